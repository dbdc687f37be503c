"""The entries of a screw file as a table, and the change of one of them in a text that keeps its comments."""

import json
import math
import re
from enum import EnumType
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic_core import PydanticUndefined

from .axis import AXIS_TABLES
from .file import TABLES
from .toml import Entry, ParameterError, Problem, entry_text, parsed_toml

#: what each table is of, in words
GROUPS = {
    "screw": "screw and nut", "solid": "steel of screw and nut", "ball": "material of the balls",
    "lubricant": "oil or grease", "friction": "friction law", "published_speeds": "speeds of the law of the paper",
    "map": "range of the map", "support_bearings": "support bearings", "guide": "guide", "wipers": "wipers of the nut",
    "motor": "motor", "axis": "axis",
}  # fmt: skip


#: column of the comments of a template
COMMENT = 44


class ScrewEntry(NamedTuple):
    """An entry of a screw file.

    Attributes
    ----------
    table, key : str
        Table and key with its unit, as in a file.
    field : str
        The key without its unit: attribute of the table of Parameters.
    unit : str
        Unit of the key, "" of a plain number or word.
    kind : {"number", "whole", "range", "choice", "text", "switch"}
        Form of the value; range: a number, or [low, high].
    minimum, maximum : float or None
        Bounds, in the unit.
    exclusive : bool
        Whether the minimum itself is not allowed.
    choices : tuple of str
        Allowed words.
    meaning : str
        What it stands for.
    required : bool
        Whether a file needs it, or another key of the same quantity.
    default : str
        Default as in a file, "" where there is none or it follows from other entries.
    group : str
        What the table is of.
    """

    table: str
    key: str
    field: str
    unit: str
    kind: str
    minimum: float | None
    maximum: float | None
    exclusive: bool
    choices: tuple[str, ...]
    meaning: str
    required: bool
    default: str
    group: str


def screw_entries() -> tuple[ScrewEntry, ...]:
    """All entries of a screw file, in the order of its tables.

    Returns
    -------
    tuple of ScrewEntry
        Each entry under its usual unit; a file may use any other unit of the same dimension.

    Examples
    --------
    >>> lead = next(entry for entry in screw_entries() if entry.key == "lead_mm")
    >>> lead.table, lead.unit, lead.minimum, lead.maximum, lead.meaning
    ('screw', 'mm', 0.0, 1000.0, 'axial travel in one turn')
    """
    return tuple(
        _described(table, entry) for table, model in TABLES.items() for entry in model.entries().values()
    )


def _described(table: str, entry: Entry) -> ScrewEntry:
    bounds = {sign: float(number) for sign, number in (bound.split() for bound in entry.bounds(entry.key))}
    words = choices_of(entry.info.annotation)
    default, required = entry.info.default, entry.info.is_required()
    stated = default is not PydanticUndefined and default is not None
    text = entry_text(entry, default, "", 12).partition(" = ")[2] if stated else ""
    return ScrewEntry(
        table, entry.key, entry.field, entry.unit_of(entry.key), _kind(entry.info.annotation, words),
        bounds.get(">", bounds.get(">=")), bounds.get("<", bounds.get("<=")), ">" in bounds, words,
        entry.info.description or "", required and table not in AXIS_TABLES, text.strip('"'), GROUPS[table],
    )  # fmt: skip


def choices_of(annotation: Any) -> tuple[str, ...]:
    """Allowed words or numbers of an annotation; empty if it allows any."""
    if isinstance(annotation, EnumType):
        return tuple(map(str, annotation))
    if get_origin(annotation) is Literal:
        return tuple(map(str, get_args(annotation)))
    return next((words for part in get_args(annotation) if (words := choices_of(part))), ())


def _kind(annotation: Any, words: tuple[str, ...]) -> str:
    if words:
        return "choice"
    parts = {part for part in (annotation, *get_args(annotation))}
    if tuple[float, float] in parts or any(get_origin(part) is tuple for part in parts):
        return "range"
    for kind, name in ((bool, "switch"), (float, "number"), (int, "whole")):
        if kind in parts:
            return name
    return "text"


