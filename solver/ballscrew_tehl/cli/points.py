"""Input and output of the command line: operating points from options or CSV, results as JSON or table."""

from __future__ import annotations

import difflib
import json
import math
import numbers
import sys
import textwrap
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ..calibration.csv_table import read_rows
from ..calibration.measurement_units import Column, column_of
from ..parameters.units import CELSIUS, RPM


class Quantity(NamedTuple):
    """A number of an operating point: option --some-name, column some_name, both the key `name`."""

    name: str
    help: str
    least: float = -math.inf
    most: float = math.inf
    default: float | None = None
    #: the least value itself is rejected
    above: bool = False
    #: zero is rejected
    not_zero: bool = False

    @property
    def option(self) -> str:
        """Spelling on the command line."""
        return "--" + self.name.replace("_", "-")

    @property
    def allowed(self) -> str:
        """Allowed values as text."""
        words = "a finite number"
        if math.isfinite(self.most):
            words = f"{self.least:g} to {self.most:g}"
        elif math.isfinite(self.least):
            words += f" {'>' if self.above else '>='} {self.least:g}"
        return words + (", not 0" if self.not_zero else "")

    def checked(self, where: str, value: Any) -> float:
        """The value as a float.

        Raises       ValueError: one line with place, value and what is allowed
        """
        try:
            found = float(value)
        except ValueError:
            found = math.nan
        low = found <= self.least if self.above else found < self.least
        if not math.isfinite(found) or low or found > self.most or (self.not_zero and found == 0.0):
            celsius = found - CELSIUS
            kelvin = self.name.endswith("_c") and self.least <= celsius <= self.most
            hint = f" degrees Celsius; is {value} K = {celsius:.6g} C meant?" if kelvin else ""
            raise ValueError(f"{where} = {value}; allowed: {self.allowed}{hint}")
        return found


def add_options(parser: ArgumentParser, quantities: Sequence[Quantity]) -> None:
    """Add one option per quantity, --points and --json."""
    for quantity in quantities:
        note = "" if quantity.default is None else f" (default {quantity.default:g})"
        metavar = quantity.name.rsplit("_", 1)[-1].upper()
        parser.add_argument(
            quantity.option, metavar=metavar, help=f"{quantity.help}; {quantity.allowed}{note}"
        )
    names = ", ".join(quantity.name for quantity in quantities)
    parser.add_argument(
        "--points",
        metavar="FILE.csv",
        help=f"many points: columns {names}; an option applies to every row without that column",
    )
    add_json(parser)


def add_json(parser: ArgumentParser) -> None:
    """Add --json."""
    parser.add_argument(
        "--json", action="store_true", help="JSON on stdout (a list with --points), logs on stderr"
    )


def read_points(args: Namespace, quantities: Sequence[Quantity]) -> list[dict[str, float]]:
    """The operating points given by the options; one without --points.

    Raises       ValueError: a value missing or not allowed, an unknown column similar to a known one
    """
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
    rows = [_by_option(row, quantities) for row in read_rows(args.points)]
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
    return points


#: key of a heading with its unit in brackets: option of that quantity, SI over its unit, offset of its unit
_OPTIONS = {
    "preload": ("preload_n", 1.0, 0.0),
    "speed": ("speed_rpm", RPM, 0.0),
    "temperature": ("temperature_c", 1.0, CELSIUS),
    "torque": ("torque_nm", 1.0, 0.0),
    "axial_load": ("axial_load_n", 1.0, 0.0),
}


def _by_option(row: Mapping[str, str], quantities: Sequence[Quantity]) -> dict[str, str]:
    """Fields by name of their option: columns named like an option, or as calibrate reads them, `preload [kN]`."""
    known = [quantity.name for quantity in quantities]
    found = {}
    for heading, text in row.items():
        name, value = heading.lower(), text
        if name not in known and (column := _with_unit(heading)) is not None:
            option, factor, offset = _OPTIONS[column.key]
            if option in known:
                name = option
                try:
                    value = repr(column.si(float(text)) / factor - offset)
                except ValueError:
                    value = text
        found[name] = value
    return found


def _with_unit(heading: str) -> Column | None:
    """Quantity and unit of a heading such as `preload [kN]`; None for any other one."""
    try:
        column = column_of(heading)
    except ValueError:
        return None
    return column if column is not None and column.key in _OPTIONS and column.unit else None


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
        print(f"{path}: columns not used: {', '.join(unused)}", file=sys.stderr)


def plain(value: Any) -> Any:
    """For JSON: numpy scalars and arrays as Python objects, None (null) for values that are not finite."""
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def print_results(
    results: Sequence[Mapping[str, Any]],
    as_json: bool,
    as_list: bool,
    notes: Mapping[str, str] | None = None,
) -> None:
    """One JSON object or list on stdout, or a readable table.

    Parameters   as_list : the user gave a list of points, also a list of one
                 notes : what a number of a single result means, in its line of the text
    """
    if as_json:
        print(json.dumps(plain(results if as_list else results[0]), allow_nan=False))
    elif as_list:
        # a key may be in some of the results only
        whole = {key: value for result in reversed(results) for key, value in result.items()}
        order = dict.fromkeys(key for result in results for key in result)
        keys = [key for key in order if not isinstance(whole[key], str)]
        print(table([keys] + [[shown(result.get(key)) for key in keys] for result in results]))
    else:
        print(listing(results[0], notes or {}))


def shown(value: Any) -> str:
    """A value as text for a table."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple)):
        return ", ".join(shown(entry) for entry in value) or "-"
    if isinstance(value, int | str):
        return str(value)
    return "-" if value is None else f"{float(value):.6g}"


#: columns of a terminal; widest column of keys, longer ones have their value behind them
WIDTH, KEYS = 80, 40


def listing(row: Mapping[str, Any], notes: Mapping[str, str] | None = None) -> str:
    """A line per key, at most WIDTH wide: numbers to the right of their column, texts to the left, notes behind."""
    number = {
        key: isinstance(value, numbers.Real) and not isinstance(value, bool) for key, value in row.items()
    }
    names = min(max(map(len, row), default=0), KEYS)
    digits = max((len(shown(row[key])) for key in row if number[key]), default=0)
    lines = []
    for key, value in row.items():
        text = shown(value)
        if notes and key in notes:
            text = f"{text.rjust(digits) if number[key] else text}  {notes[key]}"
        elif number[key]:
            text = text.rjust(digits)
        lines += _wrapped(f"{key:<{names}}  ", text)
    return "\n".join(lines)


def _wrapped(head: str, text: str) -> list[str]:
    """Text behind a head, continued below its beginning; a word too long for that on lines of its own."""
    words, column = text.split(), len(head)
    if len(head + text) <= WIDTH or not words:
        return [(head + text).rstrip()]
    if max(map(len, words)) > WIDTH - column:
        first, column = [head.rstrip()], 4
        lines = textwrap.wrap(text, WIDTH - column, break_long_words=False, break_on_hyphens=False)
        return first + [" " * column + line for line in lines]
    lines = textwrap.wrap(text, WIDTH - column, drop_whitespace=True, break_on_hyphens=False)
    return [head + lines[0], *(" " * column + line for line in lines[1:])]


def table(rows: Sequence[Sequence[str]]) -> str:
    """Text columns, the first one to the left, the others to the right."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [row[0].ljust(widths[0])] + [
            cell.rjust(w) for cell, w in zip(row[1:], widths[1:], strict=True)
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)
