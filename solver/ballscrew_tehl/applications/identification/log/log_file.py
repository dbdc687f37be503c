"""Log of a drive: the signals that are needed, in SI, without a few damaged rows; file: `tables`."""

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ballscrew_tehl.numerics import Array

from ...tables.csv_file import SCOPE, Table, naming, open_table, read_columns
from ...tables.headings import EFFORT, LOG, MOTION, Column, one_column, si

#: may be logged more slowly
SLOW = ("temperature", "preload")
#: fewest rows of a log; largest fraction of rows without a value, of damaged rows
MIN_ROWS, MAX_EMPTY, MAX_DAMAGED = 200, 0.5, 0.01
#: a value beyond this is damaged [SI];  one of several times, T2 without a unit may be a temperature
MAX_VALUE = 1e12
NUMBERED = re.compile(r"(?i)(?:(?:time|zeit)\w*?[ _]?\d+|t ?\d+(?= ?[\[(/] ?[mun]?s))(?: ?[\[(/].*)?")


class Log(NamedTuple):
    """Signals by name [SI], equally long, without missing values; their columns; rows left out, notes."""

    signals: dict[str, Array]
    columns: dict[str, Column]
    left_out: dict[str, int]
    notes: list[str]


def read_log(path: Path | str, wanted: Sequence[str] = (), stated: Mapping[str, str] = {}) -> Log:
    """Signals of a log; wanted: used before the order of EFFORT; stated: headings with units, of other columns."""
    with naming(path):
        table = open_table(path, LOG, stated)
        columns = _selected(table, stated, wanted)
        signals, (damaged, first), marks = read_columns(table, columns, LOG, MAX_DAMAGED)[2:]
        for name, values in signals.items():
            if name != "time":
                values[np.abs(values) > MAX_VALUE] = np.nan
            if not np.isfinite(values).any():
                raise ValueError(f"column {columns[name].heading!r} has no numbers; allowed: one in each row")
        _check_written(table, columns, signals)
        notes = [*filter(None, [table.unused(columns)]), *marks]
        text = f"{columns['current'].heading} [{columns['current'].unit}]" if "current" in columns else ""
        if re.search(r"(?i)rms|eff\b|pk|peak|\bA\W?p\b", text):
            notes.append(f"current {text}: the torque constant has to be one of the same, effective or peak")
        if damaged:
            notes.append(f"{damaged} damaged row{'s' * (damaged > 1)} left out, the first: {first}")
        finite = {name: np.isfinite(values) for name, values in signals.items() if name not in SLOW}
        good, least = np.all([*finite.values()], axis=0), min(finite, key=lambda key: int(finite[key].sum()))
        rows, complete = len(good) + damaged, int(good.sum())
        if not complete >= max(MIN_ROWS, MAX_EMPTY * rows):
            result = (
                f"{rows} rows, {complete} complete, {finite[least].sum()} with {columns[least].heading!r}"
            )
            remedy = "export at one rate, or keep the complete rows"
            raise ValueError(f"{result}; allowed: >= {MIN_ROWS} rows, {MAX_EMPTY:.0%} complete: {remedy}")
        left_out = {"rows without a number": len(good) - complete, "damaged rows": damaged}
        signals = {name: values[good] for name, values in signals.items()}
        signals = _without_empty_end(signals, left_out, notes)
        return Log(_in_time(signals, left_out, notes), columns, left_out, notes)


def stated_columns(texts: Iterable[str]) -> dict[str, str]:
    """Heading, with its unit or without, by signal, from the texts of the option --column."""
    stated: dict[str, str] = {}
    for text in texts:
        name, _, heading = (part.strip() for part in text.partition("="))
        if name not in LOG.quantities or not heading or name in stated:
            allowed = f"QUANTITY=HEADING [UNIT], each QUANTITY once: {', '.join(LOG.quantities)}"
            raise ValueError(f"--column = {text}; allowed: {allowed}")
        stated[name] = heading
    return stated


