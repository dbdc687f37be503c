"""Starts of a solve: a coarse solution on a finer grid, and neighbouring solutions, alone or extrapolated."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .conditions import ContactConditions, scales_of
from .film.reynolds import LEAST_PRESSURE, TARGET_LOAD, ReynoldsState
from .half_space.grid import TINY, Array, Grid
from .problem import ContactProblem, Iteration
from .solution import ContactSolution

#: pressure [p_max] above which temperatures are extrapolated through the neighbours; below, they are the nearest's
LOADED = 1e-2
#: most neighbours of a start: a quadratic
MOST_NEIGHBOURS = 3
#: distance of the neighbours and of the contact from their line, as a share of its length: beyond, they are not on one
OFF_LINE = 0.1
#: least distance of two neighbours, in the logarithm
EQUAL = 1e-9
#: pressure of nodes that were cavitated on another grid, as a share of the deepest that is allowed: they begin
#: cavitated, for the edge of cavitation moves by one node per Newton step
CAVITATED = 1e-3


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
    loaded = resample(fields[main][1], fields[main][0], grid) > LOADED
    for k, ((source, pressure, gap, warm), weight) in enumerate(zip(fields, weights, strict=True)):
        p += weight * resample(np.maximum(pressure, 0.0), source, grid)
        wanted += weight * resample(gap, source, grid)
        if warm is not None:
            # what circulates in the inlet settles slowly: its error would grow from prediction to prediction
            shares = np.where(loaded, weight, 1.0 if k == main else 0.0)
            part = shares[..., None] * _layered(resample(warm, source, grid), problem.options.n_z)
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


def prolonged(
    coarse: ContactProblem, it: Iteration, problem: ContactProblem
) -> tuple[ReynoldsState, Array | None]:
    """A coarse solution on the grid of a finer problem."""
    field_ = coarse.geometry.grid, coarse.film_pressure(it.state), it.state.gap, it.temperature
    return _on_grid([field_], [1.0], problem)


def neighbours(
    c: ContactConditions, start: ContactSolution | Sequence[ContactSolution] | None
) -> list[tuple[float, ContactSolution]]:
    """The converged neighbours to start from with their weights."""
    solutions = () if start is None else (start,) if isinstance(start, ContactSolution) else start
    if not isinstance(solutions, Sequence) or not all(isinstance(s, ContactSolution) for s in solutions):
        raise ValueError(
            f"start = {start!r}; needs a ContactSolution, up to {MOST_NEIGHBOURS} of them, or None"
        )
    if len(solutions) > MOST_NEIGHBOURS:
        raise ValueError(
            f"start: {len(solutions)} neighbours; needs at most {MOST_NEIGHBOURS}: take the nearest"
        )
    return weighted(c, [s for s in solutions if s.converged])


def weighted(
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


def carried(
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
