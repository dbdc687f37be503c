"""Surface speeds of ball and raceway by two named models, and the rolling facts of a ball in the nut.

`published` reproduces the paper; `rolling_frame` is the physical one: entrainment is nearly equal on both
raceways and what slides is differential slip and spin (Lu et al., Machines 10(3) (2022) 203; Harris, Rolling
Bearing Analysis, in the limit of zero lead).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .hertz import raceway_sign, reduced_radii
from .parameters import Parameters, ScrewParameters


class SurfaceSpeeds(NamedTuple):
    """Speeds of one contact [m/s]: u_1 raceway, u_2 ball, u_e their mean; srr = (u_1-u_2)/u_e.

    friction_slip is the sliding speed of the viscous friction formula, >= 0.
    """

    u_1: Any
    u_2: Any
    u_e: Any
    srr: Any
    friction_slip: Any


def _published(parameters: Parameters, raceway: str, speed: Any) -> SurfaceSpeeds:
    table = parameters.published_speeds
    if table is None:
        raise ValueError(
            f"kinematics = 'published'; {parameters.name} has no table published_speeds: use rolling_frame"
        )
    at_reference = table.screw if raceway_sign(raceway) > 0 else table.nut
    scale = speed / table.reference_speed
    u_1, u_2 = at_reference[0] * scale, at_reference[1] * scale
    srr = 2.0 * (at_reference[0] - at_reference[1]) / (at_reference[0] + at_reference[1])
    return SurfaceSpeeds(u_1, u_2, 0.5 * (u_1 + u_2), srr + 0.0 * scale, np.abs(u_1 - u_2))


def _rolling_frame(parameters: Parameters, raceway: str, speed: Any) -> SurfaceSpeeds:
    raceway_sign(raceway)
    u_e = entrainment_speed(parameters.screw, speed)
    return SurfaceSpeeds(u_e, u_e, u_e, 0.0 * u_e, parameters.friction.reference_slip * np.abs(u_e))


KINEMATICS: dict[str, Callable[[Parameters, str, Any], SurfaceSpeeds]] = {
    "published": _published,
    "rolling_frame": _rolling_frame,
}


def surface_speeds(
    parameters: Parameters, raceway: str, speed: Any, kinematics: str | None = None
) -> SurfaceSpeeds:
    """Surface speeds of one contact.

    Parameters   raceway : "screw" or "nut";  speed : float or array [rad/s], screw against nut, any sign
                 kinematics : "published", "rolling_frame" or None = what the parameters name
    Returns      SurfaceSpeeds, shaped like speed; all odd in speed but srr and friction_slip
    Raises       ValueError: unknown name, speed not finite, published without its table
    Source       published: Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231, Eqs. 1-4;
                 differs from paper: the ball's own rotation is not printed, so the pairs that the printed
                 entrainment speeds and slide-to-roll ratios imply are scaled with the screw speed
                 errata: Eq. 3 must read r_b^2 sin^2; Eq. 4 gives 399.7 mm/s on the nut, which no ball speed
                 reconciles with both printed nut values; the printed 1.94203 there is the magnitude
                 rolling_frame: pure rolling on the mean line, friction_slip = reference_slip * u_e
    """
    name = parameters.friction.kinematics if kinematics is None else kinematics
    if name not in KINEMATICS:
        raise ValueError(f"kinematics = {name!r}; allowed: {', '.join(KINEMATICS)}")
    if not np.all(np.isfinite(speed)):
        raise ValueError(f"speed = {speed} rad/s; needs finite")
    return KINEMATICS[name](parameters, raceway, speed)


def _gamma(screw: ScrewParameters) -> float:
    """r_b cos(beta)/r_m."""
    return 0.5 * screw.ball_diameter * math.cos(screw.contact_angle) / screw.nominal_radius


def _lead_terms(screw: ScrewParameters, helix: bool) -> tuple[float, float]:
    """Path radius of the ball centre [m] and effective g, for zero lead or the exact helix.

    Source       helix: in the frame that moves along the helix with the ball, a raceway point moves at
                 (r_m/cos(lambda)) (1 -+ g cos^2(lambda)) along the helix, per unit of angular speed
    """
    cos = math.cos(screw.lead_angle) if helix else 1.0
    return screw.nominal_radius / cos, _gamma(screw) * cos**2


def cage_speed(screw: ScrewParameters, speed: Any, fixed: str = "nut", helix: bool = False) -> Any:
    """Angular speed of the ball centres about the screw axis.

    Parameters   speed : float or array [rad/s], speed of the turning part
                 fixed : the part at rest, "nut" or "screw";  helix : exact lead angle instead of zero lead
    Returns      w_c : like speed [rad/s]
    Raises       ValueError: unknown part
    Validity     pure rolling
    Source       Harris, Rolling Bearing Analysis: w (1 -+ g)/2, g = r_b cos(beta)/r_m
    """
    _, g = _lead_terms(screw, helix)
    return 0.5 * (1.0 + raceway_sign(fixed) * g) * speed


def entrainment_speed(screw: ScrewParameters, speed: Any, helix: bool = False) -> Any:
    """Entrainment speed on both raceways in the frame that travels with the ball centre.

    Parameters   speed : float or array [rad/s], screw against nut
                 helix : exact lead angle instead of zero lead
    Returns      u_e : like speed [m/s]
    Validity     pure rolling; whichever part turns
    Source       r_m w (1 - g^2)/2: the raceways move at r_m (1-g)(w - w_c) = r_m (1+g) w_c
    """
    radius, g = _lead_terms(screw, helix)
    return 0.5 * radius * (1.0 - g**2) * speed


def roll_rate(screw: ScrewParameters, speed: Any) -> Any:
    """Angular speed of the ball about its rolling axis [rad/s]: u_e/r_b."""
    return entrainment_speed(screw, speed) / (0.5 * screw.ball_diameter)


#: share of the spin that falls on the screw contact, by the name of the hypothesis
SPIN_SPLITS: dict[str, float] = {"equal": 0.5, "screw_control": 0.0, "nut_control": 1.0}


def spin_rates(screw: ScrewParameters, speed: Any, split: str = "equal") -> tuple[Any, Any]:
    """Magnitudes of the spin of ball against raceway about the contact normals.

    Parameters   speed : float or array [rad/s]
                 split : "equal", or "screw_control", "nut_control": no spin on that raceway
    Returns      screw, nut : like speed [rad/s]; they sum to |w| sin(beta) for every attitude of the ball
    Raises       ValueError: unknown split
    Source       Jones 1959 (raceway control) and the equal split between both, a choice by name
    """
    if split not in SPIN_SPLITS:
        raise ValueError(f"split = {split!r}; allowed: {', '.join(SPIN_SPLITS)}")
    total = np.abs(speed) * math.sin(screw.contact_angle)
    return SPIN_SPLITS[split] * total, (1.0 - SPIN_SPLITS[split]) * total


def heathcote_slip(screw: ScrewParameters, raceway: str, a: Any) -> Any:
    """Differential slip between centre and edge of the contact, over entrainment speed.

    Parameters   raceway : "screw" or "nut";  a : float or array [m], semi-axis across rolling
    Returns      slip ratio : like a, >= 0
    Raises       ValueError: unknown raceway
    Source       derived for a spherical deformed surface of radius Rc = 2 r_g r_b/(r_g + r_b): a^2/(2 Rc R_x)
    """
    r_b = 0.5 * screw.ball_diameter
    r_groove = screw.screw_raceway_radius if raceway_sign(raceway) > 0 else screw.nut_raceway_radius
    deformed = 2.0 * r_groove * r_b / (r_groove + r_b)
    R_x, _ = reduced_radii(screw, screw.contact_angle, raceway)
    return a**2 / (2.0 * deformed * R_x)
