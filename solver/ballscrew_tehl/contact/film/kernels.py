"""Compiled loops of the Reynolds equation: residual, Jacobian times vector, Jacobian of one line.

They use numpy and numba only, and neither check nor allocate per point. Fields are (n_y, n_x); line 0 is the mirror
line Y = 0; the last line and the first and last column carry P = 0.

Poiseuille flux at a face: e dP/dX with e = H_f^3 phi_f, H_f the mean gap and phi_f the logarithmic mean of the
nodal fluidity: exact where ln(viscosity) is linear in pressure between two nodes, which keeps the steep
piezoviscous inlet accurate on few points. Wedge flux: g H at the face by
the quadratic through two upstream nodes and one downstream. The outermost face across may be open: P of the last line
is zero for the deflection, its flux is that of a pressure that falls with a power of the gap.
"""

from __future__ import annotations

import numpy as np
from numba import njit

#: power of the gap with which pressure falls beyond the last line: 3/2 on a long ellipse, 2 on a circle
FAR_POWER = 1.75
#: over-relaxation of settle_edge, and the change of pressure [p_max] that ends it
EDGE_RELAXATION, EDGE_TOLERANCE = 1.5, 1e-9


@njit(cache=True, error_model="numpy")
def log_mean(s_left, s_right):
    """Logarithmic mean of exp(s_left), exp(s_right) and its log-derivatives to both."""
    d = s_right - s_left
    if abs(d) < 1e-3:
        # series: mean = exp((l+r)/2) (1 + d^2/24), weights 1/2 -+ d/12
        return np.exp(0.5 * (s_left + s_right)) * (1.0 + d * d / 24.0), 0.5 - d / 12.0, 0.5 + d / 12.0
    mean = np.exp(s_left) * np.expm1(d) / d
    w_right = 1.0 / (-np.expm1(-d)) - 1.0 / d
    return mean, 1.0 - w_right, w_right


@njit(cache=True, error_model="numpy")
def lifted_gap(h, floor):
    """Gap for the flow and its derivative: h above the floor, floor*exp(h/floor - 1) below (C1, positive).

    Lets Newton's method pass iterates that overlap; a converged gap is above the floor, where it is unchanged.
    """
    if h >= floor:
        return h, 1.0
    # bounded: the exponential must not vanish, it is divided by
    lifted = floor * np.exp(max(h / floor - 1.0, -100.0))
    return lifted, lifted / floor


@njit(cache=True, error_model="numpy")
def cube_across(h_0, h_1):
    """Cube of the gap between two lines and its logarithmic derivatives to both gaps.

    Harmonic mean: outside the ellipse the gap grows by much more than itself from line to line.
    """
    h = 2.0 * h_0 * h_1 / (h_0 + h_1)
    return h * h * h, 3.0 * h_1 / ((h_0 + h_1) * h_0), 3.0 * h_0 / ((h_0 + h_1) * h_1)


@njit(cache=True, error_model="numpy")
def towards_open_side(cube, d_near, d_beyond, near, beyond):
    """cube_across at an open side: pressure falls with a power of the gap instead of to zero within one cell."""
    far = min(near / beyond, 1.0) ** FAR_POWER
    share = 1.0 - far
    cube *= share
    if share > 0.0:
        d_near += -FAR_POWER * far / (share * near)
        d_beyond += FAR_POWER * far / (share * beyond)
    return cube, d_near, d_beyond


