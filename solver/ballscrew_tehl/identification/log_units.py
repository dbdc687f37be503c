"""Column headings of logs of a drive: which signal in which unit."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from ..calibration.measurement_units import FORCE, KELVIN, SPEED, TORQUE, Column, Quantity, Units, column_of

LENGTH: Units = {unit: (factor, 0.0) for unit, factor in {"m": 1.0, "mm": 1e-3, "um": 1e-6}.items()}
ANGLE: Units = {
    "rad": (1.0, 0.0),
    **dict.fromkeys(("deg", "Grad"), (math.pi / 180.0, 0.0)),
    **dict.fromkeys(("rev", "r", "turns"), (2.0 * math.pi, 0.0)),
}
TIME: Units = {"s": (1.0, 0.0), "ms": (1e-3, 0.0), "us": (1e-6, 0.0)}
VELOCITY: Units = {
    "m/s": (1.0, 0.0), "mm/s": (1e-3, 0.0), "m/min": (1.0 / 60.0, 0.0), "mm/min": (1e-3 / 60.0, 0.0),
}  # fmt: skip
CURRENT: Units = {"A": (1.0, 0.0), "mA": (1e-3, 0.0)}
VOLTAGE: Units = {"V": (1.0, 0.0), "mV": (1e-3, 0.0)}


def _measured(*words: str) -> tuple[str, ...]:
    """Names of a measured signal of the motor, English or German."""
    forms = "{}", "actual_{}", "act_{}", "{}_act", "motor_{}", "motor{}", "ist{}", "{}istwert", "{}_istwert"
    return tuple(form.format(word) for form in forms for word in words)


#: speed and velocity are taken by their unit; the names with `screw` are of the screw side of a gear
QUANTITIES: dict[str, Quantity] = {
    "time": Quantity(("time", "t", "timestamp", "zeit", "zeitstempel"), TIME),
    "position": Quantity(_measured("position", "angle", "lage", "weg", "winkel"), LENGTH | ANGLE),
    "screw_position": Quantity(("screw_position", "screw_angle"), ANGLE),
    "speed": Quantity(_measured("speed", "velocity", "drehzahl", "geschwindigkeit"), SPEED | VELOCITY),
    "screw_speed": Quantity(("screw_speed",), SPEED),
    "current": Quantity(_measured("current", "strom"), CURRENT),
    "torque": Quantity(_measured("torque", "moment", "drehmoment"), TORQUE),
    "screw_torque": Quantity(("screw_torque",), TORQUE),
    "force": Quantity(("force", "drive_force", "kraft"), FORCE),
    "voltage": Quantity(("voltage", "drive_voltage", "spannung"), VOLTAGE),
    "temperature": Quantity(("temperature", "oil_temperature", "temperatur", "\u00f6ltemperatur"), KELVIN),
    "preload": Quantity(("preload", "vorspannung"), FORCE),
}
EXAMPLE = "time [s], position [mm], current [A]"
#: signals of the motion, the position first, and of the drive; the first that a log has is used
MOTION = ("position", "screw_position", "speed", "screw_speed")
EFFORT = ("force", "screw_torque", "torque", "current", "voltage")
NEEDED = {"time": ("time",), "position or speed": MOTION, "current, torque, force or voltage": EFFORT}


class LogColumn(NamedTuple):
    """A column that is used: its place in the row, its heading, its unit, whether an option has stated that."""

    place: int
    heading: str
    unit: str
    stated: bool = False

    @property
    def stem(self) -> str:
        """Heading without its unit."""
        return _parted(self.heading)[0]


def unit_family(name: str, unit: str) -> Units:
    """Units of a signal that a unit may be mistaken for: an angle is no length."""
    parts = LENGTH, ANGLE, SPEED, VELOCITY, QUANTITIES[name].units
    return next(units for units in parts if unit in units)


def stated_columns(texts: Iterable[str]) -> dict[str, str]:
    """Heading, with its unit or without, by signal.

    Parameters   texts : of the option --column
    Raises       ValueError: another form, an unknown signal, one given twice
    """
    found: dict[str, str] = {}
    for text in texts:
        name, _, heading = (part.strip() for part in text.partition("="))
        if name not in QUANTITIES or not heading or name in found:
            raise ValueError(
                f"--column = {text}; allowed: QUANTITY=HEADING [UNIT], each QUANTITY once: {', '.join(QUANTITIES)}"
            )
        found[name] = heading
    return found


def _parted(heading: str) -> tuple[str, str]:
    """Heading without and with the unit in the brackets at its end; `in s` and `/ s` are as good as brackets."""
    heading = heading.replace("\u00b5", "u").replace("\u03bc", "u").strip()
    found = re.fullmatch(r"(.*\S)\s*[\[(]([^\[\]()]*)[\])]", heading) or re.fullmatch(
        r"(.*\S)\s+(?:in|/)\s+(\S+)", heading
    )
    return (found[1], found[2].strip()) if found else (heading, "")


def _places(text: str, headings: Sequence[str]) -> list[int]:
    """Where a heading stands: as it is written, else without units."""
    same = [place for place, heading in enumerate(headings) if heading == text]
    stem = _parted(text)[0]
    return same or [k for k, heading in enumerate(headings) if stem in (heading, _parted(heading)[0])]


def needed_places(headings: Sequence[str], stated: Mapping[str, str]) -> list[int] | None:
    """Places of time, motion and drive in a line; None: it is no line of headings."""
    found: dict[str, int] = {}
    for place, heading in enumerate(headings):
        # a unit may follow
        stem = re.sub("[ -]", "_", _parted(heading)[0].lower()) + "_"
        for key, quantity in QUANTITIES.items():
            if any(stem.startswith(f"{name}_") for name in quantity.names):
                found.setdefault(key, place)
    for key, text in stated.items():
        for place in _places(text, headings):
            found[key] = place
    places = [found[key] for keys in NEEDED.values() for key in [k for k in keys if k in found][:1]]
    return places if len(places) == len(NEEDED) else None


def _column(heading: str, unit: str) -> Column | None:
    """Signal of a heading; unit : of a row of units.

    Raises       ValueError: as column_of
    """
    stem, own = _parted(heading)
    if own or not unit:
        return column_of(f"{stem} [{own}]" if own else stem, QUANTITIES, (), EXAMPLE)
    return column_of(f"{stem} [{unit}]", QUANTITIES, (), EXAMPLE) or column_of(stem, QUANTITIES, (), EXAMPLE)


def log_columns(
    headings: Sequence[str], units: Sequence[str], stated: Mapping[str, str], wanted: Sequence[str] = ()
) -> tuple[dict[str, LogColumn], list[str]]:
    """Columns that are used, by signal, and the headings of the others.

    Parameters   units : of a row of units, empty where there is none;  stated : see stated_columns
                 wanted : signals of the drive that are used, after stated ones, before the order of EFFORT
    Raises       ValueError: a signal missing, without unit or with an unknown one, given twice
    """
    found: dict[str, list[LogColumn]] = {}
    problems = []
    for name, text in stated.items():
        places = _places(text, headings)
        if len(places) != 1:
            raise ValueError(
                f"--column {name}={text}: {len(places) or 'no'} such columns (found: {', '.join(headings)}); allowed: "
                "one heading of the log and its unit"
            )
        heading, own = headings[places[0]], _parted(text)[1]
        unit = own or _parted(heading)[1] or units[places[0]]
        column = column_of(f"{name} [{unit}]" if unit else name, QUANTITIES, (), EXAMPLE)
        assert column is not None
        found[name] = [LogColumn(places[0], heading, column.unit, bool(own))]
    taken = {columns[0].place for columns in found.values()}
    for place, heading in enumerate(headings):
        if place in taken:
            continue
        try:
            column = _column(heading, units[place])
        except ValueError as error:
            problems.append(str(error).partition(f" allowed: {EXAMPLE}")[0])
            continue
        if column is not None and column.key not in stated:
            found.setdefault(column.key, []).append(LogColumn(place, heading, column.unit))
    for what, names in NEEDED.items():
        if not found.keys() & set(names):
            raise ValueError(
                f"column {what} missing (found: {', '.join(filter(None, headings))})"
                f"{''.join(f'; {text}' for text in problems[:2])}; allowed: headings with units between commas, "
                f'semicolons or tabs, such as {EXAMPLE}, or --column "QUANTITY=HEADING [UNIT]" for others, QUANTITY '
                f"one of {', '.join(QUANTITIES)}"
            )
    motion = next(name for name in (*stated, *MOTION) if name in found and name in MOTION)
    effort = next(name for name in (*stated, *wanted, *EFFORT) if name in found and name in EFFORT)
    used: dict[str, LogColumn] = {}
    for name in ("time", motion, effort, "temperature", "preload"):
        if len(columns := found.get(name, [])) > 1:
            raise ValueError(
                f"columns {columns[0].heading!r} and {columns[1].heading!r} both are {name}; allowed: one, or "
                f'--column "{name}=HEADING [UNIT]"'
            )
        if columns:
            used[name] = columns[0]
    taken = {column.place for column in used.values()}
    return used, [heading for place, heading in enumerate(headings) if place not in taken]
