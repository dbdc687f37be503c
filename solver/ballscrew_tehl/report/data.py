"""Numbers of the report on one screw: operating point, torque with its interval, films, loads, efficiency."""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..friction.baselines import nsk_torque
from ..friction.mechanistic import roughness_of
from ..friction.sets import FrictionSet
from ..mechanics import (
    Efficiency,
    LoadedScrew,
    ScrewConstants,
    catalogue_preload,
    efficiency,
    loaded_screw,
    screw_constants,
)
from ..nut_map.interval import TorqueInterval, map_interval, nearest, relative_intervals
from ..nut_map.trend import unphysical_trend
from ..parameters.file import Parameters
from ..parameters.units import CELSIUS, RPM, SHOWN
from ..physics.ball_law import Array
from ..runtime.evaluate import NutMap
from ..runtime.nut_law import DoubleNutState
from ..runtime.packed import MECHANISTIC

#: speed [rad/s] of the drag torque of JIS B 1192, on which catalogues state torques
CATALOGUE_SPEED = 100.0 * RPM
#: speeds of the tables and lines [rad/s], those within the map; speed of the operating point if none is given
TABLE_SPEEDS = (CATALOGUE_SPEED, *(rpm * RPM for rpm in (500.0, 1000.0, 2500.0)))
DEFAULT_SPEED = 1000.0 * RPM
#: preloads of the lines over that of the operating point; axial loads of the table over the separation load, and end
#: of the lines of efficiency
PRELOAD_RATIOS, LOAD_RATIOS, LAST_LOAD_RATIO = (0.5, 1.0, 2.0), (0.0, 0.5, 1.0), 1.25
#: points of a line, those of its interval over speed, those of a line of efficiency
POINTS, INTERVAL_POINTS, LOAD_POINTS = 161, 25, 61


class PreloadWords(NamedTuple):
    """Names of a kind of preload on the pages."""

    screw: str  # the whole
    side: str  # relieved or loaded by an axial load


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
        return (
            f"preload {self.preload:.0f} N, {self.speed / RPM:.0f} r/min, oil at "
            f"{self.temperature - CELSIUS:.1f} C"
        )


class Lines(NamedTuple):
    """Torque [N.m] over x, one row per value of `rows`; ends of its interval at interval_x, None without interval."""

    x: Array  # (m,)
    rows: Array  # (n,)
    torque: Array  # (n, m)
    unphysical: Array  # (n, m), nut_map.trend
    interval_x: Array  # (k,)
    interval: Array | None = None  # (n, k, 2)


class LoadCase(NamedTuple):
    """The nut under an axial load [N] at the operating point; efficiency None without load or outside the map."""

    axial_load: float
    screw: LoadedScrew
    efficiency: Efficiency | None


class ReportData(NamedTuple):
    """All numbers of the report.

    speeds, preloads, temperatures : of tables and lines, the operating point among them
    intervals : torque with low and high end (preload, speed, temperature, 3), NaN without interval
    films : state of the nut (temperature, speed) over by_speed.x at the preload of the point
    efficiencies : efficiency in percent, screw drives and nut drives, (speed, axial load, 2), NaN outside the map
    """

    parameters: Parameters
    friction_set: FrictionSet
    nut_map: NutMap
    point: OperatingPoint
    constants: ScrewConstants
    preloads: Array
    speeds: Array
    temperatures: Array
    intervals: Array
    interval: TorqueInterval | None
    by_preload: Lines
    by_temperature: Lines
    over_preload: Lines
    films: DoubleNutState
    cases: tuple[LoadCase, ...]
    axial_loads: Array
    efficiencies: Array

    @property
    def words(self) -> PreloadWords:
        """Names of the kind of preload."""
        return PRELOAD_WORDS[self.parameters.screw.preload_kind]

    @property
    def state(self) -> DoubleNutState:
        """State of the nut at the operating point."""
        return self.nut_map.evaluate(*self.point)

    @property
    def torque(self) -> float:
        """Torque at the operating point [N.m]."""
        return float(self.state.friction_torque)

    @property
    def roughness(self) -> float:
        """Height [m] that lambda is over."""
        if self.mechanistic:
            return roughness_of(self.parameters.friction)
        return float(self.nut_map.header["defaults"]["roughness_height"])

    @property
    def mechanistic(self) -> bool:
        """Whether the friction law is the mechanistic one, which has an interval."""
        return self.nut_map.law == MECHANISTIC

    def catalogue_torque(self, preload: Any) -> Any:
        """Drag torque [N.m] of JIS B 1192 at a preload [N], by convention at CATALOGUE_SPEED."""
        return nsk_torque(self.parameters.screw, preload)


