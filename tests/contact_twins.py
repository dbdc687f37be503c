"""Plain NumPy twins of the compiled contact kernels: whole arrays and dense matrices instead of point loops.

Written from the equations in the kernels' docstrings; they share no code with them. Slow, for small grids only.
"""

import numpy as np
from scipy.integrate import cumulative_trapezoid, trapezoid

# --- influence functions -----------------------------------------------------------------------------------------


def _love_corner(x, y):
    """Integral of 1/r over 0..x, 0..y in the logarithmic form of Johnson 1985, Eq. 3.25 (first quadrant)."""
    r = np.hypot(x, y)
    with np.errstate(divide="ignore", invalid="ignore"):
        value = x * np.log((y + r) / x) + y * np.log((x + r) / y)
    return np.where((x == 0.0) | (y == 0.0), 0.0, value)


def _corners(function, left, right, low, high):
    """Integral over a rectangle from the integral over 0..|x|, 0..|y|, odd in both."""

    def odd(x, y):
        return np.sign(x) * np.sign(y) * function(np.abs(x), np.abs(y))

    return odd(right, high) - odd(left, high) - odd(right, low) + odd(left, low)


def line_influence(x, edges, h_y, n_distance):
    """Twin of elastic.line_influence."""
    distance = h_y * np.arange(n_distance)[:, None, None]
    left, right = edges[None, None, :-1] - x[None, :, None], edges[None, None, 1:] - x[None, :, None]
    return _corners(_love_corner, left, right, distance - 0.5 * h_y, distance + 0.5 * h_y)


def wall_cell(beta, s_0, s_1, y_0, y_1, n_s=3, n_t=10):
    """Integral of exp(-|beta| r + beta s)/r over s_0..s_1, y_0..y_1, s_0 and s_1 on one side of 0 or at it.

    Gauss rules of the kernel: n_s points along s (towards the singular point in the root of s), n_t points in t,
    y = |s| sinh t, cut where the exponent reaches -40.
    """
    if s_0 == s_1 or (beta * (s_0 + s_1) < 0.0 and 2.0 * abs(beta) * min(abs(s_0), abs(s_1)) > 40.0):
        return 0.0
    v, w = np.polynomial.legendre.leggauss(n_s)
    v, w = 0.5 * (1.0 + v), 0.5 * w
    far, near = (s_0, s_1) if abs(s_0) > abs(s_1) else (s_1, s_0)
    s = far * v**2 if near == 0.0 else near + (far - near) * v
    w = 2.0 * v * w * abs(far) if near == 0.0 else w * abs(far - near)
    t_0, t_1 = np.arcsinh(y_0 / abs(s)), np.arcsinh(y_1 / abs(s))
    decay = abs(beta * s)
    if beta != 0.0:
        t_1 = np.minimum(t_1, np.arccosh(np.maximum((40.0 + beta * s) / decay, 1.0)))
    t, w_t = np.polynomial.legendre.leggauss(n_t)
    t = 0.5 * ((t_0 + t_1)[:, None] + (t_1 - t_0)[:, None] * t)
    inner = np.exp((beta * s)[:, None] - decay[:, None] * np.cosh(t)) @ w_t * 0.5 * (t_1 - t_0)
    return float(np.sum(np.where(t_1 > t_0, w * inner, 0.0)))


def wall_influence(x, edges, h_y, n_distance, beta, n_s=3, n_t=10):
    """Twin of walls.wall_influence."""
    out = np.zeros((n_distance, x.size, x.size))
    for d, i, k in np.ndindex(out.shape):
        s = sorted((x[i] - edges[k], x[i] - edges[k + 1]))
        parts = [s] if s[0] * s[1] >= 0.0 else [[s[0], 0.0], [0.0, s[1]]]
        low, high = (0.0, 0.5 * h_y) if d == 0 else ((d - 0.5) * h_y, (d + 0.5) * h_y)
        times = 2.0 if d == 0 else 1.0
        out[d, i, k] = times * sum(wall_cell(beta, *part, low, high, n_s, n_t) for part in parts)
    return out


# --- Reynolds equation -------------------------------------------------------------------------------------------