def _selected(table: Table, stated: Mapping[str, str], wanted: Sequence[str]) -> dict[str, Column]:
    """The columns that are used, by signal."""
    motion = next(name for name in (*stated, *MOTION) if name in table.columns and name in MOTION)
    effort = next(name for name in (*stated, *wanted, *EFFORT) if name in table.columns and name in EFFORT)
    names = ["time", motion, effort, *(name for name in SLOW if name in table.columns)]
    times = table.columns["time"]
    first = {column.heading: column for column in times[::-1]}
    one = table.columns | {"time": [*first.values()][::-1]}
    used = {name: one_column(one, name, f'one, or --column "{name}=HEADING [UNIT]"') for name in names}
    clocks = [k for k, text in enumerate(table.headings) if text in first or NUMBERED.fullmatch(text)]
    scopes = [place for place, heading in enumerate(table.headings) if heading == SCOPE]
    if scopes and scopes[0] > 0:
        # the time of a channel is left of it
        places = [used[name].place for name in (motion, effort)]
        clocks = [max(clock for clock in (0, *scopes) if clock <= place) for place in places]
        used["time"] = used["time"]._replace(place=clocks[0])
    rows = (row for _, row in table.rows(table.start) if len(row) == len(table.headings))
    if len(set(clocks)) > 1 and any(len({row[clock] for clock in clocks} - {""}) > 1 for row in rows):
        those = " and ".join(repr(table.headings[clock]) for clock in sorted({*clocks}))
        raise ValueError(f"unlike times {those}; allowed: one rate for all (Scope: fill with previous)")
    return used


def _check_written(table: Table, columns: Mapping[str, Column], signals: Mapping[str, Array]) -> None:
    """ValueError: numbers may lack a scale that a head of TwinCAT Scope has, or the sign in words, which jump at 0."""
    for name, column in columns.items():
        for line, (what, *texts) in takewhile(lambda row: row[0] <= table.start, table.rows(0)):
            value = ["", *texts, *len(table.headings) * [""]][column.place]
            none = {"ScaleFactor": "1 1.0", "Offset": "0 0.0"}.get(what.removeprefix("Unit "), "")
            if column.multiple is None and value and none and value not in none.split():
                own = f"{column.option(name, f'1 {column.unit}')} if the numbers have it, else [FACTOR {column.unit}]"
                raise ValueError(f"line {line}: {what} of {column.heading!r} = {value}; allowed: {own}")
        raw = signals[name] / si(1.0, LOG.quantities[name], column.unit, column.multiple)
        raw = raw[np.isfinite(raw)]
        jumps = np.ptp(raw) < 2.0**16 and np.abs(np.diff(raw)).max(initial=0.0) > 2.0**15 and raw.min() >= 0.0
        if name in (*MOTION[2:], *EFFORT) and jumps and np.allclose(raw, np.round(raw), 0.0, 1e-6):
            raise ValueError(f"{column.heading!r} is in 16 bit without a sign: subtract 65536 from 32768 on")


def _without_empty_end(
    signals: dict[str, Array], left_out: dict[str, int], notes: list[str]
) -> dict[str, Array]:
    """The signals without a last part in which all of them are 0: a buffer that was not filled."""
    filled = np.flatnonzero(np.any([values != 0.0 for values in signals.values()], axis=0))
    empty = len(signals["time"]) - 1 - int(filled[-1]) if filled.size else 0
    if empty > 0 and signals["time"][-empty - 1] > 0.0:
        left_out["rows of zeros at the end"] = empty
        notes.append(f"the last {empty} rows are 0 in all columns: a buffer that was not filled, left out")
        return {name: values[:-empty] for name, values in signals.items()}
    return signals


def _in_time(signals: dict[str, Array], left_out: dict[str, int], notes: list[str]) -> dict[str, Array]:
    """The signals with blocks of a trigger apart; stamps may repeat."""
    time = signals["time"]
    step = np.diff(time)
    back = np.flatnonzero(step < 0.0)
    usual = float(np.median(np.abs(step)))
    if back.size and np.all(time[back + 1] - time.min() <= usual):
        # blocks of a trigger, apart by a gap
        block = np.cumsum(np.r_[False, step < 0.0])
        notes.append(f"time begins again at {time.min():.6g} s {back.size} times: blocks that are apart")
        return _in_time(signals | {"time": time + block * (np.ptp(time) + 10.0 * usual)}, left_out, notes)
    if back.size:
        row = int(back[0])
        where = f"first from {time[row]:.9g} to {time[row + 1]:.9g} s after row {row + 1}"
        raise ValueError(f"time runs backwards {back.size} times, {where}; remedy: sort rows, one log a file")
    return signals
