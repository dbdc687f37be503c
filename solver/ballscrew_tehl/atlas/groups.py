"""Dimensionless groups of a rolling contact, and the closed forms that its quantities are divided by.

Without heat a contact is given by Moes' M and L, R_x/R_y, the pressure exponent Z and the Hertz pressure over p_r of
Roelands; its heating adds N = beta eta0 u_e^2/k_oil, beta T of the heating by compression, the Peclet number
rho c u_e R_x/k_oil of the oil, and the effusivity sqrt(k rho c) of the walls in the mean. What is left (curve of the
viscosity over temperature, expansion, effusivity of the oil) changes films by less than the interpolation does.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..numerics import Array
from ..parameters.file import LubricantParameters, Parameters, SolidParameters
from ..physics.ball_law import contact_angle_at_ball_load
from ..physics.film import (
    biboulet_houpert_point,
    central_film_estimate,
    moes_groups,
    thermal_load_parameter,
    wilson_sheu,
)
from ..physics.hertz import E_prime, ellipse, reduced_radii
from ..physics.kinematics import entrainment_speed
from ..physics.lubricant import ambient_density, eta0, relative_density, temperature_slope

#: quantities of a contact with units; temperature_rise: of the hottest level of the film, mean over the contact;
#: mean_rise: mean over contact and film, below 0 where oil that expands cools more than shear heats; rolling_loss,
#: core_pressure, core_area: see contact.ContactResult
QUANTITIES = {
    "central_film": "m", "minimum_film": "m", "temperature_rise": "K", "mean_rise": "K", "rolling_loss": "W",
    "core_pressure": "Pa", "core_area": "m2",
}  # fmt: skip
#: effusivity [J/(m2 K s^0.5)] of bearing steel, of which wall is a multiple
STEEL_EFFUSIVITY = (46.0 * 7800.0 * 460.0) ** 0.5
#: transition from rigid to flattened contacts: at M (L/12)^0.45 (ratio/0.047)^0.5 = TURN, over WIDTH; the coordinate
#: stretches it. 760 contacts that were left out: mean error of the film 1.1e-3, with a transition at M = 33 2.4e-3
TURN, WIDTH, STRETCH = 25.0, 0.9, 2.7
COLD = 1e-3  # N below which heat changes nothing: the coordinate is ln(N + COLD)
#: N above which heating is taken as there, twice the hottest contacts of the atlas: up to there it is extrapolated,
#: eight solved losses and films within 7 % up to N = 126, since an end within the maps of cold screws would be a kink
MAX_HEATING_N = 144.0
#: M below which a ball counts as loaded so much: films are far above its radius there
LEAST_M = 1e-6
#: ln of the share of the rolling loss that a thick film lacks, over sqrt(2 h/R_x): 4.8 to 5.3 in 1,000 contacts of five
#: screws up to h = 0.1 R_x, where the loss is an eighth of its formula; no film is counted above R_x
THICK_FILM = 5.0
#: pressure and area of the core over those of Hertz are about 1/(1 + RIGID w) and 1 + RIGID w, with the width of the
#: wedge over that of the flattening w = h sqrt(R_x R_y)/(a b). Closer forms bend more sharply: interpolated worse
RIGID = 0.6
#: core of a flattened contact: pressure over that of Hertz and the area times the square of that lack c M^m L^l
#: (R_x/R_y)^r of one; by least squares over 655 contacts above M = 1,000: rms 9e-4 and 14e-4. M where it takes over
FLATTENED = {"core_pressure": (1.71, -0.780, -0.116, -0.429), "core_area": (5.31, -0.790, -0.176, -0.454)}
FLATTENED_M = 1500.0
#: what is added to the rise of the hottest level [K], so that the share of the mean rise in it stays finite
MORE_RISE = 1.0


class RollingContacts(NamedTuple):
    """Contacts in pure rolling, SI, numbers or arrays that broadcast; oil and walls of all are alike."""

    load: Any
    R_x: Any
    R_y: Any
    u_e: Any
    temperature: Any
    E_prime: float
    oil: LubricantParameters
    wall: float


class Groups(NamedTuple):
    """Groups of contacts: M, L; radius_ratio R_x/R_y; z; pressure: p_max/p_r; N; wall: effusivity over steel's.

    slope: beta T with beta = -d ln(eta0)/dT; peclet: rho c u_e R_x/k_oil
    """

    M: Array
    L: Array
    radius_ratio: Array
    z: Array
    pressure: Array
    N: Array
    wall: Array
    slope: Array
    peclet: Array


def wall_group(solids: tuple[SolidParameters, SolidParameters]) -> float:
    """Mean effusivity of two bodies over that of bearing steel."""
    result = [(s.thermal_conductivity * s.density * s.specific_heat) ** 0.5 for s in solids]
    return 0.5 * sum(result) / STEEL_EFFUSIVITY


def rolling_contacts(
    parameters: Parameters, raceway: str, load: Any, speed: Any, temperature: Any
) -> RollingContacts:
    """Contacts of balls in pure rolling at loads [N], screw speeds [rad/s] and temperatures [K], broadcast."""
    screw = parameters.screw
    R_x, R_y = reduced_radii(screw, contact_angle_at_ball_load(screw, load), raceway)
    return RollingContacts(
        load, R_x, R_y, entrainment_speed(screw, speed), temperature, E_prime(screw), parameters.lubricant,
        wall_group(parameters.solids),
    )  # fmt: skip


class ClosedForms(NamedTuple):
    """Groups of contacts, and closed forms of their quantities by name; arrays that broadcast."""

    groups: Groups
    values: dict[str, Array]


def closed_forms(contacts: RollingContacts) -> ClosedForms:
    """Groups and closed forms of contacts.

    central_film: physics.film with the density over pressure at the temperature of the oil, and Wilson & Sheu's factor
    without sliding; rolling_loss: Biboulet & Houpert with THICK_FILM and that factor; core: Hertz with RIGID and
    FLATTENED; temperature_rise: N/beta; N up to MAX_HEATING_N; minimum_film, mean_rise: 1, see modelled.
    """
    load, R_x, R_y, u_e, temperature, E, oil, wall = contacts
    hertz = ellipse(load, R_x, R_y, E)
    a, b, p_max = hertz.a, hertz.b, hertz.p_max
    moes = moes_groups(oil, load, u_e, R_x, E, temperature)
    moes = moes._replace(M=np.maximum(moes.M, LEAST_M))
    N, ratio = thermal_load_parameter(oil, u_e, temperature), R_x / R_y
    heating, beta = np.minimum(N, MAX_HEATING_N), -temperature_slope(oil, temperature)
    groups = Groups(
        moes.M, moes.L, ratio, np.array(oil.z_roelands), p_max / oil.roelands_pressure, N, np.array(wall),
        beta * temperature, oil.density * oil.specific_heat * u_e * R_x / oil.thermal_conductivity,
    )  # fmt: skip
    # density falls with temperature by the same amount at every pressure
    compressed = relative_density(oil.density_law, p_max)
    ambient = ambient_density(oil, temperature) / oil.density
    cold = central_film_estimate(oil, moes, R_x, R_y, p_max, temperature)
    cold = cold * compressed / ((compressed + ambient - 1.0) / ambient)
    heat = wilson_sheu(heating, 0.0)
    force = biboulet_houpert_point(load, u_e, R_x, R_y, E, eta0(oil, temperature))
    wider = 1.0 + RIGID * cold * np.sqrt(R_x * R_y) / (a * b)
    flat = 1.0 / (1.0 + (FLATTENED_M / groups.M) ** 2)
    lack = {
        name: np.exp(-flat * c_0 * groups.M**m * groups.L**of_l * ratio**r)
        for name, (c_0, m, of_l, r) in FLATTENED.items()
    }
    of_thick = np.exp(-THICK_FILM * np.sqrt(2.0 * np.minimum(cold / R_x, 1.0)))
    return ClosedForms(groups, {
        "central_film": cold * heat,
        "minimum_film": np.ones(()),
        "temperature_rise": heating / beta,
        "mean_rise": np.ones(()),
        "rolling_loss": 2.0 * np.asarray(u_e) * force * heat * of_thick,
        "core_pressure": p_max / wider * lack["core_pressure"],
        "core_area": np.pi * a * b * wider * lack["core_area"] / lack["core_pressure"] ** 2,
    })  # fmt: skip


#: coordinates in which quantities are interpolated, logarithms but for z
COORDINATES = ("transition", "L", "radius_ratio", "z", "pressure", "N", "wall", "slope", "peclet")


def transition(groups: Groups) -> Array:
    """ln of what tells rigid contacts from flattened ones, ln(TURN) in the middle between them."""
    at = np.log(groups.M) + 0.45 * np.log(groups.L / 12.0) + 0.5 * np.log(groups.radius_ratio / 0.047)
    return np.asarray(at)


def stretched(at: Array) -> Array:
    """The transition as a coordinate in which quantities change evenly."""
    return at + STRETCH * np.tanh((at - np.log(TURN)) / WIDTH)


def coordinates(groups: Groups) -> Array:
    """Coordinates (..., 9), COORDINATES, of groups (...)."""
    columns = (
        stretched(transition(groups)), np.log(groups.L), np.log(groups.radius_ratio), groups.z,
        np.log(groups.pressure), np.log(groups.N + COLD), np.log(groups.wall), np.log(groups.slope),
        np.log(groups.peclet),
    )  # fmt: skip
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def modelled(values: Mapping[str, Any], closed: Mapping[str, Any]) -> dict[str, Any]:
    """What is interpolated of quantities (SI): logarithms over the closed forms, and the share of the mean rise."""
    v, ln = values, np.log
    rise = np.maximum(v["temperature_rise"], 0.0)
    return {
        "central_film": ln(v["central_film"] / closed["central_film"]),
        "minimum_film": ln(v["minimum_film"] / v["central_film"]),
        "temperature_rise": ln(np.maximum(rise / closed["temperature_rise"], 1e-12)),
        "mean_rise": v["mean_rise"] / (rise + MORE_RISE),
        "rolling_loss": ln(v["rolling_loss"] / closed["rolling_loss"]),
        "core_pressure": ln(v["core_pressure"] / closed["core_pressure"]),
        # scatters a quarter as much with the nodes as the area itself
        "core_area": ln(
            v["core_area"] / closed["core_area"] * (v["core_pressure"] / closed["core_pressure"]) ** 2
        ),
    }


def unmodelled(interpolated: Mapping[str, Any], closed: Mapping[str, Any]) -> dict[str, Array]:
    """The quantities (SI) again; the minimum film is no more than the central one."""
    at = interpolated
    central = closed["central_film"] * np.exp(at["central_film"])
    rise = closed["temperature_rise"] * np.exp(at["temperature_rise"])
    pressure = np.exp(at["core_pressure"])
    return {
        "central_film": central,
        "minimum_film": central * np.exp(np.minimum(at["minimum_film"], 0.0)),
        "temperature_rise": rise,
        "mean_rise": at["mean_rise"] * (rise + MORE_RISE),
        "rolling_loss": closed["rolling_loss"] * np.exp(at["rolling_loss"]),
        "core_pressure": closed["core_pressure"] * pressure,
        "core_area": closed["core_area"] * np.exp(at["core_area"]) / pressure**2,
    }
