"""One thermal EHL contact: conditions in, film, pressure, temperature and traction out.

Where no grid resolves the inlet, by the asymptotic branch: films are extrapolated from lower loads. BLAS runs in one
thread meanwhile: the matrices are small, and threads that wait for a busy core cost more than the whole solve.
"""

import logging
import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..parameters.file import LubricantParameters, SolidParameters
from .conditions import DEFAULT_OPTIONS, ContactConditions, SolverOptions, expected_cells, scales_of
from .film import energy
from .film.geometry import THICK_FILM
from .one_grid import solve_cold
from .problem import ContactProblem, Solids
from .result import RESOLVED_CELLS, ContactResult

try:
    from threadpoolctl import ThreadpoolController
except ImportError:  # a host of the FMU, whose Python lacks it: slower on a busy machine
    ThreadpoolController = None

#: expected film over R_x above which a solve warns that a parabolic gap is none between round bodies
WARNED_ABOVE = 0.1


def solve(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters | Solids,
    options: SolverOptions = DEFAULT_OPTIONS,
    warn: bool = True,
) -> ContactResult:
    """Solve one contact.

    Parameters   conditions: operating point;  oil, solid: materials, the film is Newtonian; a pair of
                 solids = body 1 (raceway) and body 2 (ball), one = both;  warn: log a film that is thick compared with
                 the bodies (a map has light balls that an axial load relieves)
    Returns      ContactResult; check `converged` and `reason` before using it
    Raises       ValueError: conditions out of range; oil or solid of another kind
    Validity     steady, smooth; flooded, or with a meniscus at options.x_in. Resolved while the inlet length holds
                 about three cells; the nodes along rolling are doubled first, beyond that the film comes from the
                 asymptotic branch. Above M = 3000 the minimum film is limited by the lines across: its side lobes are
                 about as narrow as their spacing. Oil in a gap of more than options.warm_films films has the inlet
                 temperature. Both surfaces have one speed each: spin and differential slip are left to the closed
                 forms of friction
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
    for name, value, kind in (
        ("conditions", conditions, ContactConditions), ("oil", oil, LubricantParameters),
        *(("solid", one, SolidParameters) for one in solids),
    ):  # fmt: skip
        if not isinstance(value, kind):
            raise ValueError(f"{name} = {value!r}; needs {kind.__name__}, as in the example of help(solve)")
    scales = scales_of(conditions, oil)
    film = scales.film_estimate * scales.h_unit
    if warn and film > WARNED_ABOVE * conditions.R_x:
        logging.getLogger(__name__).warning(
            f"load = {conditions.load:g} N: film of about {film:.2g} m, above {WARNED_ABOVE:g} of R_x = "
            f"{conditions.R_x:g} m: round bodies have no parabolic gap so wide; a higher load or a lower speed has"
        )
    announce_compilation()
    begun = time.perf_counter()
    # a diverging iterate is detected by values that are not finite
    with one_thread(), np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        solution = _solved(conditions, oil, solids, options)
    return replace(solution, seconds=time.perf_counter() - begun)


def _solved(
    conditions: ContactConditions, oil: LubricantParameters, solids: Solids, options: SolverOptions
) -> ContactResult:
    """On the grid of the options, on one of twice the nodes along rolling, or by the asymptotic branch."""
    if expected_cells(conditions, oil, options) >= RESOLVED_CELLS:
        solution = solve_cold(ContactProblem(conditions, oil, solids, options))
        # what does not converge here does not on twice the nodes either, in minutes
        if solution.usable or not solution.converged:
            return solution
    finer = replace(options, n_x=2 * options.n_x - 1)
    solution = solve_cold(ContactProblem(conditions, oil, solids, finer))
    if solution.converged and not solution.usable:
        solution = _anchored(solution, oil, solids, finer)
    return solution


def _anchored(
    solution: ContactResult, oil: LubricantParameters, solids: Solids, options: SolverOptions
) -> ContactResult:
    """The asymptotic branch: films extrapolated from the highest halved load that the grid resolves and half of it.

    The ratio of the isothermal film to its closed formula is extrapolated linearly over the logarithm of load. The
    thermal reduction, pressure and temperature are those of the solution: they do not depend on the narrow inlet.
    """
    c, cold = solution.conditions, replace(options, thermal=False)

    def isothermal(load: float) -> ContactResult:
        return solve_cold(ContactProblem(replace(c, load=load), oil, solids, cold))

    load, resolved = c.load, list[ContactResult]()
    # expected films give nearly where the grid begins to resolve: no solves before
    while not expected_cells(replace(c, load=0.5 * load), oil, cold) >= RESOLVED_CELLS:
        load *= 0.5
    while len(resolved) < 2:
        load *= 0.5
        if scales_of(replace(c, load=load), oil).film_estimate > THICK_FILM:
            reason = "no resolved load to anchor the asymptotic branch to"
            return replace(solution, converged=False, reason=reason)
        found = isothermal(load)
        resolved = [*resolved, found] if found.usable else []
    anchor, lower = resolved

    def film_of_formula(at: ContactConditions) -> float:
        scales = scales_of(at, oil)
        return scales.film_estimate * scales.h_unit

    ln_ratio, ln_lower = (math.log(s.h_c / film_of_formula(s.conditions)) for s in (anchor, lower))
    ln_ratio += (ln_ratio - ln_lower) / math.log(2.0) * math.log(c.load / anchor.conditions.load)
    h_c = film_of_formula(c) * math.exp(ln_ratio)
    if options.thermal:
        unheated = isothermal(c.load)
        if not unheated.converged:
            return replace(
                solution, converged=False, reason=f"no isothermal film to reduce: {unheated.reason}"
            )
        h_c *= solution.h_c / unheated.h_c
    return replace(solution, h_c=h_c, h_m=h_c * anchor.h_m / anchor.h_c)


# --- compiled code and threads ---


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


@lru_cache(maxsize=1)
def _controller() -> Any:
    """The BLAS libraries of this process, looked up once (milliseconds)."""
    return ThreadpoolController().select(user_api="blas")


class _Limit:
    """The limit of the process: set by the first solve that begins, taken off by the last one that ends."""

    lock, solves, limiter = threading.Lock(), 0, None  # type: threading.Lock, int, Any


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit BLAS to one thread; several threads may be within at a time."""
    with _Limit.lock:
        if _Limit.solves == 0 and ThreadpoolController is not None:
            _Limit.limiter = _controller().limit(limits=1)
        _Limit.solves += 1
    try:
        yield
    finally:
        with _Limit.lock:
            _Limit.solves -= 1
            if _Limit.solves == 0 and _Limit.limiter is not None:
                _Limit.limiter.restore_original_limits()
