"""BallScrewPreloadMonitor through fmpy, for Python hosts and native: preload, rest, range, bad input, Table 3."""

import math

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from monitors import SUBJECTS, monitor_folders, opened

from ballscrew_fmu.checks.monitor_check import monitor_outputs, preload_error, table3
from ballscrew_fmu.checks.replay import FmuInstance, replay
from ballscrew_fmu.checks.replay_fmi3 import Fmu3Instance
from ballscrew_fmu.models import MONITOR
from ballscrew_fmu.python_fmu.package import build_fmu, fmu_files
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_VG100
from ballscrew_tehl.validation.tables import mean_deviations

pytestmark = pytest.mark.slow

SUBJECT = pytest.mark.parametrize("subject", SUBJECTS)
ERROR, DISCARD, WARNING = 3, 2, 1
ZHAO = 0.0219  # mean deviation of Table 3 as published
AGREEMENT = 1e-9
OUTPUTS = ["preload", "preload_half_width", "torque_sensitivity", "lambda_ratio", "in_range"]


@pytest.fixture(scope="module")
def monitors(tmp_path_factory, synthetic_nut_map):
    return monitor_folders(tmp_path_factory.mktemp("monitors"), synthetic_nut_map)


@pytest.fixture(scope="module", params=[None, PACKAGED_VG100], ids=["published", "vg100"])
def packaged(request, tmp_path_factory):
    """Map of a kinematics, and its monitors."""
    nut_map = load_map(None, load_parameters(request.param))
    return nut_map, monitor_folders(tmp_path_factory.mktemp("packaged"), nut_map)


def friction_rows(nut_map, count, seed, **parameters):
    """Random inputs of BallScrewFriction as dicts, and what its torque would be (no presliding)."""
    rng = np.random.default_rng(seed)
    axes = nut_map.header["axes"]
    (lo, hi), fastest, (cold, hot) = axes["preload"][:2], axes["speed"][1], axes["temperature"][:2]
    rows, torques = [], []
    for _ in range(count):
        preload = math.exp(rng.uniform(math.log(0.8 * lo), math.log(hi)))
        row = {
            "preload": preload,
            "speed": float(rng.choice([-1.0, 1.0]))
            * math.exp(rng.uniform(math.log(0.3), math.log(1.03 * fastest))),
            "temperature": float(rng.uniform(cold - 2.0, hot + 2.0)),
            "axial_load": float(rng.choice([0.0, 1.0]) * rng.normal() * preload),
        }
        state = nut_map.evaluate(**row, **parameters)
        sign = math.tanh(abs(row["speed"]) / 0.1)
        total = state.viscous_torque + sign * state.coulomb_torque
        rows.append(row)
        torques.append(math.copysign(total, row["speed"]))
    return rows, torques


def measured(rows, torques):
    return [
        {"torque": torque} | {name: row[name] for name in ("speed", "temperature", "axial_load")}
        for row, torque in zip(rows, torques, strict=True)
    ]


def replayed(folders, subject, rows):
    return replay(folders[subject], rows, 1e-3, Fmu3Instance if subject == "native 3" else FmuInstance)


@SUBJECT
def test_table_3_of_the_paper(packaged, subject):
    with opened(packaged[1], subject) as one:
        rows = table3(one)
    assert len(rows) == 6
    deviation, zhao = mean_deviations(rows)[:2]
    assert round(zhao, 4) == ZHAO
    assert deviation <= ZHAO


@SUBJECT
def test_the_fmu_equals_the_map_and_recovers_the_preload(packaged, subject):
    """Random points of the packaged maps: the outputs of the map to 1e-9, the true preload to 1e-6."""
    nut_map, folders = packaged
    rows, torques = friction_rows(nut_map, 600, 11)
    inputs = measured(rows, torques)
    expected = monitor_outputs(nut_map, inputs)
    results = replayed(folders, subject, inputs)
    for found, wanted in zip(results, expected, strict=True):
        assert found == pytest.approx(wanted, rel=AGREEMENT)
    assert sum(o["in_range"] for o in results) > 350
    assert preload_error([row["preload"] for row in rows], results) <= 1e-6


def test_python_and_native_agree(packaged):
    nut_map, folders = packaged
    inputs = measured(*friction_rows(nut_map, 400, 12))
    results = [replayed(folders, subject, inputs) for subject in SUBJECTS]
    for one, two, three in zip(*results, strict=True):
        assert one == pytest.approx(two, rel=AGREEMENT)
        assert two == three


