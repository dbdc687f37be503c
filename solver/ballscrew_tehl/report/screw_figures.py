"""Figures of the section on the screw itself: loads, pressure, stiffness, lost motion, life, efficiency."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..nut_map.plot import kilonewton, scale
from ..parameters.units import RPM
from ..physics.axial_stiffness import separation_deflection_load
from ..physics.rating import STATIC_PRESSURE
from .figures import LINE, drawn, finish
from .screw_numbers import ScrewNumbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: field -> label of its axis, factor from SI
QUANTITIES = {
    "contact_pressure_max": ("largest Hertz pressure [GPa]", 1e-9),
    "ball_load_max": ("load of the heaviest ball [N]", 1.0),
    "axial_stiffness": ("axial stiffness [N/um]", 1e-6),
    "lost_motion": ("lost motion [um]", 1e6),
    "life_turns": ("life L10 [turns]", 1.0),
}
#: those computed with rigid bodies, of which the relieved side comes free earlier
RIGID = ("axial_stiffness", "lost_motion")


@drawn()
def over_axial_load(figure: Figure, axes: Axes, numbers: ScrewNumbers, name: str) -> None:
    """A field of QUANTITIES over the axial load, one line per preload; dots: the preload is released."""
    label, factor = QUANTITIES[name]
    values = factor * numbers.line(name)
    separation = numbers.line("separation_load")[:, 0]
    if name in RIGID:
        separation = separation_deflection_load(numbers.constants.stiffness, numbers.preloads)[1]
    x = numbers.axial_loads / 1000.0
    for preload, line, apart, colour in zip(
        numbers.preloads, values, separation / 1000.0, scale("cividis", len(values)), strict=True
    ):
        axes.plot(x, line, color=colour, linewidth=LINE, label=kilonewton(preload))
        axes.plot(apart, np.interp(apart, x, line), "o", color=colour, markeredgecolor="black", markersize=5)
    if name == "life_turns":
        axes.set_yscale("log")
    elif name == "contact_pressure_max":
        _with_static_pressure(axes)
    else:
        axes.set_ylim(bottom=0.0)
    finish(axes, "axial load [kN]", label)
    axes.set_xlim(x[0], x[-1])
    figure.legend(title="preload; dot: relieved side unloaded", loc="outside upper center", ncols=3)


def _with_static_pressure(axes: Axes) -> None:
    axes.axhline(1e-9 * STATIC_PRESSURE, color="black", linestyle="--", linewidth=1.0)
    axes.annotate("static rating", (0.02, 1e-9 * STATIC_PRESSURE), xycoords=("axes fraction", "data"),
                  xytext=(0.0, -3.0), textcoords="offset points", va="top")  # fmt: skip
    axes.set_ylim(0.0, 1.08e-9 * STATIC_PRESSURE)


@drawn()
def stiffness_over_preload(figure: Figure, axes: Axes, numbers: ScrewNumbers) -> None:
    """Axial stiffness without axial load over the preload, with the preloads of the other figures."""
    preload, stiffness = numbers.preload_line
    axes.plot(preload / 1000.0, 1e-6 * stiffness, color="0.3", linewidth=LINE)
    for force, colour in zip(numbers.preloads, scale("cividis", len(numbers.preloads)), strict=True):
        at = np.interp(force, preload, 1e-6 * stiffness)
        axes.plot(force / 1000.0, at, "o", color=colour, markeredgecolor="black", label=kilonewton(force))
    finish(axes, "preload [kN]", "axial stiffness [N/um]", "without axial load")
    axes.set_xlim(0.0, preload[-1] / 1000.0)
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="lower right")


@drawn(4.0)
def efficiency_over_axial_load(figure: Figure, axes: Axes, numbers: ScrewNumbers) -> None:
    """Efficiency both ways over the axial load, one colour per speed."""
    colours = scale("plasma", len(numbers.speeds))
    x = numbers.axial_loads / 1000.0
    for speed, driving, back, colour in zip(
        numbers.speeds, numbers.driving, numbers.backdriving, colours, strict=True
    ):
        axes.plot(x, 100.0 * driving, color=colour, linewidth=LINE, label=f"{speed / RPM:.0f} r/min")
        axes.plot(x, 100.0 * back, "--", color=colour, linewidth=LINE)
    axes.plot([], [], color="0.3", label="screw drives")
    axes.plot([], [], "--", color="0.3", label="nut drives")
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(0.0, 100.0)
    finish(axes, "axial load [kN]", "efficiency [%]", f"preload {kilonewton(numbers.point.preload)}")
    figure.legend(loc="outside lower center", ncols=2)
