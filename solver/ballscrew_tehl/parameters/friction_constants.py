"""Constants of the mechanistic friction law that are known within bounds: value, interval, source.

The torque's interval follows from these (friction.interval). [read]: seen in the source; [code]: in a program that uses
it; [memory]: recalled.
"""

import math
from typing import Any, NamedTuple

from pydantic import Field


class BoundedConstant(NamedTuple):
    """Value and interval in SI, unit, meaning, source."""

    value: float
    low: float
    high: float
    unit: str
    meaning: str
    source: str

    def place(self, value: float) -> float:
        """Of a value between low and high, 0 to 1; that of a length without a longest one in 1/length."""
        if math.isinf(self.high):
            return 1.0 - self.low / value
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
        1.0, 0.34, 1.5, "1", "thrust between neighbouring balls over the traction limit Lambda Q of one contact, kappa",
        "assumption, no published value found. One ball is pushed by the traction of its contacts, at most 2 Lambda Q; "
        "in a chain those of several add up, so that 1.5 is a chosen end and no bound. Low end: middle of an own "
        "estimate, 0.17 to 0.68, from contact angles that run out by 0.5 deg",
    ),
}  # fmt: skip


def bounded(name: str, **bounds: Any) -> Any:
    """A dimensionless field of the screw file with the value of its constant."""
    constant = BOUNDED[name]
    return Field(default=constant.value, description=f"{constant.meaning}, mechanistic only", **bounds)