def face_fluxes(x, kappa_h, p, gap, ln_phi, dln_phi, g, lifted_gap):
    """Twin of kernels.face_fluxes: flow_x, flow_y, c_x, c_y, wedge. lifted_gap: the safeguard, (gap, slope)."""
    dx = np.diff(x)
    h, dh = lifted_gap(0.5 * (gap[:, 1:] + gap[:, :-1]))
    phi, w_l, w_r = _log_mean(ln_phi[:, :-1], ln_phi[:, 1:])
    e = h**3 * phi
    f = e * np.diff(p, axis=1) / dx
    by_gap = 1.5 * f * dh / h
    c_x = np.stack(
        [-e / dx + f * w_l * dln_phi[:, :-1], e / dx + f * w_r * dln_phi[:, 1:], by_gap, by_gap], axis=-1
    )
    wedge = np.zeros((*f.shape, 3))
    wedge[:, 0, 0] = 1.0
    for i in range(1, dx.size):
        # Lagrange weights of the nodes i, i-1, i+1 at the face between i and i+1
        nodes, face = x[[i, i - 1, i + 1]], 0.5 * (x[i] + x[i + 1])
        for m in range(3):
            others = np.delete(nodes, m)
            wedge[:, i, m] = np.prod((face - others) / (nodes[m] - others))
    mass = g * gap
    before = np.concatenate([mass[:, :1], mass[:, :-2]], axis=1)
    flow_x = f - wedge[..., 0] * mass[:, :-1] - wedge[..., 1] * before - wedge[..., 2] * mass[:, 1:]

    h_0, dh_0 = lifted_gap(gap[:-1])
    h_1, dh_1 = lifted_gap(gap[1:])
    h = 2.0 / (1.0 / h_0 + 1.0 / h_1)
    phi, w_l, w_r = _log_mean(ln_phi[:-1], ln_phi[1:])
    e = h**3 * phi * kappa_h
    flow_y = e * np.diff(p, axis=0)
    # h^3 grows with h_0 as 3 h^2 * dh/dh_0, dh/dh_0 = h^2/(2 h_0^2)
    c_y = np.stack(
        [
            -e + flow_y * w_l * dln_phi[:-1],
            e + flow_y * w_r * dln_phi[1:],
            flow_y * 1.5 * h / h_0**2 * dh_0,
            flow_y * 1.5 * h / h_1**2 * dh_1,
        ],
        axis=-1,
    )
    return flow_x, flow_y, c_x, c_y, wedge


def _log_mean(left, right):
    """Logarithmic mean of exp(left), exp(right) and its logarithmic derivatives, by quadrature.

    mean = integral of exp(left + w (right - left)) dw over 0..1: the definition, exact to rounding with 40 points.
    """
    w, weight = np.polynomial.legendre.leggauss(40)
    w, weight = 0.5 * (1.0 + w), 0.5 * weight
    values = np.exp(left[..., None] + w * (right - left)[..., None])
    mean = values @ weight
    w_right = (values * w) @ weight / mean
    return mean, 1.0 - w_right, w_right


def residual(width, kappa_h, flow_x, flow_y):
    """Twin of kernels.residual: divergence, with the flow across mirrored at line 0."""
    out = np.zeros((flow_x.shape[0], flow_y.shape[1]))
    across = np.concatenate([-flow_y[:1], flow_y])
    along = np.diff(flow_x, axis=1)[:-1] / width[1:-1]
    out[:-1, 1:-1] = along + kappa_h * np.diff(across, axis=0)[:, 1:-1]
    return out


def jacobian_times(width, kappa_h, c_x, c_y, wedge, gap, g, dg, penalty, dp, dh):
    """Twin of kernels.jacobian_times: the divergence of the changed fluxes."""
    d_mass = g * dh + gap * dg * dp
    before = np.concatenate([d_mass[:, :1], d_mass[:, :-2]], axis=1)
    flow_x = (
        c_x[..., 0] * dp[:, :-1]
        + c_x[..., 1] * dp[:, 1:]
        + c_x[..., 2] * dh[:, :-1]
        + c_x[..., 3] * dh[:, 1:]
    )
    flow_x -= wedge[..., 0] * d_mass[:, :-1] + wedge[..., 1] * before + wedge[..., 2] * d_mass[:, 1:]
    flow_y = c_y[..., 0] * dp[:-1] + c_y[..., 1] * dp[1:] + c_y[..., 2] * dh[:-1] + c_y[..., 3] * dh[1:]
    out = residual(width, kappa_h, flow_x, flow_y)
    out[:-1, 1:-1] -= (penalty * dp)[:-1, 1:-1]
    return out


# --- film --------------------------------------------------------------------------------------------------------


def column_integrals(eta, rho):
    """Twin of film_flow.column_integrals for viscosity and relative density (..., n_z+1) through a film of height 1."""
    z = np.linspace(0.0, 1.0, eta.shape[-1])
    e0 = 1.0 / trapezoid(1.0 / eta, z)
    e1 = 1.0 / trapezoid(z / eta, z)
    r0 = trapezoid(rho, z)
    r1 = trapezoid(rho * cumulative_trapezoid(1.0 / eta, z, initial=0.0), z)
    r2 = trapezoid(rho * cumulative_trapezoid(z / eta, z, initial=0.0), z)
    return e0, e1, r0, r1, r2


