"""Optional tables of a screw file: what stands around the screw in an axis, by the numbers that catalogues print.

A number of which catalogues state two ends, or none, is a range: [low, high] in the file, or one number. One number has
the spread that the part is known to: applications.axis. None of these tables changes a map.
"""

import math
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, model_validator

from .toml import Table, entry, require


def _pair(value: Any) -> Any:
    """One number as both ends of a range; a list, as of JSON, as a tuple."""
    single = isinstance(value, int | float) and not isinstance(value, bool)
    return (float(value), float(value)) if single else tuple(value) if isinstance(value, list) else value


#: low and high end; equal: one number is stated
Range = Annotated[tuple[float, float], BeforeValidator(_pair)]


def _ends_in_order(table: Table, field: str, most: float) -> None:
    low, high = getattr(table, field)
    allowed = "a number, or [low, high] with low <= high"
    require(
        0.0 <= low <= high <= most, field, f"{allowed}, 0 to {most:g} (SI)", "check both ends and the unit"
    )


class SupportBearingParameters(Table):
    """Fixed bearing of the screw: a pair of angular-contact ball bearings, or one with two rows, under preload."""

    bore: float = entry("bore", "length", gt=0, le=1)
    outer_diameter: float = entry("outer diameter, without a flange", "length", gt=0, le=2)
    pitch_diameter: float | None = entry(
        "of the ball centres, if printed", "length", default=None, gt=0, le=2
    )
    ball_diameter: float | None = entry("ball, if printed", "length", default=None, gt=0, le=0.2)
    balls: int | None = entry("balls of one row, if printed", default=None, ge=4, le=200)
    contact_angle: float = entry(
        "contact angle", "angle", default=math.radians(60.0), ge=math.radians(10.0), le=0.5 * math.pi
    )
    dynamic_rating: float | None = entry(
        "axial C_a of one row as printed", "force", default=None, gt=0, le=1e8
    )
    axial_stiffness: float | None = entry(
        "axial stiffness of the pair under its preload", "stiffness", default=None, gt=1e6, le=1e11
    )
    preload: float | None = entry(
        "preload, if printed; default: by the stiffness", "force", default=None, gt=0, le=1e7
    )
    friction_torque: Range | None = entry(
        "friction torque of the pair as printed, with its seals", "torque", default=None
    )
    seals: Literal["none", "contact"] = entry("shields count as none", default="none")

    @model_validator(mode="after")
    def _is_a_bearing(self) -> Self:
        thick = self.bore < self.outer_diameter
        require(thick, "outer_diameter", "more than the bore", "check both")
        section = 0.5 * (self.outer_diameter - self.bore)
        if self.pitch_diameter is not None:
            inside = self.bore < self.pitch_diameter < self.outer_diameter
            require(inside, "pitch_diameter", "between bore and outer diameter", "check all three")
        if self.ball_diameter is not None:
            thin = self.ball_diameter < section
            require(thin, "ball_diameter", f"less than the rings, {1e3 * section:.4g} mm", "check all three")
        stated = self.preload is not None or self.axial_stiffness is not None
        require(stated, "preload", "a value, or axial_stiffness", "the torque follows from one of them")
        if self.friction_torque is not None:
            _ends_in_order(self, "friction_torque", 1e3)
            require(self.friction_torque[0] > 0.0, "friction_torque", "> 0", "omit it if it is not printed")
        return self


class GuideParameters(Table):
    """Guide of the table: carriages on rails, with seals, rolling friction and a cover."""

    carriages: int = entry("carriages of all rails", default=4, ge=1, le=100)
    seal_resistance: Range = entry("resistance of the seals of one carriage", "force")
    friction_coefficient: Range = entry(
        "rolling friction over normal force, without seals", default=(0.002, 0.003)
    )
    preload: float = entry("preload of one carriage", "force", default=0.0, ge=0, le=1e7)
    cover_force: Range = entry("resistance of a telescopic cover or bellows", "force", default=(0.0, 0.0))
    viscous: float = entry("viscous friction of all carriages", "damping", default=0.0, ge=0, le=1e6)

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        for field, most in (("seal_resistance", 1e5), ("friction_coefficient", 1.0), ("cover_force", 1e6)):
            _ends_in_order(self, field, most)
        return self


class WiperParameters(Table):
    """Wipers of the nut, in place of seal_torque of the table screw."""

    friction_torque: Range = entry("drag of all wipers of the nut", "torque")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        _ends_in_order(self, "friction_torque", 1e3)
        return self


class MotorParameters(Table):
    """Motor with its coupling."""

    friction_torque: Range = entry(
        "friction of bearings, seal and brake of the motor, at its shaft", "torque", default=(0.0, 0.0)
    )
    inertia: float | None = entry(
        "inertia of rotor, brake and coupling, at its shaft", "inertia", default=None, gt=0, le=1e3
    )
    ratio: float = entry("turns of the motor for one of the screw", default=1.0, gt=0, le=1e3)

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        _ends_in_order(self, "friction_torque", 1e3)
        return self


class AxisParameters(Table):
    """Mass, place and length of the axis."""

    drive: Literal["rotating_screw"] = entry(
        "what turns; a rotating nut, a belt, a rack and a gantry of two screws are not modelled",
        default="rotating_screw",
    )
    moved_mass: float = entry("table with its load", "mass", gt=0, le=1e6)
    inclination: float = entry(
        "of the axis, 90 deg: vertical; above 0 the weight acts on the nut as an axial load > 0",
        "angle",
        default=0.0,
        ge=-0.5 * math.pi,
        le=0.5 * math.pi,
    )
    stroke: float | None = entry("travel of the table", "length", default=None, gt=0, le=100)
    free_length: float | None = entry(
        "screw between the fixed bearing and the nut at the near end of the stroke", "length", default=None, ge=0,
        le=100,
    )  # fmt: skip


#: by name of the table
AXIS_TABLES: dict[str, type[Table]] = {
    "support_bearings": SupportBearingParameters,
    "guide": GuideParameters,
    "wipers": WiperParameters,
    "motor": MotorParameters,
    "axis": AxisParameters,
}
