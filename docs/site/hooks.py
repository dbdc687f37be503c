"""Pages that mkdocs builds from other sources of the project, and formulas as MathML.

index.md from README.md, changes.md from CHANGELOG.md, the tables of validation.md from examples/paper,
the errata of theory.md from their CSV, report.html and live.html from the commands `report` and `page`,
notebooks/*.md from the notebooks with the outputs stored in them.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pandas as pd
from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAPER = ROOT / "examples" / "paper"
PACKAGES = (ROOT / "solver", ROOT / "fmu_src")
#: results of commands that take minutes, by what they depend on
CACHE = ROOT / "build" / "docs_cache"
NOTEBOOK_LINK = re.compile(r"\]\(([\w/.]+)\.ipynb\)")
ERRATA_LINK = re.compile(r"^Table of the errata: .*$", re.MULTILINE)
PICTURE = re.compile(r'<img [^>]*src="([^"]+\.png)"[^>]*/?>')
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the pages that are made here."""
    config.extra["validation_tables"] = validation()
    pages: dict[str, str | bytes] = {
        "index.md": moved((ROOT / "README.md").read_text(encoding="utf-8")),
        "changes.md": moved((ROOT / "CHANGELOG.md").read_text(encoding="utf-8")),
        "reference.md": (DOCS / "site" / "reference.md").read_text(encoding="utf-8"),
        "report.html": made("report", "ballscrew_fmu.command", "report"),
        "live.html": made("live", "ballscrew_fmu", "page", "--friction", "mechanistic"),
    }
    for path in sorted((DOCS / "notebooks").glob("*.ipynb")):
        pages |= notebook(path)
    for name, content in pages.items():
        files.append(File.generated(config, name, content=content))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, **_: Any) -> str:
    """Tables of validation.md, errata of theory.md for the link to them; links to notebooks lead to their pages."""
    if page.file.src_uri == "validation.md":
        markdown += config.extra["validation_tables"]
    markdown = ERRATA_LINK.sub(lambda _: errata_markdown(), markdown)
    if page.file.src_uri.startswith("notebooks/"):
        return markdown
    return NOTEBOOK_LINK.sub(r"](\1.md)", markdown)


def errata_markdown() -> str:
    """Table of the errata."""
    found = pd.read_csv(PAPER / "zhao2023_errata.csv", comment="#", dtype=str, keep_default_na=False)
    rows = [list(found), ["---"] * 4, *found.values]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def moved(text: str) -> str:
    """A page of the top folder, with its links as seen from docs."""
    return re.sub(r"\]\(docs/", "](", text)


def on_page_content(content: str, **_: Any) -> str:
    """Formulas as MathML, which browsers show without a script; pictures lead to their full size."""

    def formula(found: re.Match[str]) -> str:
        block = found[1] == "div"
        made = convert(html.unescape(found[2]).strip(), display="block" if block else "inline")
        return f'<div class="formula">{made}</div>' if block else made

    return PICTURE.sub(r'<a href="\1" title="full size">\g<0></a>', FORMULA.sub(formula, content))


def run(*words: str) -> str:
    """What Python prints for a script or module of the packages."""
    path = os.pathsep.join([*map(str, PACKAGES), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = os.environ | {"PYTHONPATH": path, "MPLBACKEND": "Agg"}
    done = subprocess.run(
        [sys.executable, *words], env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)}: exit code {done.returncode}\n{done.stderr[-2000:]}")
    return done.stdout


def made(name: str, package: str, *arguments: str) -> bytes:
    """The page that a command writes, made again when a package changes; or the file DOCS_REPORT, DOCS_LIVE."""
    if given := os.environ.get(f"DOCS_{name.upper()}"):
        return Path(given).read_bytes()
    digest = hashlib.sha256()
    for folder in PACKAGES:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and path.parent.name != "__pycache__":
                digest.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    stored = CACHE / f"{name}_{digest.hexdigest()[:16]}.html"
    if not stored.exists():
        CACHE.mkdir(parents=True, exist_ok=True)
        for old in CACHE.glob(f"{name}_*"):
            old.unlink()
        run("-m", package, *arguments, "--output", str(stored))
    return stored.read_bytes()


def validation() -> str:
    """Tables of the laws and of the paper."""
    head = "\n\nThe packaged screw: [report of this version](report.html).\n\n"
    return head + run(str(PAPER / "measured_torques.py"))


def text_of(value: str | list[str]) -> str:
    """Text of a notebook, which may be stored by lines."""
    return value if isinstance(value, str) else "".join(value)


def notebook(path: Path) -> dict[str, str | bytes]:
    """A notebook as a page: its cells and their stored outputs."""
    name = f"notebooks/{path.stem}"
    parts, pictures = [], {}
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        source = text_of(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(NOTEBOOK_LINK.sub(r"](\1.md)", source))
            continue
        parts.append(f"```python\n{source}\n```")
        for output in cell["outputs"]:
            data = output.get("data", {})
            if "image/png" in data:
                picture = f"{name}_{len(pictures)}.png"
                pictures[picture] = base64.b64decode(text_of(data["image/png"]))
                parts.append(f"![Figure {len(pictures)} of this notebook]({Path(picture).name})")
            elif shown := text_of(output.get("text", data.get("text/plain", ""))):
                parts.append(f"```text\n{shown.rstrip()}\n```")
    parts.insert(
        1, f"(The notebook: [{path.name}]({path.name}). A test runs it; the outputs are stored in it.)"
    )
    return {f"{name}.md": "\n\n".join(parts) + "\n", **pictures}
