"""Travel of balls from rest to rolling, and the stiffness that follows from it."""

import math

import pytest

from ballscrew_tehl.friction.presliding import (
    REACHED,
    TRAVEL,
    ball_travel,
    contact_half_width,
    presliding_angle,
    transition_travel,
)
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.runtime.standstill import presliding_step

SCREW = load_parameters().screw


def test_the_angle_grows_with_the_contact_width():
    one = presliding_angle(SCREW, 1.0)
    for force in (120.0, 2000.0, 12000.0):
        assert presliding_angle(SCREW, force) == pytest.approx(one * force ** (1.0 / 3.0), rel=1e-12)
    with pytest.raises(ValueError, match="force"):
        presliding_angle(SCREW, -1.0)


def test_a_ball_has_the_travel_when_the_bristle_has_reached_its_share():
    """The law itself, stepped from rest."""
    force, coulomb = 2000.0, 0.7
    stiffness = coulomb / presliding_angle(SCREW, force)
    deflection, angle, step = 0.0, 0.0, 1e-5
    while deflection * stiffness < REACHED * coulomb:
        deflection = presliding_step(deflection, 1.0, step, coulomb, stiffness, 0.0).deflection
        angle += step
    assert ball_travel(SCREW, angle) / contact_half_width(SCREW, force) == pytest.approx(TRAVEL, rel=2e-3)
    assert angle * stiffness / coulomb == pytest.approx(transition_travel(), rel=2e-3)


def test_loop_after_a_reversal():
    """From sliding to REACHED of sliding back: 4.7 half widths, by 1.6 the travel from rest.

    A rolling ball has a loop that closes and remembers inner loops (Masing), where this would be 2 (De Moerlooze &
    Al-Bender 2008): the bristle has one element and does not reproduce that.
    """
    coulomb = 0.7
    sliding = presliding_angle(SCREW, 2000.0)
    deflection, angle, step = sliding, 0.0, 1e-5
    while deflection > -REACHED * sliding:
        deflection = presliding_step(deflection, -1.0, step, coulomb, coulomb / sliding, 0.0).deflection
        angle += step
    assert ball_travel(SCREW, angle) / contact_half_width(SCREW, 2000.0) == pytest.approx(4.74, abs=0.01)


def test_the_screw_of_the_paper():
    """Estimate by hand: half width 46 um, a ball moves 0.46 of the screw's path; 5 to 9 mrad, 80 to 150 N.m/rad."""
    assert contact_half_width(SCREW, 2000.0) == pytest.approx(46e-6, rel=0.01)
    assert ball_travel(SCREW, 1.0) / SCREW.nominal_radius == pytest.approx(0.458, abs=1e-3)
    assert 5e-3 <= presliding_angle(SCREW, 2000.0) <= 9e-3
    nut_map = load_map(None, load_parameters())
    defaults = nut_map.defaults
    args = defaults.net_sliding_coefficient, defaults.breakaway_factor
    stiffness = nut_map.presliding_stiffness(2000.0, 0.0, *args)
    coulomb = nut_map.evaluate(2000.0, 1e-9, 303.15).coulomb_torque
    assert coulomb / stiffness == pytest.approx(presliding_angle(SCREW, 2000.0), rel=1e-6)
    assert stiffness == pytest.approx(79.2, abs=0.1)
    # both nuts at their own force: with an axial load between the stiffnesses at both
    relieved, loaded = nut_map._forces_point(2000.0, 1500.0)
    low, high = (nut_map.presliding_stiffness(force, 0.0, *args) for force in (relieved, loaded))
    assert nut_map.presliding_stiffness(2000.0, 1500.0, *args) == pytest.approx(0.5 * (low + high), rel=1e-12)
    assert nut_map.presliding_stiffness(0.0, 0.0, *args) == 0.0
    assert math.isfinite(nut_map.presliding_stiffness(1e9, -1e9, *args))
