"""Calibration on a user's own measurements: usable rows, fit, errors, what the data do not identify."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .. import __version__
from ..friction.interval import implied_thrust
from ..friction.mechanistic import ContactValues
from ..friction.origin import with_set
from ..friction.sets import MECHANISTIC, SETS, FrictionSet, friction_set_lines
from ..friction.torque import FilmModel
from ..parameters.file import Parameters
from ..parameters.screw import LAW_SETS
from ..parameters.units import CELSIUS, RPM
from .diagnostics import (
    PRECISION,
    ROBUST_LIMIT,
    SPLIT_WIDTH,
    PointDiagnostics,
    Rival,
    condition,
    not_identified,
    point_diagnostics,
    predicts_better,
    share_name,
)
from .fit import TorqueBasis, fit_values
from .level import check_level
from .measurement_file import MeasurementFile, RowProblem, implausible_for, named_rows, refusal
from .measurements import Measurement
from .packaged import (
    FILM_OF_SET,
    Progress,
    check_parts_differ,
    fit_friction_set,
    left_out_deviations,
    torque_basis,
)
from .repeats import repeat_notes, repeat_scatter, repeats_of, spread_advice

#: kinds of rows that --drop leaves out of a fit
DROPS = ("impossible", "outside", "outliers")
#: degrees of freedom below which a note says that intervals are rough
FEW_DEGREES = 3
#: set -> that of the same law with one parameter less
SMALLER = {"three_parameter": "two_parameter"}
NO_OUTLIERS = "--drop outliers: there are none, every point is in the fit"
TRANSFER = (
    "for other screws of the same maker: net_sliding_coefficient, the friction between balls, carries over to screws "
    "with the same kind of balls, returns and finish; the torque of seals, which is not modelled, and the supply of "
    "oil or grease do not"
)


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration.

    friction_set  with limits and what is not identified;  basis  the points of the fit
    points        diagnostics of these points
    left_out      model/measured - 1 of each by the fit to the others, without its repeats (n,)
    dropped       rows left out of the fit, with the reason;  notes  assumptions and warnings, one sentence each
    condition     condition number of the scaled derivatives of the fit
    spread        root of the weighted mean square error over the stated uncertainties, None without these
    """

    friction_set: FrictionSet
    basis: TorqueBasis
    points: PointDiagnostics
    left_out: np.ndarray
    dropped: list[RowProblem]
    notes: list[str]
    condition: float
    spread: float | None


def _without(
    path: Any, kind: str, problems: list[RowProblem], drop: Collection[str], what: str, left: int
) -> list[RowProblem]:
    """The problems, if they may be dropped.

    Raises       ValueError: they may not, or no row is left
    """
    if problems and kind not in drop:
        raise refusal(path, what, problems, f"fix or remove them, or continue without them: --drop {kind}")
    if problems and left == 0:
        raise refusal(path, f"{what}, no row is left", problems, "fix them")
    return problems


def _placed(file: MeasurementFile, problem: RowProblem) -> RowProblem:
    return replace(problem, line=file.lines[problem.row - 1])


def usable_points(
    file: MeasurementFile,
    parameters: Parameters,
    drop: Collection[str] = (),
    outside: Callable[[Measurement], str] = lambda m: "",
) -> tuple[list[Measurement], list[RowProblem]]:
    """Points that can be fitted, and the rows that are dropped as the caller allows.

    Parameters   drop : kinds of DROPS;  outside : why the film model has no value for a point, "" if it has
    Raises       ValueError: rows that cannot be used and may not be dropped; no row left; unknown kind
    """
    if unknown := set(drop) - set(DROPS):
        raise ValueError(f"drop = {', '.join(sorted(unknown))}; allowed: {', '.join(DROPS)}")
    implausible = [_placed(file, problem) for problem in implausible_for(parameters, file.measurements)]
    problems = sorted([*file.problems, *implausible], key=lambda p: p.row)
    bad = {problem.row for problem in problems}
    points = [m for m in file.measurements if not bad & set(m.rows)]
    dropped = _without(file.path, "impossible", problems, drop, "impossible row(s)", len(points))
    checked = [(m, outside(m)) for m in points]
    beyond = [_placed(file, RowProblem(row, 0, reason)) for m, reason in checked if reason for row in m.rows]
    points = [m for m, reason in checked if not reason]
    return points, dropped + _without(
        file.path, "outside", beyond, drop, "row(s) outside the map", len(points)
    )