def changed_text(text: str, table: str, key: str, value: Any) -> str:
    """Text of a screw file with one entry changed; comments and all other lines stay.

    Parameters
    ----------
    text : str
        TOML of a screw file.
    table, key : str
        Table, "" for the name of the screw, and key with its unit.
    value : float, int, str, bool, list of float or None
        New value, in the unit of the key; None: the entry becomes a comment.

    Returns
    -------
    str
        The new text. It is not checked as a screw: screw_of does that.

    Raises
    ------
    ParameterError
        (A ValueError.) The text is no TOML, or the entry is not on a line of its own.

    Notes
    -----
    Another key of the same quantity, as lead_m for lead_mm, becomes a comment. A new ball_diameter takes both grooves
    with it, so that their radii over the ball stay; a groove that is changed afterwards is as it is stated.

    Examples
    --------
    >>> print(changed_text("[screw]\\nlead_mm = 8.0  # axial travel", "screw", "lead_mm", 10.0))
    [screw]
    lead_mm = 10.0 # axial travel
    """
    before = parsed_toml(text, "screw")
    # not by splitlines: TOML ends a line by these alone
    lines = re.split(r"\r?\n", text.removesuffix("\n"))
    if table and table not in TABLES:
        raise ParameterError(f"[{table}]; allowed: {', '.join(TABLES)}")
    fields = TABLES[table].entries() if table else {}
    field = next((name for name, entry in fields.items() if key in entry.keys), key)
    keys = fields[field].keys if field in fields else [key]
    stated = (before.get(table) or {}) if table else before
    for other in keys:
        if other != key and other in stated:
            _write(lines, table, other, None)
    _write(lines, table, key, value)
    if (table, field) == ("screw", "ball_diameter") and value and _ratio(stated, keys, key, value) != 1.0:
        ratio = _ratio(stated, keys, key, value)
        for groove in ("screw_raceway_radius", "nut_raceway_radius"):
            for name in fields[groove].keys:
                if isinstance(stated.get(name), float | int):
                    _write(lines, table, name, float(f"{ratio * stated[name]:.12g}"))
    result = "\n".join(lines) + "\n"
    after = parsed_toml(result, "screw")
    if ((after.get(table) or {}) if table else after).get(key) != value:
        problem = Problem(
            f"{table}.{key}", value, "an entry on a line of its own", "correct the text by hand"
        )
        raise ParameterError(f"screw: {problem}", [problem])
    return result


def _ratio(stated: dict[str, Any], keys: list[str], key: str, value: float) -> float:
    """New over old ball; 1 where the text has none in the same unit."""
    old = stated.get(key)
    return float(value) / old if isinstance(old, float | int) and old > 0.0 else 1.0


def _write(lines: list[str], table: str, key: str, value: Any) -> None:
    """Set an entry in the lines of a text, in place of itself or of its comment, else at the end of its table."""
    heads = [n for n, line in enumerate(lines) if re.match(r"\s*\[", line)]
    if table:
        pattern = rf"\s*#?\s*\[\s*{re.escape(table)}\s*\]\s*(#.*)?$"
        start = next((n for n, line in enumerate(lines) if re.match(pattern, line)), None)
        if start is None:
            lines += ["", f"[{table}]"]
            start = len(lines) - 1
        elif lines[start].lstrip().startswith("#") and value is not None:
            lines[start] = lines[start].lstrip("# ")
        stops = rf"\s*#?\s*\[\s*({'|'.join(TABLES)})\s*\]"
        end = next((n for n in range(start + 1, len(lines)) if re.match(stops, lines[n])), len(lines))
    else:
        start, end = -1, heads[0] if heads else len(lines)
    # possessive: what it has taken is not given back, so that its time is that of one pass
    value_there = r"""(?:\"[^\"]*+\"\s*+|'[^']*+'\s*+|[^#]*+)"""
    pattern = rf"\s*+(?P<off>#\s*+)?{re.escape(key)}\s*+=\s*+{value_there}(?P<rest>#.*)?$"
    found = [(n, match) for n in range(start + 1, end) if (match := re.match(pattern, lines[n]))]
    active = [(n, match) for n, match in found if not match["off"]]
    if value is None:
        for n, _ in active:
            lines[n] = f"# {lines[n].lstrip()}"
    elif found:
        n, match = (active or found)[0]
        # a stated value is no longer an assumed one
        comment = re.sub(r"# assumed, [^:]*: ", "# ", match["rest"] or "")
        place = match.start("rest") if match["rest"] and not match["off"] else COMMENT
        lines[n] = f"{f'{key} = {_toml(value)}':<{place}}{comment}".rstrip()
    else:
        while end > start + 1 and not lines[end - 1].strip():
            end -= 1
        lines.insert(end, f"{key} = {_toml(value)}")


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, float) and math.isfinite(value):
        return repr(value)
    return str(value).lower()
