#!/usr/bin/env python3
"""The servo axis of servo_axis.py with its screw as BallScrewTransmission, compared with spring and friction torque.

    python examples/servo_axis_transmission.py [--fmu dist/BallScrewTransmission_fmi2.fmu]
                                               [--friction dist/BallScrewFrictionNative_fmi2.fmu] [--plot FILE.png]

servo_axis.py has one linear spring for shaft, bearings and nut, and the friction of the screw as a torque. Here the FMU
is the screw itself: it takes angle and speed of the screw, position and velocity of the nut, and returns the torque of
the screw and the force on the nut. Its nut is elastic (Hertz, preloaded), each nut has the friction of its own force.
Shaft and bearings remain a spring, behind the mass of the screw, so that the stiffness without load is the same.

Coupling. Screw and axis exchange values five times in a cycle of the controller, every 25 us, the screw first: it moves
on with the speeds at the start of the step, and torque and force at its end act on the axis over the same step. With
a = h^2 k/m and b = h c/m (stiffness and damping of the nut, mass of the screw) this is stable for a + b < 2; here
a = 0.09. In 125 us steps a would be 2.2.
"""

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from fmu_command import Parser, no_fmu, plain
from matplotlib.figure import Figure
from servo_axis import FrictionFmu, Motion, circle, reversal_spike, simulate
from servo_drive import TransmissionAxis, TransmissionDrive

from ballscrew_fmu.checks.replay import FmuInstance

DIST = Path(__file__).resolve().parents[1] / "dist"
FMU, FRICTION_FMU = DIST / "BallScrewTransmission_fmi2.fmu", DIST / "BallScrewFrictionNative_fmi2.fmu"
OUTPUTS = (
    "screw_torque", "nut_force", "friction_torque", "axial_deflection", "force_nut_a", "force_nut_b",
    "shaft_power", "nut_power", "power_loss", "stored_energy",
)  # fmt: skip
STYLES = {
    "spring": {"color": "0.6", "lw": 4.0, "label": "spring and friction torque"},
    "transmission": {"color": "#D55E00", "lw": 1.6, "label": "transmission"},
}


class TransmissionRun(NamedTuple):
    """Time series, of the axis at the start of each controller cycle, of the screw at the end of each exchange; SI."""

    motion: Motion
    error: np.ndarray  # reference - table position
    motor_torque: np.ndarray
    screw: dict[str, np.ndarray]  # OUTPUTS
    in_range: bool


def simulate_transmission(
    axis: TransmissionAxis, motion: Motion, fmu: Path | str, **parameters: float
) -> TransmissionRun:
    """Axis from rest along a motion, the screw first (head of this file); parameters: of the FMU."""
    drive, errors, torques, rows, in_range = TransmissionDrive(axis), [], [], [], True
    held = {"preload": axis.preload, "temperature": axis.oil_temperature, **parameters}
    with FmuInstance(fmu, **held) as screw:
        for x_ref, v_ref, process_force in zip(*(column.tolist() for column in motion[1:]), strict=True):
            errors.append(x_ref - drive.position)
            torques.append(drive.motor_torque)
            for _ in range(axis.exchanges):
                screw.step(
                    axis.exchange_step, angle=drive.angle, speed=drive.speed, position=drive.nut_position,
                    velocity=drive.nut_velocity,
                )  # fmt: skip
                rows.append(screw.get(*OUTPUTS))
                drive.exchange(x_ref, v_ref, process_force, *rows[-1][:2])
            in_range = in_range and screw.get("in_range")
    series = dict(zip(OUTPUTS, np.array(rows).T, strict=True))
    return TransmissionRun(motion, np.array(errors), np.array(torques), series, in_range)


