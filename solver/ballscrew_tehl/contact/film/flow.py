"""Cross-film integrals of the generalised Reynolds equation, and the shear stress and velocity that follow from them.

The film is cut into n_z layers of equal thickness between surface a (z = 0) and b (z = h); integrals over the nodes are
of fourth order, exact for a uniform film. Newtonian oil. Source: Yang & Wen 1990 in the form of the model notes,
section 5.
"""

from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from ..half_space.grid import Array
from .oil import OilTable, ln_viscosity, pressure_density, pressure_factor

#: fewest layers that the cubics of cumulative_matrix fit in
LEAST_LAYERS = 4
#: bound of ln(eta) for stresses, which a Barus oil exceeds at high pressure: exp would overflow
LARGEST_LN_ETA = 300.0
#: largest change of temperature by a change of pressure between two energy solves [K]: bounds a start far away
FOLLOW_LIMIT = 40.0


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
    (n_y, n_x): fluidity : integral of dz/eta [m/(Pa s)];
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
    fluidity: Array
    stress_x: Array
    stress_y: Array
    traction_x: Array
    traction_y: Array
    gradient_x: Array
    gradient_y: Array
    power: Array

    @classmethod
    def empty(cls, ny: int, nx: int, nz: int) -> Self:
        return cls(*np.zeros((10, ny, nx, nz + 1)), *np.zeros((8, ny, nx)))


@lru_cache(maxsize=8)
def cumulative_matrix(n: int) -> Array:
    """Matrix (n+1, n+1) from nodal values on the unit interval to their integral from the first node to each.

    By the cubic through four nodes, n >= LEAST_LAYERS; the last row has the weights of the whole integral.
    """
    steps = np.zeros((n, n + 1))
    for k in range(1, n - 1):
        steps[k, k - 1 : k + 3] = -1.0, 13.0, 13.0, -1.0
    steps[0, :4] = steps[-1, :-5:-1] = 9.0, 19.0, -5.0, 1.0
    return np.concatenate((np.zeros((1, n + 1)), np.cumsum(steps, axis=0))) / (24.0 * n)


@lru_cache(maxsize=8)
def trapezoid_weights(n: int) -> Array:
    """Heights (n+1,) of the cells around the nodes of n layers, 1 in sum."""
    weights = np.full(n + 1, 1.0 / n)
    weights[[0, -1]] *= 0.5
    return weights


def film_coefficients(
    oil: OilTable, p_max: float, p: Array, t: Array, speeds: SurfaceSpeeds, u_e: float, scale: float
) -> tuple[Array, Array, Array, Array, Array]:
    """Coefficients of the generalised Reynolds equation and their derivatives to P = p/p_max and to temperature.

    phi = scale * 12 (r1 e0/e1 - r2) [uniform film: scale * rho/eta]; g = [u_a r0 + (u_b-u_a) e0 r1]/u_e. p (n_y, n_x)
    dimensionless, t (n_y, n_x, n_z+1). r1 = int rho int dz'/eta dz is taken as int (int_z^1 rho)/eta dz, r2 likewise.

    Returns      ln phi, d ln phi/dP, g, dg/dP (n_y, n_x) at constant temperature; by_t (n_y, n_x, 2, n_z+1):
                 derivatives of ln phi and g to the temperature of every node across the film [1/K]
    """
    u_a, du = speeds.u_a / u_e, (speeds.u_b - speeds.u_a) / u_e
    n = t.shape[2] - 1
    z, integral = np.linspace(0.0, 1.0, n + 1), cumulative_matrix(n)
    weights = integral[n]
    factor, d_factor = pressure_factor(oil, p[..., None] * p_max)
    rho_p, rho_slope = pressure_density(oil, p[..., None] * p_max)
    ln_eta, soft, slope = ln_viscosity(oil, factor, t)
    f = weights * np.exp(-ln_eta)
    f_t, f_p = -f * soft, -f * slope * d_factor
    rho = rho_p - oil.beta_t * (t - oil.t_ref)
    r0 = rho @ weights
    # mass above each node
    above = r0[..., None] - rho @ integral.T
    d_r = f_p * above + f * rho_slope * (1.0 - z)
    inv0, inv1, d_inv0, d_inv1 = f.sum(axis=2), f @ z, f_p.sum(axis=2), f_p @ z
    r1, r2, d_r1, d_r2 = (f * above).sum(axis=2), (f * above) @ z, d_r.sum(axis=2), d_r @ z
    c, mean = inv1 / inv0, r1 / inv0
    phi = r1 * c - r2
    dln_phi = p_max * (d_r1 * c + r1 * (d_inv1 - c * d_inv0) / inv0 - d_r2) / phi
    dg = p_max * (u_a * rho_slope[..., 0] + du * (d_r1 - mean * d_inv0) / inv0)
    by_r1 = f_t * above - oil.beta_t * (weights * inv0[..., None] - f @ integral)
    by_r2 = z * f_t * above - oil.beta_t * (weights * inv1[..., None] - (z * f) @ integral)
    by_c = (z - c[..., None]) * f_t / inv0[..., None]
    by_mean = (by_r1 - mean[..., None] * f_t) / inv0[..., None]
    by_ln_phi = (by_r1 * c[..., None] + r1[..., None] * by_c - by_r2) / phi[..., None]
    by_t = np.stack((by_ln_phi, du * by_mean - u_a * oil.beta_t * weights), axis=2)
    return np.log(12.0 * scale * phi), dln_phi, u_a * r0 + du * mean, dg, by_t


