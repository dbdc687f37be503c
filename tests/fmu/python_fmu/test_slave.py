"""BallScrewFriction for Python hosts through fmpy: values, standstill, bad input, order of calls, saved states."""

import math
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from native_library import NativeInstance
from synthetic_map import make_map

from ballscrew_fmu.checks.reference import friction_results
from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_fmu.variables.friction import origin_text
from ballscrew_tehl.runtime.constants import DAMPING_TIME
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import MECHANISTIC, sealed

OK, WARNING, DISCARD, ERROR = 0, 1, 2, 3
COULOMB = ("hysteresis_torque", "sliding_torque")
WOUND = {"presliding_stiffness": 400.0, "presliding_damping": 0.5, "preload": 1500.0}


def of_status(instance, status):
    return [text for found, text in instance.messages if found == status]


def go_on(instance, speeds=(0.002, 0.02, -0.01, 1.0, 0.0)):
    return [(instance.step(1e-3, speed=speed), instance.outputs()) for speed in speeds]


def test_outputs_equal_the_map_and_the_law_over_random_inputs_and_parameters(unpacked, synthetic_nut_map):
    """Jumping loads, rests and reversals in and beyond the map; tanh, and presliding of the screw or set."""
    rng = np.random.default_rng(6)
    for given in ({"presliding": False}, {}, {"presliding_stiffness": 400.0, "presliding_damping": 0.7}):
        rows = [
            {
                "preload": float(rng.choice([0.0, 10.0, 2000.0, 9000.0, 13000.0])),
                "speed": float(rng.choice([0.0, 1e-2, 330.0]) * rng.uniform(-1.0, 1.0)),
                "temperature": float(rng.uniform(280.0, 360.0)),
                "axial_load": float(rng.choice([0.0, 3000.0]) * rng.uniform(-1.0, 1.0)),
                "apparent_viscosity_ratio": float(rng.uniform(1.0, 9.0)),
                "breakaway_factor": float(rng.uniform(1.0, 2.0)),
            }
            for _ in range(200)
        ]
        for size in (1e-6, 1e-3, 0.1):
            expected = friction_results(synthetic_nut_map, rows, size, **given)
            with FmuInstance(unpacked, **given) as one:
                for row, wanted in zip(rows, expected, strict=True):
                    assert one.step(size, **row)
                    assert one.outputs() == pytest.approx(wanted, rel=1e-9, abs=1e-15)
            assert {wanted["in_range"] for wanted in expected} == {True, False}


def test_the_elements_start_on_the_side_of_the_speed_or_as_set(unpacked, synthetic_nut_map):
    coulomb = synthetic_nut_map.evaluate(2000.0, 4.0, 303.15).coulomb_torque
    for side, part in ((0.0, 1.0), (-1.0, -1.0), (0.25, 16.0 / 36.0)):
        with FmuInstance(unpacked, speed=4.0, presliding_side=side) as one:
            assert sum(one.get(*COULOMB)) == pytest.approx(part * coulomb, rel=1e-12)
            assert one.step(1e-9, speed=1e-6)
            assert sum(one.get(*COULOMB)) == pytest.approx(part * coulomb, rel=1e-3)


def test_an_input_outside_the_map_is_that_of_its_limit_and_reported_once(unpacked):
    limits = {"preload": (1e9, 12000.0), "temperature": (0.0, 283.15), "speed": (400.0, 320.0)}
    for name, (value, limit) in (limits | {"axial_load": (1e6, None)}).items():
        with FmuInstance(unpacked, speed=30.0) as one, FmuInstance(unpacked, speed=30.0) as other:
            for _ in range(2):
                assert one.step(**{name: value})
                assert one.get("in_range") is False
            assert [text.split()[0] for text in of_status(one, WARNING)] == [name]
            if limit:
                assert other.step(**{name: limit})
                assert one.get("friction_torque") == pytest.approx(other.get("friction_torque"), rel=1e-12)
            content = one.slave.serializeFMUstate(one.slave.getFMUstate())
            other.slave.setFMUstate(other.slave.deSerializeFMUstate(content))
            assert other.step(**{name: value})  # what was reported belongs to the state
            assert other.messages == []
    with FmuInstance(unpacked, preload=0.0, temperature=0.0) as zeros:
        assert zeros.step(0.0)
        assert zeros.get("friction_torque", "power_loss", "in_range") == [0.0, 0.0, False]


