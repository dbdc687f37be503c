"""Answers of the commands: printed as JSON, CSV, a table or a listing."""

import contextlib
import json
import math
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
    columns: Sequence[str] = ()  # main keys, of the table of many rows
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
        import pandas as pd

        cells = [{key: " ".join(v) if isinstance(v, list) else v for key, v in row.items()} for row in rows]
        write_text("--output", answer.output, pd.DataFrame(cells).to_csv(index=False))
    if as_json:
        print(json.dumps(to_builtin(rows if answer.many else rows[0]), allow_nan=False))
    elif answer.text is not None:
        print(answer.text)
    elif not answer.many:
        print(listing(rows[0]))
    elif not answer.output:
        print(_main_columns(answer))
    return answer.code


def _main_columns(answer: Answer) -> str:
    """Table of the main keys, in pieces that fit the terminal."""
    import pandas as pd

    frame = pd.DataFrame(answer.rows)
    keys = [key for key in answer.columns if key in frame]
    further = "--json" if answer.output == "" else "--output FILE.csv, or --json"
    say(f"{len(frame.columns) - len(keys)} further columns: {further}")
    columns = shutil.get_terminal_size().columns
    return str(
        frame[keys].to_string(index=False, line_width=columns, float_format="{:.5g}".format, na_rep="-")
    )


def table(head: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> str:
    """Text columns below their heads, the first `left` of them to the left."""
    lines = [head, *rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(
            f"{cell:{'<' if number < left else '>'}{w}}"
            for number, (cell, w) in enumerate(zip(line, widths, strict=True))
        )
        for line in lines
    )


def shown(value: Any) -> str:
    """A value as text for a listing."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(map(shown, value)) or "-"
    if isinstance(value, int | str):
        return str(value) or "-"
    return "-" if value is None else f"{float(value):.6g}"


#: widest column of keys
KEYS = 40


def width() -> int:
    """Columns of the terminal, at most 80."""
    return min(shutil.get_terminal_size().columns, 80)


def listing(row: Row) -> str:
    """A line per key, long texts continued below their beginning within width()."""
    names = min(max(map(len, row)), KEYS)
    return "\n".join(
        textwrap.fill(
            shown(value), max(width(), names + 20),
            initial_indent=f"{key:<{names}}  ", subsequent_indent=" " * (names + 2),
            break_long_words=False, break_on_hyphens=False,
        )
        for key, value in row.items()
    )  # fmt: skip
