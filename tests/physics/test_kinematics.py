"""Surface speeds: printed values of the published model, worked values and limits of the rolling frame."""

import math

import pytest
from reference_screw import GD4008, published_rows

from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.kinematics import cage_speed, entrainment_speed, surface_speeds

RPM = math.pi / 30.0
ROLLING = changed(GD4008, friction={"law": "mechanistic"})
SECTION_5 = {row["quantity"]: row for row in published_rows("zhao2023/section5_contact.csv")}


def test_published_speeds_give_the_printed_values():
    for raceway in ["screw", "nut"]:
        speeds = surface_speeds(GD4008, raceway, 3000 * RPM)
        # the pairs carry 0.1 mm/s: half of it on each of two speeds
        assert 1e3 * speeds.u_e == pytest.approx(float(SECTION_5["entrainment_speed"][raceway]), abs=0.05)
        printed = float(SECTION_5["slide_roll_ratio"][raceway])
        assert abs(speeds.srr) == pytest.approx(printed, abs=0.1 / (1e3 * speeds.u_e))


def test_raceways_roll_without_slip():
    """Both raceway speeds relative to the ball centre are the entrainment speed; 3000 r/min worked by hand."""
    screw, w = GD4008.screw, 3000.0 * RPM
    g = 0.5 * screw.ball_diameter * math.cos(screw.contact_angle) / screw.nominal_radius
    assert g == pytest.approx(0.084199, abs=0.5e-6)
    w_c, u_e = cage_speed(screw, w), entrainment_speed(screw, w)
    assert u_e == pytest.approx(3.11932, abs=1.0e-5)
    assert screw.nominal_radius * (1 - g) * (w - w_c) == pytest.approx(u_e, rel=1e-14)
    assert screw.nominal_radius * (1 + g) * w_c == pytest.approx(u_e, rel=1e-14)
    for raceway in ["screw", "nut"]:
        assert surface_speeds(ROLLING, raceway, w)[:2] == (u_e, u_e)
