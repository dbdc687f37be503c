"""Surface temperature of a half-space under a steady heat flux that it moves past (moving point source).

T - T0 = 1/(2 pi k) double integral of q exp[-(|u| r - u (x-x'))/(2 chi)]/r: Carslaw & Jaeger 1959, section 10.7; any
speed, standing surface included. The printed fast-source integral of the paper is its limit for large u b/chi.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .elastic import LineConvolution
from .grid import Array, Grid

GAUSS_X, WEIGHT_X = (np.array(v) for v in np.polynomial.legendre.leggauss(3))
GAUSS_T, WEIGHT_T = (np.array(v) for v in np.polynomial.legendre.leggauss(10))


@njit(cache=True)
def _strip(s, y_0, y_1, beta, nodes, weights):
    """Integral over y_0..y_1 (0 <= y_0) of exp(-|beta| r + beta s)/r, r^2 = s^2 + y^2, with y = |s| sinh t.

    The substitution takes the singularity away: dy/r = dt. The range is cut where the exponent passes -40.
    """
    a = abs(s)
    decay = abs(beta) * a
    t_0, t_1 = np.arcsinh(y_0 / a), np.arcsinh(y_1 / a)
    # exponent decay*cosh(t) - beta*s <= 40 bounds t
    limit = 40.0 + beta * s
    if decay * np.cosh(t_0) > limit:
        return 0.0
    if decay > 0.0 and limit / decay > 1.0:
        t_1 = min(t_1, np.arccosh(limit / decay))
    half, middle = 0.5 * (t_1 - t_0), 0.5 * (t_1 + t_0)
    total = 0.0
    for m in range(nodes.size):
        t = middle + half * nodes[m]
        total += weights[m] * np.exp(beta * s - decay * np.cosh(t))
    return total * half


@njit(cache=True)
def wall_influence(x, edges, h_y, n_distance, beta, gx, wx, gt, wt):
    """Influence (n_distance, nx, nx): integral of exp(-|beta| r + beta (x-x'))/r over cell k, d lines away.

    All lengths in one unit; beta = u/(2 chi) times that unit, signed. The nearest cells are integrated with a
    quadratic substitution towards the singular point.
    """
    nx = x.size
    out = np.zeros((n_distance, nx, nx))
    for d in range(n_distance):
        for i in range(nx):
            for k in range(nx):
                lo, hi = x[i] - edges[k], x[i] - edges[k + 1]  # s = x - x', from lo down to hi
                total = 0.0
                for part in range(2):
                    # split at s = 0 so that every part lies on one side
                    if part == 0:
                        s_0, s_1 = max(lo, 0.0), max(hi, 0.0)
                    else:
                        s_0, s_1 = max(-hi, 0.0), max(-lo, 0.0)
                    if s_0 <= s_1:
                        continue
                    sign = 1.0 if part == 0 else -1.0
                    near = s_1 == 0.0
                    if beta * sign < 0.0 and 2.0 * abs(beta) * s_1 > 40.0:
                        continue
                    for m in range(gx.size):
                        v = 0.5 * (1.0 + gx[m])
                        if near:
                            s, w = s_0 * v * v, s_0 * v * wx[m]
                        else:
                            s, w = s_1 + (s_0 - s_1) * v, 0.5 * (s_0 - s_1) * wx[m]
                        if d == 0:
                            strip = 2.0 * _strip(sign * s, 0.0, 0.5 * h_y, beta, gt, wt)
                        else:
                            strip = _strip(sign * s, (d - 0.5) * h_y, (d + 0.5) * h_y, beta, gt, wt)
                        total += w * strip
                out[d, i, k] = total
    return out


def wall_operator(
    grid: Grid, kappa: float, semi_axis: float, speed: float, conductivity: float, diffusivity: float
) -> LineConvolution:
    """Operator from heat flux [W/m2] on the grid to surface temperature rise [K].

    semi_axis b [m], kappa = b/a, speed of the surface along X [m/s], conductivity [W/mK], diffusivity chi [m2/s].
    """
    beta = speed * semi_axis / (2.0 * diffusivity)
    n_distance = 2 * grid.y.size - 1
    influence = wall_influence(
        grid.x, grid.cell_edges_x, grid.h_y / kappa, n_distance, beta, GAUSS_X, WEIGHT_X, GAUSS_T, WEIGHT_T
    )
    return LineConvolution(influence * (semi_axis / (2.0 * np.pi * conductivity)), grid.y.size)


def uniform_strip_rise(
    x: Array, flux: float, speed: float, half_width: float, conductivity: float, diffusivity: float
) -> Array:
    """Fast-source limit behind the leading edge of a uniform band: 2 q sqrt(x/(pi rho c k u)) (Jaeger 1942) [K]."""
    rho_c = conductivity / diffusivity
    x = np.clip(np.asarray(x) + half_width, 0.0, None)
    return 2.0 * flux * np.sqrt(x / (np.pi * rho_c * conductivity * speed))
