"""Lines of the report read from the map: torque with its interval, films, over speed, preload and temperature."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..friction.interval import DEVIATIONS, SCATTER_DEVIATION
from ..friction.interval import MEANING as OF_CONSTANTS
from ..friction.sets import FrictionSet
from ..mechanics import catalogue_preload
from ..nut_map.built import Progress
from ..nut_map.interval import map_interval, nearest
from ..nut_map.trend import Trend, unphysical_trend
from ..parameters.file import Parameters
from ..parameters.identity import parameters_hash
from ..parameters.units import CELSIUS, RPM, SHOWN
from ..physics.ball_law import Array
from ..runtime.evaluate import NutMap
from ..runtime.nut_law import DoubleNutState
from ..runtime.packed import MECHANISTIC

#: speeds of lines over preload and temperature [rad/s]; only those within the map are drawn
LINE_SPEEDS = tuple(rpm * RPM for rpm in (100.0, 500.0, 1000.0, 2500.0))
#: preloads of the lines of the measured screw [N] and end of its speeds [rad/s]
MEASURED_PRELOADS, MEASURED_TOP = (1000.0, 2000.0, 4000.0, 6000.0), 3000.0 * RPM
#: preloads of the lines of any other screw over that of its operating point; speed of that point [rad/s]
PRELOAD_SHARES, POINT_SPEED = (0.5, 1.0, 2.0), 1000.0 * RPM
#: points of a line, those of its interval
POINTS, INTERVALS = 161, 5
#: what the ends of the interval of a fitted set are, by what was left out of the fit
OF_POINT = "about 80 %, from the mean error of a point left out of the fit"
OF_TABLE = "about 80 %, from the mean error of a table left out of the fit"
OF_BOTH = f"{OF_POINT}; on lines with at most one measured point of a table"
INTERVAL_STEP = "intervals of the torque"


class Friction(NamedTuple):
    """A friction set and the map with the film of its fit."""

    entry: FrictionSet
    nut_map: NutMap

    def parts(self, preload: Any, speed: Any, temperature: Any) -> tuple[Any, Any, Any]:
        """Viscous, hysteresis and sliding torque [N.m] at preload [N], speed [rad/s], temperature [K]."""
        state = self.nut_map.evaluate(preload, speed, temperature)
        return state.viscous_torque, state.hysteresis_torque, state.sliding_torque

    def torque(self, preload: Any, speed: Any, temperature: Any) -> Any:
        """Their sum."""
        return sum(self.parts(preload, speed, temperature))


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


class Band(NamedTuple):
    """Ends of the interval of the torque [N.m], one row per line, at places x."""

    x: Array  # (m,)
    low: Array  # (n, m)
    high: Array  # (n, m)
    meaning: str


class PointInterval(NamedTuple):
    """Interval of the torque at the operating point [N.m]; shares of the variance of ln(torque), largest first."""

    low: float
    high: float
    shares: Mapping[str, float]


class Lines(NamedTuple):
    """Torque [N.m] over one quantity, one row per value of another; all at one value of the third.

    marked : where the trend of the torque is not physical or that of the supply of oil (nut_map.trend)
    """

    x: Array
    rows: Array
    torque: Array
    fixed: float
    marked: Trend
    band: Band | None = None


class FilmLines(NamedTuple):
    """State of the nut over speed at one preload [N], one row per temperature [K]: its films and lambda."""

    speed: Array
    temperatures: Array
    preload: float
    state: DoubleNutState


class TorqueLines(NamedTuple):
    """All lines of a report; rows are preloads, temperatures, speeds, speeds. interval: at the operating point."""

    over_speed: Lines
    by_temperature: Lines
    over_preload: Lines
    over_temperature: Lines
    films: FilmLines
    interval: PointInterval | None


class GivenPoint(NamedTuple):
    """What of an operating point is given, SI; None: chosen by operating_point."""

    preload: float | None = None
    speed: float | None = None
    temperature: float | None = None


#: axes of a map that an operating point lies on
POINT_AXES = ("preload", "speed", "temperature")


def operating_point(
    parameters: Parameters, axes: Any, temperature: float, given: GivenPoint
) -> OperatingPoint:
    """Point of the page; what is not given: preload as catalogues take it, POINT_SPEED, a temperature [K].

    Chosen numbers are moved into the map.
    Raises       ValueError: a given number outside the map
    """
    preload = catalogue_preload(parameters.screw)
    found = []
    for name, own, usual in zip(POINT_AXES, given, (preload, POINT_SPEED, temperature), strict=True):
        inside = nearest(axes, name, usual if own is None else own)
        if own is not None and not math.isclose(inside, own, rel_tol=1e-9):
            unit = SHOWN[name].unit
            low, high, wanted = (SHOWN[name].of(value) for value in (*axes[name][:2], own))
            raise ValueError(
                f"{name} = {wanted:.6g} {unit}; allowed: {low:.6g} to {high:.6g} {unit}, the range of the map: "
                "build one for a wider range"
            )
        found.append(inside)
    return OperatingPoint(*found)


def torque_lines(
    parameters: Parameters,
    friction: Friction,
    point: OperatingPoint,
    measured: bool,
    progress: Progress,
) -> TorqueLines:
    """Lines around an operating point with their intervals.

    Parameters   measured : the screw of the paper: its preloads and speeds;  progress : called for each interval
    Raises       ArithmeticError: equilibrium of a ball not found
    """
    axes = friction.nut_map.header["axes"]
    slowest, fastest = axes["speed"][:2]
    cold, hot = axes["temperature"][:2]
    if measured:
        preloads = np.array(MEASURED_PRELOADS)
    else:
        preloads = np.unique([nearest(axes, "preload", share * point.preload) for share in PRELOAD_SHARES])
    top = min(MEASURED_TOP, fastest) if measured else fastest
    held = [speed for speed in LINE_SPEEDS if slowest <= speed <= fastest]
    speeds = np.array(held) if len(held) > 1 else np.geomspace(slowest, fastest, 3)
    temperatures = np.unique([cold, point.temperature, hot])
    speed = np.geomspace(slowest, top, POINTS)
    force = np.linspace(max(axes["preload"][0], axes["force"][0]), preloads[-1], POINTS)
    preload = point.preload
    places = np.unique([*np.geomspace(slowest, top, INTERVALS), *speeds[speeds < top]])
    total = len(places) * (len(preloads) + len(temperatures))
    interval = _Intervals(parameters, friction, measured, places, progress, total)

    def lines(x: Array, rows: Array, fixed: float, at: Any, with_interval: bool) -> Lines:
        places = at(x, rows[:, None])
        band = interval.band(x, rows, at) if with_interval else None
        trend = unphysical_trend(friction.nut_map, *places)
        return Lines(x, rows, friction.torque(*places), fixed, trend, band)

    temperature = point.temperature
    return TorqueLines(
        lines(speed, preloads, temperature, lambda x, row: (row, x, temperature), True),
        lines(speed, temperatures, preload, lambda x, row: (preload, x, row), interval.mechanistic),
        lines(force, speeds, temperature, lambda x, row: (x, row, temperature), not interval.mechanistic),
        lines(np.linspace(cold, hot, POINTS), speeds, preload, lambda x, row: (preload, row, x), False),
        FilmLines(
            speed, temperatures, preload, friction.nut_map.evaluate(preload, speed, temperatures[:, None])
        ),
        interval.at_point(point),
    )


class _Intervals:
    """Intervals of the torque of a friction set: by the constants of the mechanistic law, or by the errors of a fit."""

    def __init__(
        self,
        parameters: Parameters,
        friction: Friction,
        measured: bool,
        places: Array,
        progress: Progress,
        total: int,
    ) -> None:
        self.mechanistic = friction.nut_map.law == MECHANISTIC
        self._measured, self._places = measured, places
        self._of = parameters, friction.nut_map.header["axes"], friction.entry
        self._friction, self._progress = friction, progress
        self._done, self._total = 0, total

    def band(self, x: Array, rows: Array, at: Callable[[Any, Any], tuple[Any, Any, Any]]) -> Band | None:
        """Interval of each line over speed; at : x and row -> preload, speed, temperature."""
        if not self.mechanistic:
            return _band_of_fit(self._of[0], self._friction, self._measured, x, rows, at)
        places = self._places
        ends = np.array([[self._relative(*map(float, at(place, row))) for place in places] for row in rows])
        torque = self._friction.torque(*at(places, rows[:, None]))
        return Band(places, torque * ends[..., 0], torque * ends[..., 1], OF_CONSTANTS)

    def at_point(self, point: OperatingPoint) -> PointInterval | None:
        """Interval at one point."""
        torque = float(self._friction.torque(*point))
        if self.mechanistic:
            found = map_interval(*self._of, *point)
            low, high = found.relative
            return PointInterval(low * torque, high * torque, found.shares)
        x, row = np.array([point.speed]), np.array([point.preload])
        band = self.band(x, row, lambda x, row: (row, x, point.temperature))
        return None if band is None else PointInterval(float(band.low[0, 0]), float(band.high[0, 0]), {})

    def _relative(self, preload: float, speed: float, temperature: float) -> tuple[float, float]:
        self._progress(self._done, self._total, INTERVAL_STEP)
        found = map_interval(*self._of, preload, speed, temperature).relative
        self._done += 1
        self._progress(self._done, self._total, INTERVAL_STEP)
        return found


def left_out_errors(friction: FrictionSet, parameters: Parameters) -> tuple[float, float] | None:
    """Mean error of a point and of a table left out of a fit to this screw; None: not fitted to it, or not known.

    The second is the first where the fit had no tables.
    """
    point = friction.errors.get("leave_one_out_mean")
    if friction.parameters_hash != parameters_hash(parameters) or point is None:
        return None
    return point, max([point, *(errors["mean"] for errors in friction.leave_one_table_out.values())])


def _band_of_fit(
    parameters: Parameters,
    friction: Friction,
    measured: bool,
    x: Array,
    rows: Array,
    at: Callable[[Any, Any], tuple[Any, Any, Any]],
) -> Band | None:
    """Scatter of a fitted set as of a normal quantity, as friction.interval counts it; None: not known.

    On the two lines along which the paper measured, the error of a point left out of the fit; on the others, which have
    one measured point at most, that of a table left out.
    """
    errors = left_out_errors(friction.entry, parameters)
    if errors is None:
        return None
    torque = friction.torque(*at(x, rows[:, None]))
    near = [measured and _is_measured_line(*at(math.nan, float(row))[:2]) for row in rows]
    error = np.where(near, *errors)[:, None]
    wide = DEVIATIONS * SCATTER_DEVIATION * error
    meaning = OF_POINT if all(near) or errors[0] == errors[1] else OF_BOTH if any(near) else OF_TABLE
    return Band(x, torque * np.exp(-wide), torque * np.exp(wide), meaning)


def _is_measured_line(preload: float, speed: float) -> bool:
    """Whether Tables 2 and 4 of the paper lie on a line: at 1000 N, or at 100 r/min; what varies on it is NaN."""
    return preload == MEASURED_PRELOADS[0] or math.isclose(speed, LINE_SPEEDS[0])
