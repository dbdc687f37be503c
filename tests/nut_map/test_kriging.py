"""Kriging against the textbook formulas, its limits, and lengths found again."""

import math

import numpy as np
import pytest

from ballscrew_tehl.nut_map import kriging
from ballscrew_tehl.nut_map.kriging import LENGTHS, NOISE, QUADRATIC_FROM, Kriging

#: lengths of three coordinates
LENGTH = np.array([0.4, 0.7, 1.1])
ELSEWHERE = np.random.default_rng(4).uniform(-0.1, 1.1, (25, 3))


def hyper(noise, lengths=LENGTH):
    return np.log([*lengths, noise])


def matern(one, other, lengths=LENGTH):
    """Rasmussen & Williams 2006, Eq. 4.17."""
    s = math.sqrt(5.0) * np.sqrt((((one[:, None] - other) / lengths) ** 2).sum(axis=-1))
    return (1.0 + s + s**2 / 3.0) * np.exp(-s)


def quadratic_terms(points):
    x, y, z = points.T
    return np.stack([np.ones_like(x), x, y, z, x * x, x * y, x * z, y * y, y * z, z * z], axis=1)


def sampled(count=40):
    """Points of the unit cube and values of a smooth function there that is no polynomial."""
    points = np.random.default_rng(3).random((count, 3))
    x, y, z = points.T
    return points, np.sin(4.0 * x) + np.exp(-y) * z + 0.5 * np.cos(3.0 * y * z)


@pytest.mark.parametrize("noise", [1e-3, 0.1])
def test_mean_covariance_and_errors_left_out_are_those_of_the_textbook(noise):
    """Eqs. 2.41, 2.25, 2.26 by explicit inverses; left out with trend and lengths of all points."""
    points, values = sampled()
    correlation = matern(points, points) + noise**2 * np.eye(40)
    inverse, terms = np.linalg.inv(correlation), quadratic_terms(points)
    trend = np.linalg.solve(terms.T @ inverse @ terms, terms.T @ inverse @ values)
    rest = values - terms @ trend
    variance = rest @ inverse @ rest / 40
    model, across = Kriging(points, values, hyper(noise)), matern(ELSEWHERE, points)
    expected = quadratic_terms(ELSEWHERE) @ trend + across @ inverse @ rest
    np.testing.assert_allclose(model(ELSEWHERE), expected, rtol=1e-8, atol=1e-8)
    expected = variance * (matern(ELSEWHERE, ELSEWHERE) - across @ inverse @ across.T)
    size = 1e-8 * np.max(np.abs(expected))
    np.testing.assert_allclose(model.covariance(ELSEWHERE), expected, atol=size)
    np.testing.assert_allclose(model.deviation(ELSEWHERE) ** 2, np.diag(expected), atol=size)
    for i in range(0, 40, 5):
        others = np.arange(40) != i
        weights = np.linalg.solve(correlation[np.ix_(others, others)], rest[others])
        # without the noise of the point itself, which is on the diagonal alone
        error = rest[i] - correlation[i, others] @ weights
        assert model.left_out[i] == pytest.approx(error, rel=1e-6, abs=1e-9)


def test_without_noise_values_come_back_and_the_trend_of_each_degree_goes_on_outside():
    for count in (QUADRATIC_FROM - 4, QUADRATIC_FROM, 60):
        points, values = sampled(count)
        model = Kriging(points, values, hyper(1e-9))
        np.testing.assert_allclose(model(points), values, atol=1e-10)
        assert np.max(model.deviation(points)) <= 1e-6 * model.scale
    far, coefficients = 3.0 * ELSEWHERE, np.arange(-4.0, 6.0)
    found = Kriging(points, quadratic_terms(points) @ coefficients, hyper(0.1))(far)
    np.testing.assert_allclose(found, quadratic_terms(far) @ coefficients, rtol=1e-7, atol=1e-7)
    few, slope = points[: QUADRATIC_FROM - 1], np.array([1.0, -3.0, 0.5])
    np.testing.assert_allclose(Kriging(few, 2.0 - few @ slope, hyper(0.1))(far), 2.0 - far @ slope, atol=1e-8)
    # a quadratic is too much for few points, a constant goes back to one value, without a trend to 0
    assert np.max(np.abs(Kriging(few, few[:, 0] ** 2, hyper(0.1))(far) - far[:, 0] ** 2)) >= 0.1
    away = np.array([[90.0, 0.5, 0.5], [0.5, 90.0, 0.5]])
    one, other = Kriging(points, values, hyper(1e-3), 0)(away)
    assert one == pytest.approx(other, rel=1e-12)
    np.testing.assert_allclose(Kriging(points, values, hyper(1e-3), -1)(away), 0.0, atol=1e-12)


def test_lengths_and_noise_of_a_process_are_found_and_bounded():
    """Lengths within a factor of 1.6, noise of 2; no worse than the true ones by the tolerance of the search."""
    lengths, noise = np.array([0.15, 0.5]), 0.03
    generator = np.random.default_rng(1)
    points = generator.random((150, 2))
    covariance = matern(points, points, lengths) + noise**2 * np.eye(150)
    values = 7.0 + np.linalg.cholesky(covariance) @ generator.standard_normal(150)
    model, true = Kriging(points, values), hyper(noise, lengths)
    assert np.max(np.abs(model.hyper - true)) <= math.log(1.6)
    assert model._solved(model.hyper)[-1] <= model._solved(true)[-1] + kriging.SEARCH_TOLERANCE
    points, _ = sampled(60)
    found = np.exp(Kriging(points, np.random.default_rng(2).standard_normal(60)).hyper)
    assert np.all((found[:3] >= 0.999 * LENGTHS[0]) & (found[:3] <= 1.001 * LENGTHS[1]))
    assert 0.999 * NOISE[0] <= found[3] <= 1.001 * NOISE[1]


def test_too_few_points_and_numbers_that_are_not_finite_are_refused():
    with pytest.raises(ValueError, match="kriging: 4 points; needs more than 4"):
        Kriging(*sampled(4))
    for place in (0, 1):
        given = sampled()
        given[place][7] = math.nan
        with pytest.raises(ValueError, match="kriging: points and values need to be finite"):
            Kriging(*given)
