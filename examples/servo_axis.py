#!/usr/bin/env python3
"""Servo axis with the friction of its ball screw from BallScrewFriction.fmu, stepped in fmpy.

    python examples/servo_axis.py [--fmu dist/BallScrewFriction.fmu] [--plot servo_axis.png]

A 300 kg table on the screw of the FMU, whose lead and preload are taken from it: current loop, speed loop (PI),
position loop (P) with velocity feedforward, two masses connected by the axial stiffness of the drive. Two motions,
each with and without friction and with the same controller: a jerk-limited positioning move, and one axis of a milled
circle, whose reversal shows the quadrant error. The guide has no dry friction, so the quadrant error is due to the
screw only.

Coupling. The FMU and the axis exchange values every `step`, friction first: the FMU steps with the speed at
the start of the step, and its torque, that at the end of its step, acts on the axis over the same step. Such
an explicit coupling can add energy to the axis although both sides are passive. With a = step^2 s0/J and
b = step s1/J (s0, s1: presliding stiffness and damping, J: inertia that feels the torque) it is stable for
a < 4 - 2b; here a = 0.0005, b = 0.005. The regularised sign needs step < 2 J w_s/T_C = 1.5 ms for
w_s = 0.1 rad/s. A master that steps both sides with the values of the last step needs a < b (1 - b).
"""

import re
import sys
from pathlib import Path
from shutil import rmtree
from typing import Any, NamedTuple

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from fmu_command import plain, run_with_fmu
from matplotlib.figure import Figure
from servo_drive import Axis, Drive, on_circle

FMU = Path(__file__).resolve().parents[1] / "dist" / "BallScrewFriction.fmu"
CASES = ("without", "with", "presliding")
STYLES = {
    "without": {"color": "#0072B2", "label": "without friction"},
    "with": {"color": "#D55E00", "label": "with friction"},
    "presliding": {"color": "#009E73", "label": "with friction and presliding"},
}
IN_POSITION = 1e-6  # [m] the axis has settled when its error stays within


class Motion(NamedTuple):
    """Reference of the table and force of the process on it against the axis direction, one row per step."""

    time: np.ndarray  # [s]
    position: np.ndarray  # [m]
    velocity: np.ndarray  # [m/s]
    process_force: np.ndarray  # [N]


def positioning(
    axis: Axis, distance=0.2, velocity=0.25, acceleration=1.5, jerk=15.0, dwell=0.25
) -> tuple[Motion, float]:
    """Jerk-limited move over a distance [m], and the time when its reference is at rest again [s].

    Reaches velocity [m/s] and acceleration [m/s2] with jerk [m/s3]; dwell [s] is the time to settle.
    """
    t_j, t_a = acceleration / jerk, velocity / acceleration
    cruise = distance / velocity - t_a - t_j
    if t_a < t_j or cruise < 0.0:
        raise ValueError(f"distance = {distance} m; too short for {velocity} m/s and {acceleration} m/s2")
    ramp = [(t_j, 1), (t_a - t_j, 0), (t_j, -1)]
    segments = [*ramp, (cruise, 0), *((t, -sign) for t, sign in ramp)]
    end = sum(t for t, _ in segments)
    time = np.arange(0.0, end + dwell, axis.step)
    x, v = np.full_like(time, distance), np.zeros_like(time)
    begin = x_0 = v_0 = a_0 = 0.0
    for duration, sign in segments:
        path = np.polynomial.Polynomial([x_0, v_0, a_0 / 2.0, sign * jerk / 6.0])
        inside = (time >= begin) & (time < begin + duration)
        x[inside], v[inside] = path(time[inside] - begin), path.deriv()(time[inside] - begin)
        x_0, v_0, a_0 = path(duration), path.deriv()(duration), a_0 + sign * jerk * duration
        begin += duration
    return Motion(time, x, v, np.zeros_like(time)), end


def circle(axis: Axis, radius=10e-3, feed=0.02, cutting_force=300.0, after=0.5) -> tuple[Motion, float]:
    """One axis of a milled circle from one reversal past the next, and the time of that reversal [s].

    radius [m], feed along the path [m/s], cutting force along the path [N], time after the reversal [s].
    """
    reversal = np.pi * radius / feed
    time = np.arange(0.0, reversal + after, axis.step)
    return Motion(time, *on_circle(time, radius, feed, cutting_force)), reversal


