#!/usr/bin/env python3
"""The packaged friction sets, fitted to Tables 2 and 4 of Zhao et al. (2023).

    python examples/paper/packaged_fit.py [FILE.toml]    (half an hour: the contacts of all balls are solved)

Prints the sets with what the package does not store: correlations, and the result of the other loss. Writes FILE.toml,
which takes the place of data/friction_sets.toml in the package.

Losses of the weighted relative error r: least_squares is the sum of r^2; soft_l1 the sum of 2 s^2 (sqrt(1 + (r/s)^2) -
1), s = 1 %: squares below about 1 %, absolute values above, which limits the effect of single outliers. The errors of
the mechanistic set are above 1 %, so it takes least_squares.
"""

import math
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
from pipe_table import percent, table
from scipy.optimize import brentq, least_squares
from scipy.stats import t as student_t

from ballscrew_tehl import __version__, load_screw
from ballscrew_tehl.applications.calibration import fit
from ballscrew_tehl.applications.calibration.fit import THIRD, TorqueBasis, torque_basis
from ballscrew_tehl.applications.calibration.measured import error_summary, solved_film, with_learned
from ballscrew_tehl.applications.calibration.measured_screw import packaged_measurements
from ballscrew_tehl.applications.calibration.written_sets import friction_set_lines, write_friction_sets
from ballscrew_tehl.friction.sets import FITTED, SETS, FrictionSet
from ballscrew_tehl.parameters.file import PACKAGED_VG100, Law, Parameters
from ballscrew_tehl.parameters.identity import parameters_hash

#: losses, that of each set
LOSSES = ("least_squares", "soft_l1")
LOSS = {"three_parameter": "soft_l1", "mechanistic": "least_squares"}
#: relative error at which soft_l1 changes from squares to absolute values
SOFT_SCALE = 0.01
HEADER = """\
Friction parameters fitted to measured torques; written by examples/paper/packaged_fit.py.
A set belongs to its law. Errors are absolute relative deviations from the measured
torque; intervals are half-widths (95 %, Student-t). Losses: least_squares: sum of squared relative errors of the
distinct points. soft_l1: the same with absolute values above 1 %."""


def fit_values(basis: TorqueBasis, loss: str) -> np.ndarray:
    """Values (3,) as FITTED that minimise a loss, none negative; the loss may have several minima in the height."""
    if loss == "least_squares":
        return fit.fit_values(basis)
    free, thinnest = basis.fitted, float(basis.film.min())
    columns = np.abs(basis.jacobian((1.0, 1.0, 0.0))).mean(axis=0)
    # each part alone gives the torque; the square of the height as unknown: the torque changes linearly with it near 0
    scale = np.array([thinnest if i == THIRD else 1.0 / columns[i] for i in free])
    root = np.array([i == THIRD for i in free])

    def values(x: np.ndarray) -> np.ndarray:
        found = np.array(basis.fixed)
        found[free] = scale * np.where(root, np.sqrt(x), x)
        return found

    def slopes(x: np.ndarray) -> np.ndarray:
        inner = scale * np.where(root, 0.5 / np.sqrt(x), 1.0)
        return np.take(basis.jacobian(values(x)), free, axis=1) * inner

    solutions = []
    for start in (0.3, 1.0, 3.0) if root.any() else (1.0,):
        x = np.where(root, start**2, 0.5)
        found = least_squares(
            lambda x: basis.errors(values(x)), x, jac=slopes, bounds=(0.0, np.inf), loss=loss,
            f_scale=SOFT_SCALE, xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=2000,
        )  # fmt: skip
        if not found.success:
            raise ArithmeticError(f"fit stopped without a minimum: {found.message}")
        solutions.append(found)
    best = values(min(solutions, key=lambda found: found.cost).x)
    if root.any() and best[THIRD] < 1e-3 * thinnest:
        # the method stays inside its bounds: a negligible height is set to 0
        return fit_values(replace(basis, names=basis.names[:THIRD]), loss)
    return best


def intervals(basis: TorqueBasis, values: np.ndarray) -> tuple[dict[str, float], dict[str, float]]:
    """Half-widths of the linearised 95 % intervals, and correlations of the fitted parameters, by pair.

    For soft_l1 as if its solution were one of least squares.
    """
    free = [i for i in basis.fitted if i != THIRD or values[i] > 0.0]
    J, r, freedom = basis.jacobian(values)[:, free], basis.errors(values), len(basis) - len(basis.names)
    norm = np.linalg.norm(J, axis=0)
    inverse = np.linalg.inv((J / norm).T @ (J / norm))
    sigma = np.sqrt(np.diag(inverse))
    width = sigma / norm * math.sqrt(r @ r / freedom) * student_t.ppf(0.975, freedom)
    half = {FITTED[i]: float(width[k]) for k, i in enumerate(free)}
    pairs = combinations(range(len(free)), 2)
    return half, {
        f"{FITTED[free[a]]}, {FITTED[free[b]]}": float(inverse[a, b] / (sigma[a] * sigma[b]))
        for a, b in pairs
    }


def profile(basis: TorqueBasis, parameter: int, value: float) -> float:
    """Least sum of squared errors with one of the fitted parameters fixed, the others free and not negative."""
    fixed = np.array(basis.fixed)
    fixed[parameter] = value
    names = tuple(name for name in basis.names if name != FITTED[parameter])
    others = fit.fit_values(replace(basis, names=names, fixed=tuple(fixed)))
    return float(np.sum(basis.errors(others) ** 2))


