"""Numbers of the report on one screw: operating point, torque with its interval, films, loads, efficiency."""

from __future__ import annotations

import math
from collections.abc import Callable
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


class UserPoint(NamedTuple):
    """What the user states of an operating point, SI; None: the default."""

    preload: float | None = None
    speed: float | None = None
    temperature: float | None = None


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


def operating_point(parameters: Parameters, axes: Any, user: UserPoint) -> OperatingPoint:
    """Point of the report; default: catalogue preload, DEFAULT_SPEED, reference temperature, moved into the map.

    Raises       ValueError: a number of the user outside the map
    """
    default = (
        catalogue_preload(parameters.screw), DEFAULT_SPEED, parameters.lubricant.reference_temperature
    )  # fmt: skip
    values = []
    for name, given, usual in zip(OperatingPoint._fields, user, default, strict=True):
        inside = nearest(axes, name, usual if given is None else given)
        if given is not None and not math.isclose(inside, given, rel_tol=1e-9):
            unit = SHOWN[name].unit
            low, high, stated = (SHOWN[name].of(value) for value in (*axes[name][:2], given))
            raise ValueError(
                f"{name} = {stated:.6g} {unit}; allowed: {low:.6g} to {high:.6g} {unit}, the range of the map: "
                "build one for a wider range"
            )
        values.append(inside)
    return OperatingPoint(*values)


def report_data(
    parameters: Parameters, friction_set: FrictionSet, nut_map: NutMap, user: UserPoint
) -> ReportData:
    """Evaluate a map around an operating point.

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
    intervals = torque_intervals(parameters, friction_set, nut_map, preloads, interval_x, temperatures)
    interval = map_interval(parameters, axes, friction_set, *point) if nut_map.law == MECHANISTIC else None
    warm = int(np.searchsorted(temperatures, point.temperature))
    here = int(np.searchsorted(preloads, point.preload))

    def lines(x: Array, rows: Array, at: Callable[[Any, Any], Any], ends: Array | None) -> Lines:
        place = at(x, rows[:, None])
        torque = nut_map.evaluate(*place).friction_torque
        return Lines(x, rows, torque, unphysical_trend(nut_map, *place).unphysical, interval_x, ends)

    force = np.linspace(max(axes["preload"][0], axes["force"][0]), preloads[-1], POINTS)
    known = nut_map.law == MECHANISTIC
    constants = screw_constants(screw)
    separation = loaded_screw(screw, constants, point.preload, 0.0).separation_load
    axial_loads = np.linspace(0.0, LAST_LOAD_RATIO * separation, LOAD_POINTS)
    return ReportData(
        parameters, friction_set, nut_map, point, constants, preloads, speeds, temperatures,
        intervals[:, np.isin(interval_x, speeds)], interval,
        lines(x, preloads, lambda x, row: (row, x, point.temperature), intervals[:, :, warm, 1:] if known else None),
        lines(x, temperatures, lambda x, row: (point.preload, x, row),
              intervals[here, :, :, 1:].swapaxes(0, 1) if known else None),
        lines(force, speeds, lambda x, row: (x, row, point.temperature), None),
        nut_map.evaluate(point.preload, x, temperatures[:, None]),
        tuple(load_case(parameters, constants, nut_map, point, ratio * separation) for ratio in LOAD_RATIOS),
        axial_loads,
        np.array([[efficiency_percent(parameters, nut_map, point._replace(speed=float(speed)), float(load))
                   for load in axial_loads] for speed in speeds]),
    )  # fmt: skip


def torque_intervals(
    parameters: Parameters,
    friction_set: FrictionSet,
    nut_map: NutMap,
    preloads: Array,
    speeds: Array,
    temperatures: Array,
) -> Array:
    """Torque with low and high end of its interval [N.m], (preload, speed, temperature, 3); ends NaN if not known."""
    torque = nut_map.evaluate(preloads[:, None, None], speeds[:, None], temperatures).friction_torque
    ends = np.full((*torque.shape, 2), math.nan)
    if nut_map.law == MECHANISTIC:
        axes = nut_map.header["axes"]
        ends = relative_intervals(parameters, axes, friction_set, preloads, speeds, temperatures)
    seals, torque = nut_map.seal_torque, torque[..., None]
    return np.concatenate((torque, seals + (torque - seals) * ends), axis=-1)


def load_case(
    parameters: Parameters,
    constants: ScrewConstants,
    nut_map: NutMap,
    point: OperatingPoint,
    axial_load: float,
) -> LoadCase:
    """Loads, stiffness and efficiency at an operating point under an axial load [N]."""
    screw = parameters.screw
    state = nut_map.evaluate(*point, axial_load)
    known = efficiency(screw, axial_load, float(state.friction_torque)) if state.in_range else None
    return LoadCase(axial_load, loaded_screw(screw, constants, point.preload, axial_load), known)


def efficiency_percent(
    parameters: Parameters, nut_map: NutMap, point: OperatingPoint, axial_load: float
) -> tuple[float, float]:
    """Efficiency in percent, screw drives and nut drives; NaN without axial load or outside the map."""
    state = nut_map.evaluate(*point, axial_load)
    both = efficiency(parameters.screw, axial_load, float(state.friction_torque))
    if both is None or not state.in_range:
        return math.nan, math.nan
    return 100.0 * both.driving, 100.0 * both.backdriving
