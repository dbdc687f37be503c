"""The table of the oil: laws and numbers, or a grade and what follows from it."""

import math
from collections.abc import Callable
from typing import Any, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from . import mineral_oil
from .mineral_oil import T_40C, T_100C
from .toml import FieldError, Table, quantity, require

#: p_r of Roelands [Pa]; ln of his reference viscosity 6.315e-5 Pa s, with changed sign
ROELANDS_PRESSURE, ROELANDS_LN = 1 / 5.1e-9, 9.67
#: fields of an oil that the file must give unless it gives a grade
_BY_GRADE = (
    "viscosity_law", "density", "reference_temperature", "specific_heat", "thermal_conductivity",
    "pressure_viscosity",
)  # fmt: skip
#: fields of the two points of D341
_POINTS = "astm_viscosity_1", "astm_temperature_1", "astm_viscosity_2", "astm_temperature_2"


def _of_grade(
    rule: Callable[[dict[str, Any]], Any], otherwise: Any = None
) -> Callable[[dict[str, Any]], Any]:
    """Default of a field: by a rule of mineral_oil if the oil is given by its grade."""
    return lambda d: rule(d) if _is_graded(d) else otherwise


def _by_density(
    rule: Callable[[float, float], float], otherwise: float | None = None
) -> Callable[[dict[str, Any]], Any]:
    """The same by a rule of density at 15 C and reference temperature."""
    return _of_grade(lambda d: rule(d["density_15c"], d["reference_temperature"]), otherwise)


def _is_graded(lub: dict[str, Any]) -> bool:
    return lub["iso_vg"] is not None and lub["viscosity_index"] is not None


