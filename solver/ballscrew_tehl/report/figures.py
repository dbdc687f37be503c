"""Figures of the report, each as a data address (data:...;base64,...).

One figure per statement, narrow enough to be read on a phone. matplotlib is imported when a figure is made.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..calibration.measurements import packaged_measurements
from ..friction.baselines import nsk_torque, zhou_torque
from ..nut_map.plot import map_figure
from ..parameters.units import CELSIUS, RPM
from ..physics.hertz import RACEWAYS
from ..runtime.packed import MECHANISTIC
from ..validation.shares import PARTS, Law, torque_parts
from ..validation.tables import ASSUMED_TEMPERATURE, MODELS
from .material import BallLoads, Material

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..contact.solve import ContactSolution

#: colour-blind safe (Okabe & Ito): this model, Zhao, Zhou, NSK
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
MARKERS = ("o", "s", "^", "v")
WIDTH, DOTS = 5.4, 150
#: parts of the torque, those of the fitted sets beside those of the mechanistic law
STACK = {**PARTS, "viscous": PARTS["rolling"], "sliding": PARTS["ball on ball, full film"]}
#: films above this number of central films are not drawn, or have one colour in a field; drawn domain in half-widths
MOST_FILMS, MOST_FILMS_FIELD = 2.5, 1.6
#: share of the contact within the colour scale of the rise: a spike of few nodes would leave the rest dark
HELD, ABOVE_HELD = 0.98, 1.5
SHOWN_X, SHOWN_Y = (-2.2, 1.6), 1.25
#: field -> title, unit, factor from SI, colours
FIELDS = {
    "pressure": ("Pressure", "GPa", 1e-9, "viridis"),
    "film": ("Film thickness", "nm", 1e9, "cividis"),
    "rise": ("Temperature rise, largest across the film", "K", 1.0, "inferno"),
}


def figure_address(figure: Figure, kind: str) -> str:
    """The picture as svg or png inside an address; the same figure gives the same bytes."""
    import matplotlib

    out = io.BytesIO()
    metadata: dict[str, Any] = {"Date": None} if kind == "svg" else {"Software": None}
    with matplotlib.rc_context({"svg.hashsalt": "report"}):
        figure.savefig(out, format=kind, dpi=DOTS, metadata=metadata)
    name = "image/svg+xml" if kind == "svg" else "image/png"
    return f"data:{name};base64,{base64.b64encode(out.getvalue()).decode()}"


def _figure(height: float = 3.8, rows: int = 1) -> tuple[Figure, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.subplots(rows, 1)


def _scale(name: str, count: int) -> list[Any]:
    from matplotlib import colormaps

    return [colormaps[name](x) for x in np.linspace(0.0, 0.82, count)]


def _finish(axes: Axes, xlabel: str, ylabel: str, title: str = "") -> None:
    axes.set(xlabel=xlabel, ylabel=ylabel, title=title)
    axes.grid(alpha=0.3)


def measured_against_computed(material: Material) -> str:
    """Every measured torque of Tables 2 and 4 with the torques of the models; the chosen friction set."""
    figure, axes = _figure(4.6)
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
    _finish(axes, "measured torque [N m]", "computed torque [N m]")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[::-1], labels[::-1], loc="upper left")
    return figure_address(figure, "svg")


def parts_over_speed(material: Material) -> str:
    """Parts of the torque over speed, stacked, at a preload of the middle."""
    speed = material.over_speed.x
    figure, axes = _stacked(material, speed / RPM, middle(material.over_speed.rows), speed)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    _finish(axes, "screw speed [r/min]", "friction torque [N m]")
    return figure_address(figure, "svg")


def parts_over_preload(material: Material) -> str:
    """The same over preload at a speed of the middle."""
    preload = material.over_preload.x
    figure, axes = _stacked(material, preload / 1000.0, preload, middle(material.over_preload.rows))
    _finish(axes, "preload [kN]", "friction torque [N m]")
    return figure_address(figure, "svg")


def middle(rows: Any) -> float:
    """The one of the values of the lines that both figures of the parts hold."""
    return float(rows[len(rows) // 2])


def named_parts(material: Material, preload: Any, speed: Any) -> dict[str, Any]:
    """Parts of the torque [N.m] by name, from the bottom of the stack; preload [N], speed [rad/s] as shares.PARTS."""
    entry, nut_map = material.chosen
    temperature = material.over_speed.fixed
    if nut_map.law == MECHANISTIC:
        found = torque_parts(Law(material.parameters, entry, nut_map, temperature), preload, speed)
        return dict(zip(PARTS, found, strict=True))
    viscous, hysteresis, sliding = material.chosen.parts(preload, speed, temperature)
    return {"sliding": sliding, "hysteresis": hysteresis, "viscous": viscous}


def _stacked(material: Material, x: Any, preload: Any, speed: Any) -> tuple[Figure, Axes]:
    """Figure with the parts over x, from the bottom those that change least with speed."""
    parts = named_parts(material, preload, speed)
    figure, axes = _figure(4.6)
    axes.stackplot(x, list(parts.values()), labels=list(parts), colors=[STACK[name] for name in parts])
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(0.0, 1.02 * float(np.sum(list(parts.values()), axis=0).max()))
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles[::-1], labels[::-1], loc="outside lower center", ncols=2, fontsize="small")
    return figure, axes


def deviations(material: Material) -> str:
    """Relative deviation of every computed torque from the measured one, by both friction sets and by the paper."""
    figure, axes = _figure(4.2)
    tables = {name: [t for t in found if t.unit == "N.m"] for name, found in material.tables.items()}
    first = next(iter(tables.values()))
    labels = [f"{row.preload / 1000:g} kN, {row.speed / RPM:.0f}" for table in first for row in table.rows]
    place = np.arange(len(labels), dtype=float)

    def percent(found: Any, model: int) -> list[float]:
        return [100.0 * (row.models[model] / row.measured - 1.0) for table in found for row in table.rows]

    series = {f"this model, {name.replace('_', ' ')}": percent(found, 0) for name, found in tables.items()}
    series["Zhao"] = percent(first, MODELS.index("Zhao"))
    colours = [COLOURS[0], "#56B4E9", COLOURS[1]]
    width = 0.8 / len(series)
    for k, (name, values) in enumerate(series.items()):
        axes.bar(
            place + (k - 0.5 * (len(series) - 1)) * width, values, width, label=name, color=colours[k % 3]
        )
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.axvline(len(first[0].rows) - 0.5, color="0.5", linewidth=0.8, linestyle=":")
    axes.set_xticks(place, labels=labels, rotation=60, ha="right", rotation_mode="anchor")
    _finish(axes, "preload, speed [r/min]", "deviation from the measurement [%]")
    axes.legend(loc="upper center", ncols=1, fontsize=9)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.35 * (high - low))
    return figure_address(figure, "svg")


def torque_over_speed(material: Material) -> str:
    """One line per preload; measured torques as circles."""
    figure, axes = _figure()
    lines = material.over_speed
    colours = _scale("cividis", len(lines.rows))
    points = packaged_measurements(ASSUMED_TEMPERATURE) if material.measured else []
    for preload, torque, colour in zip(lines.rows, lines.torque, colours, strict=True):
        axes.plot(lines.x / RPM, torque, color=colour, linewidth=2, label=f"{preload / 1000:.3g} kN")
        mine = [(m.speed / RPM, m.torque) for m in points if m.preload == preload]
        for point in mine:
            axes.plot(*point, "o", color=colour, markeredgecolor="black")
    if points:
        axes.plot([], [], "o", color="white", markeredgecolor="black", label="measured")
    axes.set_ylim(bottom=0.0)
    _finish(axes, "screw speed [r/min]", "friction torque [N m]", f"oil at {lines.fixed - CELSIUS:.0f} C")
    axes.legend(title="preload", loc="upper left", ncols=2)
    low, high = axes.get_ylim()
    axes.set_ylim(low, 1.25 * high)
    return figure_address(figure, "svg")


def torque_over_preload(material: Material) -> str:
    """One line per speed, and the two formulas without speed."""
    figure, axes = _figure()
    lines, screw = material.over_preload, material.parameters.screw
    for name, formula, colour in (("Zhou", zhou_torque, COLOURS[2]), ("NSK", nsk_torque, COLOURS[3])):
        axes.plot(lines.x / 1000.0, formula(screw, lines.x), "--", color=colour, label=name)
    points = packaged_measurements(ASSUMED_TEMPERATURE) if material.measured else []
    for speed, torque, colour in zip(
        lines.rows, lines.torque, _scale("plasma", len(lines.rows)), strict=True
    ):
        axes.plot(lines.x / 1000.0, torque, color=colour, linewidth=2, label=f"{speed / RPM:.0f} r/min")
        for m in points:
            if abs(m.speed / speed - 1.0) < 1e-6:
                axes.plot(m.preload / 1000.0, m.torque, "o", color=colour, markeredgecolor="black")
    axes.set_ylim(bottom=0.0)
    axes.set_xlim(left=0.0)
    _finish(axes, "preload [kN]", "friction torque [N m]", f"oil at {lines.fixed - CELSIUS:.0f} C")
    axes.legend(loc="upper left")
    return figure_address(figure, "svg")


def torque_over_temperature(material: Material) -> str:
    """One line per speed."""
    figure, axes = _figure()
    lines = material.over_temperature
    for speed, torque, colour in zip(
        lines.rows, lines.torque, _scale("plasma", len(lines.rows)), strict=True
    ):
        axes.plot(lines.x - CELSIUS, torque, color=colour, linewidth=2, label=f"{speed / RPM:.0f} r/min")
    axes.set_ylim(bottom=0.0)
    _finish(axes, "oil temperature [C]", "friction torque [N m]", f"preload {lines.fixed / 1000:.3g} kN")
    axes.legend(loc="upper right")
    return figure_address(figure, "svg")


def load_distribution(balls: BallLoads) -> str:
    """Load of every ball of both nuts, one line per axial load."""
    figure, axes = _figure()
    for case, colour in zip(balls.cases, ("black", *COLOURS), strict=False):
        count = case.loads.Q_a.size
        label = f"{case.axial_load / 1000:.2f} kN"
        axes.plot(np.arange(1, count + 1), case.loads.Q_a, color=colour, linewidth=2, label=label)
        axes.plot(np.arange(count + 1, 2 * count + 1), case.loads.Q_b, color=colour, linewidth=2)
    axes.axvline(count + 0.5, color="0.5", linewidth=6, alpha=0.3)
    axes.text(count + 0.5, 0.02, f" {balls.words.middle}", transform=axes.get_xaxis_transform(), fontsize=9)
    axes.set_ylim(bottom=0.0)
    low, high = axes.get_ylim()
    axes.set_ylim(low, 1.15 * high)
    _finish(
        axes,
        f"ball, relieved {balls.words.side} left, loaded {balls.words.side} right",
        "ball load [N]",
        f"preload {balls.preload / 1000:.3g} kN",
    )
    axes.legend(title="axial load", loc="upper left")
    return figure_address(figure, "svg")


def nut_forces(balls: BallLoads) -> str:
    """Axial forces of both nuts over the axial load, with the load at which the relieved nut is unloaded."""
    figure, axes = _figure()
    side = balls.words.side
    for force, label, colour in zip(
        balls.forces, (f"relieved {side}", f"loaded {side}"), COLOURS, strict=False
    ):
        axes.plot(balls.axial_loads / 1000.0, force / 1000.0, color=colour, linewidth=2, label=label)
    axes.axvline(balls.separation / 1000.0, color="0.4", linestyle=":", label=f"relieved {side} unloaded")
    axes.set_ylim(bottom=0.0)
    _finish(
        axes, "axial load [kN]", f"axial force of the {side} [kN]", f"preload {balls.preload / 1000:.3g} kN"
    )
    axes.legend(loc="upper left")
    return figure_address(figure, "svg")


def _whole(solution: ContactSolution, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x along, y across rolling [um] and a field of FIELDS (n_y, n_x) on both halves of the contact, SI."""
    if name == "rise":
        assert solution.temperature is not None
        field = solution.temperature.max(axis=2) - solution.conditions.temperature
    else:
        field = getattr(solution, name)
    y = solution.y
    if y[0] >= 0.0:
        y, field = np.concatenate((-y[:0:-1], y)), np.concatenate((field[:0:-1], field))
    return 1e6 * solution.hertz.b * solution.x, 1e6 * solution.hertz.a * y, field


