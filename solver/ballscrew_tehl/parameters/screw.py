"""Tables of a screw file: every field with dimension, bounds and meaning; contradictory entries raise.

Attributes are SI, kelvin, radians. A field that a file leaves out takes the default stated here;
`model_fields_set` of a table holds the fields that the file gave. Source of the packaged values: Zhao et al.,
Int J Adv Manuf Technol 124 (2023) 4231, Table 1; values that it does not print are marked as defaults.
"""

import math
from enum import StrEnum
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from .friction_constants import BOUNDED, bounded
from .oil import LubricantParameters
from .toml import FieldError, Table, quantity, require
from .units import COLDEST, HOTTEST, RPM

#: preload kind whose balls touch four flanks
FOUR_POINT = "single_nut_oversize_ball"
#: hot-pressed silicon nitride of bearing balls (ISO 26602): Young's modulus [Pa], Poisson's ratio
NITRIDE_MODULUS, NITRIDE_POISSON = 310e9, 0.26


def _loaded_balls(screw: dict[str, Any]) -> int:
    """Balls outside the returns, or as many as the turns hold."""
    if screw["return_ball_count"] is not None:
        return int(screw["ball_count"] - screw["return_ball_count"])
    return min(int(screw["ball_count"]), _touching_balls(screw))


def _touching_balls(screw: dict[str, Any]) -> int:
    """Largest number of touching balls in the turns, with spacer balls half of it."""
    helix = screw["turns"] * 2.0 * math.pi * screw["nominal_radius"] / math.cos(screw["lead_angle"])
    return int(helix / screw["ball_diameter"]) // (2 if screw["spacer_balls"] else 1)


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
    contact_angle: float = quantity(
        "angle", "contact angle without load", ge=math.radians(10.0), le=math.radians(80.0)
    )
    screw_raceway_radius: float = quantity("length", "groove radius of screw, above the ball's", gt=0, le=0.5)
    nut_raceway_radius: float = quantity("length", "groove radius of nut, above the ball's", gt=0, le=0.5)
    lead: float = quantity("length", "axial travel in one turn", gt=0, le=1)
    lead_angle: float = quantity(
        "angle", "lead angle at the nominal radius; default: by the lead",
        default_factory=lambda d: math.atan(d["lead"] / (2.0 * math.pi * d["nominal_radius"])),
        gt=0, lt=math.pi / 4, validate_default=True,
    )  # fmt: skip
    turns: float = Field(
        gt=0, le=100, description="loaded turns of one nut; of a half with single_nut_offset"
    )
    spacer_balls: bool = Field(
        default=False,
        description="every second ball is smaller and carries no load; ball_count is of the others",
    )
    return_ball_count: int | None = Field(
        default=None, ge=0, le=10000, description="balls in the returns; instead of loaded_ball_count"
    )
    ball_count: int = Field(
        default_factory=lambda d: _touching_balls(d) + (d["return_ball_count"] or 0),
        ge=2,
        le=10000,
        description="balls of these turns in the friction sums, returns included; default: touching balls",
    )
    loaded_ball_count: int = Field(
        default_factory=_loaded_balls, ge=2, le=10000, description="balls of one nut that carry load"
    )
    dynamic_rating: float | None = quantity(
        "force",
        "dynamic rating C_a of one nut by its catalogue; default: computed",
        default=None,
        gt=0,
        le=1e8,
    )
    youngs_modulus: float = quantity("pressure", "Young's modulus of screw and nut", ge=1e9, le=1e12)
    poisson_ratio: float = Field(ge=0, lt=0.5, description="Poisson's ratio of screw and nut")
    ball_material: Literal["steel", "silicon_nitride"] = Field(
        default="steel", description="steel: as screw and nut; silicon_nitride: hybrid"
    )
    ball_youngs_modulus: float = quantity(
        "pressure", "Young's modulus of the balls; default: by ball_material",
        default_factory=lambda d: d["youngs_modulus"] if d["ball_material"] == "steel" else NITRIDE_MODULUS,
        ge=1e9, le=1e12,
    )  # fmt: skip
    ball_poisson_ratio: float = Field(
        default_factory=lambda d: d["poisson_ratio"] if d["ball_material"] == "steel" else NITRIDE_POISSON,
        ge=0, lt=0.5, description="Poisson's ratio of the balls; default: by ball_material",
    )  # fmt: skip
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
    seal_torque: float = quantity("torque", "drag of the seals of all nuts", default=0.0, ge=0, le=1e3)

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        radius = 0.5 * self.ball_diameter
        for field in ("screw_raceway_radius", "nut_raceway_radius"):
            wide = radius < getattr(self, field)
            require(wide, field, "more than the ball radius", "a groove must be wider than the ball")
        require(
            radius < self.nominal_radius,
            "ball_diameter",
            "less than twice nominal_radius",
            "check both sizes",
        )
        tangent = self.lead / (2.0 * math.pi * self.nominal_radius)
        allowed = f"{math.degrees(math.atan(tangent)):.4g} deg within 2 % for this lead and radius"
        fits = abs(math.tan(self.lead_angle) / tangent - 1.0) <= 0.02
        require(fits, "lead_angle", allowed, "check all three")
        most, returns = min(self.ball_count, _touching_balls(self.__dict__)), self.return_ball_count
        few = self.loaded_ball_count <= most
        if returns is None:
            remedy = "more balls than fit the turns or than there are"
            require(few, "loaded_ball_count", f"at most {most}", remedy)
            return self
        carrying = self.ball_count - returns
        require(carrying >= 2, "return_ball_count", f"at most {self.ball_count - 2}", "two balls must carry")
        remedy = "it follows from ball_count and return_ball_count"
        require(self.loaded_ball_count == carrying, "loaded_ball_count", f"{carrying}, or no entry", remedy)
        least = self.ball_count - most
        require(few, "return_ball_count", f"at least {least}", "more balls than fit the turns")
        return self


