"""One thermal EHL contact: conditions in, film, pressure, temperature and traction out."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
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
from .continuation import (
    anchored,
    continued,
    continued_in_roughness,
    expected_resolved,
    thermal_reduction_continued,
)
from .film import energy
from .one_grid import HIGH_LOAD, solve_cold, solve_on_grid
from .problem import ContactProblem
from .solution import TOUCHING, ContactSolution
from .starts import neighbours

__all__ = ["DEFAULT_OPTIONS", "ContactConditions", "ContactSolution", "SolverOptions", "solve_contact"]

#: expected film over R_x above which a parabolic gap is none between round bodies
THICKEST = 0.1
#: share of the resolved cells in the inlet, by the expected film, below which the grid is refined without a first solve
#: on it
WORTH_TRYING = 0.8


def solve_contact(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions = DEFAULT_OPTIONS,
    start: ContactSolution | Sequence[ContactSolution] | None = None,
) -> ContactSolution:
    """Solve one contact.

    Parameters   conditions: operating point;  oil, solid: materials (both bodies of `solid`), with the rheology that
                 the oil names;  start: a neighbouring solution to start from, on any grid, or up to three on a line
                 through `conditions` in the logarithms of load, entrainment speed and temperature: pressure, film over
                 expected film, temperature rise and the shares of the error are extrapolated through them (Lagrange).
                 Neighbours that have not converged are left out. A contact that does not converge from its start is
                 solved from the dry contact, a narrow one (conditions.narrow) then on as many lines as others have,
                 and its reason says so; where that fails, too, from lower speeds
    Returns      ContactSolution; check `converged` and `reason` before using it
    Raises       ValueError: conditions out of range; oil, solid or start of another kind; more than three neighbours,
                 two at one point, or off the line
    Validity     steady; flooded, or with a meniscus at options.x_in. Resolved while the inlet length holds about three
                 cells; the nodes along rolling are doubled first, beyond that the film comes from the asymptotic
                 branch. Oil in a gap of more than options.warm_films films has the inlet temperature.
                 temperature_rise of pure rolling is that of the pressure spike and grows with the nodes: use
                 integrals.temperature_rise_mean, or _smooth.
                 Rough surfaces: by their asperity pressure p_a alone (Greenwood & Tripp 1970); the flow is that between
                 smooth surfaces as far apart as the mean planes. Without flow factors (Patir & Cheng 1978), the lay
                 has no effect: below a film ratio of about 3, transverse ridges make a thicker film, longitudinal
                 ones a thinner one. Friction and heat of the asperities are left out: traction, temperatures and
                 integrals are those of the film. With sigma beta eta = 0.2 and sigma/beta = 0.01, above the usual
                 intervals, thermal contacts converge up to an asperity share of 0.1 to 0.2
    Source       Zhao et al. 2023, Eqs. 5-13 with the deflection that Eq. 6 omits, the generalised Reynolds equation
                 (Yang & Wen 1990), moving-point-source walls (Carslaw & Jaeger 1959), film pressure p - p_a at every
                 node (Johnson, Greenwood & Poon 1972) and the errata named in the modules of this package
    """
    for name, value, kind in (("oil", oil, LubricantParameters), ("solid", solid, SolidParameters)):
        if not isinstance(value, kind):
            raise ValueError(f"{name} = {value!r}; needs the {kind.__name__} of load_parameters")
    _warn_of_thick(conditions, oil)
    return solved_contact(conditions, oil, solid, options, start)


def solved_contact(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters,
    options: SolverOptions,
    start: ContactSolution | Sequence[ContactSolution] | None = None,
) -> ContactSolution:
    """solve_contact without a word on thick films: a map has light balls that an axial load relieves."""
    announce_compilation()
    begun = time.perf_counter()

    def solved(at: ContactConditions, near: ContactSolution | None = None) -> ContactSolution:
        return _solved(at, oil, solid, options, neighbours(at, near))[0]

    def isothermal(at: ContactConditions) -> ContactSolution:
        return _solved(at, oil, solid, replace(options, thermal=False))[0]

    solution, lower = _solved(conditions, oil, solid, options, neighbours(conditions, start))
    if not solution.converged and conditions.roughness is not None and conditions.roughness.sigma > 0.0:
        solution = continued_in_roughness(conditions, solved) or solution
    touching = options.thermal and solution.reason == TOUCHING and solution.M > HIGH_LOAD
    if not solution.converged and (lower or touching):
        solution = thermal_reduction_continued(solution, lower, isothermal, solved)
    return replace(solution, seconds=time.perf_counter() - begun)


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
    starts: Sequence[tuple[float, ContactSolution]] = (),
) -> tuple[ContactSolution, list[ContactSolution]]:
    """On the grid of the options, on one of twice the nodes, or by the asymptotic branch; and those at lower loads."""
    near: list[tuple[float, ContactSolution]] = []
    if expected_resolved(conditions, oil, options, WORTH_TRYING):
        solution, lower = _solve_on_grid(conditions, oil, solid, options, starts)
        failed = not solution.converged
        coarse = solution.reason == TOUCHING or solution.branch != "resolved"
        if (failed and lower) or not (coarse or (failed and not options.thermal)):
            return solution, lower
        # what has taken lower loads to converge would take them again
        near = [(1.0, solution)] if lower else []
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
    starts: Sequence[tuple[float, ContactSolution]] = (),
) -> tuple[ContactSolution, list[ContactSolution]]:
    """From the neighbours with their weights, from the dry contact, or from lower speeds or loads."""
    begun = time.perf_counter()
    problem = ContactProblem(conditions, oil, solid, options)
    lower: list[ContactSolution] = []
    solution = solve_on_grid(problem, starts)
    if not solution.converged:
        solution = _solved_on_fewer_lines(problem) or solution
    # from elsewhere, too, the bodies would touch
    if not solution.converged and not problem.plain and solution.reason != TOUCHING:
        solution, lower = continued(problem, solution)
    return replace(solution, seconds=time.perf_counter() - begun), lower


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
