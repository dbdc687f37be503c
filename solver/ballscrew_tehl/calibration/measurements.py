"""Measured friction torques: points, the packaged tables of the paper."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from ..parameters.packaged_data import PACKAGED_DATA
from ..parameters.units import RPM
from ..tables.csv_file import read_rows

PACKAGED_TORQUE = PACKAGED_DATA / "zhao2023_torque.csv"
PACKAGED_PRELOAD = PACKAGED_DATA / "zhao2023_preload.csv"


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


def packaged_measurements(temperature: float) -> list[Measurement]:
    """The 11 distinct measured torques of Tables 2 and 4 of Zhao et al. (2023), tables "table2" and "table4".

    Parameters   temperature : of the oil [K]; not printed, 303 K is assumed
    """
    return merged(
        Measurement(
            float(row["preload_N"]),
            float(row["speed_rpm"]) * RPM,
            temperature,
            float(row["measured_Nm"]),
            (row["table"],),
        )
        for row in read_rows(PACKAGED_TORQUE)
    )
