#!/usr/bin/env python3
"""Friction torque of an angular contact ball bearing over speed: the law of this project and SKF's friction model.

    python examples/bearing_friction.py [--plot bearing_friction.png]

A 7208 B (14 balls of 12.303 mm, pitch diameter 60 mm, 40 degrees) with oil ISO VG 68 at 40 C under two axial loads.
Nothing of the law was fitted to bearings. Number and diameter of the balls follow from the load rating. Neither curve
has seals or the churning of an oil bath; the law has no friction of the cage.
"""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from fmu_command import run_and_plot
from matplotlib.figure import Figure

from ballscrew_tehl.applications.bearing import bearing

sys.path.append(str(Path(__file__).resolve().parent / "paper"))
from bearings import skf_torque

PITCH_MM, GRADE, TEMPERATURE = 60.0, 68, 313.15
LOADS = (1000.0, 5000.0)  # [N]
RPM = tuple(np.geomspace(10.0, 7000.0, 25))
COLOURS = ("#0072B2", "#D55E00")


def main(loads: tuple[float, ...] = LOADS, speeds: tuple[float, ...] = RPM) -> dict[str, Any]:
    """Torques over speed [r/min] for each axial load [N].

    Returns loads, speeds; law, low, high, skf: load -> array [N.m]; parts: load -> rolling, sliding, hysteresis.
    """
    angle = math.radians(40.0)
    of_7208 = bearing(1e-3 * PITCH_MM, 12.303e-3, 14, angle, 0.52, 0.52, iso_vg=GRADE)
    result: dict[str, Any] = {"loads": loads, "speeds": np.array(speeds), "skf": {}, "parts": {}}
    result |= {name: {} for name in ("law", "low", "high")}
    for load in loads:
        torques = np.array([of_7208.torque(load, n * math.pi / 30.0, TEMPERATURE) for n in speeds])
        result["parts"][load] = torques[:, :3]
        for name, column in zip(("law", "low", "high"), torques.T[3:], strict=True):
            result[name][load] = column
        result["skf"][load] = np.array([sum(skf_torque("angular", PITCH_MM, load, n, GRADE)) for n in speeds])
    return result


def table(result: dict[str, Any]) -> str:
    """Torques [N mm], one line per load and speed."""
    names = ("rolling", "sliding", "hysteresis", "law", "low", "high", "SKF")
    lines = [f"{'load N':>7} {'r/min':>7}" + "".join(f"{name:>12}" for name in names)]
    for load in result["loads"]:
        columns = [*result["parts"][load].T, *(result[name][load] for name in ("law", "low", "high", "skf"))]
        for n, *values in zip(result["speeds"], *columns, strict=True):
            lines.append(f"{load:7.0f} {n:7.0f}" + "".join(f"{1e3 * value:12.2f}" for value in values))
    return "\n".join(lines)


def plot(result: dict[str, Any], path: Path | str) -> None:
    """Draw the result of main()."""
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.subplots()
    for load, colour in zip(result["loads"], COLOURS, strict=False):
        speeds = result["speeds"]
        axes.fill_between(
            speeds, 1e3 * result["low"][load], 1e3 * result["high"][load], color=colour, alpha=0.15, lw=0
        )
        axes.plot(speeds, 1e3 * result["law"][load], color=colour, label=f"law and its interval, {load:g} N")
        axes.plot(speeds, 1e3 * result["skf"][load], "--", color=colour, label=f"SKF, {load:g} N")
    axes.set(xscale="log", yscale="log", xlabel="speed [r/min]", ylabel="friction torque [N mm]")
    axes.set_title("7208 B under an axial load, ISO VG 68 at 40 \u00b0C")
    axes.set_xticks([10, 30, 100, 300, 1000, 3000], labels=["10", "30", "100", "300", "1000", "3000"])
    axes.set_yticks([30, 50, 100, 200, 300, 500], labels=["30", "50", "100", "200", "300", "500"])
    axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    run_and_plot(__file__, __doc__, main, table, plot)
