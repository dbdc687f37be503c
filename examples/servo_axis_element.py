#!/usr/bin/env python3
"""A servo axis with BallScrewAxis: position and speed controller in Python, all mechanics in the FMU.

    python examples/servo_axis_element.py [--fmu dist/BallScrewAxis_fmi2.fmu] [--plot FILE.png]

The table moves to and fro on a sine. Communication step = controller cycle.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from fmu_command import run_with_fmu
from matplotlib.figure import Figure

from ballscrew_fmu.checks.replay import FmuInstance

FMU = Path(__file__).resolve().parents[1] / "dist" / "BallScrewAxis_fmi2.fmu"
CYCLE = 250e-6  # [s]
RATIO = 8e-3 / (2.0 * np.pi)  # [m/rad]
SPEED_GAIN, RESET_TIME, POSITION_GAIN = 1.5, 10e-3, 25.0  # [N.m.s/rad], [s], [1/s]


def main(fmu: Path | str = FMU, stop: float = 0.5) -> dict[str, Any]:
    """Time series of the reference, the error and the friction torque; SI units."""
    time = np.arange(0.0, stop, CYCLE)
    target = 5e-3 * (1.0 - np.cos(4.0 * np.pi * time))
    feed, integral, rows = np.gradient(target, CYCLE), 0.0, []
    with FmuInstance(fmu, motor_inertia=3e-3, table_mass=300.0, lead=2.0 * np.pi * RATIO) as axis:
        for x, v in zip(target, feed, strict=True):
            position, speed, friction = axis.get("position", "speed", "friction_torque")
            error = (POSITION_GAIN * (x - position) + v) / RATIO - speed
            integral += SPEED_GAIN * CYCLE / RESET_TIME * error
            axis.step(CYCLE, motor_torque=SPEED_GAIN * error + integral)
            rows.append((x - position, friction))
        energies = axis.get("supplied_energy", "heat")
    errors, torques = np.array(rows).T
    return {
        "time": time,
        "error": errors,
        "torque": torques,
        "supplied_J": energies[0],
        "heat_J": energies[1],
    }


def table(result: dict[str, Any]) -> str:
    largest = 1e6 * np.abs(result["error"]).max()
    return f"largest position error {largest:.1f} um; {result['heat_J']:.3g} of {result['supplied_J']:.3g} J are heat"


def plot(result: dict[str, Any], path: Path) -> None:
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    error, torque = figure.subplots(2, sharex=True)
    error.plot(result["time"], 1e6 * result["error"])
    error.set_ylabel("position error [um]")
    torque.plot(result["time"], result["torque"])
    torque.set(xlabel="time [s]", ylabel="friction torque [N m]")
    figure.savefig(path)


def command_line(arguments: list[str] | None = None) -> int:
    return run_with_fmu(arguments, __file__, __doc__, FMU, main, table, plot, "axis")


if __name__ == "__main__":
    sys.exit(command_line())