class SolidParameters(Table):
    """Thermal data of screw and nut, or of the balls."""

    density: float = quantity("density", "density of the solid", ge=100, le=3e4)
    specific_heat: float = quantity("specific_heat", "specific heat capacity", ge=10, le=1e4)
    thermal_conductivity: float = quantity("thermal_conductivity", "thermal conductivity", gt=0, le=1e3)


#: thermal data of NITRIDE_MODULUS
NITRIDE = SolidParameters(density=3240.0, specific_heat=700.0, thermal_conductivity=28.0)


#: names of the surface speeds of a law in files: those that the paper prints, pure rolling
PUBLISHED, ROLLING_FRAME = "published", "rolling_frame"


class Law(StrEnum):
    """Friction law, which decides surface speeds, film and the numbers that are fitted.

    MECHANISTIC: power balance of balls that roll; THREE_PARAMETER, TWO_PARAMETER: shear of the whole film with the
    surface speeds of the paper, its film with and without heat
    """

    MECHANISTIC = "mechanistic"
    THREE_PARAMETER = "three_parameter"
    TWO_PARAMETER = "two_parameter"

    @property
    def kinematics(self) -> str:
        """Name of its surface speeds in files."""
        return ROLLING_FRAME if self is Law.MECHANISTIC else PUBLISHED

    @property
    def film_model(self) -> str:
        """Name of its film in map files."""
        # the film with heat needs the roughness height: without, the deviation from the tables of the paper is 12 %
        films = {Law.THREE_PARAMETER: "solved_thermal", Law.TWO_PARAMETER: "solved"}
        return films.get(self, self.value)

    @classmethod
    def of_kinematics(cls, kinematics: str) -> tuple["Law", ...]:
        """Laws with these surface speeds, that by default first."""
        return tuple(law for law in cls if law.kinematics == kinematics)


class FrictionTable(Table):
    """Friction law, its constants and overrides of its fitted numbers."""

    hysteresis_coefficient: float = Field(
        default=BOUNDED["hysteresis_coefficient"].value, ge=0, le=1, description="mu_hs of Eq. 18"
    )
    sliding_coefficient: float = Field(default=0.15, ge=0, le=1, description="mu_s as printed, before c")
    law: Law = Field(
        default=Law.MECHANISTIC,
        strict=False,
        description="law; the other two need the table published_speeds",
    )
    apparent_viscosity_ratio: float | None = Field(default=None, gt=0, le=1e3, description="fitted number")
    net_sliding_coefficient: float | None = Field(
        default=None, ge=0, le=1, description="fitted number, by calibrate"
    )
    raceway_rq: float | None = quantity("length", "rms roughness of raceways", default=None, ge=0, le=1e-4)
    ball_rq: float | None = quantity("length", "rms roughness of the balls", default=None, ge=0, le=1e-4)
    limiting_shear_coefficient: float = bounded("limiting_shear_coefficient", ge=1e-3, le=0.5)
    boundary_friction: float = bounded("boundary_friction", ge=1e-3, le=1)
    asperity_film_ratio: float = bounded("asperity_film_ratio", ge=0.05, le=5)
    ball_thrust: float | None = Field(
        default=None, ge=0, le=100,
        description="instead of net_sliding_coefficient, which is 2 boundary_friction limiting_shear_coefficient times "
        f"it, mechanistic only: {BOUNDED['ball_thrust'].meaning}",
    )  # fmt: skip
    neighbour_oil: float = bounded("neighbour_oil", ge=0, le=1)
    supply_length: float = bounded("supply_length", ge=2, allow_inf_nan=True)
    replenishment_constant: float = Field(
        default=0.0, ge=0, le=1e-6,
        description="K_rs of SKF, a further factor: 6e-8 grease or oil-air, 3e-8 oil bath, mechanistic only",
    )  # fmt: skip
    roughness_height: float | None = quantity(
        "length", "override of the set; default: composite of raceway_rq and ball_rq, if given",
        default_factory=lambda d: _composite_roughness(d), ge=0, le=1e-4,
    )  # fmt: skip

    @model_validator(mode="before")
    @classmethod
    def _law_in_words_of_before(cls, data: Any) -> Any:
        """Files of before name surface speeds (kinematics) and fitted numbers (set) in place of the law."""
        if not isinstance(data, dict) or not data.keys() & {"kinematics", "set"}:
            return data
        data = dict(data)
        kinematics, name = data.pop("kinematics", None), data.pop("set", None)
        known = [law.value for law in Law if kinematics in (None, law.kinematics)]
        if not known:
            raise FieldError("kinematics", f"{PUBLISHED} or {ROLLING_FRAME}", "or name the law")
        if name is not None and name not in known:
            with_it = f" with kinematics = {kinematics}" if kinematics else ""
            raise FieldError("set", " or ".join(known) + with_it, "remove this entry")
        return data | {"law": name or known[0]}

    @property
    def kinematics(self) -> str:
        """Name of the surface speeds of the law in files."""
        return self.law.kinematics

    @model_validator(mode="after")
    def _stated_once(self) -> Self:
        for name, other in (("raceway_rq", "ball_rq"), ("ball_rq", "raceway_rq")):
            both = getattr(self, name) is not None or getattr(self, other) is None
            require(both, name, "a value", f"the composite with {other} needs it; 0 for a smooth surface")
        one = self.raceway_rq is None or "roughness_height" not in self.model_fields_set
        require(one, "roughness_height", "no entry", "it follows from raceway_rq and ball_rq")
        return self