def operating_point(parameters: Parameters, axes: Any, user: Mapping[str, float]) -> OperatingPoint:
    """Point of the report: numbers of the user by axis, else catalogue preload, DEFAULT_SPEED, reference temperature.

    Raises       ValueError: a number of the user outside the map
    """
    defaults = OperatingPoint(
        catalogue_preload(parameters.screw), DEFAULT_SPEED, parameters.lubricant.reference_temperature
    )
    values = []
    for axis, default in defaults._asdict().items():
        value = user.get(axis, default)
        inside = nearest(axes, axis, value)
        if axis in user and not math.isclose(inside, value, rel_tol=1e-9):
            unit = SHOWN[axis].unit
            low, high, stated = (SHOWN[axis].of(number) for number in (*axes[axis][:2], value))
            raise ValueError(
                f"{axis} = {stated:.6g} {unit}; allowed: {low:.6g} to {high:.6g} {unit}, the range of the map: "
                "build one for a wider range"
            )
        values.append(inside)
    return OperatingPoint(*values)


def report_data(
    parameters: Parameters, friction_set: FrictionSet, nut_map: NutMap, user: Mapping[str, float]
) -> ReportData:
    """Evaluate a map around an operating point; user: numbers of the point by axis, SI.

    Raises       ValueError: point outside the map;  ArithmeticError: equilibrium of a ball not found
    """
    axes, screw = nut_map.header["axes"], parameters.screw
    point = operating_point(parameters, axes, user)
    slow, fast = axes["speed"][:2]
    preloads = np.unique([nearest(axes, "preload", ratio * point.preload) for ratio in PRELOAD_RATIOS])
    speeds = np.unique([*(speed for speed in TABLE_SPEEDS if slow <= speed <= fast), point.speed])
    temperatures = np.unique([*axes["temperature"][:2], point.temperature])
    x = np.geomspace(slow, fast, POINTS)
    interval_x = np.unique([*np.geomspace(slow, fast, INTERVAL_POINTS), *speeds])
    known = nut_map.law == MECHANISTIC
    intervals = torque_intervals(parameters, friction_set, nut_map, preloads, interval_x, temperatures)
    warm = int(np.searchsorted(temperatures, point.temperature))
    here = int(np.searchsorted(preloads, point.preload))

    def lines(x: Array, rows: Array, at: Callable[[Any, Any], Any], ends: Array | None) -> Lines:
        place = at(x, rows[:, None])
        torque = nut_map.evaluate(*place).friction_torque
        return Lines(x, rows, torque, unphysical_trend(nut_map, *place).unphysical, interval_x, ends)

    def efficiency_at(speed: float, axial_load: float) -> Efficiency | None:
        state = nut_map.evaluate(point.preload, speed, point.temperature, axial_load)
        return efficiency(screw, axial_load, float(state.friction_torque)) if state.in_range else None

    force = np.linspace(max(axes["preload"][0], axes["force"][0]), preloads[-1], POINTS)
    constants = screw_constants(screw)
    separation = loaded_screw(screw, constants, point.preload, 0.0).separation_load
    axial_loads = np.linspace(0.0, LAST_LOAD_RATIO * separation, LOAD_POINTS)
    unknown = Efficiency(math.nan, math.nan)
    both = [[efficiency_at(x, load) or unknown for load in axial_loads.tolist()] for x in speeds.tolist()]
    cases = []
    for load in (ratio * separation for ratio in LOAD_RATIOS):
        loaded = loaded_screw(screw, constants, point.preload, load)
        cases.append(LoadCase(load, loaded, efficiency_at(point.speed, load)))
    return ReportData(
        parameters, friction_set, nut_map, point, constants, preloads, speeds, temperatures,
        intervals=intervals[:, np.isin(interval_x, speeds)],
        interval=map_interval(parameters, axes, friction_set, *point) if known else None,
        by_preload=lines(x, preloads, lambda x, row: (row, x, point.temperature),
                         intervals[:, :, warm, 1:] if known else None),
        by_temperature=lines(x, temperatures, lambda x, row: (point.preload, x, row),
                             intervals[here, :, :, 1:].swapaxes(0, 1) if known else None),
        over_preload=lines(force, speeds, lambda x, row: (x, row, point.temperature), None),
        films=nut_map.evaluate(point.preload, x, temperatures[:, None]),
        cases=tuple(cases), axial_loads=axial_loads, efficiencies=100.0 * np.array(both),
    )  # fmt: skip


def torque_intervals(
    parameters: Parameters, friction_set: FrictionSet, nut_map: NutMap, preloads: Array, speeds: Array,
    temperatures: Array,
) -> Array:  # fmt: skip
    """Torque with low and high end of its interval [N.m], (preload, speed, temperature, 3); ends NaN if not known."""
    torque = nut_map.evaluate(preloads[:, None, None], speeds[:, None], temperatures).friction_torque
    ends: Any = np.full((*torque.shape, 2), math.nan)
    if nut_map.law == MECHANISTIC:
        axes = nut_map.header["axes"]
        ends = relative_intervals(parameters, axes, friction_set, preloads, speeds, temperatures)
    seals, torque = nut_map.seal_torque, torque[..., None]
    return np.concatenate((torque, seals + (torque - seals) * ends), axis=-1)
