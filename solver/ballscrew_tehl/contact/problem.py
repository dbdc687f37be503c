"""One operating point on one grid: the Newton solve of the pressure and its coupling with the energy equation."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from ..parameters.file import LubricantParameters, SolidParameters
from .conditions import ContactConditions, SolverOptions, cells_in_inlet, expected_grid, scales_of
from .film import energy
from .film import flow as film_flow
from .film.oil import oil_table
from .film.reynolds import (
    GridChoice,
    LinePreconditioner,
    NewtonHistory,
    ReynoldsState,
    contact_geometry,
    stalled,
)
from .half_space.deflection import LineConvolution
from .half_space.grid import Array
from .half_space.walls import wall_operator

#: share of the change of one outer iteration that is taken at first; Aitken's rule then finds it, but no less than
OUTER_STEP = 0.6
LEAST_STEP, AITKEN_BELOW = 0.05, 0.1
#: the same while cautious; change below which caution is given up. Grown by five times, it comes back, and the next
#: trial begins at a fifth
CAUTIOUS_STEP, BOLD_BELOW = 0.5, 0.02
#: bold iterations without progress above a change after which they are given up
LOST_AFTER, LOST_ABOVE = 8, 0.1
#: share of the change of ln(viscosity) by shear thinning, and its bound
THINNING_STEP, THINNING_LIMIT = 0.5, 2.0
#: iterations without progress after which that share is halved
STALL_AFTER = 15
#: Newton steps of the pressure per outer iteration at most, and the pressure change that ends them early,
#: as a share of the last relative change of the outer iteration
NEWTON_STEPS = 10
PRESSURE_SHARE = 0.1
#: Newton steps of solves that did not converge after which the whole iteration is given up: of those that go on longer
#: few converge, on a grid that is too coarse for them, and they take minutes
WASTED_STEPS = 600
#: iterations over which the film must keep still, and the largest change of temperature there, for a solution whose hot
#: pressure spike wanders to and fro to count as converged
SETTLED_OVER, SETTLED_BELOW = 15, 0.03
#: rise [K] below which temperatures need no closer tolerance
LEAST_RISE = 10.0
#: largest temperature change of one outer iteration [K]
TEMPERATURE_LIMIT = 60.0


def _lost(changes: list[float], patience: int) -> bool:
    """Whether the iteration has got nowhere for that long while its changes are large."""
    before, lately = changes[:-patience], changes[-patience:]
    return len(before) > 2 and min(lately) > LOST_ABOVE and not min(lately) < 0.7 * min(before)


def _settled(films: list[float], changes: list[float], tolerance: float) -> bool:
    """Whether the film has kept still for so long that what moves in the temperatures cannot matter to it."""
    if len(films) <= SETTLED_OVER or not max(changes[-SETTLED_OVER:]) < SETTLED_BELOW:
        return False
    lately = films[-SETTLED_OVER:]
    return max(lately) - min(lately) <= tolerance * abs(films[-1])


class Traction(NamedTuple):
    """Shear on body 2: force along rolling [N], moment about the contact normal [N m]; heat of sliding [W]."""

    force: float
    moment: float
    heat: float


@dataclass
class Iteration:
    """Where a solve stands: pressure, temperature, sources, and the record of the way."""

    state: ReynoldsState
    history: NewtonHistory
    flow: film_flow.FilmFlow
    temperature: Array | None = None
    temperature_history: list[float] = field(default_factory=list)
    heat: energy.HeatBalance | None = None
    converged: bool = False
    cautious: bool = False
    reason: str = ""
    iterations: int = 0
    preconditioner: LinePreconditioner | None = field(default=None, repr=False)


class ContactProblem:
    """One operating point on one grid; entrainment is taken positive.

    choice: the grid, None = the one that the options and the expected film ask for
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
            # rolling the other way round is the mirror image
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
        """Book the time under a phase."""
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

        with self.timed("wall kernels"):
            return operator(c.u_1), operator(c.u_2)

    def physical(self, state: ReynoldsState) -> tuple[Array, Array]:
        """Pressure [Pa] and gap [m], the latter at least a tenth of the present film while iterating."""
        gap = np.maximum(state.gap, 0.1 * self.film_scale) * self.scales.h_unit
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

    def warm_columns(self) -> tuple[Array, Array]:
        """First column of every line where the energy equation is solved, and the one behind the last."""
        film, nodes = self.scales.warm_film, self.geometry.grid.x.size
        near = self.geometry.undeformed <= energy.INLET_GAPS * film + 1.0
        near[:, [0, -1]] = False
        some = near.any(axis=1)
        start = np.where(some, near.argmax(axis=1), 1)
        end = np.where(some, nodes - near[:, ::-1].argmax(axis=1), 1)
        return start.astype(np.int64), end.astype(np.int64)

    def warm_film(self, it: Iteration, walls: tuple[LineConvolution, LineConvolution]) -> Array:
        """Temperatures to begin with: every column sheared by itself, the walls warmed by what they then take up."""
        c, k_oil = self.conditions, self.oil.thermal_conductivity
        shape = (*it.state.p.shape, self.options.n_z + 1)
        temperature = np.full(shape, float(c.temperature))
        h = self.update_flow(it, temperature)
        p, _ = self.physical(it.state)
        slip = self.speeds.u_b - self.speeds.u_a
        wall_a = np.full(shape[:2], float(c.temperature))
        wall_b, q = wall_a.copy(), np.zeros(shape[:2])
        for _ in range(4):
            energy.sheared_films(self.table, p, h, k_oil, slip, wall_a, wall_b, temperature, q)
            wall_a += 0.6 * (c.temperature + walls[0](q) - wall_a)
            wall_b += 0.6 * (c.temperature + walls[1](q) - wall_b)
        energy.sheared_films(self.table, p, h, k_oil, slip, wall_a, wall_b, temperature, q)
        temperature[:, 0], temperature[:, -1] = c.temperature, c.temperature
        return temperature

    # an iterate that runs away is told by numbers that are not finite
    @np.errstate(over="ignore", invalid="ignore")
    def solve_coupled(
        self, it: Iteration, temperature: Array | None, tolerance: float, limit: int, cautious: bool = False
    ) -> Iteration:
        """Alternate Newton steps of the generalised Reynolds equation with rheology, energy equation and walls.

        limit: most iterations; cautious: slow and sure at first, with sources that only ever damp and temperatures that
        do not follow the pressure, until the changes are small. A bold iteration that gets nowhere ends early.
        """
        o, c, hertz, grid = self.options, self.conditions, self.scales.hertz, self.geometry.grid
        heat, conductivity = self.oil.specific_heat, self.oil.thermal_conductivity
        shape = it.state.p.shape
        q_a, q_b = np.zeros(shape), np.zeros(shape)
        response, t_p = np.zeros((*shape, 4)), np.zeros((*shape, o.n_z + 1))
        face = energy.FaceFlow.empty(*self.warm_columns(), shape[1], o.n_z)
        width, h_y, x = grid.width_x * hertz.b, grid.h_y * hertz.a, grid.x * hertz.b
        flux_unit = c.u_e * self.scales.h_unit * self.oil.density
        if o.thermal:
            walls = self.walls()
            if temperature is None:
                temperature = self.warm_film(it, walls)
            columns = np.arange(shape[1])
            outside = (columns < face.start[:, None]) | (columns >= face.end[:, None])
            temperature[..., 1:-1][outside] = c.temperature
        elif temperature is None:
            temperature = np.full((*shape, o.n_z + 1), float(c.temperature))
        h, new = self.update_flow(it, temperature), temperature
        relaxed: Array | None = None
        most, handed_over, bold_below = 1.0, False, BOLD_BELOW
        share, newtonian = (CAUTIOUS_STEP if cautious else OUTER_STEP), self.oil.rheology == "newtonian"
        it.cautious = cautious
        films: list[float] = []
        wasted = 0
        it.converged, it.reason = False, f"no convergence in {limit} thermal iterations"
        for _ in range(limit):
            # the pressure follows as closely as the temperature has come: no closer, for it costs the most
            aim = max(tolerance, PRESSURE_SHARE * min((it.temperature_history or [1.0])[-1], 0.1))
            p_at = np.maximum(it.state.p, 0.0)
            film = partial(self.general_film, temperature, t_p, p_at, it.flow)
            # a node that changes sides at the edge of cavitation takes many short steps
            steps = NEWTON_STEPS if it.history.converged or not it.temperature_history else 6 * NEWTON_STEPS
            with self.timed("reynolds"):
                it.state, newton, it.preconditioner = self.geometry.solve(
                    it.state, film, self.film_scale, aim, steps, preconditioner=it.preconditioner
                )
            # heat may leave a tenth of the film that the inlet forms
            estimate = self.scales.film_estimate
            films.append(self.central_film(it))
            self.film_scale = min(max(films[-1], 1e-2 * estimate), estimate)
            it.history.extend(newton)
            d_p = (np.maximum(it.state.p, 0.0) - p_at) * hertz.p_max
            temperature = temperature + np.clip(
                t_p * d_p[..., None], -film_flow.FOLLOW_LIMIT, film_flow.FOLLOW_LIMIT
            )
            change = 0.0
            if newtonian:
                h = self.update_flow(it, temperature)
            else:
                before = np.log(it.flow.thinning) - it.flow.ln_eta
                h = self.update_flow(it, temperature)
                step = np.log(it.flow.thinning) - it.flow.ln_eta - before
                step = THINNING_STEP * np.clip(step, -THINNING_LIMIT, THINNING_LIMIT)
                it.flow.thinning[:] = np.exp(it.flow.ln_eta + before + step)
                change = float(np.abs(step).max())
            if not newton.finite:
                it.reason = newton.reason
                break
            wasted += 0 if newton.converged else len(newton.change)
            if wasted > WASTED_STEPS:
                it.reason = f"pressure not found in {wasted} Newton steps"
                break
            if o.thermal:
                with self.timed("energy"):
                    film = partial(self.general_film, temperature, t_p, np.maximum(it.state.p, 0.0), it.flow)
                    flux_x, flux_y = self.geometry.fluxes(it.state, film, self.film_scale)
                    energy.face_flow(
                        width, h_y, grid.mirror, heat, flux_x * flux_unit, flux_y * flux_unit, it.flow, face
                    )
                    new = temperature.copy()
                    # back first: the inlet carries oil both ways
                    for forward in (False, True):
                        energy.sweep(
                            x, width, h_y, grid.mirror, h, conductivity, c.temperature, it.flow, face, temperature,
                            cautious, forward, new, t_p, q_a, q_b, response,
                        )  # fmt: skip
                with self.timed("walls"):
                    energy.update_walls(walls, new, q_a, q_b, response, c.temperature)
                if cautious:
                    t_p[:] = 0.0
                change_t = float(np.abs(new - temperature).max())
                rise = max(float(new.max()) - c.temperature, LEAST_RISE)
                change = max(change, change_t / rise)
                residual = new - temperature
                if relaxed is not None:
                    # Aitken (Kuttler & Wall 2008): the step that would have removed the last residual
                    overlap = float(np.sum(residual * relaxed)) / max(
                        float(np.sum(relaxed * relaxed)), 1e-300
                    )
                    if share > OUTER_STEP and change > 1.2 * it.temperature_history[-1]:
                        # some parts of the field do not bear long steps
                        most = OUTER_STEP
                    longest = min(1.5 * share, most)
                    if cautious or change > AITKEN_BELOW:
                        # far away only to damp what goes to and fro
                        longest = min(1.2 * share, CAUTIOUS_STEP if cautious else OUTER_STEP)
                    share = min(max(share / max(1.0 - overlap, 0.1), LEAST_STEP), longest)
                relaxed = residual
                if cautious and change < bold_below:
                    cautious, share, relaxed, handed_over = False, OUTER_STEP, None, True
                elif handed_over and not cautious and change > 5.0 * bold_below:
                    cautious, share, bold_below = True, CAUTIOUS_STEP, 0.2 * bold_below
                limited = min(share, TEMPERATURE_LIMIT / max(change_t, 1e-300))
                if stalled(it.temperature_history, STALL_AFTER):
                    # a pressure spike that wanders wants shorter steps
                    share = 0.5 * share
                temperature = temperature + limited * residual
            it.temperature_history.append(change)
            it.iterations += 1
            if not np.isfinite(change):
                it.reason = "temperature not finite"
                break
            patience = LOST_AFTER if not cautious and not handed_over else 12 * LOST_AFTER
            if _lost(it.temperature_history, patience):
                it.reason = f"no progress in {patience} thermal iterations"
                break
            if newton.converged and newton.change[-1] <= 10.0 * tolerance and change <= 10.0 * tolerance:
                it.converged, it.reason = True, "pressure and temperature changes below tolerance"
                break
            if newton.converged and _settled(films, it.temperature_history, 10.0 * tolerance):
                it.converged, it.reason = (
                    True,
                    f"film within tolerance, temperature moves by {change:.0e} of the rise",
                )
                break
        if o.thermal:
            it.temperature = temperature
            it.heat = energy.heat_balance(
                x, width, h_y, grid.mirror, it.flow, face, new, c.temperature, q_a, q_b
            )
        return it
