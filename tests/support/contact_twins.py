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


def film_coefficients(table, p_max, p, p_at, t, t_p, thinning, ln_eta_at, share, speeds, u_e, scale):
    """Twin of film_flow.film_coefficients without the derivatives: ln phi, g, g_y; p may be complex."""
    follow = t_p * ((p - p_at) * p_max)[..., None]
    t = t + np.where(np.abs(np.real(follow)) < 40.0, follow, 40.0 * np.sign(np.real(follow)))
    p = (p * p_max)[..., None] + 0.0 * t
    inv0, inv1, r0, r1, r2 = column_integrals(
        fluidity(table, p, t, thinning, ln_eta_at, share), density(table, p, t)
    )
    e0, e1 = 1.0 / inv0, 1.0 / inv1
    u_a, u_b, v_a, v_b = speeds
    g = (u_a * r0 + (u_b - u_a) * e0 * r1) / u_e
    g_y = (v_a * r0 + (v_b - v_a) * e0 * r1) / u_e
    return np.log(12.0 * scale * (r1 * e0 / e1 - r2)), g, g_y


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


def film_flow(oil, table, x, y, p, h, t, speeds):
    """Twin of film_flow.film_flow: the fields of FilmFlow by name."""
    n_z = t.shape[-1] - 1
    z, running = np.arange(n_z + 1) / n_z, running_integral(n_z)
    everywhere = np.broadcast_to(p[..., None], t.shape)
    eta, rho = np.exp(ln_viscosity(table, everywhere, t)), table.density * density(table, everywhere, t)
    gradient = np.stack([np.gradient(p, x, axis=1), np.gradient(p, y, axis=0)], axis=-1)
    # the first line is one of symmetry or an edge, the last an edge
    gradient[[0, -1], :, 1] = 0.0
    surface_a = np.stack([speeds.u_a, speeds.v_a], axis=-1)
    slip = np.stack([speeds.u_b, speeds.v_b], axis=-1) - surface_a
    wall, thinning = np.zeros((*p.shape, 2)), np.ones(t.shape)
    for j, i in np.ndindex(p.shape):
        wall[j, i], thinning[j, i] = column_stress(
            oil, p[j, i], h[j, i], gradient[j, i], slip[j, i], eta[j, i]
        )
    gap = h[..., None]
    stress = wall[..., None, :] + (z * gap)[..., None] * gradient[..., None, :]
    sheared = stress * (thinning / eta)[..., None]
    speed = surface_a[..., None, :] + np.einsum("kl,jilc->jikc", running, gap[..., None] * sheared)
    upwind, own = upwind_slope(x, p)
    expansion = table.beta_t * table.density / rho
    eps = 1e-30
    # stress at the same shear rate of an oil that is thicker by a share eps
    thicker = np.zeros(t.shape)
    for index in np.ndindex(t.shape):
        rate = np.linalg.norm(sheared[index])
        tau = shear_stress(oil, p[index[:2]], eta[index] * (1.0 + 1j * eps), rate)
        thicker[index] = np.imag(tau) / np.real(tau) / eps
    return {
        "m_x": rho * gap * speed[..., 0],
        "m_y": rho * gap * speed[..., 1],
        "shear": gap * np.sum(stress * sheared, axis=-1),
        "compression": gap
        * expansion
        * (speed[..., 0] * upwind[..., None] + speed[..., 1] * gradient[..., None, 1]),
        "squeeze": gap * expansion * speed[..., 0] * own[:, None],
        "soft": -np.imag(ln_viscosity(table, everywhere, t + 1j * eps)) / eps,
        "stiff": np.imag(ln_viscosity(table, everywhere + 1j * eps, t)) / eps,
        "rate": gap * sheared[..., 0],
        "thinning": thinning,
        "ln_eta": np.log(eta),
        "stress_share": thicker,
        "fluidity": h * ((thinning / eta) @ running[-1]),
        "traction_x": wall[..., 0] + 0.5 * h * gradient[..., 0],
        "traction_y": wall[..., 1] + 0.5 * h * gradient[..., 1],
    }


# --- energy ------------------------------------------------------------------------------------------------------


