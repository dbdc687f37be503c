"""Column headings of measurement files: which quantity in which unit.

A table of accepted spellings and not a unit library: 1/min as a speed is revolutions, which a library takes for a
frequency (a factor of 2 pi), Nm is not a nanometre, and r/min, U/min, kgf.cm are what test benches write.
"""

from __future__ import annotations

import difflib
import math
import re
from typing import NamedTuple

from ..parameters.units import CELSIUS, RPM

#: unit -> (factor, offset): SI = (value + offset) * factor
Units = dict[str, tuple[float, float]]

FORCE: Units = {
    "N": (1.0, 0.0),
    "kN": (1e3, 0.0),
    "daN": (10.0, 0.0),
    "kgf": (9.80665, 0.0),
    "lbf": (4.4482216152605, 0.0),
}
SPEED: Units = dict.fromkeys(("r/min", "rpm", "rev/min", "U/min", "1/min", "min-1", "min^-1"), (RPM, 0.0)) | {
    "rad/s": (1.0, 0.0),
    "deg/s": (math.pi / 180.0, 0.0),
    **dict.fromkeys(("r/s", "rev/s"), (2.0 * math.pi, 0.0)),
}
TEMPERATURE: Units = {
    **dict.fromkeys(("degC", "C", "\u00b0C"), (1.0, CELSIUS)),
    "K": (1.0, 0.0),
    **dict.fromkeys(("degF", "\u00b0F"), (5.0 / 9.0, 459.67)),
}
TORQUE: Units = {
    **dict.fromkeys(("N.m", "Nm", "N m", "N*m", "N\u00b7m"), (1.0, 0.0)),
    **dict.fromkeys(("N.cm", "Ncm", "cN.m", "cNm"), (1e-2, 0.0)),
    **dict.fromkeys(("N.mm", "Nmm", "mN.m", "mNm"), (1e-3, 0.0)),
    "kgf.cm": (0.0980665, 0.0),
    "lbf.in": (0.1129848290276167, 0.0),
}
#: share of the torque; no factor of a unit
PERCENT = "%"


class Quantity(NamedTuple):
    """A quantity of a measured point: accepted names of its column, units, whether it is required."""

    names: tuple[str, ...]
    units: Units
    needed: bool = False


QUANTITIES: dict[str, Quantity] = {
    "preload": Quantity(("preload",), FORCE, True),
    "speed": Quantity(("speed",), SPEED, True),
    "torque": Quantity(("torque", "friction_torque", "measured_torque", "measured"), TORQUE, True),
    "temperature": Quantity(("temperature", "oil_temperature"), TEMPERATURE),
    "axial_load": Quantity(("axial_load",), FORCE),
    "torque_uncertainty": Quantity(("torque_uncertainty", "uncertainty"), TORQUE | {PERCENT: (1e-2, 0.0)}),
}
#: columns without a unit
PLAIN = ("table", "weight", "comment")
EXAMPLE = "preload [N], speed [r/min], temperature [degC], torque [N.m]"


class Column(NamedTuple):
    """A column that is used: key of QUANTITIES or of PLAIN, spelling in the file, unit as written."""

    key: str
    heading: str
    unit: str = ""

    def si(self, value: float) -> float:
        """A value of the column in SI (per cent as a share)."""
        factor, offset = QUANTITIES[self.key].units[self.unit]
        return (value + offset) * factor


def _letters(unit: str) -> str:
    """Unit as written after a name: rad_s, rpm, nm, degc."""
    return "".join(character for character in unit.lower() if character.isalnum() and character.isascii())


def _units_text(key: str) -> str:
    return ", ".join(unit for unit in QUANTITIES[key].units if unit.isascii())


def _key_of(stem: str) -> str | None:
    return next((key for key, quantity in QUANTITIES.items() if stem in quantity.names), None)


def column_of(heading: str) -> Column | None:
    """Quantity and unit of a heading; None if it is not a known one.

    Parameters   heading : `preload [kN]`, `preload (kN)`, `preload_kN`; case matters only for a unit in brackets
    Raises       ValueError: a known quantity without unit or with an unknown one, a misspelt name
    Example
                 >>> column_of("Speed [1/min]")
                 Column(key='speed', heading='Speed [1/min]', unit='1/min')
                 >>> column_of("torque_Nm").unit, column_of("operator")
                 ('N.m', None)
    """
    bracket = re.fullmatch(r"(.*?)\s*[\[(]\s*(.*?)\s*[\])]", heading)
    stem = (bracket[1] if bracket else heading).strip().lower().replace(" ", "_").replace("-", "_")
    if bracket:
        key, unit = _key_of(stem), bracket[2]
        if key is not None:
            if unit not in QUANTITIES[key].units:
                raise ValueError(f"column {heading!r}: unit {unit!r}; allowed: {_units_text(key)}")
            return Column(key, heading, unit)
    if stem in PLAIN:
        return Column(stem, heading)
    known = {name: key for key, quantity in QUANTITIES.items() for name in quantity.names}
    for name in sorted(known, key=len, reverse=True):
        if stem == name and not bracket:
            raise ValueError(
                f"column {heading!r}: unit missing; write {name} [UNIT] with one of {_units_text(known[name])}"
            )
        if stem.startswith(f"{name}_") and not bracket:
            suffix = _letters(stem[len(name) + 1 :])
            for unit in QUANTITIES[known[name]].units:
                if suffix and _letters(unit) == suffix:
                    return Column(known[name], heading, unit)
            raise ValueError(
                f"column {heading!r}: unit {stem[len(name) + 1 :]!r}; write {name} [UNIT] with one of "
                f"{_units_text(known[name])}"
            )
    # a misspelt name may be followed by a unit
    short = stem.rsplit("_", 1)[0]
    names = [*known, *PLAIN]
    near = [name for name in names if len(short) > 2 and name.startswith(short)]
    near += difflib.get_close_matches(short, names, n=1, cutoff=0.75)
    if near:
        raise ValueError(f"column {heading!r} unknown; is {near[0]} meant? allowed: {EXAMPLE}, and others")
    return None


def columns_of(headings: list[str]) -> tuple[list[Column | None], list[str]]:
    """Columns of a heading line, None where it is not used, and the headings that are not used.

    Raises       ValueError: as column_of; a needed column missing, a quantity given twice
    """
    columns = [column_of(heading) for heading in headings]
    used = [column for column in columns if column is not None]
    for i, column in enumerate(used):
        for other in used[:i]:
            if other.key == column.key:
                raise ValueError(
                    f"columns {other.heading!r} and {column.heading!r} both are {column.key}; allowed: one"
                )
    keys = {column.key for column in used}
    for key, quantity in QUANTITIES.items():
        if quantity.needed and key not in keys:
            raise ValueError(
                f"column {key} missing (found: {', '.join(headings)}); allowed: a line of headings such as {EXAMPLE}"
            )
    if {"weight", "torque_uncertainty"} <= keys:
        raise ValueError("columns weight and torque_uncertainty; allowed: one of them")
    return columns, [heading for heading, c in zip(headings, columns, strict=True) if c is None]
