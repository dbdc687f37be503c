"""Measured friction torques: operating points, repeats of a point, and files of them with every row checked.

Dialect and headings of files: `tables.csv_file` and `tables.headings`.
"""

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import NamedTuple, Self

from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.units import CELSIUS, COLDEST, RPM

from ..tables.csv_file import open_table, read_columns
from ..tables.headings import PERCENT, TORQUES, Column

#: highest oil temperature [K], far above that of any ball screw
HOTTEST_OIL = 473.15
#: torque over (ball load times arm): below the friction of any rolling contact, above that of dry sliding
MIN_COEFFICIENT, MAX_COEFFICIENT = 1e-4, 1.0
#: nominal diameter times speed [mm r/min]; catalogues end near 2e5
MAX_DN = 5e5
#: columns whose fields may be empty
OPTIONAL = (
    "torque", "torque_low", "torque_high", "torque_tolerance", "preload_tolerance", "temperature", "axial_load",
    "weight",
)  # fmt: skip
#: minimum and maximum of the torque
LIMITS = ("torque_low", "torque_high")
#: largest tolerance, as a fraction: at 1 the torque may be 0
MAX_TOLERANCE = 0.95
#: errors over stated uncertainties that need no advice
EXPECTED = (0.5, 2.0)


@dataclass(frozen=True)
class Measurement:
    """One measured operating point.

    Parameters
    ----------
    preload : float
        Preload [N].
    speed : float
        Speed [rad/s].
    temperature : float
        Temperature of the oil [K].
    torque : float
        Measured torque [N.m].
    tables : tuple of str, optional
        Names of the tables with this point; it counts once in a fit, once in the mean of each table.
    weight : float, optional
        Factor on its relative error.
    axial_load : float, optional
        Axial load of the double nut [N].
    uncertainty : float, optional
        Standard uncertainty of the torque [N.m].
    rows : tuple of int, optional
        Rows of the file, from 1.
    limits : tuple of float, optional
        Tolerance of the torque, low and high end [N.m].
    preload_tolerance : float, optional
        As a fraction of the preload. It and limits are one error common to all points (friction.interval).

    Examples
    --------
    >>> Measurement(1000.0, 10.472, 303.15, 0.46).point
    '1000 N, 100 r/min'
    """

    preload: float
    speed: float
    temperature: float
    torque: float
    tables: tuple[str, ...] = ()
    weight: float = 1.0
    axial_load: float = 0.0
    uncertainty: float | None = None
    rows: tuple[int, ...] = field(default=(), compare=False)
    limits: tuple[float, ...] = ()
    preload_tolerance: float = 0.0

    @property
    def point(self) -> str:
        """Name of the point in messages, row 3 (1000 N, 100 r/min)."""
        point = f"{self.preload:g} N, {self.speed / RPM:g} r/min"
        return f"row {' = '.join(map(str, self.rows))} ({point})" if self.rows else point


def merged(measurements: Iterable[Measurement]) -> list[Measurement]:
    """The distinct points: a point of several tables becomes one point with all their names."""
    distinct: list[Measurement] = []
    for m in measurements:
        for i, other in enumerate(distinct):
            # in the same table, or in none, it is a repeated measurement, which counts twice
            apart = m.tables and other.tables and not set(m.tables) & set(other.tables)
            if apart and replace(m, tables=other.tables) == other:
                distinct[i] = replace(other, tables=other.tables + m.tables, rows=other.rows + m.rows)
                break
        else:
            distinct.append(m)
    return distinct


def repeats_of(measurements: Sequence[Measurement]) -> list[list[int]]:
    """Numbers of the measurements at each point: preload, speed and load agree to 3 digits, temperature to 1 K."""
    groups: dict[str, list[int]] = {}
    for number, m in enumerate(measurements):
        point = f"{m.preload:.3g} {m.speed:.3g} {m.axial_load:.3g} {m.temperature:.0f}"
        groups.setdefault(point, []).append(number)
    return list(groups.values())


def repeat_notes(measurements: Sequence[Measurement], lines: Sequence[int]) -> list[str]:
    """Rows and lines, torques [N.m] and spread of each repeated point; lines: of the file, by row."""
    notes = []
    for points in ([measurements[i] for i in group] for group in repeats_of(measurements) if len(group) > 1):
        rows, torques = [row for m in points for row in m.rows], [m.torque for m in points]
        low, high = min(torques), max(torques)
        copies = ": remove copies" if len(set(torques)) < len(torques) else ""
        notes.append(
            f"repeats of {points[0].preload:.4g} N, {points[0].speed / RPM:.4g} r/min: rows "
            f"{', '.join(map(str, rows))} (lines {', '.join(str(lines[row - 1]) for row in rows)}): {low:.4g} to "
            f"{high:.4g} N.m, spread {100.0 * (high - low) * len(torques) / sum(torques):.2g} %; each counts, and they "
            f"are left out together{copies}"
        )
    return notes


