"""Preload of the double nut from a measured friction torque: the nut map followed over the preload.

Numpy and the standard library only: this module travels inside the FMU BallScrewPreloadMonitor; native/nut.c and
native/monitor/model.c are its twins. Unlike torque.preload_from_torque, which brackets any model, it has the
derivative of the map and takes a few evaluations.

Torque rises with the preload while both nuts are loaded. Where an axial load parts them, the torque is that of one
nut and tells nothing: such a point is not in range.
"""

import math
from typing import NamedTuple

import numpy as np

from ballscrew_tehl.runtime.bspline import cubic_slopes, cubic_weights, weighted
from ballscrew_tehl.runtime.constants import (
    ACCURACY,
    JUMP,
    LEAST_ELASTICITY,
    MOST_ITERATIONS,
    SEPARATION_STEPS,
)
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.standstill import regularised_sign


class TorqueOverPreload(NamedTuple):
    """Parts of the torque of the double nut [N.m] and their derivatives over the preload [N.m/N]."""

    viscous: float
    hysteresis: float
    sliding_load: float  # sliding torque over its coefficient
    viscous_slope: float
    hysteresis_slope: float
    sliding_slope: float
    loaded_force: float  # [N] of the nut that the axial load loads, not clamped


class PreloadEstimate(NamedTuple):
    """Preload at which the map shows a torque."""

    preload: float  # [N], from 0 to the end of the map
    torque_sensitivity: float  # [N.m/N] derivative of the torque there, >= 0
    clamped: tuple[
        str, ...
    ]  # inputs beyond the map; with "torque" no preload within the map gives that torque

    @property
    def in_range(self) -> bool:
        return not self.clamped


def _along(weights, columns: list[list[float]]) -> list[float]:
    """Each column under the weights of its four neighbours."""
    a, b, c, d = weights
    return [a * x[0] + b * x[1] + c * x[2] + d * x[3] for x in columns]


