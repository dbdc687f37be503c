"""The result of a contact: films with their error, fields, integrals over its grid, and whether it is a solution."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..physics.hertz import HertzContact
from ..physics.lubricant import eta0
from .conditions import ContactConditions, cells_in_inlet, inlet_length
from .coupled import CONVERGED_AT
from .film.flow import trapezoid_weights
from .film.fluxes import wedge_flux, wedge_weights
from .film.geometry import ReynoldsState
from .grid import TINY, Array, GridChoice
from .problem import ContactProblem, Iteration

#: cells that the length of the inlet must hold at the edge of the Hertz line for a solution to count as resolved
RESOLVED_CELLS = 2.8
#: a solution is none if its film is above MOST_FILM of its isothermal formula, or, flooded, below LEAST_FILM of the
#: one with heat, or if the pressure of its core is not within CORE of its estimate. 1,000 contacts of screws:
#: films 0.37 to 1.05 and above 0.8 of these, cores 0.09 to 1.01
MOST_FILM, LEAST_FILM, CORE = 2.0, 0.1, (0.03, 2.0)
#: film over R_x above which the gap of round bodies is no parabola: there the oil ends at R_x, and a contact that loses
#: less than nothing has no rolling loss
THICKEST = 0.15
#: length over which temperatures are averaged for the smoothed maximum, and pressures for the core [b]: wider than a
#: pressure spike, whose height depends on where it lies between the nodes
SMOOTHED_OVER = 0.2
#: integrals of p^2 and p^3 of a smoothed Hertz pressure over those of the pressure itself (test: by quadrature)
SMOOTHED_HERTZ = 0.98808, 0.98627


class HeatBalance(NamedTuple):
    """Heat of the whole contact.

    Attributes
    ----------
    generated : float
        By shear and compression [W].
    conducted : float
        Into the walls [W].
    convected : float
        Carried out by the oil [W].
    """

    generated: float
    conducted: float
    convected: float

    @property
    def defect(self) -> float:
        """Relative gap of the balance; vanishes with the iteration."""
        size = max(abs(self.generated), abs(self.conducted), abs(self.convected), TINY)
        return (self.generated - self.conducted - self.convected) / size


@dataclass(frozen=True, kw_only=True)
class ContactResult:
    """Result of a contact, SI; NaN: not known. Use it only if it has converged.

    Attributes
    ----------
    conditions : ContactConditions
        Operating point.
    hertz : HertzContact
        Hertz contact of the same load.
    h_c, h_m : float
        Central and minimum film [m], extrapolated from the grid and the one of half the nodes.
    p_max : float
        Largest pressure [Pa].
    converged : bool
        Whether the iteration converged to a solution of the contact.
    reason : str
        Why the iteration stopped.
    M, L : float
        Moes numbers.
    branch : str
        "resolved", or "asymptotic" where no grid resolves the inlet and films are extrapolated over load.
    error_estimate : float
        Relative, of h_c, from grid, layers, extent of the energy equation and tolerance; NaN without a coarse grid.
    grid_film : float
        h_c of the grid, before extrapolation [m].
    iterations : int
        Of pressure and temperature on the last grid.
    seconds : float
        Time of the whole solve [s].
    temperature_rise : float
        Largest in the film [K]; in pure rolling that of the pressure spike, which grows with the nodes.
    temperature_rise_mean, temperature_rise_smooth : float
        Of the hottest level of the film: mean over the contact, largest mean over 0.2 b [K].
    mean_temperature : float
        Of the film over contact and thickness [K].
    traction_force : float
        Of mid-film on body 2 [N], positive where it drags body 2 towards u_1.
    traction_force_1, traction_force_2 : float
        Of the film on the surfaces of both bodies along rolling [N].
    sliding_heat : float
        Heat of the traction [W].
    shear_heat, compression_heat : float
        By sliding and pressure flow, and by compression [W], both on the grid.
    rolling_resistance : float
        Integral of h dp/dx dA [N], of a flooded contact to x = -R_x and y = +-R_x.
    resistance_beyond : float
        The part of it outside the grid [N].
    rolling_loss : float
        Power that pure rolling costs, u_e times rolling_resistance [W]; NaN where a film above 0.15 R_x leaves none.
    core_pressure, core_area : float
        Equivalent Hertz pressure, with the same integrals of p^2 and p^3 [Pa], and its area [m2], for the film shear.
    heat_balance : HeatBalance or None
        Of a thermal solve.
    x, y : (n_x,), (n_y,) array
        Nodes along the entrainment [b] and, on the half plane y >= 0, across [a].
    pressure, film : (n_y, n_x) array
        Fields of pressure [Pa] and film [m].
    temperature : (n_y, n_x, n_z+1) array or None
        From body 1 to body 2 [K]; None without heat.
    state, choice : ReynoldsState, GridChoice
        Of the last grid.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> from ballscrew_tehl.contact import solve_ball
    >>> solve_ball(load_screw(), "screw", 60.0, 104.7, 303.15, thermal=False).usable
    True
    """

    conditions: ContactConditions
    hertz: HertzContact
    h_c: float
    h_m: float
    p_max: float
    converged: bool
    reason: str
    M: float
    L: float
    branch: str
    error_estimate: float
    grid_film: float
    iterations: int
    seconds: float = 0.0
    temperature_rise: float
    temperature_rise_mean: float
    temperature_rise_smooth: float
    mean_temperature: float
    traction_force: float
    traction_force_1: float
    traction_force_2: float
    sliding_heat: float
    shear_heat: float
    compression_heat: float
    rolling_resistance: float
    resistance_beyond: float
    rolling_loss: float
    core_pressure: float
    core_area: float
    heat_balance: HeatBalance | None
    x: Array = field(repr=False)
    y: Array = field(repr=False)
    pressure: Array = field(repr=False)
    film: Array = field(repr=False)
    temperature: Array | None = field(repr=False)
    state: ReynoldsState = field(repr=False)
    choice: GridChoice = field(repr=False)

    @property
    def usable(self) -> bool:
        """Whether it has converged on a grid that resolves it."""
        return self.converged and self.branch == "resolved"


def solution_of(
    problem: ContactProblem, it: Iteration, extrapolation: tuple[float, float], error: float = math.nan
) -> ContactResult:
    """Result of a solve without its time; extrapolation: shares that both films gain; error: NaN if not known."""
    grid, scales, p_max = problem.geometry.grid, problem.scales, problem.scales.hertz.p_max
    if not problem.options.thermal:
        problem.update_flow(it, problem.uniform_temperature())
    on_grid = problem.central_film(it)
    h_c = on_grid * (1.0 + extrapolation[0])
    h_m = min(least_film(problem, it)[0] * (1.0 + extrapolation[1]), h_c)
    integrals = contact_integrals(problem, it)
    if integrals["rolling_loss"] < 0.0 and h_c * scales.h_unit > THICKEST * problem.conditions.R_x:
        integrals |= dict.fromkeys(("rolling_resistance", "rolling_loss"), math.nan)
    converged, reason, rise, resolving = it.converged, it.reason, 0.0, on_grid
    if converged and (wrong := _implausible(problem, h_c, h_m, integrals)):
        converged, reason = False, wrong
    if it.temperature is not None:
        rise = float(it.temperature.max()) - problem.given.temperature
        # heat inside the contact does not narrow the inlet
        resolving = max(on_grid, scales.film_estimate)
    return ContactResult(
        conditions=problem.given,
        hertz=scales.hertz,
        h_c=h_c * scales.h_unit,
        h_m=h_m * scales.h_unit,
        p_max=float(it.state.p.max()) * p_max,
        temperature_rise=rise,
        converged=converged,
        reason=reason,
        iterations=it.iterations,
        M=scales.M,
        L=scales.L,
        branch="resolved" if cells_in_inlet(grid.x, resolving) >= RESOLVED_CELLS else "asymptotic",
        error_estimate=error + CONVERGED_AT * problem.options.tolerance,
        grid_film=on_grid * scales.h_unit,
        heat_balance=None if it.heat_flows is None else HeatBalance(*it.heat_flows),
        **integrals,
        x=grid.x,
        y=grid.y,
        pressure=np.maximum(it.state.p, 0.0) * p_max,
        film=it.state.gap * scales.h_unit,
        temperature=it.temperature,
        state=it.state,
        choice=problem.choice,
    )


def _implausible(problem: ContactProblem, h_c: float, h_m: float, integrals: Mapping[str, float]) -> str:
    """Why a converged iterate with films [b^2/R_x] is no solution of the contact; empty if it may be one."""
    scales, c, options = problem.scales, problem.conditions, problem.options
    loss, core = integrals["rolling_loss"], integrals["core_pressure"]
    if not h_m > 0.0:
        return "the bodies touch: film thinner than the grid resolves"
    if loss < 0.0:
        return f"no solution: its rolling loss is {loss:.3g} W"
    flooded = options.x_in is None and options.y_max is None
    least = LEAST_FILM * scales.warm_film**2 / scales.film_estimate if flooded else 0.0
    if not least <= h_c <= MOST_FILM * scales.film_estimate:
        return f"no solution: its film is {h_c / scales.film_estimate:.3g} times its formula"
    wedge = scales.film_estimate * math.sqrt(c.R_y / c.R_x) * scales.hertz.b / scales.hertz.a
    estimate = scales.hertz.p_max / (1.0 + wedge)
    if not CORE[0] * estimate <= core <= CORE[1] * scales.hertz.p_max:
        return f"no solution: the pressure of its core is {core / estimate:.3g} times its estimate"
    return ""


def least_film(problem: ContactProblem, it: Iteration) -> tuple[float, int]:
    """Minimum film of the grid [b^2/R_x] and its line, counted from the axis.

    Over lines whose contact edge holds a cell per inlet length: under high load the outermost have no meaningful film.
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


