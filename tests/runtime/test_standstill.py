"""Standstill law: memory, exactness, passivity and explicit coupling with a rotor."""

import math

import numpy as np
import pytest

from ballscrew_tehl.runtime.constants import DAMPING_TIME, ELEMENTS, STIFFNESS_RATIO
from ballscrew_tehl.runtime.standstill import (
    RELAXED,
    Elements,
    element_limits,
    held_stiffness,
    initial_elements,
    presliding_friction,
    presliding_power,
    presliding_step,
    regularised_friction,
    regularised_sign,
)

TC, K = 0.25, 400.0
X_M = 2.0 * TC / K  # travel at which all slide
NONE = RELAXED.states


def stepped(states, speed, step, torque=TC, stiffness=K, damping=0.0):
    return presliding_step(states, speed, step, torque, stiffness, damping, element_limits(torque, stiffness))


def moved(states, travel, damping=0.0, step=1e-3):
    return stepped(states, travel / step, step, damping=damping)


def energy(states):
    return Elements(states).energy


def test_from_rest_the_torque_is_the_parabola_of_the_travel_and_its_pieces_meet_it():
    """Within the largest gap of ELEMENTS straight pieces, Tc/(4 ELEMENTS^2), and equal half between two yields."""
    for share in np.linspace(0.0, 1.2, 61):
        parabola = TC * (1.0 - (1.0 - min(share, 1.0)) ** 2)
        assert abs(moved(NONE, share * X_M).torque - parabola) <= (0.25 + 1e-9) * TC / ELEMENTS**2
    assert moved(NONE, X_M * (1.0 - 0.5 / ELEMENTS)).torque == pytest.approx(TC, rel=1e-12)
    assert moved(NONE, 1e-6 * X_M).torque == pytest.approx(1e-6 * X_M * K, rel=1e-9)


def test_inner_loops_close_and_an_outer_one_goes_on_as_if_they_had_not_been():
    """Return point memory, with three loops inside each other; Masing: a branch is the virgin curve, twice as large."""
    rng = np.random.default_rng(2)
    for _ in range(50):
        turns = np.sort(rng.uniform(-0.9, 0.9, 3))[::-1] * X_M
        start = moved(NONE, 0.95 * X_M).states
        at = 0.95 * X_M
        inner = start
        for there in (turns[2], turns[0], turns[1], turns[0], turns[2], 0.95 * X_M):
            inner = moved(inner, there - at).states
            at = there
        back = moved(moved(start, turns[2] - 0.95 * X_M).states, 0.95 * X_M - turns[2]).states
        for one, other in zip(inner, back, strict=True):
            assert abs(one - other) <= 1e-12 * element_limits(TC, K)[-1]
    full = moved(NONE, 2.0 * X_M)
    for share in (0.1, 0.4, 0.9):
        branch = TC - moved(full.states, -2.0 * share * X_M).torque
        assert branch == pytest.approx(2.0 * moved(NONE, share * X_M).torque, rel=1e-12)


def test_heat_is_the_work_less_what_is_stored_and_steps_add_up():
    rng = np.random.default_rng(0)
    for _ in range(25):
        states = initial_elements(rng.uniform(-1.0, 1.0), 0.0, TC, K).states
        travel = rng.choice([-1.0, 1.0]) * X_M * 10.0 ** rng.uniform(-2.0, 1.0)
        one = moved(states, travel)
        parts, heat, work, torque = states, 0.0, 0.0, sum(states) * math.sqrt(K / ELEMENTS)
        for _ in range(1000):
            part = moved(parts, 1e-3 * travel)
            work += 0.5 * (torque + part.torque) * 1e-3 * travel
            parts, heat, torque = part.states, heat + part.heat, part.torque
        assert parts == pytest.approx(one.states, abs=1e-12)
        assert one.heat == pytest.approx(heat, abs=1e-12)
        lost = work - energy(one.states) + energy(states)
        assert one.heat == pytest.approx(lost, abs=1e-4 * abs(work) + 1e-12)


