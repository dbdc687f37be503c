"""What friction needs of a solved contact: integrals over its grid, means over the Hertz ellipse X^2 + Y^2 <= 1."""

from typing import Any

import numpy as np

from ..physics.lubricant import eta0
from .film.flow import trapezoid_weights
from .film.fluxes import wedge_flux, wedge_weights
from .half_space.grid import Array
from .problem import ContactProblem, Iteration

#: length over which temperatures are averaged for the smoothed maximum, and pressures for the core [b]: wider than a
#: pressure spike, whose height depends on where it lies between the nodes
SMOOTHED_OVER = 0.2
#: integrals of p^2 and p^3 of a smoothed Hertz pressure over those of the pressure itself (test: by quadrature)
SMOOTHED_HERTZ = 0.98808, 0.98627


def pressure_core(x: Array, pressure: Array, area: Array) -> tuple[float, float]:
    """Largest pressure [Pa] and area [m2] of the Hertz-shaped pressure with the integrals of p^2 and p^3 of a pressure.

    x (n_x,) [b]; pressure [Pa], area [m2] (n_y, n_x). The integrals leave out the slope in front of a thick film, and
    are taken of the smoothed pressure: those of the spike depend on the nodes. Of p_0 sqrt(1 - r^2) over an ellipse of
    area A they are p_0^2 A/2 and 2 p_0^3 A/5.
    """
    smooth = _means_over(x, pressure, SMOOTHED_OVER)
    square, cube = (
        float(np.sum(area * smooth**power)) / share
        for power, share in zip((2, 3), SMOOTHED_HERTZ, strict=True)
    )
    largest = 1.25 * cube / square
    return largest, 2.0 * square / largest**2


def resistance_of_cells(x: Array, pressure: Array, gap: Array, width: Array) -> Array:
    """Integral of h dp/dx dA [N] of each step along each line (n_y, n_x-1).

    Lines of pressure [Pa], gap [m] (n_y, n_x) and width [m] (n_y,). With the gap of the wedge flux the sum is the
    dissipation of the discrete pressure flow; by the trapezoid the loss of a circle at M = 6e4 is almost twice as large
    on 129 nodes. Still 20 % from 129 to 257 nodes there, 1 % at M = 1e4.
    """
    faces = wedge_flux(wedge_weights(x), gap)
    faces[:, 0] = 0.5 * (gap[:, 0] + gap[:, 1])
    return np.asarray(width[:, None] * faces * np.diff(pressure, axis=1))


def resistance_beyond(
    x: Array, y: Array, gap: Array, R_x: float, R_y: float, shear: float, times: Any
) -> float:
    """Integral of h dp/dx dA [N] between a flooded domain and a larger one, `times` as far away.

    Far upstream the film of a point contact carries p = c |x|/h^2, h parabolic above any offset, which solves Reynolds'
    equation with c = 12 eta u_e/(3 + 2 R_x/R_y); on a long ellipse dp/dx is the 12 eta u_e/h^2 of a line contact. The
    integral over rays from the centre is closed, with the offset of the gap where a ray leaves the domain. It grows
    with the logarithm of `times` without bound: a point contact in an endless bath has no finite rolling loss. Source:
    derived (test: quadrature); Kapitza 1955 for the pressure of a half Sommerfeld solution.

    x, y, gap (k,) [m]: nodes on the border of the domain upstream, x <= 0; shear: eta u_e [N/m] of the oil that enters;
    times >= 1: float or (k,), distance of the border of the larger domain over that of this one.
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
