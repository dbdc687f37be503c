"""BallScrewFriction for Python hosts through fmpy: values, start, bad input, damaged states.

What it has in common with the native FMUs: tests/fmu/native_fmu.
"""

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
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import MECHANISTIC, sealed

OK, WARNING, DISCARD, ERROR = 0, 1, 2, 3


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
            assert sum(one.get("hysteresis_torque", "sliding_torque")) == pytest.approx(
                part * coulomb, rel=1e-12
            )
            assert one.step(1e-9, speed=1e-6)
            assert sum(one.get("hysteresis_torque", "sliding_torque")) == pytest.approx(
                part * coulomb, rel=1e-3
            )


def test_a_bad_start_value_can_be_replaced_also_from_a_saved_state(unpacked):
    """The elements then slides in the direction of the speed, as if the good value had been there at once. A fixed
    parameter can be replaced after a reset."""
    for name, value, limit in (("presliding_side", -1.1, ">= -1"), ("refine_tolerance", 0.0, "> 0")):
        with FmuInstance(unpacked, **{name: value}) as one:
            assert one.step() is False
            assert one.messages[-1] == (DISCARD, f"{name} = {value}; needs a finite number {limit}")
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
