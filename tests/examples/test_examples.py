"""The examples: their numbers against mechanics, the map and linear control theory, their picture and their
command line.

The FMU is that of the closed-form map; every expected number follows from the map and the parameters of the
axis.
"""

import importlib.util
import math
import struct
import subprocess
import sys
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from paths import EXAMPLES
from scipy.signal import lsim

from ballscrew_fmu.python_fmu.package import build_fmu

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


def rigid_inertia(axis):
    return axis.inertia + axis.table_mass * axis.ratio**2


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


def test_axial_load_is_the_force_that_moves_the_table(result, axis):
    """Of the table on the nut: mass times acceleration, guide and process, against the axis direction."""
    for name in RUNS:
        run = result["runs"][name]
        acceleration = np.gradient(run.velocity, axis.step)
        force = axis.table_mass * acceleration + axis.guide_damping * run.velocity + run.motion.process_force
        assert np.abs(force).max() > 300.0
        # the load is that at a point of time, the difference quotient that of a step with friction held
        assert np.abs(-run.axial_load - force)[1:-1].max() < 1e-3 * np.abs(force).max()


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


def test_the_bristle_unwinds_with_its_stiffness_after_the_reversal(result, axis, synthetic_nut_map):
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


def test_motor_torque_at_constant_velocity_is_friction_and_guide(result, axis):
    for name in ("move_without", "move_with"):
        run = result["runs"][name]
        row = at(run, 0.75)
        guide = axis.guide_damping * 0.25 * axis.ratio
        assert run.motor_torque[row] == pytest.approx(run.friction_torque[row] + guide, rel=1e-4)


def test_friction_torque_adds_to_the_torque_of_acceleration(result, axis):
    for name in ("move_without", "move_with"):
        run = result["runs"][name]
        row = at(run, 0.165)  # acceleration 1.5 m/s2 from 0.100 to 0.167 s
        acceleration = 1.5 / axis.ratio * rigid_inertia(axis)
        guide = axis.guide_damping * run.velocity[row] * axis.ratio
        expected = acceleration + guide + run.friction_torque[row]
        assert run.motor_torque[row] == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("name", RUNS)
def test_work_of_the_motor_is_accounted_for(result, axis, name):
    run, h, r = result["runs"][name], axis.step, axis.ratio

    def integral(power):
        return float(np.sum(power[1:] + power[:-1]) * 0.5 * h)

    motor = integral(run.motor_torque * run.speed)
    friction = float(np.sum(run.friction_torque[:-1] * np.diff(run.angle)))
    kinetic = 0.5 * axis.inertia * run.speed[-1] ** 2 + 0.5 * axis.table_mass * run.velocity[-1] ** 2
    spring = 0.5 * axis.axial_stiffness * (r * run.angle[-1] - run.position[-1]) ** 2
    damper = integral(axis.axial_damping * (r * run.speed - run.velocity) ** 2)
    guide = integral(axis.guide_damping * run.velocity**2)
    process = integral(run.motion.process_force * run.velocity)
    accounted = kinetic + spring + friction + damper + guide + process
    assert motor == pytest.approx(accounted, rel=1e-4)
    assert motor > 1.0
    motion, case = name.split("_")
    assert result[f"{motion}_motor_work_J_{case}"] == pytest.approx(motor, rel=1e-4)
    assert result[f"{motion}_friction_work_J_{case}"] == pytest.approx(friction, rel=1e-9)


@pytest.mark.parametrize("name", WITH_FRICTION)
def test_work_against_friction_becomes_heat(result, axis, name):
    run = result["runs"][name]
    heat = float(np.sum(run.heat_flow) * axis.step)
    work = float(np.sum(run.friction_torque[:-1] * np.diff(run.angle)))
    assert np.all(run.heat_flow >= 0.0)
    assert heat == pytest.approx(work, rel=2e-4)