@njit(cache=True, error_model="numpy")
def face_fluxes(
    x, kappa_h, mirror, open_side, p, gap, ln_phi, dln_phi, g, dg, g_y, dg_y, flow_x, flow_y, c_x, c_y, wedge, floor
):  # fmt: skip
    """Fluxes at faces and their derivatives.

    kappa_h : kappa/h_y, scales the flow across. mirror, open_side : of the grid. dln_phi, dg : derivatives to P.
    flow_x (ny, nx-1), flow_y (ny-1, nx): Poiseuille minus wedge flux.
    c_x (ny, nx-1, 4), c_y (ny-1, nx, 4): derivatives to P_left, P_right, H_left, H_right, along x of the Poiseuille
    part only.
    wedge (ny, nx-1, 3): weights of the nodes i, i-1, i+1 in the wedge flux of face i+1/2.
    """
    ny, nx = p.shape
    for j in range(ny):
        for i in range(nx - 1):
            dx = x[i + 1] - x[i]
            h, dh = lifted_gap(0.5 * (gap[j, i] + gap[j, i + 1]), floor)
            phi, w_l, w_r = log_mean(ln_phi[j, i], ln_phi[j, i + 1])
            e = h * h * h * phi
            slope = (p[j, i + 1] - p[j, i]) / dx
            f = e * slope
            c_x[j, i, 0] = -e / dx + f * w_l * dln_phi[j, i]
            c_x[j, i, 1] = e / dx + f * w_r * dln_phi[j, i + 1]
            c_x[j, i, 2] = 1.5 * f * dh / h
            c_x[j, i, 3] = 1.5 * f * dh / h
            if i == 0:
                wedge[j, i, 0] = 1.0
                wedge[j, i, 1] = 0.0
                wedge[j, i, 2] = 0.0
                f -= g[j, i] * gap[j, i]
            else:
                left = x[i] - x[i - 1]
                # quadratic through i-1, i, i+1 at the face (QUICK, Leonard 1979)
                w_p = 0.5 * (left + 0.5 * dx) / (left + dx)
                w_m = -0.25 * dx * dx / (left * (left + dx))
                w_0 = 1.0 - w_m - w_p
                wedge[j, i, 0] = w_0
                wedge[j, i, 1] = w_m
                wedge[j, i, 2] = w_p
                f -= (
                    w_0 * g[j, i] * gap[j, i]
                    + w_m * g[j, i - 1] * gap[j, i - 1]
                    + w_p * g[j, i + 1] * gap[j, i + 1]
                )
            flow_x[j, i] = f
    for j in range(ny - 1):
        for i in range(nx):
            h_0, dh_0 = lifted_gap(gap[j, i], floor)
            h_1, dh_1 = lifted_gap(gap[j + 1, i], floor)
            cube, d_0, d_1 = cube_across(h_0, h_1)
            if open_side and j == ny - 2:
                cube, d_0, d_1 = towards_open_side(cube, d_0, d_1, h_0, h_1)
            elif open_side and j == 0 and not mirror:
                cube, d_1, d_0 = towards_open_side(cube, d_1, d_0, h_1, h_0)
            phi, w_l, w_r = log_mean(ln_phi[j, i], ln_phi[j + 1, i])
            e = cube * phi * kappa_h
            f = e * (p[j + 1, i] - p[j, i])
            c_y[j, i, 0] = -e + f * w_l * dln_phi[j, i]
            c_y[j, i, 1] = e + f * w_r * dln_phi[j + 1, i]
            c_y[j, i, 2] = f * d_0 * dh_0
            c_y[j, i, 3] = f * d_1 * dh_1
            # transport across by spin
            f -= 0.5 * (g_y[j, i] * gap[j, i] + g_y[j + 1, i] * gap[j + 1, i])
            c_y[j, i, 0] -= 0.5 * dg_y[j, i] * gap[j, i]
            c_y[j, i, 1] -= 0.5 * dg_y[j + 1, i] * gap[j + 1, i]
            c_y[j, i, 2] -= 0.5 * g_y[j, i]
            c_y[j, i, 3] -= 0.5 * g_y[j + 1, i]
            flow_y[j, i] = f


@njit(cache=True, error_model="numpy")
def residual(width, kappa_h, mirror, flow_x, flow_y, out):
    """Net inflow by pressure minus wedge per unit area; zero on the outer edges.

    mirror: line 0 is a line of symmetry, else an outer edge.
    """
    ny, nx = out.shape
    out[:, :] = 0.0
    for j in range(0 if mirror else 1, ny - 1):
        for i in range(1, nx - 1):
            r = (flow_x[j, i] - flow_x[j, i - 1]) / width[i]
            if mirror and j == 0:
                r += 2.0 * kappa_h * flow_y[0, i]
            else:
                r += kappa_h * (flow_y[j, i] - flow_y[j - 1, i])
            out[j, i] = r


@njit(cache=True, error_model="numpy")
def jacobian_times(width, kappa_h, mirror, c_x, c_y, wedge, gap, g, dg, penalty, dp, dh, out):
    """Directional derivative of the residual for changes dp of pressure and dh of gap; identity where cavitated."""
    ny, nx = out.shape
    out[:, :] = 0.0
    dg_h = np.empty((ny, nx))
    for j in range(ny):
        for i in range(nx):
            dg_h[j, i] = g[j, i] * dh[j, i] + gap[j, i] * dg[j, i] * dp[j, i]
    for j in range(ny - 1):
        for i in range(nx - 1):
            f = (
                c_x[j, i, 0] * dp[j, i]
                + c_x[j, i, 1] * dp[j, i + 1]
                + c_x[j, i, 2] * dh[j, i]
                + c_x[j, i, 3] * dh[j, i + 1]
                - wedge[j, i, 0] * dg_h[j, i]
                - wedge[j, i, 2] * dg_h[j, i + 1]
            )
            if i > 0:
                f -= wedge[j, i, 1] * dg_h[j, i - 1]
                out[j, i] += f / width[i]
            if i + 1 < nx - 1:
                out[j, i + 1] -= f / width[i + 1]
        for i in range(1, nx - 1):
            f = (
                c_y[j, i, 0] * dp[j, i]
                + c_y[j, i, 1] * dp[j + 1, i]
                + c_y[j, i, 2] * dh[j, i]
                + c_y[j, i, 3] * dh[j + 1, i]
            ) * kappa_h
            out[j, i] += 2.0 * f if mirror and j == 0 else f
            if j + 1 < ny - 1:
                out[j + 1, i] -= f
    for j in range(ny - 1):
        for i in range(1, nx - 1):
            out[j, i] -= penalty[j, i] * dp[j, i]
    if not mirror:
        out[0, :] = 0.0


