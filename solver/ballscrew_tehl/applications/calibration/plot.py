"""Figure of a calibration: torque over speed with its interval, measured points and residuals."""

import io
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.friction.interval import torque_and_ends
from ballscrew_tehl.friction.sets import with_supply
from ballscrew_tehl.numerics import Array
from ballscrew_tehl.parameters.units import CELSIUS, RPM

from .result import Calibration

#: colour-blind safe: lightness rises with the preload; outliers in a colour of Okabe & Ito
COLOURS, CAUTION = "viridis", "#D55E00"
#: speeds shown around points at one, as a factor
AROUND = 3.0


def calibration_figure(result: Calibration) -> Figure:
    """Above: torque over speed with its interval, one colour a preload, and measured points. Below: their residuals."""
    fit, points, groups = result.fit, result.basis.measurements, dict[str, list[int]]()
    for i in sorted(range(len(points)), key=lambda i: (points[i].preload, points[i].speed)):
        kelvin, load = (
            points[i].temperature,
            f", load {points[i].axial_load:.6g} N" * bool(points[i].axial_load),
        )
        groups.setdefault(f"{points[i].preload:.6g} N{load}, {kelvin - CELSIUS:.0f} C", []).append(i)
    speed = np.array([m.speed / RPM for m in points])
    shown = [result.basis.measured, np.round(100.0 * fit.deviation, 6)]
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    for k, (name, rows) in enumerate(groups.items()):
        colour = colormaps[COLOURS](0.85 * k / max(len(groups) - 1, 1))
        x, y, low, high = _curve(result, rows, speed)
        above.fill_between(x, low, high, color=colour, alpha=0.18, linewidth=0.0)
        above.plot(x, y, color=colour, linewidth=1.4, label=name)
        for axes, values in zip((above, below), shown, strict=True):
            axes.scatter(
                speed[rows], values[rows], color=colour, edgecolors="black", linewidths=0.5, s=40, zorder=3
            )
    left_out = 100.0 * fit.left_out
    below.vlines(speed, shown[1], left_out, color="0.75", linewidth=1.0, zorder=1)
    below.scatter(speed, left_out, marker="_", color="0.35", s=60, zorder=2, label="fitted without the point")
    below.axhline(0.0, color="0.4", linewidth=1.0)
    ring: Any = {"facecolors": "none", "edgecolors": CAUTION, "linewidths": 2.0, "s": 170, "zorder": 4}
    for axes, values in zip((above, below), shown, strict=True):
        if rows := fit.outliers:
            axes.scatter(speed[rows], values[rows], label="outlier", **ring)
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small", ncols=2)
    above.set(ylabel="friction torque [N m]", ylim=(0.0, None))
    above.set_title("line: law; band: about 80 %; circles: measured", fontsize="small")
    below.set(xlabel="screw speed [r/min]", ylabel="model/measured - 1 [%]", xscale="log")
    below.xaxis.set(major_formatter="{x:g}", minor_formatter=LogFormatter())
    entry = result.friction_set
    title = f"{result.parameters.name}, points: {len(points)} ({entry.name})"
    for key, text in (("mean", "mean error"), ("leave_one_out_mean", "left out")):
        title += f", {text} {100.0 * entry.errors[key]:.2f} %" if key in entry.errors else ""
    figure.suptitle(title, fontsize="medium")
    return figure


def _curve(result: Calibration, rows: list[int], speed: Array) -> list[Array]:
    """Speeds [r/min], torque and its interval [N.m]; at the points alone if their contacts are not of the atlas."""
    points, entry, film = [result.basis.measurements[i] for i in rows], result.friction_set, result.film
    if not isinstance(film, BallContacts):
        return [speed[rows], *3 * [result.basis.torque(result.fit.values)[rows]]]
    parameters, m = with_supply(result.parameters, entry), points[0]
    around = AROUND if np.ptp(speed) == 0.0 else 1.0
    speeds = np.geomspace(speed.min() / around, speed.max() * around, 40)
    at, temperature = speeds * RPM, np.array([m.temperature])
    point = np.array([m.preload]), film, at, temperature, entry, m.axial_load
    torque, low, high = map(np.ravel, torque_and_ends(parameters, *point))
    return [speeds, torque, torque * low, torque * high]


def png_of(figure: Figure) -> bytes:
    """A figure as PNG."""
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=150, metadata={"Software": None})
    return picture.getvalue()
