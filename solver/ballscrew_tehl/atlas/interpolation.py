"""Interpolation between contacts solved at scattered points: universal kriging, its evaluation.

Linear trend, Matern correlation of order 5/2 with one length per coordinate, the same for all quantities: one matrix of
correlations serves them all. Source: Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, Eqs. 2.25,
2.41 and 4.17. The weights are found when the atlas is made.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..physics.ball_law import Array

#: points interpolated at a time: their correlations with thousands of others stay within the cache
CHUNK = 16


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
    s = one @ two.T
    s *= -2.0
    s += (one * one).sum(axis=1)[:, None]
    s += (two * two).sum(axis=1)
    s *= 5.0
    np.sqrt(np.maximum(s, 0.0, out=s), out=s)
    found = s / 3.0
    found += 1.0
    found *= s
    found += 1.0
    found *= np.exp(np.negative(s, out=s), out=s)
    return found


def trend_terms(at: Array) -> Array:
    """1 and the coordinates (m, d+1)."""
    return np.concatenate([np.ones((len(at), 1)), at], axis=1)
