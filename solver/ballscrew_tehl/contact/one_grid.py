"""One contact on one grid: from the dry contact by way of half the nodes."""

from dataclasses import replace

import numpy as np

from .conditions import DEFAULT_OPTIONS
from .coupled import LARGE_CHANGE, PRESSURE_SHARE, solve_coupled
from .film.flow import LEAST_LAYERS
from .film.geometry import TARGET_LOAD, ReynoldsState
from .film.reynolds import NEWTON_STEPS
from .half_space.deflection import PRESSURE_TOLERANCE
from .half_space.grid import Array, Grid
from .problem import ContactProblem, Iteration
from .result import ContactResult, least_film, solution_of

#: share of the extrapolation from half the nodes that counts as the error of the extrapolated film: that of the next
#: order. Twice the nodes, lines, layers and extent change h_c by 2e-4 in the median, 4e-3 at most; that is 0.24 at most
#: of extrapolation, rest and tolerance together (51 random resolved contacts of both kinematics)
REMAINDER = 0.25
#: share of the change by half the layers and half the extent of the energy equation that counts as their error: a third
#: for second order (layers), all of it for first order (extent)
REST_SHARE = 0.5


def solve_cold(problem: ContactProblem) -> ContactResult:
    """From the dry contact, by way of half the nodes."""
    options = problem.options
    coarse_choice = problem.choice.halved()
    if coarse_choice is None:
        return solution_of(problem, solve_from(problem, None, None, options.tolerance), (0.0, 0.0))
    coarse = ContactProblem(problem.given, problem.oil, problem.solids, options, coarse_choice)
    first, rest = _solve_coarse(coarse)
    if first.converged:
        it = solve_from(problem, *prolonged(coarse, first, problem), options.tolerance, first.damped)
    # what never settles with damping would not from the dry contact
    if not first.converged or not (it.converged or it.damped):
        it = solve_from(problem, None, None, options.tolerance)
    if not (first.converged and it.converged):
        return solution_of(problem, it, (0.0, 0.0))
    # Richardson: the error of second order is a third of the change from half the nodes
    extrapolation = (1.0 - coarse.central_film(first) / problem.central_film(it)) / 3.0
    # side lobes are about as narrow as the line spacing: no order of convergence, they get the share of the centre
    (h_coarse, at_coarse), (h_fine, at_fine) = least_film(coarse, first), least_film(problem, it)
    own = (1.0 - h_coarse / h_fine) / 3.0 if at_coarse == at_fine == 0 else extrapolation
    return solution_of(problem, it, (extrapolation, own), REMAINDER * abs(extrapolation) + rest)


def _solve_coarse(coarse: ContactProblem) -> tuple[Iteration, float]:
    """Solution of half the nodes, and relative error of the film by layers and extent: half of both come first."""
    if coarse.options.thermal:
        n_z, films = coarse.options.n_z, max(0.5 * coarse.options.warm_films, 2.0)
        half = replace(coarse.options, n_z=n_z // 2 if n_z // 2 >= LEAST_LAYERS else n_z, warm_films=films)
        rough = ContactProblem(coarse.given, coarse.oil, coarse.solids, half, coarse.choice)
        before = solve_from(rough, None, None, DEFAULT_OPTIONS.tolerance)
        if before.converged:
            start = prolonged(rough, before, coarse)
            first = solve_from(coarse, *start, DEFAULT_OPTIONS.tolerance, before.damped)
            if first.converged:
                change = rough.central_film(before) / coarse.central_film(first) - 1.0
                return first, REST_SHARE * abs(change)
    return solve_from(coarse, None, None, DEFAULT_OPTIONS.tolerance), 0.0


def solve_from(
    problem: ContactProblem,
    state: ReynoldsState | None,
    temperature: Array | None,
    tolerance: float,
    damped: bool = False,
) -> Iteration:
    """Solve on one grid from a state, or from the dry contact; damped: without an undamped attempt."""
    options, it = problem.options, problem.start(state)
    if not options.thermal:
        return problem.solve_isothermal(it, tolerance, options.max_newton)
    if state is None:
        it = problem.solve_isothermal(it, PRESSURE_SHARE * LARGE_CHANGE, NEWTON_STEPS)
    near, limit, used = it.state, options.max_thermal, 0
    if not damped:
        it = solve_coupled(problem, it, temperature, tolerance, limit)
        used = it.iterations
        if it.converged or used >= limit:
            return it
    # a hot inlet of a thick film
    it = solve_coupled(problem, problem.start(near), temperature, tolerance, limit - used, damped=True)
    it.iterations += used
    return it


def _weights(at: Array, nodes: Array) -> Array:
    """Matrix (at, nodes) of cubic interpolation through the four nodes around; beyond the border its value."""
    first = np.clip(np.searchsorted(nodes, at) - 2, 0, nodes.size - 4)[:, None] + np.arange(4)
    at, out = np.clip(at, nodes[0], nodes[-1])[:, None], np.zeros((at.size, nodes.size))
    for own in range(4):
        others = nodes[np.delete(first, own, axis=1)]
        weight = np.prod((at - others) / (nodes[first[:, own, None]] - others), axis=1)
        out[np.arange(at.size), first[:, own]] = weight
    return out


def resample(field_: Array, source: Grid, target: Grid) -> Array:
    """Values (n_y, n_x, ...) of one grid on another."""
    along, y = _weights(target.x, source.x), source.y
    # even across the line of symmetry
    y, field_ = np.concatenate((-y[2:0:-1], y)), np.concatenate((field_[2:0:-1], field_))
    return np.einsum("jl,lk...,ik->ji...", _weights(target.y, y), field_, along, optimize=True)


def prolonged(
    coarse: ContactProblem, it: Iteration, problem: ContactProblem
) -> tuple[ReynoldsState, Array | None]:
    """A coarse solution on the grid of a finer problem: state and temperatures."""
    source, grid, geometry = coarse.geometry.grid, problem.geometry.grid, problem.geometry
    p = resample(np.maximum(it.state.p, 0.0), source, grid)
    # cavitated nodes begin so, for the edge of cavitation moves by one node per Newton step
    p = geometry.embed(np.where(p <= 0.0, -PRESSURE_TOLERANCE, p)[grid.inner])
    p *= TARGET_LOAD / float(np.sum(geometry.weights * p))
    # the approach that leaves the gap of the contact as it was
    shape = geometry.gap(p, 0.0)
    middle = p > 0.5 * p.max()
    h_0 = float(np.mean((resample(it.state.gap, source, grid) - shape)[middle]))
    warm, layers = it.temperature, problem.options.n_z
    if warm is not None:
        warm = resample(warm, source, grid)
        if coarse.options.n_z != layers:
            levels = np.linspace(0.0, 1.0, layers + 1), np.linspace(0.0, 1.0, coarse.options.n_z + 1)
            warm = warm @ _weights(*levels).T
    return ReynoldsState(p, h_0, shape + h_0), warm
