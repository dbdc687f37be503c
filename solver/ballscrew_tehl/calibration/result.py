"""Result of a calibration: its points, what the data do not identify, as rows and as text."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..friction.interval import implied_thrust
from ..friction.sets import FITTED, FrictionSet, friction_set_lines
from ..parameters.file import Parameters
from ..parameters.units import CELSIUS, RPM
from ..runtime.packed import MECHANISTIC
from .fit import Fit, TorqueBasis
from .measurement_file import RowProblem
from .measurements import repeat_scatter, spread_advice

#: a parameter counts as identified if half its 95 % interval is at most this fraction of its value
PRECISION = 0.25
#: the split counts as identified if the 95 % interval of the sliding fraction of the torque is at most this wide
SPLIT_WIDTH = 0.10
SPLIT = "split into viscous and sliding torque"
TRANSFER = (
    "for other screws of the same maker: net_sliding_coefficient, the friction between balls, carries over to screws "
    "with the same kind of balls, returns and finish; the torque of seals, which is not modelled, and the supply of "
    "oil or grease do not"
)


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration.

    friction_set  with limits and what is not identified;  basis, fit: the points of the fit and its statistics
    dropped       rows left out of the fit, with the reason;  notes  assumptions and warnings, one sentence each
    level         of a single torque, by key of --json: the law there without friction between balls, its interval
    """

    friction_set: FrictionSet
    basis: TorqueBasis
    fit: Fit
    dropped: list[RowProblem]
    notes: list[str]
    level: dict[str, float]

    @property
    def spread(self) -> float | None:
        """Root of the weighted mean square error over the stated uncertainties, None without these."""
        stated, freedom = (
            [m.uncertainty for m in self.basis.measurements],
            len(self.basis) - len(self.basis.names),
        )
        if not (all(stated) and freedom):
            return None
        over = self.fit.deviation * self.basis.measured / np.array(stated, dtype=float)
        return math.sqrt(float(over @ over) / freedom)


def number_notes(entry: FrictionSet, parameters: Parameters) -> list[str]:
    """What the fitted number of the mechanistic law is in terms of the other keys of the screw file."""
    if entry.name != MECHANISTIC:
        return []
    thrust = implied_thrust(entry.net_sliding_coefficient, parameters)
    notes = [
        "net_sliding_coefficient = 2 boundary_friction limiting_shear_coefficient ball_thrust; with the first two of "
        f"this screw file ball_thrust = {thrust:.3g}. A screw file has one of these two numbers, not both",
        TRANSFER,
    ]
    if not entry.net_sliding_coefficient > 0.0:
        notes.append(
            "net_sliding_coefficient = 0: the computed rolling loss and shear alone exceed the measured torque: check "
            "unit and sign of the torque, preload, oil (viscosity, temperature) and its supply (supply_length)"
        )
    return notes


def not_identified(basis: TorqueBasis, found: Fit) -> dict[str, str]:
    """Parameters, or SPLIT, that the data do not determine to PRECISION and SPLIT_WIDTH -> their intervals."""
    reasons = {}
    for name, half in found.half_width.items():
        value, bounds = float(found.values[FITTED.index(name)]), found.limits[name]
        if not half <= PRECISION * value:
            low, high = (_shown(name, bounds[end]) for end in ("low", "high"))
            reasons[name] = f"95 % interval {low} to {high} around {_shown(name, value)}"
    per_net = float(np.mean(basis.sliding / basis.measured))
    low_share, high_share = (min(per_net * bound, 1.0) for bound in found.limits[FITTED[1]].values())
    if not high_share - low_share <= SPLIT_WIDTH:
        part = "sliding share" if basis.names[0] == FITTED[0] else "share of ball on ball"
        reasons[SPLIT] = f"{part} of the torque {100.0 * low_share:.0f} to {100.0 * high_share:.0f} %"
    return reasons


def _shown(name: str, value: float) -> str:
    if not math.isfinite(value):
        return "no bound"
    return f"{1e9 * value:.3g} nm" if name == FITTED[2] else f"{value:.3g}"


def outlier_text(basis: TorqueBasis, found: Fit, i: int) -> str:
    """Torque, deviation and residual of a point."""
    return (
        f"torque {basis.measured[i]:.4g} N.m, model {100.0 * found.deviation[i]:+.1f} %, deleted studentised "
        f"residual {found.studentised[i]:.1f} (limit {found.limit:.1f})"
    )


def calibration_data(result: Calibration) -> dict[str, Any]:
    """What --json adds to the friction set; one row per point of the fit."""
    found, points, outliers = result.fit, result.basis.measurements, result.fit.outliers
    computed = result.basis.torque(found.values)
    rows = [
        {
            "rows": list(m.rows),
            "preload_n": m.preload,
            "speed_rpm": m.speed / RPM,
            "temperature_k": m.temperature,
            "axial_load_n": m.axial_load,
            "weight": m.weight,
            "measured_nm": m.torque,
            "computed_nm": float(computed[i]),
            "deviation": float(found.deviation[i]),
            "left_out_deviation": float(found.left_out[i]),
            "leverage": float(found.leverage[i]),
            "studentised": float(found.studentised[i]),
            "outlier": i in outliers,
            **result.level,
        }
        for i, m in enumerate(points)
    ]
    return {
        "points": rows,
        "dropped": [{"row": problem.row, "reason": problem.reason} for problem in result.dropped],
        "outliers": [list(points[i].rows) for i in outliers],
        "notes": result.notes,
        "not_identified": result.friction_set.not_identified,
        "error_over_uncertainty": result.spread,
        "repeat_over_uncertainty": repeat_scatter(points),
    }


def calibration_text(result: Calibration, data: dict[str, Any]) -> str:
    """The result as text: points, parameters, errors, what is not identified, dropped rows."""
    heads = ("row", "preload", "speed", "oil", "axial", "measured", "computed", "model", "left out")
    units = ("", "N", "r/min", "C", "N", "N m", "N m", "%", "%")
    widths = (9, 10, 9, 7, 9, 10, 10, 8, 10)
    lines = ["".join(f"{text:>{w}}" for text, w in zip(line, widths, strict=True)) for line in (heads, units)]
    for row in data["points"]:
        lines.append(
            f"{'='.join(str(number) for number in row['rows']):>9}{row['preload_n']:>10.4g}{row['speed_rpm']:>9.4g}"
            f"{row['temperature_k'] - CELSIUS:>7.1f}{row['axial_load_n']:>9.4g}{row['measured_nm']:>10.4g}"
            f"{row['computed_nm']:>10.4g}{100.0 * row['deviation']:>+8.1f}{100.0 * row['left_out_deviation']:>+10.1f}"
            + ("  outlier" if row["outlier"] else "")
        )
    entry = result.friction_set
    lines += ["", "Fitted (value +- half-width of the 95 % interval)", *friction_set_lines(entry)]
    lines += [f"    {name:<26}{value:.4g}" for name, value in result.level.items()]
    if result.spread is not None:
        advice = spread_advice(result.spread, data["repeat_over_uncertainty"])
        lines.append(
            f"    errors over stated uncertainties: {result.spread:.2g} (about 1 expected){advice and f': {advice}'}"
        )
    if entry.not_identified:
        lines.append("Not identified by these data:")
        lines += [f"    {name}: {why}" for name, why in entry.not_identified.items()]
    lines += [f"dropped: {problem}" for problem in result.dropped]
    return "\n".join([*lines, *(f"note: {note}" for note in result.notes)])