def _check_count(points: list[Measurement], name: str) -> list[str]:
    """Warnings about few points.

    Raises       ValueError: fewer distinct operating points than fitted parameters
    """
    count = len(SETS[name])
    distinct = repeats_of(points)
    if len(distinct) < count or len(points) <= count:
        need = f"the {count} parameters of {name} need" if count > 1 else f"the parameter of {name} needs"
        fits = name in SMALLER and len(points) == count and len(distinct) >= count - 1
        raise ValueError(
            f"usable rows: {len(points)}, different operating points: {len(distinct)}; {need} at least {count + 1} "
            f"rows at {count} operating point{'s' * (count > 1)}: measure more"
            + (
                ", or give the only one as --torque-nm and its operating point"
                if count == len(points) == 1
                else ""
            )
            + (f", or fit --set {SMALLER[name]}" if fits else "")
        )
    notes = []
    if len(points) - count < FEW_DEGREES:
        notes.append(
            f"{len(points)} rows for {count} parameter{'s' * (count > 1)}: {len(points) - count} degree(s) of freedom, "
            "intervals and errors are rough"
        )
    if len(distinct) == count:
        notes.append(
            f"{count} operating points for {count} parameters: no point is left to check the shape of the torque"
        )
    return notes


def calibrate_file(
    file: MeasurementFile,
    parameters: Parameters,
    film_model: Callable[[str], FilmModel | ContactValues],
    name: str,
    loss: str = "least_squares",
    drop: Collection[str] = (),
    outside: Callable[[Measurement], str] = lambda m: "",
    progress: Progress = lambda finished, total, what: None,
) -> Calibration:
    """Fit one set to a file with error estimates and diagnostics.

    The other set of the law, with its film, is fitted as well. If its errors at left-out points are not significantly
    larger, parameters in which both differ are not identified.

    Parameters   film_model : name of a film -> film model of the parameters, of the mechanistic set their contacts
                 name : of SETS, of the law of the parameters;  loss : see fit
                 drop : kinds of DROPS;  outside : see usable_points;  progress : called during the solves and fits
    Raises       ValueError: a set of another law; as usable_points; too few points; viscous and sliding part
                 proportional at all points
    """
    with_set(parameters, name)
    points, dropped = usable_points(file, parameters, drop, outside)
    notes = [*file.notes, *repeat_notes(points, file.lines), *_check_count(points, name)]
    count = len(SETS[name])
    film = film_model(FILM_OF_SET[name])
    check_level(points, parameters, film, name, file)
    basis = torque_basis(parameters, film, points, progress)
    if "outliers" in drop:
        basis, outliers = _without_outliers(basis, count)
        dropped = dropped + outliers
        notes += _check_count(list(basis.measurements), name) if outliers else [NO_OUTLIERS]
    if name == MECHANISTIC:
        notes.append(TRANSFER)
    check_parts_differ(basis, count)
    left_out = left_out_deviations(basis, count, loss, progress)
    provenance = _provenance(file, basis, dropped)
    found = fit_friction_set(basis, parameters, film.name, name, loss, provenance, left_out)
    missed = np.abs(left_out)
    rivals = []
    for other in LAW_SETS[parameters.friction.kinematics]:
        if other != name and len(basis) > len(SETS[other]):
            own = FILM_OF_SET[other]
            theirs = torque_basis(parameters, film_model(own), basis.measurements, progress)
            values = fit_values(theirs, len(SETS[other]), loss)
            off = np.abs(left_out_deviations(theirs, len(SETS[other]), loss, progress))
            rivals.append(Rival(f"{other} (film {own})", theirs, values, off))
    unknown = not_identified(basis, found.values, count, found.limits, found.correlations, missed, rivals)
    diagnostics = point_diagnostics(basis, found.values, count)
    notes += [
        *number_notes(found, parameters),
        *(
            f"the fit {rival.name} predicts left-out points better: {100.0 * rival.left_out.mean():.1f} % instead of "
            f"{100.0 * missed.mean():.1f} %"
            for rival in rivals
            if predicts_better(rival.left_out, missed)
        ),
        *_point_notes(basis, diagnostics),
    ]
    return Calibration(
        replace(found, not_identified=unknown), basis, diagnostics, left_out, dropped, notes,
        condition(basis, found.values, count), _spread(basis, found, count),
    )  # fmt: skip


