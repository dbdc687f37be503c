"""Elements of the pages from templates/page.html, escaped unless they are Html, and the whole page."""

from collections.abc import Sequence
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup as Html


def environment(package: str) -> Environment:
    """Templates of a room, escaped; a name that is not given is an error."""
    return Environment(
        loader=PackageLoader(package), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip


TEMPLATES = environment("ballscrew_tehl.report")
MACROS: Any = TEMPLATES.get_template("page.html").module


def element(name: str, *content: Any, **attributes: str) -> Html:
    """<name attributes>content</name>; class_ for class."""
    given = Html().join(Html(' {}="{}"').format(key.rstrip("_"), text) for key, text in attributes.items())
    return Html("<{0}{1}>{2}</{0}>").format(name, given, Html().join(content))


def section(name: str, title: str, *content: Html) -> Html:
    """A part of the page."""
    return element("section", element("h2", title), *(part + "\n" for part in content), id=name)


def table(
    name: str, caption: str, head: Sequence[Any], rows: Sequence[Sequence[Any]], text: bool = False
) -> Html:
    """A table that scrolls if it is too wide; text: words, not numbers."""
    return MACROS.table(name, caption, head, rows, text)


def page(title: str, intro: Sequence[Html], sections: Sequence[tuple[str, str, Html]], footer: Html) -> str:
    """The whole page; sections: name, title, content."""
    return str(MACROS.page(title, Html().join(intro), sections, footer))
