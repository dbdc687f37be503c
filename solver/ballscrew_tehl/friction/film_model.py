"""Film model: where the friction takes its isothermal central film from; here the closed formula by Hamrock
and Dowson.

A friction set belongs to one film model, by its name.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..parameters.file import Parameters
from ..physics.film import film_groups, hamrock_dowson
from ..physics.hertz import E_prime, reduced_radii
from ..physics.kinematics import surface_speeds
from ..physics.load import contact_angle_at_ball_load
from ..physics.lubricant import eta0, pressure_viscosity


class FilmModel(Protocol):
    """Isothermal central film of the contacts of one screw with its kinematics."""

    name: str

    def central_film(self, raceway: str, load: np.ndarray, speed: float, temperature: float) -> np.ndarray:
        """Film [m] of balls with load [N] > 0 at a screw speed [rad/s] > 0 and an oil temperature [K]."""
        ...


class HamrockDowsonFilm:
    """Central film by the formula of Hamrock and Dowson.

    Parameters   parameters : the screw; its kinematics give the entrainment speed
                 contact_angle : of all balls [rad]; None = each ball at the angle under its load
    Validity     isothermal, flooded, incompressible; 5 to 12 % above compressible solutions
    Source       Hamrock & Dowson 1977, see film.hamrock_dowson; alpha is the parameter at the reference
                 temperature and follows the pressure law elsewhere
    """

    name = "hamrock_dowson"

    def __init__(self, parameters: Parameters, contact_angle: float | None = None) -> None:
        self.parameters = parameters
        self.contact_angle = contact_angle

    def central_film(self, raceway: str, load: np.ndarray, speed: float, temperature: float) -> np.ndarray:
        """Film [m] like load.

        Raises       ValueError: load, speed or temperature not positive
        """
        screw, oil = self.parameters.screw, self.parameters.lubricant
        angle = contact_angle_at_ball_load(screw, load) if self.contact_angle is None else self.contact_angle
        R_x, R_y = reduced_radii(screw, angle, raceway)
        u_e = surface_speeds(self.parameters, raceway, speed).u_e
        warm = pressure_viscosity(oil, temperature) / pressure_viscosity(oil, oil.reference_temperature)
        alpha_pv = oil.pressure_viscosity * warm
        groups = film_groups(load, u_e, R_x, E_prime(screw), eta0(oil, temperature), alpha_pv)
        return np.asarray(R_x * hamrock_dowson(groups.U, groups.W, groups.G, R_x / R_y)[0])
