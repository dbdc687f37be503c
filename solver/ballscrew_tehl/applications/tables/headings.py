"""Headings of tables: which quantity in which unit, for logs, measured torques, operating points and the live page.

Accepted spellings and not a unit library: 1/min as a speed is revolutions, which a library takes for a frequency (a
factor of 2 pi), and pint reads 20 of the spellings that test benches write otherwise or not at all (r/min, U/min, Nm,
Ncm, %).
"""

import difflib
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ballscrew_tehl.parameters.units import CELSIUS, RPM

#: unit -> (factor, offset): SI = (value + offset) * factor; dots between letters may be missing, or spaces or others
Units = dict[str, tuple[float, float]]
Value = TypeVar("Value", float, NDArray[np.float64])
#: fraction of the torque; no factor of a unit
PERCENT = "%"
INCH = 0.0254
#: units of drives that need a number of the motor, its encoder or the drive, and how
RELATIVE = {
    r"(0[.,]?1)? *%.*|\u2030.*|.*per ?(cent|mil).*|pro(zent|mille)|pct|p\.?u\.?":
        "is a part of the rated value: state what one is, as [0.04 {}]",
    "k?(cnts?|counts?|inc.*|pulses?|ticks?)(/.*)?|cts|ink.*|lsb":
        "depends on the encoder: with 4096 a turn state [1/4096 rev], a speed [1/4096 rev/s] (k: 1000/4096)",
    "1/s|hz": "may be of turns or radians: state [r/s] or [rad/s]",
    "lu|((reference|command|user) ?)?units?(/.*)?": "is set in the drive: state the length or angle of one, [0.001 mm]",
}  # fmt: skip
#: a number before the unit in brackets, how many of it one is: [0.1 um], [1/4096 rev]
MULTIPLE = re.compile(r"[\[(]\s*((\d*[.,]?\d+)(?:/([1-9]\d*))?\s+)(?=[^\d\s/][^\[\]()]*[\])]$)")


#: smallest usual range of a sensor [SI], by quantity; a round number of at least so much before a unit may be the range
#: of the sensor or what one is
RANGES = {
    "torque": 0.1, "screw_torque": 0.1, "force": 5.0, "preload": 5.0, "axial_load": 5.0, "current": 0.5, "voltage": 0.5,
    "position": 5e-3, "screw_position": 1.5, "speed": 0.1, "screw_speed": 10.0, "temperature": 5.0,
}  # fmt: skip

ALIASES: set[str] = set()


def _units(factors: Mapping[str, float]) -> Units:
    """Units without an offset; spellings of one unit are separated by spaces, messages have the first."""
    ALIASES.update(name for names in factors for name in names.split()[1:])
    return {unit: (factor, 0.0) for names, factor in factors.items() for unit in names.split()}


FORCE = _units({"N": 1.0, "kN": 1e3, "daN": 10.0, "kgf": 9.80665, "lbf": 4.4482216152605})
SPEED = _units({"r/min rpm rev/min U/min 1/min min-1 turn/min turns/min rot/min Umdr/min": RPM, "rad/s": 1.0,
                "deg/s": math.pi / 180.0, "r/s rev/s turn/s turns/s rps U/s rot/s": 2.0 * math.pi,
                "krpm": 1e3 * RPM})  # fmt: skip
VELOCITY = _units({"m/s": 1.0, "mm/s": 1e-3, "m/min": 1.0 / 60.0, "mm/min": 1e-3 / 60.0, "um/s": 1e-6,
                   "in/s inch/s": INCH, "in/min inch/min ipm": INCH / 60.0})  # fmt: skip
TEMPERATURE = {"degC": (1.0, CELSIUS), "C": (1.0, CELSIUS), "K": (1.0, 0.0), "degF": (5.0 / 9.0, 459.67)}
TORQUE = _units({"N.m": 1.0, "dN.m": 0.1, "N.cm cN.m": 1e-2, "N.mm mN.m": 1e-3, "kgf.m": 9.80665,
                 "kgf.cm kg.cm": 9.80665e-2, "lbf.ft lb.ft ft.lbf ft.lb ft.lbs lbs.ft": 1.3558179483314004,
                 "lbf.in lb.in in.lbf in.lb in.lbs lbs.in": 0.1129848290276167,
                 "ozf.in oz.in in.oz in.ozf": 0.00706155181422604})  # fmt: skip
