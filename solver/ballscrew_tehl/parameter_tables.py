"""Tables of a screw file: every field with dimension, bounds and meaning; contradictions are refused.

Attributes are SI, kelvin, radians. A field that a file leaves out takes the default stated here;
`model_fields_set` of a table tells which ones the file gave. Source of the packaged values: Zhao et al.,
Int J Adv Manuf Technol 124 (2023) 4231, Table 1; what that table does not print is called a default here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from . import oil_grade
from .oil_grade import kinematic_viscosity_d341


#: preload kind whose balls touch four flanks
FOUR_POINT = "single_nut_oversize_ball"


class FieldError(ValueError):
    """Several fields of a table do not go together."""

    def __init__(self, field: str, allowed: str, remedy: str) -> None:
        super().__init__(f"{field}; allowed: {allowed}; {remedy}")
        self.field, self.allowed, self.remedy = field, allowed, remedy


class MissingField(FieldError):
    """A field that the file must give, because nothing else in it does."""

    def __init__(self, field: str) -> None:
        super().__init__(field, "a value", "add the key")


def quantity(dimension: str, description: str, **bounds: Any) -> Any:
    """A field with a dimension (key of UNITS), bounds in SI and perhaps a default."""
    return Field(json_schema_extra={"dimension": dimension}, description=description, **bounds)


class Table(BaseModel):
    """A checked, frozen, hashable table of the file."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class ScrewParameters(Table):
    """Geometry and elasticity; section areas and spacer are not printed in Table 1: marked defaults.

    Turns and ball counts are of one set of balls that carries the preload: one nut of a double nut, one half of a
    single nut with offset lead, the whole single nut with oversize balls. What the kinds mean: module `load`.
    """

    preload_kind: Literal["double_nut", "single_nut_offset", "single_nut_oversize_ball"] = Field(
        default="double_nut", description="two nuts, one nut with offset lead, one nut with four-point balls"
    )
    nominal_radius: float = quantity("length", "radius of the ball centre helix", gt=0, le=1)
    ball_diameter: float = quantity("length", "diameter of a ball", gt=0, le=0.5)
    contact_angle: float = quantity("angle", "contact angle without load", gt=0, lt=math.pi / 2)
    screw_raceway_radius: float = quantity(
        "length", "groove radius of the screw, above the ball's", gt=0, le=0.5
    )
    nut_raceway_radius: float = quantity("length", "groove radius of the nut, above the ball's", gt=0, le=0.5)
    lead_angle: float = quantity("angle", "lead angle at the nominal radius", gt=0, lt=math.pi / 4)
    lead: float = quantity("length", "axial travel in one turn", gt=0, le=1)
    turns: float = Field(
        gt=0, le=100, description="loaded turns of one nut; of one half with single_nut_offset"
    )
    ball_count: int = Field(
        ge=2,
        le=10000,
        description="balls of these turns in the friction sums, returns included",
    )
    return_ball_count: int | None = Field(
        default=None,
        ge=0,
        le=10000,
        description="those of them in the return tubes, without load; instead of loaded_ball_count",
    )
    loaded_ball_count: int = Field(
        default_factory=lambda d: _loaded_balls(d),
        ge=2,
        le=10000,
        description="balls of one nut that carry load; for pressure, film and temperature",
    )
    youngs_modulus: float = quantity("pressure", "Young's modulus of balls, screw and nut", ge=1e9, le=1e12)
    poisson_ratio: float = Field(ge=0, lt=0.5, description="Poisson's ratio of balls, screw and nut")
    screw_section_area: float = quantity(
        "area",
        "section of the screw; default: a full rod of 0.9 nominal radii",
        default_factory=lambda d: math.pi * (0.9 * d["nominal_radius"]) ** 2,
        gt=0,
    )
    nut_section_area: float = quantity(
        "area",
        "section of the nut; default: a ring of 1.075 to 1.575 nominal radii",
        default_factory=lambda d: math.pi * (1.575**2 - 1.075**2) * d["nominal_radius"] ** 2,
        gt=0,
    )
    spacer_length: float = quantity(
        "length", "length of the spacer, or from half to half of a single nut; default: one nominal radius, one lead",
        default_factory=lambda d: d["nominal_radius" if d["preload_kind"] == "double_nut" else "lead"], ge=0,
    )  # fmt: skip
    spacer_section_area: float = quantity(
        "area", "section of the spacer; default: that of the nut",
        default_factory=lambda d: d["nut_section_area"], gt=0,
    )  # fmt: skip

    @model_validator(mode="after")
    def _fits_together(self) -> ScrewParameters:
        radius = 0.5 * self.ball_diameter
        for field in ("screw_raceway_radius", "nut_raceway_radius"):
            if not radius < getattr(self, field):
                raise FieldError(field, "more than the ball radius", "a groove must be wider than the ball")
        if not radius < self.nominal_radius:
            raise FieldError("ball_diameter", "less than twice nominal_radius", "check both sizes")
        if not abs(math.tan(self.lead_angle) * 2.0 * math.pi * self.nominal_radius / self.lead - 1.0) <= 0.02:
            angle = math.degrees(math.atan(self.lead / (2.0 * math.pi * self.nominal_radius)))
            raise FieldError(
                "lead_angle", f"{angle:.4g} deg within 2 % for this lead and radius", "check all three"
            )
        if self.return_ball_count is not None:
            carrying = self.ball_count - self.return_ball_count
            if not carrying >= 2:
                raise FieldError("return_ball_count", f"at most {self.ball_count - 2}", "two balls must carry")
            if self.loaded_ball_count != carrying:
                raise FieldError(
                    "loaded_ball_count", f"{carrying}, or no entry", "ball_count and return_ball_count say it"
                )
        most = min(self.ball_count, _touching_balls(self.__dict__))
        if not self.loaded_ball_count <= most:
            if self.return_ball_count is not None:
                least = self.ball_count - most
                raise FieldError("return_ball_count", f"at least {least}", "more balls than fit the turns")
            raise FieldError(
                "loaded_ball_count", f"at most {most}", "more balls than fit the turns or than there are"
            )
        return self


