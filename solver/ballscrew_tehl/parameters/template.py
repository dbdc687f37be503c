"""A screw file to fill in: every key with its unit, meaning and range, values of the packaged example."""

import textwrap
from collections.abc import Mapping

from .axis import (
    AXIS_TABLES,
    AxisParameters,
    GuideParameters,
    MotorParameters,
    SupportBearingParameters,
    WiperParameters,
)
from .entries import choices_of
from .file import PACKAGED_DATA, TABLES, LubricantParameters, Parameters, graded_oil, load_screw
from .screw import SEALS, ScrewParameters
from .toml import Entry, Table, entry_text
from .units import UNITS

EXAMPLE = "example_25x10.toml"
#: ISO grade and viscosity index of the example
EXAMPLE_GRADE = (100, 95.0)
#: lubricants of a template
LUBRICANTS = ("oil", "grease")
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
    ),
}
#: fields that an oil given by its grade must not have
FROM_GRADE = ("viscosity_law", "viscosity", "temperature_viscosity", "astm_")
#: values of a template of the axis: a bearing 30TAC62B, carriages HSR35, an axis of 300 kg
AXIS_EXAMPLE = {
    "support_bearings": SupportBearingParameters(
        bore=30e-3, outer_diameter=62e-3, dynamic_rating=29.2e3, axial_stiffness=1.03e9, preload=3350.0,
        friction_torque=(0.24, 0.24),
    ),
    "guide": GuideParameters(seal_resistance=(11.8, 11.8), preload=2200.0),
    "wipers": WiperParameters(friction_torque=(0.2, 0.2)),
    "motor": MotorParameters(friction_torque=(0.1, 0.2), inertia=3e-3),
    "axis": AxisParameters(moved_mass=300.0, stroke=0.5, free_length=0.1),
}  # fmt: skip
#: above the tables of an axis that are not stated
AXIS_NOTE = """
# What stands around the screw, for the friction of the whole axis (ballscrew axis, identify, the axis FMU). The values
# are of an example: remove the # of #[table] and #key, and enter the numbers of your catalogues. A friction is one
# number, which is taken to be met within a factor of 1.5, or [low, high]. What no catalogue prints may be left out."""
_HEAD = """\
# Screw file: replace the values by those of your screw and oil; those below are of {name}.
# Every key ends with its unit, one of
#   {units}
# A key after # may be omitted and then has the value shown. Next steps:
#   ballscrew torque --screw THIS.toml --preload-n 1000 --speed-rpm 500 --temperature-c 30
#   ballscrew page --screw THIS.toml --output my.html
#   ballscrew build --screw THIS.toml --output my_fmus
"""


def example_parameters(oil: str = "viscosities", lubricant: str = "oil", iso_vg: int = 0) -> Parameters:
    """Packaged example that the template of a screw file takes its values from.

    Parameters
    ----------
    oil : {"viscosities", "iso_vg"}, optional
        Oil by laws and numbers, or by grade and viscosity index.
    lubricant : {"oil", "grease"}, optional
        Oil, or a grease: its base oil by grade, and the NLGI grade.
    iso_vg : int, optional
        Another grade; 0: that of the example.

    Returns
    -------
    Parameters
        The example.

    Examples
    --------
    >>> example_parameters("iso_vg", iso_vg=68).lubricant.iso_vg
    68
    """
    example, (grade, index) = load_screw(PACKAGED_DATA / EXAMPLE), EXAMPLE_GRADE
    if iso_vg:
        oil, grade = "iso_vg", iso_vg
    if lubricant == "grease":
        name = f"grease NLGI 2, base oil ISO VG {grade}"
        base = LubricantParameters(name=name, iso_vg=grade, viscosity_index=index, nlgi="2")
        return example.model_copy(update={"lubricant": base})
    return example.model_copy(update={"lubricant": graded_oil(grade, index)}) if oil == "iso_vg" else example


def screw_template(
    parameters: Parameters, assumed: Mapping[str, str] | None = None, axis: bool = False
) -> str:
    """Text of a commented screw file with given values.

    Parameters
    ----------
    parameters : Parameters
        Values; a file with the text gives them again, to 12 digits.
    assumed : dict of str to str, optional
        Fields of the table screw that are marked as assumed, with what each follows from.
    axis : bool, optional
        With tables of the axis that the parameters do not have, as comments.

    Returns
    -------
    str
        TOML text, with unit, meaning and range of every key.

    Examples
    --------
    >>> "ball_diameter_mm" in screw_template(example_parameters())
    True
    """
    others = ", ".join("/".join(forms) for forms in UNITS.values() if len(forms) > 1)
    units = "\n#   ".join(textwrap.wrap(others, 100))
    lines = [_HEAD.format(name=parameters.name, units=units), f'name = "{parameters.name}"']
    for table in TABLES:
        if (values := getattr(parameters, table)) is None:
            continue
        graded = isinstance(values, LubricantParameters) and values.iso_vg is not None
        notes = NOTES.get("grease" if graded and values.nlgi is not None else table, ())
        lines += ["", f"[{table}]", *(f"# {note}" for note in notes)]
        if isinstance(values, ScrewParameters):
            seals = SEALS * (2.0 * values.nominal_radius) ** 2
            lines.append(
                f"# Two seals: about {seals:.3g} N.m, 2.4e-4 times the square of the diameter in mm; none if omitted."
            )
        for field, entry in values.entries().items():
            if graded and field.startswith(FROM_GRADE) and field != "viscosity_index":
                continue
            reason = (assumed or {}).get(field, "") if table == "screw" else ""
            mark = f"assumed, {reason}: " if reason else ""
            lines.append(_line(values, field, entry, mark))
    stated = {table for table in AXIS_TABLES if getattr(parameters, table) is not None}
    if axis and stated != {*AXIS_TABLES}:
        lines.append(AXIS_NOTE)
        for table in (name for name in AXIS_TABLES if name not in stated):
            values = AXIS_EXAMPLE[table]
            lines += ["", f"#[{table}]", *(f"# {note}" for note in NOTES.get(table, ()))]
            rows = (_line(values, field, entry) for field, entry in values.entries().items())
            lines += [row if row.startswith("#") else f"#{row}" for row in rows]
    return "\n".join(lines) + "\n"


def _line(values: Table, field: str, entry: Entry, mark: str = "") -> str:
    """An entry with its meaning and range; as a comment where it has its default."""
    value = getattr(values, field)
    if isinstance(values, tuple(AXIS_TABLES.values())) and isinstance(value, tuple) and value[0] == value[1]:
        value = value[0]
    text = entry_text(entry, value, "", 12)
    if field not in values.model_fields_set:
        text = f"# {text}"
    words = " | ".join(choices_of(entry.info.annotation))
    allowed = ", ".join([*entry.bounds(entry.key), words] if words else entry.bounds(entry.key))
    return f"{text:<43} # {mark}{entry.info.description}{allowed and f'; {allowed}'}"
