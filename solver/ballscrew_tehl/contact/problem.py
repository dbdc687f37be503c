"""One operating point on one grid: scales, film coefficients, flow, traction, and the isothermal solve."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..parameters.file import LubricantParameters, SolidParameters
from .conditions import ContactConditions, SolverOptions, expected_grid, scales_of
from .film import flow as film_flow
from .film import reynolds, transport
from .film.geometry import GridChoice, ReynoldsState, contact_geometry
from .film.linear import Film, LinearSystem, LineFactors
from .film.oil import oil_table
from .film.transport import HeatTransport
from .half_space.grid import Array

#: materials of body 1 (raceway) and body 2 (ball)
Solids = tuple[SolidParameters, SolidParameters]


@dataclass
class Iteration:
    """Pressure, temperature, sources and history of a solve.

    flux_x, flux_y: mass through the faces, dimensionless; heat_flows: generated, conducted, convected [W].
    """

    state: ReynoldsState
    history: reynolds.NewtonHistory
    flow: film_flow.FilmFlow
    heat: HeatTransport
    flux_x: Array
    flux_y: Array
    temperature: Array | None = None
    temperature_history: list[float] = field(default_factory=list)
    heat_flows: tuple[float, float, float] | None = None
    converged: bool = False
    damped: bool = False
    reason: str = ""
    iterations: int = 0
    preconditioner: LineFactors | None = field(default=None, repr=False)


class OilFilm(Film):
    """Film coefficients at temperatures (n_y, n_x, n_z+1) [K], which follow the pressure where heat is given."""

    def __init__(
        self, problem: "ContactProblem", temperature: Array, heat: HeatTransport | None = None
    ) -> None:
        self.problem, self.temperature = problem, temperature
        self.unit, self.unit_h = problem.scales.hertz.p_max, problem.scales.h_unit
        # the start of a thermal solve is left at a looser tolerance, where columns lead elsewhere within it
        self.across = not problem.options.thermal
        if heat is not None:
            self.heat, self.warm = heat, True

    def coefficients(self, p: Array) -> tuple[Array, ...]:
        """At a pressure [p_max] and the present temperature."""
        problem = self.problem
        *out, self.by_t = film_flow.film_coefficients(
            problem.table, self.unit, p, self.temperature, problem.speeds, problem.conditions.u_e,
            1.0 / problem.scales.reynolds,
        )  # fmt: skip
        return tuple(out)

    def follow(self, linear: LinearSystem, d_p: Array, d_h: Array) -> None:
        """Temperatures after a change of pressure [p_max] and gap [b^2/R_x]."""
        if not self.warm:
            return
        change = np.empty_like(self.temperature)
        transport.follow(
            self.heat, linear.g, linear.dg, linear.by_t, self.unit, self.unit_h, d_p, d_h, change
        )  # fmt: skip
        self.temperature += np.clip(change, -film_flow.FOLLOW_LIMIT, film_flow.FOLLOW_LIMIT)


class ContactProblem:
    """One operating point on one grid; entrainment is taken positive.

    choice: the grid, None = that of the options and the expected film
    """

    def __init__(
        self,
        conditions: ContactConditions,
        oil: LubricantParameters,
        solids: Solids,
        options: SolverOptions,
        choice: GridChoice | None = None,
    ) -> None:
        self.given = conditions
        if conditions.u_e < 0.0:
            # reversed rolling is the mirror image
            conditions = replace(conditions, u_1=-conditions.u_1, u_2=-conditions.u_2)
        self.conditions, self.oil, self.solids, self.options = conditions, oil, solids, options
        self.scales = scales_of(conditions, oil)
        film = self.scales.warm_film if options.thermal else self.scales.film_estimate
        self.choice = choice or expected_grid(conditions, self.scales, film, options)
        self.geometry = contact_geometry(self.choice, conditions.R_x / conditions.R_y)
        #: size of the film [b^2/R_x]: the expected one, then that of the iteration
        self.film_scale = self.scales.film_estimate
        self.table = oil_table(oil, conditions.temperature)
        self.speeds = film_flow.SurfaceSpeeds(float(conditions.u_1), float(conditions.u_2))

    def central_film(self, it: Iteration) -> float:
        """Gap on the axis at X = 0 [b^2/R_x], by the quadratic through the three nodes around it."""
        x, gap = self.geometry.grid.x, it.state.gap[0]
        k = int(np.argmin(np.abs(x)))
        return float(np.polyval(np.polyfit(x[k - 1 : k + 2], gap[k - 1 : k + 2], 2), 0.0))

    @cached_property
    def isothermal_film(self) -> Film:
        """The film at the inlet temperature."""
        return OilFilm(self, self.uniform_temperature())

    def start(self, state: ReynoldsState | None = None) -> Iteration:
        """An iteration at its beginning: from a state, or from the dry contact opened by the expected film."""
        if state is None:
            state = self.geometry.start(self.scales.film_estimate)
        lines, nodes = state.p.shape
        return Iteration(
            state,
            reynolds.NewtonHistory(),
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
        """Newton iteration at the inlet temperature."""
        it.state, history, it.preconditioner = reynolds.solve(
            self.geometry,
            it.state,
            self.isothermal_film,
            self.scales.film_estimate,
            tolerance,
            max_steps,
            patient=True,
        )
        it.history.extend(history)
        it.converged, it.reason = history.converged, history.reason
        it.iterations += len(history.change)
        return it

    def physical(self, state: ReynoldsState) -> tuple[Array, Array]:
        """Pressure of the film [Pa] and gap [m], the latter at least a tenth of the film while iterating."""
        gap = np.maximum(state.gap, 0.5 * reynolds.FLOOR_SHARE * self.film_scale) * self.scales.h_unit
        return np.maximum(state.p, 0.0) * self.scales.hertz.p_max, gap

    def update_flow(self, it: Iteration, temperature: Array) -> Array:
        """Velocities, heat sources and shear stress at the present pressure; returns the gap [m]."""
        p, h = self.physical(it.state)
        film = OilFilm(self, temperature, it.heat) if self.options.thermal else self.isothermal_film
        self._set_pressure_flow(it, film)
        x = self.geometry.grid.x * self.scales.hertz.b
        film_flow.film_flow(self.table, x, p, h, temperature, self.speeds, it.flow)
        return h

    def _set_pressure_flow(self, it: Iteration, film: Film) -> None:
        """Fluxes of the faces, and what the pressure drives and dissipates in the film, of the present state."""
        hertz, heat, flow = self.scales.hertz, it.heat, it.flow
        linear = reynolds.linearise(self.geometry, it.state, film, self.film_scale)
        linear.pressure_flow(flow, heat)
        it.flux_x, it.flux_y = -linear.faces.flow_x, -linear.faces.flow_y
        heat.wedge_h[:] = it.state.gap
        # volume flux u_e b^2/R_x times p_max over b
        watts = hertz.p_max * self.conditions.u_e * self.scales.h_unit / hertz.b
        for power in (flow.power, heat.pull, heat.push):
            power *= watts
        flow.gradient_x[:] *= hertz.p_max / hertz.b
        flow.gradient_y[:] *= hertz.p_max / hertz.a

    def traction(self, it: Iteration) -> tuple[float, float]:
        """Stress of mid-film integrated over the contact: force on body 2 along rolling [N], heat of sliding [W]."""
        hertz, flow = self.scales.hertz, it.flow
        area = self.geometry.grid.weights * (hertz.a * hertz.b)
        heat = float(np.sum(area * (flow.traction_x * (self.speeds.u_b - self.speeds.u_a))))
        return -float(np.sum(area * flow.traction_x)), heat
