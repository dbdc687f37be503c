"""A caged ball bearing by the mechanistic law: its parts in closed form, the atlas against solves, refusals."""

import math

import pytest
from scipy.special import ellipe

from ballscrew_tehl.applications.bearing import bearing
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.kinematics import entrainment_speed

ANGULAR = {
    "pitch_diameter": 60e-3, "ball_diameter": 12.303e-3, "balls": 14, "contact_angle": math.radians(40.0),
    "inner_conformity": 0.52, "outer_conformity": 0.52,
}  # fmt: skip
THRUST = ANGULAR | {"contact_angle": 0.5 * math.pi}
WARM = 313.15


def contacts(of, load):
    """Hertz contacts of a right contact angle."""
    screw = of.parameters.screw
    for raceway in RACEWAYS:
        yield ellipse(load, *reduced_radii(screw, screw.contact_angle, raceway), E_prime(screw))


def test_parts_sum_to_the_total_inside_its_interval():
    found = bearing(**ANGULAR).torque(1000.0, 100.0, WARM)
    assert found.rolling + found.sliding + found.hysteresis == pytest.approx(found.total, rel=1e-12)
    assert found.low < found.total < found.high
    # a stated constant is known
    known = bearing(**ANGULAR, friction={"supply_length": 6.0}).torque(1000.0, 100.0, WARM)
    assert known.total == pytest.approx(found.total, rel=1e-12)
    assert known.high / known.low < 0.95 * found.high / found.low


def test_hysteresis_and_spin_of_a_thrust_bearing_in_closed_form():
    """Rough enough, asperities carry all: both raceways spin at half the speed with 3/8 mu Q a E of a Hertz contact."""
    mu, load, speed = 0.12, 200.0, 10.0
    wide = THRUST | {"inner_conformity": 1.0, "outer_conformity": 1.0}
    rough = bearing(**wide, friction={"boundary_friction": mu, "roughness_height": 5e-5})
    found = rough.torque(14 * load, speed, WARM)
    spin = sum(0.375 * mu * load * c.a * ellipe(1.0 - (c.b / c.a) ** 2) * 0.5 for c in contacts(rough, load))
    # slip by the curvature of the contact is small beside it; the core has the load of Hertz within a per cent
    assert found.sliding == pytest.approx(14 * spin, rel=0.01)
    screw = rough.parameters.screw
    u = entrainment_speed(screw, 1.0)
    lost = sum(3.0 / 16.0 * 0.01 * load * c.b / (0.5 * screw.ball_diameter) for c in contacts(rough, load))
    assert found.hysteresis == pytest.approx(14 * u * lost, rel=1e-4)


REFUSED = {
    "pitch_diameter": 60.0, "ball_diameter": 0.0, "balls": 16, "contact_angle": 40.0, "inner_conformity": 0.5,
    "outer_conformity": math.nan, "iso_vg": 69, "friction": {"supply_length": 1.0},
}  # fmt: skip


def test_refused_geometry_constants_and_points():
    """A groove flatter than the raceway: the ellipse would be longer along rolling, which no formula covers."""
    for name, value in REFUSED.items():
        with pytest.raises(ValueError, match=name) as found:
            bearing(**{**ANGULAR, name: value})
        assert "\n" not in str(found.value)
    for name in ("net_sliding_coefficient", "supply"):
        with pytest.raises(ValueError, match=f"friction = {name}; "):
            bearing(**ANGULAR, friction={name: 0.01})
    points = {"axial_load": (0.0, 1.0, WARM), "speed": (1.0, math.nan, WARM), "temperature": (1.0, 1.0, 40.0)}
    for name, point in points.items():
        with pytest.raises(ValueError, match=f"{name} = "):
            bearing(**ANGULAR).torque(*point)
    wide = ANGULAR | {"contact_angle": 0.1, "inner_conformity": 2.0, "outer_conformity": 2.0}
    with pytest.raises(ValueError, match="outer_conformity = 2"):
        bearing(**wide | {"ball_diameter": 25e-3, "balls": 6})
