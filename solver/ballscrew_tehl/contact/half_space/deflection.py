"""Deflection of two half-spaces under pressure cells: dense along rolling, cosine transform across."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel
from .grid import Array, Grid
from .line_table import SHARE, both_sides, cell_integrals, panel_breaks, panel_nodes, panel_primitive


@kernel
def line_influence(x, edges, h_y, n_distance):
    """Influence (n_distance, nx, nx): integral of 1/r over cell k of a line d spacings away, seen from node i.

    x, edges [b]; h_y: spacing across in the same unit. Source: Love 1929 with the corner x ln(y+r) + y ln(x+r), y > 0;
    terms of x or of y alone drop out of the differences.
    """
    nx = x.size
    out = np.empty((n_distance, nx, nx))
    low, high = np.empty(nx + 1), np.empty(nx + 1)
    for i in range(nx):
        for d in range(n_distance):
            # the line's own strip is twice its upper half
            times = 1.0 if d > 0 else 2.0
            y = (d + 0.5) * h_y
            for k in range(nx + 1):
                s = edges[k] - x[i]
                if d == 0:
                    low[k] = s * np.log(abs(s)) if s != 0.0 else 0.0
                else:
                    low[k] = high[k]
                # y (ln(s + r) - ln y), odd in s
                r = np.sqrt(s * s + y * y)
                high[k] = s * np.log(y + r) + np.copysign(y * np.log((abs(s) + r) / y), s)
            for k in range(nx):
                out[d, i, k] = times * ((high[k + 1] - low[k + 1]) - (high[k] - low[k]))
    return out


def distance_modes(n_y: int) -> Array:
    """Cosine transform (modes, distances) of an even kernel of period 4(n_y-1)."""
    modes = np.arange(2 * n_y - 1)
    transform = np.cos(np.pi * np.outer(modes, modes) / (modes.size - 1))
    transform[:, 1:-1] *= 2.0
    return transform


def line_modes(n_y: int) -> tuple[Array, Array]:
    """Transforms of an even field on lines 0..n_y-1 to its modes (modes, n_y) and back (n_y, modes)."""
    n = 2 * (n_y - 1)
    angle = np.pi * np.outer(np.arange(n + 1), np.arange(n_y)) / n
    share = np.full(n + 1, 1.0 / n)
    share[[0, -1]] *= 0.5
    forward, backward = np.cos(angle), np.cos(angle).T * share
    forward[:, 1:] *= 2.0
    return forward, backward


class LineConvolution:
    """Convolution across (Toeplitz in y, even) with dense influence along x: out = sum_l K[|j-l|] f_l.

    influence : (2 n_y - 1, nx, nx), one matrix per distance in lines; the lines are 0..n_y-1 of an even field whose
    last line is zero.
    """

    def __init__(self, hat: Array, same_line: Array, n_y: int) -> None:
        """From the transform (modes, nx, nx) of the influence by distance_modes, and influence[0]."""
        self._hat, self.same_line = hat, same_line
        self._forward, self._backward = line_modes(n_y)

    @cached_property
    def single(self) -> tuple[NDArray[Any], ...]:
        """Forward, modes and backward in single precision."""
        return tuple(v.astype(np.float32) for v in (self._forward, self._hat, self._backward))

    def __call__(self, field: Array) -> Array:
        """Convolve field (n_y, nx), zero on the last line."""
        return _convolve(self._forward, self._hat, self._backward, field)

    def rough(self, field: Array) -> Array:
        """The same in single precision, 1e-6 of the largest value: half the memory traffic, for increments."""
        forward, hat, backward = self.single
        return _convolve(forward, hat, backward, field.astype(np.float32)).astype(np.float64)


def _convolve(
    forward: NDArray[Any], hat: NDArray[Any], backward: NDArray[Any], field: NDArray[Any]
) -> NDArray[Any]:
    modes, nx = hat.shape[:2]
    rows = (forward @ field).reshape(modes, -1, nx)
    return backward @ np.matmul(rows, hat.transpose(0, 2, 1)).reshape(-1, nx)


def mode_operator(grid: Grid, sign: float, breaks: Array, density: Array, own: Array) -> LineConvolution:
    """Operator of densities (panels, points, distances) at panel_nodes(breaks) for distances 1, 2, ...

    Distances beyond those are zero. sign = -1 reverses s; own: the influence of a line on itself.
    """
    modes = distance_modes(grid.y.size)
    table = panel_primitive(breaks, density @ modes[:, 1 : density.shape[2] + 1].T)
    hat = np.empty((len(modes), grid.x.size, grid.x.size))
    cell_integrals(grid.x, grid.cell_edges_x, sign, breaks, table, own, hat)
    return LineConvolution(hat, own, grid.y.size)


def deflection_operator(grid: Grid, kappa: float, factor: float) -> LineConvolution:
    """Deflection [b^2/R_x] of dimensionless pressure: factor * double integral of P/sqrt(dX^2 + (dY/kappa)^2).

    kappa = b/a; factor = 2 p_max a R_x/(pi E' b^2). Panels of order POINTS: 1e-11 of the largest influence.
    """
    h_y, scale = grid.h_y / kappa, factor * kappa
    half = panel_breaks(0.0, grid.length_x, 0.5 * h_y, SHARE, np.inf)
    s = panel_nodes(half)[:, :, None]
    # integral of 1/r across a strip
    y = (np.arange(grid.n_distance) + 0.5) * h_y
    density = scale * np.diff(np.log(y + np.sqrt(s * s + y * y)))
    own = scale * line_influence(grid.x, grid.cell_edges_x, h_y, 1)[0]
    return mode_operator(grid, 1.0, *both_sides(half, density, density), own)
