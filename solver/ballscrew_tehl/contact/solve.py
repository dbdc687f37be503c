"""One thermal EHL contact: conditions in, film, pressure, temperature and traction out."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from .. import film as film_formulas
from ..hertz import HertzContact, ellipse
from ..parameters import LubricantParameters, SolidParameters
from . import energy, film_flow
from .anderson import AndersonMixing
from .elastic import LineConvolution
from .grid import Array
from .reynolds import GridChoice, NewtonHistory, ReynoldsState, contact_geometry
from .walls import wall_operator

#: cells that the length of the inlet must hold at the edge of the Hertz line for a solution to count as resolved
RESOLVED_CELLS = 2.8
#: share of the temperature change of one outer iteration that is taken
TEMPERATURE_STEP = 0.7
#: iterations without progress after which that share is halved
STALL_AFTER = 40
#: below this change, relative to the rise, the iteration is accelerated
MIXING_FROM = 0.1
#: largest temperature change of one outer iteration [K]
TEMPERATURE_LIMIT = 30.0


@dataclass(frozen=True)
class ContactConditions:
    """Operating point of one contact.

    load [N], R_x along and R_y across rolling [m] (R_x <= R_y), u_1, u_2 surface speeds [m/s] of the two bodies,
    temperature of the oil that enters and of the bodies [K], E_prime = 2/sum((1-nu^2)/E) [Pa].
    """

    load: float
    R_x: float
    R_y: float
    u_1: float
    u_2: float
    temperature: float
    E_prime: float

    def __post_init__(self) -> None:
        for name, unit in (("load", "N"), ("R_x", "m"), ("R_y", "m"), ("E_prime", "Pa"), ("temperature", "K")):
            value = getattr(self, name)
            if not (value > 0.0 and math.isfinite(value)):
                raise ValueError(f"{name} = {value} {unit}; needs finite, > 0")
        if not self.R_x <= self.R_y:
            raise ValueError(f"R_x = {self.R_x} m; needs R_x <= R_y = {self.R_y} m: x is the rolling direction")
        if not (math.isfinite(self.u_1) and math.isfinite(self.u_2) and self.u_1 + self.u_2 != 0.0):
            raise ValueError(f"u_1, u_2 = {self.u_1}, {self.u_2} m/s; needs finite with u_1 + u_2 not 0: no oil is drawn in")

    @property
    def u_e(self) -> float:
        """Entrainment speed [m/s]."""
        return 0.5 * (self.u_1 + self.u_2)


@dataclass(frozen=True)
class SolverOptions:
    """Accuracy and cost of a solve.

    thermal: couple the energy equation; n_x, n_y, n_z: nodes along, across (half; None = 17 for a long
    ellipse to 33 for a circle) and layers through the film;
    tolerance of pressure [p_max] and of temperature (relative to the largest rise). x_in, x_out [b], y_max [a]:
    domain, None = wide enough not to starve.
    """

    thermal: bool = True
    n_x: int = 129
    n_y: int | None = None
    n_z: int = 10
    tolerance: float = 1e-5
    x_in: float | None = None
    x_out: float | None = None
    y_max: float | None = None
    max_newton: int = 300
    max_thermal: int = 400


@dataclass(frozen=True)
class ContactSolution:
    """Result of a solve; fields are (n_y, n_x) on the half plane Y >= 0, temperature (n_y, n_x, n_z+1).

    h_c, h_m central and minimum film [m]; p_max largest pressure [Pa]; temperature_rise largest rise in the film [K];
    traction_force [N] on body 2 along u_1 - u_2 (its sign: positive drags body 2 towards u_1); branch "resolved" or
    "asymptotic"; M, L Moes numbers; reason why the iteration stopped.
    """

    conditions: ContactConditions
    hertz: HertzContact
    h_c: float
    h_m: float
    p_max: float
    temperature_rise: float
    traction_force: float
    converged: bool
    reason: str
    iterations: int
    deflections: int
    seconds: float
    M: float
    L: float
    branch: str
    history: NewtonHistory
    temperature_history: list[float]
    heat_balance: energy.HeatBalance | None
    x: Array
    y: Array
    pressure: Array
    film: Array
    temperature: Array | None
    state: ReynoldsState = field(repr=False)
    choice: GridChoice = field(repr=False)


@dataclass(frozen=True)
class _Scales:
    """Dimensionless numbers of one operating point."""

    hertz: HertzContact
    h_unit: float  # b^2/R_x [m]
    reynolds: float  # 12 eta0 u_e R_x^2/(b^3 p_max), with eta0 = 1 Pa s
    M: float
    L: float
    film_estimate: float  # [b^2/R_x]
    inlet: float  # [b]


def inlet_length(film: float) -> float:
    """Distance [b] over which the Hertz gap (2 sqrt(2)/3) s^(3/2) outside a line opens by `film` [b^2/R_x]."""
    return (1.06 * film) ** (2.0 / 3.0)


def _scales(c: ContactConditions, oil: LubricantParameters) -> _Scales:
    hertz = ellipse(c.load, c.R_x, c.R_y, c.E_prime)
    a, b, p_max = float(hertz.a), float(hertz.b), float(hertz.p_max)
    hertz = HertzContact(a, b, p_max, float(hertz.delta))
    u_e = abs(c.u_e)
    groups = film_formulas.moes_groups(oil, c.load, u_e, c.R_x, c.E_prime, c.temperature)
    h_c = float(film_formulas.central_film_estimate(oil, groups, c.R_x, c.R_y, p_max, c.temperature))
    h_unit = b * b / c.R_x
    return _Scales(
        hertz, h_unit, 12.0 * u_e * c.R_x**2 / (b**3 * p_max), groups.M, groups.L, h_c / h_unit, inlet_length(h_c / h_unit)
    )


def choose_grid(options: SolverOptions, film: float, curvature_y: float, kappa: float) -> GridChoice:
    """Domain and refinement for an expected film [b^2/R_x]; rounded, so that neighbouring points share a grid.

    The inlet begins where the gap is about thirty films, the sides end where it is about ten.
    """
    wedge = math.sqrt(2.0 * film)
    x_in = -max(2.5, _round_up(5.5 * wedge))
    x_out = max(1.5, _round_up(1.5 * wedge))
    y_max = max(1.5, _round_up(math.sqrt(1.0 + 15.0 * film / curvature_y)))
    inlet = 2.0 ** (round(4.0 * math.log2(inlet_length(film))) / 4.0)
    n_y = options.n_y if options.n_y is not None else 17 + 2 * round(8.0 * kappa)
    if y_max > 2.5 and options.n_y is None:
        n_y += 8
    return GridChoice(options.x_in or x_in, options.x_out or x_out, options.y_max or y_max, options.n_x, n_y, inlet)


def _round_up(value: float) -> float:
    """Next of a geometric row with eight steps per doubling."""
    return float(2.0 ** (math.ceil(8.0 * math.log2(value)) / 8.0))


def _stalled(changes: list[float]) -> bool:
    """Whether the last STALL_AFTER changes are no smaller than the ones before."""
    if len(changes) < 2 * STALL_AFTER:
        return False
    return not min(changes[-STALL_AFTER:]) < 0.5 * min(changes[-2 * STALL_AFTER : -STALL_AFTER])


@dataclass
class _Iteration:
    """Where a solve stands: pressure, temperature, sources, and the record of the way."""

    state: ReynoldsState
    history: NewtonHistory
    temperature: Array | None = None
    temperature_history: list[float] = field(default_factory=list)
    flow: energy.FilmFlow | None = None
    heat: energy.HeatBalance | None = None
    traction: float = 0.0
    converged: bool = False
    reason: str = ""
    iterations: int = 0


class _ContactProblem:
    """One operating point on one grid; entrainment is taken positive."""

    def __init__(
        self, conditions: ContactConditions, oil: LubricantParameters, solid: SolidParameters, options: SolverOptions
    ) -> None:
        if conditions.u_e < 0.0:
            # rolling the other way round is the mirror image
            conditions = replace(conditions, u_1=-conditions.u_1, u_2=-conditions.u_2)
        self.conditions, self.oil, self.solid, self.options = conditions, oil, solid, options
        self.scales = _scales(conditions, oil)
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
            self.table, self.scales.hertz.p_max, p, self.conditions.temperature, 1.0 / self.scales.reynolds, *out
        )
        return out  # type: ignore[return-value]

    def thermal_film(self, temperature: Array, p: Array) -> tuple[Array, Array, Array, Array]:
        """Film coefficients of the generalised Reynolds equation at given temperatures."""
        c = self.conditions
        out = tuple(np.empty_like(p) for _ in range(4))
        film_flow.film_coefficients(
            self.table, self.scales.hertz.p_max, p, temperature, c.u_1, c.u_2, c.u_e, 1.0 / self.scales.reynolds, *out
        )
        return out  # type: ignore[return-value]

    def solve_isothermal(self, state: ReynoldsState, tolerance: float, max_steps: int) -> _Iteration:
        """Newton iteration at the inlet temperature."""
        state, history = self.geometry.solve(
            state, self.isothermal_film, self.scales.film_estimate, tolerance, max_steps
        )
        return _Iteration(
            state, history, converged=history.converged, reason=history.reason, iterations=len(history.change)
        )

    def walls(self) -> tuple[LineConvolution, LineConvolution]:
        """Heat flux to surface temperature, of body 1 (z = 0) and body 2 (z = h)."""
        c, solid = self.conditions, self.solid
        chi = solid.thermal_conductivity / (solid.density * solid.specific_heat)

        @lru_cache(maxsize=2)
        def operator(speed: float) -> LineConvolution:
            return wall_operator(
                self.geometry.grid, self.geometry.kappa, self.scales.hertz.b, speed, solid.thermal_conductivity, chi
            )

        return operator(c.u_1), operator(c.u_2)

    def physical(self, state: ReynoldsState) -> tuple[Array, Array]:
        """Pressure [Pa] and gap [m], the latter at least a tenth of the expected film while iterating."""
        gap = np.maximum(state.gap, 0.1 * self.scales.film_estimate) * self.scales.h_unit
        return np.maximum(state.p, 0.0) * self.scales.hertz.p_max, gap

    def update_flow(self, it: _Iteration, temperature: Array) -> tuple[Array, Array]:
        """Velocities, heat sources and traction at the present pressure."""
        c, hertz, grid = self.conditions, self.scales.hertz, self.geometry.grid
        p, h = self.physical(it.state)
        if it.flow is None:
            it.flow = energy.FilmFlow.empty(p.shape[0], p.shape[1], temperature.shape[2] - 1)
        energy.film_flow(self.table, grid.x * hertz.b, grid.y * hertz.a, p, h, temperature, c.u_1, c.u_2, it.flow)
        it.traction = -float(np.sum(grid.weights * it.flow.traction)) * hertz.a * hertz.b
        return p, h

    def solve_thermal(self, it: _Iteration, temperature: Array) -> _Iteration:
        """Alternate one Newton step of the generalised Reynolds equation with the energy equation and the walls."""
        c, o, hertz, grid = self.conditions, self.options, self.scales.hertz, self.geometry.grid
        heat, conductivity = self.oil.specific_heat, self.oil.thermal_conductivity
        walls = self.walls()
        shape = it.state.p.shape
        q_a, q_b = np.zeros(shape), np.zeros(shape)
        response = np.zeros((*shape, 4))
        width, h_y, x = grid.width_x * hertz.b, grid.h_y * hertz.a, grid.x * hertz.b
        mixing, share = AndersonMixing(), TEMPERATURE_STEP
        it.converged, it.reason = False, f"no convergence in {o.max_thermal} thermal iterations"
        for _ in range(o.max_thermal):
            frozen = temperature
            it.state, newton = self.geometry.solve(
                it.state, lambda p, t=frozen: self.thermal_film(t, p), self.scales.film_estimate, o.tolerance, max_steps=1
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
                share *= 0.5
                mixing.forget()
            if change > MIXING_FROM * rise:
                temperature = temperature + min(share, TEMPERATURE_LIMIT / change) * (new - temperature)
            else:
                temperature = mixing.next(temperature, new, share)
            it.temperature_history.append(change / rise)
            it.iterations += 1
            if not np.isfinite(change):
                it.reason = "temperature not finite"
                break
            if newton.converged and change <= 10.0 * o.tolerance * rise:
                it.converged, it.reason = True, "pressure and temperature changes below tolerance"
                break
        self.update_flow(it, temperature)
        it.temperature = temperature
        it.heat = energy.heat_balance(
            grid, hertz.a, hertz.b, heat, it.flow, temperature, c.temperature, q_a, q_b
        )
        return it


def solve_contact(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions = SolverOptions(),
    start: ContactSolution | None = None,
) -> ContactSolution:
    """Solve one contact.

    Parameters   conditions: operating point;  oil, solid: materials (both bodies of `solid`);  start: a neighbouring
                 solution on the same grid to start from
    Returns      ContactSolution; ask `converged` and `reason` before using it
    Raises       ValueError: conditions out of range
    Validity     smooth surfaces, fully flooded, steady; Newtonian. Resolved while the inlet length holds about three
                 cells; the nodes along rolling are doubled first, beyond that the film comes from the asymptotic branch
    Source       Zhao et al. 2023, Eqs. 5-13 with the deflection that Eq. 6 omits, the generalised Reynolds equation
                 (Yang & Wen 1990), moving-point-source walls (Carslaw & Jaeger 1959) and the errata named in the
                 modules of this package
    """
    begun = time.perf_counter()
    solution = _solve_on_grid(conditions, oil, solid, options, start)
    if solution.branch != "resolved":
        finer = replace(options, n_x=2 * options.n_x - 1)
        solution = _solve_on_grid(conditions, oil, solid, finer, None)
        if solution.branch != "resolved" and solution.converged:
            solution = _anchored(solution, oil, solid, finer)
    return replace(solution, seconds=time.perf_counter() - begun)


def _anchored(
    solution: ContactSolution, oil: LubricantParameters, solid: SolidParameters, options: SolverOptions
) -> ContactSolution:
    """The asymptotic branch: films continued from the highest load that the grid resolves.

    The ratio of the isothermal film to its closed formula is taken at that load and at half of it and continued
    straight over the logarithm of load. What heating takes off the film, pressure and temperature are those of the
    solution itself: they do not hang on the narrow inlet.
    """
    c = solution.conditions
    isothermal = replace(options, thermal=False)

    def at(load: float) -> ContactSolution:
        return _solve_on_grid(replace(c, load=load), oil, solid, isothermal, None)

    load, anchor = c.load, None
    for _ in range(20):
        load *= 0.5
        anchor = at(load)
        if anchor.branch == "resolved":
            break
    lower = at(0.5 * load)
    if anchor is None or not (anchor.converged and lower.converged and anchor.branch == lower.branch == "resolved"):
        return replace(solution, converged=False, reason="no resolved load to anchor the asymptotic branch to")

    def ln_ratio(s: ContactSolution) -> float:
        scales = _scales(s.conditions, oil)
        return math.log(s.h_c / (scales.film_estimate * scales.h_unit))

    slope = (ln_ratio(anchor) - ln_ratio(lower)) / math.log(2.0)
    scales = _scales(c, oil)
    h_c = scales.film_estimate * scales.h_unit * math.exp(ln_ratio(anchor) + slope * math.log(c.load / load))
    if options.thermal:
        h_c *= solution.h_c / at(c.load).h_c
    return replace(solution, h_c=h_c, h_m=h_c * anchor.h_m / anchor.h_c)


def _solve_on_grid(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions,
    start: ContactSolution | None,
) -> ContactSolution:
    begun = time.perf_counter()
    problem = _ContactProblem(conditions, oil, solid, options)
    geometry, scales = problem.geometry, problem.scales
    warm = start is not None and start.choice == problem.choice and start.converged
    state = geometry.start(scales.film_estimate)
    temperature = None
    if warm and start is not None:
        # pressures carry over in Hertz units; the gap keeps its share of the expected film
        ratio = start.h_c / start.hertz.b**2 * start.conditions.R_x / scales.film_estimate
        shift = scales.film_estimate * (1.0 - ratio) if not 0.5 < ratio < 2.0 else 0.0
        p, h_0 = start.state.p, start.state.h_0 + shift
        state = ReynoldsState(p, h_0, geometry.gap(p, h_0))
        if start.temperature is not None:
            temperature = np.maximum(start.temperature - start.conditions.temperature, 0.0) + conditions.temperature
    # a thermal solve only needs to come near: its own iteration ends the work
    rough = (1e-2, 30) if options.thermal else (options.tolerance, options.max_newton)
    it = problem.solve_isothermal(state, *rough)
    if not it.converged and warm:
        it = problem.solve_isothermal(geometry.start(scales.film_estimate), *rough)
    shape = (*it.state.p.shape, options.n_z + 1)
    if temperature is None or temperature.shape != shape:
        temperature = np.full(shape, float(conditions.temperature))
    if options.thermal:
        it = problem.solve_thermal(it, temperature)
    else:
        problem.update_flow(it, np.full(shape, float(conditions.temperature)))
    return _result(problem, it, time.perf_counter() - begun)


def _result(problem: _ContactProblem, it: _Iteration, seconds: float) -> ContactSolution:
    grid, scales = problem.geometry.grid, problem.scales
    gap = it.state.gap
    # central film on the axis: quadratic through the three nodes around X = 0
    k = int(np.argmin(np.abs(grid.x)))
    h_c = float(np.polyval(np.polyfit(grid.x[k - 1 : k + 2], gap[0, k - 1 : k + 2], 2), 0.0))
    # the inlet forms the isothermal film; what heat takes off it inside the contact does not narrow the inlet
    inlet_film = h_c if it.temperature is None else max(h_c, scales.film_estimate)
    resolved = problem.cells_in_inlet(inlet_film) >= RESOLVED_CELLS
    rise = 0.0 if it.temperature is None else float(it.temperature.max()) - problem.conditions.temperature
    sign = 1.0
    return ContactSolution(
        conditions=problem.conditions,
        hertz=scales.hertz,
        h_c=h_c * scales.h_unit,
        h_m=_minimum_film(grid.x, grid.y, gap) * scales.h_unit,
        p_max=float(it.state.p.max()) * scales.hertz.p_max,
        temperature_rise=rise,
        traction_force=sign * it.traction,
        converged=it.converged,
        reason=it.reason,
        iterations=it.iterations,
        deflections=it.history.deflections,
        seconds=seconds,
        M=scales.M,
        L=scales.L,
        branch="resolved" if resolved else "asymptotic",
        history=it.history,
        temperature_history=it.temperature_history,
        heat_balance=it.heat,
        x=grid.x,
        y=grid.y,
        pressure=np.maximum(it.state.p, 0.0) * scales.hertz.p_max,
        film=gap * scales.h_unit,
        temperature=it.temperature,
        state=it.state,
        choice=problem.choice,
    )


def _minimum_film(x: Array, y: Array, gap: Array) -> float:
    """Smallest gap over the lines whose contact edge holds a cell per inlet length [b^2/R_x].

    On a long ellipse under high load the outermost lines end on cells longer than their own inlet and carry no
    meaningful film; the minimum of such an ellipse lies at the outlet of the central lines anyway.
    """
    h_c = float(gap[0, np.argmin(np.abs(x))])
    spacing = np.interp(np.sqrt(np.clip(1.0 - y**2, 0.0, None)), x[:-1], np.diff(x))
    half_width = np.sqrt(np.clip(1.0 - y**2, 1e-4, None))
    usable = (spacing <= inlet_length(max(h_c, 0.0)) / half_width ** (1.0 / 3.0)) | (y > 1.0)
    usable[0] = True
    lines = usable & np.logical_and.accumulate(usable | (y > 1.0))
    return float(gap[lines].min())
