"""Elements of the pages from templates/page.html, escaped unless they are Html, the whole page, and that of a screw."""

from collections.abc import Mapping, Sequence
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup as Html

from ballscrew_tehl._version import __version__
from ballscrew_tehl.refinement.certificate import claim

from .data import ReportData

#: errors of a certificate by name, and their mean and quantiles by the ends of their keys, with their headings
ERRORS = {"torque": "friction torque", "film": "central film", "temperature_rise": "temperature rise"}
COLUMNS = {"mean": "mean", "50": "median", "99": "99 % quantile", "999": "99.9 % quantile", "max": "largest"}


def environment(package: str) -> Environment:
    """Templates of a room, escaped; a name that is not given is an error."""
    return Environment(
        loader=PackageLoader(package), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip


TEMPLATES = environment("ballscrew_tehl.applications.report")
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


def certificate_table(certificate: Mapping[str, Any]) -> Html:
    """Errors of a map against direct solves: mean, quantiles and largest of each quantity."""
    if "points" not in certificate:
        return element("p", "The map has no certificate.", class_="note")
    rows = []
    for name, quantity in ERRORS.items():
        errors = (certificate.get(f"{name}_error_{key}") for key in COLUMNS)
        # two digits
        texts = ("-" if error is None else f"{float(f'{100.0 * error:.2g}'):g} %" for error in errors)
        rows.append([quantity, *texts])
    caption = (
        f"Certificate: error at {certificate['points']} points of {certificate['what']}, compared with direct solves "
        "of the balls"
    )
    if certificate.get("points_not_solved"):
        caption += f"; {certificate['points_not_solved']} more were not solved"
    caption += f". {claim(certificate['points'])}"
    return table("certificate", caption, ["", *COLUMNS.values()], rows)


def report_page(data: ReportData, live: Html | None = None) -> str:
    """The report on one screw; live: fragment that computes the torque in the browser, shown first."""
    from . import figures
    from . import report_tables as tables

    certificate = certificate_table(data.nut_map.header["certificate"])
    sections = [] if live is None else [("live", "Live", section("live", "Torque of this screw, live", live))]
    for name, link, title, content in (
        ("screw", "Screw", "The screw and its oil", MACROS.screw(data, tables)),
        ("torque", "Torque", "Torque over speed, temperature and preload", MACROS.torque(data, tables, figures)),
        ("film", "Film", "Film thickness and lambda", MACROS.film(data, tables, figures)),
        *([("axis", "Axis", "The whole axis", MACROS.axis(data, tables, figures))] if data.budget else []),
        ("limits", "Limits", "What is not included, range and accuracy", MACROS.limits(data, tables, certificate)),
    ):  # fmt: skip
        sections.append((name, link, section(name, title, content)))
    title = f"Friction of {data.parameters.name}"
    footer = Html("<span>ballscrew_tehl {}</span>").format(__version__)
    return page(title, [MACROS.intro(data, tables)], sections, footer)
