"""Starts of a solve: a coarse solution on a finer grid, and solutions at lower loads or speeds, extrapolated."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .conditions import scales_of
from .film.reynolds import LEAST_PRESSURE, TARGET_LOAD, ReynoldsState
from .half_space.grid import Array, Grid
from .problem import ContactProblem, Iteration
from .solution import ContactSolution

#: pressure [p_max] above which temperatures are extrapolated through the neighbours; below, they are the nearest's
LOADED = 1e-2
#: pressure of nodes that were cavitated on another grid, as a share of the deepest that is allowed: they begin
#: cavitated, for the edge of cavitation moves by one node per Newton step
CAVITATED = 1e-3

#: solutions to start from with their weights
Starts = Sequence[tuple[float, ContactSolution]]


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


def _on_grid(
    fields: Sequence[tuple[Grid, Array, Array, Array | None]],
    weights: Sequence[float],
    problem: ContactProblem,
) -> tuple[ReynoldsState, Array | None]:
    """Weighted pressures, gaps and temperatures of other grids as a state of a problem."""
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
    p = geometry.embed(np.where(p <= 0.0, -CAVITATED * LEAST_PRESSURE, p)[grid.inner])
    p *= TARGET_LOAD / float(np.sum(geometry.weights * p))
    # the approach that leaves the gap of the contact as it was
    shape = geometry.gap(p, 0.0)
    middle = p > 0.5 * p.max()
    h_0 = float(np.mean((wanted - shape)[middle]))
    return ReynoldsState(p, h_0, shape + h_0), temperature


def prolonged(
    coarse: ContactProblem, it: Iteration, problem: ContactProblem
) -> tuple[ReynoldsState, Array | None]:
    """A coarse solution on the grid of a finer problem."""
    field_ = coarse.geometry.grid, it.state.p, it.state.gap, it.temperature
    return _on_grid([field_], [1.0], problem)


def weighted(at: float, line: Sequence[tuple[float, ContactSolution]]) -> Starts:
    """Solutions at ratios of a load or speed with their Lagrange weights at another ratio, in logarithms."""
    along = np.log([ratio / at for ratio, _ in line])
    weights = [math.prod(-t / (s - t) for t in np.delete(along, k)) for k, s in enumerate(along)]
    return [(float(weight), solution) for weight, (_, solution) in zip(weights, line, strict=True)]


def carried(starts: Starts, problem: ContactProblem) -> tuple[ReynoldsState, Array | None]:
    """Solutions with their weights: pressures in Hertz units, gaps by their share of the expected film."""
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
        fields.append((start.grid, start.state.p, gap, temperature))
    return _on_grid(fields, [weight for weight, _ in starts], problem)