def _layers(n_z):
    """Share of every level in the film (trapezoidal)."""
    out = np.full(n_z + 1, 1.0 / n_z)
    out[[0, -1]] *= 0.5
    return out


def _mirrored(face_y, mirror):
    """Flow across through the faces below (j) and above (j+1) every line; none known below an edge."""
    return np.concatenate([-face_y[:1] if mirror else 0.0 * face_y[:1], face_y])


def face_flow(width, h_y, mirror, heat, flux_x, flux_y, m_x, m_y, start, end):
    """Twin of energy.face_flow: x, y, z, reverse; zero where the kernel computes nothing."""
    ny, nx, levels = m_x.shape
    share = _layers(levels - 1)
    mean = 0.5 * (m_y[1:] + m_y[:-1])
    y = heat * (mean + (flux_y - mean @ share)[..., None])
    sides = np.diff(_mirrored(flux_y[..., None], mirror)[..., 0], axis=0)
    out_y = np.diff(_mirrored(y, mirror), axis=0)
    x, z, reverse = np.zeros((ny, nx - 1, levels)), np.zeros((ny, nx, levels - 1)), np.zeros(ny, dtype=int)
    for j in range(0 if mirror else 1, ny - 1):
        faces, cells = np.arange(start[j] - 1, end[j]), np.arange(start[j], end[j])
        lost = np.concatenate([[0.0], np.cumsum((width * sides[j] / h_y)[cells])])
        passing = flux_x[j, start[j] - 1] - lost
        profile = 0.5 * (m_x[j, faces] + m_x[j, faces + 1])
        total = profile @ share
        ruptured = (passing > 0.0) & (passing < total)
        full, shrunk = profile + (passing - total)[:, None], profile * (passing / total)[:, None]
        m = np.where(ruptured[:, None], shrunk, full)
        x[j, faces] = heat * m
        back = faces[(m < 0.0).any(axis=1)]
        reverse[j] = back[-1] + 1 if back.size else 0
        out = (x[j, cells] - x[j, cells - 1]) / width[cells, None] + out_y[j, cells] / h_y
        z[j, cells] = -np.cumsum(out * share, axis=1)[:, :-1]
    return x, y, z, reverse


def side_heat(x, width, h_y, mirror, t, t_in, face, j, i, own):
    """Heat [W/m2] that the side faces of all levels of a column bring in if its temperatures were `own`.

    Sum of inflow times (temperature of the face - own). A face has the temperature upstream of it; of second order
    where the oil has passed two columns forward, the first of them solved. Across, outflow by what was known.
    """
    ny = t.shape[0]

    def along(i):
        """Temperature of the face between the columns i and i+1, the column i_own at `own`."""
        column = {m: own if m == i_own else t[j, m] for m in (i - 1, i, i + 1) if m >= 0}
        forward = column[i]
        if i >= 1:
            slope = (column[i] - column[i - 1]) / (x[i] - x[i - 1])
            forward = np.where(face.x[j, i - 1] > 0.0, forward + 0.5 * (x[i + 1] - x[i]) * slope, forward)
        return np.where(face.x[j, i] > 0.0, forward, column[i + 1])

    i_own = i
    west, east = face.x[j, i - 1] / width[i], face.x[j, i] / width[i]
    out = west * (along(i - 1) - own) - east * (along(i) - own)
    flow = _mirrored(face.y, mirror)
    for inflow, step in ((flow[j, i] / h_y, -1), (-flow[j + 1, i] / h_y, 1)):
        near, far, behind = (abs(j + m * step) for m in (1, 2, -1))
        edge = near == ny - 1 or (near == 0 and not mirror)
        from_there = t_in if edge else 1.5 * t[near, i] - 0.5 * t[far, i]
        out = out + np.where(
            inflow > 0.0, inflow * (from_there - own), 0.5 * inflow * (t[j, i] - t[behind, i])
        )
    return out


