"""Standstill law: exactness, passivity and explicit coupling with a rotor."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ballscrew_tehl.runtime.constants import DAMPING_TIME, ELASTIC_SHARE
from ballscrew_tehl.runtime.standstill import (
    Bristle,
    bristle_friction,
    initial_bristle,
    least_inertia,
    longest_step,
    presliding_power,
    presliding_step,
    regularised_friction,
    regularised_sign,
)

TC, S0 = 0.25, 400.0


def integrated_step(z, travel, z_s, pieces=4000):
    """Deflection and its integral over the travel by the classical Runge-Kutta method, |z| <= z_s."""
    g = math.copysign(1.0, travel)
    z_b = ELASTIC_SHARE * z_s

    def rate(q):
        return 1.0 if q <= z_b else (z_s - q) / (z_s - z_b)

    q, work, h = g * z, 0.0, abs(travel) / pieces
    for _ in range(pieces):
        k_1 = rate(q)
        k_2 = rate(q + 0.5 * h * k_1)
        k_3 = rate(q + 0.5 * h * k_2)
        k_4 = rate(q + h * k_3)
        middle = q + 0.25 * h * (k_1 + k_2)
        new = q + h * (k_1 + 2 * k_2 + 2 * k_3 + k_4) / 6
        work += h * (q + 4 * middle + new) / 6
        q = new
    return g * q, work


def test_regularised_sign():
    assert regularised_sign(0.1, 0.1) == pytest.approx(math.tanh(1.0))
    assert regularised_sign(-3.0, 0.0) == -1.0
    assert regularised_sign(0.0, 0.0) == 0.0
    assert 1.0 - regularised_sign(1.1, 0.1) < 1e-9
    assert regularised_sign(1e30, 1e-300) == 1.0


@pytest.mark.parametrize("seed", range(12))
def test_step_agrees_with_integration_of_the_bristle(seed):
    rng = np.random.default_rng(seed)
    z_s = TC / S0
    z = float(rng.uniform(-z_s, z_s))
    travel = float(rng.choice([-1, 1]) * z_s * 10 ** rng.uniform(-3, 1))
    step = float(10 ** rng.uniform(-6, 0))
    expected, work = integrated_step(z, travel, z_s)
    result = presliding_step(z, travel / step, step, TC, S0, 0.0)
    assert result.deflection == pytest.approx(expected, abs=3e-7 * z_s + 1e-12)
    assert result.torque == pytest.approx(S0 * result.deflection)
    stored = 0.5 * S0 * (result.deflection**2 - z**2)
    assert result.heat == pytest.approx(S0 * work - stored, abs=1e-6 * S0 * z_s**2)


def test_elastic_range_returns_all_its_energy():
    z = 0.0
    for speed in (0.01, -0.02, 0.01):
        result = presliding_step(z, speed, 0.01, TC, S0, 0.0)
        z = result.deflection
        assert result.heat == pytest.approx(0.0, abs=1e-18)
    assert z == pytest.approx(0.0, abs=1e-18)


def test_a_sinking_coulomb_level_turns_stored_energy_into_heat():
    result = presliding_step(TC / S0, 0.0, 1e-3, TC / 2, S0, 1.0)
    assert result.deflection == TC / 2 / S0
    assert result.heat == pytest.approx(0.5 * TC**2 / S0 * (1 - 0.25))
    free = presliding_step(TC / S0, 1.0, 1e-3, 0.0, S0, 1.0)
    assert free == (0.0, 0.0, pytest.approx(0.5 * TC**2 / S0))


@pytest.mark.parametrize("coulomb", [0.0, TC])
def test_a_step_of_zero_length_keeps_the_state(coulomb):
    result = presliding_step(1e-4, 5.0, 0.0, coulomb, S0, 1.0)
    assert result == (1e-4, 0.0 if coulomb == 0.0 else S0 * 1e-4, 0.0)


def test_power_at_an_instant_is_the_limit_of_the_heat_of_a_short_step():
    for share in (-0.9, 0.5, 0.8, 0.99):
        z = share * TC / S0
        step = presliding_step(z, 0.05, 1e-7, TC, S0, 0.0)
        assert presliding_power(z, 0.05, TC, S0) == pytest.approx(step.heat / 1e-7, rel=1e-3, abs=1e-9)
    assert presliding_power(1e-4, 1.0, 0.0, S0) == 0.0
    assert presliding_power(TC / S0, 2.0, TC, S0) == pytest.approx(2.0 * TC)


step_of_a_run = st.tuples(
    st.floats(-300.0, 300.0) | st.floats(-1e-3, 1e-3) | st.just(0.0),
    st.floats(-6.0, 0.0).map(lambda e: 10.0**e),
    st.floats(-2.0, 0.0).map(lambda e: TC * 10.0**e) | st.just(0.0),
)


@settings(max_examples=150, deadline=None)
@given(st.lists(step_of_a_run, min_size=1, max_size=60), st.sampled_from([0.0, 0.5, 2.0]))
def test_bristle_never_delivers_energy(run, damping):
    z = work_of_output = heat = 0.0
    scale = 0.0
    for speed, step, coulomb in run:
        result = presliding_step(z, speed, step, coulomb, S0, damping)
        assert result.heat >= 0.0
        assert math.isfinite(result.torque)
        z = result.deflection
        heat += result.heat
        work_of_output += result.torque * speed * step
        scale += abs(result.torque * speed * step)
        assert abs(z) <= coulomb / S0 * (1 + 1e-15)
        assert work_of_output >= -1e-12 * scale - 1e-18


loaded_step = st.tuples(
    st.floats(-300.0, 300.0) | st.floats(-1e-2, 1e-2) | st.just(0.0),
    st.floats(-6.0, 0.0).map(lambda e: 10.0**e),
    st.floats(-4.0, 4.2).map(lambda e: 10.0**e) | st.just(0.0),  # preload [N]
    st.floats(0.4, 1.0),  # Coulomb torque over that at standstill
)


@settings(max_examples=200, deadline=None)
@given(st.lists(loaded_step, min_size=1, max_size=60))
def test_a_bristle_whose_stiffness_follows_the_preload_never_delivers_energy(run):
    """Coulomb torque as F, stiffness as F^(2/3), default damping; preload jumps between steps."""
    bristle, heat, given_work, scale = Bristle(), 0.0, 0.0, 0.0
    for speed, step, preload, share in run:
        coulomb, stiffness = share * TC * preload / 2000.0, 80.0 * (preload / 2000.0) ** (2.0 / 3.0)
        before = bristle
        result = bristle_friction(coulomb, speed, step, before, stiffness, DAMPING_TIME * stiffness)
        bristle = result.bristle
        assert result.power * step >= -1e-12
        assert abs(result.sign) <= 1.0 + 1e-15
        done = result.sign * coulomb * speed * step
        given_work += done
        scale += abs(done)
        heat += result.power * step
        assert given_work >= bristle.energy - 1e-12 * scale - 1e-15  # nothing is stored that was not supplied
    assert heat >= 0.0


def test_a_change_of_stiffness_keeps_the_energy_and_comes_back():
    bristle = Bristle(1e-3, 100.0)
    stiffer = bristle.at_stiffness(225.0)
    assert stiffer.energy == pytest.approx(bristle.energy, rel=1e-14)
    assert stiffer.deflection == pytest.approx(1e-3 / 1.5, rel=1e-14)
    assert stiffer.at_stiffness(100.0).deflection == pytest.approx(1e-3, rel=1e-14)
    assert bristle.at_stiffness(0.0) == (0.0, 0.0)
    lost = bristle_friction(0.0, 1.0, 1e-3, bristle, 0.0, 0.0)
    assert lost == (0.0, pytest.approx(bristle.energy / 1e-3), (0.0, 0.0))
    off = regularised_friction(TC, 0.0, 1e-3, 0.1, bristle)
    assert off == (0.0, pytest.approx(bristle.energy / 1e-3), (0.0, 0.0))


@pytest.mark.parametrize("damping", [0.0, 0.4, 50.0])
def test_neither_the_end_nor_the_mean_of_a_step_exceeds_the_coulomb_torque(damping):
    z = TC / S0
    for speed, step in ((-5.0, 1e-6), (-5.0, 1e-3), (0.1, 1e-4), (-0.01, 1e-2)):
        result = presliding_step(z, speed, step, TC, S0, damping)
        assert abs(result.torque) <= TC
        stored = 0.5 * S0 * (result.deflection**2 - z**2)
        assert abs(result.heat + stored) <= TC * abs(speed) * step * (1.0 + 1e-12)
        z = result.deflection


@pytest.mark.parametrize(
    ("side", "speed", "share"),
    [(0.0, 2.0, 1.0), (0.0, -2.0, -1.0), (0.0, 0.0, 0.0), (0.3, -2.0, 0.3), (-5.0, 2.0, -1.0)],
)
def test_side_of_the_bristle_at_the_start(side, speed, share):
    assert initial_bristle(side, speed, TC, S0) == (pytest.approx(share * TC / S0), S0)
    assert initial_bristle(side, speed, 0.0, 0.0) == (0.0, 0.0)


def test_rotors_below_the_least_inertia_do_not_come_to_rest():
    """The condition of the warning: default damping, both models with the values of the last step."""
    stiffness, step = 100.0, 1e-3
    damping = DAMPING_TIME * stiffness
    assert longest_step(stiffness, damping) == pytest.approx(DAMPING_TIME)
    least = least_inertia(step, stiffness, damping)
    assert least == pytest.approx(step * damping / 0.75)
    for factor, rests in ((0.9, False), (1.1, True)):
        speeds, _ = rotor(stiffness, damping, 0.5 * TC, 20.0, inertia=factor * least, step=step)
        assert bool(np.ptp(speeds[-1000:]) < 1e-9) is rests
    assert least_inertia(DAMPING_TIME, stiffness, damping) == math.inf
    for inertia in (0.001, 0.01, 0.1, 1.0):  # a longer step finds no rest at any inertia
        speeds, _ = rotor(stiffness, damping, 0.5 * TC, 60.0, inertia=inertia, step=1.05 * DAMPING_TIME)
        assert np.ptp(speeds[-1000:]) > 1e-6


def rotor(stiffness, damping, load, seconds, inertia=0.01, step=1e-3, omega=0.0, parallel=True):
    """Rotor and bristle stepped explicitly with the torque of the previous step; speeds and angle."""
    z = torque = angle = 0.0
    speeds, angles = [], []
    for n in range(round(seconds / step)):
        drive = load(n * step) if callable(load) else load
        if parallel:
            new = omega + step * (drive - torque) / inertia
            result = presliding_step(z, omega, step, TC, stiffness, damping)
        else:
            result = presliding_step(z, omega, step, TC, stiffness, damping)
            new = omega + step * (drive - result.torque) / inertia
        z, torque = result.deflection, result.torque
        angle += step * omega
        omega = new
        speeds.append(omega)
        angles.append(angle)
    return np.array(speeds), np.array(angles)


def test_without_damping_a_parallel_master_ripples_and_drifts():
    speeds, angles = rotor(S0, 0.0, 0.125, 10.0)
    assert np.ptp(speeds[-1000:]) == pytest.approx(0.17, abs=0.02)
    assert angles[-1] == pytest.approx(0.10, abs=0.02)


@pytest.mark.parametrize(("damping", "rest"), [(0.5, 4.0e-4), (2.0, 3.125e-4)])
def test_with_damping_the_rotor_rests(damping, rest):
    speeds, angles = rotor(S0, damping, 0.125, 10.0)
    assert np.ptp(speeds[-1000:]) < 1e-12
    assert abs(angles[-1] - angles[-1000]) < 1e-12
    assert angles[-1] == pytest.approx(rest, rel=0.01)


@pytest.mark.parametrize(("stiffness", "holds"), [(2400.0, True), (2600.0, False)])
def test_limit_of_the_stiffness_for_explicit_coupling(stiffness, holds):
    speeds, _ = rotor(stiffness, 5.0, 0.125, 10.0)
    assert bool(np.ptp(speeds[-1000:]) < 1e-9) is holds


def test_it_moves_above_the_coulomb_torque_and_holds_after_a_run():
    speeds, _ = rotor(S0, 2.0, 1.1 * TC, 2.0)
    assert speeds[-1] - speeds[-1001] == pytest.approx(0.1 * TC / 0.01, rel=1e-3)
    speeds, angles = rotor(S0, 2.0, 0.0, 10.0, omega=100.0)
    assert abs(speeds[-1]) < 1e-12
    assert abs(angles[-1] - angles[-1000]) < 1e-12
    assert angles[-1] == pytest.approx(0.5 * 0.01 * 100.0**2 / TC, rel=0.01)


def test_no_creep_under_a_swinging_load():
    """0.10 +- 0.05 N.m at 5 Hz for 50 s; a bristle without an elastic range (Dahl) creeps 0.048 rad."""
    _, angles = rotor(S0, 2.0, lambda t: 0.10 + 0.05 * math.sin(2 * math.pi * 5.0 * t), 50.0)
    assert abs(angles[-200:].mean() - angles[1000:1200].mean()) < 1e-5


def test_a_sequential_master_is_stable_up_to_its_own_limit():
    inertia, step, damping = 0.01, 1e-3, 1.0
    limit = (4.0 - 2.0 * step * damping / inertia) * inertia / step**2
    assert np.ptp(rotor(0.9 * limit, damping, 0.125, 4.0, parallel=False)[0][-500:]) < 1e-9
    assert np.ptp(rotor(1.1 * limit, damping, 0.125, 4.0, parallel=False)[0][-500:]) > 1e-3
