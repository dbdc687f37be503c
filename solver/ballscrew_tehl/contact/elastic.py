"""Deflection of two half-spaces under pressure cells: dense along rolling, cosine transform across."""

from __future__ import annotations

import numpy as np
from numba import njit

from .grid import Array, Grid


@njit(cache=True, fastmath=False)
def _love(x: float, y: float) -> float:
    """Integral of 1/r over the rectangle 0..x, 0..y (Love 1929), odd in x and in y."""
    r = np.sqrt(x * x + y * y)
    value = 0.0
    if x != 0.0:
        value += x * np.arcsinh(y / abs(x))
    if y != 0.0 and r > 0.0:
        value += y * np.arcsinh(x / abs(y))
    return value


@njit(cache=True)
def line_influence(x, edges, h_y, n_distance):
    """Influence (n_distance, nx, nx): integral of 1/r over cell k of a line d spacings away, seen from node i.

    x, edges [b]; h_y: spacing across in the same unit. Source: Love 1929; the corner function is shared by neighbours.
    """
    nx = x.size
    out = np.empty((n_distance, nx, nx))
    corner = np.empty((n_distance + 1, nx + 1))
    for i in range(nx):
        for d in range(n_distance + 1):
            for k in range(nx + 1):
                corner[d, k] = _love(edges[k] - x[i], (d - 0.5) * h_y)
        for d in range(n_distance):
            for k in range(nx):
                out[d, i, k] = corner[d + 1, k + 1] - corner[d + 1, k] - corner[d, k + 1] + corner[d, k]
    return out


def cosine_matrices(n_y: int) -> tuple[Array, Array, Array]:
    """Transforms of even data on lines 0..n_y-1 with room for linear convolution.

    Returns forward (modes, n_y), backward (n_y, modes) and kernel transform (modes, modes); period 4(n_y-1).
    """
    n = n_y - 1
    modes = np.arange(2 * n + 1)
    forward = np.cos(np.pi * np.outer(modes, np.arange(n_y)) / (2 * n))
    forward[:, 1:] *= 2.0
    backward = np.cos(np.pi * np.outer(np.arange(n_y), modes) / (2 * n)) / (4 * n)
    backward[:, 1:-1] *= 2.0
    kernel = np.cos(np.pi * np.outer(modes, modes) / (2 * n))
    kernel[:, 1:-1] *= 2.0
    return forward, backward, kernel


class LineConvolution:
    """Convolution across (Toeplitz in y, even) with dense influence along x: out = sum_l K[|j-l|] f_l.

    influence : (2 n_y - 1, nx, nx), one matrix per distance in lines.
    """

    def __init__(self, influence: Array, n_y: int) -> None:
        forward, backward, kernel = cosine_matrices(n_y)
        modes, nx = kernel.shape[0], influence.shape[1]
        self._forward, self._backward = forward, backward
        self._hat = (kernel @ influence.reshape(modes, nx * nx)).reshape(modes, nx, nx)
        self.same_line = influence[0]

    def __call__(self, field: Array) -> Array:
        """Convolve field (n_y, nx); the last line must be zero."""
        hat = self._forward @ field
        out = np.matmul(self._hat, hat[:, :, None])[:, :, 0]
        return self._backward @ out


def deflection_operator(grid: Grid, kappa: float, factor: float) -> LineConvolution:
    """Deflection [b^2/R_x] of dimensionless pressure: factor * double integral of P/sqrt(dX^2 + (dY/kappa)^2).

    kappa = b/a; factor = 2 p_max a R_x/(pi E' b^2).
    """
    n_distance = 2 * grid.y.size - 1
    influence = line_influence(grid.x, grid.cell_edges_x, grid.h_y / kappa, n_distance)
    return LineConvolution(influence * (factor * kappa), grid.y.size)