def _loaded_balls(screw: dict[str, Any]) -> int:
    """Balls outside the returns, or as many as the turns hold."""
    if screw["return_ball_count"] is not None:
        return int(screw["ball_count"] - screw["return_ball_count"])
    return min(int(screw["ball_count"]), _touching_balls(screw))


def _touching_balls(screw: dict[str, Any]) -> int:
    """Most balls that fit the turns side by side."""
    helix = screw["turns"] * 2.0 * math.pi * screw["nominal_radius"] / math.cos(screw["lead_angle"])
    return int(helix / screw["ball_diameter"])


class SolidParameters(Table):
    """Thermal data of balls, screw and nut."""

    density: float = quantity("density", "density of the steel", ge=100, le=3e4)
    specific_heat: float = quantity("specific_heat", "specific heat capacity", ge=10, le=1e4)
    thermal_conductivity: float = quantity("thermal_conductivity", "thermal conductivity", gt=0, le=1e3)


#: p_r of Roelands [Pa]
ROELANDS_PRESSURE = 1 / 5.1e-9
#: fields of an oil that the file must give unless it gives a grade
_BY_GRADE = (
    "viscosity_law",
    "density",
    "reference_temperature",
    "specific_heat",
    "thermal_conductivity",
    "pressure_viscosity",
)


def _of_grade(rule: Callable[[dict[str, Any]], Any], otherwise: Any = None) -> Callable[[dict[str, Any]], Any]:
    """Default of a field: by a rule of oil_grade if the oil is given by its grade."""
    return lambda d: rule(d) if _is_graded(d) else otherwise


def _is_graded(lub: dict[str, Any]) -> bool:
    return lub["iso_vg"] is not None and lub["viscosity_index"] is not None


