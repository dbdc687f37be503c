"""Films and temperatures of the contacts of one ball over (ball load, screw speed, oil temperature), per raceway.

Contacts are solved at scattered points; the ratios of their films to closed formulas are interpolated by kriging, once,
at the nodes of a grid, and by cubic splines between these.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..parameters.file import Parameters
from ..physics.film import central_film_estimate, moes_groups
from ..physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ..physics.kinematics import surface_speeds
from ..physics.load import contact_angle_at_ball_load
from ..runtime.bspline import cubic_weights, fit

Array = NDArray[np.float64]

#: quantities of a solved contact with units
QUANTITIES = {
    "isothermal_central_film": "m",
    "thermal_central_film": "m",
    "thermal_minimum_film": "m",
    "temperature_rise": "K",
    "temperature_rise_mean": "K",
    "pressure_max": "Pa",
    "traction_force": "N",
    "rolling_loss": "W",
    "shear_heat": "W",
    "mean_temperature": "K",
    "mean_viscosity": "Pa s",
    "error_estimate": "1",
    "asymptotic": "1",
}
#: columns of the points of solved contacts with units
POINTS = {"load": "N", "speed": "rad s-1", "temperature": "K"}
#: relative distance beyond the end of an axis that counts as rounding
ROUNDING = 1e-9
FILMS = ("isothermal_central_film", "thermal_central_film", "thermal_minimum_film")
#: what is interpolated
MAPPED = (*FILMS, "temperature_rise")


@dataclass(frozen=True)
class ContactAxes:
    """Range and nodes: lowest, highest, nodes of load [N] and speed [rad/s] (geometric) and temperature [K]."""

    load: tuple[float, float, int]
    speed: tuple[float, float, int]
    temperature: tuple[float, float, int]

    @cached_property
    def nodes(self) -> tuple[Array, Array, Array]:
        """Nodes of the three axes."""
        return np.geomspace(*self.load), np.geomspace(*self.speed), np.linspace(*self.temperature)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of nodes per axis."""
        return self.load[2], self.speed[2], self.temperature[2]


@dataclass(frozen=True)
class SolvedContacts:
    """Contacts of one raceway: points (n, 3) of load [N], speed [rad/s], temperature [K]; values (n,) by quantity.

    A contact that was not solved has the film NaN.
    """

    points: Array
    values: Mapping[str, Array]

    @property
    def good(self) -> NDArray[np.bool_]:
        """Which of them were solved (n,)."""
        return np.isfinite(self.values[FILMS[1]]) & np.isfinite(self.values[FILMS[0]])

    def __len__(self) -> int:
        return len(self.points)


@dataclass(frozen=True)
class ContactMap:
    """Samples (n_load, n_speed, n_temperature) by raceway and mapped quantity, for one screw with one kinematics.

    contacts: what was solved, by raceway; the samples are interpolated from it.
    """

    parameters: Parameters
    axes: ContactAxes
    samples: Mapping[str, Mapping[str, Array]]
    contacts: Mapping[str, SolvedContacts]

    @cached_property
    def ln_ratios(self) -> dict[tuple[str, str], Array]:
        """Logarithms of the films over the closed formula at the nodes."""
        load, speed, temperature = self.axes.nodes
        found = {}
        for raceway in RACEWAYS:
            formula = film_formula(self.parameters, raceway, load[:, None, None], speed[:, None], temperature)
            for name in FILMS:
                found[raceway, name] = np.log(self.samples[raceway][name] / formula)
        return found

    @cached_property
    def _coefficients(self) -> dict[tuple[str, str], Array]:
        found = {key: fit(values, (0, 1, 2)) for key, values in self.ln_ratios.items()}
        for raceway in RACEWAYS:
            found[raceway, "temperature_rise"] = fit(
                np.log(self.samples[raceway]["temperature_rise"]), (0, 1, 2)
            )
        return found

    def evaluate(self, raceway: str, name: str, load: Array, speed: float, temperature: float) -> Array:
        """Interpolated quantity for ball loads (n,) [N] at one speed [rad/s] and temperature [K].

        Raises       ValueError: outside the sampled range, unknown raceway or quantity
        """
        load = np.asarray(load, dtype=float)
        if (raceway, name) not in self._coefficients:
            raise ValueError(
                f"raceway, quantity = {raceway}, {name}; allowed: {', '.join(RACEWAYS)} and {', '.join(MAPPED)}"
            )
        log_value = _spline(self._coefficients[raceway, name], self.axes, load, speed, temperature)
        value = np.exp(log_value)
        if name in FILMS:
            value = value * film_formula(self.parameters, raceway, load, speed, temperature)
        return np.asarray(value)

    def evaluate_grid(self, raceway: str, name: str, load: Array, speed: Array, temperature: Array) -> Array:
        """The same on a grid of ball loads (n,), speeds (s,) and temperatures (t,); returns (n, s, t).

        Balls lighter than sampled, which only a few balls of a nut nearly free are: their films have the ratio to the
        formula of the lightest sampled one, their rise falls with the power 1/3 of load, as pressure does: an
        assumption.
        """
        value = self._coefficients[raceway, name]
        held = np.maximum(load, self.axes.load[0])
        for nodes, bounds, what, logarithmic in (
            (held, self.axes.load, "ball load [N]", True),
            (speed, self.axes.speed, "speed [rad/s]", True),
            (temperature, self.axes.temperature, "temperature [K]", False),
        ):
            # each axis in turn comes first and, contracted, goes last
            value = np.tensordot(value, _weights(nodes, *bounds, what, logarithmic), axes=(0, 1))
        value = np.exp(value)
        if name in FILMS:
            points = load[:, None, None], speed[:, None], temperature
            return np.asarray(value * film_formula(self.parameters, raceway, *points))
        return np.asarray(value * ((load / held) ** (1.0 / 3.0))[:, None, None])


