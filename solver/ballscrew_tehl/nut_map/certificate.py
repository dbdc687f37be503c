"""Errors of one map against direct per-ball solves, for whoever doubts the certificate of the atlas."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, as_completed
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..friction.sets import default_friction_set
from ..parameters.file import Parameters
from ..physics.film import MIN_FILM, film_formula
from ..physics.hertz import RACEWAYS
from ..physics.load import nut_loads

if TYPE_CHECKING:
    from ..runtime.evaluate import NutMap
    from .built import Progress


#: what the progress of a certificate is called
STAGE = "certificate: points solved"
#: regions of a certificate; those of the whole, and one beyond it
PRELOAD_ALONE, AXIAL_LOAD, BELOW_SPEED = "preload alone", "axial load", "below the lowest speed"
WHOLE = (PRELOAD_ALONE, AXIAL_LOAD)
#: lowest speed of points below that of the map, over it; one of them for so many points of the whole
SLOW, PER_SLOW_POINT = 0.5, 20
#: points drawn for each one of a certificate and at least in each region, of which some have too thin a film
SPARE, LEAST_DRAWN = 4, 32
#: preloads between whose heaviest balls others are interpolated, to find the films that are too thin
PRELOADS = 33
#: seed of the points of a certificate
SEED = 1
#: central film [m] of about the contacts that take least time; thicker and thinner ones take more
QUICKEST_FILM = 40e-9
#: points that are solved last, those that take least time
LAST = 8
#: rise [K] below which an error is relative to this one: 5 % of it is half a kelvin
LEAST_RISE = 10.0
#: quantiles of a certificate by the ends of their keys
QUANTILES = {0.5: "50", 0.99: "99", 0.999: "999"}
#: how sure a claim is
CONFIDENCE = 0.95


class Deviation(NamedTuple):
    """Relative error of a map at one operating point against direct per-ball solves."""

    torque: float
    film: float
    temperature_rise: float


NOT_SOLVED = Deviation(math.nan, math.nan, math.nan)


def points_of(count: int) -> int:
    """Points that a certificate of so many solves: further ones below the lowest speed."""
    return count + math.ceil(count / PER_SLOW_POINT)


def region_points(nut_map: NutMap, parameters: Parameters, count: int) -> dict[str, np.ndarray]:
    """Operating points (n, 4) of a certificate by region: preload [N], speed [rad/s], temperature [K], axial load [N].

    Half of count without axial load; half with one up to 1.5 times the preload either way, both nuts within the map;
    and further ones without below the lowest speed of the map, down to SLOW of it. Films of balls under the preload
    above MIN_FILM. Random, fewer points are the first ones of more.
    """
    sizes = count - count // 2, count // 2, points_of(count) - count
    points = {}
    for number, (region, size) in enumerate(zip((*WHOLE, BELOW_SPEED), sizes, strict=True)):
        unit = np.random.default_rng(SEED + number).random((max(SPARE * size, LEAST_DRAWN), 4))
        at = _operating_points(nut_map, unit, region)
        points[region] = at[_least_films(parameters, at) >= MIN_FILM][:size]
    return points


def _operating_points(nut_map: NutMap, unit: np.ndarray, region: str) -> np.ndarray:
    """Points of a region (n, 4) from those of the unit cube."""
    axes = nut_map.header["axes"]
    lowest = max(axes[name][0] for name in ("force", "preload"))
    highest = min(axes["force"][1], axes["preload"][1])
    preload = lowest * (highest / lowest) ** unit[:, 0]
    slow, fast = axes["speed"][:2]
    if region == BELOW_SPEED:
        slow, fast = SLOW * slow, slow
    speed = slow * (fast / slow) ** unit[:, 1]
    temperature = axes["temperature"][0] + (axes["temperature"][1] - axes["temperature"][0]) * unit[:, 2]
    reach = np.minimum(1.5 * preload, axes["force"][1] - preload) if region == AXIAL_LOAD else 0.0
    return np.stack([preload, speed, temperature, (2.0 * unit[:, 3] - 1.0) * reach], axis=1)


def claim(points: int) -> str:
    """What the largest error of so many points says of all others, in one sentence.

    Source       order statistics: the largest of n random points bounds the share q of all with the confidence 1 - q^n
    """
    share = (1.0 - CONFIDENCE) ** (1.0 / points)
    return (
        f"Of {points} random points, half of them under axial load, the largest error bounds {100.0 * share:.3g} % "
        f"of such points with {100.0 * CONFIDENCE:.0f} % confidence; nothing is claimed of the rest."
    )


def deviation_at(nut_map: NutMap, parameters: Parameters, point: tuple[float, ...]) -> Deviation:
    """Errors of friction torque, least central film and largest rise [of the rise, of LEAST_RISE if that is more].

    Parameters   point: preload [N], speed [rad/s], temperature [K], axial load [N]
    Returns      NOT_SOLVED where a contact did not converge
    """
    from ..contact import UnconvergedContactError
    from ..refinement.direct import mean_ball_state, rolling_parameters

    friction_set = default_friction_set(parameters)
    preload, speed, temperature, axial_load = point
    state = nut_map.evaluate(preload, speed, temperature, axial_load, *friction_set.values)
    torque = float(state.friction_torque)
    shown = rolling_parameters(parameters)
    try:
        direct = mean_ball_state(parameters, friction_set, preload, speed, temperature, axial_load, shown)
    except UnconvergedContactError:
        return NOT_SOLVED
    films = ("film_thickness_central_screw", "film_thickness_central_nut")
    rise = direct.film_temperature_rise
    return Deviation(
        abs(torque / direct.friction_torque - 1.0),
        max(abs(getattr(state, name) / getattr(direct, name) - 1.0) for name in films),
        abs(state.film_temperature_rise - rise) / max(rise, LEAST_RISE),
    )


def deviation_from_direct(
    nut_map: NutMap,
    parameters: Parameters,
    count: int,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Relative deviations of a map from direct per-ball solves at the points of region_points.

    Parameters   executor: of the concurrent.futures interface, None = in this process
    Returns      points; mean, median, 99 and 99.9 % quantile, largest deviation of torque, film and temperature rise;
                 points_not_solved: those that count nowhere because a contact did not converge; regions: the same for
                 the points with preload alone, those with an axial load, and further ones below the lowest speed of the
                 map, which do not count in the whole; all points have films above MIN_FILM;
    Raises       ArithmeticError: no contact converged
    """
    regions = region_points(nut_map, parameters, count)
    places = np.concatenate(list(regions.values()))
    points = [tuple(point) for point in places.tolist()]
    # in an order without trend, for the time left; a long one alone at the end would leave the other workers idle
    quickest = np.argsort(np.abs(np.log(_least_films(parameters, places) / QUICKEST_FILM)), kind="stable")
    last = quickest[:LAST].tolist()
    order = [k for k in np.random.default_rng(SEED).permutation(len(points)).tolist() if k not in last] + last
    results: Iterator[tuple[int, Deviation]]
    if executor is None:
        results = ((k, deviation_at(nut_map, parameters, points[k])) for k in order)
    else:
        jobs = {executor.submit(deviation_at, nut_map, parameters, points[k]): k for k in order}
        results = ((jobs[job], job.result()) for job in as_completed(jobs))
    if progress is not None:
        # the time of the first one counts
        progress(0, len(points), STAGE)
    found = np.empty((len(points), len(Deviation._fields)))
    for done, (k, deviation) in enumerate(results, 1):
        found[k] = deviation
        if progress is not None:
            progress(done, len(points), STAGE)
    ends = np.cumsum([len(at) for at in regions.values()])[:-1]
    return _certificate(dict(zip(regions, np.split(found, ends), strict=True))) | {"what": "this map"}