def test_bristle_keeps_energy_that_is_not_heat_yet(servo_axis, fmu, axis, synthetic_nut_map):
    """A short swing that winds the bristle up: work = heat + energy stored."""
    motion, _ = servo_axis.circle(axis, after=0.0)
    start = servo_axis.Motion(*(column[: int(0.015 / axis.step)] for column in motion))
    with servo_axis.FrictionFmu(fmu, axis, presliding=True) as friction:
        run = servo_axis.simulate(axis, start, friction)
    turned = run.angle[-1]
    _, coulomb = map_torques(synthetic_nut_map, axis, run, slice(0, None))
    assert 0.0 < turned < 0.6 * coulomb.min() / axis.presliding_stiffness  # elastic throughout
    work = float(np.sum(run.friction_torque[:-1] * np.diff(run.angle)))
    stored = 0.5 * axis.presliding_stiffness * turned**2
    heat = float(np.sum(run.heat_flow) * axis.step)
    assert stored > 0.2 * work
    assert work == pytest.approx(heat + stored, rel=0.01)


# control


def test_following_error_without_friction_is_that_of_the_linear_cascade(result, axis):
    """Amplitude on the circle from the transfer function; at 2 rad/s the current loop does not matter."""
    run = result["runs"]["circle_without"]
    s, r = 2.0j, axis.ratio
    controller = axis.speed_gain * (1.0 + 1.0 / (axis.reset_time * s))
    spring = axis.axial_stiffness + axis.axial_damping * s
    table = axis.table_mass * s**2 + axis.guide_damping * s
    process = 300.0 / 0.02 * s  # force over reference position
    drive = controller * s + axis.inertia * s**2
    transfer = (controller * (axis.position_gain + s) / r - drive * process / spring / r - r * process) / (
        controller * axis.position_gain / r + drive * (1.0 + table / spring) / r + r * table
    )
    settled = slice(at(run, 0.5), None)
    time = run.motion.time[settled]
    waves = np.column_stack([np.cos(2.0 * time), np.sin(2.0 * time)])
    fitted, *_ = np.linalg.lstsq(waves, run.error[settled], rcond=None)
    expected = -10e-3 * (1.0 - transfer)  # the reference is -radius cos(2 t) + radius
    assert fitted == pytest.approx([expected.real, -expected.imag], rel=0.01, abs=2e-9)
    # nothing but that wave: no quadrant error
    assert np.abs(run.error[settled] - waves @ fitted).max() < 5e-9


@pytest.mark.parametrize("name", ["circle_with", "circle_presliding"])
def test_quadrant_error_is_the_answer_of_the_loop_to_the_friction_torque(result, axis, name):
    """Superposition: the error with friction less that without is the disturbance response of the cascade."""
    run, free = result["runs"][name], result["runs"]["circle_without"]
    # torque follows the speed controller after the current loop and half a cycle
    lag = np.poly1d([1.0 / axis.current_bandwidth + 0.5 * axis.step, 1.0])
    controller = axis.speed_gain * np.poly1d([axis.reset_time, 1.0])
    inertia = np.poly1d([rigid_inertia(axis) * axis.reset_time, 0.0, 0.0, 0.0])
    response = (
        (axis.ratio * np.poly1d([axis.reset_time, 0.0]) * lag).c,
        (inertia * lag + controller * np.poly1d([1.0, axis.position_gain])).c,
    )
    _, expected, _ = lsim(response, run.friction_torque, run.motion.time)
    window = slice(at(run, result["reversal_s"] - 0.1), at(run, result["reversal_s"] + 0.3))
    difference = run.error[window] - free.error[window]
    # what is left: the elastic axis and the rest of the sampling
    assert np.abs(difference - expected[window]).max() < 0.02 * np.abs(expected[window]).max()
    assert np.abs(expected[window]).max() > 5e-6


def test_only_friction_makes_a_quadrant_error(result):
    for case in ("with", "presliding"):
        assert result[f"circle_spike_um_{case}"] > 50.0 * result["circle_spike_um_without"]
        assert result[f"circle_error_max_um_{case}"] > 3.0 * result["circle_error_max_um_without"]
        run, free = result["runs"][f"circle_{case}"], result["runs"]["circle_without"]
        after = run.motion.time >= result["reversal_s"]
        peak = float(run.motion.time[after][np.argmin(run.error[after])]) - result["reversal_s"]
        assert 0.0 < peak < 0.1
        # the table stays behind the reference, which turns back: beyond it, error negative
        assert run.error[after].min() < 5.0 * free.error[after].min() < 0.0


