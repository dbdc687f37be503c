#!/usr/bin/env python3
"""Friction torques that catalogues print for pairs of support bearings, compared with the law and its interval.

    python examples/support_bearings.py [--plot support_bearings.png]

Rows of support_bearings.csv, sources there; bearing_pair has sizes, C_a, preload and stiffness, not the torque. Neither
oil nor speed is printed: 5 r/min (and 100), 25 C, ISO VG 68. One row without C_a and balls is left out. law, SKF: over
the printed torque, geometric mean, and its standard deviation as a factor; SKF's friction model as angular contact and
as thrust bearing, at 5 r/min. inside: printed torques in the interval at 5 r/min.

The factor CATALOGUE of the interval is the least, in steps of 0.05, with which 80 % of these torques are inside: that
share is no proof. What it would be without one maker is printed below.
"""

import csv
import math
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from fmu_command import run_and_plot
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from ballscrew_tehl import bearing_pair
from ballscrew_tehl.applications.axis.bearing_pair import CATALOGUE, BearingPair
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.lubricant import eta0

sys.path.append(str(Path(__file__).resolve().parent / "paper"))
from bearings import skf_torque

TABLE = Path(__file__).with_suffix(".csv")
KINDS = "angular", "thrust"
SPEEDS, TEMPERATURE, GRADE = (5.0, 100.0), 25.0 + CELSIUS, 68  # [r/min], [K]
#: column of the table -> keyword of bearing_pair, and SI over its unit
COLUMNS = {
    "d_mm": ("bore", 1e-3), "D_mm": ("outer_diameter", 1e-3), "pitch_mm": ("pitch_diameter", 1e-3),
    "ball_mm": ("ball_diameter", 1e-3), "C_a_N": ("dynamic_rating", 1.0), "preload_N": ("preload", 1.0),
    "stiffness_N_um": ("axial_stiffness", 1e6),
}  # fmt: skip
COLOURS = {"NSK": "#0072B2", "SNFA": "#D55E00", "NACHI": "#009E73", "IBC": "#CC79A7", "INA": "#E69F00"}
TICKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0)


class Compared(NamedTuple):
    """A printed torque and what is computed for it [N.m]; with printed balls stiffness and C_a over the printed."""

    maker: str
    printed: float
    law: tuple[float, ...]  # at SPEEDS
    low: float  # at the first of them
    high: float
    skf: tuple[float, float]  # angular contact, thrust
    stiffness: float
    rating: float

    @property
    def inside(self) -> bool:
        """Whether the printed torque is in the interval."""
        return self.low <= self.printed <= self.high

    @property
    def factor(self) -> float:
        """Least factor in place of CATALOGUE with which it is."""
        middle, wide = 0.5 * math.log(self.low * self.high), 0.5 * math.log(self.high / self.low)
        others = wide**2 - math.log(CATALOGUE) ** 2
        return math.exp(math.sqrt(max((math.log(self.printed) - middle) ** 2 - others, 0.0)))


def compared(row: dict[str, str]) -> Compared:
    """The law at one row of the table."""
    given = {name: unit * float(row[column]) for column, (name, unit) in COLUMNS.items() if row[column]}
    balls = int(row["balls"]) if row["balls"] else None
    pair: BearingPair = bearing_pair(**given, balls=balls, iso_vg=GRADE)
    screw, preload, oil = pair.row.parameters.screw, pair.row.preload, pair.row.parameters.lubricant
    law = pair.torque(0.0, np.array(SPEEDS) * RPM, TEMPERATURE)
    nu = float(1e6 * eta0(oil, TEMPERATURE) / oil.density)  # density at 40 C: 1 % off
    skf = [2.0 * sum(skf_torque(kind, 2e3 * screw.nominal_radius, preload, SPEEDS[0], nu)) for kind in KINDS]
    stiffness = pair.axial_stiffness / given["axial_stiffness"] if balls else math.nan
    rating = pair.dynamic_rating / given["dynamic_rating"] if balls else math.nan
    torques = float(row["torque_Nm"]), tuple(law.rows), float(law.low[0]), float(law.high[0])
    return Compared(row["maker"], *torques, (skf[0], skf[1]), stiffness, rating)


def main() -> dict[str, list[Compared]]:
    """All rows that state C_a, by maker."""
    lines = [line for line in TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    result: dict[str, list[Compared]] = {}
    for row in csv.DictReader(lines):
        if row["C_a_N"]:
            result.setdefault(row["maker"], []).append(compared(row))
    return result


def level(ratios: Iterable[float]) -> tuple[float, float]:
    """Geometric mean, and standard deviation as a factor."""
    logs = np.log(list(ratios))
    return float(np.exp(logs.mean())), float(np.exp(logs.std()))


def least_factor(rows: Iterable[Compared], share: float = 0.8) -> float:
    """Least factor with which this share of the torques is inside."""
    factors = sorted(row.factor for row in rows)
    return factors[math.ceil(share * len(factors)) - 1]


def table(result: dict[str, list[Compared]]) -> str:
    """One line per maker, all of them, and the factor without each."""
    every = [row for rows in result.values() for row in rows]
    lines = [f"{'maker':<7}{'inside':>9}   law 5 r/min   100 r/min    SKF angular   thrust"]
    for maker, rows in (*result.items(), ("all", every)):
        shown = [f"{sum(row.inside for row in rows):>3} of {len(rows):<3}"]
        for at in range(2):
            shown.append("{:.2f} (x{:.2f})".format(*level(row.law[at] / row.printed for row in rows)))
        shown += [f"{level(row.skf[at] / row.printed for row in rows)[0]:9.2f}" for at in range(2)]
        lines.append(f"{maker:<7}" + "  ".join(shown))
    balls = [(row.stiffness, row.rating) for row in every if math.isfinite(row.stiffness)]
    (c, C), (c_most, C_most) = np.min(balls, axis=0), np.max(balls, axis=0)
    shares = f"stiffness {c:.3f} to {c_most:.3f}, C_a {C:.3f} to {C_most:.3f} of the printed"
    lines.append(f"printed balls: {shares}")
    without = (f"{least_factor(r for r in every if r.maker != m):.2f} without {m}" for m in result)
    lines.append(f"least factor for 80 %: {least_factor(every):.3f}; " + ", ".join(without))
    return "\n".join(lines)


def plot(result: dict[str, list[Compared]], path: Path | str) -> None:
    """Draw the printed torques over the law with its interval."""
    figure = Figure(figsize=(6.4, 5.6), layout="constrained")
    axes, ends = figure.subplots(), (0.02, 3.5)
    axes.plot(ends, ends, color="0.4", lw=0.8)
    for maker, rows in result.items():
        printed, law = [row.printed for row in rows], np.array([row.law[0] for row in rows])
        low, high = (np.array([getattr(row, end) for row in rows]) for end in ("low", "high"))
        inside = f"{maker}: {sum(row.inside for row in rows)} of {len(rows)} inside"
        style = {"fmt": "o", "ms": 4, "lw": 0.8, "color": COLOURS[maker], "label": inside}
        axes.errorbar(printed, law, [law - low, high - law], **style)
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=(0.01, 3.5), aspect="equal")
    axes.set(
        xlabel="printed torque of the pair [N m]", ylabel="law at 5 r/min, 25 \u00b0C, with interval [N m]"
    )
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_ticks(TICKS, labels=[f"{tick:g}" for tick in TICKS])
        axis.set_minor_locator(NullLocator())
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    run_and_plot(__file__, __doc__, main, table, plot)
