"""Modes and energies of the native models: stick and slip, rest, range, balances of power."""

import math

import numpy as np
import pytest
from native_model import NativeModel
from scipy.integrate import solve_ivp
from synthetic_map import LAWS, closed_form

from ballscrew_fmu.models import FRICTION, MONITOR, TRANSMISSION
from ballscrew_tehl.runtime.packed import FILM_SHEAR, MECHANISTIC

pytestmark = pytest.mark.slow
MAPS = {law: closed_form(law) for law in LAWS} | {"oversize": closed_form(MECHANISTIC, 0.3)}
RATIO = 8e-3 / (2.0 * math.pi)  # [m/rad] of the closed-form map
LAW = pytest.mark.parametrize("nut_map", MAPS.values(), ids=MAPS)


def begun(nut_map, model=FRICTION, **values):
    """Model exchange after its initial event."""
    one = NativeModel(nut_map, True, model)
    one.latch(**values)
    one.initial_event()
    return one


# --- modes of model exchange ---

INSIDE = {
    FRICTION: {"preload": 3000.0, "speed": 20.0, "temperature": 310.0, "axial_load": 0.0},
    TRANSMISSION: {
        "preload": 2000.0, "position": -2e-6, "speed": 20.0, "velocity": 20.0 * RATIO, "temperature": 310.0,
    },
    MONITOR: {"torque": 0.8, "speed": 30.0, "temperature": 303.15, "axial_load": 0.0},
}  # fmt: skip
BEYOND = [
    *((FRICTION, {name: value}) for name, value in (
        ("axial_load", 2e4), ("axial_load", -2e4), ("preload", 2e4), ("preload", 40.0), ("speed", -321.0),
        ("temperature", 200.0), ("temperature", 354.0),
    )),
    *((TRANSMISSION, {name: value}) for name, value in (
        ("position", -2e-5), ("position", 2e-5), ("preload", 13e3), ("preload", 40.0), ("speed", 321.0),
        ("temperature", 283.0),
    )),
    *((MONITOR, values) for values in (
        {"torque": 80.0}, {"torque": 1e-3}, {"torque": -0.1}, {"speed": 330.0}, {"temperature": 360.0},
        {"temperature": 280.0}, {"axial_load": 5000.0}, {"axial_load": 11900.0, "torque": 4.0},
    )),
]  # fmt: skip


def test_in_range_changes_at_events_with_hysteresis():
    """The indicator of each input falls below 0 outside, in_range follows at the event, which is not repeated."""
    for model, outside in BEYOND:
        one = begun(MAPS[FILM_SHEAR], model, **INSIDE[model])
        assert one.get("in_range") == 1.0
        assert one.get("in_range_indicator") > 0.0
        for values, inside in ((outside, False), (INSIDE[model], True)):
            one.latch(**values)
            assert (one.get("in_range_indicator") > 0.0) is inside, (model.name, outside)
            assert one.get("in_range") == (not inside)
            if model is not MONITOR:
                assert (one.get("range_margin") > 0.0) is inside
            for _ in range(2):
                one.event()
                assert one.get("in_range") == inside
                assert (one.get("in_range_indicator") > 0.0) is inside
    fastest = MAPS[FILM_SHEAR].speed.hi
    one = begun(MAPS[FILM_SHEAR], speed=0.5 * fastest)
    for speed, sign in (
        (fastest * (1.0 + 1e-9), 1.0), (fastest * 1.001, -1.0), (fastest * (1.0 - 1e-9), -1.0),
    ):  # fmt: skip
        one.latch(speed=speed)
        assert sign * one.get("in_range_indicator") > 0.0
        one.event()


