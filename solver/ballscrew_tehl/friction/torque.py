"""Friction by the shear of the whole film: forces on a ball, torque of nut and double nut; preload of a torque.

Source of all equations: Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231, Eqs. (14)-(24); "Eq. (n)" is its
numbering. The forces on a ball take floats and arrays alike and check nothing: their callers do.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..parameters.file import Parameters, ScrewParameters
from ..physics.ball_law import check_force, contact_angle_at_ball_load, rising_root
from ..physics.hertz import RACEWAYS, ball_ellipse, reduced_radii
from ..physics.kinematics import surface_speeds
from ..physics.load import double_nut_loads, nut_loads
from ..physics.lubricant import eta0
from .sets import FrictionSet


def viscous_force(a: Any, b: Any, viscosity: Any, slip: Any, film: Any) -> Any:
    """Force that shears the film of one contact.

    Parameters   a, b : semi-axes of the Hertz ellipse [m], > 0;  viscosity : apparent shear viscosity [Pa s]
                 slip : speed difference of the surfaces [m/s], >= 0;  film : isothermal central film [m], > 0
    Returns      pi a b eta |du| / h [N]
    Validity     Newtonian Couette flow in a parallel film over the whole ellipse
    Source       Zhao 2023, Eqs. (15)-(16); errata: the integral as printed in Eq. (15) gives 2 pi a b/3, its
                 printed result and all printed torques need pi a b, which is kept
    """
    return np.pi * np.asarray(a) * b * viscosity * np.abs(slip) / film


def roughness_share(film: Any, roughness_height: Any) -> Any:
    """Share of the viscous part that remains where the film is as thin as the roughness.

    Parameters   film : central film [m], > 0;  roughness_height : h_r [m], >= 0
    Returns      1/(1 + (h_r/h)^2), 1 without roughness
    Validity     an empirical transition from film to asperities; h_r is fitted and not a measured roughness
    Source       differs from paper: added here, Zhao 2023 has no such term
    """
    return 1.0 / (1.0 + np.square(np.asarray(roughness_height) / film))


def roughness_share_slope(film: Any, roughness_height: Any) -> Any:
    """Derivative of roughness_share with respect to the roughness height [1/m], arguments alike."""
    x = np.asarray(roughness_height) / film
    return -2.0 * x / film / np.square(1.0 + np.square(x))


def hysteresis_force(load: Any, b: Any, radius: float, coefficient: float) -> Any:
    """Rolling resistance of one contact by elastic hysteresis.

    Parameters   load : Q [N], >= 0;  b : semi-axis along rolling [m];  radius : r_b, of rolling R_x [m]
                 coefficient : share of the elastic work that is lost [1]
    Returns      3 mu_hs Q b/(16 r) [N]
    Source       Zhao 2023, Eq. (18); errata: the printed integrand lacks the square root of the Hertz
                 pressure, the printed result has it
    """
    return 3.0 * coefficient * np.asarray(load) * b / (16.0 * radius)


class FilmModel(Protocol):
    """Central film of the contacts of one screw with its kinematics; a friction set belongs to one, by its name."""

    name: str

    def central_film(self, raceway: str, load: np.ndarray, speed: float, temperature: float) -> np.ndarray:
        """Film [m] of balls with load [N] > 0 at a screw speed [rad/s] > 0 and an oil temperature [K]."""
        ...


class NutSums(NamedTuple):
    """Torque of one nut before any fitted parameter enters; `fitted` in SI gives the torque.

    viscous_screw, viscous_nut  viscous torque of that raceway at apparent viscosity ratio 1 and full share
                                [N.m]
    film_screw, film_nut        effective film for the roughness share [m]; inf for a nut without load
    hysteresis                  hysteresis torque, both raceways [N.m]
    sliding                     sliding torque at net coefficient 1 [N.m]
    """

    viscous_screw: Any
    viscous_nut: Any
    film_screw: Any
    film_nut: Any
    hysteresis: float
    sliding: float

    def torque(self, ratio: float, net_coefficient: float, roughness_height: float) -> "TorqueParts":
        """Torque of the nut for an apparent viscosity ratio [1], a net coefficient [1] and h_r [m]."""
        viscous = ratio * float(
            self.viscous_screw * roughness_share(self.film_screw, roughness_height)
            + self.viscous_nut * roughness_share(self.film_nut, roughness_height)
        )
        return TorqueParts(viscous, self.hysteresis, net_coefficient * self.sliding)


class TorqueParts(NamedTuple):
    """Magnitudes [N.m], >= 0."""

    viscous: float
    hysteresis: float
    sliding: float

    @property
    def total(self) -> float:
        """Their sum."""
        return self.viscous + self.hysteresis + self.sliding


UNLOADED = NutSums(0.0, 0.0, math.inf, math.inf, 0.0, 0.0)


def check_motion(loads: np.ndarray, speed: Any) -> None:
    """ValueError for a ball load that is negative or not finite, or a speed that is not positive."""
    if not np.all((loads >= 0.0) & np.isfinite(loads)):
        raise ValueError("load of a ball negative or not finite; needs >= 0: check preload")
    if not np.all(np.isfinite(speed) & (np.asarray(speed) > 0.0)):
        raise ValueError(f"speed = {speed} rad/s; needs finite, > 0: there is no film at rest")


def nut_sums(
    parameters: Parameters, loads: np.ndarray, speed: Any, temperature: Any, film_model: FilmModel
) -> NutSums:
    """Sum the friction of all balls of one nut, at the contact angle under the mean load.

    Parameters   loads : (n,) ball loads [N], >= 0;  speed : screw speed [rad/s], > 0;  temperature [K]: floats, or
                 arrays that broadcast to (...), for a film model that gives (n, ...)
    Returns      NutSums, viscous_* and film_* (...); UNLOADED if no ball carries load
    Raises       ValueError: speed not positive, load negative or not finite
    Source       Zhao 2023, Eqs. (23)-(24) for one nut: T = sum F (r_m + r_b cos(beta)) cos(lambda); viscous
                 and hysteresis force on both raceways, sliding once per ball, which is what the printed
                 torques sum.
                 differs from paper: each ball with its own load. The film of the roughness share is the mean
                 of 1/h^2 over the balls, weighted with their viscous force: exact to first order in (h_r/h)^2
    """
    loads = np.asarray(loads, dtype=float)
    check_motion(loads, speed)
    loads = loads[loads > 0.0]
    if loads.size == 0:
        return UNLOADED
    screw = parameters.screw
    beta = _contact_angle(screw, loads)
    viscosity = eta0(parameters.lubricant, temperature)
    by_ball = (slice(None), *(None,) * np.broadcast(speed, temperature).ndim)
    viscous, film = {}, {}
    for raceway in RACEWAYS:
        contact = ball_ellipse(screw, beta, raceway, loads)
        h = film_model.central_film(raceway, loads, speed, temperature)
        speeds = surface_speeds(parameters, raceway, speed)
        force = viscous_force(contact.a[by_ball], contact.b[by_ball], viscosity, speeds.u_1 - speeds.u_2, h)
        total = force.sum(axis=0)
        viscous[raceway] = _plain(_arm(screw, beta) * total)
        film[raceway] = _plain(np.sqrt(total / np.sum(force / h**2, axis=0)))
    alone = load_torques(parameters, loads)
    return NutSums(viscous["screw"], viscous["nut"], film["screw"], film["nut"], *alone)


def load_torques(parameters: Parameters, loads: np.ndarray) -> tuple[float, float]:
    """Hysteresis torque, and sliding torque at coefficient 1 [N.m], of a nut; arguments as nut_sums, loads > 0.

    Source       sliding: mu_s (1 - 3c + c^3) Q, the factor fitted as one number, once per ball, not once per raceway.
                 Zhao 2023, Eqs. (20)-(21), c the lines without slip as a fraction of the semi-axis; errata: the printed
                 c = a^2/(6 d_b) is a length; the middle integral is printed with the opposite sign and half the weight
                 of the stated result
    """
    arm = _arm(parameters.screw, _contact_angle(parameters.screw, loads))
    return arm * hysteresis_sum(parameters, loads), arm * float(loads.sum())


def hysteresis_sum(parameters: Parameters, loads: np.ndarray, rolling: bool = False) -> float:
    """Force of the hysteresis of all balls on both raceways [N]; arguments as nut_sums, loads > 0.

    Parameters   rolling : by the angular speed of rolling, u_e/R_x, in place of that of the paper, u_e/r_b
    """
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


def _plain(value: Any) -> Any:
    """A float for a single point, else the array."""
    return float(value) if np.ndim(value) == 0 else value


def nut_forces(parameters: Parameters, preload: float, axial_load: float) -> tuple[float, float]:
    """Axial forces [N] of the two nuts under a preload [N] > 0 and an axial load [N]; 0 for a nut that is free."""
    if axial_load == 0.0:
        return preload, preload
    shared = double_nut_loads(parameters.screw, preload, axial_load, parameters.screw.ball_count)
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
    """Friction torque of the preloaded nut while it turns: of both nuts, halves or sets of flanks (module load).

    Parameters   preload : [N], >= 0;  speed : screw speed [rad/s], not 0, its sign does not matter
                 temperature : of the oil [K];  axial_load : external load [N], adds to one nut, relieves the other
    Returns      TorqueParts; all zero at preload 0 (axial load on loose nuts is not modelled)
    Raises       ValueError: not finite, negative preload, speed 0
    Validity     steady motion; the loads of each nut are distributed as by a preload of its axial force
    Source       Zhao 2023, Eq. (24); differs from paper: 2 T_nut becomes the sum over two nuts of their own
                 force. Oversize balls: viscous and hysteresis part of all four contacts of a ball, sliding once per
                 pair of flanks; the spin of a ball between four flanks is not in it
    """
    check_force("preload", preload)
    check_force("axial_load", axial_load, allow_negative=True)
    parts = np.zeros(3)
    for force in nut_forces(parameters, preload, axial_load) if preload > 0.0 else ():
        if force > 0.0:
            loads = nut_loads(parameters.screw, force, parameters.screw.ball_count)
            sums = nut_sums(parameters, loads, abs(speed), temperature, film_model)
            parts += sums.torque(*friction_set.values)
    return TorqueParts(*parts.tolist())


def preload_from_torque(
    evaluate: Callable[[float], float], torque: float, lowest: float, highest: float, relative: float = 1e-12
) -> float:
    """Preload at which a model shows a measured torque.

    Parameters   evaluate : preload [N] -> total torque [N.m], continuous and rising
                 torque : measured [N.m], >= 0;  lowest, highest : bracket [N], 0 <= lowest < highest
                 relative : wanted relative accuracy of the preload
    Returns      preload [N]; 0 for torque 0
    Raises       ValueError: not finite, negative, outside what the bracket reaches; evaluate not continuous
    Example
                 >>> round(preload_from_torque(lambda preload: 2.0 * preload**0.5, 6.0, 0.0, 100.0), 9)
                 9.0
    """
    if not (math.isfinite(torque) and torque >= 0.0):
        raise ValueError(f"torque = {torque} N.m; needs finite, >= 0")
    if torque == 0.0:
        return 0.0
    evaluate = cache(evaluate)
    low, high = evaluate(float(lowest)), evaluate(float(highest))
    if not low <= torque <= high:
        raise ValueError(
            f"torque = {torque:.6g} N.m; allowed at this speed and temperature: {low:.6g} to {high:.6g} N.m (preload "
            f"{lowest:.6g} to {highest:.6g} N)"
        )
    preload, found = rising_root(lambda x: evaluate(x) - torque, float(lowest), float(highest), relative)
    if not found:
        raise ValueError(
            f"torque = {torque:.6g} N.m; no preload found between {lowest:.6g} and {highest:.6g} N"
        )
    return preload
