"""Units of files and answers; inside the package all quantities are SI, radians and kelvin."""

import math
import re
from typing import Any, NamedTuple

RPM = math.pi / 30.0  # [rad/s] of one revolution per minute
CELSIUS = 273.15  # [K] at 0 degrees Celsius
#: lowest and highest temperature [K] of an oil; one law of its viscosity is singular at 183.19 K
COLDEST, HOTTEST = 200.0, 500.0 + CELSIUS

#: dimension -> unit suffix -> (factor, divisor, offset): SI = value * factor / divisor + offset, so that
#: 13 mm is exactly 0.013 m. The first unit is that of data sheets.
UNITS: dict[str, dict[str, tuple[float, float, float]]] = {
    "length": {"mm": (1, 1e3, 0), "m": (1, 1, 0), "um": (1, 1e6, 0)},
    "area": {"mm2": (1, 1e6, 0), "m2": (1, 1, 0)},
    "angle": {"deg": (math.pi, 180, 0), "rad": (1, 1, 0)},
    "force": {"N": (1, 1, 0), "kN": (1e3, 1, 0)},
    "torque": {"Nm": (1, 1, 0), "mNm": (1, 1e3, 0)},
    "pressure": {"MPa": (1e6, 1, 0), "GPa": (1e9, 1, 0), "Pa": (1, 1, 0)},
    "temperature": {"degC": (1, 1, CELSIUS), "K": (1, 1, 0)},
    "temperature_difference": {"K": (1, 1, 0)},
    "viscosity": {"Pas": (1, 1, 0), "mPas": (1, 1e3, 0)},
    "kinematic_viscosity": {"mm2_s": (1, 1e6, 0), "cSt": (1, 1e6, 0), "m2_s": (1, 1, 0)},
    "pressure_coefficient": {"per_GPa": (1, 1e9, 0), "per_MPa": (1, 1e6, 0), "per_Pa": (1, 1, 0)},
    "temperature_coefficient": {"per_K": (1, 1, 0)},
    "density": {"kg_m3": (1, 1, 0), "g_cm3": (1e3, 1, 0)},
    "specific_heat": {"J_kgK": (1, 1, 0), "kJ_kgK": (1e3, 1, 0)},
    "thermal_conductivity": {"W_mK": (1, 1, 0)},
    "velocity": {"m_s": (1, 1, 0), "mm_s": (1, 1e3, 0)},
    "stiffness": {"N_um": (1e6, 1, 0), "N_m": (1, 1, 0)},
    "damping": {"Ns_m": (1, 1, 0)},
    "inertia": {"kgm2": (1, 1, 0), "kgcm2": (1, 1e4, 0)},
    "mass": {"kg": (1, 1, 0)},
    "angular_velocity": {"rpm": (math.pi, 30, 0), "rad_s": (1, 1, 0)},
}


def to_si(value: Any, dimension: str | None, unit: str) -> Any:
    """A number, or a list of numbers as a tuple, in SI; anything else unchanged for the type check."""
    if isinstance(value, list):
        return tuple(to_si(v, dimension, unit) for v in value)
    if dimension is None or isinstance(value, bool) or not isinstance(value, (int, float)):
        return value
    factor, divisor, offset = UNITS[dimension][unit]
    return value * factor / divisor + offset


def from_si(value: float, dimension: str | None, unit: str) -> float:
    """A number [SI] in a unit."""
    if dimension is None:
        return value
    factor, divisor, offset = UNITS[dimension][unit]
    return (value - offset) * divisor / factor


def turns_of(text: str) -> float | str:
    """Turns of a catalogue as a number.

    Parameters
    ----------
    text : str
        Turns, or turns x circuits.

    Returns
    -------
    float or str
        Turns; a text of another form unchanged.

    Examples
    --------
    >>> turns_of("2.5x2")
    5.0
    """
    number = r"\s*(\d+\.?\d*|\.\d+)\s*"
    product = re.fullmatch(f"{number}[xX*\u00d7]{number}", text)
    return float(product[1]) * float(product[2]) if product else text


class Shown(NamedTuple):
    """Unit of an axis of a map in what people read: its name, one of it and its zero in SI."""

    unit: str
    one: float = 1.0
    zero: float = 0.0

    def of(self, value: float) -> float:
        """A value [SI] in this unit."""
        return (value - self.zero) / self.one

    def si(self, value: float) -> float:
        """A value in this unit [SI]."""
        return value * self.one + self.zero


#: by axis of a map, and of the other numbers of an operating point
SHOWN = {
    "force": Shown("N"),
    "preload": Shown("N"),
    "share": Shown("of the separation load"),
    "difference": Shown("K"),
    "speed": Shown("r/min", RPM),
    "temperature": Shown("C", zero=CELSIUS),
    "axial_load": Shown("N"),
    "torque": Shown("N.m"),
}
