"""Result of a calibration: its points, what the data do not identify, as rows of --json and as text."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ballscrew_tehl.friction.interval import implied_thrust
from ballscrew_tehl.friction.sets import FITTED, SUPPLY, FrictionSet
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.runtime.packed import Law

from .fit import INVERSE_SUPPLY, MAX_INVERSE, OF_MECHANISTIC, THIRD, Fit, TorqueBasis
from .measurements import RowProblem, spread_advice
from .written_sets import friction_set_lines

#: a parameter counts as identified if half its 95 % interval is at most this fraction of its value
PRECISION = 0.25
#: the split counts as identified if the 95 % interval of the sliding fraction of the torque is at most this wide
SPLIT_WIDTH = 0.10
SPLIT = "split into viscous and sliding torque"
TRANSFER = (
    "for other screws of the same maker: net_sliding_coefficient, the friction between balls, carries over to screws "
    "with the same kind of balls, returns and finish; the torque of seals and the supply of oil or grease do not"
)


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration.

    Attributes
    ----------
    friction_set : FrictionSet
        Fitted set, with limits and what is not identified.
    basis, fit : TorqueBasis, Fit
        Points of the fit and its statistics.
    dropped : list of RowProblem
        Rows left out of the fit, with the reason.
    notes : list of str
        Assumptions and warnings, one sentence each.
    level : dict of str to float
        Of a single torque, by key of --json: the law there without friction between balls, its interval.
    parameters, film : Parameters, ContactValues
        Screw, oil and contacts of the fit.
    """

    friction_set: FrictionSet
    basis: TorqueBasis
    fit: Fit
    dropped: list[RowProblem]
    notes: list[str]
    level: dict[str, float]
    parameters: Parameters
    film: Any


def number_notes(entry: FrictionSet, parameters: Parameters) -> list[str]:
    """What the fitted number of the mechanistic law is in terms of the other keys of the screw file."""
    if entry.name != Law.MECHANISTIC:
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


def supply_notes(basis: TorqueBasis, found: Fit, parameters: Parameters) -> list[str]:
    """Which numbers of the mechanistic law are fitted, and why."""
    if found.supply is None:
        return []
    low, high = found.supply.length
    what = {
        OF_MECHANISTIC[1:]: "level and shape fitted",
        OF_MECHANISTIC[THIRD:]: f"shape fitted, not the level: limits of {FITTED[1]} span its bounds",
    }.get(basis.names, "level fitted, not the shape")
    default = parameters.friction.supply_length
    return [f"{what}: {SUPPLY} is {low:.3g} to {high:.3g} half-widths at 95 %, default {default:g}"]


def not_identified(basis: TorqueBasis, found: Fit) -> dict[str, str]:
    """Parameters, or SPLIT, that the data do not determine to PRECISION and SPLIT_WIDTH -> their intervals."""
    reasons = {}
    for name, half in found.half_width.items():
        value = float(found.values[basis.parameters.index(name)])
        if not half <= PRECISION * value:
            scale, unit = (1e9, " nm") if name == FITTED[2] else (1.0, "")
            low, high, middle = (
                f"{scale * number:.3g}{unit}" if math.isfinite(number) else "no bound"
                for number in (*found.limits[name].values(), value)
            )
            reasons[name] = f"95 % interval {low} to {high} around {middle}"
    supply = found.supply
    if supply and INVERSE_SUPPLY not in basis.names and np.ptp(supply.inverse) > 0.5 * MAX_INVERSE:
        reasons[SUPPLY] = "95 % interval {:.3g} to {:.3g} half-widths".format(*supply.length)
    per_net = float(np.mean(basis.sliding / basis.measured))
    low_share, high_share = (min(per_net * bound, 1.0) for bound in found.limits[FITTED[1]].values())
    if not high_share - low_share <= SPLIT_WIDTH:
        part = "sliding share" if basis.names[0] == FITTED[0] else "share of ball on ball"
        reasons[SPLIT] = f"{part} of the torque {100.0 * low_share:.0f} to {100.0 * high_share:.0f} %"
    return reasons


def calibration_data(result: Calibration) -> dict[str, Any]:
    """What --json adds to the friction set; one row per point of the fit."""
    fit, points = result.fit, result.basis.measurements
    arrays = {
        "computed_nm": result.basis.torque(fit.values), "deviation": fit.deviation,
        "left_out_deviation": fit.left_out, "leverage": fit.leverage, "studentised": fit.studentised,
    }  # fmt: skip
    rows = [
        {
            "rows": list(m.rows),
            "preload_n": m.preload,
            "speed_rpm": m.speed / RPM,
            "temperature_k": m.temperature,
            "axial_load_n": m.axial_load,
            "weight": m.weight,
            "measured_nm": m.torque,
            **{key: float(values[i]) for key, values in arrays.items()},
            "outlier": i in fit.outliers,
            **result.level,
        }
        for i, m in enumerate(points)
    ]
    uncertainty = np.array([m.uncertainty or math.nan for m in points])
    spread = math.nan
    if freedom := len(points) - len(result.basis.names):
        spread = float(np.linalg.norm(fit.deviation * result.basis.measured / uncertainty)) / math.sqrt(
            freedom
        )
    return {
        "points": rows,
        "dropped": [{"row": problem.row, "reason": problem.reason} for problem in result.dropped],
        "outliers": [list(points[i].rows) for i in fit.outliers],
        "notes": result.notes,
        "not_identified": result.friction_set.not_identified,
        "error_over_uncertainty": spread if math.isfinite(spread) else None,
    }


def calibration_text(result: Calibration, data: dict[str, Any]) -> str:
    """The same for readers: points, parameters, errors, what is not identified, dropped rows."""
    import pandas as pd

    points, entry = pd.DataFrame(data["points"]), result.friction_set
    columns = {
        "row": ["=".join(map(str, rows)) for rows in points["rows"]], "preload [N]": points["preload_n"],
        "speed [r/min]": points["speed_rpm"], "oil [C]": points["temperature_k"] - CELSIUS,
        "axial [N]": points["axial_load_n"], "measured [N m]": points["measured_nm"],
        "computed [N m]": points["computed_nm"], "model [%]": (100.0 * points["deviation"]).round(1),
        "left out [%]": (100.0 * points["left_out_deviation"]).round(1),
    }  # fmt: skip
    if points["outlier"].any():
        columns[""] = points["outlier"].map({True: "outlier", False: ""})
    lines = [pd.DataFrame(columns).to_string(index=False, float_format="{:.4g}".format, na_rep="-"), ""]
    lines.append("Fitted (value +- half-width of the 95 % interval)")
    lines += friction_set_lines(entry)
    lines += [f"    {key:<26}{value:.4g}" for key, value in result.level.items()]
    if (spread := data["error_over_uncertainty"]) is not None:
        advice = spread_advice(spread)
        text = f"    errors over stated uncertainties: {spread:.2g} (about 1 expected)"
        lines.append(f"{text}{advice and f': {advice}'}")
    if entry.not_identified:
        lines.append("Not identified by these data:")
        lines += [f"    {name}: {why}" for name, why in entry.not_identified.items()]
    lines += [f"dropped: {problem}" for problem in result.dropped]
    return "\n".join([*lines, *(f"note: {note}" for note in result.notes)])
