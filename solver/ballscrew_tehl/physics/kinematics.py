"""Surface speeds of ball and raceway by two named models, and what follows from pure rolling.

`published` reproduces the paper; `rolling_frame` is the physical one: entrainment is nearly equal on both
raceways and what slides is differential slip and spin, see ball_motion (Lu et al., Machines 10(3) (2022) 203; Harris,
Rolling Bearing Analysis, in the limit of zero lead).
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from ..parameters.file import Parameters, ScrewParameters
from ..parameters.screw import PUBLISHED, ROLLING_FRAME
from .hertz import raceway_sign


class ContactSpeeds(NamedTuple):
    """Speeds of one contact [m/s]: u_1 raceway, u_2 ball, u_e their mean; srr = (u_1-u_2)/u_e."""

    u_1: Any
    u_2: Any
    u_e: Any
    srr: Any


def _published(parameters: Parameters, raceway: str, speed: Any) -> ContactSpeeds:
    table = parameters.published_speeds
    assert table is not None  # held by the parameter check
    at_reference = table.screw if raceway_sign(raceway) > 0 else table.nut
    scale = speed / table.reference_speed
    u_1, u_2 = at_reference[0] * scale, at_reference[1] * scale
    srr = 2.0 * (at_reference[0] - at_reference[1]) / (at_reference[0] + at_reference[1])
    return ContactSpeeds(u_1, u_2, 0.5 * (u_1 + u_2), srr + 0.0 * scale)


def _rolling_frame(parameters: Parameters, raceway: str, speed: Any) -> ContactSpeeds:
    raceway_sign(raceway)
    u_e = entrainment_speed(parameters.screw, speed)
    return ContactSpeeds(u_e, u_e, u_e, 0.0 * u_e)


#: by the name in files; films are shown of ROLLING_FRAME, also for the other one, whose speeds cannot be physical
KINEMATICS: dict[str, Callable[[Parameters, str, Any], ContactSpeeds]] = {
    PUBLISHED: _published,
    ROLLING_FRAME: _rolling_frame,
}


def surface_speeds(parameters: Parameters, raceway: str, speed: Any) -> ContactSpeeds:
    """Surface speeds of one contact by the kinematics of the parameters.

    Parameters   raceway : "screw" or "nut";  speed : float or array [rad/s], screw against nut, any sign
    Returns      ContactSpeeds, shaped like speed; all odd in speed but srr
    Raises       ValueError: unknown raceway
    Source       published: Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231, Eqs. 1-4;
                 differs from paper: the ball's own rotation is not printed, so the pairs that the printed
                 entrainment speeds and slide-to-roll ratios imply are scaled with the screw speed
                 errata: Eq. 3 must read r_b^2 sin^2; Eq. 4 gives 399.7 mm/s on the nut, which no ball speed
                 reconciles with both printed nut values; the printed 1.94203 there is the magnitude
                 rolling_frame: pure rolling on the mean line
    """
    return KINEMATICS[parameters.friction.kinematics](parameters, raceway, speed)


def _gamma(screw: ScrewParameters) -> float:
    """r_b cos(beta)/r_m."""
    return 0.5 * screw.ball_diameter * math.cos(screw.contact_angle) / screw.nominal_radius


def cage_speed(screw: ScrewParameters, speed: Any) -> Any:
    """Angular speed of the ball centres about the screw axis [rad/s], the nut at rest; pure rolling, zero lead.

    Parameters   speed : float or array [rad/s], of the screw
    Source       Harris, Rolling Bearing Analysis: w (1 - g)/2, g = r_b cos(beta)/r_m; with the screw at rest 1 + g
    """
    return 0.5 * (1.0 - _gamma(screw)) * speed


def entrainment_speed(screw: ScrewParameters, speed: Any) -> Any:
    """Entrainment speed on both raceways [m/s] in the frame of the ball centre; pure rolling, zero lead.

    Parameters   speed : float or array [rad/s], screw against nut, whichever turns
    Source       r_m w (1 - g^2)/2: the raceways move at r_m (1-g)(w - w_c) = r_m (1+g) w_c
    """
    return 0.5 * screw.nominal_radius * (1.0 - _gamma(screw) ** 2) * speed


def deformed_radius(screw: ScrewParameters, raceway: str) -> float:
    """Radius R_c of the deformed contact across rolling [m]: mean curvature of ball and groove."""
    r_b = 0.5 * screw.ball_diameter
    r_groove = screw.screw_raceway_radius if raceway_sign(raceway) > 0 else screw.nut_raceway_radius
    return 2.0 * r_groove * r_b / (r_groove + r_b)
