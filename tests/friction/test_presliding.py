"""Travel of balls from rest to rolling, and the stiffness that follows from it."""

import pytest

from ballscrew_tehl.friction.presliding import (
    REACHED,
    TRAVEL,
    ball_travel,
    contact_half_width,
    presliding_angle,
    transition_travel,
)
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.runtime.standstill import presliding_step

SCREW = load_parameters().screw


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
