"""The oil in the film: ambient viscosity from a table, pressure laws, density."""

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
