"""Parameters of a double-nut ball screw: read from TOML, checked once, frozen; SI, kelvin, radians.

Keys in a file carry their unit (`ball_diameter_mm`), attributes do not (`ball_diameter`, metres).
"""

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from pydantic import Field, ValidationError, model_validator

from .axis import (
    AXIS_TABLES,
    AxisParameters,
    GuideParameters,
    MotorParameters,
    SupportBearingParameters,
    WiperParameters,
)
from .friction import FrictionTable, Law
from .oil import LubricantParameters
from .screw import FOUR_POINT, NITRIDE, ScrewParameters, SolidParameters
from .toml import (
    ONE_LINE,
    Entry,
    FieldError,
    ParameterError,
    Problem,
    Table,
    entry,
    parsed_toml,
    read_toml,
    require,
)
from .units import COLDEST, HOTTEST, RPM, to_si

__all__ = [
    "FOUR_POINT", "FrictionTable", "Law", "LubricantParameters", "ParameterError", "Parameters", "PublishedSpeeds",
    "ScrewParameters", "SolidParameters", "changed", "graded_oil", "load_screw", "screw_of",
]  # fmt: skip

#: folder of the packaged data: the screw of the paper, its measurements, fitted sets and maps
PACKAGED_DATA = Path(__file__).parents[1] / "data"
#: the screw of the paper with the oil of the packaged mechanistic set
PACKAGED_VG100 = PACKAGED_DATA / "gd4008_vg100.toml"
#: file of the default screw, in the package's data
PACKAGED = "gd4008.toml"


class PublishedSpeeds(Table):
    """Surface speeds (u_1 raceway, u_2 ball) in the fixed frame at one screw speed."""

    reference_speed: float = entry("screw speed of the pairs below", "angular_velocity", gt=0, le=1e5)
    screw: tuple[float, float] = entry("raceway and ball at the screw contact", "velocity")
    nut: tuple[float, float] = entry("raceway and ball at the nut contact", "velocity")


#: widest ends of the range of a map: force [N], speed [rad/s], temperature [K], from where an oil has a viscosity
WIDEST_ENDS = {
    "preload": (1e-2, 1e7), "speed": (1e-3 * RPM, 1e6 * RPM), "temperature": (COLDEST, HOTTEST)
}  # fmt: skip


def _end(description: str, name: str, dimension: str) -> Any:
    low, high = WIDEST_ENDS[name]
    return entry(description, dimension, default=None, ge=low, le=high)


class MapParameters(Table):
    """Range of the map of this screw, where it is not to follow from the screw and its oil: both ends or none."""

    preload_min: float | None = _end("lowest preload", "preload", "force")
    preload_max: float | None = _end("highest preload", "preload", "force")
    speed_min: float | None = _end("lowest speed", "speed", "angular_velocity")
    speed_max: float | None = _end("highest speed", "speed", "angular_velocity")
    temperature_min: float | None = _end("lowest oil temperature", "temperature", "temperature")
    temperature_max: float | None = _end("highest oil temperature", "temperature", "temperature")

    @model_validator(mode="after")
    def _both_ends_in_order(self) -> Self:
        for name in ("preload", "speed", "temperature"):
            low, high = getattr(self, f"{name}_min"), getattr(self, f"{name}_max")
            missing = f"{name}_{'min' if low is None else 'max'}"
            require((low is None) == (high is None), missing, "a value", "a range needs both ends")
            require(low is None or low < high, f"{name}_max", f"more than {name}_min", "check both ends")
        return self


