"""The oil in the compiled loops: ambient viscosity from a table, pressure laws, density, shear thinning."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiled import kernel
from ...parameters.file import LubricantParameters
from ...parameters.oil import ROELANDS_LN
from ...parameters.units import COLDEST
from ...physics import lubricant as lubricant_laws
from ..half_space.grid import Array

#: table of ln eta0: below the inlet temperature, range, step [K]; linear interpolation is then accurate to 1e-5
TABLE_BELOW, TABLE_SPAN, TABLE_STEP = 40.0, 640.0, 0.25
#: codes of the rheologies in the kernels
NEWTONIAN, EYRING, CARREAU, LIMITING = range(4)
#: least distance of a stress to the limiting stress, relative; further sliding is slip at constant stress
NEAREST_TO_LIMIT = 1e-9


class OilTable(NamedTuple):
    """Numbers of one oil at one inlet temperature.

    table_start [K], ln_eta0 (n,) of Pa s, roelands (0 Barus, 1 Roelands), z, p_r [Pa], alpha [1/Pa],
    rise, fade: A, B of the density law [1/Pa], beta_t: thermal expansion [1/K], t_ref [K], density [kg/m3];
    rheology: code, stress: Eyring stress, Carreau modulus or lower bound of the limiting stress [Pa],
    share: Carreau exponent n or Lambda of the limiting stress.
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
    rheology: int
    stress: float
    share: float


def oil_table(oil: LubricantParameters, temperature: float) -> OilTable:
    """Tabulate the oil's ambient viscosity from 40 K below to 600 K above the inlet temperature [K]."""
    start = max(temperature - TABLE_BELOW, COLDEST)
    t = start + TABLE_STEP * np.arange(int(TABLE_SPAN / TABLE_STEP) + 1)
    # bounded where the Roelands pressure term changes its sign, 6.3e-5 Pa s: below the viscosity of any oil film
    ln_eta0 = np.maximum(np.log(lubricant_laws.eta0(oil, t)), -ROELANDS_LN)
    rise, fade = lubricant_laws.DENSITY_LAWS[oil.density_law]
    rheology = {
        "newtonian": (NEWTONIAN, 1.0, 1.0),
        "eyring": (EYRING, oil.eyring_stress, 1.0),
        "carreau": (CARREAU, oil.carreau_modulus, oil.carreau_exponent),
        "limiting_shear_stress": (LIMITING, oil.limiting_stress_ambient, oil.limiting_stress_slope),
    }[oil.rheology]
    return OilTable(
        start, ln_eta0, int(oil.pressure_law == "roelands"), oil.z_roelands, oil.roelands_pressure,
        oil.pressure_viscosity, rise, fade, oil.density_temperature,
        oil.reference_temperature, oil.density, *rheology,
    )  # fmt: skip


@kernel
def pressure_factor(oil, p):
    """Pressure part of the viscosity law and its derivative [1/Pa]: (1+p/p_r)^Z - 1 (Roelands), alpha p (Barus)."""
    if oil.roelands == 1:
        power = (1.0 + p / oil.p_r) ** oil.z
        return power - 1.0, oil.z * power / (oil.p_r + p)
    return oil.alpha * p, oil.alpha


@kernel
def ln_viscosity(oil, factor, t):
    """ln eta(p, T), d ln eta/dT [1/K] and d ln eta/d factor, from the pressure factor and the temperature [K]."""
    s = (t - oil.table_start) / TABLE_STEP
    last = oil.ln_eta0.size - 2
    k = 0 if not s > 0.0 else (last if s > last else int(s))
    slope = (oil.ln_eta0[k + 1] - oil.ln_eta0[k]) / TABLE_STEP
    w = min(max(s - k, 0.0), 1.0)
    base = oil.ln_eta0[k] + w * TABLE_STEP * slope
    if not 0.0 < s < last + 1:
        # constant beyond the table
        slope = 0.0
    if oil.roelands == 1:
        return base + (base + ROELANDS_LN) * factor, slope * (1.0 + factor), base + ROELANDS_LN
    return base + factor, slope, 1.0


@kernel
def pressure_density(oil, p):
    """Density over pressure at the reference temperature relative to ambient, and its derivative [1/Pa].

    Dowson & Higginson 1966; thermal expansion beta_t (T - t_ref) comes off (sign of the print corrected).
    """
    d = 1.0 + oil.fade * p
    return 1.0 + oil.rise * p / d, oil.rise / (d * d)


@kernel
def shear_thinning(oil, p, eta, tau):
    """Thinning S = eta * rate/tau >= 1 at shear stress tau >= 0 [Pa], and dS/d(ln tau).

    eyring: sinh(t)/t, t = tau/tau_0.  limiting_shear_stress: -ln(1-t)/t, t = tau/max(tau_00, Lambda p) (Bair & Winer
    1979).  carreau: rate = (G/eta) x, x (1 + x^2)^((n-1)/2) = tau/G, solved for x.
    """
    if oil.rheology == EYRING:
        t = tau / oil.stress
        if t < 1e-2:
            return 1.0 + t * t / 6.0, t * t / 3.0
        t = min(t, 300.0)
        s = np.sinh(t) / t
        return s, np.cosh(t) - s
    if oil.rheology == LIMITING:
        t = tau / max(oil.stress, oil.share * p)
        if t < 1e-3:
            return 1.0 + t / 2.0 + t * t / 3.0, t / 2.0 + 2.0 * t * t / 3.0
        last = 1.0 - NEAREST_TO_LIMIT
        if t > last:
            # beyond, the rate is continued along its tangent
            rate, slope = (t - last) / NEAREST_TO_LIMIT - np.log(NEAREST_TO_LIMIT), 1.0 / NEAREST_TO_LIMIT
            return rate / t, slope - rate / t
        s = -np.log1p(-t) / t
        return s, 1.0 / (1.0 - t) - s
    if oil.rheology == CARREAU:
        y = tau / oil.stress
        if y < 1e-9:
            return 1.0, 0.0
        m = 0.5 * (oil.share - 1.0)
        ln_y = np.log(y)
        # ln x + m ln(1 + x^2) = ln y is increasing and convex or concave in ln x: Newton from the steep asymptote
        ln_x = max(ln_y, ln_y / oil.share)
        slope = 1.0
        for _ in range(40):
            x2 = np.exp(2.0 * ln_x)
            slope = 1.0 + 2.0 * m * x2 / (1.0 + x2)
            step = (ln_x + m * np.log1p(x2) - ln_y) / slope
            ln_x -= step
            if abs(step) < 1e-12:
                break
        s = np.exp(ln_x - ln_y)
        return s, s * (1.0 / slope - 1.0)
    return 1.0, 0.0


@kernel
def thinned_stress(oil, p, tau):
    """Stress at the shear rate at which the oil without shear thinning would have the stress tau >= 0 [Pa]."""
    if oil.rheology == EYRING:
        return oil.stress * np.arcsinh(tau / oil.stress)
    if oil.rheology == LIMITING:
        limit = max(oil.stress, oil.share * p)
        return -limit * np.expm1(-tau / limit)
    if oil.rheology == CARREAU:
        x = tau / oil.stress
        return tau * (1.0 + x * x) ** (0.5 * (oil.share - 1.0))
    return tau
