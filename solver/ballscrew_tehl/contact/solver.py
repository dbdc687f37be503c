"""One thermal EHL contact: conditions in, film, pressure, temperature and traction out."""

from __future__ import annotations

import logging
import time
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..parameters.file import LubricantParameters, SolidParameters
from .asymptotic import anchored, expected_resolved
from .conditions import DEFAULT_OPTIONS, ContactConditions, SolverOptions, scales_of
from .film import energy
from .one_grid import solve_cold
from .one_thread import one_thread
from .problem import ContactProblem, Solids
from .result import ContactResult
from .solution import ContactSolution

#: expected film over R_x above which a parabolic gap is none between round bodies
THICKEST = 0.1
#: share of the resolved cells in the inlet, by the expected film, below which the grid is refined without a first solve
#: on it
WORTH_TRYING = 0.8


def solve(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters | Solids,
    options: SolverOptions = DEFAULT_OPTIONS,
    warn: bool = True,
) -> ContactResult:
    """Solve one contact.

    Parameters   conditions: operating point;  oil, solid: materials, with the rheology that the oil names; a pair of
                 solids = body 1 (raceway) and body 2 (ball), one = both;  warn: log a film that is thick compared with
                 the bodies (a map has light balls that an axial load relieves)
    Returns      ContactResult; check `converged` and `reason` before using it
    Raises       ValueError: conditions out of range; oil or solid of another kind
    Validity     steady, smooth; flooded, or with a meniscus at options.x_in. Resolved while the inlet length holds
                 about three cells; the nodes along rolling are doubled first, beyond that the film comes from the
                 asymptotic branch. Oil in a gap of more than options.warm_films films has the inlet temperature. Both
                 surfaces have one speed each: spin and differential slip are left to the closed forms of friction
    Source       Zhao et al. 2023, Eqs. 5-13 with the deflection that Eq. 6 omits, the generalised Reynolds equation
                 (Yang & Wen 1990), moving-point-source walls (Carslaw & Jaeger 1959) and the errata named in the
                 modules of this package
    Example      a ball of 60 N on the screw at 1000 r/min (104.7 rad/s) and 30 C
        >>> from ballscrew_tehl import load_screw, solve
        >>> from ballscrew_tehl.contact import ball_conditions
        >>> screw = load_screw()
        >>> conditions = ball_conditions(screw, "screw", 60.0, 104.7, 303.15)
        >>> found = solve(conditions, screw.lubricant, screw.solid)
        >>> found.converged, f"{1e6 * found.h_c:.2f} um"
        (True, '0.16 um')
    """
    solids = solid if isinstance(solid, tuple) and len(solid) == 2 else (solid, solid)
    kinds = (
        (conditions, ContactConditions),
        (oil, LubricantParameters),
        *((one, SolidParameters) for one in solids),
    )
    for name, (value, kind) in zip(("conditions", "oil", "solid", "solid"), kinds, strict=True):
        if not isinstance(value, kind):
            raise ValueError(f"{name} = {value!r}; needs {kind.__name__}, as in the example of help(solve)")
    if warn:
        _warn_of_thick(conditions, oil)
    announce_compilation()
    begun = time.perf_counter()
    # a diverging iterate is detected by values that are not finite
    with one_thread(), np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        solution = _solved(conditions, oil, solids, options)
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
    conditions: ContactConditions, oil: LubricantParameters, solids: Solids, options: SolverOptions
) -> ContactSolution:
    """On the grid of the options, on one of twice the nodes along rolling, or by the asymptotic branch."""
    if expected_resolved(conditions, oil, options, WORTH_TRYING):
        solution = solve_cold(ContactProblem(conditions, oil, solids, options))
        # what does not converge here does not on twice the nodes either, in minutes
        if solution.usable or not solution.converged:
            return solution
    finer = replace(options, n_x=2 * options.n_x - 1)
    solution = solve_cold(ContactProblem(conditions, oil, solids, finer))
    if solution.converged and not solution.usable:

        def isothermal(at: ContactConditions) -> ContactSolution:
            return solve_cold(ContactProblem(at, oil, solids, replace(finer, thermal=False)))

        solution = anchored(solution, oil, finer, isothermal)
    return solution


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
