"""Friction laws compared on the 11 measured torques and on one more that nobody is fitted to.

Each law with its number of fitted parameters, its deviations, those of points left out of its fit, and one table
predicted by the fit to the rest. Closed formulas are the bar that a solved contact has to clear.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..calibration.fit import TorqueBasis, fit_values
from ..calibration.measurements import Measurement, packaged_measurements
from ..calibration.packaged import leave_one_table_out, left_out_deviations
from ..friction.baselines import jungnickel_torque, nsk_torque, zhou_torque
from ..friction.mechanistic import ball_ball_coefficient
from ..friction.sets import FITTED, SETS, FrictionSet
from ..parameters.file import Parameters
from ..parameters.units import RPM
from ..runtime.evaluate import NutMap
from .tables import ASSUMED_TEMPERATURE, Evaluate

#: inferred, not printed: coefficients of friction over speed in the text on Fig. 16 of Zhao et al. (2023), on the scale
#: that the measured 1 and 6 kN at 100 r/min fix, if their ends are 1 and 6 kN
TWELFTH = Measurement(6000.0, 2500.0 * RPM, ASSUMED_TEMPERATURE, 3.80)
TABLES = ("table2", "table4")


class LawRow(NamedTuple):
    """Deviations |model/measured - 1| of one law; None where it is not fitted or not known.

    numbers: fitted to these points;  torques: at the 11 points and at TWELFTH [N.m];  mean, most: of the 11 points;
    from_rest: table -> mean of the points that only this table has, by the fit to the rest;  left_out: mean and largest
    of points left out one at a time
    """

    name: str
    numbers: int
    torques: tuple[float, ...]
    mean: float
    most: float
    from_rest: dict[str, float] | None = None
    left_out: tuple[float, float] | None = None

    @property
    def twelfth(self) -> float:
        """Torque at TWELFTH over the inferred one, minus 1."""
        return self.torques[-1] / TWELFTH.torque - 1.0


def law_points() -> list[Measurement]:
    """The 11 measured points and TWELFTH."""
    return [*packaged_measurements(ASSUMED_TEMPERATURE), TWELFTH]


def evaluated_row(name: str, numbers: int, evaluate: Evaluate) -> LawRow:
    """A law that is not fitted here."""
    torques = tuple(float(evaluate(m.preload, m.speed, m.temperature)) for m in law_points())
    missed = [abs(t / m.torque - 1.0) for t, m in zip(torques, law_points(), strict=True)][:-1]
    return LawRow(name, numbers, torques, sum(missed) / len(missed), max(missed))


def set_row(entry: FrictionSet, evaluate: Evaluate) -> LawRow:
    """A friction set, with the figures of its fit if they are known."""
    row = evaluated_row(entry.name, len(SETS.get(entry.name, ())), evaluate)
    rest = {table: found["mean"] for table, found in entry.leave_one_table_out.items() if table in TABLES}
    left_out = None
    if "leave_one_out_mean" in entry.errors:
        left_out = entry.errors["leave_one_out_mean"], entry.errors["leave_one_out_max"]
    return row._replace(from_rest=rest or None, left_out=left_out)


def jungnickel_basis(parameters: Parameters, points: Sequence[Measurement]) -> TorqueBasis:
    """Torque a J + L F: a length L [mm] times the preload F, fitted first, and Jungnickel's J, a = 1 unless fitted."""
    rolling = np.array([jungnickel_torque(parameters, m.preload, m.speed, m.temperature) for m in points])
    both, per_mm = 0.5 * np.stack([rolling, rolling], axis=1), 1e-3 * np.array([m.preload for m in points])
    thick, none = np.full(both.shape, np.inf), np.zeros(len(points))
    return TorqueBasis(tuple(points), both, thick, none, per_mm, (FITTED[1], FITTED[0]), (1.0, 0.0, 0.0))


