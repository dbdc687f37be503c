"""Numbers of the report on one screw: operating point, torque with its interval, films, loads, efficiency."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ballscrew_tehl.friction.mechanistic import roughness_of
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.numerics import Array
from ballscrew_tehl.nut_map.interval import TorqueInterval, map_interval, nearest, relative_intervals
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.units import CELSIUS, RPM, SHOWN
from ballscrew_tehl.physics.rating import catalogue_preload
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.nut_law import DoubleNutState
from ballscrew_tehl.runtime.packed import Law

from ..axis.budget import AxisBudget, axis_budget
from ..mechanics import Efficiency, LoadedScrew, efficiency, loaded_screw, screw_constants
from ..trend import unphysical_trend

#: speed [rad/s] of the drag torque of JIS B 1192, on which catalogues state torques
CATALOGUE_SPEED = 100.0 * RPM
#: speeds of the tables and lines [rad/s], those within the map; speed of the operating point if none is given
TABLE_SPEEDS = (CATALOGUE_SPEED, *(rpm * RPM for rpm in (500.0, 1000.0, 2500.0)))
DEFAULT_SPEED = 1000.0 * RPM
#: preloads of the lines over that of the operating point; axial loads of the table over the separation load
PRELOAD_RATIOS, LOAD_RATIOS = (0.5, 1.0, 2.0), (0.0, 0.5, 1.0)
#: points of a line and of its interval
POINTS, INTERVAL_POINTS = 161, 25


class PreloadWords(NamedTuple):
    """Names of a kind of preload on the pages: of the whole, of what an axial load relieves or loads."""

    screw: str
    side: str


PRELOAD_WORDS = {
    "double_nut": PreloadWords("double-nut ball screw", "nut"),
    "single_nut_offset": PreloadWords("single-nut ball screw with offset lead", "half"),
    "single_nut_oversize_ball": PreloadWords("single-nut ball screw with oversize balls", "set of flanks"),
}


class OperatingPoint(NamedTuple):
    """Preload [N], speed [rad/s], temperature [K]."""

    preload: float
    speed: float
    temperature: float

    @property
    def text(self) -> str:
        """In the units of the page."""
        speed, celsius = self.speed / RPM, self.temperature - CELSIUS
        return f"preload {self.preload:.0f} N, {speed:.0f} r/min, oil at {celsius:.1f} C"


class Lines(NamedTuple):
    """Torque [N.m], one row per value of `rows`, with the ends of its interval if it has one."""

    rows: Array  # (n,)
    torque: Array  # (n, line_speeds)
    unphysical: Array  # (n, line_speeds), nut_map.trend
    interval: Array | None  # (n, interval_speeds, 2)


class LoadCase(NamedTuple):
    """The nut under an axial load [N] at the operating point; efficiency None without load or outside the map."""

    axial_load: float
    screw: LoadedScrew
    efficiency: Efficiency | None


@dataclass(frozen=True)
class ReportData:
    """Numbers of the report around an operating point, each computed when it is first read."""

    parameters: Parameters
    friction_set: FrictionSet
    nut_map: NutMap
    point: OperatingPoint
    preloads: Array  # of lines and tables, that of the point among them
    speeds: Array  # of tables, likewise
    temperatures: Array  # of lines and tables: ends of the map, point
    line_speeds: Array
    interval_speeds: Array  # those of the tables among them

    @property
    def words(self) -> PreloadWords:
        """Names of the kind of preload."""
        return PRELOAD_WORDS[self.parameters.screw.preload_kind]

    @property
    def mechanistic(self) -> bool:
        """Whether the friction law is the mechanistic one, which has an interval."""
        return self.nut_map.law == Law.MECHANISTIC

    @property
    def roughness(self) -> float:
        """Height [m] that lambda is over."""
        if self.mechanistic:
            return roughness_of(self.parameters.friction)
        return float(self.nut_map.header["defaults"]["roughness_height"])

    @property
    def _law(self) -> tuple[Parameters, Mapping[str, Any], FrictionSet]:
        return self.parameters, self.nut_map.header["axes"], self.friction_set

    @cached_property
    def intervals(self) -> Array:
        """Torque with low and high end [N.m], (preload, interval_speeds, temperature, 3); ends NaN if not known."""
        grid = self.preloads, self.interval_speeds, self.temperatures
        torque = self.nut_map.evaluate(*np.ix_(*grid)).friction_torque[..., None]
        ends = relative_intervals(*self._law, *grid) if self.mechanistic else np.full((1, 1, 1, 2), math.nan)
        seals = self.nut_map.seal_torque
        return np.concatenate((torque, seals + (torque - seals) * ends), axis=-1)

    @cached_property
    def interval(self) -> TorqueInterval | None:
        """Of the point."""
        return map_interval(*self._law, *self.point) if self.mechanistic else None

    @cached_property
    def budget(self) -> AxisBudget | None:
        """Of the axis at the point, over interval_speeds; None: no table of the screw file is of an axis."""
        if not self.parameters.has_axis:
            return None
        at = self.point.preload, self.interval_speeds, self.point.temperature
        return axis_budget(self.parameters, self.nut_map, self.friction_set, *at)

    @property
    def at_temperature(self) -> Array:
        """Intervals at the temperature of the point."""
        return self.intervals[:, :, int(np.searchsorted(self.temperatures, self.point.temperature))]

    @cached_property
    def by_preload(self) -> Lines:
        """A line for each preload."""
        return self._lines(self.preloads, self.preloads[:, None], self.point.temperature, self.at_temperature)

    @cached_property
    def by_temperature(self) -> Lines:
        """A line for each temperature."""
        intervals = self.intervals[int(np.searchsorted(self.preloads, self.point.preload))].swapaxes(0, 1)
        return self._lines(self.temperatures, self.point.preload, self.temperatures[:, None], intervals)

    def _lines(self, rows: Array, preload: Any, temperature: Any, intervals: Array) -> Lines:
        at = preload, self.line_speeds, temperature
        torque = self.nut_map.evaluate(*at).friction_torque
        unphysical = unphysical_trend(self.nut_map, *at).unphysical
        return Lines(rows, torque, unphysical, intervals[..., 1:] if self.mechanistic else None)

    @cached_property
    def films(self) -> DoubleNutState:
        """State of the nut (temperature, line_speeds) at the preload of the point."""
        return self.nut_map.evaluate(self.point.preload, self.line_speeds, self.temperatures[:, None])

    @cached_property
    def cases(self) -> tuple[LoadCase, ...]:
        """The nut under axial loads."""
        screw, cases = self.parameters.screw, []
        nut = screw, screw_constants(screw), self.friction_set.preload_factor * self.point.preload
        separation = loaded_screw(*nut, 0.0).separation_load
        for load in (ratio * separation for ratio in LOAD_RATIOS):
            state = self.nut_map.evaluate(*self.point, load)
            both = efficiency(screw, load, float(state.friction_torque)) if state.in_range else None
            cases.append(LoadCase(load, loaded_screw(*nut, load), both))
        return tuple(cases)


def default_point(parameters: Parameters) -> OperatingPoint:
    """Catalogue preload, DEFAULT_SPEED, reference temperature of the oil."""
    screw, oil = parameters.screw, parameters.lubricant
    return OperatingPoint(catalogue_preload(screw), DEFAULT_SPEED, oil.reference_temperature)


def report_data(
    parameters: Parameters, friction_set: FrictionSet, nut_map: NutMap, user: Mapping[str, float]
) -> ReportData:
    """Numbers around the point of the user [SI, by axis], else around catalogue preload and DEFAULT_SPEED."""
    axes, defaults = nut_map.header["axes"], default_point(parameters)._asdict()
    for axis, value in user.items():
        if axis not in defaults:
            raise ValueError(f"{axis}; allowed: {', '.join(defaults)}, in SI units")
        if not math.isclose(nearest(axes, axis, value), value, rel_tol=1e-9):
            unit = SHOWN[axis].unit
            low, high, stated = (SHOWN[axis].of(number) for number in (*axes[axis][:2], value))
            remedy = "the range of the map: build one for a wider range"
            if axis == "preload" and value == 0.0:
                remedy = "of a nut with clearance: ballscrew torque --preload-n 0 --axial-load-n LOAD"
            raise ValueError(
                f"{axis} = {stated:.6g} {unit}; allowed: {low:.6g} to {high:.6g} {unit}; {remedy}"
            )
    point = OperatingPoint(*(nearest(axes, axis, user.get(axis, value)) for axis, value in defaults.items()))
    slow, fast = axes["speed"][:2]
    speeds = np.unique([*(speed for speed in TABLE_SPEEDS if slow <= speed <= fast), point.speed])
    return ReportData(
        parameters, friction_set, nut_map, point,
        preloads=np.unique([nearest(axes, "preload", ratio * point.preload) for ratio in PRELOAD_RATIOS]),
        speeds=speeds,
        temperatures=np.unique([*axes["temperature"][:2], point.temperature]),
        line_speeds=np.geomspace(slow, fast, POINTS),
        interval_speeds=np.unique([*np.geomspace(slow, fast, INTERVAL_POINTS), *speeds]),
    )  # fmt: skip