def axis_of(fmu: Path | str) -> Axis:
    """The axis with lead [m] and preload [N] of the screw of an FMU: lead in its description, preload the start value.

    ValueError: an FMU that states none.
    """
    description = fmpy.read_model_description(str(fmu))
    lead = re.search(r"lead ([0-9.]+) mm", description.description or "")
    preload = next((v.start for v in description.modelVariables if v.name == "preload"), None)
    if lead is None or preload is None:
        raise ValueError(f"{fmu} states no lead or preload; needs BallScrewFriction.fmu of this version")
    return Axis(lead=1e-3 * float(lead[1]), preload=float(preload))


class FrictionFmu:
    """One instance of the FMU; use it in a `with` block, which frees it in any case.

    ValueError: an FMU without these variables.
    """

    INPUTS = ("preload", "speed", "temperature", "axial_load")
    OUTPUTS = ("friction_torque", "power_loss")
    PRESLIDING = ("presliding_stiffness", "presliding_damping")

    def __init__(self, fmu: Path | str, axis: Axis, presliding: bool = False) -> None:
        description = fmpy.read_model_description(str(fmu))
        reference = {variable.name: variable.valueReference for variable in description.modelVariables}
        missing = {*self.INPUTS, *self.OUTPUTS, *self.PRESLIDING, "presliding", "in_range"} - reference.keys()
        if missing:
            raise ValueError(f"{fmu} has no variable {min(missing)}; needs BallScrewFriction.fmu")
        self._inputs = [reference[name] for name in self.INPUTS]
        self._outputs = [reference[name] for name in self.OUTPUTS]
        self._in_range = [reference["in_range"]]
        self._time = 0.0
        self._folder = fmpy.extract(str(fmu))
        self._slave = FMU2Slave(
            guid=description.guid,
            modelIdentifier=description.coSimulation.modelIdentifier,
            unzipDirectory=self._folder,
            instanceName="screw",
        )
        self._slave.instantiate(loggingOn=True)  # the log has the reason of a rejected step
        self._slave.setupExperiment(startTime=0.0)
        self._slave.setReal(self._inputs, [axis.preload, 0.0, axis.oil_temperature, 0.0])
        self._slave.setBoolean([reference["presliding"]], [presliding])
        if presliding:
            values = [axis.presliding_stiffness, axis.presliding_damping]
            self._slave.setReal([reference[name] for name in self.PRESLIDING], values)
        self._slave.enterInitializationMode()
        self._slave.exitInitializationMode()

    def advance(self, axis: Axis, speed: float, axial_load: float) -> tuple[float, float, bool]:
        """One step: friction torque [N m] and heat flow [W] at its end, and whether it is within the map."""
        self._slave.setReal(self._inputs, [axis.preload, speed, axis.oil_temperature, axial_load])
        self._slave.doStep(currentCommunicationPoint=self._time, communicationStepSize=axis.step)
        self._time += axis.step
        torque, heat_flow = self._slave.getReal(self._outputs)
        return torque, heat_flow, bool(self._slave.getBoolean(self._in_range)[0])

    def __enter__(self) -> "FrictionFmu":
        return self

    def __exit__(self, *_: object) -> None:
        self._slave.terminate()
        self._slave.freeInstance()
        rmtree(self._folder, ignore_errors=True)


class Run(NamedTuple):
    """Time series; state and error at the start of each step, friction held over the step. SI units."""

    motion: Motion
    error: np.ndarray  # reference - table position
    angle: np.ndarray
    speed: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    motor_torque: np.ndarray
    axial_load: np.ndarray  # force of the table on the nut
    friction_torque: np.ndarray
    heat_flow: np.ndarray  # dissipated in the screw [W]
    in_range: bool  # the map covered every step


def simulate(axis: Axis, motion: Motion, friction: FrictionFmu | None = None, parallel: bool = False) -> Run:
    """Axis from rest along a motion.

    parallel: axis and friction both step with the values of the last communication point, so that the torque acts one
    step later; else friction first (head of this file).
    """
    drive = Drive(axis)
    torque = heat = 0.0
    in_range = True
    rows = []
    for x_ref, v_ref, process_force in zip(*(column.tolist() for column in motion[1:]), strict=True):
        axial_load, acting = drive.axial_load, (torque, heat)
        if friction is not None:
            torque, heat, inside = friction.advance(axis, drive.speed, axial_load)
            in_range = in_range and inside
        if not parallel:
            acting = torque, heat
        error, mechanics = x_ref - drive.position, (drive.angle, drive.speed, drive.position, drive.velocity)
        rows.append((error, *mechanics, drive.motor_torque, axial_load, *acting))
        drive.advance(x_ref, v_ref, process_force, acting[0])
    return Run(motion, *np.array(rows).T, in_range)


