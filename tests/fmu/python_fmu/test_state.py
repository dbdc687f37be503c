"""FMU state: get, set, free, serialize; complete including the bristle and reported warnings."""

import math

import fmpy
import pytest
from synthetic_map import make_map

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.python_fmu.package import build_fmu

START = {"presliding_stiffness": 400.0, "presliding_damping": 0.5, "preload": 1500.0}
LATER = (0.002, 0.02, -0.01, 1.0, 0.0)


def wound(unpacked):
    """An instance with a bristle deflected in its elastic range, at inputs that do not reveal it."""
    one = FmuInstance(unpacked, **START)
    one.step(1e-3, speed=0.2)
    one.step(1e-3, speed=0.0)
    return one


def go_on(instance):
    return [(instance.step(1e-3, speed=speed), instance.outputs()) for speed in LATER]


def test_state_can_be_restored_repeatedly(unpacked):
    with wound(unpacked) as one:
        state = one.slave.getFMUstate()
        first = go_on(one)
        one.set(preload=9000.0, roughness_height=0.0, presliding_stiffness=0.0)
        one.step(1e-3)
        for _ in range(2):
            one.slave.setFMUstate(state)
            assert go_on(one) == first
        one.slave.freeFMUstate(state)


def test_the_bristle_is_part_of_the_state(unpacked):
    with wound(unpacked) as one:
        assert one.get("hysteresis_torque") > 0.0  # deflected at rest
        state = one.slave.getFMUstate()
        one.step(1e-3, speed=-0.2)
        one.step(1e-3, speed=0.0)
        assert one.get("hysteresis_torque") == pytest.approx(0.0, abs=1e-12)
        one.slave.setFMUstate(state)
        one.step(1e-3, speed=0.0)
        assert one.get("hysteresis_torque") > 0.0


def test_a_serialized_state_continues_in_a_fresh_instance(unpacked):
    with wound(unpacked) as one, FmuInstance(unpacked, initialize=False) as other:
        content = one.slave.serializeFMUstate(one.slave.getFMUstate())
        assert one.slave.serializeFMUstate(one.slave.getFMUstate()) == content
        other.slave.setFMUstate(other.slave.deSerializeFMUstate(content))
        other.time = one.time
        assert other.outputs() == one.outputs()
        assert go_on(other) == go_on(one)


def test_values_that_are_not_finite_are_kept(unpacked):
    with FmuInstance(unpacked) as one:
        one.set(speed=math.nan, axial_load=-math.inf)
        content = one.slave.serializeFMUstate(one.slave.getFMUstate())
        one.set(speed=1.0, axial_load=0.0)
        one.slave.setFMUstate(one.slave.deSerializeFMUstate(content))
        assert math.isnan(one.get("speed"))
        assert one.get("axial_load") == -math.inf


def test_a_warning_is_not_repeated_after_restoring(unpacked):
    with FmuInstance(unpacked) as one:
        one.step(temperature=0.0)
        state = one.slave.getFMUstate()
        one.slave.setFMUstate(state)
        one.step(temperature=0.0)
        assert [status for status, _ in one.messages] == [1]


@pytest.mark.slow
def test_a_state_of_another_map_or_damaged_is_refused_and_the_steps_after_it_too(unpacked, tmp_path):
    other = build_fmu(make_map(viscous_scale=2.0), tmp_path / "other.fmu").path
    with FmuInstance(unpacked) as one, FmuInstance(other) as two:
        good = two.slave.getFMUstate()
        for content in (one.slave.serializeFMUstate(one.slave.getFMUstate()), b"\xff{", b"[1]"):
            two.slave.setFMUstate(two.slave.deSerializeFMUstate(content))
            assert two.messages[-1][0] == 3
            assert "damaged or of another version or map" in two.messages[-1][1]
            assert two.step(speed=1.0) is False
        two.slave.setFMUstate(good)
        assert two.step(speed=1.0) is True


def test_an_fmu_with_a_damaged_map_is_not_instantiated(fmu, tmp_path):
    folder = fmpy.extract(str(fmu), unzipdir=str(tmp_path / "damaged"))
    path = tmp_path / "damaged" / "resources" / "nut_map.npz"
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(Exception, match="Failed to instantiate"):
        FmuInstance(folder)
