"""Reynolds equation with deflection, cavitation and load balance, solved together by Newton's method.

In Hertz units (geometry.py). Unknowns are the pressures and the rigid approach H_0. Every Newton step solves its linear
system by GMRES (linear.py). The ellipse of a ball in a groove is long across rolling, so lines are nearly independent
and a handful of iterations suffice; a circle needs about thirty.
Differs from paper: Eq. 6 omits the deflection; cavitation (Eq. 9) is the condition P >= 0 by a penalty.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from ..grid import TINY, Array
from .fluxes import settle_edge
from .geometry import TARGET_LOAD, THICK_FILM, ContactGeometry, ReynoldsState
from .linear import LEAST_PRESSURE, Film, Linearisation, LineFactors, factor_lines, gmres

# Effects of the numbers below: tests/benchmarks/constant_effects.py. "16 contacts": of both kinematics, 5 to 98 N, 300
# to 4500 rpm.
#: largest pressure change of one Newton step, relative to p_max or to the largest pressure if that is lower
STEP_LIMIT = 0.3
#: relative residual at which GMRES ends; 16 contacts: an eighth fewer Newton steps than at 0.02, for with factors of an
#: earlier state small residuals hide large errors of the pressure
KRYLOV_TOLERANCE = 0.002
#: iterations of GMRES above which a preconditioner of an earlier state is renewed: new factors cost as much as 16
#: products. After twice as many with new factors that leave out the heat carried along the lines, it is put in, for 4
#: times as many at most
KEEP_BELOW = 12
#: pressure change [p_max] above which it is renewed at once; 16 contacts: a fifth fewer factorisations than at 3e-3; at
#: 0.3, with 16 iterations, half as many products more and a tenth more Newton steps
RENEW_ABOVE = 0.05
#: a step turns back if its projection on the last one is below -ALTERNATING of it; steps alternate if two of the last
#: four turned back and the last is above ALTERNATING times the least of three
ALTERNATING = 0.5
#: the edge of cavitation is settled at nodes below this pressure, relative to the largest, and above this share of the
#: flow in the diagonal of the node
EDGE_PRESSURE, EDGE_FLOW_SHARE = 0.02, 0.9
#: share of the expected film below which the flow is that of a lifted gap while iterating; the gap of the energy
#: equation is at least half of that
FLOOR_SHARE = 0.2
NEWTON_STEPS = 30  # Newton steps after which a patient solve goes over to pseudo time
#: first step of pseudo time [b/u_e], which aims at changes of the pressure of STEP_LIMIT; beyond the inverse of it a
#: solution is steady
FIRST_PSEUDO_STEP = 0.1
HELD_ABOVE = 50.0  # film [b^2/R_x] above which the approach is held and corrected with the load
LOAD_TOLERANCE = 1e-4  # load error, relative, that a converged solution may have
#: relative change of the central gap in the last step of a converged solution. Far beyond the film, every step takes a
#: third of the gap and leaves pressure and load as they are: bodies 36 mm apart counted as a solution
GAP_TOLERANCE = 0.02


@dataclass
class NewtonHistory:
    """Largest pressure change [p_max] and products of GMRES of every Newton step, and why they ended."""

    change: list[float] = field(default_factory=list)
    krylov: list[int] = field(default_factory=list)
    converged: bool = False
    finite: bool = True
    reason: str = "not started"

    def lose(self, reason: str) -> None:
        """End without a finite state."""
        self.finite, self.reason = False, reason


# a diverging iterate is detected by values that are not finite
@np.errstate(over="ignore", invalid="ignore")
def solve(
    geometry: ContactGeometry,
    state: ReynoldsState,
    film: Film,
    film_estimate: float,
    tolerance: float = 1e-5,
    max_steps: int = 60,
    preconditioner: LineFactors | None = None,
    patient: bool = False,
) -> tuple[ReynoldsState, NewtonHistory, LineFactors | None]:
    """Newton's method from a state; film_estimate [b^2/R_x] scales the safeguard of the gap.

    preconditioner: that of an earlier state. patient: what has not converged in NEWTON_STEPS begins again in pseudo
    time, whose squeeze term keeps the pressure spike of a cold film in place. Ends when a step within the limit changes
    the pressure by less than tolerance [p_max], or with another `reason`.
    """
    if film_estimate > HELD_ABOVE:
        return _solve_thick(geometry, state, film, film_estimate, tolerance, max_steps)
    first = min(max_steps, NEWTON_STEPS) if patient else max_steps
    end, history, factors = _newton(geometry, state, film, film_estimate, tolerance, first, preconditioner)
    if history.converged or not patient or first == max_steps:
        return end, history, factors
    end, later, factors = _newton(
        geometry, state, film, film_estimate, tolerance, max_steps - first, None, FIRST_PSEUDO_STEP
    )
    later.change, later.krylov = history.change + later.change, history.krylov + later.krylov
    return end, later, factors


def _newton(
    geometry: ContactGeometry,
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
    steady, length = not np.isfinite(pseudo_step), _StepLength(state.p)
    for _ in range(max_steps):
        linear = Linearisation(geometry, state, film, FLOOR_SHARE * film_estimate, 1.0 / pseudo_step)
        p, load_error = state.p, float(np.sum(geometry.weights * state.p)) - TARGET_LOAD
        if not np.isfinite(np.sum(linear.residual**2) + load_error):
            history.lose("residual not finite")
            break
        if history.change and history.change[-1] > RENEW_ABOVE:
            factors = None
        delta, factors = _linear_step(linear, load_error, factors, history)
        d_p = linear.update(delta[:-1].reshape(p.shape))
        size = float(np.abs(d_p).max())
        if steady:
            length.adapt(d_p)
        # limited node by node: a moving pressure spike must not shorten the step of the others
        limit = STEP_LIMIT * min(1.0, float(p.max()))
        p = p + length.share * np.clip(d_p, -limit, limit)
        if film_estimate < THICK_FILM:
            # the long steps of a wedge that carries the load alone would overshoot its edge
            _settle_edge(linear, p, size)
        state = _stepped(linear, p, state.h_0 + length.share * float(delta[-1]), history)
        if not history.finite:
            break
        balanced = abs(load_error) <= LOAD_TOLERANCE * TARGET_LOAD
        close = history.change[-1] <= length.share * tolerance * min(1.0, float(state.p.max()))
        centre, before = (float(gap[0, geometry.centre]) for gap in (state.gap, linear.gap))
        close = close and abs(centre - before) <= GAP_TOLERANCE * abs(before)
        if close and balanced and size <= limit and (steady or pseudo_step > 1.0 / FIRST_PSEUDO_STEP):
            history.converged, history.reason = True, "pressure change below tolerance"
            break
        if not steady:
            pseudo_step *= min(max(STEP_LIMIT / max(size, TINY), 0.5), 2.0)
    return state, history, factors


def _solve_thick(
    geometry: ContactGeometry,
    state: ReynoldsState,
    film: Film,
    film_estimate: float,
    tolerance: float,
    max_steps: int,
) -> tuple[ReynoldsState, NewtonHistory, None]:
    """A film far thicker than the flattening, carried by the wedge alone: held approaches, corrected with the load."""
    history = NewtonHistory(reason=f"no convergence in {max_steps} Newton steps")
    # a free approach would follow every change of the cavitated region; the film goes with the square of the load
    tolerance = min(tolerance, LOAD_TOLERANCE)
    points: list[tuple[float, float]] = []
    factors: LineFactors | None = None
    while len(history.change) < max_steps:
        linear = Linearisation(geometry, state, film, FLOOR_SHARE * film_estimate, free=False)
        if not np.isfinite(np.sum(linear.residual**2)):
            history.lose("residual not finite")
            break
        delta, factors = _linear_step(linear, 0.0, factors, history)
        state = _stepped(linear, state.p + delta[:-1].reshape(state.p.shape), state.h_0, history)
        if not history.finite:
            break
        if history.change[-1] > tolerance * min(1.0, float(state.p.max())):
            continue
        load = float(np.sum(geometry.weights * state.p)) / TARGET_LOAD
        thickness, factors = float(state.gap[0, geometry.centre]), None
        if abs(load - 1.0) <= LOAD_TOLERANCE:
            history.converged, history.reason = True, "pressure change and load error below tolerance"
            break
        if not thickness > 0.0:
            history.lose("no film at the held approach of a thick film")
            break
        points = [*points[-1:], (math.log(thickness), math.log(max(load, TINY)))]
        slope = -0.5
        if len(points) == 2 and points[1][0] != points[0][0]:
            slope = (points[1][1] - points[0][1]) / (points[1][0] - points[0][0])
        slope = min(max(slope, -2.0), -0.25)
        raised = thickness * math.expm1(-points[-1][1] / slope)
        state = ReynoldsState(state.p, state.h_0 + raised, state.gap + raised)
    return state, history, None


def _stepped(linear: Linearisation, p: Array, h_0: float, history: NewtonHistory) -> ReynoldsState:
    """State at a new pressure and approach, recorded in the history; the film follows."""
    p = np.maximum(p, -LEAST_PRESSURE * float(p.max()))
    gap = linear.geometry.gap(p, h_0)
    linear.film.follow(linear.system, np.maximum(p, 0.0) - np.maximum(linear.p, 0.0), gap - linear.gap)
    history.change.append(float(np.abs(p - linear.p).max()))
    if not np.isfinite(history.change[-1]):
        history.lose("pressure not finite")
    return ReynoldsState(p, h_0, gap)


def _settle_edge(linear: Linearisation, p: Array, step: float) -> None:
    """Move the edge of cavitation at a pressure p by at most step; Newton alone moves it by one node per step."""
    grid = linear.geometry.grid
    low = (p < EDGE_PRESSURE * float(p.max())) & (linear.flow_share > EDGE_FLOW_SHARE) & (grid.x > 0.0)
    # the penalty balances the flow into a cavitated node
    inflow = linear.penalty * p
    before = np.where(low, np.maximum(p, 0.0), p)
    settled = before.copy()
    settle_edge(linear.geometry.mesh, linear.faces, linear.dln_phi, low, settled, inflow)
    p += np.clip(settled - before, -step, step)


def _linear_step(
    linear: Linearisation, load_error: float, factors: LineFactors | None, history: NewtonHistory
) -> tuple[Array, LineFactors | None]:
    """Solve one linearised system by GMRES; factors that need too many iterations are replaced."""
    used, rhs = 0, -np.append((linear.residual / linear.scale).ravel(), load_error / TARGET_LOAD)
    if factors is not None:
        delta, used, left = gmres(linear.system, factors, rhs, KRYLOV_TOLERANCE, KEEP_BELOW)
        if not left <= KRYLOV_TOLERANCE:
            factors = None
    if factors is None:
        # without heat, both would have the same factors
        still = ((False, 2 * KEEP_BELOW),) if linear.film.warm else ()
        for carried, most in (*still, (True, 4 * KEEP_BELOW)):
            factors = factor_lines(linear.system, carried)
            delta, again, left = gmres(linear.system, factors, rhs, KRYLOV_TOLERANCE, most)
            used += again
            if left <= KRYLOV_TOLERANCE:
                break
    history.krylov.append(used)
    return delta, factors


class _StepLength:
    """Share of the Newton steps to take: halved where they alternate, doubled where they shrink again."""

    def __init__(self, p: Array) -> None:
        self.share = self._most = 1.0
        #: largest pressure change of every full step, and whether it turned back
        self.sizes: list[float] = []
        self._turned: list[bool] = []
        self._last = np.zeros_like(p)

    def adapt(self, d_p: Array) -> None:
        """Choose the share of a full step."""
        self.sizes.append(float(np.abs(d_p).max()))
        turned = float(np.sum(d_p * self._last)) < -ALTERNATING * float(np.sum(self._last * self._last))
        self._turned.append(turned)
        last, factor = self.sizes[-3:], 1.0 - 0.5 * self.share
        if turned and sum(self._turned[-4:]) > 1 and last[-1] > ALTERNATING * min(last):
            # a node at the edge of cavitation alternates; half steps bring it to rest there
            self.share *= 0.5
            self._most = self.share
        elif self.share < 1.0 and not turned and last[-1] < factor * last[-2] < factor * factor * last[-3]:
            self.share = min(2.0 * self.share, self._most)
        self._last = d_p
