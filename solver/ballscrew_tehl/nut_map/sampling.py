"""Where contacts are solved for a map: corners and edges of the range, a Sobol sequence, then where they help most.

The points that follow are those where the films, and the rolling loss by its part in the friction, are least certain,
weighted with the error of the nearest solved contact when that is left out (cross-validation by Voronoi cells: Xu, Liu,
Sun & Wang 2014, J Mech Des 136, 021012).
"""

from __future__ import annotations

import itertools

import numpy as np
from scipy.spatial import KDTree
from scipy.stats import qmc

from ..friction.mechanistic import ball_ball_coefficient
from ..parameters.file import Parameters
from ..physics.ball_formula import film_formula
from ..physics.kinematics import entrainment_speed
from .atlas import ScrewAtlas
from .contact_map import ContactModel
from .contacts import FILMS, LOAD_EXPONENT, MIN_FILM, ROLLING_FRAME, Array, ContactRange, film_weight

#: share of the unit interval of loads for balls lighter than under the lowest preload: they cause little friction
LIGHT = 0.15
#: films whose errors count; the minimum film of side lobes scatters with the grid of the solver
REFINED = FILMS[:2]
#: what else counts where the map has the law that takes it
ROLLING = "rolling_loss"
#: points of a Sobol sequence from which the next ones are chosen, as a power of two, and seeds of both sequences
POOL_POWER, FIRST_SEED, POOL_SEED = 9, 1, 2
#: points drawn for each first one, of which some have too thin a film
SPARE = 4


def operating_points(range_: ContactRange, unit: Array) -> Array:
    """Load [N], speed [rad/s], temperature [K] (n, 3) of points of the unit cube: logarithmic, the last linear.

    A share LIGHT of the loads is of balls that only an axial load relieves.
    """
    (q_0, q_1), (w_0, w_1), (t_0, t_1) = range_.load, range_.speed, range_.temperature
    knots = np.array([0.0, LIGHT if range_.preloaded > q_0 else 0.0, 1.0])
    ln_load = np.interp(unit[:, 0], knots, np.log([q_0, range_.preloaded, q_1]))
    return np.stack(
        [np.exp(ln_load), w_0 * (w_1 / w_0) ** unit[:, 1], t_0 + (t_1 - t_0) * unit[:, 2]], axis=1
    )


def frame_points() -> Array:
    """Corners of the unit cube, middles of its edges and of its faces (26, 3): whether the range can be solved."""
    steps = np.array(list(itertools.product((0.0, 0.5, 1.0), repeat=3)))
    on_border = (steps != 0.5).any(axis=1)
    inner = (steps == 0.5).sum(axis=1)
    return steps[on_border][np.argsort(inner[on_border], kind="stable")]


def first_points(count: int) -> Array:
    """Points of the unit cube (count, 3) that every map begins with: frame_points, then a Sobol sequence."""
    frame = frame_points()
    power = max(1, int(np.ceil(np.log2(max(count - len(frame), 2)))))
    sequence = qmc.Sobol(3, seed=FIRST_SEED).random_base2(power)
    return np.concatenate([frame, sequence])[:count]


def first_contacts(
    parameters: Parameters, raceway: str, range_: ContactRange, count: int, atlas: ScrewAtlas | None = None
) -> Array:
    """Operating points (n, 3) that a map of a raceway begins with: count of those whose film is above MIN_FILM.

    atlas: that holds the films. Then no frame_points, which are outside the atlas or take long, but every second point
    is one of those farthest from its contacts
    """
    if atlas is None:
        points = operating_points(range_, first_points(SPARE * count))
        return points[film_formula(parameters, raceway, *points.T) >= MIN_FILM][:count]
    border = len(frame_points())
    points = operating_points(range_, first_points(border + SPARE * count)[border:])
    points = points[film_formula(parameters, raceway, *points.T) >= MIN_FILM]
    even, others = points[: count - count // 2], points[count - count // 2 :]
    weight = film_weight(range_, others[:, 0], film_formula(parameters, raceway, *others.T))
    far = np.argsort(-weight * atlas.distance(others), kind="stable")[: count // 2]
    return np.concatenate([even, others[far]])


def refined(model: ContactModel) -> tuple[str, ...]:
    """Quantities whose errors call for more contacts: of the films, and of the law if the map has it."""
    names = (*REFINED, ROLLING) if model.parameters.friction.kinematics == ROLLING_FRAME else REFINED
    return tuple(name for name in names if name in model.interpolated)


def rolling_weight(parameters: Parameters, range_: ContactRange, points: Array, loss: Array) -> Array:
    """Weight of the relative error of the rolling loss (n,) [W] at points (n, 3): at most its part in the friction.

    The friction of a ball is taken as the rolling of both raceways and what it pushes its neighbours with; shear and
    hysteresis lower the part, and so does a supply that is not flooded.
    """
    load, speed, _ = points.T
    rolling = 2.0 * loss
    neighbours = (
        ball_ball_coefficient(parameters.friction) * load * entrainment_speed(parameters.screw, speed)
    )
    light = np.minimum(load / range_.preloaded, 1.0) ** LOAD_EXPONENT
    return np.asarray(light * rolling / (rolling + neighbours))


def _weight(model: ContactModel, name: str, points: Array, film: Array, loss: Array) -> Array:
    if name == ROLLING:
        return rolling_weight(model.parameters, model.range, points, loss)
    return film_weight(model.range, points[:, 0], film)


def left_out_errors(model: ContactModel, names: tuple[str, ...] | None = None) -> Array:
    """Largest weighted error (n,) of some quantities (None: refined) at every solved contact when it is left out."""
    film, loss = model.solved(FILMS[1]), model.solved(ROLLING)
    errors = [
        _weight(model, name, model.points, film, loss) * np.abs(model.left_out(name))
        for name in (refined(model) if names is None else names)
    ]
    return np.asarray(np.max(errors, axis=0))


def next_points(model: ContactModel, count: int, round_: int) -> Array:
    """Operating points (count, 3) where what counts is least certain, each chosen with those before it known."""
    pool = qmc.Sobol(3, seed=POOL_SEED + round_).random_base2(POOL_POWER)
    places = operating_points(model.range, pool)
    places = places[film_formula(model.parameters, model.raceway, *places.T) >= MIN_FILM]
    errors = left_out_errors(model)
    by = REFINED[0]
    nearest = KDTree(model.coordinates(by, model.points)).query(model.coordinates(by, places))[1]
    known = errors[nearest] + errors.mean()
    film, loss = model.film(FILMS[1], places), model.value(ROLLING, places)
    covariance = np.zeros((len(places), len(places)))
    for name in refined(model):
        weight = _weight(model, name, places, film, loss) * known
        covariance += model.covariance(name, places) * weight[:, None] * weight
    chosen = []
    for _ in range(count):
        # Cholesky with pivots: the largest variance that is left
        best = int(np.argmax(np.diag(covariance)))
        chosen.append(best)
        column = covariance[:, best] / np.sqrt(max(float(covariance[best, best]), np.finfo(float).tiny))
        covariance = covariance - np.outer(column, column)
    return places[chosen]
