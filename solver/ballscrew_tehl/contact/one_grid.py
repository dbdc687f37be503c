"""One contact on one grid: from the dry contact by way of half the nodes."""

import math
from dataclasses import replace

import numpy as np

from .conditions import DEFAULT_OPTIONS, SolverOptions
from .coupled import solve_coupled
from .film.flow import LEAST_LAYERS
from .film.fluxes import EDGE_TOLERANCE
from .film.geometry import TARGET_LOAD, ReynoldsState
from .film.reynolds import NEWTON_STEPS
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
#: tolerance of the isothermal solve that a coupled solve begins with
START_TOLERANCE = 1e-2


def solve_cold(problem: ContactProblem) -> ContactResult:
    """From the dry contact, by way of half the nodes."""
    options = problem.options
    coarse_choice = problem.choice.halved()
    if coarse_choice is None:
        return solution_of(problem, solve_from(problem, None, None, options.tolerance), (math.nan, math.nan))
    coarse = ContactProblem(problem.given, problem.oil, problem.solids, options, coarse_choice)
    first, rest = _solve_coarse(coarse)
    if first.converged:
        it = solve_from(problem, *prolonged(coarse, first, problem), options.tolerance, first.damped)
    # what never settles with damping would not from the dry contact
    if not first.converged or not (it.converged or it.damped):
        it = solve_from(problem, None, None, options.tolerance)
    extrapolation = own = math.nan
    if first.converged and it.converged:
        # Richardson: the error of second order is a third of the change from half the nodes
        extrapolation = (1.0 - coarse.central_film(first) / problem.central_film(it)) / 3.0
        # side lobes are about as narrow as the line spacing: no order of convergence, they get the share of the centre
        (h_coarse, at_coarse), (h_fine, at_fine) = least_film(coarse, first), least_film(problem, it)
        own = (1.0 - h_coarse / h_fine) / 3.0 if at_coarse == at_fine == 0 else extrapolation
    return solution_of(problem, it, (extrapolation, own), REMAINDER * abs(extrapolation) + rest)


def _solve_coarse(coarse: ContactProblem) -> tuple[Iteration, float]:
    """Solution of half the nodes, and the relative error of the film by layers and extent of the energy equation.

    Half the layers and half the extent come first: the beginning costs less, and the difference tells their error.
    """
    if coarse.options.thermal:
        rough = ContactProblem(coarse.given, coarse.oil, coarse.solids, _half(coarse.options), coarse.choice)
        before = solve_from(rough, None, None, DEFAULT_OPTIONS.tolerance)
        if before.converged:
            start = prolonged(rough, before, coarse)
            first = solve_from(coarse, *start, DEFAULT_OPTIONS.tolerance, before.damped)
            if first.converged:
                change = rough.central_film(before) / coarse.central_film(first) - 1.0
                return first, REST_SHARE * abs(change)
    return solve_from(coarse, None, None, DEFAULT_OPTIONS.tolerance), 0.0


def _half(options: SolverOptions) -> SolverOptions:
    """Half the layers and half the extent of the energy equation, where that leaves enough."""
    layers = options.n_z // 2
    return replace(
        options,
        n_z=layers if layers >= LEAST_LAYERS else options.n_z,
        warm_films=max(0.5 * options.warm_films, 2.0),
    )


def solve_from(
    problem: ContactProblem,
    state: ReynoldsState | None,
    temperature: Array | None,
    tolerance: float,
    damped: bool = False,
) -> Iteration:
    """Solve on one grid from a state, or from the dry contact; damped: without an undamped attempt."""
    options = problem.options
    it = problem.start(state)
    if not problem.options.thermal:
        return problem.solve_isothermal(it, tolerance, options.max_newton)
    if state is None:
        it = problem.solve_isothermal(it, START_TOLERANCE, NEWTON_STEPS)
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


# --- a coarse solution on a finer grid ---


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


def resample(field_: Array, source: Grid, target: Grid) -> Array:
    """Values (n_y, n_x, ...) of one grid on another."""
    along, y = _weights(target.x, source.x), source.y
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


def prolonged(
    coarse: ContactProblem, it: Iteration, problem: ContactProblem
) -> tuple[ReynoldsState, Array | None]:
    """A coarse solution on the grid of a finer problem: state and temperatures."""
    source, grid, geometry = coarse.geometry.grid, problem.geometry.grid, problem.geometry
    p = resample(np.maximum(it.state.p, 0.0), source, grid)
    # cavitated nodes begin so, for the edge of cavitation moves by one node per Newton step
    p = geometry.embed(np.where(p <= 0.0, -EDGE_TOLERANCE, p)[grid.inner])
    p *= TARGET_LOAD / float(np.sum(geometry.weights * p))
    # the approach that leaves the gap of the contact as it was
    shape = geometry.gap(p, 0.0)
    middle = p > 0.5 * p.max()
    h_0 = float(np.mean((resample(it.state.gap, source, grid) - shape)[middle]))
    warm = it.temperature
    if warm is not None:
        warm = _layered(resample(warm, source, grid), problem.options.n_z)
    return ReynoldsState(p, h_0, shape + h_0), warm
