"""Surface speeds: printed values of the published model, worked values and limits of the rolling frame."""

import math

import numpy as np
import pytest
from reference_screw import GD4008, published_rows

from ballscrew_tehl.hertz import E_prime, ellipse, reduced_radii
from ballscrew_tehl.kinematics import (
    cage_speed,
    entrainment_speed,
    heathcote_slip,
    roll_rate,
    spin_rates,
    surface_speeds,
)
from ballscrew_tehl.parameters import changed, load_parameters

RPM = math.pi / 30.0
SECTION_5 = {row["quantity"]: row for row in published_rows("zhao2023/section5_contact.csv")}


@pytest.mark.parametrize("raceway", ["screw", "nut"])
def test_published_speeds_give_the_printed_values(raceway):
    speeds = surface_speeds(GD4008, raceway, 3000 * RPM, "published")
    # the pairs carry 0.1 mm/s: half of it on each of two speeds
    assert 1e3 * speeds.u_e == pytest.approx(float(SECTION_5["entrainment_speed"][raceway]), abs=0.05)
    printed = float(SECTION_5["slide_roll_ratio"][raceway])
    assert abs(speeds.srr) == pytest.approx(printed, abs=0.1 / (1e3 * speeds.u_e))


def test_published_pairs_and_their_slip():
    screw = surface_speeds(GD4008, "screw", 3000 * RPM, "published")
    nut = surface_speeds(GD4008, "nut", 3000 * RPM, "published")
    assert (screw.u_1, screw.u_2) == (pytest.approx(5.7561, rel=1e-12), pytest.approx(2.9926, rel=1e-12))
    assert (nut.u_1, nut.u_2) == (pytest.approx(0.0447, rel=1e-12), pytest.approx(3.0386, rel=1e-12))
    assert screw.friction_slip == pytest.approx(5.7561 - 2.9926, rel=1e-12)
    # the sign of the slide-to-roll ratio is kept: on the nut the ball is the faster body
    assert nut.srr < 0.0 < nut.friction_slip


def test_published_is_what_the_packaged_parameters_name():
    assert surface_speeds(GD4008, "nut", 7.0) == surface_speeds(GD4008, "nut", 7.0, "published")
    other = changed(GD4008, friction={"kinematics": "rolling_frame"})
    assert surface_speeds(other, "nut", 7.0) == surface_speeds(GD4008, "nut", 7.0, "rolling_frame")


@pytest.mark.parametrize(("rpm", "u_e"), [(100, 0.10398), (1000, 1.03977), (3000, 3.11932)])
@pytest.mark.parametrize("raceway", ["screw", "nut"])
def test_rolling_frame_entrainment(raceway, rpm, u_e):
    speeds = surface_speeds(GD4008, raceway, rpm * RPM, "rolling_frame")
    assert speeds.u_e == pytest.approx(u_e, abs=1.0e-5)
    assert speeds.u_1 == speeds.u_2 == speeds.u_e
    assert speeds.srr == 0.0
    assert speeds.friction_slip == pytest.approx(0.02 * speeds.u_e, rel=1e-12)


def test_rolling_facts():
    screw, w = GD4008.screw, 1000 * RPM
    assert entrainment_speed(screw, 1.0) == pytest.approx(9.92911e-3, abs=0.5e-8)
    assert cage_speed(screw, 1.0, "nut") == pytest.approx(0.45790, abs=0.5e-5)
    # with the other part fixed the balls do the other share of the turn
    assert cage_speed(screw, 1.0, "nut") + cage_speed(screw, 1.0, "screw") == pytest.approx(1.0, rel=1e-15)
    assert roll_rate(screw, 1.0) == pytest.approx(4.16927, abs=0.5e-5)
    assert roll_rate(screw, w) == pytest.approx(436.60, abs=0.01)


def test_exact_helix():
    screw = GD4008.screw
    assert entrainment_speed(screw, 1.0, helix=True) == pytest.approx(9.9498e-3, abs=1e-7)
    assert cage_speed(screw, 1.0, helix=True) == pytest.approx(0.45807, abs=0.5e-5)


