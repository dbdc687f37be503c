"""Torque of nut and double nut: by the shear of the whole film, and what both laws share; preload of a torque.

Source of all equations: Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231, Eqs. (14)-(24); "Eq. (n)" is its
numbering. The forces on a ball take floats and arrays alike and check nothing: their callers do.
"""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..parameters.file import Parameters, ScrewParameters
from ..physics.ball_law import check_force, contact_angle_at_ball_load
from ..physics.hertz import RACEWAYS, ball_ellipse, reduced_radii
from ..physics.kinematics import surface_speeds
from ..physics.load import double_nut_loads, nut_loads
from ..physics.lubricant import eta0
from .sets import FrictionSet


def roughness_share(film: Any, roughness_height: Any) -> Any:
    """Fraction 1/(1 + (h_r/h)^2) of the viscous part that remains where the film h [m] is as thin as h_r [m].

    An empirical transition from film to asperities; h_r is fitted and not a measured roughness. differs from paper:
    added here, Zhao 2023 has no such term.
    """
    return 1.0 / (1.0 + np.square(np.asarray(roughness_height) / film))


def roughness_share_slope(film: Any, roughness_height: Any) -> Any:
    """Derivative of roughness_share with respect to the roughness height [1/m]."""
    x = np.asarray(roughness_height) / film
    return -2.0 * x / film / np.square(1.0 + np.square(x))


def hysteresis_force(load: Any, b: Any, radius: float, coefficient: float) -> Any:
    """Rolling resistance 3 mu_hs Q b/(16 r) [N] of one contact; coefficient mu_hs: fraction of the elastic work that is
    lost.

    Zhao 2023, Eq. (18); errata: the printed integrand lacks the square root of the Hertz pressure, the printed result
    has it.
    """
    return 3.0 * coefficient * np.asarray(load) * b / (16.0 * radius)


class FilmModel(Protocol):
    """Central film of the contacts of one screw."""

    def central_film(self, raceway: str, load: np.ndarray, speed: float, temperature: float) -> np.ndarray:
        """Film [m] of balls with load [N] > 0 at a screw speed [rad/s] > 0 and an oil temperature [K]."""
        ...


class TorqueParts(NamedTuple):
    """Magnitudes [N.m]; mechanistic: rolling loss and oil between balls, hysteresis, shear and ball on ball."""

    viscous: Any = 0.0
    hysteresis: Any = 0.0
    sliding: Any = 0.0

    @property
    def total(self) -> Any:
        """Their sum."""
        return self.viscous + self.hysteresis + self.sliding


class UnfittedTorques(NamedTuple):
    """Torque of one nut before fitted numbers enter [N.m]; floats, or arrays over speed and temperature."""

    viscous_screw: Any  # of a raceway at ratio 1 and full share; mechanistic: rolling loss
    viscous_nut: Any
    hysteresis: float
    sliding: float  # at coefficient 1; mechanistic: of ball on ball in a full film
    film_screw: Any = math.inf  # effective film for the roughness share [m]
    film_nut: Any = math.inf
    shear: Any = 0.0  # of both raceways, mechanistic
    thrust_factor: Any = 1.0  # of the sliding part, see mechanistic
    drag: Any = 0.0  # of the oil between balls, mechanistic

    def parts(self, ratio: float, coefficient: float, height: float = 0.0) -> TorqueParts:
        """Torque of the nut by part; arguments as FrictionSet.values."""
        viscous = self.viscous_screw * roughness_share(self.film_screw, height)
        viscous = viscous + self.viscous_nut * roughness_share(self.film_nut, height)
        sliding = self.shear + coefficient * self.thrust_factor * self.sliding
        return TorqueParts(ratio * viscous + self.drag, self.hysteresis, sliding)

    def torque(self, ratio: float, coefficient: float, height: float = 0.0) -> Any:
        """Sum of the parts."""
        return self.parts(ratio, coefficient, height).total


UNLOADED = UnfittedTorques(0.0, 0.0, 0.0, 0.0)


def sum_of_nuts(nuts: Iterable[TorqueParts]) -> TorqueParts:
    """Parts of several nuts together."""
    return TorqueParts(*map(sum, zip(*nuts, strict=True)))


def check_motion(loads: np.ndarray, speed: Any) -> None:
    """ValueError for a ball load that is negative or not finite, or a speed that is not positive."""
    if not np.all((loads >= 0.0) & np.isfinite(loads)):
        raise ValueError("load of a ball negative or not finite; needs >= 0: check preload")
    if not np.all(np.isfinite(speed) & (np.asarray(speed) > 0.0)):
        raise ValueError(f"speed = {speed} rad/s; needs finite, > 0: there is no film at rest")


