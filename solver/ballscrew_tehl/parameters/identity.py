"""Identity of the parameters that a map depends on: canonical text and its hash."""

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any

from .axis import AXIS_TABLES
from .file import TABLES, Law, ParameterError, Parameters
from .toml import entry_text

#: fields that are no part of the identity, by table: the range of a map is in its header, what only the friction law
#: takes is there as well, from which a map is summed anew where it differs, and the axis around a screw changes no map
NOT_IN_MAP: dict[str, Any] = {
    table: {name for name, entry in model.entries().items() if not entry.in_map}
    for table, model in TABLES.items()
} | dict.fromkeys(("map", *AXIS_TABLES), True)
#: fields of a screw that are part of the identity where they are not the default
UNLESS_DEFAULT = ("preload_sense", "thermal_expansion")
#: key of the header of a map
SCREW_FILE = "screw_file"
#: fields by which screws and oils are distinguished first; most that a message names
FIRST, NAMED = ("lead", "ball_diameter", "nominal_radius", "viscosity"), 3
#: relative difference of parameters that conversion of units makes
ROUNDING = 1e-12


def map_parameters_json(parameters: Parameters) -> str:
    """Canonical text of the parameters that a map depends on, and of the names of its screw and oil."""
    like_solid = parameters.ball in (None, parameters.solid)
    content = parameters.model_dump(mode="json", exclude=NOT_IN_MAP | ({"ball": True} if like_solid else {}))
    for name in UNLESS_DEFAULT:
        if content["screw"][name] == type(parameters.screw).model_fields[name].default:
            del content["screw"][name]
    return _canonical(content)


def screw_file_json(parameters: Parameters) -> str:
    """All that a screw file has given, SI: entry SCREW_FILE of the header of a map."""
    return json.dumps(parameters.model_dump(mode="json", exclude_unset=True), sort_keys=True)


def map_parameters(header: Mapping[str, Any]) -> Parameters:
    """Parameters that a map was built for, or loaded with, from its header; ParameterError without them."""
    if SCREW_FILE not in header:
        raise ParameterError("a map without its screw: give the screw file, or build it again")
    return Parameters.model_validate_json(header[SCREW_FILE])


def without_names(text: str) -> dict[str, Any]:
    """The text of map_parameters_json as tables, without names and, unless of the paper's law, ball_count."""
    content: dict[str, Any] = json.loads(text)
    for table in (content, content.get("lubricant", {})):
        table.pop("name", None)
    if content["friction"]["law"] == Law.MECHANISTIC:
        content["screw"].pop("ball_count", None)
    return content


def differences(theirs: str, ours: str) -> tuple[str, str] | None:
    """Two texts of map_parameters_json as screw, oil and their first differences; None: the same but for names."""
    one, other = _entries(theirs), _entries(ours)
    different = [place for place in one | other if not _same(one.get(place), other.get(place))]
    if not different:
        return None
    # the sizes of the screw and the viscosity first, then table by table
    tables = (*TABLES, *(table for table, _ in different))
    different.sort(key=lambda place: ((*FIRST, place[1]).index(place[1]), tables.index(place[0])))
    pairs = [_pair(*place, one.get(place), other.get(place)) for place in different[:NAMED]]
    first, second = (
        f"{content['name']} with {content['lubricant']['name']} ({', '.join(values)})"
        for content, values in zip(map(json.loads, (theirs, ours)), zip(*pairs, strict=True), strict=True)
    )
    return first, second


def _entries(text: str) -> dict[tuple[str, str], Any]:
    """Values of a text of map_parameters_json by table and field."""
    content = without_names(text)
    return {(table, name): value for table in content for name, value in (content[table] or {}).items()}


def _pair(table: str, field: str, one: Any, other: Any) -> tuple[str, str]:
    """Two values as in a screw file, to 6 digits; as they are where these are equal or only maps have the field."""
    if table in TABLES and field in TABLES[table].model_fields:
        entry = TABLES[table].entries()[field]
        pair = entry_text(entry, one), entry_text(entry, other)
        if pair[0] != pair[1]:
            return pair
    return f"{field} = {one}", f"{field} = {other}"


def _same(one: Any, other: Any) -> bool:
    """Whether two parameters are equal, numbers but for rounding."""
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=ROUNDING)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    return bool(one == other)


def parameters_hash(parameters: Parameters, oil: bool = True) -> str:
    """Start of the SHA-256 of the parameters that a map and a fit to it depend on, no names; oil: with its own."""
    content = without_names(map_parameters_json(parameters))
    content = content if oil else {table: content[table] for table in content if table != "lubricant"}
    return hashlib.sha256(_canonical(content).encode()).hexdigest()[:12]


def _canonical(content: dict[str, Any]) -> str:
    return json.dumps(content, sort_keys=True, separators=(",", ":"))
