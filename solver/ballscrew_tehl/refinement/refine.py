"""Run-time refinement: contacts are solved at the points of use, and the map is corrected by them.

A solved contact gives the errors of the logarithms of the map (packed.SURFACES) at its raceway and one point (force of
a nut, speed, temperature). Between solved points these corrections are interpolated by simple kriging, which gives the
most likely value of a field with the covariance of the solved values and its standard deviation, small where neighbours
agree. They are a smooth field with scatter around it; only the smooth part is interpolated. A contact is solved
- where none is known within REACH, if its viscous torque exceeds the tolerance, or
- where uncertain corrections may change the torque by more than `tolerance`.

Every solve begins cold, so that it depends on its point alone. Hence same calls give same results, and a restored
state continues exactly as the original. Simple kriging, covariances Matern 3/2 and, for the scatter, exponential:
Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, Eqs. (2.25), (2.26), (4.17), (4.18).
"""

from __future__ import annotations

import logging
import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..parameters.file import Parameters
from ..parameters.identity import map_parameters
from ..physics.hertz import RACEWAYS
from ..runtime.packed import Law
from .direct import Array, ball_loads, mean_load, solved_nut

if TYPE_CHECKING:  # an import would pack the module into the Python FMU, which has a copy of its own
    from ..runtime.evaluate import DoubleNutState, NutMap

#: contacts that are stored, both raceways together, least recently used ones dropped: a look-up takes time with its
#: square
CAPACITY = 256
#: cells along each axis of a map: ln(force), ln(speed), temperature. Lengths over which errors of the map are alike
CELLS = 5.0
#: distance [cells] beyond which a solved point is not used: larger, fewer solves and larger errors between points
REACH = 1.0
#: relative correction that is expected of a map without certificate, and the least one of a map with: larger, more
#: contacts are solved before the first results count
EXPECTED, MIN_EXPECTED = 0.02, 1e-4
#: standard deviations of a correction that the tolerance must cover: 2 is 95 of 100 cases
SURE = 2.0
#: change of ln(force) over which the slopes of the map are taken: a small part of a cell
SLOPE_STEP = 0.1
MAX_SOLVES = 4  # evaluations of a point at most: two nuts with two raceways
#: scatter of solved films between neighbouring points, relative, and its correlation length [cells]: grids change in
#: steps. Without it contacts are solved again and again where neighbours scatter
SCATTER, SCATTER_LENGTH = 1.5e-3, 0.05
JITTER = 1e-9  # keeps the matrix of points that nearly coincide invertible
#: distance [cells] from a contact without a solution within which none is tried again
UNSOLVABLE_RADIUS = 0.1
USED_ABOVE = 0.5  # correlation with a point above which a look-up counts as its use
DEVIATION_STEPS = 4  # iterations between the deviation and the share of scatter in it


class Known(NamedTuple):
    """Interpolated correction of one raceway."""

    values: list[float]  # of the logarithms, five columns
    deviation: float  # standard deviation of the first column, scatter left out
    #: to the nearest solved point [cells]; 0 near a contact without a solution
    distance: float


