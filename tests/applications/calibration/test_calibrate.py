"""Least squares: hand-checked numbers, hat values and left-out errors against refits, limits, refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from section7 import BASIS, MEASURED, basis_of

from ballscrew_tehl.applications.calibration.fit import fit, fit_values
from ballscrew_tehl.friction.sets import FITTED

SINGLE = [[i] for i in range(len(BASIS))]
GROUPS = [[0, 6], [1], [2, 3, 4], [5], [7], [8], [9], [10]]
TWO, THREE = (replace(BASIS, names=names) for names in (FITTED[:2], FITTED))


def test_fits_against_hand_calculation():
    """Value and half interval of ratio, net coefficient, height [nm]; errors in per cent, to the digits stated."""
    for basis, values, halves, mean in (
        (TWO, (8.76, 0.00372, 0.0), (0.66, 0.00032), 1.72),
        (THREE, (7.62, 0.00506, 24e-9), (0.58, 0.00068, 14e-9), 1.24),
    ):
        found = fit(basis, SINGLE)
        digits = np.array([0.005, 0.000005, 0.5e-9])
        assert np.all(np.abs(found.values - values) <= digits)
        assert np.all(np.abs(np.array([*found.half_width.values()]) - halves) <= digits[: len(halves)])
        assert abs(100.0 * np.abs(found.deviation).mean() - mean) <= 0.005


def test_jacobian_is_the_derivative_of_weighted_errors():
    basis = replace(BASIS, measurements=tuple(replace(m, weight=0.5 + i) for i, m in enumerate(MEASURED)))
    values = np.array([7.6, 0.005, 24e-9])
    steps = 1e-5 * np.diag(values)
    numeric = [(basis.errors(values + s) - basis.errors(values - s)) / (2 * s.sum()) for s in steps]
    np.testing.assert_allclose(basis.jacobian(values), np.transpose(numeric), rtol=1e-7)


def test_left_out_errors_are_those_of_refits():
    weighted = tuple(replace(m, weight=0.5 + i) for i, m in enumerate(MEASURED))
    for basis, groups, limit in (
        (replace(TWO, measurements=weighted), GROUPS, 1e-9),
        (replace(TWO, names=FITTED[1:2], fixed=(8.0, 0.0, 0.0)), GROUPS, 1e-9),
        (THREE, SINGLE, 1e-9),
    ):
        found = fit(basis, groups)
        assert found.leverage.sum() == pytest.approx(len(basis.names))
        for group in groups:
            values = fit_values(basis.subset([i for i in range(11) if i not in group]))
            error = (basis.torque(values) / basis.measured - 1.0)[group]
            assert np.max(np.abs(found.left_out[group] - error)) <= limit


def test_deleted_studentised_residuals_against_fits_without_the_point():
    """t = error of the prediction by the other points, over its standard error from them."""
    found = fit(TWO, SINGLE)
    for i in (0, 4, 10):
        rest = TWO.subset([j for j in range(11) if j != i])
        values = fit_values(rest)
        J, own = rest.jacobian(values)[:, :2], TWO.jacobian(values)[i, :2]
        error = rest.errors(values)
        variance = float(error @ error) / 8 * (1.0 + own @ np.linalg.inv(J.T @ J) @ own)
        assert found.studentised[i] == pytest.approx(TWO.errors(values)[i] / math.sqrt(variance), rel=1e-8)


def test_a_point_beyond_the_limit_is_an_outlier():
    """Eleven points, two parameters: 5 % two-sided over 11 tests with 8 degrees of freedom, quantile by integration."""
    found = fit(TWO, SINGLE)
    density = 35.0 / (64.0 * math.sqrt(2.0))  # of Student's t with 8 degrees of freedom at 0
    tail = quad(lambda t: density * (1.0 + t * t / 8.0) ** -4.5, found.limit, math.inf)[0]
    assert tail == pytest.approx(0.05 / 22.0, rel=1e-6)
    inside, outside = np.zeros(11), np.zeros(11)
    inside[3], outside[3], outside[6], outside[7] = 0.99, -1.01, 1.01, math.nan
    for ratio, deviation, outliers in ((inside, 1.0, []), (outside, 1.0, [3, 6]), (outside, 0.017, [])):
        changed = found._replace(studentised=ratio * found.limit, deviation=np.full(11, deviation))
        assert changed.outliers == outliers


def test_proportional_parts_are_refused():
    with pytest.raises(ValueError, match="measure at several speeds"):
        fit_values(replace(basis_of([MEASURED[0]] * 5), names=FITTED[:2]))