def spread_advice(spread: float) -> str:
    """What errors over stated uncertainties far from 1 mean, "" if they are not."""
    if spread < EXPECTED[0]:
        return (
            "the rows agree better than stated: the uncertainties are too large, or one error is common to all rows, "
            "which is a tolerance (torque_low and torque_high, or --torque-tolerance-percent)"
        )
    return (spread > EXPECTED[1]) * (
        "the stated uncertainties are too small by that factor, or the law does not fit in shape: subtract guides and "
        "seals, check oil and temperature, fit fewer speeds; the spread of repeats tells which"
    )


class RowProblem(NamedTuple):
    """A row that is not used: its number (first row of data = 1), its line in the file, why."""

    row: int
    line: int
    reason: str

    def __str__(self) -> str:
        return f"row {self.row} (line {self.line}): {self.reason}"


class MeasurementFile(NamedTuple):
    """Content of a file, or a single torque.

    where, source: the file at the begin of messages, its name and the start of its SHA-256; "" without a file
    measurements: the usable rows in their order, a point of several tables once; problems: the other rows
    notes: assumptions and unused columns; lines: of the rows in the file; torque_unit: as in the heading
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

    def with_tolerances(self, torque: float, preload: float) -> Self:
        """The same, with tolerances as fractions where a row states none; ValueError: out of range."""
        for name, value in {"torque_tolerance": torque, "preload_tolerance": preload}.items():
            if not 0.0 <= value <= MAX_TOLERANCE:
                raise ValueError(f"{name} = {value:g}; allowed: 0 to {MAX_TOLERANCE:g}, as a fraction")

        def stated(m: Measurement) -> Measurement:
            limits = m.limits or tuple(m.torque * (1.0 + side * torque) for side in (-1.0, 1.0) if torque)
            return replace(m, limits=limits, preload_tolerance=m.preload_tolerance or preload)

        return self._replace(measurements=[stated(m) for m in self.measurements])

    def without_seals(self, seal_torque: float) -> Self:
        """The same without the torque of the seals [N.m]; ValueError: nothing is left."""
        least = min((end for m in self.measurements for end in (m.torque, *m.limits)), default=math.inf)
        if not least > seal_torque:
            raise ValueError(
                f"{self.where}torque = {least:g} N.m; needs more than seal_torque = {seal_torque:g} N.m of the screw "
                "file: check both"
            )
        return self._replace(
            measurements=[
                replace(m, torque=m.torque - seal_torque, limits=tuple(end - seal_torque for end in m.limits))
                for m in self.measurements
            ],
            notes=[*self.notes, f"seal_torque = {seal_torque:g} N.m subtracted from all torques"],
        )

    def problems_of(self, m: Measurement, reason: str) -> list[RowProblem]:
        """The rows of a point that is not used; none without a reason."""
        return [RowProblem(row, self.lines[row - 1], reason) for row in m.rows if reason]


def read_measurement_file(path: Path | str, temperature: float) -> MeasurementFile:
    """Read a file and separate usable rows from others; temperature [K] of the oil where the file gives none.

    CSV with headings of tables.headings: preload, speed, torque; optional temperature, axial_load, torque_uncertainty
    (standard one, or % of the torque) or weight (factor on the relative error), torque_low and torque_high (tolerance,
    or minimum and maximum, from which a missing torque follows as their mean), torque_tolerance [%] in their place,
    preload_tolerance [%], table, comment. A negative speed with a negative torque counts as both positive.
    """
    table = open_table(path, TORQUES)
    columns = table.single_columns()
    if {"weight", "torque_uncertainty"} <= columns.keys():
        raise ValueError(f"{path}: columns weight and torque_uncertainty; allowed: one of them")
    rows = read_columns(table, columns, TORQUES)
    usable, problems, assumed = list[Measurement](), list[RowProblem](), list[int]()
    for number, line in enumerate(rows.lines, start=1):
        texts = {key: result[number - 1].replace(",", ".") for key, result in rows.texts.items()}
        value = {k: float(x[number - 1]) for k, x in rows.values.items() if texts[k] or k not in OPTIONAL}
        if reasons := _reasons(texts, columns, value):
            problems.append(RowProblem(number, line, "; ".join(reasons)))
            continue
        if "temperature" not in value:
            assumed.append(number)
        ends = sorted(abs(value[key]) for key in LIMITS if key in value)
        torque = abs(value["torque"]) if "torque" in value else 0.5 * sum(ends)
        if part := value.get("torque_tolerance", 0.0):
            ends = [torque * (1.0 - part), torque * (1.0 + part)]
        uncertainty, name = value.get("torque_uncertainty"), texts.get("table")
        if uncertainty is not None and columns["torque_uncertainty"].unit == PERCENT:
            uncertainty *= torque
        usable.append(Measurement(
            value["preload"], abs(value["speed"]), value.get("temperature", temperature), torque,
            (name,) if name else (), value.get("weight", 1.0), value.get("axial_load", 0.0), uncertainty, (number,),
            tuple(ends), value.get("preload_tolerance", 0.0),
        ))  # fmt: skip
    notes = [*filter(None, [table.unused(columns)]), *rows.notes]
    if assumed:
        which = "all rows" if len(assumed) == len(rows.lines) else named_rows(assumed)
        notes.append(f"{which}: no oil temperature given, {temperature:g} K assumed")
    source = f"{table.path.name} (SHA-256 {hashlib.sha256(table.path.read_bytes()).hexdigest()[:12]})"
    # standard uncertainties as weights of the relative errors, 1 for the median of them
    typical = median([m.uncertainty / m.torque for m in usable if m.uncertainty] or [1.0])
    usable = [replace(m, weight=typical * m.torque / m.uncertainty) if m.uncertainty else m for m in usable]
    points, unit = merged(usable), columns["torque" if "torque" in columns else LIMITS[0]].unit
    notes += repeat_notes(points, rows.lines)
    return MeasurementFile(f"{path}: ", source, points, problems, notes, rows.lines, unit)


def _reasons(
    texts: Mapping[str, str], columns: Mapping[str, Column], values: Mapping[str, float]
) -> list[str]:
    """Why a row with these fields and values [SI] cannot be a measurement; empty if it can."""
    shown = {key: f"{key} = {texts[key]} {columns[key].unit}".rstrip() for key in values}
    if missing := [key for key, value in values.items() if not math.isfinite(value)]:
        fields = {key: f"{texts[key]!r} {columns[key].unit}" if texts[key] else "empty" for key in missing}
        return [f"{key} = {field.rstrip()}; allowed: a finite number" for key, field in fields.items()]
    torques = {key: values[key] for key in ("torque", *LIMITS) if key in values}
    if not torques or len(torques.keys() & set(LIMITS)) == 1:
        stated = ", ".join(torques) or "neither"
        return [f"{stated} stated; allowed: torque, or torque_low and torque_high, or all three"]
    speed, kelvin = values["speed"], values.get("temperature", COLDEST)
    positive = ("preload", "weight", "torque_uncertainty")
    bad = {key: "> 0" for key in positive if not values.get(key, 1.0) > 0.0}
    bad |= {"speed": "not 0 (no film at rest)"} if speed == 0.0 else {}
    bad |= {key: "not 0" for key, torque in torques.items() if torque == 0.0}
    for key in ("torque_tolerance", "preload_tolerance"):
        if not 0.0 <= values.get(key, 0.0) <= MAX_TOLERANCE:
            bad[key] = f"0 to {100.0 * MAX_TOLERANCE:g}"
    if "torque_low" in values and (
        values.get("torque_tolerance") or 0.0 < values["torque_high"] < values["torque_low"]
    ):
        bad["torque_low"] = "up to torque_high, and without torque_tolerance"
    reasons = [f"{shown[key]}; allowed: {allowed}" for key, allowed in bad.items()]
    reasons += [
        f"{shown[key]} at {shown['speed']}; allowed: friction torque with the sign of the speed"
        for key, torque in torques.items()
        if torque * speed < 0.0
    ]
    sizes = sorted(map(abs, torques.values()))
    if len(sizes) == 3 and abs(torques["torque"]) != sizes[1]:
        reasons.append(f"{shown['torque']}; allowed: from {shown['torque_low']} to {shown['torque_high']}")
    if not COLDEST <= kelvin <= HOTTEST_OIL:
        other, offset = ("K", 0.0) if kelvin > HOTTEST_OIL else ("degC", CELSIUS)
        written = columns["temperature"].unit
        plausible = COLDEST <= float(texts["temperature"]) + offset <= HOTTEST_OIL
        mixed = f"; probably {other}, not {written}" if plausible and written != other else ""
        reasons.append(
            f"{shown['temperature']}; allowed: {COLDEST:g} to {HOTTEST_OIL:g} K "
            f"({COLDEST - CELSIUS:g} to {HOTTEST_OIL - CELSIUS:g} degC){mixed}"
        )
    return reasons


def named_rows(rows: Sequence[int]) -> str:
    """row 3 / rows 3, 5, 9."""
    return f"row{'s' if len(rows) > 1 else ''} {', '.join(map(str, rows))}"


def implausible_for(parameters: Parameters, m: Measurement) -> str:
    """Why a point is impossible for a screw of this size, mostly a wrong unit of force, torque or speed; "" if not."""
    screw, reasons = parameters.screw, []
    arm = screw.nominal_radius + 0.5 * screw.ball_diameter * math.cos(screw.contact_angle)
    # the friction coefficient that alone would give this torque
    force = (2.0 * m.preload + abs(m.axial_load)) / math.sin(screw.contact_angle)
    coefficient, max_speed = m.torque / (force * arm), MAX_DN / (2e3 * screw.nominal_radius) * RPM
    if not MIN_COEFFICIENT <= coefficient <= MAX_COEFFICIENT:
        reasons.append(
            f"torque = {m.torque:g} N.m at preload = {m.preload:g} N means a friction coefficient of "
            f"{coefficient:.2g} on this screw; allowed: {MIN_COEFFICIENT:g} to {MAX_COEFFICIENT:g}; "
            "units of preload or torque probably mixed up"
        )
    if not m.speed <= max_speed:
        reasons.append(
            f"speed = {m.speed / RPM:.6g} r/min; allowed on this screw: up to {max_speed / RPM:.0f} r/min; "
            "r/min and rad/s probably mixed up"
        )
    return "; ".join(reasons)
