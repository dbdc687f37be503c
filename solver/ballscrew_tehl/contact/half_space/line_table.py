"""Integrals over the cells of a line of a density that depends on s = x - x' only, from panels of polynomials.

The integral over cell k is P(x_i - edge_k) - P(x_i - edge_k+1) with one primitive P per distance between lines; P is
a polynomial on each panel of s. Tables are linear in the density, so the transform across is done on them and the
cells are integrated mode by mode; no matrix per distance is formed or transformed.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from ...compiled import kernel
from .grid import Array

#: Gauss points of a panel; the primitive is a polynomial of this degree, written out in cell_integrals
POINTS = 10
#: length of a panel in units of its distance from the singular point
SHARE = 0.4
#: exponentials of less than -CUT are taken as zero
CUT = 40.0


def _antiderivative() -> tuple[Array, Array]:
    """Gauss nodes on -1..1, and the matrix from values there to the powers of their integral from -1."""
    nodes, weights = legendre.leggauss(POINTS)
    powers = np.zeros((POINTS + 1, POINTS))
    for unit in np.eye(POINTS):
        # share of a Legendre polynomial in the values, by the rule, and the integral of it
        share = (np.flatnonzero(unit)[0] + 0.5) * weights * legendre.legval(nodes, unit)
        term = legendre.leg2poly(legendre.legint(unit, lbnd=-1))
        powers[: term.size] += np.outer(term, share)
    return nodes, powers


NODES, POWERS = _antiderivative()


def panel_breaks(start: float, end: float, scale: float, share: float, decay: float = 0.0) -> Array:
    """Borders of panels from start >= 0 to beyond end, each at most share*max(s, scale) long.

    And at most 4/decay as long as exp(-decay s) counts.
    """
    breaks = [start]
    while breaks[-1] <= end:
        s = breaks[-1]
        length = share * max(s, scale)
        breaks.append(s + (min(length, 4.0 / decay) if decay > 0.0 and decay * s <= CUT else length))
    return np.array(breaks)


def panel_nodes(breaks: Array) -> Array:
    """(panels, POINTS) Gauss nodes."""
    return 0.5 * (breaks[1:] + breaks[:-1])[:, None] + 0.5 * np.diff(breaks)[:, None] * NODES


def both_sides(breaks: Array, down: Array, up: Array, middle: Array | None = None) -> tuple[Array, Array]:
    """Panels on both sides of s = 0 from values at |s|: down on s > 0; up on s < 0, on as many panels as it has.

    middle : values on the panel -breaks[0]..breaks[0], which is there unless breaks[0] = 0.
    """
    n = len(up)
    if middle is None:
        return np.concatenate((-breaks[n:0:-1], breaks)), np.concatenate((up[::-1, ::-1], down))
    return np.concatenate((-breaks[n::-1], breaks)), np.concatenate((up[::-1, ::-1], middle, down))


def panel_primitive(breaks: Array, density: Array) -> Array:
    """Powers (panels, POINTS+1, columns) of the integral from breaks[0] of a density (panels, POINTS, columns).

    In the local coordinate -1..1 of each panel.
    """
    table = np.matmul(POWERS, density)
    table *= 0.5 * np.diff(breaks)[:, None, None]
    # value at the right end of each panel starts the next
    table[1:, 0] += np.cumsum(table.sum(axis=1), axis=0)[:-1]
    return table


@kernel
def cell_integrals(x, edges, sign, breaks, table, own, out):
    """out (columns, nx, nx) = own + sign*(P(sign*(x_i - e_k)) - P(sign*(x_i - e_k+1))); P = 0 below breaks[0].

    own : (nx, nx) added to every column. breaks must reach beyond the largest s.
    """
    nx, columns, last = x.size, table.shape[2], breaks.size - 2
    row = np.empty((nx + 1, columns))
    j = 0
    for i in range(nx):
        for k in range(nx + 1):
            s, value = sign * (x[i] - edges[k]), row[k]
            if s < breaks[0]:
                value[:] = 0.0
                continue
            while j < last and s >= breaks[j + 1]:
                j += 1
            while s < breaks[j]:
                j -= 1
            t = (2.0 * s - breaks[j] - breaks[j + 1]) / (breaks[j + 1] - breaks[j])
            c = table[j]
            c0, c1, c2, c3, c4, c5 = c[0], c[1], c[2], c[3], c[4], c[5]
            c6, c7, c8, c9, c10 = c[6], c[7], c[8], c[9], c[10]
            # the degree is written out (POINTS = 10): the columns stay in registers, twice as fast as a loop
            for m in range(columns):
                a = c7[m] + t * (c8[m] + t * (c9[m] + t * c10[m]))
                a = c3[m] + t * (c4[m] + t * (c5[m] + t * (c6[m] + t * a)))
                value[m] = c0[m] + t * (c1[m] + t * (c2[m] + t * a))
        for m in range(columns):
            for k in range(nx):
                out[m, i, k] = own[i, k] + sign * (row[k, m] - row[k + 1, m])
