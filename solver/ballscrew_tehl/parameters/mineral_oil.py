"""A mineral oil from its ISO viscosity grade and viscosity index: one published rule, one small function.

SI and kelvin; the letters of a source inside a function; accuracy of every rule in its docstring.
"""

import math
from functools import lru_cache
from typing import Any

from ..numerics import rising_root
from .units import CELSIUS

#: temperatures of the viscosity index and of the density on a data sheet [K]
T_40C, T_100C, T_15C = 313.15, 373.15, 288.15
#: grades of ISO 3448 that have a viscosity index; the number is mm2/s at 40 C
ISO_GRADES = (7, 10, 15, 22, 32, 46, 68, 100, 150, 220, 320, 460, 680, 1000, 1500, 2200, 3200)
#: how far an oil of a grade may be from its number (ISO 3448)
GRADE_TOLERANCE = 0.10
#: least viscosity at 100 C that has an index (ASTM D2270) [mm2/s]
LEAST_AT_100C = 2.0
#: viscosity-gravity constant of paraffinic oils, 0.80 to 0.84: its middle, and the largest deviation from it
PARAFFINIC_VGC, VGC_TOLERANCE = 0.82, 0.02
#: rms and largest relative error of the pressure-viscosity coefficient by roelands_z
Z_ERROR_RMS, Z_ERROR_MAX = 0.11, 0.24
#: largest index of conventional mineral oils; roelands_z is not fitted for the synthetic oils and improvers above
MINERAL_INDEX = 120.0
#: added to the viscosity [mm2/s] under the double logarithm of ASTM D341
D341_SHIFT = 0.7
#: density of water at 15 C [kg/m3], of relative densities
WATER_DENSITY = 999.1
#: K_1 of lubricating oils [kg/(m3 K)]: 0.34878 per degree F
EXPANSION_K1 = 0.34878 * 1.8

#: upper end of Y [mm2/s at 100 C]; a, b, c of L = a Y^2 + b Y + c; d, e, f of H; from 2 mm2/s on
_D2270 = (
    (3.8, 1.14673, 1.7576, -0.109, 0.84155, 1.5521, -0.077),
    (4.4, 3.38095, -15.4952, 33.196, 0.78571, 1.7929, -0.183),
    (5.0, 2.5000, -7.2143, 13.812, 0.82143, 1.5679, 0.119),
    (6.4, 0.10100, 16.6350, -45.469, 0.04985, 9.1613, -18.557),
    (7.0, 3.35714, -23.5643, 78.466, 0.22619, 7.7369, -16.656),
    (7.7, 0.01191, 21.4750, -72.870, 0.79762, -0.7321, 14.610),
    (9.0, 0.41858, 16.1558, -56.040, 0.05794, 10.5156, -28.240),
    (12.0, 0.88779, 7.5527, -16.600, 0.26665, 6.7015, -10.810),
    (15.0, 0.76720, 10.7972, -38.180, 0.20073, 8.4658, -22.490),
    (18.0, 0.97305, 5.3135, -2.200, 0.28889, 5.9741, -4.930),
    (22.0, 0.97256, 5.2500, -0.980, 0.24504, 7.4160, -16.730),
    (28.0, 0.91413, 7.4759, -21.820, 0.20323, 9.1267, -34.230),
    (40.0, 0.87031, 9.7157, -50.770, 0.18411, 10.1015, -46.750),
    (55.0, 0.84703, 12.6752, -133.310, 0.17029, 11.4866, -80.620),
    (70.0, 0.85921, 11.1009, -83.190, 0.17130, 11.3680, -76.940),
    (math.inf, 0.83531, 14.6731, -216.246, 0.16841, 11.8493, -96.947),
)


def kinematic_viscosity_d341(nu_1: float, T_1: float, nu_2: float, T_2: float, T: Any) -> Any:
    """Kinematic viscosity [m2/s] at T [K] through points nu_1, nu_2 > 0.3 mm2/s at different T_1, T_2.

    Valid for mineral oils above 2 mm2/s, -40 C to 150 C. ASTM D341: log10 log10(nu + 0.7) = m - n log10 T, nu in
    mm2/s.
    """
    y_1 = math.log10(math.log10(1e6 * nu_1 + D341_SHIFT))
    return 1e-6 * (10.0 ** (10.0**y_1 * (T / T_1) ** -slope_d341(nu_1, T_1, nu_2, T_2)) - D341_SHIFT)


