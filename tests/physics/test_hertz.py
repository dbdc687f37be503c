"""Hertz contact against worked values, closed limits and the defining integrals."""

import math

import pytest
from reference_screw import GD4008
from scipy.integrate import quad

from ballscrew_tehl.physics.hertz import E_prime, ellipse, ratio_of_axes, reduced_radii


def test_geometry_of_the_paper():
    assert E_prime(GD4008.screw) == pytest.approx(225.27e9, rel=3e-5)
    for raceway, R_x, ratio, axes in [
        ("screw", 2.18098e-3, 0.03531, 8.5712),
        ("nut", 2.58202e-3, 0.04180, 7.7331),
    ]:
        x, y = reduced_radii(GD4008.screw, GD4008.screw.contact_angle, raceway)
        assert x == pytest.approx(R_x, abs=0.5e-8)
        assert y == pytest.approx(61.769e-3, abs=0.5e-6)
        assert x / y == pytest.approx(ratio, abs=0.5e-5)
        assert ratio_of_axes(x / y) == pytest.approx(axes, abs=0.5e-4)


@pytest.mark.parametrize("ratio", [1.0, 0.5, 0.035, 1e-4])
def test_deflection_reproduces_the_undeformed_paraboloid(ratio):
    """Hertz pressure deflects by delta - x^2/(2 R_x) - y^2/(2 R_y) inside the ellipse: Johnson Eq. 3.64."""
    R_x, modulus, load = 3e-3, 226e9, 40.0
    c = ellipse(load, R_x, R_x / ratio, modulus)
    assert 2.0 / 3.0 * math.pi * c.a * c.b * c.p_max == pytest.approx(load, rel=1e-12)
    # w = (p_max a b/E*) int_0^inf [1 - x^2/(b^2+s) - y^2/(a^2+s)] ds/sqrt((a^2+s)(b^2+s)s) / 2, s = (b t)^2

    def term(power_a, power_b):
        # s = (b t/(1-t))^2 keeps the integrand finite at both ends
        def f(t):
            s = (c.b * t / (1 - t)) ** 2
            root = math.sqrt((c.a**2 + s) * (c.b**2 + s))
            return 2 * c.b / (1 - t) ** 2 / root * (c.a**2 + s) ** -power_a * (c.b**2 + s) ** -power_b

        return quad(f, 0, 1, epsabs=0, epsrel=1e-11, limit=500)[0]

    factor = c.p_max * c.a * c.b / modulus
    assert factor * term(0, 0) == pytest.approx(c.delta, rel=1e-8)
    assert factor * term(0, 1) == pytest.approx(0.5 / R_x, rel=1e-8)
    assert factor * term(1, 0) == pytest.approx(0.5 * ratio / R_x, rel=1e-8)
