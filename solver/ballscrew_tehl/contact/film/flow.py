"""Cross-film integrals of the generalised Reynolds equation, and the shear stress and velocity that follow from them.

The film is cut into n_z layers of equal thickness between surface a (z = 0) and b (z = h); integrals over the nodes are
of fourth order, exact for a uniform film. e is the generalised viscosity eta/S with the shear thinning S of the
rheology. Source: Yang & Wen 1990 in the form of the model notes, section 5.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiled import kernel
from ..half_space.grid import Array
from .oil import NEWTONIAN, ln_viscosity, pressure_density, pressure_factor, shear_thinning, thinned_stress

#: bound of ln(eta) for stresses, which a Barus oil exceeds at high pressure: exp would overflow
LARGEST_LN_ETA = 300.0
#: largest change of temperature by a change of pressure between two energy solves [K]: bounds a start far away
FOLLOW_LIMIT = 40.0

#: residual of the sliding speed at which the stress of a column is converged, relative; slip [m/s] below which it is
#: relative to this one; most Newton steps
STRESS_TOLERANCE, LEAST_SLIP, STRESS_STEPS = 1e-9, 1e-12, 60


class SurfaceSpeeds(NamedTuple):
    """Speeds along rolling of the surfaces a (z = 0) and b (z = h) [m/s]."""

    u_a: float
    u_b: float


class FilmFlow(NamedTuple):
    """Flow and heat sources in the film; arrays (n_y, n_x, n_z+1) unless said.

    m_x, m_y : rho u h, rho v h [kg/(m s)] per unit of z/h; shear : dissipation, compression : heating (per kelvin of
    T) times h [W/m2]; sliding : the part of shear that falls with the viscosity; driven : the distribution across the
    film of that of the pressure flow, 1 in sum over the cells of the energy equation, at the density of reference;
    squeeze : change of compression with the pressure of the node [W/(m2 Pa)], per kelvin; soft : -d ln(eta)/dT [1/K];
    stiff : d ln(eta)/dp [1/Pa]; rate : shear rate along x times h [m/s];
    thinning : S; ln_eta : ln of eta [Pa s] that S belongs to; stress_share : d ln(stress)/d ln(eta) at a given
    shear rate, 1 if Newtonian;
    (n_y, n_x): fluidity : integral of dz/e, with the slope of the rate over stress of a thinning oil [m/(Pa s)];
    stress_x, stress_y : at the level about which the pressure gradient turns it [Pa]; traction_x, traction_y : in
    mid-film [Pa]; gradient_x, gradient_y : pressure gradient that drives the flux of the faces [Pa/m], power : its
    dissipation times the relative density [W/m2].
    """

    m_x: Array
    m_y: Array
    shear: Array
    compression: Array
    sliding: Array
    driven: Array
    squeeze: Array
    soft: Array
    stiff: Array
    rate: Array
    thinning: Array
    ln_eta: Array
    stress_share: Array
    fluidity: Array
    stress_x: Array
    stress_y: Array
    traction_x: Array
    traction_y: Array
    gradient_x: Array
    gradient_y: Array
    power: Array

    @classmethod
    def empty(cls, ny: int, nx: int, nz: int) -> FilmFlow:
        films, columns = np.zeros((10, ny, nx, nz + 1)), np.zeros((8, ny, nx))
        thinning, stress_share = np.ones((2, ny, nx, nz + 1))
        fields = [*films, thinning, np.zeros_like(thinning), stress_share, *columns]
        return cls(*fields)


@kernel
def cumulative(f, dz, out):
    """Integral of nodal values from the first node to each, by the cubic through four nodes (n >= 4 layers)."""
    n = f.size - 1
    c = dz / 24.0
    out[0] = 0.0
    out[1] = c * (9.0 * f[0] + 19.0 * f[1] - 5.0 * f[2] + f[3])
    for k in range(1, n - 1):
        out[k + 1] = out[k] + c * (13.0 * (f[k] + f[k + 1]) - f[k - 1] - f[k + 2])
    out[n] = out[n - 1] + c * (9.0 * f[n] + 19.0 * f[n - 1] - 5.0 * f[n - 2] + f[n - 3])


@kernel
def cumulative_matrix(n):
    """Matrix (n+1, n+1) of `cumulative` on the unit interval; its last row has the weights of the integral to 1."""
    out = np.empty((n + 1, n + 1))
    unit = np.zeros(n + 1)
    column = np.empty(n + 1)
    for m in range(n + 1):
        unit[m] = 1.0
        cumulative(unit, 1.0 / n, column)
        out[:, m] = column
        unit[m] = 0.0
    return out


@kernel
def film_coefficients(oil, p_max, p, t, flow, speeds, u_e, scale, ln_phi, dln_phi, g, dg, by_t):
    """Coefficients of the generalised Reynolds equation and their derivatives to P = p/p_max and to temperature.

    phi = scale * 12 (r1 e0/e1 - r2) [uniform film: scale * rho/eta]; g = [u_a r0 + (u_b-u_a) e0 r1]/u_e. p (n_y, n_x)
    dimensionless, t (n_y, n_x, n_z+1); the thinning of flow belongs to the viscosity of flow and follows the viscosity
    by stress_share as at a given shear rate. by_t (n_y, n_x, 2, n_z+1): derivatives of ln phi and g to the temperature
    of every node across the film [1/K]; the others at constant temperature. r1 = int rho int dz'/e dz is taken as
    int (int_z^1 rho)/e dz, r2 likewise.
    """
    thinning, ln_eta_at, share = flow.thinning, flow.ln_eta, flow.stress_share
    u_a, du = speeds.u_a / u_e, (speeds.u_b - speeds.u_a) / u_e
    ny, nx = p.shape
    n = t.shape[2] - 1
    integral = cumulative_matrix(n)
    weights = integral[n]
    f, f_t, f_p, rest, carried, carried_z = np.empty((6, n + 1))
    for j in range(ny):
        for i in range(nx):
            factor, d_factor = pressure_factor(oil, p[j, i] * p_max)
            rho_p, rho_slope = pressure_density(oil, p[j, i] * p_max)
            r0 = 0.0
            for k in range(n + 1):
                ln_eta, soft, slope = ln_viscosity(oil, factor, t[j, i, k])
                f[k] = (
                    weights[k]
                    * thinning[j, i, k]
                    * np.exp(-ln_eta_at[j, i, k] - share[j, i, k] * (ln_eta - ln_eta_at[j, i, k]))
                )
                f_t[k] = -f[k] * share[j, i, k] * soft
                f_p[k] = -f[k] * share[j, i, k] * slope * d_factor
                rest[k] = rho_p - oil.beta_t * (t[j, i, k] - oil.t_ref)
                r0 += weights[k] * rest[k]
                carried[k] = carried_z[k] = 0.0
            # rest: mass above each node; carried: sum over the nodes of f times the integral up to them, by node
            inv0 = inv1 = r1 = r2 = d_inv0 = d_inv1 = d_r1 = d_r2 = 0.0
            for k in range(n + 1):
                z = k / n
                below = 0.0
                for m in range(n + 1):
                    c = integral[k, m]
                    below += c * rest[m]
                    carried[m] += c * f[k]
                    carried_z[m] += c * z * f[k]
                w = r0 - below
                d_w = rho_slope * (1.0 - z)
                inv0 += f[k]
                inv1 += z * f[k]
                r1 += f[k] * w
                r2 += z * f[k] * w
                d_inv0 += f_p[k]
                d_inv1 += z * f_p[k]
                d_r1 += f_p[k] * w + f[k] * d_w
                d_r2 += z * (f_p[k] * w + f[k] * d_w)
            c = inv1 / inv0
            mean = r1 / inv0
            phi = r1 * c - r2
            ln_phi[j, i] = np.log(12.0 * scale * phi)
            dln_phi[j, i] = p_max * (d_r1 * c + r1 * (d_inv1 - c * d_inv0) / inv0 - d_r2) / phi
            d_mean = p_max * (d_r1 - mean * d_inv0) / inv0
            g[j, i] = u_a * r0 + du * mean
            dg[j, i] = u_a * p_max * rho_slope + du * d_mean
            for k in range(n + 1):
                z = k / n
                below = 0.0
                for m in range(n + 1):
                    below += integral[k, m] * rest[m]
                w = r0 - below
                by_r1 = f_t[k] * w - oil.beta_t * (weights[k] * inv0 - carried[k])
                by_r2 = z * f_t[k] * w - oil.beta_t * (weights[k] * inv1 - carried_z[k])
                by_c = (z - c) * f_t[k] / inv0
                by_mean = (by_r1 - mean * f_t[k]) / inv0
                by_t[j, i, 0, k] = (by_r1 * c + r1 * by_c - by_r2) / phi
                by_t[j, i, 1, k] = du * by_mean - u_a * oil.beta_t * weights[k]


@kernel
def isothermal_coefficients(oil, p_max, p, t, speeds, u_e, scale, ln_phi, dln_phi, g, dg):
    """The same for one temperature t [K] everywhere and a Newtonian oil: phi = scale rho/eta."""
    ny, nx = p.shape
    u = 0.5 * (speeds.u_a + speeds.u_b) / u_e
    for j in range(ny):
        for i in range(nx):
            factor, d_factor = pressure_factor(oil, p[j, i] * p_max)
            rho, d_rho = pressure_density(oil, p[j, i] * p_max)
            rho -= oil.beta_t * (t - oil.t_ref)
            ln_eta, _, slope = ln_viscosity(oil, factor, t)
            ln_phi[j, i] = np.log(scale * rho) - ln_eta
            dln_phi[j, i] = p_max * (d_rho / rho - slope * d_factor)
            g[j, i] = u * rho
            dg[j, i] = p_max * u * d_rho


@kernel
def wall_stress(oil, p, h, p_x, p_y, du, viscosity, weights, thinning):
    """Shear stress at surface a along and across [Pa]; sets the thinning of the column.

    int tau/e dz = (du, 0) with tau = tau_a + z grad p, solved by Newton for a shear-thinning oil (n_z+1 values of
    viscosity, weights, thinning). p [Pa], h [m], pressure gradients [Pa/m], speed du of b relative to a [m/s].
    """
    n = viscosity.size - 1
    inv0 = inv1 = 0.0
    for k in range(n + 1):
        f = weights[k] / viscosity[k]
        inv0 += f
        inv1 += f * k / n
    t_x = (du / h - h * p_x * inv1) / inv0
    t_y = -h * p_y * inv1 / inv0
    if oil.rheology == NEWTONIAN:
        return t_x, t_y
    # start: the stress of a uniform film in its middle
    m_x, m_y = t_x + 0.5 * h * p_x, t_y + 0.5 * h * p_y
    size = np.sqrt(m_x * m_x + m_y * m_y)
    if size > 0.0:
        share = thinned_stress(oil, p, size) / size
        t_x, t_y = share * m_x - 0.5 * h * p_x, share * m_y - 0.5 * h * p_y
    scale = abs(du) + LEAST_SLIP
    for _ in range(STRESS_STEPS):
        r_x, r_y = -du / h, 0.0
        j_xx = j_xy = j_yy = 0.0
        for k in range(n + 1):
            z = k * h / n
            s_x, s_y = t_x + z * p_x, t_y + z * p_y
            tau = np.sqrt(s_x * s_x + s_y * s_y)
            thin, slope = shear_thinning(oil, p, viscosity[k], tau)
            thinning[k] = thin
            f = weights[k] / viscosity[k]
            r_x += f * thin * s_x
            r_y += f * thin * s_y
            extra = f * slope / (tau * tau + 1e-30)
            j_xx += f * thin + extra * s_x * s_x
            j_xy += extra * s_x * s_y
            j_yy += f * thin + extra * s_y * s_y
        if not (abs(r_x) + abs(r_y)) * h > STRESS_TOLERANCE * scale:
            break
        det = j_xx * j_yy - j_xy * j_xy
        d_x = -(j_yy * r_x - j_xy * r_y) / det
        d_y = -(j_xx * r_y - j_xy * r_x) / det
        # the rate is convex in the stress beyond its present size: from above Newton cannot miss, from below it can
        size, limit = np.sqrt(d_x * d_x + d_y * d_y), 0.5 * oil.stress + 0.5 * np.sqrt(t_x * t_x + t_y * t_y)
        if size > limit:
            d_x *= limit / size
            d_y *= limit / size
        t_x += d_x
        t_y += d_y
    return t_x, t_y


@kernel
def film_flow(oil, x, p, h, t, speeds, flow):
    """Velocities, stresses and heat sources of pressure p [Pa], gap h [m], temperature t [K] on nodes x [m].

    Fills flow; its gradients and power are those of kernels.pressure_flow, its thinning is the start for a
    shear-thinning column.
    """
    ny, nx = p.shape
    n = t.shape[2] - 1
    dz = 1.0 / n
    weights = cumulative_matrix(n)[n]
    du = speeds.u_b - speeds.u_a
    eta, rho, e, f_x, f_y, u, v = np.empty((7, n + 1))
    for j in range(ny):
        for i in range(nx):
            p_x, p_y = flow.gradient_x[j, i], flow.gradient_y[j, i]
            # compression along the flow by the differences that carry the temperature: the two move together
            p_up, by_p = p_x, 0.0
            if i > 1:
                d_1, d_2 = x[i] - x[i - 1], x[i] - x[i - 2]
                by_p = 1.0 / d_1 + 1.0 / d_2
                p_up = (
                    by_p * p[j, i]
                    - d_2 / (d_1 * (d_2 - d_1)) * p[j, i - 1]
                    + d_1 / (d_2 * (d_2 - d_1)) * p[j, i - 2]
                )
            gap = h[j, i]
            factor, d_factor = pressure_factor(oil, p[j, i])
            rho_p, _ = pressure_density(oil, p[j, i])
            for k in range(n + 1):
                ln_eta, slope, by_factor = ln_viscosity(oil, factor, t[j, i, k])
                flow.stiff[j, i, k] = by_factor * d_factor
                flow.ln_eta[j, i, k] = ln_eta
                eta[k] = np.exp(min(ln_eta, LARGEST_LN_ETA))
                rho[k] = oil.density * (rho_p - oil.beta_t * (t[j, i, k] - oil.t_ref))
                flow.soft[j, i, k] = max(-slope, 0.0)
            tau_x, tau_y = wall_stress(oil, p[j, i], gap, p_x, p_y, du, eta, weights, flow.thinning[j, i])
            flow.traction_x[j, i] = tau_x + 0.5 * gap * p_x
            flow.traction_y[j, i] = tau_y + 0.5 * gap * p_y
            inv0 = inv1 = sloped = 0.0
            for k in range(n + 1):
                z = k * dz
                s_x, s_y = tau_x + z * gap * p_x, tau_y + z * gap * p_y
                if oil.rheology != NEWTONIAN:
                    thin, slope = shear_thinning(oil, p[j, i], eta[k], np.sqrt(s_x * s_x + s_y * s_y))
                    flow.stress_share[j, i, k] = thin / (thin + slope)
                e[k] = flow.thinning[j, i, k] / eta[k]
                w = weights[k] * e[k]
                inv0 += w
                inv1 += w * z
                sloped += w / flow.stress_share[j, i, k]
                f_x[k], f_y[k] = s_x * e[k], s_y * e[k]
                flow.rate[j, i, k] = gap * f_x[k]
            flow.fluidity[j, i] = gap * sloped
            pivot = inv1 / inv0
            # by the trapezoidal rule: so the cells of the energy equation add up the heat
            lever = 0.0
            for k in range(n + 1):
                z = k * dz - pivot
                lever += (0.5 * dz if k == 0 or k == n else dz) * z * z * e[k]
            flow.stress_x[j, i], flow.stress_y[j, i] = tau_x + pivot * gap * p_x, tau_y + pivot * gap * p_y
            cumulative(f_x, dz * gap, u)
            cumulative(f_y, dz * gap, v)
            rho_mean = 0.0
            for k in range(n + 1):
                rho_mean += weights[k] * rho[k]
            for k in range(n + 1):
                # dissipation of the sliding with what the pressure flow adds to its rate, and of the pressure flow
                z = k * dz - pivot
                x_x, x_y = z * gap * p_x, z * gap * p_y
                flow.sliding[j, i, k] = (
                    gap
                    * e[k]
                    * (
                        flow.stress_x[j, i] * (flow.stress_x[j, i] + 2.0 * x_x)
                        + flow.stress_y[j, i] * (flow.stress_y[j, i] + 2.0 * x_y)
                    )
                )
                flow.driven[j, i, k] = z * z * e[k] / lever * oil.density / rho_mean
                flow.shear[j, i, k] = flow.sliding[j, i, k] + flow.driven[j, i, k] * flow.power[j, i]
                u_k, v_k = speeds.u_a + u[k], v[k]
                flow.m_x[j, i, k] = rho[k] * u_k * gap
                flow.m_y[j, i, k] = rho[k] * v_k * gap
                expansion = oil.beta_t * oil.density / rho[k]
                flow.compression[j, i, k] = gap * expansion * (u_k * p_up + v_k * p_y)
                flow.squeeze[j, i, k] = gap * expansion * u_k * by_p
