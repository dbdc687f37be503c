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

from ..parameters.file import LubricantParameters, Parameters, SolidParameters
from .conditions import (
    DEFAULT_OPTIONS,
    MAP_NODES,
    ContactConditions,
    SolverOptions,
    ball_conditions,
    expected_cells,
    map_nodes,
    scales_of,
)
from .coupled import LARGE_CHANGE, PRESSURE_SHARE, solve_coupled
from .film import energy
from .film.flow import LEAST_LAYERS
from .film.geometry import TARGET_LOAD, THICK_FILM, ReynoldsState
from .film.reynolds import NEWTON_STEPS
from .grid import Array, Grid
from .half_space import PRESSURE_TOLERANCE
from .problem import ContactProblem, Iteration, Solids
from .result import RESOLVED_CELLS, ContactResult, least_film, solution_of

try:
    from threadpoolctl import ThreadpoolController
except ImportError:  # a host of the FMU, whose Python lacks it: slower on a busy machine
    ThreadpoolController = None

#: share of the extrapolation from half the nodes that counts as the error of the extrapolated film: that of the next
#: order. Twice the nodes, lines, layers and extent change h_c by 2e-4 in the median, 4e-3 at most; that is 0.24 at most
#: of extrapolation, rest and tolerance together (51 random resolved contacts of both kinematics)
REMAINDER = 0.25
#: share of the change by half the layers and half the extent of the energy equation that counts as their error: a third
#: for second order (layers), all of it for first order (extent)
REST_SHARE = 0.5
#: expected film over R_x above which a solve warns that a parabolic gap is none between round bodies
WARNED_ABOVE = 0.1


class UnconvergedContactError(ArithmeticError):
    """A contact that did not converge; the message names it and the reason.

    Examples
    --------
    >>> raise UnconvergedContactError("contact not solved: screw, load 60 N")
    Traceback (most recent call last):
        ...
    ballscrew_tehl.contact.solver.UnconvergedContactError: contact not solved: screw, load 60 N
    """