def test_friction_enlarges_the_error_of_the_move_and_delays_standstill(result):
    run, free = result["runs"]["move_with"], result["runs"]["move_without"]
    starting = slice(0, at(run, 0.1))
    assert np.all(run.error[starting][200:] > free.error[starting][200:])
    assert result["move_error_max_um_with"] > result["move_error_max_um_without"]
    assert result["move_error_rms_um_with"] > result["move_error_rms_um_without"]
    assert result["move_settling_ms_with"] > result["move_settling_ms_without"]
    for case in ("with", "without"):
        settled = result["runs"][f"move_{case}"]
        rest = settled.motion.time > result["move_end_s"] + 1e-3 * result[f"move_settling_ms_{case}"] + 1e-9
        assert rest.any()
        assert np.abs(settled.error[rest]).max() <= 1e-6
        assert abs(settled.error[np.flatnonzero(rest)[0] - 2]) > 1e-6  # and not earlier
        assert settled.position[-1] == pytest.approx(0.2, abs=1e-6)


def test_numbers_are_those_of_the_time_series(result, axis):
    for name in RUNS:
        run = result["runs"][name]
        motion, case = name.split("_")
        assert result[f"{motion}_error_max_um_{case}"] == pytest.approx(1e6 * max(abs(run.error)))
        assert result[f"{motion}_error_rms_um_{case}"] == pytest.approx(
            1e6 * math.sqrt(np.mean(run.error**2))
        )
        assert result[f"{motion}_friction_torque_peak_Nm_{case}"] == max(abs(run.friction_torque))
        assert run.error == pytest.approx(run.motion.position - run.position, abs=1e-15)
        if motion == "circle":
            turn = at(run, result["reversal_s"])
            spike = max(abs(run.error[turn : turn + round(0.15 / axis.step)] - run.error[turn]))
            assert result[f"circle_spike_um_{case}"] == pytest.approx(1e6 * spike)
    assert result["move_friction_torque_peak_Nm_without"] == 0.0
    assert result["in_range"] is True


# motions


def test_positioning_keeps_its_limits(servo_axis, axis):
    motion, end = servo_axis.positioning(axis)
    h = axis.step
    acceleration = np.diff(motion.velocity) / h
    assert motion.velocity.max() == pytest.approx(0.25)
    assert np.abs(acceleration).max() == pytest.approx(1.5)
    assert np.abs(np.diff(acceleration)).max() / h <= 15.0 * (1.0 + 1e-6)
    assert (motion.position[0], motion.velocity[0]) == (0.0, 0.0)
    assert np.all(motion.position[motion.time >= end] == 0.2)
    assert np.cumsum(0.5 * (motion.velocity[1:] + motion.velocity[:-1])) * h == pytest.approx(
        motion.position[1:], abs=1e-8
    )


def test_a_move_that_is_too_short_is_refused(servo_axis, axis):
    with pytest.raises(ValueError, match=r"^distance = 0\.05 m; too short for 0\.25 m/s"):
        servo_axis.positioning(axis, distance=0.05)


def test_circle_has_its_feed_and_turns_at_the_reversal(servo_axis, axis):
    motion, reversal = servo_axis.circle(axis)
    assert reversal == pytest.approx(math.pi * 10e-3 / 0.02)
    assert motion.position.max() == pytest.approx(20e-3)
    assert motion.velocity.max() == pytest.approx(0.02)
    assert np.gradient(motion.position, axis.step)[1:-1] == pytest.approx(motion.velocity[1:-1], abs=1e-8)
    assert np.all(motion.velocity[motion.time < reversal][1:] > 0.0)
    assert np.all(motion.velocity[motion.time > reversal] < 0.0)
    assert np.all(motion.process_force * motion.velocity >= 0.0)  # the cutting force opposes the feed


# coupling


def hold(servo_axis, fmu, axis):
    """Run at rest under a force of 200 N that acts from 0.1 s on, with the bristle."""
    time = np.arange(0.0, 0.5, axis.step)
    motion = servo_axis.Motion(time, 0.0 * time, 0.0 * time, np.where(time > 0.1, 200.0, 0.0))
    with servo_axis.FrictionFmu(fmu, axis, presliding=True) as friction:
        return servo_axis.simulate(axis, motion, friction)


