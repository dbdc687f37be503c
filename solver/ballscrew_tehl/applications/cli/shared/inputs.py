"""What the commands read: screw, map and friction set of the options, operating points of options or a CSV file."""

import math
import re
from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ballscrew_tehl.applications.published_formulas import REXROTH, rexroth_torque
from ballscrew_tehl.applications.tables.csv_file import open_table, read_columns
from ballscrew_tehl.applications.tables.headings import MEASURED, Kind
from ballscrew_tehl.friction.drag_torque import drag_torque_set, implied_preload
from ballscrew_tehl.friction.sets import (
    FrictionSet,
    catalogue_differs,
    default_friction_set,
    friction_set_of_file,
    load_friction_sets,
    refuse_other_fit,
    with_law,
    with_supply,
    without_overrides,
)
from ballscrew_tehl.parameters.file import PACKAGED_VG100, Parameters, changed, load_screw
from ballscrew_tehl.parameters.friction import PRELOAD_FORCE, Law
from ballscrew_tehl.parameters.units import SHOWN
from ballscrew_tehl.physics.rating import nsk_torque
from ballscrew_tehl.refinement.contacts import contacts_of
from ballscrew_tehl.runtime.evaluate import NutMap

from .output import QUIET, check_output, progress_bar, say
from .quantities import DIFFERENCE, TOLERANCE, TORQUE_POINT, Quantity


def screw_of(args: Namespace, default: Path | None = None) -> Parameters:
    """The parameters of --screw, else in the file of --map, else of a default or packaged file, by further options."""
    if args.screw is None and args.map is not None:
        from ballscrew_tehl.nut_map.load import screw_of_map

        parameters = screw_of_map(args.map)
    else:
        parameters = load_screw(default if args.screw is None else args.screw)
    tolerance = getattr(args, TOLERANCE.name, None)
    if tolerance is not None:
        parameters = changed(parameters, lubricant={"temperature_tolerance": tolerance})
    return parameters


class Chosen(NamedTuple):
    """Screw and friction set of the options; of_file: the set is that of a file or a drag torque, None = packaged."""

    parameters: Parameters
    friction_set: FrictionSet
    of_file: FrictionSet | None

    def nut_map(self, args: Namespace) -> NutMap:
        """The map of --map, or one made now, with the film and the numbers of the friction set."""
        from ballscrew_tehl.nut_map.load import load_map

        with progress_bar(QUIET) as progress:
            return load_map(args.map, self.parameters, self.of_file, progress)

    @property
    def described(self) -> dict[str, str]:
        """Keys of the answer: screw, oil, set, screw of the fit."""
        parameters, friction = self.parameters, self.friction_set
        return {
            "screw": parameters.name, "oil": parameters.lubricant.name, "friction_set": friction.name,
            "friction_screw": friction.screw,
        }  # fmt: skip

    def catalogue_note(self, axial_load: float) -> dict[str, str]:
        """Key that says why a torque differs from that of the catalogue."""
        notes = ["of the preload alone, without the axial load"] if axial_load else []
        notes += (
            [catalogue_differs(self.parameters.screw)] if self.friction_set.law is Law.MECHANISTIC else []
        )
        return {"catalogue_note": "; ".join(notes)} if notes else {}

    def printed(self, preload: float) -> dict[str, float]:
        """Keys of what catalogues print for a preload [N], and of the true one that a drag torque implies."""
        screw = self.parameters.screw
        formulas = {"catalogue_torque_nm": float(nsk_torque(screw, preload))}
        if screw.preload_kind in REXROTH:
            formulas["rexroth_torque_nm"] = rexroth_torque(screw, preload)
        return formulas | implied_preload(self.friction_set, preload)


def chosen_of(args: Namespace) -> Chosen:
    """Screw and friction set selected by --screw, --map and --friction."""
    packaged, name = load_friction_sets(), args.friction
    if name is None or name in packaged:
        parameters = screw_of(args, PACKAGED_VG100 if name == Law.MECHANISTIC else None)
        parameters = parameters if name is None else with_law(parameters, name)
        delivered = drag_torque_set(parameters, contacts_of)
        if delivered and not PRELOAD_FORCE.low <= delivered.preload_factor <= PRELOAD_FORCE.high:
            say(
                f"drag_torque_Nm of the screw file: the true preload is {delivered.preload_factor:.2g} times the "
                f"nominal one, usual are {PRELOAD_FORCE.low:g} to {PRELOAD_FORCE.high:g}: check unit, preload and test"
            )
        return Chosen(parameters, delivered or default_friction_set(parameters), delivered)
    if not Path(name).is_file():
        raise ValueError(f"--friction = {name}; allowed: {', '.join(packaged)}, or a file of calibrate")
    sets = load_friction_sets(name, "give a file that ballscrew calibrate --output has written")
    only_law = set(sets) == {Law.MECHANISTIC}
    parameters = screw_of(args, PACKAGED_VG100 if only_law else None)
    of_file = friction_set_of_file(name, parameters)
    refuse_other_fit(of_file, parameters)
    if parameters.screw.drag_torque is not None:
        say(f"drag_torque_Nm of the screw file: not used, for {name} has measured torques")
    return Chosen(with_supply(without_overrides(parameters, of_file.name), of_file), of_file, of_file)


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
