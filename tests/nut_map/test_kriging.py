"""Kriging against the textbook formulas in plain NumPy, its limits, and lengths found again."""

import math

import numpy as np
import pytest

from ballscrew_tehl.nut_map import kriging
from ballscrew_tehl.nut_map.kriging import LENGTHS, NOISE, QUADRATIC_FROM, Interpolant, Kriging

#: lengths of three coordinates; noise that counts as none
LENGTH, NO_NOISE = np.array([0.4, 0.7, 1.1]), 1e-9


def hyper(noise, lengths=LENGTH):
    return np.log([*lengths, noise])


def matern(one, other, lengths=LENGTH):
    """Rasmussen & Williams 2006, Eq. 4.17, pair by pair."""
    found = np.empty((len(one), len(other)))
    for i, a in enumerate(one):
        for j, b in enumerate(other):
            r = math.sqrt(sum(((a[k] - b[k]) / lengths[k]) ** 2 for k in range(len(lengths))))
            s = math.sqrt(5.0) * r
            found[i, j] = (1.0 + s + s**2 / 3.0) * math.exp(-s)
    return found


def quadratic_terms(points):
    x, y, z = points.T
    return np.stack([np.ones_like(x), x, y, z, x * x, x * y, x * z, y * y, y * z, z * z], axis=1)


class Textbook:
    """Eqs. 2.41 (trend), 2.25 and 2.26 (mean and covariance), by explicit inverses."""

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


ELSEWHERE = np.random.default_rng(4).uniform(-0.1, 1.1, (25, 3))


# --- limits ---


@pytest.mark.parametrize("count", [QUADRATIC_FROM - 4, QUADRATIC_FROM, 60])
def test_without_noise_values_come_back_at_their_points(count):
    points, values = sampled(count)
    model = Kriging(points, values, hyper(NO_NOISE))
    np.testing.assert_allclose(model(points), values, atol=1e-11)
    assert np.max(model.deviation(points)) <= 1e-6 * model.scale
    assert np.min(model.deviation(ELSEWHERE)) >= 1e-3 * model.scale


def test_with_noise_values_are_smoothed():
    points, values = sampled(60)
    scatter = 0.02 * np.random.default_rng(5).standard_normal(60)
    model = Kriging(points, values + scatter, hyper(0.05))
    residual = np.abs(model(points) - values - scatter)
    assert np.mean(residual) >= 0.2 * np.mean(np.abs(scatter))
    # never more than when the point is left out
    assert np.all(residual <= np.abs(model.left_out))


@pytest.mark.parametrize("noise", [NO_NOISE, 0.1])
def test_a_quadratic_is_exact_also_outside(noise):
    points, _ = sampled(QUADRATIC_FROM)

    def quadratic(at):
        return quadratic_terms(at) @ np.arange(-4.0, 6.0)

    model = Kriging(points, quadratic(points), hyper(noise))
    np.testing.assert_allclose(model(3.0 * ELSEWHERE), quadratic(3.0 * ELSEWHERE), rtol=1e-8, atol=1e-8)


def test_few_points_have_a_linear_trend():
    points, _ = sampled(QUADRATIC_FROM - 1)

    def linear(at):
        return 2.0 - at @ np.array([1.0, -3.0, 0.5])

    model = Kriging(points, linear(points), hyper(0.1))
    np.testing.assert_allclose(model(3.0 * ELSEWHERE), linear(3.0 * ELSEWHERE), atol=1e-9)
    # a quadratic is no longer exact
    far = 3.0 * ELSEWHERE
    assert np.max(np.abs(Kriging(points, points[:, 0] ** 2, hyper(0.1))(far) - far[:, 0] ** 2)) >= 0.1


# --- textbook ---


@pytest.mark.parametrize("noise", [1e-3, 0.1])
def test_mean_covariance_and_deviation_are_those_of_the_textbook(noise):
    points, values = sampled()
    model, twin = Kriging(points, values, hyper(noise)), Textbook(points, values, noise)
    assert model.scale == pytest.approx(math.sqrt(twin.variance), rel=1e-8)
    np.testing.assert_allclose(model(ELSEWHERE), twin.mean(ELSEWHERE), rtol=1e-8, atol=1e-8)
    expected = twin.covariance(ELSEWHERE)
    largest = np.max(np.abs(expected))
    np.testing.assert_allclose(model.covariance(ELSEWHERE), expected, atol=1e-8 * largest)
    np.testing.assert_allclose(model.deviation(ELSEWHERE) ** 2, np.diag(expected), atol=1e-8 * largest)
    # a model of a length for each coordinate: with equal ones the covariance differs
    equal = Kriging(points, values, hyper(noise, [0.7] * 3)).covariance(ELSEWHERE)
    assert np.max(np.abs(equal - expected)) >= 1e-2 * largest


@pytest.mark.parametrize("noise", [1e-3, 0.1])
def test_errors_left_out_are_those_of_models_without_the_point(noise):
    """Trend and lengths of the whole model, as Eq. 5.12 has it."""
    points, values = sampled()
    model = Kriging(points, values, hyper(noise))
    trend = Textbook(points, values, noise).coefficients
    for i in range(len(points)):
        others = np.arange(len(points)) != i
        without = Textbook(points[others], values[others], noise, trend)
        predicted = without.mean(points[i : i + 1])[0]
        assert model.left_out[i] == pytest.approx(values[i] - predicted, rel=1e-6, abs=1e-9)


