"""BallScrewFriction against its Python twin over random steps; derivatives of all models without dynamics."""

import math

import numpy as np
import pytest
from native_model import NativeModel
from synthetic_map import LAWS, closed_form

from ballscrew_fmu.checks.reference import friction_step
from ballscrew_fmu.models import FRICTION, MONITOR, TRANSMISSION
from ballscrew_fmu.variables.friction import ELEMENT_STATES
from ballscrew_tehl.runtime.packed import Law
from ballscrew_tehl.runtime.standstill import RELAXED, initial_elements

pytestmark = pytest.mark.slow
MAPS = {law: closed_form(law) for law in LAWS} | {"oversize": closed_form(Law.MECHANISTIC, 0.3)}
AGREEMENT = 1e-9  # of a value, or the largest part that it is the sum of: libm and the order of sums differ
RATIO = 8e-3 / (2.0 * math.pi)  # [m/rad] of the closed-form map
WAY = 4.4e-6  # [m] about that at which a nut comes free at 2 kN
TORQUES = ("friction_torque", "viscous_torque", "hysteresis_torque", "sliding_torque", "friction_torque_nut_a",
           "friction_torque_nut_b")  # fmt: skip


@pytest.fixture(params=MAPS)
def nut_map(request):
    return MAPS[request.param]


def starts(model, nut_map):
    table = model.variables(nut_map.header)
    return {v.name: v.start or 0.0 for v in table if v.causality == "parameter"}


def outputs_of(model, nut_map):
    return [v.name for v in model.variables(nut_map.header) if v.causality == "output"]