@njit(cache=True, error_model="numpy")
def line_jacobian(j, width, kappa_h, mirror, c_x, c_y, wedge, gap, g, dg, penalty, same_line, out, column):
    """Jacobian of line j to its own pressures, deflection of the line by itself included.

    out (nx-2, nx-2); column (nx-2,): derivative to a rigid approach (same gap change everywhere).
    """
    nx = gap.shape[1]
    n = nx - 2
    out[:, :] = 0.0
    d_h = np.zeros(4)  # derivative of one row to the gaps at i-2, i-1, i, i+1
    for row in range(n):
        i = row + 1
        d_h[:] = 0.0
        inv = 1.0 / width[i]
        # right face
        d_h[2] += c_x[j, i, 2] * inv
        d_h[3] += c_x[j, i, 3] * inv
        d_h[2] -= wedge[j, i, 0] * g[j, i] * inv
        d_h[1] -= wedge[j, i, 1] * g[j, i - 1] * inv
        d_h[3] -= wedge[j, i, 2] * g[j, i + 1] * inv
        d_h[2] += wedge[j, i - 1, 2] * g[j, i] * inv
        # left face
        d_h[1] -= c_x[j, i - 1, 2] * inv
        d_h[2] -= c_x[j, i - 1, 3] * inv
        d_h[1] += wedge[j, i - 1, 0] * g[j, i - 1] * inv
        if i > 1:
            d_h[0] += wedge[j, i - 1, 1] * g[j, i - 2] * inv
        d_p = c_x[j, i, 0] * inv - c_x[j, i - 1, 1] * inv
        d_p += (wedge[j, i - 1, 2] - wedge[j, i, 0]) * gap[j, i] * dg[j, i] * inv
        if mirror and j == 0:
            d_p += 2.0 * kappa_h * c_y[0, i, 0]
            d_h[2] += 2.0 * kappa_h * c_y[0, i, 2]
            full_h = d_h[0] + d_h[1] + d_h[2] + d_h[3] + 2.0 * kappa_h * c_y[0, i, 3]
        else:
            d_p += kappa_h * (c_y[j, i, 0] - c_y[j - 1, i, 1])
            d_h[2] += kappa_h * (c_y[j, i, 2] - c_y[j - 1, i, 3])
            full_h = d_h[0] + d_h[1] + d_h[2] + d_h[3] + kappa_h * (c_y[j, i, 3] - c_y[j - 1, i, 2])
        column[row] = full_h
        k0 = 1 if i > 1 else 0
        for k in range(n):
            s = (
                d_h[1] * same_line[i - 1, k + 1]
                + d_h[2] * same_line[i, k + 1]
                + d_h[3] * same_line[i + 1, k + 1]
            )
            if k0 == 1:
                s += d_h[0] * same_line[i - 2, k + 1]
            out[row, k] = s
        out[row, row] += d_p - penalty[j, i]
        if row + 1 < n:
            out[row, row + 1] += (c_x[j, i, 1] - wedge[j, i, 2] * gap[j, i + 1] * dg[j, i + 1]) * inv
        if row > 0:
            out[row, row - 1] += (
                -c_x[j, i - 1, 0]
                - wedge[j, i, 1] * gap[j, i - 1] * dg[j, i - 1]
                + wedge[j, i - 1, 0] * gap[j, i - 1] * dg[j, i - 1]
            ) * inv
        if row > 1:
            out[row, row - 2] += wedge[j, i - 1, 1] * gap[j, i - 2] * dg[j, i - 2] * inv


@njit(cache=True, error_model="numpy")
def settle_edge(width, kappa_h, mirror, c_x, c_y, low, sweeps, p, r):
    """Move the edge of cavitation to its place by the linear flow equation; p and r change in place.

    Projected relaxation (Cryer 1971) of p >= 0, r <= 0, p r = 0 over the nodes `low` at fixed gaps. r (ny, nx): net
    inflow that the linear step leaves. Ends after `sweeps`, or when no node changes by EDGE_TOLERANCE.
    """
    ny, nx = p.shape
    for _ in range(sweeps):
        moved = 0.0
        for j in range(0 if mirror else 1, ny - 1):
            for i in range(1, nx - 1):
                if not low[j, i] or (p[j, i] <= 0.0 and r[j, i] <= 0.0):
                    continue
                double = 2.0 if mirror and j == 0 else 1.0
                diagonal = (c_x[j, i, 0] - c_x[j, i - 1, 1]) / width[i] + double * kappa_h * c_y[j, i, 0]
                if j > 0:
                    diagonal -= kappa_h * c_y[j - 1, i, 1]
                d = max(p[j, i] - EDGE_RELAXATION * r[j, i] / diagonal, 0.0) - p[j, i]
                p[j, i] += d
                moved = max(moved, abs(d))
                r[j, i] += diagonal * d
                r[j, i + 1] -= c_x[j, i, 0] / width[i + 1] * d
                r[j, i - 1] += c_x[j, i - 1, 1] / width[i - 1] * d
                r[j + 1, i] -= kappa_h * c_y[j, i, 0] * d
                if j > 0:
                    r[j - 1, i] += (2.0 if mirror and j == 1 else 1.0) * kappa_h * c_y[j - 1, i, 1] * d
        if not moved > EDGE_TOLERANCE:
            break
