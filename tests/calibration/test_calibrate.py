"""Fits, intervals, leave-one-out: hand-checked numbers, synthetic data, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from closed_film import HamrockDowsonFilm
from law_contacts import ClosedContacts
from reference_screw import GD4008
from section7 import BASIS, MEASURED, basis_of

from ballscrew_tehl.calibration.fit import LOSSES
from ballscrew_tehl.calibration.packaged import PACKAGED_LOSS, calibrate_packaged, fit_friction_set
from ballscrew_tehl.friction.sets import FITTED, load_friction_sets

RATIO, NET, HEIGHT = FITTED


def test_fits_against_hand_calculation():
    """Value and half interval of ratio, net coefficient, height [nm]; errors in per cent, to the digits stated."""
    for name, values, halves, errors in (
        ("two_parameter", (8.76, 0.00372, 0.0), (0.66, 0.00032), (1.72, 2.02, 9.5)),
        ("three_parameter", (7.62, 0.00506, 24e-9), (0.58, 0.00068, 14e-9), (1.24, 1.99, 7.7)),
    ):
        found = fit_friction_set(BASIS, GD4008, "hamrock_dowson", name)
        digits = (0.005, 0.000005, 0.5e-9)
        assert [abs(a - b) <= d for a, b, d in zip(found.values, values, digits, strict=True)] == [True] * 3
        for key, half, d in zip(FITTED, halves, digits, strict=False):
            assert abs(found.intervals[key] - half) <= d
        names = ("mean", 0.005), ("leave_one_out_mean", 0.005), ("leave_one_out_max", 0.05)
        for (key, d), error in zip(names, errors, strict=True):
            assert abs(100.0 * found.errors[key] - error) <= d
    assert round(found.correlations[f"{NET}, {HEIGHT}"], 2) == 0.98


def test_jacobian_is_the_derivative_of_weighted_errors():
    basis = replace(BASIS, measurements=tuple(replace(m, weight=0.5 + i) for i, m in enumerate(MEASURED)))
    values = np.array([7.6, 0.005, 24e-9])
    numeric = np.empty((len(basis), 3))
    for i in range(3):
        step = np.zeros(3)
        step[i] = 1e-5 * values[i]
        numeric[:, i] = (basis.errors(values + step) - basis.errors(values - step)) / (2 * step[i])
    np.testing.assert_allclose(basis.jacobian(values), numeric, rtol=1e-7)


def test_what_cannot_be_fitted_is_refused():
    for points, loss, message in (
        (MEASURED[:2], "least_squares", "2 distinct points; 2 fitted parameters need at least 3"),
        ([MEASURED[0]] * 5, "least_squares", "measure at several speeds"),
        (MEASURED, "absolute", "loss = 'absolute'; allowed: least_squares, soft_l1"),
    ):
        with pytest.raises(ValueError, match=message):
            fit_friction_set(basis_of(points), GD4008, "hamrock_dowson", "two_parameter", loss)


@pytest.mark.slow
def test_packaged_calibration_writes_what_it_returns(tmp_path):
    path = tmp_path / "sets.toml"
    sets = calibrate_packaged(
        lambda variant, name: ClosedContacts() if name == "mechanistic" else HamrockDowsonFilm(variant),
        path=path,
    )
    found = load_friction_sets(path)
    assert set(found) == set(sets) == set(load_friction_sets())
    for key, entry in sets.items():
        np.testing.assert_allclose(found[key].values, entry.values, rtol=1e-5)
        assert found[key].loss == entry.loss == PACKAGED_LOSS[key[1]]
        others = [loss for loss in LOSSES if loss != entry.loss]
        assert list(entry.other_losses) == list(found[key].other_losses) == others
        if key[0] == "published":
            # the films of the test basis differ by the loaded contact angle, below 2 %
            squares = fit_friction_set(BASIS, GD4008, "", key[1]).errors["mean"]
            assert entry.other_losses["least_squares"]["mean"] == pytest.approx(squares, abs=2e-3)