def fitted_row(name: str, basis: TorqueBasis, numbers: int) -> LawRow:
    """A law fitted to all points of a basis but the last, TWELFTH, by least squares.

    Parameters   name : with places for its factor {a} and coefficient {k};  numbers : 1, or 2 with the factor
    """
    fitted, loss = basis.subset(range(len(basis) - 1)), "least_squares"
    values = fit_values(fitted, numbers, loss)
    missed = np.abs(fitted.torque(values) / fitted.measured - 1.0)
    left_out = np.abs(left_out_deviations(fitted, numbers, loss))
    rest = leave_one_table_out(fitted, numbers, loss)
    return LawRow(
        name.format(a=values[0], k=values[1]), numbers, tuple(float(t) for t in basis.torque(values)),
        float(missed.mean()), float(missed.max()), {table: found["mean"] for table, found in rest.items()},
        (float(left_out.mean()), float(left_out.max())),
    )  # fmt: skip


def baseline_rows(parameters: Parameters) -> list[LawRow]:
    """Closed formulas for the screw and oil of the parameters."""
    screw = parameters.screw
    jungnickel = jungnickel_basis(parameters, law_points())
    return [
        fitted_row("Jungnickel J + {k:.3g} mm F", jungnickel, 1),
        fitted_row("Jungnickel {a:.3g} J + {k:.3g} mm F", jungnickel, 2),
        evaluated_row("Zhou", 0, lambda preload, *_: float(zhou_torque(screw, preload))),
        evaluated_row("NSK", 0, lambda preload, *_: float(nsk_torque(screw, preload))),
    ]


def unfitted_row(parameters: Parameters, nut_map: NutMap) -> LawRow:
    """The mechanistic law without a fit, with the default thrust."""
    k = ball_ball_coefficient(parameters.friction)

    def unfitted(preload: float, speed: float, temperature: float) -> float:
        return float(nut_map.evaluate(preload, speed, temperature, 0.0, 1.0, k).friction_torque)

    return evaluated_row(f"mechanistic, not fitted ({k:.3g})", 0, unfitted)


def laws_text(rows: Sequence[LawRow]) -> str:
    """Torques at the points, then the deviations, one column and one line per law."""
    width = max(len(row.name) for row in rows) + 2
    lines = ["Torque by law at the measured points and at one that no law is fitted to [N.m]"]
    lines += [f"  {chr(ord('A') + i)}: {row.name}" for i, row in enumerate(rows)]
    columns = "".join(f"{chr(ord('A') + i):>8}" for i in range(len(rows)))
    lines.append(f"{'preload':>9}{'speed':>7}{'measured':>10}{columns}")
    for i, m in enumerate(law_points()):
        torques = "".join(f"{row.torques[i]:8.3f}" for row in rows)
        note = "  inferred from friction coefficients" if m is TWELFTH else ""
        lines.append(f"{m.preload:7.0f} N{m.speed / RPM:7.0f}{m.torque:10.3f}{torques}{note}")
    lines += [
        "",
        "Deviation in per cent. 2 from 4, 4 from 2: points of one table only, by a fit to the other; left out: one",
        f"point at a time; last column: {TWELFTH.point}, not fitted;",
        f"in brackets: {FITTED[1]} by default",
        f"{'':{width}}{'fitted':>6}{'mean':>7}{'max':>7}{'2 from 4':>10}{'4 from 2':>10}{'left out':>10}{'max':>7}"
        f"{'12th':>8}",
    ]
    for row in rows:
        rest = row.from_rest or {}
        left_out = row.left_out or (math.nan, math.nan)
        cells = "".join((
            _percent(row.mean, 7), _percent(row.most, 7), *(_percent(rest.get(t, math.nan), 10) for t in TABLES),
            _percent(left_out[0], 10), _percent(left_out[1], 7), f"{100.0 * row.twelfth:+8.1f}",
        ))  # fmt: skip
        lines.append(f"{row.name:{width}}{row.numbers:6}{cells}")
    return "\n".join(lines)


def _percent(value: float, width: int) -> str:
    return f"{100.0 * value:{width}.2f}" if math.isfinite(value) else f"{'-':>{width}}"
