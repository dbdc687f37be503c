"""Reynolds equation with deflection, cavitation and load balance, solved together by Newton's method.

Dimensionless in Hertz units: P = p/p_max, X = x/b, Y = y/a, gap in b^2/R_x, load 2 pi/3. Unknowns are the pressures
and the rigid approach H_0. Every Newton step solves its linear system by GMRES; one dense Jacobian per line along
rolling (with the line's own deflection in it) is the preconditioner. The ellipse of a ball in a groove is long
across rolling, so lines are nearly independent and a handful of iterations suffice; a circle needs about thirty.
Differs from paper: Eq. 6 omits the deflection; cavitation (Eq. 9) is the condition P >= 0 by a penalty.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.linalg import lapack

from ..hertz import ratio_of_axes
from . import kernels
from .dry import dry_contact
from .elastic import LineConvolution, deflection_operator
from .grid import Array, Grid, graded_grid, uniform_grid
from .krylov import gmres

TARGET_LOAD = 2.0 * np.pi / 3.0
#: stiffness against negative pressure; its error in P is residual/PENALTY
PENALTY = 1e5
#: largest pressure change of one Newton step [p_max]
STEP_LIMIT = 0.3
#: share of the expected film below which the flow sees a lifted gap while iterating
FLOOR_SHARE = 0.2


@dataclass(frozen=True)
class GridChoice:
    """Numbers that define a grid: domain in Hertz half-widths, nodes, and the inlet length it is refined for [b]."""

    x_in: float = -2.5
    x_out: float = 1.5
    y_max: float = 1.5
    n_x: int = 129
    n_y: int = 17
    inlet: float | None = None

    def build(self) -> Grid:
        """The grid; uniform without an inlet length."""
        if self.inlet is None:
            return uniform_grid(self.x_in, self.x_out, self.y_max, self.n_x, self.n_y)
        return graded_grid(self.x_in, self.x_out, self.y_max, self.n_x, self.n_y, self.inlet)


#: nodal film coefficients of P >= 0: ln phi, d ln phi/dP, g, dg/dP, each (n_y, n_x)
FilmCoefficients = Callable[[Array], tuple[Array, Array, Array, Array]]


@dataclass(frozen=True)
class ReynoldsState:
    """Pressure (n_y, n_x) [p_max], rigid approach and gap (n_y, n_x) [b^2/R_x]."""

    p: Array
    h_0: float
    gap: Array


@dataclass
class NewtonHistory:
    """One entry per Newton step, and why it ended."""

    residual: list[float] = field(default_factory=list)
    change: list[float] = field(default_factory=list)
    load_error: list[float] = field(default_factory=list)
    krylov: list[int] = field(default_factory=list)
    deflections: int = 0
    converged: bool = False
    reason: str = "not started"


class _Linearisation:
    """Residual, Jacobian and preconditioner at one state."""

    def __init__(
        self, geometry: ContactGeometry, p: Array, gap: Array, film: FilmCoefficients, floor: float
    ) -> None:
        grid = geometry.grid
        ny, nx = p.shape
        self.geometry, self.gap = geometry, gap
        ln_phi, dln_phi, self.g, self.dg = film(np.maximum(p, 0.0))
        self.c_x, self.c_y = np.empty((ny, nx - 1, 4)), np.empty((ny - 1, nx, 4))
        self.wedge = np.empty((ny, nx - 1, 3))
        flow_x, flow_y, res = np.empty((ny, nx - 1)), np.empty((ny - 1, nx)), np.empty((ny, nx))
        kernels.face_fluxes(
            grid.x, geometry.kappa_h, p, gap, ln_phi, dln_phi, self.g, self.dg, flow_x, flow_y,
            self.c_x, self.c_y, self.wedge, floor,
        )  # fmt: skip
        kernels.residual(grid.width_x, geometry.kappa_h, flow_x, flow_y, res)
        # measured by the local flow conductance, which spans many decades from thick films to the contact
        conductance = np.zeros_like(p)
        conductance[:, 1:-1] = (np.abs(self.c_x[:, 1:, 0]) + np.abs(self.c_x[:, :-1, 1])) / grid.width_x[1:-1]
        self.penalty = np.where(p < 0.0, PENALTY + 10.0 * conductance, 0.0)
        self.residual = (res - self.penalty * p)[:-1, 1:-1]

    def factorise(self) -> None:
        """LU of every line's Jacobian, and its answer to a rigid approach."""
        geometry = self.geometry
        lines, n = self.residual.shape
        matrix, columns = np.empty((n, n)), np.empty((lines, n))
        self._lu = []
        for j in range(lines):
            kernels.line_jacobian(
                j, geometry.grid.width_x, geometry.kappa_h, self.c_x, self.c_y, self.wedge, self.gap, self.g, self.dg,
                self.penalty, geometry.deflection.same_line, matrix, columns[j],
            )  # fmt: skip
            factor, pivot, info = lapack.dgetrf(matrix.T)
            if info != 0:
                raise np.linalg.LinAlgError(f"line {j} of the contact has a singular Jacobian")
            self._lu.append((factor, pivot))
        self._approach = self._solve_lines(columns)
        self._approach_load = float(np.sum(geometry.inner_weights * self._approach))

    def _solve_lines(self, rhs: Array) -> Array:
        return np.stack([lapack.dgetrs(*lu, row, trans=1)[0] for lu, row in zip(self._lu, rhs, strict=True)])

    def precondition(self, v: Array) -> Array:
        """Line solves, bordered by the load balance."""
        z = self._solve_lines(v[:-1].reshape(self.residual.shape))
        d_h0 = (np.sum(self.geometry.inner_weights * z) - v[-1]) / self._approach_load
        return np.append(z - d_h0 * self._approach, d_h0)

    def apply(self, v: Array) -> Array:
        """Jacobian of residual and load times a change of pressures and approach."""
        geometry = self.geometry
        d_p = geometry.embed(v[:-1])
        out = np.empty_like(d_p)
        kernels.jacobian_times(
            geometry.grid.width_x, geometry.kappa_h, self.c_x, self.c_y, self.wedge, self.gap, self.g, self.dg,
            self.penalty, d_p, geometry.deflection(d_p) + v[-1], out,
        )  # fmt: skip
        return np.append(out[:-1, 1:-1], np.sum(geometry.weights * d_p))


