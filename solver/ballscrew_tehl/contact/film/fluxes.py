"""Fluxes of the Reynolds equation through the faces of its finite volumes.

Fields are (n_y, n_x); line 0 is the line of symmetry Y = 0; the last line and the first and last column carry P = 0.

Poiseuille flux at a face: e dP/dX with e = H_f^3 phi_f, H_f the mean gap and phi_f the logarithmic mean of the nodal
fluidity: exact where ln(viscosity) is linear in pressure between both. Wedge flux: g H, quadratic through two nodes
upstream and one downstream. The outermost face across may be open: P of the last line is zero for the deflection,
its flux is that of a pressure that falls with a power of the gap.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import kernel
from ..grid import Array
from ..half_space import PRESSURE_TOLERANCE

#: power of the gap with which pressure falls beyond the last line: 3/2 on a long ellipse, 2 on a circle
FAR_POWER = 1.75
EDGE_RELAXATION = 1.5  # over-relaxation of settle_edge


class Mesh(NamedTuple):
    """Nodes x and cell widths (n_x,), kappa/h_y across, whether the side is open, wedge: weights of wedge_weights."""

    x: Array
    width: Array
    kappa_h: float
    open_side: bool
    wedge: Array


class Faces(NamedTuple):
    """Fluxes at faces flow_x (n_y, n_x-1), flow_y (n_y-1, n_x), Poiseuille minus wedge, and derivatives of the former.

    c_x (4, n_y, n_x-1), c_y (5, n_y-1, n_x): conductance (flux per difference of P), derivatives to ln phi of the nodes
    before and behind, to both gaps along x (the same), to the gaps before and behind across.
    """

    flow_x: Array
    flow_y: Array
    c_x: Array
    c_y: Array


def log_mean(s_left: Array, s_right: Array) -> tuple[Array, Array, Array]:
    """Logarithmic mean of exp(s_left), exp(s_right) and its log-derivatives to both."""
    d = s_right - s_left
    near = np.abs(d) < 1e-3
    far = np.where(near, 1.0, d)
    growth = np.expm1(far)
    # series for small differences
    mean = np.exp(s_left) * np.where(near, 1.0 + d * (0.5 + d * (1.0 + 0.25 * d) / 6.0), growth / far)
    w_right = np.where(near, 0.5 + d / 12.0, 1.0 + 1.0 / growth - 1.0 / far)
    return mean, 1.0 - w_right, w_right


def lifted_gap(h: Array, floor: float) -> tuple[Array, Array]:
    """Gap for the flow and its derivative: h above the floor, else floor*exp(h/floor - 1): iterates may overlap."""
    if h.min() >= floor:
        return h, np.ones_like(h)
    # bounded: the exponential must not vanish, it is divided by
    lifted = floor * np.exp(np.clip(h / floor - 1.0, -100.0, 0.0))
    return np.where(h >= floor, h, lifted), np.where(h >= floor, 1.0, lifted / floor)


def cube_across(h: Array, open_side: bool) -> tuple[Array, Array, Array]:
    """Cube of the harmonic mean gap between the lines of h (n_y, n_x), log-derivatives to both gaps (n_y-1, n_x)."""
    h_0, h_1 = h[:-1], h[1:]
    cube = (2.0 * h_0 * h_1 / (h_0 + h_1)) ** 3
    d_0, d_1 = 3.0 * h_1 / ((h_0 + h_1) * h_0), 3.0 * h_0 / ((h_0 + h_1) * h_1)
    if open_side:
        far = np.minimum(h_0[-1] / h_1[-1], 1.0) ** FAR_POWER
        left = 1.0 - far
        cube[-1] *= left
        steep = np.where(left > 0.0, FAR_POWER * far / np.where(left > 0.0, left, 1.0), 0.0)
        d_0[-1] -= steep / h_0[-1]
        d_1[-1] += steep / h_1[-1]
    return cube, d_0, d_1


def wedge_weights(x: Array) -> Array:
    """Weights (3, n_x-1) of the nodes i, i-1, i+1 at face i+1/2: quadratic through them (QUICK, Leonard 1979)."""
    weights = np.zeros((3, x.size - 1))
    weights[0, 0] = 1.0
    left, dx = np.diff(x)[:-1], np.diff(x)[1:]
    weights[2, 1:] = 0.5 * (left + 0.5 * dx) / (left + dx)
    weights[1, 1:] = -0.25 * dx * dx / (left * (left + dx))
    weights[0, 1:] = 1.0 - weights[1, 1:] - weights[2, 1:]
    return weights


def wedge_flux(weights: Array, carried: Array) -> Array:
    """Flux (n_y, n_x-1) at the faces of what the surfaces carry at the nodes (n_y, n_x)."""
    flux = weights[0] * carried[:, :-1] + weights[2] * carried[:, 1:]
    flux[:, 1:] += weights[1, 1:] * carried[:, :-2]
    return flux


def face_fluxes(mesh: Mesh, p: Array, gap: Array, ln_phi: Array, g: Array, floor: float) -> Faces:
    """Fluxes at the faces of a state and their derivatives; floor: gap below which the flow is that of a lifted one."""
    h, dh = lifted_gap(0.5 * (gap[:, :-1] + gap[:, 1:]), floor)
    phi, w_l, w_r = log_mean(ln_phi[:, :-1], ln_phi[:, 1:])
    e = h * h * h * phi / np.diff(mesh.x)
    flow_x = e * np.diff(p, axis=1)
    c_x = np.array([e, flow_x * w_l, flow_x * w_r, 1.5 * flow_x * dh / h])
    flow_x -= wedge_flux(mesh.wedge, g * gap)
    h, dh = lifted_gap(gap, floor)
    cube, d_0, d_1 = cube_across(h, mesh.open_side)
    phi, w_l, w_r = log_mean(ln_phi[:-1], ln_phi[1:])
    e = cube * phi * mesh.kappa_h
    flow_y = e * np.diff(p, axis=0)
    c_y = np.array([e, flow_y * w_l, flow_y * w_r, flow_y * d_0 * dh[:-1], flow_y * d_1 * dh[1:]])
    return Faces(flow_x, flow_y, c_x, c_y)


def outflow_across(flow_y: Array) -> Array:
    """Flux out of lines 0 to n_y-2 to their neighbours, from faces (n_y-1, n_x, ...): odd over the line of symmetry."""
    return np.diff(flow_y, axis=0, prepend=-flow_y[:1])


def net_flow(mesh: Mesh, flow_x: Array, flow_y: Array) -> Array:
    """Divergence of the fluxes of the faces per unit area (n_y, n_x); zero on the outer edges."""
    out = np.zeros((flow_x.shape[0], flow_y.shape[1]))
    along = (flow_x[:-1, 1:] - flow_x[:-1, :-1]) / mesh.width[1:-1]
    out[:-1, 1:-1] = along + mesh.kappa_h * outflow_across(flow_y)[:, 1:-1]
    return out


def smaller(a: Array, b: Array) -> Array:
    """The smaller of two numbers of one sign, else 0."""
    return np.where(a * b <= 0.0, 0.0, np.where(np.abs(a) < np.abs(b), a, b))


def line_fluxes(width: Array, per_width: float, p: Array, flux_x: Array, flux_y: Array) -> Array:
    """Flux (n_y-1, n_x-1) through the faces of all lines by continuity; per_width: of flux_y."""
    lost = np.zeros((p.shape[0] - 1, p.shape[1] - 1))
    lost[:, 1:] = np.cumsum(width[1:-1] * per_width * outflow_across(flux_y)[:, 1:-1], axis=1)
    largest = np.arange(len(lost)), 1 + np.argmax(p[:-1, 1:-1], axis=1)
    return np.asarray((flux_x[largest] + lost[largest])[:, None] - lost)


@kernel
def settle_edge(mesh, faces, dln_phi, low, p, r):
    """Move the edge of cavitation on the nodes `low` at fixed gaps: p >= 0, net inflow r <= 0, p r = 0 (Cryer 1971)."""
    width, kappa_h, c_x, c_y = mesh.width, mesh.kappa_h, faces.c_x, faces.c_y
    ny, nx = p.shape
    for _ in range(nx):
        moved = 0.0
        for j in range(ny - 1):
            for i in range(1, nx - 1):
                if not low[j, i] or (p[j, i] <= 0.0 and r[j, i] <= 0.0):
                    continue
                double = 2.0 if j == 0 else 1.0
                by_phi = dln_phi[j, i]
                right = c_x[1, j, i] * by_phi - c_x[0, j, i]
                left = c_x[2, j, i - 1] * by_phi + c_x[0, j, i - 1]
                up = kappa_h * (c_y[1, j, i] * by_phi - c_y[0, j, i])
                diagonal = (right - left) / width[i] + double * up
                if j > 0:
                    down = kappa_h * (c_y[2, j - 1, i] * by_phi + c_y[0, j - 1, i])
                    diagonal -= down
                d = max(p[j, i] - EDGE_RELAXATION * r[j, i] / diagonal, 0.0) - p[j, i]
                p[j, i] += d
                moved = max(moved, abs(d))
                r[j, i] += diagonal * d
                r[j, i + 1] -= right / width[i + 1] * d
                r[j, i - 1] += left / width[i - 1] * d
                r[j + 1, i] -= up * d
                if j > 0:
                    r[j - 1, i] += (2.0 if j == 1 else 1.0) * down * d
        if not moved > PRESSURE_TOLERANCE:
            break
