"""A screw file to fill in: every key with its unit, meaning and range, values of the packaged example."""

import math
import os
import tempfile
import textwrap
from collections.abc import Collection
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from .file import (
    PACKAGED_DATA,
    TABLES,
    Law,
    LubricantParameters,
    Parameters,
    ScrewParameters,
    graded_oil,
    load_screw,
)
from .toml import bounds_of, dimension_of
from .units import UNITS, from_si

EXAMPLE = "example_25x10.toml"
#: ISO grade and viscosity index of the example
EXAMPLE_GRADE = (100, 95.0)
#: NLGI grade of the example grease
EXAMPLE_NLGI: Literal["2"] = "2"
#: lubricants of a template
LUBRICANTS = ("oil", "grease")
#: units that data sheets use, by dimension; others take the first one, SI
SHEET_UNITS = {
    "length": "mm",
    "area": "mm2",
    "angle": "deg",
    "pressure": "MPa",
    "temperature": "degC",
    "kinematic_viscosity": "mm2_s",
    "pressure_coefficient": "per_GPa",
    "angular_velocity": "rpm",
    "force": "N",
}
#: fields that have another unit than others of their dimension
FIELD_UNITS = {"youngs_modulus": "GPa"}
FIELD_UNITS |= dict.fromkeys(("roughness_height", "raceway_rq", "ball_rq"), "um")
#: notes above the keys of a table
NOTES = {
    "screw": (
        "Turns and balls are those of one nut; with single_nut_offset of one half, with single_nut_oversize_ball of",
        "the whole nut, whose ball_diameter is that of the oversize balls. Balls in the return tubes carry no load.",
    ),
    "lubricant": (
        "A mineral oil in two numbers: iso_vg and viscosity_index. All others but name may be omitted; they follow by",
        "published rules (ballscrew oil; init --oil iso_vg writes that form). Or laws and numbers.",
    ),
    "grease": (
        "A grease: enter the numbers of its base oil (data sheet: ISO VG or viscosity at 40 degC, viscosity index).",
        "The film is that of the base oil. Churning and thickener are not modelled: run the grease in, then calibrate.",
    ),
    "friction": (
        "Roughness: rms of raceways and balls make the composite height; without them that of the fitted set is taken.",
    ),
    "map": (
        "Range of the map, both ends of a quantity or none. Without them: preload to the force at which a ball reaches",
        "2.1 GPa, speed to 240,000 mm r/min of the pitch circle, oil 10 to 80 degC where it has 2 mPa s to 2 Pa s.",
        "The options --preload-n, --speed-rpm, --temperature-c of map build overrule them.",
    ),
}
#: fields that an oil given by its grade must not have
FROM_GRADE = ("viscosity_law", "viscosity", "temperature_viscosity", "astm_")
_HEAD = """\
# Screw file: replace the values by those of your screw and oil; those below are of {name}.
# Every key ends with its unit, one of
#   {units}
# A key after # may be omitted and then has the value shown. Next steps:
#   ballscrew torque --screw THIS.toml --preload-n 1000 --speed-rpm 500 --temperature-c 30
#   ballscrew page --screw THIS.toml --output my.html
#   ballscrew build --screw THIS.toml --output my_fmus
"""


def example_parameters(oil: str = "viscosities", lubricant: str = "oil") -> Parameters:
    """The packaged example that the template takes its values from.

    Parameters   oil : "viscosities" = laws and numbers, "iso_vg" = grade and viscosity index
                 lubricant : "oil", or "grease" = its base oil by grade, NLGI grade
    Raises       ValueError: another word
    """
    example = load_screw(PACKAGED_DATA / EXAMPLE)
    if lubricant not in LUBRICANTS:
        raise ValueError(f"lubricant = {lubricant!r}; allowed: {', '.join(LUBRICANTS)}")
    if lubricant == "grease":
        return example.model_copy(update={"lubricant": _base_oil()})
    if oil not in ("viscosities", "iso_vg"):
        raise ValueError(f"oil = {oil!r}; allowed: viscosities, iso_vg")
    return (
        example.model_copy(update={"lubricant": graded_oil(*EXAMPLE_GRADE)}) if oil == "iso_vg" else example
    )


