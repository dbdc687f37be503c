"""Graded grid of one contact in Hertz units: X = x/b along rolling, Y = y/a across, Y >= 0 (mirror symmetry)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Grid:
    """Tensor grid; lines along X at every Y, pressure zero on the outer edges.

    x : (nx,) nodes along rolling [b], graded; y : (ny,) nodes across [a], uniform from 0.
    """

    x: Array
    y: Array

    @property
    def h_y(self) -> float:
        """Spacing across [a]."""
        return float(self.y[1] - self.y[0])

    @cached_property
    def cell_edges_x(self) -> Array:
        """(nx+1,) borders of the cells around the nodes; the outermost cells end at the domain [b]."""
        middle = 0.5 * (self.x[1:] + self.x[:-1])
        return np.concatenate(([self.x[0]], middle, [self.x[-1]]))

    @cached_property
    def width_x(self) -> Array:
        """(nx,) cell widths [b]."""
        return np.diff(self.cell_edges_x)

    @cached_property
    def weights(self) -> Array:
        """(ny, nx) area weights of the whole contact [a b]: lines off the axis count twice."""
        across = np.full(self.y.size, 2.0 * self.h_y)
        across[0] = self.h_y
        return across[:, None] * self.width_x[None, :]


def uniform_grid(x_in: float, x_out: float, y_max: float, n_x: int, n_y: int) -> Grid:
    """Uniform grid over x_in..x_out [b] and 0..y_max [a]."""
    return Grid(np.linspace(x_in, x_out, n_x), np.linspace(0.0, y_max, n_y))


def _bump(x: Array, centre: float, half_width: float) -> Array:
    """Smooth plateau of height 1, about 2*half_width wide."""
    return 1.0 / (1.0 + np.abs((x - centre) / half_width) ** 6)


def _nodes(fine: Array, density: Array, n: int) -> Array:
    """n nodes spread by a density given on a fine mesh."""
    count = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))))
    return np.interp(np.linspace(0.0, count[-1], n), count, fine)


def graded_grid(x_in: float, x_out: float, y_max: float, n_x: int, n_y: int, inlet: float = 0.1) -> Grid:
    """Grid refined where the film forms and where it leaves.

    inlet : length over which the gap opens by one film thickness at the edge of the Hertz line [b]. The node density
    is a sum of plateaus (inlet of all lines, edge X = -1 of the central lines, outlet); it is integrated and
    inverted, so that the spacing varies smoothly and second-order formulas keep their order.
    """
    fine = np.linspace(x_in, x_out, 20001)
    if inlet > 1.0:
        # film thicker than the elastic flattening: a hydrodynamic wedge about as wide as the inlet itself
        density = 1.0 / (1.0 + np.abs(fine / inlet)) ** 1.5
        return Grid(_nodes(fine, density, n_x), np.linspace(0.0, y_max, n_y))
    density = 1.0 + 3.0 * _bump(fine, -0.9, 0.3) + 2.0 * _bump(fine, 0.95, 0.25)
    # the central lines: more nodes the shorter the inlet
    extra = min(max(0.3 / inlet - 2.0, 0.0), 20.0)
    density += extra * (_bump(fine, -0.985, 0.05 + inlet) + 0.5 * _bump(fine, 0.98, 0.06 + inlet))
    # a thin tail of pressure far upstream needs few nodes
    density /= 1.0 + np.maximum(0.0, -fine - 1.6)
    return Grid(_nodes(fine, density, n_x), np.linspace(0.0, y_max, n_y))
