"""Thermal film: pressure, energy equation and surface temperatures solved in turn.

One iteration: Newton steps of the generalised Reynolds equation at temperatures that follow the pressure, the flow,
sweeps of the energy equation each way, the temperatures of both surfaces, and a step towards the new temperatures by
Aitken's rule. Undamped, it takes about ten iterations; cold, fast, sliding contacts need the damped form and 15 to 45.
"""

import numpy as np

from .film import energy, reynolds
from .film.reynolds import FLOOR_SHARE, HELD_ABOVE, NewtonHistory
from .grid import TINY, Array
from .half_space import LineConvolution, wall_operator
from .problem import ContactProblem, Iteration

# Effects of the numbers below: tests/benchmarks/constant_effects.py. "16 contacts": of both kinematics, 5 to 98 N, 300
# to 4500 rpm.
#: share of the change of one iteration that is taken at first, undamped and damped; 16 contacts: 98 iterations, 111 at
#: 0.6, 85 at 1 with films up to 1e-3 away
UNDAMPED_STEP, DAMPED_STEP = 0.85, 0.5
#: share by Aitken's rule below which a solve is lost: of 1,106 that converged (360 contacts of screws and atlas), none
#: went below 0.1; those that never settle do within some thirty iterations
LEAST_STEP = 0.05
#: relative change above which Aitken's rule only shortens steps, and Newton steps are no less exact
LARGE_CHANGE = 0.1
GROWTH = 1.5  # growth of the share from one iteration to the next
#: damping ends at a relative change of LARGE_CHANGE/RETURN; when the change has grown by RETURN, it goes on from the
#: state where it ended, and then ends at the share 1/RETURN of that bound
RETURN = 5.0
#: Newton steps per iteration at most; three times as many where the last failed; where these fail, damping follows
NEWTON_STEPS = 4
#: pressure change that ends the Newton steps, as a share of the last relative change; 16 contacts: a sixth fewer Newton
#: steps than with 10 steps and a share of 0.1
PRESSURE_SHARE = 0.3
#: a solution is converged at changes below this multiple of the tolerance of pressure: bounds the error of the film
CONVERGED_AT = 10.0
#: a solution is also converged where the film is expected to change by less than that, and the mean temperature,
#: weighted by pressure, by CONVERGED_AT times that: the node of a pressure spike may still oscillate, by SPIKE_CHANGE
#: of the mean rise. Bound of the ratio of the changes, which is taken where they creep: damped
SPIKE_CHANGE, LARGEST_RATIO = 0.5, 0.98
#: sweeps of the energy equation each way per iteration: oil circulates in the inlet. With 1, the heat balance of a
#: thick sliding film closes to 3e-5 only
SWEEPS = 2
#: gap in which temperatures count, in films: beyond, oil circulates in the inlet, without an effect on the film
NEAR_FILMS = 10.0
#: temperature rise [K] below which the relative change is that over this rise: bounds the error of small rises
LEAST_RISE = 10.0
#: damped iterations between surfaces and separately sheared columns for the first temperatures; with 4, a contact that
#: slides at M = 2e5 does not converge
START_ITERATIONS = 10


# a diverging iterate is detected by values that are not finite
@np.errstate(over="ignore", invalid="ignore")
def solve_coupled(
    problem: ContactProblem,
    it: Iteration,
    temperature: Array | None,
    tolerance: float,
    limit: int,
    damped: bool = False,
) -> Iteration:
    """Alternate pressure and temperature (n_y, n_x, n_z+1) [K], None = an estimate, for at most `limit` iterations.

    damped: until the changes are small, dissipation is linearised as if it fell with temperature, temperatures do not
    follow the pressure, and steps stay short.
    """
    run = _CoupledRun(problem, it, temperature, tolerance, damped)
    it.damped, it.converged = damped, False
    it.reason = f"no convergence in {limit} thermal iterations"
    for _ in range(limit):
        newton = run.step_pressure()
        steps = len(newton.change)
        if not newton.finite:
            it.reason = newton.reason
            break
        if not (newton.converged or run.relaxation.ever_damped) and steps > NEWTON_STEPS:
            it.reason = f"pressure not found in {steps} Newton steps"
            break
        run.step_temperature()
        it.iterations += 1
        if not np.isfinite(run.change):
            it.reason = "temperature not finite"
            break
        if run.relaxation.share < LEAST_STEP:
            it.reason = f"no progress: a share of {run.relaxation.share:.2g} of the temperature step is left"
            break
        if reached := run.reached(newton):
            it.converged, it.reason = True, reached
            run.settle(newton)
            break
    equation, it.temperature = run.equation, run.temperature
    it.heat_flows = energy.heat_flows(equation.mesh, run.new, it.flow, equation.face, equation.walls)
    return it


