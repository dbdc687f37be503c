"""The packaged map of the law of the paper: sliding contacts, solved over the range of the GD4008-3, and their sums.

Films of sliding balls are no function of the groups of the atlas. They are interpolated over ball load, speed and
temperature as multiples of the closed forms, in the coordinates in which they change least.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from typing import Any

import numpy as np

from ballscrew_tehl.atlas.ball_contacts import BallContacts, BallRange
from ballscrew_tehl.atlas.contact_atlas import Interpolant
from ballscrew_tehl.atlas.groups import Array
from ballscrew_tehl.contact import UnconvergedContactError, solve_ball
from ballscrew_tehl.friction.film_shear import FilmModel, load_torques, nut_sums
from ballscrew_tehl.nut_map.build import (
    atlas_fraction,
    extreme_values,
    force_values,
    map_header,
    sharing_values,
    shift_values,
)
from ballscrew_tehl.nut_map.grid import BuiltMap, MapGrid, Progress
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.physics.film import MIN_FILM, film_formula, moes_groups_of
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.load import load_nodes, nut_loads
from ballscrew_tehl.physics.lubricant import eta0
from ballscrew_tehl.refinement.direct import rolling_parameters
from ballscrew_tehl.runtime.bspline import map_arrays
from ballscrew_tehl.runtime.packed import TORQUE_CURVES

from .fit import interpolant_of, lengths_and_noise
from .journal import Journal, solve_missing

FILM = "central_film"  # key of an entry of the journal
#: transition of the film over its formula, where the coordinate is stretched: ln(M) + STRETCH tanh(ln(M/TURN)/WIDTH)
STRETCH, TURN, WIDTH = 4.0, 33.0, 0.9
#: first lengths of the coordinates
FIRST = np.array([4.0, 4.0, 40.0])
SEED = 3


def sliding_points(range_: BallRange, parameters: Parameters, raceway: str, count: int) -> Array:
    """Ball load [N], speed [rad/s], temperature [K] (count, 3), at random, with films above MIN_FILM."""
    random, result = np.random.default_rng(SEED + RACEWAYS.index(raceway)), []
    while len(result) < count:
        u = random.random(3)
        (load, heavy), (slow, fast), (cold, hot) = range_
        point = load * (heavy / load) ** u[0], slow * (fast / slow) ** u[1], cold + (hot - cold) * u[2]
        if float(film_formula(parameters, raceway, *(np.array([v]) for v in point))[0]) >= MIN_FILM:
            result.append(point)
    return np.array(result)


def solve_films(parameters: Parameters, raceway: str, point: tuple[float, ...]) -> dict[str, float | str]:
    """Central film [m] of a ball; `reason` alone if it does not converge."""
    try:
        return {FILM: float(solve_ball(parameters, raceway, *point, thermal=True).h_c)}
    except UnconvergedContactError as error:
        return {"reason": str(error)}


def solve_sliding(
    parameters: Parameters, range_: BallRange, count: int, journal: Journal, executor: Executor,
    progress: Progress | None = None,
) -> None:  # fmt: skip
    """Solve `count` sliding contacts of each raceway that are not in the journal."""
    jobs = {
        f"{raceway} {k}": (parameters, raceway, tuple(point))
        for raceway in RACEWAYS
        for k, point in enumerate(sliding_points(range_, parameters, raceway, count).tolist())
    }
    solve_missing(solve_films, jobs, journal, executor, progress, "sliding contacts solved")


class SlidingFilms:
    """Films of sliding balls, interpolated (friction.film_shear.FilmModel).

    entries: of the journal.
    """

    def __init__(
        self, parameters: Parameters, range_: BallRange, entries: Mapping[str, Any], count: int
    ) -> None:
        self.parameters = parameters
        self.errors: dict[str, Array] = {}
        self._interpolants: dict[str, tuple[Interpolant, Array]] = {}
        for raceway in RACEWAYS:
            points = sliding_points(range_, parameters, raceway, count)
            known = [k for k in range(count) if FILM in entries.get(f"{raceway} {k}", {})]
            at = points[known]
            films = np.array([entries[f"{raceway} {k}"][FILM] for k in known])
            values = np.log(films / film_formula(parameters, raceway, *at.T))[:, None]
            x, noise = self._coordinates(raceway, at), np.ones_like(values)
            lengths, level = lengths_and_noise(x, values, noise, FIRST)
            interpolant, left_out = interpolant_of(x, values, noise, lengths, level)
            self.errors[raceway] = left_out[:, 0]
            self._interpolants[raceway] = interpolant, lengths

    def _coordinates(self, raceway: str, points: Array) -> Array:
        load, speed, temperature = points.T
        M = moes_groups_of(self.parameters, raceway, load, speed, temperature)[0].M
        heated = np.log(speed) + 0.5 * np.log(eta0(self.parameters.lubricant, temperature))
        return np.stack(
            [np.log(M) + STRETCH * np.tanh(np.log(M / TURN) / WIDTH), heated, temperature], axis=1
        )

    def central_film(self, raceway: str, load: Array, speed: Any, temperature: Any) -> Array:
        """Central film [m] of balls with loads (n,) [N]; speed and temperature broadcast to (...): (n, ...)."""
        nodes, weights = load_nodes(load)
        speed, temperature = np.broadcast_arrays(speed, temperature)
        x = np.stack(
            [
                np.repeat(nodes, speed.size), np.tile(speed.ravel(), nodes.size),
                np.tile(temperature.ravel(), nodes.size),
            ],
            axis=1,
        )  # fmt: skip
        interpolant, lengths = self._interpolants[raceway]
        ln = interpolant(self._coordinates(raceway, x) / lengths)[:, 0]
        film = np.exp(ln) * film_formula(self.parameters, raceway, *x.T)
        return np.exp(weights @ np.log(film.reshape(nodes.size, -1))).reshape(len(load), *speed.shape)


def viscous_values(parameters: Parameters, film: FilmModel, grid: MapGrid) -> Array:
    """Viscous torque base and effective film of one nut, screw and nut [N.m], [m]: (force, speed, temperature, 4)."""
    speeds, temperatures = np.geomspace(*grid.speed)[:, None], np.linspace(*grid.temperature)
    values = []
    for force in np.geomspace(*grid.force):
        loads = nut_loads(parameters.screw, float(force), parameters.screw.ball_count)
        sums = nut_sums(parameters, loads, speeds, temperatures, film)
        columns = sums.viscous_screw, sums.viscous_nut, sums.film_screw, sums.film_nut
        values.append(np.stack(columns, axis=-1))
    return np.array(values)


def published_map(
    parameters: Parameters, films: FilmModel, contacts: BallContacts, grid: MapGrid,
    certificate: Mapping[str, Any],
) -> BuiltMap:  # fmt: skip
    """The map of the law of the paper; contacts: of rolling balls, whose films and rises are shown."""
    rolling = rolling_parameters(parameters)
    extremes, sharing = extreme_values(rolling, contacts, grid), sharing_values(parameters, grid)
    forces, count = np.geomspace(*grid.force), parameters.summed_balls
    loads = [nut_loads(parameters.screw, float(force), count) for force in forces]
    alone = np.array([(*load_torques(parameters, each), *(1.0,) * (TORQUE_CURVES - 2)) for each in loads])
    values = np.concatenate([viscous_values(parameters, films, grid), extremes], axis=-1)
    arrays = map_arrays(
        values,
        force_values(parameters, grid, alone),
        np.ones(values.shape[1:3]),
        *sharing,
        shift_values(parameters, grid),
    )
    header = map_header(parameters, grid) | {
        "atlas": contacts.atlas.hash, "atlas_fraction": atlas_fraction(contacts, grid),
        "certificate": dict(certificate),
    }  # fmt: skip
    return BuiltMap(header, arrays, parameters)
