"""The certificate of the atlas: maps of random screws and their contacts against direct solves.

Every point is a screw of its own kind of preload, oil and balls at an operating point within the range of its map, half
of them under an axial load. The mean balls of its nuts are solved, on the grid of direct solves and some of them on the
fine grid of the atlas; torques follow from them by the law, and are compared with those of the map of the screw.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, as_completed
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.atlas.contact_atlas import OutsideAtlasError
from ballscrew_tehl.atlas.groups import QUANTITIES, closed_forms
from ballscrew_tehl.contact import UnconvergedContactError, ball_conditions
from ballscrew_tehl.friction.film_shear import nut_forces
from ballscrew_tehl.friction.mechanistic import mean_load, nuts_powers
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map.build import build_map
from ballscrew_tehl.nut_map.grid import Progress, screw_grid
from ballscrew_tehl.nut_map.load import nut_map_of
from ballscrew_tehl.parameters.file import FOUR_POINT, Parameters
from ballscrew_tehl.physics.film import MIN_FILM, film_formula
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.refinement.certificate import LEAST_RISE, error_totals
from ballscrew_tehl.refinement.direct import MeanBallContacts, solved_contact
from ballscrew_tehl.runtime.evaluate import NutMap

from .contacts import solve_contact
from .journal import Journal, solve_missing
from .screws import Contact, of_other_materials, random_screw

#: seed of the screws, points of each, screws drawn for one that is taken
SEED, POINTS_PER_SCREW, TRIES = 20261126, 4, 20
#: number from which on screws have any bodies and half of them oils of other pressure exponents
OTHER_MATERIALS = 300
#: number from which on the axial load is up to 4 times the preload instead of 1.5
FAR_LOADS = 1300
#: minimum film [m] below which it counts in no error: oil is hardly a continuum there
LEAST_FILM = 10e-9
#: what is compared at a point; film: the central one, larger error of the contacts
ERRORS = ("torque", "film", "minimum_film", "temperature_rise")


class Point(NamedTuple):
    """An operating point of a screw: preload [N], speed [rad/s], temperature [K], axial load [N]."""

    preload: float
    speed: float
    temperature: float
    axial_load: float


class Solved(NamedTuple):
    """Contact of the mean ball of a nut, solved: raceway, force of the nut, ball load [N], quantities (SI)."""

    raceway: str
    force: float
    load: float
    values: Mapping[str, float]


@lru_cache(maxsize=4)
def certificate_screw(number: int) -> Parameters:
    """A random screw that has a range of a map and lies inside the packaged atlas."""
    random = np.random.default_rng((SEED, number))
    for _ in range(TRIES):
        parameters = random_screw(random)
        if number >= OTHER_MATERIALS:
            parameters = of_other_materials(parameters, random, 0.5)
        try:
            screw_grid(parameters)
        except (ValueError, ArithmeticError):
            continue
        return parameters
    raise ArithmeticError(f"screw {number}: none of {TRIES} has a map")


def certificate_point(number: int) -> tuple[Parameters, Point]:
    """The point of a number: every second with axial load up to 1.5 times the preload either way, see FAR_LOADS."""
    parameters = certificate_screw(number // POINTS_PER_SCREW)
    grid = screw_grid(parameters)
    random = np.random.default_rng((SEED + 1, number))
    while True:
        preload = grid.preload[0] * (grid.force[1] / grid.preload[0]) ** random.random()
        speed = grid.speed[0] * (grid.speed[1] / grid.speed[0]) ** random.random()
        temperature = random.uniform(*grid.temperature[:2])
        most = 4.0 if number >= FAR_LOADS else 1.5
        reach = min(most * preload, grid.force[1] - preload) if number % 2 else 0.0
        point = Point(preload, speed, temperature, random.uniform(-1.0, 1.0) * reach)
        heaviest = nut_loads(parameters.screw, preload, parameters.screw.loaded_ball_count).max(keepdims=True)
        films = [float(film_formula(parameters, r, heaviest, speed, temperature)[0]) for r in RACEWAYS]
        if min(films) >= MIN_FILM:
            return parameters, point


def solve_point(number: int, fine: bool) -> list[list[Any]] | str:
    """Solved contacts of the mean balls of a point as rows; a text where one did not converge."""
    parameters, point = certificate_point(number)
    screw, result = parameters.screw, []
    for force in sorted({f for f in nut_forces(parameters, point.preload, point.axial_load) if f > 0.0}):
        load = mean_load(nut_loads(screw, force, screw.loaded_ball_count))
        for raceway in RACEWAYS:
            at = raceway, load, point.speed, point.temperature
            if not fine:
                try:
                    values = solved_contact(parameters, *at)
                except UnconvergedContactError as error:
                    return str(error)
            else:
                contact = Contact(ball_conditions(parameters, *at), parameters.lubricant, parameters.solids)
                better = solve_contact(contact)
                if "reason" in better:
                    return str(better["reason"])
                values = {name: float(better[name]) for name in QUANTITIES}
            result.append([raceway, force, load, values])
    return result


def solve_points(
    numbers: Sequence[int], fine: bool, journal: Journal, executor: Executor, progress: Progress | None = None
) -> None:
    """Solve those points that are not in the journal, by number and grid."""
    jobs = {f"{n} {'fine' if fine else 'direct'}": (n, fine) for n in numbers}
    solve_missing(solve_point, jobs, journal, executor, progress, "points of the certificate")


def direct_torque(parameters: Parameters, point: Point, solved: Sequence[Solved]) -> float:
    """Torque [N.m] from the solved mean balls by the law."""
    ratio, coefficient, _ = default_friction_set(parameters).values
    by_raceway = {r: [(s.load, s.values) for s in solved if s.raceway == r] for r in RACEWAYS}
    forces, contacts = (
        nut_forces(parameters, point.preload, point.axial_load), MeanBallContacts(parameters, by_raceway)
    )  # fmt: skip
    nuts = nuts_powers(parameters, forces, contacts, point.speed, point.temperature)
    return float(sum(times * nut.torque(ratio, coefficient) for times, nut in nuts))


def contact_errors(found: Mapping[str, float], reference: Mapping[str, float]) -> list[float]:
    """Errors of the films and of the rise of a contact; the minimum film NaN below LEAST_FILM."""
    thin = reference["minimum_film"] < LEAST_FILM
    rise = reference["temperature_rise"]
    return [
        abs(found["central_film"] / reference["central_film"] - 1.0),
        np.nan if thin else abs(found["minimum_film"] / reference["minimum_film"] - 1.0),
        abs(found["temperature_rise"] - rise) / max(rise, LEAST_RISE),
    ]


def _largest(errors: Sequence[Sequence[float]]) -> list[float]:
    """Of each column, NaN where none is defined."""
    return [max((e for e in column if e == e), default=np.nan) for column in zip(*errors, strict=True)]


def point_errors(
    number: int, rows: Sequence[Sequence[Any]], nut_map: NutMap, contacts: BallContacts
) -> tuple[list[float], dict[str, bool]]:
    """ERRORS of the map and of the contacts of the atlas at a point, NaN where none is defined, and its regions.

    A torque of the map that is not in range has none.
    """
    parameters, point = certificate_point(number)
    solved = [Solved(*row) for row in rows]
    values = default_friction_set(parameters).values
    state = nut_map.evaluate(*point, *values)
    result = float(state.friction_torque) if state.in_range else np.nan
    errors, groups = [], []
    for s in solved:
        at = s.raceway, s.load, point.speed, point.temperature
        errors.append(contact_errors({k: float(v) for k, v in contacts.at(*at).items()}, s.values))
        groups.append(closed_forms(contacts.contacts(*at)).groups)
    screw = parameters.screw
    return [abs(result / direct_torque(parameters, point, solved) - 1.0), *_largest(errors)], {
        "axial load": point.axial_load != 0.0,
        "axial load above 1.5 preloads": abs(point.axial_load) > 1.5 * point.preload,
        "oversize balls": screw.preload_kind == FOUR_POINT,
        "silicon nitride": screw.ball_material != "steel",
        "L up to 25": max(float(own.L) for own in groups) <= 25.0,
        "N above 0.3": max(float(own.N) for own in groups) > 0.3,
    }


def screw_errors(
    screw: int, solved: Mapping[str, Sequence[Sequence[Any]]]
) -> dict[str, tuple[list[float], dict[str, bool]]]:
    """point_errors of the points of a screw by their keys; none if the atlas does not hold it."""
    parameters = certificate_screw(screw)
    try:
        nut_map, contacts = nut_map_of(build_map(parameters)), BallContacts(parameters)
    except OutsideAtlasError:
        return {}
    return {key: point_errors(number_of(key), rows, nut_map, contacts) for key, rows in solved.items()}


def grid_errors(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Mean, quantiles and largest of ERRORS of direct solves against those on the fine grid, where both are known."""
    errors = []
    for number in sorted({number_of(key) for key in entries}):
        coarse, fine = (entries.get(f"{number} {grid}") for grid in ("direct", "fine"))
        if isinstance(coarse, list) and isinstance(fine, list):
            parameters, point = certificate_point(number)
            pairs = [(Solved(*one), Solved(*other)) for one, other in zip(coarse, fine, strict=True)]
            one, other = (direct_torque(parameters, point, side) for side in zip(*pairs, strict=True))
            films = [contact_errors(a.values, b.values) for a, b in pairs]
            errors.append([abs(one / other - 1.0), *_largest(films)])
    return error_totals(ERRORS, np.array(errors))


