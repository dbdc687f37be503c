"""Uniform cubic B-splines through values on a uniform grid: weights of a point, and the fit of the coefficients.

n nodes take n + 2 coefficients; the spline is exact for cubic polynomials (not-a-knot ends).
Source: C. de Boor, A Practical Guide to Splines, rev. ed. 2001, chapters IX and XIII (cardinal B-splines, not-a-knot).
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

LEAST_NODES = 4  # fewer nodes do not determine a not-a-knot cubic


def cubic_weights(t):
    """Weights of the four B-splines that live on a cell.

    Parameters   t : float or array, position in the cell, 0..1
    Returns      four weights like t, >= 0, sum 1
    Example      >>> cubic_weights(0.0)
                 (0.16666666666666666, 0.6666666666666666, 0.16666666666666666, 0.0)
    """
    u = 1.0 - t
    return (
        u * u * u / 6.0,
        (4.0 - 3.0 * t * t * (1.0 + u)) / 6.0,
        (4.0 - 3.0 * u * u * (1.0 + t)) / 6.0,
        t * t * t / 6.0,
    )


def cubic_slopes(t):
    """Derivatives of cubic_weights with respect to t (multiply by cells per unit for a slope)."""
    u = 1.0 - t
    return (-0.5 * u * u, 0.5 * t * (3.0 * t - 4.0), 0.5 * u * (4.0 - 3.0 * u), 0.5 * t * t)


def fit(values: NDArray[np.float64], axes: Sequence[int]) -> NDArray[np.float64]:
    """Spline coefficients that reproduce the values at the nodes.

    Parameters   values : array on a uniform grid along each of the axes
                 axes : the axes to fit, each with at least 4 nodes
    Returns      coefficients, two more along each of these axes
    Raises       ValueError: too few nodes, or a value that is not finite
    """
    coefficients = np.asarray(values, dtype=np.float64)
    if not np.isfinite(coefficients).all():
        raise ValueError("spline through values that are not finite; every node needs a finite value")
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
    """Rows: value at each node, then the third derivative runs through the second and the last but one node."""
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
    separation_ratio: NDArray[np.float64],
    relieved_share: NDArray[np.float64],
) -> Mapping[str, NDArray[np.float64]]:
    """Coefficient arrays of a nut map from physical values at its nodes.

    Parameters   values : (n_force, n_speed, n_temperature, 10), > 0, columns as nut_map.packed.SURFACES names them
                 force_values : (n_force, 4), > 0, columns as nut_map.packed.FORCE_CURVES names them
                 separation_ratio : (n_preload, 2), > 0: separation load over preload, axial load > 0 and < 0
                 relieved_share : (n_preload, n_share, 2): (force of the relieved nut over preload)^(2/3), 1 to 0
    Returns      arrays for NutMap.from_arrays
    Raises       ValueError: a value that must be positive is not
    """
    for name, array in (("values", values), ("force_values", force_values), ("separation_ratio", separation_ratio)):
        if not (np.asarray(array) > 0.0).all():
            raise ValueError(f"map {name}: minimum {np.min(array)}; needs > 0 at every node")
    return {
        "coefficients": fit(np.log(values), (0, 1, 2)),
        "force_coefficients": fit(np.log(force_values), (0,)),
        "separation_coefficients": fit(np.log(separation_ratio), (0,)),
        "sharing_coefficients": fit(relieved_share, (0, 1)),
    }
