"""Figure of a calibration: computed over measured torque, and deviations over speed."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..parameters.units import RPM
from ..whole_file import whole_file
from .result import Calibration

#: colour-blind safe: lightness rises with the preload; outliers in a colour of Okabe & Ito
PRELOAD_COLOURS, CAUTION = "viridis", "#D55E00"


def calibration_figure(result: Calibration) -> Figure:
    """Left: computed over measured torque with the 1:1 line. Right: deviations over speed, also of left-out points."""
    entry, basis, fit = result.friction_set, result.basis, result.fit
    measured, computed, outliers = basis.measured, basis.torque(fit.values), fit.outliers
    speed, preload = np.array([(m.speed / RPM, 1e-3 * m.preload) for m in basis.measurements]).T
    deviation, left_out = 100.0 * fit.deviation, 100.0 * fit.left_out
    figure = Figure(figsize=(11.0, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    top = 1.06 * max(measured.max(), computed.max())
    left.plot([0.0, top], [0.0, top], color="0.4", linewidth=1.0, zorder=1, label="computed = measured")
    left.set(xlabel="measured friction torque [N m]", ylabel="computed friction torque [N m]")
    right.axhline(0.0, color="0.4", linewidth=1.0)
    right.vlines(speed, deviation, left_out, color="0.75", linewidth=1.0, zorder=1)
    right.scatter(speed, left_out, marker="_", color="0.35", s=60, zorder=2, label="fitted without the point")
    right.set(xlabel="screw speed [r/min]", ylabel="model/measured - 1 [%]", xscale="log")
    right.xaxis.set_major_formatter("{x:g}")
    style: Any = {"cmap": PRELOAD_COLOURS, "edgecolors": "black", "linewidths": 0.5, "s": 42, "zorder": 3}
    ring: Any = {"facecolors": "none", "edgecolors": CAUTION, "linewidths": 2.0, "s": 170, "zorder": 4}
    for axes, x, y in (left, measured, computed), (right, speed, deviation):
        points = axes.scatter(x, y, c=preload, label="fitted to all points", **style)
        if outliers:
            axes.scatter(x[outliers], y[outliers], label="outlier", **ring)
        axes.grid(alpha=0.3)
        axes.legend(loc="best", fontsize="small")
    figure.colorbar(points, ax=left, label="preload [kN]", shrink=0.85)
    mean, unseen = (100.0 * entry.errors.get(key, math.nan) for key in ("mean", "leave_one_out_mean"))
    title = f"{len(basis)} points ({entry.kinematics}, {entry.name}, film {entry.film_model})"
    figure.suptitle(f"{title}: mean {mean:.2f} %, left out {unseen:.2f} %", fontsize="medium")
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG to a temporary file in the same folder and rename it."""
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150, metadata={"Software": None})