def nut_sums(
    parameters: Parameters, loads: np.ndarray, speed: Any, temperature: Any, film_model: FilmModel
) -> UnfittedTorques:
    """Friction of the balls (n,) [N] of one nut at the contact angle under the mean load; speed [rad/s] > 0, [K].

    Speeds and temperatures may be arrays that broadcast to (...), for a film model that gives (n, ...).

    Zhao 2023, Eqs. (23)-(24) for one nut: T = sum F (r_m + r_b cos(beta)) cos(lambda); viscous and hysteresis force on
    both raceways, sliding once per ball, as the printed torques sum. Eqs. (15)-(16) for the viscous force pi a b eta
    |du|/h of a parallel film; errata: the integral as printed in Eq. (15) gives 2 pi a b/3, its printed result and all
    printed torques need pi a b, which is kept. differs from paper: each ball with its own load. The film of the
    roughness fraction is the mean of 1/h^2 over the balls, weighted with their viscous force: exact to first order in
    (h_r/h)^2.
    """
    loads = np.asarray(loads, dtype=float)
    check_motion(loads, speed)
    loads = loads[loads > 0.0]
    if loads.size == 0:
        return UNLOADED
    screw = parameters.screw
    beta = _contact_angle(screw, loads)
    eta = eta0(parameters.lubricant, temperature)
    by_ball = (slice(None), *(None,) * np.broadcast(speed, temperature).ndim)
    viscous, films = [], []
    for raceway in RACEWAYS:
        contact = ball_ellipse(screw, beta, raceway, loads)
        h = film_model.central_film(raceway, loads, speed, temperature)
        u_1, u_2 = surface_speeds(parameters, raceway, speed)
        force = np.pi * (contact.a * contact.b)[by_ball] * eta * np.abs(u_1 - u_2) / h
        total = force.sum(axis=0)
        viscous.append(_arm(screw, beta) * total)
        films.append(np.sqrt(total / np.sum(force / h**2, axis=0)))
    return UnfittedTorques(viscous[0], viscous[1], *load_torques(parameters, loads), films[0], films[1])


def load_torques(parameters: Parameters, loads: np.ndarray) -> tuple[float, float]:
    """Hysteresis torque, and sliding torque at coefficient 1 [N.m], of a nut with ball loads (n,) > 0 [N].

    Sliding: mu_s (1 - 3c + c^3) Q, the factor fitted as one number, once per ball, not once per raceway. Zhao 2023,
    Eqs. (20)-(21), c the lines without slip as a fraction of the semi-axis; errata: the printed c = a^2/(6 d_b) is a
    length; the middle integral is printed with the opposite sign and half the weight of the stated result.
    """
    arm = _arm(parameters.screw, _contact_angle(parameters.screw, loads))
    return arm * hysteresis_sum(parameters, loads), arm * float(loads.sum())


def hysteresis_sum(parameters: Parameters, loads: np.ndarray, rolling: bool = False) -> float:
    """Force of the hysteresis of balls (n,) > 0 [N] on both raceways [N], by u_e/r_b (paper) or u_e/R_x (rolling)."""
    screw, coefficient = parameters.screw, parameters.friction.hysteresis_coefficient
    beta, force = _contact_angle(screw, loads), 0.0
    for raceway in RACEWAYS:
        radius = float(reduced_radii(screw, beta, raceway)[0]) if rolling else 0.5 * screw.ball_diameter
        width = ball_ellipse(screw, beta, raceway, loads).b
        force += float(hysteresis_force(loads, width, radius, coefficient).sum())
    return force


def _contact_angle(screw: ScrewParameters, loads: np.ndarray) -> float:
    return float(contact_angle_at_ball_load(screw, loads.mean()))


def _arm(screw: ScrewParameters, beta: float) -> float:
    return (screw.nominal_radius + 0.5 * screw.ball_diameter * math.cos(beta)) * math.cos(screw.lead_angle)


def nut_forces(parameters: Parameters, preload: float, axial_load: float) -> tuple[float, float]:
    """Axial forces [N] of the two nuts under a preload [N] > 0 and an axial load [N]; 0 for a nut that is free."""
    if axial_load == 0.0:
        return preload, preload
    shared = double_nut_loads(parameters.screw, preload, axial_load, parameters.summed_balls)
    return float(shared.force_a), float(shared.force_b)


def double_nut_torque(
    parameters: Parameters,
    friction_set: FrictionSet,
    film_model: FilmModel,
    preload: float,
    speed: float,
    temperature: float,
    axial_load: float = 0.0,
) -> TorqueParts:
    """Torque of the nut under preload and axial load [N] at a speed [rad/s] of any sign, not 0, and a temperature [K].

    Steady motion; the loads of each nut are distributed as by a preload of its axial force; an axial load on loose nuts
    is not modelled. Zhao 2023, Eq. (24); differs from paper: 2 T_nut becomes the sum over two nuts of their local
    force. Oversize balls: viscous and hysteresis part of all four contacts of a ball, sliding once per pair of flanks;
    the spin of a ball between four flanks is not in it.
    """
    check_force("preload", preload)
    check_force("axial_load", axial_load, allow_negative=True)
    forces = nut_forces(parameters, preload, axial_load) if preload > 0.0 else ()
    loads = [nut_loads(parameters.screw, force, parameters.screw.ball_count) for force in forces]
    nuts = (nut_sums(parameters, own, abs(speed), temperature, film_model) for own in loads)
    return sum_of_nuts(nut.parts(*friction_set.values) for nut in nuts)
