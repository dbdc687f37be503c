#!/usr/bin/env python3
"""Warm-up of a ball screw: friction heats nut and screw, their temperatures are inputs of the FMU.

    python examples/warm_up.py [--fmu dist/BallScrewFriction.fmu] [--plot warm_up.png]

Two lumped nodes, nut (n) and screw (s), in air of constant temperature T_a; P is power_loss of the FMU:

    C_n dT_n/dt = q duty P       - G_ns (T_n - T_s) - G_n (T_n - T_a)
    C_s dT_s/dt = (1 - q) duty P - G_ns (T_s - T_n) - G_s (T_s - T_a)
    preload     = preload_at_temperature_difference(screw, preload_0, T_s - T_n)

Assumptions, each of them a simplification:
- Each body has one temperature. No heat from bearings, motor and guide, none to the table except by G_n.
- Convection and conduction are linear with constant coefficients, not functions of speed or temperature.
- Half of the heat goes to each side (q = 0.5). The axis turns at one speed for the share `duty` of the time,
  in cycles much shorter than the time constants, so that only the mean heat matters. The position is not resolved.
- The oil at the inlet of the contacts has the temperature of the nut.
- Screw and nuts are of one steel: a common rise changes no preload. A warmer screw is longer than the nuts and the
  spacer that pushes them apart (lowers the preload) and thicker (raises it; balls at the mean temperature). Which of
  the two is larger depends on the span: of this double nut 80 mm between the middles of its loaded turns, against
  40 mm of 2 r_m cot(contact angle). Stretching of the screw between fixed bearings does not act inside the nut.
- The parameters are of a usual size for this screw; none is measured.

Per step of 20 s the heat is held and the two equations are solved exactly. The FMU has no state here (no
presliding). Torque falls with the viscosity, so that the axis warms faster and less than with constant heat: the
slope of the heat over temperature acts like additional convection. Both time constants follow from
the eigenvalues of the linearised equations.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from fmu_command import plain, run_with_fmu
from matplotlib.figure import Figure
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_tehl.parameters.file import changed, load_screw
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.thermal_preload import preload_at_temperature_difference

FMU = Path(__file__).resolve().parents[1] / "dist" / "BallScrewFriction.fmu"


@dataclass(frozen=True)
class Drive:
    """Thermal network, preload and duty; SI units."""

    nut_capacity: float = 1600.0  # [J/K] 3.5 kg of steel
    screw_capacity: float = 4600.0  # [J/K] 10 kg: 40 mm, 1 m
    nut_to_air: float = 1.8  # [W/K] with the flange to the table
    screw_to_air: float = 2.5  # [W/K] 0.13 m2 at 20 W/m2 K, turning
    nut_to_screw: float = 6.0  # [W/K] balls and oil
    heat_to_nut: float = 0.5
    ambient: float = 293.15  # [K]
    preload: float = 2000.0  # [N] at equal temperatures
    spacer_length: float = 0.056  # [m] between the inner balls of the nuts, whose turns add 24 mm
    largest_difference: float = 15.0  # [K] of screw and nut
    speed: float = 1500.0 * RPM  # [rad/s]
    duty: float = 0.5
    step: float = 20.0  # [s]

    @cached_property
    def preload_over_difference(self) -> CubicSpline:
        """Preload [N] over the temperature of the screw minus that of the nut [K]."""
        screw = changed(load_screw(), screw={"spacer_length": self.spacer_length}).screw
        differences = np.linspace(-1.0, 1.0, 31) * self.largest_difference
        preloads = [
            preload_at_temperature_difference(screw, self.preload, float(difference), screw.loaded_ball_count)
            for difference in differences
        ]
        return CubicSpline(differences, preloads)

    def rates(self) -> tuple[np.ndarray, np.ndarray]:
        """A, b: d(T_n, T_s)/dt = A (T_n - T_a, T_s - T_a) + b P."""
        g = self.nut_to_screw
        conductances = np.array([[-g - self.nut_to_air, g], [g, -g - self.screw_to_air]])
        capacities = np.array([self.nut_capacity, self.screw_capacity])
        heat = self.duty * np.array([self.heat_to_nut, 1.0 - self.heat_to_nut])
        return conductances / capacities[:, None], heat / capacities

    def preload_at(self, nut: float, screw: float) -> float:
        if not abs(screw - nut) <= self.largest_difference:
            raise ValueError(
                f"screw {screw - nut:.3g} K over the nut; allowed: +-{self.largest_difference:g} K"
            )
        return max(0.0, float(self.preload_over_difference(screw - nut)))


def time_constants(rates: np.ndarray) -> tuple[float, float]:
    """Closed form of a two-node network: slow and fast [s], from trace and determinant."""
    half, determinant = 0.5 * np.trace(rates), np.linalg.det(rates)
    root = np.sqrt(half**2 - determinant)
    return float(-1.0 / (half + root)), float(-1.0 / (half - root))


def warm_up(drive: Drive, hours: float, loss: Callable[[float, float], tuple[float, float]]) -> np.ndarray:
    """Rows of (time, T_n, T_s, preload, torque, power); loss(preload, temperature) -> (torque, power)."""
    rates, gain = drive.rates()
    block = np.zeros((3, 3))
    block[:2, :2], block[:2, 2] = rates, gain
    propagate = expm(block * drive.step)[:2]
    over = np.zeros(2)
    rows = []
    for n in range(round(hours * 3600.0 / drive.step) + 1):
        nut, screw = drive.ambient + over
        preload = drive.preload_at(nut, screw)
        torque, power = loss(preload, nut)
        rows.append((n * drive.step, nut, screw, preload, torque, power))
        over = propagate @ (*over, power)
    return np.array(rows)


def slow_time_constant(time: np.ndarray, value: np.ndarray) -> float:
    """Fitted to the tail, where only the slow part remains: 3 % to 0.1 % of the distance to the last value [s].

    The last value must be the steady one.
    """
    left = np.abs(value - value[-1]) / np.abs(value[0] - value[-1])
    part = (left < 0.03) & (left > 1e-3)
    return float(-1.0 / np.polyfit(time[part], np.log(left[part]), 1)[0])


def main(fmu: Path | str = FMU, drive: Drive | None = None, hours: float = 8.0) -> dict[str, Any]:
    """Warm-up with the FMU, and with constant initial heat for comparison.

    Returns numbers by name with unit; coupled, constant: rows of warm_up(); linearised: rates with the slope of the
    heat at the end of the run.
    """
    drive = drive or Drive()
    inside = True
    with FmuInstance(
        fmu, preload=drive.preload, speed=drive.speed, temperature=drive.ambient, presliding=False
    ) as screw:

        def loss(preload: float, temperature: float) -> tuple[float, float]:
            nonlocal inside
            screw.step(drive.step, preload=preload, speed=drive.speed, temperature=temperature)
            torque, power, in_range = screw.get("friction_torque", "power_loss", "in_range")
            inside = inside and in_range
            return torque, power

        coupled = warm_up(drive, hours, loss)
        first = tuple(coupled[0, 4:])
        constant = warm_up(drive, hours, lambda preload, temperature: first)
        _, nut, warm_screw, _, torque, power = coupled[-1]

        def heat(change: np.ndarray) -> float:
            at_nut, at_screw = np.array([nut, warm_screw]) + change
            return loss(drive.preload_at(at_nut, at_screw), at_nut)[1]

        slope = [(heat(change) - heat(-change)) / 0.2 for change in 0.1 * np.eye(2)]
    rates, gain = drive.rates()
    linearised = rates + np.outer(gain, slope)
    return {
        "drive": drive, "coupled": coupled, "constant": constant, "linearised": linearised, "in_range": inside,
        "torque_cold_Nm": first[0], "torque_warm_Nm": torque, "power_cold_W": first[1], "power_warm_W": power,
        "nut_rise_K": nut - drive.ambient, "screw_rise_K": warm_screw - drive.ambient,
        "preload_warm_N": coupled[-1, 3], "preload_extreme_N": float(coupled[np.argmax(
            np.abs(coupled[:, 3] - drive.preload)), 3]),
        "slow_constant_heat_s": slow_time_constant(constant[:, 0], constant[:, 2]),
        "slow_coupled_s": slow_time_constant(coupled[:, 0], coupled[:, 2]),
        "closed_slow_s": time_constants(rates)[0], "closed_fast_s": time_constants(rates)[1],
        "closed_slow_coupled_s": time_constants(linearised)[0],
    }  # fmt: skip


def table(result: dict[str, Any]) -> str:
    return "\n".join(f"{name:24}{value:12.4g}" for name, value in result.items() if isinstance(value, float))


def plot(result: dict[str, Any], path: Path | str) -> None:
    """Temperatures, preload and torque over time."""
    figure = Figure(figsize=(7.0, 8.0), layout="constrained")
    temperature, preload, torque = panels = figure.subplots(3, 1, sharex=True)
    hours = result["coupled"][:, 0] / 3600.0
    fraction, rpm = 100.0 * result["drive"].duty, result["drive"].speed / RPM
    for rows, dash, case in (
        (result["coupled"], "-", ""), (result["constant"], "--", ", constant heat"),
    ):  # fmt: skip
        temperature.plot(hours, rows[:, 1] - CELSIUS, dash, color="#D55E00", label=f"nut{case}")
        temperature.plot(hours, rows[:, 2] - CELSIUS, dash, color="#0072B2", label=f"screw{case}")
    preload.plot(hours, result["coupled"][:, 3], color="0.25")
    torque.plot(hours, result["coupled"][:, 4], color="0.25")
    temperature.set_title(f"Warm-up by friction, {fraction:g} % of the time at {rpm:.0f} r/min")
    temperature.set(ylabel="temperature [\u00b0C]")
    preload.set(ylabel="preload [N]")
    torque.set(ylabel="friction torque [N m]", xlabel="time [h]", xlim=(0.0, min(4.0, hours[-1])))
    temperature.legend(frameon=False, fontsize=9)
    plain(panels)
    figure.savefig(path, dpi=110)


def command_line(arguments: list[str] | None = None) -> int:
    return run_with_fmu(arguments, __file__, __doc__, FMU, main, table, plot)


if __name__ == "__main__":
    sys.exit(command_line())
