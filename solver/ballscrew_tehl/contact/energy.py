"""Film energy equation on the columns of the contact, coupled with the temperatures of both surfaces.

rho c (u T_x + v T_y + w T_z) = k T_zz - (T/rho)(d rho/dT)(u p_x + v p_y) + tau . du/dz   (Eq. 11 with the continuity
equation corrected). Steady; finite volumes of the columns' layers, upwind along the local flow (second order where the
flow runs along +x in three columns), implicit across the film. T = T0 only where flow enters the domain, outlet
included. Where the film cavitates it is taken as full: the heat there is small.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from .film_flow import column_integrals, density_ratio, ln_viscosity, pressure_factor
from .grid import Array, Grid
from .krylov import gmres
from .walls import LineConvolution


class FilmFlow(NamedTuple):
    """Flow and heat sources in the film; arrays (n_y, n_x, n_z+1) unless said.

    m_x, m_y : rho u h, rho v h [kg/(m s)] per unit of z/h; shear : dissipation, compression : heating (per kelvin of
    T) times h [W/m2]; soft : -d ln(eta)/dT [1/K]; traction (n_y, n_x) : mean of the wall shear stresses [Pa].
    """

    m_x: Array
    m_y: Array
    shear: Array
    compression: Array
    soft: Array
    traction: Array

    @classmethod
    def empty(cls, ny: int, nx: int, nz: int) -> FilmFlow:
        m_x, m_y, shear, compression, soft = np.zeros((5, ny, nx, nz + 1))
        return cls(m_x, m_y, shear, compression, soft, np.zeros((ny, nx)))


@njit(cache=True)
def film_flow(oil, x, y, p, h, t, u_a, u_b, flow):
    """Velocities and heat sources of pressure p [Pa], gap h [m], temperature t [K] on nodes x, y [m]; fills flow."""
    ny, nx = p.shape
    nz = t.shape[2] - 1
    dz = 1.0 / nz
    for j in range(ny):
        for i in range(nx):
            i_l, i_r = max(i - 1, 0), min(i + 1, nx - 1)
            if i == 0 or i == nx - 1:
                p_x = (p[j, i_r] - p[j, i_l]) / (x[i_r] - x[i_l])
            else:
                d_l, d_r = x[i] - x[i - 1], x[i + 1] - x[i]
                p_x = ((p[j, i + 1] - p[j, i]) / d_r * d_l + (p[j, i] - p[j, i - 1]) / d_l * d_r) / (
                    d_l + d_r
                )
            inner = 0 < j < ny - 1
            p_y = (p[j + 1, i] - p[j - 1, i]) / (y[j + 1] - y[j - 1]) if inner else 0.0
            e0, e1, _, _, _ = column_integrals(oil, p[j, i], t[j, i], u_a, u_b)
            gap = h[j, i]
            tau_xa = e0 * (u_b - u_a) / gap - gap * p_x * e0 / e1
            tau_ya = -gap * p_y * e0 / e1
            flow.traction[j, i] = tau_xa + 0.5 * gap * p_x
            factor = pressure_factor(oil, p[j, i])
            u, v = u_a, 0.0
            gx_old = gy_old = 0.0
            for k in range(nz + 1):
                z = k * dz * gap
                ln_eta, slope = ln_viscosity(oil, factor, t[j, i, k])
                f = np.exp(-ln_eta)
                tau_x, tau_y = tau_xa + z * p_x, tau_ya + z * p_y
                g_x, g_y = tau_x * f, tau_y * f
                if k > 0:
                    u += 0.5 * dz * gap * (gx_old + g_x)
                    v += 0.5 * dz * gap * (gy_old + g_y)
                gx_old, gy_old = g_x, g_y
                rho = oil.density * density_ratio(oil, p[j, i], t[j, i, k])
                flow.m_x[j, i, k] = rho * u * gap
                flow.m_y[j, i, k] = rho * v * gap
                flow.shear[j, i, k] = gap * (tau_x * g_x + tau_y * g_y)
                expansion = oil.beta_t * oil.density / rho
                flow.compression[j, i, k] = gap * expansion * (u * p_x + v * p_y)
                flow.soft[j, i, k] = max(-slope, 0.0)


@njit(cache=True)
def sweep(x, width, h_y, h, heat, conductivity, flow, forward, t, q_a, q_b, response):
    """One Gauss-Seidel sweep along x (forward or back) over all columns, each solved across the film; walls held.

    width (nx,), h_y [m]; heat: c_p [J/kgK]. Fills q_a, q_b (heat flux into the walls, W/m2) and response (n_y, n_x, 4):
    -dq_a/dT_a, dq_a/dT_b, dq_b/dT_a, -dq_b/dT_b with the neighbour columns held. Returns the largest change [K].
    """
    ny, nx = h.shape
    nz = t.shape[2] - 1
    dz = 1.0 / nz
    n = nz - 1
    lower, diag, upper = np.empty(n), np.empty(n), np.empty(n)
    rhs = np.empty((n, 3))
    f_z = np.empty(nz)
    change = 0.0
    for step in range(1, nx - 1):
        i = step if forward else nx - 1 - step
        for j in range(ny - 1):
            total = 0.0
            for k in range(nz):
                # net outflow of level k sideways; the vertical flux above it follows from continuity
                out = 0.5 * (flow.m_x[j, i + 1, k] - flow.m_x[j, i - 1, k]) / width[i]
                if j == 0:
                    out += (flow.m_y[0, i, k] + flow.m_y[1, i, k]) / h_y
                else:
                    out += 0.5 * (flow.m_y[j + 1, i, k] - flow.m_y[j - 1, i, k]) / h_y
                total -= out * (0.5 * dz if k == 0 else dz)
                f_z[k] = total
            lam = conductivity / h[j, i]
            for r in range(n):
                k = r + 1
                d = 2.0 * lam / (dz * dz)
                lo = hi = lam / (dz * dz)
                b = 0.0
                # west and east faces
                w = 0.5 * (flow.m_x[j, i - 1, k] + flow.m_x[j, i, k]) * heat / width[i]
                e = 0.5 * (flow.m_x[j, i + 1, k] + flow.m_x[j, i, k]) * heat / width[i]
                if w > 0.0:
                    if e > 0.0 and i > 1 and flow.m_x[j, i - 2, k] > 0.0:
                        # second-order upwind slope on the graded nodes
                        d_1, d_2 = x[i] - x[i - 1], x[i] - x[i - 2]
                        m = 0.5 * (w + e) * width[i]
                        a_1 = -d_2 / (d_1 * (d_2 - d_1))
                        a_2 = d_1 / (d_2 * (d_2 - d_1))
                        d -= m * (a_1 + a_2)
                        b -= m * (a_1 * t[j, i - 1, k] + a_2 * t[j, i - 2, k])
                    else:
                        d += w
                        b += w * t[j, i - 1, k]
                if e < 0.0:
                    d -= e
                    b -= e * t[j, i + 1, k]
                # across: north face, south face (mirror for the axis line)
                north = 0.5 * (flow.m_y[j, i, k] + flow.m_y[j + 1, i, k]) * heat / h_y
                if j == 0:
                    if north < 0.0:
                        d -= 2.0 * north
                        b -= 2.0 * north * t[1, i, k]
                else:
                    south = 0.5 * (flow.m_y[j, i, k] + flow.m_y[j - 1, i, k]) * heat / h_y
                    if north < 0.0:
                        d -= north
                        b -= north * t[j + 1, i, k]
                    if south > 0.0:
                        d += south
                        b += south * t[j - 1, i, k]
                # through the film
                below, above = f_z[k - 1] * heat / dz, f_z[k] * heat / dz
                if below > 0.0:
                    d += below
                    lo += below
                if above < 0.0:
                    d -= above
                    hi -= above
                # sources, linearised so that hotter oil shears with less heat
                s = flow.shear[j, i, k]
                d += s * flow.soft[j, i, k]
                b += s + s * flow.soft[j, i, k] * t[j, i, k]
                c = flow.compression[j, i, k]
                if c > 0.0:
                    b += c * t[j, i, k]
                else:
                    d -= c
                lower[r], diag[r], upper[r] = -lo, d, -hi
                rhs[r, 0] = b
                rhs[r, 1] = rhs[r, 2] = 0.0
            rhs[0, 0] -= lower[0] * t[j, i, 0]
            rhs[n - 1, 0] -= upper[n - 1] * t[j, i, nz]
            rhs[0, 1] = -lower[0]
            rhs[n - 1, 2] = -upper[n - 1]
            for r in range(1, n):
                f = lower[r] / diag[r - 1]
                diag[r] -= f * upper[r - 1]
                for c_ in range(3):
                    rhs[r, c_] -= f * rhs[r - 1, c_]
            for c_ in range(3):
                rhs[n - 1, c_] /= diag[n - 1]
            for r in range(n - 2, -1, -1):
                for c_ in range(3):
                    rhs[r, c_] = (rhs[r, c_] - upper[r] * rhs[r + 1, c_]) / diag[r]
            for r in range(n):
                change = max(change, abs(rhs[r, 0] - t[j, i, r + 1]))
                t[j, i, r + 1] = rhs[r, 0]
            g = lam / (2.0 * dz)
            q_a[j, i] = g * (-3.0 * t[j, i, 0] + 4.0 * t[j, i, 1] - t[j, i, 2])
            q_b[j, i] = g * (-3.0 * t[j, i, nz] + 4.0 * t[j, i, nz - 1] - t[j, i, nz - 2])
            response[j, i, 0] = g * (3.0 - 4.0 * rhs[0, 1] + rhs[1, 1])
            response[j, i, 1] = g * (4.0 * rhs[0, 2] - rhs[1, 2])
            response[j, i, 2] = g * (4.0 * rhs[n - 1, 1] - rhs[n - 2, 1])
            response[j, i, 3] = g * (3.0 - 4.0 * rhs[n - 1, 2] + rhs[n - 2, 2])
    return change


def update_walls(
    walls: tuple[LineConvolution, LineConvolution],
    t: Array,
    q_a: Array,
    q_b: Array,
    response: Array,
    t_in: float,
) -> int:
    """Set both wall temperatures of t [K] so that T = T0 + K q, with q linearised in both; returns GMRES iterations.

    Both walls at once: a thin film ties them together much more firmly than either is tied to its own body.
    """
    shape = (2, *q_a.shape)
    wall_a, wall_b = walls
    missing = np.stack([t_in + wall_a(q_a) - t[:, :, 0], t_in + wall_b(q_b) - t[:, :, -1]])

    def apply(v: Array) -> Array:
        d_a, d_b = v.reshape(shape)
        return np.stack([
            d_a + wall_a(response[:, :, 0] * d_a - response[:, :, 1] * d_b),
            d_b + wall_b(response[:, :, 3] * d_b - response[:, :, 2] * d_a),
        ]).ravel()  # fmt: skip

    step, used = gmres(apply, lambda v: v, missing.ravel(), 1e-2, 40)
    t[:, :, 0] += step.reshape(shape)[0]
    t[:, :, -1] += step.reshape(shape)[1]
    return used


class HeatBalance(NamedTuple):
    """Heat of the whole contact [W]: generated by shear and compression, into the walls, carried out by the oil."""

    generated: float
    conducted: float
    convected: float

    @property
    def defect(self) -> float:
        """Relative gap of the balance; vanishes with the grid."""
        return (self.generated - self.conducted - self.convected) / max(self.generated, 1e-300)


def heat_balance(
    grid: Grid, a: float, b: float, heat: float, flow: FilmFlow, t: Array, t_in: float, q_a: Array, q_b: Array
) -> HeatBalance:
    """Integrate the balance over the grid; a, b semi-axes [m]."""
    weights = grid.weights * (a * b)
    nz = t.shape[2] - 1
    across = np.full(nz + 1, 1.0 / nz)
    across[0] = across[-1] = 0.5 / nz
    generated = float(np.sum(weights * ((flow.shear + flow.compression * t) @ across)))
    conducted = float(np.sum(weights * (q_a + q_b)))
    carried = (flow.m_x * (t - t_in)) @ across * heat
    side = (flow.m_y * (t - t_in)) @ across * heat
    line = weights[:, 1] / (grid.width_x[1] * b)
    convected = float(np.sum(line * (carried[:, -2] - carried[:, 1]))) + 2.0 * float(
        np.sum(grid.width_x * b * side[-2])
    )
    return HeatBalance(generated, conducted, convected)