class LubricantParameters(Table):
    """Oil data and the names of its laws; the laws themselves are in `lubricant`.

    A mineral oil may be given by iso_vg and viscosity_index: laws, densities, thermal data and pressure-viscosity
    coefficient then follow by the rules of `oil_grade`, as far as they are not given.
    """

    name: str = Field(min_length=1, description="name of the oil or grease")
    iso_vg: Literal[oil_grade.ISO_GRADES] | None = Field(  # type: ignore[valid-type]
        default=None,
        description="ISO 3448 grade of a mineral oil, mm2/s at 40 C +-10 %; with viscosity_index, instead of all that "
        "follows but name and rheology",
    )
    viscosity_index: float | None = Field(
        default=None, ge=0, le=400, description="viscosity index (ASTM D2270), with iso_vg"
    )
    density_15c: float | None = quantity(
        "density", "density at 15 C of an oil with iso_vg; default: a paraffinic oil, +-2 %",
        default_factory=_of_grade(lambda d: oil_grade.density_15c(1e-6 * d["iso_vg"])), ge=600, le=1300,
    )  # fmt: skip
    viscosity_law: Literal["section_2_3", "roelands_printed", "astm_d341", "constant"] = Field(
        default_factory=_of_grade(lambda d: "astm_d341"),
        description="how the viscosity at ambient pressure depends on temperature",
    )
    pressure_law: Literal["roelands", "barus"] = Field(
        default="roelands", description="viscosity over pressure"
    )
    density_law: Literal["dowson_higginson", "dowson_higginson_590", "incompressible"] = Field(
        default="dowson_higginson", description="density over pressure"
    )
    reference_temperature: float = quantity(
        "temperature", "temperature of viscosity and density",
        default_factory=_of_grade(lambda d: oil_grade.T_40C), ge=200, le=500,
    )  # fmt: skip
    density: float = quantity(
        "density", "density at the reference temperature",
        default_factory=_of_grade(lambda d: oil_grade.density_at(d["density_15c"], d["reference_temperature"])),
        ge=100, le=3e3,
    )  # fmt: skip
    density_temperature: float = quantity(
        "temperature_coefficient", "relative fall of density per kelvin, >= 0",
        default_factory=_of_grade(
            lambda d: oil_grade.density_slope(d["density_15c"], d["reference_temperature"]), 6.5e-4
        ), ge=0, le=5e-3,
    )  # fmt: skip
    specific_heat: float = quantity(
        "specific_heat", "specific heat capacity",
        default_factory=_of_grade(
            lambda d: oil_grade.specific_heat(d["density_15c"], d["reference_temperature"])
        ), ge=10, le=1e4,
    )  # fmt: skip
    thermal_conductivity: float = quantity(
        "thermal_conductivity", "thermal conductivity",
        default_factory=_of_grade(
            lambda d: oil_grade.thermal_conductivity(d["density_15c"], d["reference_temperature"])
        ), gt=0, le=1e2,
    )  # fmt: skip
    astm_viscosity_1: float | None = quantity(
        "kinematic_viscosity", "first point of D341",
        default_factory=_of_grade(lambda d: 1e-6 * d["iso_vg"]), gt=3e-7, le=1,
    )  # fmt: skip
    astm_temperature_1: float | None = quantity(
        "temperature", "its temperature", default_factory=_of_grade(lambda d: oil_grade.T_40C), ge=200, le=500
    )
    astm_viscosity_2: float | None = quantity(
        "kinematic_viscosity", "second point of D341",
        default_factory=_of_grade(lambda d: oil_grade.viscosity_at_100c(1e-6 * d["iso_vg"], d["viscosity_index"])),
        gt=3e-7, le=1,
    )  # fmt: skip
    astm_temperature_2: float | None = quantity(
        "temperature", "its temperature", default_factory=_of_grade(lambda d: oil_grade.T_100C), ge=200, le=500
    )
    viscosity: float = quantity(
        "viscosity", "viscosity at the reference temperature; follows from the two points with astm_d341",
        default_factory=lambda d: _reference_viscosity(d), gt=1e-4, le=1e3,
    )  # fmt: skip
    pressure_viscosity: float = quantity(
        "pressure_coefficient", "alpha of Barus at the reference temperature",
        default_factory=_of_grade(lambda d: _pressure_viscosity(d)), ge=1e-10, le=1e-7,
    )  # fmt: skip
    temperature_viscosity: float | None = quantity(
        "temperature_coefficient", "beta of the law roelands_printed", default=None, gt=0, le=1
    )
    roelands_pressure: float = quantity(
        "pressure", "p_r of Roelands", default=ROELANDS_PRESSURE, ge=1e7, le=1e9
    )
    z_roelands: float = Field(
        default_factory=lambda d: _z_roelands(d),
        gt=0, le=1.5,
        description="pressure exponent of Roelands; default: slope pressure_viscosity at p = 0",
    )  # fmt: skip

    rheology: Literal["newtonian", "eyring", "carreau", "limiting_shear_stress"] = Field(
        default="newtonian", description="shear thinning of the film"
    )
    eyring_stress: float = quantity("pressure", "Eyring stress tau_0", default=5e6, ge=1e5, le=1e9)
    carreau_modulus: float = quantity("pressure", "Carreau modulus G", default=7e6, ge=1e3, le=1e10)
    carreau_exponent: float = Field(default=0.5, ge=0.1, le=1.0, description="Carreau exponent n")
    limiting_stress_ambient: float = quantity(
        "pressure", "tau_00, lower bound of the limiting stress", default=5e6, ge=1e4, le=1e9
    )
    limiting_stress_slope: float = Field(
        default=0.075, ge=1e-3, le=0.5, description="Lambda, limiting stress over pressure"
    )

    @field_validator("viscosity_index")
    @classmethod
    def _index_can_be(cls, index: float | None, info: ValidationInfo) -> float | None:
        grade = info.data.get("iso_vg")
        if index is not None and grade is not None:
            try:
                oil_grade.viscosity_at_100c(1e-6 * grade, index)
            except ValueError as error:
                allowed = str(error).split("allowed: ")[1]
                raise FieldError("viscosity_index", allowed, "check grade and index") from None
        return index

    @model_validator(mode="after")
    def _law_has_its_data(self) -> LubricantParameters:
        points = ("astm_viscosity_1", "astm_temperature_1", "astm_viscosity_2", "astm_temperature_2")
        graded = _is_graded(self.__dict__)
        if not graded:
            for name, other in (("iso_vg", "viscosity_index"), ("viscosity_index", "iso_vg")):
                if getattr(self, name) is None and getattr(self, other) is not None:
                    raise FieldError(name, "a value", f"{other} needs it")
            if self.density_15c is not None:
                raise FieldError("density_15c", "no entry without iso_vg", "give density, or iso_vg")
            for name in _BY_GRADE:
                if getattr(self, name) is None:
                    raise MissingField(name)
        elif self.viscosity_law != "astm_d341":
            raise FieldError("viscosity_law", '"astm_d341" or no entry beside iso_vg', "drop one of both")
        elif twice := [name for name in points if name in self.model_fields_set]:
            raise FieldError(twice[0], "no entry beside iso_vg", "drop the points or iso_vg")
        given = [name for name in points if getattr(self, name) is not None]
        if self.viscosity_law == "astm_d341":
            for name in points:
                if name not in given:
                    raise FieldError(name, "a value", "astm_d341 needs two points")
            if "viscosity" in self.model_fields_set:
                source = "iso_vg and viscosity_index" if graded else "the two points of astm_d341"
                raise FieldError("viscosity", "no entry", f"it follows from {source}")
            if not math.isfinite(self.viscosity):
                raise FieldError(
                    "astm_viscosity_2", "below point 1 at a higher temperature", "check both points"
                )
        else:
            if given:
                raise FieldError(
                    given[0], 'no entry unless viscosity_law = "astm_d341"', "name that law or drop it"
                )
            if "viscosity" not in self.model_fields_set:
                raise FieldError("viscosity", "a value", "give the viscosity at the reference temperature")
        if self.viscosity_law == "roelands_printed" and self.temperature_viscosity is None:
            raise FieldError("temperature_viscosity", "a value", "the law roelands_printed needs it")
        return self


