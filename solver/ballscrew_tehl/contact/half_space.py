"""The bodies as half-spaces: deflection, the dry (Hertz) contact by it, and surface temperature under a heat flux.

Dense along rolling, by cosine transform across.

Integrals over the cells of a line of a density that depends on s = x - x' only come from panels of polynomials: the
integral over cell k is P(x_i - edge_k) - P(x_i - edge_k+1) with one primitive P per distance between lines, a
polynomial on each panel of s. Tables are linear in the density: the transform across is done on them, the cells are
integrated mode by mode.
"""

from functools import cached_property, lru_cache

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from ..compiled import kernel
from .grid import TINY, Array, Grid

#: Gauss points of a panel; the primitive is a polynomial of this degree, written out in cell_integrals
POINTS = 10
SHARE = 0.4  # length of a panel in units of its distance from the singular point
CUT = 40.0  # exponentials of less than -CUT are taken as zero
#: rule for one piece of a strip
STRIP_NODES, STRIP_WEIGHTS = (np.array(v) for v in legendre.leggauss(6))
#: length of a piece in the exponent, and pieces per unit of t: error 1e-8 of the largest value of a line at its nodes
PIECE_DECAY, PIECES_PER_T = 3.0, 0.7
INNERMOST = 1e-3  # panels of a line's own strip begin at this share of the shortest distance
#: change of pressure [p_max] that ends iterations for p >= 0: of the dry contact and of the edge of cavitation
PRESSURE_TOLERANCE = 1e-9


def _antiderivative(nodes: Array) -> Array:
    """Matrix from values at nodes on -1..1 to the powers of the integral from -1 of the polynomial through them."""
    order = np.arange(1, nodes.size + 1)[:, None]
    terms = np.linalg.inv(np.vander(nodes, increasing=True)) / order
    return np.vstack((-np.sum((-1.0) ** order * terms, axis=0), terms))


NODES = legendre.leggauss(POINTS)[0]
POWERS = _antiderivative(NODES)


def panel_breaks(start: float, end: float, scale: float, share: float, decay: float = 0.0) -> Array:
    """Borders of panels from start >= 0 to beyond end, at most share*max(s, scale) long, 4/decay while that counts."""
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
    """Panels and values on both sides of s = 0, up on s < 0 as far as it goes; middle: on -breaks[0]..breaks[0] > 0."""
    n, middle = len(up), down[:0] if middle is None else middle
    mirrored = -breaks[n::-1][: n + len(middle)]
    return np.concatenate((mirrored, breaks)), np.concatenate((up[::-1, ::-1], middle, down))


def panel_primitive(breaks: Array, density: Array) -> Array:
    """Powers (panels, POINTS+1, columns), on -1..1 of a panel, of the integral of (panels, POINTS, columns)."""
    table = np.matmul(POWERS, density)
    table *= 0.5 * np.diff(breaks)[:, None, None]
    # value at the right end of each panel starts the next
    table[1:, 0] += np.cumsum(table.sum(axis=1), axis=0)[:-1]
    return table


@kernel
def cell_integrals(x, edges, sign, breaks, table, own, out):
    """out (columns, nx, nx) = own + sign*(P(sign*(x_i - e_k)) - P(sign*(x_i - e_k+1))); P = 0 below breaks[0]."""
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


def own_influence(x: Array, edges: Array, h_y: float) -> Array:
    """Integral of 1/r over each cell of a line, seen from its nodes (nx, nx), by the corner terms of Love 1929 [b]."""
    s, y = edges - x[:, None], 0.5 * h_y
    r = np.hypot(s, y)
    # y (ln(s + r) - ln y), odd in s, at the border of the strip; x ln(y+r) in its middle
    border = s * np.log(y + r) + np.copysign(y * np.log((np.abs(s) + r) / y), s)
    middle = s * np.log(np.where(s == 0.0, 1.0, np.abs(s)))
    # the strip is twice its upper half
    return 2.0 * np.diff(border - middle, axis=1)


def distance_modes(n_y: int) -> Array:
    """Cosine transform (modes, distances) of an even kernel of period 4(n_y-1)."""
    modes = np.arange(2 * n_y - 1)
    transform = np.cos(np.pi * np.outer(modes, modes) / (modes.size - 1))
    transform[:, 1:-1] *= 2.0
    return transform


