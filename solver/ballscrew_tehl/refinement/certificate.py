"""Errors of one map against direct per-ball solves, to check the certificate of the atlas, and processes for them."""

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, as_completed
from typing import Any, NamedTuple

import numpy as np

from ..friction.sets import default_friction_set
from ..nut_map.grid import Progress
from ..parameters.file import Parameters
from ..physics.film import MIN_FILM, film_formula
from ..physics.hertz import RACEWAYS
from ..physics.load import nut_loads
from ..runtime.evaluate import NutMap

STAGE = "certificate: points solved"  # what the progress of a certificate is called
#: regions of a certificate; those of the whole, and one beyond it
PRELOAD_ALONE, AXIAL_LOAD, BELOW_SPEED = "preload alone", "axial load", "below the lowest speed"
WHOLE = (PRELOAD_ALONE, AXIAL_LOAD)
#: lowest speed of points below that of the map, over it; one of them for so many points of the whole
SLOW, PER_SLOW_POINT = 0.5, 20
#: points drawn for each one of a certificate and at least in each region, of which some have too thin a film
SPARE, LEAST_DRAWN = 4, 32
SEED = 1  # seed of the points of a certificate
#: rise [K] below which an error is relative to this one: 5 % of it is half a kelvin
LEAST_RISE = 10.0
#: quantiles of a certificate by the ends of their keys
QUANTILES = {0.5: "50", 0.99: "99", 0.999: "999"}
CONFIDENCE = 0.95  # how sure a claim is


#: preload [N], speed [rad/s], temperature [K], axial load [N]
Point = tuple[float, float, float, float]


class Deviation(NamedTuple):
    """Relative error of a map at one operating point against direct per-ball solves."""

    torque: float
    film: float
    temperature_rise: float


NOT_SOLVED = Deviation(math.nan, math.nan, math.nan)


def region_points(nut_map: NutMap, parameters: Parameters, count: int) -> dict[str, np.ndarray]:
    """Operating points (n, 4) of a certificate by region: preload [N], speed [rad/s], temperature [K], axial load [N].

    Half of count without axial load; half with one up to 1.5 times the preload either way; further ones without, from
    SLOW of the lowest speed on. Films under the preload above MIN_FILM. Fewer points are the first ones of more.
    """
    sizes = count - count // 2, count // 2, math.ceil(count / PER_SLOW_POINT)
    axes, points = nut_map.header["axes"], {}
    lowest, highest = max(axes["force"][0], axes["preload"][0]), min(axes["force"][1], axes["preload"][1])
    cold, hot = axes["temperature"][:2]
    for number, (region, size) in enumerate(zip((*WHOLE, BELOW_SPEED), sizes, strict=True)):
        unit = np.random.default_rng(SEED + number).random((max(SPARE * size, LEAST_DRAWN), 4))
        slow, fast = axes["speed"][:2]
        if region == BELOW_SPEED:
            slow, fast = SLOW * slow, slow
        preload, speed = lowest * (highest / lowest) ** unit[:, 0], slow * (fast / slow) ** unit[:, 1]
        temperature = cold + (hot - cold) * unit[:, 2]
        reach = np.minimum(1.5 * preload, axes["force"][1] - preload) if region == AXIAL_LOAD else 0.0
        at = np.stack([preload, speed, temperature, (2.0 * unit[:, 3] - 1.0) * reach], axis=1)
        screw, balls = parameters.screw, parameters.screw.loaded_ball_count
        heaviest = np.array([nut_loads(screw, force, balls).max() for force in preload.tolist()])
        films = [film_formula(parameters, raceway, heaviest, speed, temperature) for raceway in RACEWAYS]
        points[region] = at[np.min(films, axis=0) >= MIN_FILM][:size]
    return points


