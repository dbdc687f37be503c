"""Log of a drive from a CSV file: the signals that are needed, in SI, read in pieces.

Fields are separated by commas, semicolons or tabs. With semicolons or tabs numbers may have decimal commas. Lines
before the headings that begin with # are comments.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .log_units import EFFORT, EXAMPLE, MOTION, QUANTITIES, log_columns

Array = NDArray[np.float64]
#: finished, total, what
Progress = Callable[[int, int, str], None]

#: rows of a piece; bytes looked at for headings and separator; bytes that the progress counts as one
PIECE, HEAD, MEGABYTE = 200_000, 65536, 1_000_000
#: size from which reading is a stage of its own [MB]
WORTH_SAYING = 5
#: fewest rows of a log; largest share of rows without a value; share of repeated
#: time stamps from which on they have too few digits;  most error of such a stamp over its last digit
FEWEST, MOST_EMPTY, FEW_REPEATED, DIGIT = 200, 0.5, 0.05, 1.5
#: what stands for a missing value
MISSING = [
    "",
    "nan",
    "NaN",
    "NAN",
    "null",
    "NULL",
    "-",
    "n/a",
    "N/A",
    "inf",
    "-inf",
    "Inf",
    "-Inf",
    "1.#QNAN",
    "-1.#IND",
]


class Log(NamedTuple):
    """Signals by name [SI], equally long, without missing values; unit as written; rows, rows left out, notes."""

    path: Path
    signals: dict[str, Array]
    units: dict[str, str]
    rows: int
    left_out: dict[str, int]
    notes: list[str]


class _Format(NamedTuple):
    headings: list[str]
    separator: str
    decimal: str
    skipped: int
    encoding: str


def read_log(
    path: Path | str, progress: Progress = lambda finished, total, what: None, wanted: Sequence[str] = ()
) -> Log:
    """Signals of a log.

    Parameters   wanted : signals of the drive that are used if the log has them, before the order of EFFORT
    Raises       ValueError: cannot be read, headings not understood, text among numbers, too few rows, no motion
    """
    path = Path(path)
    form = _format(path)
    try:
        columns, unused = log_columns(form.headings)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    used = _used(columns, wanted)
    table = _numbers(path, form, [columns[name][0] for name in used], progress)
    signals, units = {}, {}
    for name in used:
        heading, units[name] = columns[name]
        factor, offset = QUANTITIES[name].units[units[name]]
        values = table.pop(heading)
        if not np.isfinite(values).any():
            raise ValueError(f"{path}: column {heading!r} has no numbers; allowed: a number in each row")
        values += offset
        values *= factor
        signals[name] = values
    rows = len(signals["time"])
    unused = [heading for heading in unused if heading]
    notes = [f"columns not used: {', '.join(unused)}"] if unused else []
    if ignored := [columns[name][0] for name in columns if name not in used]:
        notes.append(
            f"columns not used beside {', '.join(columns[name][0] for name in used)}: {', '.join(ignored)}"
        )
    # a temperature or preload may be logged more slowly
    needed = [name for name in used if name not in ("temperature", "preload")]
    good = np.logical_and.reduce([np.isfinite(signals[name]) for name in needed])
    left_out = {"rows without a number": int(rows - good.sum())}
    if not rows >= FEWEST or not good.sum() >= max(FEWEST, MOST_EMPTY * rows):
        raise ValueError(
            f"{path}: {rows} rows, {int(good.sum())} of them complete; allowed: at least {FEWEST} rows, "
            f"{100.0 * MOST_EMPTY:.0f} % of them complete: check the export of the log"
        )
    if not good.all():
        signals = {name: values[good] for name, values in signals.items()}
    return Log(path, _in_time(path, signals, left_out, notes), units, rows, left_out, notes)


def _used(columns: dict[str, tuple[str, str]], wanted: Sequence[str]) -> list[str]:
    motion = next(name for name in MOTION if name in columns)
    effort = next(name for name in (*wanted, *EFFORT) if name in columns)
    return ["time", motion, effort, *(name for name in ("temperature", "preload") if name in columns)]


def _format(path: Path) -> _Format:
    """Headings, separator, decimal sign, lines before the headings."""
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror}); give a CSV file") from error
    encoding = "utf-16" if head[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = head[: len(head) // 2 * 2].decode(encoding)
    except UnicodeDecodeError as error:
        # a character that the piece has cut
        if encoding != "utf-16" and error.start < len(head) - 4:
            encoding = "cp1252"
        text = head.decode(encoding, "replace")
    if "\0" in text:
        raise ValueError(f"{path}: is no text; allowed: a CSV file with a line of headings")
    lines = text.splitlines()
    skipped = 0
    while skipped < len(lines) and (
        not lines[skipped].strip(" \t;,")
        or lines[skipped].lstrip().startswith("#")
        or lines[skipped].startswith("sep=")
    ):
        skipped += 1
    if len(lines) < skipped + 2:
        raise ValueError(f"{path}: no rows; allowed: a line of headings and one line per sample")
    first = lines[skipped]
    separator = next((mark for mark in ";\t" if mark in first), ",")
    headings = [
        field.strip() for field in next(csv.reader([first], delimiter=separator, skipinitialspace=True))
    ]
    if all(_is_number(heading) for heading in headings):
        raise ValueError(
            f"{path}: no line of headings, the first line is {first[:40]!r}; allowed: headings with units, such as "
            f"{EXAMPLE}"
        )
    if twice := sorted({heading for heading in headings if heading and headings.count(heading) > 1}):
        raise ValueError(f"{path}: columns given twice: {', '.join(twice)}; allowed: each heading once")
    decimal = "," if separator != "," and "," in lines[skipped + 1] else "."
    if separator == "," and len(lines[skipped + 1].split(",")) == 2 * len(headings) > 2:
        raise ValueError(
            f"{path}: {2 * len(headings)} fields under {len(headings)} headings; numbers with decimal commas need "
            "semicolons between the fields"
        )
    return _Format(headings, separator, decimal, skipped, encoding)


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def _numbers(path: Path, form: _Format, wanted: list[str], progress: Progress) -> dict[str, Array]:
    """Columns of numbers by heading; NaN where a field is empty or stands for a missing value."""
    size = max(path.stat().st_size // MEGABYTE, 1)
    parts: dict[str, list[Array]] = {heading: [] for heading in wanted}
    numbers = [form.headings.index(heading) for heading in wanted]
    with path.open("rb") as raw:
        pieces = pd.read_csv(
            raw, sep=form.separator, decimal=form.decimal, skiprows=form.skipped + 1, header=None,
            usecols=numbers, names=list(range(len(form.headings))), index_col=False, chunksize=PIECE,
            na_values=MISSING, keep_default_na=False, skipinitialspace=True, encoding=form.encoding,
            low_memory=False, encoding_errors="replace", on_bad_lines="error",
        )  # fmt: skip
        try:
            for piece in pieces:
                for number, heading in zip(numbers, wanted, strict=True):
                    parts[heading].append(_checked(path, heading, piece[number], form))
                if size >= WORTH_SAYING:
                    progress(min(raw.tell() // MEGABYTE, size), size, "MB of the log read")
        except pd.errors.EmptyDataError:
            pass
        except pd.errors.ParserError as error:
            raise ValueError(
                f"{path}: {str(error).strip()}; allowed: as many fields in each row as headings"
            ) from error
    return {heading: np.concatenate(found or [np.empty(0)]) for heading, found in parts.items()}


def _checked(path: Path, heading: str, values: pd.Series, form: _Format) -> Array:
    """Values of a column.

    Raises       ValueError: text among them
    """
    if pd.api.types.is_numeric_dtype(values.dtype) and values.dtype != bool:
        return values.to_numpy(dtype=np.float64)
    text = values.astype(str)
    found = pd.to_numeric(text.str.replace(",", ".") if form.decimal == "," else text, errors="coerce")
    bad = found.isna() & values.notna()
    if bad.any():
        at = int(np.argmax(bad.to_numpy()))
        raise ValueError(
            f"{path}: row {int(values.index[at]) + 1}: {heading} = {str(values.iloc[at])[:40]!r}; allowed: a "
            "number, or "
            "an empty field for a sample that is missing"
        )
    return found.to_numpy(dtype=np.float64)


def _in_time(
    path: Path, signals: dict[str, Array], left_out: dict[str, int], notes: list[str]
) -> dict[str, Array]:
    """The signals without repeated time stamps, or at even times if the stamps have too few digits.

    Raises       ValueError: time that runs backwards or stands still
    """
    time = signals["time"]
    step = np.diff(time)
    back = np.flatnonzero(step < 0.0)
    if back.size:
        at = int(back[0])
        raise ValueError(
            f"{path}: time runs backwards {back.size} times, first from {time[at]:.9g} to {time[at + 1]:.9g} s "
            "after row "
            f"{at + 1}; allowed: rising time: sort the rows, or give one log a file"
        )
    first = np.flatnonzero(np.r_[True, step > 0.0])
    repeated = len(time) - len(first)
    if not repeated > FEW_REPEATED * len(time):
        left_out["repeated time stamps"] = repeated
        return {name: values[first] for name, values in signals.items()} if repeated else signals
    # too few digits: samples at even times, if those agree with the stamps
    if len(first) >= FEWEST:
        index = np.arange(len(time))
        even = np.polyval(np.polyfit(index, time, 1), index)
        if float(np.max(np.abs(even - time))) <= DIGIT * float(np.median(step[step > 0.0])):
            notes.append(f"{repeated} time stamps repeat the one before: taken as evenly sampled")
            return signals | {"time": np.asarray(even, dtype=np.float64)}
    raise ValueError(
        f"{path}: {len(first)} different times in {len(time)} rows; allowed: a time for each row with digits "
        "enough for the sampling"
    )
