"""Identity of the parameters that a map depends on: canonical text and its hash."""

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

from .file import TABLES, Law, ParameterError, Parameters
from .template import entry_of

#: friction parameters that the map does not depend on
NOT_IN_MAP = (
    "sliding_coefficient",
    "apparent_viscosity_ratio",
    "net_sliding_coefficient",
    "roughness_height",
    "raceway_rq",
    "ball_rq",
    # of the mechanistic law: the map is summed anew where they differ from its header
    "limiting_shear_coefficient",
    "boundary_friction",
    "asperity_film_ratio",
    "ball_thrust",
    "supply_length",
    "replenishment_constant",
)
#: other ways to give parameters; the values that follow from them are part of the identity instead. seal_torque is no
#: part of a map, which takes it when it is read. Films do not depend on the Eyring stress
GIVEN_BY = {
    "lubricant": ("iso_vg", "viscosity_index", "density_15c", "nlgi", "rheology", "eyring_stress"),
    "screw": ("return_ball_count", "dynamic_rating", "ball_material", "seal_torque"),
}
#: key of the header of a map
SCREW_FILE = "screw_file"
#: fields added after the first maps; they enter only where they differ from this
LATER = {"screw": {"preload_kind": "double_nut"}}
#: fields that enter only where they differ from the one whose value is their default
BESIDE = {"ball_youngs_modulus": "youngs_modulus", "ball_poisson_ratio": "poisson_ratio"}
#: fields by which screws and oils are told apart first; most that a message names
FIRST, NAMED = ("lead", "ball_diameter", "nominal_radius", "viscosity"), 3
#: relative difference of parameters that conversion of units makes
ROUNDING = 1e-12


def map_parameters_json(parameters: Parameters) -> str:
    """Canonical text of the parameters that a map depends on, and of the names of its screw and oil.

    A field of LATER enters only where it differs from the value that all earlier screws had, a field of GIVEN_BY never.
    So every map stays valid for its screw.
    """
    content = parameters.model_dump(mode="json")
    # the range of a map is in its header
    content.pop("map", None)
    content["friction"]["kinematics"] = Law(content["friction"].pop("law")).kinematics
    for name in NOT_IN_MAP:
        content["friction"].pop(name, None)
    for table, names in GIVEN_BY.items():
        for name in names:
            content[table].pop(name, None)
    for table, defaults in LATER.items():
        for name, value in defaults.items():
            if content[table][name] == value:
                del content[table][name]
    for name, other in BESIDE.items():
        if content["screw"][name] == content["screw"][other]:
            del content["screw"][name]
    if content["ball"] in (None, content["solid"]):
        del content["ball"]
    return _canonical(content)


def screw_file_json(parameters: Parameters) -> str:
    """All that a screw file has given, SI: entry SCREW_FILE of the header of a map, with the law in words of before."""
    content = parameters.model_dump(mode="json", exclude_unset=True)
    if law := content.get("friction", {}).pop("law", None):
        content["friction"] |= {"kinematics": Law(law).kinematics, "set": law}
    return json.dumps(content, sort_keys=True)


def map_parameters(header: Mapping[str, Any]) -> Parameters:
    """Parameters that a map was built for, or loaded with, from its header.

    Raises       ParameterError (a ValueError): the header carries none
    """
    if SCREW_FILE not in header:
        raise ParameterError(
            "a map of an earlier version, without its screw: give the screw file, or build it again"
        )
    return Parameters.model_validate_json(header[SCREW_FILE])


def without_names(text: str) -> dict[str, Any]:
    """The text of map_parameters_json as tables, without the names: a renamed screw or oil is the same."""
    content: dict[str, Any] = json.loads(text)
    for table in (content, content.get("lubricant", {})):
        table.pop("name", None)
    return content


def differences(theirs: str, ours: str) -> tuple[str, str] | None:
    """Two texts of map_parameters_json as screw, oil and their first differences; None: the same but for names.

    Example
                 >>> text = '{"lubricant":{"name":"VG 100"},"name":"mine","screw":{"lead":%s}}'
                 >>> differences(text % 0.008, text % 0.01)
                 ('mine with VG 100 (lead_mm = 8.0)', 'mine with VG 100 (lead_mm = 10.0)')
    """
    one, other = without_names(theirs), without_names(ours)
    tables = dict.fromkeys([*TABLES, *one, *other])
    result = [entries for table in tables for entries in _in_table(table, one.get(table), other.get(table))]
    if not result:
        return None
    texts = []
    for side, text in enumerate((theirs, ours)):
        content = json.loads(text)
        entries = ", ".join(entry[side] for entry in result[:NAMED])
        texts.append(f"{content['name']} with {content['lubricant']['name']} ({entries})")
    return texts[0], texts[1]


def _in_table(table: str, one: Any, other: Any) -> Iterator[tuple[str, str]]:
    """Fields of a table that differ, as both files have them."""
    known = TABLES[table].model_fields if table in TABLES else {}
    sides = [LATER.get(table, {}) | (content or {}) for content in (one, other)]
    for field in dict.fromkeys([*(name for name in FIRST if name in known), *known, *sides[0], *sides[1]]):
        a, b = (side.get(field) for side in sides)
        if not _same(a, b):
            pair = (entry_of(table, field, a), entry_of(table, field, b)) if field in known else ("", "")
            yield pair if pair[0] != pair[1] else (f"{field} = {a}", f"{field} = {b}")


def _same(one: Any, other: Any) -> bool:
    """Whether two parameters are equal, numbers but for rounding."""
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=ROUNDING)
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_same, one, other))
    return bool(one == other)


def parameters_hash(parameters: Parameters) -> str:
    """Start of the SHA-256 of the parameters that a map, and a fit to its films, depends on; names are none of them."""
    text = _canonical(without_names(map_parameters_json(parameters)))
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def _canonical(content: dict[str, Any]) -> str:
    return json.dumps(content, sort_keys=True, separators=(",", ":"))
