"""Cross-film integrals of the generalised Reynolds equation and the velocity field that follows from them.

The film is cut into n_z layers of equal thickness between surface a (z = 0) and b (z = h); integrals by the
trapezoidal rule on n_z + 1 nodes, cumulative where the equations are nested.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from .. import lubricant as lubricant_laws
from ..parameters import LubricantParameters
from .grid import Array

TABLE_SPAN = 640.0  # K
ROELANDS_LN = lubricant_laws.ROELANDS_LN  # ln of 1/(6.3e-5 Pa s)
TABLE_STEP = 0.25  # K; linear interpolation of ln eta0 is then good to 1e-5


class OilTable(NamedTuple):
    """What the kernels know of the oil: ln eta0(T) on a uniform table and the pressure laws.

    table_start [K], ln_eta0 (n,) of Pa s, roelands (0 Barus, 1 Roelands), z, p_r [Pa], alpha [1/Pa],
    rise, fade: A, B of the density law [1/Pa], beta_t: thermal expansion [1/K], T_ref [K], density [kg/m3].
    """

    table_start: float
    ln_eta0: Array
    roelands: int
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
    start = max(temperature - 40.0, lubricant_laws.T_MIN)
    t = start + TABLE_STEP * np.arange(int(TABLE_SPAN / TABLE_STEP) + 1)
    # bounded where the Roelands pressure term would change its sign, 6.3e-5 Pa s: thinner than any oil film gets
    ln_eta0 = np.maximum(np.log(lubricant_laws.eta0(oil, t)), -lubricant_laws.ROELANDS_LN)
    rise, fade = lubricant_laws.DENSITY_LAWS[oil.density_law]
    return OilTable(
        start, ln_eta0, int(oil.pressure_law == "roelands"), oil.z_roelands, oil.roelands_pressure,
        oil.pressure_viscosity, rise, fade, oil.density_temperature,
        oil.reference_temperature, oil.density,
    )  # fmt: skip


@njit(cache=True)
def pressure_factor(oil, p):
    """Pressure part of the viscosity law: (1+p/p_r)^Z - 1 (Roelands) or alpha p (Barus)."""
    if oil.roelands == 1:
        return (1.0 + p / oil.p_r) ** oil.z - 1.0
    return oil.alpha * p


@njit(cache=True)
def ln_viscosity(oil, factor, t):
    """ln eta(p, T) and d ln eta/dT from the pressure factor and the temperature [K]."""
    s = (t - oil.table_start) / TABLE_STEP
    k = int(s)
    if k < 0:
        k = 0
    if k > oil.ln_eta0.size - 2:
        k = oil.ln_eta0.size - 2
    slope = (oil.ln_eta0[k + 1] - oil.ln_eta0[k]) / TABLE_STEP
    w = min(max(s - k, 0.0), 1.0)
    base = oil.ln_eta0[k] + w * TABLE_STEP * slope
    if oil.roelands == 1:
        return base + (base + ROELANDS_LN) * factor, slope * (1.0 + factor)
    return base + factor, slope


@njit(cache=True)
def density_ratio(oil, p, t):
    """rho(p, T)/rho0 (Dowson & Higginson 1966 with thermal expansion; falls with T, sign of the print corrected)."""
    return 1.0 + oil.rise * p / (1.0 + oil.fade * p) - oil.beta_t * (t - oil.t_ref)


@njit(cache=True)
def column_integrals(oil, p, t, u_a, u_b):
    """Generalised Reynolds integrals of one column with h = 1: (e0, e1, r0, r1, r2), density relative to rho0.

    p [Pa], t (n_z+1,) [K]. Source: model notes, section 5 (Yang & Wen 1990 form); e = eta here.
    """
    n = t.size - 1
    dz = 1.0 / n
    factor = pressure_factor(oil, p)
    inv0 = inv1 = r0 = r1 = r2 = 0.0
    f_old = f1_old = c0 = c1 = rho_old = 0.0
    for k in range(n + 1):
        f = np.exp(-ln_viscosity(oil, factor, t[k])[0])
        f1 = k * dz * f
        rho = density_ratio(oil, p, t[k])
        if k > 0:
            d0 = 0.5 * dz * (f_old + f)
            d1 = 0.5 * dz * (f1_old + f1)
            inv0 += d0
            inv1 += d1
            r0 += 0.5 * dz * (rho_old + rho)
            r1 += 0.5 * dz * (rho_old * c0 + rho * (c0 + d0))
            r2 += 0.5 * dz * (rho_old * c1 + rho * (c1 + d1))
            c0 += d0
            c1 += d1
        f_old, f1_old, rho_old = f, f1, rho
    return 1.0 / inv0, 1.0 / inv1, r0, r1, r2


@njit(cache=True)
def film_coefficients(oil, p_max, p, t, u_a, u_b, u_e, scale, ln_phi, dln_phi, g, dg):
    """Nodal coefficients of the generalised Reynolds equation and their derivatives to P = p/p_max.

    phi = scale * 12 (r1 e0/e1 - r2) [isothermal: scale * rho/eta]; g = [u_a r0 + (u_b-u_a) e0 r1]/u_e.
    p (n_y, n_x) dimensionless, t (n_y, n_x, n_z+1) [K].
    """
    ny, nx = p.shape
    eps = 1e-5
    for j in range(ny):
        for i in range(nx):
            for step in range(2):
                q = (p[j, i] + step * eps) * p_max
                e0, e1, r0, r1, r2 = column_integrals(oil, q, t[j, i], u_a, u_b)
                a = np.log(12.0 * scale * (r1 * e0 / e1 - r2))
                b = (u_a * r0 + (u_b - u_a) * e0 * r1) / u_e
                if step == 0:
                    ln_phi[j, i] = a
                    g[j, i] = b
                else:
                    dln_phi[j, i] = (a - ln_phi[j, i]) / eps
                    dg[j, i] = (b - g[j, i]) / eps


@njit(cache=True)
def isothermal_coefficients(oil, p_max, p, t, scale, ln_phi, dln_phi, g, dg):
    """The same for one temperature t [K] everywhere: phi = scale rho/eta, g = rho."""
    ny, nx = p.shape
    eps = 1e-5
    for j in range(ny):
        for i in range(nx):
            for step in range(2):
                q = (p[j, i] + step * eps) * p_max
                rho = density_ratio(oil, q, t)
                a = np.log(scale * rho) - ln_viscosity(oil, pressure_factor(oil, q), t)[0]
                if step == 0:
                    ln_phi[j, i] = a
                    g[j, i] = rho
                else:
                    dln_phi[j, i] = (a - ln_phi[j, i]) / eps
                    dg[j, i] = (rho - g[j, i]) / eps
