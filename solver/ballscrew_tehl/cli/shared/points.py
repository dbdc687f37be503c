"""Operating points from options or a CSV file."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ...parameters.units import CELSIUS, RPM
from ...tables.csv_file import read_rows
from ...tables.headings import MEASURED, HeadingError, UnknownUnitError, quantity_of, si
from .files import check_output
from .quantities import Quantity
from .results import say

#: quantity of a heading: option of it, SI over its unit, offset of its unit
_OPTIONS = {
    "preload": ("preload_n", 1.0, 0.0),
    "speed": ("speed_rpm", RPM, 0.0),
    "temperature": ("temperature_c", 1.0, CELSIUS),
    "torque": ("torque_nm", 1.0, 0.0),
    "axial_load": ("axial_load_n", 1.0, 0.0),
}


class _Column(NamedTuple):
    """Option of a column; quantity and unit, if the unit is not that of the option."""

    option: str
    other: tuple[str, str] | None = None

    def value(self, text: str) -> str:
        """A field in the unit of the option."""
        if self.other is None:
            return text
        key, unit = self.other
        try:
            return f"{si(float(text), MEASURED[key], unit) / _OPTIONS[key][1] - _OPTIONS[key][2]:.12g}"
        except ValueError:
            return text


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
    common = {
        q.name: q.checked(q.option, getattr(args, q.name))
        for q in quantities
        if getattr(args, q.name) is not None
    }
    if args.points is None:
        for quantity in quantities:
            if quantity.name not in common and quantity.default is None:
                raise ValueError(
                    f"{quantity.option} (missing); allowed: {quantity.allowed}, or --points FILE.csv"
                )
        return [{q.name: common.get(q.name, _default(q)) for q in quantities}]
    columns: dict[str, _Column | None] = {}
    problems: list[HeadingError] = []

    def is_used(heading: str) -> bool:
        columns[heading] = None
        try:
            columns[heading] = _column(heading, quantities)
        except HeadingError as error:
            problems.append(error)
        return columns[heading] is not None

    rows = read_rows(args.points, is_used)
    used = {heading: column for heading, column in columns.items() if column is not None}
    options = {column.option for column in used.values()} | common.keys()
    for error in problems:
        # beside its quantity, a heading such as torque_low_nm is another one
        if isinstance(error, UnknownUnitError) or _OPTIONS[error.key][0] not in options:
            raise ValueError(f"{args.points}: {error}")
    for heading, column in reversed(used.items()):
        if any(other.option == column.option for text, other in used.items() if text != heading):
            raise ValueError(
                f"{args.points}: columns given twice: {column.option}, also as {heading}; remedy: remove one"
            )
    if unused := [heading for heading, column in columns.items() if column is None]:
        say(f"{args.points}: columns not used: {', '.join(unused)}")
    points = [
        _point(args.points, index, {c.option: c.value(row[text]) for text, c in used.items()}, quantities, common)
        for index, row in enumerate(rows, start=1)
    ]  # fmt: skip
    for name, value in common.items():
        if any(c.option == name and all(row[text] for row in rows) for text, c in used.items()):
            option = f"--{name.replace('_', '-')}"
            raise ValueError(
                f"{option} = {value:g}, {args.points} has this column in all rows; remedy: remove one"
            )
    return points


def _column(heading: str, quantities: Sequence[Quantity]) -> _Column | None:
    """Option of a heading: its name, or as calibrate reads it, `preload [kN]`; None for any other one.

    Raises       ValueError: as quantity_of
    """
    known = [quantity.name for quantity in quantities]
    if heading.lower() in known:
        return _Column(heading.lower())
    allowed = {key: MEASURED[key] for key, (option, *_) in _OPTIONS.items() if option in known}
    found = quantity_of(heading, allowed, example=", ".join(known))
    return None if found is None else _Column(_OPTIONS[found[0]][0], found)


def _point(
    path: str, index: int, row: Mapping[str, str], quantities: Sequence[Quantity], common: Mapping[str, float]
) -> dict[str, float]:  # fmt: skip
    """Values of a row, else those of the options, else the defaults."""
    point = {}
    for quantity in quantities:
        if row.get(quantity.name):
            point[quantity.name] = quantity.checked(
                f"{path}: row {index}: {quantity.name}", row[quantity.name]
            )
        elif quantity.name in common or quantity.default is not None:
            point[quantity.name] = common.get(quantity.name, _default(quantity))
        else:
            raise ValueError(
                f"{path}: row {index}: {quantity.name} (missing); allowed: {quantity.allowed}, in a column or by "
                f"{quantity.option}"
            )
    return point


def _default(quantity: Quantity) -> float:
    return math.nan if quantity.default is None else quantity.default
