"""Profile limits and outliers: against brute force and known cases."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize
from scipy.stats import f
from section7 import BASIS

from ballscrew_tehl.calibration.diagnostics import point_diagnostics, profile_limits
from ballscrew_tehl.calibration.fit import fit_values
from ballscrew_tehl.friction.sets import FITTED


@pytest.mark.parametrize(("count", "parameter"), [(2, 0), (2, 1), (3, 0), (3, 1), (3, 2)])
def test_profile_limits_against_a_general_minimiser(count, parameter):
    limits = profile_limits(BASIS, count)[FITTED[parameter]]
    values = fit_values(BASIS, count, "least_squares")
    least = float(np.sum(BASIS.errors(values) ** 2))
    freedom = len(BASIS) - count
    allowed = least * (1.0 + f.ppf(0.95, 1, freedom) / freedom)
    others = [i for i in range(count) if i != parameter]
    for end in ("low", "high"):

        def cost(x, end=end):
            trial = values.copy()
            trial[parameter] = limits[end]
            trial[others] = np.abs(x) * values[others]
            return float(np.sum(BASIS.errors(trial) ** 2)) / least

        found = min(
            minimize(cost, np.full(len(others), start), method="Nelder-Mead",
                     options={"xatol": 1e-10, "fatol": 1e-13, "maxiter": 4000}).fun
            for start in (1.0, 0.6, 1.5)
        )  # fmt: skip
        assert found == pytest.approx(allowed / least, rel=1e-6), end
    assert limits["low"] < values[parameter] < limits["high"]


def test_deleted_studentised_residuals_against_fits_without_the_point():
    """t = error of the prediction by the other points, over its standard error from them."""
    points = point_diagnostics(BASIS, fit_values(BASIS, 2, "least_squares"), 2)
    for i in (0, 4, 10):
        rest = BASIS.subset([j for j in range(11) if j != i])
        values = fit_values(rest, 2, "least_squares")
        J, own = rest.jacobian(values)[:, :2], BASIS.jacobian(values)[i, :2]
        error = rest.errors(values)
        variance = float(error @ error) / 8 * (1.0 + own @ np.linalg.inv(J.T @ J) @ own)
        assert points.studentised[i] == pytest.approx(BASIS.errors(values)[i] / math.sqrt(variance), rel=1e-8)
    assert points.leverage.sum() == pytest.approx(2.0)


def test_a_point_beyond_either_limit_is_an_outlier():
    """Eleven points, two parameters: 5 % two-sided over 11 tests with 8 degrees of freedom, quantile by integration."""
    points = point_diagnostics(BASIS, fit_values(BASIS, 2, "least_squares"), 2)
    density = 35.0 / (64.0 * math.sqrt(2.0))  # of Student's t with 8 degrees of freedom at 0
    tail = quad(lambda t: density * (1.0 + t * t / 8.0) ** -4.5, points.limit, math.inf)[0]
    assert tail == pytest.approx(0.05 / 22.0, rel=1e-6)
    inside, outside = np.zeros(11), np.zeros(11)
    inside[3], outside[3], outside[6] = 0.99, -1.01, 1.01
    for share, deviation, found in ((inside, 1.0, []), (outside, 1.0, [3, 6]), (outside, 0.017, [])):
        changed = {
            "studentised": share * points.limit,
            "robust": 0.0 * share,
            "deviation": 0.0 * share + deviation,
        }
        assert replace(points, **changed).outliers == found
        changed |= {"studentised": 0.0 * share, "robust": 6.0 * share}
        assert replace(points, **changed).outliers == found