class Parameters(Table):
    """Parameters of one screw, in SI units; the sections of a screw file.

    Attributes
    ----------
    name : str
        Name of the screw.
    screw : ScrewParameters
        Geometry and elasticity.
    solid, ball : SolidParameters
        Thermal data of screw and nut, and of the balls; ball None: as solid.
    lubricant : LubricantParameters
        Oil.
    friction : FrictionTable
        Friction law and its constants.
    published_speeds : PublishedSpeeds or None
        Surface speeds of the law of the paper.
    map : MapParameters
        Range of the map, where it is stated.
    support_bearings, guide, wipers, motor, axis : table or None
        What stands around the screw in its axis, where it is stated: module parameters.axis.

    Examples
    --------
    >>> parameters = load_screw()
    >>> parameters.name, f"{1e3 * parameters.screw.lead:.0f} mm"
    ('GD4008-3', '8 mm')
    """

    name: str = Field(min_length=1, max_length=200, pattern=ONE_LINE, description="name of the screw")
    screw: ScrewParameters
    solid: SolidParameters
    ball: SolidParameters | None = Field(
        default_factory=lambda d: None if d["screw"].ball_material == "steel" else NITRIDE
    )
    lubricant: LubricantParameters
    friction: FrictionTable = FrictionTable()
    published_speeds: PublishedSpeeds | None = None
    map: MapParameters = MapParameters()
    support_bearings: SupportBearingParameters | None = None
    guide: GuideParameters | None = None
    wipers: WiperParameters | None = None
    motor: MotorParameters | None = None
    axis: AxisParameters | None = None

    @property
    def has_axis(self) -> bool:
        """Whether it has a table of what stands around the screw."""
        return any(getattr(self, table) is not None for table in AXIS_TABLES)

    @property
    def summed_balls(self) -> int:
        """Balls of one nut in the friction sums: those that carry load; ball_count by the laws of the paper."""
        paper = self.friction.law is Law.THREE_PARAMETER
        return self.screw.ball_count if paper else self.screw.loaded_ball_count

    @property
    def solids(self) -> tuple[SolidParameters, SolidParameters]:
        """Thermal data of the bodies and of the balls; without a table `ball` those of the bodies."""
        return self.solid, self.ball or self.solid

    @model_validator(mode="after")
    def _speeds_are_known(self) -> Self:
        known = self.friction.law is Law.MECHANISTIC or self.published_speeds is not None
        allowed = f"{Law.MECHANISTIC}, or a table published_speeds"
        require(known, "friction.law", allowed, "the paper prints one screw only")
        once = self.wipers is None or self.screw.seal_torque == 0.0
        require(
            once, "screw.seal_torque", "no entry with a table wipers", "both are the drag of the nut's seals"
        )
        massive = self.guide is None or self.axis is not None
        require(massive, "axis.moved_mass_kg", "a value", "the friction of a guide needs its load")
        return self


TABLES: dict[str, type[Table]] = {
    "screw": ScrewParameters,
    "solid": SolidParameters,
    "ball": SolidParameters,
    "lubricant": LubricantParameters,
    "friction": FrictionTable,
    "published_speeds": PublishedSpeeds,
    "map": MapParameters,
    **AXIS_TABLES,
}
#: keys of earlier versions, and what is to be done
GONE = {
    "friction.kinematics": 'published is now law = "three_parameter", rolling_frame is law = "mechanistic"',
    "friction.set": "it is now the entry law",
    "friction.sliding_coefficient": "remove it, it had no effect",
}
#: what pydantic expects of an entry, by the type of its error
KINDS = {"int_type": "a whole number", "float_type": "a number", "finite_number": "a finite number",
         "tuple_type": "a number, or [low, high]", "too_long": "a number, or [low, high]",
         "too_short": "a number, or [low, high]"}  # fmt: skip


def _refused(where: str, problems: Sequence[Problem]) -> ParameterError:
    """The one line of every error in a file: its first problem, and the entries of the others."""
    others = ", ".join(dict.fromkeys(one.entry for one in problems if one.entry != problems[0].entry))
    return ParameterError(f"{where}: {problems[0]}{others and f'; also wrong: {others}'}", problems)


def _nearest(word: str, known: list[str]) -> str:
    """The remedy for an unknown word."""
    return f"nearest: {', '.join(difflib.get_close_matches(word, known, n=1, cutoff=0.0))}"


