"""Operating points from options or a CSV file."""

from argparse import Namespace
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ...parameters.units import SHOWN
from ...tables.csv_file import read_rows
from ...tables.headings import MEASURED, HeadingError, UnknownUnitError, quantity_of, si
from .files import check_output
from .quantities import Quantity
from .results import say


class _Column(NamedTuple):
    """Quantity of a column; unit: of its heading, "" = that of the option."""

    quantity: Quantity
    unit: str = ""

    def value(self, text: str) -> str:
        """A field in the unit of the option."""
        axis = self.quantity.axis
        try:
            return f"{SHOWN[axis].of(si(float(text), MEASURED[axis], self.unit)):.12g}" if self.unit else text
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
    common = {q.name: value for q in quantities if (value := q.of(args)) is not None}
    defaults = {q.name: q.default for q in quantities if q.default is not None} | common
    if args.points is None:
        for quantity in quantities:
            if quantity.name not in defaults:
                raise ValueError(
                    f"{quantity.option} (missing); allowed: {quantity.allowed}, or --points FILE.csv"
                )
        return [{quantity.name: defaults[quantity.name] for quantity in quantities}]
    rows, columns = _read(args.points, quantities, common)
    for quantity in quantities:
        filled = quantity in columns and all(row[columns[quantity][0]] for row in rows)
        if filled and quantity.name in common:
            raise ValueError(
                f"{quantity.option} = {common[quantity.name]:g}, {args.points} has this column in all rows; remedy: "
                "remove one"
            )
    points = []
    for index, row in enumerate(rows, start=1):
        texts = {quantity.name: column.value(row[heading]) for quantity, (heading, column) in columns.items()}
        points.append(_point(f"{args.points}: row {index}: ", texts, quantities, defaults))
    return points


def _read(
    path: str, quantities: Sequence[Quantity], common: Mapping[str, float]
) -> tuple[list[dict[str, str]], dict[Quantity, tuple[str, _Column]]]:
    """Rows of a file, and heading and column of each quantity that it has; common: values of options, by name.

    Raises       ValueError: a column given twice or similar to a known one
    """
    columns: dict[str, _Column | None] = {}
    problems: list[HeadingError] = []

    def is_used(heading: str) -> bool:
        columns[heading] = None
        try:
            columns[heading] = _column(heading, quantities)
        except HeadingError as error:
            problems.append(error)
        return columns[heading] is not None

    rows = read_rows(path, is_used)
    used: dict[Quantity, tuple[str, _Column]] = {}
    twice = ""
    for heading, column in columns.items():
        if column is not None and used.setdefault(column.quantity, (heading, column))[0] != heading:
            twice = twice or f"{column.quantity.name}, also as {heading}"
    known = {quantity.axis for quantity in used} | {name.rpartition("_")[0] for name in common}
    for error in problems:
        # next to its quantity, a heading such as torque_low_nm is another one
        if isinstance(error, UnknownUnitError) or error.key not in known:
            raise ValueError(f"{path}: {error}")
    if twice:
        raise ValueError(f"{path}: columns given twice: {twice}; remedy: remove one")
    if unused := [heading for heading, column in columns.items() if column is None]:
        say(f"{path}: columns not used: {', '.join(unused)}")
    return rows, used


def _column(heading: str, quantities: Sequence[Quantity]) -> _Column | None:
    """Column of a heading: the name of an option, or as calibrate reads it, `preload [kN]`; None for any other one.

    Raises       HeadingError: as quantity_of
    """
    by_axis = {}
    for quantity in quantities:
        if heading.lower() == quantity.name:
            return _Column(quantity)
        by_axis[quantity.axis] = quantity
    example = ", ".join(quantity.name for quantity in quantities)
    match = quantity_of(
        heading, {axis: MEASURED[axis] for axis in MEASURED if axis in by_axis}, example=example
    )
    return None if match is None else _Column(by_axis[match[0]], match[1])


def _point(
    where: str, texts: Mapping[str, str], quantities: Sequence[Quantity], defaults: Mapping[str, float]
) -> dict[str, float]:
    """Values of a row, else those of the options, else the defaults."""
    point = {}
    for quantity in quantities:
        name = quantity.name
        if texts.get(name):
            point[name] = quantity.checked(where + name, texts[name])
        elif name in defaults:
            point[name] = defaults[name]
        else:
            raise ValueError(
                f"{where}{name} (missing); allowed: {quantity.allowed}, in a column or by {quantity.option}"
            )
    return point
