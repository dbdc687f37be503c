"""What depends on the grid and on the ratio of radii only: nodes, undeformed gap, deflection, dry contact.

Dimensionless in Hertz units: P = p/p_max, X = x/b, Y = y/a, gap in b^2/R_x, load 2 pi/3.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.special import elliprd

from ...physics.hertz import ratio_of_axes
from ..grid import Array, GridChoice
from ..half_space import LineConvolution, deflection_operator, dry_contact
from .fluxes import Mesh, wedge_weights

TARGET_LOAD = 2.0 * np.pi / 3.0
THICK_FILM = 2.0  # film [b^2/R_x] above which it is thicker than the flattening of the bodies


@dataclass(frozen=True)
class ReynoldsState:
    """Pressure (n_y, n_x) [p_max], negative where it cavitates; rigid approach and gap (n_y, n_x) [b^2/R_x]."""

    p: Array
    h_0: float
    gap: Array


class ContactGeometry:
    """Grid, undeformed gap, deflection and dry contact of one ratio of radii."""

    def __init__(self, choice: GridChoice, radius_ratio: float) -> None:
        self.grid = choice.build()
        self.kappa = 1.0 / ratio_of_axes(radius_ratio)
        x, y = self.grid.x, self.grid.y
        # the curvature across in units of that along rolling, Hertz-scaled
        self.undeformed = 0.5 * x[None, :] ** 2 + 0.5 * (radius_ratio / self.kappa**2) * y[:, None] ** 2
        self.weights = self.grid.load_weights
        #: node next to the centre on the axis
        self.centre = int(np.argmin(np.abs(x)))
        across = self.kappa / self.grid.h_y
        self.mesh = Mesh(x, self.grid.width_x, across, self.grid.open_side, wedge_weights(x))
        # 2 p_max a R_x/(pi E' b^2) of a Hertz ellipse: Johnson 1985, Eqs. 4.24-4.26 with the symmetric integral R_D
        factor = float(1.5 / (np.pi * self.kappa**3 * elliprd(0.0, 1.0, self.kappa**2)))
        self.deflection: LineConvolution = deflection_operator(self.grid, self.kappa, factor)

    @cached_property
    def dry_contact(self) -> tuple[Array, float]:
        """Pressure and approach without a film."""
        return dry_contact(self.grid, self.undeformed, self.deflection, TARGET_LOAD)

    def embed(self, inner: Array) -> Array:
        """Inner pressures as a field (n_y, n_x) with zero edges."""
        return np.pad(inner, ((0, 1), (1, 1)))

    def gap(self, p: Array, h_0: float) -> Array:
        """Gap of pressure p and approach h_0."""
        return self.undeformed + self.deflection(p) + h_0

    def start(self, h_c: float) -> ReynoldsState:
        """The dry contact opened by a film [b^2/R_x]; if that is a thick one, a pressure as wide as the wedge."""
        if h_c < THICK_FILM:
            p, h_0 = self.dry_contact
            h_0 += h_c
        else:
            p = self.embed((1.0 + self.undeformed / h_c)[self.grid.inner] ** -2.0)
            p *= TARGET_LOAD / float(np.sum(self.weights * p))
            h_0 = h_c - float(self.gap(p, 0.0)[0, self.centre])
        return ReynoldsState(p, h_0, self.gap(p, h_0))


@lru_cache(maxsize=8)
def contact_geometry(choice: GridChoice, radius_ratio: float) -> ContactGeometry:
    """Cached geometry; all speeds and temperatures of one ball load of a map share it."""
    return ContactGeometry(choice, radius_ratio)
