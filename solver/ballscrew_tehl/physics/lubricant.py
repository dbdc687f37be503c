"""Viscosity and density of the oil over pressure and temperature: one published law, one small function."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..parameters.file import LubricantParameters
from ..parameters.mineral_oil import D341_SHIFT, kinematic_viscosity_d341, slope_d341
from ..parameters.oil import ROELANDS_LN
from ..parameters.units import CELSIUS, COLDEST, HOTTEST

#: Roelands' temperature constant [K]
T_ROELANDS = 138.0
#: of the viscosity printed in section 2.3 of the paper, exp(B/(T - T_VOGEL)) [K]
B_VOGEL, T_VOGEL = 1045.31, 183.19


def _checked_temperature(T: Any) -> Any:
    if not np.all((np.asarray(T) >= COLDEST) & np.isfinite(T)):
        meant = float(np.min(T)) + CELSIUS
        remedy = f"is {meant:g} K meant?" if COLDEST <= meant <= HOTTEST else "is it in kelvin?"
        raise ValueError(f"temperature = {T} K; needs finite, >= {COLDEST:g} K: {remedy}")
    return T


def section_2_3(T: Any) -> Any:
    """Ambient viscosity printed in the text of the paper, 0.297 Pa s at 303 K: nine times the value of its table.

    Parameters
    ----------
    T : float or array
        Temperature [K], above 183.19 K.

    Returns
    -------
    float or array
        Viscosity at ambient pressure [Pa s].

    Notes
    -----
    Zhao et al., Int J Adv Manuf Technol 124 (2023) 4231, section 2.3.

    Examples
    --------
    >>> f"{section_2_3(303.0):.3f} Pa s"
    '0.297 Pa s'
    """
    return 4.83e-5 * np.exp(B_VOGEL / (T - T_VOGEL))


def _eta0_section_2_3(lub: LubricantParameters, T: Any) -> Any:
    # differs from paper: scaled to the viscosity of Table 1 at the reference temperature
    return lub.viscosity * section_2_3(T) / section_2_3(lub.reference_temperature)


def _roelands_s0(lub: LubricantParameters) -> tuple[float, float, float]:
    """Temperature exponent S0 = beta (T0 - 138)/(ln eta0 + 9.67), with T0 - 138 and ln eta0 + 9.67."""
    assert lub.temperature_viscosity is not None  # held by the parameter check
    span, scale = lub.reference_temperature - T_ROELANDS, math.log(lub.viscosity) + ROELANDS_LN
    return lub.temperature_viscosity * span / scale, span, scale


def _eta0_roelands_printed(lub: LubricantParameters, T: Any) -> Any:
    # Eq. 7 at p = 0; with the pressure term of `viscosity` the product of both factors, as printed
    s0_roelands, span, scale = _roelands_s0(lub)
    return np.exp(scale * ((T - T_ROELANDS) / span) ** -s0_roelands - ROELANDS_LN)


def _slope_roelands_printed(lub: LubricantParameters, T: Any) -> Any:
    s0_roelands, span, scale = _roelands_s0(lub)
    return -scale * s0_roelands / span * ((T - T_ROELANDS) / span) ** (-s0_roelands - 1.0)


def _d341_points(lub: LubricantParameters) -> tuple[Any, Any, Any, Any]:
    return lub.astm_viscosity_1, lub.astm_temperature_1, lub.astm_viscosity_2, lub.astm_temperature_2


def _eta0_astm_d341(lub: LubricantParameters, T: Any) -> Any:
    return kinematic_viscosity_d341(*_d341_points(lub), T) * ambient_density(lub, T)


def _slope_astm_d341(lub: LubricantParameters, T: Any) -> Any:
    # nu = Z - 0.7, Z = 10^(10^(m - n log10 T)): d nu/dT = -n Z ln Z/T
    points = _d341_points(lub)
    n, nu = slope_d341(*points), 1e6 * kinematic_viscosity_d341(*points, T)
    rate = -n * (nu + D341_SHIFT) * np.log(nu + D341_SHIFT) / (T * nu)
    return rate - lub.density_temperature * lub.density / ambient_density(lub, T)


ViscosityLaw = Callable[[LubricantParameters, Any], Any]
#: name -> (ambient viscosity, its logarithmic slope)
VISCOSITY_LAWS: dict[str, tuple[ViscosityLaw, ViscosityLaw]] = {
    "section_2_3": (_eta0_section_2_3, lambda lub, T: -B_VOGEL / (T - T_VOGEL) ** 2),
    "roelands_printed": (_eta0_roelands_printed, _slope_roelands_printed),
    "astm_d341": (_eta0_astm_d341, _slope_astm_d341),
    "constant": (lambda lub, T: lub.viscosity + 0.0 * T, lambda lub, T: 0.0 * T),
}


def eta0(lub: LubricantParameters, T: Any) -> Any:
    """Viscosity at ambient pressure by the viscosity law of the oil.

    Parameters
    ----------
    lub : LubricantParameters
        Oil, with the name of the law.
    T : float or array
        Temperature [K], >= 200.

    Returns
    -------
    float or array
        Viscosity [Pa s].

    Raises
    ------
    ValueError
        Temperature not finite or out of range.

    Notes
    -----
    section_2_3: Zhao et al. 2023, section 2.3, differs from paper: scaled to Table 1; roelands_printed: Eq. 7 with
    S0 = beta (T0-138)/(ln eta0+9.67); astm_d341: ASTM D341 times density; constant: none.

    Examples
    --------
    >>> from ballscrew_tehl.parameters.file import graded_oil
    >>> f"{eta0(graded_oil(68, 95.0), 313.15):.4f} Pa s"
    '0.0590 Pa s'
    """
    return VISCOSITY_LAWS[lub.viscosity_law][0](lub, _checked_temperature(T))


def temperature_slope(lub: LubricantParameters, T: Any) -> Any:
    """d ln(eta0)/dT [1/K], the negative of the coefficient beta of the literature; T: float or array [K], >= 200."""
    return VISCOSITY_LAWS[lub.viscosity_law][1](lub, _checked_temperature(T))


def viscosity(lub: LubricantParameters, p: Any, T: Any) -> Any:
    """Viscosity at pressure and temperature by the laws of the oil.

    Parameters
    ----------
    lub : LubricantParameters
        Oil, with the names of the laws.
    p : float or array
        Pressure [Pa], >= 0.
    T : float or array
        Temperature [K], >= 200, broadcast with p.

    Returns
    -------
    float or array
        Viscosity [Pa s].

    Raises
    ------
    ValueError
        Temperature not finite or out of range.

    Notes
    -----
    barus: eta_0(T) exp(alpha p), Barus 1893.

    roelands: eta_0(T) exp{(ln eta_0(T) + 9.67) [(1 + p/p_r)^Z - 1]}, Z constant, Roelands 1966. With the law
    roelands_printed this is Eq. 7 of Zhao et al. 2023; with another it differs from paper: the S0 term of Eq. 7 is
    replaced by eta_0(T). Below 6.3e-5 Pa s (hotter than any oil lasts) pressure is taken to have no effect.

    Examples
    --------
    >>> from ballscrew_tehl.parameters.file import graded_oil
    >>> f"{viscosity(graded_oil(68, 95.0), 0.5e9, 313.15):.0f} Pa s"
    '587 Pa s'
    """
    ambient = eta0(lub, T)
    if lub.pressure_law == "barus":
        return ambient * np.exp(lub.pressure_viscosity * p)
    level = np.maximum(np.log(ambient) + ROELANDS_LN, 0.0)
    return ambient * np.exp(level * np.expm1(lub.z_roelands * np.log1p(p / lub.roelands_pressure)))


def pressure_viscosity(lub: LubricantParameters, T: Any) -> Any:
    """Pressure-viscosity coefficient d ln(eta)/dp at ambient pressure by the pressure law of the oil.

    Parameters
    ----------
    lub : LubricantParameters
        Oil, with the names of the laws.
    T : float or array
        Temperature [K], >= 200.

    Returns
    -------
    float or array
        Coefficient alpha_pv [1/Pa].

    Raises
    ------
    ValueError
        Temperature not finite or out of range.

    Examples
    --------
    >>> from ballscrew_tehl.parameters.file import graded_oil
    >>> f"{1e9 * pressure_viscosity(graded_oil(68, 95.0), 313.15):.1f} 1/GPa"
    '23.5 1/GPa'
    """
    ambient = eta0(lub, T)
    if lub.pressure_law == "barus":
        return lub.pressure_viscosity + 0.0 * ambient
    return np.maximum(np.log(ambient) + ROELANDS_LN, 0.0) * lub.z_roelands / lub.roelands_pressure


#: (A, B) of rho(p)/rho(0) = 1 + A p/(1 + B p) [1/Pa], Dowson & Higginson 1966, by the name of the density law
DENSITY_LAWS: dict[str, tuple[float, float]] = {
    "dowson_higginson": (0.6e-9, 1.7e-9),  # the one of the paper
    # the same law as many film computations write it, (5.9e8 + 1.34 p)/(5.9e8 + p): 0.7 % less at 1 GPa
    "dowson_higginson_590": (0.34 / 5.9e8, 1.0 / 5.9e8),
    "incompressible": (0.0, 0.0),
}


def relative_density(law: str, p: Any) -> Any:
    """Density at pressures [Pa], >= 0, relative to ambient, 1 to 1.35, by the law of a name in DENSITY_LAWS."""
    rise, fade = DENSITY_LAWS[law]
    return 1.0 + rise * p / (1.0 + fade * p)


def ambient_density(lub: LubricantParameters, T: Any) -> Any:
    """Density at ambient pressure [kg/m3].

    Eq. 8 of Zhao et al. 2023 at p = 0; errata: the printed sign makes density rise with temperature.
    """
    return lub.density * (1.0 - lub.density_temperature * (T - lub.reference_temperature))
