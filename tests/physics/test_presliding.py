"""Travel of balls from rest to rolling, and the stiffness that follows from it."""

import pytest

from ballscrew_tehl.parameters.file import load_screw
from ballscrew_tehl.physics.stiffness import TRAVEL, ball_travel, contact_half_width, presliding_angle
from ballscrew_tehl.runtime.constants import ELEMENTS
from ballscrew_tehl.runtime.standstill import RELAXED, element_limits, presliding_step

SCREW = load_screw().screw


def test_a_ball_has_the_travel_when_all_elements_slide():
    """The law itself, stepped from rest; the last element slides half a piece of its curve earlier."""
    force, coulomb, step = 2000.0, 0.7, 1e-5
    stiffness = coulomb / presliding_angle(SCREW, force)
    states, angle, torque = RELAXED.states, 0.0, 0.0
    limits = element_limits(coulomb, stiffness)
    while torque < (1.0 - 1e-12) * coulomb:
        states, torque, _ = presliding_step(states, 1.0, step, coulomb, stiffness, 0.0, limits)
        angle += step
    travel = ball_travel(SCREW, angle / (1.0 - 0.5 / ELEMENTS)) / contact_half_width(SCREW, force)
    assert travel == pytest.approx(TRAVEL, rel=2e-3)
