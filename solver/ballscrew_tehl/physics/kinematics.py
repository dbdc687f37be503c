"""Surface speeds of ball and raceway by two named models, and what follows from pure rolling.

`published` reproduces the paper; `rolling_frame` is the physical one: entrainment is nearly equal on both
raceways and what slides is differential slip and spin, see ball_motion (Lu et al., Machines 10(3) (2022) 203; Harris,
Rolling Bearing Analysis, in the limit of zero lead).
"""

import math
from typing import Any, NamedTuple

from ..parameters.file import Parameters, ScrewParameters
from ..parameters.screw import PUBLISHED, ROLLING_FRAME
from .hertz import raceway_sign

#: names in files; films are shown of ROLLING_FRAME, also for the other one, whose speeds cannot be physical
KINEMATICS = PUBLISHED, ROLLING_FRAME


class ContactSpeeds(NamedTuple):
    """Speeds of one contact [m/s]: u_1 raceway, u_2 ball."""

    u_1: Any
    u_2: Any

    @property
    def u_e(self) -> Any:
        """Entrainment speed [m/s]."""
        return 0.5 * (self.u_1 + self.u_2)

    @property
    def srr(self) -> Any:
        """Slide-to-roll ratio."""
        return (self.u_1 - self.u_2) / self.u_e


def surface_speeds(parameters: Parameters, raceway: str, speed: Any) -> ContactSpeeds:
    """Surface speeds of one contact by the kinematics of the parameters; speed: [rad/s], screw against nut, any sign.

    Source       published: Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231, Eqs. 1-4;
                 differs from paper: the ball's own rotation is not printed, so the pairs that the printed
                 entrainment speeds and slide-to-roll ratios imply are scaled with the screw speed
                 errata: Eq. 3 must read r_b^2 sin^2; Eq. 4 gives 399.7 mm/s on the nut, which no ball speed
                 reconciles with both printed nut values; the printed 1.94203 there is the magnitude
                 rolling_frame: pure rolling on the mean line
    """
    on_screw = raceway_sign(raceway) > 0
    if parameters.friction.kinematics == ROLLING_FRAME:
        u_e = entrainment_speed(parameters.screw, speed)
        return ContactSpeeds(u_e, u_e)
    table = parameters.published_speeds
    assert table is not None  # held by the parameter check
    u_1, u_2 = table.screw if on_screw else table.nut
    return ContactSpeeds(u_1 * (speed / table.reference_speed), u_2 * (speed / table.reference_speed))


def _gamma(screw: ScrewParameters) -> float:
    """r_b cos(beta)/r_m."""
    return 0.5 * screw.ball_diameter * math.cos(screw.contact_angle) / screw.nominal_radius


def cage_speed(screw: ScrewParameters, speed: Any) -> Any:
    """Angular speed of the ball centres about the screw axis [rad/s], the nut at rest; pure rolling, zero lead.

    Source       Harris, Rolling Bearing Analysis: w (1 - g)/2, g = r_b cos(beta)/r_m; with the screw at rest 1 + g
    """
    return 0.5 * (1.0 - _gamma(screw)) * speed


def entrainment_speed(screw: ScrewParameters, speed: Any) -> Any:
    """Entrainment speed on both raceways [m/s] in the frame of the ball centre at a screw speed [rad/s]; zero lead.

    Source       r_m w (1 - g^2)/2: the raceways move at r_m (1-g)(w - w_c) = r_m (1+g) w_c
    """
    return 0.5 * screw.nominal_radius * (1.0 - _gamma(screw) ** 2) * speed
