"""Operating points from options or a CSV file."""

import math
from argparse import Namespace
from collections.abc import Mapping, Sequence

from ...parameters.units import SHOWN
from ...tables.csv_file import open_table, read_columns
from ...tables.headings import MEASURED, NO_UNIT, Kind
from ...tables.headings import Quantity as Heading
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
    common = {q.name: value for q in quantities if (value := q.of(args)) is not None}
    defaults = {q.name: q.default for q in quantities if q.default is not None} | common
    if args.points is None:
        for quantity in quantities:
            if quantity.name not in defaults:
                raise ValueError(
                    f"{quantity.option} (missing); allowed: {quantity.allowed}, or --points FILE.csv"
                )
        return [{quantity.name: defaults[quantity.name] for quantity in quantities}]
    texts = _read(args.points, quantities, common)
    for name in common.keys() & texts.keys():
        if all(texts[name]):
            option = next(quantity.option for quantity in quantities if quantity.name == name)
            raise ValueError(
                f"{option} = {common[name]:g}, {args.points} has this column in all rows; remedy: remove one"
            )
    rows = zip(*texts.values(), strict=True)
    return [
        _point(f"{args.points}: row {index}: ", dict(zip(texts, row, strict=True)), quantities, defaults)
        for index, row in enumerate(rows, start=1)
    ]


def _read(path: str, quantities: Sequence[Quantity], common: Mapping[str, float]) -> dict[str, list[str]]:
    """Fields of each quantity that a file has, in the units of the options.

    Headings are names of options, or as `calibrate` reads them, `preload [kN]`.

    Parameters   common : values of options, by name
    Raises       ValueError: a column given twice or similar to a known one
    """
    headings = {q.name: Heading((q.name,), NO_UNIT) for q in quantities}
    headings |= {q.axis: MEASURED[q.axis] for q in quantities if q.axis in MEASURED}
    kind = Kind(headings, {"of the point": tuple(headings)}, ", ".join(q.name for q in quantities))
    table = open_table(path, kind)
    used = table.single_columns([name.rpartition("_")[0] for name in (*table.columns, *common)])
    for quantity in quantities:
        if {quantity.name, quantity.axis} <= used.keys():
            twice = f"{quantity.name}, also as {used[quantity.axis].heading}"
            raise ValueError(f"{path}: columns given twice: {twice}; remedy: remove one")
    if unused := table.unused(used):
        say(f"{path}: {unused}")
    rows, texts = read_columns(table, used, kind), {}
    for quantity in quantities:
        axis = quantity.axis
        if quantity.name in used:
            texts[quantity.name] = [text.replace(",", ".") for text in rows.texts[quantity.name]]
        elif axis in used:
            texts[quantity.name] = [
                text if math.isnan(value) else f"{SHOWN[axis].of(value):.12g}"
                for text, value in zip(rows.texts[axis], rows.values[axis].tolist(), strict=True)
            ]
    return texts


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
