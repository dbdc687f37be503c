"""A contact given by its Moes numbers, for comparison with published film tables."""

import math
from typing import Any, NamedTuple

from ..parameters.file import LubricantParameters, SolidParameters
from ..parameters.oil import ROELANDS_LN
from .conditions import ContactConditions, SolverOptions
from .result import ContactResult
from .solver import solve

#: oil, steel and scale of the reference tables: alpha [1/Pa], eta0 [Pa s], p_r [Pa], E' [Pa]; R_x [m] has no effect
ALPHA, ETA0, P_ROELANDS, E_REFERENCE, R_X = 2.2e-8, 0.04, 1.96e8, 226e9, 0.01
TEMPERATURE = 313.15
STEEL = SolidParameters(density=7870.0, specific_heat=450.0, thermal_conductivity=46.0)
ISOTHERMAL = SolverOptions(thermal=False)
LAWS: dict[str, dict[str, Any]] = {
    "barus": {"pressure_law": "barus", "density_law": "incompressible"},
    "roelands": {"pressure_law": "roelands", "density_law": "dowson_higginson_590"},
}


class MoesFilm(NamedTuple):
    """Central and minimum film in Moes units H = (h/R_x)(2U)^(-1/2), and the result they come from."""

    Hc: float
    Hm: float
    result: ContactResult


def reference_oil(law: str) -> LubricantParameters:
    """Isothermal oil of the reference tables of films.

    Parameters
    ----------
    law : str
        "barus", incompressible, or "roelands", compressible.

    Returns
    -------
    LubricantParameters
        Oil with alpha = 22 1/GPa, eta0 = 0.04 Pa s.

    Raises
    ------
    ValueError
        Unknown law.

    Examples
    --------
    >>> reference_oil("barus").viscosity
    0.04
    """
    if law not in LAWS:
        raise ValueError(f"law = {law!r}; allowed: {', '.join(LAWS)}")
    return LubricantParameters(
        name=f"reference {law}", density=870.0, viscosity=ETA0, reference_temperature=TEMPERATURE, specific_heat=2000.0,
        thermal_conductivity=0.14, pressure_viscosity=ALPHA, density_temperature=0.0,
        z_roelands=ALPHA * P_ROELANDS / (math.log(ETA0) + ROELANDS_LN), roelands_pressure=P_ROELANDS,
        viscosity_law="constant", **LAWS[law],
    )  # fmt: skip


def moes_conditions(M: float, L: float, radius_ratio: float) -> ContactConditions:
    """Conditions of pure rolling at Moes numbers, for an oil of reference_oil.

    M load, L lubricant number, > 0; radius_ratio R_x/R_y, 0 < ratio <= 1. ValueError: numbers out of range.
    Definitions of Moes as in Nijenbanning, Venner & Moes, Wear 176 (1994) 217: 2U = (L/(alpha E'))^4, W = M
    (2U)^(3/4).
    """
    for name, value in (("M", M), ("L", L), ("radius_ratio", radius_ratio)):
        if not (value > 0.0 and math.isfinite(value)):
            raise ValueError(f"{name} = {value}; needs finite, > 0")
    if not radius_ratio <= 1.0:
        raise ValueError(f"radius_ratio = {radius_ratio}; needs R_x/R_y <= 1: x is the rolling direction")
    two_u = (L / (ALPHA * E_REFERENCE)) ** 4
    load = M * two_u**0.75 * E_REFERENCE * R_X**2
    u_e = 0.5 * two_u * E_REFERENCE * R_X / ETA0
    return ContactConditions(load, R_X, R_X / radius_ratio, u_e, u_e, TEMPERATURE, E_REFERENCE)


def solve_moes(
    M: float, L: float, radius_ratio: float, law: str, options: SolverOptions = ISOTHERMAL
) -> MoesFilm:
    """Isothermal film at Moes numbers.

    M, L, radius_ratio: see moes_conditions; law "barus" or "roelands". ValueError: unknown law, numbers out of range.
    """
    conditions = moes_conditions(M, L, radius_ratio)
    result = solve(conditions, reference_oil(law), STEEL, options)
    unit = R_X * math.sqrt((L / (ALPHA * E_REFERENCE)) ** 4)
    return MoesFilm(result.h_c / unit, result.h_m / unit, result)
