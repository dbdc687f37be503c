"""Adaptive sampling of a map: axes are halved, and only new nodes that the old ones do not predict are solved.

Every other node along an axis is left out and predicted by the spline through the rest; the spline through all leaves
an eighth of that error between its nodes (a sixteenth where it is smooth). Where this is below the tolerance, the new
node between two old ones takes the value of the spline (an adaptive hierarchical basis: Griebel 1998, Computing 61,
with splines instead of hats). Errors of films thinner than FILM_FLOOR are relative to it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..physics.hertz import RACEWAYS
from ..runtime.bspline import LEAST_NODES, cubic_weights, fit
from .contact_map import FILMS, Array, ContactAxes, ContactMap, film_formula

Mask = NDArray[np.bool_]

#: film [m] below which errors are relative to this one: about the roughness height of the friction sets, below which
#: films contribute little friction; lower, heavily loaded slow contacts are refined that hardly change the torque
FILM_FLOOR = 20e-9
#: films that are refined for; the minimum film of side lobes scatters with the grid of the solver
REFINED = FILMS[:2]
#: remaining share of the error of a spline when its cells are halved; 1/16 where it is smooth: the larger the more
#: nodes are solved for a tolerance
LEFT = 1.0 / 8.0
#: share of an estimated error that counts for the neighbouring cells; 0: features between the nodes left out are missed
SPREAD = 0.5
#: quantile of the errors that stands for an axis: a few contacts near a change of regime are left to the rest
QUANTILE = 0.95


def halvable(axes: ContactAxes, axis: int) -> bool:
    """Whether every other node of an axis can be left out: their number is odd."""
    return axes.shape[axis] % 2 == 1


def axis_errors(contact_map: ContactMap) -> tuple[float, float, float]:
    """Estimated error of ln(film) between the nodes of each axis (load, speed, temperature); 0: no estimate.

    The quantile QUANTILE over the solved nodes of both raceways.
    """
    found = []
    for axis in range(3):
        known = [
            _left_out(contact_map, raceway, axis)[_odd(contact_map.solved[raceway], axis)]
            for raceway in RACEWAYS
            if halvable(contact_map.axes, axis)
        ]
        errors = np.concatenate(known) if known else np.zeros(0)
        found.append(LEFT * float(np.quantile(errors, QUANTILE)) if errors.size else 0.0)
    return found[0], found[1], found[2]


def unknown_middles(contact_map: ContactMap, axis: int, tolerance: float) -> dict[str, Mask]:
    """Middles of the cells of an axis that have to be solved (..., n-1 along the axis, ...), by raceway."""
    return {raceway: _middle_errors(contact_map, raceway, axis) > tolerance for raceway in RACEWAYS}


def halved(contact_map: ContactMap, axis: int) -> ContactMap:
    """The map on axes with twice as many cells along one of them; new nodes are interpolated, none is solved."""
    axes = contact_map.axes.refined(axis)
    loads, speeds, temperatures = axes.nodes
    samples: dict[str, dict[str, Array]] = {}
    solved = {}
    for raceway in RACEWAYS:
        old = contact_map.samples[raceway]
        points = loads[:, None, None], speeds[:, None], temperatures
        formula = film_formula(contact_map.parameters, raceway, *points)
        samples[raceway] = {
            name: np.exp(_with_middles(contact_map.ln_ratios[raceway, name], axis)) * formula
            for name in FILMS
        }
        # the interpolated minimum film may exceed the central one: bounded by it
        lowest = np.minimum(samples[raceway][FILMS[2]], samples[raceway][FILMS[1]])
        samples[raceway][FILMS[2]] = np.where(
            _old_nodes(axes.shape, axis), samples[raceway][FILMS[2]], lowest
        )
        for name in ("temperature_rise", "pressure_max"):
            samples[raceway][name] = np.exp(_with_middles(np.log(old[name]), axis))
        samples[raceway]["traction_force"] = _with_middles(old["traction_force"], axis)
        flags = np.moveaxis(old["asymptotic"], axis, 0)
        samples[raceway]["asymptotic"] = _merged(flags, np.maximum(flags[1:], flags[:-1]), axis)
        known = np.moveaxis(contact_map.solved[raceway], axis, 0)
        solved[raceway] = _merged(known, np.zeros_like(known[1:]), axis)
    return ContactMap(contact_map.parameters, axes, samples, solved)


def with_solved(
    contact_map: ContactMap, values: Mapping[str, Mapping[str, Array]], mask: Mapping[str, Mask]
) -> ContactMap:
    """The map with the samples of a mask replaced by solved values (n_load, n_speed, n_temperature) by quantity."""
    samples = {
        raceway: {
            name: np.where(mask[raceway], values[raceway][name], old)
            for name, old in contact_map.samples[raceway].items()
        }
        for raceway in RACEWAYS
    }
    solved = {raceway: contact_map.solved[raceway] | mask[raceway] for raceway in RACEWAYS}
    return ContactMap(contact_map.parameters, contact_map.axes, samples, solved)


def at_new_nodes(middles: Mask, axis: int) -> Mask:
    """A mask of the middles of cells as one of the nodes of the halved axis."""
    middles = np.moveaxis(middles, axis, 0)
    return np.asarray(_merged(np.zeros((len(middles) + 1, *middles.shape[1:]), dtype=bool), middles, axis))


def _old_nodes(shape: tuple[int, ...], axis: int) -> Mask:
    """Every other node of a halved axis, in the shape that broadcasts."""
    old = np.arange(shape[axis]) % 2 == 0
    return old.reshape([-1 if k == axis else 1 for k in range(3)])


def _odd(values: NDArray, axis: int) -> NDArray:
    return np.moveaxis(values, axis, 0)[1::2]


def _left_out(contact_map: ContactMap, raceway: str, axis: int) -> Array:
    """Error at every other node along an axis, which comes first, when it is left out."""
    worst = np.zeros(_odd(contact_map.samples[raceway][FILMS[0]], axis).shape)
    for name in REFINED:
        lines = np.moveaxis(contact_map.ln_ratios[raceway, name], axis, 0)
        film = _odd(contact_map.samples[raceway][name], axis)
        error = np.abs(_predicted(lines[::2]) - lines[1::2]) * film / np.maximum(film, FILM_FLOOR)
        worst = np.maximum(worst, error)
    return worst


def _middle_errors(contact_map: ContactMap, raceway: str, axis: int) -> Array:
    """Estimated error in the middle of every cell of an axis: the greatest of the nodes around it."""
    left_out = _left_out(contact_map, raceway, axis)
    # each node left out counts for the two cells at it and for the next one on either side
    cells = np.repeat(left_out, 2, axis=0)
    wide = cells.copy()
    wide[1:] = np.maximum(wide[1:], cells[:-1])
    wide[:-1] = np.maximum(wide[:-1], cells[1:])
    for across in (1, 2):
        own = np.moveaxis(wide, across, 0)
        spread = own.copy()
        spread[1:] = np.maximum(spread[1:], SPREAD * own[:-1])
        spread[:-1] = np.maximum(spread[:-1], SPREAD * own[1:])
        wide = np.moveaxis(spread, 0, across)
    return np.moveaxis(LEFT * wide, 0, axis)


def _with_middles(values: Array, axis: int) -> Array:
    """Values on a halved axis: the old ones, and the spline through them in between."""
    lines = np.moveaxis(values, axis, 0)
    middles = _predicted(lines.reshape(len(lines), -1)).reshape(len(lines) - 1, *lines.shape[1:])
    return np.asarray(_merged(lines, middles, axis))


def _merged(lines: NDArray, middles: NDArray, axis: int) -> NDArray:
    """Nodes and middles in turn along the first axis, which goes back to its place."""
    out = np.empty((2 * len(lines) - 1, *lines.shape[1:]), dtype=lines.dtype)
    out[::2], out[1::2] = lines, middles
    return np.moveaxis(out, 0, axis)


def _predicted(lines: Array) -> Array:
    """Values (n-1, ...) half way between n nodes: by the spline, of three nodes by the parabola."""
    if len(lines) < LEAST_NODES:
        first, middle, last = lines
        return np.stack([3.0 * first + 6.0 * middle - last, 3.0 * last + 6.0 * middle - first]) / 8.0
    coefficients = fit(lines, (0,))
    weights = cubic_weights(0.5)
    cells = len(lines) - 1
    return np.asarray(sum(w * coefficients[a : a + cells] for a, w in enumerate(weights)))
