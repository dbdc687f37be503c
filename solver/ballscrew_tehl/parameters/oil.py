"""The table of the oil: laws and numbers, or a grade and what follows from it."""

import math
from collections.abc import Callable
from typing import Any, Literal, Self

from pydantic import ValidationInfo, field_validator, model_validator

from . import mineral_oil
from .mineral_oil import T_40C, T_100C
from .toml import ONE_LINE, FieldError, Table, entry, require

#: p_r of Roelands [Pa]; ln of his reference viscosity 6.315e-5 Pa s, with changed sign
ROELANDS_PRESSURE, ROELANDS_LN = 1 / 5.1e-9, 9.67
#: viscosity [Pa s] of ISO VG 3200 at 15 C
THICKEST = 30.0
#: fields of an oil that the file must give unless it gives a grade
_BY_GRADE = (
    "viscosity_law", "density", "reference_temperature", "specific_heat", "thermal_conductivity",
    "pressure_viscosity",
)  # fmt: skip
#: fields of the two points of D341
_POINTS = "astm_viscosity_1", "astm_temperature_1", "astm_viscosity_2", "astm_temperature_2"


def _of_grade(rule: Callable[[dict[str, Any]], Any], otherwise: Any = None) -> Callable[..., Any]:
    """Default of a field: by a rule of mineral_oil if the oil is given by its grade."""
    return lambda oil: rule(oil) if _is_graded(oil) else otherwise


def _by_density(rule: Callable[[float, float], float], otherwise: float | None = None) -> Callable[..., Any]:
    """The same by a rule of density at 15 C and reference temperature."""
    return _of_grade(lambda oil: rule(oil["density_15c"], oil["reference_temperature"]), otherwise)


def _is_graded(oil: dict[str, Any]) -> bool:
    return oil["iso_vg"] is not None and oil["viscosity_index"] is not None


