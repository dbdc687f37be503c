"""Caged ball bearings under an axial load: the mechanistic law, closed formulas, and SKF's friction model."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import NamedTuple

from ..caged_bearing import CAGED, Bearing, BearingTorque, bearing
from ..friction.mechanistic import nuts_powers
from ..nut_map.built import Progress
from ..parameters.packaged_data import PACKAGED_DATA
from ..parameters.units import RPM
from ..physics.supply import FLOODED
from ..tables.csv_file import read_rows
from .bearing_formulas import houpert_rolling, palmgren_torque, skf_torque

#: torques by the friction model of SKF
SKF_TORQUE = PACKAGED_DATA / "skf_torque.csv"
#: oil of the bearings, and its temperature [K]
VISCOSITY_GRADE, BEARING_TEMPERATURE = 68, 313.15
#: the law with other supplies of oil
OTHER_SUPPLIES: dict[str, dict[str, float]] = {
    "flooded": {"supply_length": FLOODED}, "replenished": {"replenishment_constant": 6e-8}
}  # fmt: skip


class BearingType(NamedTuple):
    """Geometry [mm, deg] with what the catalogue states: dynamic rating [N] and limiting speed [r/min].

    in_data: with rows in data/skf_torque.csv. Balls and grooves are no catalogue data: number and diameter of the balls
    that give the rating after ISO 281, as far as it scales; ratings and limiting speeds of the others from memory
    """

    kind: str
    pitch_diameter: float
    ball_diameter: float
    balls: int
    contact_angle: float
    conformities: tuple[float, float]
    rating: float
    limiting_speed: float
    in_data: bool = False

    def built(self, **friction: float) -> Bearing:
        """The bearing with constants of the law."""
        return bearing(
            1e-3 * self.pitch_diameter, 1e-3 * self.ball_diameter, self.balls, math.radians(self.contact_angle),
            *self.conformities, VISCOSITY_GRADE, friction=friction,
        )  # fmt: skip


BEARINGS = {
    "7208 B": BearingType("angular", 60.0, 12.303, 14, 40.0, (0.52, 0.52), 36500.0, math.inf, True),
    "7210 AC": BearingType("angular", 70.0, 12.7, 16, 25.0, (0.52, 0.53), 41000.0, math.inf, True),
    "51108": BearingType("thrust", 50.0, 7.144, 19, 90.0, (0.54, 0.54), 25500.0, math.inf, True),
    "7204 B": BearingType("angular", 33.5, 7.938, 10, 40.0, (0.52, 0.52), 13300.0, 18000.0),
    "7206 B": BearingType("angular", 46.0, 9.525, 14, 40.0, (0.52, 0.52), 24000.0, 12000.0),
    "7212 B": BearingType("angular", 85.0, 15.875, 15, 40.0, (0.52, 0.52), 61000.0, 6300.0),
    "51105": BearingType("thrust", 33.5, 6.35, 14, 90.0, (0.54, 0.54), 18200.0, 9000.0),
    "51208": BearingType("thrust", 54.0, 11.112, 12, 90.0, (0.54, 0.54), 46500.0, 5000.0),
}
#: axial load over dynamic rating, and nu n, of the bearings that are not in the data: those of the data
SHARES, NU_N = (0.02, 0.05, 0.1, 0.2, 0.3), (1e3, 1e4, 1e5, 5e5, 1e6)


#: bearing, share of its rating, nu n, rolling and sliding part of SKF [N.m]
Point = tuple[str, float, float, tuple[float, float]]


class BearingPoint(NamedTuple):
    """A bearing at a point: torques [N.m] of SKF, of the law, of the law with other supplies, of closed formulas."""

    bearing: str
    in_data: bool
    axial_load: float  # [N]
    nu_n: float  # [mm2/s r/min]
    skf_rolling: float
    skf_sliding: float
    law: BearingTorque
    rolling: Mapping[str, float]  # by supply, and houpert
    total: Mapping[str, float]  # by supply, and palmgren with oil mist and with an oil bath

    @property
    def share(self) -> float:
        """Axial load over dynamic rating."""
        return round(self.axial_load / BEARINGS[self.bearing].rating, 6)

    @property
    def skf(self) -> float:
        """Total of SKF without drag [N.m]."""
        return self.skf_rolling + self.skf_sliding


def operating_points() -> Iterator[Point]:
    """The data, then the other bearings."""
    known = {name.replace(" ", ""): name for name in BEARINGS}
    for row in read_rows(SKF_TORQUE):
        rolling, sliding = (1e-3 * float(row[f"skf_{part}_Nmm"]) for part in ("rolling", "sliding"))
        share, nu_n = float(row["axial_load_over_C"]), float(row["nu_n_mm2_s_r_min"])
        yield known[row["bearing"]], share, nu_n, (rolling, sliding)
    for name, of in BEARINGS.items():
        for share, nu_n in itertools.product(SHARES, NU_N):
            n = nu_n / VISCOSITY_GRADE
            if not of.in_data and n <= of.limiting_speed:
                skf = skf_torque(of.kind, of.pitch_diameter, share * of.rating, n, VISCOSITY_GRADE)
                yield name, share, nu_n, skf


#: groove radii over ball diameter that the bearings may have as well; load over rating and nu n of the comparison
CONFORMITIES = {"7208 B": (0.515, 0.52, 0.53), "51108": (0.52, 0.53, 0.54)}
CONFORMITY_SHARE, CONFORMITY_NU_N = 0.1, NU_N[:4]


def conformity_ratios() -> dict[str, dict[str, list[float]]]:
    """Total of the law over that of SKF at CONFORMITY_NU_N by bearing and groove radius over ball diameter."""
    found: dict[str, dict[str, list[float]]] = {}
    for name, conformities in CONFORMITIES.items():
        found[name], load = {}, CONFORMITY_SHARE * BEARINGS[name].rating
        for conformity in conformities:
            of = BEARINGS[name]._replace(conformities=(conformity, conformity))
            ratios, built = [], of.built()
            for nu_n in CONFORMITY_NU_N:
                n = nu_n / VISCOSITY_GRADE
                law = built.torque(load, n * RPM, BEARING_TEMPERATURE).total
                ratios.append(law / sum(skf_torque(of.kind, of.pitch_diameter, load, n, VISCOSITY_GRADE)))
            found[name][f"{conformity:g}"] = ratios
    return found


def bearing_points(progress: Progress, points: Sequence[Point] = ()) -> list[BearingPoint]:
    """Law, closed formulas and SKF at points, none = all operating points."""

    @cache
    def built(name: str, supply: str) -> Bearing:
        return BEARINGS[name].built(**OTHER_SUPPLIES.get(supply, {}))

    points, found = points or list(operating_points()), []
    for done, (name, share, nu_n, skf) in enumerate(points):
        progress(done, len(points), "bearings")
        of, n = BEARINGS[name], nu_n / VISCOSITY_GRADE
        load, speed = share * of.rating, n * RPM
        law = built(name, "")
        rolling, total = {}, {}
        for supply in OTHER_SUPPLIES:
            other = built(name, supply)
            ((_, nut),) = nuts_powers(other.parameters, [load], other.contacts, speed, BEARING_TEMPERATURE)
            rolling[supply] = nut.rolling_screw + nut.rolling_nut
            total[supply] = nut.torque(*CAGED.values[:2])
        rolling["houpert"] = houpert_rolling(law.parameters, load, speed, BEARING_TEMPERATURE)
        for oil in ("mist", "bath"):
            total[f"palmgren_{oil}"] = palmgren_torque(law.parameters, of.kind, oil, load, n, VISCOSITY_GRADE)
        torque = law.torque(load, speed, BEARING_TEMPERATURE)
        found.append(BearingPoint(name, of.in_data, load, nu_n, *skf, torque, rolling, total))
    progress(len(points), len(points), "bearings")
    return found
