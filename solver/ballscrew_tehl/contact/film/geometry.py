"""What depends on the grid and on the ratio of radii only: nodes, undeformed gap, deflection, dry contact.

Dimensionless in Hertz units: P = p/p_max, X = x/b, Y = y/a, gap in b^2/R_x, load 2 pi/3.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.special import elliprd

from ...physics.hertz import ratio_of_axes
from ..half_space.deflection import LineConvolution, deflection_operator, dry_contact
from ..half_space.grid import Array, Grid, graded_grid
from .fluxes import Mesh, wedge_weights

TARGET_LOAD = 2.0 * np.pi / 3.0
#: film [b^2/R_x] above which it is thicker than the flattening of the bodies
THICK_FILM = 2.0
#: fewest nodes along rolling and lines of a grid; one of half the nodes has at least twice as many cells
LEAST_NODES, LEAST_LINES = 17, 5


@dataclass(frozen=True)
class GridChoice:
    """Numbers that define a grid: domain in Hertz half-widths, nodes, and the inlet length it is refined for [b].

    n_y lines over the half plane Y >= 0; open_side: the film goes on beyond them.
    """

    x_in: float
    x_out: float
    y_max: float
    n_x: int
    n_y: int
    inlet: float
    open_side: bool = False

    def build(self) -> Grid:
        """The grid."""
        return graded_grid(self.x_in, self.x_out, self.y_max, self.n_x, self.n_y, self.inlet, self.open_side)

    def halved(self) -> "GridChoice | None":
        """Every other node of the same grid, None where too few are left."""
        n_x, n_y = (self.n_x + 1) // 2, (self.n_y + 1) // 2
        return replace(self, n_x=n_x, n_y=n_y) if n_x >= 2 * LEAST_NODES - 1 and n_y >= LEAST_LINES else None


@dataclass(frozen=True)
class ReynoldsState:
    """Pressure (n_y, n_x) [p_max], negative where it cavitates; rigid approach and gap (n_y, n_x) [b^2/R_x]."""

    p: Array
    h_0: float
    gap: Array


class ContactGeometry:
    """What depends on the grid and on the ratio of radii only; shared by all operating points."""

    def __init__(self, choice: GridChoice, radius_ratio: float) -> None:
        self.grid = choice.build()
        self.kappa = 1.0 / ratio_of_axes(radius_ratio)
        #: curvature across in units of the curvature along rolling, Hertz-scaled
        self.curvature_y = radius_ratio / self.kappa**2
        x, y = self.grid.x, self.grid.y
        self.undeformed = 0.5 * x[None, :] ** 2 + 0.5 * self.curvature_y * y[:, None] ** 2
        self.weights = self.grid.load_weights
        self.inner_weights = self.weights[self.grid.inner]
        #: node next to the centre on the axis
        self.centre = int(np.argmin(np.abs(x)))
        self.kappa_h = self.kappa / self.grid.h_y
        self.mesh = Mesh(x, self.grid.width_x, self.kappa_h, self.grid.open_side, wedge_weights(x))
        self.deflection: LineConvolution = deflection_operator(
            self.grid, self.kappa, _hertz_factor(self.kappa)
        )

    @cached_property
    def dry_contact(self) -> tuple[Array, float]:
        """Pressure and approach without a film."""
        return dry_contact(self.grid, self.undeformed, self.deflection, TARGET_LOAD)

    def embed(self, inner: Array) -> Array:
        """Inner pressures, flat or (lines, columns), as a field with zero edges."""
        field_ = np.zeros_like(self.undeformed)
        field_[self.grid.inner] = inner.reshape(self.inner_weights.shape)
        return field_

    def gap(self, p: Array, h_0: float) -> Array:
        """Gap of pressure p and approach h_0."""
        return self.undeformed + self.deflection(p) + h_0

    def start(self, h_c: float) -> ReynoldsState:
        """A state to begin with for an estimate of the central film [b^2/R_x].

        The dry contact opened by the film; where that is thicker than the flattening, a pressure as wide as the wedge.
        """
        if h_c < THICK_FILM:
            p, h_0 = self.dry_contact
            h_0 += h_c
            return ReynoldsState(p, h_0, self.gap(p, h_0))
        x, y = self.grid.x[None, :], self.grid.y[:, None]
        p = (1.0 + (x * x + self.curvature_y * y * y) / (2.0 * h_c)) ** -2.0
        p = self.embed(p[self.grid.inner])
        p *= TARGET_LOAD / float(np.sum(self.weights * p))
        h_0 = h_c - float(self.gap(p, 0.0)[0, self.centre])
        return ReynoldsState(p, h_0, self.gap(p, h_0))


def _hertz_factor(kappa: float) -> float:
    """2 p_max a R_x/(pi E' b^2) of a Hertz ellipse with b/a = kappa: a number of the shape only.

    Source: Johnson 1985, Eqs. 4.24-4.26 with the symmetric integral R_D:
    factor = 3/(2 pi kappa^3 R_D(0, 1, kappa^2)); 2/pi^2 for the circle.
    """
    return float(1.5 / (np.pi * kappa**3 * elliprd(0.0, 1.0, kappa**2)))


@lru_cache(maxsize=8)
def contact_geometry(choice: GridChoice, radius_ratio: float) -> ContactGeometry:
    """Cached geometry; all speeds and temperatures of one ball load of a map share it."""
    return ContactGeometry(choice, radius_ratio)
