"""The documentation site: builds without a warning, links lead somewhere, no network is needed, nothing is missing."""

import ast
import doctest
import html
import importlib.util
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote, urlsplit

import pytest
from mkdocs.utils import yaml_load
from paths import ROOT

DOCS = ROOT / "docs"
SITE = DOCS / "site"
PACKAGES = (ROOT / "solver" / "ballscrew_tehl", ROOT / "fmu_src" / "ballscrew_fmu")
#: elements whose address a browser fetches by itself
FETCHED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src", "video": "src"}


def load(name):
    """A module of docs/site."""
    spec = importlib.util.spec_from_file_location(f"site_{name}", SITE / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Page(HTMLParser):
    """Anchors and addresses of a page: (element, address)."""

    def __init__(self, text):
        super().__init__()
        self.anchors, self.addresses = set(), []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.anchors |= {given[key] for key in ("id", "name") if given.get(key)}
        self.addresses += [(tag, given[key]) for key in ("href", "src") if given.get(key)]


class Site(NamedTuple):
    folder: Path
    printed: str
    pages: dict[Path, Page]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site. The report in it is kept in build/docs_cache until the package changes."""
    folder = tmp_path_factory.mktemp("site") / "site"
    command = ["-m", "mkdocs", "build", "--strict", "-f", "docs/site/mkdocs.yml", "-d", str(folder)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}  # an advertisement of the theme, not of the pages
    run = subprocess.run(
        [sys.executable, *command], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(folder.rglob("*.html"))}
    return Site(folder, run.stdout + run.stderr, pages)


@pytest.mark.slow
def test_site_builds_without_a_warning(site):
    assert "WARNING" not in site.printed
    assert len(site.pages) > 30


@pytest.mark.slow
def test_links_lead_to_files_and_anchors(site):
    broken, checked = [], 0
    for path, page in site.pages.items():
        if path.name == "404.html":  # shown at any address: its links begin at the root of a server
            continue
        for _, address in page.addresses:
            parts = urlsplit(address)
            if parts.scheme in ("http", "https", "data", "mailto"):
                assert parts.scheme not in ("http", "https") or "." in parts.netloc, address
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            anchors = site.pages[target].anchors if target in site.pages else set()
            checked += 1
            if not target.is_file() or (
                parts.fragment and target.suffix == ".html" and unquote(parts.fragment) not in anchors
            ):
                broken.append(f"{path.relative_to(site.folder)}: {address}")
    assert checked > 1000
    assert broken == []


@pytest.mark.slow
def test_nothing_is_fetched_from_the_network(site):
    fetched = [
        f"{path.name}: {address}"
        for path, page in site.pages.items()
        for tag, address in page.addresses
        if tag in FETCHED and re.match(r"(https?:)?//", address)
    ]
    styles = [path.read_text(encoding="utf-8") for path in site.folder.rglob("*.css")]
    assert fetched == []
    assert styles
    assert not any(re.search(r"(@import|url\()\s*[\"']?(https?:)?//", style) for style in styles)
    # the theme fetches a drawing program where a page has such a drawing
    assert not any('class="mermaid"' in path.read_text(encoding="utf-8") for path in site.pages)


def defined(tree, prefix):
    """Public functions and classes of a module, and the methods that its classes define."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield f"{prefix}.{node.name}"
            if isinstance(node, ast.ClassDef):
                yield from defined(node, f"{prefix}.{node.name}")


def public_names():
    """All that may be imported, by its full name."""
    for package in PACKAGES:
        for path in sorted(package.rglob("*.py")):
            module = ".".join(path.relative_to(package.parent).with_suffix("").parts)
            if path.name not in ("__init__.py", "__main__.py") and "native" not in path.parts:
                yield module
                yield from defined(ast.parse(path.read_text(encoding="utf-8")), module)


@pytest.mark.slow
def test_reference_has_every_public_name(site):
    anchors = {
        html.unescape(anchor)
        for path, page in site.pages.items()
        if path.parent.name == "reference"
        for anchor in page.anchors
    }
    names = set(public_names())
    assert len(names) > 1000
    assert names - anchors == set()


@pytest.mark.slow
def test_formulas_are_shown_without_a_script(site):
    theory = (site.folder / "theory.html").read_text(encoding="utf-8")
    source = (DOCS / "theory.md").read_text(encoding="utf-8")
    apart, blocks = re.subn(r"\$\$[^$]+\$\$", "", source)
    assert blocks > 10
    assert theory.count("<math") == blocks + len(re.findall(r"\$[^$]+\$", apart))
    for path in site.pages:
        assert 'class="arithmatex"' not in path.read_text(encoding="utf-8"), path.name


@pytest.mark.slow
def test_validation_page_shows_the_numbers_of_the_command(site):
    from ballscrew_tehl.nut_map.file import load_map
    from ballscrew_tehl.parameters.file import load_parameters
    from ballscrew_tehl.validation.tables import validation_tables

    screw = load_map(None, load_parameters())
    text = (site.folder / "validation.html").read_text(encoding="utf-8")
    for table in validation_tables(lambda *point: float(screw.evaluate(*point).friction_torque)):
        assert f"{100.0 * table.deviations[0]:.2f} %" in text
        assert table.title in text
    assert "What this report is about" in (site.folder / "report.html").read_text(encoding="utf-8")


def test_navigation_has_every_page():
    text = (SITE / "mkdocs.yml").read_text(encoding="utf-8")
    pages = {path.name for path in DOCS.glob("*.md")}
    pages |= {f"notebooks/{path.stem}.md" for path in (DOCS / "notebooks").glob("*.ipynb")}
    listed = re.findall(r": ([\w/]+\.md)$", text, re.MULTILINE)
    assert set(listed) == pages | {"index.md", "changes.md"}
    assert len(listed) == len(set(listed))
    assert yaml_load(text)["theme"]["font"] is False


def test_gallery_has_every_example_with_its_picture():
    text = (DOCS / "gallery.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[[^\]]{20,}\]\(([\w/]+)\.png\)\n\n`python examples/(\w+)\.py`", text)
    assert all(Path(picture).name == example for picture, example in shown)
    scripts = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "examples").glob("*.py")}
    drawn = {
        name for name, script in scripts.items() if "def plot(" in script and 'name__ == "__main__"' in script
    }
    assert {example for _, example in shown} == drawn
    for picture, _ in shown:
        assert (DOCS / f"{picture}.png").read_bytes().startswith(b"\x89PNG")


