"""Contacts of the mechanistic law in closed form: power laws of the magnitude that the solver gives for VG 100."""

import numpy as np

from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw
from ballscrew_tehl.physics.hertz import E_prime, ellipse, reduced_radii
from ballscrew_tehl.runtime.packed import Law

VG100 = load_screw(PACKAGED_VG100)


class ClosedContacts:
    """film: central film [m] at 20 N, 10 rad/s and 303 K, thicker with speed."""

    name = Law.MECHANISTIC

    def __init__(self, film=2e-7):
        self.film = film

    def values(self, raceway, load, speed, temperature):
        """All of mechanistic.QUANTITIES by name."""
        q, n = np.asarray(load)[:, None, None] / 20.0, np.asarray(speed) / 10.0
        warm = np.exp(-0.04 * (np.asarray(temperature) - 303.0))
        screw = VG100.screw
        hertz = ellipse(np.asarray(load), *reduced_radii(screw, screw.contact_angle, raceway), E_prime(screw))
        like = np.ones(np.broadcast_shapes(q.shape, n.shape, warm.shape))
        side = 1.0 if raceway == "screw" else 1.2
        return {
            "central_film": self.film * side * q**-0.07 * n**0.67 * warm**0.6 * like,
            "rolling_loss": 0.0018 * side * q**0.4 * n**1.62 * warm**0.6 * like,
            "core_pressure": hertz.p_max[:, None, None] * like,
            "core_area": np.pi * (hertz.a * hertz.b)[:, None, None] * like,
            "mean_rise": 0.1 * n**0.9 * like,
        }