def test_raceways_roll_without_slip():
    """Both raceway speeds relative to the ball centre are the entrainment speed, from the definition."""
    screw = GD4008.screw
    g = 0.5 * screw.ball_diameter * math.cos(screw.contact_angle) / screw.nominal_radius
    assert g == pytest.approx(0.084199, abs=0.5e-6)
    w, w_c = 2.0, cage_speed(screw, 2.0)
    u_e = entrainment_speed(screw, w)
    assert screw.nominal_radius * (1 - g) * (w - w_c) == pytest.approx(u_e, rel=1e-14)
    assert screw.nominal_radius * (1 + g) * w_c == pytest.approx(u_e, rel=1e-14)


def test_spin():
    screw, w = GD4008.screw, 1000 * RPM
    for split in ("equal", "screw_control", "nut_control"):
        assert sum(spin_rates(screw, w, split)) == pytest.approx(74.05, abs=0.005)
    roll = roll_rate(screw, w)
    assert [rate / roll for rate in spin_rates(screw, w, "screw_control")] == pytest.approx(
        [0, 0.1696], abs=5e-5
    )
    assert [rate / roll for rate in spin_rates(screw, w, "nut_control")] == pytest.approx(
        [0.1696, 0], abs=5e-5
    )
    assert [rate / roll for rate in spin_rates(screw, w)] == pytest.approx([0.0848, 0.0848], abs=5e-5)


def test_slip_across_the_ellipse_at_1000_N():
    screw, w = GD4008.screw, 1000 * RPM
    a = {
        name: ellipse(16.48, *reduced_radii(screw, screw.contact_angle, name), E_prime(screw)).a
        for name in ("screw", "nut")
    }
    assert heathcote_slip(screw, "screw", a["screw"]) == pytest.approx(0.00743, abs=0.5e-5)
    assert heathcote_slip(screw, "nut", a["nut"]) == pytest.approx(0.00611, abs=0.5e-5)
    edge = a["screw"] * spin_rates(screw, w, "nut_control")[0]
    assert edge == pytest.approx(0.0208, abs=0.5e-4)
    assert edge / entrainment_speed(screw, w) == pytest.approx(0.020, abs=0.5e-3)


def test_no_spin_without_contact_angle_component():
    flat = changed(GD4008, screw={"contact_angle": 1e-6}).screw
    assert sum(spin_rates(flat, 1.0)) == pytest.approx(1e-6, rel=1e-9)


@pytest.mark.parametrize("kinematics", ["published", "rolling_frame"])
def test_array_equals_scalar_and_speeds_are_odd(kinematics):
    w = np.array([-3.0, 0.0, 3.0, 314.0])
    together = surface_speeds(GD4008, "screw", w, kinematics)
    for i, speed in enumerate(w):
        assert [field[i] for field in together] == list(surface_speeds(GD4008, "screw", speed, kinematics))
    assert together.u_e[0] == -together.u_e[2]
    assert together.srr[0] == together.srr[1] == together.srr[2]
    assert np.all(together.friction_slip >= 0.0)


def test_bad_input():
    with pytest.raises(ValueError, match="allowed: published, rolling_frame"):
        surface_speeds(GD4008, "screw", 1.0, "rolling")
    for kinematics in ("published", "rolling_frame"):
        with pytest.raises(ValueError, match="allowed: screw, nut"):
            surface_speeds(GD4008, "ball", 1.0, kinematics)
    for speed in (math.nan, math.inf):
        with pytest.raises(ValueError, match="needs finite"):
            surface_speeds(GD4008, "screw", speed)
    with pytest.raises(ValueError, match="equal, screw_control, nut_control"):
        spin_rates(GD4008.screw, 1.0, "half")


def test_another_screw_has_no_published_speeds(tmp_path):
    from importlib import resources

    with resources.as_file(resources.files("ballscrew_tehl") / "data" / "example_25x10.toml") as path:
        example = load_parameters(path)
    with pytest.raises(ValueError, match="use rolling_frame"):
        surface_speeds(example, "screw", 1.0, "published")
    assert surface_speeds(example, "screw", 1.0).u_e > 0.0
