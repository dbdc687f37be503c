"""Trends of a fitted torque that thick films do not have."""

from types import SimpleNamespace

import numpy as np
import pytest
import synthetic_map

from ballscrew_tehl.friction.torque import nut_forces
from ballscrew_tehl.nut_map.trend import Trend, too_thick, too_thin, unlike_flanks, unphysical_trend
from ballscrew_tehl.parameters.file import FOUR_POINT, changed, load_parameters
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC


class PowerLaw:
    """Stands for a map: torque speed^a exp(b (T - 300 K)); film ratio 1 at 10 rad/s, proportional to the speed."""

    def __init__(self, a, b, law=FILM_SHEAR):
        self.a, self.b, self.law = a, b, law
        self.header = {"axes": {"speed": [1.0, 1000.0, 4], "temperature": [280.0, 350.0, 4]}}

    def evaluate(self, preload, speed, temperature, axial_load):
        torque = preload * speed**self.a * np.exp(self.b * (temperature - 300.0)) + 0.0 * axial_load
        return SimpleNamespace(
            friction_torque=torque, viscous_torque=0.5 * torque, lambda_ratio=0.1 * speed + 0.0 * torque
        )


@pytest.mark.parametrize(
    ("a", "b", "text"),
    [
        (0.3, -0.01, ""),
        (0.3, 0.01, "torque rises with temperature in a thick film (lambda > 3)"),
        (-0.3, -0.01, "torque falls with speed in a thick film (lambda > 3)"),
        (-0.3, 0.01, "torque rises with temperature and falls with speed in a thick film (lambda > 3)"),
        # below the least change that counts
        (-0.004, 0.00009, ""),
    ],
)
def test_trends_of_a_power_law(a, b, text):
    assert unphysical_trend(PowerLaw(a, b), 1000.0, 100.0, 310.0).text == text
    # the direction of motion does not matter, a thin film has no such trend
    assert unphysical_trend(PowerLaw(a, b), 1000.0, -100.0, 310.0).text == text
    assert unphysical_trend(PowerLaw(a, b), 1000.0, 29.0, 310.0).text == ""
    assert unphysical_trend(PowerLaw(a, b, MECHANISTIC), 1000.0, 100.0, 310.0).text == ""


@pytest.mark.parametrize(
    ("a", "b", "w", "t", "text"),
    [
        # half of the torque is rolling loss: the supply explains an exponent of -0.3 from -0.6 on
        (-0.3, -0.01, -0.7, 0.0, "torque falls with speed in a thick film (lambda > 3): replenishment factor 0.04, "
         "the supply of oil decides"),
        (-0.3, -0.01, -0.5, 0.0, ""),
        (0.3, 0.01, 0.0, 0.021, "torque rises with temperature in a thick film (lambda > 3): replenishment factor "
         "1.2, the supply of oil decides"),
        (0.3, 0.01, 0.0, 0.019, ""),
        (0.3, -0.01, -0.7, 0.03, ""),
    ],
)  # fmt: skip
def test_trends_by_the_supply_of_oil(a, b, w, t, text):
    def supply(speed, temperature):
        return speed**w * np.exp(t * (temperature - 300.0))

    law = PowerLaw(a, b, MECHANISTIC)
    assert unphysical_trend(law, 1000.0, 100.0, 310.0, 0.0, supply).text == text
    many = unphysical_trend(law, 1000.0, np.array([29.0, 100.0]), 310.0, 0.0, supply)
    assert many.unphysical.tolist() == [False, bool(text)]


def test_films_of_a_tenth_of_the_radius_are_named():
    assert too_thick(2e-4, 2.1e-3) == ""
    assert too_thick(2e-4, 1.9e-3).startswith("film 200 um, above a tenth of the ball radius")


def test_films_below_a_nanometre_are_named():
    assert too_thin(1.01e-9) == "" == too_thin(0.0)
    assert too_thin(2.7e-12).startswith("least film 0.0027 nm, below 1 nm: oil is no continuum there")


def test_ends_of_the_map_and_beyond():
    law = PowerLaw(-0.3, 0.01)
    assert unphysical_trend(law, 1000.0, 1000.0, 350.0).unphysical
    for speed, temperature in ((1001.0, 310.0), (0.5, 310.0), (100.0, 351.0), (100.0, 279.0)):
        assert not unphysical_trend(law, 1000.0, speed, temperature).unphysical


def test_arrays_are_single_points():
    law, speed = PowerLaw(-0.3, 0.01), np.array([5.0, 29.0, 31.0, 900.0])
    found = unphysical_trend(law, np.array([[500.0], [2000.0]]), speed, 310.0)
    assert found.unphysical.tolist() == [[False, False, True, True]] * 2
    assert isinstance(found, Trend)


def test_real_map_has_physical_trends_where_its_torque_has():
    """Torque of the synthetic map grows with speed and falls with temperature everywhere."""
    nut_map = synthetic_map.make_map()
    force, speed = np.geomspace(200.0, 9000.0, 5)[:, None, None], np.geomspace(1.0, 600.0, 9)[:, None]
    temperature = np.linspace(284.0, 350.0, 4)
    assert not unphysical_trend(nut_map, force, speed, temperature, 100.0).unphysical.any()
    assert nut_map.evaluate(force, speed, temperature, 100.0).lambda_ratio.max() > 3.0


def test_oversize_balls_with_one_set_of_flanks_nearly_free_are_named():
    double = load_parameters()
    four = changed(double, screw={"preload_kind": FOUR_POINT})
    assert unlike_flanks(double, 1000.0, 2500.0, 0.5) == unlike_flanks(four, 1000.0, 0.0, 0.5) == ""
    assert unlike_flanks(four, 1000.0, 1500.0, 0.5) == ""
    assert unlike_flanks(four, 1000.0, 5000.0, 0.5) == ""
    for load in (2200.0, -2200.0):
        relieved, loaded = sorted(nut_forces(four, 1000.0, load))
        assert 0.0 < relieved < 0.12 * loaded
        said = unlike_flanks(four, 1000.0, load, 0.5)
        assert f"flanks ({relieved:.3g} N, the other {loaded:.3g} N)" in said
        assert said.endswith("of the ball 0.5 N m")