def test_likelihood_is_that_of_the_normal_distribution():
    """Eq. 5.8 with the variance that maximises it; differences, for constants are left out."""
    points, values = sampled()
    model = Kriging(points, values, hyper(1e-2))
    found, expected = [], []
    for noise, factor in ((1e-2, 1.0), (0.2, 1.0), (1e-2, 0.5), (0.05, 1.7)):
        at = hyper(noise, factor * LENGTH)
        correlation = matern(points, points, factor * LENGTH) + noise**2 * np.eye(40)
        terms, inverse = quadratic_terms(points), np.linalg.inv(correlation)
        rest = values - terms @ np.linalg.solve(terms.T @ inverse @ terms, terms.T @ inverse @ values)
        variance = rest @ inverse @ rest / 40
        covariance = variance * correlation
        expected.append(
            0.5 * rest @ np.linalg.inv(covariance) @ rest + 0.5 * np.linalg.slogdet(covariance)[1]
        )
        found.append(model._solved(at)[-1])
    np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=1e-6)


# --- most likely lengths ---


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_lengths_and_noise_of_a_process_are_found(seed):
    """Lengths within a factor of 1.6, noise of 2; no worse than the true ones by the tolerance of the search."""
    generator = np.random.default_rng(seed)
    lengths, noise = np.array([0.15, 0.5]), 0.03
    points = generator.random((150, 2))
    covariance = matern(points, points, lengths) + noise**2 * np.eye(150)
    values = 7.0 + np.linalg.cholesky(covariance) @ generator.standard_normal(150)
    model = Kriging(points, values)
    true = hyper(noise, lengths)
    assert np.max(np.abs(model.hyper - true)[:2]) <= math.log(1.6)
    assert abs(model.hyper[2] - true[2]) <= math.log(2.0)
    assert model._solved(model.hyper)[-1] <= model._solved(true)[-1] + kriging.SEARCH_TOLERANCE


def test_given_lengths_are_not_searched(monkeypatch):
    points, values = sampled()
    searched = Kriging(points, values)

    def refuse(*_, **__):
        raise AssertionError("searched")

    monkeypatch.setattr(kriging, "minimize", refuse)
    again = Kriging(points, values, searched.hyper)
    np.testing.assert_array_equal(again(ELSEWHERE), searched(ELSEWHERE))
    with pytest.raises(AssertionError, match="searched"):
        Kriging(points, values)


def test_lengths_and_noise_stay_within_their_bounds():
    """Along the first coordinate the values are noise, along the others they are constant."""
    points, _ = sampled(60)
    found = np.exp(Kriging(points, np.random.default_rng(2).standard_normal(60)).hyper)
    assert np.all((found[:3] >= 0.999 * LENGTHS[0]) & (found[:3] <= 1.001 * LENGTHS[1]))
    assert 0.999 * NOISE[0] <= found[3] <= 1.001 * NOISE[1]


# --- bad input ---


@pytest.mark.parametrize("count", [1, 4])
def test_too_few_points_are_refused(count):
    points, values = sampled(count)
    with pytest.raises(ValueError, match=f"kriging: {count} points; needs more than 4"):
        Kriging(points, values)
    points, values = sampled(5)
    assert np.isfinite(Kriging(points, values, hyper(0.1))(points)).all()


@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("which", ["points", "values"])
def test_numbers_that_are_not_finite_are_refused(bad, which):
    points, values = sampled()
    (points if which == "points" else values)[(7,)] = bad
    with pytest.raises(ValueError, match="kriging: points and values need to be finite"):
        Kriging(points, values)


def test_trend_of_a_given_degree():
    """Far from the points a constant trend goes back to one value, a linear one goes on."""
    points = np.random.default_rng(6).random((30, 2))
    values = 1.0 + 2.0 * points[:, 0]
    hyper = np.log([0.1, 0.1, 1e-3])
    far = np.array([[30.0, 0.5], [60.0, 0.5]])
    constant = Kriging(points, values, hyper, 0)(far)
    assert constant[0] == pytest.approx(constant[1], rel=1e-12)
    np.testing.assert_allclose(Kriging(points, values, hyper, 1)(far), 1.0 + 2.0 * far[:, 0], rtol=1e-9)


def test_without_a_trend_far_points_are_0():
    points = np.random.default_rng(6).random((30, 2))
    values = 1.0 + 2.0 * points[:, 0]
    hyper = np.log([0.1, 0.1, 1e-3])
    plain = Kriging(points, values, hyper, -1)
    far = np.array([[30.0, 0.5], [60.0, 0.5]])
    np.testing.assert_allclose(plain(far), 0.0, atol=1e-12)
    # simple kriging: Rasmussen & Williams, Eq. 2.25
    found = kriging._correlation(points, points, hyper) + 1e-6 * np.eye(30)
    at = np.array([[0.3, 0.4], [0.9, 0.1]])
    expected = kriging._correlation(at, points, hyper) @ np.linalg.solve(found, values)
    np.testing.assert_allclose(plain(at), expected, rtol=1e-9)
    assert np.isfinite(Kriging(points, values, None, -1).hyper).all()


def test_interpolant_alone_gives_the_same():
    """More points than are interpolated at a time."""
    generator = np.random.default_rng(7)
    model = Kriging(generator.random((40, 3)), generator.random(40), np.log([0.4, 0.5, 0.6, 1e-2]))
    at = generator.random((2 * kriging.CHUNK + 3, 3))
    part = model.interpolant
    np.testing.assert_array_equal(Interpolant(*part)(at), model(at))
    np.testing.assert_allclose(model(at)[-5:], model(at[-5:]), rtol=1e-12)
    assert part(np.empty((0, 3))).shape == (0,)