@SUBJECT
def test_the_friction_fmu_upstream(monitors, unpacked, synthetic_nut_map, subject):
    """The monitor recovers the preload from the torque of BallScrewFriction stepped in parallel."""
    rows, _ = friction_rows(synthetic_nut_map, 200, 13)
    in_range_count = 0
    with FmuInstance(unpacked, presliding=False) as friction, opened(monitors, subject) as monitor:
        for row in rows:
            assert friction.step(**row)
            del row["preload"]
            assert monitor.step(torque=friction.get("friction_torque"), **row)
            if monitor.get("in_range"):
                in_range_count += 1
                assert monitor.get("preload") == pytest.approx(friction.get("preload"), rel=1e-6)
                assert monitor.get("lambda_ratio") == pytest.approx(friction.get("lambda_ratio"), rel=1e-6)
    assert in_range_count > 100


@SUBJECT
def test_sensitivity_and_half_width(monitors, subject):
    with opened(monitors, subject, torque_uncertainty=0.01) as one:
        values = {}
        for torque in (0.799, 0.8, 0.801):
            one.step(torque=torque, speed=30.0)
            values[torque] = one.outputs()
        slope = 0.002 / (values[0.801]["preload"] - values[0.799]["preload"])
        assert values[0.8]["torque_sensitivity"] == pytest.approx(slope, rel=1e-5)
        assert values[0.8]["preload_half_width"] == pytest.approx(0.01 / slope, rel=1e-5)
        one.step(torque_uncertainty=1e6)
        assert one.get("preload_half_width") == 12000.0


@SUBJECT
def test_at_rest_the_last_preload_in_range_is_held(monitors, synthetic_nut_map, subject):
    with opened(monitors, subject, initial_preload=1700.0, speed_min=2.0) as one:
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


@SUBJECT
def test_speed_0_is_never_in_range(monitors, subject):
    with opened(monitors, subject, speed_min=0.0, regularization_speed=0.0) as one:
        one.step(torque=0.5, speed=1e-3)
        assert one.get("in_range")
        one.step(torque=0.5, speed=0.0)
        assert not one.get("in_range")


@SUBJECT
@pytest.mark.parametrize(
    ("inputs", "name"),
    [
        ({"torque": 90.0}, "torque"),
        ({"torque": 1e-4}, "torque"),
        ({"torque": -0.8}, "torque"),
        ({"speed": 400.0}, "speed"),
        ({"temperature": 400.0}, "temperature"),
        ({"torque": 3.8, "axial_load": 11000.0}, "axial_load"),
    ],
)
def test_values_outside_the_map_are_flagged_and_reported_once(monitors, subject, inputs, name):
    good = {"torque": 0.8, "speed": 30.0, "temperature": 303.15, "axial_load": 0.0}
    with opened(monitors, subject) as one:
        assert one.step(**good)
        assert one.get("in_range")
        for _ in range(2):
            assert one.step(**(good | inputs))
            assert not one.get("in_range")
        assert [text.split()[0] for status, text in one.messages if status == WARNING] == [name]
        assert one.step(**good)
        assert one.get("in_range")


@SUBJECT
def test_unconnected_inputs(monitors, subject):
    with opened(monitors, subject, torque=0.0, speed=0.0, temperature=0.0, axial_load=0.0) as one:
        for speed in (0.0, 30.0, 0.0):
            one.step(speed=speed)
            values = one.outputs()
            assert list(values) == OUTPUTS
            assert values.pop("in_range") is False
            assert all(math.isfinite(value) for value in values.values())


@SUBJECT
@pytest.mark.parametrize(
    "name", ["torque", "speed", "temperature", "axial_load", "roughness_height", "speed_min"]
)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e30])
def test_a_value_that_is_not_finite(monitors, subject, name, bad):
    """Discard, nothing changed, with a message that names the variable, alike in all FMUs."""
    with opened(monitors, subject, torque=0.8, speed=30.0) as one:
        one.step()
        before = one.outputs()
        assert one.step(**{name: bad}) is False
        assert one.outputs() == before
        status, text = one.messages[-1]
        assert status == DISCARD
        assert text.startswith(f"{name} = ")


