"""The FMU through fmpy: values, signs, standstill, bad input, order of calls."""

import math

import fmpy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ballscrew_fmu.checks.replay import FmuInstance, replay
from ballscrew_tehl.runtime.constants import DAMPING_TIME
from ballscrew_tehl.runtime.nut_law import DoubleNutState
from ballscrew_tehl.runtime.standstill import Bristle, bristle_friction, presliding_step

WARNING, DISCARD, ERROR = 1, 2, 3
PARTS = ("viscous_torque", "hysteresis_torque", "sliding_torque")
DIRECT = DoubleNutState._fields[3:10]  # outputs taken from the map unchanged


def expected(
    nut_map, preload=2000.0, speed=0.0, temperature=303.15, axial_load=0.0, regularization_speed=0.1, heat=0.0
):
    """Outputs by name from the map itself, without presliding; while the bristle slides, the same with it."""
    state = nut_map.evaluate(preload, speed, temperature, axial_load)
    sign = math.tanh(speed / regularization_speed)
    each = {}
    for nut, force in forces_of_nuts(nut_map, preload, axial_load).items():
        two = nut_map.evaluate(force, speed, temperature)
        torque = math.copysign(two.viscous_torque, speed) + sign * two.coulomb_torque
        each[f"friction_torque_nut_{nut}"] = 0.5 * torque
    parts = (
        math.copysign(1.0, speed) * state.viscous_torque,
        sign * state.hysteresis_torque,
        sign * state.sliding_torque,
    )
    return {
        "friction_torque": sum(parts),
        **dict(zip(PARTS, parts, strict=True)),
        "power_loss": sum(parts) * speed,
        **{name: getattr(state, name) for name in DIRECT},
        "in_range": state.in_range,
        "range_margin": nut_map.range_margin(preload, speed, temperature, axial_load),
        "heat": heat,
        **each,
    }


def forces_of_nuts(nut_map, preload, axial_load):
    """Force of each nut [N] by its letter: a positive axial load loads A."""
    if axial_load == 0.0:
        return {"a": preload, "b": preload}
    relieved, loaded = nut_map._forces_point(preload, axial_load)
    forces = (min(loaded, nut_map.force.hi), relieved)
    return dict(zip("ab", forces if axial_load > 0.0 else forces[::-1], strict=True))


def test_outputs_equal_the_map_over_a_random_input_sequence(unpacked, synthetic_nut_map):
    rng = np.random.default_rng(5)
    rows = [
        {
            "preload": float(rng.uniform(0.0, 12000.0)),
            "speed": float(rng.choice([0.01, 1.0, 300.0]) * rng.uniform(-1.0, 1.0)),
            "temperature": float(rng.uniform(280.0, 360.0)),
            "axial_load": float(rng.choice([0.0, 9000.0]) * rng.uniform(-1.0, 1.0)),
        }
        for _ in range(200)
    ]
    rows[0]["presliding"] = False
    heat = 0.0
    for row, outputs in zip(rows, replay(unpacked, rows), strict=True):
        row.pop("presliding", None)
        reference = expected(synthetic_nut_map, **row)
        heat += 1e-3 * reference["power_loss"]
        assert outputs == pytest.approx(reference | {"heat": heat}, rel=1e-12, abs=1e-15)
    assert heat > 1.0


