"""Preload of the double nut from a measured friction torque: the nut map followed over the preload.

Numpy and the standard library only: this module is copied into the FMU BallScrewPreloadMonitor. Its twin is
native/models/monitor/search.c. friction.torque.preload_from_torque brackets any model. This search uses the derivative
of the map, by numbers that carry it (dual.py), and needs a few evaluations.

Torque rises with the preload while both nuts are loaded. Where an axial load unloads one nut, the torque is that of
the other nut and does not depend on the preload: such a point is not in range.
"""

import math
from typing import Any, NamedTuple

from ballscrew_tehl.runtime.bspline import Axis, Weights, cubic_slopes, cubic_weights, weighted
from ballscrew_tehl.runtime.constants import (
    ACCURACY,
    JUMP,
    LEAST_ELASTICITY,
    LONGEST_STEP,
    MOST_ITERATIONS,
    ROUNDING,
    SEPARATION_STEPS,
)
from ballscrew_tehl.runtime.dual import DUALS, Dual
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.nut_law import Spin, freed_shear
from ballscrew_tehl.runtime.packed import TORQUE_CURVES, TORQUE_SURFACES, FrictionParameters
from ballscrew_tehl.runtime.standstill import regularised_sign


class TorqueOverPreload(NamedTuple):
    """Torque of the double nut at a preload."""

    torque: float  # [N.m], magnitude of the regularised friction torque
    slope: float  # [N.m/N] derivative over the preload
    loaded_force: float  # [N] of the nut that the axial load loads, not clamped


class OverPreload:
    """Torque over preload at one speed, temperature and axial load.

    Parameters   nut_map : NutMap;  speed : [rad/s], sign free;  temperature : [K];  axial_load : [N]
                 friction, regularization_speed : as in BallScrewFriction
    """

    def __init__(
        self,
        nut_map: NutMap,
        speed: float,
        temperature: float,
        axial_load: float,
        friction: FrictionParameters,
        regularization_speed: float,
    ) -> None:
        self._map, self._load = nut_map, abs(axial_load)
        self._side = 0 if axial_load > 0.0 else 1
        self._friction = friction
        self._sign = regularised_sign(abs(speed), regularization_speed)
        j, k, self._weights, self._s = nut_map.placed(speed, temperature)
        self._block = nut_map.blocks[j : j + 4, k : k + 4, :, :TORQUE_SURFACES]
        self._columns: dict[int, list[list[list[float]]]] = {}

    def torque(self, preload: float) -> TorqueOverPreload:
        """Torque and its derivative at a preload from 0 to the end of the map."""
        if self._load == 0.0:
            nuts, loaded = [self._nut(preload, 1.0)] * 2, preload
        else:
            relieved, other = self._forces(preload)
            loaded, end = other.value, self._map.force.hi
            nuts = [
                self._nut(relieved.value, relieved.slope),
                self._nut(loaded, other.slope) if loaded <= end else self._nut(end, 0.0),
            ]
        (viscous, coulomb, spin), (viscous_2, coulomb_2, spin_2) = nuts
        total = viscous + viscous_2 + self._sign * (coulomb + coulomb_2 + freed_shear(spin, spin_2, DUALS))
        return TorqueOverPreload(total.value, total.slope, loaded)

    def _nut(self, force: float, slope: float) -> tuple[Dual, Dual, Spin | None]:
        """Viscous and Coulomb torque and Spin of one nut over the preload; slope: of its force over the preload."""
        axis = self._map.force
        i, t = axis.place(force)
        scale = axis.scale if axis.lo <= force <= axis.hi else 0.0
        w, w_d = cubic_weights(t), tuple(scale * slope_of for slope_of in cubic_slopes(t))
        columns = self._columns.get(i)
        if columns is None:
            columns = self._columns[i] = self._contracted(i)
        *surfaces, curves = [_duals(w, w_d, column) for column in columns]
        below = force < axis.lo
        f = Dual(force / axis.lo, force / axis.lo) if below else 1.0
        slopes = surfaces[1] if self._s < 1.0 else None
        *parts, spin = self._map.nut_torques(surfaces[0], slopes, curves, f, self._s, self._friction, DUALS)
        # so far over the logarithm of the force
        rate = slope / max(force, 1e-30)
        viscous, hysteresis, sliding = (Dual(x.value, rate * x.slope) for x in parts)
        if spin is not None:
            spin = Spin(*(Dual(x.value, rate * x.slope) for x in spin))
        return viscous, hysteresis + sliding, spin

    def _contracted(self, cell: int) -> list[list[list[float]]]:
        """Columns at four neighbours over force: surfaces, below the axis of speed their slopes, curves."""
        flat = self._block[:, :, cell : cell + 4].reshape(16, -1)
        surfaces = (self._weights @ flat).reshape(-1, 4, TORQUE_SURFACES).transpose(0, 2, 1).tolist()
        return [*surfaces, self._map.curves[cell : cell + 4, :TORQUE_CURVES].T.tolist()]

    def _forces(self, preload: float) -> tuple[Dual, Dual]:
        """Forces of the relieved and of the loaded nut over the preload."""
        if preload <= 0.0:
            return Dual(0.0, 0.0), Dual(self._load, 0.0)
        return self._map.forces_over(Dual(preload, 1.0), self._load, self._side, _weights_at, DUALS)

    def separation_preload(self) -> float:
        """Preload at or below which the axial load parts the nuts [N]; 0 without axial load, at most the map's end."""
        if self._load == 0.0:
            return 0.0
        preload, row = self._load, self._map.separation_lists[self._side]
        for _ in range(SEPARATION_STEPS):
            # over the logarithm of the preload
            cell, weights = _weights_at(self._map.preload, Dual(preload, preload))
            ratio = weighted(weights, row, cell)
            step = (math.log(self._load / preload) - ratio.value) / (1.0 + ratio.slope)
            preload *= math.exp(min(max(step, -LONGEST_STEP), LONGEST_STEP))
        return min(preload, self._map.force.hi)