def pressure_core(x: Array, pressure: Array, area: Array) -> tuple[float, float]:
    """Largest pressure [Pa] and area [m2] of the Hertz-shaped pressure with the integrals of p^2 and p^3 of a pressure.

    x (n_x,) [b]; pressure [Pa], area [m2] (n_y, n_x). Of the smoothed pressure: the spike depends on the nodes. Of
    p_0 sqrt(1 - r^2) over an ellipse of area A they are p_0^2 A/2 and 2 p_0^3 A/5.
    """
    smooth = _means_over(x, pressure, SMOOTHED_OVER)
    square, cube = (
        float(np.sum(area * smooth**power)) / fraction
        for power, fraction in zip((2, 3), SMOOTHED_HERTZ, strict=True)
    )
    largest = 1.25 * cube / square
    return largest, 2.0 * square / largest**2


def resistance_of_cells(x: Array, pressure: Array, gap: Array, width: Array) -> Array:
    """Integral of h dp/dx dA [N] of each step along each line (n_y, n_x-1).

    Pressure [Pa], gap [m] (n_y, n_x), width of the lines [m] (n_y,). With the gap of the wedge flux the sum is the
    dissipation of the discrete pressure flow: 20 % from 129 to 257 nodes at M = 6e4, where the trapezoid doubles it.
    """
    faces = wedge_flux(wedge_weights(x), gap)
    faces[:, 0] = 0.5 * (gap[:, 0] + gap[:, 1])
    return np.asarray(width[:, None] * faces * np.diff(pressure, axis=1))


