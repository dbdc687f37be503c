"""Kriging against the textbook formulas in plain NumPy, its limits, and lengths found again."""

import math

import numpy as np
import pytest

from ballscrew_tehl.nut_map import kriging
from ballscrew_tehl.nut_map.kriging import LENGTHS, NOISE, QUADRATIC_FROM, Interpolant, Kriging

#: lengths of three coordinates; noise that counts as none
LENGTH, NO_NOISE = np.array([0.4, 0.7, 1.1]), 1e-9
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


class Textbook:
    """Eqs. 2.41 (trend), 2.25 and 2.26 (mean and covariance), by explicit inverses; None: with this trend."""

    def __init__(self, points, values, noise, coefficients=None):
        self.points = points
        self.inverse = np.linalg.inv(matern(points, points) + noise**2 * np.eye(len(points)))
        terms = quadratic_terms(points)
        if coefficients is None:
            normal = terms.T @ self.inverse @ terms
            coefficients = np.linalg.inv(normal) @ terms.T @ self.inverse @ values
        self.coefficients = coefficients
        self.rest = values - terms @ coefficients
        self.variance = self.rest @ self.inverse @ self.rest / len(points)

    def mean(self, at):
        return quadratic_terms(at) @ self.coefficients + matern(at, self.points) @ self.inverse @ self.rest

    def covariance(self, at):
        across = matern(at, self.points)
        return self.variance * (matern(at, at) - across @ self.inverse @ across.T)


def sampled(count=40, seed=3):
    """Points of the unit cube and values of a smooth function there that is no polynomial."""
    points = np.random.default_rng(seed).random((count, 3))
    x, y, z = points.T
    return points, np.sin(4.0 * x) + np.exp(-y) * z + 0.5 * np.cos(3.0 * y * z)


@pytest.mark.parametrize("noise", [1e-3, 0.1])
def test_mean_covariance_and_errors_left_out_are_those_of_the_textbook(noise):
    """Left out: trend and lengths of the whole model, as Eq. 5.12 has it."""
    points, values = sampled()
    model, twin = Kriging(points, values, hyper(noise)), Textbook(points, values, noise)
    assert model.scale == pytest.approx(math.sqrt(twin.variance), rel=1e-8)
    np.testing.assert_allclose(model(ELSEWHERE), twin.mean(ELSEWHERE), rtol=1e-8, atol=1e-8)
    expected = twin.covariance(ELSEWHERE)
    size = np.max(np.abs(expected))
    np.testing.assert_allclose(model.covariance(ELSEWHERE), expected, atol=1e-8 * size)
    np.testing.assert_allclose(model.deviation(ELSEWHERE) ** 2, np.diag(expected), atol=1e-8 * size)
    for i in range(len(points)):
        others = np.arange(len(points)) != i
        without = Textbook(points[others], values[others], noise, twin.coefficients)
        error = values[i] - without.mean(points[i : i + 1])[0]
        assert model.left_out[i] == pytest.approx(error, rel=1e-6, abs=1e-9)


def test_without_noise_values_come_back_and_with_noise_they_are_smoothed():
    for count in (QUADRATIC_FROM - 4, QUADRATIC_FROM, 60):
        points, values = sampled(count)
        model = Kriging(points, values, hyper(NO_NOISE))
        np.testing.assert_allclose(model(points), values, atol=1e-10)
        assert np.max(model.deviation(points)) <= 1e-6 * model.scale
        assert np.min(model.deviation(ELSEWHERE)) >= 1e-3 * model.scale
    scatter = 0.02 * np.random.default_rng(5).standard_normal(60)
    model = Kriging(points, values + scatter, hyper(0.05))
    residual = np.abs(model(points) - values - scatter)
    assert np.mean(residual) >= 0.2 * np.mean(np.abs(scatter))
    assert np.all(residual <= np.abs(model.left_out))


