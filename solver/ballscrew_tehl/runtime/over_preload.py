"""Torque of the double nut over its preload, with the derivative: the map followed along one operating point.

Numpy and the standard library only: this module travels inside the FMU BallScrewPreloadMonitor. The law is that of
nut_law.py, computed with numbers that carry their derivative (dual.py); this module looks splines and their slopes up.
"""

import math
from typing import NamedTuple

import numpy as np

from ballscrew_tehl.runtime.bspline import Axis, Weights, cubic_slopes, cubic_weights, weighted
from ballscrew_tehl.runtime.constants import LONGEST_STEP, SEPARATION_STEPS
from ballscrew_tehl.runtime.dual import DUALS, Dual
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.nut_law import Spin, freed_shear, nut_forces
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
        speed = abs(speed)
        self._sign = regularised_sign(speed, regularization_speed)
        j, t_j = nut_map.speed.place(speed)
        k, t_k = nut_map.temperature.place(temperature)
        self._s = min(speed / nut_map.speed.lo, 1.0)
        w_k = cubic_weights(t_k)
        rows = [[a * b for a in cubic_weights(t_j) for b in w_k]]
        if self._s < 1.0:
            rows.append([a * nut_map.speed.scale * b for a in cubic_slopes(t_j) for b in w_k])
        self._weights = np.array(rows)
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
        i, w, w_d = _along_log(axis, force, axis.lo <= force <= axis.hi)
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
        nut_map = self._map
        p, w_p, d_p = self._along_preload(preload)
        rows = nut_map.sharing_lists[self._side][p : p + 4]

        def sharing(share: Dual) -> Dual:
            q, t_q = nut_map.share.place(share.value)
            w_q, d_q = cubic_weights(t_q), cubic_slopes(t_q)
            along = [weighted(w_q, row, q) for row in rows]
            over_share = weighted(w_p, [weighted(d_q, row, q) for row in rows], 0) * nut_map.share.scale
            over_preload = weighted(d_p, along, 0) / preload
            return Dual(weighted(w_p, along, 0), over_preload + over_share * share.slope)

        ratio = self._separation(preload)
        separation = Dual(ratio.value, ratio.slope / preload)
        return nut_forces(Dual(preload, 1.0), self._load, separation, sharing, DUALS)

    def _separation(self, preload: float) -> Dual:
        """ln(separation load over preload), over the logarithm of the preload."""
        p, w, w_d = self._along_preload(preload)
        row = self._map.separation_lists[self._side]
        return Dual(weighted(w, row, p), weighted(w_d, row, p))

    def _along_preload(self, preload: float) -> tuple[int, Weights, Weights]:
        axis = self._map.preload
        return _along_log(axis, preload, axis.lo < preload < axis.hi)

    def separation_preload(self) -> float:
        """Preload at or below which the axial load parts the nuts [N]; 0 without axial load, at most the map's end."""
        if self._load == 0.0:
            return 0.0
        preload = self._load
        for _ in range(SEPARATION_STEPS):
            ratio = self._separation(preload)
            step = (math.log(self._load / preload) - ratio.value) / (1.0 + ratio.slope)
            preload *= math.exp(min(max(step, -LONGEST_STEP), LONGEST_STEP))
        return min(preload, self._map.force.hi)


def _along_log(axis: Axis, value: float, inside: bool) -> tuple[int, Weights, Weights]:
    """Cell of a logarithmic axis, weights there and their derivatives over the logarithm, 0 if not inside."""
    cell, t = axis.place(value)
    scale = axis.scale if inside else 0.0
    a, b, c, d = cubic_slopes(t)
    return cell, cubic_weights(t), (scale * a, scale * b, scale * c, scale * d)


def _duals(weights: Weights, slopes: Weights, columns: list[list[float]]) -> list[Dual]:
    """Each column of four neighbours under their weights, with the derivative."""
    (a, b, c, d), (da, db, dc, dd) = weights, slopes
    return [Dual(a * p + b * q + c * r + d * s, da * p + db * q + dc * r + dd * s) for p, q, r, s in columns]
