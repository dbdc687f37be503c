import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from ballscrew_tehl.runtime.bspline import cubic_slopes, cubic_weights, fit, map_arrays


def value(coefficients, t, function=cubic_weights):
    cell = min(int(t), len(coefficients) - 4)
    return float(np.dot(function(t - cell), coefficients[cell : cell + 4]))


def test_the_spline_is_the_not_a_knot_spline_of_scipy():
    rng = np.random.default_rng(1)
    samples = rng.normal(size=9)
    reference = make_interp_spline(np.arange(9.0), samples, k=3)
    coefficients = fit(samples, (0,))
    for t in np.linspace(0.0, 8.0, 57):
        assert value(coefficients, t) == pytest.approx(float(reference(t)), abs=1e-12)
        assert value(coefficients, t, cubic_slopes) == pytest.approx(float(reference(t, 1)), abs=1e-12)


def test_cubics_are_reproduced_along_each_axis():
    x, y = np.arange(5.0), np.arange(6.0)
    samples = (x**3 - 4 * x)[:, None] * (2 - y**2)[None, :]
    coefficients = fit(samples, (0, 1))
    assert coefficients.shape == (7, 8)
    along_x = np.array(cubic_weights(0.3)) @ coefficients[2:6]
    assert value(along_x, 3.6) == pytest.approx((2.3**3 - 4 * 2.3) * (2 - 3.6**2), rel=1e-12)


def test_weights_add_up_to_one_and_slopes_to_zero_for_arrays_too():
    t = np.linspace(0.0, 1.0, 11)
    assert np.allclose(sum(cubic_weights(t)), 1.0, atol=1e-15)
    assert np.allclose(sum(cubic_slopes(t)), 0.0, atol=1e-15)
    assert [w[3] for w in cubic_weights(t)] == pytest.approx(cubic_weights(float(t[3])))


def test_too_few_nodes_and_values_that_are_not_finite_are_refused():
    with pytest.raises(ValueError, match="3 nodes; needs >= 4"):
        fit(np.ones(3), (0,))
    with pytest.raises(ValueError, match="finite"):
        fit(np.array([1.0, 2.0, np.nan, 3.0]), (0,))


def test_a_map_value_that_is_not_positive_is_refused():
    good = (np.ones((4, 4, 4, 10)), np.ones((4, 4)), np.ones((4, 2)), np.ones((4, 4, 2)))
    assert map_arrays(*good)["coefficients"].shape == (6, 6, 6, 10)
    bad = np.ones((4, 4))
    bad[2, 1] = 0.0
    with pytest.raises(ValueError, match="force_values"):
        map_arrays(good[0], bad, *good[2:])