def _roelands_level(lub: dict[str, Any]) -> float:
    return math.log(lub["viscosity"]) + 9.67


def _z_roelands(lub: dict[str, Any]) -> float:
    """Z from the slope at p = 0; NaN where the slope is missing."""
    alpha = math.nan if lub["pressure_viscosity"] is None else lub["pressure_viscosity"]
    return float(alpha * lub["roelands_pressure"] / _roelands_level(lub))


def _pressure_viscosity(lub: dict[str, Any]) -> float:
    """alpha of a mineral oil at its reference temperature by Roelands' Z."""
    eta_40, eta_100 = (
        lub[f"astm_viscosity_{i}"] * oil_grade.density_at(lub["density_15c"], lub[f"astm_temperature_{i}"])
        for i in (1, 2)
    )
    return oil_grade.roelands_z(eta_40, eta_100) * _roelands_level(lub) / ROELANDS_PRESSURE


def _reference_viscosity(lub: dict[str, Any]) -> float:
    """Dynamic viscosity of the D341 points at the reference temperature; NaN where they are not usable."""
    nu_1, T_1 = lub["astm_viscosity_1"], lub["astm_temperature_1"]
    nu_2, T_2 = lub["astm_viscosity_2"], lub["astm_temperature_2"]
    if None in (nu_1, T_1, nu_2, T_2, lub["density"], lub["reference_temperature"]) or not (nu_1 - nu_2) * (T_2 - T_1) > 0.0:
        return math.nan
    return float(
        kinematic_viscosity_d341(nu_1, T_1, nu_2, T_2, lub["reference_temperature"]) * lub["density"]
    )


