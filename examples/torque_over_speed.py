"""Friction torque of the packaged screw over speed and preload, with the measured torques."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from fmu_command import run_and_plot

from ballscrew_tehl import load_map
from ballscrew_tehl.applications.calibration.measured_screw import packaged_measurements
from ballscrew_tehl.parameters.units import RPM

PRELOADS = (1000.0, 2000.0, 4000.0, 6000.0)  # N
TEMPERATURE = 303.0  # K


def main() -> dict[str, np.ndarray]:
    """Torque [N.m] (preload, speed) over screw speed [r/min] from the map, and the measured points."""
    nut_map = load_map()
    rpm = np.geomspace(10.0, 3000.0, 200)
    torque = []
    for preload in PRELOADS:
        torque.append(nut_map.evaluate(preload, rpm * RPM, TEMPERATURE).friction_torque)
    points = packaged_measurements(TEMPERATURE)
    measured = np.array([(m.preload, m.speed / RPM, m.torque) for m in points])
    return {"rpm": rpm, "torque": np.array(torque), "measured": measured}


def plot(result: dict[str, np.ndarray], path: Path) -> None:
    """Torque over speed for each preload, measured points as circles."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7.5, 4.4), layout="constrained")
    for preload, torque in zip(PRELOADS, result["torque"], strict=True):
        (line,) = axes.plot(result["rpm"], torque, label=f"{preload / 1000:g} kN", linewidth=2)
        mine = result["measured"][result["measured"][:, 0] == preload]
        axes.plot(mine[:, 1], mine[:, 2], "o", color=line.get_color(), markeredgecolor="black", markersize=6)
    axes.plot([], [], "o", color="white", markeredgecolor="black", label="measured (Zhao 2023)")
    axes.set(xlabel="screw speed [r/min]", ylabel="friction torque [N m]", xscale="log")
    axes.set_ylim(bottom=0.0)
    axes.set_xticks([10, 30, 100, 300, 1000, 3000], labels=["10", "30", "100", "300", "1000", "3000"])
    axes.set_title("Preloaded double-nut ball screw GD4008-3, oil at 30 C")
    axes.grid(alpha=0.3, which="both")
    axes.legend(title="preload", loc="upper left")
    figure.savefig(path, dpi=150)
    plt.close(figure)


if __name__ == "__main__":
    run_and_plot(__file__, __doc__, main, None, plot)
