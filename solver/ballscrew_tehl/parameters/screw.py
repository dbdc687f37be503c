"""Tables of a screw file: every field with dimension, bounds and meaning; contradictory entries raise.

Attributes are SI, kelvin, radians. A field that a file leaves out takes the default stated here;
`model_fields_set` of a table holds the fields that the file gave. Source of the packaged values: Zhao et al.,
Int J Adv Manuf Technol 124 (2023) 4231, Table 1; values that it does not print are marked as defaults.
"""

import csv
import math
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import model_validator

from .mineral_oil import ISO_GRADES
from .toml import Table, entry, require
from .units import CELSIUS, RPM, turns_of

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

#: torque of both seals over the square of the diameter [N/m] (Bosch Rexroth, 2.4e-4 N.m/mm2; its rows from 12 mm on are
#: 0.8 to 1.43 of that); reinforced ones have twice as much
SEALS = 240.0


def _drag(description: str, dimension: str | None = None, **rules: Any) -> Any:
    """A field of the drag torque, None if nothing else is its default."""
    default = {} if "default_factory" in rules else {"default": None}
    return entry(description, dimension, in_map=False, **default | {"gt": 0} | rules)


@lru_cache(maxsize=1)
def _class_tolerances() -> list[dict[str, str]]:
    """Rows of the table of the standards."""
    lines = (Path(__file__).parents[1] / "data" / "drag_torque_tolerance.csv").read_text("utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def tolerance_of_class(grade: str, slenderness: float, torque: float) -> float | None:
    """Tolerance [+-%] of a drag torque [N.m] by accuracy class and thread length over diameter; None: not in the table.

    JIS B 1192-1997 (C0 to C5) and DIN ISO 3408-3 (T0 to T7), as two catalogues print them, for screws up to 4 m.
    """
    for row in _class_tolerances():
        if row["class"] == grade and slenderness <= float(row["slenderness"]):
            highest = [name for name in row if name[0].isdigit() and torque <= float(name)]
            inside = torque > LEAST_OF_CLASS and highest and row[highest[0]]
            return float(row[highest[0]]) if inside else None
    return None


def _by_class(screw: dict[str, Any]) -> float | None:
    grade, torque = screw["drag_torque_class"], screw["drag_torque"]
    return (
        None
        if None in (grade, torque)
        else tolerance_of_class(grade, screw["drag_torque_slenderness"], torque)
    )


def _end(screw: dict[str, Any], side: float) -> float | None:
    """End of the tolerance of the drag torque."""
    torque, percent = screw["drag_torque"], screw["drag_torque_tolerance_percent"]
    return None if None in (torque, percent) else torque * (1.0 + 0.01 * side * percent)


def _loaded_balls(screw: dict[str, Any]) -> int:
    """Balls outside the returns, or as many as the turns hold."""
    if screw["return_ball_count"] is not None:
        return int(screw["ball_count"] - screw["return_ball_count"])
    return min(int(screw["ball_count"]), _touching_balls(screw))


def _touching_balls(screw: dict[str, Any]) -> int:
    """Largest number of touching balls in the turns of all starts, with spacer balls half of it."""
    helix = screw["turns"] * 2.0 * math.pi * screw["nominal_radius"] / math.cos(screw["lead_angle"])
    return screw["starts"] * (int(helix / screw["ball_diameter"]) // (2 if screw["spacer_balls"] else 1))


#: highest over lowest drag torque of a tolerance: +-50 % is a factor of 3, stock inspected by its end alone up to 10
WIDEST_TOLERANCE = 20.0
#: below this drag torque [N.m] the standards have no tolerance
LEAST_OF_CLASS = 0.2


class ScrewParameters(Table):
    """Geometry and elasticity; section areas and spacer are not printed in Table 1: marked defaults.

    Turns and ball counts are of one set of balls that carries the preload: one nut of a double nut, one half of a
    single nut with offset lead, the whole single nut with oversize balls. What the kinds mean: module `load`. The
    starts of a thread lie side by side: turns are those of one start, ball counts of all of them.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> screw = load_screw().screw
    >>> f"{1e3 * screw.ball_diameter:.3f} mm", screw.loaded_ball_count
    ('4.763 mm', 72)
    """

    preload_kind: Literal["double_nut", "single_nut_offset", "single_nut_oversize_ball"] = entry(
        "two nuts, one nut with offset lead, one nut with four-point balls", default="double_nut"
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
    starts: int = entry("starts of the thread", default=1, ge=1, le=12)
    turns: float = entry('loaded turns of one start of a nut or half, as 5 or "2.5x2"', gt=0, le=100)
    spacer_balls: bool = entry(
        "every second ball is smaller and carries no load; ball_count is of the others",
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
    preload_sense: Literal["pushed_apart", "pulled_together"] = entry(
        "by preload the two nuts or halves are so; no matter with oversize balls", default="pushed_apart"
    )
    thermal_expansion: float = entry(
        "thermal expansion of screw and nut; default: bearing steel", "temperature_coefficient",
        default=11.5e-6, gt=0, le=5e-5,
    )  # fmt: skip
    seal_torque: float = entry(
        "drag of the seals of all nuts", "torque", in_map=False, default=0.0, ge=0, le=1e3
    )
    preload_basis: Literal["nominal", "force"] = entry(
        "what a preload is: nominal (set by its drag torque), or a force", in_map=False, default="nominal"
    )
    drag_torque: float | None = _drag("drag torque of the delivered screw, without seals", "torque", le=1e3)
    drag_torque_class: (
        Literal["C0", "C1", "C2", "C3", "C5", "T0", "T1", "T2", "T3", "T4", "T5", "T7"] | None
    ) = entry(
        "accuracy class of the screw, which gives the tolerance by JIS B 1192 or ISO 3408-3",
        in_map=False,
        default=None,
    )
    drag_torque_slenderness: float = _drag("thread length over diameter, for the class", default=40.0, le=60)
    drag_torque_tolerance_percent: float | None = _drag(
        "tolerance of drag_torque, +-; default: by its class", lt=100, default_factory=_by_class
    )
    drag_torque_min: float | None = _drag(
        "low end of it, in place of a tolerance", "torque", le=1e3, default_factory=lambda d: _end(d, -1.0)
    )
    drag_torque_max: float | None = _drag(
        "high end likewise", "torque", le=2e3, default_factory=lambda d: _end(d, 1.0)
    )
    drag_torque_preload: float | None = _drag("preload that it is printed for", "force", le=1e8)
    drag_torque_oil: int = entry(
        "ISO VG of its oil; default: that of ISO 3408-3 (JIS B 1192: 68)", in_map=False, default=100
    )
    drag_torque_speed: float = _drag("speed of its test", "angular_velocity", default=100.0 * RPM, le=1e5)
    drag_torque_temperature: float = _drag(
        "oil temperature of its test", "temperature", default=20.0 + CELSIUS, ge=250, le=400
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
        self._drag_is_whole()
        return self

    def _drag_is_whole(self) -> None:
        """Raise FieldError for a drag torque without preload or tolerance, or with two kinds of a tolerance."""
        given = {name for name in self.model_fields_set if name.startswith("drag_torque")}
        tolerance, ends = "drag_torque_tolerance_percent", ("drag_torque_min", "drag_torque_max")
        for name in ("drag_torque", "drag_torque_preload") if given else ():
            require(getattr(self, name) is not None, name, "a value", "a drag torque is that of a preload")
        stated = given & {*ends}
        one = self.drag_torque_tolerance_percent is None or not stated
        require(one, tolerance, "no entry", "minimum and maximum state it")
        for name in ends if given else ():
            missing = name if stated else tolerance
            require(
                getattr(self, name) is not None,
                missing,
                "a value",
                "it needs a tolerance, a class, or both ends",
            )
        if (torque := self.drag_torque) is not None:
            inside = self.drag_torque_min <= torque <= self.drag_torque_max  # type: ignore[operator]
            allowed = f"drag_torque_min to drag_torque_max, {self.drag_torque_min:g} to {self.drag_torque_max:g} N.m"
            require(inside, "drag_torque", allowed, "check all three")
            most = WIDEST_TOLERANCE * self.drag_torque_min  # type: ignore[operator]
            sharp = self.drag_torque_max <= most  # type: ignore[operator]
            require(sharp, "drag_torque_max", f"at most {most:.4g} N.m", "so wide a tolerance says nothing")
        grades = ", ".join(map(str, ISO_GRADES))
        require(self.drag_torque_oil in ISO_GRADES, "drag_torque_oil", grades, "it is an ISO viscosity grade")

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
