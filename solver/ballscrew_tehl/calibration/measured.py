"""Calibration: a friction set from a file of measured torques, its points by the contacts of the screw or a map."""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from .._version import __version__
from ..atlas.ball_contacts import BallContacts
from ..atlas.contact_atlas import OutsideAtlasError
from ..friction.interval import implied_thrust
from ..friction.mechanistic import ContactValues, mean_load
from ..friction.sets import SETS, FrictionSet, with_set
from ..friction.torque import FilmModel, nut_forces
from ..nut_map.built import Progress
from ..parameters.file import Law, Parameters
from ..parameters.identity import parameters_hash
from ..parameters.units import RPM
from ..physics.ball_law import Array
from ..physics.hertz import RACEWAYS
from ..physics.load import nut_loads
from ..runtime.evaluate import NutMap
from ..runtime.packed import MECHANISTIC
from .fit import MAX_LEVERAGE, Fit, TorqueBasis, fit, torque_basis
from .level import check_level
from .measurement_file import (
    MeasurementFile,
    RowProblem,
    implausible_for,
    named_rows,
    read_measurement_file,
)
from .measurements import Measurement, repeat_notes, repeats_of
from .result import Calibration, not_identified, outlier_text

#: set -> its film model, or contacts of the mechanistic law
Films = Callable[[str], FilmModel | ContactValues]
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


def calibrate(
    measurements: Path | str,
    parameters: Parameters | None = None,
    map_file: Path | str | None = None,
    *,
    name: str | None = None,
    temperature: float | None = None,
    drop: Collection[str] = (),
    progress: Progress = lambda finished, total, what: None,
) -> Calibration:
    """Fit the friction numbers of a screw to measured torques by least squares.

    Parameters   measurements : CSV file, headings with units: preload [N], speed [r/min], torque [N.m], ...
                 parameters : screw and oil (load_screw); None = those of the map file, or the packaged GD4008-3
                 map_file : map of this screw, None = of the atlas; what that does not hold is solved, seconds a point
                 name : friction set to fit; None = that of the screw
                 temperature : of rows without one [K]; None = reference temperature of the oil
                 drop : kinds of rows to leave out, of DROPS;  progress : called while points are computed
    Returns      Calibration; load_map(map_file, parameters, calibration.friction_set) takes its numbers
    Raises       ValueError: names file and row; a set of another law; rows that cannot be used and may not be
                 dropped; too few points; viscous and sliding part proportional at all points
    """
    from ..nut_map.file import parameters_for

    parameters = parameters_for(map_file, parameters)
    name = name or parameters.friction.law
    with_set(parameters, name)
    if temperature is None:
        temperature = parameters.lubricant.reference_temperature
    file = read_measurement_file(measurements, temperature)
    if seals := parameters.screw.seal_torque:
        file = replace(
            file,
            measurements=[m.without_seals(seals) for m in file.measurements],
            notes=[*file.notes, f"seal_torque = {seals:g} N.m subtracted from all torques"],
        )
    films, outside = films_of(parameters, map_file)
    points, dropped = usable_points(file, parameters, drop, outside)
    notes = [*file.notes, *repeat_notes(points, file.lines), *_check_count(points, name)]
    film = films(name)
    check_level(points, parameters, film, name, file)
    basis = replace(torque_basis(parameters, film, points, progress), names=SETS[name])
    found = fit(basis, repeats_of(points))
    if "outliers" in drop and not found.outliers:
        notes.append(NO_OUTLIERS)
    elif "outliers" in drop:
        # one pass; outliers of the remaining points are reported and kept
        for i in found.outliers:
            dropped += file.problems_of(points[i], f"outlier: {outlier_text(basis, found, i)}")
        basis = basis.subset([i for i in range(len(basis)) if i not in found.outliers])
        notes += _check_count(list(basis.measurements), name)
        found = fit(basis, repeats_of(basis.measurements))
    friction_set = fitted_set(basis, found, parameters, name, _provenance(file, basis, dropped))
    notes += [*number_notes(friction_set, parameters), *_point_notes(basis, found)]
    if name == MECHANISTIC:
        notes.append(TRANSFER)
    return Calibration(friction_set, basis, found, dropped, notes, _spread(basis, found))


def fitted_set(
    basis: TorqueBasis, found: Fit, parameters: Parameters, name: str, provenance: str
) -> FrictionSet:
    """Friction set of a fit: values, intervals, errors, what is not identified."""
    ratio, net, height = found.values.tolist()
    return FrictionSet(
        Law(name), ratio, net, height, loss="least_squares",
        provenance=provenance, intervals=found.half_width, limits=found.limits,
        errors=error_summary(basis, found.deviation, found.left_out),
        not_identified=not_identified(basis, found),
        screw=parameters.name, parameters_hash=parameters_hash(parameters),
    )  # fmt: skip


