"""One operating point on one grid: scales, film coefficients, flow, traction, and the isothermal solve."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..parameters.file import LubricantParameters, SolidParameters
from ..physics.asperity import pressure_scale
from .conditions import ContactConditions, SolverOptions, cells_in_inlet, expected_grid, scales_of
from .film import energy, kernels, transport
from .film import flow as film_flow
from .film.asperity import Asperities
from .film.linear import LinearSystem, LineFactors
from .film.oil import oil_table
from .film.reynolds import (
    FLOOR_SHARE,
    Film,
    GridChoice,
    NewtonHistory,
    ReynoldsState,
    contact_geometry,
)
from .film.transport import HeatTransport
from .half_space.grid import Array

#: least gap, as a share of the present film, in flow and energy equation while an iterate overlaps; moved to 0.02: no
#: effect, to 0.5: films change by 1.5e-5
LEAST_GAP_SHARE = 0.1
#: mean Hertz pressure [p_max], and the share of it that asperities carry at most where a solve begins
MEAN_PRESSURE, START_SHARE = 2.0 / 3.0, 0.5


class Traction(NamedTuple):
    """Shear on body 2: force along rolling [N], moment about the contact normal [N m]; heat of sliding [W]."""

    force: float
    moment: float
    heat: float


@dataclass
class Iteration:
    """Pressure, temperature, sources and history of a solve; flux_x, flux_y: mass through the faces, dimensionless."""

    state: ReynoldsState
    history: NewtonHistory
    flow: film_flow.FilmFlow
    heat: HeatTransport
    flux_x: Array
    flux_y: Array
    temperature: Array | None = None
    temperature_history: list[float] = field(default_factory=list)
    balance: Callable[[], energy.HeatBalance] | None = None
    converged: bool = False
    damped: bool = False
    reason: str = ""
    iterations: int = 0
    preconditioner: LineFactors | None = field(default=None, repr=False)


class WarmFilm(Film):
    """Film coefficients at temperatures that follow the pressure, and thinning that follows the viscosity."""

    def __init__(
        self, problem: ContactProblem, temperature: Array, flow: film_flow.FilmFlow, heat: HeatTransport
    ) -> None:
        self.problem, self.temperature, self.flow, self.heat = problem, temperature, flow, heat
        ny, nx, layers = temperature.shape
        self.unit, self.unit_h, self.warm = problem.scales.hertz.p_max, problem.scales.h_unit, True
        self.asperities = problem.asperities
        self.by_t, self.change = np.zeros((ny, nx, 3, layers)), np.empty_like(temperature)

    def coefficients(self, p: Array) -> tuple[Array, ...]:
        """At a pressure [p_max] and the present temperature."""
        problem, flow = self.problem, self.flow
        out = tuple(np.empty_like(p) for _ in range(6))
        film_flow.film_coefficients(
            problem.table, self.unit, p, self.temperature, flow.thinning, flow.ln_eta, flow.stress_share,
            problem.speeds, problem.conditions.u_e, 1.0 / problem.scales.reynolds, *out, self.by_t,
        )  # fmt: skip
        return out

    def follow(self, linear: LinearSystem, d_p: Array, d_h: Array) -> None:
        """Temperatures after a change of pressure [p_max] and gap [b^2/R_x]."""
        transport.follow(
            self.heat, linear.g, linear.dg, linear.by_t, self.unit, self.unit_h, d_p, d_h, self.change
        )  # fmt: skip
        self.temperature += np.clip(self.change, -film_flow.FOLLOW_LIMIT, film_flow.FOLLOW_LIMIT)


class ContactProblem:
    """One operating point on one grid; entrainment is taken positive.

    choice: the grid, None = that of the options and the expected film
    """

    def __init__(
        self,
        conditions: ContactConditions,
        oil: LubricantParameters,
        solid: SolidParameters,
        options: SolverOptions,
        choice: GridChoice | None = None,
    ) -> None:
        self.given = conditions
        if conditions.u_e < 0.0:
            # reversed rolling is the mirror image
            conditions = conditions.reversed()
        self.conditions, self.oil, self.solid, self.options = conditions, oil, solid, options
        self.seconds: dict[str, float] = defaultdict(float)
        self.scales = scales_of(conditions, oil)
        film = self.scales.warm_film if options.thermal else self.scales.film_estimate
        self.choice = choice or expected_grid(conditions, self.scales, film, options)
        with self.timed("geometry"):
            self.geometry = contact_geometry(self.choice, conditions.R_x / conditions.R_y)
        rough = conditions.roughness
        #: asperities of the surfaces in the units of the solve
        self.asperities = Asperities()
        if rough is not None:
            scale = pressure_scale(rough, conditions.E_prime) / self.scales.hertz.p_max
            self.asperities = Asperities(scale, rough.sigma / self.scales.h_unit)
        #: size of the film [b^2/R_x]: the expected one, then that of the iteration
        self.film_scale = self.scales.film_estimate
        self.table = oil_table(oil, conditions.temperature)
        grid, hertz = self.geometry.grid, self.scales.hertz
        self.speeds = film_flow.SurfaceSpeeds(*conditions.surface_speeds(grid.x * hertz.b, grid.y * hertz.a))
        #: whether the film is that of one viscosity per pressure
        self.plain = oil.rheology == "newtonian" and not options.thermal

    @contextmanager
    def timed(self, phase: str) -> Iterator[None]:
        """Add the time to a phase."""
        begun = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[phase] += time.perf_counter() - begun

    def central_film(self, it: Iteration) -> float:
        """Gap on the axis at X = 0 [b^2/R_x], by the quadratic through the three nodes around it."""
        x, gap = self.geometry.grid.x, it.state.gap[self.geometry.axis]
        k = int(np.argmin(np.abs(x)))
        return float(np.polyval(np.polyfit(x[k - 1 : k + 2], gap[k - 1 : k + 2], 2), 0.0))

    def cells_in_inlet(self, film: float) -> float:
        """Grid cells in the inlet length of the central line for a film [b^2/R_x]."""
        return cells_in_inlet(self.geometry.grid.x, film)

    @cached_property
    def isothermal_film(self) -> Film:
        """Film coefficients of a Newtonian oil at the inlet temperature."""
        c, shape = self.conditions, self.geometry.undeformed.shape

        def coefficients(p: Array) -> tuple[Array, ...]:
            out = tuple(np.empty_like(p) for _ in range(6))
            film_flow.isothermal_coefficients(
                self.table, self.scales.hertz.p_max, p, c.temperature, self.speeds, c.u_e, 1.0 / self.scales.reynolds,
                *out,
            )  # fmt: skip
            return out

        return Film(coefficients, shape, self.scales.hertz.p_max, self.asperities)

    def start(self, state: ReynoldsState | None = None) -> Iteration:
        """An iteration at its beginning: from a state, or from the dry contact opened by the expected film."""
        if state is None:
            # a film as thick as the asperities that carry their share alone would leave
            least = self.asperities.gap_at(START_SHARE * MEAN_PRESSURE) if self.asperities.rough else 0.0
            state = self.with_asperities(self.geometry.start(max(self.scales.film_estimate, least)))
        lines, nodes = state.p.shape
        return Iteration(
            state,
            NewtonHistory(),
            film_flow.FilmFlow.empty(lines, nodes, self.options.n_z),
            HeatTransport.empty(lines, self.geometry.grid.x * self.scales.hertz.b, self.options.n_z),
            np.zeros((lines, nodes - 1)),
            np.zeros((lines - 1, nodes)),
        )

    def uniform_temperature(self) -> Array:
        """Inlet temperature everywhere (n_y, n_x, n_z+1) [K]."""
        shape = (*self.geometry.undeformed.shape, self.options.n_z + 1)
        return np.full(shape, float(self.conditions.temperature))

    def solve_isothermal(self, it: Iteration, tolerance: float, max_steps: int) -> Iteration:
        """Newton iteration of a Newtonian oil at the inlet temperature."""
        with self.timed("reynolds"):
            it.state, history, it.preconditioner = self.geometry.solve(
                it.state, self.isothermal_film, self.scales.film_estimate, tolerance, max_steps, patient=True
            )
        it.history.extend(history)
        it.converged, it.reason = history.converged, history.reason
        it.iterations += len(history.change)
        return it

    def with_asperities(self, state: ReynoldsState) -> ReynoldsState:
        """A state whose pressure is nowhere below that of the asperities: the film does not pull."""
        if not self.asperities.rough:
            return state
        p = np.maximum(state.p, self.asperity_pressure(state))
        # the approach that leaves the gap of the contact as it was
        shape, middle = self.geometry.gap(p, 0.0), state.p > 0.5 * state.p.max()
        h_0 = float(np.max((state.gap - shape)[middle]))
        return ReynoldsState(p, h_0, shape + h_0, np.zeros(p.shape, dtype=bool))

    def asperity_pressure(self, state: ReynoldsState) -> Array:
        """Pressure that the asperities carry [p_max]."""
        return self.geometry.asperity_pressure(self.asperities, state.gap)[0]

    def film_pressure(self, state: ReynoldsState) -> Array:
        """Pressure that they leave to the film [p_max], slightly negative where it cavitates."""
        return state.p - self.asperity_pressure(state)

    def physical(self, state: ReynoldsState) -> tuple[Array, Array]:
        """Pressure of the film [Pa] and gap [m], the latter at least a tenth of the film while iterating."""
        gap = np.maximum(state.gap, LEAST_GAP_SHARE * self.film_scale) * self.scales.h_unit
        return np.maximum(self.film_pressure(state), 0.0) * self.scales.hertz.p_max, gap

    def update_flow(self, it: Iteration, temperature: Array) -> Array:
        """Velocities, heat sources and shear stress at the present pressure; returns the gap [m]."""
        p, h = self.physical(it.state)
        with self.timed("film flow"):
            film = self.isothermal_film if self.plain else WarmFilm(self, temperature, it.flow, it.heat)
            self._set_pressure_flow(it, film)
            x = self.geometry.grid.x * self.scales.hertz.b
            film_flow.film_flow(self.table, x, p, h, temperature, self.speeds, it.flow)
        return h

    def _set_pressure_flow(self, it: Iteration, film: Film) -> None:
        """Fluxes of the faces, and what the pressure drives and dissipates in the film, of the present state."""
        hertz, geometry, heat, flow = self.scales.hertz, self.geometry, it.heat, it.flow
        linear = geometry.linearise(it.state, film, self.film_scale)
        system, grid, pressure = linear.system, geometry.grid, np.maximum(linear.film_pressure, 0.0)
        it.flux_x, it.flux_y = -linear.flow_x, -linear.flow_y
        kernels.pressure_flow(
            grid.x, grid.width_x, grid.h_y, geometry.kappa_h, grid.mirror, pressure, it.state.gap, linear.ln_phi,
            system.dln_phi, system.g, linear.flow_x, linear.flow_y, system.c_x, system.c_y, system.wedge,
            geometry.deflection.same_line, FLOOR_SHARE * self.film_scale,
            flow.gradient_x, flow.gradient_y, flow.power, heat.pull, heat.push,
        )  # fmt: skip
        heat.wedge_h[:] = it.state.gap
        # volume flux u_e b^2/R_x times p_max over b
        watts = hertz.p_max * self.conditions.u_e * self.scales.h_unit / hertz.b
        for power in (flow.power, heat.pull, heat.push):
            power *= watts
        flow.gradient_x[:] *= hertz.p_max / hertz.b
        flow.gradient_y[:] *= hertz.p_max / hertz.a

    def traction(self, it: Iteration) -> Traction:
        """Stress of mid-film integrated over the contact; the halves of a mirrored contact count twice."""
        hertz, grid, flow = self.scales.hertz, self.geometry.grid, it.flow
        area = grid.weights * (hertz.a * hertz.b)
        x, y = np.meshgrid(grid.x * hertz.b, grid.y * hertz.a)
        moment = 0.0 if grid.mirror else -float(np.sum(area * (x * flow.traction_y - y * flow.traction_x)))
        slip_x, slip_y = self.speeds.u_b - self.speeds.u_a, self.speeds.v_b - self.speeds.v_a
        heat = float(np.sum(area * (flow.traction_x * slip_x + flow.traction_y * slip_y)))
        return Traction(-float(np.sum(area * flow.traction_x)), moment, heat)