def test_outputs_with_presliding_equal_the_map_and_the_law(unpacked, synthetic_nut_map):
    """Jumping loads, rests and reversals, with the start values of the parameters."""
    rng, bristle, net = np.random.default_rng(6), Bristle(), synthetic_nut_map.defaults[1::2]
    with FmuInstance(unpacked) as one:
        for _ in range(300):
            row = {
                "preload": float(rng.choice([0.0, 10.0, 2000.0, 9000.0])),
                "speed": float(rng.choice([0.0, 1.0, 300.0]) * rng.uniform(-1.0, 1.0)),
                "axial_load": float(rng.choice([0.0, 3000.0]) * rng.uniform(-1.0, 1.0)),
            }
            assert one.step(**row)
            state = synthetic_nut_map.evaluate(temperature=303.15, **row)
            stiffness = synthetic_nut_map.presliding_stiffness(row["preload"], row["axial_load"], *net)
            law = bristle_friction(
                state.coulomb_torque, row["speed"], 1e-3, bristle, stiffness, DAMPING_TIME * stiffness
            )
            bristle = law.bristle
            parts = one.get(*PARTS)
            assert parts[1] + parts[2] == pytest.approx(law.sign * state.coulomb_torque, rel=1e-12, abs=1e-15)
            assert abs(parts[1] + parts[2]) <= state.coulomb_torque * (1.0 + 1e-15)
            power = law.power + state.viscous_torque * abs(row["speed"])
            assert one.get("power_loss") == pytest.approx(power, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize(("side", "share"), [(0.0, 1.0), (-1.0, -1.0), (0.25, 0.25)])
def test_the_bristle_starts_on_the_side_of_the_speed_or_as_set(unpacked, synthetic_nut_map, side, share):
    coulomb = synthetic_nut_map.evaluate(2000.0, 4.0, 303.15).coulomb_torque
    with FmuInstance(unpacked, speed=4.0, presliding_side=side) as one:
        assert sum(one.get(*PARTS[1:])) == pytest.approx(share * coulomb, rel=1e-12)
        assert one.step(1e-9, speed=1e-6)
        assert sum(one.get(*PARTS[1:])) == pytest.approx(share * coulomb, rel=1e-3)


@pytest.mark.parametrize(("step", "warns"), [(3.9e-3, False), (4.1e-3, True)])
def test_a_step_that_is_too_long_for_the_bristle_is_reported_once(unpacked, step, warns):
    with FmuInstance(unpacked) as one:
        one.step(1.0, speed=10.0)  # slides: no matter
        assert one.messages == []
        for speed in (-0.1, 0.1, -0.1):
            assert one.step(step, speed=speed)
        texts = [text for status, text in one.messages if status == WARNING]
        assert len(texts) == int(warns)
        assert all(
            text.startswith("step = 0.0041 s; ") and "= 0.004 s (logged once)" in text for text in texts
        )


def test_simulate_fmu_follows_an_input_signal(fmu, synthetic_nut_map):
    time = np.array([0.0, 0.1, 0.2])
    signal = np.array(
        list(zip(time, [30.0, 0.0, -30.0], strict=True)), dtype=[("time", float), ("speed", float)]
    )
    result = fmpy.simulate_fmu(
        str(fmu), input=signal, stop_time=0.2, output_interval=0.01, start_values={"preload": 3e3}
    )
    assert len(result) == 21
    assert result["friction_torque"][0] == pytest.approx(
        expected(synthetic_nut_map, 3000.0, 30.0)["friction_torque"], rel=1e-12
    )
    # the last row is that of the step from 0.19 s with the input at its start
    assert result["friction_torque"][-1] == pytest.approx(
        expected(synthetic_nut_map, 3000.0, -27.0)["friction_torque"], rel=1e-9
    )
    assert result["in_range"].all()


def test_values_after_initialization_are_those_of_the_map(unpacked, synthetic_nut_map):
    with FmuInstance(unpacked, preload=1500.0, speed=-40.0, temperature=310.0) as one:
        assert one.outputs() == pytest.approx(expected(synthetic_nut_map, 1500.0, -40.0, 310.0), rel=1e-12)


def test_outputs_follow_inputs_in_initialization_mode(unpacked, synthetic_nut_map):
    with FmuInstance(unpacked, initialize=False) as one:
        one.slave.setupExperiment(startTime=0.0)
        one.slave.enterInitializationMode()
        for speed in (10.0, 20.0):
            one.set(speed=speed)
            assert one.get("friction_torque") == pytest.approx(
                expected(synthetic_nut_map, speed=speed)["friction_torque"]
            )
        one.slave.exitInitializationMode()


def test_get_after_set_gives_the_values_of_the_last_step(instance):
    instance.step(speed=30.0)
    before = instance.outputs()
    instance.set(speed=-60.0, preload=500.0)
    assert instance.outputs() == before
    instance.step()
    assert instance.get("friction_torque") < 0.0
    before = instance.outputs()
    instance.set(speed=1.0)
    instance.slave.terminate()
    assert instance.outputs() == before


@pytest.mark.parametrize("speed", [-200.0, -0.3, -0.02, 0.02, 0.3, 200.0])
def test_each_part_opposes_motion(instance, speed):
    instance.step(10.0, speed=speed)
    parts = instance.get(*PARTS)
    assert all(part * speed > 0.0 for part in parts)
    assert instance.get("friction_torque") == pytest.approx(sum(parts), rel=1e-15)
    instance.step(10.0)  # in the step before, some work wound up the bristle
    assert instance.get("power_loss") == pytest.approx(speed * sum(parts))


def test_no_friction_at_rest(instance):
    instance.step(speed=0.0)
    assert instance.get("friction_torque", "power_loss", "film_thickness_min") == [0.0, 0.0, 0.0]
    assert instance.get("in_range")


def test_unconnected_inputs_are_clamped_and_flagged(unpacked):
    with FmuInstance(unpacked, preload=0.0, temperature=0.0, speed=0.0, axial_load=0.0) as one:
        for speed in (0.0, 30.0):
            one.step(speed=speed)
            values = one.outputs()
            assert values.pop("in_range") is False
            assert all(math.isfinite(value) for value in values.values())
            assert one.get("friction_torque") == 0.0
        warnings = [text for status, text in one.messages if status == WARNING]
        assert [text.split()[0] for text in warnings] == ["preload", "temperature"]  # once each


@pytest.mark.parametrize(
    ("inputs", "same_as"),
    [
        ({"preload": -1.0, "speed": 30.0}, {"preload": 0.0, "speed": 30.0}),
        ({"temperature": 0.0, "speed": 30.0}, {"temperature": 283.15, "speed": 30.0}),
        ({"preload": 1e9, "speed": 30.0}, {"preload": 12000.0, "speed": 30.0}),
    ],
)
def test_beyond_the_map(instance, synthetic_nut_map, inputs, same_as):
    assert instance.step(**inputs, presliding=False)
    point = {"preload": 2000.0, "temperature": 303.15, "axial_load": 0.0, **inputs}
    margin = synthetic_nut_map.range_margin(**point)
    assert margin < 0.0
    reference = expected(synthetic_nut_map, **same_as) | {"in_range": False, "range_margin": margin}
    reference["heat"] = 1e-3 * reference["power_loss"]
    assert instance.outputs() == pytest.approx(reference, rel=1e-12)


def test_10000_rpm(instance, synthetic_nut_map):
    speed = 10000.0 * math.pi / 30.0
    assert instance.step(speed=speed, presliding=False)
    fastest = expected(synthetic_nut_map, speed=320.0)
    assert instance.get("friction_torque") == pytest.approx(fastest["friction_torque"], rel=1e-12)
    assert instance.get("power_loss") == pytest.approx(fastest["friction_torque"] * speed, rel=1e-12)
    assert instance.get("in_range") is False


@pytest.mark.parametrize("presliding", [False, True])
@pytest.mark.parametrize("name", ["preload", "speed", "temperature", "axial_load", "roughness_height"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e40])
def test_a_value_that_is_not_finite_discards_the_step_and_changes_nothing(unpacked, name, bad, presliding):
    with (
        FmuInstance(unpacked, presliding=presliding, speed=0.01) as one,
        FmuInstance(unpacked, presliding=presliding, speed=0.01) as undisturbed,
    ):
        for each in (one, undisturbed):
            each.step()
        good = one.get(name)
        before = one.outputs()
        assert one.step(**{name: bad}) is False
        assert one.outputs() == before
        assert one.messages[-1] == (DISCARD, one.messages[-1][1])
        assert one.messages[-1][1].startswith(f"{name} = {bad}")
        assert one.step(**{name: good}) is True
        undisturbed.step()
        assert one.outputs() == undisturbed.outputs()


@pytest.mark.parametrize("name", ["net_sliding_coefficient", "presliding_stiffness", "regularization_speed"])
def test_a_negative_parameter_discards_the_step(instance, name):
    assert instance.step(speed=1.0, **{name: -1e-9}) is False
    assert instance.messages[-1] == (DISCARD, f"{name} = -1e-09; needs a finite number >= 0")


def test_a_refine_tolerance_of_zero_discards_the_step(instance):
    assert instance.step(speed=1.0, refine_tolerance=0.0) is False
    assert instance.messages[-1] == (DISCARD, "refine_tolerance = 0.0; needs a finite number > 0")


def test_a_bad_start_value_is_logged_and_can_be_replaced(unpacked, synthetic_nut_map):
    with FmuInstance(unpacked, speed=math.nan) as one:
        assert one.messages == [(DISCARD, "speed = nan; needs a finite number")]
        assert one.step() is False
        assert one.step(speed=5.0, presliding=False) is True
        reference = expected(synthetic_nut_map, speed=5.0)
        heat = 1e-3 * reference["power_loss"]
        assert one.outputs() == pytest.approx(reference | {"heat": heat}, rel=1e-12)


@pytest.mark.parametrize("restored", [False, True])
def test_after_a_bad_start_value_the_bristle_begins_with_the_good_one(unpacked, restored):
    """It slides in the direction of the speed, as if the good value had been there at once; from a state too."""
    with FmuInstance(unpacked, speed=math.nan) as one, FmuInstance(unpacked, speed=0.01) as good:
        assert one.step() is False
        if restored:
            content = one.slave.serializeFMUstate(one.slave.getFMUstate())
            assert one.step(speed=-2.0)
            one.slave.setFMUstate(one.slave.deSerializeFMUstate(content))
            one.time = 0.0
        for _ in range(3):
            assert one.step(speed=0.01)
            assert good.step(speed=0.01)
            assert one.outputs() == good.outputs()
        assert one.get("power_loss") > 0.0


@pytest.mark.parametrize("presliding", [False, True])
@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-6, 1.0])
def test_any_step_size(unpacked, size, presliding):
    with FmuInstance(unpacked, presliding=presliding) as one:
        for speed in (0.0, 1e-4, -3.0, 0.0):
            assert one.step(size, speed=speed)
            values = one.outputs()
            assert all(math.isfinite(value) for value in values.values())
            assert values["power_loss"] >= 0.0


