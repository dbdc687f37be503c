"""The examples: their numbers against mechanics, the map and linear control theory, their picture and their
command line.

The FMU is that of the closed-form map; every expected number follows from the map and the parameters of the
axis.
"""

import importlib.util
import math
import subprocess
import sys
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from paths import EXAMPLES

from ballscrew_fmu.python_fmu.package import build_fmu

pytestmark = pytest.mark.slow

SCRIPT = EXAMPLES / "servo_axis.py"
RUNS = ("move_without", "move_with", "circle_without", "circle_with", "circle_presliding")
WITH_FRICTION = ("move_with", "circle_with", "circle_presliding")


@pytest.fixture(scope="session")
def fmu(tmp_path_factory, synthetic_nut_map):
    return build_fmu(synthetic_nut_map, tmp_path_factory.mktemp("examples") / "BallScrewFriction.fmu").path


@pytest.fixture(scope="session")
def servo_axis():
    spec = importlib.util.spec_from_file_location("servo_axis", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def result(servo_axis, fmu):
    return servo_axis.main(fmu)


@pytest.fixture(scope="session")
def axis(result):
    return result["axis"]


def at(run, time):
    """Row of a run at a time [s]."""
    return int(np.searchsorted(run.motion.time, time))


def map_torques(nut_map, axis, run, rows):
    """Viscous and Coulomb torque of the map [N.m], >= 0, at the operating points of these rows."""
    state = nut_map.evaluate(axis.preload, run.speed[rows], axis.oil_temperature, run.axial_load[rows])
    return state.viscous_torque, state.coulomb_torque


# friction torque


def test_torque_at_constant_velocity_is_that_of_the_map(result, axis, synthetic_nut_map):
    run = result["runs"]["move_with"]
    cruise = slice(at(run, 0.6), at(run, 0.75))
    assert run.speed[cruise] == pytest.approx(0.25 / 8e-3 * 2.0 * math.pi, rel=1e-5)
    assert run.friction_torque[cruise] == pytest.approx(
        np.add(*map_torques(synthetic_nut_map, axis, run, cruise)), rel=1e-9
    )
    assert np.ptp(run.friction_torque[cruise]) < 1e-4


@pytest.mark.parametrize("name", ["move_with", "circle_with"])
def test_torque_follows_the_map_with_the_axial_load_of_the_axis(result, axis, synthetic_nut_map, name):
    run = result["runs"][name]
    sliding = np.flatnonzero(np.abs(run.speed) > 1.2)  # 12 regularisation speeds: the sign is 1
    viscous, coulomb = map_torques(synthetic_nut_map, axis, run, sliding)
    expected = np.sign(run.speed[sliding]) * (viscous + coulomb)
    assert sliding.size > 0.7 * run.speed.size
    assert run.friction_torque[sliding] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", ["move_with", "circle_with"])
def test_torque_opposes_motion(result, name):
    run = result["runs"][name]
    moving = np.abs(run.speed) > 1e-9
    assert np.all(run.friction_torque[moving] * run.speed[moving] > 0.0)
    assert run.friction_torque[~moving] == pytest.approx(0.0, abs=1e-6)


def test_torque_with_presliding_opposes_sliding_and_springs_back_after_the_reversal(result):
    run = result["runs"]["circle_presliding"]
    sliding = np.abs(run.speed) > 1.5
    assert np.all(run.friction_torque[sliding] * run.speed[sliding] > 0.0)
    assert np.any(run.friction_torque * run.speed < 0.0)


def test_the_bristle_unloads_with_its_stiffness_after_the_reversal(result, axis, synthetic_nut_map):
    run = result["runs"]["circle_presliding"]
    turn = int(np.argmax(run.angle))
    _, coulomb = map_torques(synthetic_nut_map, axis, run, slice(turn, turn + 1))
    back = run.angle[turn] - run.angle[turn:]
    # elastic from +1 to -0.7 of the Coulomb torque
    elastic = turn + np.flatnonzero(back < 1.6 * coulomb / axis.presliding_stiffness)[5:]
    assert elastic.size > 50
    viscous, _ = map_torques(synthetic_nut_map, axis, run, elastic)
    damping = axis.presliding_damping * run.speed[elastic]
    bristle = run.friction_torque[elastic] - np.sign(run.speed[elastic]) * viscous - damping
    slope = np.polyfit(run.angle[elastic], bristle, 1)[0]
    # the axial load moves a little over the reversal, and with it the share of the hysteresis part
    assert slope == pytest.approx(axis.presliding_stiffness, rel=0.01)


# mechanics


@pytest.mark.parametrize("name", WITH_FRICTION)
def test_work_against_friction_becomes_heat(result, axis, name):
    run = result["runs"][name]
    heat = float(np.sum(run.heat_flow) * axis.step)
    work = float(np.sum(run.friction_torque[:-1] * np.diff(run.angle)))
    assert np.all(run.heat_flow >= 0.0)
    assert heat == pytest.approx(work, rel=2e-4)


# control


# motions


def test_a_move_that_is_too_short_is_refused(servo_axis, axis):
    with pytest.raises(ValueError, match=r"^distance = 0\.05 m; too short for 0\.25 m/s"):
        servo_axis.positioning(axis, distance=0.05)


# coupling


@pytest.mark.parametrize(
    "change", [{"presliding_stiffness": 1.3e6}, {"presliding_damping": 50.0}, {"step": 12e-3}]
)
def test_an_unstable_coupling_is_refused(servo_axis, change):
    with pytest.raises(ValueError, match=r"^step = .*explicit coupling needs"):
        servo_axis.Axis(**change)


def test_leaving_the_map_is_reported(servo_axis, fmu, capfd):
    hot = replace(servo_axis.Axis(), oil_temperature=400.0)
    motion, _ = servo_axis.circle(hot, after=0.0)
    start = servo_axis.Motion(*(column[:10] for column in motion))
    with servo_axis.FrictionFmu(fmu, hot) as friction:
        assert servo_axis.simulate(hot, start, friction).in_range is False
    assert "temperature = 400.0 is outside the map" in capfd.readouterr().out


# picture and command line


def test_plot_writes_a_picture(servo_axis, result, tmp_path):
    picture = tmp_path / "servo_axis.png"
    servo_axis.plot(result, picture)
    content = picture.read_bytes()
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    pixels = imread(picture)[..., :3]
    for case, panels in (("without", 4), ("with", 5), ("presliding", 3)):
        near = np.abs(pixels - to_rgb(servo_axis.STYLES[case]["color"])).max(axis=-1) < 0.02
        drawn = [
            half.any() for column in np.array_split(near, 2, axis=1) for half in np.array_split(column, 3)
        ]
        assert sum(drawn) == panels  # one curve per panel of this run


def test_command_line_prints_the_numbers_and_draws(servo_axis, fmu, result, tmp_path, monkeypatch, capsys):
    called = []
    monkeypatch.setattr(servo_axis, "main", lambda path: called.append(path) or result)
    picture = tmp_path / "a.png"
    assert servo_axis.command_line(["--fmu", str(fmu), "--plot", str(picture)]) == 0
    assert called == [fmu]
    assert picture.exists()
    printed, errors = capsys.readouterr()
    spike = next(line for line in printed.splitlines() if line.startswith("circle_spike_um")).split()
    assert [float(word) for word in spike[1:]] == pytest.approx(
        [result[f"circle_spike_um_{case}"] for case in ("without", "with", "presliding")], abs=0.005
    )
    assert errors == ""


def test_a_missing_fmu_is_one_line(tmp_path):
    command = [sys.executable, str(SCRIPT), "--fmu", "none.fmu", "--plot", "a.png"]
    run = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr.startswith("servo_axis.py: none.fmu not found; run build_fmu.py")
    assert run.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_other_bad_input_is_one_line(servo_axis, fmu, tmp_path, capsys):
    text = tmp_path / "text.fmu"
    text.write_text("no zip")
    other = tmp_path / "other.fmu"
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(other, "w") as target:
        description = source.read("modelDescription.xml").replace(b'name="axial_load"', b'name="load"')
        target.writestr("modelDescription.xml", description)
    for path, message in (
        (text, f"{text} is no FMU; run build_fmu.py"),
        (other, f"{other} has no variable axial_load; needs BallScrewFriction.fmu"),
    ):
        assert servo_axis.command_line(["--fmu", str(path)]) == 2
        error = capsys.readouterr().err
        assert error.startswith(f"servo_axis.py: {message}")
        assert error.count("\n") == 1
    with pytest.raises(SystemExit, match="2"):
        servo_axis.command_line(["--speed", "3"])
    assert capsys.readouterr().err.count("\n") == 1
