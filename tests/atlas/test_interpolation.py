"""Universal kriging of the atlas: against a dense solve of its system, its points, and refits without a point."""

import numpy as np

from atlas_builder.fit import interpolant_of
from ballscrew_tehl.atlas.contact_atlas import CHUNK, correlation, trend_terms

RNG = np.random.default_rng(2)
LENGTHS, LEVEL = np.array([1.5, 4.0]), np.array([0.03, 0.1])


def points_and_values(n):
    x = RNG.uniform(-3.0, 3.0, (n, 2))
    return x, np.stack([np.sin(x[:, 0]) + 0.3 * x[:, 1], np.cos(x[:, 0] * 0.5) * x[:, 1]], axis=1)


def test_interpolant_is_the_dense_solution_of_its_system():
    """[K + N, F; F', 0] of weights and trend, many points at once."""
    x, y = points_and_values(40)
    noise = RNG.uniform(1.0, 3.0, y.shape)
    found, _ = interpolant_of(x, y, noise, LENGTHS, LEVEL)
    at = RNG.uniform(-4.0, 4.0, (2 * CHUNK + 3, 2)) / LENGTHS
    terms = trend_terms(x / LENGTHS)
    for q in range(2):
        covariance = correlation(x / LENGTHS, x / LENGTHS) + np.diag((LEVEL[q] * noise[:, q]) ** 2)
        system = np.block([[covariance, terms], [terms.T, np.zeros((3, 3))]])
        solved = np.linalg.solve(system, np.append(y[:, q], np.zeros(3)))
        expected = np.hstack([correlation(at, x / LENGTHS), trend_terms(at)]) @ solved
        np.testing.assert_allclose(found(at)[:, q], expected, rtol=1e-8, atol=1e-8)


def test_correlation_is_matern_of_order_5_2():
    r = np.array([[0.0, 0.0], [0.6, 0.8], [3.0, 4.0]])
    d = np.sqrt(5.0) * np.array([0.0, 1.0, 5.0])
    np.testing.assert_allclose(correlation(r, r)[0], (1.0 + d + d**2 / 3.0) * np.exp(-d), rtol=1e-9)


def test_errors_left_out_are_those_of_refits_without_the_point():
    x, y = points_and_values(25)
    noise = RNG.uniform(1.0, 3.0, y.shape)
    _, errors = interpolant_of(x, y, noise, LENGTHS, LEVEL)
    for k in range(25):
        rest = np.arange(25) != k
        without, _ = interpolant_of(x[rest], y[rest], noise[rest], LENGTHS, LEVEL)
        expected = y[k] - without(x[k : k + 1] / LENGTHS)[0]
        np.testing.assert_allclose(errors[k], expected, rtol=1e-6, atol=1e-9)