class OverPreload:
    """Torque over preload at one speed, temperature and axial load.

    Parameters   nut_map : NutMap;  speed : [rad/s], sign free;  temperature : [K];  axial_load : [N]
                 ratio, net, roughness, regularization_speed : friction parameters as in BallScrewFriction
    """

    def __init__(
        self, nut_map: NutMap, speed, temperature, axial_load, ratio, net, roughness, regularization_speed
    ) -> None:
        self._map, self._load = nut_map, axial_load
        self._ratio, self._net, self._roughness = ratio, net, roughness
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
        self._block = nut_map._surfaces[j : j + 4, k : k + 4, :, :4]
        self._columns: dict[int, list[list[list[float]]]] = {}

    def torque(self, preload: float) -> tuple[float, float, TorqueOverPreload]:
        """Torque [N.m] and its derivative [N.m/N] at a preload from 0 to the end of the map, and their parts."""
        parts = self.parts(preload)
        coulomb = parts.hysteresis + self._net * parts.sliding_load
        coulomb_slope = parts.hysteresis_slope + self._net * parts.sliding_slope
        return (
            parts.viscous + self._sign * coulomb,
            parts.viscous_slope + self._sign * coulomb_slope,
            parts,
        )

    def parts(self, preload: float) -> TorqueOverPreload:
        if self._load == 0.0:
            nut = self._nut(preload, 1.0)
            return TorqueOverPreload._make([*(2.0 * x for x in nut), preload])
        relieved, loaded = self._map._forces_point(preload, self._load)
        slope = self._force_slope(preload)
        hi = self._map.force.hi
        nuts = self._nut(relieved, slope), self._nut(min(loaded, hi), slope if loaded <= hi else 0.0)
        return TorqueOverPreload._make([*(a + b for a, b in zip(*nuts, strict=True)), loaded])

    def _nut(self, force: float, slope: float) -> tuple[float, ...]:
        """Parts of one nut and their derivatives over the preload; slope: of its force over the preload."""
        axis = self._map.force
        i, t = axis.place(force)
        f = min(force / axis.lo, 1.0)
        third = f ** (1.0 / 3.0)
        within = axis.scale if axis.lo <= force <= axis.hi else 0.0
        below = 1.0 if force < axis.lo else 0.0
        rate = slope / max(force, 1e-30)
        # weights of the neighbours, and their derivatives over the logarithm of the force
        w, w_d = cubic_weights(t), tuple(within * x for x in cubic_slopes(t))
        columns = self._columns.get(i)
        if columns is None:
            columns = self._columns[i] = self._contracted(i)
        value, value_d, slopes = _along(w, columns[0]), _along(w_d, columns[0]), None
        if self._s < 1.0:
            slopes = _along(w, columns[1]), _along(w_d, columns[1])
        curve, curve_d = _along(w, columns[2]), _along(w_d, columns[2])
        viscous = viscous_d = 0.0
        for raceway in (0, 1):
            v, d = self._raceway(raceway, value, value_d, slopes)
            viscous += v
            viscous_d += d
        share = self._ratio * third * third
        viscous *= share
        viscous_d = share * viscous_d + below * (2.0 / 3.0) * viscous
        hysteresis, sliding = math.exp(curve[0]) * f * third, math.exp(curve[1]) * f
        return (
            viscous,
            hysteresis,
            sliding,
            rate * viscous_d,
            rate * hysteresis * (curve_d[0] + below * (4.0 / 3.0)),
            rate * sliding * (curve_d[1] + below),
        )

    def _contracted(self, cell: int) -> list[list[list[float]]]:
        """Columns at four neighbours over force: surfaces, below the axis of speed their slopes (else none), curves."""
        flat = self._block[:, :, cell : cell + 4].reshape(16, -1)
        surfaces = [[row[n : n + 4] for n in range(0, 16, 4)] for row in (self._weights @ flat).tolist()]
        columns = [list(map(list, zip(*rows, strict=True))) for rows in surfaces]
        curves = self._map._curves[cell : cell + 4, :2].T.tolist()
        return [columns[0], columns[-1] if len(columns) > 1 else [], curves]

    def _raceway(self, raceway: int, value, value_d, slopes) -> tuple[float, float]:
        """Viscous torque of a raceway and its derivative over the logarithm of the force; evaluate._nut, derived."""
        h = 2 + raceway
        x = (self._roughness / math.exp(value[h])) ** 2
        share = 1.0 / (1.0 + x)
        x_d = -2.0 * x * value_d[h]
        torque = math.exp(value[raceway]) * share
        torque_d = torque * (value_d[raceway] - x_d * share)
        if slopes is None:
            return torque, torque_d
        (slope, slope_d), s = slopes, self._s
        n = slope[raceway] + 2.0 * x * share * slope[h]
        n_d = slope_d[raceway] + 2.0 * (x * share * slope_d[h] + x_d * share * share * slope[h])
        c = 0.5 * (min(max(n, 0.0), 3.0) - 1.0)
        c_d = 0.5 * n_d if 0.0 < n < 3.0 else 0.0
        slow, slow_d = s * (1.0 - c + c * s * s), s * (s * s - 1.0) * c_d
        return torque * slow, torque_d * slow + torque * slow_d

    def separation_preload(self) -> float:
        """Preload at or below which the axial load parts the nuts [N]; 0 without axial load, at most the map's end."""
        load = abs(self._load)
        if load == 0.0:
            return 0.0
        nut_map, side = self._map, 0 if self._load > 0.0 else 1
        axis, separation = nut_map.preload, nut_map._separation_lists[side]
        preload = load
        for _ in range(SEPARATION_STEPS):
            p, t_p = axis.place(preload)
            within = axis.scale if axis.lo <= preload <= axis.hi else 0.0
            ratio = weighted(cubic_weights(t_p), separation, p)
            slope = 1.0 + within * weighted(cubic_slopes(t_p), separation, p)
            preload *= math.exp(min(max((math.log(load / preload) - ratio) / slope, -50.0), 50.0))
        return min(preload, nut_map.force.hi)

    def _force_slope(self, preload: float) -> float:
        """Derivative of the force of either nut over the preload under an axial load; 0 where the nuts part."""
        if preload <= 0.0:
            return 0.0
        nut_map, side = self._map, 0 if self._load > 0.0 else 1
        axis = nut_map.preload
        p, t_p = axis.place(preload)
        within = axis.scale if axis.lo < preload < axis.hi else 0.0
        w_p, d_p = cubic_weights(t_p), tuple(within * x for x in cubic_slopes(t_p))
        separation = nut_map._separation_lists[side]
        share = abs(self._load) / (preload * math.exp(weighted(w_p, separation, p)))
        if share >= 1.0:
            return 0.0
        share_d = -share * (1.0 + weighted(d_p, separation, p))
        q, t_q = nut_map.share.place(share)
        w_q, d_q = cubic_weights(t_q), cubic_slopes(t_q)
        y = y_d = 0.0
        for a, row in enumerate(nut_map._sharing_lists[side][p : p + 4]):
            along = weighted(w_q, row, q)
            y += w_p[a] * along
            y_d += d_p[a] * along + w_p[a] * weighted(d_q, row, q) * nut_map.share.scale * share_d
        return math.sqrt(y) * (y + 1.5 * y_d) if y > 0.0 else 0.0