def test_the_monitor_holds_its_estimate_at_rest():
    one = begun(MAPS[FILM_SHEAR], MONITOR, torque=0.8, speed=30.0, speed_min=2.0)
    estimated = one.get("preload")
    one.latch(torque=0.5)
    assert one.get("preload") < estimated  # continuous while it moves
    one.latch(speed=1.9)
    assert one.get("motion_indicator") < 0.0
    before = one.get("preload")
    assert one.get("in_range") == 1.0
    one.event()
    assert one.get("in_range") == 0.0
    assert one.get("motion_indicator") < 0.0
    for torque in (0.0, 3.0, -2.0):
        one.latch(torque=torque, speed=0.0)
        assert one.get("preload") == before
    one.latch(torque=0.8, speed=30.0)
    assert one.get("motion_indicator") > 0.0
    assert one.get("preload") == before
    one.event()
    assert one.get("preload") == pytest.approx(estimated, rel=1e-12)
    assert one.get("in_range") == 1.0


@LAW
def test_slip_begins_at_the_sliding_deflection_and_ends_at_reversal(nut_map):
    stiffness, coulomb = 400.0, nut_map.evaluate(2000.0, 0.01, 303.15).coulomb_torque
    sliding = coulomb / stiffness
    one = begun(nut_map, preload=2000.0, presliding_stiffness=stiffness, presliding_damping=0.5)
    one.latch(speed=0.01)
    assert one.get("presliding_deflection_rate") == pytest.approx(0.01)
    for share, sticks in ((0.69, True), (0.99, True), (0.9995, False)):
        one.latch(presliding_deflection=share * sliding)
        assert (one.get("slip_indicator") > 0.0) == sticks
        elastic = 0.01 * min(1.0, (1.0 - share) / 0.3)
        assert one.get("presliding_deflection_rate") == pytest.approx(elastic)
    assert not one.event()
    assert one.get("friction_torque") == pytest.approx(coulomb + one.get("viscous_torque"), rel=1e-12)
    assert one.get("presliding_deflection_rate") == 0.0
    assert one.get("slip_indicator") > 0.0
    assert one.get("power_loss") == pytest.approx(0.01 * one.get("friction_torque"), rel=1e-12)
    one.latch(speed=-0.01)
    assert one.get("slip_indicator") < 0.0
    assert one.event()
    # as much as when slip began: no energy without motion
    assert one.get("presliding_deflection") == pytest.approx(0.9995 * sliding)
    assert one.get("presliding_deflection_rate") == pytest.approx(-0.01)
    assert one.get("slip_indicator") > 0.0
    for share in (0.9995, -0.9995):  # at rest there is no slip: the torque is stiffness times deflection
        still = nut_map.evaluate(2000.0, 0.0, 303.15).coulomb_torque
        one = begun(
            nut_map,
            preload=2000.0,
            presliding_stiffness=stiffness,
            presliding_deflection=share * still / stiffness,
        )
        assert not one.event()
        assert one.get("friction_torque") == pytest.approx(share * still, rel=1e-9)
        assert abs(one.get("power_loss")) <= 1e-15


@LAW
def test_model_exchange_keeps_the_energy_when_the_stiffness_changes(nut_map):
    """Held at rest while the preload rises, from zero and between events too."""
    net = nut_map.defaults[1::2]
    stiffness, higher = (nut_map.presliding_stiffness(preload, 0.0, *net) for preload in (2000.0, 2400.0))
    one = begun(nut_map, preload=2000.0)
    one.latch(presliding_deflection=1e-3)
    torque = one.get("friction_torque")
    assert torque == pytest.approx(1e-3 * stiffness, rel=1e-9)
    one.latch(preload=2400.0)
    assert one.get("slip_indicator") > 0.0  # no event yet: the state is the deflection at the last one
    assert one.get("presliding_deflection") == 1e-3
    assert one.get("friction_torque") == pytest.approx(1e-3 * math.sqrt(stiffness * higher), rel=1e-12)
    one.latch(preload=7000.0)
    assert one.get("slip_indicator") < 0.0
    assert one.event()
    higher = nut_map.presliding_stiffness(7000.0, 0.0, *net)
    assert one.get("presliding_deflection") == pytest.approx(1e-3 * math.sqrt(stiffness / higher), rel=1e-12)
    assert abs(one.get("heat")) <= 1e-18
    for preload, event in ((0.0, True), (0.0, False), (2000.0, True)):
        one.latch(preload=preload)
        assert (one.get("slip_indicator") < 0.0) == event
        one.event()
        assert one.get("friction_torque") == 0.0  # what was stored is lost without preload
    assert one.get("heat") == pytest.approx(0.5 * stiffness * 1e-6, rel=1e-9)
    one.latch(presliding_deflection=1e-3)
    assert one.get("friction_torque") == pytest.approx(torque, rel=1e-9)