LENGTH = _units({"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "cm": 1e-2, "in inch": INCH})
ANGLE = _units({"rad": 1.0, "deg Grad degree degrees": math.pi / 180.0, "rev r turns turn rot U": 2.0 * math.pi,
                "mrad": 1e-3, "urad": 1e-6, "mdeg": 1e-3 * math.pi / 180.0})  # fmt: skip
#: time of day, a date before it
CLOCK = "HH:MM:SS"
TIME = _units({"s sec second seconds Sek": 1.0, "ms msec": 1e-3, "us usec": 1e-6, "ns nsec": 1e-9, "100ns": 1e-7,
               "min": 60.0, "h": 3600.0, "d days": 86400.0}) | {CLOCK: (1.0, 0.0)}  # fmt: skip
CURRENT = _units({"A": 1.0, "mA": 1e-3, "Arms Aeff Amprms": 1.0, "Apk Apeak Ap Amppeak Amppk": 1.0})
VOLTAGE = _units({"V": 1.0, "mV": 1e-3})


class Quantity(NamedTuple):
    """Accepted names of its column (English, German) and units."""

    names: tuple[str, ...]
    units: Units


class Kind(NamedTuple):
    """What a table has; needed: keys of which one must be there, by how a message names them."""

    quantities: Mapping[str, Quantity]
    needed: Mapping[str, Sequence[str]]
    example: str
    texts: Sequence[str] = ()


def _of_the_motor(*words: str) -> tuple[str, ...]:
    """Names of a measured signal of the motor."""
    forms = "{}", "actual_{}", "act_{}", "{}_act", "motor_{}", "motor{}", "ist{}", "{}istwert", "{}_istwert"
    return tuple(form.format(word) for form in forms for word in words)


_PRELOAD = Quantity(("preload", "vorspannung", "vorspannkraft"), FORCE)
_OIL = Quantity(("temperature", "oil_temperature", "temperatur", "\u00f6ltemperatur"), TEMPERATURE)
#: stated in place of a heading of the time: the rows are counted
ROW = "row"
#: of measured torques and operating points
MEASURED = {
    "preload": _PRELOAD,
    "speed": Quantity(("speed", "drehzahl"), SPEED),
    "torque": Quantity(("torque", "friction_torque", "measured_torque", "measured",
                        "moment", "drehmoment", "reibmoment", "leerlaufmoment", "leerlaufdrehmoment"), TORQUE),
    "temperature": _OIL,
    "axial_load": Quantity(("axial_load", "axiallast"), FORCE),
    "torque_uncertainty": Quantity(("torque_uncertainty", "torque_error", "uncertainty"),
                                   TORQUE | {PERCENT: (1e-2, 0.0)}),
}  # fmt: skip
MEASURED_EXAMPLE = "preload [N], speed [r/min], temperature [degC], torque [N.m]"
#: of a number as it is written
NO_UNIT: Units = {"": (1.0, 0.0)}
TORQUES = Kind(
    MEASURED
    | {
        "weight": Quantity(("weight",), NO_UNIT),
    }
    | {name: Quantity((name,), {PERCENT: (1e-2, 0.0)}) for name in ("torque_tolerance", "preload_tolerance")}
    | {name: Quantity((name,), TORQUE) for name in ("torque_low", "torque_high")},
    {"preload": ("preload",), "speed": ("speed",), "torque": ("torque", "torque_low")},
    MEASURED_EXAMPLE,
    ("table", "comment"),
)
#: signals of the motion, the position first, and of the drive; the first that a log has is used
MOTION = ("position", "screw_position", "speed", "screw_speed")
EFFORT = ("force", "screw_torque", "torque", "current", "voltage")
_TIMES = "time", "t", "timestamp", "time_stamp", "datetime", "date_time", "zeit", "zeitstempel", "uhrzeit"
#: log of a drive; a speed is one of the motor or along the axis by its unit, `screw` is behind a gear
LOG = Kind(
    {
        "time": Quantity(_TIMES, TIME),
        "position": Quantity(_of_the_motor("position", "angle", "lage", "weg", "winkel"), LENGTH | ANGLE),
        "screw_position": Quantity(("screw_position", "screw_angle"), ANGLE),
        "speed": Quantity(
            _of_the_motor("speed", "velocity", "drehzahl", "geschwindigkeit"), SPEED | VELOCITY
        ),
        "screw_speed": Quantity(("screw_speed",), SPEED),
        "current": Quantity(_of_the_motor("current", "strom"), CURRENT),
        "torque": Quantity(_of_the_motor("torque", "moment", "drehmoment"), TORQUE),
        "screw_torque": Quantity(("screw_torque",), TORQUE),
        "force": Quantity(("force", "drive_force", "kraft"), FORCE),
        "voltage": Quantity(("voltage", "drive_voltage", "spannung"), VOLTAGE),
        "temperature": _OIL,
        "preload": _PRELOAD,
    },
    {"time": ("time",), "position or speed": MOTION, "current, torque, force or voltage": EFFORT},
    'time [s], position [mm], current [A], or --column "QUANTITY=HEADING [UNIT]" for others',
)


class HeadingError(ValueError):
    """A heading that may mean a quantity, its key: misspelt, without a unit or with an unknown one in brackets."""

    def __init__(self, key: str, text: str, unknown_unit: bool = False) -> None:
        super().__init__(text)
        self.key, self.unknown_unit = key, unknown_unit


class Column(NamedTuple):
    """A column that is used: place in the row, heading, unit ("": none), if an option states it, multiple of it."""

    place: int
    heading: str
    unit: str
    stated: bool = False
    multiple: float | None = None

    def option(self, key: str, unit: str = "") -> str:
        """That states the unit of this quantity, or another."""
        own = self.unit if self.multiple is None else f"{self.multiple:g} {self.unit}"
        return f'--column "{key}={parted(self.heading)[0]} [{unit or own}]"'


def parted(heading: str) -> tuple[str, str | None]:
    """Heading without its unit, and that; None: no brackets, `in` or `/` at its end.

    >>> parted("Lage (\u00b5m)"), parted("TCMD(X) [A(p)]"), parted("Strom / A"), parted("speed_rpm")
    (('Lage', 'um'), ('TCMD(X)', 'A(p)'), ('Strom', 'A'), ('speed_rpm', None))
    """
    heading = heading.replace("\u00b5", "u").replace("\u03bc", "u").strip()
    match = re.fullmatch(r"(.*\S)\s*[\[(]\s*((?:[^\[\]()]|\([^\[\]()]*\))*?)\s*[\])]", heading)
    match = match or re.fullmatch(r"(.*\S)\s+(?:in|/)\s+(\S+)", heading)
    return (match[1], match[2]) if match else (heading, None)


def quantity_of(heading: str, kind: Kind, below: str = "") -> tuple[str, str] | None:
    """Quantity and unit of a heading, "" without one; below: unit in a row of units; None: not a known quantity.

    >>> quantity_of("Speed [1/min]", TORQUES), quantity_of("torque_Nm", TORQUES), quantity_of("room", TORQUES)
    (('speed', '1/min'), ('torque', 'N.m'), None)
    """
    stem, unit = parted(heading)
    if not unit and below:
        try:
            if result := quantity_of(f"{stem} [{below}]", kind):
                return result
        except HeadingError as error:
            if unit is not None or not error.unknown_unit or _relative(below):
                raise
    stem = re.sub("[ -]", "_", stem.lower())
    if stem in kind.texts:
        return stem, ""
    keys = {name: key for key, quantity in kind.quantities.items() for name in quantity.names}
    for name in sorted(keys, key=len, reverse=True):
        if stem == name or (unit is None and stem.startswith(f"{name}_")):
            return keys[name], _unit_of(heading, stem[len(name) + 1 :], unit, name, keys[name], kind)
    # a misspelt name may be followed by a unit
    short = stem.rsplit("_", 1)[0]
    names = [*keys, *kind.texts]
    near = [name for name in names if len(short) > 2 and name.startswith(short)]
    near += difflib.get_close_matches(short, names, n=1, cutoff=0.75)
    if near:
        message = f"column {heading!r} unknown; is {near[0]} meant? allowed: {kind.example}"
        raise HeadingError(keys.get(near[0], near[0]), message)
    return None


def _relative(unit: str) -> str:
    """Why a unit of RELATIVE is none, "" of others."""
    return "".join(f" {why}" for pattern, why in RELATIVE.items() if re.fullmatch(pattern, unit.lower()))


def _unit_of(heading: str, behind: str, unit: str | None, name: str, key: str, kind: Kind) -> str:
    """Unit of a quantity as the tables have it, of one in brackets or behind the name: rad_s, rpm, nm, degc."""

    def spelled(text: str) -> str:
        if unit is None:
            return re.sub("[^a-z0-9]", "", text.lower())
        # case matters, what may stand between the letters does not
        text = text.replace("\u00b0", "deg").replace("\u207b\u00b9", "1")
        return re.sub("[\\s.*^_()\u00b7\u22c5\u30fb-]", "", text)

    written, units = behind if unit is None else unit, kind.quantities[key].units
    for known in units:
        if (spelled(written) or not known) and spelled(known) == spelled(written):
            return known
    for known in units:
        # not mega for milli
        if spelled(known).lower() == spelled(written).lower() and not spelled(written).startswith("MN"):
            return known
    problem = f"unit {written!r}" if written else "unit missing"
    problem += _relative(written).format(next(iter(units)))
    remedy = f"write {name} [UNIT] with one of" if unit is None else "allowed:"
    text = f"column {heading!r}: {problem}; {remedy} {', '.join(k for k in units if k not in ALIASES) or 'no unit'}"
    raise HeadingError(key, text, unknown_unit=unit is not None)


def named_places(headings: Sequence[str], kind: Kind, stated: Mapping[str, str]) -> list[int]:
    """Places of the needed quantities in a line, by their names alone; empty: it is no line of headings."""
    # a unit may follow
    stems = [re.sub("[ -]", "_", parted(heading)[0].lower()) + "_" for heading in headings]
    places: dict[str, int] = {}
    for key, quantity in kind.quantities.items():
        names = tuple(f"{name}_" for name in quantity.names)
        if result := [k for k, stem in enumerate(stems) if stem.startswith(names)]:
            places[key] = result[0]
    places |= {key: same[-1] for key, text in stated.items() if (same := _places_of(text, headings))}
    needed = [next((places[key] for key in keys if key in places), -1) for keys in kind.needed.values()]
    return [] if -1 in needed else needed


def _multiple(heading: str) -> tuple[str, float | None]:
    """Heading without the number before its unit, and that; None: no number."""
    match = MULTIPLE.search(heading)
    multiple = float(match[2].replace(",", ".")) / int(match[3] or 1) if match else 0.0
    if not match or multiple == 0.0:
        return heading, None
    return heading[: match.start(1)] + heading[match.end() :], multiple


def _refuse_range(key: str, heading: str, unit: str, multiple: float, factor: float) -> None:
    """HeadingError for a number that may be the range of a sensor: round, of a usual size, (0.5 N.m), (100 N.m)."""
    round_one = float(f"{multiple:.2g}") == multiple
    if multiple != 1.0 and round_one and multiple * factor >= RANGES.get(key, math.inf):
        stem = parted(heading)[0]
        raise HeadingError(
            key,
            f"column {heading!r}: {multiple:g} {unit} may be the range of the sensor, or what one is; allowed: "
            f'--column "{key}={stem} [{unit}]" for a range, --column "{key}={stem} [{multiple:g} {unit}]" where one is '
            "that; in a file without that option: the heading with the unit alone, or values in it",
            unknown_unit=True,
        )


def _places_of(text: str, headings: Sequence[str]) -> list[int]:
    """Where a stated heading is: as it is written, else without units."""
    same = [place for place, heading in enumerate(headings) if heading == text]
    stem = parted(text.lstrip("#% "))[0]
    return same or [k for k, heading in enumerate(headings) if stem in (heading, parted(heading)[0])]


def columns_of(
    headings: Sequence[str],
    kind: Kind,
    stated: Mapping[str, str],
    below: Sequence[str],
    periods: Collection[float] = (),
) -> tuple[dict[str, list[Column]], list[HeadingError]]:
    """Columns by key, headings that were not understood.

    stated: by an option; below: row of units, may be short; periods: of the samples [s], for logs without a time
    """
    # without brackets and what is behind: rpm (Rotational speed), but A(p)
    whole = r"[\[(\s]*([^\[\]()]*(\((p|pk|peak|rms)\))?).*"
    units = [re.sub(whole, r"\1", text).strip() for text in below] + len(headings) * [""]
    those = f"found: {', '.join(filter(None, headings))}"
    those += "; save the file as UTF-8" * ("\ufffd" in those)
    columns = {key: [_stated(key, text, headings, kind, units, those)] for key, text in stated.items()}
    taken, problems = {column.place for (column,) in columns.values()}, []
    for place, heading in enumerate(headings):
        text, multiple = _multiple(heading)
        try:
            result = None if place in taken else quantity_of(text, kind, units[place])
            if result is not None and multiple is not None:
                key, unit = result
                _refuse_range(key, heading, unit, multiple, kind.quantities[key].units[unit][0])
        except HeadingError as error:
            problems.append(error)
            continue
        if result is not None and result[0] not in stated:
            columns.setdefault(result[0], []).append(Column(place, heading, result[1], False, multiple))
    if len(periods) == 1 and not any(problem.key == "time" for problem in problems):
        columns.setdefault("time", [Column(-1, ROW, "s", False, *periods)])
    _check_needed(columns, kind, problems, those, periods)
    return columns, problems


def _stated(
    key: str, text: str, headings: Sequence[str], kind: Kind, units: Sequence[str], those: str
) -> Column:
    """The column that an option states."""
    places = _places_of(text, headings)
    if not places and key == "time" and parted(text)[0] == ROW:
        places = [-1]
    if len(places) != 1:
        raise ValueError(
            f"--column {key}={text}: {len(places) or 'no'} such columns ({those}); allowed: one, rename others"
        )
    (place,), own = places, parted(text)[1]
    heading = headings[place] if place >= 0 else ROW
    unit = own or parted(heading)[1] or units[place]
    text, multiple = _multiple(f"{key} [{unit}]" if unit else key)
    unit = (quantity_of(text, kind) or ("", ""))[1]
    if not own and multiple is not None:
        _refuse_range(key, heading, unit, multiple, kind.quantities[key].units[unit][0])
    return Column(place, heading, unit, bool(own), multiple)


def _check_needed(
    columns: Collection[str],
    kind: Kind,
    problems: Sequence[HeadingError],
    those: str,
    periods: Collection[float],
) -> None:
    """ValueError: none of the columns has a needed quantity, with a heading that was not understood or all of them."""
    for what, keys in kind.needed.items():
        if any(key in columns for key in keys):
            continue
        # names that are known first
        for problem in sorted(problems, key=lambda one: not one.unknown_unit):
            if problem.key in keys:
                raise problem
        allowed = f"headings with units: {kind.example}"
        if what == "time":
            seen = (
                f" ({', '.join(f'{period:.6g} s' for period in periods)} above the headings)"
                if periods
                else ""
            )
            allowed += f', or row numbers, each 1 ms{seen}: --column "time={ROW} [1 ms]"'
        raise ValueError(f"column {what} missing ({those}); allowed: {allowed}")


def one_column(columns: Mapping[str, Iterable[Column]], key: str, remedy: str = "one") -> Column:
    """The column of a quantity; ValueError: there are two."""
    first, *others = columns[key]
    if others:
        both = f"columns {first.heading!r} and {others[0].heading!r}"
        alike = first.heading == others[0].heading
        raise ValueError(f"{both} both are {key}; allowed: {'one: rename the other' if alike else remedy}")
    return first


def si(value: Value, quantity: Quantity, unit: str, multiple: float | None = None) -> Value:
    """A value of a column, or all of them, in SI (per cent as a fraction)."""
    factor, offset = quantity.units[unit]
    return (value * (multiple or 1.0) + offset) * factor