def test_trend_of_each_degree_goes_on_outside():
    points, values = sampled(60)
    far = 3.0 * ELSEWHERE
    quadratic = quadratic_terms(points) @ np.arange(-4.0, 6.0)
    found = Kriging(points, quadratic, hyper(0.1))(far)
    np.testing.assert_allclose(found, quadratic_terms(far) @ np.arange(-4.0, 6.0), rtol=1e-7, atol=1e-7)
    slope = np.array([1.0, -3.0, 0.5])
    few = points[: QUADRATIC_FROM - 1]
    np.testing.assert_allclose(Kriging(few, 2.0 - few @ slope, hyper(0.1))(far), 2.0 - far @ slope, atol=1e-8)
    # a quadratic is too much for few points, a constant goes back to one value, without a trend to 0
    assert np.max(np.abs(Kriging(few, few[:, 0] ** 2, hyper(0.1))(far) - far[:, 0] ** 2)) >= 0.1
    away = np.array([[90.0, 0.5, 0.5], [0.5, 90.0, 0.5]])
    one, other = Kriging(points, values, hyper(1e-3), 0)(away)
    assert one == pytest.approx(other, rel=1e-12)
    np.testing.assert_allclose(Kriging(points, values, hyper(1e-3), -1)(away), 0.0, atol=1e-12)
    near = points[:3] + 0.01
    found = Kriging(points, values, hyper(1e-2), -1)(near)
    correlation = matern(points, points) + 1e-4 * np.eye(60)
    np.testing.assert_allclose(found, matern(near, points) @ np.linalg.solve(correlation, values), rtol=1e-8)


def test_likelihood_is_that_of_the_normal_distribution():
    """Eq. 5.8 with the variance that maximises it; differences, for constants are left out."""
    points, values = sampled()
    model = Kriging(points, values, hyper(1e-2))
    found, expected = [], []
    for noise, factor in ((1e-2, 1.0), (0.2, 1.0), (1e-2, 0.5), (0.05, 1.7)):
        correlation = matern(points, points, factor * LENGTH) + noise**2 * np.eye(40)
        terms, inverse = quadratic_terms(points), np.linalg.inv(correlation)
        rest = values - terms @ np.linalg.solve(terms.T @ inverse @ terms, terms.T @ inverse @ values)
        covariance = (rest @ inverse @ rest / 40) * correlation
        log_determinant = np.linalg.slogdet(covariance)[1]
        expected.append(0.5 * rest @ np.linalg.inv(covariance) @ rest + 0.5 * log_determinant)
        found.append(model._solved(hyper(noise, factor * LENGTH))[-1])
    np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=1e-6)


def test_lengths_and_noise_of_a_process_are_found_and_bounded():
    """Lengths within a factor of 1.6, noise of 2; no worse than the true ones by the tolerance of the search."""
    lengths, noise = np.array([0.15, 0.5]), 0.03
    for seed in (1, 2):
        generator = np.random.default_rng(seed)
        points = generator.random((150, 2))
        covariance = matern(points, points, lengths) + noise**2 * np.eye(150)
        values = 7.0 + np.linalg.cholesky(covariance) @ generator.standard_normal(150)
        model, true = Kriging(points, values), hyper(noise, lengths)
        assert np.max(np.abs(model.hyper - true)[:2]) <= math.log(1.6)
        assert abs(model.hyper[2] - true[2]) <= math.log(2.0)
        assert model._solved(model.hyper)[-1] <= model._solved(true)[-1] + kriging.SEARCH_TOLERANCE
    points, _ = sampled(60)
    found = np.exp(Kriging(points, np.random.default_rng(2).standard_normal(60)).hyper)
    assert np.all((found[:3] >= 0.999 * LENGTHS[0]) & (found[:3] <= 1.001 * LENGTHS[1]))
    assert 0.999 * NOISE[0] <= found[3] <= 1.001 * NOISE[1]


def test_interpolant_alone_gives_the_same():
    """More points than are interpolated at a time."""
    points, values = sampled()
    model = Kriging(points, values, hyper(1e-2))
    at = np.random.default_rng(7).random((2 * kriging.CHUNK + 3, 3))
    np.testing.assert_array_equal(Interpolant(*model.interpolant)(at), model(at))
    np.testing.assert_allclose(model(at)[-5:], model(at[-5:]), rtol=1e-10)
    assert model.interpolant(np.empty((0, 3))).shape == (0,)


def test_too_few_points_and_numbers_that_are_not_finite_are_refused():
    with pytest.raises(ValueError, match="kriging: 4 points; needs more than 4"):
        Kriging(*sampled(4))
    for place in (0, 1):
        given = sampled()
        given[place][7] = math.nan
        with pytest.raises(ValueError, match="kriging: points and values need to be finite"):
            Kriging(*given)
