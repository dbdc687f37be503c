"""Ball loads: worked values, equilibrium, the recurrence itself, separation, limits and bad input."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_screw import GD4008

from ballscrew_tehl.physics.ball_law import (
    contact_angle_at_ball_load,
    contact_compliance,
    loaded_contact_angle,
)
from ballscrew_tehl.physics.load import double_nut_loads, nut_loads, separation_load

SCREW = GD4008.screw
BETA = SCREW.contact_angle
SB = math.sin(BETA) * math.cos(SCREW.lead_angle)


def extremes(Q):
    return Q.max() / Q.mean(), Q.min() / Q.mean()


def test_loaded_contact_angle():
    for force, count, degrees in [
        (1000, 86, 45.515), (2000, 86, 45.809), (6000, 86, 46.630), (2000, 72, 45.907),
    ]:  # fmt: skip
        beta = loaded_contact_angle(SCREW, force, count)
        assert math.degrees(beta) == pytest.approx(degrees, abs=0.0005)
        Q = force / (count * math.sin(beta) * math.cos(SCREW.lead_angle))
        assert contact_angle_at_ball_load(SCREW, Q) == pytest.approx(beta, rel=1e-13)


def test_distribution_under_preload():
    for force, count, most, least in [
        (1000, 86, 1.0396, 0.9801), (2000, 86, 1.0499, 0.9750), (6000, 86, 1.0719, 0.9642),
        (1000, 72, 1.0329, 0.9834), (6000, 72, 1.0596, 0.9701),
    ]:  # fmt: skip
        Q = nut_loads(SCREW, force, count, BETA)
        assert extremes(Q) == pytest.approx((most, least), abs=0.5e-4)
        # heaviest next to the spacer, falling steadily to the outer ball
        assert np.all(np.diff(Q) > 0.0)


def test_the_relieved_nut_separates_at_the_separation_load():
    for angle in [BETA, None]:
        for sign in [1, -1]:
            for preload in [1.0, 12000.0]:
                limit = separation_load(SCREW, preload, 86, sign, angle)
                just_before = double_nut_loads(SCREW, preload, 0.999 * sign * limit, 86, angle)
                just_after = double_nut_loads(SCREW, preload, 1.001 * sign * limit, 86, angle)
                assert 0.0 < min(just_before.force_a, just_before.force_b) < 1e-3 * preload
                assert min(just_after.force_a, just_after.force_b) == 0.0
                assert max(just_after.force_a, just_after.force_b) == pytest.approx(1.001 * limit, rel=1e-9)


@pytest.mark.parametrize("angle", [BETA, None])
@given(preload=st.floats(1.0, 12000.0), share=st.floats(-5.0, 5.0))
@settings(deadline=None, max_examples=30)
def test_double_nut_balances_and_keeps_the_gap(angle, preload, share):
    load = share * preload
    state = double_nut_loads(SCREW, preload, load, 86, angle)
    assert state.force_b - state.force_a == pytest.approx(load, abs=1e-8 * (preload + abs(load)))
    assert np.all(state.Q_a >= 0.0)
    assert np.all(state.Q_b >= 0.0)
    for Q, force in ((state.Q_a, state.force_a), (state.Q_b, state.force_b)):
        beta = contact_angle_at_ball_load(SCREW, Q) if angle is None else angle
        total = np.sum(Q * np.sin(beta)) * math.cos(SCREW.lead_angle)
        assert total == pytest.approx(force, rel=1e-9, abs=1e-9)


def test_gap_equation_from_the_loads():
    """Approach of the balls at the spacer and its elongation give the same gap under every load."""
    c = contact_compliance(SCREW, BETA)
    stretch = SCREW.spacer_length / SCREW.youngs_modulus
    stretch *= 1 / SCREW.screw_section_area + 1 / SCREW.spacer_section_area

    def gap(load):
        state = double_nut_loads(SCREW, 2000.0, load, 86, BETA)
        approach = c * (state.Q_a[-1] ** (2 / 3) + state.Q_b[0] ** (2 / 3)) / SB
        return approach + stretch * state.force_a

    assert [gap(load) for load in (-4000.0, 1000.0, 6000.0)] == pytest.approx([gap(0.0)] * 3, rel=1e-9)


def test_bad_forces():
    for bad in (-1.0, math.nan, math.inf):
        for function, name in (
            (lambda f: double_nut_loads(SCREW, f, 0.0, 86), "preload"),
            (lambda f: separation_load(SCREW, f, 86), "preload"),
            (lambda f: nut_loads(SCREW, f, 86), "force"),
            (lambda f: loaded_contact_angle(SCREW, f, 86), "force"),
            (lambda f: contact_angle_at_ball_load(SCREW, f), "ball_load"),
        ):
            with pytest.raises(ValueError, match=f"{name} = "):
                function(bad)
