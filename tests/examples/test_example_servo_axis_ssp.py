"""The servo axis as an SSP archive: its schema and units, its masters against the script, its axis FMU."""

import subprocess
import sys
import zipfile

import fmpy
import numpy as np
import pytest
import servo_axis
import servo_axis_fmu
import servo_axis_ssp
import ssp_archive
from fmpy.validation import validate_fmu
from servo_drive import Axis

from ballscrew_fmu.checks.replay import FmuInstance

pytestmark = pytest.mark.slow

# no input or parameter of the screw at the start value of its FMU
AXIS = Axis(preload=2500.0, oil_temperature=308.0, presliding_stiffness=200.0)
# a clock that adds up 16,560 steps, each rounded by 2.2e-16 s at most, is 4e-12 s off in the end, the reference at
# 0.02 m/s 8e-14 m: that is 1e-8 of the following error, the least of what is compared
AGREEMENT = 1e-8


@pytest.fixture(scope="module")
def result(native_fmu):
    return servo_axis_ssp.main(native_fmu, native_fmu.parent / "out" / "servo_axis.ssp", AXIS)


@pytest.fixture(scope="module")
def axis_fmu(tmp_path_factory):
    path = tmp_path_factory.mktemp("axis") / "ServoAxis.fmu"
    return servo_axis_fmu.build_axis_fmu(path, AXIS, 10e-3, 0.02, 300.0)


def series_of(result, master):
    if master in result["missing"]:
        pytest.skip(result["missing"][master])
    return result["series"][master]


# archive


def test_the_archive_holds_two_fmus_and_their_parameters_and_passes_all_checks(result):
    with zipfile.ZipFile(result["ssp"]) as archive:
        assert sorted(archive.namelist()) == [
            "SystemStructure.ssd", "resources/ServoAxis.fmu", "resources/axis.ssv", "resources/native.fmu",
            "resources/screw.ssv",
        ]  # fmt: skip
    assert ssp_archive.findings(result["ssp"]) == []
    bound = {p.name: (float(p.value), p.unit) for p in ssp_archive.bound_parameters(result["ssp"]).parameters}
    assert bound == {
        "screw.preload": (2500.0, "N"),
        "screw.temperature": (308.0, "K"),
        "screw.presliding_stiffness": (200.0, "N.m/rad"),
        "screw.presliding_damping": (0.2, "N.m.s/rad"),
        "axis.radius": (10e-3, "m"),
        "axis.feed": (0.02, "m/s"),
        "axis.cutting_force": (300.0, "N"),
    }


def test_same_input_gives_the_same_archive(result, native_fmu, tmp_path):
    steps = result["sequential"].motion.time.size
    again = servo_axis_ssp.write_ssp(tmp_path / "again.ssp", native_fmu, AXIS, steps * AXIS.step)
    assert again.read_bytes() == result["ssp"].read_bytes()


def rewritten(ssp, path, member, old, new):
    """Copy of an archive with one text changed."""
    with zipfile.ZipFile(ssp) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == member:
                assert old in content.decode()
                content = content.decode().replace(old, new, 1).encode()
            target.writestr(name, content)
    return path


@pytest.mark.parametrize(
    ("member", "old", "new", "finding"),
    [
        ("SystemStructure.ssd", '<ssc:Real unit="N.m" />', '<ssc:Real unit="N" />', "friction_torque: output in N"),
        ("SystemStructure.ssd", '<ssc:BaseUnit kg="1" m="2" s="-2"', '<ssc:BaseUnit kg="1" m="2" s="-1"', "unit N.m"),
        ("SystemStructure.ssd", 'name="speed" kind="input"', 'name="speed" kind="output"', "screw.speed: output"),
        ("SystemStructure.ssd", 'endConnector="axial_load"', 'endConnector="speed"', "axial_load is fed 0 times"),
        ("SystemStructure.ssd", 'startConnector="speed"', 'startConnector="angle"', "joins different units"),
        ("resources/screw.ssv", 'value="2500.0"', 'value="-1"', "screw.preload = -1"),
        ("resources/screw.ssv", 'name="preload"', 'name="load"', "no such parameter"),
        ("resources/axis.ssv", 'unit="m/s"', 'unit="m"', "axis.feed"),
    ],
)  # fmt: skip
def test_wrong_archives_are_found(result, tmp_path, member, old, new, finding):
    wrong = rewritten(result["ssp"], tmp_path / "wrong.ssp", member, old, new)
    assert finding in " | ".join(ssp_archive.findings(wrong))


def test_an_archive_that_violates_the_schema_is_refused(result, tmp_path):
    wrong = rewritten(
        result["ssp"], tmp_path / "wrong.ssp", "SystemStructure.ssd", 'kind="input"', 'kind="in"'
    )
    with pytest.raises(Exception, match="Failed to validate"):
        ssp_archive.findings(wrong)


def test_a_connection_of_different_units_is_not_written(native_fmu, axis_fmu, tmp_path):
    parts = [ssp_archive.Component("screw", native_fmu, {}), ssp_archive.Component("axis", axis_fmu, {})]
    links = [ssp_archive.Connection(("axis", "angle"), ("screw", "speed"))]
    with pytest.raises(ValueError, match=r"axis.angle \(output, rad\) to screw.speed \(input, rad/s\)"):
        ssp_archive.write_archive(tmp_path / "a.ssp", "a", parts, links, 1.0, "set")
    links = [ssp_archive.Connection(("axis", "torque"), ("screw", "speed"))]
    with pytest.raises(ValueError, match="the FMU of axis has no variable torque"):
        ssp_archive.write_archive(tmp_path / "a.ssp", "a", parts, links, 1.0, "set")
    assert not (tmp_path / "a.ssp").exists()


