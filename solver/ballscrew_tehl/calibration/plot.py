"""Picture of a calibration: measured against computed torque, and what is left over speed.

matplotlib is imported when a figure is made.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..friction.sets import SETS
from ..parameters.units import RPM
from .user import Calibration

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: colour-blind safe: lightness rises with the preload; the colour of Okabe & Ito for what needs care
PRELOAD_COLOURS, CAUTION = "viridis", "#D55E00"


def calibration_figure(result: Calibration) -> Figure:
    """Left: computed over measured torque with the 1:1 line. Right: deviations over speed, each point also left out."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    found, basis = result.friction_set, result.basis
    measured, computed = basis.measured, basis.torque(found.values)
    speed = np.array([m.speed / RPM for m in basis.measurements])
    preload = np.array([m.preload / 1000.0 for m in basis.measurements])
    deviation = 100.0 * result.points.deviation
    left_out = 100.0 * result.left_out
    stray = result.points.outliers
    figure = Figure(figsize=(11.0, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.set(xlabel="measured friction torque [N m]", ylabel="computed friction torque [N m]")
    top = 1.06 * max(measured.max(), computed.max())
    left.plot([0.0, top], [0.0, top], color="0.4", linewidth=1.0, zorder=1, label="computed = measured")
    marks = left.scatter(measured, computed, c=preload, cmap=PRELOAD_COLOURS, edgecolors="black", linewidths=0.5,
                         s=42, zorder=3)  # fmt: skip
    left.set(xlim=(0.0, top), ylim=(0.0, top), box_aspect=1.0)
    figure.colorbar(marks, ax=left, label="preload [kN]", shrink=0.85)
    right.set(xlabel="screw speed [r/min]", ylabel="model/measured - 1 [%]", xscale="log")
    right.axhline(0.0, color="0.4", linewidth=1.0)
    stated = [m.uncertainty for m in basis.measurements]
    if all(stated):
        share = 100.0 * np.array(stated, dtype=float) / measured
        right.errorbar(speed, deviation, yerr=share, fmt="none", ecolor="0.55", linewidth=1.0, capsize=3.0, zorder=1,
                       label="standard uncertainty")  # fmt: skip
    right.vlines(speed, deviation, left_out, color="0.75", linewidth=1.0, zorder=1)
    right.scatter(speed, left_out, marker="_", color="0.35", s=60, zorder=2, label="fitted without the point")
    right.scatter(speed, deviation, c=preload, cmap=PRELOAD_COLOURS, edgecolors="black", linewidths=0.5, s=42,
                  zorder=3, label="fitted to all points")  # fmt: skip
    for axes, x, y in ((left, measured, computed), (right, speed, deviation)):
        if stray:
            axes.scatter(x[stray], y[stray], facecolors="none", edgecolors=CAUTION, linewidths=2.0, s=170, zorder=4,
                         label="outlier")  # fmt: skip
        axes.grid(alpha=0.3)
    for i in stray:
        name = ", ".join(str(row) for row in basis.measurements[i].rows or (i + 1,))
        right.annotate(
            f"row {name}", (speed[i], deviation[i]), xytext=(9, 9), textcoords="offset points", color=CAUTION
        )
    right.xaxis.set_major_formatter("{x:g}")
    if speed.max() < 10.0 * speed.min():
        # less than a decade has no major tick of its own
        right.set_xticks(np.unique(np.round(speed)), minor=False)
        right.xaxis.set_minor_formatter(NullFormatter())
    right.margins(y=0.12)
    left.legend(loc="upper left", fontsize="small")
    right.legend(loc="best", fontsize="small")
    errors, count = found.errors, len(SETS[found.name])
    figure.suptitle(
        f"{len(basis)} points, {count} fitted parameters ({found.kinematics}, film {found.film_model}, {found.loss}): "
        f"mean deviation {100.0 * errors['mean']:.2f} %, left out {100.0 * errors['leave_one_out_mean']:.2f} %",
        fontsize="medium",
    )
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG to a temporary name beside `path` and rename it."""
    temporary = path.with_name(path.name + ".part")
    try:
        figure.savefig(temporary, format="png", dpi=150, metadata={"Software": None})
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
