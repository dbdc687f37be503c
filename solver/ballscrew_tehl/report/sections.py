"""The whole page, of the paper's screw and of any other one: its parts in their order, from templates/parts.html."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from .. import __version__
from ..friction.sets import NO_SPLIT
from ..nut_map.trend import THICK
from ..parameters.units import CELSIUS, RPM
from ..physics.rating import STATIC_PRESSURE
from . import (
    contact_figures,
    figures,
    map_tables,
    screw_figures,
    screw_tables,
    tables,
    torque_tables,
)
from .lines import Progress
from .material import Material
from .page import TEMPLATES, Html, page, section

PAPER = "https://doi.org/10.1007/s00170-022-09524-2"
#: what the templates use beside the material
GLOBALS: dict[str, Any] = {
    "figures": figures,
    "screw_figures": screw_figures,
    "contact_figures": contact_figures,
    "tables": SimpleNamespace(**vars(tables) | vars(torque_tables) | vars(screw_tables) | vars(map_tables)),
    "doi": PAPER,
    "version": __version__,
    "NO_SPLIT": NO_SPLIT,
    **{"CELSIUS": CELSIUS, "RPM": RPM, "STATIC_PRESSURE": STATIC_PRESSURE, "THICK": THICK},
}
#: a step of the progress
PAGE_STEP = "parts of the page"


def parts_of_page(material: Material) -> list[tuple[str, str, str]]:
    """Macro and anchor, name in the list of links, and title of each part, in their order."""
    torque = ("torque", "Torque", "Torque over speed, preload and temperature")
    others = [
        ("balls", "Ball loads", f"Ball loads of the {material.balls.words.nut}"),
        ("contacts", "Contact", "Film, pressure and temperature of one contact"),
        ("map", "Map", "The map, its certificate and its limits"),
    ]
    if material.measured:
        return [
            ("validation", "Validation", "Validation against measured torques"),
            torque,
            ("screw", "Screw", "The screw"),
            *others,
        ]
    return [
        ("screw", "Screw", "The screw and its oil"),
        torque,
        ("film", "Film", "Film thickness and lambda"),
        *others,
        ("friction", "Friction numbers", "The friction numbers"),
    ]


def whole_page(material: Material, progress: Progress, live: Html | None = None) -> str:
    """The page with all its parts.

    Parameters   progress : called before and after each of them
                 live : fragment that computes the torque in the browser, shown first; this package cannot make it
    """
    template = TEMPLATES.get_template("parts.html", globals=GLOBALS)
    macros: Any = template.make_module({"m": material})
    parts = parts_of_page(material)
    written = [] if live is None else [("live", "Live", section("live", "Torque of this screw, live", live))]
    with figures.style():
        for number, (name, link, title) in enumerate(parts, start=1):
            progress(number - 1, len(parts), PAGE_STEP)
            written.append((name, link, section(name, f"{number} {title}", getattr(macros, name)())))
    progress(len(parts), len(parts), PAGE_STEP)
    title = f"Ball-screw friction: {material.parameters.name}"
    return page(title, [macros.intro()], written, macros.footer())
