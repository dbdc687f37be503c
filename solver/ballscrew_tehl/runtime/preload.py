"""Preload of the double nut from a measured friction torque: the nut map followed over the preload.

Twin: native/models/monitor/search.c. The search uses the derivative of the map, by numbers that carry it (Dual), and
needs a few evaluations; friction.torque.preload_from_torque brackets any model.

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
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.nut_law import NutTorques, Ops, freed_shear, nut_torques
from ballscrew_tehl.runtime.packed import TORQUE_CURVES, TORQUE_SURFACES, FrictionParameters
from ballscrew_tehl.runtime.standstill import regularised_sign


class Dual:
    """Value and derivative over one variable; the other operand may be a float."""

    __slots__ = ("slope", "value")

    def __init__(self, value: float, slope: float) -> None:
        self.value = value
        self.slope = slope

    def __add__(self, other: Any) -> "Dual":
        if other.__class__ is Dual:
            return Dual(self.value + other.value, self.slope + other.slope)
        return Dual(self.value + other, self.slope)

    __radd__ = __add__

    def __sub__(self, other: Any) -> "Dual":
        if other.__class__ is Dual:
            return Dual(self.value - other.value, self.slope - other.slope)
        return Dual(self.value - other, self.slope)

    def __rsub__(self, other: float) -> "Dual":
        return Dual(other - self.value, -self.slope)

    def __mul__(self, other: Any) -> "Dual":
        if other.__class__ is Dual:
            return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)
        return Dual(self.value * other, self.slope * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "Dual":
        if other.__class__ is Dual:
            ratio = self.value / other.value
            return Dual(ratio, (self.slope - ratio * other.slope) / other.value)
        return Dual(self.value / other, self.slope / other)

    def __rtruediv__(self, other: float) -> "Dual":
        ratio = other / self.value
        return Dual(ratio, -ratio * self.slope / self.value)

    def __pow__(self, exponent: float) -> "Dual":
        """value >= 0 or a whole exponent; at 0 the derivative counts as 0."""
        power = self.value**exponent
        return Dual(power, exponent * power / self.value * self.slope if self.value else 0.0)

    def __lt__(self, other: Any) -> bool:
        return bool(self.value < (other.value if other.__class__ is Dual else other))

    def __gt__(self, other: Any) -> bool:
        return bool(self.value > (other.value if other.__class__ is Dual else other))


def _exp(x: Dual) -> Dual:
    value = math.exp(x.value)
    return Dual(value, value * x.slope)


def _place(axis: Axis, x: Dual) -> tuple[int, Dual]:
    """Cell of a value on an axis and position in it, constant beyond the axis."""
    cell, t = axis.place(x.value)
    if not axis.lo < x.value < axis.hi:
        return cell, Dual(t, 0.0)
    return cell, Dual(t, axis.scale * (x.slope / x.value if axis.logarithmic else x.slope))


DUALS = Ops(_exp, min, max, lambda condition, yes, no: yes if condition else Dual(no, 0.0), _place)


class TorqueOverPreload(NamedTuple):
    """Torque of the double nut at a preload."""

    torque: float  # [N.m], magnitude of the regularised friction torque
    slope: float  # [N.m/N] derivative over the preload
    loaded_force: float  # [N] of the nut that the axial load loads, not clamped


class OverPreload:
    """Torque over preload at one speed [rad/s], sign free, temperature [K] and axial load [N]."""

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
        over, end = Dual(preload, 1.0 if preload > 0.0 else 0.0), self._map.force.hi
        relieved, loaded = over, over + self._load
        if self._load > 0.0 and preload > 0.0:
            relieved, loaded = self._map.forces_over(over, self._load, self._side, DUALS)
        first = self._nut(relieved)
        second = first
        if self._load > 0.0:
            second = self._nut(loaded if loaded.value <= end else Dual(end, 0.0))
        coulomb = first.hysteresis + first.sliding + (second.hysteresis + second.sliding)
        coulomb = coulomb + freed_shear(first, second, DUALS)
        total = first.viscous + second.viscous + self._sign * coulomb
        return TorqueOverPreload(total.value, total.slope, loaded.value)

    def _nut(self, force: Dual) -> NutTorques:
        """Torques of one nut over the preload."""
        axis = self._map.force
        i, t = axis.place(force.value)
        if i not in self._columns:
            # four neighbours over force: surfaces, below the axis of speed their slopes, curves
            flat = self._block[:, :, i : i + 4].reshape(16, -1)
            columns = (self._weights @ flat).reshape(-1, 4, TORQUE_SURFACES).transpose(0, 2, 1).tolist()
            self._columns[i] = [*columns, self._map.curves[i : i + 4, :TORQUE_CURVES].T.tolist()]
        # over the logarithm of the force, with the ends of the axis, where the derivative is that of the map
        scale = axis.scale if axis.lo <= force.value <= axis.hi else 0.0
        w, w_d = cubic_weights(t), tuple(scale * slope for slope in cubic_slopes(t))
        *surfaces, curves = [_duals(w, w_d, column) for column in self._columns[i]]
        f = Dual(force.value / axis.lo, force.value / axis.lo) if force.value < axis.lo else 1.0
        slopes = surfaces[1] if self._s < 1.0 else None
        law, friction = self._map.law, self._friction
        parts = nut_torques(law, surfaces[0], slopes, curves, f, self._s, friction, DUALS)
        rate = force.slope / max(force.value, 1e-30)
        return NutTorques(*(Dual(x.value, rate * x.slope) if isinstance(x, Dual) else x for x in parts))

    def separation_preload(self) -> float:
        """Preload at or below which the axial load parts the nuts [N]; 0 without axial load, at most the map's end."""
        if self._load == 0.0:
            return 0.0
        preload, axis = self._load, self._map.preload
        for _ in range(SEPARATION_STEPS):
            # over the logarithm of the preload
            cell, t = DUALS.place(axis, Dual(preload, preload))
            row = self._map.load_lists[0]
            ratio = weighted(cubic_weights(t), row, self._side * (axis.last + 4) + cell)
            step = (math.log(self._load / preload) - ratio.value) / (1.0 + ratio.slope)
            preload *= math.exp(min(max(step, -LONGEST_STEP), LONGEST_STEP))
        return min(preload, self._map.force.hi)


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
    """Preload at which the map gives a torque [N.m], positive against a positive speed, while the screw turns.

    Newton's method for ln(torque) over ln(preload), safeguarded by bisection; all finite, the speed not 0. Clamped and
    flagged: a torque along the motion gives 0, one at or below that of an unloaded nut the preload at which it is
    unloaded, one beyond the map its end; below the preload axis the power laws of the map hold.
    """
    axis, clamped = nut_map.force, nut_map.outside(speed, temperature)
    model = OverPreload(nut_map, speed, temperature, axial_load, friction, regularization_speed)
    preload, found, at = _solve(model, -torque if speed < 0.0 else torque, axis.hi)
    determined = found and at.slope * preload >= LEAST_ELASTICITY * abs(torque)
    if not determined or preload < nut_map.preload.lo:
        clamped.insert(0, "torque")
    if at.loaded_force > axis.hi:
        clamped.append("axial_load")
    return PreloadEstimate(preload, max(at.slope, 0.0), tuple(clamped))


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
        ratio = wanted / at.torque if at.torque > 0.0 else math.inf
        error = math.log(ratio) if ratio > 0.0 else -math.inf
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
