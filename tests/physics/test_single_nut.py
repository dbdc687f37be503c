"""Single nuts: offset lead as a double nut in one piece; oversize balls between four flanks, with their limits."""

import math

import numpy as np
import pytest
from closed_film import HamrockDowsonFilm
from reference_screw import GD4008

from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.ball_law import contact_compliance, groove_distance
from ballscrew_tehl.physics.load import ball_oversize, ball_pitch, double_nut_loads

FOUR = changed(GD4008, screw={"preload_kind": "single_nut_oversize_ball"})
OFFSET = changed(GD4008, screw={"preload_kind": "single_nut_offset"})
SCREW, BETA = FOUR.screw, FOUR.screw.contact_angle
FRICTION = FrictionSet("three_parameter", 7.0, 0.005, 3e-8)


def test_offset_lead_is_the_double_nut_of_the_same_turns_per_side():
    for axial_load in [0.0, 1500.0, -4000.0, 9000.0]:
        same = changed(OFFSET, screw={"spacer_length": GD4008.screw.spacer_length})
        found, expected = (double_nut_loads(p.screw, 2000.0, axial_load, 86) for p in (same, GD4008))
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(one, other)
        film = [HamrockDowsonFilm(p) for p in (same, GD4008)]
        torques = [
            double_nut_torque(p, FRICTION, f, 2000.0, 50.0, 303.0, axial_load)
            for p, f in zip((same, GD4008), film, strict=True)
        ]
        assert torques[0] == torques[1]


def test_chain_of_balls_obeys_the_recurrence():
    """d(k+1) - 2 d(k) + d(k-1) = K f(d(k)) with the net force of all balls, from the loads alone."""
    state, mirrored = (double_nut_loads(SCREW, 2000.0, load, 86) for load in (3000.0, -3000.0))
    np.testing.assert_allclose(mirrored.Q_a, state.Q_b, rtol=1e-9, atol=1e-9)
    # of the groove centres: radial distance, which stays, and axial one without load
    apart = groove_distance(SCREW) + ball_oversize(SCREW, 2000.0, 86)
    x, y_0 = apart * math.cos(BETA), apart * math.sin(BETA)
    loads = np.array([state.Q_b, state.Q_a])
    length = groove_distance(SCREW) + contact_compliance(SCREW) * loads ** (2 / 3)
    y = np.sqrt(length**2 - x**2)
    d = (y[0] - y_0) / math.cos(SCREW.lead_angle)
    forces = loads * y / length * math.cos(SCREW.lead_angle)
    assert forces.sum(axis=1) == pytest.approx([state.force_b, state.force_a], rel=1e-9)
    areas = 1.0 / SCREW.screw_section_area + 1.0 / SCREW.nut_section_area
    K = ball_pitch(SCREW, 86) / SCREW.youngs_modulus * areas
    net = forces[0] - forces[1]
    np.testing.assert_allclose(np.diff(d, 2), K * net[1:-1], rtol=1e-5)
    # the load enters both bodies at the right end: nothing is left at the other
    assert d[1] - d[0] == pytest.approx(K * net[0], rel=1e-4)
    assert d[-1] - d[-2] == pytest.approx(K * (3000.0 - net[-1]), rel=1e-5)
