"""Tables of a screw file as checked models, whose fields have a dimension; content of a TOML file."""

import tomllib
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

from .units import from_si


class FieldError(ValueError):
    """Fields of a table that contradict each other, or one that others need."""

    def __init__(self, field: str, allowed: str, remedy: str) -> None:
        super().__init__(f"{field}; allowed: {allowed}; {remedy}")
        self.field, self.allowed, self.remedy = field, allowed, remedy


def require(good: bool, field: str, allowed: str, remedy: str) -> None:
    """Raise FieldError unless a condition holds; NaN fails."""
    if not good:
        raise FieldError(field, allowed, remedy)


class ParameterError(ValueError):
    """One line: file, key, value, what is allowed, remedy."""


def quantity(dimension: str, description: str, **bounds: Any) -> Any:
    """A field with a dimension (key of UNITS), bounds in SI and an optional default."""
    return Field(json_schema_extra={"dimension": dimension}, description=description, **bounds)


class Table(BaseModel):
    """A checked, frozen, hashable table of the file."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


def dimension_of(field: FieldInfo) -> str | None:
    """Dimension of a field, a key of UNITS; None: a plain number or a word."""
    extra = field.json_schema_extra
    return str(extra["dimension"]) if isinstance(extra, dict) else None


def bounds_of(field: FieldInfo, unit: str) -> list[str]:
    """Bounds of a field in a unit, such as "> 0"."""
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    return [
        f"{sign} {from_si(getattr(rule, name), dimension_of(field), unit):.6g}"
        for rule in field.metadata
        for name, sign in signs.items()
        if hasattr(rule, name)
    ]


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
