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
from urllib.parse import unquote, urlsplit

import pytest
from paths import ROOT

DOCS = ROOT / "docs"
PACKAGES = (ROOT / "solver" / "ballscrew_tehl", ROOT / "fmu_src" / "ballscrew_fmu")
#: elements whose address a browser fetches by itself
FETCHED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src", "video": "src"}


class Page(HTMLParser):
    """Text, anchors and addresses of a page: (element, address)."""

    def __init__(self, text):
        super().__init__()
        self.text, self.anchors, self.addresses = text, set(), []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.anchors |= {given[key] for key in ("id", "name") if given.get(key)}
        self.addresses += [(tag, given[key]) for key in ("href", "src") if given.get(key)]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Folder and pages of the built site. The report in it has tests of its own: here it is a short page."""
    folder = tmp_path_factory.mktemp("site")
    report = folder / "report.html"
    report.write_text("<!doctype html><title>report</title>", encoding="utf-8")
    command = ["-m", "mkdocs", "build", "--strict", "-f", "docs/site/mkdocs.yml", "-d", str(folder / "site")]
    # the first is an advertisement of the theme; signatures on one line need no formatter for each
    small = {"NO_MKDOCS_2_WARNING": "1", "DOCS_SIGNATURES": "false", "DOCS_REPORT": str(report)}
    run = subprocess.run(
        [sys.executable, *command],
        cwd=ROOT,
        env=os.environ | small,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert "WARNING" not in run.stdout + run.stderr
    return {
        path: Page(path.read_text(encoding="utf-8")) for path in sorted((folder / "site").rglob("*.html"))
    }


@pytest.mark.slow
def test_links_lead_to_files_and_anchors(site):
    broken, checked = [], 0
    for path, page in site.items():
        if path.name == "404.html":  # shown at any address: its links begin at the root of a server
            continue
        for _, address in page.addresses:
            parts = urlsplit(address)
            if parts.scheme in ("http", "https", "data", "mailto"):
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            anchor = unquote(parts.fragment) if target.suffix == ".html" else ""
            checked += 1
            if not target.is_file() or (anchor and anchor not in site[target].anchors):
                broken.append(f"{path.name}: {address}")
    assert checked > 1000
    assert broken == []


@pytest.mark.slow
def test_nothing_is_fetched_from_the_network(site):
    remote = re.compile(r"(https?:)?//")
    fetched = [a for page in site.values() for tag, a in page.addresses if tag in FETCHED and remote.match(a)]
    assert fetched == []
    styles = list(next(iter(site)).parent.rglob("*.css"))
    assert styles
    for style in styles:
        assert not re.search(r"(@import|url\()\s*[\"']?(https?:)?//", style.read_text(encoding="utf-8"))
    # the theme fetches a program where a page has a drawing, and one for formulas that are not MathML
    assert [page for page in site.values() if re.search('class="(mermaid|arithmatex)"', page.text)] == []


def documented(tree, prefix):
    """Public functions and classes of a module, and the methods that its classes define: (name, node)."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield f"{prefix}.{node.name}", node
            if isinstance(node, ast.ClassDef):
                yield from documented(node, f"{prefix}.{node.name}")


def modules():
    """Name and tree of every module of the packages."""
    for package in PACKAGES:
        for path in sorted(package.rglob("*.py")):
            if "native" not in path.relative_to(package).parts:
                name = ".".join(path.relative_to(package.parent).with_suffix("").parts)
                yield name, ast.parse(path.read_text(encoding="utf-8"))


@pytest.mark.slow
def test_reference_formulas_and_validation_are_complete(site):
    from ballscrew_tehl.nut_map.file import load_map
    from ballscrew_tehl.parameters.file import load_parameters
    from ballscrew_tehl.validation.tables import validation_tables

    reference = [page for path, page in site.items() if path.parent.name == "reference"]
    anchors = {html.unescape(anchor) for page in reference for anchor in page.anchors}
    names = {
        name
        for module, tree in modules()
        if not module.endswith(("__init__", "__main__"))
        for name in (module, *(name for name, _ in documented(tree, module)))
    }
    assert len(names) > 500
    assert names - anchors == set()

    pages = {path.name: page.text for path, page in site.items()}
    source, blocks = re.subn(r"\$\$[^$]+\$\$", "", (DOCS / "theory.md").read_text(encoding="utf-8"))
    assert pages["theory.html"].count("<math") == blocks + len(re.findall(r"\$[^$]+\$", source)) > 50

    screw = load_map(None, load_parameters())
    for table in validation_tables(lambda *point: float(screw.evaluate(*point).friction_torque)):
        assert f"{100.0 * table.deviations[0]:.2f} %" in pages["validation.html"]
        assert table.title in pages["validation.html"]


def test_every_example_has_its_picture():
    text = (DOCS / "script_the_fmu.md").read_text(encoding="utf-8")
    shown = dict(re.findall(r"!\[[^\]]{20,}\]\(([\w/]+\.png)\)\n\n`python examples/(\w+)\.py`", text))
    scripts = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "examples").glob("*.py")}
    drawn = {name for name, script in scripts.items() if "def plot(" in script and '"__main__"' in script}
    assert set(shown.values()) == drawn
    assert all((DOCS / picture).read_bytes().startswith(b"\x89PNG") for picture in shown)


def test_docstrings_keep_every_word():
    """All words of every docstring, in their order, and none besides the markup."""
    spec = importlib.util.spec_from_file_location("docstrings", DOCS / "site" / "docstrings.py")
    docstrings = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(docstrings)
    result = doctest.testmod(docstrings)
    assert (result.attempted >= 3, result.failed) == (True, 0)

    def words(text):
        return re.findall(r"[A-Za-z0-9]+", html.unescape(text))

    for name, tree in modules():
        for _, node in [(name, tree), *documented(tree, name)]:
            if text := ast.get_docstring(node):
                made = re.sub(r"^```(text|pycon|python)$", "", docstrings.markdown(text), flags=re.MULTILINE)
                assert words(made) == words(text), f"{name}: {getattr(node, 'name', '')}"