@pytest.mark.parametrize("size", [-1e-3, math.nan, math.inf])
def test_an_impossible_step_size_discards(instance, size):
    assert instance.step(size, speed=1.0) is False
    assert "step size" in instance.messages[-1][1]


def test_step_before_initialization_and_after_terminate_is_discarded(unpacked):
    with FmuInstance(unpacked, initialize=False) as one:
        assert one.step() is False
        assert "exitInitializationMode" in one.messages[-1][1]
    with FmuInstance(unpacked) as one:
        one.slave.terminate()
        assert one.step() is False


def test_setting_an_output_is_logged_and_has_no_effect(instance):
    instance.step(speed=30.0)
    before = instance.outputs()
    instance.set(friction_torque=99.0)
    assert instance.messages[-1] == (ERROR, "friction_torque is not a Real input or parameter: not set")
    assert instance.outputs() == before


def test_reset_restores_the_start_values(unpacked):
    with (
        FmuInstance(unpacked) as fresh,
        FmuInstance(unpacked, preload=900.0, presliding_stiffness=100.0) as used,
    ):
        used.step(speed=0.01)
        used.slave.reset()
        used.slave.setupExperiment(startTime=0.0)
        used.slave.enterInitializationMode()
        used.slave.exitInitializationMode()
        assert used.get("preload", "presliding_stiffness") == [2000.0, 0.0]
        assert used.outputs() == fresh.outputs()