def line_modes(n_y: int) -> tuple[Array, Array]:
    """Transforms of an even field on lines 0..n_y-1 to its modes (modes, n_y) and back (n_y, modes)."""
    n = 2 * (n_y - 1)
    angle = np.pi * np.outer(np.arange(n + 1), np.arange(n_y)) / n
    fraction = np.full(n + 1, 1.0 / n)
    fraction[[0, -1]] *= 0.5
    forward, backward = np.cos(angle), np.cos(angle).T * fraction
    forward[:, 1:] *= 2.0
    return forward, backward


@kernel
def convolve(forward, modes, backward, field):
    """Field (n_y, n_x) in the precision of the modes, convolved: see LineConvolution."""
    rows = np.dot(forward, field)
    for m in range(len(modes)):
        rows[m] = np.dot(modes[m], rows[m])
    return np.dot(backward, rows)


class LineConvolution:
    """Convolution across (Toeplitz in y, even) with dense influence along x: out = sum_l K[|j-l|] f_l.

    Lines 0..n_y-1 of an even field whose last line is zero; hat: transform (modes, nx, nx) by distance_modes of the
    influence K (2 n_y - 1, nx, nx), one matrix per distance in lines; same_line: K[0].
    """

    def __init__(self, hat: Array, same_line: Array, n_y: int) -> None:
        self._hat, self.same_line = hat, same_line
        self._forward, self._backward = line_modes(n_y)

    @cached_property
    def single(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """Forward, modes and backward in single precision."""
        single = np.float32
        return self._forward.astype(single), self._hat.astype(single), self._backward.astype(single)

    def __call__(self, field: Array) -> Array:
        """Convolve field (n_y, nx), zero on the last line."""
        return np.asarray(convolve(self._forward, self._hat, self._backward, field))

    def rough(self, field: Array) -> Array:
        """The same in single precision, 1e-6 of the largest value: half the memory traffic, for increments."""
        return np.asarray(convolve(*self.single, field.astype(np.float32)).astype(np.float64))


def mode_operator(grid: Grid, sign: float, breaks: Array, density: Array, own: Array) -> LineConvolution:
    """Operator of densities (panels, points, distances 1, 2, ...) at panel_nodes(breaks); own: of a line on itself."""
    modes = distance_modes(grid.y.size)
    table = panel_primitive(breaks, density @ modes[:, 1 : density.shape[2] + 1].T)
    hat = np.empty((len(modes), grid.x.size, grid.x.size))
    cell_integrals(grid.x, grid.cell_edges_x, sign, breaks, table, own, hat)
    return LineConvolution(hat, own, grid.y.size)


def deflection_operator(grid: Grid, kappa: float, factor: float) -> LineConvolution:
    """Deflection [b^2/R_x]: factor 2 p_max a R_x/(pi E' b^2) * double integral of P/sqrt(dX^2 + (dY/kappa)^2)."""
    h_y, scale = grid.h_y / kappa, factor * kappa
    half = panel_breaks(0.0, grid.length_x, 0.5 * h_y, SHARE, np.inf)
    s = panel_nodes(half)[:, :, None]
    # integral of 1/r across a strip
    y = (np.arange(grid.n_distance) + 0.5) * h_y
    density = scale * np.diff(np.log(y + np.sqrt(s * s + y * y)))
    own = scale * own_influence(grid.x, grid.cell_edges_x, h_y)
    return mode_operator(grid, 1.0, *both_sides(half, density, density), own)


def dry_contact(
    grid: Grid, undeformed: Array, deflection: LineConvolution, load: float
) -> tuple[Array, float]:
    """Pressure (n_y, n_x) and approach of a load without a film: conjugate gradients of Polonsky & Keer 1999."""
    weights, inside = grid.weights, np.zeros_like(undeformed, dtype=bool)
    inside[grid.inner] = True
    p = np.sqrt(np.maximum(0.0, 1.0 - grid.x[None, :] ** 2 - grid.y[:, None] ** 2)) * inside
    p *= load / np.sum(weights * p)
    direction, g_old, fresh = np.zeros_like(p), 1.0, 0.0
    for _ in range(p.size):
        contact = p > 0.0
        gap = undeformed + deflection(p)
        gap -= float(np.sum((weights * gap)[contact]) / np.sum(weights[contact]))
        g_new = float(np.sum((weights * gap * gap)[contact]))
        direction = np.where(contact, gap + fresh * (g_new / g_old) * direction, 0.0)
        g_old = g_new
        image = deflection(direction)
        image -= np.sum((weights * image)[contact]) / np.sum(weights[contact])
        curvature = float(np.sum((weights * image * direction)[contact]))
        step = float(np.sum((weights * gap * direction)[contact])) / curvature
        p_new = np.maximum(p - step * direction, 0.0) * inside
        overlap = inside & (p_new == 0.0) & (gap < 0.0)
        fresh = 0.0 if overlap.any() else 1.0
        p_new[overlap] = -step * gap[overlap]
        p_new *= load / np.sum(weights * p_new)
        change = float(np.max(np.abs(p_new - p)))
        p = p_new
        if not change > PRESSURE_TOLERANCE:
            break
    gap = undeformed + deflection(p)
    return p, -float(gap[p > 0.0].mean())


@kernel
def strips(s, y, beta, nodes, weights, out):
    """out (s.size, y.size-1) = integral over y_d..y_d+1 of exp(beta (s - r))/r, r^2 = s^2 + y^2; s, beta, y >= 0."""
    # with y = s sinh t, dy/r = dt: no singularity; in pieces short against the exponent and against the range of t
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
    s = panel_nodes(half)
    down = _strips(s, y, speed)
    down = down[:, :, : np.count_nonzero(down.any(axis=(0, 1)))]
    n = np.count_nonzero(2.0 * speed * s[:, 0] <= CUT)
    return both_sides(half, down, down[:n] * np.exp(-2.0 * speed * s[:n, :, None]), middle)


def own_line(x: Array, edges: Array, h_y: float, beta: float) -> Array:
    """Influence (nx, nx) of the cells of a line on its nodes; near 0 a strip is exp(beta s) (constant - 2 ln|s|)."""
    speed, strip = abs(beta), np.array([0.0, 0.5 * h_y])
    first = INNERMOST * min(float(np.min(np.diff(x))), h_y, 1.0 / max(speed, TINY))
    half = panel_breaks(first, float(x[-1] - x[0]), 0.0, 1.5 * SHARE, 2.0 * speed)
    # half of the mean strip on 0..epsilon and, with minus, on -epsilon..0
    c = 0.5 * speed * first
    constant = _strips(half[:1], strip, speed)[0, 0] * np.exp(-2.0 * c)
    plus, minus = (constant * (1.0 + v) + 1.0 + 0.5 * v for v in (c, -c))
    middle = 0.5 * (plus + minus) + (plus - minus) * NODES
    breaks, density = _panels(half, strip, speed, middle[None, :, None])
    table, out = panel_primitive(breaks, 2.0 * density), np.empty((1, x.size, x.size))
    cell_integrals(x, edges, np.copysign(1.0, beta), breaks, table, np.zeros(out.shape[1:]), out)
    return out[0]


# both walls of one grid: it is solved with half the layers and with all, without damping and with it
@lru_cache(maxsize=2)
def wall_operator(
    grid: Grid, kappa: float, semi_axis: float, speed: float, conductivity: float, diffusivity: float
) -> LineConvolution:
    """Heat flux [W/m2] to surface rise [K]: semi_axis b [m], kappa = b/a, speed along X [m/s], diffusivity [m2/s].

    T - T0 = 1/(2 pi k) double integral of q exp[-(|u| r - u (x-x'))/(2 chi)]/r, a moving point source at any speed:
    Carslaw & Jaeger 1959, section 10.7. The printed fast-source integral of the paper is its limit for large u b/chi.
    """
    beta = float(speed * semi_axis / (2.0 * diffusivity))
    scale, h_y = semi_axis / (2.0 * np.pi * conductivity), grid.h_y / kappa
    own = scale * own_line(grid.x, grid.cell_edges_x, h_y, beta)
    half = panel_breaks(0.0, grid.length_x, 0.5 * h_y, SHARE, 2.0 * abs(beta))
    breaks, density = _panels(half, np.arange(0.5, grid.n_distance) * h_y, abs(beta))
    return mode_operator(grid, np.copysign(1.0, beta), breaks, scale * density, own)