def ball_ball_coefficient(friction: FrictionTable, thrust: float | None = None) -> float:
    """2 mu_b Lambda kappa; thrust: kappa, None = that of BOUNDED."""
    kappa = BOUNDED["ball_thrust"].value if thrust is None else thrust
    return 2.0 * friction.boundary_friction * friction.limiting_shear_coefficient * kappa


def _composite_roughness(friction: dict[str, Any]) -> float | None:
    """rms roughness of both surfaces together [m], sqrt(Rq_1^2 + Rq_2^2); None = that of the set."""
    both = friction["raceway_rq"], friction["ball_rq"]
    return None if None in both else math.hypot(*both)


class PublishedSpeeds(Table):
    """Surface speeds (u_1 raceway, u_2 ball) in the fixed frame at one screw speed."""

    reference_speed: float = quantity("angular_velocity", "screw speed of the pairs below", gt=0, le=1e5)
    screw: tuple[float, float] = quantity("velocity", "raceway and ball at the screw contact")
    nut: tuple[float, float] = quantity("velocity", "raceway and ball at the nut contact")


#: widest ends of the range of a map: force [N], speed [rad/s], temperature [K], from where an oil has a viscosity
WIDEST_ENDS = {
    "preload": (1e-2, 1e7), "speed": (1e-3 * RPM, 1e6 * RPM), "temperature": (COLDEST, HOTTEST)
}  # fmt: skip


def _end(name: str, dimension: str, description: str) -> Any:
    least, most = WIDEST_ENDS[name]
    return quantity(dimension, description, default=None, ge=least, le=most)


class MapParameters(Table):
    """Range of the map of this screw, where it is not to follow from the screw and its oil: both ends or none."""

    preload_min: float | None = _end("preload", "force", "lowest preload")
    preload_max: float | None = _end("preload", "force", "highest preload")
    speed_min: float | None = _end("speed", "angular_velocity", "lowest speed")
    speed_max: float | None = _end("speed", "angular_velocity", "highest speed")
    temperature_min: float | None = _end("temperature", "temperature", "lowest oil temperature")
    temperature_max: float | None = _end("temperature", "temperature", "highest oil temperature")

    @model_validator(mode="after")
    def _both_ends_in_order(self) -> Self:
        for name in ("preload", "speed", "temperature"):
            low, high = getattr(self, f"{name}_min"), getattr(self, f"{name}_max")
            missing = f"{name}_{'min' if low is None else 'max'}"
            require((low is None) == (high is None), missing, "a value", "a range needs both ends")
            require(low is None or low < high, f"{name}_max", f"more than {name}_min", "check both ends")
        return self


class Parameters(Table):
    """Parameters of one screw."""

    name: str = Field(min_length=1, description="name of the screw")
    screw: ScrewParameters
    solid: SolidParameters
    ball: SolidParameters | None = Field(
        default_factory=lambda d: None if d["screw"].ball_material == "steel" else NITRIDE
    )
    lubricant: LubricantParameters
    friction: FrictionTable = FrictionTable()
    published_speeds: PublishedSpeeds | None = None
    map: MapParameters = MapParameters()

    @property
    def solids(self) -> tuple[SolidParameters, SolidParameters]:
        """Thermal data of the bodies and of the balls; without a table `ball` those of the bodies."""
        return self.solid, self.ball or self.solid

    @model_validator(mode="after")
    def _speeds_are_known(self) -> Self:
        if self.friction.kinematics == PUBLISHED and self.published_speeds is None:
            allowed = f"{Law.MECHANISTIC}, or a table published_speeds"
            raise FieldError("friction.law", allowed, "the paper prints one screw only")
        return self
