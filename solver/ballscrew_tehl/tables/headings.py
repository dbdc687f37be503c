"""Headings of tables: which quantity in which unit. Read by `calibrate`, `identify`, `--points` and the live page.

Accepted spellings and not a unit library: 1/min as a speed is revolutions, which a library takes for a frequency (a
factor of 2 pi), and pint reads 20 of the spellings that test benches write otherwise or not at all (r/min, U/min, Nm,
Ncm, %).
"""

import difflib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..parameters.units import CELSIUS, RPM

#: unit -> (factor, offset): SI = (value + offset) * factor; dots between letters may be missing, or spaces or others
Units = dict[str, tuple[float, float]]
Value = TypeVar("Value", float, NDArray[np.float64])
#: fraction of the torque; no factor of a unit
PERCENT = "%"


def _units(factors: Mapping[str, float]) -> Units:
    """Units without an offset; spellings of one unit are separated by spaces."""
    return {unit: (factor, 0.0) for names, factor in factors.items() for unit in names.split()}


FORCE = _units({"N": 1.0, "kN": 1e3, "daN": 10.0, "kgf": 9.80665, "lbf": 4.4482216152605})
SPEED = _units({"r/min rpm rev/min U/min 1/min min-1": RPM, "rad/s": 1.0, "deg/s": math.pi / 180.0,
                "r/s rev/s turn/s turns/s": 2.0 * math.pi})  # fmt: skip
VELOCITY = _units({"m/s": 1.0, "mm/s": 1e-3, "m/min": 1.0 / 60.0, "mm/min": 1e-3 / 60.0})
TEMPERATURE: Units = {
    "degC": (1.0, CELSIUS),
    "C": (1.0, CELSIUS),
    "K": (1.0, 0.0),
    "degF": (5.0 / 9.0, 459.67),
}
TORQUE = _units({"N.m": 1.0, "N.cm cN.m": 1e-2, "N.mm mN.m": 1e-3, "kgf.cm": 0.0980665,
                 "lbf.in lb.in": 0.1129848290276167})  # fmt: skip
LENGTH = _units({"m": 1.0, "mm": 1e-3, "um": 1e-6})
ANGLE = _units({"rad": 1.0, "deg Grad": math.pi / 180.0, "rev r turns": 2.0 * math.pi})
TIME = _units({"s": 1.0, "ms": 1e-3, "us": 1e-6})
CURRENT = _units({"A": 1.0, "mA": 1e-3})
VOLTAGE = _units({"V": 1.0, "mV": 1e-3})


class Quantity(NamedTuple):
    """Accepted names of its column (English, German), units, whether a file of measured torques must have it."""

    names: tuple[str, ...]
    units: Units
    needed: bool = False


def _of_the_motor(*words: str) -> tuple[str, ...]:
    """Names of a measured signal of the motor."""
    forms = "{}", "actual_{}", "act_{}", "{}_act", "motor_{}", "motor{}", "ist{}", "{}istwert", "{}_istwert"
    return tuple(form.format(word) for form in forms for word in words)


_PRELOAD = "preload", "vorspannung"
_OIL = Quantity(("temperature", "oil_temperature", "temperatur", "\u00f6ltemperatur"), TEMPERATURE)
#: of measured torques and operating points
MEASURED = {
    "preload": Quantity(_PRELOAD, FORCE, True),
    "speed": Quantity(("speed", "drehzahl"), SPEED, True),
    "torque": Quantity(
        ("torque", "friction_torque", "measured_torque", "measured", "moment", "drehmoment", "reibmoment"), TORQUE, True
    ),
    "temperature": _OIL,
    "axial_load": Quantity(("axial_load", "axiallast"), FORCE),
    "torque_uncertainty": Quantity(
        ("torque_uncertainty", "torque_error", "uncertainty"), TORQUE | {PERCENT: (1e-2, 0.0)}
    ),
}  # fmt: skip
#: of measured torques, without a unit
PLAIN = ("table", "weight", "comment")
MEASURED_EXAMPLE = "preload [N], speed [r/min], temperature [degC], torque [N.m]"
#: of the log of a drive; a speed is one of the motor or along the axis by its unit, `screw` is behind a gear
LOG = {
    "time": Quantity(("time", "t", "timestamp", "zeit", "zeitstempel"), TIME),
    "position": Quantity(_of_the_motor("position", "angle", "lage", "weg", "winkel"), LENGTH | ANGLE),
    "screw_position": Quantity(("screw_position", "screw_angle"), ANGLE),
    "speed": Quantity(_of_the_motor("speed", "velocity", "drehzahl", "geschwindigkeit"), SPEED | VELOCITY),
    "screw_speed": Quantity(("screw_speed",), SPEED),
    "current": Quantity(_of_the_motor("current", "strom"), CURRENT),
    "torque": Quantity(_of_the_motor("torque", "moment", "drehmoment"), TORQUE),
    "screw_torque": Quantity(("screw_torque",), TORQUE),
    "force": Quantity(("force", "drive_force", "kraft"), FORCE),
    "voltage": Quantity(("voltage", "drive_voltage", "spannung"), VOLTAGE),
    "temperature": _OIL,
    "preload": Quantity(_PRELOAD, FORCE),
}
LOG_EXAMPLE = "time [s], position [mm], current [A]"


