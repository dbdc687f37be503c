"""Log of a drive from a CSV file: the signals that are needed, in SI, read in pieces.

Fields are separated by commas, semicolons or tabs. Numbers may have decimal commas. A few damaged rows are left out.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .log_format import MISSING, Format, is_number, read_format
from .log_units import QUANTITIES, LogColumn

Array = NDArray[np.float64]
#: finished, total, what
Progress = Callable[[int, int, str], None]

#: bytes of a piece; bytes that the progress counts as one
PIECE, MEGABYTE = 16_000_000, 1_000_000
#: size from which reading is a stage of its own [MB]
WORTH_SAYING = 5
#: fewest rows of a log; largest share of rows without a value, of damaged rows; share of repeated
#: time stamps from which on they have too few digits;  most error of such a stamp over its last digit
FEWEST, MOST_EMPTY, MOST_DAMAGED, FEW_REPEATED, DIGIT = 200, 0.5, 0.01, 0.05, 1.5
#: a value beyond this is damaged [SI]
LARGEST = 1e12


class Log(NamedTuple):
    """Signals by name [SI], equally long, without missing values; their columns; rows, rows left out, notes."""

    path: Path
    signals: dict[str, Array]
    columns: dict[str, LogColumn]
    rows: int
    left_out: dict[str, int]
    notes: list[str]


def read_log(
    path: Path | str,
    progress: Progress = lambda finished, total, what: None,
    wanted: Sequence[str] = (),
    stated: Mapping[str, str] = {},
) -> Log:
    """Signals of a log.

    Parameters   wanted : signals of the drive that are used if the log has them, before the order of EFFORT
                 stated : heading with its unit, by signal, of columns that have other headings
    Raises       ValueError: cannot be read, headings not understood, damaged rows, too few rows, time not rising
    """
    path = Path(path)
    try:
        form = read_format(path, stated, wanted)
        signals, damaged, first = _numbers(path, form, progress)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    columns, notes = form.columns, form.notes
    rows = len(signals["time"]) + damaged
    for name, values in signals.items():
        factor, offset = QUANTITIES[name].units[columns[name].unit]
        beyond = np.abs(values) > LARGEST / factor
        if beyond.any():
            values[beyond] = np.nan
            notes.append(
                f"{int(beyond.sum())} values of {name} beyond {LARGEST:g} (SI) left out, the first in row "
                f"{int(np.argmax(beyond)) + 1}"
            )
        if not np.isfinite(values).any():
            raise ValueError(
                f"{path}: column {columns[name].heading!r} has no numbers; allowed: a number in each row"
            )
        values += offset
        values *= factor
    if form.unused:
        notes.append(f"columns not used: {', '.join(form.unused)}")
    if damaged:
        notes.append(f"{damaged} damaged row{'s' * (damaged > 1)} left out, the first: {first}")
    # a temperature or preload may be logged more slowly
    needed = [name for name in signals if name not in ("temperature", "preload")]
    good = np.logical_and.reduce([np.isfinite(signals[name]) for name in needed])
    left_out = {"rows without a number": int((~good).sum()), "damaged rows": damaged}
    if not rows >= FEWEST or not good.sum() >= max(FEWEST, MOST_EMPTY * rows):
        raise ValueError(
            f"{path}: {rows} rows, {int(good.sum())} of them complete; allowed: at least {FEWEST} rows, "
            f"{100.0 * MOST_EMPTY:.0f} % of them complete: check the export of the log"
        )
    if not good.all():
        signals = {name: values[good] for name, values in signals.items()}
    return Log(path, _in_time(path, signals, left_out, notes), columns, rows, left_out, notes)


def _numbers(path: Path, form: Format, progress: Progress) -> tuple[dict[str, Array], int, str]:
    """Columns of numbers by signal, NaN where a value is missing; number of damaged rows left out, the first of them.

    Raises       ValueError: too many are damaged
    """
    size = max(path.stat().st_size // MEGABYTE, 1)
    parts: dict[str, list[Array]] = {name: [] for name in form.columns}
    rows, line, count, first = 0, form.skipped, 0, ""
    with path.open("rb") as raw:
        for piece in _pieces(raw, form):
            try:
                values, damaged = _piece(piece, form)
            except pd.errors.ParserError as error:
                raise ValueError(f"below line {line}: {error}; allowed: quotes in pairs") from error
            for name, found in values.items():
                parts[name].append(found[~damaged] if damaged.any() else found)
            if damaged.any() and not first:
                first = _damage(piece.decode(errors="replace"), line, int(np.argmax(damaged)), form)
            rows, count, line = rows + len(damaged), count + int(damaged.sum()), line + piece.count(b"\n")
            if size >= WORTH_SAYING:
                progress(min(raw.tell() // MEGABYTE, size), size, "MB of the log read")
    if count > MOST_DAMAGED * rows:
        raise ValueError(
            f"{first}; allowed: a number, or an empty field for a sample that is missing, in each field of a heading "
            f"({count} of {rows} rows are damaged, at most {100.0 * MOST_DAMAGED:g} % are left out)"
        )
    return {name: np.concatenate(found) for name, found in parts.items()}, count, first


def _pieces(raw: BinaryIO, form: Format) -> Iterator[bytes]:
    """The rows in pieces of whole lines, ASCII or UTF-8."""
    file: Any = io.TextIOWrapper(raw, form.recoded, "replace") if form.recoded else raw
    for _ in range(form.skipped):
        file.readline()
    while piece := file.read(PIECE):
        whole = piece + file.readline()
        yield whole.encode() if isinstance(whole, str) else whole


def _piece(piece: bytes, form: Format) -> tuple[dict[str, Array], NDArray[np.bool_]]:
    """Values of some lines by signal, NaN where missing or text; which rows have text or too many fields."""
    places = [column.place for column in form.columns.values()]
    # one field more than a row may have, which pandas would drop
    longer = f"{form.separator * form.fields}\n".encode()
    table = pd.read_csv(
        io.BytesIO(longer + piece), sep=form.separator, decimal=form.decimal, header=None,
        names=list(range(form.fields + 1)), usecols=[*places, form.fields], index_col=False, na_values=MISSING,
        keep_default_na=False, skipinitialspace=True, low_memory=False, encoding_errors="replace",
    )[1:]  # fmt: skip
    damaged = table[form.fields].notna().to_numpy()
    values = {}
    for name, place in zip(form.columns, places, strict=True):
        column = table[place]
        if not pd.api.types.is_numeric_dtype(column.dtype):
            written = column.astype(str)
            numbers = written.str.replace(",", ".") if form.decimal == "," else written
            found = pd.to_numeric(numbers, errors="coerce")
            damaged = damaged | (found.isna() & column.notna()).to_numpy()
            column = found
        values[name] = column.to_numpy(dtype=np.float64)
    return values, damaged


def _damage(text: str, line: int, row: int, form: Format) -> str:
    """What is wrong with a row of a piece;  line : lines above the piece."""
    number, written = [(k, one) for k, one in enumerate(text.split("\n"), line + 1) if one.strip()][row]
    fields = [field.strip('" \r') for field in written.split(form.separator)]
    if len(fields) > form.fields:
        return f"line {number}: {len(fields)} fields under {form.fields} headings"
    for column in form.columns.values():
        value = fields[column.place] if column.place < len(fields) else ""
        if value not in MISSING and not is_number(value, form.decimal):
            return f"line {number}: {column.heading} = {value[:20]!r}"
    return f"line {number}: {written[:20]!r}"


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