def _explained(table: str, raw: dict[str, Any], error: dict[str, Any]) -> Problem:
    """An error of pydantic, bounds in the unit of the file."""
    cause = error.get("ctx", {}).get("error")
    entry = TABLES[table].entries()[cause.field if isinstance(cause, FieldError) else str(error["loc"][0])]
    key = next((key for key in entry.keys if key in raw), entry.keys[0])
    if isinstance(cause, FieldError):
        return Problem(f"{table}.{key}", raw.get(key), cause.allowed, cause.remedy)
    if error["type"] == "missing":
        allowed = f"one of {', '.join(entry.keys)}"
    else:
        bounds = [f"{bound} {entry.unit_of(key)}".rstrip() for bound in entry.bounds(key)]
        kind = [KINDS[error["type"]]] if error["type"] in KINDS else []
        allowed = ", ".join(kind + bounds) or str(error["msg"]).removeprefix("Input should be ")
    return Problem(f"{table}.{key}", raw.get(key), allowed, f"it stands for: {entry.info.description}")


def _unknown_key(table: str, key: str, value: Any) -> Problem:
    """An unknown key of a table, or a known one without its unit."""
    if (gone := GONE.get(f"{table}.{key}")) is not None:
        return Problem(f"{table}.{key}", value, "no entry", gone)
    entries = TABLES[table].entries().values()
    allowed, remedy = "a known key", _nearest(key, [name for known in entries for name in known.keys])
    for known in sorted(entries, key=lambda known: len(known.field)):
        if known.dimension and (key == known.field or key.startswith(f"{known.field}_")):
            allowed, remedy = ", ".join(known.keys), "bad unit: end the key with one of these"
    return Problem(f"{table}.{key}", value, allowed, remedy)


def _build_table(table: str, raw: dict[str, Any]) -> tuple[Table | None, list[Problem]]:
    """A table of a file, whose keys carry their unit, checked and in SI; what is wrong with it."""
    entries: dict[str, Entry] = {
        key: entry for entry in TABLES[table].entries().values() for key in entry.keys
    }
    values: dict[str, Any] = {}
    problems = []
    for key, value in raw.items():
        if (entry := entries.get(key)) is None:
            problems.append(_unknown_key(table, key, value))
        elif entry.field in values:
            problems.append(Problem(f"{table}.{key}", value, "one entry", f"{entry.field} is given twice"))
        else:
            values[entry.field] = to_si(value, entry.dimension, entry.unit_of(key))
    try:
        return TABLES[table](**values), problems
    except ValidationError as err:
        # an entry that is missing may be the one with an unknown key
        found = [dict(error) for error in err.errors() if error["type"] != "default_factory_not_called"]
        named = [_explained(table, raw, error) for error in found]
        return None, problems + [one for one in named if not (problems and one.value is None)]


def _build(where: str, content: dict[str, Any]) -> Parameters:
    known, problems = [*TABLES, "name"], []
    for name, value in content.items():
        if name not in known:
            key, shown = (f"[{name}]", "a table") if isinstance(value, dict) else (name, value)
            problems.append(Problem(key, shown, "a known table", _nearest(name, known)))
    values: dict[str, Any] = {"name": content.get("name")}
    for table in TABLES:
        raw = content.get(table)
        if raw is None and (problems or not Parameters.model_fields[table].is_required()):
            continue
        if not isinstance(raw, dict):
            problems.append(Problem(f"[{table}]", raw, "a table", f"add it: see the packaged {PACKAGED}"))
            continue
        values[table], of_table = _build_table(table, raw)
        problems += of_table
    if problems:
        raise _refused(where, problems)
    try:
        return Parameters(**values)
    except ValidationError as err:
        cause = err.errors()[0].get("ctx", {}).get("error")
        problem = Problem("name", content.get("name"), "a text in one line", "name the screw")
        if isinstance(cause, FieldError):
            table, _, field = cause.field.partition(".")
            problem = Problem(
                cause.field, getattr(values.get(table), field, None), cause.allowed, cause.remedy
            )
        raise _refused(where, [problem]) from None


