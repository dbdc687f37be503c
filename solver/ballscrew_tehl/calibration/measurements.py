"""Measured friction torques: operating points with their torque, and repeated measurements of one point."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from ..parameters.units import RPM

#: errors over stated uncertainties that need no advice
EXPECTED = (0.5, 2.0)
#: share of these errors in the scatter of repeats from which on the stated uncertainties are the cause
CAUSE = 0.5


@dataclass(frozen=True)
class Measurement:
    """One measured operating point.

    preload [N], speed [rad/s], temperature of the oil [K], torque [N.m]
    tables  names of the tables with this point; it counts once in a fit, once in the mean of each table
    weight  factor on its relative error
    axial_load [N] of the double nut;  uncertainty: standard one of the torque [N.m], None if not known
    rows    of the file, from 1
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

    def without_seals(self, seal_torque: float) -> "Measurement":
        """The same with the torque of the balls alone, without that of the seals [N.m].

        Raises       ValueError: nothing is left
        """
        if not self.torque > seal_torque:
            raise ValueError(
                f"torque = {self.torque:g} N.m; needs more than seal_torque = {seal_torque:g} N.m of the screw file: "
                "check both"
            )
        return replace(self, torque=self.torque - seal_torque)

    @property
    def point(self) -> str:
        """For messages: row 3 (1000 N, 100 r/min)."""
        point = f"{self.preload:g} N, {self.speed / RPM:g} r/min"
        return f"row {' = '.join(str(row) for row in self.rows)} ({point})" if self.rows else point


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
    """Numbers of the measurements at each operating point, in order of the first.

    Points are the same whose preload, speed and load agree to 3 digits, temperature to 1 K.
    """
    groups: dict[tuple[str, ...], list[int]] = {}
    for number, m in enumerate(measurements):
        point = f"{m.preload:.3g}", f"{m.speed:.3g}", f"{m.axial_load:.3g}", f"{m.temperature:.0f}"
        groups.setdefault(point, []).append(number)
    return list(groups.values())


def repeat_notes(measurements: Sequence[Measurement], lines: Sequence[int]) -> list[str]:
    """Rows and lines, torques and spread of each repeated point.

    Parameters   lines : of the file, by row
    """
    notes = []
    for group in repeats_of(measurements):
        rows = [row for i in group for row in measurements[i].rows]
        torques, first = [measurements[i].torque for i in group], measurements[group[0]]
        if len(group) > 1:
            spread = 100.0 * (max(torques) - min(torques)) / (sum(torques) / len(torques))
            copies = ": remove copies" if len(set(torques)) < len(torques) else ""
            notes.append(
                f"repeats of {first.preload:.4g} N, {first.speed / RPM:.4g} r/min: rows {', '.join(map(str, rows))} "
                f"(lines {', '.join(str(lines[row - 1]) for row in rows)}): {min(torques):.4g} to {max(torques):.4g} "
                f"N.m, spread {spread:.2g} %; each counts, and they are left out together{copies}"
            )
    return notes


def repeat_scatter(measurements: Sequence[Measurement]) -> float | None:
    """Scatter of repeats over the stated uncertainties, root mean square; None: no repeats, or none stated.

    Equal torques are copies.
    """
    squares, freedom = 0.0, 0
    stated = [m for m in measurements if m.uncertainty]
    for group in repeats_of(stated):
        unlike = {stated[i].torque: stated[i] for i in group}
        mean = sum(unlike) / len(unlike)
        squares += sum(((m.torque - mean) / (m.uncertainty or math.inf)) ** 2 for m in unlike.values())
        freedom += len(unlike) - 1
    return math.sqrt(squares / freedom) if freedom else None


def spread_advice(spread: float, scatter: float | None) -> str:
    """What errors over stated uncertainties far from 1 mean, and what to do; "" if they are not.

    Parameters   spread : root of the weighted mean square error;  scatter : see repeat_scatter
    """
    if EXPECTED[0] <= spread <= EXPECTED[1]:
        return ""
    if spread < EXPECTED[0]:
        return "the stated uncertainties are too large by its inverse"
    small = "the stated uncertainties are too small by that factor"
    shape = "the law does not fit in shape: subtract guides and seals, check oil and temperature, fit fewer speeds"
    if scatter is None:
        return f"{small}, or {shape}; repeats of a point tell which"
    return f"repeats scatter by {scatter:.2g}: {small if scatter > CAUSE * spread else shape}"