def claim(points: int) -> str:
    """What the largest error of so many points says of all others, in one sentence.

    Order statistics: the largest of n random points bounds the fraction q of all with the confidence 1 - q^n.
    """
    fraction = (1.0 - CONFIDENCE) ** (1.0 / points)
    return (
        f"Of {points} random points, half of them under axial load, the largest error bounds {100.0 * fraction:.3g} % "
        f"of such points with {100.0 * CONFIDENCE:.0f} % confidence; nothing is claimed of the rest."
    )


def deviation_at(nut_map: NutMap, parameters: Parameters, point: Point) -> Deviation:
    """Errors at a point of region_points, of the rise over itself or LEAST_RISE; NOT_SOLVED if no contact converged."""
    from ..contact import UnconvergedContactError
    from .direct import mean_ball_state, rolling_parameters

    friction_set = default_friction_set(parameters)
    state = nut_map.evaluate(*point, *friction_set.values)
    try:
        direct = mean_ball_state(parameters, friction_set, *point, rolling_parameters(parameters))
    except UnconvergedContactError:
        return NOT_SOLVED
    films = ("film_thickness_central_screw", "film_thickness_central_nut")
    rise = direct.film_temperature_rise
    return Deviation(
        abs(float(state.friction_torque) / direct.friction_torque - 1.0),
        max(abs(getattr(state, name) / getattr(direct, name) - 1.0) for name in films),
        abs(state.film_temperature_rise - rise) / max(rise, LEAST_RISE),
    )


def deviation_from_direct(
    nut_map: NutMap,
    parameters: Parameters,
    count: int,
    executor: Executor | None = None,
    progress: Progress = lambda finished, total, what: None,
) -> dict[str, Any]:
    """Relative deviations of a map from direct per-ball solves at the points of region_points.

    error_totals of the whole, where points_not_solved do not count, and of every region; ArithmeticError if no contact
    converged. executor: None = in this process
    """
    regions = region_points(nut_map, parameters, count)
    points: list[Point] = [tuple(point) for at in regions.values() for point in at.tolist()]
    # in an order without trend, for the time left
    order = np.random.default_rng(SEED).permutation(len(points)).tolist()
    results: Iterator[tuple[int, Deviation]]
    if executor is None:
        results = ((k, deviation_at(nut_map, parameters, points[k])) for k in order)
    else:
        jobs = {executor.submit(deviation_at, nut_map, parameters, points[k]): k for k in order}
        results = ((jobs[job], job.result()) for job in as_completed(jobs))
    # the time of the first one counts
    progress(0, len(points), STAGE)
    result = np.empty((len(points), len(Deviation._fields)))
    for done, (k, deviation) in enumerate(results, 1):
        result[k] = deviation
        progress(done, len(points), STAGE)
    ends = np.cumsum([len(at) for at in regions.values()])[:-1]
    solved = {
        region: errors[np.isfinite(errors).all(axis=1)]
        for region, errors in zip(regions, np.split(result, ends), strict=True)
    }
    held, total = np.concatenate([solved[region] for region in WHOLE]), sum(len(regions[r]) for r in WHOLE)
    if not len(held):
        raise ArithmeticError(f"none of {total} points of the certificate has a direct solution")
    return {
        **error_totals(Deviation._fields, held),
        "points_not_solved": total - len(held),
        "regions": {name: error_totals(Deviation._fields, own) for name, own in solved.items() if len(own)},
        "what": "this map",
    }


def error_totals(names: Sequence[str], errors: np.ndarray) -> dict[str, Any]:
    """Number of points, and mean, quantiles and largest of each column of their errors (n, names), NaN left out."""
    result: dict[str, Any] = {"points": len(errors)}
    for name, column in zip(names, errors.T, strict=True):
        known = column[np.isfinite(column)]
        if known.size:
            result[f"{name}_error_mean"] = float(known.mean())
            for fraction, key in QUANTILES.items():
                result[f"{name}_error_{key}"] = float(np.quantile(known, fraction))
            result[f"{name}_error_max"] = float(known.max())
    return result
