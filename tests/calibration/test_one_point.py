"""Calibration on one torque: round trip, interval around the point, torques that are refused."""

import math
from dataclasses import replace

import pytest
from law_contacts import VG100, ClosedContacts

from ballscrew_tehl.calibration.measured import calibrate_point
from ballscrew_tehl.calibration.measurements import Measurement
from ballscrew_tehl.friction.interval import (
    DEVIATIONS,
    KNOWN_ERROR,
    LEFT_OUT,
    SCATTER_DEVIATION,
    torque_interval,
)
from ballscrew_tehl.friction.mechanistic import double_nut_parts
from ballscrew_tehl.friction.sets import friction_set_of_file, load_friction_sets, write_friction_sets
from ballscrew_tehl.parameters.units import RPM

CONTACTS = ClosedContacts()
K = 0.0113
PLACE = 1500.0, 300.0 * RPM, 310.0


def torque_at(preload, speed, temperature, coefficient):
    return double_nut_parts(VG100, [preload] * 2, CONTACTS, speed, temperature, 1.0, coefficient).total


TORQUE = torque_at(*PLACE, K)


def test_coefficient_comes_back_and_the_interval_is_narrow_at_the_point_and_wider_away(tmp_path):
    found = calibrate_point(Measurement(*PLACE, TORQUE), VG100, CONTACTS).friction_set
    assert found.net_sliding_coefficient == pytest.approx(K, rel=1e-12)
    write_friction_sets(tmp_path / "fit.toml", [found])
    read = friction_set_of_file(tmp_path / "fit.toml", VG100)
    here = torque_interval(VG100, [PLACE[0]] * 2, CONTACTS, *PLACE[1:], read)
    assert here.torque == pytest.approx(TORQUE, rel=1e-5)
    scatter = load_friction_sets()["mechanistic"].errors["leave_one_out_mean"]
    free = torque_interval(VG100, [PLACE[0]] * 2, CONTACTS, *PLACE[1:], replace(read, learned={}))
    variance = (math.log(free.high / free.low) / 2.0 / DEVIATIONS) ** 2
    # the torque is known to KNOWN_ERROR
    left = variance * KNOWN_ERROR**2 / (variance + KNOWN_ERROR**2)
    wide = 2.0 * DEVIATIONS * math.sqrt(left + (SCATTER_DEVIATION * scatter) ** 2)
    assert math.log(here.high / here.low) == pytest.approx(wide, rel=1e-4)
    there = torque_interval(VG100, [5000.0] * 2, CONTACTS, 2500.0 * RPM, 310.0, read)
    assert math.log(there.high / there.low) > wide
    free = torque_interval(VG100, 2 * [5e3], CONTACTS, 2500.0 * RPM, 310.0, replace(read, learned={}))
    assert there.high / there.low < free.high / free.low
    assert there.shares[LEFT_OUT] < 1.0


REFUSED = [
    (100.0 * TORQUE, "N.cm"), (10.0 * TORQUE, "kgf.cm"), (1000.0 * TORQUE, "N.mm"), (1e5 * TORQUE, "check unit"),
    (0.99 * torque_at(*PLACE, 0.0), "check unit, preload"), (math.nan, "nan N.m"),
]  # fmt: skip


def test_torques_far_from_the_law_are_refused_with_their_unit():
    for torque, text in REFUSED:
        with pytest.raises(ValueError, match="times that of the law; allowed: ") as error:
            calibrate_point(Measurement(*PLACE, torque), VG100, CONTACTS)
        assert text in str(error.value)
