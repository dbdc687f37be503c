"""Standstill law: exactness, passivity and explicit coupling with a rotor."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ballscrew_tehl.runtime.constants import DAMPING_TIME, ELASTIC_SHARE
from ballscrew_tehl.runtime.standstill import (
    Bristle,
    bristle_friction,
    initial_bristle,
    longest_step,
    presliding_power,
    presliding_step,
    regularised_friction,
    regularised_sign,
)

TC, S0 = 0.25, 400.0
Z_S = TC / S0  # deflection at which it slides


def test_step_agrees_with_integration_of_the_bristle():
    """dz/dt = v up to the elastic range, then less to 0 at the sliding deflection; heat is work less what is stored."""
    rng = np.random.default_rng(0)
    for _ in range(25):
        z, sign = rng.uniform(-Z_S, Z_S), rng.choice([-1.0, 1.0])
        travel, step = Z_S * 10.0 ** rng.uniform(-3, 1), 10.0 ** rng.uniform(-6, 0)

        def rate(_, y):
            share = 1.0 if y[0] <= ELASTIC_SHARE * Z_S else (Z_S - y[0]) / (Z_S * (1.0 - ELASTIC_SHARE))
            return [share, y[0]]

        run = solve_ivp(rate, (0.0, travel), [sign * z, 0.0], rtol=1e-9, atol=1e-12, max_step=Z_S / 20)
        expected, work = run.y[:, -1]
        result = presliding_step(z, sign * travel / step, step, TC, S0, 0.0)
        assert result.deflection == pytest.approx(sign * expected, abs=1e-5 * Z_S)
        assert result.torque == pytest.approx(S0 * result.deflection)
        stored = 0.5 * S0 * (result.deflection**2 - z**2)
        assert result.heat == pytest.approx(S0 * work - stored, abs=1e-5 * S0 * Z_S * (Z_S + travel))


def test_elastic_range_returns_all_its_energy_and_a_sinking_level_turns_it_into_heat():
    z = 0.0
    for speed in (0.01, -0.02, 0.01):
        result = presliding_step(z, speed, 0.01, TC, S0, 0.0)
        z = result.deflection
        assert result.heat == pytest.approx(0.0, abs=1e-18)
    assert z == pytest.approx(0.0, abs=1e-18)
    result = presliding_step(Z_S, 0.0, 1e-3, TC / 2, S0, 1.0)
    assert result.deflection == TC / 2 / S0
    assert result.heat == pytest.approx(0.5 * TC**2 / S0 * (1 - 0.25))
    assert presliding_step(Z_S, 1.0, 1e-3, 0.0, S0, 1.0) == (0.0, 0.0, pytest.approx(0.5 * TC**2 / S0))
    for coulomb in (0.0, TC):  # a step of zero length keeps the state
        result = presliding_step(1e-4, 5.0, 0.0, coulomb, S0, 1.0)
        assert result == (1e-4, 0.0 if coulomb == 0.0 else S0 * 1e-4, 0.0)


def test_power_at_an_instant_is_the_limit_of_the_heat_of_a_short_step():
    for share in (-0.9, 0.5, 0.8, 0.99):
        step = presliding_step(share * Z_S, 0.05, 1e-7, TC, S0, 0.0)
        assert presliding_power(share * Z_S, 0.05, TC, S0) == pytest.approx(
            step.heat / 1e-7, rel=1e-3, abs=1e-9
        )
    assert presliding_power(1e-4, 1.0, 0.0, S0) == 0.0
    assert presliding_power(Z_S, 2.0, TC, S0) == pytest.approx(2.0 * TC)


def test_the_bristle_never_delivers_energy():
    """Random speeds, steps and levels; the Coulomb torque as F, the stiffness fixed or as F^(2/3). The torque stays at
    or below its level, the mean of a step too."""
    rng = np.random.default_rng(1)
    for run in range(400):
        bristle, given, scale = Bristle(), 0.0, 0.0
        for _ in range(rng.integers(1, 60)):
            speed = rng.choice([0.0, rng.uniform(-300.0, 300.0), rng.uniform(-1e-2, 1e-2)])
            step, load = 10.0 ** rng.uniform(-6.0, 0.0), 10.0 ** rng.uniform(-4.0, 0.9) * (rng.random() > 0.1)
            stiffness = S0 if run % 2 else 80.0 * load ** (2.0 / 3.0)
            damping = (0.0, 0.5, 50.0)[run % 3] if run % 2 else DAMPING_TIME * stiffness
            coulomb = TC * load * rng.uniform(0.4, 1.0)
            result = bristle_friction(coulomb, speed, step, bristle, stiffness, damping)
            bristle = result.bristle
            assert result.power * step >= -1e-12
            assert abs(result.sign) <= 1.0 + 1e-15
            assert abs(bristle.deflection) * stiffness <= coulomb * (1.0 + 1e-15)
            done = result.sign * coulomb * speed * step
            given, scale = given + done, scale + abs(done)
            assert given >= bristle.energy - 1e-12 * scale - 1e-15  # nothing is stored that was not supplied


def test_a_change_of_stiffness_keeps_the_energy_and_what_is_switched_off_becomes_heat():
    bristle = Bristle(1e-3, 100.0)
    stiffer = bristle.at_stiffness(225.0)
    assert stiffer.energy == pytest.approx(bristle.energy, rel=1e-14)
    assert stiffer.deflection == pytest.approx(1e-3 / 1.5, rel=1e-14)
    assert stiffer.at_stiffness(100.0).deflection == pytest.approx(1e-3, rel=1e-14)
    assert bristle.at_stiffness(0.0) == (0.0, 0.0)
    for off in (
        bristle_friction(0.0, 1.0, 1e-3, bristle, 0.0, 0.0),
        regularised_friction(TC, 0.0, 1e-3, 0.1, bristle),
    ):
        assert off == (0.0, pytest.approx(bristle.energy / 1e-3), (0.0, 0.0))
    for speed, width, sign in (
        (0.1, 0.1, math.tanh(1.0)), (-3.0, 0.0, -1.0), (0.0, 0.0, 0.0), (1e30, 1e-300, 1.0),
    ):  # fmt: skip
        assert regularised_sign(speed, width) == pytest.approx(sign)


def test_side_of_the_bristle_at_the_start():
    for side, speed, share in (
        (0.0, 2.0, 1.0), (0.0, -2.0, -1.0), (0.0, 0.0, 0.0), (0.3, -2.0, 0.3), (-5.0, 2.0, -1.0),
    ):  # fmt: skip
        assert initial_bristle(side, speed, TC, S0) == (pytest.approx(share * Z_S), S0)
        assert initial_bristle(side, speed, 0.0, 0.0) == (0.0, 0.0)


# --- coupled with a rotor ---


def rotor(stiffness, damping, load, seconds, inertia=0.01, step=1e-3, omega=0.0, parallel=True):
    """Rotor and bristle stepped explicitly, parallel: with the torque of the previous step; speeds and angles."""
    z = torque = angle = 0.0
    speeds, angles = [], []
    for n in range(round(seconds / step)):
        drive = load(n * step) if callable(load) else load
        result = presliding_step(z, omega, step, TC, stiffness, damping)
        angle += step * omega
        omega += step * (drive - (torque if parallel else result.torque)) / inertia
        z, torque = result.deflection, result.torque
        speeds.append(omega)
        angles.append(angle)
    return np.array(speeds), np.array(angles)


def rests(speeds):
    return bool(np.ptp(speeds[-500:]) < 1e-9)


def test_rotors_below_the_lowest_inertia_do_not_come_to_rest():
    """The condition of the warning: default damping, both models with the values of the last step."""
    stiffness, step = 100.0, 1e-3
    damping = DAMPING_TIME * stiffness
    assert longest_step(stiffness, damping) == pytest.approx(DAMPING_TIME)
    lowest = step * damping / (1.0 - step / DAMPING_TIME)
    for factor in (0.9, 1.1):
        speeds, _ = rotor(stiffness, damping, 0.5 * TC, 20.0, factor * lowest)
        assert rests(speeds) == (factor > 1.0)
    for inertia in (0.001, 0.1):  # a longer step finds no rest at any inertia
        assert not rests(rotor(stiffness, damping, 0.5 * TC, 60.0, inertia, 1.05 * DAMPING_TIME)[0])


def test_a_rotor_rests_with_damping_moves_above_the_coulomb_torque_and_does_not_creep():
    """Without damping a parallel master ripples and drifts. A bristle without elastic range would creep 0.048 rad."""
    speeds, angles = rotor(S0, 0.0, 0.125, 10.0)
    assert np.ptp(speeds[-1000:]) == pytest.approx(0.17, abs=0.02)
    assert angles[-1] == pytest.approx(0.10, abs=0.02)
    for damping, rest in ((0.5, 4.0e-4), (2.0, 3.125e-4)):
        speeds, angles = rotor(S0, damping, 0.125, 10.0)
        assert max(np.ptp(speeds[-1000:]), abs(angles[-1] - angles[-1000])) < 1e-12
        assert angles[-1] == pytest.approx(rest, rel=0.01)
    speeds, _ = rotor(S0, 2.0, 1.1 * TC, 2.0)
    assert speeds[-1] - speeds[-1001] == pytest.approx(0.1 * TC / 0.01, rel=1e-3)
    speeds, angles = rotor(S0, 2.0, 0.0, 10.0, omega=100.0)
    assert max(abs(speeds[-1]), abs(angles[-1] - angles[-1000])) < 1e-12
    assert angles[-1] == pytest.approx(0.5 * 0.01 * 100.0**2 / TC, rel=0.01)
    _, angles = rotor(S0, 2.0, lambda t: 0.10 + 0.05 * math.sin(2 * math.pi * 5.0 * t), 50.0)
    assert abs(angles[-200:].mean() - angles[1000:1200].mean()) < 1e-5
