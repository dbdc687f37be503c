"""Surface temperature of a half-space under a steady heat flux that it moves past (moving point source).

T - T0 = 1/(2 pi k) double integral of q exp[-(|u| r - u (x-x'))/(2 chi)]/r: Carslaw & Jaeger 1959, section 10.7; any
speed, zero included. The printed fast-source integral of the paper is its limit for large u b/chi.
"""

from functools import lru_cache

import numpy as np

from ...compiled import kernel
from . import deflection as panels
from .deflection import CUT, NODES, SHARE, LineConvolution
from .grid import TINY, Array, Grid

#: rule for one piece of a strip
STRIP_NODES, STRIP_WEIGHTS = (np.array(v) for v in np.polynomial.legendre.leggauss(6))
#: length of a piece in the exponent, and pieces per unit of t: error 1e-8 of the largest value of a line at its nodes
PIECE_DECAY, PIECES_PER_T = 3.0, 0.7
#: panels of a line's own strip begin at this share of the shortest distance
INNERMOST = 1e-3


@kernel
def strips(s, y, beta, nodes, weights, out):
    """out (s.size, y.size-1) = integral over y_d..y_d+1 of exp(beta (s - r))/r, r^2 = s^2 + y^2; s, beta, y >= 0.

    With y = s sinh t, dy/r = dt: no singularity; in pieces short against the exponent and against the range of t.
    """
    for n in range(s.size):
        decay = beta * s[n]
        t_1 = np.arcsinh(y[0] / s[n])
        for d in range(y.size - 1):
            t_0, t_1 = t_1, np.arcsinh(y[d + 1] / s[n])
            half = np.sinh(0.5 * t_0)
            # exponent at the near side, beta (r - s) = decay (cosh t - 1)
            nearest = 2.0 * decay * half * half
            if nearest > CUT:
                out[n, d:] = 0.0
                break
            end, span = t_1, 0.0
            if decay > 0.0:
                half = np.sinh(0.5 * t_1)
                span = min(2.0 * decay * half * half, CUT) - nearest
                end = min(t_1, 2.0 * np.arcsinh(np.sqrt(0.5 * CUT / decay)))
            pieces = 1 + int(span / PIECE_DECAY + PIECES_PER_T * (end - t_0))
            width = (end - t_0) / pieces
            total = 0.0
            for piece in range(pieces):
                for m in range(nodes.size):
                    e = np.exp(t_0 + width * (piece + 0.5 * (1.0 + nodes[m])))
                    total += weights[m] * np.exp(-0.5 * decay * (e - 1.0) * (e - 1.0) / e)
            out[n, d] = 0.5 * width * total


def _strips(s: Array, y: Array, speed: float) -> Array:
    """Strips between y (k+1,) downstream at s of any shape (..., k)."""
    out = np.empty((s.size, y.size - 1))
    strips(s.ravel(), y, speed, STRIP_NODES, STRIP_WEIGHTS, out)
    return out.reshape(*s.shape, -1)


def _panels(half: Array, y: Array, speed: float, middle: Array | None = None) -> tuple[Array, Array]:
    """Panels on both sides of s = 0 and on them the strips between y, those that count, for mode_operator."""
    s = panels.panel_nodes(half)
    down = _strips(s, y, speed)
    down = down[:, :, : np.count_nonzero(down.any(axis=(0, 1)))]
    n = np.count_nonzero(2.0 * speed * s[:, 0] <= CUT)
    return panels.both_sides(half, down, down[:n] * np.exp(-2.0 * speed * s[:n, :, None]), middle)


def own_line(x: Array, edges: Array, h_y: float, beta: float) -> Array:
    """Influence (nx, nx) of the cells of a line on its nodes; near 0 a strip is exp(beta s) (constant - 2 ln|s|)."""
    speed, strip = abs(beta), np.array([0.0, 0.5 * h_y])
    first = INNERMOST * min(float(np.min(np.diff(x))), h_y, 1.0 / max(speed, TINY))
    half = panels.panel_breaks(first, float(x[-1] - x[0]), 0.0, 1.5 * SHARE, 2.0 * speed)
    # half of the mean strip on 0..epsilon and, with minus, on -epsilon..0
    c = 0.5 * speed * first
    constant = _strips(half[:1], strip, speed)[0, 0] * np.exp(-2.0 * c)
    plus, minus = (constant * (1.0 + v) + 1.0 + 0.5 * v for v in (c, -c))
    middle = 0.5 * (plus + minus) + (plus - minus) * NODES
    breaks, density = _panels(half, strip, speed, middle[None, :, None])
    table, out = panels.panel_primitive(breaks, 2.0 * density), np.empty((1, x.size, x.size))
    panels.cell_integrals(x, edges, np.copysign(1.0, beta), breaks, table, np.zeros(out.shape[1:]), out)
    return out[0]


# both walls of one grid: it is solved with half the layers and with all, without damping and with it
@lru_cache(maxsize=2)
def wall_operator(
    grid: Grid, kappa: float, semi_axis: float, speed: float, conductivity: float, diffusivity: float
) -> LineConvolution:
    """Heat flux [W/m2] to surface rise [K]: semi_axis b [m], kappa = b/a, speed along X [m/s], diffusivity [m2/s]."""
    beta = float(speed * semi_axis / (2.0 * diffusivity))
    scale, h_y = semi_axis / (2.0 * np.pi * conductivity), grid.h_y / kappa
    own = scale * own_line(grid.x, grid.cell_edges_x, h_y, beta)
    half = panels.panel_breaks(0.0, grid.length_x, 0.5 * h_y, SHARE, 2.0 * abs(beta))
    breaks, density = _panels(half, np.arange(0.5, grid.n_distance) * h_y, abs(beta))
    return panels.mode_operator(grid, np.copysign(1.0, beta), breaks, scale * density, own)