class LubricantParameters(Table):
    """Oil data and the names of its laws; the laws themselves are in `physics.lubricant`.

    A mineral oil may be given by iso_vg and viscosity_index: laws, densities, thermal data and pressure-viscosity
    coefficient then follow by the rules of `mineral_oil`, as far as they are not given.

    Examples
    --------
    >>> oil = LubricantParameters(name="oil", iso_vg=68, viscosity_index=95.0)
    >>> oil.viscosity_law, f"{oil.density:.0f} kg/m3"
    ('astm_d341', '868 kg/m3')
    """

    name: str = entry("name of the oil or grease", min_length=1, max_length=200, pattern=ONE_LINE)
    iso_vg: Literal[mineral_oil.ISO_GRADES] | None = entry(  # type: ignore[valid-type]
        "ISO 3448 grade of a mineral oil (VG 2 to 5: by two viscosities), with viscosity_index",
        in_map=False,
        default=None,
    )
    viscosity_index: float | None = entry(
        "its viscosity index (ASTM D2270)", in_map=False, default=None, ge=0, le=400
    )
    nlgi: Literal["000", "00", "0", "1", "2", "3"] | None = entry(
        "NLGI grade of a grease; all other values are then those of its base oil", in_map=False, default=None
    )
    density_15c: float | None = entry(
        "its density at 15 C; default: a paraffinic oil, +-2 %", "density", in_map=False, ge=600, le=1300,
        default_factory=_of_grade(lambda oil: mineral_oil.density_15c(1e-6 * oil["iso_vg"])),
    )  # fmt: skip
    viscosity_law: Literal["section_2_3", "roelands_printed", "astm_d341", "constant"] = entry(
        "how the viscosity at ambient pressure depends on temperature",
        default_factory=_of_grade(lambda oil: "astm_d341"),
    )
    pressure_law: Literal["roelands", "barus"] = entry("viscosity over pressure", default="roelands")
    density_law: Literal["dowson_higginson", "dowson_higginson_590", "incompressible"] = entry(
        "density over pressure", default="dowson_higginson"
    )
    reference_temperature: float = entry(
        "temperature of viscosity and density", "temperature", ge=200, le=500,
        default_factory=_of_grade(lambda oil: T_40C),
    )  # fmt: skip
    density: float = entry(
        "density at the reference temperature", "density", ge=500, le=2.5e3,
        default_factory=_by_density(mineral_oil.density_at),
    )  # fmt: skip
    density_temperature: float = entry(
        "relative fall of density per kelvin, >= 0", "temperature_coefficient", ge=0, le=5e-3,
        default_factory=_by_density(mineral_oil.density_slope, 6.5e-4),
    )  # fmt: skip
    specific_heat: float = entry(
        "specific heat capacity", "specific_heat", ge=700, le=5e3,
        default_factory=_by_density(mineral_oil.specific_heat),
    )  # fmt: skip
    thermal_conductivity: float = entry(
        "thermal conductivity", "thermal_conductivity", ge=0.05, le=1,
        default_factory=_by_density(mineral_oil.thermal_conductivity),
    )  # fmt: skip
    astm_viscosity_1: float | None = entry(
        "first point of D341", "kinematic_viscosity", gt=3e-7, le=0.1,
        default_factory=_of_grade(lambda oil: 1e-6 * oil["iso_vg"]),
    )  # fmt: skip
    astm_temperature_1: float | None = entry(
        "its temperature", "temperature", default_factory=_of_grade(lambda oil: T_40C), ge=200, le=500
    )
    astm_viscosity_2: float | None = entry(
        "second point of D341", "kinematic_viscosity", gt=3e-7, le=0.1,
        default_factory=_of_grade(
            lambda oil: mineral_oil.viscosity_at_100c(1e-6 * oil["iso_vg"], oil["viscosity_index"])
        ),
    )  # fmt: skip
    astm_temperature_2: float | None = entry(
        "its temperature", "temperature", default_factory=_of_grade(lambda oil: T_100C), ge=200, le=500
    )
    viscosity: float = entry(
        "viscosity at the reference temperature; follows from the two points with astm_d341", "viscosity",
        default_factory=lambda oil: _reference_viscosity(oil), gt=1e-4, le=1e3,
    )  # fmt: skip
    pressure_viscosity: float = entry(
        "alpha of Barus at the reference temperature; mineral oils: 15 to 30 1/GPa", "pressure_coefficient",
        ge=5e-9, le=8e-8,
        default_factory=_of_grade(lambda oil: _pressure_viscosity(oil)),
    )  # fmt: skip
    temperature_viscosity: float | None = entry(
        "beta of the law roelands_printed", "temperature_coefficient", default=None, gt=0, le=1
    )
    roelands_pressure: float = entry("p_r of Roelands", "pressure", default=ROELANDS_PRESSURE, ge=1e7, le=1e9)
    z_roelands: float = entry(
        "pressure exponent of Roelands; default: slope pressure_viscosity at p = 0", gt=0, le=1.5,
        default_factory=lambda oil: _z_roelands(oil),
    )  # fmt: skip
    rheology: Literal["newtonian"] = entry(
        "flow of the film in a contact; shear thinning: eyring_stress, in the friction law",
        in_map=False, default="newtonian",
    )  # fmt: skip
    temperature_tolerance: float = entry(
        "how much warmer or colder the oil may be than stated, which the interval of a torque contains",
        "temperature_difference", in_map=False, default=5.0, ge=0, le=50,
    )  # fmt: skip
    eyring_stress: float = entry(
        "Eyring stress tau_0 of the friction law", "pressure", in_map=False, default=5e6, ge=1e5, le=1e9
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
    def _law_has_its_data(self) -> Self:
        graded, stated = _is_graded(self.__dict__), self.model_fields_set
        by_points = self.viscosity_law == "astm_d341"
        if graded:
            require(by_points, "viscosity_law", '"astm_d341" or no entry with iso_vg', "remove one of them")
            for name in _POINTS:
                require(name not in stated, name, "no entry with iso_vg", "remove the points or iso_vg")
        else:
            for name, other in (("iso_vg", "viscosity_index"), ("viscosity_index", "iso_vg")):
                require(getattr(self, other) is None, name, "a value", f"{other} needs it")
            missing = self.density_15c is None
            require(missing, "density_15c", "no entry without iso_vg", "give density, or iso_vg")
            for name in _BY_GRADE:
                require(getattr(self, name) is not None, name, "a value", "add the key")
        # above, a number in mPa s was written with Pa s
        stated_one = "viscosity" in self.model_fields_set and self.reference_temperature >= T_40C - 25.0
        thick = stated_one and self.viscosity > THICKEST
        meant = f"at 15 C and above up to {THICKEST:g} Pa s: is {1e-3 * self.viscosity:.4g} Pa s meant?"
        require(not thick, "viscosity", meant, "check the unit")
        given = [getattr(self, name) is not None for name in _POINTS]
        if by_points:
            for name, good in zip(_POINTS, given, strict=True):
                require(good, name, "a value", "astm_d341 needs two points")
            source = "iso_vg and viscosity_index" if graded else "the two points of astm_d341"
            require("viscosity" not in stated, "viscosity", "no entry", f"it follows from {source}")
            falls = math.isfinite(self.viscosity)
            require(falls, "astm_viscosity_2", "below point 1 at a higher temperature", "check both points")
            slope = mineral_oil.slope_d341(*(getattr(self, name) for name in _POINTS))
            allowed = (
                f"1 to 6.5 as slope of D341 through both points, not {slope:.2g} (mineral oils 3 to 4.5)"
            )
            require(1.0 <= slope <= 6.5, "astm_viscosity_1", allowed, "check both points and their units")
            return self
        for name, bad in zip(_POINTS, given, strict=True):
            allowed = 'no entry unless viscosity_law = "astm_d341"'
            require(not bad, name, allowed, "choose that law or remove the entry")
        remedy = "give the viscosity at the reference temperature"
        require("viscosity" in stated, "viscosity", "a value", remedy)
        has_slope = self.viscosity_law != "roelands_printed" or self.temperature_viscosity is not None
        require(has_slope, "temperature_viscosity", "a value", "the law roelands_printed needs it")
        return self


def _z_roelands(oil: dict[str, Any]) -> float:
    """Z from the slope at p = 0; NaN where the slope is missing."""
    alpha = math.nan if oil["pressure_viscosity"] is None else oil["pressure_viscosity"]
    return float(alpha * oil["roelands_pressure"] / (math.log(oil["viscosity"]) + ROELANDS_LN))


def _pressure_viscosity(oil: dict[str, Any]) -> float:
    """alpha of a mineral oil at its reference temperature by Roelands' Z."""
    eta_40, eta_100 = (
        oil[f"astm_viscosity_{i}"] * mineral_oil.density_at(oil["density_15c"], oil[f"astm_temperature_{i}"])
        for i in (1, 2)
    )
    level = math.log(oil["viscosity"]) + ROELANDS_LN
    return mineral_oil.roelands_z(eta_40, eta_100) * level / ROELANDS_PRESSURE


def _reference_viscosity(oil: dict[str, Any]) -> float:
    """Dynamic viscosity of the D341 points at the reference temperature; NaN where they are not usable."""
    nu_1, T_1, nu_2, T_2 = (oil[name] for name in _POINTS)
    rho, T = oil["density"], oil["reference_temperature"]
    if None in (nu_1, T_1, nu_2, T_2, rho, T) or not (nu_1 - nu_2) * (T_2 - T_1) > 0.0:
        return math.nan
    return float(mineral_oil.kinematic_viscosity_d341(nu_1, T_1, nu_2, T_2, T) * rho)
