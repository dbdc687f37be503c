"""Operating points from options or a CSV file."""

from __future__ import annotations

import difflib
import math
from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...calibration.csv_table import read_rows
from ...calibration.measurement_units import QUANTITIES, Column, UnknownUnitError, column_of
from ...parameters.units import CELSIUS, RPM
from .files import check_output
from .quantities import Quantity
from .results import say


def check_rows(args: Namespace) -> None:
    """Refuse an --output that could not be written."""
    if args.output:
        check_output(
            "--output", args.output, "a file *.csv", (args.points, args.screw, getattr(args, "map", None))
        )


def read_points(args: Namespace, quantities: Sequence[Quantity]) -> list[dict[str, float]]:
    """The operating points given by the options; one without --points.

    Raises       ValueError: a value missing or not allowed, an unknown column similar to a known one
    """
    check_rows(args)
    common: dict[str, float] = {}
    for quantity in quantities:
        given = getattr(args, quantity.name)
        if given is not None:
            common[quantity.name] = quantity.checked(quantity.option, given)
    if args.points is None:
        for quantity in quantities:
            if quantity.name not in common and quantity.default is None:
                raise ValueError(
                    f"{quantity.option} (missing); allowed: {quantity.allowed}, or --points FILE.csv"
                )
        return [{q.name: common.get(q.name, _default(q)) for q in quantities}]
    rows = [_by_option(args.points, row, quantities) for row in read_rows(args.points)]
    _check_columns(args.points, rows[0], quantities)
    points = []
    for index, row in enumerate(rows, start=1):
        point = {}
        for quantity in quantities:
            if row.get(quantity.name):
                where = f"{args.points}: row {index}: {quantity.name}"
                point[quantity.name] = quantity.checked(where, row[quantity.name])
            elif quantity.name in common or quantity.default is not None:
                point[quantity.name] = common.get(quantity.name, _default(quantity))
            else:
                raise ValueError(
                    f"{args.points}: row {index}: {quantity.name} (missing); allowed: {quantity.allowed}, "
                    f"in a column or by {quantity.option}"
                )
        points.append(point)
    for quantity in quantities:
        if quantity.name in common and all(row.get(quantity.name) for row in rows):
            raise ValueError(
                f"{quantity.option} = {common[quantity.name]:g}, {args.points} has this column in all rows; remedy: "
                "remove one"
            )
    return points


#: key of a heading with its unit in brackets: option of that quantity, SI over its unit, offset of its unit
_OPTIONS = {
    "preload": ("preload_n", 1.0, 0.0),
    "speed": ("speed_rpm", RPM, 0.0),
    "temperature": ("temperature_c", 1.0, CELSIUS),
    "torque": ("torque_nm", 1.0, 0.0),
    "axial_load": ("axial_load_n", 1.0, 0.0),
}


def _by_option(path: Path, row: Mapping[str, str], quantities: Sequence[Quantity]) -> dict[str, str]:
    """Fields by name of their option: columns named like an option, or as calibrate reads them, `preload [kN]`."""
    known = [quantity.name for quantity in quantities]
    found: dict[str, str] = {}
    for heading, text in row.items():
        name, value = heading.lower(), text
        if name not in known and (column := _with_unit(path, heading, known)) is not None:
            name, factor, offset = _OPTIONS[column.key]
            try:
                value = f"{column.si(float(text)) / factor - offset:.12g}"
            except ValueError:
                value = text
        if name in found:
            raise ValueError(f"{path}: columns given twice: {name}, also as {heading}; remedy: remove one")
        found[name] = value
    return found


def _with_unit(path: Path, heading: str, known: Sequence[str]) -> Column | None:
    """Quantity and unit of a heading such as `preload [kN]`; None for any other one.

    Raises       ValueError: an unknown unit in brackets
    """
    try:
        return column_of(heading, {key: QUANTITIES[key] for key in _OPTIONS if _OPTIONS[key][0] in known}, ())
    except UnknownUnitError as error:
        raise ValueError(f"{path}: {error}") from None
    except ValueError:
        return None


def _default(quantity: Quantity) -> float:
    return math.nan if quantity.default is None else quantity.default


def _check_columns(path: str, columns: Mapping[str, str], quantities: Sequence[Quantity]) -> None:
    """Reject a misspelt column; report columns that are not used."""
    known = [quantity.name for quantity in quantities]
    unused = [column for column in columns if column not in known]
    for column in unused:
        near = difflib.get_close_matches(
            column, [name for name in known if name not in columns], n=1, cutoff=0.7
        )
        if near:
            raise ValueError(f"{path}: column {column}; allowed: {', '.join(known)}; is {near[0]} meant?")
    if unused:
        say(f"{path}: columns not used: {', '.join(unused)}")
