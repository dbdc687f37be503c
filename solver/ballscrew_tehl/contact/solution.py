"""What a solve of one contact has found: films with their error, fields, heat and traction."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from .conditions import cells_in_inlet, inlet_length
from .coupled import CONVERGED_AT
from .film.reynolds import GridChoice, ReynoldsState
from .half_space.grid import Array
from .integrals import contact_integrals
from .problem import ContactProblem, Iteration
from .result import ContactResult, HeatBalance

#: cells that the length of the inlet must hold at the edge of the Hertz line for a solution to count as resolved
RESOLVED_CELLS = 2.8
#: share of the film that an extrapolation may add: beyond, the coarse grid does not resolve the inlet
EXTRAPOLATED_BELOW = 0.06
#: a solution is none if its film is above MOST_FILM of its isothermal formula, or, flooded with a Newtonian oil, below
#: LEAST_FILM of the one with heat, or if the pressure of its core is not within CORE of its estimate. 1,000 contacts of
#: screws: films 0.37 to 1.05 and above 0.8 of these, cores 0.09 to 1.01
MOST_FILM, LEAST_FILM, CORE = 2.0, 0.1, (0.03, 2.0)
#: film over R_x above which a contact that loses less than nothing has no rolling loss: its oil ends at R_x
THICK = 0.15
#: reason of an iteration that has converged to overlapping bodies
TOUCHING = "the bodies touch: film thinner than the grid resolves"


@dataclass(frozen=True, kw_only=True)
class ContactSolution(ContactResult):
    """A result with its state and grid.

    h_c, h_m are extrapolated from the grid and the one of half the nodes by the two shares `extrapolation`;
    error_estimate is NaN without a coarse grid.
    """

    extrapolation: tuple[float, float]
    state: ReynoldsState = field(repr=False)
    choice: GridChoice = field(repr=False)

    @property
    def usable(self) -> bool:
        """Whether the grid holds it."""
        return self.converged and self.branch == "resolved"


def solution_of(
    problem: ContactProblem, it: Iteration, extrapolation: tuple[float, float], error: float = math.nan
) -> ContactSolution:
    """What a solve has found; its time is left at zero."""
    grid, scales = problem.geometry.grid, problem.scales
    if problem.plain:
        problem.update_flow(it, problem.uniform_temperature())
    force, sliding_heat = problem.traction(it)
    force *= -1.0 if problem.given.u_e < 0.0 else 1.0
    h_c, h_m = _films(problem, it, extrapolation)
    integrals = contact_integrals(problem, it, force)
    if integrals["rolling_loss"] < 0.0 and h_c * scales.h_unit > THICK * problem.conditions.R_x:
        integrals |= dict.fromkeys(("rolling_resistance", "rolling_loss"), math.nan)
    converged, reason = it.converged, it.reason
    if converged and not min(h_m, h_c) > 0.0:
        converged, reason = False, TOUCHING
    if converged and (wrong := _implausible(problem, h_c, integrals)):
        converged, reason = False, wrong
    return ContactSolution(
        conditions=problem.given,
        hertz=scales.hertz,
        h_c=h_c * scales.h_unit,
        h_m=min(h_m, h_c) * scales.h_unit,
        p_max=float(it.state.p.max()) * scales.hertz.p_max,
        temperature_rise=0.0
        if it.temperature is None
        else float(it.temperature.max()) - problem.given.temperature,
        traction_force=force,
        sliding_heat=sliding_heat,
        converged=converged,
        reason=reason,
        iterations=it.iterations,
        M=scales.M,
        L=scales.L,
        branch=_branch(problem, it),
        extrapolation=extrapolation,
        error_estimate=error + CONVERGED_AT * problem.options.tolerance,
        grid_film=problem.central_film(it) * scales.h_unit,
        heat_balance=None if it.heat_flows is None else HeatBalance(*it.heat_flows),
        **integrals,
        x=grid.x,
        y=grid.y,
        pressure=np.maximum(it.state.p, 0.0) * scales.hertz.p_max,
        film=it.state.gap * scales.h_unit,
        temperature=it.temperature,
        state=it.state,
        choice=problem.choice,
    )


def _implausible(problem: ContactProblem, h_c: float, integrals: Mapping[str, float]) -> str:
    """Why a converged iterate is no solution of the contact; empty if it may be one."""
    scales, c, options = problem.scales, problem.conditions, problem.options
    loss, core = integrals["rolling_loss"], integrals["core_pressure"]
    if loss < 0.0:
        return f"no solution: its rolling loss is {loss:.3g} W"
    least = LEAST_FILM * scales.warm_film**2 / scales.film_estimate
    if problem.oil.rheology != "newtonian" or options.x_in is not None or options.y_max is not None:
        least = 0.0
    if not least <= h_c <= MOST_FILM * scales.film_estimate:
        return f"no solution: its film is {h_c / scales.film_estimate:.3g} times its formula"
    wedge = scales.film_estimate * math.sqrt(c.R_y / c.R_x) * scales.hertz.b / scales.hertz.a
    estimate = scales.hertz.p_max / (1.0 + wedge)
    if not CORE[0] * estimate <= core <= CORE[1] * scales.hertz.p_max:
        return f"no solution: the pressure of its core is {core / estimate:.3g} times its estimate"
    return ""


def _films(problem: ContactProblem, it: Iteration, extrapolation: tuple[float, float]) -> tuple[float, float]:
    """Central and minimum film [b^2/R_x], extrapolated to zero spacing where the shares to add are small."""
    h_c, h_m = (
        film * (1.0 + share if abs(share) < EXTRAPOLATED_BELOW else 1.0)
        for film, share in zip(
            (problem.central_film(it), least_film(problem, it)[0]), extrapolation, strict=True
        )
    )
    return h_c, h_m


def _branch(problem: ContactProblem, it: Iteration) -> str:
    """Whether the grid resolves the inlet of the isothermal film, which heat inside the contact does not narrow."""
    film = problem.central_film(it)
    if it.temperature is not None:
        film = max(film, problem.scales.film_estimate)
    cells = cells_in_inlet(problem.geometry.grid.x, film)
    return "resolved" if cells >= RESOLVED_CELLS else "asymptotic"


def least_film(problem: ContactProblem, it: Iteration) -> tuple[float, int]:
    """Minimum film of the grid [b^2/R_x] and the line that it lies on, counted from the axis.

    Over the lines whose contact edge holds a cell per inlet length. On a long ellipse under high load the outermost
    lines end on cells longer than their own inlet and have no meaningful film; the minimum of such an ellipse lies at
    the outlet of the central lines anyway.
    """
    x, y, gap = problem.geometry.grid.x, problem.geometry.grid.y, it.state.gap
    h_c = float(gap[0, np.argmin(np.abs(x))])
    spacing = np.interp(np.sqrt(np.clip(1.0 - y**2, 0.0, None)), x[:-1], np.diff(x))
    half_width = np.sqrt(np.clip(1.0 - y**2, 1e-4, None))
    usable = (spacing <= inlet_length(max(h_c, 0.0)) / half_width ** (1.0 / 3.0)) | (y > 1.0)
    usable[0] = True
    lines = usable & np.logical_and.accumulate(usable | (y > 1.0))
    # the lobe is about as narrow as the spacing: parabola through the least node of each line and its neighbours, then
    # through the lines, there of the logarithm: the gap opens steeply towards the edge
    least = np.array([_vertex(x, line) for line in gap])
    k = int(np.argmin(np.where(lines, least, np.inf)))
    if not 0 < k < y.size - 1 or not least[k - 1 : k + 2].min() > 0.0 or not lines[k + 1]:
        return float(least[k]), k
    return math.exp(_vertex(y[k - 1 : k + 2], np.log(least[k - 1 : k + 2]))), k


def _vertex(x: Array, values: Array) -> float:
    """Least value of the parabola through the least inner node and its neighbours."""
    k = min(max(int(np.argmin(values)), 1), x.size - 2)
    low, mid, high = (float(v) for v in values[k - 1 : k + 2])
    left, right = float(x[k - 1] - x[k]), float(x[k + 1] - x[k])
    bend = ((high - mid) / right - (low - mid) / left) / (right - left)
    slope = (low - mid) / left - bend * left
    if not bend > 0.0 or not left < -0.5 * slope / bend < right:
        return min(low, mid, high)
    return mid - 0.25 * slope * slope / bend
