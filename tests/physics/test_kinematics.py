"""Surface speeds: printed values of the published model, worked values and limits of the rolling frame."""

import math

import numpy as np
import pytest
from reference_screw import GD4008, published_rows

from ballscrew_tehl.friction.parts import net_sliding_share
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.kinematics import (
    FREE_ROLLING_POSITION,
    cage_speed,
    entrainment_speed,
    slip_field,
    surface_speeds,
)

RPM = math.pi / 30.0
W = 1000 * RPM
#: equal split, raceway control at the screw, at the nut
SPLITS = (0.5, 0.0, 1.0)
SECTION_5 = {row["quantity"]: row for row in published_rows("zhao2023/section5_contact.csv")}


def test_published_speeds_give_the_printed_values():
    for raceway in ["screw", "nut"]:
        speeds = surface_speeds(GD4008, raceway, 3000 * RPM, "published")
        # the pairs carry 0.1 mm/s: half of it on each of two speeds
        assert 1e3 * speeds.u_e == pytest.approx(float(SECTION_5["entrainment_speed"][raceway]), abs=0.05)
        printed = float(SECTION_5["slide_roll_ratio"][raceway])
        assert abs(speeds.srr) == pytest.approx(printed, abs=0.1 / (1e3 * speeds.u_e))


def test_rolling_frame_entrainment():
    for rpm, u_e in [(100, 0.10398), (1000, 1.03977), (3000, 3.11932)]:
        for raceway in ["screw", "nut"]:
            speeds = surface_speeds(GD4008, raceway, rpm * RPM, "rolling_frame")
            assert speeds.u_e == pytest.approx(u_e, abs=1.0e-5)
            assert speeds.u_1 == speeds.u_2 == speeds.u_e
            assert speeds.srr == 0.0
            assert speeds.friction_slip == pytest.approx(0.02 * speeds.u_e, rel=1e-12)


def test_raceways_roll_without_slip():
    """Both raceway speeds relative to the ball centre are the entrainment speed, from the definition."""
    screw = GD4008.screw
    g = 0.5 * screw.ball_diameter * math.cos(screw.contact_angle) / screw.nominal_radius
    assert g == pytest.approx(0.084199, abs=0.5e-6)
    w, w_c = 2.0, cage_speed(screw, 2.0)
    u_e = entrainment_speed(screw, w)
    assert screw.nominal_radius * (1 - g) * (w - w_c) == pytest.approx(u_e, rel=1e-14)
    assert screw.nominal_radius * (1 + g) * w_c == pytest.approx(u_e, rel=1e-14)


def rolling(split=0.5, parameters=GD4008):
    return changed(parameters, friction={"kinematics": "rolling_frame", "spin_split": split})


def fields(parameters, speed=W, angle=GD4008.screw.contact_angle):
    """Slip fields of screw and nut."""
    return [slip_field(parameters, raceway, speed, angle) for raceway in RACEWAYS]


def at_1000_N(screw, raceway):
    """Contact of one of 86 balls, contact angle as without load."""
    return ellipse(16.48, *reduced_radii(screw, screw.contact_angle, raceway), E_prime(screw))


def test_slip_across_the_ellipse_at_1000_N():
    u_e = entrainment_speed(GD4008.screw, W)
    a = {raceway: at_1000_N(GD4008.screw, raceway).a for raceway in RACEWAYS}
    on = dict(zip(RACEWAYS, fields(rolling(1.0)), strict=True))
    for raceway, expected in (("screw", 0.00743), ("nut", 0.00611)):
        parabola = on[raceway].differential_1 - on[raceway].differential_2
        assert parabola * a[raceway] ** 2 / u_e == pytest.approx(expected, abs=0.5e-5)
    edge = a["screw"] * (on["screw"].spin_2 - on["screw"].spin_1)
    assert edge == pytest.approx(0.0208, abs=0.5e-4)
    assert edge / u_e == pytest.approx(0.020, abs=0.5e-3)


def test_coulomb_friction_on_the_parabola_has_no_net_force_and_johnsons_resistance():
    nodes, weights = np.polynomial.legendre.leggauss(400)
    pressure = 0.75 * weights * (1.0 - nodes**2)
    slip = nodes**2 - FREE_ROLLING_POSITION**2
    assert net_sliding_share(FREE_ROLLING_POSITION) == pytest.approx(0.0, abs=1e-15)
    assert pressure @ np.sign(slip) == pytest.approx(0.0, abs=5e-3)
    # half of it is in the closed form: slip ratio (a^2/2 Rc R_x)(t^2 - c^2)
    assert 0.5 * pressure @ np.abs(slip) == pytest.approx(0.08057, abs=2e-5)


def test_bad_input():
    with pytest.raises(ValueError, match="allowed: published, rolling_frame"):
        surface_speeds(GD4008, "screw", 1.0, "rolling")
    for kinematics in ("published", "rolling_frame"):
        with pytest.raises(ValueError, match="allowed: screw, nut"):
            surface_speeds(GD4008, "ball", 1.0, kinematics)
    for speed in (math.nan, math.inf):
        with pytest.raises(ValueError, match="needs finite"):
            surface_speeds(GD4008, "screw", speed)
    for kinematics in ("published", "rolling_frame"):
        with pytest.raises(ValueError, match="allowed: screw, nut"):
            slip_field(GD4008, "ball", 1.0, 0.8, kinematics)
        with pytest.raises(ValueError, match="radians"):
            slip_field(GD4008, "nut", 1.0, 45.0, kinematics)
        with pytest.raises(ValueError, match="needs finite"):
            slip_field(GD4008, "nut", math.nan, 0.8, kinematics)
    with pytest.raises(ValueError, match="allowed: published, rolling_frame"):
        slip_field(GD4008, "nut", 1.0, 0.8, "rolling")


def test_spin():
    for split in SPLITS:
        spins = [field.spin_2 - field.spin_1 for field in fields(rolling(split))]
        assert sum(spins) == pytest.approx(74.05, abs=0.005)
        expected = [0.1696 * split, 0.1696 * (1.0 - split)]
        assert [spin / 436.60 for spin in spins] == pytest.approx(expected, abs=5e-5)


def test_signs_of_the_differential_part():
    on_screw, on_nut = fields(rolling())
    assert on_screw.differential_1 > 0.0 > on_nut.differential_1
    assert on_screw.differential_2 == pytest.approx(on_nut.differential_2, rel=1e-12)
    assert on_screw.differential_2 < 0.0
