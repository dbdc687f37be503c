"""Surface speeds of ball and raceway by two named models, their variation over the contact ellipse, rolling facts.

`published` reproduces the paper; `rolling_frame` is the physical one: entrainment is nearly equal on both
raceways and what slides is differential slip and spin (Lu et al., Machines 10(3) (2022) 203; Harris, Rolling
Bearing Analysis, in the limit of zero lead).

Contact frame, right-handed: x along rolling at positive speed, z along the normal from body 1 (raceway) to body 2
(ball), y = z cross x across. y leads away from the screw axis; on the flank where it leads towards the axis
everything is the mirror image: the spins change sign.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..parameters.file import FOUR_POINT, Parameters, ScrewParameters
from .hertz import raceway_sign, reduced_radii

#: position of the two lines without slip of a freely rolling ball, as a fraction of the semi-axis: root of 1-3c+c^3
FREE_ROLLING_POSITION = 2.0 * math.cos(4.0 * math.pi / 9.0)


class SurfaceSpeeds(NamedTuple):
    """Speeds of one contact [m/s]: u_1 raceway, u_2 ball, u_e their mean; srr = (u_1-u_2)/u_e.

    friction_slip is the sliding speed of the viscous friction formula, >= 0.
    """

    u_1: Any
    u_2: Any
    u_e: Any
    srr: Any
    friction_slip: Any


class SlipField(NamedTuple):
    """How the surface speeds of one contact vary over the ellipse; body 1 raceway, body 2 ball; default uniform.

    u_i(x, y) = u_i + differential_i y^2 - spin_i y along rolling, v_i(x, y) = spin_i x across.
    differential_i [1/(m s)]; spin_i [rad/s], turn of the surface about the normal from body 1 to body 2.
    """

    differential_1: Any = 0.0
    differential_2: Any = 0.0
    spin_1: Any = 0.0
    spin_2: Any = 0.0


def _published(parameters: Parameters, raceway: str, speed: Any) -> SurfaceSpeeds:
    table = parameters.published_speeds
    if table is None:
        raise ValueError(f"{parameters.name} has no table published_speeds: use rolling_frame")
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


def _checked_name(parameters: Parameters, speed: Any, kinematics: str | None) -> str:
    """Name of the model.

    Raises       ValueError: unknown name, speed not finite
    """
    name = parameters.friction.kinematics if kinematics is None else kinematics
    if name not in KINEMATICS:
        raise ValueError(f"kinematics = {name!r}; allowed: {', '.join(KINEMATICS)}")
    if not np.all(np.isfinite(speed)):
        raise ValueError(f"speed = {speed} rad/s; needs finite")
    return name


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
    return KINEMATICS[_checked_name(parameters, speed, kinematics)](parameters, raceway, speed)


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


def deformed_radius(screw: ScrewParameters, raceway: str) -> float:
    """Radius R_c of the deformed contact across rolling [m]: mean curvature of ball and groove."""
    r_b = 0.5 * screw.ball_diameter
    r_groove = screw.screw_raceway_radius if raceway_sign(raceway) > 0 else screw.nut_raceway_radius
    return 2.0 * r_groove * r_b / (r_groove + r_b)


def _uniform(parameters: Parameters, raceway: str, speed: Any, contact_angle: Any) -> SlipField:
    reduced_radii(parameters.screw, contact_angle, raceway)  # raises for the same arguments
    zero = 0.0 * speed * contact_angle
    return SlipField(zero, zero, zero, zero)


def spin_share(parameters: Parameters, contact_angle: Any) -> Any:
    """Share of w sin(beta) that is the spin at the screw contact; 1 - share is that at the nut.

    Parameters   contact_angle : float or array [rad]
    Returns      friction.spin_split where a ball touches two flanks. Where it touches four under preload alone, its
                 axis is parallel to that of the screw: the only motion that slides at the middle of no contact. The
                 spins then are w_b +- W of raceway, each against the other: 6.44 and -5.44 for GD4008-3 at 45 degrees
    Source       w_b = u_e/(r_b cos(beta)), W = w (1 +- g)/2, g = r_b cos(beta)/r_m; zero lead
    """
    screw = parameters.screw
    if screw.preload_kind != FOUR_POINT:
        return parameters.friction.spin_split
    arm = 0.5 * screw.ball_diameter * np.cos(contact_angle)
    g = arm / screw.nominal_radius
    return 0.5 * (1.0 + g) + 0.5 * screw.nominal_radius * (1.0 - g**2) / arm


def _differential_and_spin(parameters: Parameters, raceway: str, speed: Any, contact_angle: Any) -> SlipField:
    screw, sign = parameters.screw, raceway_sign(raceway)
    split = spin_share(parameters, contact_angle)
    r_m, r_b, R_c = screw.nominal_radius, 0.5 * screw.ball_diameter, deformed_radius(screw, raceway)
    R_x, _ = reduced_radii(screw, contact_angle, raceway)
    sin, cos = np.sin(contact_angle), np.cos(contact_angle)
    # the raceway as the ball centre sees it: w - w_c of the screw, w_c of the nut
    turning = 0.5 * (1.0 + sign * r_b * cos / r_m) * speed
    u = turning * (r_m - sign * r_b * cos)
    share = split if sign > 0 else 1.0 - split
    # 1/R_x - 1/r_b = +- 1/(radius of the raceway along rolling)
    return SlipField(
        differential_1=u * (1.0 / R_x - 1.0 / r_b) / (2.0 * R_c),
        differential_2=-u / (2.0 * R_c * r_b),
        spin_1=-turning * sin,
        spin_2=(share * speed - turning) * sin,
    )


SLIP_FIELDS: dict[str, Callable[[Parameters, str, Any, Any], SlipField]] = {
    "published": _uniform,
    "rolling_frame": _differential_and_spin,
}


def slip_field(
    parameters: Parameters, raceway: str, speed: Any, contact_angle: Any, kinematics: str | None = None
) -> SlipField:
    """Differential (Heathcote) slip and spin of one contact, each body by its own surface.

    Parameters   raceway : "screw" or "nut";  speed : float or array [rad/s], screw against nut, any sign
                 contact_angle : float or array [rad], 0 < beta < pi/2, equal on both raceways
                 kinematics : "published", "rolling_frame" or None = what the parameters name
    Returns      SlipField in the contact frame of this module, shaped like speed and angle; all odd in speed.
                 differential_1 > 0 on the screw, < 0 on the nut; differential_2 < 0; their difference is
                 u_e/(2 R_c R_x) on both. The spins spin_2 - spin_1 of screw and nut add up to w sin(beta)
                 for every attitude of the ball; spin_share is the share of the screw
    Raises       ValueError: unknown name, speed not finite, angle out of range
    Validity     zero lead, no gyroscopic turn of the ball; relative error (a/r_b)^2; the bend of the contact along
                 rolling is left out, (b/a)^2 of the slip; so is the strain of the surfaces, equal on both
    Source       published: none, the paper has uniform speeds and the field is zero
                 rolling_frame: rigid rotations as seen from the ball centre, at the height y^2/(2 R_c) of the
                 deformed contact, R_c = 2 r_g r_b/(r_g + r_b) (bodies of one steel): the raceway turns with
                 W = w (1 +- g)/2 on r_m -+ r_b cos(beta) +- cos(beta) y^2/(2 R_c) + sin(beta) y, the ball rolls with
                 u_e/r_b on r_b - y^2/(2 R_c); normal parts of the rotations: -W sin(beta), and of the ball what
                 the split leaves (equal 0.5; Jones 1959, raceway control: 0 at the screw, 1 at the nut)
    Example
        >>> from ballscrew_tehl.parameters.file import load_parameters
        >>> field = slip_field(load_parameters(), "screw", 104.72, 0.7854, "rolling_frame")
        >>> round(float(field.spin_2 - field.spin_1), 2)
        37.02
    """
    name = _checked_name(parameters, speed, kinematics)
    return SLIP_FIELDS[name](parameters, raceway, speed, contact_angle)