def slope_d341(nu_1: float, T_1: float, nu_2: float, T_2: float) -> float:
    """n of ASTM D341 through two points, 3 to 4.5 for mineral oils; arguments as kinematic_viscosity_d341."""
    y_1, y_2 = (math.log10(math.log10(1e6 * nu + D341_SHIFT)) for nu in (nu_1, nu_2))
    return (y_1 - y_2) / math.log10(T_2 / T_1)


def _reference_oils(Y: float) -> tuple[float, float]:
    """L and H [mm2/s]: viscosity at 40 C of the oils of index 0 and 100 with Y at 100 C."""
    _, a, b, c, d, e, f = next(row for row in _D2270 if row[0] >= Y)
    return (a * Y + b) * Y + c, (d * Y + e) * Y + f


def viscosity_index(nu_40: float, nu_100: float) -> float:
    """Viscosity index, not rounded, from the kinematic viscosities [m2/s] at 40 C and 100 C.

    L and H by the equations of the standard's appendix: within 0.31 of the index by its table, from 0 to 200. ASTM
    D2270 (ISO 2909), procedures A (up to 100) and B, coefficients of its Table X2.1.
    """
    U, Y = 1e6 * nu_40, 1e6 * nu_100
    if not (math.isfinite(U) and U > Y >= LEAST_AT_100C):
        raise ValueError(
            f"nu_40, nu_100 = {U:g}, {Y:g} mm2/s; needs nu_40 > nu_100 >= {LEAST_AT_100C:g} mm2/s: no index is "
            "defined for others"
        )
    L, H = _reference_oils(Y)
    if U >= H:
        return 100.0 * (L - U) / (L - H)
    return (10.0 ** (math.log10(H / U) / math.log10(Y)) - 1.0) / 0.00715 + 100.0


@lru_cache(maxsize=256)
def viscosity_at_100c(nu_40: float, index: float) -> float:
    """Kinematic viscosity at 100 C [m2/s] of a viscosity index: viscosity_index solved for nu_100, within 0.04 %."""
    lowest, highest = 1e-6 * LEAST_AT_100C, nu_40 * (1.0 - 1e-9)
    allowed = [viscosity_index(nu_40, nu) for nu in (lowest, highest)] if lowest < highest else [math.nan] * 2
    if not allowed[0] <= index <= allowed[1]:
        raise ValueError(
            f"viscosity_index = {index:g}; allowed: {allowed[0]:.4g} to {allowed[1]:.4g} for {1e6 * nu_40:g} mm2/s "
            f"at 40 C: at 100 C an oil needs {LEAST_AT_100C:g} mm2/s or more to have an index"
        )
    return rising_root(lambda nu: viscosity_index(nu_40, nu) - index, lowest, highest)[0]


def density_15c(nu_40: float, vgc: float = PARAFFINIC_VGC) -> float:
    """Density at 15 C [kg/m3] by viscosity at 40 C [m2/s] and viscosity-gravity constant.

    vgc: 0.80 to 0.84 paraffinic, 0.86 to 0.90 naphthenic; 0.02 in it are 2.2 % (ISO VG 7) to 1.2 % (3200). ASTM D2501,
    Eq. 1: vgc = (G - 0.0664 - 0.1154 lg(nu - 5.5))/(0.94 - 0.109 lg(nu - 5.5)), solved for G.
    """
    if not 1e6 * nu_40 > 5.5:
        raise ValueError(f"nu_40 = {1e6 * nu_40:g} mm2/s; needs > 5.5 mm2/s: give the density at 15 C")
    lg = math.log10(1e6 * nu_40 - 5.5)
    return 1e3 * (vgc * (0.94 - 0.109 * lg) + 0.0664 + 0.1154 * lg)


