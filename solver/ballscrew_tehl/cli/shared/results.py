"""Results of a command: JSON, CSV, or a table or listing that fits a terminal."""

from __future__ import annotations

import contextlib
import json
import math
import numbers
import shutil
import sys
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...whole_file import whole_file
from .files import written


class CommandError(Exception):
    """A check or a build that failed, on input that is allowed: one line, exit code 1."""


def say(text: str) -> None:
    """One line on stderr; if its reader has left, the work goes on without it."""
    with contextlib.suppress(BrokenPipeError):
        print(text, file=sys.stderr, flush=True)


def write_text(option: str, path: Path | str, text: str) -> None:
    """Write the file of an option, whole or not at all, and say so."""
    with written(option, path), whole_file(Path(path)) as temporary:
        temporary.write_text(text, encoding="utf-8")
    say(f"written: {path}")


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
    columns: Sequence[str] = (),
    output: str | None = "",
) -> None:
    """One JSON object or list on stdout, a file, or readable text.

    Parameters   as_list : the user gave a list of points, also a list of one
                 notes : what a number of a single result means, in its line of the text
                 columns : main keys of a list, for the table; none: all
                 output : CSV file of all keys; None: not given, "": the command writes none
    """
    if output:
        _write_csv(output, results)
    if as_json:
        print(json.dumps(plain(results if as_list else results[0]), allow_nan=False))
    elif output:
        say(f"written: {output}")
    elif as_list:
        _print_table(results, columns, "--json" if output == "" else "--output FILE.csv, or --json")
    else:
        print(listing(results[0], notes or {}))


def _write_csv(output: str, results: Sequence[Mapping[str, Any]]) -> None:
    import pandas as pd

    rows = [
        {key: " ".join(value) if isinstance(value, list) else value for key, value in result.items()}
        for result in results
    ]
    with written("--output", output), whole_file(Path(output)) as temporary:
        pd.DataFrame(rows).to_csv(temporary, index=False)


#: last part of a key -> unit in the head of a column; width to which heads are wrapped
UNITS = {"n": "[N]", "nm": "[N.m]", "rpm": "[r/min]", "c": "[C]", "k": "[K]", "m": "[m]", "pa": "[Pa]"}
HEAD = 8


def _print_table(results: Sequence[Mapping[str, Any]], columns: Sequence[str], further: str) -> None:
    """As many of the columns, by default of all without texts, as fit the terminal; none of zeros only."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    # a key may be in some of the results only
    console, every = (
        Console(force_jupyter=False),
        list(dict.fromkeys(key for result in results for key in result)),
    )

    def shows(key: str) -> bool:
        values = [result.get(key) for result in results]
        return any(isinstance(value, bool) or value not in (None, 0.0) for value in values) and (
            key in columns or not any(isinstance(value, str) for value in values)
        )

    keys = [key for key in columns or every if shows(key)]
    while True:
        found = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
        for key in keys:
            found.add_column(Text(_head(key)), justify="right", vertical="bottom", no_wrap=True)
        for result in results:
            found.add_row(*(shown(result.get(key), 5) for key in keys))
        whole = console.measure(found, options=console.options.update(width=10_000)).maximum
        if len(keys) == 1 or whole <= console.width:
            break
        keys.pop()
    console.print(found)
    if len(keys) < len(every):
        say(f"{len(every) - len(keys)} further columns: {further}")


def _head(key: str) -> str:
    *words, unit = key.split("_")
    words.append(UNITS.get(unit, unit) if words else unit)
    return "\n".join(textwrap.wrap(" ".join(words), HEAD, break_long_words=False))


def shown(value: Any, digits: int = 6) -> str:
    """A value as text for a table."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple)):
        return ", ".join(shown(entry) for entry in value) or "-"
    if isinstance(value, int | str):
        return str(value)
    return "-" if value is None else f"{float(value):.{digits}g}"


#: widest column of keys, longer ones have their value behind them
KEYS = 40


def width() -> int:
    """Columns of the terminal, at most 80."""
    return min(shutil.get_terminal_size().columns, 80)


def listing(row: Mapping[str, Any], notes: Mapping[str, str] | None = None) -> str:
    """A line per key within width(): numbers to the right of their column, texts to the left, notes behind."""
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
    if len(head + text) <= width() or not text:
        return [(head + text).rstrip()]
    if max(map(len, text.split())) > width() - column:
        first, head, column = [head.rstrip()], "    ", 4
    lines = textwrap.wrap(text, max(width() - column, 20), break_long_words=False, break_on_hyphens=False)
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
