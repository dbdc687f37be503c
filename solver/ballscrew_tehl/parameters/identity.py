"""Identity of the parameters that a map depends on: canonical text and its hash."""

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any

from .file import TABLES, Law, ParameterError, Parameters
from .template import entry_of

#: parameters that are no part of the identity, by table: the range of a map, which is in its header; what follows as
#: values from the grade or the returns; the seals, which a map takes when it is read; what the friction law alone takes
#: of the oil; and the fitted numbers and the constants of the mechanistic law, for which a map is summed anew where
#: they differ from its header
NOT_IN_MAP: dict[str, Any] = {
    "map": True,
    "lubricant": {
        "iso_vg", "viscosity_index", "density_15c", "nlgi", "rheology", "eyring_stress", "temperature_tolerance",
    },
    "screw": {"return_ball_count", "dynamic_rating", "ball_material", "seal_torque"},
    "friction": {
        "law", "sliding_coefficient", "apparent_viscosity_ratio", "net_sliding_coefficient", "roughness_height",
        "raceway_rq", "ball_rq", "limiting_shear_coefficient", "boundary_friction", "asperity_film_ratio",
        "ball_thrust", "supply_length", "replenishment_constant", "neighbour_oil",
    },
}  # fmt: skip
#: key of the header of a map
SCREW_FILE = "screw_file"
#: fields added after the first maps: they enter only where they differ from this value, or from that of this field
LATER = {"preload_kind": "double_nut", "spacer_balls": False}
LATER_AS = {"ball_youngs_modulus": "youngs_modulus", "ball_poisson_ratio": "poisson_ratio"}
#: fields by which screws and oils are told apart first; most that a message names
FIRST, NAMED = ("lead", "ball_diameter", "nominal_radius", "viscosity"), 3
#: relative difference of parameters that conversion of units makes
ROUNDING = 1e-12


def map_parameters_json(parameters: Parameters) -> str:
    """Canonical text of the parameters that a map depends on, and of the names of its screw and oil.

    Fields that were added later enter only where they differ from what all earlier screws had, so that every map stays
    valid for its screw.
    """
    excluded = dict(NOT_IN_MAP)
    if parameters.ball in (None, parameters.solid):
        excluded["ball"] = True
    content = parameters.model_dump(mode="json", exclude=excluded)
    content["friction"]["kinematics"] = parameters.friction.kinematics
    screw = content["screw"]
    before = LATER | {name: screw[other] for name, other in LATER_AS.items()}
    content["screw"] = {
        key: value for key, value in screw.items() if key not in before or value != before[key]
    }
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
    one, other = _entries(theirs), _entries(ours)
    different = [place for place in one | other if not _same(one.get(place), other.get(place))]
    if not different:
        return None
    # the sizes of the screw and the viscosity first, then table by table
    tables = (*TABLES, *(table for table, _ in different))
    different.sort(key=lambda place: ((*FIRST, place[1]).index(place[1]), tables.index(place[0])))
    pairs = [_entries_of(*place, one.get(place), other.get(place)) for place in different[:NAMED]]
    texts = []
    for entries, text in zip(zip(*pairs, strict=True), (theirs, ours), strict=True):
        content = json.loads(text)
        texts.append(f"{content['name']} with {content['lubricant']['name']} ({', '.join(entries)})")
    return texts[0], texts[1]


def _entries(text: str) -> dict[tuple[str, str], Any]:
    """Values of a text of map_parameters_json by table and field."""
    content = without_names(text)
    content["screw"] = LATER | content["screw"]
    return {
        (table, field): value
        for table, entries in content.items()
        for field, value in (entries or {}).items()
    }


def _entries_of(table: str, field: str, one: Any, other: Any) -> tuple[str, str]:
    """Two values as in a screw file, to 6 digits; as they are where these are equal or only maps have the field."""
    if field in (TABLES[table].model_fields if table in TABLES else ()):
        pair = entry_of(table, field, one), entry_of(table, field, other)
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


def parameters_hash(parameters: Parameters) -> str:
    """Start of the SHA-256 of the parameters that a map, and a fit to its films, depends on; names are none of them."""
    text = _canonical(without_names(map_parameters_json(parameters)))
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def _canonical(content: dict[str, Any]) -> str:
    return json.dumps(content, sort_keys=True, separators=(",", ":"))
