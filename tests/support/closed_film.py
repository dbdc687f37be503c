"""A film model without solver: the closed formula by Hamrock and Dowson."""

import numpy as np

from ballscrew_tehl.physics.ball_law import contact_angle_at_ball_load
from ballscrew_tehl.physics.film import FilmGroups, film_groups
from ballscrew_tehl.physics.hertz import E_prime, reduced_radii
from ballscrew_tehl.physics.kinematics import surface_speeds
from ballscrew_tehl.physics.lubricant import eta0, pressure_viscosity


def hamrock_dowson(groups: FilmGroups, radius_ratio):
    """H_c = h/R_x; J Lubr Technol 99 (1977) 264, k = 1.0339 (R_y/R_x)^0.636."""
    k = 1.0339 * np.asarray(radius_ratio) ** -0.636
    U, W, G = groups.U, groups.W, groups.G
    return 2.69 * U**0.67 * G**0.53 * W**-0.067 * (1.0 - 0.61 * np.exp(-0.73 * k))


class HamrockDowsonFilm:
    """Central film of a screw; contact_angle: of all balls [rad], None = each ball at the angle under its load."""

    name = "hamrock_dowson"

    def __init__(self, parameters, contact_angle=None):
        self.parameters, self.contact_angle = parameters, contact_angle

    def central_film(self, raceway, load, speed, temperature):
        screw, oil = self.parameters.screw, self.parameters.lubricant
        angle = contact_angle_at_ball_load(screw, load) if self.contact_angle is None else self.contact_angle
        R_x, R_y = reduced_radii(screw, angle, raceway)
        u_e = surface_speeds(self.parameters, raceway, speed).u_e
        warm = pressure_viscosity(oil, temperature) / pressure_viscosity(oil, oil.reference_temperature)
        groups = film_groups(
            load, u_e, R_x, E_prime(screw), eta0(oil, temperature), oil.pressure_viscosity * warm
        )
        return np.asarray(R_x * hamrock_dowson(groups, R_x / R_y))
