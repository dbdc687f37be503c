"""Surface temperature of a half-space under a steady heat flux that it moves past (moving point source).

T - T0 = 1/(2 pi k) double integral of q exp[-(|u| r - u (x-x'))/(2 chi)]/r: Carslaw & Jaeger 1959, section 10.7; any
speed, zero included. The printed fast-source integral of the paper is its limit for large u b/chi.
"""

import numpy as np

from ...compiled import kernel
from .deflection import (
    CUT,
    NODES,
    SHARE,
    LineConvolution,
    both_sides,
    cell_integrals,
    mode_operator,
    panel_breaks,
    panel_nodes,
    panel_primitive,
)
from .grid import TINY, Array, Grid

#: rule for one piece of a strip
STRIP_NODES, STRIP_WEIGHTS = (np.array(v) for v in np.polynomial.legendre.leggauss(6))
#: length of a piece in the exponent, and pieces per unit of t: with them the error is 1e-8 of the
#: largest value that a line has at its own nodes, and 1e-5 of any value down to 1e-10 of that
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
    out = np.empty((s.size, y.size - 1))
    strips(s.ravel(), y, speed, STRIP_NODES, STRIP_WEIGHTS, out)
    return out.reshape(*s.shape, -1)


def _fading(s: Array, down: Array, speed: float) -> Array:
    """Strips upstream from those downstream at panel nodes s, on the panels where they count."""
    n = np.count_nonzero(2.0 * speed * s[:, 0] <= CUT)
    return down[:n] * np.exp(-2.0 * speed * s[:n, :, None])


def own_line(x: Array, edges: Array, h_y: float, beta: float) -> Array:
    """Influence (nx, nx) of the cells of a line on its nodes.

    Panels in a geometric series down to a small epsilon, within which a strip is exp(beta s) (constant - 2 ln|s|).
    """
    speed, strip = abs(float(beta)), np.array([0.0, 0.5 * h_y])
    first = INNERMOST * min(float(np.min(np.diff(x))), h_y, 1.0 / max(speed, TINY))
    half = panel_breaks(first, float(x[-1] - x[0]), 0.0, 1.5 * SHARE, 2.0 * speed)
    s = panel_nodes(half)
    down = 2.0 * _strips(s, strip, speed)
    # mean strip on 0..epsilon and, with minus, on -epsilon..0
    c = 0.5 * speed * first
    constant = 2.0 * _strips(half[:1], strip, speed)[0, 0] * np.exp(-2.0 * c)
    plus, minus = (constant * (1.0 + v) + 2.0 + v for v in (c, -c))
    middle = 0.5 * (plus + minus) + (plus - minus) * NODES
    breaks, density = both_sides(half, down, _fading(s, down, speed), middle[None, :, None])
    out = np.empty((1, x.size, x.size))
    sign = np.copysign(1.0, beta)
    cell_integrals(x, edges, sign, breaks, panel_primitive(breaks, density), np.zeros(out.shape[1:]), out)
    return out[0]


def wall_strips(length: float, h_y: float, n_distance: int, beta: float) -> tuple[Array, Array]:
    """Panels of s/sign(beta) and on them the strips of lines 1, 2, ... away that count, for mode_operator."""
    speed = abs(float(beta))
    half = panel_breaks(0.0, length, 0.5 * h_y, SHARE, 2.0 * speed)
    s = panel_nodes(half)
    down = _strips(s, np.array([(d + 0.5) * h_y for d in range(n_distance)]), speed)
    down = down[:, :, : np.count_nonzero(down.any(axis=(0, 1)))]
    return both_sides(half, down, _fading(s, down, speed))


def wall_operator(
    grid: Grid, kappa: float, semi_axis: float, speed: float, conductivity: float, diffusivity: float
) -> LineConvolution:
    """Operator from heat flux [W/m2] on the grid to surface temperature rise [K].

    semi_axis b [m], kappa = b/a, speed of the surface along X [m/s], conductivity [W/mK], diffusivity chi [m2/s].
    """
    beta = speed * semi_axis / (2.0 * diffusivity)
    scale, h_y = semi_axis / (2.0 * np.pi * conductivity), grid.h_y / kappa
    own = scale * own_line(grid.x, grid.cell_edges_x, h_y, beta)
    breaks, density = wall_strips(grid.length_x, h_y, grid.n_distance, beta)
    return mode_operator(grid, np.copysign(1.0, beta), breaks, scale * density, own)
