"""Tables of a screw file: every field with dimension, bounds and meaning; contradictory entries raise.

Attributes are SI, kelvin, radians. A field that a file leaves out takes the default stated here;
`model_fields_set` of a table holds the fields that the file gave. Source of the packaged values: Zhao et al.,
Int J Adv Manuf Technol 124 (2023) 4231, Table 1; values that it does not print are marked as defaults.
"""

import math
from enum import StrEnum
from functools import partial
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from .friction_constants import BOUNDED
from .oil import LubricantParameters
from .toml import FieldError, Table, entry, require
from .units import COLDEST, HOTTEST, RPM, turns_of

#: preload kind whose balls touch four flanks
FOUR_POINT = "single_nut_oversize_ball"
#: hot-pressed silicon nitride of bearing balls (ISO 26602): Young's modulus [Pa], Poisson's ratio
NITRIDE_MODULUS, NITRIDE_POISSON = 310e9, 0.26
#: ball centre circle minus root diameter, over ball, in tables of THK and of a gothic arch; deviation that is allowed
ROOT_OF_BALL, ROOT_SPREAD = 1.022, 0.15
#: radius of the ball centre circle [m] of the smallest screws that are made; of screws whose numbers may be inches
SMALLEST, MAY_BE_INCHES = 0.75e-3, 3e-3
#: largest radius of the ball centre circle over the ball diameter (125 x 5 with balls of 3.175 mm: 20): beyond, a digit
#: has slipped
THIN_BALLS = 22.0


def _loaded_balls(screw: dict[str, Any]) -> int:
    """Balls outside the returns, or as many as the turns hold."""
    if screw["return_ball_count"] is not None:
        return int(screw["ball_count"] - screw["return_ball_count"])
    return min(int(screw["ball_count"]), _touching_balls(screw))


