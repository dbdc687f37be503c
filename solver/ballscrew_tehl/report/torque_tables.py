"""Tables and notes of the page on the friction torque: fitted numbers, torques, intervals, what they are."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .. import __version__
from ..friction.baselines import nsk_torque
from ..friction.origin import CATALOGUE_DIFFERS, carried_over
from ..friction.sets import FITTED, MECHANISTIC, SETS
from ..nut_map.trend import THICK
from ..parameters.units import CELSIUS, RPM
from ..physics.ball_law import Array
from .lines import Lines
from .material import Material
from .page import Html, element, table
from .tables import percent_of, validation_table, words

NAMES = {
    "apparent_viscosity_ratio": "apparent viscosity ratio",
    "net_sliding_coefficient": "net sliding coefficient",
    "roughness_height": "roughness height [nm]",
}
#: cell of a number that a set does not have
UNKNOWN = "-"
#: least share of the variance of an interval that is shown
LEAST_SHARE = 1e-3


def identity(material: Material) -> Html:
    """Screw, oil, kinematics, set, program and map."""
    parameters, header, entry = material.parameters, material.picture.nut_map.header, material.chosen.entry
    rows = [
        ("screw", parameters.name),
        ("oil", parameters.lubricant.name),
        ("kinematics", words(parameters.friction.kinematics)),
        ("friction set", f"{words(entry.name)}, film: {words(entry.film_model)}"),
        ("program", f"ballscrew_tehl {__version__}; the map was built by {header['version']}"),
        ("map", element("code", str(header["file_hash"]))),
    ]
    return table("identity", "What this report is about", ("", ""), rows, text=True)


def carried_over_note(material: Material) -> str:
    """That the friction numbers are those of another screw, and the catalogue torque; "" if they are not."""
    other = carried_over(material.chosen.entry, material.parameters)
    if not other:
        return ""
    force = material.screw.point.preload
    catalogue = float(nsk_torque(material.parameters.screw, force))
    return f"{other[0].upper()}{other[1:]}. At {force:.0f} N it is {catalogue:.3f} N m."


def validation_tables(material: Material) -> list[Html]:
    """Tables of the paper with a column per friction set."""
    chosen = material.chosen.entry.name
    others = {name: {t.name: t for t in found} for name, found in material.tables.items() if name != chosen}
    return [
        validation_table(one, chosen, {name: found[one.name] for name, found in others.items()})
        for one in material.tables[chosen]
    ]


def calibration(material: Material) -> Html:
    """Calibrated numbers with intervals and errors."""
    frictions = material.frictions
    rows: list[list[str]] = []

    def add(what: str, value: Any) -> None:
        cells = [value(friction.entry) for friction in frictions]
        if any(cell != UNKNOWN for cell in cells):
            rows.append([what, *cells])

    def fitted(key: str) -> Any:
        def text(entry: Any) -> str:
            if key not in SETS.get(entry.name, FITTED):
                return UNKNOWN
            scale = 1e9 if key == "roughness_height" else 1.0
            half = entry.intervals.get(key)
            known = "" if half is None else f" +- {scale * half:.2g}"
            return f"{scale * getattr(entry, key):.4g}{known}"

        return text

    def error(key: str) -> Any:
        return lambda entry: percent_of(entry.errors[key]) if key in entry.errors else UNKNOWN

    for key in FITTED:
        add(f"{NAMES[key]}, fitted", fitted(key))
    for key, what in (
        ("mean", "mean deviation of the points of the fit"),
        ("leave_one_out_mean", "mean deviation of points left out of the fit one at a time"),
        ("leave_one_out_max", "largest deviation of points left out of the fit one at a time"),
    ):
        add(what, error(key))
    for name in dict.fromkeys(name for f in frictions for name in f.entry.leave_one_table_out):
        add(
            f"{name.replace('table', 'Table ')} left out of the fit: mean and largest deviation",
            lambda entry, name=name: ", ".join(
                percent_of(entry.leave_one_table_out.get(name, {}).get(key, math.nan))
                for key in ("mean", "max")
            ),
        )
    head = ["", *(f"{words(f.entry.name)} (film: {words(f.entry.film_model)})" for f in frictions)]
    caption = (
        "Fitted numbers (+-: half width of the 95 % interval), deviations of points in and out of the fit"
    )
    return table("calibration", caption, head, rows)


def shares(material: Material) -> Html:
    """What contributes to the interval at the operating point."""
    found, point = material.lines.interval, material.screw.point
    if found is None or not found.shares:
        return Html()
    caption = f"Interval of the torque at {point.text}, {found.low:.3f} to {found.high:.3f} N m: what contributes to it"
    rows = [
        (words(name), f"{100.0 * share:.1f}") for name, share in found.shares.items() if share > LEAST_SHARE
    ]
    return table("shares", caption, ["constant, or error of the fit", "share of the variance [%]"], rows)


def torques(material: Material) -> Html:
    """Torques at the preloads and speeds of the lines, and the catalogue torque."""
    preloads, speeds = material.lines.over_speed.rows, material.lines.over_preload.rows
    temperature = material.lines.over_speed.fixed
    rows = []
    for preload in map(float, preloads):
        torques = (float(material.chosen.torque(preload, float(w), temperature)) for w in speeds)
        catalogue = float(nsk_torque(material.parameters.screw, preload))
        rows.append([f"{preload:.0f}", *(f"{value:.3f}" for value in (*torques, catalogue))])
    return table(
        "torques",
        f"Friction torque [N m], oil at {temperature - CELSIUS:.1f} C; out of range where its line is dashed",
        ["preload [N]", *(f"{w / RPM:.0f} r/min" for w in speeds), "catalogue"],
        rows,
    )


def catalogue_note(material: Material) -> str:
    """Why the torques of the mechanistic law differ from those of the catalogue; "" for the other law."""
    law = material.chosen.nut_map.law == MECHANISTIC
    return f"{CATALOGUE_DIFFERS[0].upper()}{CATALOGUE_DIFFERS[1:]}." if law else ""


def intervals(lines: Lines, speeds: Array) -> Html:
    """Ends of the drawn intervals at the speeds of the table of torques [rad/s]."""
    band = lines.band
    if band is None:
        return Html()
    rows = []
    for preload, *ends in zip(lines.rows, band.low, band.high, strict=True):
        low_high = zip(*(np.interp(speeds, band.x, end) for end in ends), strict=True)
        rows.append([f"{preload:.0f}", *(f"{low:.3f} to {high:.3f}" for low, high in low_high)])
    caption = f"Interval of the torque [N m] ({band.meaning}), oil at {lines.fixed - CELSIUS:.1f} C"
    return table("intervals", caption, ["preload [N]", *(f"{w / RPM:.0f} r/min" for w in speeds)], rows)


def interval_note(material: Material) -> str:
    """What the shaded intervals are."""
    band = material.lines.over_speed.band
    if band is None:
        return "No interval: this friction set was fitted to another screw or oil, its errors are not those here."
    return f"Shaded: interval of the torque, {band.meaning}."


def trend_note(material: Material) -> str:
    """Where the torque has a trend that thick flooded films do not have; "" if nowhere on the lines."""
    over = {
        "temperature": material.lines.over_temperature.marked.rises_with_temperature,
        "speed": material.lines.over_speed.marked.falls_with_speed,
    }
    if not any(np.any(found) for found in over.values()):
        return ""
    shares = {name: f"{100.0 * float(np.mean(found)):.0f} %" for name, found in over.items()}
    places = (
        f"on {shares['temperature']} of the lines over temperature",
        f"on {shares['speed']} of those over speed",
    )
    end = "Such parts of the lines are dashed. The command torque reports such points as out of range; an FMU does not."
    return (
        f"Not physical: in thick films (lambda above {THICK:g}) the torque rises with temperature {places[0]} and "
        f"falls with speed {places[1]}. {end}"
    )
