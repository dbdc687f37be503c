"""Closed film formula of the contacts of one ball at operating points of the screw, without a solve."""

from typing import Any

import numpy as np

from ..parameters.file import Parameters
from .ball_law import Array, contact_angle_at_ball_load
from .film import central_film_estimate, moes_groups
from .hertz import E_prime, ball_ellipse, reduced_radii
from .kinematics import surface_speeds


def moes_groups_of(parameters: Parameters, raceway: str, load: Array, speed: Any, temperature: Any) -> Any:
    """FilmGroups, R_x and R_y [m] of a ball with its own contact angle; load, speed and temperature broadcast."""
    screw = parameters.screw
    R_x, R_y = reduced_radii(screw, contact_angle_at_ball_load(screw, load), raceway)
    u_e = surface_speeds(parameters, raceway, speed).u_e
    return moes_groups(parameters.lubricant, load, u_e, R_x, E_prime(screw), temperature), R_x, R_y


#: film [m] below which oil is no continuum
MIN_FILM = 1e-9
#: film over the ball radius above which a film is beyond lubrication theory
THICKEST_FILM = 0.1


def film_formula(parameters: Parameters, raceway: str, load: Array, speed: Any, temperature: Any) -> Array:
    """Closed film formula that the samples are divided by [m]; load, speed and temperature broadcast."""
    groups, R_x, R_y = moes_groups_of(parameters, raceway, load, speed, temperature)
    # the pressure that compresses the oil varies little with the contact angle: that of the drawing
    p_max = ball_ellipse(parameters.screw, parameters.screw.contact_angle, raceway, load).p_max
    return np.asarray(central_film_estimate(parameters.lubricant, groups, R_x, R_y, p_max, temperature))