def _provenance(file: MeasurementFile, basis: TorqueBasis, dropped: list[RowProblem]) -> str:
    without = f", without {named_rows([problem.row for problem in dropped])}" if dropped else ""
    return (
        f"{file.path.name} (SHA-256 {file.digest}), {len(basis)} points of {len(file.lines)} rows{without}, "
        f"ballscrew_tehl {__version__}"
    )


def number_notes(found: FrictionSet, parameters: Parameters) -> list[str]:
    """What the fitted number of the mechanistic law is in terms of the other keys of the screw file."""
    if found.name != MECHANISTIC:
        return []
    thrust = implied_thrust(found.net_sliding_coefficient, parameters)
    notes = [
        "net_sliding_coefficient = 2 boundary_friction limiting_shear_coefficient ball_thrust; with the first two of "
        f"this screw file ball_thrust = {thrust:.3g}. A screw file has one of these two numbers, not both"
    ]
    if not found.net_sliding_coefficient > 0.0:
        notes.append(
            "net_sliding_coefficient = 0: the computed rolling loss and shear alone exceed the measured torque: check "
            "unit and sign of the torque, preload, oil (viscosity, temperature) and its supply (supply_length)"
        )
    return notes


def _without_outliers(basis: TorqueBasis, count: int) -> tuple[TorqueBasis, list[RowProblem]]:
    """The points without outliers, in one pass; outliers of the remaining points are reported and kept."""
    points = point_diagnostics(basis, fit_values(basis, count, "least_squares"), count)
    keep = [i for i in range(len(basis)) if i not in points.outliers]
    outliers = [
        RowProblem(row, 0, f"outlier: {_outlier_text(basis, points, i)}")
        for i in points.outliers
        for row in basis.measurements[i].rows or (i + 1,)
    ]
    return (basis.subset(keep) if outliers else basis), outliers


def _outlier_text(basis: TorqueBasis, points: PointDiagnostics, i: int) -> str:
    return (
        f"torque {basis.measured[i]:.4g} N.m, model {100.0 * points.deviation[i]:+.1f} %, deleted studentised "
        f"residual {points.studentised[i]:.1f} (limit {points.limit:.1f}), robust {points.robust[i]:.1f} "
        f"(limit {ROBUST_LIMIT:g})"
    )


def _point_notes(basis: TorqueBasis, points: PointDiagnostics) -> list[str]:
    notes = [
        f"{basis.measurements[i].point}: outlier, kept: {_outlier_text(basis, points, i)}; "
        "to leave it out: --drop outliers"
        for i in points.outliers
    ]
    unchecked = [basis.measurements[i].point for i in points.unchecked]
    if unchecked:
        notes.append(
            f"{', '.join(unchecked)}: no other point checks it (leverage {points.leverage.max():.2f})"
        )
    if (text := _power_text(basis, points)) is not None:
        notes.append(text)
    return notes


def _power_text(basis: TorqueBasis, points: PointDiagnostics) -> str | None:
    """Which errors of a measured torque these points would show; None where that is not determined."""
    size = points.detectable
    if not np.any(np.isfinite(size)):
        return None
    if not math.isfinite(np.median(size)):
        return (
            f"{len(basis)} points: no torque measured too high would be found as an outlier at a typical one"
        )
    least = basis.measurements[int(np.argmax(size))].point
    worst = f"more than {100.0 * np.max(size):.0f} %" if np.all(np.isfinite(size)) else "no error"
    return (
        f"a torque measured too high by {100.0 * np.median(size):.0f} % or more at a typical one of these {len(basis)} "
        f"points would be found as an outlier, {worst} at {least}"
    )