def test_an_axis_that_is_unstable_in_such_masters_is_refused(native_fmu, tmp_path):
    axis = Axis(presliding_damping=0.01)  # fine for friction first
    with pytest.raises(ValueError, match="masters that step both at once need"):
        servo_axis_ssp.write_ssp(tmp_path / "a.ssp", native_fmu, axis, 1.0)


# masters


@pytest.mark.parametrize("master", servo_axis_ssp.MASTERS)
def test_each_master_agrees_with_the_script_that_steps_both_at_once(result, master):
    series, run = series_of(result, master), result["parallel"]
    for field, name in servo_axis_ssp.OBSERVED.items():
        expected = getattr(run, field)
        assert series[name].size == expected.size
        gap = np.abs(series[name][:-1] - expected[1:]).max()
        assert gap <= AGREEMENT * np.abs(expected).max(), name
        assert gap <= 1.001 * result[f"from_parallel_{master}"] * np.abs(expected).max(), name
    assert result[f"in_range_{master}"] is True
    assert result[f"spike_um_{master}"] == pytest.approx(result["spike_um_parallel"], rel=1e-6)


def test_in_parallel_the_torque_acts_one_step_later(native_fmu):
    """Both orders over one step that starts at speed: the second has none of its torque yet."""
    axis = Axis()
    motion, _ = servo_axis.circle(axis)
    short = servo_axis.Motion(*(column[:200] for column in motion))
    runs = {}
    for parallel in (False, True):
        with servo_axis.FrictionFmu(native_fmu, axis, presliding=True) as friction:
            runs[parallel] = servo_axis.simulate(axis, short, friction, parallel)
    first = int(np.flatnonzero(runs[False].friction_torque)[0])
    assert runs[True].friction_torque[first] == 0.0
    assert runs[True].friction_torque[first + 1] == runs[False].friction_torque[first] != 0.0


# the axis FMU


def test_the_axis_fmu_is_valid_and_states_its_units(axis_fmu):
    assert validate_fmu(str(axis_fmu)) == []
    description = fmpy.read_model_description(str(axis_fmu))
    units = {v.name: v.unit for v in description.modelVariables}
    slave = servo_axis_fmu.slave
    table = {**slave.INPUTS, **slave.OUTPUTS, **slave.PARAMETERS}
    assert units == {name: unit for name, (unit, _) in table.items()}
    assert description.coSimulation.canHandleVariableCommunicationStepSize is False
    assert description.coSimulation.needsExecutionTool is False


def test_the_axis_fmu_steps_as_the_drive_does(axis_fmu):
    fmu = fmpy.simulate_fmu(
        str(axis_fmu), stop_time=0.05, output_interval=AXIS.step, start_values={"friction_torque": 0.3, "feed": 0.01}
    )  # fmt: skip
    drive = servo_axis.Drive(AXIS)
    for n in range(400):
        drive.advance(*map(float, servo_axis.on_circle(n * AXIS.step, 10e-3, 0.01, 300.0)), 0.3)
    last = fmu[-1]
    assert last["time"] == pytest.approx(0.05)
    for name in ("angle", "speed", "position", "velocity", "motor_torque", "axial_load"):
        assert last[name] == pytest.approx(getattr(drive, name), rel=1e-9), name


@pytest.mark.parametrize(
    ("values", "step", "message"),
    [
        ({}, 250e-6, "step size = 0.00025 s; needs the cycle"),
        ({"friction_torque": float("nan")}, AXIS.step, "friction_torque = nan"),
        ({"radius": 0.0}, AXIS.step, "radius and feed above 0"),
    ],
)
def test_the_axis_fmu_discards_unsupported_steps(axis_fmu, values, step, message):
    with FmuInstance(axis_fmu, **values) as instance:
        before = instance.outputs()
        assert instance.step(step) is False
        assert message in instance.messages[-1][1]
        assert instance.outputs() == before
    with FmuInstance(axis_fmu) as instance:
        assert instance.step(AXIS.step * (1.0 + 1e-12), friction_torque=0.1) is True


# command line


def test_command_line_prints_all_draws_and_names_what_is_missing(native_fmu, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ecospy", None)  # importing it fails now
    picture, ssp = tmp_path / "a.png", tmp_path / "new" / "a.ssp"
    arguments = ["--fmu", str(native_fmu), "--output", str(ssp), "--plot", str(picture)]
    assert servo_axis_ssp.command_line(arguments) == 0
    out, err = capsys.readouterr()
    assert "SSP in fmpy" in out
    assert "SSP in ecos" not in out
    assert "not run: ecos does not load here" in err
    assert "no finding" in out
    assert ssp.exists()
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("arguments", [["--fmu", "missing.fmu"], ["--fmu", __file__], ["--wrong"]])
def test_bad_input_is_one_line_and_exit_code_2(arguments):
    script = servo_axis_ssp.__file__
    run = subprocess.run([sys.executable, script, *arguments], capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert len(run.stderr.strip().splitlines()) == 1


def test_another_fmu_is_refused_in_one_line(axis_fmu, tmp_path, capsys):
    arguments = ["--fmu", str(axis_fmu), "--output", str(tmp_path / "a.ssp")]
    assert servo_axis_ssp.command_line(arguments) == 2
    assert "has no variable" in capsys.readouterr().err
    assert not (tmp_path / "a.ssp").exists()