class _CoupledRun:
    """State of one solve: iterate, temperatures and records."""

    def __init__(
        self,
        problem: ContactProblem,
        it: Iteration,
        temperature: Array | None,
        tolerance: float,
        damped: bool,
    ) -> None:
        self.problem, self.it, self.tolerance = problem, it, tolerance
        self.relaxation = Relaxation(damped)
        self.equation = EnergyEquation(problem)
        near = temperature is not None
        if temperature is None:
            temperature = self.equation.estimate(it)
        # in the film where the energy equation is not solved
        columns, face = np.arange(temperature.shape[1]), self.equation.face
        outside = (columns < face.start[:, None]) | (columns >= face.end[:, None])
        temperature[..., 1:-1][outside] = problem.conditions.temperature
        #: temperatures of the iterate; those of the last energy solve
        self.temperature = self.new = temperature
        self.gap = problem.update_flow(it, temperature)
        if near and not damped:
            # the first Newton steps need the temperatures of a near start to follow as well
            self.equation.solve(it, temperature, self.gap, damped)
        self.films: list[float] = []
        #: changes of temperature: largest over largest rise, mean over largest rise, largest over mean rise
        self.change, self.mean_change, self.spike = np.inf, np.inf, np.inf
        #: pressure and temperature where damping last ended; whether undamped steps have led away from there
        self.kept = it.state, temperature
        self.returned = False

    def step_pressure(self) -> NewtonHistory:
        """Newton steps of the pressure, as close as the temperatures are known, which follow it; and the flow."""
        problem, it = self.problem, self.it
        aim = max(self.tolerance, PRESSURE_SHARE * min(self.change, LARGE_CHANGE))
        # a node at the edge of cavitation may take many short steps
        steps = NEWTON_STEPS if it.history.converged or self.change == np.inf else 3 * NEWTON_STEPS
        if problem.film_scale > HELD_ABOVE:
            steps = problem.options.max_newton
        newton = self._newton(aim, steps)
        self.films.append(problem.central_film(it))
        self._rescale(self.films[-1])
        self.gap = problem.update_flow(it, self.temperature)
        return newton

    def _newton(self, aim: float, steps: int) -> NewtonHistory:
        """Newton steps to a pressure change [p_max], at temperatures that follow."""
        problem, it = self.problem, self.it
        film = problem.film(self.temperature.copy(), it.heat)
        it.state, it.history, it.preconditioner = reynolds.solve(
            problem.geometry, it.state, film, problem.film_scale, aim, steps, preconditioner=it.preconditioner
        )
        self.temperature = film.temperature
        return it.history

    def settle(self, newton: NewtonHistory) -> None:
        """Newton steps to the tolerance where the last ended before it: losses of neighbours scattered by 1.5 %."""
        if newton.change[-1] <= self.tolerance:
            return
        it, state, temperature = self.it, self.it.state, self.temperature
        if not self._newton(self.tolerance, 3 * NEWTON_STEPS).converged:
            it.state, self.temperature = state, temperature
        self.gap = self.problem.update_flow(it, self.temperature)
        # the heat balance is that of the last flow
        self.new = self.equation.solve(it, self.temperature, self.gap, False)

    def _rescale(self, film: float) -> None:
        """Take a film [b^2/R_x] as that of the iteration."""
        estimate = self.problem.scales.film_estimate
        self.problem.film_scale = min(max(film, 0.5 * FLOOR_SHARE * estimate), estimate)

    def step_temperature(self) -> None:
        """Solve the energy equation and step towards it."""
        it, damped, T_0 = self.it, self.relaxation.damped, self.problem.conditions.temperature
        self.new = self.equation.solve(it, self.temperature, self.gap, damped)
        if damped:
            self._hold_temperatures()
        residual = self.new - self.temperature
        rise = max(float(self.new.max()) - T_0, LEAST_RISE)
        near = it.state.gap <= NEAR_FILMS * self.problem.film_scale
        largest = float(np.max(np.abs(residual[near]), initial=0.0))
        # by load: a pressure spike covers many nodes and little of the contact
        carried = np.maximum(it.state.p, 0.0) * self.problem.geometry.weights
        carried /= float(np.sum(carried))
        heated = float(np.sum(carried * self.new.mean(axis=2))) - T_0
        self.change, self.spike = largest / rise, largest / max(heated, LEAST_RISE)
        self.mean_change = float(np.sum(carried * np.abs(residual).mean(axis=2))) / rise
        step = self.relaxation.step(residual * near[..., None], self.change)
        if damped and not self.relaxation.damped:
            self.kept = it.state, self.temperature
        elif self.relaxation.damped and not damped:
            self._go_back()
            return
        if damped and not self.returned:
            # it creeps: changes are small while much is left to change
            self.films.clear()
        self.temperature = self.temperature + np.where(near[..., None], step, 1.0) * residual

    def _hold_temperatures(self) -> None:
        """The next Newton steps at given temperatures: far away, they would follow the wrong way."""
        heat = self.it.heat
        for part in (heat.source, heat.squeeze, heat.lift, heat.widen):
            part[:] = 0.0

    def _go_back(self) -> None:
        """To where damping ended: one undamped step may leave a film that takes dozens of iterations to recover."""
        it = self.it
        it.state, self.temperature = self.kept
        it.preconditioner = None
        self._rescale(self.problem.central_film(it))
        self.gap = self.problem.update_flow(it, self.temperature)
        self._hold_temperatures()
        self.films.clear()
        self.returned = True

    def reached(self, newton: NewtonHistory) -> str:
        """Which criterion of convergence holds; empty if none does."""
        tolerance = CONVERGED_AT * self.tolerance
        if not newton.converged:
            return ""
        if newton.change[-1] <= tolerance and self.change <= tolerance:
            return "pressure and temperature changes below tolerance"
        left = _left(self.films, LARGEST_RATIO if self.relaxation.damped else 0.0)
        if self.spike <= SPIKE_CHANGE and self.mean_change <= CONVERGED_AT * tolerance and left <= tolerance:
            return f"film and mean temperature within tolerance, largest change {self.change:.0e} of the rise"
        return ""


