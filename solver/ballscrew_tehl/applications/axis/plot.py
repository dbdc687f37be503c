"""Picture of the budget of an axis."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...parameters.units import RPM
from .budget import PART_NAMES, AxisBudget

#: colours by part (Okabe & Ito): distinct without colour vision
COLOURS = dict(
    zip(PART_NAMES, ("#0072B2", "#D55E00", "#E69F00", "#009E73", "#CC79A7", "#999999"), strict=True)
)


def draw_budget(axes: Axes, budget: AxisBudget) -> None:
    """Parts over speed, stacked, the largest share below, with the interval of the sum."""
    rpm, names = budget.speed / RPM, list(budget.parts)
    axes.stackplot(
        rpm, [budget.parts[name].torque for name in names], labels=[PART_NAMES[name] for name in names],
        colors=[COLOURS[name] for name in names], alpha=0.85,
    )  # fmt: skip
    axes.plot(rpm, budget.torque, color="black", linewidth=1.5)
    if np.isfinite(budget.low).all():
        for ends, label in ((budget.low, "80 % interval of the sum"), (budget.high, None)):
            axes.plot(rpm, ends, "--", color="black", linewidth=1.0, label=label)
    axes.set(
        xscale="log", xlim=(rpm[0], rpm[-1]), ylim=(0.0, None), ylabel="friction torque at the screw [N m]"
    )
    axes.xaxis.set_major_formatter("{x:g}")


def budget_figure(budget: AxisBudget, title: str) -> Figure:
    """One figure with a legend."""
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.subplots()
    draw_budget(axes, budget)
    axes.set(title=title, xlabel="screw speed [r/min]")
    axes.grid(alpha=0.3)
    handles, labels = axes.get_legend_handles_labels()
    # in the order of the stack, seen from above
    figure.legend(handles[::-1], labels[::-1], loc="outside right upper", frameon=False, fontsize=9)
    return figure
