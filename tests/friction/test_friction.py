"""Forces of one ball against values worked by hand and against quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad

from ballscrew_tehl.friction import parts as friction
from ballscrew_tehl.physics.kinematics import FREE_ROLLING_POSITION


def test_viscous_force_is_couette_shear_over_the_whole_ellipse():
    a, b, eta, slip, h = 280.5e-6, 32.7e-6, 0.297, 0.0921, 42.9e-9
    assert friction.viscous_force(a, b, eta, slip, h) == pytest.approx(
        np.pi * a * b * eta * slip / h, rel=1e-15
    )
    assert friction.viscous_force(a, b, eta, -slip, h) > 0.0


def test_hysteresis_force_loses_the_stated_share_of_the_elastic_work():
    load, b, r_b = 32.955, 41.23e-6, 2.3815e-3
    assert friction.hysteresis_force(load, b, r_b, 0.01) == pytest.approx(
        3 * 0.01 * load * b / (16 * r_b), rel=1e-15
    )
    # of an ellipse: moment of the front half of the Hertz pressure is 3 Q b/16
    moment = quad(lambda x: 0.75 * load / b * (1 - (x / b) ** 2) * x, 0.0, b)[0]
    assert friction.hysteresis_force(load, b, r_b, 0.01) == pytest.approx(0.01 * moment / r_b, rel=1e-12)


@pytest.mark.parametrize("c", [0.0, 0.2, 0.338, 0.3473, 0.6, 1.0])
def test_net_sliding_share_is_the_net_coulomb_force_of_a_hertz_line_load(c):
    def pressure(t):
        return 0.75 * (1.0 - t * t)

    outside = 2.0 * quad(pressure, c, 1.0)[0]
    inside = 2.0 * quad(pressure, 0.0, c)[0]
    assert friction.net_sliding_share(c) == pytest.approx(outside - inside, abs=1e-12)


def test_free_rolling_has_no_net_sliding():
    assert pytest.approx(0.347296, abs=5e-7) == FREE_ROLLING_POSITION
    assert friction.net_sliding_share(FREE_ROLLING_POSITION) == pytest.approx(0.0, abs=1e-15)


def test_printed_net_coefficient_lies_near_free_rolling():
    # physics: 0.15 (1 - 3c + c^3) = 0.0037 needs c = 0.3380
    assert round(float(friction.no_slip_position(0.0037 / 0.15)), 4) == 0.3380


def test_no_slip_position_is_the_inverse():
    c = np.linspace(0.0, 1.0, 41)
    np.testing.assert_allclose(friction.no_slip_position(friction.net_sliding_share(c)), c, atol=1e-12)


def test_roughness_share_runs_from_none_to_all():
    h = np.array([1e-12, 24e-9, 1.0])
    np.testing.assert_allclose(friction.roughness_share(h, 24e-9), [0.0, 0.5, 1.0], atol=1e-8)
    assert friction.roughness_share(24e-9, 0.0) == 1.0
    assert friction.roughness_share(np.inf, 24e-9) == 1.0


def test_roughness_share_slope_is_its_derivative():
    h, step = np.array([15e-9, 40e-9, 300e-9]), 1e-13
    above, below = (friction.roughness_share(h, 24e-9 + d) for d in (step, -step))
    numeric = (above - below) / (2 * step)
    np.testing.assert_allclose(friction.roughness_share_slope(h, 24e-9), numeric, rtol=1e-6)


def test_arrays_give_the_scalars():
    loads = np.array([16.48, 32.955])
    widths = np.array([32.7e-6, 41.23e-6])
    found = friction.hysteresis_force(loads, widths, 2.3815e-3, 0.01)
    for i in range(2):
        assert found[i] == friction.hysteresis_force(loads[i], widths[i], 2.3815e-3, 0.01)
    np.testing.assert_array_equal(friction.sliding_force(loads, 0.0037), loads * 0.0037)
