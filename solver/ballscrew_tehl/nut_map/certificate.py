"""Certificate of a map: its errors against direct per-ball solves at points that were not used to build it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor, as_completed
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..friction.sets import default_friction_set
from ..parameters.file import Parameters
from ..physics.ball_formula import film_formula
from ..physics.hertz import RACEWAYS
from ..physics.load import nut_loads
from ..runtime.packed import POINT
from .contacts import MIN_FILM, film_parameters

if TYPE_CHECKING:
    from ..runtime.evaluate import NutMap
    from .workers import Progress


def operating_points(nut_map: NutMap, count: int, seed: int = 1) -> np.ndarray:
    """Random points inside a map (count, 4): preload [N], speed [rad/s], temperature [K], axial load [N].

    Every second point has an axial load, up to 1.5 times the preload either way, both nuts within the map.
    """
    generator = np.random.default_rng(seed)
    axes = nut_map.header["axes"]
    u = generator.random((count, 4))
    lowest, highest = (
        max(axes[name][0] for name in ("force", "preload")),
        min(axes["force"][1], axes["preload"][1]),
    )
    preload = lowest * (highest / lowest) ** u[:, 0]
    speed = axes["speed"][0] * (axes["speed"][1] / axes["speed"][0]) ** u[:, 1]
    temperature = axes["temperature"][0] + (axes["temperature"][1] - axes["temperature"][0]) * u[:, 2]
    reach = np.minimum(1.5 * preload, axes["force"][1] - preload)
    axial = np.where(np.arange(count) % 2 == 1, (2.0 * u[:, 3] - 1.0) * reach, 0.0)
    return np.stack([preload, speed, temperature, axial], axis=1)


def slow_points(nut_map: NutMap, count: int, seed: int = 2) -> np.ndarray:
    """Random points as operating_points without axial load, below the lowest speed of a map down to SLOW of it."""
    points = operating_points(nut_map, count, seed)
    lowest = nut_map.header["axes"]["speed"][0]
    points[:, 1] = lowest * SLOW ** np.random.default_rng(seed).random(count)
    points[:, 3] = 0.0
    return points


#: lowest speed of slow_points over that of the map; one of them for so many operating points
SLOW, PER_SLOW_POINT = 0.5, 20
#: points drawn for each one of a certificate, of which some have too thin a film
SPARE = 2
#: parts of a certificate
PRELOAD_ALONE, AXIAL_LOAD, BELOW_SPEED = "preload alone", "axial load", "below the lowest speed"
#: quantiles of a certificate by the ends of their keys
QUANTILES = {0.5: "50", 0.99: "99", 0.999: "999"}


class Deviation(NamedTuple):
    """Relative error of a map at one operating point against direct per-ball solves."""

    torque: float
    film: float
    temperature_rise: float


NOT_SOLVED = Deviation(math.nan, math.nan, math.nan)


def deviation_at(nut_map: NutMap, parameters: Parameters, point: tuple[float, ...]) -> Deviation:
    """Errors of friction torque, least central film and largest rise [of the rise, of 1 K if that is more].

    Parameters   point: preload [N], speed [rad/s], temperature [K], axial load [N]
    Returns      NOT_SOLVED where a contact did not converge
    """
    from ..contact import UnconvergedContactError
    from ..refinement.direct import mean_ball_state

    friction_set = default_friction_set(parameters)
    preload, speed, temperature, axial_load = point
    state = nut_map.evaluate(preload, speed, temperature, axial_load, *friction_set.values)
    torque = float(state.friction_torque)
    shown = film_parameters(parameters)
    try:
        direct = mean_ball_state(parameters, friction_set, preload, speed, temperature, axial_load, shown)
    except UnconvergedContactError:
        return NOT_SOLVED
    films = ("film_thickness_central_screw", "film_thickness_central_nut")
    rise = direct.film_temperature_rise
    return Deviation(
        abs(torque / direct.friction_torque - 1.0),
        max(abs(getattr(state, name) / getattr(direct, name) - 1.0) for name in films),
        abs(state.film_temperature_rise - rise) / max(rise, 1.0),
    )


def deviation_from_direct(
    nut_map: NutMap,
    parameters: Parameters,
    count: int,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Relative deviations of a map from direct per-ball solves at random points.

    Parameters   executor: of the concurrent.futures interface, None = in this process
    Returns      points; mean, median, 99 and 99.9 % quantile, largest deviation of torque, film and temperature rise;
                 points_not_solved: those that count nowhere because a contact did not converge; regions: the same for
                 the points with preload alone, those with an axial load, and further ones below the lowest speed of the
                 map, which do not count in the whole; all points have films above MIN_FILM;
                 each: the points [N, rad/s, K, N] and the deviations there by column, rounded to six and three digits
    Raises       ArithmeticError: no contact converged
    """
    slow = _with_films(parameters, slow_points(nut_map, math.ceil(count / PER_SLOW_POINT)))
    whole = _with_films(parameters, operating_points(nut_map, SPARE * count))[:count]
    places = np.concatenate([whole, slow])
    points = [tuple(point) for point in places.tolist()]
    # thick films take longest: one of them alone at the end would leave the other workers idle
    order = np.argsort(-_least_films(parameters, places), kind="stable").tolist()
    results: Iterator[tuple[int, Deviation]]
    if executor is None:
        results = ((k, deviation_at(nut_map, parameters, points[k])) for k in order)
    else:
        jobs = {executor.submit(deviation_at, nut_map, parameters, points[k]): k for k in order}
        results = ((jobs[job], job.result()) for job in as_completed(jobs))
    if progress is not None:
        # the time of the first one counts
        progress(0, len(points), "points of the certificate")
    found: dict[int, Deviation] = {}
    for k, deviation in results:
        found[k] = deviation
        if progress is not None:
            progress(len(found), len(points), "points of the certificate")
    return certificate_of(points, [found[k] for k in range(len(points))], len(slow))


