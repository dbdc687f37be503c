"""Interpolation of contacts solved at scattered points: universal kriging (Gaussian process regression).

Quadratic trend, Matern covariance of order 5/2 with one length per coordinate, and noise: that of the solver's grids,
about 1e-3 of a film. Lengths and noise by maximum likelihood. Source: Rasmussen & Williams 2006, Gaussian Processes for
Machine Learning, Eqs. 2.25, 2.41, 4.17 (order 5/2) and 5.8; leave-one-out errors: their Eq. 5.12.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

from .contacts import Array

#: bounds of a length, in units of the range of its coordinate, and of the noise as a share of the deviation
LENGTHS, NOISE = (0.05, 20.0), (1e-5, 1.0)
#: lengths and noise that the search begins with, its most evaluations and its tolerance of the logarithms
FIRST_LENGTH, FIRST_NOISE, MAX_EVALUATIONS, SEARCH_TOLERANCE = 0.5, 3e-3, 160, 0.05
#: fewest points that a quadratic trend takes: with fewer, the trend is linear
QUADRATIC_FROM = 24
#: points interpolated at a time: their correlations with some thousand others stay within the cache
CHUNK = 32


class Interpolant(NamedTuple):
    """What interpolates, without its errors: points (n, d), hyper (d+1,), slopes of the trend, weights (n,)."""

    points: Array
    hyper: Array
    slopes: Array
    weights: Array

    def __call__(self, at: Array) -> Array:
        """Interpolated values at points (m, d)."""
        trend = _terms(at, _degree(self.slopes.size, at.shape[1])) @ self.slopes
        parts = [
            _correlation(at[i : i + CHUNK], self.points, self.hyper) @ self.weights
            for i in range(0, len(at), CHUNK)
        ]
        return np.asarray(trend + np.concatenate(parts) if parts else trend)


class Kriging:
    """Values at scattered points, interpolated.

    Parameters   points (n, d): coordinates of about unit range;  values (n,);  hyper (d+1,): logarithms of lengths and
                 noise found before, None = search for the most likely ones;  degree: of the trend, 0 to 2, -1 = none,
                 None = by the number of points
    Raises       ValueError: fewer points than a linear trend has terms, or numbers that are not finite
    """

    def __init__(
        self, points: Array, values: Array, hyper: Array | None = None, degree: int | None = None
    ) -> None:
        n, dimensions = points.shape
        if not n > dimensions + 1:
            raise ValueError(f"kriging: {n} points; needs more than {dimensions + 1}")
        if not (np.isfinite(points).all() and np.isfinite(values).all()):
            raise ValueError("kriging: points and values need to be finite")
        self.points, self.values = points, values
        self._trend = _terms(points, (2 if n >= QUADRATIC_FROM else 1) if degree is None else degree)
        self.hyper = self._most_likely() if hyper is None else hyper
        self._factor, slopes, self._weights, self.scale, _ = self._solved(self.hyper)
        self.interpolant = Interpolant(points, self.hyper, slopes, self._weights)

    def _most_likely(self) -> Array:
        dimensions = self.points.shape[1]
        first = np.log([FIRST_LENGTH] * dimensions + [FIRST_NOISE])
        bounds = [tuple(np.log(LENGTHS))] * dimensions + [tuple(np.log(NOISE))]
        found = minimize(
            lambda hyper: self._solved(hyper)[-1],
            first,
            method="Nelder-Mead",
            bounds=bounds,
            options={
                "maxfev": MAX_EVALUATIONS,
                "xatol": SEARCH_TOLERANCE,
                "fatol": SEARCH_TOLERANCE,
                # of size 1 in the logarithms: a small one ends far from the maximum
                "initial_simplex": np.vstack([first, first + np.eye(dimensions + 1)]),
            },
        )
        return np.asarray(found.x)

    def _solved(self, hyper: Array) -> tuple[Array, Array, Array, float, float]:
        """Factor of the correlations, coefficients of the trend, weights, deviation, negative log likelihood."""
        n = self.values.size
        correlation = _correlation(self.points, self.points, hyper)
        correlation[np.diag_indices(n)] += math.exp(2.0 * hyper[-1])
        factor = cholesky(correlation, lower=True)
        whitened = cho_solve((factor, True), self._trend)
        slopes = np.linalg.solve(self._trend.T @ whitened, whitened.T @ self.values)
        rest = self.values - self._trend @ slopes
        weights = cho_solve((factor, True), rest)
        variance = max(float(rest @ weights) / n, np.finfo(float).tiny)
        likelihood = 0.5 * n * math.log(variance) + float(np.log(np.diag(factor)).sum())
        return factor, slopes, weights, math.sqrt(variance), likelihood

    def __call__(self, points: Array) -> Array:
        """Interpolated values at points (m, d)."""
        return self.interpolant(points)

    def covariance(self, points: Array) -> Array:
        """Posterior covariance (m, m) at points (m, d), without noise, trend taken as known."""
        correlated = _correlation(points, self.points, self.hyper)
        solved = cho_solve((self._factor, True), correlated.T)
        return np.asarray(self.scale**2 * (_correlation(points, points, self.hyper) - correlated @ solved))

    def deviation(self, points: Array) -> Array:
        """Standard deviation (m,) of the interpolated values at points (m, d)."""
        correlated = _correlation(points, self.points, self.hyper)
        solved = cho_solve((self._factor, True), correlated.T)
        return np.asarray(
            self.scale * np.sqrt(np.maximum(1.0 - np.einsum("mn,nm->m", correlated, solved), 0.0))
        )

    @cached_property
    def left_out(self) -> Array:
        """Error (n,) at every point when it is left out, lengths and trend kept."""
        inverse = cho_solve((self._factor, True), np.eye(self.values.size))
        return np.asarray(self._weights / np.diag(inverse))


def _correlation(one: Array, two: Array, hyper: Array) -> Array:
    """Correlations (m, n) of order 5/2 between points (m, d) and (n, d)."""
    scale = math.sqrt(5.0) * np.exp(-hyper[:-1])
    s = cdist(one * scale, two * scale)
    return np.asarray((1.0 + s + s * s / 3.0) * np.exp(-s))


def _degree(terms: int, dimensions: int) -> int:
    """Degree of a trend of so many terms."""
    return terms - 1 if terms <= 1 else 1 if terms == dimensions + 1 else 2


def _terms(points: Array, degree: int) -> Array:
    """1, from degree 1 up the coordinates, from degree 2 up their products (n, terms); nothing for degree -1."""
    if degree < 0:
        return np.empty((len(points), 0))
    columns = [np.ones(len(points)), *(points.T if degree else ())]
    if degree == 2:
        d = points.shape[1]
        columns += [points[:, i] * points[:, j] for i in range(d) for j in range(i, d)]
    return np.stack(columns, axis=1)
