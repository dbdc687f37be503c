"""Profile limits, outliers, parameters not identified: against brute force, known cases, repeated noise."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize
from scipy.stats import binom, f
from section7 import BASIS, MEASURED, RPM, basis_of

from ballscrew_tehl.calibration.diagnostics import (
    SPLIT,
    Rival,
    condition,
    not_identified,
    point_diagnostics,
    predicts_better,
    profile_limits,
    sliding_share,
)
from ballscrew_tehl.calibration.fit import fit_values
from ballscrew_tehl.calibration.packaged import intervals, left_out_deviations
from ballscrew_tehl.friction.sets import FITTED

RATIO, NET, HEIGHT = FITTED
TRUTH = (7.5, 0.005, 24e-9)


def noisy(basis, values, noise, seed):
    """The basis with torques of the model, relative errors normal."""
    generator = np.random.default_rng(seed)
    torques = basis.torque(values) * (1.0 + noise * generator.normal(size=len(basis)))
    points = tuple(replace(m, torque=float(t)) for m, t in zip(basis.measurements, torques, strict=True))
    return replace(basis, measurements=points)


@pytest.fixture(scope="module")
def wide():
    """Twenty points over preload, speed and thin to thick films: enough to identify the parameters."""
    return basis_of([
        replace(MEASURED[1], preload=preload, speed=rpm * RPM, tables=())
        for preload in (1000.0, 2000.0, 4000.0, 6000.0) for rpm in (20.0, 100.0, 400.0, 1200.0, 3000.0)
    ])  # fmt: skip


def identified(basis, count, rivals=(), loss="least_squares"):
    values = fit_values(basis, count, loss)
    _, correlations = intervals(basis, values, count)
    left_out = np.abs(left_out_deviations(basis, count, loss))
    return not_identified(basis, values, count, profile_limits(basis, count), correlations, left_out, rivals)


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("parameter", [0, 1, 2])
def test_profile_limits_against_a_general_minimiser(count, parameter):
    if parameter >= count:
        pytest.skip("not fitted")
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


def test_profile_limits_of_two_parameters_are_the_linear_intervals():
    values = fit_values(BASIS, 2, "least_squares")
    half, _ = intervals(BASIS, values, 2)
    for i, (name, ends) in enumerate(profile_limits(BASIS, 2).items()):
        assert ends["low"] == pytest.approx(values[i] - half[name], rel=1e-6)
        assert ends["high"] == pytest.approx(values[i] + half[name], rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 3])
def test_limits_cover_the_truth(count):
    """Forty noisy repetitions of the eleven points, 2 %: 95 % intervals. Bound: 0.1 % quantile of the binomial law."""
    truth = TRUTH if count == 3 else (8.8, 0.0037, 0.0)
    repetitions = 40
    least = binom.ppf(1e-3, repetitions, 0.95)
    inside, widths = np.zeros(count), []
    for seed in range(repetitions):
        limits = profile_limits(noisy(BASIS, truth, 0.02, seed), count)
        for i, name in enumerate(FITTED[:count]):
            inside[i] += limits[name]["low"] <= truth[i] <= limits[name]["high"]
        widths.append([limits[name]["high"] - limits[name]["low"] for name in FITTED[:count]])
    assert np.all(inside >= least), inside
    # too wide intervals must fail
    assert np.all(np.median(widths, axis=0) < 2.5 * np.array(truth[:count]))


def test_limits_of_a_vanished_height_begin_at_zero():
    limits = profile_limits(noisy(BASIS, (9.0, 0.0037, 0.0), 0.01, 2), 3)
    assert limits[HEIGHT]["low"] == 0.0
    assert 0.0 < limits[HEIGHT]["high"] < 50e-9


def test_limits_of_exact_data_are_the_true_values():
    limits = profile_limits(noisy(BASIS, TRUTH, 0.0, 0), 3)
    for name, value in zip(FITTED, TRUTH, strict=True):
        assert limits[name]["low"] == pytest.approx(value, rel=1e-4)
        assert limits[name]["high"] == pytest.approx(value, rel=1e-4)


def test_no_degree_of_freedom_means_no_limits():
    assert profile_limits(BASIS.subset([0, 6]), 2)[NET] == {"low": 0.0, "high": math.inf}


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
    for share, found in ((inside, []), (outside, [3, 6])):
        assert replace(points, studentised=share * points.limit, robust=0.0 * share).outliers == found
        assert replace(points, studentised=0.0 * share, robust=6.0 * share).outliers == found


@pytest.mark.parametrize("stray", [{4: 1.15}, {2: 1.3, 7: 1.25, 12: 1.3}, {0: 0.85}])
def test_outliers_are_found_also_when_they_mask_each_other(wide, stray):
    basis = noisy(wide, TRUTH, 0.01, 5)
    points = tuple(replace(m, torque=m.torque * stray.get(i, 1.0)) for i, m in enumerate(basis.measurements))
    basis = replace(basis, measurements=points)
    found = point_diagnostics(basis, fit_values(basis, 3, "least_squares"), 3)
    assert found.outliers == sorted(stray)


def with_error(basis, i, size):
    """The basis with the torque of a point measured too high by a share."""
    points = tuple(
        replace(m, torque=m.torque * (1.0 + size * (j == i))) for j, m in enumerate(basis.measurements)
    )
    return replace(basis, measurements=points)


@pytest.mark.slow
def test_the_size_that_is_called_detectable_is_found_in_half_of_the_files(wide):
    """Nine points with 2 % scatter: an error of that size is at the bound, half of it or twice it is not."""
    nine = wide.subset([0, 2, 4, 6, 8, 10, 12, 14, 17])
    found = {0.3: 0, 2.0: 0}
    files = 20
    for seed in range(files):
        basis = noisy(nine, TRUTH, 0.02, seed)
        clean = point_diagnostics(basis, fit_values(basis, 3, "least_squares"), 3)
        i = seed % len(nine)
        assert clean.detectable[i] >= 0.03
        for share in found:
            moved = with_error(basis, i, share * min(clean.detectable[i], 1.0))
            limits = point_diagnostics(moved, fit_values(moved, 3, "least_squares"), 3)
            found[share] += bool(abs(limits.studentised[i]) > limits.limit)
    assert found[0.3] <= 2
    assert found[2.0] >= 15


@pytest.mark.slow
def test_good_points_are_rarely_outliers(wide):
    """One false alarm among 20 files by the studentised residuals, few more by the robust guard; binomial bound."""
    files = 60
    alarms = 0
    for seed in range(files):
        basis = noisy(wide, TRUTH, 0.02, seed)
        alarms += bool(point_diagnostics(basis, fit_values(basis, 3, "least_squares"), 3).outliers)
    assert alarms <= binom.ppf(0.999, files, 0.07)


def test_the_first_point_of_the_paper_is_an_outlier_for_a_smooth_film():
    assert point_diagnostics(BASIS, fit_values(BASIS, 2, "least_squares"), 2).outliers == [0]


def test_a_point_without_a_check_is_reported():
    points = [MEASURED[0]] * 6 + [MEASURED[8]]
    basis = noisy(basis_of(points), (8.0, 0.004, 0.0), 0.01, 1)
    found = point_diagnostics(basis, fit_values(basis, 2, "least_squares"), 2)
    assert found.unchecked == [6]
    assert 6 not in found.outliers


def test_wide_and_precise_data_identify_everything(wide):
    basis = noisy(wide, TRUTH, 0.005, 3)
    smooth = Rival(
        "smooth",
        basis,
        fit_values(basis, 2, "least_squares"),
        np.abs(left_out_deviations(basis, 2, "least_squares")),
    )
    assert predicts_better(np.abs(left_out_deviations(basis, 3, "least_squares")), smooth.left_out)
    assert identified(basis, 3, [smooth]) == {}
    assert condition(basis, fit_values(basis, 3, "least_squares"), 3) < 10.0


def test_the_tables_identify_neither_height_nor_split():
    two = fit_values(BASIS, 2, "least_squares")
    smooth = Rival("smooth", BASIS, two, np.abs(left_out_deviations(BASIS, 2, "least_squares")))
    found = identified(BASIS, 3, [smooth])
    assert "correlation 0.98 with net_sliding_coefficient" in found[HEIGHT]
    assert "0 nm in the fit smooth, not significantly worse at left-out points" in found[HEIGHT]
    assert f"{100.0 * sliding_share(BASIS, two[1]):.0f} % in the fit smooth" in found[SPLIT]
    # without the second fit the interval alone shows it for the height
    assert "95 % interval" in identified(BASIS, 3)[HEIGHT]


def test_one_speed_identifies_no_split():
    basis = noisy(BASIS.subset(range(6)), (8.0, 0.004, 0.0), 0.03, 4)
    found = identified(basis, 2)
    assert set(found) == {RATIO, NET, SPLIT}
    assert "correlation -0.99 with apparent_viscosity_ratio" in found[NET]


def test_equal_predictions_are_not_reported_as_better():
    errors = np.array([0.01, 0.02, 0.005, 0.03, 0.01, 0.02])
    assert not predicts_better(errors, errors)
    assert not predicts_better(errors, 0.5 * errors)
    assert predicts_better(0.5 * errors, errors)
    # never with five points
    assert not predicts_better(0.5 * errors[:5], errors[:5])
