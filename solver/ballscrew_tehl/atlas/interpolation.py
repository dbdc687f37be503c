"""Interpolation between contacts solved at scattered points: universal kriging, its evaluation.

Linear trend, Matern correlation of order 5/2 with one length per coordinate, the same for all quantities: one matrix of
correlations serves them all. Source: Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, Eqs. 2.25,
2.41 and 4.17. The weights are found when the atlas is made.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: points interpolated at a time: their correlations with thousands of others stay within the cache
CHUNK = 64


class Interpolant(NamedTuple):
    """Points (n, d) over the lengths of their coordinates; trend (terms, q) and weights (n, q) of q quantities."""

    points: Array
    trend: Array
    weights: Array

    def __call__(self, at: Array) -> Array:
        """Interpolated quantities (m, q) at points (m, d) over the lengths."""
        found = trend_terms(at) @ self.trend
        for i in range(0, len(at), CHUNK):
            found[i : i + CHUNK] += correlation(at[i : i + CHUNK], self.points) @ self.weights
        return found


def correlation(one: Array, two: Array) -> Array:
    """Correlations (m, n) of order 5/2 between points (m, d) and (n, d) over the lengths."""
    square = (one * one).sum(axis=1)[:, None] + (two * two).sum(axis=1) - 2.0 * (one @ two.T)
    s = np.sqrt(np.maximum(5.0 * square, 0.0))
    found = (s / 3.0 + 1.0) * s + 1.0
    found *= np.exp(-s)
    return found


def trend_terms(at: Array) -> Array:
    """1 and the coordinates (m, d+1)."""
    return np.concatenate([np.ones((len(at), 1)), at], axis=1)
