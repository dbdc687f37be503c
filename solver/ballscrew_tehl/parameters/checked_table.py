"""A checked table of a screw file, and what is said when its fields do not go together."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class FieldError(ValueError):
    """Several fields of a table do not go together."""

    def __init__(self, field: str, allowed: str, remedy: str) -> None:
        super().__init__(f"{field}; allowed: {allowed}; {remedy}")
        self.field, self.allowed, self.remedy = field, allowed, remedy


class MissingFieldError(FieldError):
    """A field that the file must give, because nothing else in it does."""

    def __init__(self, field: str) -> None:
        super().__init__(field, "a value", "add the key")


def quantity(dimension: str, description: str, **bounds: Any) -> Any:
    """A field with a dimension (key of UNITS), bounds in SI and perhaps a default."""
    return Field(json_schema_extra={"dimension": dimension}, description=description, **bounds)


class Table(BaseModel):
    """A checked, frozen, hashable table of the file."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)
