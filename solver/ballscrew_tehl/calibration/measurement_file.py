"""Measured torques of a user's CSV file: units in the headings, every row checked, dropped rows reported.

Dialect and headings: `tables.csv_file` and `tables.headings`.
"""

import hashlib
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..parameters.file import Parameters
from ..parameters.units import CELSIUS, COLDEST, RPM
from ..tables.csv_file import Numbers, read_table
from ..tables.headings import MEASURED, MEASURED_EXAMPLE, PERCENT, PLAIN, Column, both_are, quantity_of, si
from .measurements import Measurement, merged

#: highest oil temperature [K], far above that of any ball screw
HOTTEST = 473.15
#: torque over (ball load times arm): below the friction of any rolling contact, above that of dry sliding
MIN_COEFFICIENT, MAX_COEFFICIENT = 1e-4, 1.0
#: nominal diameter times speed [mm r/min]; catalogues end near 2e5
MAX_DN = 5e5
#: most rows listed in one message
NAMED_ROWS = 8
#: columns whose fields may be empty
OPTIONAL = ("temperature", "axial_load", "weight")


@dataclass(frozen=True)
class RowProblem:
    """A row that is not used: its number (first row of data = 1), its line in the file, why."""

    row: int
    line: int
    reason: str

    def __str__(self) -> str:
        return f"row {self.row} (line {self.line}): {self.reason}"


@dataclass(frozen=True)
class MeasurementFile:
    """Content of a file.

    measurements  the usable rows in their order, a point of several tables once
    problems      the rows that are not usable
    notes         assumptions and unused columns, one sentence each
    lines         line of each row of data in the file;  digest  start of its SHA-256
    torque_unit   as in the heading
    """

    path: Path
    measurements: list[Measurement]
    problems: list[RowProblem]
    notes: list[str]
    lines: tuple[int, ...]
    digest: str
    torque_unit: str

    def problems_of(self, m: Measurement, reason: str) -> list[RowProblem]:
        """The rows of a point that is not used."""
        return [RowProblem(row, self.lines[row - 1], reason) for row in m.rows]

    def dropped(
        self, what: str, kind: str, problems: list[RowProblem], drop: Collection[str], left: int
    ) -> list[RowProblem]:
        """The problems, if they may be dropped.

        Parameters   what : `impossible row(s)`;  kind : in drop if they may;  left : usable points without them
        Raises       ValueError: they may not, or no row is left
        """
        if not problems or (kind in drop and left > 0):
            return problems
        remedy = "fix them"
        if kind in drop:
            what = f"{what}, no row is left"
        else:
            remedy = f"fix or remove them, or continue without them: --drop {kind}"
        shown = " | ".join(map(str, problems[:NAMED_ROWS]))
        more = f" | and {len(problems) - NAMED_ROWS} more" if len(problems) > NAMED_ROWS else ""
        raise ValueError(f"{self.path}: {len(problems)} {what}: {shown}{more}; {remedy}")


def measured_columns(headings: Sequence[str]) -> tuple[dict[str, Column], list[str]]:
    """Columns by quantity or plain name, and the headings that are not used.

    Raises       ValueError: as quantity_of; a needed column missing, a quantity given twice
    """
    columns: dict[str, Column] = {}
    unused = []
    for place, heading in enumerate(headings):
        found = quantity_of(heading, MEASURED, PLAIN, example=MEASURED_EXAMPLE)
        if found is None:
            unused.append(heading)
            continue
        column = Column(place, heading, found[1])
        if (other := columns.setdefault(found[0], column)) is not column:
            raise both_are((other, column), found[0])
    for key, quantity in MEASURED.items():
        if quantity.needed and key not in columns:
            raise ValueError(
                f"column {key} missing (found: {', '.join(headings)}); allowed: a line of headings such as "
                f"{MEASURED_EXAMPLE}"
            )
    if {"weight", "torque_uncertainty"} <= columns.keys():
        raise ValueError("columns weight and torque_uncertainty; allowed: one of them")
    return columns, unused


