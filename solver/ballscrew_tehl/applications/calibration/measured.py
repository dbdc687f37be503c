"""Calibration: a friction set from measured torques, their points by the contacts of the screw or a map."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ballscrew_tehl._version import __version__
from ballscrew_tehl.friction.film_shear import double_nut_torque, nut_forces
from ballscrew_tehl.friction.interval import (
    OperatingPoint,
    TorqueInterval,
    learned,
    of_force,
    torque_interval,
)
from ballscrew_tehl.friction.mechanistic import ContactValues, double_nut_parts, mean_load
from ballscrew_tehl.friction.sets import (
    CATALOGUE,
    CATALOGUE_DIFFERS,
    SETS,
    SUPPLY,
    FrictionSet,
    check_usable,
    default_friction_set,
    refuse_other_fit,
    with_supply,
    without_overrides,
)
from ballscrew_tehl.numerics import Array
from ballscrew_tehl.nut_map.grid import Progress
from ballscrew_tehl.parameters.file import Law, Parameters
from ballscrew_tehl.parameters.friction import ball_ball_coefficient
from ballscrew_tehl.parameters.identity import parameters_hash
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.physics.rating import nsk_torque
from ballscrew_tehl.refinement.contacts import contacts_of
from ballscrew_tehl.runtime.evaluate import NutMap

from ..tables.headings import TORQUE
from .fit import INVERSE_SUPPLY, Fit, TorqueBasis, fit_law, torque_basis
from .measurements import (
    Measurement,
    MeasurementFile,
    RowProblem,
    implausible_for,
    named_rows,
    read_measurement_file,
    repeats_of,
)
from .result import SPLIT, Calibration, not_identified, number_notes, supply_notes

#: kinds of rows that --drop leaves out of a fit
DROPS = ("impossible", "outside", "outliers")
#: degrees of freedom below which a note says that intervals are rough;  most rows listed in one message
FEW_DEGREES, NAMED_ROWS = 3, 8
#: units that are suggested for a torque in another one
SUGGESTED = ("N.m", "N.cm", "N.mm", "kgf.cm", "lbf.in", "ozf.in")
#: most that a torque may be above the interval of the law, or below it, as a factor
MAX_FACTOR = 3.0
#: remedy where a torque is far from the law
CHECK = (
    "check unit, preload, oil (viscosity, temperature), its supply and what was subtracted from the torque"
)
ONE_POINT = (
    "one point identifies the level of the torque only: no left-out error, no limits of the coefficient"
)
HELD = (
    "the interval of the torque is narrow at this point and wider away from it, where the bounded constants have other "
    "effects; scatter as of the packaged fit"
)
EXACT = (
    "the torque counts as measured on this screw, to 2 %: one of a catalogue or a sheet has a tolerance, 20 to 50 % by "
    "ISO 3408-3: state it by --torque-tolerance-percent"
)
TOLERATED = "tolerances are in the interval of the torque, not in the limits of the fitted numbers"

#: why a point cannot be used; "": it can
Reason = Callable[[Measurement], str]


def calibrate(
    measurements: Path | str | Measurement,
    parameters: Parameters | None = None,
    map_file: Path | str | None = None,
    *,
    temperature: float | None = None,
    drop: Collection[str] = (),
    torque_tolerance: float = 0.0,
    preload_tolerance: float = 0.0,
    progress: Progress = lambda finished, total, what: None,
) -> Calibration:
    """Fit the friction numbers of a screw to measured torques by least squares, to a single one exactly.

    Parameters
    ----------
    measurements : path, str or Measurement
        CSV file, headings with units: preload [N], speed [r/min], torque [N.m], ...; or a single torque.
    parameters : Parameters, optional
        Screw and oil (load_screw); None: those of the map file, or the packaged GD4008-3.
    map_file : path or str, optional
        Map of this screw; None: contacts of the atlas; those beyond it are solved, seconds a point.
    temperature : float, optional
        Of rows without one [K]; None: reference temperature of the oil.
    drop : collection of str, optional
        Kinds of rows to leave out, of DROPS.
    torque_tolerance, preload_tolerance : float, optional
        As fractions, of all rows that state none: 0.25 of a sheet's +-25 %. One error common to all rows, in the
        interval (friction.interval).
    progress : callable, optional
        Called while points are computed.

    Returns
    -------
    Calibration
        Result; load_map(map_file, parameters, calibration.friction_set) takes its numbers.

    Raises
    ------
    ValueError
        Names file and row; rows that cannot be used and may not be dropped; too few points;
        torques far from the law; viscous and sliding part proportional at all points; numbers that no file may have.

    Examples
    --------
    >>> from ballscrew_tehl import calibrate, load_screw
    >>> from ballscrew_tehl.applications.calibration.measurements import Measurement
    >>> result = calibrate(Measurement(2000.0, 104.7, 303.15, 0.8), load_screw("gd4008_vg100.toml"))
    >>> f"{result.friction_set.net_sliding_coefficient:.4f}"
    '0.0056'
    """
    from ballscrew_tehl.nut_map.load import parameters_for

    if unknown := set(drop) - set(DROPS):
        raise ValueError(f"drop = {', '.join(sorted(unknown))}; allowed: {', '.join(DROPS)}")
    parameters = parameters_for(map_file, parameters)
    if isinstance(measurements, Measurement):
        file = MeasurementFile.of_point(measurements)
    else:
        reference = parameters.lubricant.reference_temperature
        file = read_measurement_file(measurements, reference if temperature is None else temperature)
    file = file.with_tolerances(torque_tolerance, preload_tolerance)
    result = _calibration(file, parameters, *film_of(parameters, map_file), drop, progress)
    # what would be refused where the set is used
    where = "--torque-nm" if isinstance(measurements, Measurement) else str(measurements)
    check_usable(result.friction_set, parameters, where, "check the units of torque and preload")
    refuse_other_fit(result.friction_set, parameters)
    return result


def calibrate_point(m: Measurement, parameters: Parameters, contacts: ContactValues) -> Calibration:
    """Calibration on a single torque without axial load.

    Parameters
    ----------
    m : Measurement
        The torque.
    parameters : Parameters
        Screw and oil.
    contacts : ContactValues
        Contacts of the balls.

    Returns
    -------
    Calibration
        As of calibrate.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> screw, point = load_screw("gd4008_vg100.toml"), Measurement(2000.0, 104.7, 303.15, 0.8)
    >>> f"{calibrate_point(point, screw, solved_film(screw)).friction_set.net_sliding_coefficient:.4f}"
    '0.0056'
    """
    return _calibration(MeasurementFile.of_point(m), parameters, contacts)


def _calibration(
    file: MeasurementFile, parameters: Parameters, film: Any,
    outside: Reason = lambda m: "", drop: Collection[str] = (),
    progress: Progress = lambda finished, total, what: None,
) -> Calibration:  # fmt: skip
    name = parameters.friction.law
    if parameters.screw.spacer_balls and name == Law.MECHANISTIC:
        raise ValueError(
            "spacer_balls = true; between them nothing slides, so there is no number to fit: compare the torque with "
            "the interval of ballscrew torque, and where it lies outside state supply_length or "
            "limiting_shear_coefficient in the screw file"
        )
    if seals := parameters.screw.seal_torque:
        file = file.without_seals(seals)
    single = (
        name == Law.MECHANISTIC and not file.problems and [m.axial_load for m in file.measurements] == [0.0]
    )
    law = _typical_law(file, parameters, film, outside)
    kinds: dict[str, Reason] = {"impossible": partial(implausible_for, parameters), "outside": outside}
    points, dropped = _usable(file, kinds, drop)
    notes = file.notes + ([] if single else _check_count(points, name))
    basis = replace(torque_basis(parameters, film, points, progress), names=SETS[name])
    defaults = parameters, default_friction_set(parameters).net_sliding_coefficient
    fitted, result = fit_law(basis, repeats_of(points), *defaults)
    if "outliers" in drop and result.outliers:
        # one pass; outliers of the remaining points are reported and kept
        for i, text in _outliers(points, result).items():
            dropped += file.problems_of(points[i], text)
        kept = [i for i in range(len(basis)) if i not in result.outliers]
        points, basis = [points[i] for i in kept], basis.subset(kept)
        notes += _check_count(points, name)
        fitted, result = fit_law(basis, repeats_of(points), *defaults)
    basis = fitted
    level: dict[str, float] = {}
    if single:
        (m,), remainder = points, float(basis.torque((1.0, 0.0, 0.0))[0])
        _check_level(m, law, file.where, rest=remainder)
        level = {"without_ball_ball_nm": remainder, "law_low_nm": law.low, "law_high_nm": law.high}
        statistics: dict[str, Any] = {
            "loss": "solved", "not_identified": {SPLIT: ONE_POINT},
            "provenance": f"{file.source or 'one torque'}, {m.torque:g} N.m at {m.preload:g} N, "
            f"{m.speed / RPM:g} r/min, {m.temperature - CELSIUS:g} C",
        }  # fmt: skip
        catalogue = float(nsk_torque(parameters.screw, m.preload))
        if not law.low <= m.torque <= law.high:
            span = f"{law.low:.4g} to {law.high:.4g} N.m"
            notes.append(
                f"torque = {m.torque:.6g} N.m is outside the interval of the law without it, {span}: {CHECK}"
            )
        notes += [HELD] + [EXACT] * (not m.limits and not m.uncertainty)
        notes += [f"catalogue torque ({CATALOGUE}) {catalogue:.3g} N.m: {CATALOGUE_DIFFERS}"]
    else:
        others = len(repeats_of(points)) > len(basis.names)
        without = f", without {named_rows([problem.row for problem in dropped])}" if dropped else ""
        statistics = {
            "loss": "least_squares", "intervals": result.half_width, "limits": result.limits,
            "provenance": f"{file.source}, {len(basis)} points of {len(file.lines)} rows{without}",
            # without other points none is left out, but repeats
            "errors": error_summary(basis, result.deviation, result.left_out if others else np.full(1, math.nan)),
            "not_identified": not_identified(basis, result),
        }  # fmt: skip
        outliers = _outliers(points, result).items()
        notes += [f"{points[i].point}: {text}; to leave it out: --drop outliers" for i, text in outliers]
    if any(m.limits or m.preload_tolerance for m in points):
        notes.append(
            TOLERATED if name == Law.MECHANISTIC else f"tolerances are not used: {name} has no interval"
        )
        statistics["provenance"] += ", with tolerances"
    statistics["provenance"] += f", ballscrew_tehl {__version__}"
    statistics |= {"screw": parameters.name, "parameters_hash": parameters_hash(parameters)}
    if name == Law.MECHANISTIC:
        statistics["screw_hash"] = parameters_hash(parameters, oil=False)
        statistics["nlgi"] = parameters.lubricant.nlgi or ""
    ratio, net, height = result.values.tolist()
    if INVERSE_SUPPLY in basis.names:
        statistics[SUPPLY], height = 1.0 / height if height > 0.0 else math.inf, 0.0
    friction_set = FrictionSet(name, ratio, net, height, **statistics)
    if name == Law.MECHANISTIC:
        friction_set = with_learned(friction_set, basis, result.deviation, parameters, film)
    notes += number_notes(friction_set, parameters)
    notes += supply_notes(basis, result, parameters)
    return Calibration(friction_set, basis, result, dropped, notes, level, parameters, film)


def with_learned(
    entry: FrictionSet, basis: TorqueBasis, deviation: Array, parameters: Parameters, contacts: ContactValues
) -> FrictionSet:
    """A set of the mechanistic law with what its torques say of the constants; deviation: model/measured - 1."""
    parameters = with_supply(parameters, entry)
    measured = basis.measurements

    def points(side: float) -> list[OperatingPoint]:
        preloads = [m.preload * (1.0 + side * m.preload_tolerance) for m in measured]
        others = [(m.speed, m.temperature, m.axial_load) for m in measured]
        return [OperatingPoint(force, *at) for force, at in zip(preloads, others, strict=True)]

    def level(side: float) -> Array:
        at = [(p.forces(parameters), contacts, p.speed, p.temperature) for p in points(side)]
        return np.log([double_nut_parts(parameters, *each, *entry.values[:2]).total for each in at])

    ends = np.log([m.limits or (m.torque, m.torque) for m in measured]).T - np.log(basis.measured)
    tolerances = [ends] if np.any(ends) else []
    if any(m.preload_tolerance for m in measured):
        # with a larger preload the law has more, and the torque is less over it
        tolerances.append(level(0.0) - [level(1.0), level(-1.0)])
    own = np.array([(m.uncertainty or 0.0) / m.torque for m in measured])
    errors = -np.log1p(deviation)
    result = learned(parameters, points(0.0), errors, basis.weights, contacts, entry, own, tolerances)
    return replace(entry, learned=result)


def _typical_law(file: MeasurementFile, parameters: Parameters, film: Any, outside: Reason) -> TorqueInterval:
    """Torque of the unfitted law, without overrides, at the point with the median torque over preload, as checked.

    With the interval of the mechanistic law, of another one the torque alone; NaN if all points are outside.
    """
    name = parameters.friction.law
    own = without_overrides(parameters, name)
    inside = sorted((m for m in file.measurements if not outside(m)), key=lambda m: m.torque / m.preload)
    if not inside:
        return TorqueInterval(math.nan, math.nan, math.nan, {}, {})
    m = inside[(len(inside) - 1) // 2]
    if name is Law.MECHANISTIC:
        unfitted = FrictionSet(name, 1.0, ball_ball_coefficient(own.friction, own.friction.ball_thrust))
        point = OperatingPoint(m.preload, m.speed, m.temperature, m.axial_load)
        law = torque_interval(of_force(own, unfitted), point, film, unfitted)
    else:
        at = m.preload, m.speed, m.temperature, m.axial_load
        torque = double_nut_torque(own, default_friction_set(own), film, *at).total
        law = TorqueInterval(torque, torque, torque, {}, {})
    typical = f"{m.point}, typical of {len(inside)} rows: " if len(inside) > 1 else ""
    _check_level(m, law, f"{file.where}{typical}", file.torque_unit)
    return law


def _check_level(
    m: Measurement, law: TorqueInterval, where: str, unit: str = "N.m", rest: float = 0.0
) -> None:
    """ValueError if the law cannot give the torque of a point, or hardly does, with the unit that was probably meant.

    unit: as it was written; rest: torque without friction between balls [N.m], 0: does not bound it
    """
    low, high = max(rest, law.low / MAX_FACTOR), MAX_FACTOR * law.high
    if low <= m.torque <= high:
        return
    # the unit that brings it nearest to the law
    written = m.torque / TORQUE[unit][0]
    meant = {other: written * TORQUE[other][0] for other in SUGGESTED}
    nearest = min(meant, key=lambda other: max(meant[other] / law.torque, law.torque / meant[other]))
    remedy = CHECK
    if low <= meant[nearest] <= high and nearest != unit:
        remedy = f"is {written:.6g} {nearest} = {meant[nearest]:.4g} N.m meant?"
    without = f", without friction between balls {rest:.4g} N.m" if rest else ""
    raise ValueError(
        f"{where}torque = {m.torque:.6g} N.m, {m.torque / law.torque:.3g} times that of the law; allowed: {low:.4g} to "
        f"{high:.4g} N.m. Its interval is {law.low:.4g} to {law.high:.4g} N.m there{without}: {remedy}"
    )


def _usable(
    file: MeasurementFile, kinds: Mapping[str, Reason], drop: Collection[str]
) -> tuple[list[Measurement], list[RowProblem]]:
    """Points without the kinds of rows that cannot be used, and these rows; ValueError: they may not be dropped."""
    points, dropped = file.measurements, list[RowProblem]()
    for kind, reason_of in kinds.items():
        problems = [each for m in points for each in file.problems_of(m, reason_of(m))]
        problems = sorted(problems + file.problems * (kind == "impossible"))
        points = [m for m in points if not reason_of(m)]
        dropped += problems
        if not problems or (kind in drop and points):
            continue
        if not file.where:
            raise ValueError(problems[0].reason + "; remedy: a larger map, or none" * (kind == "outside"))
        shown = " | ".join(map(str, problems[:NAMED_ROWS]))
        more = f" | and {len(problems) - NAMED_ROWS} more" if len(problems) > NAMED_ROWS else ""
        remedy = f"fix or remove them, or continue without them: --drop {kind}"
        remedy = "no row is left" if kind in drop else remedy
        raise ValueError(f"{file.where}{len(problems)} {kind} row(s): {shown}{more}; {remedy}")
    return points, dropped


def _outliers(points: Sequence[Measurement], found: Fit) -> dict[int, str]:
    """Torque, deviation and residual of the outliers by number."""
    return {
        i: f"outlier: torque {points[i].torque:.4g} N.m, model {100.0 * found.deviation[i]:+.1f} %, deleted "
        f"studentised residual {found.studentised[i]:.1f} (limit {found.limit:.1f})"
        for i in found.outliers
    }


def error_summary(basis: TorqueBasis, deviation: Array, left_out: Array) -> dict[str, float]:
    """Mean and largest |model/measured - 1|, mean of each table, and of points left out of the fit."""
    errors, unseen = np.abs(deviation), np.abs(left_out[np.isfinite(left_out)])
    summary = {"mean": float(errors.mean()), "max": float(errors.max())}
    of_points = [m.tables or ("all",) for m in basis.measurements]
    tables = dict.fromkeys(table for names in of_points for table in names)
    for table in tables if len(tables) > 1 else ():
        summary[table] = float(errors[[table in names for names in of_points]].mean())
    if unseen.size:
        summary |= {"leave_one_out_mean": float(unseen.mean()), "leave_one_out_max": float(unseen.max())}
    return summary


def _check_count(points: Sequence[Measurement], name: str) -> list[str]:
    """A note about few points; ValueError: fewer rows or operating points than the parameters need."""
    count, distinct, rows = len(SETS[name]), len(repeats_of(points)), len(points)
    if distinct < count or rows <= count:
        raise ValueError(
            f"usable rows: {rows}, different operating points: {distinct}; {name} has {count} parameter(s) and needs "
            f"at least {count + 1} rows at {count} operating point(s): measure more"
        )
    if rows - count >= FEW_DEGREES and distinct > count:
        return []
    return [
        f"{rows} rows at {distinct} operating point(s) for {count} parameter(s): intervals and errors are rough"
    ]


def film_of(parameters: Parameters, map_file: Path | str | None) -> tuple[Any, Reason]:
    """FilmModel of a set, or ContactValues of the mechanistic law, and why a point is outside the map."""
    if map_file is None:
        return solved_film(parameters), lambda m: ""
    from ballscrew_tehl.nut_map.load import load_map

    nut_map = load_map(map_file, parameters)

    def outside(m: Measurement) -> str:
        forces = [force for force in nut_forces(parameters, m.preload, m.axial_load) if force > 0.0]
        problems = []
        for axis, unit, factor, values in (
            ("force of a nut", "N", 1.0, forces), ("speed", "r/min", RPM, [m.speed]),
            ("temperature", "K", 1.0, [m.temperature]),
        ):  # fmt: skip
            low, high = nut_map.header["axes"][axis.split()[0]][:2]
            # a value on the edge of the map may be off by rounding
            if not all(low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9) for value in values):
                shown = ", ".join(f"{value / factor:.6g}" for value in dict.fromkeys(values))
                allowed = f"{low / factor:.6g} to {high / factor:.6g} {unit}"
                problems.append(f"outside the map: {axis} = {shown} {unit}; allowed: {allowed}")
        return "; ".join(problems)

    mechanistic = parameters.friction.law is Law.MECHANISTIC
    return solved_film(parameters) if mechanistic else MapFilm(nut_map, parameters), outside


class MapFilm:
    """Films of balls by the law of the paper, from the effective films of a nut in its map (FilmModel).

    The effective film of a nut is that of its mean ball but for the square of the spread of the loads.
    """

    def __init__(self, nut_map: NutMap, parameters: Parameters) -> None:
        self.nut_map, screw = nut_map, parameters.screw
        self._force = np.geomspace(*nut_map.header["axes"]["force"])
        self._load = np.array([mean_load(nut_loads(screw, float(f), screw.ball_count)) for f in self._force])

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        """Central film [m] of balls with load (n,) [N] at speed [rad/s] and temperature [K]."""
        force = np.exp(np.interp(np.log(load), np.log(self._load), np.log(self._force)))
        film = 2 + RACEWAYS.index(raceway)
        return np.exp(self.nut_map.surfaces(force, speed, temperature)[film])


def solved_film(parameters: Parameters) -> Any:
    """FilmModel of the law of the paper, solved, or ContactValues of the mechanistic law, of the atlas if it can."""
    if parameters.friction.law is Law.MECHANISTIC:
        return contacts_of(parameters)
    from ballscrew_tehl.refinement.direct import DirectFilm

    return DirectFilm(parameters)
