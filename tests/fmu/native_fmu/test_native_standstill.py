"""Modes and energies of the native models: stick and slip, rest, range, balances of power, events against steps."""

import math

import numpy as np
import pytest
from native_library import INDICATORS
from native_model import NativeModel
from synthetic_map import LAWS, closed_form

from ballscrew_fmu.models import FRICTION, MONITOR, TRANSMISSION
from ballscrew_fmu.variables.friction import ELEMENT_STATES
from ballscrew_tehl.runtime.constants import ELEMENTS
from ballscrew_tehl.runtime.packed import Law

pytestmark = pytest.mark.slow
MAPS = {law: closed_form(law) for law in LAWS} | {"oversize": closed_form(Law.MECHANISTIC, 0.3)}
RATIO = 8e-3 / (2.0 * math.pi)  # [m/rad] of the closed-form map
LAW = pytest.mark.parametrize("nut_map", MAPS.values(), ids=MAPS)


def begun(nut_map, model=FRICTION, **values):
    one = NativeModel(nut_map, True, model)
    one.latch(**values)
    one.initial_event()
    return one


INSIDE = {
    FRICTION: {"preload": 3000.0, "speed": 20.0, "temperature": 310.0, "axial_load": 0.0},
    TRANSMISSION: {
        "preload": 2000.0, "position": -2e-6, "speed": 20.0, "velocity": 20.0 * RATIO, "temperature": 310.0,
    },
    MONITOR: {"torque": 0.8, "speed": 30.0, "temperature": 303.15, "axial_load": 0.0},
}  # fmt: skip
BEYOND = [
    *((FRICTION, {name: value}) for name, value in (
        ("axial_load", -2e4), ("preload", 2e4), ("preload", 40.0), ("speed", -321.0), ("temperature", 354.0),
    )),
    *((TRANSMISSION, {name: value}) for name, value in (
        ("position", -2e-5), ("position", 2e-5), ("preload", 40.0), ("speed", 321.0), ("temperature", 283.0),
    )),
    *((MONITOR, values) for values in (
        {"torque": 80.0}, {"torque": 1e-3}, {"torque": -0.1}, {"speed": 330.0}, {"temperature": 360.0},
        {"axial_load": 5000.0},
    )),
]  # fmt: skip


def test_in_range_changes_at_events_with_hysteresis():
    """The indicator of each input falls below 0 outside, in_range follows at the event, which is not repeated."""
    for model, outside in BEYOND:
        one = begun(MAPS[Law.THREE_PARAMETER], model, **INSIDE[model])
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
    fastest = MAPS[Law.THREE_PARAMETER].speed.hi
    one = begun(MAPS[Law.THREE_PARAMETER], speed=0.5 * fastest)
    for speed, sign in (
        (fastest * (1.0 + 1e-9), 1.0), (fastest * 1.001, -1.0), (fastest * (1.0 - 1e-9), -1.0),
    ):  # fmt: skip
        one.latch(speed=speed)
        assert sign * one.get("in_range_indicator") > 0.0
        one.event()


def test_the_monitor_holds_its_estimate_at_rest():
    one = begun(MAPS[Law.THREE_PARAMETER], MONITOR, torque=0.8, speed=30.0, speed_min=2.0)
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


STIFF = {"presliding_stiffness": 400.0, "presliding_damping": 1e-12}
ROOT = math.sqrt(400.0 / ELEMENTS)


def rates(one):
    return [one.get(f"{name}_rate") for name in ELEMENT_STATES]


