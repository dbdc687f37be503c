"""Friction sets from measured torques: fit, 95 % intervals, correlations, leave-one-out errors, provenance.

The torque is linear in the apparent viscosity ratio and in the net sliding coefficient, and the film does not
change during a fit. So each operating point is solved once, and a fit takes milliseconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import TypeVar, cast

import numpy as np
from scipy.stats import t as student_t

from .. import __version__
from ..friction.mechanistic import UNLOADED_POWERS, ContactValues, NutPowers, nut_powers
from ..friction.sets import (
    FITTED,
    MECHANISTIC,
    PACKAGED_SETS,
    SETS,
    FrictionSet,
    load_friction_sets,
    write_friction_sets,
)
from ..friction.torque import UNLOADED, FilmModel, NutSums, nut_forces, nut_sums
from ..parameters.file import Parameters, changed, load_screw
from ..parameters.identity import parameters_hash
from ..parameters.packaged_data import PACKAGED_VG100
from ..physics.load import nut_loads
from .diagnostics import free_parameters, profile_limits
from .fit import LOSSES, TorqueBasis, Values, fit_values
from .measurements import Measurement, packaged_measurements
from .repeats import repeats_of

#: of one nut: NutSums or NutPowers
Nut = TypeVar("Nut")
#: called with (finished, total, what)
Progress = Callable[[int, int, str], None]
#: loss of the packaged sets; the file also has the results of the other loss. The errors of the mechanistic set are
#: above the 1 % up to which soft_l1 is a sum of squares
PACKAGED_LOSS = {"two_parameter": "soft_l1", "three_parameter": "soft_l1", "mechanistic": "least_squares"}
#: film model of the sets. The film of the thermal solve needs the roughness height: with two parameters the
#: deviation from the tables is 12 %, with three it is less than with the isothermal film of the published decomposition
FILM_OF_SET = {"two_parameter": "solved", "three_parameter": "solved_thermal", MECHANISTIC: MECHANISTIC}


def torque_basis(
    parameters: Parameters,
    film_model: FilmModel | ContactValues,
    measurements: Sequence[Measurement],
    progress: Progress = lambda finished, total, what: None,
) -> TorqueBasis:
    """Solve the operating points once: loads of the balls, films, sums.

    Parameters   film_model : films, or the contacts of the mechanistic law
                 progress : called with the number of finished points, of all points, and a text
    Raises       ValueError: a point outside the range of the film model or of the load distribution, by name
    """
    screw = parameters.screw
    if film_model.name == MECHANISTIC:
        contacts = cast(ContactValues, film_model)

        def powers(force: float, m: Measurement) -> NutPowers:
            loads = nut_loads(screw, force, screw.loaded_ball_count)
            return nut_powers(parameters, loads, m.speed, m.temperature, contacts)

        return TorqueBasis.of_powers(
            measurements, _of_nuts(parameters, contacts, measurements, powers, UNLOADED_POWERS, progress)
        )
    films = cast(FilmModel, film_model)

    def sums(force: float, m: Measurement) -> NutSums:
        return nut_sums(parameters, nut_loads(screw, force, screw.ball_count), m.speed, m.temperature, films)

    return TorqueBasis.of_nuts(
        measurements, _of_nuts(parameters, films, measurements, sums, UNLOADED, progress)
    )


def _of_nuts(
    parameters: Parameters,
    film_model: FilmModel | ContactValues,
    measurements: Sequence[Measurement],
    evaluate: Callable[[float, Measurement], Nut],
    unloaded: Nut,
    progress: Progress,
) -> list[list[Nut]]:
    """Both nuts of every point, each under its own force; one evaluation for equal forces."""
    count, found = len(measurements), []
    for number, m in enumerate(measurements):
        progress(number, count, f"operating points with {film_model.name}")
        try:
            nuts = [
                evaluate(force, m) if force > 0.0 else unloaded
                for force in dict.fromkeys(nut_forces(parameters, m.preload, m.axial_load))
            ]
        except ValueError as err:
            raise ValueError(f"{m.point}: {err}") from err
        found.append(nuts if len(nuts) == 2 else 2 * nuts)
    progress(count, count, f"operating points with {film_model.name}")
    return found


def intervals(basis: TorqueBasis, values: Values, count: int) -> tuple[dict[str, float], dict[str, float]]:
    """Half-widths of the 95 % intervals and correlations of the fitted parameters.

    Returns      intervals : parameter -> half-width (SI), inf if not determined
                 correlations : "first, second" -> -1..1, NaN if not determined
    Validity     model linear around the solution, errors independent and of equal relative size; for a loss
                 other than least_squares as if its solution were one of least squares
    Source       Student-t with n - count degrees of freedom on (J'J)^-1 r'r/(n - count)
    """
    # at height 0 the torque does not depend on it to first order
    free = free_parameters(basis, values, count)
    J = basis.jacobian(values)[:, free]
    residual = basis.errors(values)
    freedom = len(basis) - count
    norm = np.linalg.norm(J, axis=0)
    names = basis.names[:count]
    half = dict.fromkeys(names, math.inf)
    correlations = {f"{x}, {y}": math.nan for x, y in combinations(names, 2)}
    if freedom < 1 or not np.all(norm > 0.0) or not np.linalg.cond(J / norm) < 1e7:
        return half, correlations
    inverse = np.linalg.inv((J / norm).T @ (J / norm))
    spread = np.sqrt(np.diag(inverse))
    width = spread / norm * math.sqrt(residual @ residual / freedom) * student_t.ppf(0.975, freedom)
    for row, i in enumerate(free):
        half[FITTED[i]] = float(width[row])
        for column in range(row + 1, len(free)):
            pair = f"{FITTED[i]}, {FITTED[free[column]]}"
            correlations[pair] = float(inverse[row, column] / (spread[row] * spread[column]))
    return half, correlations


def _deviations(basis: TorqueBasis, values: Values) -> np.ndarray:
    """Absolute relative deviations from the measurement, without weights."""
    return np.abs(basis.torque(values) / basis.measured - 1.0)


def left_out_deviations(
    basis: TorqueBasis, count: int, loss: str, progress: Progress = lambda finished, total, what: None
) -> np.ndarray:
    """model/measured - 1 of each point by the fit to all others, without its repeats if enough points are left (n,)."""
    missed = np.empty(len(basis))
    groups = repeats_of(basis.measurements)
    if len(groups) <= count:
        groups = [[i] for i in range(len(basis))]
    for number, group in enumerate(groups):
        progress(number, len(groups), "fits without one point")
        values = fit_values(basis.subset([j for j in range(len(basis)) if j not in group]), count, loss)
        missed[group] = basis.torque(values)[group] / basis.measured[group] - 1.0
    progress(len(groups), len(groups), "fits without one point")
    return missed


def leave_one_table_out(basis: TorqueBasis, count: int, loss: str) -> dict[str, dict[str, float]]:
    """Deviation of the points that are in one table only from the fit to all other points, mean and max.

    Returns      table -> {"mean", "max"}; without the tables whose absence leaves too few points to fit
    """
    found = {}
    for name in basis.tables:
        seen = [i for i, m in enumerate(basis.measurements) if set(m.tables) - {name}]
        unseen = [i for i in range(len(basis)) if i not in seen]
        if len(seen) >= count and unseen:
            missed = _deviations(basis, fit_values(basis.subset(seen), count, loss))[unseen]
            found[name] = {"mean": float(missed.mean()), "max": float(missed.max())}
    return found


def _error_summary(basis: TorqueBasis, values: Values, left_out: np.ndarray) -> dict[str, float]:
    """Absolute deviations of the fit, and of each point from the fit to all others; left_out: left_out_deviations."""
    missed = _deviations(basis, values)
    summary = {"mean": float(missed.mean()), "max": float(missed.max())}
    for name, rows in basis.tables.items():
        if len(basis.tables) > 1:
            summary[name] = float(missed[rows].mean())
    unseen = np.abs(left_out)
    return summary | {"leave_one_out_mean": float(unseen.mean()), "leave_one_out_max": float(unseen.max())}


def check_parts_differ(basis: TorqueBasis, count: int) -> None:
    """ValueError at points at which viscous and sliding part are proportional, if a fit determines both."""
    linear = basis.jacobian((1.0, 1.0, 0.0))[:, :2]
    if count > 1 and not np.linalg.cond(linear / np.linalg.norm(linear, axis=0)) < 1e6:
        raise ValueError("viscous and sliding part are proportional at all points: measure at several speeds")


def fit_friction_set(
    basis: TorqueBasis,
    parameters: Parameters,
    film_model: str,
    name: str,
    loss: str = "least_squares",
    provenance: str = "",
    left_out: np.ndarray | None = None,
) -> FrictionSet:
    """Fit one set of friction parameters and estimate its errors.

    Parameters   basis : the points, see torque_basis;  film_model : name of its film model
                 name : of SETS, of the law of the basis;  loss : see fit
                 left_out : left_out_deviations of this fit if they are already computed
    Raises       ValueError: not more points than parameters, viscous and sliding part proportional
    """
    count = len(SETS[name])
    if len(basis) <= count:
        raise ValueError(f"{len(basis)} distinct points; {count} fitted parameters need at least {count + 1}")
    check_parts_differ(basis, count)
    values = fit_values(basis, count, loss)
    half, correlations = intervals(basis, values, count)
    ratio, net, height = (float(v) for v in values)
    if left_out is None:
        left_out = left_out_deviations(basis, count, loss)
    return FrictionSet(
        name,
        parameters.friction.kinematics,
        film_model,
        apparent_viscosity_ratio=ratio,
        net_sliding_coefficient=net,
        roughness_height=height,
        loss=loss,
        provenance=provenance,
        intervals=half,
        correlations=correlations,
        errors=_error_summary(basis, values, left_out),
        leave_one_table_out=leave_one_table_out(basis, count, loss),
        limits=profile_limits(basis, count),
        screw=parameters.name,
        parameters_hash=parameters_hash(parameters),
    )


def other_losses(basis: TorqueBasis, name: str, loss: str) -> dict[str, dict[str, float]]:
    """Values and errors of the set fitted by every loss but this one."""
    found = {}
    for other in LOSSES:
        if other != loss:
            count = len(SETS[name])
            values = fit_values(basis, count, other)
            fitted = {FITTED[i]: float(values[i]) for i in basis.fitted(count)}
            found[other] = fitted | _error_summary(basis, values, left_out_deviations(basis, count, other))
    return found


def calibrate_packaged(
    film_model: Callable[[Parameters, str], FilmModel | ContactValues],
    parameters: Parameters | None = None,
    path: Path | str | None = PACKAGED_SETS,
    progress: Callable[[str], None] = lambda text: None,
    only: str | None = None,
) -> dict[tuple[str, str], FrictionSet]:
    """Fit the packaged sets, two and three parameters of the published kinematics and the mechanistic one; write them.

    Parameters   film_model : parameters, name of the set -> film model, of the mechanistic one its contacts
                 parameters : the screw of the tables; None = the packaged one. The mechanistic set is that of the
                 packaged screw with its oil VG 100
                 path : file to write; None = write nothing
                 progress : called with the name of the next step
                 only : name of the sets to fit, the others as they are packaged; None = all
    Returns      (kinematics, name) -> FrictionSet
    Source       measurements: Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231, Tables 2 and 4
    """
    screw = load_screw() if parameters is None else parameters
    temperature = screw.lubricant.reference_temperature
    measurements = packaged_measurements(temperature)
    published = changed(screw, friction={"kinematics": "published"})
    fits = [
        (published, name, f"{screw.screw.ball_count} balls per nut", "")
        for name in ("two_parameter", "three_parameter")
    ]
    own = load_screw(PACKAGED_VG100)
    balls = f"{own.screw.loaded_ball_count} load-carrying balls per nut"
    fits.append((own, MECHANISTIC, balls, f"{own.lubricant.name}, "))
    sets = {} if only is None else load_friction_sets()
    for variant, name, balls, oil in fits:
        if only not in (None, name):
            continue
        kinematics, film = variant.friction.kinematics, film_model(variant, name)
        progress(f"{kinematics}: films of {len(measurements)} operating points with {film.name}")
        basis = torque_basis(variant, film, measurements)
        loss = PACKAGED_LOSS[name]
        progress(f"{kinematics}: {name} by {loss}")
        provenance = (
            f"Zhao et al. (2023), Tables 2 and 4, {len(measurements)} distinct points, {oil}oil at {temperature:g} K "
            f"(assumed), {balls}, ballscrew_tehl {__version__}"
        )
        found = fit_friction_set(basis, variant, film.name, name, loss, provenance)
        sets[kinematics, name] = replace(found, other_losses=other_losses(basis, name, loss))
    if path is not None:
        write_friction_sets(path, sets, HEADER)
    return sets


HEADER = """\
Friction parameters fitted to measured torques; written by `ballscrew calibrate --packaged`.
A set belongs to its kinematics and its film model. Errors are absolute relative deviations from the measured
torque; intervals are half-widths (95 %, Student-t). Losses: least_squares: sum of squared relative errors of the
distinct points. soft_l1: the same with absolute values above 1 %."""
