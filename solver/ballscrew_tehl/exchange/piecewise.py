"""Few points, joined by straight lines, near a curve.

Straight pieces that need not meet give a lower bound of the largest error: the smallest one at which so many cover the
samples, each as long as the error allows (greedy, bisection over the error). The points are between their ends, where
the pieces of a curve with one sign of curvature meet; their values are a weighted least squares whose weights follow
the errors (Lawson 1961: towards the least largest error). Between samples the curve is the monotone cubic.

Samples with standard errors: distances count over them, and no more points than bring all within LIMIT of them.
"""

from bisect import bisect_right
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..identification.directions import LIMIT
from ..physics.ball_law import Array

#: relative accuracy of the error;  slopes tried at once, rounds;  rounds of the weights
ACCURACY, SLOPES, ROUNDS, WEIGHTS = 1e-3, 33, 6, 60


class Points(NamedTuple):
    """Places and values of the points, largest distance from the curve, and a lower bound of it for so many points."""

    x: Array
    y: Array
    error: float
    bound: float


def line_error(x: Array, y: Array, error: Array | None = None) -> float:
    """Least largest distance of points from a straight line, over their errors: half the least width over its slope."""
    if len(x) < 3:
        return 0.0
    steps = np.diff(y) / np.diff(x)
    low, high, width = steps.min(), steps.max(), np.empty(0)
    for _ in range(ROUNDS):
        slopes = np.linspace(low, high, SLOPES)
        rest = y - slopes[:, None] * x
        if error is None:
            width = np.ptp(rest, axis=1)
        else:
            apart = rest[:, :, None] - rest[:, None, :]
            width = np.max(2.0 * apart / (error[:, None] + error), axis=(1, 2))
        best = int(np.argmin(width))
        low, high = slopes[max(best - 1, 0)], slopes[min(best + 1, SLOPES - 1)]
    return 0.5 * float(width.min())


def _starts(x: Array, y: Array, errors: Array | None, error: float) -> list[int]:
    """First samples of the longest pieces with at most an error."""
    starts = [0]

    def piece_error(first: int, last: int) -> float:
        part = slice(first, last + 1)
        return line_error(x[part], y[part], None if errors is None else errors[part])

    while True:
        first = starts[-1]
        ends = range(first + 1, len(x))
        last = first + bisect_right(ends, error, key=lambda k: piece_error(first, k))
        if last >= len(x) - 1:
            return starts
        starts.append(last + 1)


def few_points(x: Array, y: Array, count: int, errors: Array | None = None) -> Points:
    """At most `count` >= 2 points for a curve of rising x (n,), n >= 3, and y (n,) with standard errors > 0 or none."""
    low, high, starts = 0.0, line_error(x, y, errors), [0]
    unit = np.ones(len(x)) if errors is None else errors
    enough = 1e-12 * float(np.max(np.abs(y))) if errors is None else LIMIT
    while high - low > ACCURACY * high and high > enough:
        middle = max(0.5 * (low + high), enough)
        pieces = _starts(x, y, errors, middle)
        if len(pieces) >= count:
            low = middle
        else:
            high, starts = middle, pieces
    places = np.array([x[0], *(0.5 * (x[k - 1] + x[k]) for k in starts[1:]), x[-1]])
    values, error = _values(x, y, places, unit, enough)
    # pieces that do not meet between two samples may do so at one of them
    for number, first in enumerate(starts[1:], start=1):
        for place in (x[first - 1], x[first]):
            tried = np.r_[places[:number], place, places[number + 1 :]]
            new, largest = _values(x, y, tried, unit, enough)
            if largest < error:
                places, values, error = tried, new, largest
    if errors is not None:
        error = float(np.max(np.abs(np.interp(x, places, values) - y)))
    return Points(places, values, error, low * float(unit.min()))


def _values(x: Array, y: Array, places: Array, unit: Array, enough: float) -> tuple[Array, float]:
    """Values at places, and their largest distance over a unit from the curve at its samples and at the places."""
    at = np.union1d(x, places)
    over = np.interp(at, x, unit)
    curve = PchipInterpolator(x, y)(at)
    hats = np.column_stack([np.interp(at, places, row) for row in np.eye(len(places))])
    best, error, weight = curve, np.inf, over**-2.0
    for _ in range(WEIGHTS):
        root = np.sqrt(weight)
        values = np.linalg.lstsq(hats * root[:, None], curve * root, rcond=None)[0]
        distance = np.abs(hats @ values - curve) / over
        if distance.max() < error:
            best, error = values, float(distance.max())
        if not error > max(enough, 1e-14 * np.abs(curve).max()):
            break
        weight = weight * np.maximum(distance / distance.max(), 1e-3)
        weight = weight / weight.sum()
    return best, error
