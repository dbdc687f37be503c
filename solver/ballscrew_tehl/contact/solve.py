"""One thermal EHL contact: conditions in, film, pressure, temperature and traction out."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace

import numpy as np

from ..hertz import HertzContact
from ..parameters import LubricantParameters, SolidParameters
from . import energy
from .conditions import DEFAULT_OPTIONS, ContactConditions, SolverOptions, inlet_length, scales_of
from .grid import Array
from .problem import ContactProblem, Iteration
from .reynolds import GridChoice, NewtonHistory, ReynoldsState

__all__ = ["DEFAULT_OPTIONS", "ContactConditions", "ContactSolution", "SolverOptions", "solve_contact"]

#: cells that the length of the inlet must hold at the edge of the Hertz line for a solution to count as resolved
RESOLVED_CELLS = 2.8


@dataclass(frozen=True)
class ContactSolution:
    """Result of a solve; fields are (n_y, n_x) on the half plane Y >= 0, X along the entrainment.

    temperature (n_y, n_x, n_z+1) [K]; h_c, h_m central and minimum film [m]; p_max largest pressure [Pa];
    temperature_rise largest rise in the film [K]; traction_force [N] on body 2 (positive where it drags body 2
    towards u_1); branch "resolved" or "asymptotic"; M, L Moes numbers; reason why the iteration stopped.
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


def solve_contact(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions = DEFAULT_OPTIONS,
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
    if anchor is None or not (
        anchor.converged and lower.converged and anchor.branch == lower.branch == "resolved"
    ):
        return replace(
            solution, converged=False, reason="no resolved load to anchor the asymptotic branch to"
        )

    def ln_ratio(s: ContactSolution) -> float:
        scales = scales_of(s.conditions, oil)
        return math.log(s.h_c / (scales.film_estimate * scales.h_unit))

    slope = (ln_ratio(anchor) - ln_ratio(lower)) / math.log(2.0)
    scales = scales_of(c, oil)
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
    problem = ContactProblem(conditions, oil, solid, options)
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
            temperature = (
                np.maximum(start.temperature - start.conditions.temperature, 0.0) + conditions.temperature
            )
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


def _result(problem: ContactProblem, it: Iteration, seconds: float) -> ContactSolution:
    grid, scales = problem.geometry.grid, problem.scales
    gap = it.state.gap
    # central film on the axis: quadratic through the three nodes around X = 0
    k = int(np.argmin(np.abs(grid.x)))
    h_c = float(np.polyval(np.polyfit(grid.x[k - 1 : k + 2], gap[0, k - 1 : k + 2], 2), 0.0))
    # the inlet forms the isothermal film; what heat takes off it inside the contact does not narrow the inlet
    inlet_film = h_c if it.temperature is None else max(h_c, scales.film_estimate)
    resolved = problem.cells_in_inlet(inlet_film) >= RESOLVED_CELLS
    rise = 0.0 if it.temperature is None else float(it.temperature.max()) - problem.conditions.temperature
    return ContactSolution(
        conditions=problem.given,
        hertz=scales.hertz,
        h_c=h_c * scales.h_unit,
        h_m=_minimum_film(grid.x, grid.y, gap) * scales.h_unit,
        p_max=float(it.state.p.max()) * scales.hertz.p_max,
        temperature_rise=rise,
        traction_force=math.copysign(it.traction, it.traction * problem.given.u_e),
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