class FrictionParameters(Table):
    """Friction coefficients of Table 1, named variants and overrides of the fitted set."""

    hysteresis_coefficient: float = Field(default=0.01, ge=0, le=1, description="mu_hs of Eq. 18")
    sliding_coefficient: float = Field(
        default=0.15, ge=0, le=1, description="mu_s as printed, before the share of c"
    )
    reference_slip: float = Field(
        default=0.02, gt=0, le=2, description="slip over entrainment, rolling_frame only"
    )
    spin_split: float = Field(
        default=0.5,
        ge=0,
        le=1,
        description="share of the spin at the screw contact, rolling_frame only: 0.5 equal, 0 or 1 raceway control",
    )
    kinematics: Literal["published", "rolling_frame"] = Field(
        default="published", description="surface speeds"
    )
    set: Literal["three_parameter", "two_parameter"] = Field(
        default="three_parameter", description="fitted set"
    )
    apparent_viscosity_ratio: float | None = Field(
        default=None, gt=0, le=1e3, description="override of the set"
    )
    net_sliding_coefficient: float | None = Field(default=None, ge=0, le=1, description="override of the set")
    raceway_rq: float | None = quantity("length", "rms roughness of the raceways", default=None, ge=0, le=1e-4)
    ball_rq: float | None = quantity("length", "rms roughness of the balls", default=None, ge=0, le=1e-4)
    roughness_height: float | None = quantity(
        "length", "override of the set; default: composite of raceway_rq and ball_rq, if given",
        default_factory=lambda d: _composite_roughness(d), ge=0, le=1e-4,
    )  # fmt: skip

    @model_validator(mode="after")
    def _roughness_is_said_once(self) -> FrictionParameters:
        for name, other in (("raceway_rq", "ball_rq"), ("ball_rq", "raceway_rq")):
            if getattr(self, name) is None and getattr(self, other) is not None:
                raise FieldError(name, "a value", f"the composite with {other} needs it; 0 for a smooth surface")
        if self.raceway_rq is not None and "roughness_height" in self.model_fields_set:
            raise FieldError("roughness_height", "no entry", "it follows from raceway_rq and ball_rq")
        return self


def _composite_roughness(friction: dict[str, Any]) -> float | None:
    """rms roughness of both surfaces together [m], sqrt(Rq_1^2 + Rq_2^2); None = as the set says."""
    both = friction["raceway_rq"], friction["ball_rq"]
    return None if None in both else math.hypot(*both)


class PublishedSpeeds(Table):
    """Surface speeds (u_1 raceway, u_2 ball) in the fixed frame at one screw speed."""

    reference_speed: float = quantity("angular_velocity", "screw speed of the pairs below", gt=0, le=1e5)
    screw: tuple[float, float] = quantity("velocity", "raceway and ball at the screw contact")
    nut: tuple[float, float] = quantity("velocity", "raceway and ball at the nut contact")


class Parameters(Table):
    """All that describes one screw."""

    name: str = Field(min_length=1, description="name of the screw")
    screw: ScrewParameters
    solid: SolidParameters
    lubricant: LubricantParameters
    friction: FrictionParameters = FrictionParameters()
    published_speeds: PublishedSpeeds | None = None

    @model_validator(mode="after")
    def _speeds_are_known(self) -> Parameters:
        if self.friction.kinematics == "published" and self.published_speeds is None:
            raise FieldError(
                "friction.kinematics",
                '"rolling_frame", or a table published_speeds',
                "the paper prints one screw only",
            )
        return self