def error_summary(basis: TorqueBasis, deviation: Array, left_out: Array) -> dict[str, float]:
    """Mean and largest |model/measured - 1|, mean of each table, and of points left out of the fit."""
    errors, unseen = np.abs(deviation), np.abs(left_out[np.isfinite(left_out)])
    summary = {"mean": float(errors.mean()), "max": float(errors.max())}
    tables = list(dict.fromkeys(table for m in basis.measurements for table in m.tables or ("all",)))
    for table in tables if len(tables) > 1 else ():
        inside = [table in (m.tables or ("all",)) for m in basis.measurements]
        summary[table] = float(errors[inside].mean())
    if unseen.size:
        summary |= {"leave_one_out_mean": float(unseen.mean()), "leave_one_out_max": float(unseen.max())}
    return summary


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
    points, implausible = _separated(file, file.measurements, lambda m: implausible_for(parameters, m))
    impossible = sorted([*file.problems, *implausible], key=lambda problem: problem.row)
    dropped = file.dropped("impossible row(s)", "impossible", impossible, drop, len(points))
    points, beyond = _separated(file, points, outside)
    return points, dropped + file.dropped("row(s) outside the map", "outside", beyond, drop, len(points))


def _separated(
    file: MeasurementFile, points: Sequence[Measurement], reason_of: Callable[[Measurement], str]
) -> tuple[list[Measurement], list[RowProblem]]:
    """Points without a reason against them, and the rows of the others."""
    reasons = [(m, reason_of(m)) for m in points]
    problems = [problem for m, reason in reasons if reason for problem in file.problems_of(m, reason)]
    return [m for m, reason in reasons if not reason], problems


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


def _provenance(file: MeasurementFile, basis: TorqueBasis, dropped: Sequence[RowProblem]) -> str:
    without = f", without {named_rows([problem.row for problem in dropped])}" if dropped else ""
    return (
        f"{file.path.name} (SHA-256 {file.digest}), {len(basis)} points of {len(file.lines)} rows{without}, "
        f"ballscrew_tehl {__version__}"
    )


def _point_notes(basis: TorqueBasis, found: Fit) -> list[str]:
    """Outliers that were kept, and points that no other point checks."""
    notes = [
        f"{basis.measurements[i].point}: outlier, kept: {outlier_text(basis, found, i)}; "
        "to leave it out: --drop outliers"
        for i in found.outliers
    ]
    if unchecked := [basis.measurements[i].point for i in np.flatnonzero(found.leverage > MAX_LEVERAGE)]:
        notes.append(
            f"{', '.join(unchecked)}: no other point checks it (leverage {found.leverage.max():.2f})"
        )
    return notes


def _spread(basis: TorqueBasis, found: Fit) -> float | None:
    stated = [m.uncertainty for m in basis.measurements]
    if not all(stated):
        return None
    over = found.deviation * basis.measured / np.array(stated, dtype=float)
    return math.sqrt(float(over @ over) / (len(basis) - len(basis.names)))


def films_of(
    parameters: Parameters, map_file: Path | str | None
) -> tuple[Films, Callable[[Measurement], str]]:
    """Film models or contacts by set, and why a point is outside the map, "" if it is not."""
    if map_file is None:
        return lambda name: solved_film(name, parameters), lambda m: ""
    from ..nut_map.file import load_map

    axes = load_map(map_file, parameters).header["axes"]

    def outside(m: Measurement) -> str:
        forces = [force for force in nut_forces(parameters, m.preload, m.axial_load) if force > 0.0]
        checks = (
            ("force of a nut", "N", "force", 1.0, forces),
            ("speed", "r/min", "speed", RPM, [m.speed]),
            ("temperature", "K", "temperature", 1.0, [m.temperature]),
        )
        found = []
        for what, unit, axis, factor, values in checks:
            low, high = axes[axis][:2]
            # a value on the edge of the map may be off by rounding
            if not all(low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9) for value in values):
                shown = ", ".join(f"{value / factor:.6g}" for value in dict.fromkeys(values))
                found.append(
                    f"{what} = {shown} {unit}; allowed: {low / factor:.6g} to {high / factor:.6g} {unit}"
                )
        return "; ".join(found)

    def films(name: str) -> FilmModel | ContactValues:
        if name == MECHANISTIC:
            return solved_film(name, parameters)
        return MapFilm(load_map(map_file, with_set(parameters, name)), parameters)

    return films, outside


class MapFilm:
    """Films of balls by the law of the paper, from the effective films of a nut in its map (friction.torque.FilmModel).

    The effective film of a nut is that of its mean ball but for the square of the spread of the loads.
    """

    def __init__(self, nut_map: NutMap, parameters: Parameters) -> None:
        self.nut_map, self.name, screw = nut_map, str(nut_map.header["film_model"]), parameters.screw
        self._force = np.geomspace(*nut_map.header["axes"]["force"])
        self._load = np.array([mean_load(nut_loads(screw, float(f), screw.ball_count)) for f in self._force])

    def central_film(self, raceway: str, load: Array, speed: float, temperature: float) -> Array:
        """Central film [m] of balls with load (n,) [N] at speed [rad/s] and temperature [K]."""
        force = np.exp(np.interp(np.log(load), np.log(self._load), np.log(self._force)))
        film = 2 + RACEWAYS.index(raceway)
        return np.exp(self.nut_map.surfaces(force, speed, temperature)[film])


def solved_film(name: str, parameters: Parameters) -> FilmModel | ContactValues:
    """Film model of a set, by the solver, or the contacts of the mechanistic law, of the atlas if it holds them."""
    from ..refinement.direct import DirectContacts, DirectFilm

    if name == MECHANISTIC:
        try:
            return BallContacts(parameters)
        except OutsideAtlasError:
            return DirectContacts(parameters)
    return DirectFilm(parameters, Law(name).film_model == "solved_thermal")
