"""Factors of other units; inside the package all quantities are SI, radians and kelvin."""

import math

RPM = math.pi / 30.0  # [rad/s] of one revolution per minute
CELSIUS = 273.15  # [K] at 0 degrees Celsius