@SUBJECT
def test_a_step_of_size_0(monitors, subject):
    """FMI 2: outputs follow the inputs, the preload is not stored. FMI 3: an Error."""
    with opened(monitors, subject, torque=0.8, speed=30.0) as one:
        one.step()
        stored = one.get("preload")
        one.set(torque=1.6)
        if subject == "native 3":
            with pytest.raises(FMICallException):
                one.step(0.0)
            return
        assert one.step(0.0)
        assert one.get("preload") > 1.5 * stored
        one.step(speed=0.0)
        assert one.get("preload") == stored


@SUBJECT
def test_saved_state_holds_the_preload(monitors, subject):
    get, set_, serialize, restore = {
        "native 3": ("getFMUState", "setFMUState", "serializeFMUState", "deserializeFMUState")
    }.get(subject, ("getFMUstate", "setFMUstate", "serializeFMUstate", "deSerializeFMUstate"))
    with opened(monitors, subject) as one, opened(monitors, subject) as other:
        one.step(torque=0.8, speed=30.0)
        one.step(speed=0.0)
        stored = one.outputs()
        content = getattr(one.slave, serialize)(getattr(one.slave, get)())
        one.step(torque=2.0, speed=30.0)
        one.step(speed=0.0)
        assert one.get("preload") != stored["preload"]
        for instance in (one, other):
            getattr(instance.slave, set_)(getattr(instance.slave, restore)(content))
            assert instance.outputs() == stored
            instance.time = 2e-3
            instance.step(torque=1.0)
            assert instance.get("preload") == stored["preload"]


@SUBJECT
def test_friction_parameters_act(monitors, synthetic_nut_map, subject):
    parameters = {
        "apparent_viscosity_ratio": 3.0,
        "net_sliding_coefficient": 0.008,
        "roughness_height": 60e-9,
        "breakaway_factor": 2.0,
        "regularization_speed": 5.0,
        "speed_min": 0.01,
        "torque_uncertainty": 0.05,
    }
    inputs = [
        {"torque": 0.3, "speed": s, "temperature": 310.0, "axial_load": 100.0} for s in (0.02, 0.4, 7.0)
    ]
    expected = monitor_outputs(synthetic_nut_map, inputs, **parameters)
    plain = monitor_outputs(synthetic_nut_map, inputs, speed_min=0.01)
    with opened(monitors, subject, **parameters) as one:
        for row, wanted, other in zip(inputs, expected, plain, strict=True):
            one.step(**row)
            assert one.outputs() == pytest.approx(wanted, rel=AGREEMENT)
            assert one.get("preload") != pytest.approx(other["preload"], rel=0.01)


@SUBJECT
def test_outputs_follow_inputs_while_initializing_and_steps_afterwards(monitors, subject):
    with opened(monitors, subject, torque=0.8, speed=30.0) as one:
        begin = one.outputs()
        assert begin["in_range"]
        one.set(torque=1.6)
        assert one.outputs() == begin
        one.step()
        assert one.get("preload") > begin["preload"]


def test_validation_finds_nothing_and_the_bytes_are_the_same_again(tmp_path, synthetic_nut_map):
    one, two = (build_fmu(synthetic_nut_map, tmp_path / f"{n}.fmu", model=MONITOR) for n in "ab")
    assert validate_fmu(str(one.path)) == []
    assert one.path.read_bytes() == two.path.read_bytes()
    names = set(fmu_files(synthetic_nut_map, model=MONITOR))
    assert "binaries/linux64/BallScrewPreloadMonitor.so" in names
    assert not any("solver" in name for name in names)
    description = fmpy.read_model_description(str(one.path))
    assert [v.name for v in description.modelVariables if v.causality == "output"] == OUTPUTS
    assert one.guid != build_fmu(synthetic_nut_map, tmp_path / "friction.fmu").guid
    page = fmu_files(synthetic_nut_map, model=MONITOR)["documentation/index.html"].decode()
    assert "speed_min" in page
    assert "{" not in page.partition("</head>")[2]


def test_friction_and_monitor_side_by_side_in_one_process(monitors, unpacked):
    """They share an interpreter: neither may run the other's code."""
    with FmuInstance(unpacked) as friction, FmuInstance(monitors["python"]) as monitor:
        friction.step(preload=1500.0, speed=30.0)
        torque = friction.get("friction_torque")
        monitor.step(torque=torque, speed=30.0)
        friction.step(speed=60.0)
        assert monitor.get("preload") == pytest.approx(1500.0, rel=1e-9)