def solve(
    conditions: ContactConditions,
    oil: LubricantParameters,
    solid: SolidParameters | Solids,
    options: SolverOptions = DEFAULT_OPTIONS,
    warn: bool = True,
) -> ContactResult:
    """Solve one contact.

    Parameters
    ----------
    conditions : ContactConditions
        Operating point.
    oil : LubricantParameters
        Oil; the film is Newtonian.
    solid : SolidParameters or pair of SolidParameters
        Bodies: a pair is body 1 (raceway) and body 2 (ball), one stands for both.
    options : SolverOptions, optional
        Accuracy and cost.
    warn : bool, optional
        Log a film that is thick compared with the bodies (a map has light balls that an axial load relieves).

    Returns
    -------
    ContactResult
        Films, pressure, temperature, forces; check `converged` and `reason` before using it.

    Raises
    ------
    ValueError
        Conditions out of range; oil or solid of another kind.

    Notes
    -----
    Steady, smooth; flooded, or with a meniscus at options.x_in. Resolved while the inlet length has about three cells;
    the nodes along rolling are doubled first, beyond that the film comes from the asymptotic branch. Above M = 3000 the
    minimum film is limited by the lines across: its side lobes are about as narrow as their spacing. Oil in a gap of
    more than options.warm_films films has the inlet temperature. Both surfaces have one speed each: spin and
    differential slip are left to the closed forms of friction.

    Zhao et al. 2023, Eqs. 5-13 with the deflection that Eq. 6 omits, the generalised Reynolds equation (Yang & Wen
    1990), moving-point-source walls (Carslaw & Jaeger 1959) and the errata named in the modules of this package.

    Examples
    --------
    A ball of 60 N on the screw at 1000 r/min (104.7 rad/s) and 30 C:

    >>> from ballscrew_tehl import load_screw, solve
    >>> from ballscrew_tehl.contact import ball_conditions
    >>> screw = load_screw()
    >>> conditions = ball_conditions(screw, "screw", 60.0, 104.7, 303.15)
    >>> result = solve(conditions, screw.lubricant, screw.solid)
    >>> result.converged, f"{1e6 * result.h_c:.2f} um"
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
        result = isothermal(load)
        resolved = [*resolved, result] if result.usable else []
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


# --- one grid: from the dry contact by way of half the nodes


def solve_cold(problem: ContactProblem) -> ContactResult:
    """From the dry contact, by way of half the nodes."""
    options = problem.options
    coarse_choice = problem.choice.halved()
    if coarse_choice is None:
        return solution_of(problem, solve_from(problem, None, None, options.tolerance), (0.0, 0.0))
    coarse = ContactProblem(problem.given, problem.oil, problem.solids, options, coarse_choice)
    first, remainder = _solve_coarse(coarse)
    if first.converged:
        it = solve_from(problem, *prolonged(coarse, first, problem), options.tolerance, first.damped)
    # what never settles with damping would not from the dry contact
    if not first.converged or not (it.converged or it.damped):
        it = solve_from(problem, None, None, options.tolerance)
    if not (first.converged and it.converged):
        return solution_of(problem, it, (0.0, 0.0))
    # Richardson: the error of second order is a third of the change from half the nodes
    extrapolation = (1.0 - coarse.central_film(first) / problem.central_film(it)) / 3.0
    # side lobes are about as narrow as the line spacing: no order of convergence, they get the share of the centre
    (h_coarse, at_coarse), (h_fine, at_fine) = least_film(coarse, first), least_film(problem, it)
    own = (1.0 - h_coarse / h_fine) / 3.0 if at_coarse == at_fine == 0 else extrapolation
    return solution_of(problem, it, (extrapolation, own), REMAINDER * abs(extrapolation) + remainder)


def _solve_coarse(coarse: ContactProblem) -> tuple[Iteration, float]:
    """Solution of half the nodes, and relative error of the film by layers and extent: half of both come first."""
    if coarse.options.thermal:
        n_z, films = coarse.options.n_z, max(0.5 * coarse.options.warm_films, 2.0)
        half = replace(coarse.options, n_z=n_z // 2 if n_z // 2 >= LEAST_LAYERS else n_z, warm_films=films)
        rough = ContactProblem(coarse.given, coarse.oil, coarse.solids, half, coarse.choice)
        before = solve_from(rough, None, None, DEFAULT_OPTIONS.tolerance)
        if before.converged:
            start = prolonged(rough, before, coarse)
            first = solve_from(coarse, *start, DEFAULT_OPTIONS.tolerance, before.damped)
            if first.converged:
                change = rough.central_film(before) / coarse.central_film(first) - 1.0
                return first, REST_SHARE * abs(change)
    return solve_from(coarse, None, None, DEFAULT_OPTIONS.tolerance), 0.0


def solve_from(
    problem: ContactProblem,
    state: ReynoldsState | None,
    temperature: Array | None,
    tolerance: float,
    damped: bool = False,
) -> Iteration:
    """Solve on one grid from a state, or from the dry contact; damped: without an undamped attempt."""
    options, it = problem.options, problem.start(state)
    if not options.thermal:
        return problem.solve_isothermal(it, tolerance, options.max_newton)
    if state is None:
        it = problem.solve_isothermal(it, PRESSURE_SHARE * LARGE_CHANGE, NEWTON_STEPS)
    near, limit, used = it.state, options.max_thermal, 0
    if not damped:
        it = solve_coupled(problem, it, temperature, tolerance, limit)
        used = it.iterations
        if it.converged or used >= limit:
            return it
    # a hot inlet of a thick film
    it = solve_coupled(problem, problem.start(near), temperature, tolerance, limit - used, damped=True)
    it.iterations += used
    return it


def _weights(at: Array, nodes: Array) -> Array:
    """Matrix (at, nodes) of cubic interpolation through the four nodes around; beyond the border its value."""
    first = np.clip(np.searchsorted(nodes, at) - 2, 0, nodes.size - 4)[:, None] + np.arange(4)
    at, out = np.clip(at, nodes[0], nodes[-1])[:, None], np.zeros((at.size, nodes.size))
    for own in range(4):
        others = nodes[np.delete(first, own, axis=1)]
        weight = np.prod((at - others) / (nodes[first[:, own, None]] - others), axis=1)
        out[np.arange(at.size), first[:, own]] = weight
    return out


def resample(field_: Array, source: Grid, target: Grid) -> Array:
    """Values (n_y, n_x, ...) of one grid on another."""
    along, y = _weights(target.x, source.x), source.y
    # even across the line of symmetry
    y, field_ = np.concatenate((-y[2:0:-1], y)), np.concatenate((field_[2:0:-1], field_))
    return np.einsum("jl,lk...,ik->ji...", _weights(target.y, y), field_, along, optimize=True)


def prolonged(
    coarse: ContactProblem, it: Iteration, problem: ContactProblem
) -> tuple[ReynoldsState, Array | None]:
    """A coarse solution on the grid of a finer problem: state and temperatures."""
    source, grid, geometry = coarse.geometry.grid, problem.geometry.grid, problem.geometry
    p = resample(np.maximum(it.state.p, 0.0), source, grid)
    # cavitated nodes begin so, for the edge of cavitation moves by one node per Newton step
    p = geometry.embed(np.where(p <= 0.0, -PRESSURE_TOLERANCE, p)[grid.inner])
    p *= TARGET_LOAD / float(np.sum(geometry.weights * p))
    # the approach that leaves the gap of the contact as it was
    shape = geometry.gap(p, 0.0)
    middle = p > 0.5 * p.max()
    h_0 = float(np.mean((resample(it.state.gap, source, grid) - shape)[middle]))
    warm, layers = it.temperature, problem.options.n_z
    if warm is not None:
        warm = resample(warm, source, grid)
        if coarse.options.n_z != layers:
            levels = np.linspace(0.0, 1.0, layers + 1), np.linspace(0.0, 1.0, coarse.options.n_z + 1)
            warm = warm @ _weights(*levels).T
    return ReynoldsState(p, h_0, shape + h_0), warm


# --- the contact of a ball at an operating point of the screw


def solve_for_map(
    conditions: ContactConditions, oil: LubricantParameters, solid: SolidParameters | Solids, thermal: bool
) -> ContactResult:
    """The last solve of a contact of a ball: on the default nodes or twice MAP_NODES where fewer do not converge."""
    for n_x in sorted({map_nodes(conditions, oil), DEFAULT_OPTIONS.n_x, 2 * MAP_NODES - 1}):
        result = solve(conditions, oil, solid, SolverOptions(thermal=thermal, n_x=n_x), warn=False)
        if result.converged:
            break
    return result


def solve_ball(
    parameters: Parameters, raceway: str, load: float, speed: float, temperature: float, thermal: bool
) -> ContactResult:
    """Solve the contact of one ball, with a further attempt on another grid.

    Parameters
    ----------
    parameters : Parameters
        Screw, oil, bodies and kinematics.
    raceway : str
        Raceway that the ball touches, "screw" or "nut".
    load : float
        Ball load [N], > 0.
    speed : float
        Speed of the screw [rad/s], > 0.
    temperature : float
        Temperature of oil and bodies [K].
    thermal : bool
        Couple the energy equation.

    Returns
    -------
    ContactResult
        A converged result.

    Raises
    ------
    UnconvergedContactError
        Names the contact and the reason.
    ValueError
        A value out of range.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> result = solve_ball(load_screw(), "screw", 60.0, 104.7, 303.15, thermal=False)
    >>> f"{1e6 * result.h_c:.2f} um"
    '0.17 um'
    """
    conditions = ball_conditions(parameters, raceway, load, speed, temperature)
    result = solve_for_map(conditions, parameters.lubricant, parameters.solids, thermal)
    if result.converged:
        return result
    raise UnconvergedContactError(
        f"contact not solved: {raceway}, load {load:.6g} N, speed {speed:.6g} rad/s, {temperature:.6g} K "
        f"({'thermal' if thermal else 'isothermal'}): {result.reason}"
    )


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
