"""The documentation site: builds without a warning, links lead somewhere, no network is needed, nothing is missing."""

import ast
import html
import importlib.util
import re
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit

import pytest
from paths import ROOT
from processes import output

DOCS = ROOT / "docs"
PACKAGES = (ROOT / "solver" / "ballscrew_tehl", ROOT / "fmu_src" / "ballscrew_fmu")
REMOTE = re.compile(r"(https?:)?//|data:|mailto:")


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
    """Pages of the built site. The report in it has tests of its own: here it is a short page."""
    folder = tmp_path_factory.mktemp("site")
    report = folder / "report.html"
    report.write_text("<!doctype html><title>report</title>", encoding="utf-8")
    command = ["-m", "mkdocs", "build", "--strict", "-f", "docs/site/mkdocs.yml", "-d", str(folder / "site")]
    # the first is an advertisement of the theme; signatures on one line need no formatter for each
    output(*command, NO_MKDOCS_2_WARNING="1", DOCS_SIGNATURES="false", DOCS_REPORT=str(report))
    return {
        path: Page(path.read_text(encoding="utf-8")) for path in sorted((folder / "site").rglob("*.html"))
    }


@pytest.mark.slow
def test_links_lead_to_files_and_anchors_and_nothing_is_fetched(site):
    broken, checked = [], 0
    for path, page in site.items():
        for tag, address in page.addresses:
            parts = urlsplit(address)
            if REMOTE.match(address):
                assert tag == "a" or address.startswith("data:"), f"{path.name}: {address} is fetched"
            elif path.name != "404.html":  # shown at any address: its links begin at the root of a server
                target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
                anchor = unquote(parts.fragment) if target.suffix == ".html" else ""
                checked += 1
                if not target.is_file() or (anchor and anchor not in site[target].anchors):
                    broken.append(f"{path.name}: {address}")
    assert (broken, checked > 1000) == ([], True)
    styles = list(next(iter(site)).parent.rglob("*.css"))
    assert styles
    for style in styles:
        assert not re.search(r"(@import|url\()\s*[\"']?(https?:)?//", style.read_text(encoding="utf-8"))
    # the theme fetches a program where a page has a drawing, and one for formulas that are not MathML
    assert [path for path, page in site.items() if re.search('class="(mermaid|arithmatex)"', page.text)] == []


def documented(node, name):
    """A module, its public functions and classes, and the methods that its classes define: (name, node)."""
    yield name, node
    for child in () if isinstance(node, ast.FunctionDef) else node.body:
        if isinstance(child, ast.FunctionDef | ast.ClassDef) and not child.name.startswith("_"):
            yield from documented(child, f"{name}.{child.name}")


def public():
    """All that may be imported."""
    for package in PACKAGES:
        for path in sorted(package.rglob("[!_]*.py")):
            if "native" not in path.relative_to(package).parts:
                name = ".".join(path.relative_to(package.parent).with_suffix("").parts)
                yield from documented(ast.parse(path.read_text(encoding="utf-8")), name)


@pytest.mark.slow
def test_reference_formulas_and_validation_are_complete(site):
    reference = [page for path, page in site.items() if path.parent.name == "reference"]
    anchors = {html.unescape(anchor) for page in reference for anchor in page.anchors}
    names = {name for name, _ in public()}
    assert (names - anchors, len(names) > 500) == (set(), True)
    pages = {path.name: page.text for path, page in site.items()}
    source, blocks = re.subn(r"\$\$[^$]+\$\$", "", (DOCS / "theory.md").read_text(encoding="utf-8"))
    assert pages["theory.html"].count("<math") == blocks + len(re.findall(r"\$[^$]+\$", source)) > 50
    # the table of README.md is the one that `validate` prints, which is on the page of the validation
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (Table \d: [^|]*)((?:\| [\d.]+ % ){4})\|$", readme, re.MULTILINE)
    printed = re.split("<strong>(?=Table)", pages["validation.html"])[1 : 1 + len(rows)]
    assert len(rows) == 3
    for (title, values), table in zip(rows, printed, strict=True):
        assert table.startswith(title.strip())
        means = re.findall(r">([\d.]+ %)<", table.partition("mean deviation")[2])[:4]
        assert means == re.findall(r"[\d.]+ %", values)


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
    for name, node in public():
        text = ast.get_docstring(node) or ""
        made = re.sub(r"^```(text|pycon|python)$", "", docstrings.markdown(text), flags=re.MULTILINE)
        new, old = (re.findall(r"[A-Za-z0-9]+", html.unescape(words)) for words in (made, text))
        assert new == old, name
