"""Preload of the double nut from a measured friction torque: the nut map followed over the preload.

Numpy and the standard library only: this module is copied into the FMU BallScrewPreloadMonitor. Its twin is
native/models/monitor/search.c. friction.torque.preload_from_torque brackets any model. This search uses the derivative
of the map and needs a few evaluations.

Torque rises with the preload while both nuts are loaded. Where an axial load unloads one nut, the torque is that of
the other nut and does not depend on the preload: such a point is not in range.
"""

import math
from typing import NamedTuple

from ballscrew_tehl.runtime.constants import (
    ACCURACY,
    JUMP,
    LEAST_ELASTICITY,
    LONGEST_STEP,
    MOST_ITERATIONS,
    ROUNDING,
)
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.over_preload import OverPreload, TorqueOverPreload
from ballscrew_tehl.runtime.packed import FrictionParameters


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