def resistance_beyond(
    x: Array, y: Array, gap: Array, R_x: float, R_y: float, shear: float, times: Any
) -> float:
    """Integral of h dp/dx dA [N] between a flooded domain and a larger one, `times` as far away.

    Far upstream p = c |x|/h^2, h parabolic above any offset, solves Reynolds' equation with c = 12 eta u_e/(3 + 2
    R_x/R_y); on a long ellipse dp/dx is the 12 eta u_e/h^2 of a line contact. The integral over rays from the centre is
    closed, and grows with the logarithm of `times`: a point contact in an endless bath has no finite rolling loss.
    Source: derived (test: quadrature); Kapitza 1955 for the pressure of a half Sommerfeld solution.
    x, y, gap (k,) [m]: border of the domain upstream, x <= 0; shear: eta u_e [N/m] of the oil that enters; times >= 1:
    float or (k,), distance of the border of the larger domain over that of this one.
    """
    c = 12.0 * shear / (3.0 + 2.0 * R_x / R_y)
    rise = 0.5 * (x * x / R_x + y * y / R_y)
    offset = gap - rise
    far = rise * times**2 + offset
    opening = np.log(far / gap)
    # h dp/dx = c (2 x^2/(R_x h^2) - 1/h), with dA = t dt |x dy - y dx| for points t (x, y)
    along = x * x / (R_x * rise**2) * (opening + offset * (1.0 / far - 1.0 / gap)) - 0.5 * opening / rise
    area = np.abs(x[:-1] * y[1:] - x[1:] * y[:-1])
    return float(np.sum(area * 0.5 * (along[1:] + along[:-1])) * c)


