"""One operating point on one grid: scales, film coefficients, flow, traction, and the isothermal solve."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..parameters.file import LubricantParameters, SolidParameters
from .conditions import ContactConditions, SolverOptions, cells_in_inlet, expected_grid, scales_of
from .film import energy
from .film import flow as film_flow
from .film.oil import oil_table
from .film.reynolds import GridChoice, LinePreconditioner, NewtonHistory, ReynoldsState, contact_geometry
from .half_space.grid import Array

#: least gap, as a share of the present film, in flow and energy equation while an iterate overlaps; moved to 0.02: no
#: effect, to 0.5: films change by 1.5e-5
LEAST_GAP_SHARE = 0.1


class Traction(NamedTuple):
    """Shear on body 2: force along rolling [N], moment about the contact normal [N m]; heat of sliding [W]."""

    force: float
    moment: float
    heat: float


@dataclass
class Iteration:
    """Pressure, temperature, sources and history of a solve."""

    state: ReynoldsState
    history: NewtonHistory
    flow: film_flow.FilmFlow
    temperature: Array | None = None
    temperature_history: list[float] = field(default_factory=list)
    heat: energy.HeatBalance | None = None
    converged: bool = False
    damped: bool = False
    reason: str = ""
    iterations: int = 0
    preconditioner: LinePreconditioner | None = field(default=None, repr=False)


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

    def isothermal_film(self, p: Array) -> tuple[Array, ...]:
        """Film coefficients of a Newtonian oil at the inlet temperature."""
        c = self.conditions
        out = tuple(np.empty_like(p) for _ in range(6))
        film_flow.isothermal_coefficients(
            self.table, self.scales.hertz.p_max, p, c.temperature, self.speeds, c.u_e, 1.0 / self.scales.reynolds, *out
        )  # fmt: skip
        return out

    def general_film(
        self, temperature: Array, t_p: Array, p_at: Array, flow: film_flow.FilmFlow, p: Array
    ) -> tuple[Array, ...]:
        """Film coefficients of the generalised Reynolds equation; temperature and thinning follow the pressure."""
        c = self.conditions
        out = tuple(np.empty_like(p) for _ in range(6))
        film_flow.film_coefficients(
            self.table, self.scales.hertz.p_max, p, p_at, temperature, t_p, flow.thinning, flow.ln_eta,
            flow.stress_share,
            self.speeds, c.u_e, 1.0 / self.scales.reynolds, *out,
        )  # fmt: skip
        return out

    def start(self, state: ReynoldsState | None = None) -> Iteration:
        """An iteration at its beginning: from a state, or from the dry contact opened by the expected film."""
        if state is None:
            state = self.geometry.start(self.scales.film_estimate)
        lines, nodes = state.p.shape
        return Iteration(state, NewtonHistory(), film_flow.FilmFlow.empty(lines, nodes, self.options.n_z))

    def uniform_temperature(self) -> Array:
        """Inlet temperature everywhere (n_y, n_x, n_z+1) [K]."""
        shape = (*self.geometry.undeformed.shape, self.options.n_z + 1)
        return np.full(shape, float(self.conditions.temperature))

    def solve_isothermal(self, it: Iteration, tolerance: float, max_steps: int) -> Iteration:
        """Newton iteration of a Newtonian oil at the inlet temperature."""
        with self.timed("reynolds"):
            it.state, history, it.preconditioner = self.geometry.solve(
                it.state, self.isothermal_film, self.scales.film_estimate, tolerance, max_steps
            )
        it.history.extend(history)
        it.converged, it.reason = history.converged, history.reason
        it.iterations += len(history.change)
        return it

    def physical(self, state: ReynoldsState) -> tuple[Array, Array]:
        """Pressure [Pa] and gap [m], the latter at least a tenth of the present film while iterating."""
        gap = np.maximum(state.gap, LEAST_GAP_SHARE * self.film_scale) * self.scales.h_unit
        return np.maximum(state.p, 0.0) * self.scales.hertz.p_max, gap

    def update_flow(self, it: Iteration, temperature: Array) -> Array:
        """Velocities, heat sources and shear stress at the present pressure; returns the gap [m]."""
        hertz, grid = self.scales.hertz, self.geometry.grid
        p, h = self.physical(it.state)
        with self.timed("film flow"):
            film_flow.film_flow(
                self.table, grid.x * hertz.b, grid.y * hertz.a, grid.mirror, p, h, temperature, self.speeds, it.flow
            )  # fmt: skip
        return h

    def traction(self, it: Iteration) -> Traction:
        """Stress of mid-film integrated over the contact; the halves of a mirrored contact count twice."""
        hertz, grid, flow = self.scales.hertz, self.geometry.grid, it.flow
        area = grid.weights * (hertz.a * hertz.b)
        x, y = np.meshgrid(grid.x * hertz.b, grid.y * hertz.a)
        moment = 0.0 if grid.mirror else -float(np.sum(area * (x * flow.traction_y - y * flow.traction_x)))
        slip_x, slip_y = self.speeds.u_b - self.speeds.u_a, self.speeds.v_b - self.speeds.v_a
        heat = float(np.sum(area * (flow.traction_x * slip_x + flow.traction_y * slip_y)))
        return Traction(-float(np.sum(area * flow.traction_x)), moment, heat)
