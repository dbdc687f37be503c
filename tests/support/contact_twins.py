"""Plain NumPy twins of the compiled contact kernels: whole arrays and dense matrices instead of point loops.

Written from the equations in the kernels' docstrings; they share no code with them. Slow, for small grids only.
"""

import numpy as np
from scipy.optimize import brentq, root

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


def strips(s, y, beta, points=40):
    """Twin of walls.strips: Gauss rule in t, y = s sinh t, on fixed pieces of the range that counts."""
    v, w = np.polynomial.legendre.leggauss(points)
    out = np.zeros((s.size, y.size - 1))
    for n, d in np.ndindex(out.shape):
        t_0, t_1 = np.arcsinh(y[d] / s[n]), np.arcsinh(y[d + 1] / s[n])
        if beta > 0.0:
            t_1 = min(t_1, np.arccosh(1.0 + 40.0 / (beta * s[n])))
        ends = np.linspace(t_0, max(t_0, t_1), 17)
        t = 0.5 * (ends[1:] + ends[:-1])[:, None] + 0.5 * np.diff(ends)[:, None] * v
        out[n, d] = np.sum(0.5 * np.diff(ends)[:, None] * w * np.exp(-beta * s[n] * (np.cosh(t) - 1.0)))
    return out


def cell_integrals(x, edges, sign, breaks, table, own):
    """Twin of line_table.cell_integrals."""
    s = sign * (x[:, None] - edges[None, :])
    panel = np.clip(np.searchsorted(breaks, s, side="right") - 1, 0, breaks.size - 2)
    t = (s - breaks[panel]) / (breaks[panel + 1] - breaks[panel]) * 2.0 - 1.0
    powers = t[:, :, None] ** np.arange(table.shape[1])
    primitive = np.einsum("ikq,ikqm->mik", powers, table[panel]) * (s >= breaks[0])
    return own - sign * np.diff(primitive, axis=2)


# --- Reynolds equation -------------------------------------------------------------------------------------------
#
# No derivatives here: fields may be complex, so that a step of 1e-30 i gives derivatives to rounding.


def lifted_gap(h, floor):
    """Twin of kernels.lifted_gap."""
    above = np.real(h) >= floor
    return np.where(above, h, floor * np.exp(np.where(above, 0.0, h / floor - 1.0)))


def _log_mean(left, right):
    """Logarithmic mean of exp(left), exp(right): the integral of exp(left + w (right - left)) dw over 0..1.

    The definition, exact to rounding with 40 points.
    """
    w, weight = np.polynomial.legendre.leggauss(40)
    return np.exp(left[..., None] + 0.5 * (1.0 + w) * (right - left)[..., None]) @ (0.5 * weight)


def wedge_weights(x):
    """Weights (nx-1, 3) of the nodes i, i-1, i+1 at the face between i and i+1: Lagrange; the first face upwind."""
    out = np.zeros((x.size - 1, 3))
    out[0, 0] = 1.0
    for i in range(1, x.size - 1):
        nodes, face = x[[i, i - 1, i + 1]], 0.5 * (x[i] + x[i + 1])
        for m in range(3):
            others = np.delete(nodes, m)
            out[i, m] = np.prod((face - others) / (nodes[m] - others))
    return out


def poiseuille_along(x, p, gap, ln_phi, floor):
    """Pressure flow through the faces along x."""
    h = lifted_gap(0.5 * (gap[:, 1:] + gap[:, :-1]), floor)
    return h**3 * _log_mean(ln_phi[:, :-1], ln_phi[:, 1:]) * np.diff(p, axis=1) / np.diff(x)


def face_fluxes(x, kappa_h, mirror, open_side, p, gap, ln_phi, g, g_y, floor):
    """Twin of kernels.face_fluxes: flow_x, flow_y."""
    mass, wedge = g * gap, wedge_weights(x)
    before = np.concatenate([mass[:, :1], mass[:, :-2]], axis=1)
    carried = wedge[:, 0] * mass[:, :-1] + wedge[:, 1] * before + wedge[:, 2] * mass[:, 1:]
    flow_x = poiseuille_along(x, p, gap, ln_phi, floor) - carried

    h = lifted_gap(gap, floor)
    e = (2.0 / (1.0 / h[:-1] + 1.0 / h[1:])) ** 3 * _log_mean(ln_phi[:-1], ln_phi[1:])
    if open_side:
        # inner line, the one beyond it, face between them
        for near, beyond, face in [(-2, -1, -1)] + ([] if mirror else [(1, 0, 0)]):
            opening = h[near] / h[beyond]
            e[face] *= 1.0 - np.where(np.real(opening) < 1.0, opening, 1.0) ** 1.75
    across = g_y * gap
    return flow_x, kappa_h * e * np.diff(p, axis=0) - 0.5 * (across[1:] + across[:-1])


def residual(width, kappa_h, mirror, flow_x, flow_y):
    """Twin of kernels.residual: divergence; at a mirror the flow across changes sign."""
    out = np.zeros((flow_x.shape[0], flow_y.shape[1]), dtype=flow_x.dtype)
    across = np.concatenate([-flow_y[:1], flow_y])
    along = np.diff(flow_x, axis=1)[:-1] / width[1:-1]
    out[:-1, 1:-1] = along + kappa_h * np.diff(across, axis=0)[:, 1:-1]
    if not mirror:
        out[0] = 0.0
    return out


# --- oil --------------------------------------------------------------------------------------------------------------