def test_groups_of_the_coupling_are_those_of_the_head_of_the_file(servo_axis, axis, synthetic_nut_map):
    stability, damping = axis.coupling
    assert stability == pytest.approx(0.0005, rel=0.1)
    assert damping == pytest.approx(0.005, rel=0.1)
    assert stability < damping * (1.0 - damping)  # for masters that step both sides with old values too
    state = synthetic_nut_map.evaluate(axis.preload, 0.0, axis.oil_temperature)
    longest = 2.0 * axis.inertia * 0.1 / state.coulomb_torque
    assert longest == pytest.approx(1.5e-3, rel=0.15)
    assert axis.step < 0.1 * longest
    for number in ("a = 0.0005", "b = 0.005", "= 1.5 ms", "a < 4 - 2b"):
        assert number in servo_axis.__doc__


def test_the_limit_of_the_coupling_is_where_the_axis_begins_to_chatter(servo_axis, fmu):
    def with_share_of_limit(share):
        axis = replace(servo_axis.Axis(), step=250e-6)
        b = axis.coupling[1]
        # past the check of Axis, which refuses it
        object.__setattr__(
            axis, "presliding_stiffness", share * (4.0 - 2.0 * b) * axis.inertia / axis.step**2
        )
        return axis

    def alternation(share):
        return np.abs(np.diff(hold(servo_axis, fmu, with_share_of_limit(share)).speed[-400:], 2)).max()

    assert alternation(0.8) < 1e-5
    assert alternation(1.2) > 1e-2


@pytest.mark.parametrize(
    "change", [{"presliding_stiffness": 1.3e6}, {"presliding_damping": 50.0}, {"step": 12e-3}]
)
def test_an_unstable_coupling_is_refused(servo_axis, change):
    with pytest.raises(ValueError, match=r"^step = .*explicit coupling needs"):
        servo_axis.Axis(**change)


def test_the_axis_rests_on_the_bristle_under_a_force(servo_axis, fmu, axis):
    run = hold(servo_axis, fmu, axis)
    assert np.abs(run.speed[-100:]).max() < 1e-3
    assert run.axial_load[-1] == pytest.approx(-200.0, rel=1e-4)
    assert run.motor_torque[-1] == pytest.approx(run.friction_torque[-1] + 200.0 * axis.ratio, abs=1e-4)


def test_leaving_the_map_is_reported(servo_axis, fmu, capfd):
    hot = replace(servo_axis.Axis(), oil_temperature=400.0)
    motion, _ = servo_axis.circle(hot, after=0.0)
    start = servo_axis.Motion(*(column[:10] for column in motion))
    with servo_axis.FrictionFmu(fmu, hot) as friction:
        assert servo_axis.simulate(hot, start, friction).in_range is False
    assert "temperature = 400.0 lies beyond the map" in capfd.readouterr().out


# picture and command line


def test_plot_writes_a_picture(servo_axis, result, tmp_path):
    picture = tmp_path / "servo_axis.png"
    servo_axis.plot(result, picture)
    content = picture.read_bytes()
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", content[16:24]) == (1560, 1092)
    pixels = imread(picture)[..., :3]
    for case, panels in (("without", 4), ("with", 5), ("presliding", 3)):
        near = np.abs(pixels - to_rgb(servo_axis.STYLES[case]["color"])).max(axis=-1) < 0.02
        drawn = [
            half.any() for column in np.array_split(near, 2, axis=1) for half in np.array_split(column, 3)
        ]
        assert sum(drawn) == panels  # curves in the panels where this run belongs


def test_command_line_prints_the_numbers_and_draws(servo_axis, fmu, result, tmp_path, monkeypatch, capsys):
    asked = []
    monkeypatch.setattr(servo_axis, "main", lambda path: asked.append(path) or result)
    picture = tmp_path / "a.png"
    assert servo_axis.command_line(["--fmu", str(fmu), "--plot", str(picture)]) == 0
    assert asked == [fmu]
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