def _reasons(row: Mapping[str, str], columns: Mapping[str, Column], values: Mapping[str, float]) -> list[str]:
    """Why the row cannot be a measurement; empty if it can.

    Parameters   row : fields as written;  values [SI]
    """
    unit = {key: f" {column.unit}".rstrip() for key, column in columns.items()}
    if bad := [key for key, value in values.items() if not math.isfinite(value)]:
        fields = {key: f"{row[key]!r}{unit[key]}" if row[key] else "empty" for key in bad}
        return [f"{key} = {field}; allowed: a finite number" for key, field in fields.items()]
    shown = {key: f"{key} = {row[key]}{unit[key]}" for key in values}
    torque, speed, kelvin = values["torque"], values["speed"], values.get("temperature", COLDEST)
    positive = (key for key in ("preload", "weight", "torque_uncertainty") if key in values)
    reasons = [f"{shown[key]}; allowed: > 0" for key in positive if not values[key] > 0.0]
    if speed == 0.0:
        reasons.append(f"{shown['speed']}; allowed: not 0 (no film at rest)")
    if torque == 0.0:
        reasons.append(f"{shown['torque']}; allowed: not 0")
    elif torque * speed < 0.0:
        reasons.append(
            f"{shown['torque']} at {shown['speed']}; allowed: friction torque with the sign of the speed"
        )
    if not COLDEST <= kelvin <= HOTTEST:
        other, offset = ("K", 0.0) if kelvin > HOTTEST else ("degC", CELSIUS)
        plausible = COLDEST <= float(row["temperature"]) + offset <= HOTTEST
        written = columns["temperature"].unit
        mixed = f"; probably {other}, not {written}" if plausible and written != other else ""
        reasons.append(
            f"{shown['temperature']}; allowed: {COLDEST:g} to {HOTTEST:g} K "
            f"({COLDEST - CELSIUS:g} to {HOTTEST - CELSIUS:g} degC){mixed}"
        )
    return reasons


class _Columns(NamedTuple):
    """Columns that are used and headings that are not, line of each row; fields as written and SI by quantity."""

    used: dict[str, Column]
    unused: list[str]
    lines: tuple[int, ...]
    texts: dict[str, list[str]]
    values: dict[str, NDArray[np.float64]]


def _read_columns(path: Path | str) -> _Columns:
    table, rows = read_table(path)
    try:
        columns, unused = measured_columns(table.headings)
    except ValueError as err:
        raise ValueError(f"{path}: {err}") from err
    lines, numbers, values = tuple(line for line, _ in rows), Numbers(table), {}
    texts = {key: [fields[column.place] for _, fields in rows] for key, column in columns.items()}
    for key, column in columns.items():
        if column.unit or key == "weight":
            value, _ = numbers.add(column.place, lines, texts[key])
            values[key] = si(value, MEASURED[key], column.unit) if column.unit else value
            texts[key] = [text.replace(",", ".") for text in texts[key]]
    numbers.check()
    return _Columns(columns, unused, lines, texts, values)


