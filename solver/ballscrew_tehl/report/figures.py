"""Figures of the report, each as a data address (data:...;base64,...).

One figure per statement, narrow enough to be read on a phone. matplotlib is imported when a figure is made.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any

import numpy as np

from ..calibration.measured_screw import ASSUMED_TEMPERATURE, MODELS, packaged_measurements
from ..friction.baselines import nsk_torque, zhou_torque
from ..nut_map.plot import celsius, kilonewton, map_figure, scale
from ..nut_map.trend import THICK
from ..parameters.units import CELSIUS, RPM
from ..runtime.packed import MECHANISTIC
from .lines import FilmLines, Lines
from .material import BallLoads, Material
from .torque_parts import PARTS, Law, torque_parts

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: colour-blind safe (Okabe & Ito): this model, Zhao, Zhou, NSK
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
MARKERS = ("o", "s", "^", "v")
#: width [in], dots per inch; on a phone of 390 px the page shows 271 pt of them: SMALL is 8 pt there
WIDTH, DOTS = 4.2, 200
#: least size of letters [pt], width of a line [pt]
SMALL, LINE = 9.0, 1.8
#: speed that the catalogue torque is stated for [r/min]; lambda between which asperities carry a part of the load
CATALOGUE_RPM, MIXED = 100.0, (1.0, THICK)
FONTS: Any = {
    "font.size": SMALL, "axes.titlesize": 10.0, "axes.labelsize": SMALL, "figure.titlesize": 10.0,
    "legend.fontsize": SMALL, "legend.title_fontsize": SMALL, "xtick.labelsize": SMALL, "ytick.labelsize": SMALL,
}  # fmt: skip
#: parts of the torque, those of the fitted sets beside those of the mechanistic law
STACK = {**PARTS, "viscous": PARTS["rolling"], "sliding": PARTS["ball on ball, full film"]}


def figure_address(figure: Figure, kind: str) -> str:
    """The picture as svg or png inside an address; the same figure gives the same bytes."""
    import matplotlib

    out = io.BytesIO()
    metadata: dict[str, Any] = {"Date": None} if kind == "svg" else {"Software": None}
    with matplotlib.rc_context({"svg.hashsalt": "report"}):
        figure.savefig(out, format=kind, dpi=DOTS, metadata=metadata)
    name = "image/svg+xml" if kind == "svg" else "image/png"
    return f"data:{name};base64,{base64.b64encode(out.getvalue()).decode()}"


@contextmanager
def style() -> Iterator[None]:
    """Sizes of letters while figures are made."""
    import matplotlib

    with matplotlib.rc_context(FONTS):
        yield


def drawn(height: float = 3.4, rows: int = 1, kind: str = "svg") -> Callable[[Callable[..., None]], Any]:
    """Makes of what draws in a figure of WIDTH, with its axes one below the other, what returns its address."""

    def decorated(draw: Callable[..., None]) -> Callable[..., str]:
        @wraps(draw)
        def address(*content: Any) -> str:
            from matplotlib.figure import Figure

            figure = Figure(figsize=(WIDTH, height), layout="constrained")
            draw(figure, figure.subplots(rows, 1), *content)
            return figure_address(figure, kind)

        return address

    return decorated


def finish(axes: Axes, xlabel: str, ylabel: str, title: str = "") -> None:
    """Labels and grid."""
    axes.set(xlabel=xlabel, ylabel=ylabel, title=title)
    axes.grid(alpha=0.3)


@drawn(4.6)
def measured_against_computed(figure: Figure, axes: Axes, material: Material) -> None:
    """Every measured torque of Tables 2 and 4 with the torques of the models; the chosen friction set."""
    tables = [t for t in material.tables[material.chosen.entry.name] if t.unit == "N.m"]
    highest = 1.08 * max(row.measured for table in tables for row in table.rows)
    axes.plot([0.0, highest], [0.0, highest], color="0.4", linewidth=1.0)
    axes.fill_between(
        [0.0, highest], [0.0, 0.95 * highest], [0.0, 1.05 * highest], color="0.88", linewidth=0.0
    )
    for k, name in reversed(list(enumerate(MODELS))):
        points = [(row.measured, row.models[k]) for table in tables for row in table.rows]
        axes.plot(
            *zip(*points, strict=True), MARKERS[k], color=COLOURS[k], label=name, markersize=7 if k == 0 else 5,
            markeredgecolor="black" if k == 0 else COLOURS[k], fillstyle="full" if k == 0 else "none",
        )  # fmt: skip
    axes.set_xlim(0.0, highest)
    axes.set_ylim(0.0, 1.12 * highest)
    finish(axes, "measured torque [N m]", "computed torque [N m]")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[::-1], labels[::-1], loc="upper left")


@drawn(4.8)
def parts_over_speed(figure: Figure, axes: Axes, material: Material) -> None:
    """Parts of the torque over speed, stacked, at a preload of the middle."""
    speed = material.lines.over_speed.x
    _stack(figure, axes, material, speed / RPM, middle(material.lines.over_speed.rows), speed)
    over_log_speed(axes)
    finish(axes, "screw speed [r/min]", "friction torque [N m]")


@drawn(4.8)
def parts_over_preload(figure: Figure, axes: Axes, material: Material) -> None:
    """The same over preload at a speed of the middle."""
    preload = material.lines.over_preload.x
    _stack(figure, axes, material, preload / 1000.0, preload, middle(material.lines.over_preload.rows))
    finish(axes, "preload [kN]", "friction torque [N m]")


def middle(rows: Any) -> float:
    """The one of the values of the lines that both figures of the parts hold."""
    return float(rows[len(rows) // 2])


def named_parts(material: Material, preload: Any, speed: Any) -> dict[str, Any]:
    """Parts of the torque [N.m] by name, from the bottom of the stack; preload [N], speed [rad/s] as PARTS."""
    entry, nut_map = material.chosen
    temperature = material.lines.over_speed.fixed
    if nut_map.law == MECHANISTIC:
        found = torque_parts(Law(material.parameters, entry, nut_map, temperature), preload, speed)
        return dict(zip(PARTS, found, strict=True))
    viscous, hysteresis, sliding = material.chosen.parts(preload, speed, temperature)
    return {"sliding": sliding, "hysteresis": hysteresis, "viscous": viscous}


def _stack(figure: Figure, axes: Axes, material: Material, x: Any, preload: Any, speed: Any) -> None:
    """The parts over x, from the bottom those that change least with speed."""
    parts = named_parts(material, preload, speed)
    axes.stackplot(x, list(parts.values()), labels=list(parts), colors=[STACK[name] for name in parts])
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(0.0, 1.02 * float(np.sum(list(parts.values()), axis=0).max()))
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles[::-1], labels[::-1], loc="outside lower center")


@drawn(6.4)
def deviations(figure: Figure, axes: Axes, material: Material) -> None:
    """Relative deviation of every computed torque from the measured one, by both friction sets and by the paper."""
    tables = {name: [t for t in found if t.unit == "N.m"] for name, found in material.tables.items()}
    first = next(iter(tables.values()))
    labels = [
        f"{row.preload / 1000:g} kN\n{row.speed / RPM:.0f} r/min" for table in first for row in table.rows
    ]
    place = np.arange(len(labels), dtype=float)

    def percent(found: Any, model: int) -> list[float]:
        return [100.0 * (row.models[model] / row.measured - 1.0) for table in found for row in table.rows]

    series = {f"this model, {name.replace('_', ' ')}": percent(found, 0) for name, found in tables.items()}
    series["Zhao"] = percent(first, MODELS.index("Zhao"))
    colours = [COLOURS[0], "#56B4E9", COLOURS[1]]
    height = 0.8 / len(series)
    for k, (name, values) in enumerate(series.items()):
        at = place + (k - 0.5 * (len(series) - 1)) * height
        axes.barh(at, values, height, label=name, color=colours[k % 3])
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.axhline(len(first[0].rows) - 0.5, color="0.5", linewidth=0.8, linestyle=":")
    axes.set_yticks(place, labels=labels)
    axes.set_ylim(place[-1] + 0.6, place[0] - 0.6)
    finish(axes, "deviation from the measurement [%]", "")
    figure.legend(loc="outside upper center", ncols=1)


def _draw(
    axes: Axes, lines: Lines, unit: float, labels: Sequence[str], colours: str, shift: float = 0.0
) -> list[Any]:
    """Lines with their intervals, dashed where their trend is marked; x over unit, less shift; returns the colours."""
    marked = np.broadcast_to(lines.marked.unphysical, lines.torque.shape)
    x, shades = lines.x / unit - shift, scale(colours, len(labels))
    for k, (label, colour) in enumerate(zip(labels, shades, strict=True)):
        axes.plot(x, np.where(marked[k], np.nan, lines.torque[k]), color=colour, linewidth=LINE, label=label)
        if marked[k].any():
            axes.plot(x, np.where(marked[k], lines.torque[k], np.nan), "--", color=colour, linewidth=LINE)
        if lines.band is not None:
            places = lines.band.x / unit - shift
            ends = lines.band.low[k], lines.band.high[k]
            axes.fill_between(places, *ends, color=colour, alpha=0.22, linewidth=0.0)
    axes.set_ylim(bottom=0.0)
    return shades


def _legend(axes: Axes, title: str = "") -> None:
    """A legend in the upper left, with room for it above the lines."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, 1.3 * high)
    axes.legend(title=title, loc="upper left", ncols=2)


