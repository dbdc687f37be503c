"""Compiled loops of the Reynolds equation: residual, Jacobian times vector, Jacobian of one line.

They use numpy and numba only, and neither check nor allocate per point. Fields are (n_y, n_x); line 0 is the line of
symmetry Y = 0; the last line and the first and last column carry P = 0.

Poiseuille flux at a face: e dP/dX with e = H_f^3 phi_f, H_f the mean gap and phi_f the logarithmic mean of the
nodal fluidity: exact where ln(viscosity) is linear in pressure between two nodes, which keeps the steep
piezoviscous inlet accurate on few points. Wedge flux: g H at the face by
the quadratic through two upstream nodes and one downstream. The outermost face across may be open: P of the last line
is zero for the deflection, its flux is that of a pressure that falls with a power of the gap.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...compiled import kernel

#: power of the gap with which pressure falls beyond the last line: 3/2 on a long ellipse, 2 on a circle
FAR_POWER = 1.75
#: over-relaxation of settle_edge, and the change of pressure [p_max] that ends it
EDGE_RELAXATION, EDGE_TOLERANCE = 1.5, 1e-9


class Mesh(NamedTuple):
    """Nodes x and cell widths (n_x,) along rolling; kappa/h_y, scales the flow across; whether the side is open."""

    x: Any
    width: Any
    kappa_h: float
    open_side: bool


class Faces(NamedTuple):
    """Fluxes at faces and their derivatives.

    flow_x (n_y, n_x-1), flow_y (n_y-1, n_x): Poiseuille minus wedge flux.
    c_x (n_y, n_x-1, 4), c_y (n_y-1, n_x, 5), of the Poiseuille part: conductance (flux per difference of P),
    derivatives to ln phi of the nodes before and behind, to both gaps along x (the same), to the gaps before and behind
    across. wedge (n_y, n_x-1, 3): weights of the nodes i, i-1, i+1 in the wedge flux of face i+1/2.
    """

    flow_x: Any
    flow_y: Any
    c_x: Any
    c_y: Any
    wedge: Any

    @classmethod
    def empty(cls, ny: int, nx: int) -> Faces:
        sizes = (ny, nx - 1), (ny - 1, nx), (ny, nx - 1, 4), (ny - 1, nx, 5), (ny, nx - 1, 3)
        return cls(*(np.empty(size) for size in sizes))


@kernel
def log_mean(s_left, s_right):
    """Logarithmic mean of exp(s_left), exp(s_right) and its log-derivatives to both."""
    d = s_right - s_left
    if abs(d) < 1e-3:
        # series: mean = exp((l+r)/2) (1 + d^2/24), weights 1/2 -+ d/12
        return np.exp(0.5 * (s_left + s_right)) * (1.0 + d * d / 24.0), 0.5 - d / 12.0, 0.5 + d / 12.0
    mean = np.exp(s_left) * np.expm1(d) / d
    w_right = 1.0 / (-np.expm1(-d)) - 1.0 / d
    return mean, 1.0 - w_right, w_right


@kernel
def lifted_gap(h, floor):
    """Gap for the flow and its derivative: h above the floor, floor*exp(h/floor - 1) below (C1, positive).

    Lets Newton's method pass iterates that overlap; a converged gap is above the floor, where it is unchanged.
    """
    if h >= floor:
        return h, 1.0
    # bounded: the exponential must not vanish, it is divided by
    lifted = floor * np.exp(max(h / floor - 1.0, -100.0))
    return lifted, lifted / floor


@kernel
def cube_across(h_0, h_1):
    """Cube of the gap between two lines and its logarithmic derivatives to both gaps.

    Harmonic mean: outside the ellipse the gap grows by much more than itself from line to line.
    """
    h = 2.0 * h_0 * h_1 / (h_0 + h_1)
    return h * h * h, 3.0 * h_1 / ((h_0 + h_1) * h_0), 3.0 * h_0 / ((h_0 + h_1) * h_1)


@kernel
def towards_open_side(cube, d_near, d_beyond, near, beyond):
    """cube_across at an open side: pressure falls with a power of the gap instead of to zero within one cell."""
    far = min(near / beyond, 1.0) ** FAR_POWER
    share = 1.0 - far
    cube *= share
    if share > 0.0:
        d_near += -FAR_POWER * far / (share * near)
        d_beyond += FAR_POWER * far / (share * beyond)
    return cube, d_near, d_beyond


@kernel
def face_fluxes(mesh, p, gap, ln_phi, g, floor, faces):
    """Fluxes at the faces of a state and their derivatives; fills faces."""
    x, kappa_h, open_side = mesh.x, mesh.kappa_h, mesh.open_side
    flow_x, flow_y, c_x, c_y, wedge = faces.flow_x, faces.flow_y, faces.c_x, faces.c_y, faces.wedge
    ny, nx = p.shape
    for j in range(ny):
        for i in range(nx - 1):
            dx = x[i + 1] - x[i]
            h, dh = lifted_gap(0.5 * (gap[j, i] + gap[j, i + 1]), floor)
            phi, w_l, w_r = log_mean(ln_phi[j, i], ln_phi[j, i + 1])
            e = h * h * h * phi / dx
            f = e * (p[j, i + 1] - p[j, i])
            c_x[j, i, 0] = e
            c_x[j, i, 1] = f * w_l
            c_x[j, i, 2] = f * w_r
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
            phi, w_l, w_r = log_mean(ln_phi[j, i], ln_phi[j + 1, i])
            e = cube * phi * kappa_h
            f = e * (p[j + 1, i] - p[j, i])
            c_y[j, i, 0] = e
            c_y[j, i, 1] = f * w_l
            c_y[j, i, 2] = f * w_r
            c_y[j, i, 3] = f * d_0 * dh_0
            c_y[j, i, 4] = f * d_1 * dh_1
            flow_y[j, i] = f


@kernel
def smaller(a, b):
    """The smaller of two numbers of one sign, else 0."""
    if a * b <= 0.0:
        return 0.0
    return a if abs(a) < abs(b) else b


@kernel
def line_flux(j, width, per_width, p, flux_x, flux_y, out):
    """Flux through the faces of line j by continuity; out (n_x-1,).

    From the face behind the largest pressure, where the wedge alone carries the flow: far upstream the flux is the
    small difference of two flows that grow with the gap, and errors of the pressure weigh as much.
    per_width: of flux_y.
    """
    nx = out.size + 1
    anchor = 1
    for i in range(2, nx - 1):
        if p[j, i] > p[j, anchor]:
            anchor = i
    out[anchor] = flux_x[j, anchor]
    for i in range(anchor + 1, nx - 1):
        side = 2.0 * flux_y[0, i] if j == 0 else flux_y[j, i] - flux_y[j - 1, i]
        out[i] = out[i - 1] - width[i] * per_width * side
    for i in range(anchor, 0, -1):
        side = 2.0 * flux_y[0, i] if j == 0 else flux_y[j, i] - flux_y[j - 1, i]
        out[i - 1] = out[i] + width[i] * per_width * side


@kernel
def pressure_flow(mesh, h_y, p, gap, ln_phi, dln_phi, g, faces, same_line, floor, flow, heat):
    """Gradients and dissipation of the pressure flow at the nodes, from the fluxes of their faces; fills flow, heat.

    gradient_x, gradient_y (n_y, n_x), per unit of x and h_y: the smaller of the gradient that drives the mean flux of
    the faces and that of the pressures of the neighbours: beside a pressure spike, where the viscosity changes by
    decades from node to node, either may be far too large. power (n_y, n_x): flux times pressure drop, half of it to
    either node of a face, per area, so that its sum is that of the faces between nodes under pressure. While iterating,
    the flux along x is bounded by that of continuity, which temperatures do not change. Zero in a cavitated node.
    pull (n_y, n_x, 2), push (n_y, n_x, 4): changes of power with the pressure drops before and behind, and with the
    wedge fluxes at the nodes i-2 to i+1, which continuity asks the pressure to carry: on faces where pressure flow
    dominates over the deflection, by their share.
    """
    x, width, kappa_h = mesh.x, mesh.width, mesh.kappa_h
    flow_x, flow_y, c_x, c_y, wedge = faces.flow_x, faces.flow_y, faces.c_x, faces.c_y, faces.wedge
    grad_x, grad_y, power = flow.gradient_x, flow.gradient_y, flow.power
    pull, push = heat.pull, heat.push
    ny, nx = p.shape
    pull[:, :, :] = 0.0
    push[:, :, :] = 0.0
    flux, steady = np.zeros((2, nx - 1))
    for j in range(ny):
        for i in range(nx):
            grad_x[j, i] = grad_y[j, i] = power[j, i] = 0.0
        if j == ny - 1:
            break
        line_flux(j, width, kappa_h, p, flow_x, flow_y, steady)
        for i in range(nx - 1):
            flux[i] = c_x[j, i, 0] * (p[j, i + 1] - p[j, i])
            flux[i] = smaller(flux[i], steady[i] + flux[i] - flow_x[j, i])
        for i in range(1, nx - 1):
            if not p[j, i] > 0.0:
                continue
            own, _ = lifted_gap(gap[j, i], floor)
            conductance = own * own * own * np.exp(ln_phi[j, i])
            d_l, d_r = x[i] - x[i - 1], x[i + 1] - x[i]
            drop_l, drop_r = p[j, i] - p[j, i - 1], p[j, i + 1] - p[j, i]
            central = (drop_r / d_r * d_l + drop_l / d_l * d_r) / (d_l + d_r)
            grad_x[j, i] = smaller(0.5 * (flux[i - 1] + flux[i]) / conductance, central)
            half = 0.5 / width[i]
            power[j, i] = half * (flux[i - 1] * drop_l + flux[i] * drop_r)
            pull[j, i, 0], pull[j, i, 1] = half * flux[i - 1], half * flux[i]
            elastic = abs(g[j, i]) * same_line[i, i]
            left, right = 0.0, 0.0
            for m in (i - 1, i):
                through = (
                    c_x[j, m, 0] + abs(c_x[j, m, 1] * dln_phi[j, m]) + abs(c_x[j, m, 2] * dln_phi[j, m + 1])
                )
                left, right = right, through / (through + elastic)
            left *= half * drop_l
            right *= half * drop_r
            push[j, i, 0] = left * wedge[j, i - 1, 1]
            push[j, i, 1] = left * wedge[j, i - 1, 0] + right * wedge[j, i, 1]
            push[j, i, 2] = left * wedge[j, i - 1, 2] + right * wedge[j, i, 0]
            push[j, i, 3] = right * wedge[j, i, 2]
            up = c_y[j, i, 0] * (p[j + 1, i] - p[j, i])
            if j == 0:
                power[j, i] += kappa_h * up * (p[j + 1, i] - p[j, i])
                continue
            down = c_y[j - 1, i, 0] * (p[j, i] - p[j - 1, i])
            power[j, i] += 0.5 * kappa_h * (up * (p[j + 1, i] - p[j, i]) + down * (p[j, i] - p[j - 1, i]))
            central = 0.5 * (p[j + 1, i] - p[j - 1, i]) / h_y
            grad_y[j, i] = smaller(0.5 * (up + down) / (conductance * kappa_h * h_y), central)


@kernel
def residual(mesh, faces, out):
    """Net inflow by pressure minus wedge per unit area; zero on the outer edges."""
    width, kappa_h, flow_x, flow_y = mesh.width, mesh.kappa_h, faces.flow_x, faces.flow_y
    ny, nx = out.shape
    out[:, :] = 0.0
    for j in range(ny - 1):
        for i in range(1, nx - 1):
            r = (flow_x[j, i] - flow_x[j, i - 1]) / width[i]
            if j == 0:
                r += 2.0 * kappa_h * flow_y[0, i]
            else:
                r += kappa_h * (flow_y[j, i] - flow_y[j - 1, i])
            out[j, i] = r


@kernel
def jacobian_times(s, dp, dh, d_phi, d_g, out):
    """Directional derivative of the residual for changes of pressure dp, gap dh, ln phi and g at the nodes.

    s : linear.LinearSystem
    """
    width, kappa_h, c_x, c_y, wedge = s.width, s.kappa_h, s.c_x, s.c_y, s.wedge
    gap, g, penalty, squeeze = s.gap, s.g, s.penalty, s.squeeze
    ny, nx = out.shape
    out[:, :] = 0.0
    d_wedge = np.empty(nx)
    for j in range(ny - 1):
        for i in range(nx):
            d_wedge[i] = g[j, i] * dh[j, i] + gap[j, i] * d_g[j, i]
        for i in range(nx - 1):
            f = (
                c_x[j, i, 0] * (dp[j, i + 1] - dp[j, i])
                + c_x[j, i, 1] * d_phi[j, i]
                + c_x[j, i, 2] * d_phi[j, i + 1]
                + c_x[j, i, 3] * (dh[j, i] + dh[j, i + 1])
                - wedge[j, i, 0] * d_wedge[i]
                - wedge[j, i, 2] * d_wedge[i + 1]
            )
            if i > 0:
                f -= wedge[j, i, 1] * d_wedge[i - 1]
                out[j, i] += f / width[i]
            if i + 1 < nx - 1:
                out[j, i + 1] -= f / width[i + 1]
        for i in range(1, nx - 1):
            f = (
                c_y[j, i, 0] * (dp[j + 1, i] - dp[j, i])
                + c_y[j, i, 1] * d_phi[j, i]
                + c_y[j, i, 2] * d_phi[j + 1, i]
                + c_y[j, i, 3] * dh[j, i]
                + c_y[j, i, 4] * dh[j + 1, i]
            ) * kappa_h
            out[j, i] += 2.0 * f if j == 0 else f
            if j + 1 < ny - 1:
                out[j + 1, i] -= f
    for j in range(ny - 1):
        for i in range(1, nx - 1):
            out[j, i] -= penalty[j, i] * dp[j, i] + squeeze * (g[j, i] * dh[j, i] + gap[j, i] * d_g[j, i])


@kernel
def line_jacobian(j, s, far_phi, far_g, out, column):
    """Jacobian of line j to its own pressures, deflection of the line by itself included.

    s : linear.LinearSystem; far_phi, far_g (nx, nx): changes of ln phi and g with the pressures of the line by the heat
    that the oil carries along, of size 0 without.
    out (nx-2, nx-2); column (nx-2,): derivative to a rigid approach (same gap change everywhere).
    """
    width, kappa_h, c_x, c_y, wedge, same_line = s.width, s.kappa_h, s.c_x, s.c_y, s.wedge, s.same_line
    gap, g, penalty, squeeze, dln_phi, dg = s.gap, s.g, s.penalty, s.squeeze, s.dln_phi, s.dg
    nx = gap.shape[1]
    double = 2.0 if j == 0 else 1.0
    far = far_phi.size > 0
    by_h, by_p, by_phi, by_g = np.zeros(4), np.zeros(3), np.zeros(3), np.zeros(4)
    row = np.empty(nx)
    for i in range(1, nx - 1):
        inv = 1.0 / width[i]
        # by nodes i-2, i-1, i, i+1 (by_h, by_g) or i-1, i, i+1
        by_p[0], by_p[2] = c_x[j, i - 1, 0] * inv, c_x[j, i, 0] * inv
        by_p[1] = -by_p[0] - by_p[2] - double * kappa_h * c_y[j, i, 0]
        by_phi[0] = -c_x[j, i - 1, 1] * inv
        by_phi[1] = (c_x[j, i, 1] - c_x[j, i - 1, 2]) * inv + double * kappa_h * c_y[j, i, 1]
        by_phi[2] = c_x[j, i, 2] * inv
        by_g[0] = wedge[j, i - 1, 1] * inv
        by_g[1] = (wedge[j, i - 1, 0] - wedge[j, i, 1]) * inv
        by_g[2] = (wedge[j, i - 1, 2] - wedge[j, i, 0]) * inv - squeeze
        by_g[3] = -wedge[j, i, 2] * inv
        by_h[0] = 0.0
        by_h[1] = -c_x[j, i - 1, 3] * inv
        by_h[2] = (c_x[j, i, 3] - c_x[j, i - 1, 3]) * inv + double * kappa_h * c_y[j, i, 3]
        by_h[3] = c_x[j, i, 3] * inv
        approach = double * kappa_h * c_y[j, i, 4]
        if j > 0:
            by_p[1] -= kappa_h * c_y[j - 1, i, 0]
            by_phi[1] -= kappa_h * c_y[j - 1, i, 2]
            by_h[2] -= kappa_h * c_y[j - 1, i, 4]
            approach -= kappa_h * c_y[j - 1, i, 3]
        by_p[1] -= penalty[j, i]
        first = 1 if i == 1 else 0
        for m in range(first, 4):
            by_h[m] += by_g[m] * g[j, i - 2 + m]
            by_g[m] *= gap[j, i - 2 + m]
        row[:] = 0.0
        for m in range(3):
            k = i - 1 + m
            row[k] += by_p[m] + by_phi[m] * dln_phi[j, k]
        for m in range(first, 4):
            row[i - 2 + m] += by_g[m] * dg[j, i - 2 + m]
        for m in range(first, 4):
            approach += by_h[m]
        column[i - 1] = approach
        b0, b1, b2, b3 = by_h[0], by_h[1], by_h[2], by_h[3]
        before = i - 2 + first
        for k in range(1, nx - 1):
            out[i - 1, k - 1] = row[k] + (
                b0 * same_line[before, k]
                + b1 * same_line[i - 1, k]
                + b2 * same_line[i, k]
                + b3 * same_line[i + 1, k]
            )
        if far:
            for m in range(3):
                b0, at = by_phi[m], i - 1 + m
                for k in range(1, nx - 1):
                    out[i - 1, k - 1] += b0 * far_phi[at, k]
            for m in range(first, 4):
                b0, at = by_g[m], i - 2 + m
                for k in range(1, nx - 1):
                    out[i - 1, k - 1] += b0 * far_g[at, k]


@kernel
def settle_edge(s, low, sweeps, p, r):
    """Move the edge of cavitation to its place by the linear flow equation; p and r change in place.

    s : linear.LinearSystem. Projected relaxation (Cryer 1971) of p >= 0, r <= 0, p r = 0 over the nodes `low` at fixed
    gaps. r (ny, nx): net inflow that the linear step leaves. Ends after `sweeps`, or when no node changes by
    EDGE_TOLERANCE.
    """
    width, kappa_h, c_x, c_y, dln_phi = s.width, s.kappa_h, s.c_x, s.c_y, s.dln_phi
    ny, nx = p.shape
    for _ in range(sweeps):
        moved = 0.0
        for j in range(ny - 1):
            for i in range(1, nx - 1):
                if not low[j, i] or (p[j, i] <= 0.0 and r[j, i] <= 0.0):
                    continue
                double = 2.0 if j == 0 else 1.0
                by_phi = dln_phi[j, i]
                right, left = (
                    c_x[j, i, 1] * by_phi - c_x[j, i, 0],
                    c_x[j, i - 1, 2] * by_phi + c_x[j, i - 1, 0],
                )
                up = kappa_h * (c_y[j, i, 1] * by_phi - c_y[j, i, 0])
                diagonal = (right - left) / width[i] + double * up
                if j > 0:
                    down = kappa_h * (c_y[j - 1, i, 2] * by_phi + c_y[j - 1, i, 0])
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
        if not moved > EDGE_TOLERANCE:
            break
