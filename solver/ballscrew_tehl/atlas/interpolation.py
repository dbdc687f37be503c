"""Interpolation between contacts solved at scattered points by universal kriging, and cubic splines through a grid.

Linear trend, Matern correlation of order 5/2 with one length per coordinate, the same for all quantities: one matrix of
correlations serves them all. Source: Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, Eqs. 2.25,
2.41 and 4.17. The weights are found when the atlas is made.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..physics.ball_law import Array

#: points interpolated at a time: their correlations with thousands of others stay within the cache, and its memory is
#: used again; with 16 they took seven times as long on a busy machine
CHUNK = 8


class Interpolant(NamedTuple):
    """Points (n, d) over the lengths of their coordinates; trend (terms, q) and weights (n, q) of q quantities."""

    points: Array
    trend: Array
    weights: Array

    def __call__(self, at: Array) -> Array:
        """Interpolated quantities (m, q) at points (m, d) over the lengths."""
        found = trend_terms(at) @ self.trend
        squares = (self.points * self.points).sum(axis=1)
        for i in range(0, len(at), CHUNK):
            found[i : i + CHUNK] += correlation(at[i : i + CHUNK], self.points, squares) @ self.weights
        return found


def correlation(one: Array, two: Array, squares: Array | None = None) -> Array:
    """Correlations (m, n) of order 5/2 between points (m, d) and (n, d) over the lengths.

    squares : sums (n,) of those of the coordinates of the second, if they are known
    """
    s = one @ two.T
    s *= -2.0
    s += (one * one).sum(axis=1)[:, None]
    s += (two * two).sum(axis=1) if squares is None else squares
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


def cubic_basis(knots: Array, x: Array) -> tuple[NDArray[np.int64], Array]:
    """First coefficient of the four cubic B-splines that live at points x (...), and their values (..., 4).

    Source       de Boor, A Practical Guide to Splines, rev. ed. 2001, chapter X: recurrence of Cox and de Boor
    """
    cell = np.clip(np.searchsorted(knots, x, side="right") - 1, 3, len(knots) - 5)
    values = np.ones((*np.shape(x), 1))
    for degree in (1, 2, 3):
        steps = np.arange(degree)
        left, right = knots[cell[..., None] + 1 - degree + steps], knots[cell[..., None] + 1 + steps]
        part = values / (right - left)
        values = np.zeros((*np.shape(x), degree + 1))
        values[..., :-1] = part * (right - x[..., None])
        values[..., 1:] += part * (x[..., None] - left)
    return cell - 3, values


def cubic_spline(nodes: Array, values: Array, axis: int) -> tuple[Array, Array]:
    """Knots of the cubic spline through values at four or more rising nodes along an axis, and its coefficients.

    Not-a-knot ends; as many coefficients as nodes.
    """
    knots = np.concatenate([[nodes[0]] * 4, nodes[2:-2], [nodes[-1]] * 4])
    first, weights = cubic_basis(knots, nodes)
    collocation = np.zeros((nodes.size, nodes.size))
    collocation[np.arange(nodes.size)[:, None], first[:, None] + np.arange(4)] = weights
    rows = np.moveaxis(values, axis, 0)
    solved = np.asarray(np.linalg.solve(collocation, rows.reshape(nodes.size, -1)), dtype=float)
    return knots, np.moveaxis(solved.reshape(rows.shape), 0, axis)
