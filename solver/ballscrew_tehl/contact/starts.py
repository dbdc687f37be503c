"""Start of a solve: a coarse solution on a finer grid."""

from __future__ import annotations

import numpy as np

from .film.reynolds import LEAST_PRESSURE, TARGET_LOAD, ReynoldsState
from .half_space.grid import Array, Grid
from .problem import ContactProblem, Iteration

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
    p = geometry.embed(np.where(p <= 0.0, -CAVITATED * LEAST_PRESSURE, p)[grid.inner])
    p *= TARGET_LOAD / float(np.sum(geometry.weights * p))
    # the approach that leaves the gap of the contact as it was
    shape = geometry.gap(p, 0.0)
    middle = p > 0.5 * p.max()
    h_0 = float(np.mean((resample(it.state.gap, source, grid) - shape)[middle]))
    warm = it.temperature
    if warm is not None:
        warm = _layered(resample(warm, source, grid), problem.options.n_z)
    return ReynoldsState(p, h_0, shape + h_0), warm
