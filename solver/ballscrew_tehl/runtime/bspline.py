"""Uniform cubic B-splines through values on a uniform grid: axes, weights of a point, fit.

n nodes take n + 2 coefficients; the spline is exact for cubic polynomials (not-a-knot ends).
Source: C. de Boor, A Practical Guide to Splines, rev. ed. 2001, chapters IX, XIII (cardinal B-splines, not-a-knot).
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Weights = tuple[Any, Any, Any, Any]  # of four neighbours; floats or arrays
LEAST_NODES = 4  # fewer nodes do not determine a not-a-knot cubic


def cubic_weights(t: Any) -> Weights:
    """Weights of the four B-splines that live on a cell, >= 0, sum 1; t: position in the cell, 0..1."""
    u = 1.0 - t
    return (
        u * u * u / 6.0,
        (4.0 - 3.0 * t * t * (1.0 + u)) / 6.0,
        (4.0 - 3.0 * u * u * (1.0 + t)) / 6.0,
        t * t * t / 6.0,
    )


def cubic_slopes(t: Any) -> Weights:
    """Derivatives of cubic_weights with respect to t (multiply by cells per unit for a slope)."""
    u = 1.0 - t
    return (-0.5 * u * u, 0.5 * t * (3.0 * t - 4.0), 0.5 * u * (4.0 - 3.0 * u), 0.5 * t * t)


def weighted(weights: Weights, values: Any, first: Any) -> Any:
    """Four neighbouring values of a list or array, from `first` on, under the weights of their cell."""
    a, b, c, d = weights
    return a * values[first] + b * values[first + 1] + c * values[first + 2] + d * values[first + 3]


class Axis:
    """Uniform axis, in the value or in its logarithm: clamps a value and places it in a cell."""

    def __init__(self, bounds: Sequence[float], logarithmic: bool) -> None:
        """Bounds: lowest value, highest value, number of nodes."""
        self.lo, self.hi = float(bounds[0]), float(bounds[1])
        self.last = int(bounds[2]) - 2
        self.logarithmic = logarithmic
        self.origin = math.log(self.lo) if logarithmic else self.lo
        self.scale = (self.last + 1) / ((math.log(self.hi) if logarithmic else self.hi) - self.origin)

    def place(self, value: float) -> tuple[int, float]:
        """Cell and position in it (0..1) of the value, clamped to the axis."""
        if value < self.lo:  # comparisons take half the time of min and max, in every step of the FMU
            value = self.lo
        elif value > self.hi:
            value = self.hi
        t = ((math.log(value) if self.logarithmic else value) - self.origin) * self.scale
        cell = int(t)
        if cell > self.last:
            cell = self.last
        return cell, t - cell

    def place_array(self, value: NDArray[np.float64]) -> tuple[NDArray[np.int_], NDArray[np.float64]]:
        """The same for an array."""
        value = np.clip(value, self.lo, self.hi)
        t = ((np.log(value) if self.logarithmic else value) - self.origin) * self.scale
        cell = np.clip(t.astype(int), 0, self.last)
        return cell, t - cell


def fit(values: NDArray[np.float64], axes: Sequence[int]) -> NDArray[np.float64]:
    """Spline coefficients that reproduce the values at the nodes, two more along each of these axes; ValueError."""
    coefficients = np.asarray(values, dtype=np.float64)
    if not np.isfinite(coefficients).all():
        raise ValueError("spline through values not finite; every node needs one, a logarithm one > 0")
    for axis in axes:
        nodes = coefficients.shape[axis]
        if nodes < LEAST_NODES:
            raise ValueError(f"spline axis {axis} has {nodes} nodes; needs >= {LEAST_NODES}")
        rows = np.moveaxis(coefficients, axis, 0)
        right = np.concatenate([rows, np.zeros((2, *rows.shape[1:]))])
        solved = np.linalg.solve(_collocation(nodes), right.reshape(nodes + 2, -1))
        coefficients = np.moveaxis(solved.reshape(right.shape), 0, axis)
    return np.ascontiguousarray(coefficients)


def _collocation(nodes: int) -> NDArray[np.float64]:
    """Rows: value at each node; third derivative the same on both sides of the second and last but one."""
    matrix = np.zeros((nodes + 2, nodes + 2))
    for node in range(nodes):
        matrix[node, node : node + 3] = (1 / 6, 4 / 6, 1 / 6)
    not_a_knot = (1.0, -4.0, 6.0, -4.0, 1.0)
    matrix[nodes, :5] = not_a_knot
    matrix[nodes + 1, -5:] = not_a_knot
    return matrix


def map_arrays(
    values: NDArray[np.float64],
    force_values: NDArray[np.float64],
    drag: NDArray[np.float64],
    separation_ratio: NDArray[np.float64],
    relieved_share: NDArray[np.float64],
    shift: NDArray[np.float64],
) -> dict[str, NDArray[np.float64]]:
    """Coefficient arrays of a nut map from physical values at its nodes; ValueError: one that must be > 0 is not.

    values (force, speed, temperature, 10): packed.SURFACES; force_values (force, 9): packed.FORCE_CURVES; drag (speed,
    temperature) [N.m]: of the oil between the balls of a nut, mechanistic;
    separation_ratio (preload, 2): separation load over preload, axial load > 0 and < 0, all > 0
    relieved_share (preload, share, 2): (force of relieved nut over preload)^(2/3), 1 to 0
    shift (preload, difference): change of preload^(2/3) by a temperature difference [N^(2/3)]
    """
    with np.errstate(divide="ignore", invalid="ignore"):  # fit refuses the logarithm of what is not positive
        return {
            "coefficients": fit(np.log(values), (0, 1, 2)),
            "force_coefficients": fit(np.log(force_values), (0,)),
            "drag_coefficients": fit(np.log(drag), (0, 1)),
            "separation_coefficients": fit(np.log(separation_ratio), (0,)),
            "sharing_coefficients": fit(relieved_share, (0, 1)),
            "shift_coefficients": fit(shift, (0, 1)),
        }
