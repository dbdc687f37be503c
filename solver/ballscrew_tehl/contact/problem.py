"""One operating point on one grid: scales, film coefficients, flow, and the isothermal solve."""

from dataclasses import dataclass, field, replace

import numpy as np

from ..parameters.file import LubricantParameters, SolidParameters
from .conditions import ContactConditions, SolverOptions, choose_grid, scales_of
from .film import flow as film_flow
from .film import reynolds
from .film.geometry import ReynoldsState, contact_geometry
from .film.linear import Film, Linearisation, LineFactors
from .film.transport import HeatTransport
from .grid import Array, GridChoice

#: materials of body 1 (raceway) and body 2 (ball)
Solids = tuple[SolidParameters, SolidParameters]


@dataclass
class Iteration:
    """Pressure, temperature, flow and last Newton steps; flux_*: mass through faces; heat_flows: HeatBalance [W]."""

    state: ReynoldsState
    flow: film_flow.FilmFlow
    heat: HeatTransport
    flux_x: Array = field(init=False)
    flux_y: Array = field(init=False)
    history: reynolds.NewtonHistory = field(default_factory=reynolds.NewtonHistory)
    temperature: Array | None = None
    heat_flows: tuple[float, float, float] | None = None
    converged: bool = False
    damped: bool = False
    reason: str = ""
    iterations: int = 0
    preconditioner: LineFactors | None = field(default=None, repr=False)


class ContactProblem:
    """One operating point on one grid, given or that of the expected film; entrainment is taken positive."""

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
        self.choice = choice or choose_grid(conditions, self.scales, film, options)
        self.geometry = contact_geometry(self.choice, conditions.R_x / conditions.R_y)
        #: size of the film [b^2/R_x]: the expected one, then that of the iteration
        self.film_scale = self.scales.film_estimate
        self.table = film_flow.oil_table(oil, conditions.temperature)
        self.speeds = film_flow.SurfaceSpeeds(float(conditions.u_1), float(conditions.u_2))

    def central_film(self, it: Iteration) -> float:
        """Gap on the axis at X = 0 [b^2/R_x], by the quadratic through the three nodes around it."""
        x, gap = self.geometry.grid.x, it.state.gap[0]
        k = int(np.argmin(np.abs(x)))
        return float(np.polyval(np.polyfit(x[k - 1 : k + 2], gap[k - 1 : k + 2], 2), 0.0))

    def film(self, temperature: Array, heat: HeatTransport | None = None) -> Film:
        """The oil at temperatures (n_y, n_x, n_z+1) [K], which follow the pressure where heat is given."""
        scales, u_e = self.scales, self.conditions.u_e
        unit, scale = scales.hertz.p_max, 1.0 / scales.reynolds

        def law(p: Array, t: Array) -> tuple[Array, ...]:
            return film_flow.film_coefficients(self.table, unit, p, t, self.speeds, u_e, scale)

        # the start of a thermal solve is left at a looser tolerance, where columns lead elsewhere within it
        return Film(law, unit, scales.h_unit, temperature, heat, across=not self.options.thermal)

    def start(self, state: ReynoldsState | None = None) -> Iteration:
        """An iteration at its beginning: from a state, or from the dry contact opened by the expected film."""
        if state is None:
            state = self.geometry.start(self.scales.film_estimate)
        (lines, nodes), layers = state.p.shape, self.options.n_z
        x = self.geometry.grid.x * self.scales.hertz.b
        flow, heat = film_flow.FilmFlow.empty(lines, nodes, layers), HeatTransport.empty(lines, x, layers)
        return Iteration(state, flow, heat)

    def uniform_temperature(self) -> Array:
        """Inlet temperature everywhere (n_y, n_x, n_z+1) [K]."""
        shape = (*self.geometry.undeformed.shape, self.options.n_z + 1)
        return np.full(shape, float(self.conditions.temperature))

    def solve_isothermal(self, it: Iteration, tolerance: float, max_steps: int) -> Iteration:
        """Newton iteration at the inlet temperature."""
        film = self.film(self.uniform_temperature())
        it.state, it.history, it.preconditioner = reynolds.solve(
            self.geometry, it.state, film, self.scales.film_estimate, tolerance, max_steps, patient=True
        )
        it.converged, it.reason = it.history.converged, it.history.reason
        it.iterations += len(it.history.change)
        return it

    def update_flow(self, it: Iteration, temperature: Array) -> Array:
        """Velocities, heat sources, stress and fluxes at the present pressure; returns the gap of the film [m]."""
        hertz, heat, flow = self.scales.hertz, it.heat, it.flow
        film = self.film(temperature, heat if self.options.thermal else None)
        linear = Linearisation(self.geometry, it.state, film, reynolds.FLOOR_SHARE * self.film_scale)
        linear.pressure_flow(flow, heat)
        it.flux_x, it.flux_y = -linear.faces.flow_x, -linear.faces.flow_y
        heat.wedge_h[:] = it.state.gap
        # volume flux u_e b^2/R_x times p_max over b
        watts = hertz.p_max * self.conditions.u_e * self.scales.h_unit / hertz.b
        for power in (flow.power, heat.pull, heat.push):
            power *= watts
        flow.gradient_x[:] *= hertz.p_max / hertz.b
        flow.gradient_y[:] *= hertz.p_max / hertz.a
        p, floor = np.maximum(it.state.p, 0.0) * hertz.p_max, 0.5 * reynolds.FLOOR_SHARE * self.film_scale
        h = np.maximum(it.state.gap, floor) * self.scales.h_unit
        film_flow.film_flow(self.table, self.geometry.grid.x * hertz.b, p, h, temperature, self.speeds, flow)
        return h
