"""Tables of a screw file: every field with dimension, bounds and meaning; contradictions are refused.

Attributes are SI, kelvin, radians. A field that a file leaves out takes the default stated here;
`model_fields_set` of a table tells which ones the file gave. Source of the packaged values: Zhao et al.,
Int J Adv Manuf Technol 124 (2023) 4231, Table 1; what that table does not print is called a default here.
"""

from __future__ import annotations

import math
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator


class FieldError(ValueError):
    """Several fields of a table do not go together."""

    def __init__(self, field: str, allowed: str, remedy: str) -> None:
        super().__init__(f"{field}; allowed: {allowed}; {remedy}")
        self.field, self.allowed, self.remedy = field, allowed, remedy


def quantity(dimension: str, description: str, **bounds: Any) -> Any:
    """A field with a dimension (key of UNITS), bounds in SI and perhaps a default."""
    return Field(json_schema_extra={"dimension": dimension}, description=description, **bounds)


class Table(BaseModel):
    """A checked, frozen, hashable table of the file."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class ScrewParameters(Table):
    """Geometry and elasticity; section areas and spacer are not printed in Table 1: marked defaults."""

    nominal_radius: float = quantity("length", "radius of the ball centre helix", gt=0, le=1)
    ball_diameter: float = quantity("length", "diameter of a ball", gt=0, le=0.5)
    contact_angle: float = quantity("angle", "contact angle without load", gt=0, lt=math.pi / 2)
    screw_raceway_radius: float = quantity(
        "length", "groove radius of the screw, above the ball's", gt=0, le=0.5
    )
    nut_raceway_radius: float = quantity("length", "groove radius of the nut, above the ball's", gt=0, le=0.5)
    lead_angle: float = quantity("angle", "lead angle at the nominal radius", gt=0, lt=math.pi / 4)
    lead: float = quantity("length", "axial travel in one turn", gt=0, le=1)
    turns: float = Field(gt=0, le=100, description="loaded turns of one nut")
    ball_count: int = Field(
        ge=2, le=10000, description="balls of one nut in the friction sums, returns included"
    )
    loaded_ball_count: int = Field(
        default_factory=lambda d: min(d["ball_count"], _touching_balls(d)),
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
        "length", "length of the spacer; default: one nominal radius",
        default_factory=lambda d: d["nominal_radius"], ge=0,
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
        most = min(self.ball_count, _touching_balls(self.__dict__))
        if not self.loaded_ball_count <= most:
            raise FieldError(
                "loaded_ball_count", f"at most {most}", "more balls than fit the turns or than there are"
            )
        return self


def _touching_balls(screw: dict[str, Any]) -> int:
    """Most balls that fit the turns side by side."""
    helix = screw["turns"] * 2.0 * math.pi * screw["nominal_radius"] / math.cos(screw["lead_angle"])
    return int(helix / screw["ball_diameter"])


class SolidParameters(Table):
    """Thermal data of balls, screw and nut."""

    density: float = quantity("density", "density of the steel", ge=100, le=3e4)
    specific_heat: float = quantity("specific_heat", "specific heat capacity", ge=10, le=1e4)
    thermal_conductivity: float = quantity("thermal_conductivity", "thermal conductivity", gt=0, le=1e3)


class LubricantParameters(Table):
    """Oil data and the names of its laws; the laws themselves are in `lubricant`."""

    name: str = Field(min_length=1, description="name of the oil or grease")
    viscosity_law: Literal["section_2_3", "roelands_printed", "astm_d341", "constant"] = Field(
        description="how the viscosity at ambient pressure depends on temperature"
    )
    pressure_law: Literal["roelands", "barus"] = Field(
        default="roelands", description="viscosity over pressure"
    )
    density_law: Literal["dowson_higginson", "dowson_higginson_590", "incompressible"] = Field(
        default="dowson_higginson", description="density over pressure"
    )
    density: float = quantity("density", "density at the reference temperature", ge=100, le=3e3)
    density_temperature: float = quantity(
        "temperature_coefficient", "relative fall of density per kelvin, >= 0", default=6.5e-4, ge=0, le=5e-3
    )
    reference_temperature: float = quantity(
        "temperature", "temperature of viscosity and density", ge=200, le=500
    )
    specific_heat: float = quantity("specific_heat", "specific heat capacity", ge=10, le=1e4)
    thermal_conductivity: float = quantity("thermal_conductivity", "thermal conductivity", gt=0, le=1e2)
    astm_viscosity_1: float | None = quantity(
        "kinematic_viscosity", "first point of D341", default=None, gt=3e-7, le=1
    )
    astm_temperature_1: float | None = quantity(
        "temperature", "its temperature", default=None, ge=200, le=500
    )
    astm_viscosity_2: float | None = quantity(
        "kinematic_viscosity", "second point of D341", default=None, gt=3e-7, le=1
    )
    astm_temperature_2: float | None = quantity(
        "temperature", "its temperature", default=None, ge=200, le=500
    )
    viscosity: float = quantity(
        "viscosity", "viscosity at the reference temperature; follows from the two points with astm_d341",
        default_factory=lambda d: _reference_viscosity(d), gt=1e-4, le=1e3,
    )  # fmt: skip
    pressure_viscosity: float = quantity("pressure_coefficient", "alpha of Barus", ge=1e-10, le=1e-7)
    temperature_viscosity: float | None = quantity(
        "temperature_coefficient", "beta of the law roelands_printed", default=None, gt=0, le=1
    )
    roelands_pressure: float = quantity("pressure", "p_r of Roelands", default=1 / 5.1e-9, ge=1e7, le=1e9)
    z_roelands: float = Field(
        default_factory=lambda d: d["pressure_viscosity"] * d["roelands_pressure"] / _roelands_level(d),
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

    @model_validator(mode="after")
    def _law_has_its_data(self) -> LubricantParameters:
        points = ("astm_viscosity_1", "astm_temperature_1", "astm_viscosity_2", "astm_temperature_2")
        given = [name for name in points if getattr(self, name) is not None]
        if self.viscosity_law == "astm_d341":
            for name in points:
                if name not in given:
                    raise FieldError(name, "a value", "astm_d341 needs two points")
            if "viscosity" in self.model_fields_set:
                raise FieldError("viscosity", "no entry", "it follows from the two points of astm_d341")
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


def kinematic_viscosity_d341(nu_1: float, T_1: float, nu_2: float, T_2: float, T: Any) -> Any:
    """Kinematic viscosity through two measured points.

    Parameters   nu_1, nu_2 : float [m2/s], > 0.3 mm2/s;  T_1, T_2 : float [K], different
                 T : float or array [K]
    Returns      nu : like T [m2/s]
    Validity     mineral oils above 2 mm2/s, -40 C to 150 C
    Source       ASTM D341: log10 log10(nu + 0.7) = m - n log10 T, nu in mm2/s
    Example
        >>> round(1e6 * kinematic_viscosity_d341(100e-6, 313.15, 11.1e-6, 373.15, 313.15), 9)
        100.0
    """
    y_1, y_2 = (math.log10(math.log10(1e6 * nu + 0.7)) for nu in (nu_1, nu_2))
    n = (y_1 - y_2) / math.log10(T_2 / T_1)
    return 1e-6 * (10.0 ** (10.0**y_1 * (T / T_1) ** -n) - 0.7)


def _roelands_level(lub: dict[str, Any]) -> float:
    return math.log(lub["viscosity"]) + 9.67


def _reference_viscosity(lub: dict[str, Any]) -> float:
    """Dynamic viscosity of the D341 points at the reference temperature; NaN where they are not usable."""
    nu_1, T_1 = lub["astm_viscosity_1"], lub["astm_temperature_1"]
    nu_2, T_2 = lub["astm_viscosity_2"], lub["astm_temperature_2"]
    if None in (nu_1, T_1, nu_2, T_2) or not (nu_1 - nu_2) * (T_2 - T_1) > 0.0:
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
    roughness_height: float | None = quantity("length", "override of the set", default=None, ge=0, le=1e-4)


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