class LubricantParameters(Table):
    """Oil data and the names of its laws; the laws themselves are in `physics.lubricant`.

    A mineral oil may be given by iso_vg and viscosity_index: laws, densities, thermal data and pressure-viscosity
    coefficient then follow by the rules of `mineral_oil`, as far as they are not given.
    """

    name: str = Field(min_length=1, description="name of the oil or grease")
    iso_vg: Literal[mineral_oil.ISO_GRADES] | None = Field(  # type: ignore[valid-type]
        default=None, description="ISO 3448 grade of a mineral oil, with viscosity_index"
    )
    viscosity_index: float | None = Field(
        default=None, ge=0, le=400, description="its viscosity index (ASTM D2270)"
    )
    nlgi: Literal["000", "00", "0", "1", "2", "3"] | None = Field(
        default=None, description="NLGI grade of a grease; all other values are then those of its base oil"
    )
    density_15c: float | None = quantity(
        "density", "its density at 15 C; default: a paraffinic oil, +-2 %",
        default_factory=_of_grade(lambda d: mineral_oil.density_15c(1e-6 * d["iso_vg"])), ge=600, le=1300,
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
        default_factory=_of_grade(lambda d: T_40C), ge=200, le=500,
    )  # fmt: skip
    density: float = quantity(
        "density", "density at the reference temperature",
        default_factory=_by_density(mineral_oil.density_at), ge=100, le=3e3,
    )  # fmt: skip
    density_temperature: float = quantity(
        "temperature_coefficient", "relative fall of density per kelvin, >= 0",
        default_factory=_by_density(mineral_oil.density_slope, 6.5e-4), ge=0, le=5e-3,
    )  # fmt: skip
    specific_heat: float = quantity(
        "specific_heat", "specific heat capacity",
        default_factory=_by_density(mineral_oil.specific_heat), ge=10, le=1e4,
    )  # fmt: skip
    thermal_conductivity: float = quantity(
        "thermal_conductivity", "thermal conductivity",
        default_factory=_by_density(mineral_oil.thermal_conductivity), gt=0, le=1e2,
    )  # fmt: skip
    astm_viscosity_1: float | None = quantity(
        "kinematic_viscosity", "first point of D341",
        default_factory=_of_grade(lambda d: 1e-6 * d["iso_vg"]), gt=3e-7, le=1,
    )  # fmt: skip
    astm_temperature_1: float | None = quantity(
        "temperature", "its temperature", default_factory=_of_grade(lambda d: T_40C), ge=200, le=500
    )
    astm_viscosity_2: float | None = quantity(
        "kinematic_viscosity", "second point of D341",
        default_factory=_of_grade(lambda d: mineral_oil.viscosity_at_100c(1e-6 * d["iso_vg"], d["viscosity_index"])),
        gt=3e-7, le=1,
    )  # fmt: skip
    astm_temperature_2: float | None = quantity(
        "temperature", "its temperature", default_factory=_of_grade(lambda d: T_100C), ge=200, le=500
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

    rheology: Literal["newtonian"] = Field(
        default="newtonian",
        description="flow of the film in a contact; shear thinning: eyring_stress, in the friction law",
    )
    temperature_tolerance: float = quantity(
        "temperature_difference", "the oil of the contacts may be so much warmer or colder than stated: the interval",
        default=5.0, ge=0, le=50,
    )  # fmt: skip
    eyring_stress: float = quantity(
        "pressure", "Eyring stress tau_0 of the friction law", default=5e6, ge=1e5, le=1e9
    )

    @field_validator("viscosity_index")
    @classmethod
    def _index_can_be(cls, index: float | None, info: ValidationInfo) -> float | None:
        grade = info.data.get("iso_vg")
        if index is not None and grade is not None:
            try:
                mineral_oil.viscosity_at_100c(1e-6 * grade, index)
            except ValueError as error:
                allowed = str(error).split("allowed: ")[1]
                raise FieldError("viscosity_index", allowed, "check grade and index") from None
        return index

    @model_validator(mode="after")
    def _grade_or_values(self) -> Self:
        if _is_graded(self.__dict__):
            by_points = self.viscosity_law == "astm_d341"
            require(by_points, "viscosity_law", '"astm_d341" or no entry with iso_vg', "remove one of them")
            for name in _POINTS:
                once = name not in self.model_fields_set
                require(once, name, "no entry with iso_vg", "remove the points or iso_vg")
            return self
        for name, other in (("iso_vg", "viscosity_index"), ("viscosity_index", "iso_vg")):
            require(getattr(self, other) is None, name, "a value", f"{other} needs it")
        require(self.density_15c is None, "density_15c", "no entry without iso_vg", "give density, or iso_vg")
        for name in _BY_GRADE:
            require(getattr(self, name) is not None, name, "a value", "add the key")
        return self

    @model_validator(mode="after")
    def _law_has_its_data(self) -> Self:
        own_viscosity = "viscosity" in self.model_fields_set
        if self.viscosity_law == "astm_d341":
            for name in _POINTS:
                require(getattr(self, name) is not None, name, "a value", "astm_d341 needs two points")
            source = (
                "iso_vg and viscosity_index" if _is_graded(self.__dict__) else "the two points of astm_d341"
            )
            require(not own_viscosity, "viscosity", "no entry", f"it follows from {source}")
            falls = math.isfinite(self.viscosity)
            require(falls, "astm_viscosity_2", "below point 1 at a higher temperature", "check both points")
            return self
        for name in _POINTS:
            allowed = 'no entry unless viscosity_law = "astm_d341"'
            require(getattr(self, name) is None, name, allowed, "choose that law or remove the entry")
        require(own_viscosity, "viscosity", "a value", "give the viscosity at the reference temperature")
        has_slope = self.viscosity_law != "roelands_printed" or self.temperature_viscosity is not None
        require(has_slope, "temperature_viscosity", "a value", "the law roelands_printed needs it")
        return self


def _roelands_level(lub: dict[str, Any]) -> float:
    return math.log(lub["viscosity"]) + ROELANDS_LN


def _z_roelands(lub: dict[str, Any]) -> float:
    """Z from the slope at p = 0; NaN where the slope is missing."""
    alpha = math.nan if lub["pressure_viscosity"] is None else lub["pressure_viscosity"]
    return float(alpha * lub["roelands_pressure"] / _roelands_level(lub))


def _pressure_viscosity(lub: dict[str, Any]) -> float:
    """alpha of a mineral oil at its reference temperature by Roelands' Z."""
    eta_40, eta_100 = (
        lub[f"astm_viscosity_{i}"] * mineral_oil.density_at(lub["density_15c"], lub[f"astm_temperature_{i}"])
        for i in (1, 2)
    )
    return mineral_oil.roelands_z(eta_40, eta_100) * _roelands_level(lub) / ROELANDS_PRESSURE


def _reference_viscosity(lub: dict[str, Any]) -> float:
    """Dynamic viscosity of the D341 points at the reference temperature; NaN where they are not usable."""
    nu_1, T_1 = lub["astm_viscosity_1"], lub["astm_temperature_1"]
    nu_2, T_2 = lub["astm_viscosity_2"], lub["astm_temperature_2"]
    rho, T = lub["density"], lub["reference_temperature"]
    if None in (nu_1, T_1, nu_2, T_2, rho, T) or not (nu_1 - nu_2) * (T_2 - T_1) > 0.0:
        return math.nan
    return float(mineral_oil.kinematic_viscosity_d341(nu_1, T_1, nu_2, T_2, T) * rho)