def main(
    fmu: Path | str = FMU, friction_fmu: Path | str = FRICTION_FMU, axis: TransmissionAxis | None = None
) -> dict[str, Any]:
    """Both axes on the circle of servo_axis.py.

    Returns numbers by name with unit; under `axis`, `runs` and `reversal_s` what plot() needs.
    """
    axis = axis or TransmissionAxis()
    motion, reversal = circle(axis)
    with FrictionFmu(friction_fmu, axis, presliding=True) as friction:
        runs: dict[str, Any] = {"spring": simulate(axis, motion, friction)}
    runs["transmission"] = simulate_transmission(axis, motion, fmu)
    result: dict[str, Any] = {"axis": axis, "runs": runs, "reversal_s": reversal}
    for name, run in runs.items():
        result[f"circle_error_max_um_{name}"] = 1e6 * float(np.abs(run.error).max())
        result[f"circle_spike_um_{name}"] = 1e6 * reversal_spike(run, reversal)
        result[f"circle_motor_torque_peak_Nm_{name}"] = float(np.abs(run.motor_torque).max())
    screw, step = runs["transmission"].screw, axis.exchange_step
    friction_peak = {"spring": runs["spring"].friction_torque, "transmission": screw["friction_torque"]}
    for name, torque in friction_peak.items():
        result[f"circle_friction_torque_peak_Nm_{name}"] = float(np.abs(torque).max())
    result["circle_nut_force_peak_N_transmission"] = float(np.abs(screw["nut_force"]).max())
    result["circle_deflection_peak_um_transmission"] = 1e6 * float(np.abs(screw["axial_deflection"]).max())
    result["circle_least_nut_force_N_transmission"] = float(
        min(screw["force_nut_a"].min(), screw["force_nut_b"].min())
    )
    result["circle_screw_heat_J_transmission"] = step * float(screw["power_loss"].sum())
    result["in_range"] = bool(runs["spring"].in_range and runs["transmission"].in_range)
    return result


def table(result: dict[str, Any]) -> str:
    """The numbers of main(), one line per quantity."""
    lines = [f"{'':34}{'spring':>14}{'transmission':>14}"]
    for name in dict.fromkeys(name.rsplit("_", 1)[0] for name in result if name.endswith(tuple(STYLES))):
        values = (result.get(f"{name}_{case}") for case in STYLES)
        lines.append(f"{name:34}" + "".join(f"{'-':>14}" if v is None else f"{v:14.3f}" for v in values))
    return "\n".join(lines)


def plot(result: dict[str, Any], path: Path | str) -> None:
    """Draw the result of main() to a picture file: error, forces of the nuts and deflection around the reversal."""
    figure = Figure(figsize=(9.0, 8.2), layout="constrained")
    error, forces, deflection = figure.subplots(3, 1, sharex=True)
    figure.suptitle("Servo axis with its screw as a transmission, around the reversal", fontsize=15)
    axis, reversal = result["axis"], result["reversal_s"]
    for name, run in result["runs"].items():
        error.plot(1e3 * (run.motion.time - reversal), 1e6 * run.error, **STYLES[name])
    screw = result["runs"]["transmission"].screw
    time = 1e3 * (axis.exchange_step * (1.0 + np.arange(screw["nut_force"].size)) - reversal)
    for nut, color in (("a", "#0072B2"), ("b", "#009E73")):
        forces.plot(time, screw[f"force_nut_{nut}"], color=color, label=f"nut {nut.upper()}")
    deflection.plot(time, 1e6 * screw["axial_deflection"], color=STYLES["transmission"]["color"])
    error.set(ylabel="following error [\u00b5m]")
    forces.set(ylabel="force of a nut [N]")
    deflection.set(
        ylabel="screw ahead of the nut [\u00b5m]", xlabel="time from the reversal of the reference [ms]"
    )
    plain((error, forces, deflection))
    deflection.set_xlim(-150.0, 150.0)
    error.legend(frameon=False, loc="lower left")
    forces.legend(frameon=False, loc="upper left")
    figure.savefig(path, dpi=130)


def command_line(arguments: list[str] | None = None) -> int:
    parser = Parser(__file__, __doc__)
    parser.add_argument("--fmu", type=Path, default=FMU, help="the transmission; default: %(default)s")
    parser.add_argument(
        "--friction", type=Path, default=FRICTION_FMU, help="the friction FMU; default: %(default)s"
    )
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw the result to this file")
    options = parser.parse_args(arguments)
    if problem := no_fmu(options.fmu) or no_fmu(options.friction):
        return parser.complain(problem)
    try:
        result = main(options.fmu, options.friction)
        print(table(result))
        if not result["in_range"]:
            print("the map did not cover every step", file=sys.stderr)
        if options.plot:
            plot(result, options.plot)
            print(options.plot)
    except (OSError, ValueError) as error:
        return parser.complain(str(error))
    return 0


if __name__ == "__main__":
    sys.exit(command_line())
