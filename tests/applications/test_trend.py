"""Reservations about a point: trends that thick films do not have, films that are no lubricant film, unlike flanks."""

from types import SimpleNamespace

import numpy as np
from reference_screw import GD4008

from ballscrew_tehl.applications.trend import too_thick, too_thin, unlike_flanks, unphysical_trend
from ballscrew_tehl.friction.film_shear import nut_forces
from ballscrew_tehl.parameters.file import FOUR_POINT, changed

THICK = " in a thick film (lambda > 3)"


class PowerLaw:
    """Stands for a map: torque speed^a exp(b (T - 300 K)); film ratio 1 at 10 rad/s, proportional to the speed."""

    def __init__(self, a, b):
        self.a, self.b = a, b
        self.header = {"axes": {"speed": [1.0, 1000.0, 4], "temperature": [280.0, 350.0, 4]}}

    def evaluate(self, preload, speed, temperature, axial_load):
        torque = preload * speed**self.a * np.exp(self.b * (temperature - 300.0)) + 0.0 * axial_load
        ratio = 0.1 * speed + 0.0 * torque
        return SimpleNamespace(friction_torque=torque, lambda_ratio=ratio)


def test_trends_of_a_power_law():
    for a, b, text in (
        (0.3, -0.01, ""),
        (0.3, 0.01, f"torque rises with temperature{THICK}"),
        (-0.3, -0.01, f"torque falls with speed{THICK}"),
        (-0.3, 0.01, f"torque rises with temperature and falls with speed{THICK}"),
        # below the smallest change that counts
        (-0.004, 0.00009, ""),
    ):
        law = PowerLaw(a, b)
        # the direction of motion does not matter, a thin film or a point beyond the map has no such trend
        for speed, temperature in ((100.0, 310.0), (-100.0, 310.0), (1000.0, 350.0)):
            assert unphysical_trend(law, 1000.0, speed, temperature).text == text
        for speed, temperature in ((29.0, 310.0), (1001.0, 310.0), (100.0, 351.0), (100.0, 279.0)):
            assert unphysical_trend(law, 1000.0, speed, temperature).text == ""


def test_films_that_are_none_and_nearly_free_flanks_are_named():
    assert too_thick(2e-4, 2.1e-3) == too_thin(1.01e-9) == too_thin(0.0) == ""
    assert too_thick(2e-4, 1.9e-3).startswith("film 200 um, above a tenth of the ball radius")
    assert too_thin(2.7e-12).startswith("minimum film 0.0027 nm, below 1 nm: oil is no continuum there")
    four = changed(GD4008, screw={"preload_kind": FOUR_POINT})
    for screw, load in ((GD4008, 2500.0), (four, 0.0), (four, 800.0)):
        assert unlike_flanks(screw, 1000.0, load, 0.5, 0.5) == ""
    assert unlike_flanks(four, 1000.0, 800.0, 0.5, 0.509) == ""
    assert "map 10 % off, from the motion" in unlike_flanks(four, 1000.0, 800.0, 0.5, 0.55)
    free = unlike_flanks(four, 1000.0, 5000.0, 0.5, 0.5)
    assert "(0 N, the other 5e+03 N): map within 3 %" in free
    for load in (2200.0, -2200.0):
        relieved, loaded = sorted(nut_forces(four, 1000.0, load))
        assert 0.0 < relieved < 0.4 * loaded
        said = unlike_flanks(four, 1000.0, load, 0.5, 0.5)
        assert f"flanks ({relieved:.3g} N, the other {loaded:.3g} N)" in said
        assert said.endswith("of the ball 0.5 N m")