class ContactGeometry:
    """Everything that depends on the grid and on the ratio of radii only; shared by all operating points."""

    def __init__(self, choice: GridChoice, radius_ratio: float) -> None:
        self.grid = choice.build()
        self.kappa = 1.0 / ratio_of_axes(radius_ratio)
        #: curvature across in units of the curvature along rolling, Hertz-scaled
        self.curvature_y = radius_ratio / self.kappa**2
        x, y = self.grid.x, self.grid.y
        self.undeformed = 0.5 * x[None, :] ** 2 + 0.5 * self.curvature_y * y[:, None] ** 2
        self.weights = self.grid.weights
        self.inner_weights = self.weights[:-1, 1:-1]
        self.kappa_h = self.kappa / self.grid.h_y
        self.deflection: LineConvolution = deflection_operator(
            self.grid, self.kappa, _hertz_factor(self.kappa)
        )
        self.dry_pressure, self.dry_approach = dry_contact(
            self.grid, self.undeformed, self.deflection, TARGET_LOAD
        )

    def embed(self, inner: Array) -> Array:
        """Inner pressures (flat) as a field with zero edges."""
        field_ = np.zeros_like(self.undeformed)
        field_[:-1, 1:-1] = inner.reshape(self.inner_weights.shape)
        return field_

    def gap(self, p: Array, h_0: float) -> Array:
        """Gap of pressure p and approach h_0."""
        return self.undeformed + self.deflection(p) + h_0

    def start(self, h_c: float) -> ReynoldsState:
        """The dry contact, opened by an estimate of the central film [b^2/R_x]."""
        p, h_0 = self.dry_pressure, self.dry_approach + h_c
        return ReynoldsState(p, h_0, self.gap(p, h_0))

    def solve(
        self,
        state: ReynoldsState,
        film: FilmCoefficients,
        film_estimate: float,
        tolerance: float = 1e-5,
        max_steps: int = 60,
        krylov_tolerance: float = 0.02,
        max_krylov: int = 60,
    ) -> tuple[ReynoldsState, NewtonHistory]:
        """Newton's method from a state; film_estimate [b^2/R_x] scales the safeguard of the gap.

        Ends when an undamped step changes the pressure by less than tolerance [p_max], or says why not.
        """
        history = NewtonHistory()
        p, h_0, gap = state.p, state.h_0, state.gap
        floor = FLOOR_SHARE * film_estimate
        history.reason = f"no convergence in {max_steps} Newton steps"
        for _ in range(max_steps):
            linear = _Linearisation(self, p, gap, film, floor)
            load_error = float(np.sum(self.weights * p)) - TARGET_LOAD
            history.residual.append(float(np.sqrt(np.mean(linear.residual**2))))
            history.load_error.append(load_error)
            if not np.isfinite(history.residual[-1]):
                history.reason = "residual not finite"
                break
            linear.factorise()
            rhs = -np.append(linear.residual, load_error)
            delta, used = gmres(linear.apply, linear.precondition, rhs, krylov_tolerance, max_krylov)
            d_p = self.embed(delta[:-1])
            # limited node by node: a moving pressure spike must not hold up the rest
            damped = bool(np.abs(d_p).max() > STEP_LIMIT)
            p_new = p + np.clip(d_p, -STEP_LIMIT, STEP_LIMIT)
            p_new = np.maximum(p_new, -1e-4 * float(p_new.max()))
            h_0 += float(delta[-1])
            change = float(np.abs(p_new - p).max())
            p = p_new
            gap = self.gap(p, h_0)
            history.change.append(change)
            history.krylov.append(used)
            history.deflections += used + 2
            if not np.isfinite(change):
                history.reason = "pressure not finite"
                break
            if change <= tolerance * min(1.0, float(p.max())) and not damped:
                history.converged, history.reason = True, "pressure change below tolerance"
                break
        return ReynoldsState(p, h_0, gap), history


def _hertz_factor(kappa: float) -> float:
    """2 p_max a R_x/(pi E' b^2) of a Hertz ellipse with b/a = kappa: a number of the shape only.

    Source: Johnson 1985, Eqs. 4.24-4.26 with the symmetric integral R_D:
    factor = 3/(2 pi kappa^3 R_D(0, 1, kappa^2)); 2/pi^2 for the circle.
    """
    from scipy.special import elliprd

    return float(1.5 / (np.pi * kappa**3 * elliprd(0.0, 1.0, kappa**2)))


@lru_cache(maxsize=8)
def contact_geometry(choice: GridChoice, radius_ratio: float) -> ContactGeometry:
    """Cached geometry; a map visits all speeds and temperatures of one ball load with the same one."""
    return ContactGeometry(choice, radius_ratio)
