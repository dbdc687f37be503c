"""Single nuts: offset lead as a double nut in one piece; oversize balls between four flanks, with their limits."""

import math

import numpy as np
import pytest
from reference_screw import GD4008

from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.ball_law import contact_compliance, groove_distance
from ballscrew_tehl.physics.load import ball_oversize, ball_pitch, double_nut_loads

FOUR = changed(GD4008, screw={"preload_kind": "single_nut_oversize_ball"})
SCREW, BETA = FOUR.screw, FOUR.screw.contact_angle


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