class CorrectionStore:
    """Corrections of one raceway at up to `capacity` points, by kriging; expected: deviation before any is known."""

    COLUMNS = 5
    _weights: Array

    def __init__(self, capacity: int, expected: float) -> None:
        self.capacity, self.expected, self._clock = capacity, expected, 0
        self._unsolvable = np.empty((0, 3))
        self._set(np.empty((0, 3)), np.empty((0, self.COLUMNS)), np.empty(0, dtype=int))

    def __len__(self) -> int:
        return len(self._points)

    def look_up(self, point: Array) -> Known:
        """Correction at a point (3,) [cells]."""
        useless = bool((((self._unsolvable - point) ** 2).sum(axis=1) < UNSOLVABLE_RADIUS**2).any())
        if not len(self._points):
            return Known([0.0] * self.COLUMNS, self.expected, 0.0 if useless else math.inf)
        distances = np.sqrt(((self._points - point) ** 2).sum(axis=1))
        nearness = _covariance(distances)
        self._clock += 1
        self._used[nearness > USED_ABOVE] = self._clock
        unknown = 1.0 - float(nearness @ self._inverse @ nearness)
        scatter = (SCATTER / self._sigma) ** 2 * np.exp(-distances / SCATTER_LENGTH)
        values = ((nearness + scatter) @ self._weights).tolist()
        distance = 0.0 if useless else float(distances.min())
        return Known(values, self._sigma * math.sqrt(max(unknown, 0.0)), distance)

    def insert(self, point: Array, values: Array) -> None:
        """Store the correction (5,) at a point (3,) [cells]; the least recently used one is dropped."""
        keep = np.ones(len(self._points), dtype=bool)
        if len(self._points) >= self.capacity:
            keep[np.argmin(self._used)] = False
        self._set(
            np.vstack([self._points[keep], point]),
            np.vstack([self._values[keep], values]),
            np.append(self._used[keep], self._clock),
        )

    def insert_unsolvable(self, point: Array) -> None:
        """Store that there is no solution at a point (3,) [cells]; the oldest one is dropped."""
        self._unsolvable = np.vstack([self._unsolvable, point])[-self.capacity :]

    def _set(self, points: Array, values: Array, used: NDArray[np.int_]) -> None:
        self._points, self._values, self._used = points, values, used
        self._sigma = self.expected
        if not len(points):
            return
        distances = np.sqrt(((points[:, None] - points) ** 2).sum(axis=-1))
        smooth, rough = _covariance(distances), np.exp(-distances / SCATTER_LENGTH)
        for step in range(DEVIATION_STEPS + 1):
            if step > 0:
                # the expected size counts as one solved point
                misfit = self.expected**2 + float(values[:, 0] @ self._weights[:, 0])
                self._sigma = math.sqrt(misfit / (1.0 + len(points)))
            self._weights = np.linalg.solve(smooth + (SCATTER / self._sigma) ** 2 * rough, values)
        self._inverse = np.linalg.inv(smooth + JITTER * np.eye(len(points)))

    def state(self) -> dict[str, Any]:
        """Content for JSON."""
        arrays = self._points, self._values, self._used, self._unsolvable
        names = "points", "values", "used", "unsolvable"
        return {"clock": self._clock} | {n: array.tolist() for n, array in zip(names, arrays, strict=True)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Content from state()."""
        points, values, unsolvable = (
            np.array(state[name], float) for name in ("points", "values", "unsolvable")
        )
        self._clock, self._unsolvable = int(state["clock"]), unsolvable.reshape(-1, 3)
        self._set(points.reshape(-1, 3), values.reshape(-1, self.COLUMNS), np.array(state["used"], int))


def _covariance(distance: Array) -> Array:
    """Matern 3/2 with a length of one cell."""
    scaled = math.sqrt(3.0) * distance
    return np.asarray((1.0 + scaled) * np.exp(-scaled))


class Solve(NamedTuple):
    """One contact that was solved, or tried."""

    raceway: str
    force: float  # of the nut [N]
    speed: float  # [rad/s]
    temperature: float  # [K]
    reason: str
    seconds: float
    failure: str  # why there is no solution; empty if there is one

    def __str__(self) -> str:
        where = f"force {self.force:.6g} N, speed {self.speed:.6g} rad/s, {self.temperature:.6g} K"
        result = f"solved: {self.reason}"
        if self.failure:
            result = f"not solved, uncorrected map used: {self.failure}"
        return f"contact of the {self.raceway} at {where} {result}"


class _LookUp(NamedTuple):
    """One look-up of a correction during an evaluation."""

    raceway: int
    force: float
    viscous: float  # torque up to a factor common to both nuts
    known: Known


class Refinement:
    """A nut map with live corrections; evaluate() as that of the map.

    nut_map; parameters: None = those of the map's header;
    tolerance: relative error of the friction torque, > 0; report: called with every Solve, None = logging, a failure
    as a warning; solves: the last of them

    Nothing is solved beyond the axes of the map, where known corrections apply; below the lowest speed and force the
    correction is that of the end of the axis. Torque follows direct per-ball solves within the tolerance (in 95 of 100
    cases, the rest up to three times as much); films and rise are corrected as for the mean ball, without a bound, but
    not those of rolling balls that are shown with the law of the paper. Forces of the nuts, hysteresis and sliding
    torque stay those of the map; of the mechanistic law the rolling part alone, nearly all that follows the film, is
    corrected
    """

    def __init__(
        self,
        nut_map: NutMap,
        parameters: Parameters | None = None,
        tolerance: float = 1e-3,
        report: Callable[[Solve], None] | None = None,
    ) -> None:
        self.nut_map, self.tolerance = nut_map, tolerance
        self.solves: deque[Solve] = deque(maxlen=CAPACITY)
        self._parameters = parameters or map_parameters(nut_map.header)
        self._report = report or _logged
        force, speed, temperature = nut_map.force, nut_map.speed, nut_map.temperature
        spans = math.log(force.hi / force.lo), math.log(speed.hi / speed.lo), temperature.hi - temperature.lo
        self._cell = np.array(spans) / CELLS
        # half of the largest error of the map by its certificate
        error = float(nut_map.header["certificate"].get("torque_error_max", 2.0 * EXPECTED))
        expected = min(max(0.5 * error, MIN_EXPECTED), EXPECTED)
        self._known = [CorrectionStore(CAPACITY // 2, expected) for _ in RACEWAYS]

    @property
    def tolerance(self) -> float:
        """Relative error of the friction torque that is allowed."""
        return self._tolerance

    @tolerance.setter
    def tolerance(self, value: float) -> None:
        if not (value > 0.0 and math.isfinite(value)):
            raise ValueError(f"refine_tolerance = {value}; needs a finite number > 0")
        self._tolerance = float(value)

    def __len__(self) -> int:
        """Number of stored contacts."""
        return sum(len(store) for store in self._known)

    def prepare(self) -> None:
        """Compile or load the solver now, by a contact in the middle of the map that is not stored."""
        force, speed = (math.sqrt(axis.lo * axis.hi) for axis in (self.nut_map.force, self.nut_map.speed))
        temperature = 0.5 * (self.nut_map.temperature.lo + self.nut_map.temperature.hi)
        with suppress(ArithmeticError):
            solved_nut(self._parameters, RACEWAYS[0], force, speed, temperature, 0.0)

    def evaluate(
        self,
        preload: Any,
        speed: Any,
        temperature: Any,
        axial_load: Any = 0.0,
        apparent_viscosity_ratio: Any = None,
        net_sliding_coefficient: Any = None,
        roughness_height: Any = None,
        breakaway_factor: Any = None,
        temperature_difference: Any = 0.0,
    ) -> DoubleNutState:
        """NutMap.evaluate, refined: same parameters, results and errors; points of arrays one after the other."""
        friction = (apparent_viscosity_ratio, net_sliding_coefficient, roughness_height, breakaway_factor)
        plain = self.nut_map.evaluate(
            preload, speed, temperature, axial_load, temperature_difference=temperature_difference
        )
        at = plain.preload_actual, speed, temperature, axial_load
        columns = self.nut_map.checked_arguments(*at, *friction)
        rows = zip(*(np.ravel(column).tolist() for column in columns), strict=True)
        seal = self.nut_map.seal_torque
        states = [self.evaluate_point(*row)._replace(seal_torque=seal, preload_actual=row[0]) for row in rows]
        range_of = {"in_range": plain.in_range, "clamped": plain.clamped}
        if isinstance(columns[0], float):
            return states[0]._replace(**range_of)
        fields: dict[str, Any] = {
            name: np.array([getattr(state, name) for state in states]).reshape(columns[0].shape)
            for name in states[0]._fields
            if name not in ("clamped", "seal_torque")
        }
        return states[0]._replace(**fields | range_of)

    def evaluate_point(
        self, preload: float, speed: float, temperature: float, axial_load: float, *friction: float
    ) -> DoubleNutState:
        """evaluate() for floats that the caller has checked: the step of the FMU."""
        point = (
            min(max(abs(speed), self.nut_map.speed.lo), self.nut_map.speed.hi),
            min(max(temperature, self.nut_map.temperature.lo), self.nut_map.temperature.hi),
        )
        asked: list[_LookUp] = []

        def correction(force: float, values: list[float]) -> list[float]:
            fraction = min(force / self.nut_map.force.lo, 1.0) ** (2.0 / 3.0)  # law below the axis
            force = max(force, self.nut_map.force.lo)
            corrected = list(values)
            for raceway, store in enumerate(self._known):
                result = store.look_up(self._place(force, *point))
                corrected[raceway::2] = [
                    v + c for v, c in zip(values[raceway::2], result.values, strict=True)
                ]
                torque, film = corrected[raceway:4:2]  # logarithms of this raceway
                viscous = fraction * math.exp(torque)
                if self.nut_map.law != Law.MECHANISTIC:
                    viscous /= 1.0 + (friction[2] / math.exp(film)) ** 2
                asked.append(_LookUp(raceway, force, viscous, result))
            return corrected

        # after MAX_SOLVES every correction is known
        for solves in range(MAX_SOLVES + 1):
            asked.clear()
            state = self.nut_map.evaluate_point(
                preload, speed, temperature, axial_load, *friction, correction=correction
            )
            target = self._wanted(state, asked) if state.in_range and solves < MAX_SOLVES else None
            if target is None:
                break
            self._solve(*target, *point)
        return state

    def _wanted(self, state: DoubleNutState, asked: list[_LookUp]) -> tuple[int, float, str] | None:
        """Raceway, force and reason of the contact to solve next, if any."""
        viscous = float(state.viscous_torque)
        total = viscous + float(state.hysteresis_torque) + float(state.sliding_torque)
        sum_of_parts = sum(one.viscous for one in asked)
        if not (viscous > 0.0 and sum_of_parts > 0.0):
            return None  # no speed or no load
        part = viscous / (total * sum_of_parts)
        unknown = [one for one in asked if one.known.distance > 0.0]
        far = [one for one in asked if one.known.distance > REACH and part * one.viscous > self.tolerance]
        error = SURE * part * sum(one.viscous * one.known.deviation for one in unknown)
        if far:
            unsure, reason = far[0], f"no solved contact within {REACH:g} cells"
        elif error > self.tolerance:
            unsure = max(unknown, key=lambda one: one.viscous * one.known.deviation)
            reason = f"torque may be off by {error:.1e}"
        else:
            return None
        return unsure.raceway, unsure.force, reason

    def _place(self, force: float, speed: float, temperature: float) -> Array:
        """Coordinates in cells."""
        return np.array([math.log(force), math.log(speed), temperature]) / self._cell

    def _solve(self, raceway: int, force: float, reason: str, speed: float, temperature: float) -> None:
        """Solve one contact and store its correction; one that fails is stored as such."""
        place, begun, failure = self._place(force, speed, temperature), time.perf_counter(), ""
        try:
            self._known[raceway].insert(place, self._correction(raceway, force, speed, temperature))
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            failure = str(error) or type(error).__name__
            self._known[raceway].insert_unsolvable(place)
        seconds = time.perf_counter() - begun
        solve = Solve(RACEWAYS[raceway], force, speed, temperature, reason, seconds, failure)
        self.solves.append(solve)
        self._report(solve)

    def _correction(self, raceway: int, force: float, speed: float, temperature: float) -> Array:
        """Solved contact minus map, in logarithms: columns of packed.SURFACES of this raceway (5,)."""
        axis, screw = self.nut_map.force, self._parameters.screw
        wide = np.array([force * math.exp(-SLOPE_STEP), force, force * math.exp(SLOPE_STEP)])
        surfaces = self.nut_map.surfaces(wide, speed, temperature)[raceway::2]
        reached = np.log(np.clip(wide, axis.lo, axis.hi))
        slopes = (surfaces[:, 2] - surfaces[:, 0]) / (reached[2] - reached[0])
        point = RACEWAYS[raceway], force, speed, temperature
        solved = solved_nut(self._parameters, *point, float(slopes[1]))
        expected = surfaces[:, 1].copy()
        # extremes belong to the heaviest or lightest of the load-carrying balls; the solved ball is the extreme one of
        # a nut with another force, and there the map is compared with it
        load = mean_load(ball_loads(screw, force, self.nut_map.law == Law.MECHANISTIC))
        for column, slope in enumerate(slopes[2:], start=2):
            # films are least, the rise is largest
            extreme = np.max if (slope > 0.0) == (column == 4) else np.min
            other = force
            for _ in range(2):
                other *= load / float(extreme(ball_loads(screw, other)))
            expected[column] = self.nut_map.surfaces(other, speed, temperature)[2 * column + raceway]
            expected[column] += slope * math.log(other / min(max(other, axis.lo), axis.hi))
        if not ((solved > 0.0) & (solved < math.inf)).all():
            raise ValueError(f"{solved}; needs > 0 and finite")
        correction = np.log(solved) - expected
        if self.nut_map.law == Law.MECHANISTIC:
            # shear torque or thrust factor: of both raceways together
            correction[1] = 0.0
        else:
            correction[2:] = 0.0
        return correction

    def state(self) -> dict[str, Any]:
        """All that later results depend on except map and tolerance; exact in JSON."""
        return {name: store.state() for name, store in zip(RACEWAYS, self._known, strict=True)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a state() of a refinement of the same map."""
        for name, store in zip(RACEWAYS, self._known, strict=True):
            store.restore(state[name])


def _logged(solve: Solve) -> None:
    logging.getLogger(__name__).log(logging.WARNING if solve.failure else logging.DEBUG, "%s", solve)