def test_friction_parameters_are_tunable_between_steps(instance, synthetic_nut_map):
    instance.step(speed=30.0, presliding=False)
    base = instance.outputs()
    instance.step(apparent_viscosity_ratio=3.8, net_sliding_coefficient=0.0102, regularization_speed=30.0)
    state = synthetic_nut_map.evaluate(2000.0, 30.0, 303.15)
    sign = math.tanh(1.0)
    assert instance.get("viscous_torque") == pytest.approx(base["viscous_torque"] / 2.0)
    assert instance.get("sliding_torque") == pytest.approx(2.0 * sign * state.sliding_torque)
    instance.step(roughness_height=0.0)
    assert instance.get("lambda_ratio") == 1000.0
    assert instance.get("viscous_torque") > base["viscous_torque"] / 2.0


def test_presliding_follows_the_bristle_and_keeps_the_viscous_part(unpacked, synthetic_nut_map):
    z, stiffness, damping, step = 0.0, 400.0, 0.7, 1e-3
    with FmuInstance(unpacked, presliding_stiffness=stiffness, presliding_damping=damping) as one:
        for speed in (0.02, 0.3, -0.01, 0.0, -5.0, 0.0):
            one.step(step, speed=speed)
            state = synthetic_nut_map.evaluate(2000.0, speed, 303.15)
            coulomb = state.coulomb_torque
            bristle = presliding_step(z, speed, step, coulomb, stiffness, damping)
            z = bristle.deflection
            viscous = math.copysign(state.viscous_torque, speed)
            parts = one.get(*PARTS)
            assert parts[0] == pytest.approx(viscous)
            assert parts[1] + parts[2] == pytest.approx(bristle.torque)
            assert parts[1] * state.sliding_torque == pytest.approx(parts[2] * state.hysteresis_torque)
            assert one.get("friction_torque") == pytest.approx(sum(parts))
            assert one.get("power_loss") == pytest.approx(bristle.heat / step + viscous * speed)


