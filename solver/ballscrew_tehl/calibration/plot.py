"""Figure of a calibration: computed over measured torque, and deviations over speed.

matplotlib is imported when a figure is made.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..friction.sets import SETS
from ..parameters.units import RPM
from ..whole_file import whole_file
from .result import Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: colour-blind safe: lightness rises with the preload; outliers in a colour of Okabe & Ito
PRELOAD_COLOURS, CAUTION = "viridis", "#D55E00"


def calibration_figure(result: Calibration) -> Figure:
    """Left: computed over measured torque with the 1:1 line. Right: deviations over speed, also of left-out points."""
    from matplotlib.figure import Figure

    found, basis = result.friction_set, result.basis
    figure = Figure(figsize=(11.0, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    _computed_over_measured(left, result)
    figure.colorbar(left.collections[0], ax=left, label="preload [kN]", shrink=0.85)
    _deviations_over_speed(right, result)
    left.legend(loc="upper left", fontsize="small")
    right.legend(loc="best", fontsize="small")
    errors, count = found.errors, len(SETS[found.name])
    figure.suptitle(
        f"{len(basis)} points, {count} fitted parameter{'s' if count > 1 else ''} ({found.kinematics}, "
        f"film {found.film_model}): "
        f"mean deviation {100.0 * errors['mean']:.2f} %, "
        f"left out {100.0 * errors.get('leave_one_out_mean', math.nan):.2f} %",
        fontsize="medium",
    )
    return figure


def _points(axes: Axes, result: Calibration, x: np.ndarray, y: np.ndarray, label: str = "") -> None:
    """The points, coloured by preload; rings around the outliers."""
    preload = [m.preload / 1000.0 for m in result.basis.measurements]
    axes.scatter(
        x, y, c=preload, cmap=PRELOAD_COLOURS, edgecolors="black", linewidths=0.5, s=42, zorder=3, label=label
    )
    if outliers := result.fit.outliers:
        axes.scatter(x[outliers], y[outliers], facecolors="none", edgecolors=CAUTION, linewidths=2.0, s=170, zorder=4,
                     label="outlier")  # fmt: skip
    axes.grid(alpha=0.3)


def _computed_over_measured(axes: Axes, result: Calibration) -> None:
    measured, computed = result.basis.measured, result.basis.torque(result.friction_set.values)
    top = 1.06 * max(measured.max(), computed.max())
    axes.plot([0.0, top], [0.0, top], color="0.4", linewidth=1.0, zorder=1, label="computed = measured")
    _points(axes, result, measured, computed)
    axes.set(xlabel="measured friction torque [N m]", ylabel="computed friction torque [N m]")
    axes.set(xlim=(0.0, top), ylim=(0.0, top), box_aspect=1.0)


def _deviations_over_speed(axes: Axes, result: Calibration) -> None:
    from matplotlib.ticker import NullFormatter

    measurements = result.basis.measurements
    speed = np.array([m.speed / RPM for m in measurements])
    deviation, left_out = 100.0 * result.fit.deviation, 100.0 * result.fit.left_out
    axes.set(xlabel="screw speed [r/min]", ylabel="model/measured - 1 [%]", xscale="log")
    axes.axhline(0.0, color="0.4", linewidth=1.0)
    stated = [m.uncertainty for m in measurements]
    if all(stated):
        share = 100.0 * np.array(stated, dtype=float) / result.basis.measured
        axes.errorbar(speed, deviation, yerr=share, fmt="none", ecolor="0.55", linewidth=1.0, capsize=3.0, zorder=1,
                      label="standard uncertainty")  # fmt: skip
    axes.vlines(speed, deviation, left_out, color="0.75", linewidth=1.0, zorder=1)
    axes.scatter(speed, left_out, marker="_", color="0.35", s=60, zorder=2, label="fitted without the point")
    _points(axes, result, speed, deviation, "fitted to all points")
    for i in result.fit.outliers:
        name = ", ".join(str(row) for row in measurements[i].rows or (i + 1,))
        axes.annotate(
            f"row {name}", (speed[i], deviation[i]), xytext=(9, 9), textcoords="offset points", color=CAUTION
        )
    axes.xaxis.set_major_formatter("{x:g}")
    if speed.max() < 10.0 * speed.min():
        # a logarithmic axis of less than a decade may have no major tick
        axes.set_xticks(np.unique(np.round(speed)), minor=False)
        axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(y=0.12)


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG to a temporary file in the same folder and rename it."""
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150, metadata={"Software": None})
