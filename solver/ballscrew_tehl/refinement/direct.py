"""Films of the balls from the contact solver, without a map."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..atlas.groups import QUANTITIES, closed_forms, rolling_contacts, unmodelled
from ..contact import THICKEST, ContactResult, solve_ball
from ..friction.mechanistic import mean_load, nuts_powers, rolling_torque
from ..friction.sets import FrictionSet
from ..friction.torque import nut_forces, nut_sums
from ..parameters.file import Parameters, ScrewParameters, changed
from ..physics.ball_law import Array, contact_angle_at_ball_load
from ..physics.film import film_formula
from ..physics.hertz import RACEWAYS, ball_ellipse
from ..physics.kinematics import ROLLING_FRAME
from ..physics.load import EQUAL_LOADS, load_nodes, nut_loads
from ..runtime.packed import MECHANISTIC

#: nodes per unit of ln(load) of a nut, each of which is a solve
NODES_PER_LN = 4.0


def rolling_parameters(parameters: Parameters) -> Parameters:
    """Parameters of the contacts whose films and rises are shown: those of rolling balls, see ROLLING_FRAME."""
    if parameters.friction.kinematics == ROLLING_FRAME:
        return parameters
    return changed(parameters, friction={"law": MECHANISTIC})


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
    """QUANTITIES of a ball by a thermal solve, or by the closed forms where these give a film above THICKEST of R_x.

    Hot films are thicker than the closed form: one whose oil ends before it loses anything has that of the closed form.

    Raises       UnconvergedContactError: names the contact and the reason
    """
    if parameters.friction.kinematics != ROLLING_FRAME:
        return contact_quantities(solve_ball(parameters, raceway, load, speed, temperature, thermal=True))
    contact = rolling_contacts(parameters, raceway, np.array([load]), speed, temperature)
    forms = unmodelled(dict.fromkeys(QUANTITIES, np.zeros(1)), closed_forms(contact).values)
    closed = {name: float(value[0]) for name, value in forms.items()}
    if closed["central_film"] > THICKEST * float(contact.R_x[0]):
        return closed
    values = contact_quantities(solve_ball(parameters, raceway, load, speed, temperature, thermal=True))
    if math.isnan(values["rolling_loss"]):
        values["rolling_loss"] = closed["rolling_loss"]
    return values


class DirectFilm:
    """Film model that solves the contacts at each call: thermal ("solved_thermal") or isothermal ("solved").

    The loads of the balls of a nut form a narrow range; the film is solved at Chebyshev nodes of ln(load) over it and
    interpolated by the polynomial through them, more nodes where the range is wide. Solutions are cached.
    """

    def __init__(self, parameters: Parameters, thermal: bool) -> None:
        self.parameters = parameters
        self.thermal = thermal
        self.name = "solved_thermal" if thermal else "solved"
        self._solved: dict[tuple[str, float, float, float], float] = {}

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        """Central film [m] of balls with load (n,) [N] at speed [rad/s] and temperature [K].

        Raises       UnconvergedContactError: a contact that did not converge
        """
        nodes, weights = load_nodes(load, NODES_PER_LN)
        films = [self._film(raceway, float(node), speed, temperature) for node in nodes]
        return np.asarray(np.exp(weights @ np.log(films)))

    def _film(self, raceway: str, load: float, speed: float, temperature: float) -> float:
        key = (raceway, load, speed, temperature)
        if key not in self._solved:
            self._solved[key] = solve_ball(
                self.parameters, raceway, load, speed, temperature, self.thermal
            ).h_c
        return self._solved[key]


def direct_extremes(
    parameters: Parameters, preload: float, axial_load: float, speed: float, temperature: float
) -> dict[str, float]:
    """Film, temperature, pressure and load extremes of the load-carrying balls of both nuts, by thermal solves.

    Parameters   preload [N] > 0, axial_load [N]; speed [rad/s] > 0, temperature [K]
    Returns      the outputs of NutMap.evaluate of the same names (without lambda_ratio), SI
    Raises       UnconvergedContactError
    """
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
def _ball_loads(screw: ScrewParameters, force: float, count: int) -> Array:
    return nut_loads(screw, force, count)


class NutContacts:
    """The contacts of the balls of one nut, one solve per raceway and film.

    Parameters   film : film model of the friction: of the thermal solve ("solved_thermal"), of the isothermal one
                 ("solved"), which is then solved as well, or "mechanistic"
    """

    def __init__(self, parameters: Parameters, film: str) -> None:
        self.parameters = parameters
        self.film = film
        screw = parameters.screw
        self._count = screw.loaded_ball_count if film == MECHANISTIC else screw.ball_count

    def mean_load(self, force: float) -> float:
        """mean_load of the balls in the friction sums of a nut under an axial force [N]."""
        return mean_load(_ball_loads(self.parameters.screw, force, self._count))

    def extreme_loads(self, force: float) -> tuple[float, float]:
        """Lightest and heaviest of the load-carrying balls [N]."""
        screw = self.parameters.screw
        loads = _ball_loads(screw, force, screw.loaded_ball_count)
        return float(loads.min()), float(loads.max())

    def solve(self, raceway: str, force: float, speed: float, temperature: float, slope: float) -> Array:
        """Solve the mean ball of one raceway and sum over the balls.

        Parameters   force of the nut [N] > 0, speed [rad/s] > 0, temperature [K]
                     slope : exponent of load that leads from the film of the mean ball to that of the others
        Returns      (5,): viscous torque at viscosity ratio 1 and full viscous share, mechanistic: rolling torque
                     [N m]; effective film for that share at a roughness height, mechanistic: of the mean ball [m];
                     thermal minimum and central film [m] and rise [K] of the mean ball
        Raises       UnconvergedContactError; ValueError: out of range
        """
        screw = self.parameters.screw
        loads = _ball_loads(screw, force, self._count)
        load = mean_load(loads)
        hot = solved_contact(self.parameters, raceway, load, speed, temperature)
        extremes = hot["minimum_film"], hot["central_film"], hot["temperature_rise"]
        if self.film == MECHANISTIC:
            contacts = MeanBallContacts(self.parameters, {raceway: [(load, hot)]})
            at = np.array([[speed]]), np.array([[temperature]])
            mean = contacts.values(raceway, np.array([load]), *at)
            lost = contacts.values(raceway, loads, *at)["rolling_loss"].sum(axis=0)
            rolling = rolling_torque(self.parameters, raceway, load, mean, lost, *at)
            return np.array([rolling[0, 0], hot["central_film"], *extremes])
        own = hot["central_film"]
        if self.film == "solved":
            own = solve_ball(self.parameters, raceway, load, speed, temperature, False).h_c
        film = _PowerFilm(load, {name: (own, slope) for name in RACEWAYS})
        sums = nut_sums(self.parameters, loads, speed, temperature, film)._asdict()
        return np.array([sums[f"viscous_{raceway}"], sums[f"film_{raceway}"], *extremes])


class _PowerFilm:
    """Film around that of the mean ball, whose load [N] is given: by raceway its film [m] and the exponent of load."""

    name = "mean ball"

    def __init__(self, load: float, films: Mapping[str, tuple[float, float]]) -> None:
        self.load, self.films = load, films

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        film, slope = self.films[raceway]
        return np.asarray(film * (load / self.load) ** slope)


class DirectState(NamedTuple):
    """Operating point of the double nut without a map."""

    friction_torque: float  # [N.m]
    film_thickness_central_screw: float  # [m] least over the balls
    film_thickness_central_nut: float  # [m]
    film_temperature_rise: float  # [K] largest over the balls


#: load of a ball [N] and QUANTITIES of its contact
Solved = tuple[float, Mapping[str, float]]


class MeanBallContacts:
    """Contacts of the mechanistic law from those of mean balls on each raceway (mechanistic.ContactValues).

    Of several, the one whose load is nearest to the mean load.
    The rolling loss of the others by its closed form; the law takes nothing else of them.
    """

    name = MECHANISTIC

    def __init__(self, parameters: Parameters, solved: Mapping[str, Sequence[Solved]]) -> None:
        self.parameters, self.solved = parameters, solved

    def values(self, raceway: str, load: Array, speed: Array, temperature: Array) -> dict[str, Array]:
        """Quantities (n, 1, 1) at ball loads (n,), a speed (1, 1) and a temperature (1,): those of the solution."""
        wanted, at = mean_load(load), (float(speed.flat[0]), float(temperature.flat[0]))
        mean, contact = min(self.solved[raceway], key=lambda one: abs(math.log(one[0] / wanted)))
        found = {name: np.full((load.size, 1, 1), value) for name, value in contact.items()}
        loads = np.append(mean, load)
        closed = closed_forms(rolling_contacts(self.parameters, raceway, loads, *at)).values["rolling_loss"]
        found["rolling_loss"] = contact["rolling_loss"] * (closed[1:] / closed[0])[:, None, None]
        return found


class DirectContacts:
    """Contacts of the mechanistic law, the mean ball of each raceway solved at each new point (ContactValues)."""

    name = MECHANISTIC

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self._solved: dict[tuple[str, float, float, float], dict[str, float]] = {}

    def values(self, raceway: str, load: Array, speed: Array, temperature: Array) -> dict[str, Array]:
        """Quantities (n, 1, 1) at the ball loads (n,) of a nut, or at their mean_load alone, at a single point.

        Raises       UnconvergedContactError: a contact that did not converge
        """
        # the mean of many loads and that of their mean differ by rounding
        mean = float(f"{mean_load(load):.12g}")
        key = raceway, mean, float(speed.flat[0]), float(temperature.flat[0])
        if key not in self._solved:
            self._solved[key] = solved_contact(self.parameters, *key)
        contacts = MeanBallContacts(self.parameters, {raceway: [(mean, self._solved[key])]})
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
    """Torque and extremes from one ball per raceway and nut, the mean one.

    It gives the friction of all (see mean_load). The film of the others by the closed formula, which leaves an error of
    second order in the torque; the rise is that of the mean ball, below the load of the heaviest by 3 to 13 %. Where
    that was solved as well, films differed by 0.05 % in the mean and 0.25 % at most, rises by 0.9 and 13 %, as much as
    the solves themselves scatter: two screws, 30 points each, whose certificates stated film errors of 0.15 and 0.10 %
    by it, 0.14 and 0.12 % without.

    Parameters   preload [N] > 0, speed [rad/s] > 0, temperature [K], axial_load [N]
                 films : of the balls whose films and rise are shown; None = the parameters
    Raises       UnconvergedContactError; ValueError: out of range
    """
    screw, at = parameters.screw, (speed, temperature)
    mechanistic, thermal = friction_set.film_model == MECHANISTIC, friction_set.film_model != "solved"
    shared = thermal and films in (None, parameters)
    torque, rise = 0.0, 0.0
    means: dict[str, list[Solved]] = {name: [] for name in RACEWAYS}
    thinnest = dict.fromkeys(RACEWAYS, math.inf)
    forces = nut_forces(parameters, preload, axial_load)
    for force, times in Counter(force for force in forces if force > 0.0).items():
        carrying = _ball_loads(screw, force, screw.loaded_ball_count)
        loads = carrying if mechanistic else _ball_loads(screw, force, screw.ball_count)
        mean = mean_load(loads)
        balls = np.array([carrying.min(), mean, carrying.max()])
        wide, slopes = math.log(balls[2] / balls[0]), {}
        for raceway in RACEWAYS:
            hot = solved_contact(films or parameters, raceway, mean, *at)
            own = hot["central_film"]
            if not shared:
                own = solve_ball(parameters, raceway, mean, *at, thermal).h_c
            light, middle, heavy = film_formula(parameters, raceway, balls, *at)
            means[raceway].append((mean, hot))
            slopes[raceway] = own, math.log(heavy / light) / wide if wide > EQUAL_LOADS else 0.0
            thinnest[raceway] = min(
                thinnest[raceway], hot["central_film"] * float(min(light, heavy) / middle)
            )
            rise = max(rise, hot["temperature_rise"])
        if not mechanistic:
            sums = nut_sums(parameters, loads, *at, _PowerFilm(mean, slopes))
            torque += times * sums.torque(*friction_set.values)
    if mechanistic:
        nuts = nuts_powers(parameters, forces, MeanBallContacts(parameters, means), *at)
        torque = sum(times * nut.torque(*friction_set.values) for times, nut in nuts)
    return DirectState(torque, thinnest["screw"], thinnest["nut"], rise)
