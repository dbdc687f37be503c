"""Measured torques of a user's CSV file: units in the headings, every row checked, dropped rows reported.

The file is read as any table of numbers (module csv_table): separators, decimal commas, encodings.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

from ..parameters.file import Parameters
from ..parameters.units import CELSIUS, RPM
from .csv_table import read_table, with_decimal_points
from .measurement_units import PERCENT, Column, columns_of
from .measurements import Measurement, merged

#: range of oil temperatures [K]: lower end of the viscosity laws, far above any oil of a ball screw
COLDEST, HOTTEST = 200.0, 473.15
#: torque over (ball load times arm): below the friction of any rolling contact, above that of dry sliding
LEAST_COEFFICIENT, MOST_COEFFICIENT = 1e-4, 1.0
#: nominal diameter times speed [mm r/min]; catalogues end near 2e5
MOST_DN = 5e5
#: most rows listed in one message
NAMED_ROWS = 8

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class RowProblem:
    """A row that is not used: its number (first row of data = 1), its line in the file (0: not known), why."""

    row: int
    line: int
    reason: str

    def __str__(self) -> str:
        place = f"row {self.row} (line {self.line})" if self.line else f"row {self.row}"
        return f"{place}: {self.reason}"


@dataclass(frozen=True)
class MeasurementFile:
    """Content of a file.

    measurements  the usable rows in their order, a point of several tables once
    problems      the rows that are not usable
    notes         assumptions and unused columns, one sentence each
    lines         line of each row of data in the file;  digest  start of its SHA-256
    """

    path: Path
    measurements: list[Measurement]
    problems: list[RowProblem]
    notes: list[str]
    lines: tuple[int, ...]
    digest: str


def _number(text: str) -> float:
    return float(text) if _NUMBER.fullmatch(text) else math.nan


def _reasons(row: dict[str, str], columns: dict[str, Column], si: dict[str, float]) -> list[str]:
    """Why the row cannot be a measurement; empty if it can."""
    found = []
    for key, value in si.items():
        if not math.isfinite(value):
            unit = columns[key].unit if key in columns else ""
            what = "empty" if not row[key] else f"{row[key]!r} {unit}".rstrip()
            found.append(f"{key} = {what}; allowed: a finite number")
    if found:
        return found

    def shown(key: str) -> str:
        unit = f" {columns[key].unit}" if columns[key].unit else ""
        return f"{key} = {row[key]}{unit}"

    for key in ("preload", "weight", "torque_uncertainty"):
        if key in si and not si[key] > 0.0:
            found.append(f"{shown(key)}; allowed: > 0")
    if si["speed"] == 0.0:
        found.append(f"{shown('speed')}; allowed: not 0 (no film at rest)")
    if si["torque"] == 0.0:
        found.append(f"{shown('torque')}; allowed: not 0")
    elif si["torque"] * si["speed"] < 0.0:
        found.append(
            f"{shown('torque')} at {shown('speed')}; allowed: friction torque with the sign of the speed"
        )
    kelvin = si.get("temperature", COLDEST)
    if not COLDEST <= kelvin <= HOTTEST:
        unit = columns["temperature"].unit
        other = "K" if kelvin > HOTTEST else "degC"
        plausible = COLDEST <= _number(row["temperature"]) + (CELSIUS if other == "degC" else 0.0) <= HOTTEST
        mixed = f"; probably {other}, not {unit}" if plausible and unit != other else ""
        found.append(
            f"{shown('temperature')}; allowed: {COLDEST:g} to {HOTTEST:g} K "
            f"({COLDEST - CELSIUS:g} to {HOTTEST - CELSIUS:g} degC){mixed}"
        )
    return found


def read_measurement_file(path: Path | str, temperature: float) -> MeasurementFile:
    """Read a file and separate usable rows from others.

    Parameters   path : CSV with headings as measurement_units reads them: preload, speed, torque; optional
                 temperature, axial_load, torque_uncertainty (standard one, or % of the torque) or weight (factor on the
                 relative error), table, comment
                 temperature : of the oil where the file gives none [K]
    Returns      MeasurementFile; a negative speed with a negative torque counts as both positive
    Raises       ValueError: cannot be read, no rows, headings not understood, decimal commas not clear
    """
    path = Path(path)
    content = read_table(path)
    try:
        columns, unused = columns_of(content.headings)
    except ValueError as err:
        raise ValueError(f"{path}: {err}") from err
    named = {k: c for k, c in enumerate(columns) if c is not None}
    rows = with_decimal_points(content, [k for k, c in named.items() if c.unit or c.key == "weight"]).rows
    fields = [{c.key: row[k] for k, c in named.items()} for _, row in rows]
    by_key = {c.key: c for c in named.values()}
    usable: list[Measurement] = []
    problems: list[RowProblem] = []
    assumed: list[int] = []
    for number, ((line, _), row) in enumerate(zip(rows, fields, strict=True), start=1):
        empty = [key for key in ("temperature", "axial_load", "weight") if not row.get(key)]
        numeric = [key for key, c in by_key.items() if (c.unit or key == "weight") and key not in empty]
        si = {
            key: by_key[key].si(_number(row[key])) if by_key[key].unit else _number(row[key])
            for key in numeric
        }
        if reasons := _reasons(row, by_key, si):
            problems.append(RowProblem(number, line, "; ".join(reasons)))
            continue
        if "temperature" in empty:
            assumed.append(number)
        torque = abs(si["torque"])
        uncertainty = si.get("torque_uncertainty")
        if uncertainty is not None and by_key["torque_uncertainty"].unit == PERCENT:
            uncertainty *= torque
        table = row.get("table", "")
        usable.append(
            Measurement(
                si["preload"], abs(si["speed"]), si.get("temperature", temperature), torque,
                (table,) if table else (), si.get("weight", 1.0), si.get("axial_load", 0.0), uncertainty, (number,),
            )
        )  # fmt: skip
    notes = [f"columns not used: {', '.join(unused)}"] if unused else []
    if assumed:
        which = "all rows" if len(assumed) == len(rows) else named_rows(assumed)
        notes.append(f"{which}: no oil temperature given, {temperature:g} K assumed")
    return MeasurementFile(
        path, merged(_weighted(usable)), problems, notes, tuple(line for line, _ in rows), content.digest
    )


def _weighted(points: list[Measurement]) -> list[Measurement]:
    """Standard uncertainties as weights of the relative errors, 1 for the median of them."""
    relative = [m.uncertainty / m.torque for m in points if m.uncertainty is not None]
    if not relative:
        return points
    typical = median(relative)
    return [replace(m, weight=typical * m.torque / m.uncertainty) if m.uncertainty else m for m in points]


def named_rows(rows: Sequence[int]) -> str:
    """row 3 / rows 3, 5, 9."""
    return f"row{'s' if len(rows) > 1 else ''} {', '.join(str(row) for row in rows)}"


def mean_ball_friction(parameters: Parameters, m: Measurement) -> float:
    """Torque over the sum of ball load times arm [1]: the friction coefficient that alone would give this torque."""
    screw = parameters.screw
    force = 2.0 * m.preload + abs(m.axial_load)
    arm = screw.nominal_radius + 0.5 * screw.ball_diameter * math.cos(screw.contact_angle)
    return m.torque * math.sin(screw.contact_angle) / (force * arm)


def implausible_for(parameters: Parameters, measurements: Sequence[Measurement]) -> list[RowProblem]:
    """Rows that are impossible for a screw of this size, mostly due to a wrong unit of a force, torque or speed."""
    found = []
    for m in measurements:
        reasons = []
        coefficient = mean_ball_friction(parameters, m)
        if not LEAST_COEFFICIENT <= coefficient <= MOST_COEFFICIENT:
            reasons.append(
                f"torque = {m.torque:g} N.m at preload = {m.preload:g} N means a friction coefficient of "
                f"{coefficient:.2g} on this screw; allowed: {LEAST_COEFFICIENT:g} to {MOST_COEFFICIENT:g}; "
                "units of preload or torque probably mixed up"
            )
        dn = 2e3 * parameters.screw.nominal_radius * m.speed / RPM
        if not dn <= MOST_DN:
            reasons.append(
                f"speed = {m.speed / RPM:.6g} r/min; allowed on this screw: up to "
                f"{MOST_DN / (2e3 * parameters.screw.nominal_radius):.0f} r/min; r/min and rad/s probably mixed up"
            )
        if reasons:
            found += [RowProblem(row, 0, "; ".join(reasons)) for row in m.rows or (0,)]
    return found


def refusal(path: Path | str, what: str, problems: Sequence[RowProblem], remedy: str) -> ValueError:
    """Error in one line about rows that are not accepted; what: `impossible row(s)`."""
    shown = " | ".join(str(problem) for problem in problems[:NAMED_ROWS])
    more = len(problems) - NAMED_ROWS
    return ValueError(
        f"{path}: {len(problems)} {what}: {shown}{f' | and {more} more' if more > 0 else ''}; {remedy}"
    )
