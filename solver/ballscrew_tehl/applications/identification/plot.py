"""Picture of an identification: friction over speed, with the law where a map is given, and residual over position."""

import numpy as np
from matplotlib.figure import Figure

from .directions import LIMIT, UNITS
from .dynamics import Identified
from .preload import LawCurve

#: colours of Okabe & Ito: forwards, backwards, law
AHEAD, BACK, LAW = "#0072B2", "#D55E00", "#009E73"


def identification_figure(found: Identified, law: LawCurve | None = None) -> Figure:
    """Left: magnitude of friction over the magnitude of speed, both directions. Right: residual over position."""
    units, friction = UNITS[found.rotary], found.friction
    figure = Figure(figsize=(11.0, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    if law is not None:
        speeds, value, low, high, label = law
        shade = {"color": LAW, "alpha": 0.18, "linewidth": 0.0, "label": "interval of the law"}
        left.fill_between(speeds / units.one, low, high, **shade)
        left.plot(speeds / units.one, value, color=LAW, linewidth=1.6, label=label)
    for sign, colour, label in ((1.0, AHEAD, "positive speed"), (-1.0, BACK, "negative speed, sign changed")):
        of_it = friction.speed * sign > 0.0
        half = 0.5 * (friction.high - friction.low)[of_it]
        left.errorbar(np.abs(friction.speed[of_it]) / units.one, sign * friction.value[of_it], yerr=half, fmt="o",
                      color=colour, markersize=3.5, elinewidth=0.9, label=f"{label}, 95 %")  # fmt: skip
    inertia, effort, speed = units.shown
    left.set(xlabel=f"speed [{speed}]", ylabel=f"friction without the offset [{effort}]")
    left.set(xlim=(0.0, None), ylim=(min(0.0, left.get_ylim()[0]), None))
    left.legend(loc="best", fontsize="small")
    place, mean, error = found.places
    name, unit, one = ("angle", "turns", 2.0 * np.pi) if found.rotary else ("position", "m", 1.0)
    right.axhline(0.0, color="0.4", linewidth=1.0)
    right.errorbar(place / one, mean, LIMIT * error, fmt="o-", color="0.25", markersize=3.5, linewidth=0.9)
    right.set(xlabel=f"{name} [{unit}]", ylabel=f"mean residual [{effort}]")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    values = f"{units.names[0]} {found.inertia:.4g} {inertia}, offset {found.offset:.3g} {effort}"
    title = f"{values}, {found.samples} samples, filter {found.cutoff:.3g} Hz"
    figure.suptitle(title, fontsize="medium")
    return figure
