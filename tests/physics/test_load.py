"""Ball loads: worked values, equilibrium, the recurrence itself, separation, limits and bad input."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_screw import GD4008
from scipy.optimize import root

from ballscrew_tehl.parameters.file import FOUR_POINT, changed
from ballscrew_tehl.physics.ball_law import (
    contact_angle_at_ball_load,
    contact_compliance,
    flank_law,
    groove_distance,
    loaded_contact_angle,
)
from ballscrew_tehl.physics.load import ball_pitch, double_nut_loads, nut_loads, separation_load
from ballscrew_tehl.physics.rating import computed_dynamic_rating

SCREW = GD4008.screw
OVERSIZE = changed(GD4008, screw={"preload_kind": FOUR_POINT}).screw
BETA = SCREW.contact_angle


def approach(Q):
    """Axial approach of balls by their loads: the groove centres, a fixed radial distance apart, move apart."""
    a_0 = groove_distance(SCREW)
    length = a_0 + contact_compliance(SCREW) * Q ** (2 / 3)
    moved = np.sqrt(length**2 - (a_0 * math.cos(BETA)) ** 2) - a_0 * math.sin(BETA)
    return moved / math.cos(SCREW.lead_angle)


def axial(Q, screw=SCREW):
    return Q * np.sin(contact_angle_at_ball_load(screw, Q)) * math.cos(screw.lead_angle)


def test_loaded_contact_angle():
    for force, count, degrees in [
        (1000, 86, 45.515), (2000, 86, 45.809), (6000, 86, 46.630), (2000, 72, 45.907),
    ]:  # fmt: skip
        beta = loaded_contact_angle(SCREW, force, count)
        assert math.degrees(beta) == pytest.approx(degrees, abs=0.0005)
        Q = force / (count * math.sin(beta) * math.cos(SCREW.lead_angle))
        assert contact_angle_at_ball_load(SCREW, Q) == pytest.approx(beta, rel=1e-13)


def test_distribution_under_preload():
    """Heaviest next to the spacer, where the balls obey the recurrence of the chain and carry the force."""
    for force, count in [(1000, 86), (6000, 72)]:
        Q = nut_loads(SCREW, force, count)
        assert np.all(np.diff(Q) > 0.0)
        K = ball_pitch(SCREW, count) / SCREW.youngs_modulus
        K *= 1.0 / SCREW.screw_section_area + 1.0 / SCREW.nut_section_area
        d, f = approach(Q), axial(Q)
        assert f.sum() == pytest.approx(force, rel=1e-9)
        np.testing.assert_allclose(np.diff(d, 2), K * f[1:-1], rtol=1e-6)
        assert d[1] - d[0] == pytest.approx(K * f[0], rel=1e-6)


@pytest.mark.parametrize(("shift", "tolerance"), [(0.5, 1e-6), (0.0, 0.01)])
def test_two_starts_share_a_nut_of_the_length_of_one(shift, tolerance):
    """Against springs between all nodes of screw and nut: balls of the starts in turn, or two at every place."""
    two = changed(GD4008, screw={"lead": 0.02, "lead_angle": math.atan(0.02 / (math.pi * 0.04)), "starts": 2,
                                 "turns": 1.5, "ball_count": 60, "loaded_ball_count": 60}).screw  # fmt: skip
    each, force, law = 30, 4000.0, flank_law(two)
    step = two.turns * two.lead / (each - 1 + shift)
    z = np.concatenate([np.arange(each) * step, (np.arange(each) + shift) * step])
    order = np.argsort(z, kind="stable")
    gap = np.maximum(np.diff(z[order]), 1e-5)
    rods = np.zeros((2, 60, 60))
    for rod, area in zip(rods, (two.screw_section_area, two.nut_section_area), strict=True):
        for i, (j, k) in enumerate(pairwise(order)):
            rod[np.ix_([j, k], [j, k])] += two.youngs_modulus * area / gap[i] * np.array([[1, -1], [-1, 1]])
    held = order[-1]

    def residual(x):
        screw, nut = x[:60] * 1e-6, x[60:] * 1e-6
        f = law(nut - screw)[0]
        forces = np.concatenate([rods[0] @ screw - f, rods[1] @ nut + f])
        forces[60 + held] -= force
        forces[held] = 1e9 * screw[held]
        return forces / force

    x = root(residual, np.repeat([0.0, 3.0], 60), method="lm", tol=1e-13).x * 1e-6
    Q = law(x[60:] - x[:60])[2]
    assert axial(Q, two).sum() == pytest.approx(force, rel=1e-6)
    np.testing.assert_allclose(Q[order], nut_loads(two, force, 60), rtol=tolerance)
    longer = changed(GD4008, screw=two.model_dump(exclude_unset=True) | {"starts": 1, "turns": 3.0}).screw
    assert computed_dynamic_rating(longer) == pytest.approx(computed_dynamic_rating(two), rel=1e-12)
    assert nut_loads(longer, force, 60).max() > 1.03 * Q.max()


def test_the_relieved_nut_separates_at_the_separation_load():
    for sign in [1, -1]:
        for preload in [1.0, 12000.0]:
            limit = separation_load(SCREW, preload, 86, sign)
            just_before = double_nut_loads(SCREW, preload, 0.999 * sign * limit, 86)
            just_after = double_nut_loads(SCREW, preload, 1.001 * sign * limit, 86)
            assert 0.0 < min(just_before.force_a, just_before.force_b) < 1e-3 * preload
            assert min(just_after.force_a, just_after.force_b) == 0.0
            assert max(just_after.force_a, just_after.force_b) == pytest.approx(1.001 * limit, rel=1e-9)


@given(preload=st.floats(1.0, 12000.0), share=st.floats(-5.0, 5.0))
@settings(deadline=None, max_examples=30)
def test_double_nut_balances_and_keeps_the_gap(preload, share):
    load = share * preload
    for screw in (SCREW, OVERSIZE):
        state = double_nut_loads(screw, preload, load, 86)
        assert state.force_b - state.force_a == pytest.approx(load, abs=1e-8 * (preload + abs(load)))
        for Q, force in ((state.Q_a, state.force_a), (state.Q_b, state.force_b)):
            assert np.all(Q >= 0.0)
            if screw is SCREW:
                assert axial(Q).sum() == pytest.approx(force, rel=1e-9, abs=1e-9)


def test_gap_equation_from_the_loads():
    """Approach of the balls at the spacer and its elongation give the same gap under every load."""
    stretch = SCREW.spacer_length / SCREW.youngs_modulus
    stretch *= 1 / SCREW.screw_section_area + 1 / SCREW.spacer_section_area

    def gap(load):
        state = double_nut_loads(SCREW, 2000.0, load, 86)
        return approach(state.Q_a[-1]) + approach(state.Q_b[0]) + stretch * state.force_a

    assert [gap(load) for load in (-4000.0, 1000.0, 6000.0)] == pytest.approx([gap(0.0)] * 3, rel=1e-9)


def test_bad_forces():
    for bad in (-1.0, math.nan, math.inf):
        for name, function, *more in (
            ("preload", double_nut_loads, 0.0, 86), ("preload", separation_load, 86), ("force", nut_loads, 86),
            ("force", loaded_contact_angle, 86), ("ball_load", contact_angle_at_ball_load),
        ):  # fmt: skip
            with pytest.raises(ValueError, match=f"{name} = "):
                function(SCREW, bad, *more)
