"""Rolling resistance against direct solutions of Reynolds' equation, printed numbers, a second print, bad input."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from ballscrew_tehl.physics.film import biboulet_houpert_point, replenishment_factor
from ballscrew_tehl.physics.hertz import ellipse

E_PRIME = 226e9


def point_case(U, W, kappa):
    """Arguments of an elliptical contact from the papers' groups and b/a, at R_x = 2 mm."""
    R_x = 2e-3
    ratio = brentq(lambda r: np.divide(*ellipse(1.0, R_x, r * R_x, E_PRIME)[1::-1]) - kappa, 1.0, 1e5)
    return {"load": W * E_PRIME * R_x**2, "u_e": 0.5 * U * E_PRIME * R_x / 0.1, "R_x": R_x, "R_y": ratio * R_x,
            "E_prime": E_PRIME, "eta0": 0.1}  # fmt: skip


def test_number_printed_for_the_elastic_limit():
    """Biboulet & Houpert part 2, section 3.4: 10.9e-9 at W 1e-5; proportional to W^(1/3), here at 1e3 W."""
    elastic = biboulet_houpert_point(**point_case(1e-11, 1e-2, 0.01))
    assert abs(elastic / 10.0 / (E_PRIME * 4e-6) - 10.9e-9) <= 0.1e-9


def test_second_print_of_the_point():
    """Balan, Houpert, Tufescu & Olaru, Lubricants 3 (2015) 222, Eqs. (1) to (4): powers of k for the ellipse."""
    for k in [5.0, 10.0, 28.0, 60.0]:
        for load in [1e-4, 0.1, 20.0]:
            R_x, u_e, eta0 = 2e-3, 1.0, 0.1
            U, W, unit = eta0 * u_e / (E_PRIME * R_x), load / (E_PRIME * R_x**2), E_PRIME * R_x**2
            rigid = 2.9766 * unit * k**0.3316 * W ** (1 / 3) * U ** (2 / 3)
            elastic = 7.5826 * unit * k**0.4055 * W ** (1 / 3) * U**0.75
            M = 0.5549 * k**-0.6029 * W * U**-0.75
            printed = (rigid - elastic) / (1.0 + M / 6.6) + elastic
            force = biboulet_houpert_point(load, u_e, R_x, k * R_x, E_PRIME, eta0)
            # their fit of the ellipse by a power of k
            assert abs(force / printed - 1.0) <= 0.025


def test_replenishment_falls_with_speed_and_viscosity_and_is_one_when_flooded():
    speeds = np.array([0.0, 100.0, 1000.0, 5000.0])
    factor = replenishment_factor(6e-8, 4.4, speeds, 100.0, 32.0, 48.0)
    assert factor[0] == 1.0
    assert np.all(np.diff(factor) < 0.0)
    assert np.all(replenishment_factor(0.0, 4.4, speeds, 100.0, 32.0, 48.0) == 1.0)
    # d + D = 80 mm, D - d = 16 mm: exp(-6e-8 100 1000 80 sqrt(4.4/32))
    assert factor[2] == pytest.approx(math.exp(-6e-3 * 80.0 * math.sqrt(4.4 / 32.0)), rel=1e-12)