def energies(axis: Axis, run: Run) -> dict[str, float]:
    """Work of the motor and its parts [J], from rest to the last row; friction as it acts on the axis."""
    h, r = axis.step, axis.ratio
    turns = np.diff(run.angle)
    stretch = r * run.angle[-1] - run.position[-1]

    def over_time(power: np.ndarray) -> float:
        return float(np.trapezoid(power, dx=h))

    force = run.motion.process_force[:-1]
    return {
        "motor": over_time(run.motor_torque * run.speed),
        "friction": float(run.friction_torque[:-1] @ turns),
        "guide": over_time(axis.guide_damping * run.velocity**2),
        "axial_damper": over_time(axis.axial_damping * (r * run.speed - run.velocity) ** 2),
        "process": float(force @ np.diff(run.position)),
        "kinetic": 0.5 * float(axis.inertia * run.speed[-1] ** 2 + axis.table_mass * run.velocity[-1] ** 2),
        "spring": 0.5 * axis.axial_stiffness * float(stretch) ** 2,
    }


def settling_time(run: Run, end: float) -> float:
    """From the end of the reference [s] until the error stays within IN_POSITION; nan: it does not."""
    outside = np.flatnonzero(np.abs(run.error) > IN_POSITION)
    last = outside[-1] + 1 if outside.size else 0
    return max(0.0, float(run.motion.time[last]) - end) if last < run.error.size else float("nan")


def reversal_spike(run: Run, reversal: float, window: float = 0.15) -> float:
    """Largest change of the following error within a window [s] after the reversal [m]."""
    first = int(np.searchsorted(run.motion.time, reversal))
    last = int(np.searchsorted(run.motion.time, reversal + window))
    return float(np.abs(run.error[first:last] - run.error[first]).max())


def main(fmu: Path | str = FMU, axis: Axis | None = None) -> dict[str, Any]:
    """All five runs.

    Returns numbers by name, with unit, for the runs `with` and `without` friction and `presliding` (friction with
    presliding); under `axis`, `runs`, `move_end_s` and `reversal_s` the time series and what plot() needs.
    """
    axis = axis or axis_of(fmu)
    move, move_end = positioning(axis)
    arc, reversal = circle(axis)
    runs = {"move_without": simulate(axis, move), "circle_without": simulate(axis, arc)}
    for name, motion, presliding in (
        ("move_with", move, False),
        ("circle_with", arc, False),
        ("circle_presliding", arc, True),
    ):
        with FrictionFmu(fmu, axis, presliding) as friction:
            runs[name] = simulate(axis, motion, friction)

    result: dict[str, Any] = {"axis": axis, "runs": runs, "move_end_s": move_end, "reversal_s": reversal}
    for name, run in runs.items():
        motion, case = name.split("_")
        energy = energies(axis, run)
        result[f"{motion}_error_max_um_{case}"] = 1e6 * float(np.abs(run.error).max())
        result[f"{motion}_error_rms_um_{case}"] = 1e6 * float(np.sqrt(np.mean(run.error**2)))
        result[f"{motion}_motor_torque_peak_Nm_{case}"] = float(np.abs(run.motor_torque).max())
        result[f"{motion}_friction_torque_peak_Nm_{case}"] = float(np.abs(run.friction_torque).max())
        result[f"{motion}_motor_work_J_{case}"] = energy["motor"]
        result[f"{motion}_friction_work_J_{case}"] = energy["friction"]
        if motion == "move":
            result[f"move_settling_ms_{case}"] = 1e3 * settling_time(run, move_end)
        else:
            result[f"circle_spike_um_{case}"] = 1e6 * reversal_spike(run, reversal)
    result |= {"lead_mm": 1e3 * axis.lead, "preload_N": axis.preload}
    result["in_range"] = all(run.in_range for run in runs.values())
    return result


def table(result: dict[str, Any]) -> str:
    """The numbers of main(), one line per quantity."""
    lines = [f"{'':30}" + "".join(f"{case:>12}" for case in CASES)]
    for name in dict.fromkeys(name.rsplit("_", 1)[0] for name in result if name.endswith(CASES)):
        values = (result.get(f"{name}_{case}") for case in CASES)
        lines.append(f"{name:30}" + "".join(f"{'-':>12}" if v is None else f"{v:12.2f}" for v in values))
    lines.append(f"screw of the FMU: lead {result['lead_mm']:g} mm, preload {result['preload_N']:g} N")
    return "\n".join(lines)


