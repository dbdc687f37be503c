"""What a solve of one contact has found: films with their error, fields, heat and traction."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..physics.hertz import HertzContact
from .conditions import ContactConditions, inlet_length
from .coupled import CONVERGED_AT
from .film import energy
from .film.reynolds import TARGET_LOAD, GridChoice, NewtonHistory, ReynoldsState
from .half_space.grid import Array, Grid
from .integrals import ContactIntegrals, contact_integrals
from .problem import ContactProblem, Iteration

#: cells that the length of the inlet must hold at the edge of the Hertz line for a solution to count as resolved
RESOLVED_CELLS = 2.8
#: share of the film that an extrapolation may add: beyond, the coarse grid does not resolve the inlet
EXTRAPOLATED_BELOW = 0.06
#: reason of an iteration that has converged to overlapping bodies
TOUCHING = "the bodies touch: film thinner than the grid resolves"


@dataclass(frozen=True)
class ContactSolution:
    """Result of a solve; fields are (n_y, n_x) on the half plane Y >= 0, X along the entrainment.

    temperature (n_y, n_x, n_z+1) [K]; h_c, h_m central and minimum film [m], extrapolated from the grid and the one of
    half the nodes by the two shares `extrapolation`; error_estimate: relative, of h_c, from grid, layers, extent of the
    energy equation and tolerance (NaN without a coarse grid; a warm start keeps the shares of its start, or those
    interpolated between its neighbours), error_parts: those of the grid and of layers and extent; film (n_y, n_x): as
    on the grid, between the mean planes of rough surfaces; pressure (n_y, n_x) [Pa]: that deforms the
    bodies and carries the load, p_max the largest; asperity_pressure (n_y, n_x) [Pa]: the part of it that asperities
    carry, the film carries the rest; asperity_load_share: of the load, 0 to 1, on the asymptotic branch that of the
    load that converged; temperature_rise largest rise in the film [K]; traction_force [N] on body 2 (positive where it
    drags body 2 towards u_1), spin_moment [N m] about the normal from body 1 to body 2,
    sliding_heat [W] of both; phases: seconds by part of the work; branch "resolved" or "asymptotic";
    integrals: rolling loss, forces on the walls, heat by part and means over the contact, of the grid (the asymptotic
    branch of a contact that did not converge: extrapolated over the load like forces and heat; the fields, history and
    shares are those of the load that did, error_estimate is NaN); M, L Moes numbers; reason why the iteration stopped.
    """

    conditions: ContactConditions
    hertz: HertzContact
    h_c: float
    h_m: float
    p_max: float
    temperature_rise: float
    traction_force: float
    spin_moment: float
    sliding_heat: float
    converged: bool
    reason: str
    iterations: int
    deflections: int
    seconds: float
    phases: dict[str, float]
    M: float
    L: float
    branch: str
    extrapolation: tuple[float, float]
    error_estimate: float
    error_parts: tuple[float, float]
    history: NewtonHistory
    temperature_history: list[float]
    heat_balance: energy.HeatBalance | None
    integrals: ContactIntegrals
    x: Array
    y: Array
    pressure: Array
    asperity_pressure: Array
    asperity_load_share: float
    film: Array
    temperature: Array | None
    state: ReynoldsState = field(repr=False)
    choice: GridChoice = field(repr=False)

    def share_below(self, film: float) -> float:
        """Share of the Hertz ellipse whose film is below one [m]."""
        inside = (self.x[None, :] ** 2 + self.y[:, None] ** 2 <= 1.0) * self.grid.weights
        return float(np.sum(inside * (self.film < film)) / np.sum(inside))

    @property
    def grid(self) -> Grid:
        """The grid of the fields."""
        return Grid(self.x, self.y, self.choice.mirror, self.choice.open_side)

    @property
    def usable(self) -> bool:
        """Whether others may be extrapolated from it."""
        return self.converged and self.branch == "resolved"

    def moved_to(self, other: ContactSolution, **extrapolated: Any) -> ContactSolution:
        """This solution under the conditions of another one, with extrapolated values: the asymptotic branch."""
        return replace(
            self,
            conditions=other.conditions,
            hertz=other.hertz,
            M=other.M,
            L=other.L,
            branch="asymptotic",
            error_estimate=math.nan,
            **extrapolated,
        )


def solution_of(
    problem: ContactProblem,
    it: Iteration,
    extrapolation: tuple[float, float],
    errors: tuple[float, float] = (math.nan, 0.0),
) -> ContactSolution:
    """What a solve has found; its time is left at zero."""
    grid, scales = problem.geometry.grid, problem.scales
    if problem.plain:
        problem.update_flow(it, problem.uniform_temperature())
    traction = problem.traction(it)
    sign = -1.0 if problem.given.u_e < 0.0 else 1.0
    h_c, h_m = _films(problem, it, extrapolation)
    asperities = problem.asperity_pressure(it.state)
    converged, reason = it.converged, it.reason
    if converged and not min(h_m, h_c) > 0.0:
        converged, reason = False, TOUCHING
    return ContactSolution(
        conditions=problem.given,
        hertz=scales.hertz,
        h_c=h_c * scales.h_unit,
        h_m=min(h_m, h_c) * scales.h_unit,
        p_max=float(it.state.p.max()) * scales.hertz.p_max,
        temperature_rise=0.0
        if it.temperature is None
        else float(it.temperature.max()) - problem.given.temperature,
        traction_force=sign * traction.force,
        spin_moment=sign * traction.moment,
        sliding_heat=traction.heat,
        converged=converged,
        reason=reason,
        iterations=it.iterations,
        deflections=it.history.deflections,
        seconds=0.0,
        phases=dict(problem.seconds),
        M=scales.M,
        L=scales.L,
        branch=_branch(problem, it),
        extrapolation=extrapolation,
        error_estimate=sum(errors) + CONVERGED_AT * problem.options.tolerance,
        error_parts=errors,
        history=it.history,
        temperature_history=it.temperature_history,
        heat_balance=None if it.balance is None else it.balance(),
        integrals=contact_integrals(problem, it, sign * traction.force),
        x=grid.x,
        y=grid.y,
        pressure=np.maximum(it.state.p, 0.0) * scales.hertz.p_max,
        asperity_pressure=asperities * scales.hertz.p_max,
        asperity_load_share=float(np.sum(problem.geometry.weights * asperities)) / TARGET_LOAD,
        film=it.state.gap * scales.h_unit,
        temperature=it.temperature,
        state=it.state,
        choice=problem.choice,
    )


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
    return "resolved" if problem.cells_in_inlet(film) >= RESOLVED_CELLS else "asymptotic"


def least_film(problem: ContactProblem, it: Iteration) -> tuple[float, int]:
    """Minimum film of the grid [b^2/R_x] and the line that it lies on, counted from the axis."""
    grid, gap, axis = problem.geometry.grid, it.state.gap, problem.geometry.axis
    halves = [gap[axis:]] if grid.mirror else [gap[axis:], gap[axis::-1]]
    return min(_minimum_film(grid.x, grid.y[axis:], half) for half in halves)


def _minimum_film(x: Array, y: Array, gap: Array) -> tuple[float, int]:
    """Smallest gap, and its line, over the lines whose contact edge holds a cell per inlet length [b^2/R_x].

    On a long ellipse under high load the outermost lines end on cells longer than their own inlet and have no
    meaningful film; the minimum of such an ellipse lies at the outlet of the central lines anyway.
    """
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