def _with_films(parameters: Parameters, points: np.ndarray) -> np.ndarray:
    """Those of some points where the balls of a nut under the preload have films above MIN_FILM."""
    return np.asarray(points[_least_films(parameters, points) >= MIN_FILM])


def _least_films(parameters: Parameters, points: np.ndarray) -> np.ndarray:
    """Least film [m] of the heaviest ball of a nut under the preload at points (n, 4), by the closed formula."""
    screw = parameters.screw
    load = np.array([nut_loads(screw, float(f), screw.loaded_ball_count).max() for f in points[:, 0]])
    films = [film_formula(parameters, raceway, load, points[:, 1], points[:, 2]) for raceway in RACEWAYS]
    return np.asarray(np.min(films, axis=0))


def certificate_of(
    points: Sequence[tuple[float, ...]], found: Sequence[Deviation], slow: int = 0
) -> dict[str, Any]:
    """Certificate of the deviations at some points, NaN where no direct solution was found.

    slow: how many of the points, the last ones, lie below the lowest speed of the map
    Raises       ArithmeticError: no point has a direct solution
    """
    errors, places = np.array(found), np.array(points)
    known = np.isfinite(errors).all(axis=1)
    whole = np.arange(len(points)) < len(points) - slow
    if not known[whole].any():
        raise ArithmeticError(f"none of {whole.sum()} points of the certificate has a direct solution")
    held = places[known & whole]
    each = {name: _rounded(column, 6) for name, column in zip(POINT, held.T, strict=True)}
    for name, column in zip(Deviation._fields, errors[known & whole].T, strict=True):
        each[f"{name}_error"] = _rounded(column, 3)
    regions = {
        PRELOAD_ALONE: whole & (places[:, 3] == 0.0), AXIAL_LOAD: whole & (places[:, 3] != 0.0), BELOW_SPEED: ~whole
    }  # fmt: skip
    return {
        **_totals(errors[known & whole]),
        "points_not_solved": int(np.sum(~known & whole)),
        "regions": {
            name: _totals(errors[known & mask]) for name, mask in regions.items() if (known & mask).any()
        },
        "each": each,
    }


def _totals(errors: np.ndarray) -> dict[str, Any]:
    """Number of points, and mean, quantiles and largest of each column of their errors (n, 3)."""
    result: dict[str, Any] = {"points": len(errors)}
    for name, column in zip(Deviation._fields, errors.T, strict=True):
        result[f"{name}_error_mean"] = float(column.mean())
        for share, key in QUANTILES.items():
            result[f"{name}_error_{key}"] = float(np.quantile(column, share))
        result[f"{name}_error_max"] = float(column.max())
    return result


def _rounded(column: Iterable[float], digits: int) -> list[float]:
    return [float(f"{value:.{digits}g}") for value in column]
