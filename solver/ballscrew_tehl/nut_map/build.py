"""Building a map: solve the contacts of one ball over the sampling grid, then sum them over the balls of a nut."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor, as_completed
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..contact.ball_contact import solve_ball
from ..friction.torque import nut_sums
from ..parameters.file import Parameters
from ..parameters.identity import map_parameters_json
from ..physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ..physics.load import contact_angle_at_ball_load, double_nut_loads, nut_loads, separation_load
from ..runtime.bspline import map_arrays
from ..runtime.packed import FORCE_CURVES
from . import sampling
from .contact_map import FILMS, QUANTITIES, Array, ContactAxes, ContactMap
from .grid import BuiltMap, MapGrid, contact_axes
from .journal import Journal, Solved
from .workers import Progress, worker_pool

#: speeds of one load and temperature that a process solves at a time, which an interrupt can lose; fewer: more
#: overhead between processes
PIECE = 4


def _solve_row(
    parameters: Parameters, raceway: str, load: float, speeds: Array, temperature: float
) -> dict[str, Array]:
    """All speeds of one ball load and temperature: a unit of work for one process."""
    row = {name: np.empty(speeds.size) for name in QUANTITIES}
    for i, speed in enumerate(speeds):
        cold = solve_ball(parameters, raceway, load, float(speed), temperature, thermal=False)
        hot = solve_ball(parameters, raceway, load, float(speed), temperature, thermal=True)
        values = (
            cold.h_c, hot.h_c, hot.h_m, hot.temperature_rise, hot.p_max, hot.traction_force,
            float(cold.branch != "resolved"),
        )  # fmt: skip
        for name, value in zip(QUANTITIES, values, strict=True):
            row[name][i] = value
    return row


def build_contact_map(
    parameters: Parameters,
    grid: MapGrid,
    executor: Executor,
    progress: Progress | None = None,
    journal: Journal | None = None,
) -> ContactMap:
    """Solve the sampling grid, isothermal and thermal, on an executor, and refine it where it is not accurate enough.

    Parameters   journal: contacts solved before, and where those solved now are written at once
    Raises       UnconvergedContactError: a contact that did not converge; no value is substituted
    """
    axes = contact_axes(parameters, grid)
    solved = Solved(journal)
    everywhere = dict.fromkeys(RACEWAYS, np.ones(axes.shape, dtype=bool))
    _solve_missing(parameters, axes, everywhere, solved, executor, progress)
    contact_map = ContactMap(parameters, axes, solved.samples(axes, everywhere), everywhere)
    while (chosen := _axis_to_halve(contact_map, grid)) is not None:
        axis, unknown = chosen
        mask = {raceway: sampling.at_new_nodes(middles, axis) for raceway, middles in unknown.items()}
        contact_map = sampling.halved(contact_map, axis)
        _solve_missing(parameters, contact_map.axes, mask, solved, executor, progress)
        contact_map = sampling.with_solved(contact_map, solved.samples(contact_map.axes, mask), mask)
    return contact_map


def _axis_to_halve(contact_map: ContactMap, grid: MapGrid) -> tuple[int, dict[str, sampling.Mask]] | None:
    """The axis along which the largest share of cells is above the tolerance, and these cells; None: there is none."""
    largest, chosen = 0.0, None
    for axis in range(3):
        if (
            sampling.halvable(contact_map.axes, axis)
            and contact_map.axes.refined(axis).shape[axis] <= grid.contact_most[axis]
        ):
            unknown = sampling.unknown_middles(contact_map, axis, grid.contact_tolerance)
            share = float(np.mean([mask.mean() for mask in unknown.values()]))
            if share > largest:
                largest, chosen = share, (axis, unknown)
    return chosen


def _solve_missing(
    parameters: Parameters,
    axes: ContactAxes,
    mask: Mapping[str, sampling.Mask],
    solved: Solved,
    executor: Executor,
    progress: Progress | None,
) -> None:
    """Solve the nodes of a mask that are not solved yet; every finished piece is stored at once."""
    loads, speeds, temperatures = axes.nodes
    jobs = {}
    waiting = 0
    # heavy balls take longest: first, so that no worker is idle at the end
    for i, load in reversed(list(enumerate(loads.tolist()))):
        for raceway in RACEWAYS:
            for k, temperature in enumerate(temperatures.tolist()):
                missing = solved.missing(raceway, load, speeds[mask[raceway][i, :, k]], temperature)
                waiting += 2 * missing.size
                for first in range(0, missing.size, PIECE):
                    piece = missing[first : first + PIECE]
                    job = executor.submit(_solve_row, parameters, raceway, load, piece, temperature)
                    jobs[job] = raceway, load, piece, temperature
    # grows as axes are halved
    total = 2 * len(solved) + waiting
    try:
        for job in as_completed(jobs):
            raceway, load, piece, temperature = jobs[job]
            solved.add(raceway, load, piece, temperature, job.result())
            waiting -= 2 * piece.size
            if progress is not None:
                progress(total - waiting, total, "contacts solved")
    except BaseException:
        for job in jobs:
            job.cancel()
        raise


def viscous_values(parameters: Parameters, contact_map: ContactMap, thermal: bool, grid: MapGrid) -> Array:
    """Viscous torque base and effective film of one nut, screw and nut [N.m], [m].

    Parameters   thermal: whether the film is that of the thermal solve
    Returns      (n_force, n_speed, n_temperature, 4)
    """
    forces, speeds, temperatures = _nodes(grid)
    film = _GridFilm(contact_map, FILMS[1] if thermal else FILMS[0])
    values = np.empty((forces.size, speeds.size, temperatures.size, 4))
    for i, force in enumerate(forces):
        loads = nut_loads(parameters.screw, float(force), parameters.screw.ball_count)
        sums = nut_sums(parameters, loads, speeds[:, None], temperatures, film)
        columns = sums.viscous_screw, sums.viscous_nut, sums.film_screw, sums.film_nut
        values[i] = np.stack(columns, axis=-1)
    return values


def extreme_values(parameters: Parameters, contact_map: ContactMap, grid: MapGrid) -> Array:
    """Least films and largest rise over the load-carrying balls of one nut (..., 6).

    Minimum film screw, nut; central film screw, nut [m]; temperature rise screw, nut [K]. Films fall and heating
    rises with load, but not everywhere: both ends of the range of loads are evaluated.
    """
    forces, *points = _nodes(grid)
    values = np.empty((forces.size, *(nodes.size for nodes in points), 6))
    for i, force in enumerate(forces):
        loads = nut_loads(parameters.screw, float(force), parameters.screw.loaded_ball_count)
        ends = np.array([loads.min(), loads.max()])
        for r, raceway in enumerate(RACEWAYS):
            for column, name in ((r, FILMS[2]), (2 + r, FILMS[1])):
                values[i, ..., column] = contact_map.evaluate_grid(raceway, name, ends, *points).min(axis=0)
            rise = contact_map.evaluate_grid(raceway, "temperature_rise", ends, *points)
            values[i, ..., 4 + r] = rise.max(axis=0)
    return values


class _GridFilm:
    """Film model for all speeds (s, 1) and temperatures (t,) at once: (n, s, t)."""

    name = "grid"

    def __init__(self, contact_map: ContactMap, quantity: str) -> None:
        self.contact_map, self.quantity = contact_map, quantity

    def central_film(self, raceway: str, load: Array, speed: Any, temperature: Any) -> Array:
        return self.contact_map.evaluate_grid(raceway, self.quantity, load, speed.ravel(), temperature)


def force_values(parameters: Parameters, grid: MapGrid) -> Array:
    """Quantities of the force of a nut alone (n_force, 4), columns as packed.FORCE_CURVES names them."""
    screw = parameters.screw
    film = _AnyFilm()
    values = np.empty((grid.force[2], len(FORCE_CURVES)))
    for i, force in enumerate(_nodes(grid)[0]):
        sums = nut_sums(
            parameters, nut_loads(screw, float(force), screw.ball_count), 1.0, grid.temperature[0], film
        )
        heaviest = float(nut_loads(screw, float(force), screw.loaded_ball_count).max())
        angle = float(contact_angle_at_ball_load(screw, heaviest))
        p_max = max(
            float(ellipse(heaviest, *reduced_radii(screw, angle, raceway), E_prime(screw)).p_max)
            for raceway in RACEWAYS
        )
        values[i] = sums.hysteresis, sums.sliding, p_max, heaviest
    return values


class _AnyFilm:
    """A film for sums that do not depend on it."""

    name = "none"

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        return np.full(load.shape, 1e-7)


def sharing_values(parameters: Parameters, grid: MapGrid) -> tuple[Array, Array]:
    """Separation load over preload (n_preload, 2) and (relieved force/preload)^(2/3) (n_preload, n_share, 2).

    Last axis: axial load > 0 and < 0. Columns as bspline.map_arrays takes them.
    """
    screw, count = parameters.screw, parameters.screw.ball_count
    preloads = np.geomspace(*grid.preload)
    shares = np.linspace(0.0, 1.0, grid.share_nodes)
    ratio = np.empty((preloads.size, 2))
    relieved = np.zeros((preloads.size, shares.size, 2))
    for i, preload in enumerate(preloads):
        for side, sign in enumerate((1, -1)):
            largest = abs(separation_load(screw, float(preload), count, sign))
            ratio[i, side] = largest / preload
            for k, share in enumerate(shares[:-1]):
                both = double_nut_loads(screw, float(preload), float(sign * share * largest), count)
                force = min(both.force_a, both.force_b) if share > 0.0 else preload
                relieved[i, k, side] = (max(force, 0.0) / preload) ** (2.0 / 3.0)
    return ratio, relieved


def _nodes(grid: MapGrid) -> tuple[Array, Array, Array]:
    return np.geomspace(*grid.force), np.geomspace(*grid.speed), np.linspace(*grid.temperature)


def build_map(
    parameters: Parameters,
    workers: int | None = None,
    progress: Progress | None = None,
    grid: MapGrid | None = None,
    executor: Executor | None = None,
    journal: Path | None = None,
) -> BuiltMap:
    """Build the map of a screw with the kinematics that its parameters name.

    Parameters   workers: processes, None = one per core;  progress: called while it runs;  grid: None = the default
                 executor: any executor of the concurrent.futures interface instead of own processes;  journal: file
                 of contacts solved by a build that was interrupted, continued by this one
    Returns      BuiltMap, to be written by file.save_map
    Raises       UnconvergedContactError, ValueError
    """
    grid = grid or MapGrid()
    with ExitStack() as stack:
        record = None
        if journal is not None:
            record = stack.enter_context(Journal(journal, map_parameters_json(parameters), __version__))
        if executor is None:
            executor = stack.enter_context(worker_pool(workers))
        contact_map = build_contact_map(parameters, grid, executor, progress, record)
    forces = force_values(parameters, grid)
    sharing = sharing_values(parameters, grid)
    extremes = extreme_values(parameters, contact_map, grid)
    arrays = {}
    for thermal, name in ((False, "solved"), (True, "solved_thermal")):
        values = np.concatenate([viscous_values(parameters, contact_map, thermal, grid), extremes], axis=-1)
        arrays[name] = dict(map_arrays(values, forces, *sharing))
    header = {
        "axes": {
            "force": list(grid.force),
            "speed": list(grid.speed),
            "temperature": list(grid.temperature),
            "preload": list(grid.preload),
            "share": [0.0, 1.0, grid.share_nodes],
        },
        "kinematics": parameters.friction.kinematics,
        "version": __version__,
        "contacts": 2 * sum(int(mask.sum()) for mask in contact_map.solved.values()),
        "sampling_errors": dict(
            zip(("load", "speed", "temperature"), sampling.axis_errors(contact_map), strict=True)
        ),
        "asymptotic_share": float(
            np.mean([contact_map.samples[raceway]["asymptotic"] for raceway in RACEWAYS])
        ),
    }
    return BuiltMap(header, arrays, contact_map)