def test_a_level_that_sinks_turns_energy_into_heat_and_one_that_rises_leaves_the_elements():
    full = element_limits(TC, K)
    half = stepped(full, 0.0, 1e-3, TC / 2, K, 1.0)
    assert half.states == pytest.approx(element_limits(TC / 2, K))
    assert half.heat == pytest.approx(0.75 * energy(full))
    assert stepped(half.states, 0.0, 1e-3, TC, K, 1.0) == (half.states, pytest.approx(TC / 2), 0.0)
    assert stepped(full, 1.0, 1e-3, 0.0, K, 1.0) == (NONE, 0.0, pytest.approx(energy(full)))
    assert stepped(full, 5.0, 0.0, TC, K, 1.0) == (full, pytest.approx(TC), 0.0)


def test_power_at_an_instant_is_the_limit_of_the_heat_of_a_short_step():
    for share in (-0.9, 0.5, 0.8, 0.99, 1.0):
        states = initial_elements(share, 0.0, TC, K).states
        step = stepped(states, 0.05, 1e-9)
        assert presliding_power(states, 0.05, TC, K) == pytest.approx(step.heat / 1e-9, rel=1e-6, abs=1e-9)
    assert presliding_power(NONE, 1.0, 0.0, K) == 0.0
    assert presliding_power(element_limits(TC, K), 2.0, TC, K) == pytest.approx(2.0 * TC)


def test_the_elements_never_deliver_energy():
    """Random speeds, steps and levels; the Coulomb torque as F, the stiffness fixed or as F^(2/3). The torque stays at
    or below its level, the mean of a step too."""
    rng = np.random.default_rng(1)
    for run in range(400):
        elements, given, scale = RELAXED, 0.0, 0.0
        for _ in range(rng.integers(1, 60)):
            speed = rng.choice([0.0, rng.uniform(-300.0, 300.0), rng.uniform(-1e-2, 1e-2)])
            step, load = 10.0 ** rng.uniform(-6.0, 0.0), 10.0 ** rng.uniform(-4.0, 0.9) * (rng.random() > 0.1)
            stiffness = held_stiffness(elements, K if run % 2 else 80.0 * load ** (2.0 / 3.0))
            damping = (0.0, 0.5, 50.0)[run % 3] if run % 2 else DAMPING_TIME * stiffness
            coulomb = TC * load * rng.uniform(0.4, 1.0)
            result = presliding_friction(coulomb, speed, step, elements, stiffness, damping)
            elements = result.elements
            assert result.power * step >= 0.0
            assert abs(result.sign) <= 1.0 + 1e-15
            done = result.sign * coulomb * speed * step
            given, scale = given + done, scale + abs(done)
            assert given >= elements.energy - 1e-12 * scale - 1e-15  # nothing is stored that was not supplied


def test_the_stiffness_stays_under_load_and_follows_without_it():
    held = Elements(initial_elements(0.3, 0.0, TC, K).states, K, False)
    assert held_stiffness(held, 1.1 * K) == held_stiffness(held, 0.9 * K) == K
    for factor in (1.01 * STIFFNESS_RATIO, 0.99 / STIFFNESS_RATIO, 0.0):
        assert held_stiffness(held, factor * K) == factor * K
    for side, free in ((0.0, True), (0.3, False), (1.0, True)):
        assert initial_elements(side, 0.0, TC, K).free == free
        start = initial_elements(side, 0.0, TC, K)
        assert presliding_friction(TC, 0.0, 1e-3, start, K, 0.0).elements.free == free
    for off in (
        presliding_friction(0.0, 1.0, 1e-3, held, 0.0, 0.0),
        regularised_friction(TC, 0.0, 1e-3, 0.1, held),
    ):
        assert (off.sign, off.power, off.elements.states) == (0.0, pytest.approx(held.energy / 1e-3), NONE)
    for speed, width, sign in (
        (0.1, 0.1, math.tanh(1.0)), (-3.0, 0.0, -1.0), (0.0, 0.0, 0.0), (1e30, 1e-300, 1.0),
    ):  # fmt: skip
        assert regularised_sign(speed, width) == pytest.approx(sign)


def test_side_at_the_start():
    for side, speed, share in (
        (0.0, 2.0, 1.0), (0.0, -2.0, -1.0), (0.0, 0.0, 0.0), (0.3, -2.0, 0.3), (-5.0, 2.0, -1.0),
    ):  # fmt: skip
        assert initial_elements(side, speed, TC, K).states == pytest.approx(moved(NONE, share * X_M).states)
        assert initial_elements(side, speed, 0.0, 0.0).states == NONE