def over_log_speed(axes: Axes) -> None:
    """Speed axis with plain numbers."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _rpm(speeds: Any) -> list[str]:
    return [f"{speed / RPM:.0f} r/min" for speed in speeds]


@drawn(4.2)
def torque_over_speed(figure: Figure, axes: Axes, material: Material) -> None:
    """One line per preload; measured torques as circles, else the catalogue torque at its speed."""
    lines = material.lines.over_speed
    colours = _draw(axes, lines, RPM, [kilonewton(force) for force in lines.rows], "cividis")
    if material.measured:
        points = [(m.preload, m.speed / RPM, m.torque) for m in packaged_measurements(ASSUMED_TEMPERATURE)]
        mark, label = "o", "measured"
    else:
        over_log_speed(axes)
        torques = nsk_torque(material.parameters.screw, lines.rows)
        points = [(f, CATALOGUE_RPM, T) for f, T in zip(lines.rows, torques, strict=True)]
        mark, label = "D", "catalogue"
    _mark(axes, points, lines.rows, colours, mark)
    axes.plot([], [], mark, color="white", markeredgecolor="black", label=label)
    finish(axes, "screw speed [r/min]", "friction torque [N m]", f"oil at {lines.fixed - CELSIUS:.0f} C")
    _legend(axes, "preload")


def _mark(
    axes: Axes, points: Sequence[tuple[float, float, float]], rows: Any, colours: Any, mark: str
) -> None:
    """Points, each the value of its line with x and y, in the colour of that line; those of no line are left out."""
    for value, x, y in points:
        for row, colour in zip(rows, colours, strict=True):
            if abs(value / row - 1.0) < 1e-6:
                axes.plot(x, y, mark, color=colour, markeredgecolor="black")


@drawn(4.2)
def torque_by_temperature(figure: Figure, axes: Axes, material: Material) -> None:
    """One line over speed per temperature."""
    lines = material.lines.by_temperature
    _draw(axes, lines, RPM, [celsius(T) for T in lines.rows], "plasma")
    over_log_speed(axes)
    finish(axes, "screw speed [r/min]", "friction torque [N m]", f"preload {kilonewton(lines.fixed)}")
    _legend(axes, "oil")


@drawn(4.2)
def torque_over_preload(figure: Figure, axes: Axes, material: Material) -> None:
    """One line per speed, and the two formulas without speed."""
    lines, screw = material.lines.over_preload, material.parameters.screw
    formulas = [("NSK" if material.measured else "catalogue", nsk_torque, COLOURS[3])]
    if material.measured:
        formulas.append(("Zhou", zhou_torque, COLOURS[2]))
    for name, formula, colour in formulas:
        axes.plot(lines.x / 1000.0, formula(screw, lines.x), "-.", color=colour, label=name)
    colours = _draw(axes, lines, 1000.0, _rpm(lines.rows), "plasma")
    if material.measured:
        found = packaged_measurements(ASSUMED_TEMPERATURE)
        _mark(axes, [(m.speed, m.preload / 1000.0, m.torque) for m in found], lines.rows, colours, "o")
    axes.set_xlim(left=0.0)
    finish(axes, "preload [kN]", "friction torque [N m]", f"oil at {lines.fixed - CELSIUS:.0f} C")
    _legend(axes)


@drawn()
def torque_over_temperature(figure: Figure, axes: Axes, material: Material) -> None:
    """One line per speed."""
    lines = material.lines.over_temperature
    _draw(axes, lines, 1.0, _rpm(lines.rows), "plasma", CELSIUS)
    finish(axes, "oil temperature [C]", "friction torque [N m]", f"preload {kilonewton(lines.fixed)}")
    _legend(axes)


def _over_speed_of_films(axes: Axes, lines: FilmLines, ylabel: str) -> None:
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    over_log_speed(axes)
    finish(axes, "screw speed [r/min]", ylabel, f"preload {kilonewton(lines.preload)}")


@drawn(4.4)
def film_over_speed(figure: Figure, axes: Axes, lines: FilmLines) -> None:
    """Central films of both raceways and the least film over speed, one colour per temperature."""
    colours = scale("plasma", len(lines.temperatures))
    state = lines.state
    for name, films, kind in (
        ("central, screw", state.film_thickness_central_screw, "-"),
        ("central, nut", state.film_thickness_central_nut, "--"),
        ("minimum", state.film_thickness_min, ":"),
    ):
        for film, colour in zip(films, colours, strict=True):
            axes.plot(lines.speed / RPM, 1e9 * film, kind, color=colour, linewidth=LINE)
        axes.plot([], [], kind, color="0.3", label=name)
    for label, colour in zip(map(celsius, lines.temperatures), colours, strict=True):
        axes.plot([], [], color=colour, linewidth=5.0, label=label)
    _over_speed_of_films(axes, lines, "least film over the balls [nm]")
    figure.legend(loc="outside lower center", ncols=3)


@drawn(4.4)
def lambda_over_speed(figure: Figure, axes: Axes, lines: FilmLines) -> None:
    """Lambda over speed, one line per temperature, with the limits of mixed and full film."""
    labels, colours = map(celsius, lines.temperatures), scale("plasma", len(lines.temperatures))
    for value, label, colour in zip(lines.state.lambda_ratio, labels, colours, strict=True):
        axes.plot(lines.speed / RPM, value, color=colour, linewidth=LINE, label=label)
    _over_speed_of_films(axes, lines, "lambda")
    axes.axhspan(*MIXED, color="0.85", zorder=0, label=f"{MIXED[0]:g} to {MIXED[1]:g}: mixed")
    figure.legend(loc="outside lower center", ncols=2)


@drawn()
def load_distribution(figure: Figure, axes: Axes, balls: BallLoads) -> None:
    """Load of every ball of both nuts, one line per axial load."""
    for case, colour in zip(balls.cases, ("black", *COLOURS), strict=False):
        count = case.loads.Q_a.size
        label = f"{case.axial_load / 1000:.2f} kN"
        axes.plot(np.arange(1, count + 1), case.loads.Q_a, color=colour, linewidth=LINE, label=label)
        axes.plot(np.arange(count + 1, 2 * count + 1), case.loads.Q_b, color=colour, linewidth=LINE)
    axes.axvline(count + 0.5, color="0.5", linewidth=6, alpha=0.3)
    axes.text(
        count + 0.5, 0.02, f" {balls.words.middle}", transform=axes.get_xaxis_transform(), fontsize=SMALL
    )
    axes.set_ylim(bottom=0.0)
    low, high = axes.get_ylim()
    axes.set_ylim(low, 1.15 * high)
    side = balls.words.side
    finish(axes, f"ball, relieved {side} left, loaded {side} right", "ball load [N]",
           f"preload {kilonewton(balls.preload)}")  # fmt: skip
    axes.legend(title="axial load", loc="upper left")


@drawn()
def nut_forces(figure: Figure, axes: Axes, balls: BallLoads) -> None:
    """Axial forces of both nuts over the axial load, with the load at which the relieved nut is unloaded."""
    side = balls.words.side
    for force, name, colour in zip(balls.forces, ("relieved", "loaded"), COLOURS, strict=False):
        x, y = balls.axial_loads / 1000.0, force / 1000.0
        axes.plot(x, y, color=colour, linewidth=LINE, label=f"{name} {side}")
    axes.axvline(balls.separation / 1000.0, color="0.4", linestyle=":", label=f"relieved {side} unloaded")
    axes.set_ylim(bottom=0.0)
    finish(axes, "axial load [kN]", f"axial force of the {side} [kN]", f"preload {kilonewton(balls.preload)}")
    axes.legend(loc="upper left")


def map_picture_address(material: Material) -> str:
    """The picture of the map as `map plot` draws it."""
    return figure_address(map_figure(material.picture), "png")
