"""Contacts of one ball that were solved for a map, and the range they were solved over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..parameters.file import Parameters, changed
from ..physics.ball_law import Array
from ..runtime.packed import MECHANISTIC

#: the command that messages advise
BUILD_MAP = "ballscrew map build --screw FILE.toml --output MAP.nc"
#: quantities of a solved contact with units; temperature_rise: of the hottest level, mean over the contact (the largest
#: in pure rolling depends on where the pressure spike lies between the nodes); mean_rise: mean over contact and film,
#: below 0 where oil that expands cools more than shear heats; rolling_loss, core_pressure, core_area: of the thermal
#: solve, see contact.ContactResult
QUANTITIES = {
    "isothermal_central_film": "m",
    "thermal_central_film": "m",
    "thermal_minimum_film": "m",
    "temperature_rise": "K",
    "rolling_loss": "W",
    "core_pressure": "Pa",
    "core_area": "m2",
    "mean_rise": "K",
    "asymptotic": "1",
}
#: columns of the points of solved contacts with units
POINTS = {"load": "N", "speed": "rad s-1", "temperature": "K"}
#: film [m] below which errors are relative to this one: about the roughness height of the friction sets, below which
#: films contribute little friction; lower, heavily loaded slow contacts are refined that hardly change the torque
FILM_FLOOR = 20e-9
#: exponent of load of the friction of a ball, by which errors of light balls count less
LOAD_EXPONENT = 2.0 / 3.0
#: film [m] by the closed formula below which no contact is solved: oil is no continuum there, the solves take longest;
#: kriging continues the films
MIN_FILM = 1e-9
#: relative distance beyond the end of an axis that counts as rounding
ROUNDING = 1e-9
FILMS = ("isothermal_central_film", "thermal_central_film", "thermal_minimum_film")
#: temperature rises, of the hottest level of the film and of its mean
RISE, MEAN_RISE = "temperature_rise", "mean_rise"
RISES = (RISE, MEAN_RISE)
#: pressure and area of the core of a contact
CORE = ("core_pressure", "core_area")
#: arrays of a map that depend on the film model, whose name follows
VISCOUS = "viscous_coefficients_"
#: kinematics whose films are shown, also of a map of the published one, whose speeds cannot be physical
ROLLING_FRAME = "rolling_frame"
#: what is interpolated
MAPPED = (*FILMS, *RISES, "rolling_loss", *CORE)


@dataclass(frozen=True)
class ContactRange:
    """Lowest and highest load [N], speed [rad/s] and temperature [K].

    preloaded: load [N] below which only the balls of a nut are that an axial load relieves
    """

    load: tuple[float, float]
    speed: tuple[float, float]
    temperature: tuple[float, float]
    preloaded: float

    def check(self, load: Any, speed: Any, temperature: Any) -> None:
        """Raise ValueError where an operating point lies outside by more than rounding."""
        for what, given, (low, high) in (
            ("ball load [N]", load, self.load),
            ("speed [rad/s]", speed, self.speed),
            ("temperature [K]", temperature, self.temperature),
        ):
            value, slack = np.asarray(given, dtype=float), ROUNDING * high
            if not np.all((value >= low - slack) & (value <= high + slack)):
                raise ValueError(
                    f"{what} = {value.min():.6g} to {value.max():.6g}; the contact map covers {low:.6g} to {high:.6g}"
                )


@dataclass(frozen=True)
class SolvedContacts:
    """Contacts of one raceway: points (n, 3) of load [N], speed [rad/s], temperature [K]; values (n,) by quantity.

    A contact that was not solved has the thermal film NaN; the isothermal one is NaN where the atlas is taken for it.
    """

    points: Array
    values: Mapping[str, Array]

    @property
    def good(self) -> NDArray[np.bool_]:
        """Which of them were solved (n,)."""
        return np.isfinite(self.values[FILMS[1]])

    def __len__(self) -> int:
        return len(self.points)


def film_weight(range_: ContactRange, load: Array, film: Array) -> Array:
    """Weight of the relative error of a film [m] of a ball load [N]: about its part in the friction."""
    light = np.minimum(load / range_.preloaded, 1.0) ** LOAD_EXPONENT
    return np.asarray(light * film / np.maximum(film, FILM_FLOOR))


def film_parameters(parameters: Parameters) -> Parameters:
    """Parameters of the contacts whose films and rises are shown: those of rolling balls, see ROLLING_FRAME."""
    if parameters.friction.kinematics == ROLLING_FRAME:
        return parameters
    return changed(parameters, friction={"kinematics": ROLLING_FRAME, "set": MECHANISTIC})
