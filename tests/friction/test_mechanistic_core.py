"""Half-width of the core of the pressure that shears the film."""

import numpy as np
import pytest

from ballscrew_tehl.friction.mechanistic import BLUNT, core_half_width

R_X = 1e-3


def test_a_core_much_narrower_than_the_ball_is_that_of_its_area():
    assert core_half_width(np.array([1e-5]), R_X)[0] == pytest.approx(1e-5, rel=1e-8)
    assert core_half_width(np.array([0.25 * R_X]), R_X)[0] == pytest.approx(0.25 * R_X, rel=1.1e-3)


def test_a_core_stays_within_the_radius():
    assert core_half_width(np.array([1e3 * R_X]), R_X)[0] == pytest.approx(R_X, rel=1e-9)
    widths = core_half_width(np.geomspace(1e-3, 10.0, 200) * R_X, R_X)
    assert np.all(np.diff(widths) > 0.0)
    assert widths.max() <= R_X


def test_a_core_bends_without_a_kink():
    """d ln(b)/d ln(area) falls from 1 to 0, nowhere steeper than its closed form allows."""
    ln = np.linspace(-3.0, 3.0, 601)
    slope = np.gradient(np.log(core_half_width(R_X * np.exp(ln), R_X)), ln)
    assert np.abs(slope - 1.0 / (1.0 + np.exp(BLUNT * ln)))[1:-1].max() <= 1e-4
