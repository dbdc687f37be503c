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
    """Central film of a screw, each ball at the contact angle under its load."""

    name = "hamrock_dowson"

    def __init__(self, parameters):
        self.parameters = parameters

    def central_film(self, raceway, load, speed, temperature):
        screw, oil = self.parameters.screw, self.parameters.lubricant
        R_x, R_y = reduced_radii(screw, contact_angle_at_ball_load(screw, load), raceway)
        u_e = surface_speeds(self.parameters, raceway, speed).u_e
        warm = pressure_viscosity(oil, temperature) / pressure_viscosity(oil, oil.reference_temperature)
        groups = film_groups(
            load, u_e, R_x, E_prime(screw), eta0(oil, temperature), oil.pressure_viscosity * warm
        )
        return np.asarray(R_x * hamrock_dowson(groups, R_x / R_y))
