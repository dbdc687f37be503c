"""Logs of simulated axes: the public EMPS benchmark with its loops, and a GD4008-3 with the friction of a map."""

import math
from pathlib import Path

import numpy as np

from ballscrew_tehl.parameters.units import RPM

#: EMPS (Janot, Gautier, Brunot 2019): published mass [kg] and offset [N] of the least squares, drive gain [N/V]
MASS, OFFSET, GAIN = 95.1089, -3.1648, 35.1507
#: measured friction [N] over speed [m/s]: force - mass * acceleration
SPEED, FRICTION = np.loadtxt(
    Path(__file__).parents[1] / "identification" / "emps_friction.csv", delimiter=",", skiprows=1
).T
#: samples in which the reference accelerates, and coasts, by turns
PIECES = (35, 351, 50, 1, 98, 687, 98, 1, 148, 1035, 148, 1, 50, 351, 101, 351, 50, 1, 98, 687, 98, 1, 148, 1035, 148,
          1, 50, 351, 66)  # fmt: skip
ACCELERATION, QUANTUM = 0.83, 5e-8
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
        friction = None
        for _ in range(fine):
            friction = float(np.interp(v, SPEED, FRICTION))
            v += step / fine * (GAIN * u - friction) / MASS
            x += step / fine * v
    voltages = voltages + voltage_noise * rng.standard_normal(len(voltages))
    voltages = np.r_[np.full(delay, voltages[0]), voltages[: len(voltages) - delay]]
    return step * np.arange(len(wanted)), positions, voltages


def screw_log(nut_map, preload, seed, temperature=303.15, noise=0.05, speeds=(60, 150, 300, 600, 1000, 1500)):
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
    torque = nut_map.evaluate(preload, grid, temperature).friction_torque + GUIDES * LEAD
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