def _left(films: list[float], least: float) -> float:
    """Relative change that the film has yet to make, as a geometric series by the larger of its last two ratios."""
    if len(films) < 3:
        return np.inf
    changes = np.maximum(np.abs(np.diff(films[-4:])), TINY)
    ratio = min(max(float(np.max(changes[1:] / changes[:-1])), least), LARGEST_RATIO)
    return float(changes[-1]) * ratio / (1.0 - ratio) / abs(films[-1])


class Relaxation:
    """Share of the change of an iteration that is taken: Aitken's rule within bounds (Kuttler & Wall 2008)."""

    def __init__(self, damped: bool) -> None:
        self.damped = self.ever_damped = damped
        self.share = DAMPED_STEP if damped else UNDAMPED_STEP
        self._undamped_below = LARGE_CHANGE / RETURN
        self._residual: Array | None = None

    def step(self, residual: Array, change: float) -> float:
        """Share of a residual to take; change: its relative size."""
        if (before := self._residual) is not None:
            # the share that would have removed the residual before, no longer than a bound
            overlap = float(np.sum(residual * before)) / max(float(np.sum(before * before)), TINY)
            longest = DAMPED_STEP if self.damped else UNDAMPED_STEP if change > LARGE_CHANGE else 1.0
            self.share = min(self.share / max(1.0 - overlap, TINY), GROWTH * self.share, longest)
        self._residual = residual
        # damping ends at small changes and resumes where they grow again
        if self.damped and change < self._undamped_below:
            self.damped, self.share, self._residual = False, UNDAMPED_STEP, None
        elif self.ever_damped and not self.damped and change > RETURN * self._undamped_below:
            self.damped, self.share, self._residual = True, DAMPED_STEP, None
            self._undamped_below /= RETURN
        return self.share


