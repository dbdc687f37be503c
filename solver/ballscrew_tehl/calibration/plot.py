"""Figure of a calibration: torque over speed with its interval, measured points and residuals."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from ..atlas.ball_contacts import BallContacts
from ..friction.interval import interval_ends
from ..friction.mechanistic import nuts_powers, torque_line
from ..friction.sets import with_supply
from ..friction.torque import nut_forces
from ..parameters.units import CELSIUS, RPM
from ..physics.ball_law import Array
from ..whole_file import whole_file
from .result import Calibration

#: colour-blind safe: lightness rises with the preload; outliers in a colour of Okabe & Ito
COLOURS, CAUTION = "viridis", "#D55E00"
#: preloads, loads and temperatures of which the curve is drawn
CURVES = 8


def calibration_figure(result: Calibration) -> Figure:
    """Above: torque over speed with its interval, one colour a preload, and measured points. Below: their residuals."""
    fit, points = result.fit, result.basis.measurements
    computed, groups = result.basis.torque(fit.values), dict[str, list[int]]()
    for i in sorted(range(len(points)), key=lambda i: (points[i].preload, points[i].speed)):
        m = points[i]
        load = f", load {1e-3 * m.axial_load:.3g} kN" * (m.axial_load != 0.0)
        groups.setdefault(
            f"{1e-3 * m.preload:.3g} kN{load}, {m.temperature - CELSIUS:.0f} \u00b0C", []
        ).append(i)
    speed, torque = np.array([(m.speed / RPM, m.torque) for m in points]).T
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    for k, (name, rows) in enumerate(groups.items()):
        # of many, some
        colour = colormaps[COLOURS](0.85 * k / max(len(groups) - 1, 1))
        x, y, low, high = _curve(result, rows, (speed.min() * RPM, speed.max() * RPM))
        above.fill_between(x, low, high, color=colour, alpha=0.18, linewidth=0.0)
        above.plot(x, y, color=colour, linewidth=1.4, label=name)
        style: Any = {"color": colour, "edgecolors": "black", "linewidths": 0.5, "s": 40, "zorder": 3}
        above.scatter(speed[rows], torque[rows], **style)
        below.scatter(speed[rows], 100.0 * fit.deviation[rows], **style)
    below.vlines(speed, 100.0 * fit.deviation, 100.0 * fit.left_out, color="0.75", linewidth=1.0, zorder=1)
    below.scatter(
        speed,
        100.0 * fit.left_out,
        marker="_",
        color="0.35",
        s=60,
        zorder=2,
        label="fitted without the point",
    )
    ring: Any = {"facecolors": "none", "edgecolors": CAUTION, "linewidths": 2.0, "s": 170, "zorder": 4}
    if rows := fit.outliers:
        above.scatter(speed[rows], torque[rows], label="outlier", **ring)
        below.scatter(speed[rows], 100.0 * fit.deviation[rows], **ring)
    below.axhline(0.0, color="0.4", linewidth=1.0)
    above.set(ylabel="friction torque [N m]", ylim=(0.0, None))
    below.set(xlabel="screw speed [r/min]", ylabel="model/measured - 1 [%]", xscale="log")
    below.xaxis.set_major_formatter("{x:g}")
    for axes in above, below:
        axes.grid(alpha=0.3)
    above.legend(fontsize="small", ncols=2, title="line: law, band: its 80 % interval, circles: measured")
    below.legend(loc="best", fontsize="small")
    entry = result.friction_set
    mean, unseen = (100.0 * entry.errors.get(key, math.nan) for key in ("mean", "leave_one_out_mean"))
    title = f"{result.parameters.name}, {len(points)} points ({entry.kinematics}, {entry.name})"
    figure.suptitle(f"{title}: mean error {mean:.2f} %, left out {unseen:.2f} %", fontsize="medium")
    return figure


def _curve(
    result: Calibration, rows: list[int], ends: tuple[float, float]
) -> tuple[Array, Array, Array, Array]:
    """Speeds [r/min] between ends, torque and its interval [N.m]; at the points alone where contacts are not of the atlas."""
    points, entry, film = [result.basis.measurements[i] for i in rows], result.friction_set, result.film
    if not isinstance(film, BallContacts):
        torque = result.basis.torque(result.fit.values)[rows]
        return np.array([m.speed / RPM for m in points]), torque, torque, torque
    parameters, m = with_supply(result.parameters, entry), points[0]
    speeds, temperature = np.geomspace(*ends, 40), np.array([m.temperature])
    nuts = nuts_powers(
        parameters, nut_forces(parameters, m.preload, m.axial_load), film, speeds[:, None], temperature
    )
    rest, slope = torque_line(nuts)
    torque = np.ravel(rest + entry.net_sliding_coefficient * slope)
    low, high = np.ones((2, len(speeds)))
    if m.axial_load == 0.0:
        interval = interval_ends(parameters, np.array([m.preload]), film, speeds, temperature, entry)
        low, high = (np.ravel(end) for end in interval)
    return speeds / RPM, torque, low * torque, high * torque


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG to a temporary file in the same folder and rename it."""
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150, metadata={"Software": None})
