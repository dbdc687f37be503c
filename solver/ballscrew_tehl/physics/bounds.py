"""Checks of the arguments of closed formulas; an error says what, value, unit, allowed and remedy."""

from __future__ import annotations

from typing import Any

import numpy as np

#: unit and remedy by name of an argument; others are dimensionless groups
_UNITS = {
    "sigma": ("m", "check the roughness measurement; 0 is a smooth contact"),
    "E_prime": ("Pa", "2/sum((1-nu^2)/E), 226e9 for steel"),
    "load": ("N", "check preload"),
    "u_e": ("m/s", "mean speed of both surfaces relative to the contact"),
    "R_x": ("m", "reduced radius along rolling"),
    "R_y": ("m", "reduced radius across rolling"),
    "temperature": ("K", "kelvin, 303.15 for 30 C"),
    "eta0": ("Pa s", "viscosity at ambient pressure"),
    "alpha_pv": ("1/Pa", "pressure-viscosity coefficient"),
}


def needs(valid: Any, name: str, value: Any, allowed: str) -> None:
    """Raise a ValueError unless every element of valid is true (a NaN compares false)."""
    if not np.all(valid):
        unit, remedy = _UNITS.get(name, ("", "check the quantities that form it"))
        raise ValueError(f"{name} = {value}{' ' * bool(unit)}{unit}; needs finite, {allowed}: {remedy}")


def needs_not_negative(**values: Any) -> None:
    """Raise a ValueError for the first argument that is negative or not finite."""
    for name, value in values.items():
        needs((np.asarray(value) >= 0.0) & np.isfinite(value), name, value, ">= 0")


def needs_positive(**values: Any) -> None:
    """Raise a ValueError for the first argument that is not positive or not finite."""
    for name, value in values.items():
        needs((np.asarray(value) > 0.0) & np.isfinite(value), name, value, "> 0")