def _least_films(parameters: Parameters, points: np.ndarray) -> np.ndarray:
    """Least film [m] of the heaviest ball of a nut under the preload at points (n, 4), by the closed formula."""
    screw = parameters.screw
    preloads = np.geomspace(points[:, 0].min(), points[:, 0].max(), PRELOADS)
    heaviest = [nut_loads(screw, float(force), screw.loaded_ball_count).max() for force in preloads]
    load = np.exp(np.interp(np.log(points[:, 0]), np.log(preloads), np.log(heaviest)))
    films = [film_formula(parameters, raceway, load, points[:, 1], points[:, 2]) for raceway in RACEWAYS]
    return np.asarray(np.min(films, axis=0))


def _certificate(errors: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """Certificate of the deviations (n, 3) of each region, NaN where there is no direct solution.

    Raises       ArithmeticError: no point of the whole has one
    """
    good = {region: np.isfinite(found).all(axis=1) for region, found in errors.items()}
    held = np.concatenate([errors[r][good[r]] for r in WHOLE])
    total = sum(len(good[region]) for region in WHOLE)
    if not len(held):
        raise ArithmeticError(f"none of {total} points of the certificate has a direct solution")
    return {
        **error_totals(Deviation._fields, held),
        "points_not_solved": total - len(held),
        "regions": {
            region: error_totals(Deviation._fields, errors[region][known])
            for region, known in good.items()
            if known.any()
        },
    }


def error_totals(names: Sequence[str], errors: np.ndarray) -> dict[str, Any]:
    """Number of points, and mean, quantiles and largest of each column of their errors (n, names), NaN left out."""
    result: dict[str, Any] = {"points": len(errors)}
    for name, column in zip(names, errors.T, strict=True):
        known = column[np.isfinite(column)]
        if known.size:
            result[f"{name}_error_mean"] = float(known.mean())
            for share, key in QUANTILES.items():
                result[f"{name}_error_{key}"] = float(np.quantile(known, share))
            result[f"{name}_error_max"] = float(known.max())
    return result
