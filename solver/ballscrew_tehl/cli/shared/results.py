"""Answers of the commands: printed as JSON, CSV, or a table or listing that fits a terminal."""

import contextlib
import json
import math
import numbers
import shutil
import sys
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ...whole_file import whole_file
from .files import written

Row = Mapping[str, Any]


class CommandError(Exception):
    """A check or a build that failed, on input that is allowed: one line, exit code 1."""


class Answer(NamedTuple):
    """What a command returns, to be printed by `show`."""

    rows: Sequence[Row]  # values by key, one row per operating point
    many: bool = False  # a list of points was given, also a list of one
    text: str | None = None  # for readers, in place of table or listing
    columns: Sequence[str] = ()  # main keys of the table of many rows; none: all
    notes: Mapping[str, str] = {}  # what a number of a single row means, behind it in the listing
    output: str | None = ""  # CSV file of all keys; None: not given, "": the command writes none
    code: int = 0  # exit code


def say(text: str) -> None:
    """One line on stderr; a reader that has left is no error."""
    with contextlib.suppress(BrokenPipeError):
        print(text, file=sys.stderr, flush=True)


def write_text(option: str, path: Path | str, text: str) -> None:
    """Write the file of an option, whole or not at all, and say so."""
    with written(option, path), whole_file(Path(path)) as temporary:
        temporary.write_text(text, encoding="utf-8")
    say(f"written: {path}")


def to_builtin(value: Any) -> Any:
    """For JSON: numpy scalars and arrays as Python objects, None (null) for values that are not finite."""
    if isinstance(value, Mapping):
        return {str(key): to_builtin(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [to_builtin(entry) for entry in value]
    if hasattr(value, "tolist"):
        return to_builtin(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def show(answer: Answer, as_json: bool) -> int:
    """Print an answer on stdout, or write its CSV file. Returns the exit code."""
    rows = answer.rows
    if answer.output:
        _write_csv(answer.output, rows)
    if as_json:
        print(json.dumps(to_builtin(rows if answer.many else rows[0]), allow_nan=False))
    elif answer.output:
        say(f"written: {answer.output}")
    elif answer.text is not None:
        print(answer.text)
    elif answer.many:
        _print_rows(answer)
    else:
        print(listing(rows[0], answer.notes))
    return answer.code


def _write_csv(output: str, rows: Sequence[Row]) -> None:
    import pandas as pd

    cells = [
        {key: " ".join(value) if isinstance(value, list) else value for key, value in row.items()}
        for row in rows
    ]
    with written("--output", output), whole_file(Path(output)) as temporary:
        pd.DataFrame(cells).to_csv(temporary, index=False)


#: last part of a key -> unit in the head of a column; width to which heads are wrapped
UNITS = {"n": "[N]", "nm": "[N.m]", "rpm": "[r/min]", "c": "[C]", "k": "[K]", "m": "[m]", "pa": "[Pa]"}
HEAD = 8


def _print_rows(answer: Answer) -> None:
    """As many of the columns, by default of all without texts, as fit the terminal; none of zeros only."""
    # a key may be in some of the rows only
    known = list(dict.fromkeys(key for row in answer.rows for key in row))

    def shows(key: str) -> bool:
        values = [row.get(key) for row in answer.rows]
        return any(isinstance(value, bool) or value not in (None, 0.0) for value in values) and (
            key in answer.columns or not any(isinstance(value, str) for value in values)
        )

    keys = [key for key in answer.columns or known if shows(key)]
    text, count = "", 0
    for count in range(len(keys), 0, -1):
        cells = [[shown(row.get(key), 5) for key in keys[:count]] for row in answer.rows]
        text = table([_head(key) for key in keys[:count]], cells, left=0)
        if max(map(len, text.split("\n"))) <= shutil.get_terminal_size().columns:
            break
    print(text)
    if count < len(known):
        further = "--json" if answer.output == "" else "--output FILE.csv, or --json"
        say(f"{len(known) - count} further columns: {further}")


def _head(key: str) -> str:
    *words, unit = key.split("_")
    words.append(UNITS.get(unit, unit) if words else unit)
    return "\n".join(textwrap.wrap(" ".join(words), HEAD, break_long_words=False))


def table(head: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> str:
    """Text columns below their heads, which may have several lines; the first `left` columns to the left."""
    heads = [text.split("\n") for text in head]
    height = max(map(len, heads))
    above = zip(*([""] * (height - len(lines)) + lines for lines in heads), strict=True)
    lines = [*above, *rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if number < left else cell.rjust(width)
            for number, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


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


def listing(row: Row, notes: Mapping[str, str]) -> str:
    """A line per key within width(): numbers to the right of their column, texts to the left, notes behind."""
    number = {
        key: shown(value)
        for key, value in row.items()
        if isinstance(value, numbers.Real) and not isinstance(value, bool)
    }
    names = min(max(map(len, row), default=0), KEYS)
    digits = max(map(len, number.values()), default=0)
    lines = []
    for key, value in row.items():
        text = number[key].rjust(digits) if key in number else shown(value)
        lines += _wrapped(f"{key:<{names}}  ", f"{text}  {notes[key]}" if key in notes else text)
    return "\n".join(lines)


def _wrapped(head: str, text: str) -> list[str]:
    """Text behind a head, continued below its beginning; a word too long for that on lines of its own."""
    first = []
    if max(map(len, text.split()), default=0) > width() - len(head):
        first, head = [head.rstrip()], "    "
    lines = textwrap.wrap(
        text, max(width(), len(head) + 20), initial_indent=head, subsequent_indent=" " * len(head),
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip
    return first + (lines or [head.rstrip()])
