"""What the commands read: screw, map and friction set of the options, operating points of options or a CSV file."""

import math
import re
from argparse import Namespace
from collections.abc import Mapping, Sequence
from typing import Any

from ballscrew_tehl.applications.screw_model import ScrewModel, screw_model
from ballscrew_tehl.applications.tables.csv_file import open_table, read_columns
from ballscrew_tehl.applications.tables.headings import MEASURED, Kind
from ballscrew_tehl.parameters.units import SHOWN
from ballscrew_tehl.runtime.evaluate import NutMap

from ...quantities import DIFFERENCE, TORQUE_POINT, Quantity
from .output import QUIET, check_output, progress_bar, say


def chosen_of(args: Namespace) -> ScrewModel:
    """Screw and friction set selected by the options INPUTS."""
    chosen = screw_model(args.screw, args.map, args.friction, args.temperature_tolerance_k)
    for note in chosen.notes:
        say(note)
    return chosen


def map_of(chosen: ScrewModel) -> NutMap:
    """Its map, with progress where it is made now."""
    with progress_bar(QUIET) as progress:
        return chosen.nut_map(progress)


def read_points(args: Namespace, quantities: Sequence[Quantity]) -> list[dict[str, float]]:
    """The operating points by name: a field of --points, else an option, else a default; one point without --points."""
    check_rows(args)
    rows: list[dict[str, str]] = [{}] if args.points is None else _rows(args, quantities)
    for one in quantities:
        value = getattr(args, one.name)
        if value is not None and all(row.get(one.name) for row in rows):
            raise ValueError(f"{one.option} = {value:g}, {args.points} has this column in all rows; drop one")
    return [
        {quantity.name: _value(args, number, row, quantity) for quantity in quantities}
        for number, row in enumerate(rows, start=1)
    ]


def check_rows(args: Namespace) -> None:
    """Refuse an --output that could not be written."""
    if args.output:
        inputs = args.points, args.screw, getattr(args, "map", None)
        check_output("--output", args.output, "a file *.csv", inputs)


def _rows(args: Namespace, quantities: Sequence[Quantity]) -> list[dict[str, str]]:
    """Rows of --points by name in the units of the options, under headings as `calibrate` reads them."""
    headings = {quantity.axis: MEASURED[quantity.axis] for quantity in quantities}
    example = ", ".join(quantity.name for quantity in quantities)
    kind = Kind(headings, {"of the point": tuple(headings)}, example)
    table = open_table(args.points, kind)
    used = table.single_columns([q.axis for q in quantities if getattr(args, q.name) is not None])
    rows, fields = read_columns(table, used, kind), {}
    if any(re.match(r"\s*temperature_difference", text) for text in table.headings):
        option = DIFFERENCE.option
        raise ValueError(
            f"{args.points}: a column of temperature_difference; allowed: {option}, for all rows"
        )
    for note in (table.unused(used), *rows.notes):
        if note:
            say(f"{args.points}: {note}")
    for name, axis in ((quantity.name, quantity.axis) for quantity in quantities if quantity.axis in used):
        # a field that is no number is refused by its text; digits: without those of the units
        fields[name] = [
            text if math.isnan(value) else f"{SHOWN[axis].of(value):.13g}"
            for text, value in zip(rows.texts[axis], rows.values[axis].tolist(), strict=True)
        ]
    return [dict(zip(fields, row, strict=True)) for row in zip(*fields.values(), strict=True)]


def _value(args: Namespace, number: int, row: Mapping[str, str], quantity: Quantity) -> float:
    """Value of a row, from 1, or of the options."""
    where = f"{args.points}: row {number}: {quantity.name}"
    if text := row.get(quantity.name):
        return quantity(text, where)
    value: float | None = getattr(args, quantity.name)
    value = quantity.default if value is None else value
    if value is not None:
        return value
    remedy = f"in a column or by {quantity.option}"
    if args.points is None:
        where, remedy = quantity.option, "or --points FILE.csv"
    raise ValueError(f"{where} (missing); allowed: {quantity.allowed}, {remedy}")


def some_of(some: Sequence[Any], results: Sequence[Any]) -> str:
    """How many of several results a line is about; "" of a single one."""
    return "" if len(results) == 1 else f"{len(some)} of {len(results)} points, the first: "


def say_outside(results: Sequence[dict[str, Any]], axes: Mapping[str, Any]) -> None:
    """One line on stderr about answers beyond a map, with the first of them, and a key in each; axes: of its header."""
    if not (outside := [result for result in results if result["clamped"]]):
        return
    first, keys = outside[0], {quantity.axis: quantity.name for quantity in TORQUE_POINT}
    if "preload_actual_n" in first:
        keys["preload"] = "preload_actual_n"
    clamped = [keys.get(name, name) for name in first["clamped"]]
    values = ", ".join(f"{key} {first[key]:g}" if key in keys.values() else key for key in clamped)
    # below its lowest preload a map continues by power laws
    light = clamped == ["preload_n"] and first["preload_n"] < axes["preload"][0]
    edge = "extrapolated from its lowest preload" if light else "those at its edge"
    for result in outside:
        result["range_note"] = (
            "outside the map: the numbers and the interval are those of its edge or extrapolated"
        )
    say(
        f"in_range: false; {some_of(outside, results)}{values} is outside the map, the numbers are {edge} (ranges: "
        "ballscrew map info; a larger map: ballscrew map build; without a map: ballscrew torque --direct)"
    )


#: end of a key, its unit, by names of numbers; others are pure numbers
_NAMES = {
    "n": "nut_force_a nut_force_b separation_load ball_load_max static_load_rating dynamic_load_rating traction_force "
    "traction_force_1 traction_force_2",
    "m": "film_thickness_min film_thickness_central_screw film_thickness_central_nut h_c h_m axial_deflection "
    "lost_motion",
    "k": "film_temperature_rise temperature_rise temperature_rise_mean temperature_rise_smooth",
    "pa": "contact_pressure_max p_max",
    "w": "rolling_loss",
    "n_per_m": "axial_stiffness",
    "nm": "catalogue_torque",
}
_KEYS = {name: f"{name}_{unit}" for unit, names in _NAMES.items() for name in names.split()}


def key_of(name: str) -> str:
    """Key of a number of a result, with its unit at the end."""
    return _KEYS.get(name, name)
