"""One thermal EHL contact: conditions in, film, pressure, temperature and traction out."""

from __future__ import annotations

import logging
import time
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from ..parameters.file import LubricantParameters, SolidParameters
from .conditions import (
    DEFAULT_OPTIONS,
    LEAST_FACTOR,
    NARROW_LINES,
    ContactConditions,
    SolverOptions,
    narrow,
    scales_of,
)
from .continuation import anchored, continued, expected_resolved, thermal_reduction_continued
from .film import energy
from .one_grid import HIGH_LOAD, solve_cold, solve_near
from .one_thread import one_thread
from .problem import ContactProblem
from .result import ContactResult
from .solution import TOUCHING, ContactSolution

#: expected film over R_x above which a parabolic gap is none between round bodies
THICKEST = 0.1
#: share of the resolved cells in the inlet, by the expected film, below which the grid is refined without a first solve
#: on it
WORTH_TRYING = 0.8


def solve(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions = DEFAULT_OPTIONS,
    warn: bool = True,
) -> ContactResult:
    """Solve one contact.

    Parameters   conditions: operating point;  oil, solid: materials (both bodies of `solid`), with the rheology that
                 the oil names;  warn: log a film that is thick compared with the bodies (a map has light balls that an
                 axial load relieves). A narrow contact that does not converge is solved on as many
                 lines as others have, and its reason says so; where that fails, too, from lower speeds or loads
    Returns      ContactResult; check `converged` and `reason` before using it
    Raises       ValueError: conditions out of range; oil or solid of another kind
    Validity     steady, smooth; flooded, or with a meniscus at options.x_in. Resolved while the inlet length holds
                 about three cells; the nodes along rolling are doubled first, beyond that the film comes from the
                 asymptotic branch. Oil in a gap of more than options.warm_films films has the inlet temperature. Both
                 surfaces have one speed each: spin and differential slip are left to the closed forms of friction
    Source       Zhao et al. 2023, Eqs. 5-13 with the deflection that Eq. 6 omits, the generalised Reynolds equation
                 (Yang & Wen 1990), moving-point-source walls (Carslaw & Jaeger 1959) and the errata named in the
                 modules of this package
    """
    for name, value, kind in (("oil", oil, LubricantParameters), ("solid", solid, SolidParameters)):
        if not isinstance(value, kind):
            raise ValueError(f"{name} = {value!r}; needs the {kind.__name__} of load_parameters")
    if warn:
        _warn_of_thick(conditions, oil)
    announce_compilation()
    begun = time.perf_counter()
    with one_thread():
        solution = _continued(conditions, oil, solid, options)
    return replace(solution, seconds=time.perf_counter() - begun)


def _continued(
    conditions: ContactConditions, oil: LubricantParameters, solid: SolidParameters, options: SolverOptions
) -> ContactSolution:
    """By itself, else as thermal reduction continued from lower loads."""

    def thermal(at: ContactConditions) -> ContactSolution:
        return _solved(at, oil, solid, options)[0]

    def isothermal(at: ContactConditions) -> ContactSolution:
        return _solved(at, oil, solid, replace(options, thermal=False))[0]

    solution, lower = _solved(conditions, oil, solid, options)
    touching = options.thermal and solution.reason == TOUCHING and solution.M > HIGH_LOAD
    if not solution.converged and (lower or touching):
        solution = thermal_reduction_continued(solution, lower, isothermal, thermal)
    return solution


def _warn_of_thick(c: ContactConditions, oil: LubricantParameters) -> None:
    """Say where the bodies are far apart, compared with their radius: a solution in dimensionless numbers alone."""
    scales = scales_of(c, oil)
    film = scales.film_estimate * scales.h_unit
    if film > THICKEST * c.R_x:
        logging.getLogger(__name__).warning(
            f"load = {c.load:g} N: film of about {film:.2g} m, above {THICKEST:g} of R_x = {c.R_x:g} m: "
            "round bodies have no parabolic gap so wide; for these, a higher load or a lower speed"
        )


def _solved(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions,
) -> tuple[ContactSolution, list[ContactSolution]]:
    """On the grid of the options, on one of twice the nodes, or by the asymptotic branch; and those at lower loads."""
    near: ContactSolution | None = None
    if expected_resolved(conditions, oil, options, WORTH_TRYING):
        solution, lower = _solve_on_grid(conditions, oil, solid, options)
        failed = not solution.converged
        coarse = solution.reason == TOUCHING or solution.branch != "resolved"
        if (failed and lower) or not (coarse or (failed and not options.thermal)):
            return solution, lower
        # what has taken lower loads to converge would take them again
        near = solution if lower and solution.converged else None
    finer = replace(options, n_x=2 * options.n_x - 1)
    solution, lower = _solve_on_grid(conditions, oil, solid, finer, near)
    failed = not solution.converged and not options.thermal and solution.M > HIGH_LOAD
    if failed or (solution.converged and solution.branch != "resolved"):

        def isothermal(at: ContactConditions) -> ContactSolution:
            return _solve_on_grid(at, oil, solid, replace(finer, thermal=False))[0]

        solution = anchored(solution, oil, finer, isothermal)
    return solution, lower


def _solve_on_grid(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions,
    near: ContactSolution | None = None,
) -> tuple[ContactSolution, list[ContactSolution]]:
    """From a solution on another grid, from the dry contact, or from lower speeds or loads."""
    problem = ContactProblem(conditions, oil, solid, options)
    lower: list[ContactSolution] = []
    solution = solve_near(problem, [(1.0, near)], options.max_thermal) if near else None
    if solution is None or not solution.converged:
        solution = solve_cold(problem)
    if not solution.converged:
        solution = _solved_on_fewer_lines(problem) or solution
    # from elsewhere, too, the bodies would touch
    if not solution.converged and not problem.plain and solution.reason != TOUCHING:
        solution, lower = continued(problem, solution)
    return solution, lower


def _solved_on_fewer_lines(problem: ContactProblem) -> ContactSolution | None:
    """A narrow pressure that does not settle on its lines, on those of others; None: it is none, or does not either.

    The spike lies between the nodes of both; more lines only scatter less from load to load.
    """
    options, fewer = problem.options, problem.options.density / NARROW_LINES
    if options.n_y is not None or fewer < LEAST_FACTOR or not narrow(problem.scales):
        return None
    solution = solve_cold(
        ContactProblem(problem.given, problem.oil, problem.solid, replace(options, density=fewer))
    )
    return replace(solution, reason=f"{solution.reason}, on fewer lines") if solution.converged else None


@lru_cache(maxsize=1)
def announce_compilation() -> bool:
    """Warn once per process if the kernels are not compiled on this machine yet; returns whether it did."""
    cache = energy.sweep.stats.cache_path
    compiled = cache is not None and any(Path(cache).glob("energy.sweep-*.nbi"))
    if not compiled:
        logging.getLogger(__name__).warning(
            "compiling the contact solver: once per machine, about 40 s on a quiet one"
        )
    return not compiled
