"""What friction needs of a solved contact: integrals and means over its grid, of the film without the asperities.

Areas count the halves of a mirrored contact twice. The contact is the Hertz ellipse X^2 + Y^2 <= 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .half_space.grid import TINY, Array
from .problem import ContactProblem, Iteration

#: length over which temperatures are averaged for the smoothed maximum [b]: wider than a pressure spike
SMOOTHED_OVER = 0.2


class ContactIntegrals(NamedTuple):
    """Integrals of one solution.

    rolling_resistance: integral of h dp/dx dA [N]; rolling_loss: u_e times that, what pure rolling costs [W];
    traction_force_1, _2: film on the surfaces of the bodies along rolling [N]; shear_heat: by sliding and by the
    pressure flow [W]; compression_heat [W]; mean_temperature of the film over contact and thickness [K];
    mean_viscosity: of the sheared film, geometric mean over the contact [Pa s]; temperature_rise_mean and
    temperature_rise_smooth: of the film's hottest level, mean over the contact and largest mean over SMOOTHED_OVER [K].
    """

    rolling_resistance: float
    rolling_loss: float
    traction_force_1: float
    traction_force_2: float
    shear_heat: float
    compression_heat: float
    mean_temperature: float
    mean_viscosity: float
    temperature_rise_mean: float
    temperature_rise_smooth: float


def rolling_resistance(pressure: Array, gap: Array, width: Array) -> float:
    """Integral of h dp/dx dA [N]: lines of pressure [Pa], gap [m] (n_y, n_x) as wide as width (n_y,) [m].

    By the trapezoid of the gap over every step of the pressure: exact for a gap that is linear between two nodes.
    """
    steps = 0.5 * (gap[:, 1:] + gap[:, :-1]) * np.diff(pressure, axis=1)
    return float(np.sum(width * steps.sum(axis=1)))


def walls(u_e: float, traction_force: float, rolling_resistance: float) -> dict[str, float]:
    """Forces on the walls: the pressure flow adds to both the same stress, h/2 dp/dx, against the motion.

    traction_force: of mid-film on body 2, as in ContactSolution.
    Source       Johnson & Cameron 1967
    """
    drag = -float(np.sign(u_e)) * 0.5 * rolling_resistance
    return {"traction_force_1": -traction_force + drag, "traction_force_2": traction_force + drag}


def _means_over(x: Array, values: Array, length: float) -> Array:
    """Means of piecewise linear values (n_y, n_x) over x - length/2 to x + length/2 at the inner nodes."""
    steps = 0.5 * (values[:, 1:] + values[:, :-1]) * np.diff(x)
    total = np.concatenate((np.zeros((values.shape[0], 1)), np.cumsum(steps, axis=1)), axis=1)
    low, high = np.maximum(x - 0.5 * length, x[0]), np.minimum(x + 0.5 * length, x[-1])
    return np.array([np.interp(high, x, line) - np.interp(low, x, line) for line in total]) / (high - low)


def contact_integrals(problem: ContactProblem, it: Iteration, traction_force: float) -> ContactIntegrals:
    """Integrals of a state whose flow is up to date; traction_force: of mid-film on body 2, as in ContactSolution."""
    hertz, grid, c, flow = problem.scales.hertz, problem.geometry.grid, problem.given, it.flow
    pressure = np.maximum(problem.film_pressure(it.state), 0.0) * hertz.p_max
    gap = it.state.gap * problem.scales.h_unit
    width = np.full(grid.y.size, grid.h_y * hertz.a)
    if grid.mirror:
        width[1:] *= 2.0
    resistance = rolling_resistance(pressure, gap, width)
    area = grid.weights * (hertz.a * hertz.b)
    inside = (grid.x[None, :] ** 2 + grid.y[:, None] ** 2 <= 1.0) * area
    if not inside.any():
        # nearly rigid bodies: the ellipse is smaller than the spacing
        inside[problem.geometry.axis, np.argmin(np.abs(grid.x))] = 1.0
    shear = compression = rise_mean = rise_smooth = 0.0
    temperature = problem.given.temperature
    layers = np.full(problem.options.n_z + 1, 1.0 / problem.options.n_z)
    layers[[0, -1]] *= 0.5
    if it.temperature is not None:
        shear = float(np.sum(area * (flow.shear @ layers)))
        compression = float(np.sum(area * ((flow.compression * it.temperature) @ layers)))
        hottest = it.temperature.max(axis=2) - problem.given.temperature
        rise_mean = float(np.sum(inside * hottest) / np.sum(inside))
        rise_smooth = float(_means_over(grid.x, hottest, SMOOTHED_OVER).max())
        temperature = float(np.sum(inside * (it.temperature @ layers)) / np.sum(inside))
    # viscosity that carries the stress of sliding at its shear rate
    viscosity = gap / np.maximum(flow.fluidity, TINY)
    sheared = np.exp(np.sum(inside * np.log(np.maximum(viscosity, TINY))) / np.sum(inside))
    return ContactIntegrals(
        rolling_resistance=resistance,
        rolling_loss=abs(c.u_e) * resistance,
        **walls(c.u_e, traction_force, resistance),
        shear_heat=shear,
        compression_heat=compression,
        mean_temperature=temperature,
        mean_viscosity=float(sheared),
        temperature_rise_mean=rise_mean,
        temperature_rise_smooth=rise_smooth,
    )
