"""Figures of solved contacts: fields as filled contours, pressure and film along the middle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..nut_map.contact_map import Array
from ..physics.hertz import RACEWAYS
from .figures import COLOURS, LINE, SMALL, figure_address, finish, new_figure

if TYPE_CHECKING:
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
#: share of the largest pressure of a line where its rim is; least pressure of a line with a rim over Hertz pressure
RIM, LEAST_PRESSURE = 0.3, 0.25
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


def contact_rim(solution: ContactResult) -> tuple[Array, Array, Array]:
    """Lines y that carry load, and where the pressure of each rises at the inlet and falls at the outlet.

    Where it passes the share RIM of its largest value on the line, linear between nodes; y in semi-axes, x in
    half-widths.
    """
    x, y, pressure = whole_field(solution, "pressure")
    found = []
    for place, line in zip(y, pressure, strict=True):
        if line.max() < LEAST_PRESSURE * solution.hertz.p_max:
            continue
        above = np.flatnonzero(line > RIM * line.max())
        ends = [above[0] - 1, above[-1]]  # nodes before the crossing
        share = [(RIM * line.max() - line[k]) / (line[k + 1] - line[k]) for k in ends]
        found.append((place, *(x[k] + s * (x[k + 1] - x[k]) for k, s in zip(ends, share, strict=True))))
    return tuple(np.array(found).T)


def fine_field(solution: ContactResult, name: str) -> tuple[Array, Array, Array]:
    """The field on POINTS_X x POINTS_Y points of the drawn domain, arguments and axes as whole_field.

    The lines of the solver lie far apart across rolling and their features follow the rim of the contact: between the
    lines the field is interpolated at equal places from rim to rim, monotonically, so that no value is made up.
    """
    from scipy.interpolate import PchipInterpolator

    x, y, field = whole_field(solution, name)
    lines, inlet, outlet = contact_rim(solution)
    fine_x = np.linspace(*SHOWN_X, POINTS_X)
    fine_y = np.clip(np.linspace(-SHOWN_Y, SHOWN_Y, POINTS_Y), y[0], y[-1])

    def rim(of: Array) -> tuple[Array, Array]:
        """Middle and half-width of the rim, beyond the last line as on it."""
        at = np.clip(of, lines[0], lines[-1])
        low, high = (PchipInterpolator(lines, ends)(at) for ends in (inlet, outlet))
        return 0.5 * (low + high), 0.5 * (high - low)

    middle, half = rim(y)
    fine_middle, fine_half = rim(fine_y)
    reach = max(np.abs((fine_x[[0, -1], None] - fine_middle) / fine_half).max(), 1.0)
    place = np.linspace(-reach, reach, int(POINTS_X * 2.0 * reach))
    rows = [np.interp(m + place * h, x, line) for m, h, line in zip(middle, half, field, strict=True)]
    # monotone but for rounding
    between = np.clip(PchipInterpolator(y, np.array(rows), axis=0)(fine_y), np.min(field), np.max(field))
    fine = [
        np.interp((fine_x - m) / h, place, line)
        for m, h, line in zip(fine_middle, fine_half, between, strict=True)
    ]
    return fine_x, np.linspace(-SHOWN_Y, SHOWN_Y, POINTS_Y), np.array(fine)


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


def contact_field(solutions: Sequence[ContactResult | None], name: str) -> str:
    """A field of FIELDS on screw and nut raceway with one colour scale; oil enters from below; the Hertz ellipse."""
    title, unit, _, colours = FIELDS[name]
    figure, panels = new_figure(4.6, 2)
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
        filled = _contours(axes, s, name, levels, colours, extend)
        a, b = 1e6 * s.hertz.a, 1e6 * s.hertz.b
        axes.plot(a * np.cos(angle), b * np.sin(angle), color="black", linewidth=0.8, linestyle="--")
        axes.set(xlim=(-SHOWN_Y * a, SHOWN_Y * a), ylim=(SHOWN_X[0] * b, SHOWN_X[1] * b))
    panels[-1].set_xlabel("across rolling [um]")
    if filled is not None:
        figure.colorbar(filled, ax=panels, label=f"[{unit}]", location="bottom", aspect=40)
    figure.suptitle(title)
    return figure_address(figure, "png")


def _contours(axes: Any, solution: ContactResult, name: str, levels: Array, colours: str, extend: str) -> Any:
    x, y, field = fine_field(solution, name)
    a, b = 1e6 * solution.hertz.a, 1e6 * solution.hertz.b
    values = FIELDS[name][2] * field.T
    return axes.contourf(a * y, b * x, values, levels, cmap=colours, extend=extend)


def central_lines(solutions: Sequence[ContactResult | None]) -> str:
    """Pressure and film along the middle of both contacts."""
    figure, panels = new_figure(5.0, 2)
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
    return figure_address(figure, "svg")
