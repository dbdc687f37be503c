"""The oil in the film; cross-film integrals of the generalised Reynolds equation, and stress and velocity from them.

The film is cut into n_z layers of equal thickness between surface a (z = 0) and b (z = h); integrals over the nodes are
of fourth order, exact for a uniform film. Newtonian oil. Source: Yang & Wen 1990 in the form of the model notes,
section 5.
"""

from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from ...compiled import kernel
from ...parameters.file import LubricantParameters
from ...parameters.oil import ROELANDS_LN
from ...parameters.units import COLDEST
from ...physics import lubricant as lubricant_laws
from ..grid import Array

#: table of ln eta0: below the inlet temperature, range, step [K]; linear interpolation is then accurate to 1e-5
TABLE_BELOW, TABLE_SPAN, TABLE_STEP = 40.0, 640.0, 0.25
LEAST_LAYERS = 4  # fewest layers that the cubics of cumulative_matrix fit in
#: bound of ln(eta) for stresses, which a Barus oil exceeds at high pressure: exp would overflow
LARGEST_LN_ETA = 300.0
#: largest change of temperature in one sweep and by a change of pressure between two energy solves [K]: the sources are
#: exponential in temperature, longer steps overshoot
SWEEP_LIMIT = 30.0


class OilTable(NamedTuple):
    """Numbers of one oil at one inlet temperature.

    table_start [K], ln_eta0 (n,) of Pa s, roelands (else Barus), z, p_r [Pa], alpha [1/Pa],
    rise, fade: A, B of the density law [1/Pa], beta_t: thermal expansion [1/K], t_ref [K], density [kg/m3].
    """

    table_start: float
    ln_eta0: Array
    roelands: bool
    z: float
    p_r: float
    alpha: float
    rise: float
    fade: float
    beta_t: float
    t_ref: float
    density: float


def oil_table(oil: LubricantParameters, temperature: float) -> OilTable:
    """Tabulate the oil's ambient viscosity from 40 K below to 600 K above the inlet temperature [K]."""
    start = max(temperature - TABLE_BELOW, COLDEST)
    t = start + TABLE_STEP * np.arange(int(TABLE_SPAN / TABLE_STEP) + 1)
    # bounded where the Roelands pressure term changes its sign, 6.3e-5 Pa s: below the viscosity of any oil film
    ln_eta0 = np.maximum(np.log(lubricant_laws.eta0(oil, t)), -ROELANDS_LN)
    rise, fade = lubricant_laws.DENSITY_LAWS[oil.density_law]
    return OilTable(
        start, ln_eta0, oil.pressure_law == "roelands", oil.z_roelands, oil.roelands_pressure,
        oil.pressure_viscosity, rise, fade, oil.density_temperature,
        oil.reference_temperature, oil.density,
    )  # fmt: skip


@kernel
def pressure_factor(oil, p):
    """Pressure part of the viscosity law and its derivative [1/Pa]: (1+p/p_r)^Z - 1 (Roelands), alpha p (Barus)."""
    if oil.roelands:
        power = (1.0 + p / oil.p_r) ** oil.z
        return power - 1.0, oil.z * power / (oil.p_r + p)
    return oil.alpha * p, oil.alpha


@kernel
def ln_viscosity(oil, factor, t):
    """ln eta(p, T), d ln eta/dT [1/K] and d ln eta/d factor, from the pressure factor and the temperature [K]."""
    s, last = (t - oil.table_start) / TABLE_STEP, oil.ln_eta0.size - 2
    k = int(np.fmin(np.fmax(s, 0.0), last))
    slope = (oil.ln_eta0[k + 1] - oil.ln_eta0[k]) / TABLE_STEP
    base = oil.ln_eta0[k] + min(max(s - k, 0.0), 1.0) * TABLE_STEP * slope
    if not 0.0 < s < last + 1:
        slope = 0.0  # constant beyond the table
    if oil.roelands:
        return base + (base + ROELANDS_LN) * factor, slope * (1.0 + factor), base + ROELANDS_LN
    return base + factor, slope, 1.0


@kernel
def pressure_density(oil, p):
    """Density over pressure relative to ambient (Dowson & Higginson 1966), and its derivative [1/Pa]."""
    d = 1.0 + oil.fade * p
    return 1.0 + oil.rise * p / d, oil.rise / (d * d)


class SurfaceSpeeds(NamedTuple):
    """Speeds along rolling of the surfaces a (z = 0) and b (z = h) [m/s]."""

    u_a: float
    u_b: float


