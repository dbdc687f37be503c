"""Tables of the page on the map: its range, and what is extrapolated or marked."""

from __future__ import annotations

import numpy as np

from ..friction.origin import carried_over
from ..nut_map.trend import MIN_FORCE_RATIO
from ..parameters.file import FOUR_POINT
from ..parameters.units import SHOWN
from ..physics.ball_formula import MIN_FILM, THICKEST_FILM
from ..runtime.packed import MECHANISTIC
from .material import Material
from .page import Html, table


def axes(material: Material) -> Html:
    """Range of the map."""
    ends = material.picture.nut_map.header["axes"]
    rows = [
        [
            name,
            *(f"{round(shown.of(end), 3):.6g} {shown.unit}" for end in ends[name][:2]),
            f"{ends[name][2]:.0f}",
        ]
        for name, shown in SHOWN.items()
        if name != "share"
    ]
    return table("axes", "Range of the map", ["axis (force: of one nut)", "from", "to", "nodes"], rows)


def limits(material: Material) -> Html:
    """What of the map and of this page is not interpolated between solved contacts, or carries a mark."""
    header = material.picture.nut_map.header
    rows = [
        ("beyond the range", "values at its edge are given and marked as out of range (in_range false)"),
        ("inside the atlas of contacts", f"{100.0 * header['atlas_fraction']:.4g} % of the contacts; beyond it they "
         "keep their ratio to the closed forms"),
    ]  # fmt: skip
    rows += _marks(material)
    if material.parameters.screw.preload_kind == FOUR_POINT and material.chosen.nut_map.law == MECHANISTIC:
        rows.append(
            (
                "oversize balls under axial load",
                f"torque and efficiency are some 10 % less certain from a force ratio of both sets of flanks of "
                f"{MIN_FORCE_RATIO:g} to separation; the command torque marks such points (unlike_flanks)",
            )
        )
    if other := carried_over(material.chosen.entry, material.parameters):
        rows.append(("friction numbers", other))
    return table("limits", "What is extrapolated or marked", ("", ""), rows, text=True)


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def _marks(material: Material) -> list[tuple[str, str]]:
    """Marks on the lines of this page."""
    lines, state = material.lines, material.lines.films.state
    shares = {
        "over speed": lines.over_speed,
        "over speed by temperature": lines.by_temperature,
        "over preload": lines.over_preload,
        "over temperature": lines.over_temperature,
    }
    found = [
        f"{_percent(share)} of those {name}"
        for name, of in shares.items()
        if (share := float(np.mean(of.marked.unphysical))) > 0.0
    ]
    rows = [("dashed lines of torque", ", ".join(found) or "none")]
    thin = float(np.mean(state.film_thickness_min < MIN_FILM))
    if thin > 0.0:
        rows.append(("films below a nanometre", f"{_percent(thin)} of the lines of the film, thinner than "
                     "the contacts of the atlas"))  # fmt: skip
    thick = THICKEST_FILM * 0.5 * material.parameters.screw.ball_diameter
    central = np.maximum(state.film_thickness_central_screw, state.film_thickness_central_nut)
    share = float(np.mean(central > thick))
    if share > 0.0:
        rows.append(("films above a tenth of the ball radius", f"{_percent(share)} of the lines of the film; the "
                     "rolling loss is a closed form there"))  # fmt: skip
    beyond = float(np.mean(np.isnan(material.screw.driving[:, 1:])))
    if beyond > 0.0:
        rows.append(("efficiency", f"not drawn at {_percent(beyond)} of its loads, where the force of a nut leaves "
                     "the map"))  # fmt: skip
    return rows
