"""Arrays, and the root of a rising function."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


MAX_STEPS = 200


#: steps of rising_root to one side after which the interval is halved
ONE_SIDED = 3


def rising_root(
    function: Callable[[float], float], low: float, high: float, relative: float = 1e-13
) -> tuple[float, bool]:
    """Where a rising function passes through zero between low and high, to a relative accuracy; whether it was found.

    Bisection with regula falsi (Illinois rule: Dowell & Jarratt, BIT 11 (1971) 168).
    """
    f_low, f_high, side = function(low), function(high), 0
    if f_low == 0.0 or f_high == 0.0:
        return (low if f_low == 0.0 else high), True
    x = low
    for _ in range(MAX_STEPS):
        x = high - f_high * (high - low) / (f_high - f_low)
        # on a curve that starts like a root, chords converge slowly from one side
        if not low < x < high or not abs(side) < ONE_SIDED:
            x, side = 0.5 * (low + high), 0
        f = function(x)
        if f == 0.0 or high - low <= relative * abs(high):
            return x, True
        if not math.isfinite(f):
            break
        if f > 0.0:
            high, f_high, f_low, side = x, f, f_low * (0.5 if side > 0 else 1.0), max(side, 0) + 1
        else:
            low, f_low, f_high, side = x, f, f_high * (0.5 if side < 0 else 1.0), min(side, 0) - 1
    return x, False