def shear_rate(oil, p, eta, tau):
    """Shear rate [1/s] of a shear stress tau >= 0 [Pa] by the rheology that the lubricant names; for scalars."""
    if oil.rheology == "eyring":
        return oil.eyring_stress / eta * np.sinh(tau / oil.eyring_stress)
    if oil.rheology == "limiting_shear_stress":
        limit = max(oil.limiting_stress_ambient, oil.limiting_stress_slope * p)
        return -limit / eta * np.log1p(-tau / limit)
    if oil.rheology == "carreau":
        n, modulus = oil.carreau_exponent, oil.carreau_modulus

        def excess(ln_x):
            return ln_x + 0.5 * (n - 1.0) * np.logaddexp(0.0, 2.0 * ln_x) - np.log(tau / modulus)

        return modulus / eta * np.exp(brentq(excess, -100.0, 300.0, xtol=1e-14, rtol=1e-14))
    return tau / eta


def shear_stress(oil, p, eta, rate):
    """Shear stress [Pa] of a shear rate [1/s]: the closed inverse."""
    newtonian = eta * rate
    if oil.rheology == "eyring":
        return oil.eyring_stress * np.arcsinh(newtonian / oil.eyring_stress)
    if oil.rheology == "limiting_shear_stress":
        limit = max(oil.limiting_stress_ambient, oil.limiting_stress_slope * p)
        return -limit * np.expm1(-newtonian / limit)
    if oil.rheology == "carreau":
        return newtonian * (1.0 + (newtonian / oil.carreau_modulus) ** 2) ** (
            0.5 * (oil.carreau_exponent - 1.0)
        )
    return newtonian


# --- film --------------------------------------------------------------------------------------------------------


def ln_viscosity(table, p, t):
    """ln eta by the laws on the table of an oil, p and t of one shape; both may be complex."""
    s = (t - table.table_start) / 0.25
    k = np.clip(np.floor(np.real(s)).astype(int), 0, table.ln_eta0.size - 2)
    ln_eta0 = table.ln_eta0[k] * (1.0 - (s - k)) + table.ln_eta0[k + 1] * (s - k)
    if table.roelands:
        return ln_eta0 + (ln_eta0 + 9.67) * ((1.0 + p / table.p_r) ** table.z - 1.0)
    return ln_eta0 + table.alpha * p


def density(table, p, t):
    """Density relative to the reference, as ln_viscosity."""
    return 1.0 + table.rise * p / (1.0 + table.fade * p) - table.beta_t * (t - table.t_ref)


def running_integral(n):
    """Matrix (n+1, n+1): integral from 0 to z_k on n layers of 0..1, every layer by the cubic through four nodes."""
    z = np.arange(n + 1) / n
    out = np.zeros((n + 1, n + 1))
    for k in range(n):
        nodes = min(max(k - 1, 0), n - 3) + np.arange(4)
        powers = np.arange(4)[:, None]
        moments = (z[k + 1] ** (powers + 1) - z[k] ** (powers + 1)) / (powers + 1)
        out[k + 1] = out[k]
        out[k + 1, nodes] += np.linalg.solve(z[nodes] ** powers, moments)[:, 0]
    return out


def column_integrals(inv_e, rho):
    """Twin of film_flow.column_integrals: 1/e0, 1/e1, r0, r1, r2 for 1/e and rho (..., n_z+1), a film of height 1.

    r1 and r2 with the order of integration turned round: oil above a level moves with what the level is sheared.
    """
    n = rho.shape[-1] - 1
    z, running = np.arange(n + 1) / n, running_integral(n)
    weights = running[-1]
    above = (rho @ weights)[..., None] - rho @ running.T
    return (
        inv_e @ weights,
        (z * inv_e) @ weights,
        rho @ weights,
        (above * inv_e) @ weights,
        (above * z * inv_e) @ weights,
    )


def fluidity(table, p, t, thinning, ln_eta_at, share):
    """1/e [1/(Pa s)]: at the viscosity ln_eta_at the one with the thinning, from there eta^-share."""
    ratio = np.exp(ln_viscosity(table, p, t) - ln_eta_at)
    return thinning / (np.exp(ln_eta_at) * ratio**share)


def upwind_slope(x, p):
    """dp/dx by the quadratic through the node and two behind it, and its derivative to the node's own p."""
    slope, own = np.gradient(p, x, axis=1), np.zeros(x.size)
    for i in range(2, x.size):
        nodes = x[[i, i - 1, i - 2]] - x[i]
        weights = np.linalg.solve(nodes ** np.arange(3)[:, None], [0.0, 1.0, 0.0])
        slope[:, i], own[i] = p[:, [i, i - 1, i - 2]] @ weights, weights[0]
    return slope, own


def column_stress(oil, p, h, gradient, slip, eta):
    """Stress (2,) at surface a [Pa] by a general root finder, and the thinning (n_z+1,).

    gradient, slip (2,): of pressure, and the speed of b relative to a. eta (n_z+1,) [Pa s].
    """
    n = eta.size - 1
    z, weights = h * np.arange(n + 1) / n, running_integral(n)[-1]

    def thinning_at(wall):
        tau = np.linalg.norm(wall[:, None] + z * gradient[:, None], axis=0)
        return np.array([eta[k] * shear_rate(oil, p, eta[k], tau[k]) / tau[k] for k in range(n + 1)])

    def sliding(wall):
        return h * (wall[:, None] + z * gradient[:, None]) @ (weights * thinning_at(wall) / eta)

    rate = np.linalg.norm(slip) / h
    mean = 1.0 / (weights @ (1.0 / eta))
    start = shear_stress(oil, p, mean, rate) * slip / (rate * h) - 0.5 * h * gradient
    unit = np.linalg.norm(start)
    found = root(lambda v: (sliding(v * unit) - slip) / np.linalg.norm(slip), start / unit, tol=1e-13)
    wall = found.x * unit
    assert np.linalg.norm(sliding(wall) - slip) < 1e-9 * np.linalg.norm(slip), found.message
    return wall, thinning_at(wall)
