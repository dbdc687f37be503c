"""Films of the balls from the contact solver, without a map."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..contact import ContactResult, solve_ball
from ..friction.mechanistic import mean_load, nuts_powers, rolling_torque
from ..friction.sets import FrictionSet
from ..friction.torque import nut_forces, nut_sums
from ..parameters.file import Parameters, ScrewParameters
from ..physics.ball_formula import film_formula, minimum_rolling_loss, rolling_formula
from ..physics.ball_law import Array
from ..physics.hertz import RACEWAYS
from ..physics.load import EQUAL_LOADS, load_nodes, nut_loads
from ..runtime.packed import MECHANISTIC

#: nodes per unit of ln(load) of a nut, each of which is a solve
NODES_PER_LN = 4.0


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
        raceway: [
            solve_ball(parameters, raceway, q, speed, temperature, thermal=True) for q in {heaviest, lightest}
        ]
        for raceway in RACEWAYS
    }
    everything = [solution for pair in solved.values() for solution in pair]
    return {
        "film_thickness_min": min(s.h_m for s in everything),
        "film_thickness_central_screw": min(s.h_c for s in solved["screw"]),
        "film_thickness_central_nut": min(s.h_c for s in solved["nut"]),
        "film_temperature_rise": max(s.temperature_rise_mean for s in everything),
        "contact_pressure_max": max(s.hertz.p_max for s in everything),
        "ball_load_max": heaviest,
    }


class RacewayValues(NamedTuple):
    """One raceway of one nut from the contact of its mean ball."""

    viscous_torque: float  # [N.m] at viscosity ratio 1 and full viscous share; mechanistic: rolling torque
    effective_film: float  # [m] for the viscous share at a roughness height; mechanistic: of the mean ball
    minimum_film: float  # [m] thermal, of the mean ball
    central_film: float  # [m] thermal, of the mean ball
    temperature_rise: float  # [K] of the mean ball


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

    def solve(
        self, raceway: str, force: float, speed: float, temperature: float, slope: float
    ) -> RacewayValues:
        """Solve the mean ball and sum over the balls.

        Parameters   force of the nut [N] > 0, speed [rad/s] > 0, temperature [K]
                     slope : exponent of load that leads from the film of the mean ball to that of the others
        Raises       UnconvergedContactError; ValueError: out of range
        """
        screw = self.parameters.screw
        loads = _ball_loads(screw, force, self._count)
        load = mean_load(loads)
        hot = solve_ball(self.parameters, raceway, load, speed, temperature, thermal=True)
        extremes = hot.h_m, hot.h_c, hot.temperature_rise_mean
        if self.film == MECHANISTIC:
            contacts = MeanBallContacts(self.parameters, {raceway: [hot]})
            at = np.array([[speed]]), np.array([[temperature]])
            rolling = rolling_torque(self.parameters, raceway, loads, *at, contacts)
            return RacewayValues(float(rolling[0, 0]), hot.h_c, *extremes)
        isothermal = self.film == "solved"
        own = solve_ball(self.parameters, raceway, load, speed, temperature, False) if isothermal else hot
        film = _PowerFilm(load, {name: (own.h_c, slope) for name in RACEWAYS})
        sums = nut_sums(self.parameters, loads, speed, temperature, film)._asdict()
        return RacewayValues(sums[f"viscous_{raceway}"], sums[f"film_{raceway}"], *extremes)


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


class MeanBallContacts:
    """Contacts of the mechanistic law from solutions of mean balls on each raceway (mechanistic.ContactValues).

    Of several, the one whose load is nearest to the mean load.
    The rolling loss of the others by its closed formula; the law takes nothing else of them.
    """

    name = MECHANISTIC

    def __init__(self, parameters: Parameters, solved: Mapping[str, Sequence[ContactResult]]) -> None:
        self.parameters, self.solved = parameters, solved

    def value(self, raceway: str, name: str, load: Array, speed: Array, temperature: Array) -> Array:
        """A quantity (n, 1, 1) at ball loads (n,), a speed (1, 1) and a temperature (1,): those of the solution."""
        wanted, at = mean_load(load), (float(speed[0, 0]), float(temperature[0]))
        mean = min(self.solved[raceway], key=lambda one: abs(math.log(one.conditions.load / wanted)))
        values = {
            "thermal_central_film": mean.h_c,
            "rolling_loss": mean.rolling_loss,
            "core_pressure": mean.core_pressure,
            "core_area": mean.core_area,
            "mean_rise": mean.mean_temperature - mean.conditions.temperature,
        }
        found = np.full(load.shape, values[name])
        if name == "rolling_loss":
            own, others = (
                rolling_formula(self.parameters, raceway, loads, *at)
                for loads in (np.array(mean.conditions.load), load)
            )
            found = np.maximum(
                found / own * others, minimum_rolling_loss(self.parameters, raceway, load, *at)
            )
        return found[:, None, None]


class DirectContacts:
    """Contacts of the mechanistic law, the mean ball of each raceway solved at each new point (ContactValues)."""

    name = MECHANISTIC

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self._solved: dict[tuple[str, float, float, float], ContactResult] = {}

    def value(self, raceway: str, name: str, load: Array, speed: Array, temperature: Array) -> Array:
        """A quantity (n, 1, 1) at the ball loads (n,) of a nut, or at their mean_load alone, at a single point.

        Raises       UnconvergedContactError: a contact that did not converge
        """
        # the mean of many loads and that of their mean differ by rounding
        mean = float(f"{mean_load(load):.12g}")
        key = raceway, mean, float(speed[0, 0]), float(temperature[0])
        if key not in self._solved:
            self._solved[key] = solve_ball(self.parameters, *key, thermal=True)
        contacts = MeanBallContacts(self.parameters, {raceway: [self._solved[key]]})
        return contacts.value(raceway, name, load, speed, temperature)


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
    means: dict[str, list[ContactResult]] = {name: [] for name in RACEWAYS}
    thinnest = dict.fromkeys(RACEWAYS, math.inf)
    forces = nut_forces(parameters, preload, axial_load)
    for force, times in Counter(force for force in forces if force > 0.0).items():
        carrying = _ball_loads(screw, force, screw.loaded_ball_count)
        loads = carrying if mechanistic else _ball_loads(screw, force, screw.ball_count)
        mean = mean_load(loads)
        balls = np.array([carrying.min(), mean, carrying.max()])
        wide, slopes = math.log(balls[2] / balls[0]), {}
        for raceway in RACEWAYS:
            own = solve_ball(parameters, raceway, mean, *at, thermal)
            hot = own if shared else solve_ball(films or parameters, raceway, mean, *at, thermal=True)
            light, middle, heavy = film_formula(parameters, raceway, balls, *at)
            means[raceway].append(own)
            slopes[raceway] = own.h_c, math.log(heavy / light) / wide if wide > EQUAL_LOADS else 0.0
            thinnest[raceway] = min(thinnest[raceway], hot.h_c * float(min(light, heavy) / middle))
            rise = max(rise, hot.temperature_rise_mean)
        if not mechanistic:
            sums = nut_sums(parameters, loads, *at, _PowerFilm(mean, slopes))
            torque += times * sums.torque(*friction_set.values).total
    if mechanistic:
        ratio, net, _ = friction_set.values
        nuts = nuts_powers(parameters, forces, MeanBallContacts(parameters, means), *at)
        torque = sum(times * nut.torque(ratio, net) for times, nut in nuts)
    return DirectState(torque, thinnest["screw"], thinnest["nut"], rise)