def certificate(
    entries: Mapping[str, Any], executor: Executor, progress: Progress | None = None
) -> dict[str, Any]:
    """Mean, quantiles and largest of ERRORS, and of regions, at the points that were solved.

    entries: of the journal, by number and grid. Returns those on the fine grid; against_direct_solves: on the grid of
    direct solves; of_direct_solves: grid_errors; largest_at: number of the point whose torque misses most.
    """
    screws: dict[int, dict[str, Any]] = {}
    for key, rows in entries.items():
        if isinstance(rows, list):
            screws.setdefault(number_of(key) // POINTS_PER_SCREW, {})[key] = rows
    result: dict[str, tuple[list[float], dict[str, bool]]] = {}
    running = [executor.submit(screw_errors, *of) for of in screws.items()]
    for done, job in enumerate(as_completed(running), 1):
        result |= job.result()
        if progress is not None:
            progress(done, len(running), "screws of the certificate")

    def totals(grid: str) -> dict[str, Any]:
        keys = sorted((key for key in result if key.endswith(grid)), key=number_of)
        table, sorts = np.array([result[key][0] for key in keys]), [result[key][1] for key in keys]
        return {
            "what": f"random screws (seed {SEED})", "grid": grid,
            "points_not_solved": sum(key.endswith(grid) and isinstance(of, str) for key, of in entries.items()),
            "points_without_torque": int(np.isnan(table[:, 0]).sum()),
            "largest_at": number_of(keys[int(np.nanargmax(table[:, 0]))]),
            **error_totals(ERRORS, table),
            "regions": {
                name: error_totals(ERRORS, table[own])
                for name in sorts[0]
                if (own := np.array([of[name] for of in sorts])).any()
            },
        }  # fmt: skip

    return totals("fine") | {
        "against_direct_solves": totals("direct"),
        "of_direct_solves": grid_errors(entries),
    }


def number_of(key: str) -> int:
    """Of a point by its key in the journal."""
    return int(key.split()[0])
