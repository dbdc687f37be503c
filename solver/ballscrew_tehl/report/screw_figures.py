"""Figures of the section on the screw itself: loads, pressure, stiffness, lost motion, life, efficiency."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..nut_map.plot import scale
from ..parameters.units import RPM
from ..physics.axial_stiffness import separation_deflection_load
from ..physics.rating import STATIC_PRESSURE
from .figures import LINE, figure_address, finish, new_figure
from .screw_numbers import ScrewNumbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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


def over_axial_load(numbers: ScrewNumbers, name: str) -> str:
    """A field of QUANTITIES over the axial load, one line per preload; dots: the preload is released."""
    label, factor = QUANTITIES[name]
    figure, axes = new_figure()
    values = factor * numbers.line(name)
    separation = numbers.line("separation_load")[:, 0]
    if name in RIGID:
        separation = separation_deflection_load(numbers.constants.stiffness, numbers.preloads)[1]
    x = numbers.axial_loads / 1000.0
    for preload, line, apart, colour in zip(
        numbers.preloads, values, separation / 1000.0, scale("cividis", len(values)), strict=True
    ):
        axes.plot(x, line, color=colour, linewidth=LINE, label=f"{preload / 1000.0:.3g} kN")
        axes.plot(apart, np.interp(apart, x, line), "o", color=colour, markeredgecolor="black", markersize=5)
    DETAILS.get(name, _from_zero)(axes)
    finish(axes, "axial load [kN]", label)
    axes.set_xlim(x[0], x[-1])
    figure.legend(title="preload; dot: relieved side unloaded", loc="outside upper center", ncols=3)
    return figure_address(figure, "svg")


def _from_zero(axes: Axes) -> None:
    axes.set_ylim(bottom=0.0)


def _with_static_pressure(axes: Axes) -> None:
    axes.axhline(1e-9 * STATIC_PRESSURE, color="black", linestyle="--", linewidth=1.0)
    axes.annotate("static rating", (0.02, 1e-9 * STATIC_PRESSURE), xycoords=("axes fraction", "data"),
                  xytext=(0.0, -3.0), textcoords="offset points", va="top")  # fmt: skip
    axes.set_ylim(0.0, 1.08e-9 * STATIC_PRESSURE)


def _logarithmic(axes: Axes) -> None:
    axes.set_yscale("log")


DETAILS: dict[str, Callable[[Any], None]] = {
    "contact_pressure_max": _with_static_pressure,
    "life_turns": _logarithmic,
}


def stiffness_over_preload(numbers: ScrewNumbers) -> str:
    """Axial stiffness without axial load over the preload, with the preloads of the other figures."""
    figure, axes = new_figure()
    preload, stiffness = numbers.preload_line
    axes.plot(preload / 1000.0, 1e-6 * stiffness, color="0.3", linewidth=LINE)
    for force, colour in zip(numbers.preloads, scale("cividis", len(numbers.preloads)), strict=True):
        at = np.interp(force, preload, 1e-6 * stiffness)
        axes.plot(
            force / 1000.0, at, "o", color=colour, markeredgecolor="black", label=f"{force / 1000.0:.3g} kN"
        )
    finish(axes, "preload [kN]", "axial stiffness [N/um]", "without axial load")
    axes.set_xlim(0.0, preload[-1] / 1000.0)
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="lower right")
    return figure_address(figure, "svg")


def efficiency_over_axial_load(numbers: ScrewNumbers) -> str:
    """Efficiency both ways over the axial load, one colour per speed."""
    figure, axes = new_figure(4.0)
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
    point = numbers.point
    finish(axes, "axial load [kN]", "efficiency [%]", f"preload {point.preload / 1000.0:.3g} kN")
    figure.legend(loc="outside lower center", ncols=2)
    return figure_address(figure, "svg")
