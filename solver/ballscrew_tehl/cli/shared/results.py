"""Results of a command: JSON, a table, or a listing that fits a terminal."""

from __future__ import annotations

import json
import math
import numbers
import sys
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any


def say(text: str) -> None:
    """One line on stderr."""
    print(text, file=sys.stderr)


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
    results: Sequence[Mapping[str, Any]], as_json: bool, as_list: bool, notes: Mapping[str, str] | None = None
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
    first, column = [], len(head)
    if len(head + text) <= WIDTH or not text:
        return [(head + text).rstrip()]
    if max(map(len, text.split())) > WIDTH - column:
        first, head, column = [head.rstrip()], "    ", 4
    lines = textwrap.wrap(text, WIDTH - column, break_long_words=False, break_on_hyphens=False)
    return first + [(" " * column if number else head) + line for number, line in enumerate(lines)]


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
