"""Measured torques of a user's CSV file: units in the headings, every row checked.

Dialect and headings: `tables.csv_file` and `tables.headings`.
"""

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import NamedTuple, Self

from ..parameters.file import Parameters
from ..parameters.units import CELSIUS, COLDEST, RPM
from ..tables.csv_file import open_table, read_columns
from ..tables.headings import PERCENT, TORQUES, Column
from .measurements import Measurement, merged

#: highest oil temperature [K], far above that of any ball screw
HOTTEST = 473.15
#: torque over (ball load times arm): below the friction of any rolling contact, above that of dry sliding
MIN_COEFFICIENT, MAX_COEFFICIENT = 1e-4, 1.0
#: nominal diameter times speed [mm r/min]; catalogues end near 2e5
MAX_DN = 5e5
#: columns whose fields may be empty
OPTIONAL = ("temperature", "axial_load", "weight")


class RowProblem(NamedTuple):
    """A row that is not used: its number (first row of data = 1), its line in the file, why."""

    row: int
    line: int
    reason: str

    def __str__(self) -> str:
        return f"row {self.row} (line {self.line}): {self.reason}"


class MeasurementFile(NamedTuple):
    """Content of a file, or a single torque.

    where, source : the file at the begin of messages, its name and the start of its SHA-256; "" without a file
    measurements : the usable rows in their order, a point of several tables once;  problems : the other rows
    notes : assumptions and unused columns;  lines : of the rows in the file;  torque_unit : as in the heading
    """

    where: str
    source: str
    measurements: list[Measurement]
    problems: list[RowProblem]
    notes: list[str]
    lines: Sequence[int]
    torque_unit: str

    @classmethod
    def of_point(cls, m: Measurement) -> Self:
        """A single torque without a file."""
        return cls("", "", [replace(m, rows=(1,))], [], [], (1,), "N.m")

    def problems_of(self, m: Measurement, reason: str) -> list[RowProblem]:
        """The rows of a point that is not used; none without a reason."""
        return [RowProblem(row, self.lines[row - 1], reason) for row in m.rows if reason]


def read_measurement_file(path: Path | str, temperature: float) -> MeasurementFile:
    """Read a file and separate usable rows from others.

    Parameters   path : CSV with headings of tables.headings: preload, speed, torque; optional temperature, axial_load,
                 torque_uncertainty (standard one, or % of the torque) or weight (factor on the relative error), table,
                 comment
                 temperature : of the oil where the file gives none [K]
    Returns      MeasurementFile; a negative speed with a negative torque counts as both positive
    Raises       ValueError: cannot be read, no rows, headings not understood, numbers that can be read in two ways
    """
    table = open_table(path, TORQUES)
    columns = table.single_columns()
    if {"weight", "torque_uncertainty"} <= columns.keys():
        raise ValueError(f"{path}: columns weight and torque_uncertainty; allowed: one of them")
    rows = read_columns(table, columns, TORQUES)
    usable: list[Measurement] = []
    problems: list[RowProblem] = []
    assumed: list[int] = []
    for number, line in enumerate(rows.lines, start=1):
        texts = {key: found[number - 1].replace(",", ".") for key, found in rows.texts.items()}
        value = {k: float(x[number - 1]) for k, x in rows.values.items() if texts[k] or k not in OPTIONAL}
        if reasons := _reasons(texts, columns, value):
            problems.append(RowProblem(number, line, "; ".join(reasons)))
            continue
        if "temperature" not in value:
            assumed.append(number)
        torque, uncertainty, name = abs(value["torque"]), value.get("torque_uncertainty"), texts.get("table")
        if uncertainty is not None and columns["torque_uncertainty"].unit == PERCENT:
            uncertainty *= torque
        usable.append(Measurement(
            value["preload"], abs(value["speed"]), value.get("temperature", temperature), torque,
            (name,) if name else (), value.get("weight", 1.0), value.get("axial_load", 0.0), uncertainty, (number,),
        ))  # fmt: skip
    notes = list(filter(None, [table.unused(columns)]))
    if assumed:
        which = "all rows" if len(assumed) == len(rows.lines) else named_rows(assumed)
        notes.append(f"{which}: no oil temperature given, {temperature:g} K assumed")
    source = f"{table.path.name} (SHA-256 {hashlib.sha256(table.path.read_bytes()).hexdigest()[:12]})"
    points = merged(_weighted(usable))
    return MeasurementFile(f"{path}: ", source, points, problems, notes, rows.lines, columns["torque"].unit)


def _reasons(
    texts: Mapping[str, str], columns: Mapping[str, Column], values: Mapping[str, float]
) -> list[str]:
    """Why a row cannot be a measurement; empty if it can.

    Parameters   texts : fields as written;  values [SI]
    """
    shown = {key: f"{key} = {texts[key]} {columns[key].unit}".rstrip() for key in values}
    if bad := [key for key, value in values.items() if not math.isfinite(value)]:
        fields = {key: f"{texts[key]!r} {columns[key].unit}" if texts[key] else "empty" for key in bad}
        return [f"{key} = {field.rstrip()}; allowed: a finite number" for key, field in fields.items()]
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
        written = columns["temperature"].unit
        plausible = COLDEST <= float(texts["temperature"]) + offset <= HOTTEST
        mixed = f"; probably {other}, not {written}" if plausible and written != other else ""
        reasons.append(
            f"{shown['temperature']}; allowed: {COLDEST:g} to {HOTTEST:g} K "
            f"({COLDEST - CELSIUS:g} to {HOTTEST - CELSIUS:g} degC){mixed}"
        )
    return reasons


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
