#!/usr/bin/env python3
"""The friction laws compared with the torques that Zhao et al. (2023) measured, and with closed formulas.

    python examples/paper/measured_torques.py

Prints, for each law with its number of fitted parameters: deviations at the 11 points, at points left out of its fit,
of one table predicted by the fit to the other, and at a twelfth point that nothing is fitted to. Then Tables 2, 3 and 4
of the paper. Closed formulas are the bar that a solved contact has to clear.
"""

import itertools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from pipe_table import percent, table

from ballscrew_tehl import load_map, load_screw
from ballscrew_tehl.applications.calibration.fit import torque_basis
from ballscrew_tehl.applications.calibration.measured_screw import (
    ASSUMED_TEMPERATURE,
    MODELS,
    Evaluate,
    ValidationTable,
    packaged_measurements,
    validation_tables,
)
from ballscrew_tehl.applications.calibration.measurements import Measurement
from ballscrew_tehl.applications.published_formulas import jungnickel_torque, zhou_torque
from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.friction.sets import SETS, SUPPLY, FrictionSet, default_friction_set
from ballscrew_tehl.parameters.file import PACKAGED_VG100, Parameters, changed
from ballscrew_tehl.parameters.friction import ball_ball_coefficient
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.rating import nsk_torque
from ballscrew_tehl.runtime.evaluate import NutMap

#: inferred, not printed: coefficients of friction over speed in the text on Fig. 16 of Zhao et al. (2023), on the scale
#: that the measured 1 and 6 kN at 100 r/min fix, if their ends are 1 and 6 kN: 3.59, 3.77, 3.80 or 3.50 N.m
TWELFTH = Measurement(6000.0, 2500.0 * RPM, ASSUMED_TEMPERATURE, 3.80)
TWELFTH_LEAST = 3.50
TABLES = ("table2", "table4")
#: oil temperatures [C] that a screw may have after ten minutes of idling, as section 4.1 has it
OIL_TEMPERATURES = (20.0, 25.0, 30.0, 35.0)
#: thermal resistance [K/W] from the nut to its surroundings, of the rows with self-heating: an assumption, as of a nut
#: of 40 mm in a housing; 0: one temperature for all points
RESISTANCES = (0.0, 0.05)
#: the law, without oil between the balls, and with the replenishment of an oil bath on top
VARIANTS: tuple[dict[str, float], ...] = ({}, {"neighbour_oil": 0.0}, {"replenishment_constant": 3e-8})


class Law(NamedTuple):
    """A friction set with the parameters and the map that it is evaluated with."""

    entry: FrictionSet
    parameters: Parameters
    nut_map: NutMap

    def parts(self, preload, speed, temperature) -> tuple:
        """Viscous, hysteresis and sliding torque [N.m] with the numbers of the set."""
        return tuple(self.nut_map.evaluate(preload, speed, temperature, 0.0, *self.entry.values)[:3])

    def torque(self, preload, speed, temperature):
        """Torque [N.m] with the numbers of the set."""
        return sum(self.parts(preload, speed, temperature))


class LawRow(NamedTuple):
    """Deviations |model/measured - 1| of one law at the 11 points; torques: there and at TWELFTH [N.m].

    from_rest: table -> mean of the points that only this table has, by the fit to the rest; left_out: mean and largest
    of points left out one at a time; None where nothing is fitted
    """

    name: str
    numbers: int
    torques: np.ndarray
    from_rest: dict[str, float] | None = None
    left_out: tuple[float, float] | None = None

    def cells(self) -> list[str]:
        """The row of the table of laws."""
        errors = np.abs(self.torques[:-1] / _measured() - 1.0)
        remainder, left_out = self.from_rest or {}, self.left_out or (None, None)
        from_rest = (percent(remainder.get(name)) for name in TABLES)
        ends = (100.0 * (self.torques[-1] / inferred - 1.0) for inferred in (TWELFTH.torque, TWELFTH_LEAST))
        twelfth = "{:+.0f} to {:+.0f} %".format(*ends)
        shown = percent(errors.mean()), percent(errors.max()), *from_rest, *map(percent, left_out), twelfth
        return [self.name, str(self.numbers), *shown]


def packaged_laws() -> list[Law]:
    """The law of the paper, and the mechanistic one, which comes with another oil."""
    result = []
    for parameters in (load_screw(), load_screw(PACKAGED_VG100)):
        entry = default_friction_set(parameters)
        result.append(Law(entry, parameters, load_map(None, parameters)))
    return result


def law_points() -> list[Measurement]:
    """The 11 measured points and TWELFTH."""
    return [*packaged_measurements(), TWELFTH]


def _measured() -> np.ndarray:
    return np.array([m.torque for m in packaged_measurements()])


def evaluated_row(name: str, numbers: int, evaluate: Evaluate) -> LawRow:
    """A law that is not fitted here."""
    torques = [float(evaluate(m.preload, m.speed, m.temperature)) for m in law_points()]
    return LawRow(name, numbers, np.array(torques))


def set_row(entry: FrictionSet, evaluate: Evaluate) -> LawRow:
    """A friction set, with the figures of its fit."""
    row = evaluated_row(entry.name, len(SETS[entry.name]), evaluate)
    remainder = {name: result["mean"] for name, result in entry.leave_one_table_out.items()}
    return row._replace(
        from_rest=remainder, left_out=(entry.errors["leave_one_out_mean"], entry.errors["leave_one_out_max"])
    )