#: diameters of balls that are made [mm]
BALLS = (
    0.8, 1.0, 1.2, 1.588, 2.0, 2.381, 3.175, 3.969, 4.763, 5.556, 6.35, 7.144, 7.938, 9.525, 12.7, 15.875, 19.05,
)  # fmt: skip
#: ball over lead of one start and over nominal diameter, pitch circle beyond the latter over ball
BALL_OF_LEAD, BALL_OF_DIAMETER, BEYOND = 0.635, 0.2, 0.27
#: loaded turns of a nut with one start; of each start of several
USUAL_TURNS, TURNS_OF_A_START = 3.0, 1.5
USUAL_CONFORMITY = 0.53


class CatalogueSizes(NamedTuple):
    """What a catalogue page states of a screw [mm]; None: assumed."""

    diameter_mm: float
    lead_mm: float
    ball_mm: float | None = None
    turns: float | None = None
    starts: int = 1


def catalogue_parameters(sizes: CatalogueSizes, like: Parameters) -> tuple[Parameters, frozenset[str]]:
    """A screw of these sizes, the rest as of another one, and names of its fields that are assumed.

    Raises       pydantic.ValidationError (a ValueError): sizes that make no screw
    Example
        >>> found, _ = catalogue_parameters(CatalogueSizes(32.0, 10.0), example_parameters())
        >>> f"{1e3 * found.screw.ball_diameter:.3f} mm, {found.screw.ball_count} balls"
        '6.350 mm, 50 balls'
    """
    wanted = min(BALL_OF_LEAD * sizes.lead_mm / sizes.starts, BALL_OF_DIAMETER * sizes.diameter_mm)
    ball = sizes.ball_mm or min(BALLS, key=lambda d: abs(math.log(d / wanted)))
    turns = sizes.turns or (USUAL_TURNS if sizes.starts == 1 else TURNS_OF_A_START * sizes.starts)
    groove = USUAL_CONFORMITY * ball
    screw = ScrewParameters(
        preload_kind="double_nut", nominal_radius=0.5e-3 * (sizes.diameter_mm + BEYOND * ball),
        ball_diameter=1e-3 * ball, contact_angle=math.radians(45.0), screw_raceway_radius=1e-3 * groove,
        nut_raceway_radius=1e-3 * groove, lead=1e-3 * sizes.lead_mm, turns=turns,
        youngs_modulus=like.screw.youngs_modulus, poisson_ratio=like.screw.poisson_ratio,
    )  # fmt: skip
    given = {"lead"} | {
        name for name, own in (("ball_diameter", sizes.ball_mm), ("turns", sizes.turns)) if own
    }
    name = f"screw {sizes.diameter_mm:g}x{sizes.lead_mm:g}"
    return like.model_copy(update={"name": name, "screw": screw}), frozenset(screw.model_fields_set - given)


def _base_oil() -> LubricantParameters:
    grade, index = EXAMPLE_GRADE
    return LubricantParameters(
        name=f"grease NLGI {EXAMPLE_NLGI}, base oil ISO VG {grade}", iso_vg=grade, viscosity_index=index,
        nlgi=EXAMPLE_NLGI,
    )  # fmt: skip