def load_screw(path: Path | str | None = None) -> Parameters:
    """Read a screw file.

    Parameters
    ----------
    path : path or str, optional
        TOML file, or the name of a packaged one, gd4008.toml, gd4008_vg100.toml or example_25x10.toml, where no file
        has that name. None: the packaged screw of the paper, GD4008-3.

    Returns
    -------
    Parameters
        Checked parameters, in SI units.

    Raises
    ------
    ParameterError
        (A ValueError.) One line: file, key, value, what is allowed, remedy.

    Examples
    --------
    >>> load_screw().screw.ball_count
    86
    """
    path = Path(PACKAGED if path is None else path)
    packaged = PACKAGED_DATA / path.name
    by_name = path.parent == Path() and not path.exists() and packaged.is_file()
    return _build(str(path), read_toml(packaged if by_name else path))


def screw_of(content: str | Mapping[str, Any], name: str = "screw") -> Parameters:
    """Screw of the content of a screw file.

    Parameters
    ----------
    content : str or mapping
        TOML text, or its tables, keys with their units as in a file.
    name : str, optional
        What messages call it.

    Returns
    -------
    Parameters
        Checked parameters, in SI units.

    Raises
    ------
    ParameterError
        (A ValueError.) One line; attribute problems: each entry that is wrong, with value, what is allowed, remedy.

    Examples
    --------
    >>> try:
    ...     screw_of({"name": "my screw", "screw": {"turns": 0.0, "lead": 8.0}})
    ... except ParameterError as error:
    ...     [problem.entry for problem in error.problems][:2]
    ['screw.lead', 'screw.turns']
    """
    return _build(name, parsed_toml(content, name) if isinstance(content, str) else dict(content))


def graded_oil(iso_vg: int, viscosity_index: float, density_15c: float | None = None) -> LubricantParameters:
    """Mineral oil of an ISO viscosity grade and a viscosity index.

    Parameters
    ----------
    iso_vg : int
        Grade of ISO 3448.
    viscosity_index : float
        Index of ASTM D2270.
    density_15c : float, optional
        Density at 15 C [kg/m3]; None: that of a paraffinic oil.

    Returns
    -------
    LubricantParameters
        Oil with all laws and data.

    Raises
    ------
    ParameterError
        (A ValueError.) One line.

    Notes
    -----
    Assumptions and sources: module mineral_oil.

    Examples
    --------
    >>> oil = graded_oil(68, 95.0)
    >>> f"{oil.viscosity:.4f} Pa s at 40 C, alpha {1e9 * oil.pressure_viscosity:.1f} 1/GPa"
    '0.0590 Pa s at 40 C, alpha 23.5 1/GPa'
    """
    raw: dict[str, Any] = {"iso_vg": iso_vg, "viscosity_index": viscosity_index}
    raw["name"] = f"mineral oil ISO VG {iso_vg}, viscosity index {viscosity_index:g}"
    if density_15c is not None:
        raw["density_15c_kg_m3"] = density_15c
    result, problems = _build_table("lubricant", raw)
    if problems:
        raise _refused("oil", problems)
    assert isinstance(result, LubricantParameters)
    return result


def changed(parameters: Parameters, **tables: dict[str, Any]) -> Parameters:
    """Checked copy with some values changed; defaults that depend on them are computed again.

    Parameters
    ----------
    parameters : Parameters
        Parameters to copy.
    **tables : dict
        Values [SI] by field, of each table.

    Returns
    -------
    Parameters
        The copy.

    Raises
    ------
    pydantic.ValidationError
        (A ValueError.) A value that is not allowed.

    Examples
    --------
    >>> changed(load_screw(), lubricant={"viscosity": 0.1}).lubricant.viscosity
    0.1
    """
    data = parameters.model_dump(exclude_unset=True)
    for table, values in tables.items():
        data[table] = {**(data.get(table) or {}), **values}
    return Parameters.model_validate(data)