def _beyond_radius(problem: ContactProblem, gap: Array, cells: Array) -> float:
    """What the resistance [N] of a flooded domain lacks for oil to x = -R_x and y = +-R_x; beyond, it is left out."""
    grid, hertz, c = problem.geometry.grid, problem.scales.hertz, problem.given
    # the border upstream: the inlet, then the last line as far as x = 0
    side = np.append(grid.x[grid.x < 0.0], 0.0)[1:]
    x = hertz.b * np.concatenate((np.full(grid.y.size, grid.x[0]), side))
    y = hertz.a * np.concatenate((grid.y, np.full(side.size, grid.y[-1])))
    border = np.concatenate((gap[:, 0], np.interp(side, grid.x, gap[-1])))
    with np.errstate(divide="ignore"):
        times = np.minimum(c.R_x / np.abs(x), c.R_x / np.abs(y))
    shear = float(eta0(problem.oil, c.temperature)) * abs(c.u_e)
    lacking = 2.0 * resistance_beyond(x, y, border, c.R_x, c.R_y, shear, np.maximum(times, 1.0))
    half = 0.5 * grid.h_y
    inner, outer = np.abs(grid.y) - half, np.abs(grid.y) + half
    aside = np.clip((outer - c.R_x / hertz.a) / (outer - inner), 0.0, 1.0)
    upstream = np.clip((-c.R_x / hertz.b - grid.x[:-1]) / np.diff(grid.x), 0.0, 1.0)
    outside = np.maximum(upstream[None, :], aside[:, None])
    return lacking - float(np.sum(outside * cells))


def _means_over(x: Array, values: Array, length: float) -> Array:
    """Means of piecewise linear values (n_y, n_x) over x - length/2 to x + length/2 at the inner nodes."""
    steps = 0.5 * (values[:, 1:] + values[:, :-1]) * np.diff(x)
    total = np.concatenate((np.zeros((values.shape[0], 1)), np.cumsum(steps, axis=1)), axis=1)
    low, high = np.maximum(x - 0.5 * length, x[0]), np.minimum(x + 0.5 * length, x[-1])
    return np.array([np.interp(high, x, line) - np.interp(low, x, line) for line in total]) / (high - low)


def contact_integrals(problem: ContactProblem, it: Iteration) -> dict[str, float]:
    """Fields of ContactResult of a state whose flow is up to date; forces on the walls: Johnson & Cameron 1967."""
    hertz, grid, c, flow = problem.scales.hertz, problem.geometry.grid, problem.given, it.flow
    pressure = np.maximum(it.state.p, 0.0) * hertz.p_max
    gap = it.state.gap * problem.scales.h_unit
    area = grid.weights * (hertz.a * hertz.b)
    cells = resistance_of_cells(grid.x, pressure, gap, grid.width_y * hertz.a)
    flooded = problem.options.x_in is None and problem.options.y_max is None
    beyond = _beyond_radius(problem, gap, cells) if flooded else 0.0
    resistance = float(cells.sum()) + beyond
    inside = (grid.x[None, :] ** 2 + grid.y[:, None] ** 2 <= 1.0) * area
    if not inside.any():
        # nearly rigid bodies: the ellipse is smaller than the spacing
        inside[0, np.argmin(np.abs(grid.x))] = 1.0
    shear = compression = rise_mean = rise_smooth = 0.0
    temperature = c.temperature
    if it.temperature is not None:
        layers = trapezoid_weights(problem.options.n_z)
        shear = float(np.sum(area * (flow.shear @ layers)))
        compression = float(np.sum(area * ((flow.compression * it.temperature) @ layers)))
        hottest = it.temperature.max(axis=2) - c.temperature
        rise_mean = float(np.sum(inside * hottest) / np.sum(inside))
        rise_smooth = float(_means_over(grid.x, hottest, SMOOTHED_OVER).max())
        temperature = float(np.sum(inside * (it.temperature @ layers)) / np.sum(inside))
    core_pressure, core_area = pressure_core(grid.x, pressure, area)
    direction = float(np.sign(c.u_e))
    traction = -direction * float(np.sum(area * flow.traction_x))
    slip = problem.speeds.u_b - problem.speeds.u_a
    # the pressure flow adds to both walls the same stress, h/2 dp/dx, against the motion
    drag = -direction * 0.5 * resistance
    return {
        "rolling_resistance": resistance, "resistance_beyond": beyond, "rolling_loss": abs(c.u_e) * resistance,
        "traction_force": traction, "sliding_heat": float(np.sum(area * (flow.traction_x * slip))),
        "traction_force_1": drag - traction, "traction_force_2": drag + traction,
        "shear_heat": shear, "compression_heat": compression, "mean_temperature": temperature,
        "temperature_rise_mean": rise_mean, "temperature_rise_smooth": rise_smooth,
        "core_pressure": core_pressure, "core_area": core_area,
    }  # fmt: skip
