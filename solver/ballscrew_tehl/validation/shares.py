"""Which part of the mechanistic law carries what share of the torque, over speed and preload.

matplotlib is imported when a figure is made.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..calibration.measurements import Measurement
from ..friction.sets import FrictionSet
from ..parameters.file import Parameters
from ..parameters.units import RPM
from ..physics.ball_law import Array
from ..physics.kinematics import entrainment_speed
from ..physics.load import nut_loads
from ..runtime.evaluate import NutMap
from .laws import TWELFTH, law_points

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


#: parts from the bottom of the stack with their colours (Okabe & Ito)
PARTS = {
    "ball on ball, full film": "#56B4E9",
    "ball on ball, more by asperities": "#0072B2",
    "spin, differential and helix slip": "#009E73",
    "hysteresis": "#F0E442",
    "rolling": "#D55E00",
}
#: preloads [N] of the panels over speed, speeds [r/min] of those over preload
PANEL_PRELOADS, PANEL_RPM = (1000.0, 6000.0), (100.0, 2500.0)
SPEEDS, PRELOADS = np.geomspace(20.0, 3000.0, 41) * RPM, np.linspace(500.0, 6500.0, 25)


class Law(NamedTuple):
    """The mechanistic law of a screw: its map, its numbers and the oil temperature [K]."""

    parameters: Parameters
    entry: FrictionSet
    nut_map: NutMap
    temperature: float


def torque_parts(law: Law, preload: Array, speed: Array) -> Array:
    """Parts of the torque of the double nut [N.m] without axial load, rows as PARTS (n, ...); their sum is the torque.

    Parameters   preload : [N], speed : [rad/s], broadcast to (...), within the map
    """
    ratio, net, _ = law.entry.values
    preload, speed = np.broadcast_arrays(np.asarray(preload, float), np.asarray(speed, float))
    whole = law.nut_map.evaluate(preload, speed, law.temperature, 0.0, ratio, net)
    slip = np.asarray(law.nut_map.evaluate(preload, speed, law.temperature, 0.0, ratio, 0.0).sliding_torque)
    screw = law.parameters.screw
    loads = {
        force: nut_loads(screw, force, screw.loaded_ball_count).sum()
        for force in set(preload.ravel().tolist())
    }
    on_balls = np.vectorize(loads.__getitem__, otypes=[float])(preload)
    film = 2.0 * net * float(entrainment_speed(screw, 1.0)) * on_balls
    more = np.asarray(whole.sliding_torque) - slip - film
    return np.array([film, more, slip, whole.hysteresis_torque, whole.viscous_torque])


def shares_figure(law: Law) -> Figure:
    """Stacked parts over speed at two preloads and over preload at two speeds, with the measured torques."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 8.0), layout="constrained")
    panels = figure.subplots(2, 2)
    points = law_points()
    over_preload = torque_parts(law, PRELOADS[:, None], np.array(PANEL_RPM) * RPM)
    for column, preload in enumerate(PANEL_PRELOADS):
        parts = torque_parts(law, np.array(preload), SPEEDS)
        axes = panels[0, column]
        axes.stackplot(SPEEDS / RPM, parts, labels=list(PARTS), colors=list(PARTS.values()))
        _measured(axes, [m for m in points if m.preload == preload], lambda m: m.speed / RPM)
        axes.set(xscale="log", xlabel="screw speed [r/min]", title=f"preload {preload / 1000.0:g} kN")
        axes.xaxis.set_major_formatter("{x:g}")
    for column, rpm in enumerate(PANEL_RPM):
        axes = panels[1, column]
        axes.stackplot(PRELOADS / 1000.0, over_preload[..., column], colors=list(PARTS.values()))
        _measured(axes, [m for m in points if abs(m.speed / RPM - rpm) < 1e-6], lambda m: m.preload / 1000.0)
        axes.set(xlabel="preload [kN]", title=f"{rpm:g} r/min")
    for axes in panels.flat:
        axes.set(ylabel="friction torque [N m]", ylim=(0.0, None))
        axes.margins(x=0.0)
    # the panel with both kinds of points
    handles, labels = panels[0, 1].get_legend_handles_labels()
    figure.legend(handles[::-1], labels[::-1], loc="outside right upper", fontsize="small")
    figure.suptitle(
        f"{law.parameters.name}, {law.parameters.lubricant.name}, {law.temperature:g} K, mechanistic with k = "
        f"{law.entry.net_sliding_coefficient:.4g}",
        fontsize="medium",
    )
    return figure


def _measured(axes: Axes, points: Sequence[Measurement], x: Callable[[Measurement], float]) -> None:
    """Measured torques; the inferred one open."""
    for inferred in (False, True):
        chosen = [m for m in points if (m is TWELFTH) == inferred]
        if chosen:
            axes.plot(
                [x(m) for m in chosen], [m.torque for m in chosen], "o", color="black", clip_on=False,
                markerfacecolor="white" if inferred else "black", label="inferred" if inferred else "measured",
            )  # fmt: skip


def shares_text(law: Law) -> str:
    """Shares in per cent at the corners of the measured range."""
    lines = ["Share of the torque by part [%]", f"{'preload':>9}{'speed':>7}{'torque':>9}"]
    lines[1] += "".join(f"  {name}" for name in PARTS)
    for preload in PANEL_PRELOADS:
        for rpm in PANEL_RPM:
            parts = torque_parts(law, np.array(preload), np.array(rpm * RPM))
            total = float(parts.sum())
            cells = "".join(
                f"  {100.0 * float(value) / total:{len(name)}.1f}"
                for value, name in zip(parts, PARTS, strict=True)
            )
            lines.append(f"{preload:7.0f} N{rpm:7.0f}{total:9.3f}{cells}")
    return "\n".join(lines)
