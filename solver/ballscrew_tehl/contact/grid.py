"""Graded grid of one contact in Hertz units: X = x/b along rolling, Y = y/a across, of which Y >= 0 is solved."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TINY = 1e-300  # keeps a divisor from zero where everything else in it vanishes
#: film over the gap at unit distance outside the edge of a Hertz line [b^2/R_x]: (2 sqrt(2)/3) s^(3/2)
INLET_SHAPE = 1.06
#: fewest nodes along rolling and lines of a grid; one of half the nodes has at least twice as many cells
LEAST_NODES, LEAST_LINES = 17, 5


@dataclass(frozen=True, eq=False)
class Grid:
    """Tensor grid; lines along X at every Y, pressure zero on the outer edges."""

    x: Array  # (nx,) nodes along rolling [b], graded
    y: Array  # (ny,) nodes across [a], uniform from 0
    open_side: bool = False  # the film goes on beyond the last lines, else P = 0 there

    @property
    def inner(self) -> tuple[slice, slice]:
        """Lines and columns between the outer edges."""
        return slice(0, -1), slice(1, -1)

    @property
    def h_y(self) -> float:
        """Spacing across [a]."""
        return float(self.y[1] - self.y[0])

    @property
    def n_distance(self) -> int:
        """Distances between lines of the whole contact, 0 included."""
        return 2 * self.y.size - 1

    @property
    def length_x(self) -> float:
        """Length of the domain along rolling [b]."""
        return float(self.x[-1] - self.x[0])

    @cached_property
    def cell_edges_x(self) -> Array:
        """(nx+1,) borders of the cells around the nodes; the outermost cells end at the domain [b]."""
        middle = 0.5 * (self.x[1:] + self.x[:-1])
        return np.concatenate(([self.x[0]], middle, [self.x[-1]]))

    @cached_property
    def width_x(self) -> Array:
        """(nx,) cell widths [b]."""
        return np.diff(self.cell_edges_x)

    @property
    def width_y(self) -> Array:
        """(ny,) widths of the lines of the whole contact [a]: those off the axis count twice."""
        return self.h_y * np.where(np.arange(self.y.size) > 0, 2.0, 1.0)

    @cached_property
    def weights(self) -> Array:
        """(ny, nx) area weights of the whole contact [a b]."""
        return self.width_y[:, None] * self.width_x[None, :]

    @cached_property
    def load_weights(self) -> Array:
        """(ny, nx) area weights for the load [a b]: the last lines at an open side include the load beyond."""
        weights = self.weights.copy()
        if self.open_side:
            # where the wedge alone carries the load, that of a line falls with the square of its distance
            beyond = self.y[-2] ** 2 / (self.y[-2] + 0.5 * self.h_y) * self.width_x
            weights[-2] += 2.0 * beyond
        return weights


def _bump(x: Array, centre: float, half_width: float) -> Array:
    """Smooth plateau of height 1, about 2*half_width wide."""
    return 1.0 / (1.0 + np.abs((x - centre) / half_width) ** 6)


@dataclass(frozen=True)
class GridChoice:
    """Numbers that define a grid: domain in Hertz half-widths, nodes along x, lines over Y >= 0."""

    x_in: float
    x_out: float
    y_max: float
    n_x: int
    n_y: int
    inlet: float  # length [b]
    open_side: bool = False  # as of Grid

    def halved(self) -> "GridChoice | None":
        """Every other node of the same grid, None where too few are left."""
        n_x, n_y = (self.n_x + 1) // 2, (self.n_y + 1) // 2
        return replace(self, n_x=n_x, n_y=n_y) if n_x >= 2 * LEAST_NODES - 1 and n_y >= LEAST_LINES else None

    def build(self) -> Grid:
        """The grid, refined where the film forms and leaves: a smooth density of nodes, integrated and inverted."""
        # fine in the core for any length of the domain
        fine = np.sinh(np.linspace(math.asinh(self.x_in), math.asinh(self.x_out), 20001))
        density = 1.0 + 3.0 * _bump(fine, -0.9, 0.3) + 2.0 * _bump(fine, 0.95, 0.25)
        # side lobes of a wide ellipse: the outlets of its outer lines
        density += _bump(fine, 0.35, 0.5)
        # the central lines: more nodes the shorter the inlet
        extra, inlet = min(max(0.3 / self.inlet - 2.0, 0.0), 20.0), self.inlet
        density += extra * (_bump(fine, -0.985, 0.05 + inlet) + 0.5 * _bump(fine, 0.98, 0.06 + inlet))
        # a thin tail of pressure far away needs few nodes; the wedge of a film thicker than the flattening needs a
        # spacing in proportion to the distance
        wedge = max(1.0, math.sqrt(2.0 * inlet**1.5 / INLET_SHAPE))
        density /= (1.0 + np.maximum(0.0, np.abs(fine) - 1.6) / wedge) ** (1.25 if inlet < 1.0 else 1.0)
        count = np.append(0.0, np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(fine)))
        x = np.interp(np.linspace(0.0, count[-1], self.n_x), count, fine)
        return Grid(x, np.linspace(0.0, self.y_max, self.n_y), self.open_side)