class FilmFlow(NamedTuple):
    """Flow and heat sources in the film; arrays (n_y, n_x, n_z+1) unless said.

    m_x, m_y: rho u h, rho v h [kg/(m s)] per unit of z/h; shear: dissipation, compression : heating (per kelvin of
    T) times h [W/m2]; sliding: the part of shear that falls with the viscosity; driven: the distribution across the
    film of that of the pressure flow, 1 in sum over the cells of the energy equation, at the density of reference;
    squeeze: change of compression with the pressure of the node [W/(m2 Pa)], per kelvin; soft: -d ln(eta)/dT [1/K];
    stiff: d ln(eta)/dp [1/Pa]; rate: shear rate along x times h [m/s];
    (n_y, n_x): fluidity : integral of dz/eta [m/(Pa s)]; traction_x: stress of mid-film [Pa]; gradient_x, gradient_y :
    pressure gradient that drives the flux of the faces [Pa/m], power : its dissipation times relative density [W/m2].
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
    fluidity: Array
    traction_x: Array
    gradient_x: Array
    gradient_y: Array
    power: Array

    @classmethod
    def empty(cls, ny: int, nx: int, nz: int) -> Self:
        """Zeros."""
        return cls(*np.zeros((10, ny, nx, nz + 1)), *np.zeros((5, ny, nx)))


@kernel
def cumulative_matrix(n):
    """Matrix (n+1, n+1) from values on 0..1 to their integral to each node, by cubics through four nodes."""
    out = np.zeros((n + 1, n + 1))
    for k in range(1, n - 1):
        out[k + 1, k - 1 : k + 3] = np.array((-1.0, 13.0, 13.0, -1.0))
    out[1, :4], out[n, n - 3 :] = np.array((9.0, 19.0, -5.0, 1.0)), np.array((1.0, -5.0, 19.0, 9.0))
    for k in range(n):
        out[k + 1] += out[k]
    return out / (24.0 * n)


@lru_cache(maxsize=8)
def trapezoid_weights(n: int) -> Array:
    """Heights (n+1,) of the cells around the nodes of n layers, 1 in sum."""
    weights = np.full(n + 1, 1.0 / n)
    weights[[0, -1]] *= 0.5
    return weights


@kernel
def film_coefficients(oil, p_max, p, t, speeds, u_e, scale):
    """Ln phi, d ln phi/dP, g, dg/dP (n_y, n_x) of the generalised Reynolds equation at p [p_max], t (n_y, n_x, n_z+1).

    And by_t (n_y, n_x, 2, n_z+1): derivatives of ln phi and g to the temperature of every node across the film [1/K].
    phi = scale * 12 (r1 e0/e1 - r2) [uniform film: scale * rho/eta]; g = [u_a r0 + (u_b-u_a) e0 r1]/u_e.
    r1 = int rho int dz'/eta dz is taken as int (int_z^1 rho)/eta dz, r2 likewise.
    """
    u_a, du = speeds.u_a / u_e, (speeds.u_b - speeds.u_a) / u_e
    (ny, nx), n = p.shape, t.shape[2] - 1
    ln_phi, dln_phi, g, dg = np.empty((ny, nx)), np.empty((ny, nx)), np.empty((ny, nx)), np.empty((ny, nx))
    by_t, integral = np.empty((ny, nx, 2, n + 1)), cumulative_matrix(n)
    weights = integral[n]
    f, f_t, rho, above, carried, carried_z = np.empty((6, n + 1))
    for j in range(ny):
        for i in range(nx):
            factor, d_factor = pressure_factor(oil, p[j, i] * p_max)
            rho_p, rho_slope = pressure_density(oil, p[j, i] * p_max)
            r0 = inv0 = inv1 = r1 = r2 = d_inv0 = d_inv1 = d_r1 = d_r2 = 0.0
            for k in range(n + 1):
                rho[k] = rho_p - oil.beta_t * (t[j, i, k] - oil.t_ref)
                r0 += weights[k] * rho[k]
            for k in range(n + 1):
                z, ahead = k / n, r0
                for m in range(n + 1):
                    ahead -= integral[k, m] * rho[m]
                ln_eta, soft, slope = ln_viscosity(oil, factor, t[j, i, k])
                f[k] = weights[k] * np.exp(-ln_eta)
                f_t[k], f_p, above[k] = -f[k] * soft, -f[k] * slope * d_factor, ahead
                d_r = f_p * ahead + f[k] * rho_slope * (1.0 - z)
                inv0, inv1, r1, r2 = inv0 + f[k], inv1 + z * f[k], r1 + f[k] * ahead, r2 + z * f[k] * ahead
                d_inv0, d_inv1, d_r1, d_r2 = d_inv0 + f_p, d_inv1 + z * f_p, d_r1 + d_r, d_r2 + z * d_r
            c, mean = inv1 / inv0, r1 / inv0
            phi = r1 * c - r2
            ln_phi[j, i], g[j, i] = np.log(12.0 * scale * phi), u_a * r0 + du * mean
            dln_phi[j, i] = p_max * (d_r1 * c + r1 * (d_inv1 - c * d_inv0) / inv0 - d_r2) / phi
            dg[j, i] = p_max * (u_a * rho_slope + du * (d_r1 - mean * d_inv0) / inv0)
            carried[:] = carried_z[:] = 0.0
            for k in range(n + 1):
                for m in range(n + 1):
                    carried[m] += integral[k, m] * f[k]
                    carried_z[m] += integral[k, m] * f[k] * (k / n)
            for k in range(n + 1):
                z = k / n
                by_r1 = f_t[k] * above[k] - oil.beta_t * (weights[k] * inv0 - carried[k])
                by_r2 = z * f_t[k] * above[k] - oil.beta_t * (weights[k] * inv1 - carried_z[k])
                by_c, by_mean = (z - c) * f_t[k] / inv0, (by_r1 - mean * f_t[k]) / inv0
                by_t[j, i, 0, k] = (by_r1 * c + r1 * by_c - by_r2) / phi
                by_t[j, i, 1, k] = du * by_mean - u_a * oil.beta_t * weights[k]
    return ln_phi, dln_phi, g, dg, by_t


@kernel
def wall_stress(h, p_x, p_y, du, eta, weights):
    """Stress at surface a along, across [Pa]: int tau/eta dz = (du, 0), tau = tau_a + z grad p; int 1/eta, z/eta."""
    inv0 = inv1 = 0.0
    for k in range(eta.size):
        inv0 += weights[k] / eta[k]
        inv1 += weights[k] / eta[k] * (k / (eta.size - 1))
    return (du / h - h * p_x * inv1) / inv0, -h * p_y * inv1 / inv0, inv0, inv1


@kernel
def film_flow(oil, x, p, h, t, speeds, flow):
    """Fill flow, but gradients and power (Linearisation.pressure_flow), at p [Pa], h [m], t [K] on nodes x [m]."""
    (ny, nx), n = p.shape, t.shape[2] - 1
    integral = cumulative_matrix(n)
    weights = integral[n]
    eta, rho, f_x, f_y, arm = np.empty((5, n + 1))
    for j in range(ny):
        for i in range(nx):
            gap, p_x, p_y = h[j, i], flow.gradient_x[j, i], flow.gradient_y[j, i]
            factor, d_factor = pressure_factor(oil, p[j, i])
            rho_p, _ = pressure_density(oil, p[j, i])
            mean = lever = 0.0
            for k in range(n + 1):
                ln_eta, slope, by_factor = ln_viscosity(oil, factor, t[j, i, k])
                flow.stiff[j, i, k], flow.soft[j, i, k] = by_factor * d_factor, max(-slope, 0.0)
                eta[k] = np.exp(min(ln_eta, LARGEST_LN_ETA))
                rho[k] = oil.density * (rho_p - oil.beta_t * (t[j, i, k] - oil.t_ref))
                mean += weights[k] * rho[k]
            tau_x, tau_y, inv0, inv1 = wall_stress(gap, p_x, p_y, speeds.u_b - speeds.u_a, eta, weights)
            pivot = inv1 / inv0
            s_x, s_y = tau_x + pivot * gap * p_x, tau_y + pivot * gap * p_y
            flow.fluidity[j, i], flow.traction_x[j, i] = gap * inv0, tau_x + 0.5 * gap * p_x
            for k in range(n + 1):
                arm[k] = k / n - pivot
                f_x[k], f_y[k] = (s_x + arm[k] * gap * p_x) / eta[k], (s_y + arm[k] * gap * p_y) / eta[k]
                # by the trapezoidal rule: so the cells of the energy equation add up the heat
                lever += (0.5 / n if k == 0 or k == n else 1.0 / n) * arm[k] * arm[k] / eta[k]
            # compression along the flow by the differences that carry the temperature: the two move together
            p_up, by_p = p_x, 0.0
            if i > 1:
                d_1, d_2 = x[i] - x[i - 1], x[i] - x[i - 2]
                by_p = 1.0 / d_1 + 1.0 / d_2
                p_up = by_p * p[j, i] - d_2 / (d_1 * (d_2 - d_1)) * p[j, i - 1]
                p_up += d_1 / (d_2 * (d_2 - d_1)) * p[j, i - 2]
            for k in range(n + 1):
                u, v = speeds.u_a, 0.0
                for m in range(n + 1):
                    u += gap * integral[k, m] * f_x[m]
                    v += gap * integral[k, m] * f_y[m]
                flow.m_x[j, i, k], flow.m_y[j, i, k] = rho[k] * u * gap, rho[k] * v * gap
                flow.rate[j, i, k] = gap * f_x[k]
                # dissipation of the sliding with what the pressure flow adds to its rate, and of the pressure flow
                twice = 2.0 * arm[k] * gap
                work = s_x * (s_x + twice * p_x) + s_y * (s_y + twice * p_y)
                flow.sliding[j, i, k] = gap / eta[k] * work
                flow.driven[j, i, k] = arm[k] * arm[k] / eta[k] * oil.density / (lever * mean)
                flow.shear[j, i, k] = flow.sliding[j, i, k] + flow.driven[j, i, k] * flow.power[j, i]
                expansion = gap * oil.beta_t * oil.density / rho[k]
                flow.compression[j, i, k] = expansion * (u * p_up + v * p_y)
                flow.squeeze[j, i, k] = expansion * u * by_p