def test_every_symptom_has_an_answer():
    guide = (DOCS / "import_the_fmu.md").read_text(encoding="utf-8").partition("## Troubleshooting")[2]
    symptoms = re.findall(r"^\| (?!symptom|---)([^|]+) \|", guide, re.MULTILINE)
    headings = re.findall(r"^### (.*)$", (DOCS / "faq.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(symptoms) >= 8
    assert {s.lower() for s in symptoms} - {h.lower() for h in headings} == set()


def test_theory_lists_every_erratum_of_the_report():
    tree = ast.parse((PACKAGES[0] / "report" / "errata.py").read_text(encoding="utf-8"))
    places = [
        call.args[0].value
        for call in ast.walk(tree)
        if isinstance(call, ast.Call) and getattr(call.func, "id", "") == "Erratum"
    ]
    theory = (DOCS / "theory.md").read_text(encoding="utf-8").partition("## Errata")[2]
    rows = re.findall(r"^\| ([^|]+) \|", theory.partition("\n## ")[0], re.MULTILINE)[1:]
    assert len(places) > 15
    assert sorted(rows) == sorted(places)


def docstrings():
    for package in PACKAGES:
        for path in sorted(package.rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                documented = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
                if documented and (text := ast.get_docstring(node)):
                    yield f"{path.name}: {getattr(node, 'name', '')}", text


def test_docstrings_keep_every_word():
    """All words of every docstring, in their order, and none besides the markup."""
    markdown = load("docstrings").markdown

    def words(text):
        return re.findall(r"[A-Za-z0-9]+", text)

    checked = 0
    for where, text in docstrings():
        made = html.unescape(re.sub(r"^```(text|pycon|python)$", "", markdown(text), flags=re.MULTILINE))
        assert words(made) == words(html.unescape(text)), where
        checked += 1
    assert checked > 1000


def test_examples_of_the_docstring_reader_hold():
    result = doctest.testmod(load("docstrings"))
    assert result.attempted >= 3
    assert result.failed == 0
