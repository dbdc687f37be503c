"""One operating point on one grid: the isothermal Newton solve and its coupling with the energy equation."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache, partial

import numpy as np

from ..parameters import LubricantParameters, SolidParameters
from . import energy, film_flow
from .anderson import AndersonMixing
from .conditions import ContactConditions, SolverOptions, choose_grid, inlet_length, scales_of
from .elastic import LineConvolution
from .grid import Array
from .reynolds import NewtonHistory, ReynoldsState, contact_geometry
from .walls import wall_operator

#: share of the temperature change of one outer iteration that is taken
TEMPERATURE_STEP = 0.7
#: iterations without progress after which that share is halved
STALL_AFTER = 40
#: Newton steps of the pressure per outer iteration at most, and the pressure change that ends them early,
#: as a share of the last relative temperature change
NEWTON_STEPS = 5
PRESSURE_SHARE = 0.02
#: below this change, relative to the rise, the iteration is accelerated: at first, and after a stall
MIXING_FROM = (5e-3, 0.3)
#: largest temperature change of one outer iteration [K]
TEMPERATURE_LIMIT = 30.0


def _stalled(changes: list[float]) -> bool:
    """Whether the last STALL_AFTER changes are no smaller than the ones before."""
    if len(changes) < 2 * STALL_AFTER:
        return False
    return not min(changes[-STALL_AFTER:]) < 0.5 * min(changes[-2 * STALL_AFTER : -STALL_AFTER])


@dataclass
class Iteration:
    """Where a solve stands: pressure, temperature, sources, and the record of the way."""

    state: ReynoldsState
    history: NewtonHistory
    flow: energy.FilmFlow
    temperature: Array | None = None
    temperature_history: list[float] = field(default_factory=list)
    heat: energy.HeatBalance | None = None
    traction: float = 0.0
    converged: bool = False
    reason: str = ""
    iterations: int = 0


class ContactProblem:
    """One operating point on one grid; entrainment is taken positive."""

    def __init__(
        self,
        conditions: ContactConditions,
        oil: LubricantParameters,
        solid: SolidParameters,
        options: SolverOptions,
    ) -> None:
        self.given = conditions
        if conditions.u_e < 0.0:
            # rolling the other way round is the mirror image
            conditions = replace(conditions, u_1=-conditions.u_1, u_2=-conditions.u_2)
        self.conditions, self.oil, self.solid, self.options = conditions, oil, solid, options
        self.scales = scales_of(conditions, oil)
        ratio = conditions.R_x / conditions.R_y
        kappa = self.scales.hertz.b / self.scales.hertz.a
        self.choice = choose_grid(options, self.scales.film_estimate, ratio / kappa**2, kappa)
        self.geometry = contact_geometry(self.choice, ratio)
        self.table = film_flow.oil_table(oil, conditions.temperature)

    def cells_in_inlet(self, film: float) -> float:
        """Grid cells in the inlet length of the central line for a film [b^2/R_x]."""
        x = self.geometry.grid.x
        k = int(np.searchsorted(x, -1.0))
        return inlet_length(max(film, 0.0)) / float(x[k] - x[k - 1])

    def isothermal_film(self, p: Array) -> tuple[Array, Array, Array, Array]:
        """Film coefficients at the inlet temperature."""
        out = tuple(np.empty_like(p) for _ in range(4))
        film_flow.isothermal_coefficients(
            self.table,
            self.scales.hertz.p_max,
            p,
            self.conditions.temperature,
            1.0 / self.scales.reynolds,
            *out,
        )
        return out  # type: ignore[return-value]

    def thermal_film(self, temperature: Array, p: Array) -> tuple[Array, Array, Array, Array]:
        """Film coefficients of the generalised Reynolds equation at given temperatures."""
        c = self.conditions
        out = tuple(np.empty_like(p) for _ in range(4))
        film_flow.film_coefficients(
            self.table,
            self.scales.hertz.p_max,
            p,
            temperature,
            c.u_1,
            c.u_2,
            c.u_e,
            1.0 / self.scales.reynolds,
            *out,
        )
        return out  # type: ignore[return-value]

    def solve_isothermal(self, state: ReynoldsState, tolerance: float, max_steps: int) -> Iteration:
        """Newton iteration at the inlet temperature."""
        state, history = self.geometry.solve(
            state, self.isothermal_film, self.scales.film_estimate, tolerance, max_steps
        )
        lines, nodes = state.p.shape
        flow = energy.FilmFlow.empty(lines, nodes, self.options.n_z)
        return Iteration(
            state,
            history,
            flow,
            converged=history.converged,
            reason=history.reason,
            iterations=len(history.change),
        )

    def walls(self) -> tuple[LineConvolution, LineConvolution]:
        """Heat flux to surface temperature, of body 1 (z = 0) and body 2 (z = h)."""
        c, solid = self.conditions, self.solid
        chi = solid.thermal_conductivity / (solid.density * solid.specific_heat)

        @lru_cache(maxsize=2)
        def operator(speed: float) -> LineConvolution:
            return wall_operator(
                self.geometry.grid,
                self.geometry.kappa,
                self.scales.hertz.b,
                speed,
                solid.thermal_conductivity,
                chi,
            )

        return operator(c.u_1), operator(c.u_2)

    def physical(self, state: ReynoldsState) -> tuple[Array, Array]:
        """Pressure [Pa] and gap [m], the latter at least a tenth of the expected film while iterating."""
        gap = np.maximum(state.gap, 0.1 * self.scales.film_estimate) * self.scales.h_unit
        return np.maximum(state.p, 0.0) * self.scales.hertz.p_max, gap

    def update_flow(self, it: Iteration, temperature: Array) -> tuple[Array, Array]:
        """Velocities, heat sources and traction at the present pressure."""
        c, hertz, grid = self.conditions, self.scales.hertz, self.geometry.grid
        p, h = self.physical(it.state)
        energy.film_flow(
            self.table, grid.x * hertz.b, grid.y * hertz.a, p, h, temperature, c.u_1, c.u_2, it.flow
        )
        it.traction = -float(np.sum(grid.weights * it.flow.traction)) * hertz.a * hertz.b
        return p, h

    def solve_thermal(self, it: Iteration, temperature: Array) -> Iteration:
        """Alternate one Newton step of the generalised Reynolds equation with the energy equation and the walls."""
        c, o, hertz, grid = self.conditions, self.options, self.scales.hertz, self.geometry.grid
        heat, conductivity = self.oil.specific_heat, self.oil.thermal_conductivity
        walls = self.walls()
        shape = it.state.p.shape
        q_a, q_b = np.zeros(shape), np.zeros(shape)
        response = np.zeros((*shape, 4))
        width, h_y, x = grid.width_x * hertz.b, grid.h_y * hertz.a, grid.x * hertz.b
        mixing, share, early = AndersonMixing(), TEMPERATURE_STEP, False
        it.converged, it.reason = False, f"no convergence in {o.max_thermal} thermal iterations"
        for _ in range(o.max_thermal):
            # the pressure follows as closely as the temperature has come: no closer, for it costs the most
            aim = max(o.tolerance, PRESSURE_SHARE * (it.temperature_history or [1.0])[-1])
            it.state, newton = self.geometry.solve(
                it.state,
                partial(self.thermal_film, temperature),
                self.scales.film_estimate,
                aim,
                max_steps=NEWTON_STEPS,
            )
            for name in ("residual", "change", "load_error", "krylov"):
                getattr(it.history, name).extend(getattr(newton, name))
            it.history.deflections += newton.deflections
            _, h = self.update_flow(it, temperature)
            new = temperature.copy()
            # back first: the inlet carries oil both ways
            for forward in (False, True):
                energy.sweep(x, width, h_y, h, heat, conductivity, it.flow, forward, new, q_a, q_b, response)
            energy.update_walls(walls, new, q_a, q_b, response, c.temperature)
            change = float(np.abs(new - temperature).max())
            rise = max(float(new.max()) - c.temperature, 1e-3)
            if len(it.temperature_history) % STALL_AFTER == 0 and _stalled(it.temperature_history):
                # recirculating oil wants acceleration early, a wandering pressure spike wants none and shorter steps
                early = not early
                share *= 1.0 if early else 0.5
            if change > MIXING_FROM[early] * rise:
                temperature = temperature + min(share, TEMPERATURE_LIMIT / change) * (new - temperature)
            else:
                temperature = mixing.next(temperature, new, share)
            it.temperature_history.append(change / rise)
            it.iterations += 1
            if not np.isfinite(change):
                it.reason = "temperature not finite"
                break
            if (
                newton.converged
                and newton.change[-1] <= 10.0 * o.tolerance
                and change <= 10.0 * o.tolerance * rise
            ):
                it.converged, it.reason = True, "pressure and temperature changes below tolerance"
                break
        self.update_flow(it, temperature)
        it.temperature = temperature
        it.heat = energy.heat_balance(
            grid, hertz.a, hertz.b, heat, it.flow, temperature, c.temperature, q_a, q_b
        )
        return it