def sweep(x, width, h_y, mirror, h, conductivity, t_in, flow, face, t_at, cautious, forward, t, limit=30.0):
    """Twin of energy.sweep: columns in turn, each a dense linear system for all its temperatures, walls given.

    Returns a dict: t, t_p, q_a, q_b, response, change. Columns that are not visited keep zero.
    """
    t = t.copy()
    n_y, n_x, n_z = *h.shape, t.shape[2] - 1
    dz, inner = 1.0 / n_z, slice(1, n_z)
    q, response, t_p = np.zeros((2, n_y, n_x)), np.zeros((n_y, n_x, 4)), np.zeros_like(t)
    change = 0.0
    for j in range(0 if mirror else 1, n_y - 1):
        columns = np.arange(face.start[j], face.end[j])
        for i in columns if forward else columns[columns <= face.reverse[j]][::-1]:
            lam = conductivity / (h[j, i] * dz)
            peclet = face.z[j, i] / lam
            # conservative: hotter oil gives less heat, at unchanged stress
            sense = -1.0 if cautious else 1.0
            answer = 2.0 / flow.fluidity[j, i] if flow.fluidity[j, i] > 0.0 and not cautious else 0.0
            up, down = lam * peclet / -np.expm1(-peclet), lam * peclet / np.expm1(peclet)

            def column_heat(own, j=j, i=i, up=up, down=down, sense=sense, answer=answer):
                """Heat of all levels [W/m2] times their share of the film, at temperatures `own`."""
                rising = up * own[:-1] - down * own[1:]
                # oil that flows upwards has the temperature of its cell, the reference of the heat
                lift = face.z[j, i]
                gain = np.zeros(n_z + 1)
                gain[1:] += rising - lift * own[1:]
                gain[:-1] -= rising - lift * own[:-1]
                warmer = own - t_at[j, i]
                soft, rate, shear = flow.soft[j, i], flow.rate[j, i], flow.shear[j, i]
                stress = np.sum(_layers(n_z) * rate * soft * warmer)
                c = flow.compression[j, i]
                heated = shear * (1.0 + sense * soft * warmer) - answer * rate * stress
                heated += np.maximum(c, 0.0) * t[j, i] + np.minimum(c, 0.0) * own
                sides = side_heat(x, width, h_y, mirror, t, t_in, face, j, i, own)
                return gain + _layers(n_z) * (heated + sides)

            zero = column_heat(np.zeros(n_z + 1))
            matrix = np.stack([column_heat(unit) - zero for unit in np.eye(n_z + 1)], axis=1)
            walls = matrix[inner][:, [0, -1]]
            solve = np.linalg.inv(-matrix[inner, inner])
            new = solve @ (zero[inner] + walls @ t[j, i, [0, -1]])
            # more pressure: thicker oil is sheared less, by a stress that rises everywhere
            rate, stiff = flow.rate[j, i], flow.stiff[j, i]
            stress = np.sum(_layers(n_z) * rate * stiff)
            by_p = flow.squeeze[j, i] * t[j, i] - flow.shear[j, i] * stiff + answer * rate * stress
            t_p[j, i, inner] = solve @ (dz * by_p[inner])
            by_walls = solve @ walls
            delta = new - t[j, i, inner]
            change = np.maximum(change, np.abs(delta).max())
            t[j, i, inner] += np.clip(delta, -limit, limit)
            # half cells at the walls: no linearisation; only the effect of the wall itself
            own = t[j, i]
            sides = side_heat(x, width, h_y, mirror, t, t_in, face, j, i, own)
            still = side_heat(x, width, h_y, mirror, t, t_in, face, j, i, own + 1.0)
            source = flow.shear[j, i] + flow.compression[j, i] * own + sides
            for side, (level, next_, b) in enumerate(((0, 1, down[0]), (n_z, n_z - 1, up[-1]))):
                q[side, j, i] = b * (own[next_] - own[level]) + 0.5 * dz * source[level]
                response[j, i, 3 * side] = (
                    b * (1.0 - by_walls[next_ - 1, side]) + 0.5 * dz * (sides - still)[level]
                )
                response[j, i, 1 + side] = b * by_walls[next_ - 1, 1 - side]
    return {"t": t, "t_p": t_p, "q_a": q[0], "q_b": q[1], "response": response, "change": change}
