"""Surface speeds: printed values of the published model, worked values and limits of the rolling frame."""

import math
from importlib import resources

import numpy as np
import pytest
from reference_screw import GD4008, published_rows

from ballscrew_tehl.friction.parts import net_sliding_share
from ballscrew_tehl.parameters.file import changed, load_parameters
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


def sag(radius, distance):
    """Height of a circle over its tangent; a negative radius bends away."""
    return distance**2 / (radius * (1.0 + math.sqrt(1.0 - (distance / radius) ** 2)))


class RigidBodies:
    """Ball and raceways in space, in the frame that turns with the ball centre about the screw axis.

    Vectors have radial, tangential, axial components. What turns how fast follows from rolling on the lines
    y = +- line of each contact and the split of the spin; none of the closed forms is used. flank = -1: the
    other side of the groove, mirrored, with a right-handed contact frame again.
    """

    AXIS = np.array([0.0, 0.0, 1.0])

    def __init__(self, screw, split, flank=1, turning_part="screw", lines=(0.0, 0.0)):
        self.screw, self.r_b = screw, 0.5 * screw.ball_diameter
        self.centre = np.array([screw.nominal_radius, 0.0, 0.0])
        self.sides = {"screw": 1.0, "nut": -1.0}
        self.towards_ball = np.array(
            [math.cos(screw.contact_angle), 0.0, -flank * math.sin(screw.contact_angle)]
        )
        self.turns = {"screw": (W, 0.0), "nut": (0.0, -W)}[turning_part]

        def mismatch(unknowns):
            slips = [
                self.slip(unknowns, raceway, 0.0, line) + self.slip(unknowns, raceway, 0.0, -line)
                for raceway, line in zip(RACEWAYS, lines, strict=True)
            ]
            rates = [self.turning(unknowns, raceway) for raceway in RACEWAYS]
            on_screw, on_nut = (
                (self.frame(raceway) @ (ball - race))[2]
                for raceway, (race, ball) in zip(RACEWAYS, rates, strict=True)
            )
            return np.concatenate([*slips, [(1.0 - split) * on_screw - split * on_nut]])

        offset = mismatch(np.zeros(4))
        matrix = np.array([mismatch(unit) - offset for unit in np.eye(4)]).T
        self.solution = np.linalg.lstsq(matrix, -offset)[0]
        np.testing.assert_allclose(mismatch(self.solution), 0.0, atol=1e-11)

    def frame(self, raceway):
        """Rows x, y, z of the contact frame."""
        x = np.array([0.0, self.sides[raceway], 0.0])
        z = self.sides[raceway] * self.towards_ball
        return np.array([x, np.cross(z, x), z])

    def point(self, raceway, x, y, bent):
        """Point of the deformed contact, halfway between ball and groove; bent along rolling too or not."""
        race = (self.screw.nominal_radius / math.cos(self.screw.contact_angle)) - self.sides[
            raceway
        ] * self.r_b
        groove = getattr(self.screw, f"{raceway}_raceway_radius")
        height = 0.5 * (sag(self.r_b, y) + sag(groove, y))
        if bent:
            height += 0.5 * (sag(self.r_b, x) + sag(-self.sides[raceway] * race, x))
        return self.centre + np.array([x, y, height - self.r_b]) @ self.frame(raceway)

    def turning(self, unknowns, raceway):
        """Angular velocities of raceway and ball."""
        return (self.turns[RACEWAYS.index(raceway)] - unknowns[0]) * self.AXIS, unknowns[1:]

    def velocities(self, raceway, x, y, bent=False, unknowns=None):
        """(u_1, v_1), (u_2, v_2)."""
        race, ball = self.turning(self.solution if unknowns is None else unknowns, raceway)
        point = self.point(raceway, x, y, bent)
        frame = self.frame(raceway)[:2]
        return frame @ np.cross(race, point), frame @ np.cross(ball, point - self.centre)

    def slip(self, unknowns, raceway, x, y):
        v_1, v_2 = self.velocities(raceway, x, y, unknowns=unknowns)
        return v_1 - v_2


EXAMPLE = load_parameters(resources.files("ballscrew_tehl") / "data" / "example_25x10.toml")
STEEP = changed(GD4008, screw={"contact_angle": 1.0})


def test_slip_field_is_that_of_rigid_bodies_in_space():
    for split in [*SPLITS, 0.3]:
        for parameters in [GD4008, STEEP, EXAMPLE]:
            for raceway in RACEWAYS:
                screw = parameters.screw
                field = slip_field(rolling(split, parameters), raceway, W, screw.contact_angle)
                u_e = entrainment_speed(screw, W)
                bodies = RigidBodies(screw, split)
                a, r_b = at_1000_N(screw, raceway).a, 0.5 * screw.ball_diameter
                errors = []
                for y in (a, -a, 0.5 * a, 0.0, -0.25 * a):
                    for x in (-0.2 * a, 0.0, 0.2 * a):
                        (u_1, v_1), (u_2, v_2) = bodies.velocities(raceway, x, y)
                        assert [v_1, v_2] == pytest.approx(
                            [field.spin_1 * x, field.spin_2 * x], abs=1e-13 * u_e
                        )
                        error_1 = u_1 - (u_e + field.differential_1 * y**2 - field.spin_1 * y)
                        error_2 = u_2 - (u_e + field.differential_2 * y**2 - field.spin_2 * y)
                        errors.append(max(abs(error_1), abs(error_2)) / u_e)
                        # next term of the circle's height
                        assert errors[-1] <= 0.13 * (y / r_b) ** 4 + 1e-13
                # rows of three: at y = a and at a/2
                assert errors[0] / errors[6] == pytest.approx(16.0, rel=0.02)


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
