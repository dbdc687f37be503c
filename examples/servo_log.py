#!/usr/bin/env python3
"""Logs of two simulated axes whose truth is known, to try the command `identify` on.

    python examples/servo_log.py [--plot servo_log.png]

emps.csv: the public EMPS benchmark (Janot, Gautier, Brunot 2019: DC motor, ball screw, carriage) with its published
mass, drive, loops, encoder and reference motion, and its measured curve of friction. before.csv and now.csv: an axis
with a GD4008-3 at 2000 and 1800 N and the friction of the packaged map, 80 N of guides, a tilt, noise and a delay.
"""

import math
from pathlib import Path

import numpy as np
from fmu_command import plain, run_and_plot
from matplotlib.figure import Figure

from ballscrew_tehl import load_map
from ballscrew_tehl.parameters.file import PACKAGED_VG100
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.runtime.evaluate import NutMap

#: EMPS (Janot, Gautier, Brunot 2019): published mass [kg] and offset [N] of the least squares, drive gain [N/V]
MASS, OFFSET, GAIN = 95.1089, -3.1648, 35.1507
#: measured friction [N] over speed [m/s]: force - mass * acceleration
SPEED, FRICTION = np.loadtxt(Path(__file__).with_name("emps_friction.csv"), delimiter=",", skiprows=1).T
#: samples in which the reference accelerates, and coasts, by turns
PIECES = (35, 351, 50, 1, 98, 687, 98, 1, 148, 1035, 148, 1, 50, 351, 101, 351, 50, 1, 98, 687, 98, 1, 148, 1035, 148,
          1, 50, 351, 66)  # fmt: skip
ACCELERATION, QUANTUM = 0.83, 5e-8
#: preloads [N] of the logs of the GD4008-3 by name, oil temperature [K]
PRELOADS, TEMPERATURE = {"before": 2000.0, "now": 1800.0}, 30.0 + CELSIUS
#: guides of the GD4008-3 axis [N], its lead [m/rad], torque constant [N.m/A], inertia [kg m2], offset [N.m]
GUIDES, LEAD, CONSTANT, INERTIA, TILT = 80.0, 8e-3 / (2.0 * math.pi), 0.8, 2.5e-3, 0.15


def emps_log(laps=4, noise=0.0, voltage_noise=0.0, delay=0, seed=0, fine=10):
    """Time [s], position [m], voltage [V] with 1 kHz: position and velocity loop, saturation, encoder."""
    rng = np.random.default_rng(seed)
    signs = [0.0 if k % 2 else 1.0 - k % 4 for k in range(len(PIECES))]
    reference = np.tile(np.repeat(ACCELERATION * np.array(signs), PIECES), laps)
    step = 1e-3
    wanted = np.cumsum(step * (15 * step * ACCELERATION + np.cumsum(reference) * step))
    x = v = last = 0.0
    positions, voltages = np.empty(len(wanted)), np.empty(len(wanted))
    for k, target in enumerate(wanted):
        seen = round((x + noise * rng.standard_normal()) / QUANTUM) * QUANTUM
        u = 243.45 * (160.18 * (target - seen) - (seen - last) / step)
        u = min(max(u, -10.0), 10.0)
        last = positions[k] = seen
        voltages[k] = u
        for _ in range(fine):
            friction = float(np.interp(v, SPEED, FRICTION))
            v += step / fine * (GAIN * u - friction) / MASS
            x += step / fine * v
    voltages = voltages + voltage_noise * rng.standard_normal(len(voltages))
    voltages = np.r_[np.full(delay, voltages[0]), voltages[: len(voltages) - delay]]
    return step * np.arange(len(wanted)), positions, voltages


def screw_log(
    nut_map,
    preload,
    seed,
    temperature=TEMPERATURE,
    noise=0.05,
    speeds=(60, 150, 300, 600, 1000, 1500),
    guides=GUIDES,
):
    """Time [s], angle [rad], current [A]: trapezoids of speed, guides, tilt, noise, a delay of the current."""
    rng, step, pieces = np.random.default_rng(seed), 1e-3, []
    for speed in speeds:
        ramp = np.linspace(0.0, speed * RPM, int(speed * RPM / 0.6) + 1)
        for sign in (1.0, -1.0):
            pieces += [np.zeros(50), sign * ramp, np.full(300, sign * speed * RPM), sign * ramp[::-1]]
    window = np.hanning(21)
    speed = np.convolve(np.concatenate(pieces), window / window.sum(), "same")
    time = step * np.arange(len(speed))
    grid = np.geomspace(1e-3, np.abs(speed).max(), 300)
    torque = nut_map.evaluate(preload, grid, temperature).friction_torque + guides * LEAD
    friction = np.sign(speed) * np.where(np.abs(speed) > 1e-3, np.interp(np.abs(speed), grid, torque), 0.0)
    drive = INERTIA * np.gradient(speed, step) + friction + TILT
    quantum = 2.0 * math.pi / 2**20
    angle = np.cumsum(speed) * step - 0.5 * step * speed
    current = np.interp(time - 1.3e-3, time, drive) / CONSTANT + noise * rng.standard_normal(len(time))
    return time, np.round(angle / quantum) * quantum, np.round(current / 5e-3) * 5e-3


def write_log(path, headings, *columns):
    """A CSV file."""
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=headings, comments="", fmt="%.9g")
    return path


def main(folder: Path | str = ".", screw: NutMap | None = None) -> dict[str, tuple[np.ndarray, ...]]:
    """Write the logs to a folder.

    screw: map of the GD4008-3 with the friction of its axis; None = the packaged one, VG 100. Returns time [s], motion
    [m] or [deg], voltage [V] or current [A] by name of the log.
    """
    screw = screw or load_map(PACKAGED_VG100)
    emps = emps_log(noise=1e-7, voltage_noise=0.03, delay=2)
    write_log(Path(folder) / "emps.csv", "time [s],position [m],voltage [V]", *emps)
    logs = {"emps": emps}
    for seed, (name, preload) in enumerate(PRELOADS.items()):
        time, angle, current = screw_log(screw, preload, seed)
        logs[name] = time, np.degrees(angle) % 360.0, current
        columns = *logs[name], np.full(len(time), TEMPERATURE - CELSIUS)
        write_log(
            Path(folder) / f"{name}.csv", "time [s],position [deg],current [A],temperature [degC]", *columns
        )
    return logs


def table(logs: dict[str, tuple[np.ndarray, ...]]) -> str:
    """Names and lengths."""
    return "\n".join(
        f"{name}.csv: {len(time)} samples, {time[-1]:.1f} s" for name, (time, *_) in logs.items()
    )


def plot(logs: dict[str, tuple[np.ndarray, ...]], path: Path | str) -> None:
    """Position and signal of the drive over time, the first lap of EMPS."""
    figure = Figure(figsize=(9.0, 4.8), layout="constrained")
    panels = figure.subplots(2, 2, sharex="col")
    plain(panels.flat)
    labels = "position [m]", "voltage [V]", "position in the turn [deg]", "current [A]"
    for column, name in enumerate(("emps", "now")):
        time, motion, effort = (values[: sum(PIECES) if name == "emps" else None] for values in logs[name])
        for row, values in enumerate((motion, effort)):
            panels[row, column].plot(time, values, lw=0.8)
            panels[row, column].set_ylabel(labels[2 * column + row])
        panels[0, column].set_title(f"{name}.csv")
        panels[1, column].set_xlabel("time [s]")
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    run_and_plot(__file__, __doc__, main, table, plot)
