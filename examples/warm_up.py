#!/usr/bin/env python3
"""Warm-up of an axis: friction by place heats nut, screw and bearing, their temperatures are inputs of the FMU.

    python examples/warm_up.py [--fmu dist/BallScrewAxis_fmi2.fmu] [--plot warm_up.png]

Nodes: the fixed bearing, segments of the screw from it on, the nut. Every two minutes the FMU makes one cycle of the
axis, to and fro with rests, and gives the mean powers of its places, which then heat the network:

    C_i dT_i/dt = sum_j G_ij (T_j - T_i) - G_i (T_i - T_air) + sum of the heat of the places

The solution over the two minutes is exact. Temperature of the nut and temperature of the screw in its stroke less that
of the nut return to the FMU. The screw grows away from the fixed bearing by 11.7 um per metre and kelvin.

Assumptions, each of them a simplification:
- Convection and conduction are linear with constant coefficients. None is printed anywhere: halve and double them.
- Half of the heat of the nut and its wipers goes to the nut, half to the screw, evenly over the stroke; half of that of
  the bearings to their seat, half to the screw. Heat of motor and guide goes elsewhere.
- The oil at the inlet of the contacts has the temperature of the nut.
- Friction of bearings, wipers, motor and guide is that of docs/axis.md for a 40 mm screw with a 500 kg table, constant.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from fmu_command import plain, run_with_fmu
from matplotlib.figure import Figure
from scipy.linalg import expm

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_tehl.parameters.units import CELSIUS, RPM

FMU = Path(__file__).resolve().parents[1] / "dist" / "BallScrewAxis_fmi2.fmu"
EXPANSION = 11.7e-6  # [1/K]
PLACES = ("nut", "wipers", "bearings", "motor", "guide", "damping")
#: of the axis; bearing_seal_torque is all of a bearing ZKLN3572.2RS as printed
AXIS = {
    "table_mass": 500.0,
    "motor_inertia": 3e-3,
    "guide_coulomb": 81.0,
    "seal_torque": 0.20,
    "motor_coulomb": 0.15,
}
BEARING_TORQUE = 0.60  # [N.m]


@dataclass(frozen=True)
class Network:
    """Capacities [J/K], conductances [W/K] and cycle; SI units."""

    segments: int = 5
    stroke: tuple[int, int] = (1, 4)  # segments that the nut passes: first, behind the last
    segment_length: float = 0.2
    nut_capacity: float = 1600.0  # 3.5 kg of steel
    segment_capacity: float = 910.0  # 40 mm, 0.2 m
    seat_capacity: float = 1400.0  # bearing and a part of its housing
    nut_to_air: float = 1.8  # with the flange to the table
    segment_to_air: float = 0.5  # 0.026 m2 at 20 W/m2 K, turning
    seat_to_air: float = 3.0  # with the bed of the machine
    nut_to_screw: float = 6.0  # balls and oil
    seat_to_screw: float = 2.0
    along_screw: float = 0.28  # steel, 45 W/m K
    ambient: float = 293.15
    convection: float = 1.0  # multiplies what goes to the air
    bearings: float = 1.0  # multiplies the friction of the bearings
    speed: float = 1000.0 * RPM
    cycle: float = 2.0  # [s] half of it moving
    cycle_step: float = 2e-3
    hold: float = 120.0  # [s] between two cycles of the FMU

    def matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """A, B: d(T - T_air)/dt = A (T - T_air) + B powers; seat, segments, nut; powers in the order of PLACES."""
        n, nut = self.segments + 2, self.segments + 1
        inside = np.arange(*self.stroke) + 1
        links = [(0, 1, self.seat_to_screw)] + [(i, i + 1, self.along_screw) for i in range(1, self.segments)]
        links += [(int(i), nut, self.nut_to_screw / len(inside)) for i in inside]
        air = np.array([self.seat_to_air, *[self.segment_to_air] * self.segments, self.nut_to_air])
        flow = -np.diag(self.convection * air)
        for i, j, conductance in links:
            flow[[i, j], [j, i]] += conductance
            flow[[i, j], [i, j]] -= conductance
        heat = np.zeros((n, len(PLACES)))
        heat[nut, :2] = 0.5
        heat[inside, :2] = 0.5 / len(inside)
        heat[[0, 1], 2] = 0.5
        capacity = np.array([self.seat_capacity, *[self.segment_capacity] * self.segments, self.nut_capacity])
        return flow / capacity[:, None], heat / capacity[:, None]


def powers_of_cycle(axis: FmuInstance, network: Network, **inputs: float) -> tuple[np.ndarray, bool]:
    """Mean power of each place over one cycle: forward, rest, backward, rest; whether all was in range."""
    count, powers, inside = round(network.cycle / network.cycle_step), np.zeros(len(PLACES)), True
    for n in range(count):
        target = network.speed * (1.0, 0.0, -1.0, 0.0)[4 * n // count]
        torque = min(max(1.5 * (target - axis.get("speed")), -30.0), 30.0)
        axis.step(network.cycle_step, motor_torque=torque, **inputs)
        *values, in_range = axis.get(*(f"power_{place}" for place in PLACES), "in_range")
        powers, inside = powers + values, inside and in_range
    return powers / count, inside


def warm_up(fmu: Path | str, network: Network, hours: float) -> tuple[np.ndarray, np.ndarray, bool]:
    """Temperatures [K] of seat, segments and nut, and powers [W], every two minutes; whether all was in range."""
    rates, gain = network.matrices()
    n, nut = len(rates), network.segments + 1
    block = np.zeros((n + len(PLACES),) * 2)
    block[:n, :n], block[:n, n:] = rates, gain
    propagate = expm(block * network.hold)[:n]
    over, rows, losses, inside = np.zeros(n), [], [], True
    with FmuInstance(fmu, bearing_seal_torque=network.bearings * BEARING_TORQUE, **AXIS) as axis:
        for _ in range(round(3600.0 * hours / network.hold) + 1):
            screw = over[1 + network.stroke[0] : 1 + network.stroke[1]].mean()
            inputs = {"temperature": network.ambient + over[nut], "temperature_difference": screw - over[nut]}
            powers, good = powers_of_cycle(axis, network, **inputs)
            rows.append(network.ambient + over)
            losses.append(powers)
            inside = inside and good
            over = propagate @ (*over, *powers)
    return np.array(rows), np.array(losses), inside


def growth(network: Network, temperatures: np.ndarray) -> np.ndarray:
    """Way of the free end of the screw from the fixed bearing [m]."""
    over = temperatures[:, 1:-1] - network.ambient
    return EXPANSION * network.segment_length * over.sum(axis=1)


def main(fmu: Path | str = FMU, network: Network | None = None, hours: float = 1.0) -> dict[str, Any]:
    """Warm-up, and what the friction of the bearings and the convection, halved and doubled, make of it."""
    network = network or Network()
    temperatures, powers, inside = warm_up(fmu, network, hours)
    grown = growth(network, temperatures)
    result = {
        "network": network, "temperatures": temperatures, "powers": powers, "growth": grown, "in_range": inside,
        "growth_um": 1e6 * grown[-1], "nut_rise_K": temperatures[-1, -1] - network.ambient,
        "seat_rise_K": temperatures[-1, 0] - network.ambient,
    }  # fmt: skip
    result |= {f"power_{place}_W": power for place, power in zip(PLACES, powers[-1], strict=True)}
    for name in ("bearings", "convection"):
        for factor in (0.5, 2.0):
            other = replace(network, **{name: factor})
            change = growth(other, warm_up(fmu, other, hours)[0])[-1] - grown[-1]
            result[f"{name}_x_{factor:g}_um"] = 1e6 * change
    return result


def table(result: dict[str, Any]) -> str:
    return "\n".join(f"{name:24}{value:12.4g}" for name, value in result.items() if isinstance(value, float))


def plot(result: dict[str, Any], path: Path | str) -> None:
    """Temperatures, powers by place and growth over time."""
    figure = Figure(figsize=(7.0, 8.0), layout="constrained")
    temperature, power, way = panels = figure.subplots(3, 1, sharex=True)
    network, rows = result["network"], result["temperatures"] - CELSIUS
    minutes = network.hold / 60.0 * np.arange(len(rows))
    temperature.plot(minutes, rows[:, -1], color="#D55E00", label="nut")
    temperature.plot(minutes, rows[:, 0], color="#009E73", label="seat of the bearing")
    temperature.plot(minutes, rows[:, 1:-1], color="#0072B2", linewidth=0.8)
    temperature.plot([], [], color="#0072B2", label="segments of the screw")
    power.stackplot(minutes, result["powers"].T, labels=PLACES)
    way.plot(minutes, 1e6 * result["growth"], color="0.25")
    temperature.set_title(f"Warm-up by friction, half of the time at {network.speed / RPM:.0f} r/min")
    temperature.set(ylabel="temperature [\u00b0C]")
    power.set(ylabel="power [W]")
    way.set(ylabel="growth of the screw [\u00b5m]", xlabel="time [min]", xlim=(0.0, minutes[-1]))
    temperature.legend(frameon=False, fontsize=9)
    power.legend(loc="lower right", fontsize=9, ncols=3)
    plain(panels)
    figure.savefig(path, dpi=110)


def command_line(arguments: list[str] | None = None) -> int:
    return run_with_fmu(arguments, __file__, __doc__, FMU, main, table, plot, "axis")


if __name__ == "__main__":
    sys.exit(command_line())