def screw_template(parameters: Parameters, assumed: Collection[str] = ()) -> str:
    """Text of a commented screw file with these values; read again, it gives them back to 12 digits.

    Parameters   assumed : fields of the table screw that are marked so
    """
    others = ", ".join("/".join(forms) for forms in UNITS.values() if len(forms) > 1)
    units = "\n#   ".join(textwrap.wrap(others, 100))
    lines = [_HEAD.format(name=parameters.name, units=units), f'name = "{parameters.name}"']
    for table in TABLES:
        values = getattr(parameters, table)
        if values is None:
            continue
        oil = isinstance(values, LubricantParameters)
        graded = oil and values.iso_vg is not None
        notes = NOTES["grease"] if oil and values.nlgi is not None else NOTES.get(table, ())
        lines += ["", f"[{table}]", *(f"# {note}" for note in notes)]
        for field, info in type(values).model_fields.items():
            if graded and field.startswith(FROM_GRADE) and field != "viscosity_index":
                continue
            value = getattr(values, field)
            dimension = dimension_of(info)
            key, unit = _key(field, dimension)
            shown = "" if value is None else _in_file(value, dimension, unit)
            entry = f"{key} = {shown}".rstrip()
            if field not in values.model_fields_set:
                entry = f"# {entry}"
            mark = "assumed: " if table == "screw" and field in assumed else ""
            lines.append(f"{entry:<43} # {mark}{info.description}{_range(info, dimension, unit)}")
    return "\n".join(lines) + "\n"


def _key(field: str, dimension: str | None) -> tuple[str, str]:
    """Key of a field in a file, and the unit that ends it."""
    if dimension is None:
        return field, ""
    unit = FIELD_UNITS.get(field) or SHEET_UNITS.get(dimension) or next(iter(UNITS[dimension]))
    return f"{field}_{unit}", unit


def entry_of(table: str, field: str, value: Any) -> str:
    """A value [SI] as a line of a screw file, to 6 digits: lead_mm = 8.0."""
    dimension = dimension_of(TABLES[table].model_fields[field])
    key, unit = _key(field, dimension)
    return f"{key} = {'none' if value is None else _in_file(value, dimension, unit, 6)}"


def _in_file(value: Any, dimension: Any, unit: str, digits: int = 12) -> str:
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(_in_file(v, dimension, unit, digits) for v in value) + "]"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, int) and dimension is None:
        return str(value)
    text = f"{from_si(value, dimension, unit):.{digits}g}"
    return text if any(mark in text for mark in ".en") else f"{text}.0"


def _range(info: FieldInfo, dimension: str | None, unit: str) -> str:
    """Allowed values of a field, in the unit of the key."""
    words = bounds_of(info, dimension, unit)
    words += [" | ".join(str(choice) for choice in choices)] if (choices := _choices(info.annotation)) else []
    return f"; {', '.join(words)}" if words else ""


def _choices(annotation: Any) -> tuple[Any, ...]:
    """Allowed words or numbers of an annotation; empty if it allows any."""
    if annotation is Law:
        return tuple(Law)
    inside = get_args(annotation)
    if get_origin(annotation) is Literal:
        return inside
    return next((result for part in inside if (result := _choices(part))), ())


def write_template(
    path: Path | str, oil: str = "viscosities", lubricant: str = "oil", sizes: CatalogueSizes | None = None
) -> None:
    """Write the template to a file that does not exist yet.

    Parameters   oil, lubricant : as example_parameters;  sizes : of a catalogue; None = those of the example
    Raises       ValueError: the file exists, or its folder cannot be written
    """
    path = Path(path)
    parameters, assumed = example_parameters(oil, lubricant), frozenset[str]()
    if sizes is not None:
        try:
            parameters, assumed = catalogue_parameters(sizes, parameters)
        except ValidationError as err:
            shown = ", ".join(f"{name} = {value:g}" for name, value in sizes._asdict().items() if value)
            problem = err.errors()[0]
            where = "".join(f"{part}: " for part in problem["loc"])
            raise ValueError(f"{shown}: {where}{problem['msg']}: no screw has these sizes") from err
    text = screw_template(parameters, assumed)
    try:
        handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}; needs a folder that can be written") from error
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
        os.chmod(scratch, 0o644)
        # unlike a rename, a link never replaces an existing file
        os.link(scratch, path)
    except FileExistsError as error:
        raise ValueError(f"{path}: exists already; allowed: a new file; choose another name") from error
    finally:
        os.unlink(scratch)
