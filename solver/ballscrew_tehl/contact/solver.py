"""One thermal EHL contact: conditions in, film, pressure, temperature and traction out.

Where no grid resolves the inlet, by the asymptotic branch: films are extrapolated from lower loads. BLAS runs in one
thread meanwhile: the matrices are small, and threads that wait for a busy core cost more than the whole solve.
"""

import logging
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from ..parameters.file import LubricantParameters, SolidParameters
from .conditions import (
    DEFAULT_OPTIONS,
    ContactConditions,
    SolverOptions,
    cells_in_inlet,
    expected_grid,
    scales_of,
)
from .film import energy
from .one_grid import solve_cold
from .problem import ContactProblem, Solids
from .result import RESOLVED_CELLS, ContactResult

try:
    from threadpoolctl import ThreadpoolController
except ImportError:  # a host of the FMU, whose Python lacks it: slower on a busy machine
    ThreadpoolController = None

#: expected film over R_x above which a solve warns that a parabolic gap is none between round bodies
WARNED_ABOVE = 0.1
#: share of the resolved cells in the inlet, by the expected film, below which the grid is refined without a first solve
#: on it
WORTH_TRYING = 0.8
#: halvings of the load, from the first that the grid is expected to resolve, in search of two resolved ones
MOST_HALVINGS = 8


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
    """Warn of a film that is thick compared with the bodies: a solution in dimensionless numbers alone."""
    scales = scales_of(c, oil)
    film = scales.film_estimate * scales.h_unit
    if film > WARNED_ABOVE * c.R_x:
        logging.getLogger(__name__).warning(
            f"load = {c.load:g} N: film of about {film:.2g} m, above {WARNED_ABOVE:g} of R_x = {c.R_x:g} m: "
            "round bodies have no parabolic gap so wide; for these, a higher load or a lower speed"
        )


def _solved(
    conditions: ContactConditions, oil: LubricantParameters, solids: Solids, options: SolverOptions
) -> ContactResult:
    """On the grid of the options, on one of twice the nodes along rolling, or by the asymptotic branch."""
    if _expected_resolved(conditions, oil, options, WORTH_TRYING):
        solution = solve_cold(ContactProblem(conditions, oil, solids, options))
        # what does not converge here does not on twice the nodes either, in minutes
        if solution.usable or not solution.converged:
            return solution
    finer = replace(options, n_x=2 * options.n_x - 1)
    solution = solve_cold(ContactProblem(conditions, oil, solids, finer))
    if solution.converged and not solution.usable:

        def isothermal(at: ContactConditions) -> ContactResult:
            return solve_cold(ContactProblem(at, oil, solids, replace(finer, thermal=False)))

        solution = _anchored(solution, oil, finer, isothermal)
    return solution


# --- the asymptotic branch ---


def _anchored(
    solution: ContactResult,
    oil: LubricantParameters,
    options: SolverOptions,
    isothermal: Callable[[ContactConditions], ContactResult],
) -> ContactResult:
    """The asymptotic branch: films extrapolated from the highest load that the grid resolves.

    The ratio of the isothermal film to its closed formula is taken at that load and at half of it and extrapolated
    linearly over the logarithm of load. The thermal reduction, pressure and temperature are those of the solution
    itself: they do not depend on the narrow inlet.
    """
    c, scales = solution.conditions, scales_of(solution.conditions, oil)

    def at(load: float) -> ContactResult:
        return isothermal(replace(c, load=load))

    anchors = _resolved_pair(c, oil, options, at)
    if anchors is None:
        reason = "no resolved load to anchor the asymptotic branch to"
        return replace(solution, converged=False, reason=reason)
    anchor, lower = anchors

    def ln_ratio(s: ContactResult) -> float:
        own = scales_of(s.conditions, oil)
        return math.log(s.h_c / (own.film_estimate * own.h_unit))

    slope = (ln_ratio(anchor) - ln_ratio(lower)) / math.log(2.0)
    ln_share = ln_ratio(anchor) + slope * math.log(c.load / anchor.conditions.load)
    h_c = scales.film_estimate * scales.h_unit * math.exp(ln_share)
    if options.thermal:
        cold = at(c.load)
        if not cold.converged:
            return replace(solution, converged=False, reason=f"no isothermal film to reduce: {cold.reason}")
        h_c *= solution.h_c / cold.h_c
    return replace(solution, h_c=h_c, h_m=h_c * anchor.h_m / anchor.h_c)


def _resolved_pair(
    c: ContactConditions,
    oil: LubricantParameters,
    options: SolverOptions,
    at: Callable[[float], ContactResult],
) -> tuple[ContactResult, ContactResult] | None:
    """Solutions at the highest halved load that the grid resolves and at half of it; None if there are none."""
    load, lower = c.load, None
    # expected films give nearly where the grid begins to resolve: no solves before
    while not _expected_resolved(replace(c, load=0.5 * load), oil, replace(options, thermal=False)):
        load *= 0.5
    for _ in range(MOST_HALVINGS):
        load *= 0.5
        anchor, lower = lower, at(load)
        if anchor is not None and anchor.usable and lower.usable:
            return anchor, lower
    return None


def _expected_resolved(
    conditions: ContactConditions, oil: LubricantParameters, options: SolverOptions, share: float = 1.0
) -> bool:
    """Whether the grid of an operating point holds a share of the cells that its expected inlet asks for."""
    scales = scales_of(conditions, oil)
    x = expected_grid(conditions, scales, scales.film_estimate, options).build().x
    return cells_in_inlet(x, scales.film_estimate) >= share * RESOLVED_CELLS


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
