"""Preload of a measured torque, with its interval."""

import math
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

from ..friction.interval import TorqueInterval, of_force
from ..friction.sets import FrictionSet
from ..numerics import rising_root
from ..nut_map.interval import map_interval
from ..parameters.file import Parameters
from ..runtime.evaluate import NutMap


def preload_from_torque(
    evaluate: Callable[[float], float], torque: float, lowest: float, highest: float, relative: float = 1e-12
) -> float:
    """Preload at which a model shows a measured torque.

    Parameters
    ----------
    evaluate : callable
        Preload [N] -> total torque [N.m], continuous and rising.
    torque : float
        Measured torque [N.m], >= 0.
    lowest, highest : float
        Bracket of the preload [N], 0 <= lowest < highest.
    relative : float, optional
        Relative accuracy of the preload.

    Returns
    -------
    float
        Preload [N]; 0 for torque 0.

    Raises
    ------
    ValueError
        Torque not finite, negative or outside what the bracket reaches; `evaluate` not continuous.

    Examples
    --------
    >>> round(preload_from_torque(lambda preload: 2.0 * preload**0.5, 6.0, 0.0, 100.0), 9)
    9.0
    """
    if not (math.isfinite(torque) and torque >= 0.0):
        raise ValueError(f"torque = {torque} N.m; needs finite, >= 0")
    if torque == 0.0:
        return 0.0
    evaluate = cache(evaluate)
    low, high = evaluate(float(lowest)), evaluate(float(highest))
    if not low <= torque <= high:
        raise ValueError(
            f"torque = {torque:.6g} N.m; allowed at this speed and temperature: {low:.6g} to {high:.6g} N.m (preload "
            f"{lowest:.6g} to {highest:.6g} N)"
        )
    preload, result = rising_root(lambda x: evaluate(x) - torque, float(lowest), float(highest), relative)
    if not result:
        raise ValueError(f"torque = {torque:.6g} N.m; no preload between {lowest:.6g} and {highest:.6g} N")
    return preload


PRELOAD_ACCURACY = 1e-3  # relative, of the ends of an interval


class PreloadInterval(NamedTuple):
    """Preloads [N] whose intervals of the torque end at a measured torque."""

    low: float
    high: float
    meaning: str  # of the interval of the torque at the preload itself
    at_edge: tuple[str, ...]  # ends that the map cuts off


def preload_interval(
    parameters: Parameters,
    nut_map: NutMap,
    friction_set: FrictionSet,
    torque: float,
    preload: float,
    speed: float,
    temperature: float,
    difference: float = 0.0,
    axial_load: float = 0.0,
) -> PreloadInterval:
    """Preloads [N] at which a measured torque [N.m] >= 0 is the high and low end of its interval, within the map.

    difference: temperature of screw minus that of the nut [K];  axial_load: [N]
    """
    parameters = of_force(parameters, friction_set)
    axes, at = nut_map.header["axes"], (speed, temperature)
    lowest, highest = axes["preload"][0], min(axes["force"][1], axes["preload"][1])

    def interval(preload: float) -> TorqueInterval:
        actual = nut_map.actual_preload(preload, difference) if difference else preload
        return map_interval(parameters, axes, friction_set, actual, *at, axial_load)

    def end(preload: float, which: int) -> float:
        seals = nut_map.seal_torque
        state = nut_map.evaluate(preload, *at, axial_load, temperature_difference=difference)
        balls = float(state.friction_torque) - seals
        return interval(preload).relative[which] * balls + seals

    low, high, at_edge = lowest, highest, []
    if end(lowest, 1) < torque:
        low = preload_from_torque(lambda x: end(x, 1), torque, lowest, highest, PRELOAD_ACCURACY)
    else:
        at_edge.append("low")
    if end(highest, 0) > torque:
        high = preload_from_torque(lambda x: end(x, 0), torque, 0.0, highest, PRELOAD_ACCURACY)
    else:
        at_edge.append("high")
    # an extrapolated preload is below the map
    return PreloadInterval(min(low, preload), max(high, preload), interval(preload).meaning, tuple(at_edge))