def _weights_at(axis: Axis, value: Dual) -> tuple[int, Any]:
    """Cell of a value and weights there, constant beyond the axis."""
    cell, t = axis.place(value.value)
    slope = value.slope / value.value if axis.logarithmic else value.slope
    inside = axis.lo < value.value < axis.hi
    return cell, cubic_weights(Dual(t, axis.scale * slope if inside else 0.0))


def _duals(weights: Weights, slopes: Weights, columns: list[list[float]]) -> list[Dual]:
    """Each column of four neighbours under their weights, with the derivative."""
    (a, b, c, d), (da, db, dc, dd) = weights, slopes
    return [Dual(a * p + b * q + c * r + d * s, da * p + db * q + dc * r + dd * s) for p, q, r, s in columns]


class PreloadEstimate(NamedTuple):
    """Preload at which the map shows a torque."""

    preload: float  # [N], from 0 to the end of the map
    torque_sensitivity: float  # [N.m/N] derivative of the torque there, >= 0
    clamped: tuple[str, ...]  # inputs beyond the map; "torque": no preload within the map gives that torque

    @property
    def in_range(self) -> bool:
        return not self.clamped


def estimate_preload(
    nut_map: NutMap,
    torque: float,
    speed: float,
    temperature: float,
    axial_load: float,
    friction: FrictionParameters,
    regularization_speed: float,
) -> PreloadEstimate:
    """Preload at which the map gives a torque while the screw turns.

    Parameters   torque : measured friction torque [N.m], positive when it opposes a positive speed
                 speed : [rad/s], not 0;  temperature : [K];  axial_load : [N];  the rest: as OverPreload
    Returns      PreloadEstimate. Clamped and flagged: a torque along the motion gives 0, a torque at or below that of
                 an unloaded nut the preload at which it is unloaded, a torque above that at the end of the map the end
                 of the map. Below the preload axis the power laws of the map are used, flagged
    Validity     all arguments are finite: the caller has checked them
    Source       Newton's method for ln(torque) over ln(preload), safeguarded by bisection
    """
    axis = nut_map.force
    clamped = []
    if abs(speed) > nut_map.speed.hi:
        clamped.append("speed")
    if not nut_map.temperature.lo <= temperature <= nut_map.temperature.hi:
        clamped.append("temperature")
    model = OverPreload(nut_map, speed, temperature, axial_load, friction, regularization_speed)
    preload, found, at = _solve(model, -torque if speed < 0.0 else torque, axis.hi)
    determined = found and at.slope * preload >= LEAST_ELASTICITY * abs(torque)
    if not determined or preload < nut_map.preload.lo:
        clamped.insert(0, "torque")
    if at.loaded_force > axis.hi:
        clamped.append("axial_load")
    return PreloadEstimate(preload, max(at.slope, 0.0), tuple(clamped))


def _log_ratio(wanted: float, total: float) -> float:
    ratio = wanted / total if total > 0.0 else math.inf
    return math.log(ratio) if ratio > 0.0 else -math.inf


def _solve(model: OverPreload, wanted: float, highest: float) -> tuple[float, bool, TorqueOverPreload]:
    """Preload, whether the torque is that wanted, and the torque of the last evaluation, which is there."""
    low = model.separation_preload()
    if low > 0.0 or not wanted > 0.0:  # without preload there is no torque
        at = model.torque(low)
        if not wanted > (1.0 + JUMP) * at.torque:
            return low, False, at._replace(slope=0.0)
    high, high_known, before = highest, False, math.inf
    preload = 0.5 * (low + highest) if low > 0.0 else 0.25 * highest
    for _ in range(MOST_ITERATIONS):
        at = model.torque(preload)
        if preload >= highest and at.torque <= wanted:
            return highest, at.torque == wanted, at
        if at.torque > wanted:
            high, high_known = preload, True
        else:
            low = preload
        error = _log_ratio(wanted, at.torque)
        rises = at.slope * preload > LEAST_ELASTICITY * at.torque > 0.0
        step = error * at.torque / (at.slope * preload) if rises else math.inf
        new = preload * math.exp(min(step, LONGEST_STEP)) if step > -LONGEST_STEP else 0.0
        if abs(step) <= ACCURACY:
            return min(new, highest), True, at
        if high_known and high - low <= ROUNDING * high:
            return preload, abs(error) <= JUMP, at
        if not high_known and new >= high:
            new = high  # whether the map gives so much torque is not known yet
        elif not (low < new < high and abs(error) <= 0.5 * before):
            new = math.sqrt(low * high) if low > 0.0 else 0.5 * high
        before = abs(error)
        preload = new
    return preload, False, at
