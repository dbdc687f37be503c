"""Parameters of a double-nut ball screw: read from TOML, checked once, frozen; SI, kelvin, radians.

Keys in a file carry their unit (`ball_diameter_mm`), attributes do not (`ball_diameter`, metres).
"""

from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from .oil import LubricantParameters
from .screw import (
    FOUR_POINT,
    FrictionTable,
    Law,
    MapParameters,
    Parameters,
    PublishedSpeeds,
    ScrewParameters,
    SolidParameters,
)
from .toml import (
    Entry,
    FieldError,
    MissingFieldError,
    ParameterError,
    Table,
    bounds_of,
    check_tables,
    dimension_of,
    key_forms,
    message,
    read_table,
    read_toml,
)

__all__ = [
    "FOUR_POINT", "FrictionTable", "Law", "LubricantParameters", "ParameterError", "Parameters", "PublishedSpeeds",
    "ScrewParameters", "SolidParameters", "changed", "graded_oil",
    "load_screw",
]  # fmt: skip

#: folder of the packaged data: the screw of the paper, its measurements, fitted sets and maps
PACKAGED_DATA = Path(__file__).parents[1] / "data"
#: the screw of the paper with the oil of the packaged mechanistic set
PACKAGED_VG100 = PACKAGED_DATA / "gd4008_vg100.toml"
#: file of the default screw, in the package's data
PACKAGED = "gd4008.toml"

TABLES: dict[str, type[Table]] = {
    "screw": ScrewParameters,
    "solid": SolidParameters,
    "ball": SolidParameters,
    "lubricant": LubricantParameters,
    "friction": FrictionTable,
    "published_speeds": PublishedSpeeds,
    "map": MapParameters,
}


#: keys of files of before, by table
WORDS_OF_BEFORE = {"friction": ("kinematics", "set")}


def _dimensions(table: str) -> dict[str, str | None]:
    """Dimensions of the keys of a table."""
    fields = {name: dimension_of(field) for name, field in TABLES[table].model_fields.items()}
    return fields | dict.fromkeys(WORDS_OF_BEFORE.get(table, ()))


def _allowed(field: FieldInfo, entry: Entry | None, error: dict[str, Any]) -> str:
    """What a field accepts, in the unit of the file."""
    kind = {"int_type": "a whole number", "float_type": "a number", "finite_number": "a finite number"}
    dimension, unit = (dimension_of(field), entry.unit) if entry else (None, "")
    words = [
        kind.get(error["type"], ""),
        *(f"{bound} {unit}".rstrip() for bound in bounds_of(field, dimension, unit)),
    ]
    return ", ".join(word for word in words if word) or str(error["msg"]).removeprefix("Input should be ")


def _explain(where: str, table: str, entries: dict[str, Entry], error: dict[str, Any]) -> ParameterError:
    """The first error of pydantic as one line about the file."""
    cause = error.get("ctx", {}).get("error")
    field = cause.field if isinstance(cause, FieldError) else str(error["loc"][0])
    dimensions = _dimensions(table)
    # a missing key in the unit of one of its kind
    used = {one.unit for name, one in entries.items() if dimensions[name] == dimensions[field]}
    forms = sorted(
        key_forms(field, dimensions[field]), key=lambda form: form.removeprefix(f"{field}_") not in used
    )
    entry = entries.get(field)
    key = f"{table}.{entry.key if entry else forms[0]}"
    value = entry.value if entry else None
    missing = error["type"] == "missing" or isinstance(cause, MissingFieldError)
    if isinstance(cause, FieldError) and not missing:
        return message(where, key, value, cause.allowed, cause.remedy)
    info = TABLES[table].model_fields[field]
    remedy = str(info.description)
    if missing:
        return message(where, key, None, "one of " + ", ".join(forms), f"add the key: {remedy}")
    return message(where, key, value, _allowed(info, entry, error), f"it stands for: {remedy}")


def _build_table(where: str, table: str, raw: dict[str, Any]) -> Table:
    fields, entries = read_table(where, table, raw, _dimensions(table))
    try:
        return TABLES[table](**fields)
    except ValidationError as err:
        raise _explain(where, table, entries, dict(err.errors()[0])) from None


def _build(where: str, content: dict[str, Any]) -> Parameters:
    check_tables(where, content, [*TABLES, "name"])
    values: dict[str, Any] = {}
    for table in TABLES:
        raw = content.get(table)
        if raw is None and not Parameters.model_fields[table].is_required():
            continue
        if not isinstance(raw, dict):
            raise message(where, f"[{table}]", raw, "a table", "add it: see the packaged " + PACKAGED)
        values[table] = _build_table(where, table, raw)
    try:
        return Parameters(**{"name": content.get("name"), **values})
    except ValidationError as err:
        cause = err.errors()[0].get("ctx", {}).get("error")
        if isinstance(cause, FieldError):
            law = values["friction"].law.value if "friction" in values else None
            raise message(where, cause.field, law, cause.allowed, cause.remedy) from None
        raise message(where, "name", content.get("name"), "a text", "name the screw") from None


def load_screw(path: Path | str | None = None) -> Parameters:
    """Read a screw file.

    Parameters   path : TOML file; None = the packaged screw of the paper, GD4008-3
    Returns      Parameters, SI
    Raises       ParameterError (a ValueError), one line: file, key, value, what is allowed, remedy
    Example
        >>> load_screw().screw.ball_count
        86
    """
    if path is None:
        return _build(PACKAGED, read_toml(PACKAGED_DATA / PACKAGED))
    return _build(str(path), read_toml(Path(path)))


def graded_oil(iso_vg: int, viscosity_index: float, density_15c: float | None = None) -> LubricantParameters:
    """A mineral oil by its ISO viscosity grade and viscosity index; assumptions: module mineral_oil.

    Parameters   iso_vg : grade of ISO 3448;  viscosity_index : ASTM D2270
                 density_15c : at 15 C [kg/m3]; None = that of a paraffinic oil
    Raises       ParameterError (a ValueError), one line
    Example
        >>> oil = graded_oil(68, 95.0)
        >>> f"{oil.viscosity:.4f} Pa s at 40 C, alpha {1e9 * oil.pressure_viscosity:.1f} 1/GPa"
        '0.0590 Pa s at 40 C, alpha 23.5 1/GPa'
    """
    raw: dict[str, Any] = {"iso_vg": iso_vg, "viscosity_index": viscosity_index}
    raw["name"] = f"mineral oil ISO VG {iso_vg}, viscosity index {viscosity_index:g}"
    if density_15c is not None:
        raw["density_15c_kg_m3"] = density_15c
    result = _build_table("oil", "lubricant", raw)
    assert isinstance(result, LubricantParameters)
    return result


def changed(parameters: Parameters, **tables: dict[str, Any]) -> Parameters:
    """A checked copy with some values (SI) changed; defaults that depend on them are computed again.

    Parameters   tables : table name -> field -> value
    Raises       pydantic.ValidationError (a ValueError)
    Example
        >>> changed(load_screw(), lubricant={"viscosity": 0.1}).lubricant.viscosity
        0.1
    """
    data = parameters.model_dump(exclude_unset=True)
    for table, values in tables.items():
        data[table] = {**(data.get(table) or {}), **values}
    return Parameters.model_validate(data)
