"""Films and temperatures of the contacts of one ball over (ball load, screw speed, oil temperature), per raceway.

Samples come from the contact solver; between them ratios to closed formulas are interpolated, which vary little.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..film import central_film_estimate, moes_groups
from ..hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ..kinematics import surface_speeds
from ..load import contact_angle_at_ball_load
from ..parameters import Parameters
from .bspline import LEAST_NODES, cubic_weights, fit

Array = NDArray[np.float64]

#: sampled quantities with units; the first four are interpolated
QUANTITIES = {
    "isothermal_central_film": "m",
    "thermal_central_film": "m",
    "thermal_minimum_film": "m",
    "temperature_rise": "K",
    "pressure_max": "Pa",
    "traction_force": "N",
    "asymptotic": "1",
}
FILMS = ("isothermal_central_film", "thermal_central_film", "thermal_minimum_film")


@dataclass(frozen=True)
class ContactAxes:
    """Sampling grid: lowest, highest, nodes of load [N] and speed [rad/s] (geometric) and temperature [K]."""

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

    def refined(self, axis: int) -> ContactAxes:
        """The same with twice as many cells along one axis; the old nodes stay."""
        bounds = [self.load, self.speed, self.temperature]
        low, high, nodes = bounds[axis]
        bounds[axis] = (low, high, 2 * nodes - 1)
        return ContactAxes(*bounds)


@dataclass(frozen=True)
class ContactMap:
    """Samples (n_load, n_speed, n_temperature) by raceway and quantity, for one screw with one kinematics."""

    parameters: Parameters
    axes: ContactAxes
    samples: Mapping[str, Mapping[str, Array]]

    @cached_property
    def _ln_ratios(self) -> dict[tuple[str, str], Array]:
        """Logarithms of the films over the closed formula at the nodes."""
        load, speed, temperature = self.axes.nodes
        found = {}
        for raceway in RACEWAYS:
            formula = np.empty(self.axes.shape)
            for j, w in enumerate(speed):
                for k, t in enumerate(temperature):
                    formula[:, j, k] = film_formula(self.parameters, raceway, load, w, t)
            for name in FILMS:
                found[raceway, name] = np.log(self.samples[raceway][name] / formula)
        return found

    @cached_property
    def _coefficients(self) -> dict[tuple[str, str], Array]:
        found = {key: fit(values, (0, 1, 2)) for key, values in self._ln_ratios.items()}
        for raceway in RACEWAYS:
            found[raceway, "temperature_rise"] = fit(
                np.log(self.samples[raceway]["temperature_rise"]), (0, 1, 2)
            )
        return found

    def axis_errors(self) -> tuple[float, float, float]:
        """Estimated error of ln(film) between the nodes of each axis (load, speed, temperature).

        Every other node along the axis is left out and predicted by the spline through the rest; the spline through
        all leaves an eighth of that (a sixteenth where it is smooth). The 95 % quantile over nodes, raceways and both
        central films: a few contacts near a change of regime must not rule the sampling of all, and the minimum film
        of side lobes scatters with the grid.
        """
        return tuple(self._axis_error(axis) for axis in range(3))  # type: ignore[return-value]

    def _axis_error(self, axis: int) -> float:
        nodes = self.axes.shape[axis]
        if nodes % 2 == 0:
            return 0.0  # not to be halved
        found = []
        for values in (self._ln_ratios[raceway, name] for raceway in RACEWAYS for name in FILMS[:2]):
            lines = np.moveaxis(values, axis, 0).reshape(nodes, -1)
            found.append(np.abs(_predicted(lines[::2]) - lines[1::2]).ravel())
        return float(np.quantile(np.concatenate(found), 0.95)) / 8.0

    def evaluate(self, raceway: str, name: str, load: Array, speed: float, temperature: float) -> Array:
        """Interpolated quantity for ball loads (n,) [N] at one speed [rad/s] and temperature [K].

        Raises       ValueError: outside the sampled range, unknown raceway or quantity
        """
        load = np.asarray(load, dtype=float)
        if (raceway, name) not in self._coefficients:
            raise ValueError(
                f"raceway, quantity = {raceway}, {name}; allowed: {', '.join(RACEWAYS)} and "
                f"{', '.join((*FILMS, 'temperature_rise'))}"
            )
        log_value = _spline(self._coefficients[raceway, name], self.axes, load, speed, temperature)
        value = np.exp(log_value)
        if name in FILMS:
            value = value * film_formula(self.parameters, raceway, load, speed, temperature)
        return np.asarray(value)


def _predicted(lines: Array) -> Array:
    """Values (n-1, columns) half way between n nodes: by the spline, of three nodes by the parabola."""
    if len(lines) < LEAST_NODES:
        first, middle, last = lines
        return np.stack([3.0 * first + 6.0 * middle - last, 3.0 * last + 6.0 * middle - first]) / 8.0
    coefficients = fit(lines, (0,))
    weights = cubic_weights(0.5)
    cells = len(lines) - 1
    return np.asarray(sum(w * coefficients[a : a + cells] for a, w in enumerate(weights)))


def film_formula(
    parameters: Parameters, raceway: str, load: Array, speed: float, temperature: float
) -> Array:
    """Closed film formula that the samples are divided by (n,) [m]."""
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
    slack = 1e-9 * hi
    if not np.all((value >= lo - slack) & (value <= hi + slack)):
        raise ValueError(
            f"{what} = {value.min():.6g} to {value.max():.6g}; the contact map covers {lo:.6g} to {hi:.6g}"
        )
    if logarithmic:
        value, lo, hi = np.log(value), np.log(lo), np.log(hi)
    t = (value - lo) / (hi - lo) * (nodes - 1)
    cell = np.clip(t.astype(int), 0, nodes - 2)
    return cell, t - cell


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