def test_a_level_that_falls_takes_energy_and_elements_that_slide_follow_one_that_rises():
    """Sliding, energy is stored from the work of the motion; held at rest, a fall beyond 5 % is heat at an event."""
    nut_map = MAPS[Law.MECHANISTIC]
    one = begun(nut_map, preload=2000.0, speed=0.01, **STIFF)
    one.latch(preload=2400.0)
    assert [one.get(f"slip_indicator_{i}") > 0.0 for i in range(1, 7)] == [True] * 6
    stored = sum(one.get(name) * rate for name, rate in zip(ELEMENT_STATES, rates(one), strict=True))
    assert all(rate > 0.0 for rate in rates(one))
    assert one.get("power_loss") == pytest.approx(0.01 * one.get("friction_torque") - stored, rel=1e-12)
    one = begun(nut_map, preload=2000.0, presliding_side=1.0, **STIFF)
    held = 0.5 * sum(one.get(name) ** 2 for name in ELEMENT_STATES)
    for preload, falls in ((1995.0, False), (1500.0, True)):
        one.latch(preload=preload)
        level = nut_map.evaluate(preload, 0.0, 303.15).coulomb_torque
        assert one.get("friction_torque") == pytest.approx(level)
        assert (one.get("slip_indicator_3") < 0.0) is falls
    assert one.event()
    kept = 0.5 * sum(one.get(name) ** 2 for name in ELEMENT_STATES)
    assert one.get("heat") == pytest.approx(held - kept, rel=1e-12)
    assert not one.event()


@LAW
def test_model_exchange_keeps_energy_and_stiffness_while_a_load_is_held(nut_map):
    """Held at rest while the preload changes; beyond a factor of 4 the stiffness follows at an event, at the same
    energy; without preload what was stored is heat."""
    net = nut_map.defaults[1::2]
    stiffness = nut_map.presliding_stiffness(1200.0, 0.0, *net)
    one = begun(nut_map, preload=1200.0, presliding_side=0.05)
    torque, held = one.get("friction_torque"), [one.get(name) for name in ELEMENT_STATES]
    one.latch(preload=2400.0)
    one.event()
    assert one.get("friction_torque") == pytest.approx(torque, rel=1e-12)
    one.latch(preload=11000.0)
    assert one.get("stiffness_indicator") < 0.0
    one.event()
    higher = nut_map.presliding_stiffness(11000.0, 0.0, *net)
    assert one.get("friction_torque") == pytest.approx(torque * math.sqrt(higher / stiffness), rel=1e-12)
    assert [one.get(name) for name in ELEMENT_STATES] == pytest.approx(held)
    assert one.get("stiffness_indicator") > 0.0
    assert abs(one.get("heat")) <= 1e-18
    one.latch(preload=0.0)
    assert one.event()
    assert one.get("friction_torque") == 0.0
    assert one.get("heat") == pytest.approx(0.5 * sum(y * y for y in held), rel=1e-9)
    one.latch(preload=2000.0)
    one.event()
    assert one.get("stiffness_indicator") == 1.0  # nothing is held: exactly that of the loads


def test_elements_that_are_switched_off_while_they_slide_are_not_counted_twice():
    one = begun(MAPS[Law.THREE_PARAMETER], speed=5.0)
    sliding = one.get("power_loss")
    one.latch(presliding=0.0)
    assert one.event()
    assert [one.get(name) for name in ELEMENT_STATES] == [0.0] * 6
    assert one.get("power_loss") == pytest.approx(sliding, rel=1e-12)
    one.latch(presliding=1.0, **STIFF)
    one.event()
    assert rates(one) == pytest.approx([5.0 * ROOT] * 6)  # and stick when they are switched on again


