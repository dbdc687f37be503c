"""Reynolds equation with deflection, cavitation and load balance, solved together by Newton's method.

Dimensionless in Hertz units: P = p/p_max, X = x/b, Y = y/a, gap in b^2/R_x, load 2 pi/3. Unknowns are the pressures
and the rigid approach H_0. Every Newton step solves its linear system by GMRES; one dense Jacobian per line along
rolling (with the line's own deflection in it) is the preconditioner. The ellipse of a ball in a groove is long
across rolling, so lines are nearly independent and a handful of iterations suffice; a circle needs about thirty.
Differs from paper: Eq. 6 omits the deflection; cavitation (Eq. 9) is the condition P >= 0 by a penalty.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import lapack

from ...physics.hertz import ratio_of_axes
from ..half_space.deflection import LineConvolution, deflection_operator
from ..half_space.dry import dry_contact
from ..half_space.grid import TINY, Array, Grid, graded_grid, uniform_grid
from . import kernels
from .krylov import gmres

TARGET_LOAD = 2.0 * np.pi / 3.0
#: deepest pressure of an iterate, as a share of its largest: deeper, the penalty that holds cavitated nodes gets softer
#: and the load error larger; less deep, a node at the edge of cavitation may change sides without end
LEAST_PRESSURE = 1e-6
#: factor of the penalty over the wedge flux and the conductance of a cavitated node
PENALTY = 10.0
#: largest pressure change of one Newton step, relative to p_max or to the largest pressure if that is lower
STEP_LIMIT = 0.3
#: relative residual at which GMRES ends, and its most iterations
KRYLOV_TOLERANCE, MOST_KRYLOV = 0.02, 60
#: iterations of GMRES above which a preconditioner of an earlier state is renewed
KEEP_BELOW = 4
#: pressure change [p_max] above which it is renewed at once
RENEW_ABOVE = 3e-3
#: largest change of the approach of one Newton step, relative to film and flattening
APPROACH_LIMIT = 0.5
#: Newton steps without progress after which the steps are halved, and their least share by this rule
STALL_AFTER = 6
LEAST_SHARE = 0.125
#: reduction of the changes over STALL_AFTER steps that counts as progress
STALL_REDUCTION = 0.5
#: a step turns back if its projection on the last one is below -TURN of it; steps alternate if two of the last four
#: turned back and the last is above ALTERNATING times the least of three
TURN, ALTERNATING = 0.5, 0.5
#: share of the steps below which the tolerance is no longer reduced with them: a smaller one would never be reached
SHARE_IN_TOLERANCE = 0.1
#: smallest share of its fluidity that a node keeps in one Newton step
LEAST_FLUIDITY = 0.05
#: least d ln(viscosity)/dP for a step in fluidity: below, fluidity and pressure are linear in each other
LEAST_THICKENING = 1e-3
#: the edge of cavitation is settled at nodes below this pressure, relative to the largest, and above this share of the
#: flow in the diagonal of the node; sweeps for it
EDGE_PRESSURE, EDGE_FLOW_SHARE, EDGE_SWEEPS = 0.02, 0.9, 100
#: share of the expected film below which the flow is that of a lifted gap while iterating
FLOOR_SHARE = 0.2
#: film [b^2/R_x] above which it is thicker than the flattening of the bodies
THICK_FILM = 2.0
#: load error, relative, that a converged solution may have
LOAD_TOLERANCE = 1e-4
#: fewest nodes along and across rolling that a coarser grid may have
LEAST_NODES, LEAST_LINES = 33, 5


@dataclass(frozen=True)
class GridChoice:
    """Numbers that define a grid: domain in Hertz half-widths, nodes, and the inlet length it is refined for [b].

    mirror: n_y lines over the half plane Y >= 0, else over the whole; open_side: the film goes on beyond them.
    """

    x_in: float = -2.5
    x_out: float = 1.5
    y_max: float = 1.5
    n_x: int = 129
    n_y: int = 17
    inlet: float | None = None
    mirror: bool = True
    open_side: bool = False

    def build(self) -> Grid:
        """The grid; uniform without an inlet length."""
        if self.inlet is None:
            return uniform_grid(
                self.x_in, self.x_out, self.y_max, self.n_x, self.n_y, self.mirror, self.open_side
            )
        return graded_grid(
            self.x_in, self.x_out, self.y_max, self.n_x, self.n_y, self.inlet, self.mirror, self.open_side
        )

    def halved(self) -> GridChoice | None:
        """Every other node of the same grid, None where too few are left."""
        n_x, n_y = (self.n_x + 1) // 2, (self.n_y + 1) // 2
        return replace(self, n_x=n_x, n_y=n_y) if n_x >= LEAST_NODES and n_y >= LEAST_LINES else None


#: nodal film coefficients of P >= 0: ln phi, d ln phi/dP, g, dg/dP, g_y, dg_y/dP, each (n_y, n_x)
FilmCoefficients = Callable[[Array], tuple[Array, ...]]


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
    factorisations: int = 0
    converged: bool = False
    finite: bool = True
    reason: str = "not started"

    def extend(self, later: NewtonHistory) -> None:
        """Append the steps of a later part of the same solve."""
        for name in ("residual", "change", "load_error", "krylov"):
            getattr(self, name).extend(getattr(later, name))
        self.deflections += later.deflections
        self.factorisations += later.factorisations
        self.converged, self.finite, self.reason = later.converged, later.finite, later.reason


class _Linearisation:
    """Residual and Jacobian at one state."""

    def __init__(
        self, geometry: ContactGeometry, p: Array, gap: Array, film: FilmCoefficients, floor: float
    ) -> None:
        grid = geometry.grid
        ny, nx = p.shape
        self.geometry, self.gap = geometry, gap
        ln_phi, dln_phi, self.g, self.dg, g_y, dg_y = film(np.maximum(p, 0.0))
        self.thickening = -dln_phi
        self.c_x, self.c_y = np.empty((ny, nx - 1, 4)), np.empty((ny - 1, nx, 4))
        self.wedge = np.empty((ny, nx - 1, 3))
        self.flow_x, self.flow_y, res = np.empty((ny, nx - 1)), np.empty((ny - 1, nx)), np.empty((ny, nx))
        kernels.face_fluxes(
            grid.x, geometry.kappa_h, grid.mirror, grid.open_side, p, gap, ln_phi, dln_phi, self.g, self.dg, g_y,
            dg_y, self.flow_x, self.flow_y,
            self.c_x, self.c_y, self.wedge, floor,
        )  # fmt: skip
        kernels.residual(grid.width_x, geometry.kappa_h, grid.mirror, self.flow_x, self.flow_y, res)
        # measured by the local flow conductance, which spans many decades from thick films to the contact
        conductance = np.zeros_like(p)
        conductance[:, 1:-1] = (np.abs(self.c_x[:, 1:, 0]) + np.abs(self.c_x[:, :-1, 1])) / grid.width_x[1:-1]
        # stiff enough that the wedge holds a cavitated node well above the deepest pressure allowed
        stiffness = PENALTY * (1.0 + grid.x[-1]) / (LEAST_PRESSURE * float(p.max()))
        self.penalty = np.where(p < 0.0, stiffness + PENALTY * conductance, 0.0)
        self.residual = (res - self.penalty * p)[grid.inner]
        elastic = np.abs(self.g * np.diagonal(geometry.deflection.same_line) / grid.width_x)
        self.flow_share = conductance / (conductance + elastic + TINY)
        #: size of the diagonal: turns residuals into changes of pressure, the load balance last
        self.scale = np.append((conductance + elastic + self.penalty)[grid.inner], TARGET_LOAD)

    def update(self, d_p: Array) -> Array:
        """Change of pressure for a linear step d_p.

        Where pressure flow dominates, the equation is linear in the fluidity rather than in the pressure: the step is
        taken in the fluidity there, with whose logarithm the pressure rises in few steps.
        """
        thickening = np.maximum(self.thickening, LEAST_THICKENING)
        in_fluidity = -np.log(np.maximum(1.0 - thickening * d_p, LEAST_FLUIDITY)) / thickening
        return d_p + self.flow_share * (in_fluidity - d_p)

    def apply(self, v: Array) -> Array:
        """Scaled Jacobian of residual and load times a change of pressures and approach."""
        geometry, grid = self.geometry, self.geometry.grid
        d_p = geometry.embed(v[:-1])
        out = np.empty_like(d_p)
        kernels.jacobian_times(
            grid.width_x, geometry.kappa_h, grid.mirror, self.c_x, self.c_y, self.wedge, self.gap, self.g, self.dg,
            self.penalty, d_p, geometry.deflection.rough(d_p) + v[-1], out,
        )  # fmt: skip
        return np.append(out[grid.inner], np.sum(geometry.weights * d_p)) / self.scale


class LinePreconditioner:
    """LU of every line's Jacobian with the line's own deflection, bordered by the load balance."""

    def __init__(self, linear: _Linearisation) -> None:
        geometry = self._geometry = linear.geometry
        grid = geometry.grid
        lines, n = linear.residual.shape
        matrix, columns = np.empty((n, n)), np.empty((lines, n))
        self._lu = []
        for row in range(lines):
            j = row + (0 if grid.mirror else 1)
            kernels.line_jacobian(
                j, grid.width_x, geometry.kappa_h, grid.mirror, linear.c_x, linear.c_y, linear.wedge, linear.gap,
                linear.g, linear.dg, linear.penalty, geometry.deflection.same_line, matrix, columns[row],
            )  # fmt: skip
            factor, pivot, info = lapack.dgetrf(matrix.T)
            if info != 0:
                raise np.linalg.LinAlgError(f"line {j} of the contact has a singular Jacobian")
            self._lu.append((factor, pivot))
        self._approach = self._solve_lines(columns)
        self._approach_load = float(np.sum(geometry.inner_weights * self._approach))

    def _solve_lines(self, rhs: Array) -> Array:
        return np.stack([lapack.dgetrs(*lu, row, trans=1)[0] for lu, row in zip(self._lu, rhs, strict=True)])

    def scaled(self, scale: Array) -> Callable[[Array], Array]:
        """The same for residuals that have been divided by a scale."""
        return lambda v: self(scale * v)

    def __call__(self, v: Array) -> Array:
        """Line solves, bordered by the load balance."""
        z = self._solve_lines(v[:-1].reshape(self._approach.shape))
        d_h0 = (np.sum(self._geometry.inner_weights * z) - v[-1]) / self._approach_load
        return np.append(z - d_h0 * self._approach, d_h0)


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
        self.kappa_h = self.kappa / self.grid.h_y
        self.deflection: LineConvolution = deflection_operator(
            self.grid, self.kappa, _hertz_factor(self.kappa)
        )

    @cached_property
    def dry_contact(self) -> tuple[Array, float]:
        """Pressure and approach without a film."""
        return dry_contact(self.grid, self.undeformed, self.deflection, TARGET_LOAD)

    @property
    def axis(self) -> int:
        """Line Y = 0."""
        return 0 if self.grid.mirror else self.grid.y.size // 2

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
        h_0 = h_c - float(self.gap(p, 0.0)[self.axis, np.argmin(np.abs(self.grid.x))])
        return ReynoldsState(p, h_0, self.gap(p, h_0))

    # a diverging iterate is detected by values that are not finite
    @np.errstate(over="ignore", invalid="ignore")
    def solve(
        self,
        state: ReynoldsState,
        film: FilmCoefficients,
        film_estimate: float,
        tolerance: float = 1e-5,
        max_steps: int = 60,
        preconditioner: LinePreconditioner | None = None,
    ) -> tuple[ReynoldsState, NewtonHistory, LinePreconditioner | None]:
        """Newton's method from a state; film_estimate [b^2/R_x] scales the safeguard of the gap.

        preconditioner: that of an earlier state, kept while GMRES needs few iterations with it.
        Ends when a step within the limit changes the pressure by less than tolerance [p_max], or with another `reason`.
        """
        history = NewtonHistory(reason=f"no convergence in {max_steps} Newton steps")
        p, h_0, gap = state.p, state.h_0, state.gap
        length = _StepLength(p)
        for _ in range(max_steps):
            linear = _Linearisation(self, p, gap, film, FLOOR_SHARE * film_estimate)
            load_error = float(np.sum(self.weights * p)) - TARGET_LOAD
            history.residual.append(float(np.sqrt(np.mean(linear.residual**2))))
            history.load_error.append(load_error)
            if not np.isfinite(history.residual[-1]):
                history.finite, history.reason = False, "residual not finite"
                break
            if history.change and history.change[-1] > RENEW_ABOVE:
                preconditioner = None
            rhs = -np.append(linear.residual, load_error) / linear.scale
            delta, preconditioner = _linear_step(linear, rhs, preconditioner, history)
            d_p = linear.update(self.embed(delta[:-1]))
            length.adapt(d_p)
            # limited node by node: a moving pressure spike must not shorten the step of the others
            limit = STEP_LIMIT * min(1.0, float(p.max()))
            p_new = p + length.share * np.clip(d_p, -limit, limit)
            if film_estimate < THICK_FILM:
                # the long steps of a wedge that carries the load alone would overshoot its edge
                self._settle_edge(linear, p_new, length.sizes[-1])
            p_new = np.maximum(p_new, -LEAST_PRESSURE * float(p_new.max()))
            # a film thicker than the flattening must not be overshot
            approach = APPROACH_LIMIT * (1.0 + max(float(gap[self.axis].min()), 0.0))
            h_0 += length.share * min(max(float(delta[-1]), -approach), approach)
            change = float(np.abs(p_new - p).max())
            p, gap = p_new, self.gap(p_new, h_0)
            history.change.append(change)
            if not np.isfinite(change):
                history.finite, history.reason = False, "pressure not finite"
                break
            balanced = abs(load_error) <= LOAD_TOLERANCE * TARGET_LOAD
            close = change <= length.tolerance_share * tolerance * min(1.0, float(p.max()))
            if close and balanced and length.sizes[-1] <= limit:
                history.converged, history.reason = True, "pressure change below tolerance"
                break
        return ReynoldsState(p, h_0, gap), history, preconditioner

    def _settle_edge(self, linear: _Linearisation, p: Array, step: float) -> None:
        """Move the edge of cavitation with a step to the pressure p; Newton alone moves it by one node per step.

        step: bounds the change of the edge, for the inflow is accurate to KRYLOV_TOLERANCE only.
        """
        grid = self.grid
        low = (p < EDGE_PRESSURE * float(p.max())) & (linear.flow_share > EDGE_FLOW_SHARE) & (grid.x > 0.0)
        # the penalty balances the flow into a cavitated node
        inflow = linear.penalty * p
        before = np.where(low, np.maximum(p, 0.0), p)
        settled = before.copy()
        kernels.settle_edge(
            grid.width_x, self.kappa_h, grid.mirror, linear.c_x, linear.c_y, low, EDGE_SWEEPS, settled, inflow
        )
        p += np.clip(settled - before, -step, step)

    def fluxes(
        self, state: ReynoldsState, film: FilmCoefficients, film_estimate: float
    ) -> tuple[Array, Array]:
        """Flux through the faces along and across [u_e b^2/R_x times the density of reference]."""
        linear = _Linearisation(self, state.p, state.gap, film, FLOOR_SHARE * film_estimate)
        return -linear.flow_x, -linear.flow_y


def _linear_step(
    linear: _Linearisation, rhs: Array, preconditioner: LinePreconditioner | None, history: NewtonHistory
) -> tuple[Array, LinePreconditioner]:
    """Solve one linearised system by GMRES; a preconditioner that needs too many iterations is replaced."""
    used = 0
    if preconditioner is not None:
        delta, used, left = gmres(
            linear.apply, preconditioner.scaled(linear.scale), rhs, KRYLOV_TOLERANCE, KEEP_BELOW
        )
        if not left <= KRYLOV_TOLERANCE:
            preconditioner = None
    if preconditioner is None:
        preconditioner = LinePreconditioner(linear)
        history.factorisations += 1
        delta, again, _ = gmres(
            linear.apply, preconditioner.scaled(linear.scale), rhs, KRYLOV_TOLERANCE, MOST_KRYLOV
        )
        used += again
    history.krylov.append(used)
    history.deflections += used + 1
    return delta, preconditioner


class _StepLength:
    """Share of the Newton steps to take: halved where they alternate or do not shrink, doubled where they do."""

    def __init__(self, p: Array) -> None:
        self.share = self._most = 1.0
        #: largest pressure change of every full step
        self.sizes: list[float] = []
        self._turned: list[bool] = []
        self._last = np.zeros_like(p)

    @property
    def tolerance_share(self) -> float:
        """Share of the tolerance that a shortened step must meet."""
        return 1.0 if self._most < SHARE_IN_TOLERANCE else self.share

    def adapt(self, d_p: Array) -> None:
        """Choose the share of a full step."""
        self.sizes.append(float(np.abs(d_p).max()))
        turned = float(np.sum(d_p * self._last)) < -TURN * float(np.sum(self._last * self._last))
        self._turned.append(turned)
        if turned and sum(self._turned[-4:]) > 1 and self.sizes[-1] > ALTERNATING * min(self.sizes[-3:]):
            # a node at the edge of cavitation alternates; half steps bring it to rest there
            self.share *= 0.5
            self._most = self.share
        elif stalled(self.sizes, STALL_AFTER):
            self.share = max(0.5 * self.share, LEAST_SHARE)
        elif self.share < 1.0 and not turned and _shrinking(self.sizes, 1.0 - 0.5 * self.share):
            self.share = min(2.0 * self.share, self._most)
        self._last = d_p


def _shrinking(steps: list[float], factor: float) -> bool:
    """Whether each of the last two steps is smaller than the one before by a factor."""
    return len(steps) > 2 and steps[-1] < factor * steps[-2] < factor * factor * steps[-3]


def stalled(changes: list[float], after: int) -> bool:
    """Whether the last `after` changes are no smaller than the ones before; True once per `after` at most."""
    if len(changes) % after or len(changes) < 2 * after:
        return False
    return not min(changes[-after:]) < STALL_REDUCTION * min(changes[-2 * after : -after])


def _hertz_factor(kappa: float) -> float:
    """2 p_max a R_x/(pi E' b^2) of a Hertz ellipse with b/a = kappa: a number of the shape only.

    Source: Johnson 1985, Eqs. 4.24-4.26 with the symmetric integral R_D:
    factor = 3/(2 pi kappa^3 R_D(0, 1, kappa^2)); 2/pi^2 for the circle.
    """
    from scipy.special import elliprd

    return float(1.5 / (np.pi * kappa**3 * elliprd(0.0, 1.0, kappa**2)))


@lru_cache(maxsize=8)
def contact_geometry(choice: GridChoice, radius_ratio: float) -> ContactGeometry:
    """Cached geometry; all speeds and temperatures of one ball load of a map share it."""
    return ContactGeometry(choice, radius_ratio)