class HeadingError(ValueError):
    """A heading that may mean a quantity, its key: misspelt, without a unit or with an unknown one."""

    def __init__(self, key: str, text: str) -> None:
        super().__init__(text)
        self.key = key


class UnknownUnitError(HeadingError):
    """A unit in brackets that is none of its quantity."""


class Column(NamedTuple):
    """A column that is used: place in the row, spelling, unit ("" for a plain one), whether an option states it."""

    place: int
    heading: str
    unit: str
    stated: bool = False


def parted(heading: str) -> tuple[str, str | None]:
    """Heading without its unit, and that; None: no brackets, `in` or `/` at its end.

    >>> parted("Lage (\u00b5m)"), parted("Strom / A"), parted("speed_rpm")
    (('Lage', 'um'), ('Strom', 'A'), ('speed_rpm', None))
    """
    heading = heading.replace("\u00b5", "u").replace("\u03bc", "u").strip()
    found = re.fullmatch(r"(.*\S)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]", heading) or re.fullmatch(
        r"(.*\S)\s+(?:in|/)\s+(\S+)", heading
    )
    return (found[1], found[2]) if found else (heading, None)


def lowered(stem: str) -> str:
    """Name as the lists have it."""
    return re.sub("[ -]", "_", stem.strip().lower())


def _joined(unit: str) -> str:
    """Unit in brackets, without what may stand between its letters."""
    return re.sub("[\\s.*^\u00b7\u22c5-]", "", unit).replace("\u00b0", "deg")


def _letters(unit: str) -> str:
    """Unit as written after a name: rad_s, rpm, nm, degc."""
    return re.sub("[^a-z0-9]", "", unit.lower())


def quantity_of(
    heading: str, quantities: Mapping[str, Quantity], plain: Sequence[str] = (), below: str = "", example: str = ""
) -> tuple[str, str] | None:  # fmt: skip
    """Quantity and unit of a heading, unit "" of a plain one; None if it is not a known one.

    Parameters   heading : `preload [kN]`, `preload in kN`, `preload_kN`; case matters only for a unit in brackets
                 below : unit in a row of units, for a heading without one
    Raises       HeadingError: a known quantity without unit or with an unknown one, a misspelt name
    Example
                 >>> quantity_of("Speed [1/min]", MEASURED), quantity_of("torque_Nm", MEASURED)
                 (('speed', '1/min'), ('torque', 'N.m'))
    """
    stem, given = parted(heading)
    if not given and below:
        try:
            if found := quantity_of(f"{stem} [{below}]", quantities, plain):
                return found
        except UnknownUnitError:
            if given is not None:
                raise
    stem = lowered(stem)
    if stem in plain:
        return stem, ""
    keys = {name: key for key, quantity in quantities.items() for name in quantity.names}
    for name in sorted(keys, key=len, reverse=True):
        if stem != name and (given is not None or not stem.startswith(f"{name}_")):
            continue
        written = stem[len(name) + 1 :] if given is None else given
        spelled, units = _letters if given is None else _joined, quantities[keys[name]].units
        for unit in units:
            if spelled(written) and spelled(unit) == spelled(written):
                return keys[name], unit
        problem = f"unit {written!r}" if written else "unit missing"
        remedy = f"write {name} [UNIT] with one of" if given is None else "allowed:"
        kind = HeadingError if given is None else UnknownUnitError
        raise kind(keys[name], f"column {heading!r}: {problem}; {remedy} {', '.join(units)}")
    # a misspelt name may be followed by a unit
    short = stem.rsplit("_", 1)[0]
    names = [*keys, *plain]
    near = [name for name in names if len(short) > 2 and name.startswith(short)]
    near += difflib.get_close_matches(short, names, n=1, cutoff=0.75)
    if near:
        also = f" allowed: {example}, and others" if example else ""
        raise HeadingError(
            keys.get(near[0], near[0]), f"column {heading!r} unknown; is {near[0]} meant?{also}"
        )
    return None


def both_are(columns: Iterable[Column], key: str, remedy: str = "one") -> ValueError:
    """Error about two columns of one quantity."""
    first, second, *_ = (repr(column.heading) for column in columns)
    return ValueError(f"columns {first} and {second} both are {key}; allowed: {remedy}")


def si(value: Value, quantity: Quantity, unit: str) -> Value:
    """A value of a column, or all of them, in SI (per cent as a fraction)."""
    factor, offset = quantity.units[unit]
    return (value + offset) * factor
