"""HTML elements of a page, text is escaped unless it is Html; style for screens, phones and paper."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

STYLE = """
:root { color-scheme: light; --ink: #1a1a1a; --soft: #5a6472; --line: #d5dae0; --blue: #0b5a8c;
  --pale: #f3f6f9; }
* { box-sizing: border-box; }
body { margin: 0; color: var(--ink); background: #fff;
  font: 16px/1.55 system-ui, "Segoe UI", Roboto, Arial, sans-serif; }
main { max-width: 68rem; margin: 0 auto; padding: 1rem 1.25rem 4rem; }
h1 { font-size: clamp(1.5rem, 4.5vw, 2.2rem); line-height: 1.2; margin: 1rem 0 .5rem; }
h2 { font-size: clamp(1.25rem, 3.5vw, 1.6rem); margin: 3rem 0 .75rem; padding-top: .5rem;
  border-top: 3px solid var(--blue); }
h3 { font-size: 1.1rem; margin: 1.75rem 0 .5rem; }
p, ul { max-width: 48rem; }
.lead { color: var(--soft); font-size: 1.05rem; }
nav ul { list-style: none; margin: 1rem 0; padding: 0; display: flex; flex-wrap: wrap; gap: .35rem .9rem; }
a { color: var(--blue); }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(11rem, 1fr)); gap: .75rem;
  margin: 1.25rem 0; }
.tile { background: var(--pale); border-left: 4px solid var(--blue); padding: .6rem .9rem; }
.tile b { display: block; font-size: 1.35rem; line-height: 1.3; }
.tile span { color: var(--soft); font-size: .9rem; }
.scroll { overflow-x: auto; margin: 0 0 1.25rem; }
table { border-collapse: collapse; font-size: .92rem; font-variant-numeric: tabular-nums; min-width: 100%; }
.caption { font-weight: 600; font-size: .95rem; margin: 1.25rem 0 .25rem; max-width: none; }
th, td { padding: .35rem .6rem; border-bottom: 1px solid var(--line); text-align: right; vertical-align: top; }
th { background: var(--pale); text-align: right; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; }
table:not(.text) td:not(:first-child) { white-space: nowrap; }
table.text th, table.text td { text-align: left; }
table.text td { min-width: 6.5rem; }
table.text td.long { min-width: 13rem; }
tr.total td { font-weight: 600; border-top: 2px solid var(--ink); }
.figures > * { min-width: 0; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 26rem), 1fr));
  gap: 1rem 1.5rem; }
figure { margin: .5rem 0; }
img { width: 100%; height: auto; display: block; }
figcaption { color: var(--soft); font-size: .9rem; margin-top: .25rem; }
figure.wide { max-width: 60rem; }
.verdict { font-weight: 600; white-space: nowrap; }
.verdict::before { content: ""; display: inline-block; width: .7em; height: .7em; border-radius: 50%;
  margin-right: .4em; }
.verdict.reproduced::before { background: #009e73; }
.verdict.near::before { background: #e69f00; }
.verdict.not-reproduced::before { background: #d55e00; }
.note { background: #fff8e6; border-left: 4px solid #e69f00; padding: .5rem .9rem; max-width: 48rem; }
code { font-size: .92em; overflow-wrap: anywhere; }
footer { margin-top: 3rem; color: var(--soft); font-size: .9rem; border-top: 1px solid var(--line);
  padding-top: .75rem; }
@media (max-width: 40rem) {
  main { padding: .5rem .9rem 3rem; }
  table { font-size: .85rem; }
  th, td { padding: .3rem .45rem; }
  table.text td { min-width: 5.5rem; }
  table.text td.long { min-width: 11rem; }
  figure.wide { overflow-x: auto; }
  figure.wide img { min-width: 60rem; }
}
@media print {
  @page { margin: 15mm; }
  body { font-size: 10pt; }
  main { max-width: none; padding: 0; }
  nav { display: none; }
  h2 { break-after: avoid; margin-top: 1.5rem; }
  h3, .caption { break-after: avoid; }
  figure, tr, .tile { break-inside: avoid; }
  .figures { grid-template-columns: 1fr 1fr; }
  .scroll { overflow: visible; }
  table { font-size: 8.5pt; min-width: 0; width: 100%; }
  table.text td, table.text td.long { min-width: 0; }
  th, .tile, .note { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
"""


class Html(str):
    """Text that is HTML already."""

    __slots__ = ()


def _escaped(content: Any) -> str:
    return content if isinstance(content, Html) else html.escape(str(content))


def element(name: str, *content: Any, **attributes: str) -> Html:
    """<name attributes>content</name>; class_ for class.

    Example
        >>> element("p", "a < b", class_="note")
        '<p class="note">a &lt; b</p>'
    """
    given = "".join(f' {key.rstrip("_")}="{html.escape(value)}"' for key, value in attributes.items())
    return Html(f"<{name}{given}>{''.join(map(_escaped, content))}</{name}>")


def paragraph(*content: Any, class_: str = "") -> Html:
    """A paragraph."""
    return element("p", *content, **({"class_": class_} if class_ else {}))


def bullets(*items: Any) -> Html:
    """A list."""
    return element("ul", *(element("li", item) for item in items))


def section(name: str, title: str, *content: Html) -> Html:
    """A numbered part of the page."""
    return element("section", element("h2", title), *(Html(part + "\n") for part in content), id=name)


def figure(address: str, caption: str, wide: bool = False) -> Html:
    """An image with its caption, which is also its description."""
    image = Html(f'<img src="{address}" alt="{html.escape(caption)}">')
    return element("figure", image, element("figcaption", caption), **({"class_": "wide"} if wide else {}))


def figures(*content: Html) -> Html:
    """Figures side by side where there is room."""
    return element("div", *content, class_="figures")


def table(
    name: str,
    caption: str,
    head: Sequence[Any],
    rows: Sequence[Sequence[Any]],
    total: Sequence[Any] | None = None,
    text: bool = False,
) -> Html:
    """A table that scrolls if it is too wide; total: a last row; text: words, not numbers."""

    def row(cells: Sequence[Any], cell: str = "td", **attributes: str) -> Html:
        made = (element(cell, c, **({"class_": "long"} if text and len(str(c)) > 40 else {})) for c in cells)
        return element("tr", *made, **attributes)

    body = [row(cells) for cells in rows] + ([] if total is None else [row(total, class_="total")])
    attributes = {"id": name, "aria-label": caption} | ({"class_": "text"} if text else {})
    top = [element("thead", row(head, "th"))] if any(map(str, head)) else []
    inner = element("table", *top, element("tbody", *(Html("\n" + line) for line in body)), **attributes)
    # the caption does not scroll with the table
    title = paragraph(caption, class_="caption")
    return element("div", title, element("div", inner, class_="scroll"))


def tiles(entries: Sequence[tuple[str, str]]) -> Html:
    """Highlighted numbers with their meaning."""
    made = (
        element("div", element("b", number), element("span", what), class_="tile") for number, what in entries
    )
    return element("div", *made, class_="tiles")


def page(title: str, intro: Sequence[Html], sections: Sequence[tuple[str, str, Html]], footer: Html) -> str:
    """The whole page; sections: name, title, content."""
    links = (element("li", element("a", name, href=f"#{key}")) for key, name, _ in sections)
    main = element(
        "main", element("h1", title), *intro, element("nav", element("ul", *links)),
        *(Html("\n" + content) for _, _, content in sections), element("footer", footer),
    )  # fmt: skip
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{main}\n</body>\n</html>\n"
    )