def density_at(rho_15: float, T: Any) -> Any:
    """Density of a lubricating oil [kg/m3] at T [K] by that at 15 C, 800 to 1160 kg/m3.

    ASTM D1250 (API MPMS 11.1), lubricating oils: rho_15 exp(-x (1 + 0.8 x)), x = K_1 (T - 15 C)/rho_15; changed: the
    base is 15 C instead of 60 F, 0.4 K apart.
    """
    x = EXPANSION_K1 * (T - T_15C) / rho_15
    return rho_15 * math.e ** (-x * (1.0 + 0.8 * x))


def density_slope(rho_15: float, T: float) -> float:
    """Relative fall of density per kelvin at T [1/K]: the derivative of density_at."""
    x = EXPANSION_K1 * (T - T_15C) / rho_15
    return EXPANSION_K1 / rho_15 * (1.0 + 1.6 * x)


def specific_heat(rho_15: float, T: float) -> float:
    """Specific heat capacity of a petroleum oil [J/(kg K)], rho_15 in kg/m3, T in K; good to some 5 %.

    Cragoe, Thermal properties of petroleum products, NBS Misc. Publ. 97 (1929): c = (0.4024 + 0.00081 t) / sqrt(s)
    cal/(g K), t in C, s relative density.
    """
    return 4186.8 * (0.4024 + 0.00081 * (T - CELSIUS)) / math.sqrt(rho_15 / WATER_DENSITY)


def thermal_conductivity(rho_15: float, T: float) -> float:
    """Thermal conductivity of a petroleum oil [W/(m K)], rho_15 in kg/m3, T in K; good to some 10 %.

    Cragoe, NBS Misc. Publ. 97 (1929): k = 0.1172 (1 - 0.00054 t)/s, t in C, s relative density.
    """
    return 0.1172 * (1.0 - 0.00054 * (T - CELSIUS)) / (rho_15 / WATER_DENSITY)


def roelands_z(eta_40: float, eta_100: float) -> float:
    """Pressure exponent Z of Roelands from the dynamic viscosities [Pa s] of a mineral oil at 40 C and 100 C.

    alpha = Z (ln eta + 9.67)/p_r then follows measured coefficients of 13 oils without viscosity index improver at 30,
    60 and 100 C with 11 % rms, 24 % at most, -1 % mean (tests/published/test_mineral_oils.py). Roelands, dissertation,
    Delft 1966, in the form of Fein, Tribology Data Handbook (CRC 1997): Z = (7.81 (H_40 - H_100))^1.5 (0.885 - 0.864
    H_40), H = lg(1.200 + lg eta), eta in mPa s.
    """
    if not 1e-3 < eta_100 < eta_40:
        raise ValueError(
            f"eta_40, eta_100 = {eta_40:g}, {eta_100:g} Pa s; needs eta_40 > eta_100 > 1e-3 Pa s"
        )
    H_40, H_100 = (math.log10(1.2 + math.log10(1e3 * eta)) for eta in (eta_40, eta_100))
    return float((7.81 * (H_40 - H_100)) ** 1.5 * (0.885 - 0.864 * H_40))


def so_klaus(nu: float, rho: float, slope: float) -> float:
    """Pressure-viscosity coefficient [1/Pa], for comparison: 10 % above measured ones, 17 % rms.

    nu [m2/s] and rho [kg/m3] at the temperature; slope: n of ASTM D341, its chart's slope over 0.2. So & Klaus, ASLE
    Trans. 23 (1980) 409: 1e8 alpha = 1.216 + 4.143 x^3.0627 + 2.848e-4 n^5.1903 x^1.5976 - 3.999 x^3.0975 rho^0.1162,
    x = lg nu, mm2/s and g/cm3.
    """
    x = math.log10(1e6 * nu)
    poly = 1.216 + 4.143 * x**3.0627 + 2.848e-4 * slope**5.1903 * x**1.5976
    return 1e-8 * (poly - 3.999 * x**3.0975 * (1e-3 * rho) ** 0.1162)


def agma_925(eta: float) -> float:
    """Pressure-viscosity coefficient [1/Pa] by eta [Pa s], for comparison: 24 % below measured ones, 25 % rms.

    AGMA 925-A03, mineral oil: alpha = 0.010471 eta^0.1348 mm2/N, eta in mPa s.
    """
    return 0.010471e-6 * float(1e3 * eta) ** 0.1348
