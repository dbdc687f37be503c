"""Table `friction` of a screw file: the law, and its constants that are known within bounds.

The torque's interval follows from these (friction.interval). [read]: seen in the source; [code]: in a program that uses
it; [memory]: recalled.
"""

import math
from functools import partial
from typing import Any, NamedTuple, Self

from pydantic import model_validator

from ..runtime.packed import Law
from .toml import Table, entry, require


class BoundedConstant(NamedTuple):
    """Value and interval in SI, unit, meaning, source."""

    value: float
    low: float
    high: float
    unit: str
    meaning: str
    source: str
    factor: bool = False  # uniform in its logarithm

    def place(self, value: float) -> float:
        """Of a value between low and high, 0 to 1; that of a length without a longest one in 1/length."""
        if math.isinf(self.high):
            return 1.0 - self.low / value
        if self.factor:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


#: by the name of the field of the screw file, table friction or lubricant
BOUNDED: dict[str, BoundedConstant] = {
    "limiting_shear_coefficient": BoundedConstant(
        0.05, 0.04, 0.08, "1", "limit of the oil's shear stress over pressure, Lambda",
        "SKF catalogue: full-film sliding 0.05 with mineral, 0.04 with synthetic oil [read]; Evans & Johnson 1986: "
        "0.04 to 0.08 [memory]",
    ),
    "eyring_stress": BoundedConstant(
        5e6, 3e6, 9e6, "Pa", "Eyring stress tau_0 of the oil",
        "mineral oils 2 to 10 MPa, typical 5 [code]; Evans & Johnson 1986: 4 to 8 MPa [memory]",
    ),
    "boundary_friction": BoundedConstant(
        0.12, 0.08, 0.15, "1", "friction coefficient mu_b of asperities and of ball on ball",
        "SKF catalogue: 0.12 in motion, 0.15 at start [read]; programs: 0.08 to 0.15 [code]",
    ),
    "roughness_height": BoundedConstant(
        0.2e-6, 0.1e-6, 0.35e-6, "m", "composite rms roughness sigma of raceway and ball",
        "ball Ra 0.02 to 0.04 um by ISO 3290 G10 to G24 [read]; raceways 0.1 to 0.3 um [code]",
    ),
    "asperity_film_ratio": BoundedConstant(
        0.5, 0.27, 0.85, "1", "film over roughness where asperities carry 1/e of the load, L_0",
        "share of the load at h/sigma = 0.5: 0.03 Greenwood & Tripp [code], 0.33 Balan 2015 Eq. A2, 0.39 SKF "
        "catalogue; 0.65 the latter over eight bearings",
    ),
    "supply_length": BoundedConstant(
        6.0, 3.0, math.inf, "1", "half-widths before the middle of the contact where its oil begins; inf = flooded",
        "bearings (SKF's friction model): 4 to 8 b [read]; 3 b elastic inlet of Houpert 1987; flooded: open grooves of "
        "Balan 2015 [read]; uniform in 1/length",
    ),
    "neighbour_oil": BoundedConstant(
        1.0, 0.0, 1.0, "1", "filled share of the gap between neighbouring balls",
        "full: resistance of two spheres, Jeffrey & Onishi 1984 [read]; none: oil that is short or aerated",
    ),
    "hysteresis_coefficient": BoundedConstant(
        0.01, 0.005, 0.012, "1", "share of elastic work that is lost, mu_hs of Eq. 18",
        "Zhao 2023, Table 1 [read]; rolling of bearing steel 0.005 to 0.012 [code, memory]",
    ),
    "ball_thrust": BoundedConstant(
        1.0, 0.4, 1.25, "1", "thrust between neighbouring balls over the traction limit Lambda Q of one contact, kappa",
        "three screws whose force is stated: 0.8 to 1 GD4008-3 at 100 r/min, 0.45 to 1 both of XJTU as the screws that "
        "they could be (examples/paper/rig.py) [computed]; ends an eighth below, a quarter beyond. A ball is pushed by "
        "the traction of its contacts, at most 2 Lambda Q; own estimate from contact angles that run out by 0.5 deg: "
        "0.17 to 0.68",
    ),
}  # fmt: skip

#: no constant of the law and in no table: what becomes of a preload that is a name, see screw.preload_basis
PRELOAD_FORCE = BoundedConstant(
    1.0, 0.3, 1.1, "1", "true force behind a preload that is nominal, over that preload",
    "makers set a preload by its drag torque (Rexroth: T_pr0 is the criterion for the preload [read]), so that the "
    "force is that at which a screw has the printed torque. With the friction of BOUNDED: 0.3 to 0.36 double, 0.55 "
    "to 0.65 single nuts of Rexroth, 0.25 to 0.95 JIS B 1192; 1 where a load cell or the deflection sets it, +-10 % "
    "[assumption]. A factor: uniform in its logarithm", factor=True,
)  # fmt: skip


#: of a number that the friction law takes, not the films
_of_law = partial(entry, in_map=False)


def _bounded(name: str, **rules: Any) -> Any:
    """A dimensionless field with the value of its constant."""
    constant = BOUNDED[name]
    return _of_law(f"{constant.meaning}, mechanistic only", default=constant.value, **rules)


class FrictionTable(Table):
    """Friction law, its constants and overrides of its fitted numbers."""

    hysteresis_coefficient: float = entry(
        "mu_hs of Eq. 18", default=BOUNDED["hysteresis_coefficient"].value, ge=0, le=1
    )
    law: Law = entry(
        "law; three_parameter needs the table published_speeds", default=Law.MECHANISTIC, strict=False
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
