"""Motion of the contacts of a ball against the zero-lead formulas, and what no motion of the ball can remove."""

import math

import numpy as np
import pytest

from ballscrew_tehl.parameters.file import FOUR_POINT, changed, load_screw
from ballscrew_tehl.physics import kinematics
from ballscrew_tehl.physics.hertz import ellipse, reduced_radii
from ballscrew_tehl.physics.kinematics import cage_speed, contact_motion, entrainment_speed, neighbour_sliding

ROLLING = changed(load_screw(), friction={"law": "mechanistic"})
SCREW = ROLLING.screw


def rolling_motion(screw, contact_angle, spin_split):
    """Motion of a ball that rolls without slip in the limit of zero lead, per screw speed; spin shared by the split."""
    w_c = float(cage_speed(screw, 1.0))
    rolling = float(entrainment_speed(screw, 1.0)) / (0.5 * screw.ball_diameter)
    along = np.array([-math.sin(contact_angle), 0.0, math.cos(contact_angle)])
    normal = np.array([math.cos(contact_angle), 0.0, math.sin(contact_angle)])
    # spin of the ball about the normal from screw to ball: W of the screw less its share of the spin
    turn = (1.0 - w_c - spin_split) * math.sin(contact_angle)
    return np.array([w_c, *(-rolling * along + turn * normal)])


def test_without_lead_a_rolling_ball_has_no_slip_and_the_spin_of_the_split():
    for split in [0.0, 0.3, 1.0]:
        flat = SCREW.model_copy(update={"lead_angle": 1e-12})
        beta = SCREW.contact_angle
        motion = contact_motion(flat, beta)
        found = motion.matrix @ rolling_motion(flat, beta, split) + motion.offset
        assert np.max(np.abs(found[:, :2])) <= 1e-12 * SCREW.nominal_radius
        spins = np.array([split, 1.0 - split]) * math.sin(beta)
        assert np.max(np.abs(np.abs(found[:, 2]) - spins)) <= 1e-9


def test_differential_slip_is_the_parabola_worked_by_hand():
    """At the edge of the ellipse over u_e, 1000 N on 86 balls: u_e a^2/(2 R_c R_x)."""
    motion, u_e = contact_motion(SCREW, SCREW.contact_angle), float(entrainment_speed(SCREW, 1.0))
    for raceway, slip, expected in zip(motion.raceways, motion.differential, (0.00743, 0.00611), strict=True):
        a = ellipse(16.48, *reduced_radii(SCREW, SCREW.contact_angle, raceway), 225.27e9).a
        assert slip * a**2 / u_e == pytest.approx(expected, abs=0.5e-5)


def test_helix_leaves_a_slip_across_rolling_that_no_motion_removes():
    """Sum over both contacts: r_b w sin(lambda), for any motion of the ball and the balls."""
    motion = contact_motion(SCREW, SCREW.contact_angle)
    expected = 0.5 * SCREW.ball_diameter * math.sin(SCREW.lead_angle)
    for q in np.random.default_rng(3).normal(size=(5, 4)):
        across = (motion.matrix @ q + motion.offset)[:, 1]
        # y of both contacts point the same way round the ball
        assert np.min(np.abs(np.abs([across.sum(), across[0] - across[1]]) - expected)) <= 1e-12
    spin = (motion.matrix @ q + motion.offset)[:, 2]
    whole = math.sin(SCREW.contact_angle) * math.cos(SCREW.lead_angle)
    assert min(abs(abs(spin.sum()) - whole), abs(abs(spin[0] - spin[1]) - whole)) <= 1e-12


def test_neighbours_slide_with_the_speed_of_their_surfaces():
    """Over 2 u_e: 1/cos(beta) of oversize balls, which turn about an axis parallel to that of the screw."""
    angle = SCREW.contact_angle
    oversize = changed(ROLLING, screw={"preload_kind": FOUR_POINT}).screw
    for screw, expected, tolerance in ((SCREW, 1.0, 0.02), (oversize, 1.0 / math.cos(angle), 0.015)):
        found = neighbour_sliding(screw, kinematics.rolling_motion(contact_motion(screw, angle)))
        assert abs(found / expected - 1.0) <= tolerance
