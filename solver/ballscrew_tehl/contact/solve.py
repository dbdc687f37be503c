"""One thermal EHL contact: conditions in, film, pressure, temperature and traction out."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..parameters.file import LubricantParameters, SolidParameters
from ..physics.hertz import HertzContact
from .conditions import (
    DEFAULT_OPTIONS,
    ContactConditions,
    SolverOptions,
    cells_in_inlet,
    expected_grid,
    inlet_length,
    scales_of,
)
from .coupled import CONVERGED_AT, solve_coupled
from .film import energy
from .film.reynolds import LEAST_PRESSURE, TARGET_LOAD, GridChoice, NewtonHistory, ReynoldsState
from .half_space.grid import TINY, Array, Grid
from .integrals import ContactIntegrals, contact_integrals
from .problem import ContactProblem, Iteration

__all__ = ["DEFAULT_OPTIONS", "ContactConditions", "ContactSolution", "SolverOptions", "solve_contact"]

#: cells that the length of the inlet must hold at the edge of the Hertz line for a solution to count as resolved
RESOLVED_CELLS = 2.8
#: share of these cells by the expected film below which the grid is refined without a first solve on it
WORTH_TRYING = 0.8
#: tolerance on the grid of half the nodes, where a cold solve begins: bounds the error of the extrapolation
COARSE_TOLERANCE = 3e-5
#: share of the extrapolation from half the nodes that counts as the error of the extrapolated film: that of the next
#: order. Twice the nodes, lines, layers and extent change h_c by 2e-4 in the median, 4e-3 at most; that is 0.24 at most
#: of extrapolation, rest and tolerance together (51 random resolved contacts of both kinematics)
REMAINDER = 0.25
#: share of the change by half the layers and half the extent of the energy equation that counts as their error: a third
#: for second order (layers), all of it for first order (extent)
REST_SHARE = 0.5
#: fewest layers of a coarse solution
LEAST_LAYERS = 4
#: tolerance and most Newton steps of the isothermal solve that a coupled solve begins with
START_TOLERANCE, START_STEPS = 1e-2, 30
#: iterations after which a coupled solve begins again with damping
UNDAMPED_ITERATIONS = 60
#: shares of the roughness through which a rough contact is continued that does not converge by itself
ROUGHNESS_SHARES = (0.0, 0.25, 0.5, 0.7, 0.85, 1.0)
#: continuation in speed: share of the speed by which the first start is sought lower, and how often; first, largest and
#: least step of ln(speed); growth of a step after a success, solves at most; a failure halves the step
LOWER_SPEED, MOST_LOWER = 0.5, 3
FIRST_SPEED_STEP, LARGEST_SPEED_STEP, LEAST_SPEED_STEP = 0.1, 0.4, 0.01
SPEED_STEP_GROWTH, MOST_SPEED_STEPS = 1.5, 40
#: most iterations of a coupled solve from neighbours: 4 to 8 in the median on lines of 21 contacts
NEAR_ITERATIONS = 25
#: pressure [p_max] above which temperatures are extrapolated through the neighbours; below, they are the nearest's
LOADED = 1e-2
#: most neighbours of a start: a quadratic
MOST_NEIGHBOURS = 3
#: distance of the neighbours and of the contact from their line, as a share of its length: beyond, they are not on one
OFF_LINE = 0.1
#: least distance of two neighbours, in the logarithm
EQUAL = 1e-9
#: Moes load above which an isothermal film that no grid solves is taken from the asymptotic branch
ASYMPTOTIC_ABOVE = 3e4
#: halvings of the load, from the first that the grid is expected to resolve, in search of two resolved ones
MOST_HALVINGS = 8
#: share of the load below which no resolved load is expected: ends that search
LEAST_LOAD_SHARE = 1e-6
#: share of the film that an extrapolation may add: beyond, the coarse grid does not resolve the inlet
EXTRAPOLATED_BELOW = 0.06
#: pressure of nodes that were cavitated on another grid, as a share of the deepest that is allowed: they begin
#: cavitated, for the edge of cavitation moves by one node per Newton step
CAVITATED = 1e-3


@dataclass(frozen=True)
class ContactSolution:
    """Result of a solve; fields are (n_y, n_x) on the half plane Y >= 0, X along the entrainment.

    temperature (n_y, n_x, n_z+1) [K]; h_c, h_m central and minimum film [m], extrapolated from the grid and the one of
    half the nodes by the two shares `extrapolation`; error_estimate: relative, of h_c, from grid, layers, extent of the
    energy equation and tolerance (NaN without a coarse grid; a warm start keeps the shares of its start, or those
    interpolated between its neighbours), error_parts: those of the grid and of layers and extent; film (n_y, n_x): as
    on the grid, between the mean planes of rough surfaces; pressure (n_y, n_x) [Pa]: that deforms the
    bodies and carries the load, p_max the largest; asperity_pressure (n_y, n_x) [Pa]: the part of it that asperities
    carry, the film carries the rest; asperity_load_share: of the load, 0 to 1, on the asymptotic branch that of the
    load that converged; temperature_rise largest rise in the film [K]; traction_force [N] on body 2 (positive where it
    drags body 2 towards u_1), spin_moment [N m] about the normal from body 1 to body 2,
    sliding_heat [W] of both; phases: seconds by part of the work; branch "resolved" or "asymptotic";
    integrals: rolling loss, forces on the walls, heat by part and means over the contact, not extrapolated; M, L Moes
    numbers; reason why the iteration stopped.
    """

    conditions: ContactConditions
    hertz: HertzContact
    h_c: float
    h_m: float
    p_max: float
    temperature_rise: float
    traction_force: float
    spin_moment: float
    sliding_heat: float
    converged: bool
    reason: str
    iterations: int
    deflections: int
    seconds: float
    phases: dict[str, float]
    M: float
    L: float
    branch: str
    extrapolation: tuple[float, float]
    error_estimate: float
    error_parts: tuple[float, float]
    history: NewtonHistory
    temperature_history: list[float]
    heat_balance: energy.HeatBalance | None
    integrals: ContactIntegrals
    x: Array
    y: Array
    pressure: Array
    asperity_pressure: Array
    asperity_load_share: float
    film: Array
    temperature: Array | None
    state: ReynoldsState = field(repr=False)
    choice: GridChoice = field(repr=False)

    def share_below(self, film: float) -> float:
        """Share of the Hertz ellipse whose film is below one [m]."""
        inside = (self.x[None, :] ** 2 + self.y[:, None] ** 2 <= 1.0) * self.grid.weights
        return float(np.sum(inside * (self.film < film)) / np.sum(inside))

    @property
    def grid(self) -> Grid:
        """The grid of the fields."""
        return Grid(self.x, self.y, self.choice.mirror, self.choice.open_side)

    @property
    def usable(self) -> bool:
        """Whether others may be extrapolated from it."""
        return self.converged and self.branch == "resolved"

    def moved_to(self, other: ContactSolution, **extrapolated: Any) -> ContactSolution:
        """This solution under the conditions of another one, with extrapolated values: the asymptotic branch."""
        return replace(
            self,
            conditions=other.conditions,
            hertz=other.hertz,
            M=other.M,
            L=other.L,
            branch="asymptotic",
            **extrapolated,
        )


def solve_contact(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions = DEFAULT_OPTIONS,
    start: ContactSolution | Sequence[ContactSolution] | None = None,
) -> ContactSolution:
    """Solve one contact.

    Parameters   conditions: operating point;  oil, solid: materials (both bodies of `solid`), with the rheology that
                 the oil names;  start: a neighbouring solution to start from, on any grid, or up to three on a line
                 through `conditions` in the logarithms of load, entrainment speed and temperature: pressure, film over
                 expected film, temperature rise and the shares of the error are extrapolated through them (Lagrange).
                 Neighbours that have not converged are left out. A contact that does not converge from its start is
                 solved from the dry contact, and where that fails, too, from lower speeds
    Returns      ContactSolution; check `converged` and `reason` before using it
    Raises       ValueError: conditions out of range; more than three neighbours, two at one point, or off the line
    Validity     steady; flooded, or with a meniscus at options.x_in. Resolved while the inlet length holds about three
                 cells; the nodes along rolling are doubled first, beyond that the film comes from the asymptotic
                 branch. Oil in a gap of more than options.warm_films films has the inlet temperature.
                 temperature_rise of pure rolling is that of the pressure spike and grows with the nodes: use
                 integrals.temperature_rise_mean, or _smooth.
                 Rough surfaces: by their asperity pressure p_a alone (Greenwood & Tripp 1970); the flow is that between
                 smooth surfaces as far apart as the mean planes. Without flow factors (Patir & Cheng 1978), the lay
                 has no effect: below a film ratio of about 3, transverse ridges make a thicker film, longitudinal
                 ones a thinner one. Friction and heat of the asperities are left out: traction, temperatures and
                 integrals are those of the film. With sigma beta eta = 0.2 and sigma/beta = 0.01, above the usual
                 intervals, thermal contacts converge up to an asperity share of 0.1 to 0.2
    Source       Zhao et al. 2023, Eqs. 5-13 with the deflection that Eq. 6 omits, the generalised Reynolds equation
                 (Yang & Wen 1990), moving-point-source walls (Carslaw & Jaeger 1959), film pressure p - p_a at every
                 node (Johnson, Greenwood & Poon 1972) and the errata named in the modules of this package
    """
    announce_compilation()
    begun = time.perf_counter()
    solution = _solved(conditions, oil, solid, options, _neighbours(conditions, start))
    if not solution.converged and conditions.roughness is not None and conditions.roughness.sigma > 0.0:
        solution = _continued_in_roughness(conditions, oil, solid, options) or solution
    return replace(solution, seconds=time.perf_counter() - begun)


def _continued_in_roughness(
    conditions: ContactConditions, oil: LubricantParameters, solid: SolidParameters, options: SolverOptions
) -> ContactSolution | None:
    """The solution by rising roughness from the smooth contact; None: one of them did not converge."""
    solution: ContactSolution | None = None
    for share in ROUGHNESS_SHARES:
        rough = conditions.roughness and replace(
            conditions.roughness, sigma=share * conditions.roughness.sigma
        )
        solution = _solved(
            replace(conditions, roughness=rough), oil, solid, options, _neighbours(conditions, solution)
        )
        if not solution.usable:
            return None
    return solution


def _solved(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions,
    starts: Sequence[tuple[float, ContactSolution]],
) -> ContactSolution:
    """On the grid of the options, on one of twice the nodes, or by the asymptotic branch."""
    solution = None
    if _expected_resolved(conditions, oil, options, WORTH_TRYING):
        solution = _solve_on_grid(conditions, oil, solid, options, starts)
    if solution is None or solution.branch != "resolved" or not (solution.converged or options.thermal):
        finer = replace(options, n_x=2 * options.n_x - 1)
        solution = _solve_on_grid(conditions, oil, solid, finer)
        if solution.converged:
            beyond = solution.branch != "resolved"
        else:
            beyond = not options.thermal and solution.M > ASYMPTOTIC_ABOVE
        if beyond:
            solution = _anchored(solution, oil, solid, finer)
    return solution


@lru_cache(maxsize=1)
def announce_compilation() -> bool:
    """Warn once per process if the kernels are not compiled on this machine yet; returns whether it did."""
    cache = energy.sweep.stats.cache_path
    compiled = cache is not None and any(Path(cache).glob("energy.sweep-*.nbi"))
    if not compiled:
        logging.getLogger(__name__).warning(
            "compiling the contact solver: once per machine, about 40 s on a quiet one"
        )
    return not compiled


def _anchored(
    solution: ContactSolution, oil: LubricantParameters, solid: SolidParameters, options: SolverOptions
) -> ContactSolution:
    """The asymptotic branch: films extrapolated from the highest load that the grid resolves.

    The ratio of the isothermal film to its closed formula is taken at that load and at half of it and extrapolated
    linearly over the logarithm of load. The thermal reduction, pressure and temperature are those of the solution
    itself: they do not depend on the narrow inlet. An isothermal solution that did not converge gets the fields of the
    highest load that the grid resolves.
    """
    c, scales = solution.conditions, scales_of(solution.conditions, oil)
    isothermal = replace(options, thermal=False)

    def at(load: float) -> ContactSolution:
        return _solve_on_grid(replace(c, load=load), oil, solid, isothermal)

    anchors = _resolved_pair(c, oil, isothermal, at)
    if anchors is None:
        reason = "no resolved load to anchor the asymptotic branch to"
        return replace(solution, converged=False, reason=reason)
    anchor, lower = anchors

    def ln_ratio(s: ContactSolution) -> float:
        own = scales_of(s.conditions, oil)
        return math.log(s.h_c / (own.film_estimate * own.h_unit))

    slope = (ln_ratio(anchor) - ln_ratio(lower)) / math.log(2.0)
    ln_share = ln_ratio(anchor) + slope * math.log(c.load / anchor.conditions.load)
    h_c = scales.film_estimate * scales.h_unit * math.exp(ln_share)
    if options.thermal:
        h_c *= solution.h_c / at(c.load).h_c
    h_m = h_c * anchor.h_m / anchor.h_c
    if solution.converged:
        return replace(solution, h_c=h_c, h_m=h_m)
    return anchor.moved_to(
        solution,
        p_max=float(solution.hertz.p_max),
        h_c=h_c,
        h_m=h_m,
        reason=f"film continued from {anchor.conditions.load:.6g} N",
    )


def _resolved_pair(
    c: ContactConditions,
    oil: LubricantParameters,
    options: SolverOptions,
    at: Callable[[float], ContactSolution],
) -> tuple[ContactSolution, ContactSolution] | None:
    """Solutions at the highest halved load that the grid resolves and at half of it; None if there are none."""
    load, lower = c.load, None
    # expected films give nearly where the grid begins to resolve: no solves before
    while load > LEAST_LOAD_SHARE * c.load and not _expected_resolved(
        replace(c, load=0.5 * load), oil, options
    ):
        load *= 0.5
    for _ in range(MOST_HALVINGS):
        load *= 0.5
        anchor, lower = lower, at(load)
        if anchor is not None and anchor.usable and lower.usable:
            return anchor, lower
    return None


def _expected_resolved(
    conditions: ContactConditions, oil: LubricantParameters, options: SolverOptions, share: float = 1.0
) -> bool:
    """Whether the grid of an operating point holds a share of the cells that its expected inlet asks for."""
    scales = scales_of(conditions, oil)
    x = expected_grid(conditions, scales, scales.film_estimate, options).build().x
    return cells_in_inlet(x, scales.film_estimate) >= share * RESOLVED_CELLS


def _solve_on_grid(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions,
    starts: Sequence[tuple[float, ContactSolution]] = (),
) -> ContactSolution:
    """From the neighbours with their weights; else from the dry contact; else from lower speeds."""
    begun = time.perf_counter()
    problem = ContactProblem(conditions, oil, solid, options)
    solution = _solve_near(problem, starts, options.max_thermal) if starts else None
    if solution is not None and not solution.converged and len(starts) > 1:
        # a pressure spike that moves leaves a wave in the prediction
        nearest = max(starts, key=lambda pair: abs(pair[0]))[1]
        solution = _solve_near(problem, [(1.0, nearest)], options.max_thermal)
    if solution is None or not solution.converged:
        solution = _solve_cold(problem)
    if not solution.converged and not problem.plain and not solution.M > ASYMPTOTIC_ABOVE:
        solution = _continued_in_speed(problem, solution)
    return replace(solution, seconds=time.perf_counter() - begun)


def _solve_cold(problem: ContactProblem) -> ContactSolution:
    """From the dry contact, by way of half the nodes."""
    options = problem.options
    coarse_choice = problem.choice.halved()
    if coarse_choice is None:
        return _result(problem, _solve_from(problem, None, None, options.tolerance), (math.nan, math.nan))
    coarse = ContactProblem(problem.given, problem.oil, problem.solid, options, coarse_choice)
    first, rest = _solve_coarse(coarse)
    if first.converged:
        it = _solve_from(problem, *_prolonged(coarse, first, problem), options.tolerance, first.damped)
    if not first.converged or not it.converged:
        it = _solve_from(problem, None, None, options.tolerance)
    extrapolation = own = math.nan
    if first.converged and it.converged:
        # Richardson: the error of second order is a third of the change from half the nodes
        extrapolation = (1.0 - coarse.central_film(first) / problem.central_film(it)) / 3.0
        # side lobes are about as narrow as the line spacing: no order of convergence, they get the share of the centre
        (h_coarse, at_coarse), (h_fine, at_fine) = _least_film(coarse, first), _least_film(problem, it)
        own = (1.0 - h_coarse / h_fine) / 3.0 if at_coarse == at_fine == 0 else extrapolation
    solution = _result(problem, it, (extrapolation, own), (REMAINDER * abs(extrapolation), rest))
    return replace(solution, phases={**solution.phases, "coarse grid": sum(coarse.seconds.values())})


def _solve_near(
    problem: ContactProblem, starts: Sequence[tuple[float, ContactSolution]], limit: int
) -> ContactSolution:
    """From neighbours with their weights; the shares of the error are interpolated."""
    state, temperature = _carried(starts, problem)
    options = problem.options
    it = problem.start(state)
    if problem.plain:
        it = problem.solve_isothermal(it, options.tolerance, options.max_newton)
    else:
        it = solve_coupled(problem, it, temperature, options.tolerance, min(limit, NEAR_ITERATIONS))
    # a share depends on how the grid holds the inlet: beyond the neighbours it counts in full as its own error
    shares = np.array([s.extrapolation for _, s in starts])
    between = len(starts) > 1 and max(abs(weight) for weight, _ in starts) <= 1.0
    grid = max(s.error_parts[0] for _, s in starts) if between else float(np.max(np.abs(shares[:, 0])))
    weights = np.array([weight for weight, _ in starts])
    # within the range of the neighbours: a quadratic beyond them would amplify their scatter from contact to contact
    centre, least = (float(v) for v in np.clip(weights @ shares, shares.min(axis=0), shares.max(axis=0)))
    rests = [s.error_parts[1] for _, s in starts]
    rest = min(max(float(weights @ rests), min(rests)), max(rests))
    return _result(problem, it, (centre, least), (grid, rest))


def _continued_in_speed(problem: ContactProblem, failed: ContactSolution) -> ContactSolution:
    """The last resort: from a lower speed that converges, both surfaces faster together step by step.

    Heat and the film grow with the speed: a spike of cold oil far from its place does not find it. At most
    options.max_thermal iterations from the lower speed on, and MOST_SPEED_STEPS solves.
    """
    oil, solid, options = problem.oil, problem.solid, problem.options

    def at(share: float) -> ContactProblem:
        return problem if share == 1.0 else ContactProblem(problem.given.at_speed(share), oil, solid, options)

    share, reached = 1.0, failed
    for _ in range(MOST_LOWER):
        share *= LOWER_SPEED
        reached = _solve_cold(at(share))
        if reached.converged:
            break
    if not reached.converged:
        return replace(failed, reason=f"{failed.reason}; nor at {share:g} of the speed")
    begun_at, step, left = share, FIRST_SPEED_STEP, options.max_thermal
    line = [reached]
    for _ in range(MOST_SPEED_STEPS):
        following = min(share * math.exp(step), 1.0)
        near = at(following)
        solution = _solve_near(near, _weighted(near.given, line), left)
        left -= solution.iterations
        if solution.converged:
            share, line = following, [*line, solution][-MOST_NEIGHBOURS:]
            step = min(SPEED_STEP_GROWTH * step, LARGEST_SPEED_STEP)
            if share == 1.0:
                return replace(
                    solution,
                    reason=f"{solution.reason}, continued from {begun_at:g} of the speed",
                    iterations=options.max_thermal - left,
                )
        else:
            step *= 0.5
        if left <= 0 or step < LEAST_SPEED_STEP:
            break
    return replace(
        failed, reason=f"{failed.reason}; continued from lower speeds as far as {share:.3g} of the speed"
    )


def _solve_coarse(coarse: ContactProblem) -> tuple[Iteration, float]:
    """Solution of half the nodes, and the relative error of the film by layers and extent of the energy equation.

    Half the layers and half the extent come first: the beginning costs less, and the difference tells their error.
    """
    if coarse.options.thermal:
        rough = ContactProblem(coarse.given, coarse.oil, coarse.solid, _half(coarse.options), coarse.choice)
        before = _solve_from(rough, None, None, COARSE_TOLERANCE)
        if before.converged:
            start = _prolonged(rough, before, coarse)
            first = _solve_from(coarse, *start, COARSE_TOLERANCE, before.damped)
            if first.converged:
                change = rough.central_film(before) / coarse.central_film(first) - 1.0
                return first, REST_SHARE * abs(change)
    return _solve_from(coarse, None, None, COARSE_TOLERANCE), 0.0


def _half(options: SolverOptions) -> SolverOptions:
    """Half the layers and half the extent of the energy equation, where that leaves enough."""
    layers = options.n_z // 2
    return replace(
        options,
        n_z=layers if layers >= LEAST_LAYERS else options.n_z,
        warm_films=max(0.5 * options.warm_films, 2.0),
    )


def _solve_from(
    problem: ContactProblem,
    state: ReynoldsState | None,
    temperature: Array | None,
    tolerance: float,
    damped: bool = False,
) -> Iteration:
    """Solve on one grid from a state, or from the dry contact; damped: without an undamped attempt."""
    options = problem.options
    it = problem.start(state)
    if problem.plain:
        return problem.solve_isothermal(it, tolerance, options.max_newton)
    if state is None:
        it = problem.solve_isothermal(it, START_TOLERANCE, START_STEPS)
    near, limit, used = it.state, options.max_thermal, 0
    if not damped:
        it = solve_coupled(problem, it, temperature, tolerance, min(limit, UNDAMPED_ITERATIONS))
        used = it.iterations
        if it.converged or used >= limit:
            return it
    # a hot inlet of a thick film
    it = solve_coupled(problem, problem.start(near), temperature, tolerance, limit - used, damped=True)
    it.iterations += used
    return it


def _weights(at: Array, nodes: Array) -> Array:
    """Matrix (at, nodes) of cubic interpolation through the four nodes around; beyond the border its value."""
    first = np.clip(np.searchsorted(nodes, at) - 2, 0, nodes.size - 4)
    at = np.clip(at, nodes[0], nodes[-1])
    out = np.zeros((at.size, nodes.size))
    for own in range(4):
        weight = np.ones(at.size)
        for other in range(4):
            if other != own:
                weight *= (at - nodes[first + other]) / (nodes[first + own] - nodes[first + other])
        out[np.arange(at.size), first + own] = weight
    return out


def _resample(field_: Array, source: Grid, target: Grid) -> Array:
    """Values (n_y, n_x, ...) of one grid on another."""
    along, y = _weights(target.x, source.x), source.y
    if source.mirror:
        # even across the line of symmetry
        y, field_ = np.concatenate((-y[2:0:-1], y)), np.concatenate((field_[2:0:-1], field_))
    return np.einsum("jl,lk...,ik->ji...", _weights(target.y, y), field_, along, optimize=True)


def _layered(temperature: Array, n_z: int) -> Array:
    """Temperatures (..., layers+1) at the levels of another number of layers."""
    layers = temperature.shape[-1] - 1
    if layers == n_z:
        return temperature
    at, nodes = np.linspace(0.0, 1.0, n_z + 1), np.linspace(0.0, 1.0, layers + 1)
    return temperature @ _weights(at, nodes).T


def _on_grid(
    fields: Sequence[tuple[Grid, Array, Array, Array | None]],
    weights: Sequence[float],
    problem: ContactProblem,
) -> tuple[ReynoldsState, Array | None]:
    """Weighted film pressures, gaps and temperatures of other grids as a state of a problem."""
    grid, geometry = problem.geometry.grid, problem.geometry
    p, wanted = np.zeros_like(geometry.undeformed), np.zeros_like(geometry.undeformed)
    temperature: Array | None = None
    main = int(np.argmax(np.abs(weights)))
    loaded = _resample(fields[main][1], fields[main][0], grid) > LOADED
    for k, ((source, pressure, gap, warm), weight) in enumerate(zip(fields, weights, strict=True)):
        p += weight * _resample(np.maximum(pressure, 0.0), source, grid)
        wanted += weight * _resample(gap, source, grid)
        if warm is not None:
            # what circulates in the inlet settles slowly: its error would grow from prediction to prediction
            shares = np.where(loaded, weight, 1.0 if k == main else 0.0)
            part = shares[..., None] * _layered(_resample(warm, source, grid), problem.options.n_z)
            temperature = part if temperature is None else temperature + part
    cavitated = p <= 0.0
    p = geometry.embed(np.where(cavitated, -CAVITATED * LEAST_PRESSURE, p)[grid.inner])
    p += geometry.asperity_pressure(problem.asperities, wanted)[0]
    p *= TARGET_LOAD / float(np.sum(geometry.weights * p))
    # the approach that leaves the gap of the contact as it was
    shape = geometry.gap(p, 0.0)
    middle = p > 0.5 * p.max()
    h_0 = float(np.mean((wanted - shape)[middle]))
    return ReynoldsState(p, h_0, shape + h_0, cavitated if problem.asperities.rough else None), temperature


def _prolonged(
    coarse: ContactProblem, it: Iteration, problem: ContactProblem
) -> tuple[ReynoldsState, Array | None]:
    """A coarse solution on the grid of a finer problem."""
    field_ = coarse.geometry.grid, coarse.film_pressure(it.state), it.state.gap, it.temperature
    return _on_grid([field_], [1.0], problem)


def _neighbours(
    c: ContactConditions, start: ContactSolution | Sequence[ContactSolution] | None
) -> list[tuple[float, ContactSolution]]:
    """The converged neighbours to start from with their weights."""
    solutions = [start] if isinstance(start, ContactSolution) else list(start or ())
    if len(solutions) > MOST_NEIGHBOURS:
        raise ValueError(
            f"start: {len(solutions)} neighbours; needs at most {MOST_NEIGHBOURS}: take the nearest"
        )
    return _weighted(c, [s for s in solutions if s.converged])


def _weighted(
    c: ContactConditions, solutions: Sequence[ContactSolution]
) -> list[tuple[float, ContactSolution]]:
    """Lagrange weights of solutions on a line through an operating point, in logarithms."""
    if len(solutions) < 2:
        return [(1.0, s) for s in solutions]

    def place(at: ContactConditions) -> Array:
        return np.log([at.load, abs(at.u_e), at.temperature])

    points = np.array([place(s.conditions) - place(c) for s in solutions])
    distances = np.linalg.norm(points[:, None] - points[None], axis=-1)
    first, last = np.unravel_index(int(distances.argmax()), distances.shape)
    length = float(distances[first, last])
    direction = (points[last] - points[first]) / max(length, TINY)
    along = points @ direction
    off = np.linalg.norm(points - along[:, None] * direction, axis=1)
    gaps = np.diff(np.sort(along))
    if not gaps.min() > EQUAL or not off.max() <= OFF_LINE * length:
        raise ValueError(
            "start: neighbours at one point, or not on a line with the contact in the logarithms of load, speed and "
            "temperature; needs distinct points on a line: give the nearest one alone"
        )
    weights = [math.prod(-t / (s - t) for t in np.delete(along, k)) for k, s in enumerate(along)]
    return list(zip((float(w) for w in weights), solutions, strict=True))


def _carried(
    starts: Sequence[tuple[float, ContactSolution]], problem: ContactProblem
) -> tuple[ReynoldsState, Array | None]:
    """Neighbours with their weights: pressures in Hertz units, gaps by their share of the expected film."""
    c, scales = problem.conditions, problem.scales
    fields: list[tuple[Grid, Array, Array, Array | None]] = []
    for _, start in starts:
        own = scales_of(start.conditions, problem.oil)
        share = scales.film_estimate / own.film_estimate
        temperature = start.temperature
        if temperature is not None:
            # colder than the inlet behind the spike, where the oil expands
            temperature = temperature + (c.temperature - start.conditions.temperature)
        gap = start.state.gap + start.h_c / own.h_unit * (share - 1.0)
        film_pressure = start.state.p - start.asperity_pressure / start.hertz.p_max
        fields.append((start.grid, film_pressure, gap, temperature))
    return _on_grid(fields, [weight for weight, _ in starts], problem)


def _result(
    problem: ContactProblem,
    it: Iteration,
    extrapolation: tuple[float, float],
    errors: tuple[float, float] = (math.nan, 0.0),
) -> ContactSolution:
    """What a solve has found; its time is left at zero."""
    grid, scales = problem.geometry.grid, problem.scales
    if problem.plain:
        problem.update_flow(it, problem.uniform_temperature())
    traction = problem.traction(it)
    sign = -1.0 if problem.given.u_e < 0.0 else 1.0
    h_c, h_m = _films(problem, it, extrapolation)
    asperities = problem.asperity_pressure(it.state)
    converged, reason = it.converged, it.reason
    if converged and not min(h_m, h_c) > 0.0:
        converged, reason = False, "the bodies touch: film thinner than the grid resolves"
    return ContactSolution(
        conditions=problem.given,
        hertz=scales.hertz,
        h_c=h_c * scales.h_unit,
        h_m=min(h_m, h_c) * scales.h_unit,
        p_max=float(it.state.p.max()) * scales.hertz.p_max,
        temperature_rise=0.0
        if it.temperature is None
        else float(it.temperature.max()) - problem.given.temperature,
        traction_force=sign * traction.force,
        spin_moment=sign * traction.moment,
        sliding_heat=traction.heat,
        converged=converged,
        reason=reason,
        iterations=it.iterations,
        deflections=it.history.deflections,
        seconds=0.0,
        phases=dict(problem.seconds),
        M=scales.M,
        L=scales.L,
        branch=_branch(problem, it),
        extrapolation=extrapolation,
        error_estimate=sum(errors) + CONVERGED_AT * problem.options.tolerance,
        error_parts=errors,
        history=it.history,
        temperature_history=it.temperature_history,
        heat_balance=None if it.balance is None else it.balance(),
        integrals=contact_integrals(problem, it, sign * traction.force),
        x=grid.x,
        y=grid.y,
        pressure=np.maximum(it.state.p, 0.0) * scales.hertz.p_max,
        asperity_pressure=asperities * scales.hertz.p_max,
        asperity_load_share=float(np.sum(problem.geometry.weights * asperities)) / TARGET_LOAD,
        film=it.state.gap * scales.h_unit,
        temperature=it.temperature,
        state=it.state,
        choice=problem.choice,
    )


def _films(problem: ContactProblem, it: Iteration, extrapolation: tuple[float, float]) -> tuple[float, float]:
    """Central and minimum film [b^2/R_x], extrapolated to zero spacing where the shares to add are small."""
    h_c, h_m = (
        film * (1.0 + share if abs(share) < EXTRAPOLATED_BELOW else 1.0)
        for film, share in zip(
            (problem.central_film(it), _least_film(problem, it)[0]), extrapolation, strict=True
        )
    )
    return h_c, h_m


def _branch(problem: ContactProblem, it: Iteration) -> str:
    """Whether the grid resolves the inlet of the isothermal film, which heat inside the contact does not narrow."""
    film = problem.central_film(it)
    if it.temperature is not None:
        film = max(film, problem.scales.film_estimate)
    return "resolved" if problem.cells_in_inlet(film) >= RESOLVED_CELLS else "asymptotic"


def _least_film(problem: ContactProblem, it: Iteration) -> tuple[float, int]:
    """Minimum film of the grid [b^2/R_x] and the line that it lies on, counted from the axis."""
    grid, gap, axis = problem.geometry.grid, it.state.gap, problem.geometry.axis
    halves = [gap[axis:]] if grid.mirror else [gap[axis:], gap[axis::-1]]
    return min(_minimum_film(grid.x, grid.y[axis:], half) for half in halves)


def _minimum_film(x: Array, y: Array, gap: Array) -> tuple[float, int]:
    """Smallest gap, and its line, over the lines whose contact edge holds a cell per inlet length [b^2/R_x].

    On a long ellipse under high load the outermost lines end on cells longer than their own inlet and have no
    meaningful film; the minimum of such an ellipse lies at the outlet of the central lines anyway.
    """
    h_c = float(gap[0, np.argmin(np.abs(x))])
    spacing = np.interp(np.sqrt(np.clip(1.0 - y**2, 0.0, None)), x[:-1], np.diff(x))
    half_width = np.sqrt(np.clip(1.0 - y**2, 1e-4, None))
    usable = (spacing <= inlet_length(max(h_c, 0.0)) / half_width ** (1.0 / 3.0)) | (y > 1.0)
    usable[0] = True
    lines = usable & np.logical_and.accumulate(usable | (y > 1.0))
    # the lobe is about as narrow as the spacing: parabola through the least node of each line and its neighbours, then
    # through the lines, there of the logarithm: the gap opens steeply towards the edge
    least = np.array([_vertex(x, line) for line in gap])
    k = int(np.argmin(np.where(lines, least, np.inf)))
    if not 0 < k < y.size - 1 or not least[k - 1 : k + 2].min() > 0.0 or not lines[k + 1]:
        return float(least[k]), k
    return math.exp(_vertex(y[k - 1 : k + 2], np.log(least[k - 1 : k + 2]))), k


def _vertex(x: Array, values: Array) -> float:
    """Least value of the parabola through the least inner node and its neighbours."""
    k = min(max(int(np.argmin(values)), 1), x.size - 2)
    low, mid, high = (float(v) for v in values[k - 1 : k + 2])
    left, right = float(x[k - 1] - x[k]), float(x[k + 1] - x[k])
    bend = ((high - mid) / right - (low - mid) / left) / (right - left)
    slope = (low - mid) / left - bend * left
    if not bend > 0.0 or not left < -0.5 * slope / bend < right:
        return min(low, mid, high)
    return mid - 0.25 * slope * slope / bend