def test_a_step_that_is_too_long_for_presliding_is_reported_once(unpacked):
    for factor, count in ((0.98, 0), (1.02, 1)):
        with FmuInstance(unpacked, presliding_side=0.1) as one:
            for speed in (0.0, 10.0, 0.0):  # at rest, elastic or not, or while it slides: no matter
                one.step(1.0, speed=speed)
            assert one.messages == []
            for speed in (-0.1, 0.1, -0.1):
                assert one.step(factor * DAMPING_TIME, speed=speed)
            assert len(of_status(one, WARNING)) == count


NUMBERS = ("preload", "speed", "temperature", "axial_load", "roughness_height", "net_sliding_coefficient")


def test_a_bad_value_discards_the_step_and_changes_nothing(unpacked):
    bad = [(name, value) for name in NUMBERS for value in (math.nan, math.inf, -math.inf, 1e40)]
    bad += [(name, -1e-9) for name in (*NUMBERS[4:], "presliding_stiffness", "regularization_speed")]
    bad += [("refine_tolerance", 0.0)]
    with FmuInstance(unpacked, speed=0.01) as one, FmuInstance(unpacked, speed=0.01) as undisturbed:
        for name, value in bad:
            for each in (one, undisturbed):
                assert each.step()
            good, before = one.get(name), one.outputs()
            assert one.step(**{name: value}) is False
            assert one.outputs() == before
            status, text = one.messages[-1]
            assert (status, text.split("; needs a finite number")[0]) == (DISCARD, f"{name} = {value}")
            assert one.step(**{name: good})
            assert undisturbed.step()
            assert one.outputs() == undisturbed.outputs()
        for size in (-1e-3, math.nan, math.inf):
            assert one.step(size) is False
            assert "step size" in one.messages[-1][1]
        assert one.outputs() == undisturbed.outputs()


def test_a_bad_start_value_can_be_replaced_also_from_a_saved_state(unpacked):
    """The elements then slides in the direction of the speed, as if the good value had been there at once. A fixed
    parameter can be replaced after a reset."""
    with FmuInstance(unpacked, presliding_side=-1.1) as one:
        assert one.step() is False
        assert one.messages[-1] == (DISCARD, "presliding_side = -1.1; needs a finite number >= -1")
    for restored in (False, True):
        with FmuInstance(unpacked, speed=math.nan) as one, FmuInstance(unpacked, speed=0.01) as good:
            assert one.messages == [(DISCARD, "speed = nan; needs a finite number")]
            assert one.step() is False
            if restored:
                content = one.slave.serializeFMUstate(one.slave.getFMUstate())
                assert one.step(speed=-2.0)
                one.slave.setFMUstate(one.slave.deSerializeFMUstate(content))
                one.time = 0.0
                assert math.isnan(one.get("speed"))
            assert go_on(one, (0.01, 0.01)) == go_on(good, (0.01, 0.01))


def test_outputs_follow_the_inputs_while_initializing_and_steps_afterwards(unpacked):
    with FmuInstance(unpacked, initialize=False) as one:
        assert one.step() is False
        assert "exitInitializationMode" in one.messages[-1][1]
        one.slave.setupExperiment(startTime=0.0)
        one.slave.enterInitializationMode()
        seen = []
        for speed in (10.0, 20.0):
            one.set(speed=speed)
            seen.append(one.get("friction_torque"))
        one.slave.exitInitializationMode()
        one.set(speed=10.0)
        assert one.get("friction_torque") == seen[1] > seen[0]
        assert one.step(10.0)
        assert one.get("friction_torque") == pytest.approx(seen[0], rel=1e-12)
        one.slave.terminate()
        assert one.step() is False


def test_an_exception_is_logged_and_has_no_effect(unpacked):
    """An exception of the Python code would kill the process when the instance is freed (pythonfmu 0.7)."""
    with FmuInstance(unpacked) as one:
        one.step(speed=30.0)
        before = one.outputs()
        package = next(Path(unpacked).glob("resources/_ballscrew_*")).name  # others may be loaded as well
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(f"{package}.python_fmu_slave.presliding_friction", None)
            assert one.step(presliding_stiffness=1.0) is False
        assert one.messages[-1][1].startswith("step failed: TypeError")
        assert one.outputs() == before
        assert one.step() is True