def read_measurement_file(path: Path | str, temperature: float) -> MeasurementFile:
    """Read a file and separate usable rows from others.

    Parameters   path : CSV with headings of tables.headings: preload, speed, torque; optional temperature, axial_load,
                 torque_uncertainty (standard one, or % of the torque) or weight (factor on the relative error), table,
                 comment
                 temperature : of the oil where the file gives none [K]
    Returns      MeasurementFile; a negative speed with a negative torque counts as both positive
    Raises       ValueError: cannot be read, no rows, headings not understood, numbers that can be read in two ways
    """
    columns, unused, lines, texts, values = _read_columns(path)
    usable: list[Measurement] = []
    problems: list[RowProblem] = []
    assumed: list[int] = []
    for number, line in enumerate(lines, start=1):
        row = {key: column[number - 1] for key, column in texts.items()}
        value = {key: float(x[number - 1]) for key, x in values.items() if row[key] or key not in OPTIONAL}
        if reasons := _reasons(row, columns, value):
            problems.append(RowProblem(number, line, "; ".join(reasons)))
            continue
        if "temperature" not in value:
            assumed.append(number)
        torque, uncertainty, name = abs(value["torque"]), value.get("torque_uncertainty"), row.get("table")
        if uncertainty is not None and columns["torque_uncertainty"].unit == PERCENT:
            uncertainty *= torque
        usable.append(Measurement(
            value["preload"], abs(value["speed"]), value.get("temperature", temperature), torque,
            (name,) if name else (), value.get("weight", 1.0), value.get("axial_load", 0.0), uncertainty, (number,),
        ))  # fmt: skip
    notes = [f"columns not used: {', '.join(unused)}"] if unused else []
    if assumed:
        which = "all rows" if len(assumed) == len(lines) else named_rows(assumed)
        notes.append(f"{which}: no oil temperature given, {temperature:g} K assumed")
    notes += _duplicates(usable)
    digest = hashlib.sha256(Path(path).read_bytes()).hexdigest()[:12]
    points = merged(_weighted(usable))
    return MeasurementFile(Path(path), points, problems, notes, lines, digest, columns["torque"].unit)


def _duplicates(points: list[Measurement]) -> list[str]:
    """Note about rows that have the same numbers."""
    same: dict[Measurement, list[int]] = {}
    for m in points:
        same.setdefault(m, []).extend(m.rows)
    twice = [" = ".join(map(str, numbers)) for numbers in same.values() if len(numbers) > 1]
    if not twice:
        return []
    more = f" and {len(twice) - NAMED_ROWS} more" * (len(twice) > NAMED_ROWS)
    rows = ", ".join(twice[:NAMED_ROWS]) + more
    return [f"duplicates, the same point and torque: row {rows}; every one counts: remove copies"]


def _weighted(points: list[Measurement]) -> list[Measurement]:
    """Standard uncertainties as weights of the relative errors, 1 for the median of them."""
    relative = [m.uncertainty / m.torque for m in points if m.uncertainty is not None]
    typical = median(relative or [1.0])
    return [replace(m, weight=typical * m.torque / m.uncertainty) if m.uncertainty else m for m in points]


def named_rows(rows: Sequence[int]) -> str:
    """row 3 / rows 3, 5, 9."""
    return f"row{'s' if len(rows) > 1 else ''} {', '.join(map(str, rows))}"


def implausible_for(parameters: Parameters, m: Measurement) -> str:
    """Why a point is impossible for a screw of this size, mostly a wrong unit of force, torque or speed; "" if not."""
    screw, reasons = parameters.screw, []
    arm = screw.nominal_radius + 0.5 * screw.ball_diameter * math.cos(screw.contact_angle)
    max_speed = MAX_DN / (2e3 * screw.nominal_radius)  # r/min
    # the friction coefficient that alone would give this torque
    force = 2.0 * m.preload + abs(m.axial_load)
    coefficient = m.torque * math.sin(screw.contact_angle) / (force * arm)
    if not MIN_COEFFICIENT <= coefficient <= MAX_COEFFICIENT:
        reasons.append(
            f"torque = {m.torque:g} N.m at preload = {m.preload:g} N means a friction coefficient of "
            f"{coefficient:.2g} on this screw; allowed: {MIN_COEFFICIENT:g} to {MAX_COEFFICIENT:g}; "
            "units of preload or torque probably mixed up"
        )
    if not m.speed / RPM <= max_speed:
        reasons.append(
            f"speed = {m.speed / RPM:.6g} r/min; allowed on this screw: up to {max_speed:.0f} r/min; "
            "r/min and rad/s probably mixed up"
        )
    return "; ".join(reasons)
