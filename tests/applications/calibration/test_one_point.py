"""Calibration on one torque: round trip, interval around the point, torques that are refused."""

import math
from dataclasses import replace

import pytest
from law_contacts import VG100, ClosedContacts

from ballscrew_tehl.applications.calibration.measured import calibrate_point
from ballscrew_tehl.applications.calibration.measurements import Measurement, read_measurement_file
from ballscrew_tehl.applications.calibration.written_sets import write_friction_sets
from ballscrew_tehl.friction.interval import (
    DEVIATIONS,
    KNOWN_ERROR,
    LEFT_OUT,
    SCATTER_DEVIATION,
    OperatingPoint,
    torque_interval,
)
from ballscrew_tehl.friction.mechanistic import double_nut_parts
from ballscrew_tehl.friction.sets import (
    carried_over,
    friction_set_of_file,
    load_friction_sets,
    refuse_other_fit,
)
from ballscrew_tehl.parameters.file import changed, graded_oil
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.runtime.packed import MapError

CONTACTS = ClosedContacts()
K = 0.0113
PLACE = OperatingPoint(1500.0, 300.0 * RPM, 310.0)


def torque_at(preload, speed, temperature, coefficient):
    return double_nut_parts(VG100, [preload] * 2, CONTACTS, speed, temperature, 1.0, coefficient).total


TORQUE = torque_at(*PLACE[:3], K)


def test_coefficient_comes_back_and_the_interval_is_narrow_at_the_point_and_wider_away(tmp_path):
    found = calibrate_point(Measurement(*PLACE[:3], TORQUE), VG100, CONTACTS).friction_set
    assert found.net_sliding_coefficient == pytest.approx(K, rel=1e-12)
    write_friction_sets(tmp_path / "fit.toml", [found])
    read = friction_set_of_file(tmp_path / "fit.toml", VG100)
    here = torque_interval(VG100, PLACE, CONTACTS, read)
    assert here.torque == pytest.approx(TORQUE, rel=1e-5)
    scatter = load_friction_sets()["mechanistic"].errors["leave_one_out_mean"]
    free = torque_interval(VG100, PLACE, CONTACTS, replace(read, learned={}))
    variance = (math.log(free.high / free.low) / 2.0 / DEVIATIONS) ** 2
    # the torque is known to KNOWN_ERROR
    left = variance * KNOWN_ERROR**2 / (variance + KNOWN_ERROR**2)
    wide = 2.0 * DEVIATIONS * math.sqrt(left + (SCATTER_DEVIATION * scatter) ** 2)
    assert math.log(here.high / here.low) == pytest.approx(wide, rel=1e-4)
    away = OperatingPoint(5000.0, 2500.0 * RPM, 310.0)
    there = torque_interval(VG100, away, CONTACTS, read)
    assert math.log(there.high / there.low) > wide
    free = torque_interval(VG100, away, CONTACTS, replace(read, learned={}))
    assert there.high / there.low < free.high / free.low
    assert there.shares[LEFT_OUT] < 1.0


@pytest.mark.parametrize("of", ["torque", "preload"])
def test_a_sheet_with_a_tolerance_holds_it_in_its_oil_and_in_another_or_a_grease(of):
    limits = (0.75 * TORQUE, 1.25 * TORQUE)
    stated = {"torque": {"limits": limits}, "preload": {"preload_tolerance": 0.25}}[of]
    found = calibrate_point(Measurement(*PLACE[:3], TORQUE, **stated), VG100, CONTACTS).friction_set
    ends = (
        limits
        if of == "torque"
        else [torque_at((1.0 + side) * PLACE[0], *PLACE[1:3], K) for side in (-0.25, 0.25)]
    )
    thin = VG100.model_copy(update={"lubricant": graded_oil(68, 95.0)})
    widths = []
    greased = changed(VG100, lubricant={"nlgi": "2"})
    for parameters, note in ((VG100, ""), (thin, "in another oil"), (greased, "in another oil or grease")):
        refuse_other_fit(found, parameters)
        assert note in carried_over(found, parameters)
        here = torque_interval(parameters, PLACE, CONTACTS, found)
        widths.append(here.high / here.low)
    assert ends[1] / ends[0] <= widths[0] <= 1.05 * ends[1] / ends[0]
    # what is not known of the other oil counts, less than without a fit
    free = torque_interval(thin, PLACE, CONTACTS, replace(found, learned={}))
    assert all(widths[0] < width < free.high / free.low for width in widths[1:])
    with pytest.raises(MapError, match="other sizes or bodies than this screw file"):
        refuse_other_fit(found, changed(VG100, screw={"lead": 0.0081}))


REFUSED = [
    (100.0 * TORQUE, "N.cm"), (10.0 * TORQUE, "kgf.cm"), (1000.0 * TORQUE, "N.mm"), (1e5 * TORQUE, "check unit"),
    (0.99 * torque_at(*PLACE[:3], 0.0), "check unit, preload"), (math.nan, "nan N.m"),
]  # fmt: skip


def test_torques_far_from_the_law_are_refused_with_their_unit():
    for torque, text in REFUSED:
        with pytest.raises(ValueError, match="times that of the law; allowed: ") as error:
            calibrate_point(Measurement(*PLACE[:3], torque), VG100, CONTACTS)
        assert text in str(error.value)


def test_a_row_states_its_tolerance_or_both_ends(tmp_path):
    path, head = tmp_path / "sheet.csv", "preload [N], speed [r/min], torque_low [N.m], torque_high [N.m]"
    for text, limits in (
        ("preload [N], speed [r/min], torque [N.m], torque_tolerance [%]\n1000, 100, 0.4, 25\n", (0.3, 0.5)),
        (f"{head}\n1000, 100, 0.3, 0.5\n", (0.3, 0.5)),
        (f"{head}\n1000, -100, -0.3, -0.5\n", (0.3, 0.5)),
    ):
        path.write_text(text)
        (m,) = read_measurement_file(path, 303.15).measurements
        assert m.torque == pytest.approx(0.4, rel=1e-12)
        assert m.limits == pytest.approx(limits, rel=1e-12)
    for text, told in (
        (f"{head}\n1000, 100, 0.5, 0.3\n", "torque_low = 0.5 N.m; allowed: up to torque_high"),
        (f"{head}, torque_tolerance [%]\n1000, 100, 0.3, 0.5, 25\n", "without torque_tolerance"),
        ("preload [N], speed [r/min], torque [N.m], torque_tolerance [%]\n1000, 100, 0.4, 99\n", "0 to 95"),
    ):
        path.write_text(text)
        (problem,) = read_measurement_file(path, 303.15).problems
        assert told in problem.reason
