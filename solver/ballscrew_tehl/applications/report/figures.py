"""Figures of the report, each as a data address (data:image/svg+xml;base64,...), legible on a phone."""

import base64
import io
from collections.abc import Callable
from functools import wraps
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from ballscrew_tehl.numerics import Array
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.rating import nsk_torque

from ..axis.plot import draw_budget
from ..trend import THICK
from .data import CATALOGUE_SPEED, Lines, ReportData

SIZE = (4.2, 4.2)  # [in]
#: letters of 9 pt are 8 pt on a phone of 390 px; the same figure gives the same bytes
STYLE: Any = {
    "font.size": 9.0, "axes.titlesize": 9.0, "legend.fontsize": 9.0, "legend.title_fontsize": 9.0,
    "lines.linewidth": 1.8, "axes.grid": True, "grid.alpha": 0.3, "svg.hashsalt": "report",
}  # fmt: skip
#: colour maps of preloads and of temperatures, and colours of the parts of the torque (Okabe & Ito): colour-blind safe
PRELOADS, TEMPERATURES, PARTS = "cividis", "plasma", ("#D55E00", "#009E73", "#0072B2")
MIXED = (1.0, THICK)  # film ratios between which asperities carry a part of the load


def drawn(draw: Callable[..., None]) -> Callable[[ReportData], str]:
    """Makes of what draws into a figure and its axes what returns the address of the picture."""

    @wraps(draw)
    def address(data: ReportData) -> str:
        out = io.BytesIO()
        with matplotlib.rc_context(STYLE):
            figure = Figure(figsize=SIZE, layout="constrained")
            draw(figure, figure.subplots(), data)
            figure.savefig(out, format="svg", metadata={"Date": None})
        return f"data:image/svg+xml;base64,{base64.b64encode(out.getvalue()).decode()}"

    return address


def colours(name: str, rows: Array) -> list[Any]:
    """A colour for each row from dark to light, none too light for a line on white."""
    return list(matplotlib.colormaps[name](np.linspace(0.0, 0.82, len(rows))))


def kilonewton(force: float) -> str:
    """A force [N] with its unit."""
    return f"{force / 1000.0:.3g} kN"


def celsius(temperature: float) -> str:
    """A temperature [K] with its unit."""
    return f"{temperature - CELSIUS:.3g} C"


def logarithmic(axes: Axes, which: str) -> None:
    """A logarithmic axis with plain numbers at 1, 2, 5 or, over many decades, at 1, 3 of each."""
    axes.set(**{f"{which}scale": "log"})
    axis = getattr(axes, f"{which}axis")
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 3.0) if high > 300.0 * low else (1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def draw_lines(
    axes: Axes, data: ReportData, lines: Lines, label: Callable[[float], str], shades: list[Any]
) -> None:
    """Lines with their intervals, dashed where their trend is not physical."""
    speed, interval_speed = data.line_speeds / RPM, data.interval_speeds / RPM
    for k, colour in enumerate(shades):
        torque, dashed = lines.torque[k], lines.unphysical[k]
        axes.plot(speed, np.where(dashed, np.nan, torque), color=colour, label=label(lines.rows[k]))
        axes.plot(speed, np.where(dashed, torque, np.nan), "--", color=colour)
        if lines.interval is not None:
            axes.fill_between(interval_speed, *lines.interval[k].T, color=colour, alpha=0.2, linewidth=0.0)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("friction torque [N m]")


def over_speed(figure: Figure, axes: Axes, title: str, columns: int = 3) -> None:
    """Axis of speed, title and legend of a figure over speed; columns: of the legend, fewer for long labels."""
    axes.set(title=title, xlabel="screw speed [r/min]")
    axes.margins(x=0.02)
    logarithmic(axes, "x")
    figure.legend(loc="outside lower center", ncols=columns)


@drawn
def torque_by_preload(figure: Figure, axes: Axes, data: ReportData) -> None:
    """Torque over speed, one line per preload, with the catalogue torque of each at its speed."""
    shades = colours(PRELOADS, data.preloads)
    draw_lines(axes, data, data.by_preload, kilonewton, shades)
    for torque, colour in zip(nsk_torque(data.parameters.screw, data.preloads), shades, strict=True):
        axes.plot(CATALOGUE_SPEED / RPM, torque, "D", color=colour, markeredgecolor="black")
    axes.plot([], [], "D", color="white", markeredgecolor="black", label="catalogue")
    over_speed(figure, axes, f"oil at {celsius(data.point.temperature)}")


@drawn
def torque_by_temperature(figure: Figure, axes: Axes, data: ReportData) -> None:
    """Torque over speed, one line per oil temperature."""
    draw_lines(axes, data, data.by_temperature, celsius, colours(TEMPERATURES, data.temperatures))
    over_speed(figure, axes, f"preload {kilonewton(data.point.preload)}")


@drawn
def torque_parts(figure: Figure, axes: Axes, data: ReportData) -> None:
    """Parts of the torque over speed at the operating point, stacked."""
    point = data.point
    state = data.nut_map.evaluate(point.preload, data.line_speeds, point.temperature)
    parts = state.sliding_torque, state.hysteresis_torque, state.viscous_torque
    labels = "sliding", "hysteresis", "rolling" if data.mechanistic else "viscous"
    axes.stackplot(data.line_speeds / RPM, parts, labels=labels, colors=PARTS)
    axes.set_ylabel("friction torque [N m]")
    over_speed(figure, axes, f"preload {kilonewton(point.preload)}, oil at {celsius(point.temperature)}")


@drawn
def axis_parts(figure: Figure, axes: Axes, data: ReportData) -> None:
    """Friction of the axis by part over speed, stacked, with the interval of the sum."""
    assert data.budget is not None
    draw_budget(axes, data.budget)
    point = data.point
    title = f"preload {kilonewton(point.preload)}, oil at {celsius(point.temperature)}"
    over_speed(figure, axes, title, columns=2)


@drawn
def film(figure: Figure, axes: Axes, data: ReportData) -> None:
    """Least film of all balls over speed, one line per oil temperature, with lambda on the right."""
    films, shades = 1e9 * data.films.film_thickness_min, colours(TEMPERATURES, data.temperatures)
    for line, temperature, colour in zip(films, data.temperatures, shades, strict=True):
        axes.plot(data.line_speeds / RPM, line, color=colour, label=celsius(temperature))
    axes.set_ylabel("least film over the balls [nm]")
    logarithmic(axes, "y")
    if nanometres := 1e9 * data.roughness:
        low, high = axes.get_ylim()
        axes.axhspan(*(nanometres * ratio for ratio in MIXED), color="0.88", zorder=0, label="mixed")
        axes.set_ylim(low, high)
        right = axes.twinx()
        right.set_ylim(low / nanometres, high / nanometres)
        right.set_ylabel("lambda")
        right.grid(visible=False)
        logarithmic(right, "y")
    over_speed(figure, axes, f"preload {kilonewton(data.point.preload)}")