class EnergyEquation:
    """Energy equation of the film of one problem with both surfaces: fluxes, responses and one solve."""

    def __init__(self, problem: ContactProblem) -> None:
        grid, hertz = problem.geometry.grid, problem.scales.hertz
        self.problem = problem
        self.T_0 = problem.conditions.temperature
        self.mesh = energy.EnergyMesh(
            grid.x * hertz.b, grid.width_x * hertz.b, grid.h_y * hertz.a, problem.oil.thermal_conductivity, self.T_0
        )  # fmt: skip
        #: unit of the Reynolds fluxes [kg/(m s)]
        self.flux_unit = problem.conditions.u_e * problem.scales.h_unit * problem.oil.density
        shape = problem.geometry.undeformed.shape
        near = problem.geometry.undeformed <= problem.options.warm_films * problem.scales.warm_film + 1.0
        near[:, [0, -1]] = False
        # of every line the first column where the equation is solved, and the one behind the last
        start = np.where(near.any(axis=1), near.argmax(axis=1), 1)
        end = np.where(near.any(axis=1), shape[1] - near[:, ::-1].argmax(axis=1), 1)
        self.face = energy.FaceFlow.empty(start, end, shape[1], problem.options.n_z)
        self.walls = energy.WallHeat(np.zeros(shape), np.zeros(shape), np.zeros((*shape, 4)))
        self.operators = wall_operators(problem)

    def estimate(self, it: Iteration) -> Array:
        """First temperatures: every column sheared by itself, surfaces warmed by the heat that they take up."""
        problem, T_0 = self.problem, self.T_0
        temperature = problem.uniform_temperature()
        h, p = problem.update_flow(it, temperature), np.maximum(it.state.p, 0.0) * problem.scales.hertz.p_max
        k_oil, slip = problem.oil.thermal_conductivity, problem.speeds.u_b - problem.speeds.u_a
        walls = np.full((2, *p.shape), float(T_0))
        for _ in range(START_ITERATIONS):
            q = energy.sheared_films(problem.table, p, h, k_oil, slip, *walls, temperature)
            for wall, operator in zip(walls, self.operators, strict=True):
                wall += DAMPED_STEP * (T_0 + operator(q) - wall)
        energy.sheared_films(problem.table, p, h, k_oil, slip, *walls, temperature)
        temperature[:, 0], temperature[:, -1] = T_0, T_0
        return temperature

    def solve(self, it: Iteration, temperature: Array, gap: Array, damped: bool) -> Array:
        """Temperatures by the energy equation at a pressure and flow; fills it.heat and the fluxes to the walls."""
        oil, face, unit = self.problem.oil, self.face, self.flux_unit
        energy.face_flow(
            self.mesh, oil.specific_heat, it.state.p, it.flux_x * unit, it.flux_y * unit, it.flow, face
        )
        new = temperature.copy()
        # backward first: oil flows both ways in the inlet
        for sweep in range(2 * SWEEPS):
            forward, whole = sweep % 2 == 1, sweep == 2 * SWEEPS - 1
            energy.sweep(
                self.mesh, gap, it.flow, face, temperature, damped, forward, whole, new, it.heat,
                self.walls.response,
            )  # fmt: skip
        energy.wall_heat(self.mesh, gap, it.flow, face, new, self.walls)
        energy.update_walls(self.operators, new, self.walls, self.T_0)
        return new


def wall_operators(problem: ContactProblem) -> list[LineConvolution]:
    """Heat flux to surface temperature, of body 1 (z = 0) and body 2 (z = h); one operator where both are alike."""
    c, geometry, b = problem.conditions, problem.geometry, problem.scales.hertz.b
    return [
        wall_operator(
            geometry.grid, geometry.kappa, b, speed, s.thermal_conductivity,
            s.thermal_conductivity / (s.density * s.specific_heat),
        )
        for speed, s in zip((c.u_1, c.u_2), problem.solids, strict=True)
    ]  # fmt: skip
