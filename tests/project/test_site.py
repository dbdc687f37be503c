"""The documentation site: builds without a warning, links lead somewhere, no network is needed, nothing is missing."""

import re
from urllib.parse import unquote, urlsplit

import pytest
from lxml import html
from processes import output

REMOTE = re.compile(r"(https?:)?//|data:|mailto:")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Pages of the built site. Report and live page have tests of their own: here they are one short page."""
    folder = tmp_path_factory.mktemp("site")
    short = folder / "short.html"
    short.write_text("<!doctype html><title>short</title>", encoding="utf-8")
    command = ["-m", "mkdocs", "build", "--strict", "-f", "docs/site/mkdocs.yml", "-d", str(folder / "site")]
    # the first is an advertisement of the theme; signatures on one line need no formatter for each
    output(*command, NO_MKDOCS_2_WARNING="1", DOCS_SIGNATURES="false", DOCS_REPORT=short, DOCS_LIVE=short)
    return {
        path: html.document_fromstring(path.read_bytes())
        for path in sorted((folder / "site").rglob("*.html"))
    }


@pytest.mark.slow
def test_links_lead_to_files_and_anchors_and_nothing_is_fetched(site):
    broken, checked = [], 0
    anchors = {path: set(page.xpath("//@id|//@name")) for path, page in site.items()}
    for path, page in site.items():
        for address in page.xpath("//@href|//@src"):
            parts, tag = urlsplit(address), address.getparent().tag
            if REMOTE.match(address):
                assert tag == "a" or address.startswith("data:"), f"{path.name}: {address} is fetched"
            elif path.name != "404.html":  # shown at any address: its links begin at the root of a server
                target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
                anchor = unquote(parts.fragment) if target.suffix == ".html" else ""
                checked += 1
                if not target.is_file() or (anchor and anchor not in anchors[target]):
                    broken.append(f"{path.name}: {address}")
    assert (broken, checked > 1000) == ([], True)
    # the theme fetches a program where a page has a drawing, and one for formulas that are not MathML
    drawn = "//*[@class='mermaid' or @class='arithmatex']"
    assert [path for path, page in site.items() if page.xpath(drawn)] == []