def plot(result: dict[str, Any], path: Path | str) -> None:
    """Draw the result of main() to a picture file: the move on the left, the reversal on the right."""
    figure = Figure(figsize=(12.0, 8.4), layout="constrained")
    panels = figure.subplots(3, 2)
    plain(panels.flat)
    figure.suptitle("Servo axis: effect of the friction of the ball screw", fontsize=15)
    draw_move(panels[:, 0], result)
    draw_reversal(panels[:, 1], result)
    figure.savefig(path, dpi=130)


def draw_move(panels: Any, result: dict[str, Any]) -> None:
    """Velocity, following error and torque of the positioning move, one panel each."""
    velocity, error, torque = panels
    with_friction, end = result["runs"]["move_with"], result["move_end_s"]
    time = with_friction.motion.time
    velocity.plot(time, 60.0 * with_friction.motion.velocity, color="0.25")
    for case in CASES[:2]:
        run = result["runs"][f"move_{case}"]
        error.plot(time, 1e6 * run.error, **STYLES[case])
        torque.plot(time, run.motor_torque, **STYLES[case])
    torque.plot(time, with_friction.friction_torque, color="0.25", ls="--", lw=1.3, label="friction torque")
    velocity.set(title="Positioning move over 200 mm", ylabel="reference velocity [m/min]", ylim=(-0.5, 17.5))
    error.set(ylabel="following error [\u00b5m]")
    torque.set(ylabel="motor torque [N m]", xlabel="time [s]")
    for panel in panels:
        panel.axvline(end, color="0.5", lw=1.0, ls=":")
        panel.set_xlim(0.0, time[-1])
        panel.label_outer()
    velocity.text(end + 0.01, 8.0, "reference\nat rest", color="0.4", fontsize=9)
    cruise = time.size // 2
    speed = 60.0 * with_friction.speed[cruise] / (2.0 * np.pi)
    velocity.text(time[cruise], 15.4, f"{speed:.0f} r/min", ha="center", color="0.25", fontsize=9)
    friction = with_friction.friction_torque[cruise]
    torque.text(0.5, friction + 0.4, f"{friction:.2f} N m", color="0.25", fontsize=9)
    error.legend(frameon=False, loc="upper center")
    torque.legend(frameon=False, loc="lower left")


def draw_reversal(panels: Any, result: dict[str, Any]) -> None:
    """Following error and motor torque over time, friction torque over travel, around the reversal."""
    error, torque, loop = panels
    reversal, ratio = result["reversal_s"], result["axis"].ratio
    for case in CASES:
        run = result["runs"][f"circle_{case}"]
        near = np.abs(run.motion.time - reversal) <= 0.15
        time = 1e3 * (run.motion.time[near] - reversal)
        error.plot(time, 1e6 * run.error[near], **STYLES[case])
        torque.plot(time, run.motor_torque[near], **STYLES[case])
        if case != "without":
            travel = 1e6 * ratio * (run.angle[near] - run.angle[near].max())
            loop.plot(travel, run.friction_torque[near], **STYLES[case])
    error.set(
        title="Reversal on a milled circle, 10 mm radius, 1.2 m/min", ylabel="following error [\u00b5m]"
    )
    torque.set(ylabel="motor torque [N m]", xlabel="time from the reversal of the reference [ms]")
    loop.set(ylabel="friction torque [N m]", xlabel="travel of the screw from the turning point [\u00b5m]")
    loop.set(xlim=(-30.0, 1.0), ylim=(-0.95, 0.95))
    for panel in (error, torque):
        panel.set_xlim(-150.0, 150.0)
        panel.axvline(0.0, color="0.5", lw=1.0, ls=":")
    error.tick_params(labelbottom=False)
    for x, y, text in ((-26.0, 0.74, "forward \u2192"), (-26.0, -0.86, "\u2190 back")):
        loop.text(x, y, text, color="0.4", fontsize=9)
    error.legend(frameon=False, loc="lower left")
    loop.legend(frameon=False, loc="center left")


def command_line(arguments: list[str] | None = None) -> int:
    return run_with_fmu(arguments, __file__, __doc__, FMU, main, table, plot)


if __name__ == "__main__":
    sys.exit(command_line())