# --- saved states ---


def test_a_state_is_complete_can_be_restored_repeatedly_and_continues_in_another_instance(unpacked):
    """The elements are loaded at rest: inputs and outputs set afterwards do not reveal it."""
    with FmuInstance(unpacked, **WOUND) as one, FmuInstance(unpacked, initialize=False) as other:
        go_on(one, (0.2, 0.0))
        assert one.get("hysteresis_torque") > 0.0
        state = one.slave.getFMUstate()
        content = one.slave.serializeFMUstate(state)
        first = go_on(one)
        one.set(preload=9000.0, roughness_height=0.0, presliding_stiffness=0.0, presliding=False)
        one.step(1e-3)
        for _ in range(2):
            one.slave.setFMUstate(state)
            assert go_on(one) == first
        one.slave.freeFMUstate(state)
        other.slave.setFMUstate(other.slave.deSerializeFMUstate(content))
        assert other.slave.serializeFMUstate(other.slave.getFMUstate()) == content
        other.time = one.time
        assert go_on(other) == first
        other.slave.reset()
        other._initialize({})
        other.time = 0.0
        with FmuInstance(unpacked) as fresh:
            assert go_on(other) == go_on(fresh)


def refused(call, *arguments):
    with pytest.raises(FMICallException) as error:
        call(*arguments)
    assert error.value.status == ERROR


def test_a_state_of_another_map_or_damaged_is_refused_and_the_steps_after_it_too(unpacked, tmp_path):
    other = build_fmu(make_map(viscous_scale=2.0), tmp_path / "other.fmu").path
    with FmuInstance(unpacked) as one, FmuInstance(other) as two:
        good = two.slave.getFMUstate()
        content = two.slave.serializeFMUstate(good)
        another = two.slave.deSerializeFMUstate(one.slave.serializeFMUstate(one.slave.getFMUstate()))
        for call, given, reason in (
            (two.slave.setFMUstate, another, "of another version or map"),
            *((two.slave.deSerializeFMUstate, text, "damaged")
              for text in (b"\xff{", b"", b"[1]", content[:-1], content[:-20] + b"1" + content[-19:])),
        ):  # fmt: skip
            refused(call, given)
            assert two.messages[-1][0] == ERROR
            assert reason in two.messages[-1][1]
            refused(two.step)
            assert "called in Error" in two.messages[-1][1]
            two.slave.setFMUstate(good)
            assert two.step(speed=1.0) is True


def test_friction_numbers_of_another_screw_are_reported_once(tmp_path):
    """The text of the header; here and in a native FMU, whose compiler and printf would misread it."""
    made = make_map(law=MECHANISTIC)
    says = 'measured on A, not on "B" 50 % \\ ??/ \u00e4'
    catalogue = {"preload": 2000.0, "torque": 0.5048}
    friction = {"set": "mechanistic", "loss": "", "provenance": "of A", "errors": {}, "limits": {}}
    friction |= {"not_identified": None, "carried_over": says, "catalogue": catalogue}
    band = {"preload": 2000.0, "speed": 10.0, "temperature": 303.15, "low": 0.7, "high": 1.6, "fitted": False}
    header = {**made.header, "friction": friction, "mechanistic_interval": band}
    text = origin_text(header)
    assert text.startswith(says + "; catalogue torque 0.505 N.m at 2000 N; torque 0.70 to 1.60 times")
    nut_map = NutMap(sealed(header, made.arrays), made.arrays)
    with FmuInstance(build_fmu(nut_map, tmp_path / "python.fmu").path) as one:
        go_on(one)
        # % is doubled in FMI 2, whose message is a format of printf
        assert [found.replace("%%", "%") for found in of_status(one, WARNING)] == [text]
    for version in (2, 3):
        with NativeInstance(version, nut_map=nut_map) as native:
            native.start().go()
            found = [message.text for message in native.opening if message.status == WARNING]
            assert [line.replace("%%", "%") for line in found] == [text]
