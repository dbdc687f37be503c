"""Films and temperature rise of one raceway between the contacts that were solved: by kriging.

Coordinates of a contact: ln(ball load), ln(oil viscosity at ambient pressure times screw speed) and temperature, each
over its range. Moes load and pressure spike depend on the first two alone, so that films over their closed formula
change little with the third: kriging with one length per coordinate then needs few points.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..parameters.file import Parameters
from ..physics.lubricant import eta0
from .contact_map import FILMS, MAPPED, Array, ContactAxes, SolvedContacts, film_formula
from .kriging import Kriging

#: what a film is interpolated over: the closed formula, or another film
OVER = {FILMS[0]: None, FILMS[1]: FILMS[0], FILMS[2]: FILMS[1]}


def coordinates(parameters: Parameters, axes: ContactAxes, points: Array) -> Array:
    """Coordinates (n, 3) for kriging of operating points (n, 3)."""
    load, speed, temperature = points.T
    oil = parameters.lubricant
    span = np.log(axes.speed[1] / axes.speed[0])
    thickening = np.log(eta0(oil, temperature) / eta0(oil, axes.temperature[1]))
    return np.stack(
        [
            np.log(load / axes.load[0]) / np.log(axes.load[1] / axes.load[0]),
            (np.log(speed / axes.speed[0]) + thickening) / span,
            (temperature - axes.temperature[0]) / (axes.temperature[1] - axes.temperature[0]),
        ],
        axis=1,
    )


class ContactModel:
    """Films and rise of one raceway by kriging of its solved contacts.

    Parameters   hyper: lengths and noise by quantity of an earlier model, None = the most likely ones
    """

    def __init__(
        self,
        parameters: Parameters,
        raceway: str,
        axes: ContactAxes,
        contacts: SolvedContacts,
        hyper: Mapping[str, Array] | None = None,
    ) -> None:
        self.parameters, self.raceway, self.axes = parameters, raceway, axes
        self.contacts, self._hyper = contacts, hyper or {}
        self.points = contacts.points[contacts.good]
        self.coordinates = coordinates(parameters, axes, self.points)
        self._models: dict[str, Kriging] = {}

    def solved(self, name: str) -> Array:
        """A quantity of the contacts that were solved."""
        return self.contacts.values[name][self.contacts.good]

    def kriging(self, name: str) -> Kriging:
        """Model of the logarithm of a film over what it is interpolated over, or of a rise."""
        if name not in self._models:
            values = np.log(self.solved(name))
            if name in FILMS:
                values = values - np.log(self._below(name, self.points, self.solved))
            self._models[name] = Kriging(self.coordinates, values, self._hyper.get(name))
        return self._models[name]

    def _below(self, name: str, points: Array, film: Any) -> Array:
        over = OVER[name]
        if over is not None:
            return np.asarray(film(over))
        load, speed, temperature = points.T
        return film_formula(self.parameters, self.raceway, load, speed, temperature)

    def film(self, name: str, points: Array) -> Array:
        """A film [m] at operating points (n, 3)."""
        ratio = np.exp(self.kriging(name)(coordinates(self.parameters, self.axes, points)))
        return np.asarray(ratio * self._below(name, points, lambda over: self.film(over, points)))

    def at_nodes(self) -> dict[str, Array]:
        """Everything that is mapped at the nodes of the axes (n_load, n_speed, n_temperature)."""
        nodes = np.stack(np.meshgrid(*self.axes.nodes, indexing="ij"), axis=-1).reshape(-1, 3)
        at, shape = coordinates(self.parameters, self.axes, nodes), self.axes.shape
        found: dict[str, Array] = {}
        for name in MAPPED:
            values = np.exp(self.kriging(name)(at))
            if name in FILMS:
                values = values * self._below(name, nodes, lambda over: found[over].ravel())
            if name == FILMS[2]:
                # interpolated, it may exceed the central film
                values = np.minimum(values, found[FILMS[1]].ravel())
            found[name] = values.reshape(shape)
        return found
