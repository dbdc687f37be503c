"""Surface speeds: printed values of the published model, worked values and limits of the rolling frame."""

import math

import pytest
from reference_screw import GD4008, published_rows

from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.kinematics import cage_speed, entrainment_speed, surface_speeds

RPM = math.pi / 30.0
ROLLING = changed(GD4008, friction={"kinematics": "rolling_frame"})
SECTION_5 = {row["quantity"]: row for row in published_rows("zhao2023/section5_contact.csv")}


def test_published_speeds_give_the_printed_values():
    for raceway in ["screw", "nut"]:
        speeds = surface_speeds(GD4008, raceway, 3000 * RPM)
        # the pairs carry 0.1 mm/s: half of it on each of two speeds
        assert 1e3 * speeds.u_e == pytest.approx(float(SECTION_5["entrainment_speed"][raceway]), abs=0.05)
        printed = float(SECTION_5["slide_roll_ratio"][raceway])
        assert abs(speeds.srr) == pytest.approx(printed, abs=0.1 / (1e3 * speeds.u_e))


def test_rolling_frame_entrainment():
    for rpm, u_e in [(100, 0.10398), (1000, 1.03977), (3000, 3.11932)]:
        for raceway in ["screw", "nut"]:
            speeds = surface_speeds(ROLLING, raceway, rpm * RPM)
            assert speeds.u_e == pytest.approx(u_e, abs=1.0e-5)
            assert speeds.u_1 == speeds.u_2 == speeds.u_e
            assert speeds.srr == 0.0


def test_raceways_roll_without_slip():
    """Both raceway speeds relative to the ball centre are the entrainment speed, from the definition."""
    screw = GD4008.screw
    g = 0.5 * screw.ball_diameter * math.cos(screw.contact_angle) / screw.nominal_radius
    assert g == pytest.approx(0.084199, abs=0.5e-6)
    w, w_c = 2.0, cage_speed(screw, 2.0)
    u_e = entrainment_speed(screw, w)
    assert screw.nominal_radius * (1 - g) * (w - w_c) == pytest.approx(u_e, rel=1e-14)
    assert screw.nominal_radius * (1 + g) * w_c == pytest.approx(u_e, rel=1e-14)


def test_bad_input():
    for parameters in (GD4008, ROLLING):
        with pytest.raises(ValueError, match="allowed: screw, nut"):
            surface_speeds(parameters, "ball", 1.0)
