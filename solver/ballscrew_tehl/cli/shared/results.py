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


#: widest column of keys in a listing
KEYS = 40


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
    """Write the CSV file of an answer, print it on stdout. Returns the exit code."""
    rows, many, text, columns, output, code = answer
    if output or (many and text is None and not as_json):
        import pandas as pd

        cells = [{key: " ".join(v) if isinstance(v, list) else v for key, v in row.items()} for row in rows]
        frame = pd.DataFrame(cells)
        if output:
            write_text("--output", output, frame.to_csv(index=False))
        else:
            main = frame[[key for key in columns if key in frame]]
            further = "--json" if output == "" else "--output FILE.csv, or --json"
            say(f"{len(frame.columns) - len(main.columns)} further columns: {further}")
            width, form = shutil.get_terminal_size().columns, "{:.5g}".format
            print(main.to_string(index=False, line_width=width, float_format=form, na_rep="-"))
    if as_json:
        print(json.dumps(to_builtin(rows if many else rows[0]), allow_nan=False))
    elif text is not None or not many:
        print(listing(rows[0]) if text is None else text)
    return code


def table(head: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> str:
    """Text columns below their heads, the first `left` of them to the left."""
    lines = [head, *rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    form = "  ".join(f"{{:{'<' if k < left else '>'}{width}}}" for k, width in enumerate(widths))
    return "\n".join(form.format(*line) for line in lines)


def filled(text: str, head: str = "") -> str:
    """A head and a text beside it, in lines that fit the terminal, at most 80 columns."""
    width = max(min(shutil.get_terminal_size().columns, 80), len(head) + 18)
    return textwrap.fill(
        text, width, initial_indent=head, subsequent_indent=" " * len(head), break_long_words=False,
        break_on_hyphens=False,
    )  # fmt: skip


def listing(row: Row) -> str:
    """A line per key, long texts continued below their beginning."""
    names = min(max(map(len, row)), KEYS)
    return "\n".join(filled(shown(value), f"{key:<{names}}  ") for key, value in row.items())


def shown(value: Any) -> str:
    """A value as text for a listing."""
    if isinstance(value, list | tuple):
        return ", ".join(map(shown, value)) or "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None or value == "":
        return "-"
    return str(value) if isinstance(value, int | str) else f"{float(value):.6g}"
