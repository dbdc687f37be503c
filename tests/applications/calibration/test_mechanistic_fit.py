"""Fits of the mechanistic law: one number or two, their errors, what the data identify, the packaged set."""

import numpy as np
import pytest
from law_contacts import VG100, ClosedContacts

from ballscrew_tehl.applications.calibration.fit import fit_values, torque_basis
from ballscrew_tehl.applications.calibration.measured import calibrate
from ballscrew_tehl.applications.calibration.measured_screw import packaged_measurements
from ballscrew_tehl.friction.mechanistic import nut_powers
from ballscrew_tehl.friction.sets import default_friction_set, load_friction_sets
from ballscrew_tehl.parameters.file import PACKAGED_DATA, changed, load_screw
from ballscrew_tehl.physics.load import nut_loads

K = 0.0113
MEASURED = packaged_measurements(303.0)
CONTACTS = ClosedContacts()
BASIS = torque_basis(VG100, CONTACTS, MEASURED)


def test_basis_is_the_torque_of_two_nuts():
    for m, found in zip(MEASURED, BASIS.torque((1.3, K, 0.0)), strict=True):
        loads = nut_loads(VG100.screw, m.preload, VG100.screw.loaded_ball_count)
        nut = nut_powers(VG100, loads, m.speed, m.temperature, CONTACTS)
        assert found == pytest.approx(2.0 * nut.torque(1.3, K), rel=1e-12)


def test_one_number_is_the_weighted_mean_of_the_rest():
    rest = BASIS.measured - BASIS.torque((1.0, 0.0, 0.0))
    over = BASIS.sliding / BASIS.measured
    expected = float(np.sum(rest / BASIS.measured * over) / np.sum(over**2))
    ratio, found, height = fit_values(BASIS)
    assert (ratio, height) == (1.0, 0.0)
    assert found == pytest.approx(expected, rel=1e-12)


def test_between_spacer_balls_no_torque_determines_the_number():
    spaced = changed(VG100, screw={"spacer_balls": True, "ball_count": 36, "loaded_ball_count": 36})
    with pytest.raises(ValueError, match="nothing slides, so there is no number to fit"):
        calibrate(MEASURED[0], spaced)


def test_packaged_number_is_that_of_its_screw_and_carried_over_to_others():
    packaged = load_friction_sets()["mechanistic"]
    assert default_friction_set(VG100) == packaged
    assert packaged.values[0] == 1.0
    # what docs/validation.md states; 4, 12 and 6 % were wanted
    assert packaged.errors["mean"] <= 0.06
    assert packaged.errors["max"] <= 0.155
    assert np.max([found["mean"] for found in packaged.leave_one_table_out.values()]) <= 0.125
    screw = load_screw(PACKAGED_DATA / "example_25x10.toml")
    found = default_friction_set(screw)
    assert (found.values, found.errors, found.limits) == (packaged.values, {}, {})
    assert found.provenance == f"carried over from GD4008-3: {packaged.provenance}"
    thrust = {"ball_thrust": 0.5, "boundary_friction": 0.1}
    found = default_friction_set(changed(screw, friction=thrust))
    assert found.net_sliding_coefficient == pytest.approx(2.0 * 0.1 * 0.05 * 0.5, rel=1e-12)
    with pytest.raises(
        ValueError, match=r"ball_thrust = 0\.5; allowed: no entry with net_sliding_coefficient"
    ):
        default_friction_set(changed(screw, friction=thrust | {"net_sliding_coefficient": 0.01}))