def _touching_balls(screw: dict[str, Any]) -> int:
    """Largest number of touching balls in the turns of all starts, with spacer balls half of it."""
    helix = screw["turns"] * 2.0 * math.pi * screw["nominal_radius"] / math.cos(screw["lead_angle"])
    return screw["starts"] * (int(helix / screw["ball_diameter"]) // (2 if screw["spacer_balls"] else 1))


class ScrewParameters(Table):
    """Geometry and elasticity; section areas and spacer are not printed in Table 1: marked defaults.

    Turns and ball counts are of one set of balls that carries the preload: one nut of a double nut, one half of a
    single nut with offset lead, the whole single nut with oversize balls. What the kinds mean: module `load`. The
    starts of a thread lie side by side: turns are those of one start, ball counts of all of them.
    """

    preload_kind: Literal["double_nut", "single_nut_offset", "single_nut_oversize_ball"] = entry(
        "two nuts, one nut with offset lead, one nut with four-point balls", before="double_nut", default="double_nut"
    )  # fmt: skip
    nominal_radius: float = entry("radius of the ball centre helix", "length", gt=0, le=1)
    root_diameter: float | None = entry(
        "root of the thread; instead of ball_diameter", "length", in_map=False, default=None, gt=0, le=2
    )
    ball_diameter: float = entry("diameter of a ball", "length", gt=0, le=0.5)
    contact_angle: float = entry(
        "contact angle without load", "angle", ge=math.radians(10.0), le=math.radians(80.0)
    )
    screw_raceway_radius: float = entry("groove radius of screw, above the ball's", "length", gt=0, le=0.5)
    nut_raceway_radius: float = entry("groove radius of nut, above the ball's", "length", gt=0, le=0.5)
    lead: float = entry("axial travel in one turn", "length", gt=0, le=1)
    lead_angle: float = entry(
        "lead angle at the nominal radius; default: by the lead", "angle", gt=0, lt=math.pi / 4, validate_default=True,
        default_factory=lambda screw: math.atan(screw["lead"] / (2.0 * math.pi * screw["nominal_radius"])),
    )  # fmt: skip
    hand: Literal["right", "left"] = entry("left, or a negative lead", in_map=False, default="right")
    starts: int = entry("starts of the thread", before=1, default=1, ge=1, le=12)
    turns: float = entry('loaded turns of one start of a nut or half, as 5 or "2.5x2"', gt=0, le=100)
    spacer_balls: bool = entry(
        "every second ball is smaller and carries no load; ball_count is of the others",
        before=False,
        default=False,
    )
    return_ball_count: int | None = entry(
        "balls in the returns; instead of loaded_ball_count", in_map=False, default=None, ge=0, le=10000
    )
    ball_count: int = entry(
        "balls of one nut, returns included, in the sums of the laws of the paper; default: touching balls",
        ge=2, le=10000,
        default_factory=lambda screw: _touching_balls(screw) + (screw["return_ball_count"] or 0),
    )  # fmt: skip
    loaded_ball_count: int = entry(
        "balls of one nut that carry load", default_factory=_loaded_balls, ge=2, le=10000
    )
    dynamic_rating: float | None = entry(
        "dynamic rating C_a of one nut by its catalogue; default: computed", "force", in_map=False,
        default=None, gt=0, le=1e8,
    )  # fmt: skip
    static_rating: float | None = entry(
        "static rating C_0a likewise", "force", in_map=False, default=None, gt=0, le=1e8
    )
    youngs_modulus: float = entry("Young's modulus of screw and nut", "pressure", unit="GPa", ge=1e9, le=1e12)
    poisson_ratio: float = entry("Poisson's ratio of screw and nut", ge=0, lt=0.5)
    ball_material: Literal["steel", "silicon_nitride"] = entry(
        "steel: as screw and nut; silicon_nitride: hybrid", in_map=False, default="steel"
    )
    ball_youngs_modulus: float = entry(
        "Young's modulus of the balls; default: by ball_material", "pressure", ge=1e9, le=1e12,
        default_factory=lambda d: d["youngs_modulus"] if d["ball_material"] == "steel" else NITRIDE_MODULUS,
    )  # fmt: skip
    ball_poisson_ratio: float = entry(
        "Poisson's ratio of the balls; default: by ball_material", ge=0, lt=0.5,
        default_factory=lambda d: d["poisson_ratio"] if d["ball_material"] == "steel" else NITRIDE_POISSON,
    )  # fmt: skip
    screw_section_area: float = entry(
        "section of the screw; default: a full rod of 0.9 nominal radii", "area", gt=0,
        default_factory=lambda screw: math.pi * (0.9 * screw["nominal_radius"]) ** 2,
    )  # fmt: skip
    nut_section_area: float = entry(
        "section of the nut; default: a ring of 1.075 to 1.575 nominal radii", "area", gt=0,
        default_factory=lambda screw: math.pi * (1.575**2 - 1.075**2) * screw["nominal_radius"] ** 2,
    )  # fmt: skip
    spacer_length: float = entry(
        "length of the spacer, or from half to half of a single nut; default: one nominal radius, one lead", "length",
        ge=0, default_factory=lambda d: d["nominal_radius" if d["preload_kind"] == "double_nut" else "lead"],
    )  # fmt: skip
    spacer_section_area: float = entry(
        "section of the spacer; default: that of the nut", "area", gt=0,
        default_factory=lambda screw: screw["nut_section_area"],
    )  # fmt: skip
    seal_torque: float = entry(
        "drag of the seals of all nuts", "torque", in_map=False, default=0.0, ge=0, le=1e3
    )

    @property
    def signed_lead(self) -> float:
        """Lead [m], negative of a left-hand thread."""
        return -self.lead if self.hand == "left" else self.lead

    @model_validator(mode="before")
    @classmethod
    def _as_catalogues_state_it(cls, data: Any) -> Any:
        """Turns x circuits, a negative lead of a left-hand thread, the root diameter in place of the ball."""
        if not isinstance(data, dict):
            return data
        data = dict(data)
        if isinstance(turns := data.get("turns"), str):
            data["turns"] = turns_of(turns)
        if isinstance(lead := data.get("lead"), float | int) and lead < 0:
            allowed = "more than 0 with hand = right"
            require(data.get("hand") != "right", "lead", allowed, "a negative lead is left-hand")
            data |= {"lead": -lead, "hand": "left"}
        radius, root = data.get("nominal_radius"), data.get("root_diameter")
        if "ball_diameter" not in data and isinstance(radius, float) and isinstance(root, float):
            data["ball_diameter"] = (2.0 * radius - root) / ROOT_OF_BALL
        return data

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        radius = 0.5 * self.ball_diameter
        for field in ("screw_raceway_radius", "nut_raceway_radius"):
            wide = radius < getattr(self, field)
            require(wide, field, "more than the ball radius", "a groove must be wider than the ball")
        self._can_be_made()
        tangent = self.lead / (2.0 * math.pi * self.nominal_radius)
        allowed = f"{math.degrees(math.atan(tangent)):.4g} deg within 2 % for this lead and radius"
        fits = abs(math.tan(self.lead_angle) / tangent - 1.0) <= 0.02
        require(fits, "lead_angle", allowed, "check all three")
        self._balls_fit()
        return self

    def _can_be_made(self) -> None:
        """Raise FieldError for grooves that meet, a shaft thinner than its balls, a root that is of another ball."""
        inches = ", or are all sizes in inches? 1 in = 25.4 mm" if self.nominal_radius < MAY_BE_INCHES else ""
        ball, circle = self.ball_diameter, 2.0 * self.nominal_radius
        allowed, thick = f"at least {1e3 * SMALLEST:g} mm", ball < self.nominal_radius
        require(self.nominal_radius >= SMALLEST, "nominal_radius", allowed, f"no screw is smaller{inches}")
        require(thick, "ball_diameter", "less than nominal_radius", f"check both{inches}")
        allowed, many = f"at most {1e3 * THIN_BALLS * ball:.4g} mm", self.nominal_radius <= THIN_BALLS * ball
        require(many, "nominal_radius", allowed, "no screw has so small balls: check both")
        pitch = self.lead / self.starts * math.cos(self.lead_angle)
        allowed = f"less than {1e3 * pitch:.4g} mm, lead over starts across the groove"
        require(ball < pitch, "ball_diameter", allowed, f"the grooves meet: check lead and starts{inches}")
        if self.root_diameter is not None:
            root, spread = circle - ROOT_OF_BALL * ball, ROOT_SPREAD * ball
            allowed = f"{1e3 * (root - spread):.4g} to {1e3 * (root + spread):.4g} mm"
            fits = abs(self.root_diameter - root) <= spread
            require(fits, "root_diameter", allowed, "check nominal_radius and ball_diameter")

    def _balls_fit(self) -> None:
        """Raise FieldError for more balls than the turns and the returns hold."""
        touching, returns = _touching_balls(self.__dict__), self.return_ball_count
        largest = min(self.ball_count, touching)
        few = self.loaded_ball_count <= largest
        if returns is None:
            remedy = "more balls than fit the turns or than there are"
            require(few, "loaded_ball_count", f"at most {largest}", remedy)
            remedy = "more than fit the turns and returns as long as these"
            require(self.ball_count <= 2 * touching, "ball_count", f"at most {2 * touching}", remedy)
            return
        carrying = self.ball_count - returns
        require(carrying >= 2, "return_ball_count", f"at most {self.ball_count - 2}", "two balls must carry")
        remedy = "it follows from ball_count and return_ball_count"
        require(self.loaded_ball_count == carrying, "loaded_ball_count", f"{carrying}, or no entry", remedy)
        allowed = f"at least {self.ball_count - largest}"
        require(few, "return_ball_count", allowed, "more balls than fit the turns")


class SolidParameters(Table):
    """Thermal data of screw and nut, or of the balls."""

    density: float = entry("density of the solid", "density", ge=100, le=3e4)
    specific_heat: float = entry("specific heat capacity", "specific_heat", ge=10, le=1e4)
    thermal_conductivity: float = entry("thermal conductivity", "thermal_conductivity", ge=1, le=1e3)


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


#: of a number that the friction law takes, not the films
_of_law = partial(entry, in_map=False)


def _bounded(name: str, **rules: Any) -> Any:
    """A dimensionless field with the value of its constant."""
    constant = BOUNDED[name]
    return _of_law(f"{constant.meaning}, mechanistic only", default=constant.value, **rules)


class FrictionTable(Table):
    """Friction law, its constants and overrides of its fitted numbers."""

    words_of_before = "kinematics", "set"

    hysteresis_coefficient: float = entry(
        "mu_hs of Eq. 18", default=BOUNDED["hysteresis_coefficient"].value, ge=0, le=1
    )
    #: printed, but no law takes it: torques determine its product with what c does
    sliding_coefficient: float = _of_law(
        "mu_s as printed, without effect: net_sliding_coefficient has it", default=0.15, ge=0.15, le=0.15
    )
    law: Law = _of_law(
        "law; the other two need the table published_speeds", default=Law.MECHANISTIC, strict=False
    )
    apparent_viscosity_ratio: float | None = _of_law("fitted number", default=None, gt=0, le=1e3)
    net_sliding_coefficient: float | None = _of_law("fitted number, by calibrate", default=None, ge=0, le=1)
    raceway_rq: float | None = _of_law(
        "rms roughness of raceways", "length", unit="um", default=None, ge=0, le=1e-4
    )
    ball_rq: float | None = _of_law(
        "rms roughness of the balls", "length", unit="um", default=None, ge=0, le=1e-4
    )
    limiting_shear_coefficient: float = _bounded("limiting_shear_coefficient", ge=1e-3, le=0.5)
    boundary_friction: float = _bounded("boundary_friction", ge=1e-3, le=1)
    asperity_film_ratio: float = _bounded("asperity_film_ratio", ge=0.05, le=5)
    ball_thrust: float | None = _of_law(
        "instead of net_sliding_coefficient, which is 2 boundary_friction limiting_shear_coefficient times it, "
        f"mechanistic only: {BOUNDED['ball_thrust'].meaning}",
        default=None, ge=0, le=100,
    )  # fmt: skip
    neighbour_oil: float = _bounded("neighbour_oil", ge=0, le=1)
    supply_length: float = _bounded("supply_length", ge=2, allow_inf_nan=True)
    replenishment_constant: float = _of_law(
        "K_rs of SKF, a further factor: 6e-8 grease or oil-air, 3e-8 oil bath, mechanistic only",
        default=0.0, ge=0, le=1e-6,
    )  # fmt: skip
    roughness_height: float | None = _of_law(
        "override of the set; default: composite of raceway_rq and ball_rq, if given", "length", unit="um",
        default_factory=lambda d: (
            None if None in (d["raceway_rq"], d["ball_rq"]) else math.hypot(d["raceway_rq"], d["ball_rq"])
        ), ge=0, le=1e-4,
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


class PublishedSpeeds(Table):
    """Surface speeds (u_1 raceway, u_2 ball) in the fixed frame at one screw speed."""

    reference_speed: float = entry("screw speed of the pairs below", "angular_velocity", gt=0, le=1e5)
    screw: tuple[float, float] = entry("raceway and ball at the screw contact", "velocity")
    nut: tuple[float, float] = entry("raceway and ball at the nut contact", "velocity")


#: widest ends of the range of a map: force [N], speed [rad/s], temperature [K], from where an oil has a viscosity
WIDEST_ENDS = {
    "preload": (1e-2, 1e7), "speed": (1e-3 * RPM, 1e6 * RPM), "temperature": (COLDEST, HOTTEST)
}  # fmt: skip


def _end(description: str, name: str, dimension: str) -> Any:
    low, high = WIDEST_ENDS[name]
    return entry(description, dimension, default=None, ge=low, le=high)


class MapParameters(Table):
    """Range of the map of this screw, where it is not to follow from the screw and its oil: both ends or none."""

    preload_min: float | None = _end("lowest preload", "preload", "force")
    preload_max: float | None = _end("highest preload", "preload", "force")
    speed_min: float | None = _end("lowest speed", "speed", "angular_velocity")
    speed_max: float | None = _end("highest speed", "speed", "angular_velocity")
    temperature_min: float | None = _end("lowest oil temperature", "temperature", "temperature")
    temperature_max: float | None = _end("highest oil temperature", "temperature", "temperature")

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
    def summed_balls(self) -> int:
        """Balls of one nut in the friction sums: those that carry load; ball_count by the laws of the paper."""
        paper = self.friction.kinematics == PUBLISHED
        return self.screw.ball_count if paper else self.screw.loaded_ball_count

    @property
    def solids(self) -> tuple[SolidParameters, SolidParameters]:
        """Thermal data of the bodies and of the balls; without a table `ball` those of the bodies."""
        return self.solid, self.ball or self.solid

    @model_validator(mode="after")
    def _speeds_are_known(self) -> Self:
        known = self.friction.kinematics != PUBLISHED or self.published_speeds is not None
        allowed = f"{Law.MECHANISTIC}, or a table published_speeds"
        require(known, "friction.law", allowed, "the paper prints one screw only")
        return self
