"""Picture of the comparisons of validation.machines; matplotlib is imported when it is made."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .bearings import BEARINGS, BearingPoint
from .machines import Machines, rig_torques
from .machines_text import ROLLING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: colours by share of the rating (Okabe & Ito), markers by kind
COLOURS = ("#56B4E9", "#0072B2", "#009E73", "#E69F00", "#D55E00")
MARKERS = {"angular": "o", "thrust": "s"}
#: places of the screws beside the speeds of the grooves [r/min]
PLACES = (250.0, 280.0)


def machines_figure(found: Machines) -> Figure:
    """Law over reference: rolling part and total of the bearings over nu n; grooves over speed, screws."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 4.8), layout="constrained")
    left, middle, right = figure.subplots(1, 3, sharey=True)
    _bearings(left, middle, found.bearings)
    _grooves_and_screws(right, found)
    for axes in (left, middle, right):
        axes.axhline(1.0, color="black", linewidth=0.8)
        axes.set(yscale="log", ylim=(0.3, 3.5))
        axes.set_yticks(
            [0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0], labels=["0.3", "0.5", "0.7", "1", "1.5", "2", "3"]
        )
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    left.set_ylabel("law over SKF, over measurement")
    return figure


def _bearings(left: Axes, middle: Axes, every: list[BearingPoint]) -> None:
    part = ROLLING["law, film and hysteresis"]
    for place, (share, colour) in enumerate(zip(sorted({p.share for p in every}), COLOURS, strict=True)):
        for kind, marker in MARKERS.items():
            points = [p for p in every if BEARINGS[p.bearing].kind == kind and p.share == share]
            # side by side at the same nu n
            x = np.array([p.nu_n for p in points]) * 1.12 ** (place - 2)
            style: dict[str, Any] = {
                "marker": marker, "edgecolors": colour, "s": 22, "zorder": 3, "linewidths": 0.9,
                "facecolors": [colour if p.in_data else "white" for p in points],
            }  # fmt: skip
            left.scatter(x, [part(p) / p.skf_rolling for p in points], **style)
            middle.scatter(x, [p.law.total / p.skf for p in points], **style)
            ends = [p.law.low / p.skf for p in points], [p.law.high / p.skf for p in points]
            middle.vlines(x, *ends, color=colour, alpha=0.35, linewidth=1.0)
        left.scatter([], [], color=colour, label=f"{share:g} C")
    for kind, marker in MARKERS.items():
        left.scatter([], [], color="grey", marker=marker, label=kind)
    left.scatter([], [], facecolors="white", edgecolors="grey", label="not in the data")
    left.legend(fontsize="x-small", ncols=2)
    left.set_title("bearings: film and hysteresis over SKF's rolling", fontsize="medium")
    middle.set_title("bearings: total over SKF's, with interval", fontsize="medium")
    for axes in (left, middle):
        axes.set(xscale="log", xlabel=r"$\nu n$ [mm$^2$/s r/min]")


def _grooves_and_screws(axes: Axes, found: Machines) -> None:
    for d, colour in zip(sorted({p.ball_diameter for p in found.grooves}), COLOURS[1::2], strict=False):
        own = [p for p in found.grooves if p.ball_diameter == d]
        ratios = [p.flooded / p.measured for p in own]
        axes.plot([p.speed for p in own], ratios, "o", color=colour, label=f"open grooves, balls of {d:g} mm")
    low, high = min(p.low for p in found.screws), max(p.high for p in found.screws)
    for x, measured in zip(PLACES, rig_torques().values(), strict=True):
        axes.vlines(x, low / measured, high / measured, color="0.75", linewidth=2.0)
        axes.plot([x] * len(found.screws), [p.torque / measured for p in found.screws], "_", color="black")
    axes.plot([], [], color="0.75", linewidth=2.0, label="intervals of the screws it could be")
    axes.plot([], [], "_", color="black", label="their torques")
    axes.set_title("open grooves; two screws of a rig", fontsize="medium")
    axes.set_xticks([60, 120, 180, *PLACES], labels=["60", "120", "180", *rig_torques()])
    axes.set_xlabel("speed of the grooves [r/min]; screw")
    axes.legend(fontsize="x-small", loc="lower left")
