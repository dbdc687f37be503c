"""TOML tables whose keys carry their unit (`ball_diameter_mm`), turned into SI values; one-line errors."""

import difflib
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

from .units import UNITS, from_si, to_si


class FieldError(ValueError):
    """Fields of a table that contradict each other."""

    def __init__(self, field: str, allowed: str, remedy: str) -> None:
        super().__init__(f"{field}; allowed: {allowed}; {remedy}")
        self.field, self.allowed, self.remedy = field, allowed, remedy


class MissingFieldError(FieldError):
    """A required field that is missing."""

    def __init__(self, field: str) -> None:
        super().__init__(field, "a value", "add the key")


def quantity(dimension: str, description: str, **bounds: Any) -> Any:
    """A field with a dimension (key of UNITS), bounds in SI and an optional default."""
    return Field(json_schema_extra={"dimension": dimension}, description=description, **bounds)


class Table(BaseModel):
    """A checked, frozen, hashable table of the file."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class ParameterError(ValueError):
    """One line: file, key, value, what is allowed, remedy."""


@dataclass(frozen=True)
class Entry:
    """Key and value as written in the file, for messages."""

    key: str
    value: Any
    unit: str


def dimension_of(field: FieldInfo) -> str | None:
    """Dimension of a field, a key of UNITS; None: a plain number or a word."""
    extra = field.json_schema_extra
    return str(extra["dimension"]) if isinstance(extra, dict) else None


def bounds_of(field: FieldInfo, dimension: str | None, unit: str) -> list[str]:
    """Bounds of a field in a unit, such as "> 0"."""
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    return [
        f"{sign} {from_si(getattr(rule, name), dimension, unit):.6g}"
        for rule in field.metadata
        for name, sign in signs.items()
        if hasattr(rule, name)
    ]


def key_forms(field: str, dimension: str | None) -> list[str]:
    """Keys by which a field may be given."""
    return [field] if dimension is None else [f"{field}_{unit}" for unit in UNITS[dimension]]


def message(where: str, key: str, value: Any, allowed: str, remedy: str) -> ParameterError:
    """The one line of every error in a file."""
    shown = "(missing)" if value is None else repr(value)
    return ParameterError(f"{where}: {key} = {shown}; allowed: {allowed}; {remedy}")


def _nearest(word: str, known: list[str]) -> str:
    close = difflib.get_close_matches(word, known, n=1, cutoff=0.0)
    return close[0] if close else ""


def read_toml(path: Path, remedy: str = "give the path of a screw file") -> dict[str, Any]:
    """Content of a TOML file.

    Raises       ParameterError: it cannot be read or parsed
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as err:
        raise ParameterError(f"{path}: cannot be read ({err.strerror}); {remedy}") from err
    except UnicodeDecodeError as err:
        raise ParameterError(f"{path}: is no text in UTF-8; {remedy}") from err
    except tomllib.TOMLDecodeError as err:
        raise ParameterError(f"{path}: no valid TOML ({err}); correct the file there") from err


def check_tables(where: str, content: dict[str, Any], known: list[str]) -> None:
    """Refuse an unknown table and name the nearest known one."""
    for name, value in content.items():
        if name not in known:
            key = f"[{name}]" if isinstance(value, dict) else name
            shown = "a table" if isinstance(value, dict) else value
            raise message(where, key, shown, "a known table", f"nearest: {_nearest(name, known)}")


def read_table(
    where: str, table: str, raw: dict[str, Any], dimensions: dict[str, str | None]
) -> tuple[dict[str, Any], dict[str, Entry]]:
    """Fields in SI and, per field, the entry as written.

    Parameters   raw : the TOML table; dimensions : field -> dimension (None = a plain number or a word)
    Raises       ParameterError: unknown key, unit missing or not of the dimension, a field given twice
    """
    forms = {form: field for field, dim in dimensions.items() for form in key_forms(field, dim)}
    values: dict[str, Any] = {}
    entries: dict[str, Entry] = {}
    for key, value in raw.items():
        field = forms.get(key)
        if field is None:
            owner = max((f for f in dimensions if key == f or key.startswith(f + "_")), key=len, default=None)
            if owner is not None and dimensions[owner] is not None:
                allowed = ", ".join(key_forms(owner, dimensions[owner]))
                raise message(
                    where, f"{table}.{key}", value, allowed, "bad unit: end the key with one of these"
                )
            raise message(
                where, f"{table}.{key}", value, "a known key", f"nearest: {_nearest(key, list(forms))}"
            )
        if field in values:
            raise message(
                where, f"{table}.{key}", value, "one entry", f"{entries[field].key} is given as well"
            )
        unit = key[len(field) + 1 :]
        values[field] = to_si(value, dimensions[field], unit)
        entries[field] = Entry(key, value, unit)
    return values, entries
