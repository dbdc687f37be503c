"""Factors of other units; inside the package all quantities are SI, radians and kelvin."""

import math
from typing import NamedTuple

RPM = math.pi / 30.0  # [rad/s] of one revolution per minute
CELSIUS = 273.15  # [K] at 0 degrees Celsius
#: least and highest temperature [K] of an oil; one law of its viscosity is singular at 183.19 K
COLDEST, HOTTEST = 200.0, 500.0 + CELSIUS


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
    "speed": Shown("r/min", RPM),
    "temperature": Shown("C", zero=CELSIUS),
    "axial_load": Shown("N"),
    "torque": Shown("N.m"),
}
