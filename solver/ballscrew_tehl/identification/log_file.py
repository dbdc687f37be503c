"""Log of a drive: the signals that are needed, in SI. Dialect and headings: `tables.csv_file`, `tables.headings`.

A few damaged rows are left out.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..physics.ball_law import Array
from ..tables.csv_file import Numbers, Progress, Table, open_table
from ..tables.headings import LOG, LOG_EXAMPLE, Column, both_are, lowered, parted, quantity_of, si

#: signals of the motion, the position first, and of the drive; the first that a log has is used
MOTION = ("position", "screw_position", "speed", "screw_speed")
EFFORT = ("force", "screw_torque", "torque", "current", "voltage")
NEEDED = {"time": ("time",), "position or speed": MOTION, "current, torque, force or voltage": EFFORT}
#: may be logged more slowly
SLOW = ("temperature", "preload")
#: TwinCAT Scope heads each column of time [ms] so
SCOPE = "Name"
#: rows that are converted at once
PIECE = 100_000
#: fewest rows of a log; largest fraction of rows without a value, of damaged rows; fraction of repeated time stamps
#: from which on they have too few digits;  largest error of such a stamp over its last digit
MIN_ROWS, MAX_EMPTY, MAX_DAMAGED, FEW_REPEATED, DIGIT = 200, 0.5, 0.01, 0.05, 1.5
#: a value beyond this is damaged [SI]
MAX_VALUE = 1e12


class Log(NamedTuple):
    """Signals by name [SI], equally long, without missing values; their columns; rows left out, notes."""

    path: Path
    signals: dict[str, Array]
    columns: dict[str, Column]
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
    table = open_table(path, lambda fields: _needed_places(fields, stated))
    try:
        columns, unused = _columns_of(table, stated, wanted)
        signals, damaged, first = _numbers(table, columns, progress)
    except ValueError as error:
        raise ValueError(str(error) if str(path) in str(error) else f"{path}: {error}") from error
    notes = []
    if count := table.above:
        notes.append(
            f"{count} line{'s' * (count > 1)} above the headings in line {table.heading_line} skipped"
        )
    if count := len(table.between):
        notes.append(f"{count} line{'s' * (count > 1)} between headings and rows: no samples")
    for name, values in signals.items():
        signals[name], note = _to_si(path, name, columns[name], values)
        notes += note
    if unused:
        notes.append(f"columns not used: {', '.join(unused)}")
    if damaged:
        notes.append(f"{damaged} damaged row{'s' * (damaged > 1)} left out, the first: {first}")
    rows = len(signals["time"]) + damaged
    good = np.logical_and.reduce([np.isfinite(signals[name]) for name in signals if name not in SLOW])
    left_out = {"rows without a number": int((~good).sum()), "damaged rows": damaged}
    if not rows >= MIN_ROWS or not good.sum() >= max(MIN_ROWS, MAX_EMPTY * rows):
        raise ValueError(
            f"{path}: {rows} rows, {int(good.sum())} of them complete; allowed: at least {MIN_ROWS} rows, "
            f"{100.0 * MAX_EMPTY:.0f} % of them complete: check the export of the log"
        )
    if not good.all():
        signals = {name: values[good] for name, values in signals.items()}
    return Log(path, _in_time(path, signals, left_out, notes), columns, left_out, notes)


def stated_columns(texts: Iterable[str]) -> dict[str, str]:
    """Heading, with its unit or without, by signal.

    Parameters   texts : of the option --column
    Raises       ValueError: another form, an unknown signal, one given twice
    """
    stated: dict[str, str] = {}
    for text in texts:
        name, _, heading = (part.strip() for part in text.partition("="))
        if name not in LOG or not heading or name in stated:
            raise ValueError(
                f"--column = {text}; allowed: QUANTITY=HEADING [UNIT], each QUANTITY once: {', '.join(LOG)}"
            )
        stated[name] = heading
    return stated


def _places(text: str, headings: Sequence[str]) -> list[int]:
    """Where a stated heading stands: as it is written, else without units."""
    same = [place for place, heading in enumerate(headings) if heading == text]
    stem = parted(text)[0]
    return same or [k for k, heading in enumerate(headings) if stem in (heading, parted(heading)[0])]


def _needed_places(fields: Sequence[str], stated: Mapping[str, str]) -> list[int] | None:
    """Places of time, motion and drive in a line; None: it is no line of headings."""
    places: dict[str, int] = {}
    for place, heading in enumerate(fields):
        # a unit may follow
        stem = lowered(parted("time" if heading == SCOPE else heading)[0]) + "_"
        for name, quantity in LOG.items():
            if any(stem.startswith(f"{known}_") for known in quantity.names):
                places.setdefault(name, place)
    for name, text in stated.items():
        if found := _places(text, fields):
            places[name] = found[-1]
    needed = [next((places[name] for name in names if name in places), -1) for names in NEEDED.values()]
    return None if -1 in needed else needed


def _columns_of(
    table: Table, stated: Mapping[str, str], wanted: Sequence[str]
) -> tuple[dict[str, Column], list[str]]:
    """Columns that are used, by signal, and the headings of the others.

    A row of units may stand between headings and rows.
    """
    scope = [k for k, text in enumerate(table.headings) if text == table.headings[0] == SCOPE]
    headings = [("" if k else "time [ms]") if k in scope else text for k, text in enumerate(table.headings)]
    for units in (*table.between, []):
        below = [unit.strip("[]() ") for unit in units] + len(headings) * [""]
        try:
            columns, unused = _by_signal(headings, below, stated, wanted)
            break
        except ValueError:
            if not units:
                raise
    if scope:
        columns["time"] = columns["time"]._replace(place=_clock(table, columns, scope))
    return columns, [text for text in unused if text]


def _by_signal(
    headings: Sequence[str], below: Sequence[str], stated: Mapping[str, str], wanted: Sequence[str]
) -> tuple[dict[str, Column], list[str]]:
    """Columns that are used, stated ones first, and the other headings;  below : row of units, or empty texts.

    Raises       ValueError: a signal missing, without unit or with an unknown one, given twice
    """
    columns = {name: [_stated_column(name, text, headings, below)] for name, text in stated.items()}
    taken, problems = {column.place for (column,) in columns.values()}, []
    for place, heading in enumerate(headings):
        try:
            found = None if place in taken else quantity_of(heading, LOG, below=below[place])
        except ValueError as error:
            problems.append(str(error))
            continue
        if found is not None and found[0] not in stated:
            columns.setdefault(found[0], []).append(Column(place, heading, found[1]))
    for what, names in NEEDED.items():
        if not columns.keys() & set(names):
            raise ValueError(
                f"column {what} missing (found: {', '.join(filter(None, headings))})"
                f"{''.join(f'; {text}' for text in problems[:2])}; allowed: headings with units between commas, "
                f'semicolons or tabs, such as {LOG_EXAMPLE}, or --column "QUANTITY=HEADING [UNIT]" for others, '
                f"QUANTITY one of {', '.join(LOG)}"
            )
    motion = next(name for name in (*stated, *MOTION) if name in columns and name in MOTION)
    effort = next(name for name in (*stated, *wanted, *EFFORT) if name in columns and name in EFFORT)
    used: dict[str, Column] = {}
    for name in ("time", motion, effort, *SLOW):
        if len(same := columns.get(name, [])) > 1:
            raise both_are(same, name, f'one, or --column "{name}=HEADING [UNIT]"')
        if same:
            used[name] = same[0]
    places = {column.place for column in used.values()}
    return used, [heading for place, heading in enumerate(headings) if place not in places]


def _stated_column(name: str, text: str, headings: Sequence[str], below: Sequence[str]) -> Column:
    """Column of the option --column."""
    places = _places(text, headings)
    if len(places) != 1:
        raise ValueError(
            f"--column {name}={text}: {len(places) or 'no'} such columns (found: {', '.join(headings)}); allowed: "
            "one heading of the log and its unit"
        )
    heading, own = headings[places[0]], parted(text)[1]
    unit = own or parted(heading)[1] or below[places[0]]
    found = quantity_of(f"{name} [{unit}]" if unit else name, LOG)
    assert found is not None
    return Column(places[0], heading, found[1], bool(own))


def _clock(table: Table, columns: Mapping[str, Column], scope: Sequence[int]) -> int:
    """Place of the time of motion and drive, which is left of them.

    Raises       ValueError: unlike times
    """
    names = [name for name in columns if name not in ("time", *SLOW)]
    places = [max(place for place in scope if place < columns[name].place) for name in names]
    rows = (row for _, row in islice(table.rows(), MIN_ROWS) if len(row) == len(table.headings))
    if any(row[places[0]] != row[places[1]] for row in rows):
        raise ValueError(
            f"{names[0]} and {names[1]} have unlike times; allowed: an export at one sample time"
        )
    return places[0]


def _numbers(
    table: Table, columns: Mapping[str, Column], progress: Progress
) -> tuple[dict[str, Array], int, str]:
    """Values by signal, NaN where one is missing; number of damaged rows left out, the first of them.

    Raises       ValueError: too many are damaged, numbers that can be read in two ways
    """
    numbers, fields, rows = Numbers(table), len(table.headings), table.rows(progress)
    parts: dict[str, list[Array]] = {name: [] for name in columns}
    total, damaged, first = 0, 0, ""
    while piece := list(islice(rows, PIECE)):
        lines = [line for line, _ in piece]
        wrong = {
            k: f"{len(row)} fields under {fields} headings"
            for k, (_, row) in enumerate(piece)
            if len(row) > fields
        }
        values = {}
        for name, column in columns.items():
            texts = [row[column.place] if column.place < len(row) else "" for _, row in piece]
            values[name], text = numbers.add(column.place, lines, texts)
            for k in np.flatnonzero(text):
                wrong.setdefault(int(k), f"{column.heading} = {texts[k][:20]!r}")
        kept = np.delete(np.arange(len(piece)), list(wrong))
        for name, found in values.items():
            parts[name].append(found[kept] if wrong else found)
        if wrong and not first:
            first = f"line {lines[min(wrong)]}: {wrong[min(wrong)]}"
        total, damaged = total + len(piece), damaged + len(wrong)
    numbers.check()
    if damaged > MAX_DAMAGED * total:
        commas = "; numbers with decimal commas need semicolons between the fields"
        commas *= table.separator == "," and f"{2 * fields} fields" in first
        raise ValueError(
            f"{first}; allowed: a number, or an empty field for a sample that is missing, in each field of a heading "
            f"({damaged} of {total} rows are damaged, at most {100.0 * MAX_DAMAGED:g} % are left out){commas}"
        )
    if not total:
        raise ValueError("no rows; allowed: a line of headings and one line per sample")
    return {name: np.concatenate(found) for name, found in parts.items()}, damaged, first


def _to_si(path: Path, name: str, column: Column, values: Array) -> tuple[Array, list[str]]:
    """Values in SI, and a note about those that are too large to be any."""
    values, notes = si(values, LOG[name], column.unit), []
    beyond = np.abs(values) > MAX_VALUE
    if beyond.any():
        values[beyond] = np.nan
        first = int(np.argmax(beyond)) + 1
        notes = [
            f"{int(beyond.sum())} values of {name} beyond {MAX_VALUE:g} (SI) left out, the first in row {first}"
        ]
    if not np.isfinite(values).any():
        raise ValueError(f"{path}: column {column.heading!r} has no numbers; allowed: a number in each row")
    return values, notes


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
        row = int(back[0])
        raise ValueError(
            f"{path}: time runs backwards {back.size} times, first from {time[row]:.9g} to {time[row + 1]:.9g} s "
            "after row "
            f"{row + 1}; allowed: rising time: sort the rows, or give one log a file"
        )
    first = np.flatnonzero(np.r_[True, step > 0.0])
    repeated = len(time) - len(first)
    if not repeated > FEW_REPEATED * len(time):
        left_out["repeated time stamps"] = repeated
        return {name: values[first] for name, values in signals.items()} if repeated else signals
    # too few digits: samples at even times, if those agree with the stamps
    if len(first) >= MIN_ROWS:
        index = np.arange(len(time))
        even = np.polyval(np.polyfit(index, time, 1), index)
        if float(np.max(np.abs(even - time))) <= DIGIT * float(np.median(step[step > 0.0])):
            notes.append(f"{repeated} time stamps repeat the one before: taken as evenly sampled")
            return signals | {"time": np.asarray(even, dtype=np.float64)}
    raise ValueError(
        f"{path}: {len(first)} different times in {len(time)} rows; allowed: a time for each row with digits "
        "enough for the sampling"
    )