def _held_rise(solution: ContactSolution) -> float:
    """Rise [K] not exceeded in the share HELD of the Hertz ellipse."""
    x, y, field = _whole(solution, "rise")
    a, b = 1e6 * solution.hertz.a, 1e6 * solution.hertz.b
    return float(np.quantile(field[(y[:, None] / a) ** 2 + (x / b) ** 2 < 1.0], HELD))


def contact_field(solutions: Sequence[ContactSolution | None], name: str) -> str:
    """A field of FIELDS on screw and nut raceway with one colour scale; oil enters from below; the Hertz ellipse."""
    title, unit, factor, colours = FIELDS[name]
    figure, panels = _figure(4.2, 2)
    shown = [s for s in solutions if s is not None]
    highest = largest = max(float(_whole(s, name)[2].max()) for s in shown)
    if name == "film":
        highest = MOST_FILMS_FIELD * max(s.h_c for s in shown)
    elif name == "rise":
        highest = min(largest, max(ABOVE_HELD * _held_rise(s) for s in shown))
    mesh = None
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    for axes, raceway, s in zip(panels, RACEWAYS, solutions, strict=True):
        axes.set(title=f"{raceway} raceway", ylabel="along rolling [um]")
        if s is None:
            axes.text(0.5, 0.5, "not converged", ha="center", transform=axes.transAxes)
            continue
        a, b = 1e6 * s.hertz.a, 1e6 * s.hertz.b
        x, y, field = _whole(s, name)
        mesh = axes.pcolormesh(
            y,
            x,
            factor * field.T,
            cmap=colours,
            vmin=0.0,
            vmax=factor * highest,
            shading="gouraud",
            rasterized=True,
        )
        axes.plot(a * np.cos(angle), b * np.sin(angle), color="white", linewidth=1.0, linestyle="--")
        axes.set(xlim=(-SHOWN_Y * a, SHOWN_Y * a), ylim=(SHOWN_X[0] * b, SHOWN_X[1] * b))
    panels[-1].set_xlabel("across rolling [um]")
    if mesh is not None:
        figure.colorbar(mesh, ax=panels, label=f"[{unit}]", extend="max" if highest < largest else "neither")
    figure.suptitle(title)
    return figure_address(figure, "png")