def _spread(basis: TorqueBasis, found: FrictionSet, count: int) -> float | None:
    stated = [m.uncertainty for m in basis.measurements]
    if not all(stated):
        return None
    over = (basis.torque(found.values) - basis.measured) / np.array(stated, dtype=float)
    return math.sqrt(float(over @ over) / (len(basis) - count))


def point_rows(result: Calibration) -> list[dict[str, Any]]:
    """One row per point of the fit, units in the keys."""
    outliers = set(result.points.outliers)
    computed = result.basis.torque(result.friction_set.values)
    return [
        {
            "rows": list(m.rows),
            "preload_n": m.preload,
            "speed_rpm": m.speed / RPM,
            "temperature_k": m.temperature,
            "axial_load_n": m.axial_load,
            "weight": m.weight,
            "measured_nm": m.torque,
            "computed_nm": float(computed[i]),
            "deviation": float(result.points.deviation[i]),
            "left_out_deviation": float(result.left_out[i]),
            "leverage": float(result.points.leverage[i]),
            "studentised": float(result.points.studentised[i]),
            "outlier": i in outliers,
            "detectable": float(result.points.detectable[i]),
        }
        for i, m in enumerate(result.basis.measurements)
    ]


def calibration_data(result: Calibration) -> dict[str, Any]:
    """What --json adds to the friction set."""
    return {
        "points": point_rows(result),
        "dropped": [{"row": problem.row, "reason": problem.reason} for problem in result.dropped],
        "outliers": [list(result.basis.measurements[i].rows) for i in result.points.outliers],
        "notes": result.notes,
        "not_identified": result.friction_set.not_identified,
        "condition": result.condition,
        "error_over_uncertainty": result.spread,
        "repeat_over_uncertainty": repeat_scatter(result.basis.measurements),
    }


def calibration_text(result: Calibration) -> str:
    """The result as text: points, parameters, errors, what is not identified, dropped rows."""
    lines = [
        f"{'row':>9}{'preload':>10}{'speed':>9}{'oil':>7}{'axial':>9}{'measured':>10}{'computed':>10}{'model':>8}"
        f"{'left out':>10}",
        f"{'':>9}{'N':>10}{'r/min':>9}{'C':>7}{'N':>9}{'N m':>10}{'N m':>10}{'%':>8}{'%':>10}",
    ]
    for row in point_rows(result):
        lines.append(
            f"{'='.join(str(number) for number in row['rows']):>9}{row['preload_n']:>10.4g}{row['speed_rpm']:>9.4g}"
            f"{row['temperature_k'] - CELSIUS:>7.1f}{row['axial_load_n']:>9.4g}{row['measured_nm']:>10.4g}"
            f"{row['computed_nm']:>10.4g}{100.0 * row['deviation']:>+8.1f}{100.0 * row['left_out_deviation']:>+10.1f}"
            + ("  outlier" if row["outlier"] else "")
        )
    found = result.friction_set
    lines += ["", "Fitted (value +- half-width of the linearised 95 % interval)", *friction_set_lines(found)]
    for name, ends in found.limits.items():
        scale, unit = (1e9, " nm") if name == "roughness_height" else (1.0, "")
        lines.append(
            f"    95 % by profile: {name} {scale * ends['low']:.4g} to {scale * ends['high']:.4g}{unit}"
        )
    lines.append(f"    condition number of the scaled derivatives: {result.condition:.3g}")
    if result.spread is not None:
        advice = spread_advice(result.spread, repeat_scatter(result.basis.measurements))
        lines.append(
            f"    errors over stated uncertainties: {result.spread:.2g} (about 1 expected){advice and f': {advice}'}"
        )
    if found.not_identified:
        lines.append("Not identified by these data:")
        lines += [f"    {name}: {why}" for name, why in found.not_identified.items()]
    else:
        lines.append(
            f"Identified by these data: every parameter to {100.0 * PRECISION:.0f} %, the "
            f"{share_name(result.basis)} to {100.0 * SPLIT_WIDTH:.0f} points of per cent"
        )
    lines += [f"dropped: {problem}" for problem in result.dropped]
    lines += [f"note: {note}" for note in result.notes]
    return "\n".join(lines)