@LAW
def test_power_balance_of_model_exchange(nut_map):
    """Shaft - nut - loss = rate of the stored energy, at random points: elements that stick and that slide, both nuts
    loaded and one.

    Of co-simulation: that of Python (tests/runtime), whose steps are the same (test_native_equivalence).
    """
    one, rng, modes = NativeModel(nut_map, True, TRANSMISSION), np.random.default_rng(6), set()
    for _ in range(200):
        angle, speed = rng.uniform(-2.0, 2.0), rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-3.0, 2.0)
        position = RATIO * angle - 5e-6 * rng.normal()
        velocity = RATIO * speed - 1e-4 * rng.normal()
        elements = dict(zip(ELEMENT_STATES, 0.05 * rng.normal(size=ELEMENTS), strict=True))
        one.reset(True)
        one.latch(angle=angle, speed=speed, position=position, velocity=velocity, **elements)
        one.initial_event()
        moving = dict(zip(ELEMENT_STATES, rates(one), strict=True))
        (stored,) = one.derivative(["stored_energy"], angle=speed, position=velocity, **moving)
        shaft, nut, loss = (one.get(name) for name in ("shaft_power", "nut_power", "power_loss"))
        assert abs(shaft - nut - loss - stored) <= 1e-9 * (abs(shaft) + abs(nut) + loss)
        assert loss >= 0.0
        speeds = np.abs(list(moving.values()))
        modes |= set((speeds > 0.5 * speeds.max()).tolist())
    assert modes == {True, False}


RATES = [f"{name}_rate" for name in ELEMENT_STATES]
# next to no damping, which in a step is that of its mean
FROM_REST = {"presliding_stiffness": 1500.0, "presliding_damping": 1e-12, "presliding_side": 1e-20}


def profile(swing, count=120):
    """Inputs held over steps: slow and fast motion, reversals, rests; loads that swing, once beyond the map."""
    rng, rows, speed = np.random.default_rng(3), [], 0.4
    for n in range(count):
        if n % 7 == 0:
            speed = (-1.0) ** (n // 7) * 10.0 ** rng.uniform(-0.2, 0.7)
        rows.append({
            "speed": 0.0 if n % 19 == 18 else speed, "preload": 2000.0 + swing * math.sin(0.2 * n),
            "temperature": 400.0 if swing and 30 <= n < 33 else 303.15, "axial_load": 1.5 * swing * (n >= 40),
        })  # fmt: skip
    return rows


def exchange_step(one, row):
    """Heat and events of a step of model exchange at constant inputs: rates are constant between events, so these are
    where lines cross 0."""
    one.latch(**row)
    one.event()  # the inputs jump
    left, heat, events = 1e-3, 0.0, 0
    while left > 0.0:
        now, states, rates = (one.values(names) for names in (INDICATORS, ELEMENT_STATES, RATES))
        power = one.get("power_loss")
        one.latch(**dict(zip(ELEMENT_STATES, states + left * rates, strict=True)))
        then = one.values(INDICATORS)
        crossed = (now > 0.0) & (then <= 0.0)
        taken = left * min([1.0, *(now[crossed] / (now - then)[crossed])])
        heat, left = heat + taken * power, left - taken
        if crossed.any():  # beyond by rounding: the indicator has changed its sign
            beyond = states + (taken * (1.0 + 1e-13) + 1e-18) * rates
            one.latch(**dict(zip(ELEMENT_STATES, beyond, strict=True)))
            one.event()
            events += 1
    return heat, events


def test_model_exchange_has_the_states_torques_and_heat_of_co_simulation():
    """To rounding while the Coulomb torque stays; or within the time in which elements that slide follow it."""
    for swing, tolerance in ((0.0, 1e-9), (600.0, 0.1)):
        rows, total = profile(swing), np.zeros(2)
        exchange, steps = (NativeModel(MAPS[Law.THREE_PARAMETER], continuous=c) for c in (True, False))
        for one in (exchange, steps):
            one.latch(**FROM_REST, **rows[0])
        exchange.initial_event()
        for row in rows:
            total += exchange_step(exchange, row)
            steps.step(1e-3, **row)
            assert abs(exchange.get("friction_torque") - steps.get("friction_torque")) <= tolerance
            if not swing:
                difference = exchange.values(ELEMENT_STATES) - steps.values(ELEMENT_STATES)
                assert np.max(np.abs(difference)) <= 1e-8
        heat, events = total
        heat += exchange.get("heat")
        assert abs(heat - steps.get("heat")) <= tolerance * heat
        assert events >= 60