def profile_limits(basis: TorqueBasis) -> dict[str, dict[str, float]]:
    """95 % limits by the profile of the sum of squared errors; unlike the linearised ones valid far from the solution.

    Bates & Watts, Nonlinear Regression Analysis (1988), section 6.1: limits where the cost exceeds its least value by
    s^2 F(1, n - p; 0.95).
    """
    freedom, values = len(basis) - len(basis.names), fit_values(basis, "least_squares")
    allowed = float(np.sum(basis.errors(values) ** 2)) * (1.0 + student_t.ppf(0.975, freedom) ** 2 / freedom)
    result = {}
    for i in basis.fitted:

        def excess(value: float, i: int = i) -> float:
            return profile(basis, i, value) - allowed

        best = float(values[i])
        low = float(brentq(excess, 0.0, best, xtol=1e-9 * best)) if excess(0.0) > 0.0 else 0.0
        high = 1.1 * best
        while not excess(high) > 0.0:
            high *= 1.3
        result[FITTED[i]] = {"low": low, "high": float(brentq(excess, best, high, xtol=1e-9 * best))}
    return result


def refitted(basis: TorqueBasis, loss: str, without: list[int]) -> np.ndarray:
    """model/measured - 1 of points by the fit to the others."""
    values = fit_values(basis.subset([i for i in range(len(basis)) if i not in without]), loss)
    return (basis.torque(values) / basis.measured - 1.0)[without]


def errors_of(basis: TorqueBasis, values: np.ndarray, loss: str) -> dict[str, float]:
    """Errors of a fit, and of each point by the fit to all others."""
    left_out = np.array([refitted(basis, loss, [i])[0] for i in range(len(basis))])
    return error_summary(basis, basis.torque(values) / basis.measured - 1.0, left_out)


def leave_one_table_out(basis: TorqueBasis, loss: str) -> dict[str, dict[str, float]]:
    """Mean and largest error of the points that one table alone has, by the fit to all others."""
    result = {}
    for name in ("table2", "table4"):
        errors = np.abs(
            refitted(basis, loss, [i for i, m in enumerate(basis.measurements) if m.tables == (name,)])
        )
        result[name] = {"mean": float(errors.mean()), "max": float(errors.max())}
    return result


def fitted_set(basis: TorqueBasis, parameters: Parameters, name: str, provenance: str) -> FrictionSet:
    """A set by its loss with all that the package stores of it."""
    loss = LOSS[name]
    values = fit_values(basis, loss)
    ratio, net, height = values.tolist()
    return FrictionSet(
        Law(name), ratio, net, height, loss, provenance,
        intervals=intervals(basis, values)[0], errors=errors_of(basis, values, loss),
        leave_one_table_out=leave_one_table_out(basis, loss), limits=profile_limits(basis),
        screw=parameters.name, parameters_hash=parameters_hash(parameters),
    )  # fmt: skip


def basis_of(parameters: Parameters, film_model: Callable = solved_film) -> TorqueBasis:
    """The 11 points by the films, or contacts, of a set."""
    temperature = load_screw().lubricant.reference_temperature
    basis = torque_basis(parameters, film_model(parameters), packaged_measurements(temperature))
    return replace(basis, names=SETS[parameters.friction.law])


def main(file: str | None = None, film_model: Callable = solved_film) -> str:
    """The sets and what is not stored, as text.

    file: that the sets are written to; film_model: films, or contacts, of a screw.
    """
    sets, lines, others = [], [], []
    published, own = load_screw(), load_screw(PACKAGED_VG100)
    for name in LOSS:
        mechanistic = name == "mechanistic"
        parameters = own if mechanistic else published
        screw = parameters.screw
        balls = f"{screw.loaded_ball_count} load-carrying" if mechanistic else str(screw.ball_count)
        basis = basis_of(parameters, film_model)
        provenance = (
            f"Zhao et al. (2023), Tables 2 and 4, {len(basis)} distinct points, "
            f"{f'{parameters.lubricant.name}, ' if mechanistic else ''}oil at "
            f"{published.lubricant.reference_temperature:g} K (assumed), {balls} balls per nut, "
            f"ballscrew_tehl {__version__}"
        )
        entry = fitted_set(basis, parameters, name, provenance)
        if mechanistic:
            deviation = basis.torque(entry.values) / basis.measured - 1.0
            entry = with_learned(entry, basis, deviation, parameters, film_model(parameters))
        sets.append(entry)
        correlations = intervals(basis, np.array(entry.values))[1]
        lines += [
            *friction_set_lines(entry),
            *(f"    correlation {pair}: {r:.2f}" for pair, r in correlations.items()),
        ]
        for loss in LOSSES:
            values, errors = entry.values, entry.errors
            if loss != entry.loss:
                values = fit_values(basis, loss)
                errors = errors_of(basis, values, loss)
            shown = "mean", "table2", "table4", "leave_one_out_mean", "leave_one_out_max"
            others.append([name, loss + " (packaged)" * (loss == entry.loss), *(f"{value:.4g}" for value in values),
                           *(percent(errors[key]) for key in shown)])  # fmt: skip
    if file:
        write_friction_sets(file, sets, HEADER)
    head = ["set", "loss", "ratio", "net coefficient", "height [m]", "mean", "table 2", "table 4"]
    return "\n".join([*lines, "", table("Losses", [*head, "left out, mean", "left out, largest"], others)])


if __name__ == "__main__":
    print(main(*sys.argv[1:]))
