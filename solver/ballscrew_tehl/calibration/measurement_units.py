"""Column headings of measurement files: which quantity in which unit.

A table of accepted spellings and not a unit library: 1/min as a speed is revolutions, which a library takes for a
frequency (a factor of 2 pi), and pint reads 20 of the spellings that test benches write otherwise or not at all (r/min,
U/min, Nm, Ncm, %).
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..parameters.units import CELSIUS, RPM

#: unit -> (factor, offset): SI = (value + offset) * factor; dots between letters may be missing, or spaces or others
Units = dict[str, tuple[float, float]]
#: share of the torque; no factor of a unit
PERCENT = "%"

FORCE: Units = {
    unit: (factor, 0.0)
    for unit, factor in {"N": 1.0, "kN": 1e3, "daN": 10.0, "kgf": 9.80665, "lbf": 4.4482216152605}.items()
}
SPEED: Units = dict.fromkeys(("r/min", "rpm", "rev/min", "U/min", "1/min", "min-1"), (RPM, 0.0)) | {
    "rad/s": (1.0, 0.0),
    "deg/s": (math.pi / 180.0, 0.0),
    **dict.fromkeys(("r/s", "rev/s"), (2.0 * math.pi, 0.0)),
}
KELVIN = {"degC": (1.0, CELSIUS), "C": (1.0, CELSIUS), "K": (1.0, 0.0), "degF": (5.0 / 9.0, 459.67)}
TORQUE: Units = {
    "N.m": (1.0, 0.0),
    **dict.fromkeys(("N.cm", "cN.m"), (1e-2, 0.0)),
    **dict.fromkeys(("N.mm", "mN.m"), (1e-3, 0.0)),
    "kgf.cm": (0.0980665, 0.0),
    "lbf.in": (0.1129848290276167, 0.0),
}


class UnknownUnitError(ValueError):
    """A unit in brackets that is none of its quantity."""


class Quantity(NamedTuple):
    """A quantity of a measured point: accepted names of its column (English, German), units, whether it is required."""

    names: tuple[str, ...]
    units: Units
    needed: bool = False


QUANTITIES: dict[str, Quantity] = {
    "preload": Quantity(("preload", "vorspannung"), FORCE, True),
    "speed": Quantity(("speed", "drehzahl"), SPEED, True),
    "torque": Quantity(
        ("torque", "friction_torque", "measured_torque", "measured", "drehmoment", "reibmoment"), TORQUE, True
    ),
    "temperature": Quantity(("temperature", "oil_temperature", "temperatur", "\u00f6ltemperatur"), KELVIN),
    "axial_load": Quantity(("axial_load", "axiallast"), FORCE),
    "torque_uncertainty": Quantity(
        ("torque_uncertainty", "torque_error", "uncertainty"), TORQUE | {PERCENT: (1e-2, 0.0)}
    ),
}
#: columns without a unit
PLAIN = ("table", "weight", "comment")
EXAMPLE = "preload [N], speed [r/min], temperature [degC], torque [N.m]"


class Column(NamedTuple):
    """A column that is used: key of QUANTITIES or of PLAIN, spelling in the file, unit as in QUANTITIES."""

    key: str
    heading: str
    unit: str = ""

    @property
    def numeric(self) -> bool:
        """Whether its fields are numbers."""
        return bool(self.unit) or self.key == "weight"

    def si(self, value: float) -> float:
        """A value of the column in SI (per cent as a share)."""
        factor, offset = QUANTITIES[self.key].units[self.unit] if self.unit else (1.0, 0.0)
        return (value + offset) * factor


def _joined(unit: str) -> str:
    """Unit in brackets, without what may stand between its letters."""
    return re.sub("[\\s.*^\u00b7\u22c5-]", "", unit).replace("\u00b0", "deg")


def _letters(unit: str) -> str:
    """Unit as written after a name: rad_s, rpm, nm, degc."""
    return re.sub("[^a-z0-9]", "", unit.lower())


def column_of(
    heading: str,
    quantities: Mapping[str, Quantity] = QUANTITIES,
    plain: Sequence[str] = PLAIN,
    example: str = EXAMPLE,
) -> Column | None:
    """Quantity and unit of a heading; None if it is not a known one.

    Parameters   heading : `preload [kN]`, `preload (kN)`, `preload_kN`; case matters only for a unit in brackets
                 quantities, plain, example : of another kind of file
    Raises       ValueError: a known quantity without unit or with an unknown one, a misspelt name
    Example
                 >>> column_of("Speed [1/min]")
                 Column(key='speed', heading='Speed [1/min]', unit='1/min')
                 >>> column_of("torque_Nm").unit, column_of("torque [N cm]").unit, column_of("operator")
                 ('N.m', 'N.cm', None)
    """
    bracket = re.fullmatch(r"(.*?)\s*[\[(]\s*(.*?)\s*[\])]", heading)
    stem = re.sub("[ -]", "_", (bracket[1] if bracket else heading).strip().lower())
    if stem in plain:
        return Column(stem, heading)
    keys = {name: key for key, quantity in quantities.items() for name in quantity.names}
    for name in sorted(keys, key=len, reverse=True):
        if stem != name and (bracket or not stem.startswith(f"{name}_")):
            continue
        given = bracket[2] if bracket else stem[len(name) + 1 :]
        spelled, units = _joined if bracket else _letters, quantities[keys[name]].units
        for unit in units:
            if spelled(given) and spelled(unit) == spelled(given):
                return Column(keys[name], heading, unit)
        problem = f"unit {given!r}" if given else "unit missing"
        remedy = "allowed:" if bracket else f"write {name} [UNIT] with one of"
        kind = UnknownUnitError if bracket else ValueError
        raise kind(f"column {heading!r}: {problem}; {remedy} {', '.join(units)}")
    # a misspelt name may be followed by a unit
    short = stem.rsplit("_", 1)[0]
    names = [*keys, *plain]
    near = [name for name in names if len(short) > 2 and name.startswith(short)]
    near += difflib.get_close_matches(short, names, n=1, cutoff=0.75)
    if near:
        raise ValueError(f"column {heading!r} unknown; is {near[0]} meant? allowed: {example}, and others")
    return None


def columns_of(headings: list[str]) -> tuple[list[Column | None], list[str]]:
    """Columns of a heading line, None where it is not used, and the headings that are not used.

    Raises       ValueError: as column_of; a needed column missing, a quantity given twice
    """
    columns = [column_of(heading) for heading in headings]
    first: dict[str, Column] = {}
    for column in filter(None, columns):
        if (other := first.setdefault(column.key, column)) is not column:
            raise ValueError(
                f"columns {other.heading!r} and {column.heading!r} both are {column.key}; allowed: one"
            )
    for key, quantity in QUANTITIES.items():
        if quantity.needed and key not in first:
            raise ValueError(
                f"column {key} missing (found: {', '.join(headings)}); allowed: a line of headings such as {EXAMPLE}"
            )
    if {"weight", "torque_uncertainty"} <= first.keys():
        raise ValueError("columns weight and torque_uncertainty; allowed: one of them")
    return columns, [heading for heading, column in zip(headings, columns, strict=True) if column is None]
