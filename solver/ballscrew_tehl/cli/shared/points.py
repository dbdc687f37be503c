"""Operating points from options or a CSV file."""

import math
from argparse import Namespace
from collections.abc import Mapping, Sequence

from ...parameters.units import SHOWN
from ...tables.csv_file import open_table, read_columns
from ...tables.headings import MEASURED, Kind
from .files import check_output
from .quantities import Quantity
from .results import say


def check_rows(args: Namespace) -> None:
    """Refuse an --output that could not be written."""
    if args.output:
        inputs = args.points, args.screw, getattr(args, "map", None)
        check_output("--output", args.output, "a file *.csv", inputs)


def read_points(args: Namespace, quantities: Sequence[Quantity]) -> list[dict[str, float]]:
    """The operating points by name: a field of --points, else an option, else a default; one point without --points.

    Raises       ValueError: a value missing, not allowed or given twice, a column similar to a known one
    """
    check_rows(args)
    rows: list[dict[str, str]] = [{}] if args.points is None else _read(args, quantities)
    for quantity in quantities:
        value = getattr(args, quantity.name)
        if value is not None and all(row.get(quantity.name) for row in rows):
            raise ValueError(
                f"{quantity.option} = {value:g}, {args.points} has this column in all rows; remedy: remove one"
            )
    return [
        {quantity.name: _value(args, number, row, quantity) for quantity in quantities}
        for number, row in enumerate(rows, start=1)
    ]


def _read(args: Namespace, quantities: Sequence[Quantity]) -> list[dict[str, str]]:
    """Rows of the file by name in the units of the options, under headings as `calibrate` reads them."""
    headings = {quantity.axis: MEASURED[quantity.axis] for quantity in quantities}
    example = ", ".join(quantity.name for quantity in quantities)
    kind = Kind(headings, {"of the point": tuple(headings)}, example)
    table = open_table(args.points, kind)
    used = table.single_columns([q.axis for q in quantities if getattr(args, q.name) is not None])
    if unused := table.unused(used):
        say(f"{args.points}: {unused}")
    rows = read_columns(table, used, kind)
    fields = {}
    for quantity in quantities:
        if quantity.axis in used:
            # a field that is no number is refused by its text; digits: without those of the units
            texts, values = rows.texts[quantity.axis], rows.values[quantity.axis].tolist()
            fields[quantity.name] = [
                text if math.isnan(value) else f"{SHOWN[quantity.axis].of(value):.13g}"
                for text, value in zip(texts, values, strict=True)
            ]
    return [dict(zip(fields, row, strict=True)) for row in zip(*fields.values(), strict=True)]


def _value(args: Namespace, number: int, row: Mapping[str, str], quantity: Quantity) -> float:
    """Value of a row, from 1, or of the options."""
    where = f"{args.points}: row {number}: {quantity.name}"
    if text := row.get(quantity.name):
        return quantity(text, where)
    value: float | None = getattr(args, quantity.name)
    if value is None:
        value = quantity.default
    if value is not None:
        return value
    if args.points is None:
        raise ValueError(f"{quantity.option} (missing); allowed: {quantity.allowed}, or --points FILE.csv")
    raise ValueError(f"{where} (missing); allowed: {quantity.allowed}, in a column or by {quantity.option}")
