"""Few points, joined by straight lines, near a curve.

Straight pieces that need not meet give a lower bound of the largest error: the smallest one at which so many cover the
samples, each as long as the error allows (greedy, bisection over the error). The points are between their ends, where
the pieces of a curve with one sign of curvature meet; their values are a weighted least squares whose weights follow
the errors (Lawson 1961: towards the least largest error). Between samples the curve is the monotone cubic.
"""

from bisect import bisect_right
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from ballscrew_tehl.numerics import Array

#: relative accuracy of the error;  slopes tried at once, rounds;  rounds of the weights
ACCURACY, SLOPES, ROUNDS, WEIGHTS = 1e-3, 33, 6, 60
#: mean square of deviations over standard errors up to which points are enough: 1 by chance alone
ENOUGH = 1.5


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
    low, high, width = steps.min(), steps.max(), np.empty(0)
    for _ in range(ROUNDS):
        slopes = np.linspace(low, high, SLOPES)
        width = np.ptp(y - slopes[:, None] * x, axis=1)
        best = int(np.argmin(width))
        low, high = slopes[max(best - 1, 0)], slopes[min(best + 1, SLOPES - 1)]
    return 0.5 * float(width.min())


def _starts(x: Array, y: Array, error: float) -> list[int]:
    """First samples of the longest pieces with at most an error."""
    starts = [0]
    while True:
        first = starts[-1]
        ends = range(first + 1, len(x))
        last = first + bisect_right(ends, error, key=lambda k: line_error(x[first : k + 1], y[first : k + 1]))
        if last >= len(x) - 1:
            return starts
        starts.append(last + 1)


def few_points(x: Array, y: Array, count: int) -> Points:
    """At most `count` >= 2 points for a curve of rising x (n,), n >= 3, and y (n,)."""
    low, high, starts = 0.0, line_error(x, y), [0]
    while high - low > ACCURACY * high and high > 1e-12 * float(np.max(np.abs(y))):
        middle = 0.5 * (low + high)
        pieces = _starts(x, y, middle)
        if len(pieces) >= count:
            low = middle
        else:
            high, starts = middle, pieces
    places = np.array([x[0], *(0.5 * (x[k - 1] + x[k]) for k in starts[1:]), x[-1]])
    values, error = _values(x, y, places)
    # pieces that do not meet between two samples may do so at one of them
    for number, first in enumerate(starts[1:], start=1):
        for place in (x[first - 1], x[first]):
            tried = np.r_[places[:number], place, places[number + 1 :]]
            new, largest = _values(x, y, tried)
            if largest < error:
                places, values, error = tried, new, largest
    return Points(places, values, error, low)


def _values(x: Array, y: Array, places: Array) -> tuple[Array, float]:
    """Values at places, and their largest distance from the curve at its samples and at the places."""
    at = np.union1d(x, places)
    curve = PchipInterpolator(x, y)(at)
    hats = np.column_stack([np.interp(at, places, row) for row in np.eye(len(places))])
    best, error, weight = curve, np.inf, np.ones(len(at))
    for _ in range(WEIGHTS):
        root = np.sqrt(weight)
        values = np.linalg.lstsq(hats * root[:, None], curve * root, rcond=None)[0]
        distance = np.abs(hats @ values - curve)
        if distance.max() < error:
            best, error = values, float(distance.max())
        if not error > 1e-14 * np.abs(curve).max():
            break
        weight = weight * np.maximum(distance / distance.max(), 1e-3)
        weight = weight / weight.sum()
    return best, error


def weighted_points(x: Array, y: Array, errors: Array, count: int) -> Points:
    """Points at samples, added where these are farthest off until all is near by their errors, at most `count`."""
    places = x[[0, -1]]
    while True:
        hats = np.column_stack([np.interp(x, places, row) for row in np.eye(len(places))])
        values = np.linalg.lstsq(hats / errors[:, None], y / errors, rcond=None)[0]
        distance = np.abs(hats @ values - y)
        if np.mean((distance / errors) ** 2) <= ENOUGH or len(places) >= min(count, len(x)):
            return Points(places, np.asarray(values, dtype=float), float(distance.max()), 0.0)
        new = np.where(np.isin(x, places), 0.0, distance / errors)
        places = np.union1d(places, x[np.argmax(new)])
