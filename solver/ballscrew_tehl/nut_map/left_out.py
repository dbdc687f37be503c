"""Errors of the solved contacts when they are left out, carried through to torque, film and temperature rise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..friction.mechanistic import nut_powers
from ..friction.sets import FrictionSet
from ..friction.torque import nut_sums
from ..parameters.file import Parameters
from ..physics.hertz import RACEWAYS
from ..runtime.packed import MECHANISTIC
from .certificate import Deviation
from .contact_map import MORE_RISE, OVER, ContactMap, ContactModel
from .contacts import CORE, FILMS, LOAD_EXPONENT, MAPPED, MEAN_RISE, RISE, Array


def left_out_deviations(contact_map: ContactMap, friction_set: FrictionSet) -> dict[str, Any]:
    """Number of the solved contacts, and mean, 99 % quantile and largest of the errors where each is left out.

    Torque: of a nut whose balls all are such contacts on one raceway, with the values that the other contacts predict
    in place of those solved; of the light balls that an axial load relieves by their part in the torque. Film and rise:
    of the other contacts alone. Costs no solve; the equilibrium of a ball takes milliseconds for each contact.
    """
    found = [_of_raceway(contact_map, friction_set, raceway) for raceway in RACEWAYS]
    result: dict[str, Any] = {"left_out_contacts": sum(len(columns[0]) for columns in found)}
    for name, columns in zip(Deviation._fields, zip(*found, strict=True), strict=True):
        errors = np.concatenate(columns)
        totals = errors.mean(), np.quantile(errors, 0.99), errors.max()
        result |= {
            f"{name}_left_out_{key}": float(v) for key, v in zip(("mean", "99", "max"), totals, strict=True)
        }
    return result


def _of_raceway(
    contact_map: ContactMap, friction_set: FrictionSet, raceway: str
) -> tuple[Array, Array, Array]:
    """Errors of the columns of Deviation: of every contact, and two of those of loaded balls."""
    model, points = contact_map.models[raceway], contact_map.models[raceway].points
    solved = {name: model.solved(name) for name in MAPPED}
    predicted = _predicted(model, solved)
    film = predicted[FILMS[1]] / solved[FILMS[1]] - 1.0
    rise = (predicted[RISE] - solved[RISE]) / np.maximum(solved[RISE], 1.0)
    other = next(name for name in RACEWAYS if name != raceway)
    beside = {name: contact_map.models[other].value(name, points) for name in MAPPED}
    light = np.minimum(points[:, 0] / contact_map.range.preloaded, 1.0)
    torque = np.empty(len(points))
    for i, point in enumerate(points.tolist()):
        as_solved, as_predicted = (
            _torque(
                contact_map.parameters,
                friction_set,
                point,
                {
                    raceway: {name: float(values[name][i]) for name in MAPPED},
                    other: {name: float(beside[name][i]) for name in MAPPED},
                },
            )
            for values in (solved, predicted)
        )
        torque[i] = abs(as_predicted / as_solved - 1.0)
    loaded = light >= 1.0 if np.any(light >= 1.0) else light > 0.0
    return light**LOAD_EXPONENT * torque, np.abs(film[loaded]), np.abs(rise[loaded])


def _predicted(model: ContactModel, solved: Mapping[str, Array]) -> dict[str, Array]:
    """Quantities of the solved contacts as the others predict them, each with the error of what it is a share of."""
    found: dict[str, Array] = {}
    for name in MAPPED:
        error, over = model.left_out(name), OVER.get(name)
        if name == MEAN_RISE:
            share = solved[name] / (solved[RISE] + MORE_RISE)
            found[name] = (share + error) * (found[RISE] + MORE_RISE)
            continue
        found[name] = solved[name] * (1.0 + error)
        if over is not None:
            found[name] *= found[over] / solved[over]
        if name == CORE[1]:
            found[name] *= (solved[CORE[0]] / found[CORE[0]]) ** 2
    return found


class _GivenContacts:
    """Contacts of given values by raceway and name: of the mechanistic law, and the film of the others."""

    name = MECHANISTIC

    def __init__(self, values: Mapping[str, Mapping[str, float]], film: str) -> None:
        self.values, self.film = values, film

    def value(self, raceway: str, name: str, load: Array, speed: Array, temperature: Array) -> Array:
        return np.full((load.size, 1, 1), self.values[raceway][name])

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        return np.full(load.shape, self.values[raceway][self.film])


def _torque(
    parameters: Parameters,
    friction_set: FrictionSet,
    point: list[float],
    values: Mapping[str, Mapping[str, float]],
) -> float:
    """Torque [N.m] of one ball with the load [N] of a point, at its speed [rad/s] and temperature [K]."""
    film = FILMS[int(friction_set.film_model == "solved_thermal")]
    load, speed, temperature = point
    contacts, loads = _GivenContacts(values, film), np.array([load])
    if friction_set.film_model != MECHANISTIC:
        return nut_sums(parameters, loads, speed, temperature, contacts).torque(*friction_set.values).total
    ratio, net, _ = friction_set.values
    return float(nut_powers(parameters, loads, speed, temperature, contacts).torque(ratio, net))
