"""Tables of a screw file as checked models, each entry of the file stated once; content of a TOML file."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

from .units import UNITS, from_si

#: text without control characters and other ends of a line: names are written into comments of files
ONE_LINE = r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029]+$"

#: characters of a screw file: more is another file, over which the parser may take minutes
MOST_OF_A_FILE = 1_000_000


class FieldError(ValueError):
    """Fields of a table that contradict each other, or one that others need."""

    def __init__(self, field: str, allowed: str, remedy: str) -> None:
        super().__init__(f"{field}; allowed: {allowed}; {remedy}")
        self.field, self.allowed, self.remedy = field, allowed, remedy


def require(good: bool, field: str, allowed: str, remedy: str) -> None:
    """Raise FieldError unless a condition holds; NaN fails."""
    if not good:
        raise FieldError(field, allowed, remedy)


class Problem(NamedTuple):
    """What is wrong with one entry of a screw file.

    Attributes
    ----------
    entry : str
        Table and key, as "screw.lead_mm".
    value : object
        Value in the file, None: missing.
    allowed, remedy : str
        What is allowed, what to do.
    """

    entry: str
    value: Any
    allowed: str
    remedy: str

    def __str__(self) -> str:
        shown = "(missing)" if self.value is None else repr(self.value)
        return f"{self.entry} = {shown}; allowed: {self.allowed}; {self.remedy}"


class ParameterError(ValueError):
    """One line: file, key, value, what is allowed, remedy; problems: all that is wrong, the first is in the line."""

    def __init__(self, text: str, problems: Sequence[Problem] = ()) -> None:
        super().__init__(text)
        self.problems = tuple(problems)


class Entry(NamedTuple):
    """A field of a table as an entry of a screw file.

    dimension: of UNITS, None = a plain number or a word; unit: on data sheets, "" = the first one of the dimension
    in_map: whether maps depend on it
    """

    field: str
    info: FieldInfo
    dimension: str | None = None
    unit: str = ""
    in_map: bool = True

    @property
    def keys(self) -> list[str]:
        """Keys by which a file may give it."""
        return [f"{self.field}_{unit}" for unit in UNITS[self.dimension]] if self.dimension else [self.field]

    @property
    def key(self) -> str:
        """The key with the unit of data sheets."""
        return f"{self.field}_{self.unit}" if self.unit else self.keys[0]

    def unit_of(self, key: str) -> str:
        """Unit at the end of a key."""
        return key[len(self.field) + 1 :]

    def bounds(self, key: str) -> list[str]:
        """Bounds in the unit of a key, such as "> 0"."""
        signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
        return [
            f"{sign} {from_si(getattr(rule, name), self.dimension, self.unit_of(key)):.6g}"
            for rule in self.info.metadata
            for name, sign in signs.items()
            if hasattr(rule, name)
        ]


def entry(description: str, dimension: str | None = None, **rules: Any) -> Any:
    """A field of a table, stated once: what reader, template, messages and the hash of a map take of it.

    rules: unit and in_map of Entry; bounds and default (SI) as of pydantic.Field.
    """
    own: dict[str, Any] = {name: rules.pop(name) for name in ("unit", "in_map") if name in rules}
    return Field(description=description, json_schema_extra=own | {"dimension": dimension}, **rules)


class Table(BaseModel):
    """A checked, frozen, hashable table of the file."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def entries(cls) -> dict[str, Entry]:
        """Its entries by field."""
        return {
            name: Entry(name, info, **info.json_schema_extra)  # type: ignore[arg-type]
            for name, info in cls.model_fields.items()
        }


def read_toml(path: Path, remedy: str = "give the path of a screw file") -> dict[str, Any]:
    """Content of a TOML file; ParameterError: it cannot be read or parsed."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as err:
        raise ParameterError(f"{path}: cannot be read ({err.strerror}); {remedy}") from err
    except UnicodeDecodeError as err:
        raise ParameterError(f"{path}: is no text in UTF-8; {remedy}") from err
    return parsed_toml(text, str(path))


def parsed_toml(text: str, where: str) -> dict[str, Any]:
    """Content of TOML, with or without a byte order mark; ParameterError: it cannot be parsed."""
    if len(text) > MOST_OF_A_FILE:
        raise ParameterError(
            f"{where}: {len(text)} characters; allowed: a screw file, up to {MOST_OF_A_FILE}; give the right file"
        )
    try:
        return tomllib.loads(text.removeprefix("\ufeff"))
    except (tomllib.TOMLDecodeError, RecursionError) as err:
        raise ParameterError(f"{where}: no valid TOML ({err}); correct the file there") from err


def entry_text(entry: Entry, value: Any, none: str = "none", digits: int = 6) -> str:
    """A value [SI] as a line of a screw file: lead_mm = 8.0."""
    return f"{entry.key} = {none if value is None else _in_file(value, entry, digits)}".rstrip()


def _in_file(value: Any, entry: Entry, digits: int) -> str:
    if isinstance(value, tuple | list):
        return f"[{', '.join(_in_file(v, entry, digits) for v in value)}]"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, int) and entry.dimension is None:
        return str(value).lower()
    text = f"{from_si(value, entry.dimension, entry.unit_of(entry.key)):.{digits}g}"
    return text if any(mark in text for mark in ".en") else f"{text}.0"
