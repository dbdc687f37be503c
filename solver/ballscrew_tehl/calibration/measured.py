"""Calibration: a friction set from a file of measured torques, its points by the contacts of the screw or a map."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from .._version import __version__
from ..atlas.ball_contacts import BallContacts
from ..atlas.contact_atlas import OutsideAtlasError
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
from .measurement_file import RowProblem, implausible_for, named_rows, read_measurement_file
from .measurements import Measurement, repeat_notes, repeats_of
from .one_point import check_level
from .result import TRANSFER, Calibration, not_identified, number_notes, outlier_text

#: kinds of rows that --drop leaves out of a fit
DROPS = ("impossible", "outside", "outliers")
#: degrees of freedom below which a note says that intervals are rough;  most rows listed in one message
FEW_DEGREES, NAMED_ROWS = 3, 8


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

    if unknown := set(drop) - set(DROPS):
        raise ValueError(f"drop = {', '.join(sorted(unknown))}; allowed: {', '.join(DROPS)}")
    parameters = parameters_for(map_file, parameters)
    name = name or parameters.friction.law
    with_set(parameters, name)
    if temperature is None:
        temperature = parameters.lubricant.reference_temperature
    file = read_measurement_file(measurements, temperature)
    points, notes = file.measurements, list(file.notes)
    if seals := parameters.screw.seal_torque:
        points = [m.without_seals(seals) for m in points]
        notes.append(f"seal_torque = {seals:g} N.m subtracted from all torques")
    film, outside = film_of(name, parameters, map_file)

    def problems(reason_of: Callable[[Measurement], str]) -> list[RowProblem]:
        return [problem for m in points for problem in file.problems_of(m, reason_of(m))]

    inside = [m for m in points if not outside(m)]
    if inside:
        # a wrong unit of all torques before what it makes of single rows
        check_level(inside, parameters, film, name, file.path, file.torque_unit)
    impossible = [*file.problems, *problems(lambda m: implausible_for(parameters, m))]
    impossible.sort(key=lambda problem: problem.row)
    points = [m for m in points if not implausible_for(parameters, m)]
    dropped = _dropped(file.path, "impossible row(s)", "impossible", impossible, drop, len(points))
    beyond, points = problems(outside), [m for m in points if not outside(m)]
    dropped += _dropped(file.path, "row(s) outside the map", "outside", beyond, drop, len(points))
    notes += [*repeat_notes(points, file.lines), *_check_count(points, name)]
    basis = replace(torque_basis(parameters, film, points, progress), names=SETS[name])
    found = fit(basis, repeats_of(points))
    if "outliers" in drop and not found.outliers:
        notes.append("--drop outliers: there are none, every point is in the fit")
    elif "outliers" in drop:
        # one pass; outliers of the remaining points are reported and kept
        for i in found.outliers:
            dropped += file.problems_of(points[i], f"outlier: {outlier_text(basis, found, i)}")
        basis = basis.subset([i for i in range(len(basis)) if i not in found.outliers])
        notes += _check_count(basis.measurements, name)
        found = fit(basis, repeats_of(basis.measurements))
    without = f", without {named_rows([problem.row for problem in dropped])}" if dropped else ""
    provenance = (
        f"{file.path.name} (SHA-256 {file.digest}), {len(basis)} points of {len(file.lines)} rows{without}, "
        f"ballscrew_tehl {__version__}"
    )
    ratio, net, height = found.values.tolist()
    friction_set = FrictionSet(
        Law(name), ratio, net, height, loss="least_squares",
        provenance=provenance, intervals=found.half_width, limits=found.limits,
        errors=error_summary(basis, found.deviation, found.left_out),
        not_identified=not_identified(basis, found),
        screw=parameters.name, parameters_hash=parameters_hash(parameters),
    )  # fmt: skip
    notes += [*number_notes(friction_set, parameters), *_point_notes(basis, found)]
    notes += [TRANSFER] * (name == MECHANISTIC)
    return Calibration(friction_set, basis, found, dropped, notes)


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


def _dropped(
    path: Path, what: str, kind: str, problems: list[RowProblem], drop: Collection[str], left: int
) -> list[RowProblem]:
    """The problems, if they may be dropped.

    Parameters   what : `impossible row(s)`;  kind : in drop if they may;  left : usable points without them
    Raises       ValueError: they may not, or no row is left
    """
    if not problems or (kind in drop and left > 0):
        return problems
    remedy = "fix them"
    if kind in drop:
        what = f"{what}, no row is left"
    else:
        remedy = f"fix or remove them, or continue without them: --drop {kind}"
    shown = " | ".join(map(str, problems[:NAMED_ROWS]))
    more = f" | and {len(problems) - NAMED_ROWS} more" if len(problems) > NAMED_ROWS else ""
    raise ValueError(f"{path}: {len(problems)} {what}: {shown}{more}; {remedy}")


def _check_count(points: Sequence[Measurement], name: str) -> list[str]:
    """Warnings about few points.

    Raises       ValueError: fewer distinct operating points than fitted parameters
    """
    count, distinct = len(SETS[name]), len(repeats_of(points))
    plural = "s" * (count > 1)
    if distinct < count or len(points) <= count:
        remedy = ", or give the only one as --torque-nm and its operating point"
        if name == "three_parameter" and len(points) == count and distinct >= count - 1:
            remedy = ", or fit --set two_parameter"
        raise ValueError(
            f"usable rows: {len(points)}, different operating points: {distinct}; the {count} parameter{plural} of "
            f"{name} need at least {count + 1} rows at {count} operating point{plural}: measure more"
            f"{remedy if len(points) == count else ''}"
        )
    notes = []
    if (freedom := len(points) - count) < FEW_DEGREES:
        notes.append(
            f"{len(points)} rows for {count} parameter{plural}: {freedom} degree(s) of freedom, intervals and errors "
            "are rough"
        )
    if distinct == count:
        notes.append(
            f"{count} operating points for {count} parameters: no point is left to check the shape of the torque"
        )
    return notes


def _point_notes(basis: TorqueBasis, found: Fit) -> list[str]:
    """Outliers that were kept, and points that no other point checks."""
    points = basis.measurements
    notes = [
        f"{points[i].point}: outlier, kept: {outlier_text(basis, found, i)}; to leave it out: --drop outliers"
        for i in found.outliers
    ]
    if unchecked := [points[i].point for i in np.flatnonzero(found.leverage > MAX_LEVERAGE)]:
        notes.append(
            f"{', '.join(unchecked)}: no other point checks it (leverage {found.leverage.max():.2f})"
        )
    return notes


def film_of(
    name: str, parameters: Parameters, map_file: Path | str | None
) -> tuple[FilmModel | ContactValues, Callable[[Measurement], str]]:
    """Film model of a set, or contacts of the mechanistic law; why a point is outside the map, "" if it is not."""
    if map_file is None:
        return solved_film(name, parameters), lambda m: ""
    from ..nut_map.file import load_map

    axes = load_map(map_file, parameters).header["axes"]

    def outside(m: Measurement) -> str:
        forces = [force for force in nut_forces(parameters, m.preload, m.axial_load) if force > 0.0]
        found = []
        for what, unit, axis, factor, values in (
            ("force of a nut", "N", "force", 1.0, forces),
            ("speed", "r/min", "speed", RPM, [m.speed]),
            ("temperature", "K", "temperature", 1.0, [m.temperature]),
        ):
            low, high = axes[axis][:2]
            # a value on the edge of the map may be off by rounding
            if not all(low * (1.0 - 1e-9) <= value <= high * (1.0 + 1e-9) for value in values):
                shown = ", ".join(f"{value / factor:.6g}" for value in dict.fromkeys(values))
                found.append(
                    f"{what} = {shown} {unit}; allowed: {low / factor:.6g} to {high / factor:.6g} {unit}"
                )
        return "; ".join(found)

    if name == MECHANISTIC:
        return solved_film(name, parameters), outside
    return MapFilm(load_map(map_file, with_set(parameters, name)), parameters), outside


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