def temperature_rows() -> list[list[str]]:
    """Mean and largest deviation by oil temperature, which is not printed, one number of each law fitted anew.

    With RESISTANCES the oil of each point is warmer by the resistance times its measured friction power.
    """
    variants, rows = (
        [changed(load_screw(PACKAGED_VG100), friction={SUPPLY: 6.0} | other) for other in VARIANTS],
        [],
    )
    for celsius, resistance in itertools.product(OIL_TEMPERATURES, RESISTANCES):
        points = [
            replace(m, temperature=celsius + CELSIUS + resistance * m.torque * m.speed) for m in law_points()
        ]
        bases = [torque_basis(each, BallContacts(each), points) for each in variants]
        law, *others = (fitted_row("{0:.4g}", b.sliding[:, None], b.torque((1.0, 0.0, 0.0))) for b in bases)
        J = np.array([jungnickel_torque(variants[0], m.preload, m.speed, m.temperature) for m in points])
        F = 1e-3 * np.array([[m.preload] for m in points])
        laws = law, *(fitted_row("{0:.3g}", F, fixed) for fixed in (J, np.zeros(len(F)))), *others
        at = f"{celsius:g} C" + f", {resistance:g} K/W" * (resistance > 0.0)
        rows.append([at, *(cell for row in laws for cell in (row.name, *row.cells()[2:4]))])
    return rows


def fitted_row(name: str, columns: np.ndarray, fixed: np.ndarray) -> LawRow:
    """Torque columns (12, p) @ numbers + fixed (12,), fitted to the 11 points by relative least squares.

    name: with places for the numbers {0}, {1}.
    """
    measured, points = _measured(), packaged_measurements()

    def torques(rows) -> tuple[np.ndarray, np.ndarray]:
        A, y = columns[:-1][rows] / measured[rows, None], 1.0 - fixed[:-1][rows] / measured[rows]
        numbers = np.linalg.lstsq(A, y, rcond=None)[0]
        return columns @ numbers + fixed, numbers

    def errors(without: list[int]) -> np.ndarray:
        result, _ = torques([i for i in range(len(measured)) if i not in without])
        return np.abs(result[without] / measured[without] - 1.0)

    result, numbers = torques(list(range(len(measured))))
    only = {name: [i for i, m in enumerate(points) if m.tables == (name,)] for name in TABLES}
    left_out = np.array([errors([i])[0] for i in range(len(measured))])
    return LawRow(
        name.format(*numbers), len(numbers), result,
        {name: float(errors(rows).mean()) for name, rows in only.items()},
        (float(left_out.mean()), float(left_out.max())),
    )  # fmt: skip


def baseline_rows(parameters: Parameters) -> list[LawRow]:
    """Closed formulas for screw and oil: Jungnickel J with a length times the preload F, Zhou, NSK."""
    points, screw = law_points(), parameters.screw
    J = np.array([jungnickel_torque(parameters, m.preload, m.speed, m.temperature) for m in points])
    F = 1e-3 * np.array([m.preload for m in points])
    return [
        fitted_row("Jungnickel J + {0:.3g} mm F", F[:, None], J),
        fitted_row("Jungnickel {0:.3g} J + {1:.3g} mm F", np.stack([J, F], axis=1), np.zeros(len(F))),
        evaluated_row("Zhou", 0, lambda preload, *_: float(zhou_torque(screw, preload))),
        evaluated_row("NSK", 0, lambda preload, *_: float(nsk_torque(screw, preload))),
    ]


def compared_laws(laws: list[Law]) -> list[LawRow]:
    """The packaged sets, the mechanistic law with the default thrust in place of a fit, closed formulas."""
    last = laws[-1]
    k = ball_ball_coefficient(last.parameters.friction)
    unfitted = last._replace(entry=FrictionSet(last.entry.law, 1.0, k))
    return [
        *(set_row(law.entry, law.torque) for law in laws),
        evaluated_row(f"mechanistic, not fitted ({k:.3g})", 0, unfitted.torque),
        *baseline_rows(last.parameters),
    ]


def paper_table(shown: ValidationTable) -> str:
    """One table of the paper."""
    digits = 3 if shown.unit == "N.m" else 0
    rows = []
    for row in shown.rows:
        torques = (f"{x:.{digits}f}" for x in (row.measured, *row.models))
        rows.append([f"{row.preload:.0f}", f"{row.speed / RPM:.0f}", *torques])
    rows.append(["mean deviation", "", "", *map(percent, shown.deviations)])
    title = f"{shown.title} [{shown.unit.replace('.', ' ')}]"
    return table(title, ["preload [N]", "speed [r/min]", "measured", *MODELS], rows)


def main() -> str:
    """The tables as text."""
    laws = packaged_laws()
    head = ["law", "fitted numbers", "mean", "largest", "Table 2 from 4", "Table 4 from 2"]
    head += ["left out, mean", "left out, largest", "12th point"]
    rows = [row.cells() for row in compared_laws(laws)]
    parts = ["## Friction laws compared", table("Deviation from the measured torques", head, rows)]
    head = ["oil at", "law: coefficient", "mean", "largest", "Jungnickel: [mm]", "mean", "largest"]
    head += ["proportional to preload, as Zhou and NSK: [mm]", "mean", "largest"]
    head += ["law without oil between balls", "mean", "largest", "law in an oil bath", "mean", "largest"]
    title = "Deviation by the oil temperature, not printed; ISO VG 100, one number of each fitted anew"
    parts.append(table(title, head, temperature_rows()))
    parts.append("## Tables of the paper")
    for entry, parameters, nut_map in laws:
        law = Law(entry, parameters, nut_map)
        parts += [f"### Friction set `{entry.name}`", f"{entry.provenance}."]
        parts += [
            paper_table(shown) for shown in validation_tables(lambda *at, law=law: float(law.torque(*at)))
        ]
    return "\n\n".join(part.rstrip() for part in parts)


if __name__ == "__main__":
    print(main())
