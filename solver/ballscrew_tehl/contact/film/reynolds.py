"""Reynolds equation with deflection, cavitation and load balance, solved together by Newton's method.

Dimensionless in Hertz units: P = p/p_max, X = x/b, Y = y/a, gap in b^2/R_x, load 2 pi/3. Unknowns are the pressures
and the rigid approach H_0. Every Newton step solves its linear system by GMRES; one dense Jacobian per line along
rolling (with the line's own deflection in it) is the preconditioner. The pressure deforms the bodies and carries the
load. The ellipse of a ball in a groove is long across rolling, so lines are nearly
independent and a handful of iterations suffice; a circle needs about thirty.
Differs from paper: Eq. 6 omits the deflection; cavitation (Eq. 9) is the condition P >= 0 by a penalty.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.special import elliprd

from ...physics.hertz import ratio_of_axes
from ..half_space.deflection import LineConvolution, deflection_operator
from ..half_space.dry import dry_contact
from ..half_space.grid import TINY, Array, Grid, graded_grid
from . import kernels
from .linear import LinearSystem, LineFactors, factor_lines, gmres
from .transport import HeatTransport

TARGET_LOAD = 2.0 * np.pi / 3.0
# Effects of the numbers below: tests/benchmarks/constant_effects.py. "16 contacts": of both kinematics, 5 to 98 N, 300
# to 4500 rpm.
#: deepest pressure of an iterate, as a share of its largest: bounds the negative load of cavitated nodes; the penalty
#: that holds them is stiff in inverse proportion
LEAST_PRESSURE = 1e-6
#: factor of the penalty over the wedge flux and the conductance of a cavitated node
PENALTY = 10.0
#: largest pressure change of one Newton step, relative to p_max or to the largest pressure if that is lower
STEP_LIMIT = 0.3
#: relative residual at which GMRES ends; 16 contacts: an eighth fewer Newton steps than at 0.02, for with factors of an
#: earlier state small residuals hide large errors of the pressure; and its most iterations
KRYLOV_TOLERANCE, MOST_KRYLOV = 0.002, 60
#: iterations of GMRES above which a preconditioner of an earlier state is renewed: new factors cost as much as 16
#: products
KEEP_BELOW = 12
#: pressure change [p_max] above which it is renewed at once; 16 contacts: a fifth fewer factorisations than at 3e-3; at
#: 0.3, with 16 iterations, half as many products more and a tenth more Newton steps
RENEW_ABOVE = 0.05
#: iterations with factors that leave out the heat carried along the lines, after which it is put in
MOST_KRYLOV_STILL = 24
#: a step turns back if its projection on the last one is below -TURN of it; steps alternate if two of the last four
#: turned back and the last is above ALTERNATING times the least of three
TURN, ALTERNATING = 0.5, 0.5
#: smallest share of its fluidity that a node keeps in one Newton step
LEAST_FLUIDITY = 0.05
#: the edge of cavitation is settled at nodes below this pressure, relative to the largest, and above this share of the
#: flow in the diagonal of the node; sweeps for it
EDGE_PRESSURE, EDGE_FLOW_SHARE, EDGE_SWEEPS = 0.02, 0.9, 100
#: share of the expected film below which the flow is that of a lifted gap while iterating
FLOOR_SHARE = 0.2
#: Newton steps after which a patient solve goes over to pseudo time
NEWTON_STEPS = 30
#: pseudo time steps [b/u_e]: the first, and the one beyond which a solution is steady
FIRST_PSEUDO_STEP, LONG_PSEUDO_STEP = 0.1, 10.0
#: change of pressure [p_max] that the pseudo time step aims at
PSEUDO_CHANGE = 0.3
#: film [b^2/R_x] above which the approach is held and corrected with the load
HELD_ABOVE = 50.0
#: largest change of ln(film) between two held approaches of a thick film
THICK_STEP = 1.5
#: film [b^2/R_x] above which it is thicker than the flattening of the bodies
THICK_FILM = 2.0
#: load error, relative, that a converged solution may have
LOAD_TOLERANCE = 1e-4
#: relative change of the central gap in the last step of a converged solution. Far beyond the film, every step takes a
#: third of the gap and leaves pressure and load as they are: bodies 36 mm apart counted as a solution
GAP_TOLERANCE = 0.02
#: fewest nodes along and across rolling that a coarser grid may have
LEAST_NODES, LEAST_LINES = 33, 5


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

    def halved(self) -> GridChoice | None:
        """Every other node of the same grid, None where too few are left."""
        n_x, n_y = (self.n_x + 1) // 2, (self.n_y + 1) // 2
        return replace(self, n_x=n_x, n_y=n_y) if n_x >= LEAST_NODES and n_y >= LEAST_LINES else None


class Film:
    """Film coefficients over the pressure; an oil of one temperature and viscosity per pressure unless overridden."""

    #: whether columns across precondition the line solves
    across = False

    def __init__(
        self, coefficients: Callable[[Array], tuple[Array, ...]], shape: tuple[int, int], unit: float = 1.0
    ) -> None:
        #: nodal coefficients of P >= 0: ln phi, d ln phi/dP, g, dg/dP (n_y, n_x)
        self.coefficients = coefficients
        self.unit, self.unit_h = unit, 1.0
        ny, nx = shape
        self.by_t, self.heat, self.warm = np.zeros((ny, nx, 2, 0)), HeatTransport.none(shape), False

    def follow(self, linear: LinearSystem, d_p: Array, d_h: Array) -> None:
        """Take over changes of pressure [p_max] and gap [b^2/R_x] into what depends on them."""


@dataclass(frozen=True)
class ReynoldsState:
    """Pressure (n_y, n_x) [p_max], negative where it cavitates; rigid approach and gap (n_y, n_x) [b^2/R_x]."""

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
    converged: bool = False
    finite: bool = True
    reason: str = "not started"

    def record(self, residual: Array, load_error: float) -> bool:
        """Enter a residual and a load error; whether they are finite."""
        self.residual.append(float(np.sqrt(np.mean(residual**2))))
        self.load_error.append(load_error)
        if not np.isfinite(self.residual[-1] + load_error):
            self.finite, self.reason = False, "residual not finite"
        return self.finite

    def extend(self, later: NewtonHistory) -> None:
        """Append the steps of a later part of the same solve."""
        for name in ("residual", "change", "load_error", "krylov"):
            getattr(self, name).extend(getattr(later, name))
        self.converged, self.finite, self.reason = later.converged, later.finite, later.reason


class _Linearisation:
    """Residual and Jacobian at one state."""

    def __init__(
        self,
        geometry: ContactGeometry,
        p: Array,
        gap: Array,
        film: Film,
        floor: float,
        squeeze: float = 0.0,
        free: bool = True,
    ) -> None:
        grid = geometry.grid
        ny, nx = p.shape
        self.geometry, self.pressure = geometry, p
        ln_phi, dln_phi, g, dg = film.coefficients(np.maximum(p, 0.0))
        self.thickening, self.ln_phi = -dln_phi, ln_phi
        self.faces, res = kernels.Faces.empty(ny, nx), np.empty((ny, nx))
        kernels.face_fluxes(geometry.mesh, p, gap, ln_phi, g, floor, self.faces)
        kernels.residual(geometry.mesh, self.faces, res)
        c_x = self.faces.c_x
        # measured by the local flow conductance, which spans many decades from thick films to the contact
        conductance = np.zeros_like(p)
        right, left = (
            c_x[:, 1:, 1] * dln_phi[:, 1:-1] - c_x[:, 1:, 0],
            c_x[:, :-1, 2] * dln_phi[:, 1:-1] + c_x[:, :-1, 0],
        )
        conductance[:, 1:-1] = (np.abs(right) + np.abs(left)) / grid.width_x[1:-1]
        # stiff enough that the wedge holds a cavitated node well above the deepest pressure allowed
        stiffness = PENALTY * (1.0 + grid.x[-1]) / (LEAST_PRESSURE * float(p.max()))
        penalty = np.where(p < 0.0, stiffness + PENALTY * conductance, 0.0)
        self.residual = np.zeros_like(p)
        self.residual[grid.inner] = (res - penalty * p)[grid.inner]
        own = np.diagonal(geometry.deflection.same_line)
        elastic = np.abs(g * own * (1.0 / grid.width_x + squeeze))
        self.flow_share = conductance / (conductance + elastic + TINY)
        scale = conductance + elastic + penalty
        scale[scale == 0.0] = 1.0
        forward, modes, backward = geometry.deflection.single
        self.system = LinearSystem(
            grid.width_x, geometry.kappa_h, gap, g, dln_phi, dg, film.by_t, penalty, c_x, self.faces.c_y,
            self.faces.wedge, squeeze, scale, TARGET_LOAD, geometry.weights, free, forward, modes, backward,
            geometry.deflection.same_line, film.heat, film.unit, film.unit_h, film.warm, film.across,
        )  # fmt: skip

    def update(self, d_p: Array) -> Array:
        """Change of pressure for a linear step d_p.

        Where pressure flow dominates, the equation is linear in the fluidity rather than in the pressure: the step is
        taken in the fluidity there, with whose logarithm the pressure rises in few steps.
        """
        thickening = np.maximum(self.thickening, TINY)
        in_fluidity = -np.log1p(np.maximum(-thickening * d_p, LEAST_FLUIDITY - 1.0)) / thickening
        return d_p + self.flow_share * (in_fluidity - d_p)

    def right_hand_side(self, load_error: float) -> Array:
        """Scaled residual and load error with negative sign."""
        return -np.append((self.residual / self.system.scale).ravel(), load_error / TARGET_LOAD)


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
        self.mesh = kernels.Mesh(x, self.grid.width_x, self.kappa_h, self.grid.open_side)
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

    # a diverging iterate is detected by values that are not finite
    @np.errstate(over="ignore", invalid="ignore")
    def solve(
        self,
        state: ReynoldsState,
        film: Film,
        film_estimate: float,
        tolerance: float = 1e-5,
        max_steps: int = 60,
        preconditioner: LineFactors | None = None,
        patient: bool = False,
    ) -> tuple[ReynoldsState, NewtonHistory, LineFactors | None]:
        """Newton's method from a state; film_estimate [b^2/R_x] scales the safeguard of the gap.

        preconditioner: that of an earlier state, kept while GMRES needs few iterations with it.
        patient: where Newton's method has not converged in NEWTON_STEPS, begin again in pseudo time: the squeeze term
        of a film that changes within a few passages of the contact keeps the pressure spike of a cold film in place.
        A film above HELD_ABOVE, far thicker than the flattening, is found at a held approach corrected with the load.
        Ends when a step within the limit changes the pressure by less than tolerance [p_max], or with another `reason`.
        """
        if film_estimate > HELD_ABOVE:
            return self._solve_thick(state, film, film_estimate, tolerance, max_steps)
        first = min(max_steps, NEWTON_STEPS) if patient else max_steps
        end, history, factors = self._newton(state, film, film_estimate, tolerance, first, preconditioner)
        if history.converged or not patient or first == max_steps:
            return end, history, factors
        end, later, factors = self._newton(
            state, film, film_estimate, tolerance, max_steps - first, None, FIRST_PSEUDO_STEP
        )
        history.extend(later)
        return end, history, factors

    def _newton(
        self,
        state: ReynoldsState,
        film: Film,
        film_estimate: float,
        tolerance: float,
        max_steps: int,
        factors: LineFactors | None,
        pseudo_step: float = np.inf,
    ) -> tuple[ReynoldsState, NewtonHistory, LineFactors | None]:
        """Newton steps of pressures and approach; pseudo_step: the first of pseudo time [b/u_e], none by default."""
        history = NewtonHistory(reason=f"no convergence in {max_steps} Newton steps")
        p, h_0, gap = state.p, state.h_0, state.gap
        steady, length = not np.isfinite(pseudo_step), _StepLength(p)
        for _ in range(max_steps):
            linear = _Linearisation(self, p, gap, film, FLOOR_SHARE * film_estimate, 1.0 / pseudo_step)
            load_error = float(np.sum(self.weights * p)) - TARGET_LOAD
            if not history.record(linear.residual[self.grid.inner], load_error):
                break
            if history.change and history.change[-1] > RENEW_ABOVE:
                factors = None
            delta, factors = _linear_step(linear, linear.right_hand_side(load_error), factors, history)
            d_p = linear.update(delta[:-1].reshape(p.shape))
            size = float(np.abs(d_p).max())
            if steady:
                length.adapt(d_p)
            # limited node by node: a moving pressure spike must not shorten the step of the others
            limit = STEP_LIMIT * min(1.0, float(p.max()))
            p_new = p + length.share * np.clip(d_p, -limit, limit)
            if film_estimate < THICK_FILM:
                # the long steps of a wedge that carries the load alone would overshoot its edge
                self._settle_edge(linear, p_new, size)
            p_new = _bounded(p_new)
            h_0 += length.share * float(delta[-1])
            centre = float(gap[0, self.centre])
            gap = self._taken(linear, film, p, p_new, h_0, history)
            p, change = p_new, history.change[-1]
            if not history.finite:
                break
            balanced = abs(load_error) <= LOAD_TOLERANCE * TARGET_LOAD
            close = change <= length.share * tolerance * min(1.0, float(p.max()))
            close = close and abs(float(gap[0, self.centre]) - centre) <= GAP_TOLERANCE * abs(centre)
            if close and balanced and size <= limit and (steady or pseudo_step > LONG_PSEUDO_STEP):
                history.converged, history.reason = True, "pressure change below tolerance"
                break
            if not steady:
                pseudo_step *= min(max(PSEUDO_CHANGE / max(size, TINY), 0.5), 2.0)
        return ReynoldsState(p, h_0, gap), history, factors

    def _solve_thick(
        self, state: ReynoldsState, film: Film, film_estimate: float, tolerance: float, max_steps: int
    ) -> tuple[ReynoldsState, NewtonHistory, None]:
        """A film far thicker than the flattening: the pressure at a held approach, corrected with the load.

        The wedge alone carries the load, which falls with the square root of the film; a free approach would follow
        every change of the cavitated region instead.
        """
        history = NewtonHistory(reason=f"no convergence in {max_steps} Newton steps")
        # the film goes with the square of the load
        tolerance = min(tolerance, LOAD_TOLERANCE)
        p, h_0, gap = state.p, state.h_0, state.gap
        points: list[tuple[float, float]] = []
        while len(history.change) < max_steps:
            factors: LineFactors | None = None
            while len(history.change) < max_steps:
                linear = _Linearisation(self, p, gap, film, FLOOR_SHARE * film_estimate, 0.0, False)
                load_error = float(np.sum(self.weights * p)) - TARGET_LOAD
                if not history.record(linear.residual[self.grid.inner], load_error):
                    return ReynoldsState(p, h_0, gap), history, None
                delta, factors = _linear_step(linear, linear.right_hand_side(0.0), factors, history)
                p_new = _bounded(p + delta[:-1].reshape(p.shape))
                gap = self._taken(linear, film, p, p_new, h_0, history)
                p, change = p_new, history.change[-1]
                if not history.finite:
                    return ReynoldsState(p, h_0, gap), history, None
                if change <= tolerance * min(1.0, float(p.max())):
                    break
            load = float(np.sum(self.weights * p)) / TARGET_LOAD
            thickness = float(gap[0, self.centre])
            if abs(load - 1.0) <= LOAD_TOLERANCE and change <= tolerance * min(1.0, float(p.max())):
                history.converged, history.reason = True, "pressure change and load error below tolerance"
                break
            if not thickness > 0.0:
                history.finite, history.reason = False, "no film at the held approach of a thick film"
                break
            points = [*points[-1:], (math.log(thickness), math.log(max(load, TINY)))]
            slope = -0.5
            if len(points) == 2 and points[1][0] != points[0][0]:
                slope = (points[1][1] - points[0][1]) / (points[1][0] - points[0][0])
            slope = min(max(slope, -2.0), -0.25)
            step = min(max(-points[-1][1] / slope, -THICK_STEP), THICK_STEP)
            raised = thickness * math.expm1(step)
            h_0, gap = h_0 + raised, gap + raised
        return ReynoldsState(p, h_0, gap), history, None

    def _taken(
        self, linear: _Linearisation, film: Film, p: Array, p_new: Array, h_0: float, history: NewtonHistory
    ) -> Array:
        """The gap after a step from p to p_new, which the film follows and the history records."""
        gap = self.gap(p_new, h_0)
        change = np.maximum(p_new, 0.0) - np.maximum(linear.pressure, 0.0)
        film.follow(linear.system, change, gap - linear.system.gap)
        history.change.append(float(np.abs(p_new - p).max()))
        if not np.isfinite(history.change[-1]):
            history.finite, history.reason = False, "pressure not finite"
        return gap

    def _settle_edge(self, linear: _Linearisation, p: Array, step: float) -> None:
        """Move the edge of cavitation with a step to the pressure p; Newton alone moves it by one node per step.

        step: bounds the change of the edge, for the inflow is accurate to KRYLOV_TOLERANCE only.
        """
        grid = self.grid
        low = (p < EDGE_PRESSURE * float(p.max())) & (linear.flow_share > EDGE_FLOW_SHARE) & (grid.x > 0.0)
        # the penalty balances the flow into a cavitated node
        inflow = linear.system.penalty * p
        before = np.where(low, np.maximum(p, 0.0), p)
        settled = before.copy()
        kernels.settle_edge(linear.system, low, EDGE_SWEEPS, settled, inflow)
        p += np.clip(settled - before, -step, step)

    def linearise(self, state: ReynoldsState, film: Film, film_estimate: float) -> _Linearisation:
        """Fluxes, residual and Jacobian of a state; fluxes in u_e b^2/R_x times the density of reference."""
        return _Linearisation(self, state.p, state.gap, film, FLOOR_SHARE * film_estimate)


def _bounded(p: Array) -> Array:
    """A pressure whose cavitated nodes carry next to nothing."""
    return np.maximum(p, -LEAST_PRESSURE * float(p.max()))


def _linear_step(
    linear: _Linearisation, rhs: Array, factors: LineFactors | None, history: NewtonHistory
) -> tuple[Array, LineFactors]:
    """Solve one linearised system by GMRES; factors that need too many iterations are replaced."""
    used, delta, system = 0, np.empty_like(rhs), linear.system
    if factors is not None:
        used, left = gmres(system, factors, rhs, KRYLOV_TOLERANCE, KEEP_BELOW, delta)
        if not left <= KRYLOV_TOLERANCE:
            factors = None
    if factors is None:
        ny, nx = linear.residual.shape
        factors = LineFactors.empty(ny, nx)
        # without heat, both would have the same factors
        still = ((False, MOST_KRYLOV_STILL),) if system.warm else ()
        for carried, most in (*still, (True, MOST_KRYLOV)):
            if not factor_lines(system, factors, carried):
                raise np.linalg.LinAlgError("a line of the contact has a singular Jacobian")
            again, left = gmres(system, factors, rhs, KRYLOV_TOLERANCE, most, delta)
            used += again
            if left <= KRYLOV_TOLERANCE:
                break
    history.krylov.append(used)
    return delta, factors


class _StepLength:
    """Share of the Newton steps to take: halved where they alternate, doubled where they shrink again."""

    def __init__(self, p: Array) -> None:
        self.share = self._most = 1.0
        #: largest pressure change of every full step
        self.sizes: list[float] = []
        self._turned: list[bool] = []
        self._last = np.zeros_like(p)

    def adapt(self, d_p: Array) -> None:
        """Choose the share of a full step."""
        self.sizes.append(float(np.abs(d_p).max()))
        turned = float(np.sum(d_p * self._last)) < -TURN * float(np.sum(self._last * self._last))
        self._turned.append(turned)
        if turned and sum(self._turned[-4:]) > 1 and self.sizes[-1] > ALTERNATING * min(self.sizes[-3:]):
            # a node at the edge of cavitation alternates; half steps bring it to rest there
            self.share *= 0.5
            self._most = self.share
        elif self.share < 1.0 and not turned and _shrinking(self.sizes, 1.0 - 0.5 * self.share):
            self.share = min(2.0 * self.share, self._most)
        self._last = d_p


def _shrinking(steps: list[float], factor: float) -> bool:
    """Whether each of the last two steps is smaller than the one before by a factor."""
    return len(steps) > 2 and steps[-1] < factor * steps[-2] < factor * factor * steps[-3]


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