def film_flow(x, y, p, h, eta, rho, expansion, u_a, u_b):
    """Twin of energy.film_flow: m_x, m_y, shear, compression, traction. rho [kg/m3], expansion -d ln(rho)/dT [1/K]."""
    p_x = np.gradient(p, x, axis=1)
    p_y = np.gradient(p, y, axis=0)
    p_y[[0, -1]] = 0.0
    z = np.linspace(0.0, 1.0, eta.shape[-1])
    e0, e1 = 1.0 / trapezoid(1.0 / eta, z), 1.0 / trapezoid(z / eta, z)
    tau_x = (e0 * (u_b - u_a) / h - h * p_x * e0 / e1)[..., None] + z * (h * p_x)[..., None]
    tau_y = (-h * p_y * e0 / e1)[..., None] + z * (h * p_y)[..., None]
    gap = h[..., None]
    u = u_a + cumulative_trapezoid(gap * tau_x / eta, z, initial=0.0)
    v = cumulative_trapezoid(gap * tau_y / eta, z, initial=0.0)
    shear = gap * (tau_x**2 + tau_y**2) / eta
    compression = gap * expansion * (u * p_x[..., None] + v * p_y[..., None])
    return rho * u * gap, rho * v * gap, shear, compression, 0.5 * (tau_x[..., 0] + tau_x[..., -1])


def sweep(x, width, h_y, h, heat, conductivity, flow, forward, t):
    """Twin of energy.sweep: columns in turn, each a dense linear system for its inner temperatures.

    Returns the new t, q_a, q_b and the largest change.
    """
    t = t.copy()
    n_y, n_x, n_z = *h.shape, t.shape[2] - 1
    dz = 1.0 / n_z
    q_a, q_b = np.zeros_like(h), np.zeros_like(h)
    change = 0.0
    inner = slice(1, n_z)
    for i in range(1, n_x - 1) if forward else range(n_x - 2, 0, -1):
        for j in range(n_y - 1):
            m_x, here = flow.m_x[j], flow.m_y[j, i]
            # the mirror line sees its neighbour on both sides, with the flow across turned round
            there, back = flow.m_y[j + 1, i], -flow.m_y[1, i] if j == 0 else flow.m_y[j - 1, i]
            west, east = 0.5 * (m_x[i - 1] + m_x[i]), 0.5 * (m_x[i] + m_x[i + 1])
            south, north = 0.5 * (back + here), 0.5 * (here + there)
            if j == 0:
                south = -north
            outflow = (east - west) / width[i] + (north - south) / h_y
            share = np.full(n_z, dz)
            share[0] *= 0.5
            up = -np.cumsum(outflow[:-1] * share)  # through the level between k and k+1

            matrix, rhs = np.zeros((n_z + 1, n_z + 1)), np.zeros(n_z + 1)
            lam = conductivity / h[j, i]
            for k in range(1, n_z):
                matrix[k, [k - 1, k, k + 1]] += np.array([-1.0, 2.0, -1.0]) * lam / dz**2
                # upwind in the form without divergence: inflow times (own - upstream temperature)
                below, above = up[k - 1] * heat / dz, up[k] * heat / dz
                matrix[k, [k, k - 1]] += max(below, 0.0) * np.array([1.0, -1.0])
                matrix[k, [k, k + 1]] += max(-above, 0.0) * np.array([1.0, -1.0])
                w, e = west[k] * heat / width[i], east[k] * heat / width[i]
                if w > 0.0 and e > 0.0 and i > 1 and m_x[i - 2, k] > 0.0:
                    nodes = x[[i, i - 1, i - 2]]
                    weights = np.linalg.solve(np.vander(nodes - x[i], 3, increasing=True).T, [0.0, 1.0, 0.0])
                    m = 0.5 * (west[k] + east[k]) * heat
                    matrix[k, k] += m * weights[0]
                    rhs[k] -= m * (weights[1] * t[j, i - 1, k] + weights[2] * t[j, i - 2, k])
                else:
                    matrix[k, k] += max(w, 0.0)
                    rhs[k] += max(w, 0.0) * t[j, i - 1, k]
                matrix[k, k] += max(-e, 0.0)
                rhs[k] += max(-e, 0.0) * t[j, i + 1, k]
                n, s = north[k] * heat / h_y, south[k] * heat / h_y
                matrix[k, k] += max(-n, 0.0) + max(s, 0.0)
                rhs[k] += max(-n, 0.0) * t[j + 1, i, k] + max(s, 0.0) * t[1 if j == 0 else j - 1, i, k]
                shear, soft, c = flow.shear[j, i, k], flow.soft[j, i, k], flow.compression[j, i, k]
                matrix[k, k] += shear * soft + max(-c, 0.0)
                rhs[k] += shear * (1.0 + soft * t[j, i, k]) + max(c, 0.0) * t[j, i, k]
            matrix[0, 0] = matrix[n_z, n_z] = 1.0
            rhs[[0, n_z]] = t[j, i, [0, n_z]]
            new = np.linalg.solve(matrix, rhs)
            change = max(change, np.abs(new - t[j, i])[inner].max())
            t[j, i, inner] = new[inner]
            q_a[j, i] = lam * (-1.5 * new[0] + 2.0 * new[1] - 0.5 * new[2]) / dz
            q_b[j, i] = lam * (-1.5 * new[-1] + 2.0 * new[-2] - 0.5 * new[-3]) / dz
    return t, q_a, q_b, change
