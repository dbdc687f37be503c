"""Films of the balls from the contact solver, without a map."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from typing import NamedTuple

import numpy as np

from ..atlas.groups import QUANTITIES, closed_forms, rolling_contacts, unmodelled
from ..contact import THICKEST, ContactResult, solve_ball
from ..friction.film_shear import nut_forces, nut_sums
from ..friction.mechanistic import mean_load, nuts_powers, rolling_torque
from ..friction.sets import FrictionSet, with_law
from ..numerics import Array
from ..parameters.file import Parameters, ScrewParameters
from ..physics.ball_law import contact_angle_at_ball_load
from ..physics.film import film_formula
from ..physics.hertz import RACEWAYS, ball_ellipse
from ..physics.load import EQUAL_LOADS, load_nodes, nut_loads
from ..runtime.packed import Law

NODES_PER_LN = 4.0  # nodes per unit of ln(load) of a nut, each of which is a solve


def rolling_parameters(parameters: Parameters) -> Parameters:
    """Parameters of the contacts whose films and rises are shown: those of rolling balls, see physics.kinematics."""
    return with_law(parameters, Law.MECHANISTIC)


def contact_quantities(found: ContactResult) -> dict[str, float]:
    """QUANTITIES of a thermal solution."""
    values = (
        found.h_c, found.h_m, found.temperature_rise_mean, found.mean_temperature - found.conditions.temperature,
        found.rolling_loss, found.core_pressure, found.core_area,
    )  # fmt: skip
    return {name: float(value) for name, value in zip(QUANTITIES, values, strict=True)}


def solved_contact(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float
) -> dict[str, float]:
    """QUANTITIES of a ball by a thermal solve, or by the closed forms where these give a film above THICKEST of R_x."""
    if parameters.friction.law is Law.THREE_PARAMETER:
        return contact_quantities(solve_ball(parameters, raceway, load, speed, temperature, thermal=True))
    contact = rolling_contacts(parameters, raceway, np.array([load]), speed, temperature)
    forms = unmodelled(dict.fromkeys(QUANTITIES, np.zeros(1)), closed_forms(contact).values)
    closed = {name: float(value[0]) for name, value in forms.items()}
    if closed["central_film"] > THICKEST * float(contact.R_x[0]):
        return closed
    values = contact_quantities(solve_ball(parameters, raceway, load, speed, temperature, thermal=True))
    if math.isnan(values["rolling_loss"]):  # hot films are thicker than the closed form
        values["rolling_loss"] = closed["rolling_loss"]
    return values


class DirectFilm:
    """Films of the law of the paper: contacts solved at Chebyshev nodes over ln(load) of a nut, cached."""

    def __init__(self, parameters: Parameters) -> None:
        @cache
        def film(raceway: str, load: float, speed: float, temperature: float) -> float:
            return solve_ball(parameters, raceway, load, speed, temperature, True).h_c

        self._film = film

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        """Central film [m] of balls with load (n,) [N] at speed [rad/s] and temperature [K]."""
        nodes, weights = load_nodes(load, NODES_PER_LN)
        films = [self._film(raceway, float(node), speed, temperature) for node in nodes]
        return np.asarray(np.exp(weights @ np.log(films)))


def direct_extremes(
    parameters: Parameters, preload: float, axial_load: float, speed: float, temperature: float
) -> dict[str, float]:
    """Extremes of the load-carrying balls of both nuts by thermal solves, by the names of NutMap.evaluate."""
    screw = parameters.screw
    forces = {force for force in nut_forces(parameters, preload, axial_load) if force > 0.0}
    loads = np.concatenate([nut_loads(screw, force, screw.loaded_ball_count) for force in forces])
    heaviest, lightest = float(loads.max()), float(loads[loads > 0.0].min())
    # film falls and heating rises with load: the ends of the range hold the extremes
    solved = {
        raceway: [solved_contact(parameters, raceway, q, speed, temperature) for q in {heaviest, lightest}]
        for raceway in RACEWAYS
    }
    everything = [contact for pair in solved.values() for contact in pair]
    angle = float(contact_angle_at_ball_load(screw, heaviest))
    return {
        "film_thickness_min": min(s["minimum_film"] for s in everything),
        "film_thickness_central_screw": min(s["central_film"] for s in solved["screw"]),
        "film_thickness_central_nut": min(s["central_film"] for s in solved["nut"]),
        "film_temperature_rise": max(s["temperature_rise"] for s in everything),
        "contact_pressure_max": max(float(ball_ellipse(screw, angle, r, heaviest).p_max) for r in RACEWAYS),
        "ball_load_max": heaviest,
    }


@lru_cache(maxsize=1024)
def ball_loads(screw: ScrewParameters, force: float, carrying: bool = True) -> Array:
    """Loads of the balls of a nut under an axial force [N], of the carrying ones or as if all carried."""
    return nut_loads(screw, force, screw.loaded_ball_count if carrying else screw.ball_count)


def solved_nut(
    parameters: Parameters,
    raceway: str,
    force: float,
    speed: float,
    temperature: float,
    slope: float,
) -> Array:
    """Solve the mean ball of one raceway of a nut, sum over the balls by a film with this exponent of load.

    Returns (5,): viscous torque at viscosity ratio 1 and full viscous share, mechanistic: rolling torque [N m];
    effective film for that share, mechanistic: of the mean ball [m]; its thermal minimum, central film [m], rise [K]
    """
    mechanistic = parameters.friction.law is Law.MECHANISTIC
    loads = ball_loads(parameters.screw, force, mechanistic)
    load = mean_load(loads)
    hot = solved_contact(parameters, raceway, load, speed, temperature)
    own = hot["central_film"]
    if mechanistic:
        contacts = MeanBallContacts(parameters, {raceway: [(load, hot)]})
        at = np.array([[speed]]), np.array([[temperature]])
        mean = contacts.values(raceway, np.array([load]), *at)
        lost = contacts.values(raceway, loads, *at)["rolling_loss"].sum(axis=0)
        torque = rolling_torque(parameters, raceway, load, mean, lost, *at)[0, 0]
    else:
        films = _PowerFilm(load, dict.fromkeys(RACEWAYS, (own, slope)))
        sums = nut_sums(parameters, loads, speed, temperature, films)._asdict()
        torque, own = sums[f"viscous_{raceway}"], sums[f"film_{raceway}"]
    return np.array([torque, own, hot["minimum_film"], hot["central_film"], hot["temperature_rise"]])


@dataclass
class _PowerFilm:
    """Film around that of the mean ball, whose load [N] is given: by raceway its film [m] and the exponent of load."""

    load: float
    films: Mapping[str, tuple[float, float]]

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        film, slope = self.films[raceway]
        return np.asarray(film * (load / self.load) ** slope)


class DirectState(NamedTuple):
    """Operating point of the double nut without a map."""

    friction_torque: float  # [N.m]
    film_thickness_central_screw: float  # [m] smallest over the balls
    film_thickness_central_nut: float  # [m]
    film_temperature_rise: float  # [K] largest over the balls


@dataclass
class MeanBallContacts:
    """ContactValues of the mechanistic law from mean balls, of several the nearest one, other losses by closed form.

    solved: by raceway, loads [N] with QUANTITIES of their contacts
    """

    parameters: Parameters
    solved: Mapping[str, Sequence[tuple[float, Mapping[str, float]]]]

    def values(self, raceway: str, load: Array, speed: Array, temperature: Array) -> dict[str, Array]:
        """Quantities (n, 1, 1) at ball loads (n,), a speed (1, 1) and a temperature (1,): those of the solution."""
        target, at = mean_load(load), (float(speed.flat[0]), float(temperature.flat[0]))
        mean, contact = min(self.solved[raceway], key=lambda one: abs(math.log(one[0] / target)))
        result = {name: np.full((load.size, 1, 1), value) for name, value in contact.items()}
        loads = np.append(mean, load)
        closed = closed_forms(rolling_contacts(self.parameters, raceway, loads, *at)).values["rolling_loss"]
        result["rolling_loss"] = contact["rolling_loss"] * (closed[1:] / closed[0])[:, None, None]
        return result


class DirectContacts:
    """Contacts of the mechanistic law, the mean ball of each raceway solved at each new point (ContactValues)."""

    def __init__(self, parameters: Parameters) -> None:
        self.parameters, self._solved = parameters, cache(partial(solved_contact, parameters))

    def values(self, raceway: str, load: Array, speed: Array, temperature: Array) -> dict[str, Array]:
        """Quantities (n, 1, t) at the ball loads (n,) of a nut, or at their mean_load alone, at a speed (1, 1)."""
        if temperature.size > 1:
            each = [self.values(raceway, load, speed, one) for one in np.split(temperature, temperature.size)]
            return {name: np.concatenate([one[name] for one in each], axis=2) for name in each[0]}
        # the mean of many loads and that of their mean differ by rounding
        mean = float(f"{mean_load(load):.12g}")
        contact = self._solved(raceway, mean, float(speed.flat[0]), float(temperature.flat[0]))
        contacts = MeanBallContacts(self.parameters, {raceway: [(mean, contact)]})
        return contacts.values(raceway, load, speed, temperature)


def mean_ball_state(
    parameters: Parameters,
    friction_set: FrictionSet,
    preload: float,
    speed: float,
    temperature: float,
    axial_load: float = 0.0,
    films: Parameters | None = None,
) -> DirectState:
    """Torque and extremes from the mean ball per raceway and nut, which gives the friction of all (see mean_load).

    Films of the others by the closed formula: an error of second order in the torque. Where the heaviest was solved as
    well, its load 3 to 13 % higher, films differed by 0.05 % in the mean and 0.25 % at most, rises by 0.9 and 13 %, as
    much as solves scatter: two screws, 30 points each.
    films: of the balls whose films and rise are shown; None = the parameters
    """
    screw, at = parameters.screw, (speed, temperature)
    mechanistic, shared = friction_set.law is Law.MECHANISTIC, films in (None, parameters)
    torque, rise = 0.0, 0.0
    means: dict[str, list[tuple[float, Mapping[str, float]]]] = {name: [] for name in RACEWAYS}
    thinnest = dict.fromkeys(RACEWAYS, math.inf)
    forces = nut_forces(parameters, preload, axial_load)
    for force, times in Counter(force for force in forces if force > 0.0).items():
        carrying, loads = ball_loads(screw, force), ball_loads(screw, force, mechanistic)
        mean = mean_load(loads)
        balls = np.array([carrying.min(), mean, carrying.max()])
        wide, slopes = math.log(balls[2] / balls[0]), {}
        for raceway in RACEWAYS:
            hot = solved_contact(films or parameters, raceway, mean, *at)
            own = hot["central_film"]
            if not shared:
                own = solve_ball(parameters, raceway, mean, *at, True).h_c
            light, middle, heavy = film_formula(parameters, raceway, balls, *at)
            means[raceway].append((mean, hot))
            slopes[raceway] = own, math.log(heavy / light) / wide if wide > EQUAL_LOADS else 0.0
            thinner = hot["central_film"] * float(min(light, heavy) / middle)
            thinnest[raceway], rise = min(thinnest[raceway], thinner), max(rise, hot["temperature_rise"])
        if not mechanistic:
            sums = nut_sums(parameters, loads, *at, _PowerFilm(mean, slopes))
            torque += times * sums.torque(*friction_set.values)
    if mechanistic:
        nuts = nuts_powers(parameters, forces, MeanBallContacts(parameters, means), *at)
        torque = sum(times * nut.torque(*friction_set.values) for times, nut in nuts)
    return DirectState(torque, thinnest["screw"], thinnest["nut"], rise)
