"""Measured friction torques: operating points with their torque."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from ..parameters.units import RPM


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

    def without_seals(self, seal_torque: float) -> Measurement:
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