def test_presliding_holds_an_axis_that_creeps_with_the_regularisation(unpacked):
    """J = 0.01 kg m2, 0.125 N.m applied, steps of 1 ms, the rotor stepped explicitly."""

    def run(**parameters):
        omega = torque = angle = 0.0
        with FmuInstance(unpacked, preload=200.0, **parameters) as one:
            for _ in range(3000):
                new = omega + 1e-3 * (0.02 - torque) / 0.01
                one.step(1e-3, speed=omega)
                torque = one.get("friction_torque")
                angle += 1e-3 * omega
                omega = new
        return angle, omega

    held, speed = run(presliding_stiffness=100.0, presliding_damping=2.0)
    assert abs(speed) < 1e-9
    assert held == pytest.approx(0.02 / 100.0, rel=0.2)
    creeping, _ = run(presliding=False)
    assert creeping > 100.0 * held


@pytest.fixture(scope="module")
def unwound(unpacked):
    """One instance for all examples of a property, and its initial state."""
    with FmuInstance(unpacked) as one:
        yield one, one.slave.getFMUstate()


@settings(max_examples=40, deadline=None)
@given(
    run=st.lists(
        st.tuples(
            st.floats(-300.0, 300.0) | st.floats(-1e-2, 1e-2) | st.just(0.0),
            st.sampled_from([0.0, 60.0, 2000.0, 11000.0]),
            st.sampled_from([1e-9, 1e-4, 1e-3, 0.5]),
        ),
        min_size=1,
        max_size=25,
    ),
    stiffness=st.sampled_from([0.0, 400.0]),
    damping=st.sampled_from([0.0, 0.5]),
)
def test_the_fmu_never_delivers_energy(unwound, run, stiffness, damping):
    one, beginning = unwound
    one.slave.setFMUstate(beginning)
    one.set(presliding_stiffness=stiffness, presliding_damping=damping)
    work = scale = 0.0
    for speed, preload, size in run:
        assert one.step(size, speed=speed, preload=preload)
        assert one.get("power_loss") >= 0.0
        done = one.get("friction_torque") * speed * size
        work += done
        scale += abs(done)
        assert work >= -1e-12 * scale - 1e-18


def test_wrong_calls_are_logged_and_have_no_effect(instance):
    """An exception of the Python code would kill the process when the instance is freed (pythonfmu 0.7)."""
    slave = instance.slave
    assert slave.getReal([999]) == [0.0]
    assert slave.getInteger([0]) == [0]
    assert slave.getString([0]) == [b""]
    slave.setReal([999], [1.0])
    slave.setBoolean([16], [True])
    slave.setInteger([0], [1])
    slave.setString([0], ["text"])
    assert [status for status, _ in instance.messages] == [ERROR] * 7
    assert instance.step(speed=30.0)
    assert instance.get("friction_torque") > 0.0


def test_an_exception_inside_the_step_discards_it_without_ending_the_host(unpacked, slave_module):
    """An unexpected exception, caused by a patched function of a running instance."""
    with FmuInstance(unpacked) as one:
        one.step(speed=30.0)
        before = one.outputs()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(slave_module(unpacked), "bristle_friction", None)
            assert one.step(presliding_stiffness=1.0) is False
        assert one.messages[-1][1].startswith("step failed: TypeError")
        assert one.outputs() == before
        assert one.step() is True