def standstill(rng, n):
    return {
        "presliding": float(n % 4 > 0),
        "presliding_stiffness": (0.0, 150.0, 2000.0)[n % 3],
        "presliding_damping": (0.0, 0.4)[n // 5 % 2],
        "regularization_speed": (0.0, 0.1, 2.0)[n // 7 % 3],
        "breakaway_factor": (0.5, 2.0)[n % 2],  # 1 is a kink
        "net_sliding_coefficient": rng.uniform(0.0, 0.01),
        "apparent_viscosity_ratio": rng.uniform(0.5, 9.0),
        "roughness_height": (0.0, 24e-9, 2e-7)[n // 3 % 3],
        "seal_torque": (0.0, 0.05, 0.4)[n % 3],
    }


def loads(rng, n):
    preload = 10.0 ** rng.uniform(1.5, 4.15)
    return {
        "preload": 0.0 if n % 17 == 0 else preload,
        "speed": 0.0 if n % 23 == 0 else rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-3.0, 2.7),
        "temperature": rng.uniform(279.0, 357.0),
        "axial_load": 0.0 if n % 3 == 0 else 2.0 * rng.normal() * preload,
        "temperature_difference": 0.0 if n % 5 < 2 else 24.0 * math.sin(7.0 * n),
    }


def motion(rng, n):
    inputs = loads(rng, n)
    del inputs["axial_load"]
    inputs["temperature_difference"] *= inputs["preload"] > 2000.0  # that of less may be lost: a kink
    angle = rng.normal() * 100.0
    return inputs | {
        "angle": angle,
        "position": RATIO * angle - rng.normal() * WAY * 10.0 ** rng.uniform(-3.0, 0.3),
        "velocity": RATIO * inputs["speed"] - rng.normal() * 10.0 ** rng.uniform(-6.0, -2.5),
    }


def measured(rng, n):
    torque = float(rng.choice([-1.0, 1.0])) * 10.0 ** rng.uniform(-3.0, 1.0)
    speed = math.copysign(10.0 ** rng.uniform(-2.0, 2.6), torque if n % 11 else -torque)
    axial_load = rng.normal() * 3000.0 * (n % 4 > 0)
    return {
        "torque": torque, "speed": speed, "temperature": rng.uniform(280.0, 356.0), "axial_load": axial_load,
        "temperature_difference": 3.0 * math.sin(7.0 * n) * (n % 2),
    }  # fmt: skip


def test_random_steps_are_those_of_python(nut_map):
    """All outputs, the elements and the heat; steps of any length, also of 0; loads and parameters jump."""
    one, quiet = NativeModel(nut_map), NativeModel(nut_map)
    rng, names, start = np.random.default_rng(5), outputs_of(FRICTION, nut_map), starts(FRICTION, nut_map)
    before, heat, in_range = RELAXED, 0.0, set()
    for n in range(2000):
        inputs, given = loads(rng, n), start | standstill(rng, n // 20)
        step = 0.0 if n % 13 == 12 else 10.0 ** rng.uniform(-6.0, -1.0)
        if n % 100 == 0:
            before, heat = RELAXED, 0.0
            for each in (one, quiet):
                each.reset()
        for each in (one, quiet):
            each.step(step, **inputs, **given)
        expected, elements = friction_step(nut_map, inputs | given, step, before)
        heat = expected["heat"] = heat + step * expected["power_loss"]
        parts = sum(abs(expected[name]) for name in TORQUES[1:4])
        scale = dict.fromkeys(TORQUES, parts)
        # heat is the difference of two energies
        losses = parts * abs(inputs["speed"]) + max(before.energy, elements.energy) / max(step, 1e-9)
        scale["power_loss"] = losses + expected["power_loss"]
        for name in names:
            error, full = abs(one.get(name) - expected[name]), max(abs(expected[name]), scale.get(name, 0.0))
            assert error <= AGREEMENT * full + 1e-18, (name, n, one.get(name), expected[name])
        for name, state in zip(ELEMENT_STATES, elements.states, strict=True):
            assert one.get(name) == pytest.approx(state, rel=1e-9, abs=1e-15)
        in_range.add(bool(expected["in_range"]))
        assert (one.get("range_margin") >= 0.0) == expected["in_range"]
        if n % 100 == 99:
            assert quiet.get("heat") == pytest.approx(one.get("heat"), rel=1e-12)  # read or not
            assert heat > 0.0
        before = elements
    assert in_range == {True, False}


def test_the_elements_start_at_their_side_or_that_of_the_speed(nut_map):
    model, net = NativeModel(nut_map), nut_map.defaults[1::2]
    stiffness = nut_map.presliding_stiffness(2000.0, 0.0, *net)
    for speed, side in ((0.0, 0.0), (-5.0, 0.0), (5.0, -1.0), (5.0, 0.4), (0.0, 3.0)):
        coulomb = nut_map.evaluate(2000.0, speed, 303.15).coulomb_torque
        expected = initial_elements(side, speed, coulomb, stiffness).states
        for continuous in (False, True):
            model.reset(continuous)
            model.latch(presliding_side=side, speed=speed)
            if continuous:
                model.initial_event()
                assert [model.event(), model.event()] == [any(expected), False]
            assert [model.get(name) for name in ELEMENT_STATES] == pytest.approx(expected, rel=1e-12)
    model.reset()
    model.latch(speed=5.0, presliding_element_2=1e-4)  # one that is set is kept
    model.step(1e-9)
    assert model.get("presliding_element_2") == pytest.approx(1e-4, rel=1e-3)


WIDTHS = {  # [unit] of a difference quotient; None: a share of the value
    FRICTION: dict.fromkeys(
        ("preload", "speed", "temperature", "axial_load", "temperature_difference", "presliding_element_3",
         "net_sliding_coefficient",
         "apparent_viscosity_ratio", "breakaway_factor", "presliding_stiffness", "presliding_damping", "seal_torque")
    ),
    TRANSMISSION: dict.fromkeys(
        ("speed", "preload", "temperature", "temperature_difference", "nut_stiffness", "contact_damping_time")
    )
    | {"angle": 1e-4 * WAY / RATIO, "position": 1e-4 * WAY, "velocity": 1e-7, "presliding_element_3": 1e-7},
    MONITOR: {
        "torque": 1e-4, "speed": 1e-3, "temperature": 1e-2, "axial_load": 0.1, "temperature_difference": 1e-3,
        "apparent_viscosity_ratio": 1e-4,
        "net_sliding_coefficient": 1e-7, "roughness_height": 1e-12, "breakaway_factor": 1e-4,
        "regularization_speed": 1e-3, "speed_min": 1e-4, "torque_uncertainty": 1e-5, "initial_preload": 0.1,
        "law_uncertainty": 1e-5, "seal_torque": 1e-5,
    },
}  # fmt: skip


@pytest.mark.parametrize(("model", "name"), [(FRICTION, "friction_torque"), (MONITOR, "preload")])
def test_derivative_along_the_axial_load_at_its_start(model, name, nut_map):
    one, at = NativeModel(nut_map, model=model), {"speed": 30.0, "temperature": 303.15}
    at |= {"torque": 0.8} if model is MONITOR else {"preload": 2000.0}

    def value(load):
        one.latch(**at, axial_load=load)
        return one.get(name)

    # of a positive load: the sides of this map are not alike
    difference = (4.0 * value(1.0) - value(2.0) - 3.0 * value(0.0)) / 2.0
    (found,) = one.derivative([name], axial_load=1.0)
    assert abs(found - difference) <= 1e-4 * abs(difference)
    assert one.derivative([name], axial_load=-2.0) == [-2.0 * found]
    assert abs(difference) > 0.0


SPREAD = 3e-3 * np.array([1.0, -3.0, 4.0, 7.0, -9.0, 11.0])  # of states: of the size of their limits


@pytest.mark.parametrize("continuous", [False, True])
@pytest.mark.parametrize("model", WIDTHS, ids=lambda model: model.layer)
def test_derivatives_are_those_of_the_outputs(model, nut_map, continuous):
    one = NativeModel(nut_map, continuous, model)
    rng = np.random.default_rng(3)
    start = starts(model, nut_map)
    outputs = [name for name in outputs_of(model, nut_map) if name != "in_range"]
    outputs += [f"{name}_rate" for name in ELEMENT_STATES] if model is not MONITOR else []
    sharp = tried = 0
    for n in range(1, 40 if model is MONITOR else 150):
        base = start | {k: v for k, v in standstill(rng, n).items() if k in start}
        base |= {FRICTION: loads, TRANSMISSION: motion, MONITOR: measured}[model](rng, n)
        if model is MONITOR:
            base |= {"speed_min": (0.01, 1.0)[n % 2], "roughness_height": 3e-8}
        else:
            base |= {name: float(y) for name, y in zip(ELEMENT_STATES, rng.normal() * SPREAD, strict=True)}
        step = 0.0 if continuous or n % 4 == 0 or model is MONITOR else 10.0 ** rng.uniform(-5.0, -1.0)

        def outputs_at(base=base, step=step, later=n % 2 > 0, **change):
            one.reset(continuous)
            one.latch(**base)
            if continuous and later and model is not MONITOR:
                one.initial_event()  # the state belongs to the stiffness of these loads
            if step:
                one.step(step, **base | change)
            else:
                one.latch(**base | change)
            return one.values(outputs)

        values = outputs_at()
        if model is MONITOR and abs(base["speed"]) > base["speed_min"] and not one.get("in_range"):
            continue  # where the torque does not determine the preload, it counts as constant
        full = np.maximum(np.abs(values), 1e-9 * np.abs(values).max())
        for name, absolute in WIDTHS[model].items():
            if base[name] == 0.0 and name not in ("angle", "presliding_damping"):
                continue  # a kink
            outputs_at()
            found = np.array(one.derivative(outputs, **{name: 1.0}))
            width = absolute or 1e-5 * max(abs(base[name]), 1e-5)
            wide, narrow = (
                (outputs_at(**{name: base[name] + w}) - outputs_at(**{name: base[name] - w})) / (2.0 * w)
                for w in (width, 0.5 * width)
            )
            # of the sensitivity of the monitor, itself a difference quotient, the program keeps fewer digits
            noise = (1e-10 if model is MONITOR else 1e-12) * np.maximum(full, abs(values[:7]).max()) / width
            allowed = 3.0 * np.abs(wide - narrow) + 1e-5 * np.abs(narrow) + noise
            wrong = ~(np.abs(found - narrow) <= allowed)
            if nut_map.oversize and "range_margin" in outputs and abs(one.get("range_margin")) < 0.01:
                wrong[outputs.index("range_margin")] = False  # flanks that part within the width: a kink
            assert not wrong.any(), (n, name, [outputs[i] for i in np.flatnonzero(wrong)], found, narrow)
            sharp += int((allowed <= 1e-2 * np.abs(narrow)).sum())
            tried += np.count_nonzero(narrow)
        seeds = {n: (-1.0) ** i * (abs(base[n]) + 1e-3) for i, n in enumerate(list(WIDTHS[model])[:4])}
        outputs_at()
        alone = [s * np.array(one.derivative(outputs, **{name: 1.0})) for name, s in seeds.items()]
        together = np.array(one.derivative(outputs, **seeds))
        slack = (1e-4 if model is MONITOR else 1e-9) * np.sum(np.abs(alone), axis=0) + 1e-12 * full.max()
        assert (np.abs(together - np.sum(alone, axis=0)) <= slack).all(), n
    assert sharp > 0.4 * tried
