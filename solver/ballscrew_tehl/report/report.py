"""The report on one screw as an HTML page."""

from .._version import __version__
from . import figures
from . import report_tables as tables
from .data import ReportData
from .page import MACROS, Html, certificate_table, page, section


def report_page(data: ReportData, live: Html | None = None) -> str:
    """The page; live: fragment that computes the torque in the browser, shown first; made by ballscrew_fmu."""
    certificate = certificate_table(data.nut_map.header["certificate"])
    sections = [] if live is None else [("live", "Live", section("live", "Torque of this screw, live", live))]
    for name, link, title, content in (
        ("screw", "Screw", "The screw and its oil", MACROS.screw(data, tables)),
        ("torque", "Torque", "Torque over speed, temperature and preload", MACROS.torque(data, tables, figures)),
        ("film", "Film", "Film thickness and lambda", MACROS.film(data, tables, figures)),
        ("limits", "Limits", "What is not included, range and accuracy", MACROS.limits(data, tables, certificate)),
    ):  # fmt: skip
        sections.append((name, link, section(name, title, content)))
    title = f"Friction of the ball screw {data.parameters.name}"
    footer = Html("<span>ballscrew_tehl {}</span>").format(__version__)
    return page(title, [MACROS.intro(data, tables)], sections, footer)
