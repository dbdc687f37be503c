"""Figures of solved contacts: fields as filled contours, pressure and film along the middle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..physics.ball_law import Array
from ..physics.hertz import RACEWAYS
from .figures import COLOURS, LINE, SMALL, drawn, finish

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..contact import ContactResult

#: films above this number of central films are not drawn over the middle line
MOST_FILMS = 2.5
#: share of the Hertz ellipse within the scale of a field: few nodes of a spike would leave the rest in one colour
HELD = 0.98
#: levels of a field, at most
LEVELS = 14
#: drawn domain: along rolling in half-widths, across in semi-axes; its points
SHOWN_X, SHOWN_Y = (-2.2, 1.6), 1.25
POINTS_X, POINTS_Y = 401, 301
#: least half-width of a line over that of the Hertz ellipse
MIN_RIM = 0.2
#: field -> title, unit, factor from SI, colours
FIELDS = {
    "pressure": ("Pressure", "GPa", 1e-9, "viridis"),
    "film": ("Film thickness", "nm", 1e9, "cividis_r"),
    "rise": ("Temperature rise, largest across the film", "K", 1.0, "inferno_r"),
}


def whole_field(solution: ContactResult, name: str) -> tuple[Array, Array, Array]:
    """x along rolling in half-widths, y across in semi-axes, field of FIELDS (n_y, n_x) on both halves, SI."""
    if name == "rise":
        assert solution.temperature is not None
        field = solution.temperature.max(axis=2) - solution.conditions.temperature
    else:
        field = getattr(solution, name)
    y = np.concatenate((-solution.y[:0:-1], solution.y))
    return solution.x, y, np.concatenate((field[:0:-1], field))


def fine_field(solution: ContactResult, name: str) -> tuple[Array, Array, Array]:
    """The field on POINTS_X x POINTS_Y points of the drawn domain, arguments and axes as whole_field.

    The lines of the solver lie far apart across rolling and their features follow the rim of the contact: between the
    lines the field is interpolated at equal places over the half-width of the Hertz ellipse there, monotonically, so
    that no value is made up.
    """
    from scipy.interpolate import PchipInterpolator

    x, y, field = whole_field(solution, name)
    fine_x, fine_y = np.linspace(*SHOWN_X, POINTS_X), np.linspace(-SHOWN_Y, SHOWN_Y, POINTS_Y)
    inside = np.clip(fine_y, y[0], y[-1])
    rim, fine_rim = (np.sqrt(np.clip(1.0 - of**2, MIN_RIM**2, None)) for of in (y, inside))
    reach = np.abs(fine_x).max() / MIN_RIM
    place = np.linspace(-reach, reach, int(POINTS_X * 2.0 * reach))
    rows = np.array([np.interp(place * half, x, line) for half, line in zip(rim, field, strict=True)])
    # monotone but for rounding
    between = np.clip(PchipInterpolator(y, rows, axis=0)(inside), np.min(field), np.max(field))
    fine = [np.interp(fine_x / half, place, line) for half, line in zip(fine_rim, between, strict=True)]
    return fine_x, fine_y, np.array(fine)


def inside_range(solution: ContactResult, name: str) -> tuple[float, float]:
    """Least value in the Hertz ellipse and the one not exceeded in the share HELD of it, SI."""
    x, y, field = fine_field(solution, name)
    inside = field[y[:, None] ** 2 + x**2 < 1.0]
    return float(inside.min()), float(np.quantile(inside, HELD))


def contour_levels(ranges: Sequence[tuple[float, float]], name: str) -> Array:
    """Round levels in the unit of FIELDS over the values in the ellipses; what lies outside them is left blank.

    Pressure and rise begin above zero, so that the unloaded surroundings have no colour.
    """
    from matplotlib.ticker import MaxNLocator

    factor = FIELDS[name][2]
    low = factor * min(least for least, _ in ranges) if name == "film" else 0.0
    high = factor * max(most for _, most in ranges)
    levels = np.asarray(MaxNLocator(LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    return levels if name == "film" else levels[levels > 1e-9 * high]


@drawn(4.6, 2, "png")
def contact_field(
    figure: Figure, panels: Sequence[Axes], solutions: Sequence[ContactResult | None], name: str
) -> None:
    """A field of FIELDS on screw and nut raceway with one colour scale; oil enters from below; the Hertz ellipse."""
    title, unit, factor, colours = FIELDS[name]
    levels = contour_levels([inside_range(s, name) for s in solutions if s is not None], name)
    filled = None
    # a spike above the scale has the colour of its end; a film above it is not in the contact
    extend = "neither" if name == "film" else "max"
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    for axes, raceway, s in zip(panels, RACEWAYS, solutions, strict=True):
        axes.set(title=f"{raceway} raceway", ylabel="along rolling [um]")
        if s is None:
            axes.text(0.5, 0.5, "not converged", ha="center", transform=axes.transAxes)
            continue
        a, b = 1e6 * s.hertz.a, 1e6 * s.hertz.b
        x, y, field = fine_field(s, name)
        filled = axes.contourf(a * y, b * x, factor * field.T, levels, cmap=colours, extend=extend)
        axes.plot(a * np.cos(angle), b * np.sin(angle), color="black", linewidth=0.8, linestyle="--")
        axes.set(xlim=(-SHOWN_Y * a, SHOWN_Y * a), ylim=(SHOWN_X[0] * b, SHOWN_X[1] * b))
    panels[-1].set_xlabel("across rolling [um]")
    if filled is not None:
        figure.colorbar(filled, ax=panels, label=f"[{unit}]", location="bottom", aspect=40)
    figure.suptitle(title)


@drawn(5.0, 2)
def central_lines(figure: Figure, panels: Sequence[Axes], solutions: Sequence[ContactResult | None]) -> None:
    """Pressure and film along the middle of both contacts."""
    for axes, raceway, s in zip(panels, RACEWAYS, solutions, strict=True):
        finish(axes, "", "pressure [GPa]", f"{raceway} raceway")
        if s is None:
            axes.text(0.5, 0.5, "not converged", ha="center", transform=axes.transAxes)
            continue
        row = int(np.argmin(np.abs(s.y)))
        x = 1e6 * s.hertz.b * s.x
        axes.plot(x, 1e-9 * s.pressure[row], color=COLOURS[0], linewidth=LINE, label="pressure")
        hertz = 1e-9 * s.hertz.p_max * np.sqrt(np.clip(1.0 - s.x**2, 0.0, None))
        axes.plot(x, hertz, ":", color="0.4", label="Hertz")
        right = axes.twinx()
        right.plot(x, 1e9 * s.film[row], color=COLOURS[1], linewidth=LINE, label="film")
        right.set_ylim(0.0, 1e9 * MOST_FILMS * s.h_c)
        right.set_ylabel("film [nm]", color=COLOURS[1])
        axes.set_xlim(SHOWN_X[0] * 1e6 * s.hertz.b, SHOWN_X[1] * 1e6 * s.hertz.b)
        axes.set_ylim(bottom=0.0)
        handles = [*axes.get_legend_handles_labels()[0], *right.get_legend_handles_labels()[0]]
        right.legend(handles=handles, loc="upper left", fontsize=SMALL)
    panels[-1].set_xlabel("along rolling [um], oil enters from the left")
