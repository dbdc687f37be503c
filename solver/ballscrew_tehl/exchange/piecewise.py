"""Few points, joined by straight lines, with the least largest distance from a curve.

Straight pieces that need not meet give a lower bound: the least error at which so many cover the samples of the curve,
each as long as the error allows (greedy, bisection over the error). Where the curve has one sign of curvature the
pieces meet by themselves. Their ends are the places of the points; the values are the linear programme of the least
largest error; the places are then moved one by one. Errors count at the samples and at the places themselves, where
the lines bend; between samples the curve is the monotone cubic through them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.optimize import linprog, minimize_scalar

Array = NDArray[np.float64]
#: bisections of the error; relative accuracy of a slope; passes over the places
BISECTIONS, SLOPE, PASSES = 30, 1e-9, 3


class Points(NamedTuple):
    """Places and values of the points, largest distance from the curve, and a lower bound of it for so many points."""

    x: Array
    y: Array
    error: float
    bound: float


def line_error(x: Array, y: Array) -> float:
    """Least largest distance of points from a straight line: half the least width over its slope."""
    if len(x) < 3:
        return 0.0
    steps = np.diff(y) / np.diff(x)

    def width(slope: float) -> float:
        left = y - slope * x
        return float(left.max() - left.min())

    low, high = float(steps.min()), float(steps.max())
    if not high > low:
        return 0.5 * width(low)
    found = minimize_scalar(
        width, bounds=(low, high), method="bounded", options={"xatol": SLOPE * (high - low)}
    )
    return 0.5 * float(found.fun)


def _starts(x: Array, y: Array, error: float, most: int) -> list[int] | None:
    """First samples of the longest pieces with at most an error; None: more than `most` are needed."""
    starts, first, last = [0], 0, len(x) - 1
    while True:
        # the last sample of the piece is at least `low`; doubling steps, then bisection
        low, high, step = min(first + 1, last), last, 2
        while low < high:
            tried = min(first + step, high) if step else (low + high + 1) // 2
            if line_error(x[first : tried + 1], y[first : tried + 1]) <= error:
                low, step = tried, 2 * step
            else:
                high, step = tried - 1, 0
        if low >= last:
            return starts
        first = low + 1
        starts.append(first)
        if len(starts) > most:
            return None


def _values(curve: PchipInterpolator, places: Array) -> tuple[Array, float]:
    """Values at places with the least largest distance from the curve, and that."""
    x = np.union1d(curve.x, places)
    y = curve(x)
    hats = np.column_stack([np.interp(x, places, row) for row in np.eye(len(places))])
    scale = float(np.ptp(y)) or 1.0
    ones = np.ones((len(x), 1))
    found = linprog(
        np.r_[np.zeros(len(places)), 1.0],
        A_ub=np.block([[hats, -ones], [-hats, -ones]]),
        b_ub=np.r_[y, -y] / scale,
        bounds=[(None, None)] * len(places) + [(0.0, None)],
        method="highs",
    )
    values = np.asarray(found.x[:-1]) * scale
    return values, float(np.max(np.abs(hats @ values - y)))


def few_points(x: Array, y: Array, count: int) -> Points:
    """At most `count` points for a curve.

    Parameters   x : (n,) rising, n >= 3;  y : (n,);  count : >= 2
    Example
                 >>> found = few_points(np.linspace(0.0, 1.0, 401), np.linspace(0.0, 1.0, 401) ** 2, 5)
                 >>> round(found.error, 3), len(found.x)  # 1/(8 * 4^2)
                 (0.008, 5)
    """
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    low, high = 0.0, line_error(x, y)
    best = [0]
    if high > 1e-12 * float(np.max(np.abs(y))):
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            starts = _starts(x, y, middle, count - 1)
            if starts is None:
                low = middle
            else:
                high, best = middle, starts
            if high - low <= 1e-3 * high:
                break
    inner = [0.5 * (x[k - 1] + x[k]) for k in best[1:]]
    places = np.array([x[0], *inner, x[-1]])
    curve = PchipInterpolator(x, y)
    values, error = _values(curve, places)
    for _ in range(PASSES):
        before = error
        for k in range(1, len(places) - 1):
            for toward in (-0.5, 0.5, -0.1, 0.1):
                tried = places.copy()
                tried[k] += toward * abs(places[k + (1 if toward > 0 else -1)] - places[k]) * 0.5
                new, worst = _values(curve, tried)
                if worst < error * (1.0 - 1e-6):
                    places, values, error = tried, new, worst
        if error > 0.98 * before or error <= 1.02 * low:
            break
    return Points(places, values, error, low)
