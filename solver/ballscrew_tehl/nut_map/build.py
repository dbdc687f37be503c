"""Building a map: solve contacts of one ball over the range, then sum them over the balls of a nut."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, ThreadPoolExecutor, wait
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from .. import __version__
from ..contact import UnconvergedContactError, solve_ball
from ..friction.mechanistic import law_constants, nut_powers
from ..friction.sets import default_friction_set
from ..friction.torque import load_torques, nut_sums
from ..parameters.file import FOUR_POINT, Parameters
from ..parameters.identity import parameters_hash
from ..parameters.units import CELSIUS, RPM
from ..physics.hertz import RACEWAYS
from ..physics.load import double_nut_loads, nut_loads, separation_load
from ..runtime.bspline import fit, map_arrays
from ..runtime.packed import FORCE_CURVES, MECHANISTIC, TORQUE_CURVES
from . import sampling
from .atlas import atlas_quantities, load_atlas
from .contact_map import ContactMap, ContactModel, MapContacts, screw_atlases
from .contacts import (
    FILMS,
    MIN_FILM,
    QUANTITIES,
    VISCOUS,
    Array,
    ContactRange,
    SolvedContacts,
    film_parameters,
)
from .grid import BuiltMap, MapGrid, contact_range, largest_pressure, map_grid, narrowed
from .interval import BAND, band
from .journal import Contact, Journal, Key
from .workers import Progress, interrupt_held, worker_pool

#: share of its friction by which a contact that did not converge may be uncertain; above, the range is cut before it
UNCERTAIN = 0.02
#: seconds after which progress is shown again, for a contact may take a minute
ALIVE = 20.0
#: share of the contacts that must be solved for a map
MIN_SOLVED = 0.5
#: every third temperature, at which the shear of balls on two flanks is summed; its mean changes by 1.6e-3 at most
SPARSE = slice(1, None, 3)


class MapNotBuiltError(ArithmeticError):
    """Too few contacts of the range could be solved; the message says which share and what remedies there are."""


def _solve_contact(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float, heated: bool = False
) -> Contact:
    """Isothermal (NaN if heated) and thermal contact of one ball; one that does not converge is NaN."""
    point = raceway, load, speed, temperature
    try:
        cold = None if heated else solve_ball(parameters, *point, thermal=False)
        hot = solve_ball(parameters, *point, thermal=True)
    except UnconvergedContactError:
        return dict.fromkeys(QUANTITIES, math.nan)
    return {
        "isothermal_central_film": math.nan if cold is None else float(cold.h_c),
        "thermal_central_film": float(hot.h_c),
        "thermal_minimum_film": float(hot.h_m),
        "temperature_rise": float(hot.temperature_rise_mean),
        "rolling_loss": float(hot.rolling_loss),
        "core_pressure": float(hot.core_pressure),
        "core_area": float(hot.core_area),
        "mean_rise": float(hot.mean_temperature - temperature),
        "asymptotic": float(any(each is not None and each.branch == "asymptotic" for each in (cold, hot))),
    }


def _key(parameters: Parameters, raceway: str, point: Sequence[float]) -> Key:
    """Numbers to 12 digits, which distinguish two nodes."""
    return parameters.friction.kinematics, raceway, *(f"{value:.12g}" for value in point)


def build_contact_map(
    parameters: Parameters,
    grid: MapGrid,
    executor: Executor,
    progress: Progress | None = None,
    journal: Journal | None = None,
) -> ContactMap:
    """Solve contacts on an executor until films left out are predicted well enough: isothermal, unless heated, thermal.

    Parameters   journal: contacts solved before, and where those solved now are written at once
    Raises       MapNotBuiltError: fewer than MIN_SOLVED of the contacts converged
    """
    range_ = contact_range(parameters, grid)
    journal = Journal(QUANTITIES) if journal is None else journal
    first, most = contact_counts(parameters, grid)
    atlas = load_atlas().hash if grid.atlas and atlas_quantities(parameters) else ""
    atlases = screw_atlases(parameters, range_, atlas)
    whole = heated(parameters, grid)
    points = {
        r: sampling.first_contacts(parameters, r, range_, first, atlases[r] if whole else None)
        for r in RACEWAYS
    }
    models: dict[str, ContactModel] = {}
    round_ = 0
    while True:
        _solve_missing(parameters, points, journal, executor, progress, whole)
        contacts = {
            raceway: _contacts_at(parameters, raceway, points[raceway], journal) for raceway in RACEWAYS
        }
        _refuse_unsolved(contacts, range_)
        hyper = {r: model.hyper for r, model in models.items()} if round_ % 2 else {}
        models = {
            r: ContactModel(parameters, r, range_, contacts[r], hyper.get(r), atlases.get(r))
            for r in RACEWAYS
        }
        open_ = [r for r in RACEWAYS if len(points[r]) < most and not _well_known(models[r], first, grid)]
        if not open_:
            _fit_models(models)
            return ContactMap(parameters, range_, contacts, {r: models[r].hyper for r in RACEWAYS}, atlas)
        for raceway in open_:
            known = len(points[raceway])
            count = min(grid.contact_batch, known, most - known)
            more = sampling.next_points(models[raceway], count, round_)
            points[raceway] = np.concatenate([points[raceway], more])
        round_ += 1


def _contacts_at(parameters: Parameters, raceway: str, points: Array, journal: Journal) -> SolvedContacts:
    solved = [journal.contacts[_key(parameters, raceway, point)] for point in points.tolist()]
    return SolvedContacts(points, {name: np.array([each[name] for each in solved]) for name in QUANTITIES})


def _fit_models(models: Mapping[str, ContactModel]) -> None:
    """Fit what all quantities are interpolated by, raceways side by side; most of it reads the atlas."""
    with ThreadPoolExecutor(len(models)) as threads:
        list(threads.map(lambda model: [model.kriging(name) for name in model.interpolated], models.values()))


def heated(parameters: Parameters, grid: MapGrid) -> bool:
    """Whether the atlas holds the films of a map, of which only thermal contacts are then solved."""
    return grid.atlas and FILMS[1] in atlas_quantities(parameters)


def contact_counts(parameters: Parameters, grid: MapGrid) -> tuple[int, int]:
    """Contacts of each raceway that a map begins with, and the most that it takes."""
    if heated(parameters, grid):
        return grid.contact_check, 2 * grid.contact_check
    return grid.contact_first, grid.contact_max


def _well_known(model: ContactModel, first: int, grid: MapGrid) -> bool:
    """Whether what is left out is predicted well enough: in the mean, and the worst of it (sampling.refined).

    Of the first contacts, spread over the range: those that follow lie where the solver scatters most.
    """
    errors = sampling.left_out_errors(model)[: np.count_nonzero(model.contacts.good[:first])]
    return bool(errors.mean() <= grid.contact_tolerance and errors.max() <= grid.contact_largest)


def _refuse_unsolved(contacts: Mapping[str, SolvedContacts], range_: ContactRange) -> None:
    good, total = sum(int(c.good.sum()) for c in contacts.values()), sum(map(len, contacts.values()))
    if not total:
        raise MapNotBuiltError(
            f"no contact of the range has a film above {1e9 * MIN_FILM:g} nm, below which none is solved: give a "
            "higher speed by --speed-rpm, a lower temperature by --temperature-c, or a thicker oil"
        )
    if not good >= MIN_SOLVED * total:
        raise MapNotBuiltError(
            f"{total - good} of {total} contacts of the range did not converge (ball load {range_.load[0]:.3g} to "
            f"{range_.load[1]:.3g} N, {range_.speed[0] / RPM:.3g} to {range_.speed[1] / RPM:.4g} r/min, "
            f"{range_.temperature[0] - CELSIUS:g} to {range_.temperature[1] - CELSIUS:g} C): give a narrower range by "
            "--preload-n, --speed-rpm, --temperature-c"
        )


def _solve_missing(
    parameters: Parameters,
    points: Mapping[str, Array],
    journal: Journal,
    executor: Executor,
    progress: Progress | None,
    only_heated: bool,
) -> None:
    """Solve the points of each raceway that are not solved yet; every finished contact is stored at once."""
    jobs = {}
    solve = partial(_solve_contact, heated=True) if only_heated else _solve_contact
    for raceway, at in points.items():
        for point in at.tolist():
            key = _key(parameters, raceway, point)
            if key not in journal:
                jobs[executor.submit(solve, parameters, raceway, *point)] = key
    # grows as points are added
    total = len(journal) + len(jobs)
    pending = set(jobs)
    try:
        while pending:
            done, pending = wait(pending, ALIVE, FIRST_COMPLETED)
            # what is solved is kept before an interrupt ends the loop
            for job in sorted(done, key=lambda one: one.exception() is not None):
                journal.add(jobs[job], job.result())
            if progress is not None:
                progress(len(journal), total, "contacts solved")
    except BaseException:
        for job in jobs:
            job.cancel()
        raise


def atlas_share(contact_map: ContactMap) -> float:
    """Share of the solved contacts that lie within the range of the atlas; 0 without one."""
    inside = [
        np.zeros(len(model.points), dtype=bool) if model.atlas is None else model.atlas.inside(model.points)
        for model in contact_map.models.values()
    ]
    return float(np.concatenate(inside).mean())


def sampling_errors(contact_map: ContactMap) -> dict[str, float]:
    """Mean error of a film when its contact is left out, by raceway; FILM_FLOOR as sampling counts it."""
    return {
        raceway: float(sampling.left_out_errors(model, sampling.REFINED).mean())
        for raceway, model in contact_map.models.items()
    }


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
    """Quantities of the force of a nut alone (n_force, 5), columns as packed.FORCE_CURVES names them."""
    screw = parameters.screw
    values = np.empty((grid.force[2], len(FORCE_CURVES)))
    for i, force in enumerate(_nodes(grid)[0]):
        alone = load_torques(parameters, nut_loads(screw, float(force), screw.ball_count))
        heaviest = float(nut_loads(screw, float(force), screw.loaded_ball_count).max())
        p_max = largest_pressure(screw, float(force))
        values[i] = *alone, 1.0, p_max, heaviest
    return values


def mechanistic_values(
    parameters: Parameters,
    contact_map: ContactMap,
    grid: MapGrid,
    workers: int | None = None,
    progress: Progress | None = None,
) -> tuple[Array, Array]:
    """Torques of one nut by the mechanistic law and of its force alone.

    Parameters   workers: threads, None = one per core
    Returns      (n_force, n_speed, n_temperature, 4): rolling torque screw and nut, shear torque [N.m], thrust factor;
                 (n_force, 3): hysteresis torque, ball-ball torque at coefficient 1 [N.m], shear of a ball on two flanks
                 over that of one on four alike, geometric mean over speeds and SPARSE temperatures
    """
    forces, speeds, temperatures = _nodes(grid)
    contacts = MapContacts(contact_map)
    values = np.empty((forces.size, speeds.size, temperatures.size, 4))
    alone = np.ones((forces.size, TORQUE_CURVES))

    def fill(i: int) -> None:
        loads = nut_loads(parameters.screw, float(forces[i]), parameters.screw.loaded_ball_count)
        powers = nut_powers(parameters, loads, speeds[:, None], temperatures, contacts)
        columns = powers.rolling_screw, powers.rolling_nut, powers.shear, powers.thrust_factor
        values[i] = np.stack(columns, axis=-1)
        alone[i, :2] = powers.hysteresis, powers.ball_ball
        if parameters.screw.preload_kind == FOUR_POINT:
            free = nut_powers(
                parameters, loads, speeds[:, None], temperatures[SPARSE], contacts, np.zeros_like(loads)
            )
            alone[i, 2] = np.exp(np.mean(np.log(free.shear / powers.shear[:, SPARSE])))

    # the first makes the tables that all share; the equilibria of the others run side by side
    fill(0)
    with ThreadPoolExecutor(workers or os.cpu_count()) as threads:
        for done, _ in enumerate(threads.map(fill, range(1, forces.size)), 2):
            if progress is not None:
                progress(done, forces.size, "map: sums over the balls")
    return values, alone


def mechanistic_coefficients(
    parameters: Parameters, contact_map: ContactMap, header: Mapping[str, Any]
) -> tuple[Array, Array]:
    """Spline coefficients of mechanistic_values on the axes of a map, for constants that differ from its own."""
    force, speed, temperature = (tuple(header["axes"][name]) for name in ("force", "speed", "temperature"))
    surfaces, alone = mechanistic_values(parameters, contact_map, MapGrid(force, speed, temperature))
    return fit(np.log(surfaces), (0, 1, 2)), fit(np.log(alone), (0,))


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


def map_journal(path: Path, parameters: Parameters) -> Journal:
    """File of the contacts of a map, to be opened by `with` for build_map: a build continues what it holds."""
    return Journal(QUANTITIES, path, {"version": __version__, "screw and oil": parameters_hash(parameters)})


def build_map(
    parameters: Parameters,
    workers: int | None = None,
    progress: Progress | None = None,
    grid: MapGrid | None = None,
    executor: Executor | None = None,
    journal: Journal | None = None,
) -> BuiltMap:
    """Build the map of a screw with the kinematics that its parameters name.

    The published kinematics has films of rolling balls (contacts.film_parameters): their contacts are solved as well.

    Parameters   workers: processes, and threads of the sums, None = one per core;  progress: called while it runs
                 grid: None = the default
                 executor: any executor of the concurrent.futures interface instead of own processes
                 journal: open file of contacts (map_journal), with those of a build that was interrupted
    Returns      BuiltMap, to be written by file.save_map
    Raises       MapNotBuiltError, ValueError
    """
    grid = grid or map_grid(parameters)
    with interrupt_held():
        # the first sequence reads its tables in a function that drops Ctrl-C, and then has none
        qmc.Sobol(1)
    films = film_parameters(parameters)
    journal = Journal(QUANTITIES) if journal is None else journal
    with ExitStack() as stack:
        if executor is None:
            executor = stack.enter_context(worker_pool(workers))
        contact_map = build_contact_map(parameters, grid, executor, progress, journal)
        film_map = contact_map
        if films is not parameters:
            film_map = build_contact_map(films, grid, executor, progress, journal)
    uncertain, cut = contact_map.uncertain_points(UNCERTAIN), ""
    if len(uncertain):
        grid, cut = narrowed(parameters, grid, uncertain)
    solved = [
        *contact_map.contacts.values(),
        *([] if film_map is contact_map else film_map.contacts.values()),
    ]
    header: dict[str, Any] = {
        "axes": {
            "force": list(grid.force),
            "speed": list(grid.speed),
            "temperature": list(grid.temperature),
            "preload": list(grid.preload),
            "share": [0.0, 1.0, grid.share_nodes],
        },
        "kinematics": parameters.friction.kinematics,
        "film_kinematics": films.friction.kinematics,
        "version": __version__,
        "contacts": sum(map(len, solved)),
        "contacts_not_solved": sum(int(np.sum(~c.good)) for c in solved),
        "range_cut": cut,
        "sampling_errors": sampling_errors(contact_map),
        "atlas": contact_map.atlas,
        "atlas_share": atlas_share(contact_map),
    }
    arrays, forces = {}, force_values(parameters, grid)
    if films is parameters:
        # balls that roll have the mechanistic law
        viscous, alone = mechanistic_values(parameters, contact_map, grid, workers, progress)
        arrays[f"{VISCOUS}{MECHANISTIC}"] = fit(np.log(viscous), (0, 1, 2))
        forces[:, :TORQUE_CURVES] = alone
        header[MECHANISTIC] = law_constants(parameters)
        header[BAND] = band(parameters, contact_map, header["axes"], default_friction_set(parameters))
    else:
        for thermal, name in enumerate(("solved", "solved_thermal")):
            viscous = viscous_values(parameters, contact_map, bool(thermal), grid)
            arrays[f"{VISCOUS}{name}"] = fit(np.log(viscous), (0, 1, 2))
    extremes, sharing = extreme_values(films, film_map, grid), sharing_values(parameters, grid)
    arrays |= map_arrays(extremes, forces, *sharing)
    arrays["extreme_coefficients"] = arrays.pop("coefficients")
    return BuiltMap(header, arrays, contact_map)