def film_formula(parameters: Parameters, raceway: str, load: Array, speed: Any, temperature: Any) -> Array:
    """Closed film formula that the samples are divided by [m]; load, speed and temperature broadcast."""
    screw, oil = parameters.screw, parameters.lubricant
    R_x, R_y = reduced_radii(screw, contact_angle_at_ball_load(screw, load), raceway)
    u_e = surface_speeds(parameters, raceway, speed).u_e
    modulus = E_prime(screw)
    groups = moes_groups(oil, load, u_e, R_x, modulus, temperature)
    # the pressure that compresses the oil varies little with the contact angle: that of the drawing
    p_max = ellipse(load, *reduced_radii(screw, screw.contact_angle, raceway), modulus).p_max
    return np.asarray(central_film_estimate(oil, groups, R_x, R_y, p_max, temperature))


def _place(
    value: Array | float, lo: float, hi: float, nodes: int, what: str, logarithmic: bool
) -> tuple[Array, Array]:
    value = np.asarray(value, dtype=float)
    slack = ROUNDING * hi
    if not np.all((value >= lo - slack) & (value <= hi + slack)):
        raise ValueError(
            f"{what} = {value.min():.6g} to {value.max():.6g}; the contact map covers {lo:.6g} to {hi:.6g}"
        )
    if logarithmic:
        value, lo, hi = np.log(value), np.log(lo), np.log(hi)
    t = (value - lo) / (hi - lo) * (nodes - 1)
    cell = np.clip(t.astype(int), 0, nodes - 2)
    return cell, t - cell


def _weights(value: Array, lo: float, hi: float, nodes: int, what: str, logarithmic: bool) -> Array:
    """Matrix (points, nodes + 2) from spline coefficients to values."""
    cell, t = _place(value, lo, hi, nodes, what, logarithmic)
    matrix = np.zeros((len(value), nodes + 2))
    for a, w in enumerate(cubic_weights(t)):
        matrix[np.arange(len(value)), cell + a] = w
    return matrix


def _spline(coefficients: Array, axes: ContactAxes, load: Array, speed: float, temperature: float) -> Array:
    j, t_j = _place(speed, *axes.speed, "speed [rad/s]", True)
    k, t_k = _place(temperature, *axes.temperature, "temperature [K]", False)
    block = coefficients[:, int(j) : int(j) + 4, int(k) : int(k) + 4]
    curve = np.array(cubic_weights(float(t_j))) @ (block @ np.array(cubic_weights(float(t_k)))).T
    i, t_i = _place(load, *axes.load, "ball load [N]", True)
    return sum(w * curve[i + a] for a, w in enumerate(cubic_weights(t_i)))


class SolvedFilm:
    """Film model of the contact solver, read from a contact map.

    Parameters   contact_map; thermal: film of the thermal solve ("solved_thermal") or of the isothermal ("solved")
    Validity     loads, speeds and temperatures of the map; ValueError outside
    """

    def __init__(self, contact_map: ContactMap, thermal: bool) -> None:
        self.contact_map = contact_map
        self.name = "solved_thermal" if thermal else "solved"
        self._quantity = FILMS[1] if thermal else FILMS[0]

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        """Central film [m] of balls with load (n,) [N] at speed [rad/s] and temperature [K]."""
        return self.contact_map.evaluate(raceway, self._quantity, load, speed, temperature)