def test_bristle_that_is_switched_off_while_it_slips_is_not_counted_twice():
    one = begun(MAPS[FILM_SHEAR], speed=5.0)
    slipping = one.get("power_loss")
    one.latch(presliding=0.0)
    assert one.event()
    assert one.get("presliding_deflection") == 0.0
    assert one.get("power_loss") == pytest.approx(slipping, rel=1e-12)


# --- balance of power of the transmission ---

POWERS = ("shaft_power", "nut_power", "power_loss")


def cycle(time):
    """Inputs along a smooth cycle of 0.4 s with two reversals of the screw and a load that parts the nuts."""
    w = 2.0 * math.pi / 0.4
    angle, speed = 2.0 * (1.0 - math.cos(w * time)), 2.0 * w * math.sin(w * time)
    x = 5e-6 * math.sin(w * time + 0.7) + 1e-6 * math.sin(3.0 * w * time)
    rate = 5e-6 * w * math.cos(w * time + 0.7) + 3e-6 * w * math.cos(3.0 * w * time)
    return {"angle": angle, "speed": speed, "position": RATIO * angle - x, "velocity": RATIO * speed - rate}


@LAW
def test_power_balance_of_model_exchange(nut_map):
    """Shaft - nut - heat = stored over a cycle with reversal: bristle integrated and events located by a solver.

    Of co-simulation: that of Python (tests/runtime), whose steps are the same (test_native_equivalence).
    """
    one = begun(nut_map, TRANSMISSION, **cycle(0.0))
    first, end, events, time = one.get("stored_energy"), 0.4, 0, 0.0
    state = np.array([one.get("presliding_deflection"), 0.0, 0.0, 0.0, 0.0])

    def rates(t, y):
        one.latch(**cycle(t), presliding_deflection=y[0])
        shaft, nut, loss = (one.get(name) for name in POWERS)
        return [one.get("presliding_deflection_rate"), shaft, nut, loss, abs(shaft)]

    def indicator(t, y):
        one.latch(**cycle(t), presliding_deflection=y[0])
        return one.get("slip_indicator")

    indicator.terminal = True
    while time < end:
        run = solve_ivp(rates, (time, end), state, rtol=1e-9, atol=1e-12, max_step=1e-3, events=indicator)
        assert run.success
        time, state = run.t[-1], run.y[:, -1]
        one.latch(**cycle(time), presliding_deflection=state[0])
        if run.status == 1:
            events += 1
            passed = state[0] + 1e-9 * one.get("presliding_deflection_rate")
            time += 1e-9  # past the crossing
            one.latch(**cycle(time), presliding_deflection=passed)
            one.event()
            state[0] = one.get("presliding_deflection")
        assert events < 400
    # by the film shear law the bristle sticks again with less energy; by the other one with the same, so that the heat
    # of its events is rounding, of either sign
    lost = one.get("heat")
    assert lost > 1e-6 if nut_map.law == FILM_SHEAR else abs(lost) <= 1e-12
    balance = state[1] - state[2] - state[3] - lost - (one.get("stored_energy") - first)
    assert events >= 3
    assert state[4] > 5.0
    assert abs(balance) <= 1e-6 * state[4]