def central_lines(solutions: Sequence[ContactSolution | None]) -> str:
    """Pressure and film along the middle of both contacts."""
    figure, panels = _figure(5.2, 2)
    for axes, raceway, s in zip(panels, RACEWAYS, solutions, strict=True):
        _finish(axes, "", "pressure [GPa]", f"{raceway} raceway")
        if s is None:
            axes.text(0.5, 0.5, "not converged", ha="center", transform=axes.transAxes)
            continue
        row = int(np.argmin(np.abs(s.y)))
        x = 1e6 * s.hertz.b * s.x
        axes.plot(x, 1e-9 * s.pressure[row], color=COLOURS[0], linewidth=2, label="pressure")
        axes.plot(
            x,
            1e-9 * s.hertz.p_max * np.sqrt(np.clip(1.0 - s.x**2, 0.0, None)),
            ":",
            color="0.4",
            label="Hertz",
        )
        right = axes.twinx()
        right.plot(x, 1e9 * s.film[row], color=COLOURS[1], linewidth=2, label="film")
        right.set_ylim(0.0, 1e9 * MOST_FILMS * s.h_c)
        right.set_ylabel("film [nm]", color=COLOURS[1])
        axes.set_xlim(SHOWN_X[0] * 1e6 * s.hertz.b, SHOWN_X[1] * 1e6 * s.hertz.b)
        axes.set_ylim(bottom=0.0)
        handles = [*axes.get_legend_handles_labels()[0], *right.get_legend_handles_labels()[0]]
        right.legend(handles=handles, loc="upper left", fontsize=9)
    panels[-1].set_xlabel("along rolling [um], oil enters from the left")
    return figure_address(figure, "svg")


def map_picture_address(material: Material) -> str:
    """The picture of the map as `map plot` draws it."""
    return figure_address(map_figure(material.picture), "png")