def estimate_preload(
    nut_map: NutMap,
    torque: float,
    speed: float,
    temperature: float,
    axial_load: float,
    ratio: float,
    net: float,
    roughness: float,
    regularization_speed: float,
) -> PreloadEstimate:
    """Preload at which the map shows a torque while the screw turns.

    Parameters   torque : measured friction torque [N.m], positive when it opposes a positive speed
                 speed : [rad/s], not 0;  temperature : [K];  axial_load : [N];  the rest: as OverPreload
    Returns      PreloadEstimate; clamped: a torque against the motion gives 0, one at or below that of parted nuts the
                 preload at which they part, one above all that the map gives the end of the map; a preload below
                 force of the map its power laws go on, flagged
    Validity     the caller has checked that all are finite numbers
    Source       Newton's method for ln(torque) over ln(preload), safeguarded by bisection
    """
    axis = nut_map.force
    clamped = []
    if abs(speed) > nut_map.speed.hi:
        clamped.append("speed")
    if not nut_map.temperature.lo <= temperature <= nut_map.temperature.hi:
        clamped.append("temperature")
    model = OverPreload(nut_map, speed, temperature, axial_load, ratio, net, roughness, regularization_speed)
    preload, found, slope, parts = _solve(model, -torque if speed < 0.0 else torque, axis.hi)
    if not found or preload < nut_map.preload.lo or not slope * preload >= LEAST_ELASTICITY * abs(torque):
        clamped.insert(0, "torque")
    if parts.loaded_force > axis.hi:
        clamped.append("axial_load")
    return PreloadEstimate(preload, max(slope, 0.0), tuple(clamped))


def _log_ratio(wanted: float, total: float) -> float:
    ratio = wanted / total if total > 0.0 else math.inf
    return math.log(ratio) if ratio > 0.0 else -math.inf


def _solve(model: OverPreload, wanted: float, highest: float):
    """Preload, whether the torque is that wanted, derivative and parts there."""
    low = model.separation_preload()
    if low > 0.0 or not wanted > 0.0:  # without preload there is no torque
        total, slope, parts = model.torque(low)
        if not wanted > (1.0 + JUMP) * total:
            return low, False, 0.0, parts
    high, high_known, before = highest, False, math.inf
    preload = 0.5 * (low + highest) if low > 0.0 else 0.25 * highest
    for _ in range(MOST_ITERATIONS):
        total, slope, parts = model.torque(preload)
        if preload >= highest and total <= wanted:
            return highest, total == wanted, slope, parts
        if total > wanted:
            high, high_known = preload, True
        else:
            low = preload
        error = _log_ratio(wanted, total)
        told = slope * preload > LEAST_ELASTICITY * total > 0.0
        step = error * total / (slope * preload) if told else math.inf
        new = preload * math.exp(min(step, 50.0)) if step > -50.0 else 0.0
        if abs(step) <= ACCURACY:
            return min(new, highest), True, slope, parts
        if high_known and high - low <= 4e-16 * high:
            return preload, abs(error) <= JUMP, slope, parts
        if not high_known and new >= high:
            new = high  # whether the map gives so much torque is not known yet
        elif not (low < new < high and abs(error) <= 0.5 * before):
            new = math.sqrt(low * high) if low > 0.0 else 0.5 * high
        before = abs(error)
        preload = new
    return preload, False, slope, parts
