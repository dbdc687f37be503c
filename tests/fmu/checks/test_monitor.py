"""BallScrewPreloadMonitor through fmpy, for Python hosts and native: preload, rest, range, Table 3."""

import math

import numpy as np
import pytest
from synthetic_map import LAWS, make_map

from ballscrew_fmu.checks.check import table3
from ballscrew_fmu.checks.reference import monitor_outputs, preload_error
from ballscrew_fmu.checks.replay import Fmu3Instance, FmuInstance, replay
from ballscrew_fmu.models import MONITOR
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.runtime.packed import DEFAULTS
from ballscrew_tehl.validation.tables import mean_deviations

pytestmark = pytest.mark.slow

WARNING = 1
GOOD = {"torque": 0.8, "speed": 30.0, "temperature": 303.15, "axial_load": 0.0}
KIND = {"python": FmuInstance, 2: FmuInstance, 3: Fmu3Instance}


@pytest.fixture(params=KIND)
def kind(request):
    return request.param


@pytest.fixture
def opened(folder_of, kind):
    return lambda law=LAWS[0], **start: KIND[kind](folder_of(MONITOR, kind, law), **start)


def friction_rows(nut_map, count, **parameters):
    """Random inputs of a monitor and the preload that their torque was computed from, without presliding."""
    rng = np.random.default_rng(11)
    axes = nut_map.header["axes"]
    (lo, hi), fastest, (cold, hot) = axes["preload"][:2], axes["speed"][1], axes["temperature"][:2]
    rows, preloads = [], []
    for _ in range(count):
        preload = math.exp(rng.uniform(math.log(0.8 * lo), math.log(hi)))
        speed = math.exp(rng.uniform(math.log(0.05), math.log(1.03 * fastest)))
        row = {"speed": rng.choice([-1.0, 1.0]) * speed, "temperature": rng.uniform(cold - 2.0, hot + 2.0)}
        row["axial_load"] = float(rng.choice([0.0, 1.0]) * rng.normal() * preload)
        state = nut_map.evaluate(preload, **row, **parameters)
        total = state.viscous_torque + math.tanh(abs(row["speed"]) / 0.1) * state.coulomb_torque
        rows.append({"torque": math.copysign(total, row["speed"]), **row})
        preloads.append(preload)
    return rows, preloads


@pytest.mark.parametrize("law", LAWS)
def test_outputs_are_those_of_the_map_and_the_preload_is_recovered(folder_of, kind, law):
    """Also below the slowest speed of the map, with breakaway, and with every parameter off its start value."""
    nut_map = make_map(law=law)
    friction = dict(zip(DEFAULTS, (3.0, 0.008, 60e-9, 2.5), strict=True))
    rows, preloads = friction_rows(nut_map, 300, **friction)
    given = {**friction, "speed_min": 0.02, "torque_uncertainty": 0.05, "law_uncertainty": 0.1}
    expected = monitor_outputs(nut_map, rows, **given)
    found = replay(folder_of(MONITOR, kind, law), [{**rows[0], **given}, *rows[1:]])
    for one, wanted in zip(found, expected, strict=True):
        assert one == pytest.approx(wanted, rel=1e-9)
    assert sum(one["in_range"] for one in found) > 150
    assert preload_error(preloads, found) <= 1e-6


def test_table_3_of_the_paper(tmp_path):
    """Bound: deviation of the publication, recomputed from its printed table."""
    nut_map = load_map(None, load_parameters())
    fmu = build_fmu(nut_map, tmp_path / "monitor.fmu", model=MONITOR).path
    with FmuInstance(fmu) as one:
        rows = table3(one)
        deviation = mean_deviations(rows)[0]
        assert len(rows) == 6
        assert deviation <= 0.0219


def test_sensitivity_and_half_width(opened):
    with opened(torque_uncertainty=0.01) as one:
        preloads = []
        for torque in (0.799, 0.801, 0.8):
            one.step(torque=torque, speed=30.0)
            preloads.append(one.get("preload"))
        slope = 0.002 / (preloads[1] - preloads[0])
        assert one.get("torque_sensitivity") == pytest.approx(slope, rel=1e-5)
        assert one.get("preload_half_width") == pytest.approx(0.01 / slope, rel=1e-5)
        one.step(law_uncertainty=0.03)
        assert one.get("preload_half_width") == pytest.approx(math.hypot(0.01, 0.024) / slope, rel=1e-5)
        preload, half = one.get("preload", "preload_half_width")
        assert one.get("preload_low", "preload_high") == [preload - half, preload + half]
        one.step(torque_uncertainty=1e6)
        assert one.get("preload_half_width", "preload_low", "preload_high") == [12000.0, 0.0, 12000.0]


def test_at_rest_the_last_preload_in_range_is_held(opened):
    with opened(initial_preload=1700.0, speed_min=2.0) as one:
        one.step(torque=5.0, speed=1.99)  # below speed_min
        assert one.get("preload", "in_range") == [1700.0, False]
        one.step(torque=0.8, speed=-2.0)  # against the motion: estimated, but not in range
        assert one.get("preload", "in_range") == [0.0, False]
        one.step(torque=0.8, speed=0.0)
        assert one.get("preload") == 1700.0
        one.step(torque=-0.8, speed=-2.0)
        stored = one.get("preload")
        assert one.get("in_range")
        one.step(torque=500.0, speed=30.0)
        assert one.get("preload", "in_range") == [12000.0, False]
        for torque, speed in ((0.0, 0.0), (-0.7, 1.9), (3.0, -1e-9)):
            one.step(torque=torque, speed=speed)
            assert one.get("preload", "in_range") == [stored, False]
            assert one.get("torque_sensitivity") > 0.0


def test_values_outside_the_map_are_flagged_and_reported_once_and_zeros_are_no_nan(opened):
    outside = [{"torque": torque} for torque in (90.0, 1e-4, -0.8)]
    outside += [{"speed": 400.0}, {"temperature": 400.0}, {"axial_load": 11000.0, "torque": 3.8}]
    for inputs in outside:
        with opened() as one:
            assert one.step(**GOOD)
            assert one.get("in_range")
            for _ in range(2):
                assert one.step(**(GOOD | inputs))
                assert not one.get("in_range")
            named = [text.split()[0] for status, text in one.messages if status == WARNING]
            assert named == [next(iter(inputs))]
            assert one.step(**GOOD)
            assert one.get("in_range")
    with opened(**dict.fromkeys(GOOD, 0.0)) as one:
        for speed in (0.0, 30.0, 0.0):
            one.step(speed=speed)
            assert one.get("in_range") is False
            assert all(map(math.isfinite, one.outputs().values()))


def test_a_step_of_size_0_holds_nothing_and_a_saved_state_has_what_is_held(folder_of):
    """For Python hosts; the native one: test_native_calls, test_native_states."""
    folder = folder_of(MONITOR, "python")
    with FmuInstance(folder, **GOOD) as one, FmuInstance(folder) as other:
        assert one.step(0.0, torque=1.6)
        assert one.step(speed=0.0)
        assert one.get("preload") == one.get("initial_preload")  # nothing stored yet
        one.step(**GOOD)
        one.step(speed=0.0)
        stored, content = one.outputs(), one.slave.serializeFMUstate(one.slave.getFMUstate())
        for speed in (30.0, 0.0):
            one.step(torque=2.0, speed=speed)
        assert one.get("preload") != stored["preload"]
        for instance in (one, other):
            instance.slave.setFMUstate(instance.slave.deSerializeFMUstate(content))
            assert instance.outputs() == stored
            instance.step(torque=1.0)
            assert instance.get("preload") == stored["preload"]