def isothermal_coefficients(
    oil: OilTable, p_max: float, p: Array, t: float, speeds: SurfaceSpeeds, u_e: float, scale: float
) -> tuple[Array, Array, Array, Array]:
    """The same for one temperature t [K] everywhere: phi = scale rho/eta."""
    u = 0.5 * (speeds.u_a + speeds.u_b) / u_e
    factor, d_factor = pressure_factor(oil, p * p_max)
    rho_p, d_rho = pressure_density(oil, p * p_max)
    rho = rho_p - oil.beta_t * (t - oil.t_ref)
    ln_eta, _, slope = ln_viscosity(oil, factor, np.asarray(t))
    return np.log(scale * rho) - ln_eta, p_max * (d_rho / rho - slope * d_factor), u * rho, p_max * u * d_rho


def wall_stress(
    h: Array, p_x: Array, p_y: Array, du: float, viscosity: Array, weights: Array
) -> tuple[Array, Array]:
    """Shear stress at surface a along and across [Pa]: int tau/eta dz = (du, 0) with tau = tau_a + z grad p.

    h [m], pressure gradients [Pa/m] (n_y, n_x), speed du of b relative to a [m/s]; viscosity (n_y, n_x, n_z+1), weights
    of the integral across (n_z+1,).
    """
    f = weights / viscosity
    inv0, inv1 = f.sum(axis=-1), f @ np.linspace(0.0, 1.0, weights.size)
    return (du / h - h * p_x * inv1) / inv0, -h * p_y * inv1 / inv0


def film_flow(
    oil: OilTable, x: Array, p: Array, h: Array, t: Array, speeds: SurfaceSpeeds, flow: FilmFlow
) -> None:
    """Velocities, stresses and heat sources of pressure p [Pa], gap h [m], temperature t [K] on nodes x [m].

    Fills flow but its gradients and power, which are those of Linearisation.pressure_flow.
    """
    n = t.shape[2] - 1
    z, integral = np.linspace(0.0, 1.0, n + 1), cumulative_matrix(n)
    weights = integral[n]
    p_x, p_y, gap = flow.gradient_x, flow.gradient_y, h[..., None]
    factor, d_factor = pressure_factor(oil, p[..., None])
    rho_p, _ = pressure_density(oil, p[..., None])
    ln_eta, slope, by_factor = ln_viscosity(oil, factor, t)
    eta = np.exp(np.minimum(ln_eta, LARGEST_LN_ETA))
    rho = oil.density * (rho_p - oil.beta_t * (t - oil.t_ref))
    flow.stiff[:], flow.soft[:] = by_factor * d_factor, np.maximum(-slope, 0.0)
    tau_x, tau_y = wall_stress(h, p_x, p_y, speeds.u_b - speeds.u_a, eta, weights)
    inv0, inv1 = (weights / eta).sum(axis=2), (weights / eta) @ z
    pivot = inv1 / inv0
    flow.fluidity[:] = h * inv0
    flow.traction_x[:], flow.traction_y[:] = tau_x + 0.5 * h * p_x, tau_y + 0.5 * h * p_y
    flow.stress_x[:], flow.stress_y[:] = tau_x + pivot * h * p_x, tau_y + pivot * h * p_y
    rise_x, rise_y = (h * p_x)[..., None], (h * p_y)[..., None]
    f_x, f_y = (tau_x[..., None] + z * rise_x) / eta, (tau_y[..., None] + z * rise_y) / eta
    flow.rate[:] = gap * f_x
    u, v = speeds.u_a + gap * (f_x @ integral.T), gap * (f_y @ integral.T)
    flow.m_x[:], flow.m_y[:] = rho * u * gap, rho * v * gap
    # dissipation of the sliding with what the pressure flow adds to its rate, and of the pressure flow
    arm, s_x, s_y = z - pivot[..., None], flow.stress_x[..., None], flow.stress_y[..., None]
    flow.sliding[:] = gap / eta * (s_x * (s_x + 2.0 * arm * rise_x) + s_y * (s_y + 2.0 * arm * rise_y))
    # by the trapezoidal rule: so the cells of the energy equation add up the heat
    lever = (arm * arm / eta) @ trapezoid_weights(n)
    flow.driven[:] = arm * arm / eta * (oil.density / (lever * (rho @ weights)))[..., None]
    flow.shear[:] = flow.sliding + flow.driven * flow.power[..., None]
    # compression along the flow by the differences that carry the temperature: the two move together
    p_up, by_p = p_x.copy(), np.zeros(x.size)
    d_1, d_2 = x[2:] - x[1:-1], x[2:] - x[:-2]
    by_p[2:] = 1.0 / d_1 + 1.0 / d_2
    p_up[:, 2:] = by_p[2:] * p[:, 2:] - d_2 / (d_1 * (d_2 - d_1)) * p[:, 1:-1]
    p_up[:, 2:] += d_1 / (d_2 * (d_2 - d_1)) * p[:, :-2]
    expansion = gap * oil.beta_t * oil.density / rho
    flow.compression[:] = expansion * (u * p_up[..., None] + v * p_y[..., None])
    flow.squeeze[:] = expansion * u * by_p[:, None]
