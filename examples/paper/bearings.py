"""Caged ball bearings under an axial load: the mechanistic law, closed formulas, and SKF's friction model.

Units of the formulas as in catalogues: speed n [r/min], kinematic viscosity nu [mm2/s], pitch diameter d_m [mm];
torques [N.m].
"""

import itertools
import math
from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import pandas as pd
from pipe_table import data_file

from ballscrew_tehl.applications.bearing import CAGED, Bearing, bearing
from ballscrew_tehl.friction.mechanistic import nuts_powers
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.ball_law import loaded_contact_angle
from ballscrew_tehl.physics.film import FLOODED, thermal_load_parameter
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, reduced_radii
from ballscrew_tehl.physics.kinematics import entrainment_speed
from ballscrew_tehl.physics.lubricant import eta0
from ballscrew_tehl.physics.rating import STATIC_PRESSURE, ball_pressure

SKF_TORQUE = "skf_torque.csv"
#: friction coefficient of SKF's sliding part, of boundary and of full film with mineral oil
BOUNDARY, FULL_FILM = 0.12, 0.05
#: f_0 of Palmgren by kind and lubrication
PALMGREN_F0 = {
    ("angular", "mist"): 1.7, ("angular", "bath"): 3.3, ("thrust", "mist"): 0.8, ("thrust", "bath"): 1.5,
}  # fmt: skip
#: z and y of Palmgren's f_1 = z (P_0/C_0)^y
PALMGREN_F1 = {"angular": (0.001, 0.33), "thrust": (0.0008, 0.33)}


def skf_torque(kind: str, d_m: float, axial_load: float, n: float, nu: float) -> tuple[float, float]:
    """Rolling and sliding part of SKF's friction model, no radial load, no starvation factor, no drag of an oil bath.

    kind: "angular" or "thrust" (no other row of the catalogue's table); axial_load [N]. Returns M_rr = phi_ish G_rr
    (nu n)^0.6, M_sl = G_sl mu_sl [N.m]. SKF rolling bearings catalogue, forms [read], constants [memory]; they give
    the 70 rows of skf_torque.csv to their digits. phi_ish = 1/(1 + 1.84e-9 (n d_m)^1.28 nu^0.64), mu_sl = phi_bl 0.12
    + (1 - phi_bl) 0.05, phi_bl = exp(-2.6e-8 (n nu)^1.4 d_m).
    """
    if kind == "angular":
        centrifugal = d_m**4 * n**2
        G_rr = 5.03e-7 * d_m**1.97 * (1.90e-12 * centrifugal + 1.97 * axial_load) ** 0.54
        G_sl = (
            1.30e-2 * d_m**0.26 * ((1.91e-12 * centrifugal) ** (4.0 / 3.0) + 0.68 * axial_load ** (4.0 / 3.0))
        )
    else:
        G_rr = 1.03e-6 * d_m**1.83 * axial_load**0.54
        G_sl = 1.6e-2 * d_m**0.05 * axial_load ** (4.0 / 3.0)
    inlet_heating = 1.0 / (1.0 + 1.84e-9 * (n * d_m) ** 1.28 * nu**0.64)
    boundary_fraction = math.exp(-2.6e-8 * (n * nu) ** 1.4 * d_m)
    mu = boundary_fraction * BOUNDARY + (1.0 - boundary_fraction) * FULL_FILM
    return 1e-3 * inlet_heating * G_rr * (nu * n) ** 0.6, 1e-3 * G_sl * mu


def palmgren_torque(
    parameters: Parameters, kind: str, oil: str, axial_load: float, n: float, nu: float
) -> float:
    """Torque of Palmgren's formula [N.m]; parameters: of caged_bearing; oil: "mist" or "bath".

    Harris, Rolling Bearing Analysis [memory]: M_0 = 1e-7 f_0 (nu n)^(2/3) d_m^3, 160e-7 f_0 d_m^3 below nu n = 2000;
    M_1 = z (P_0/C_0)^y F d_m, F = max(0.9 cot(alpha), 1) F_a, of thrust bearings F_a; N.mm. differs from it: P_0/C_0
    is the cube of the Hertz pressure over the 4.2 GPa of ISO 76.
    """
    screw = parameters.screw
    d_m, f_0, (z, y) = 2e3 * screw.nominal_radius, PALMGREN_F0[kind, oil], PALMGREN_F1[kind]
    oil_torque = 1e-7 * f_0 * max(nu * n, 2000.0) ** (2.0 / 3.0) * d_m**3
    load = axial_load * max(0.9 / math.tan(screw.contact_angle), 1.0)
    pressure = ball_pressure(screw, axial_load / (screw.loaded_ball_count * math.sin(screw.contact_angle)))
    return 1e-3 * (oil_torque + z * (pressure / STATIC_PRESSURE) ** (3.0 * y) * load * d_m)


def houpert_rolling(parameters: Parameters, axial_load: float, speed: float, temperature: float) -> float:
    """Rolling part [N.m] by the closed rolling force of Houpert with the inlet heating of Aihara.

    parameters: of caged_bearing; axial_load [N], speed [rad/s], temperature [K]. F_R = 2.86 E' R_x^2 k^0.348 G^0.022
    U^0.66 W^0.47, k = R_y/R_x, U of the mean speed: Houpert, J Tribol 109 (1987) 363 [memory]; 1/(1 + 0.29 N^0.78):
    Goksem & Hargreaves, through Aihara 1987 [read].
    """
    screw, oil = parameters.screw, parameters.lubricant
    angle = float(loaded_contact_angle(screw, axial_load, screw.loaded_ball_count))
    load = axial_load / (screw.loaded_ball_count * math.sin(angle))
    E, eta, u_e = E_prime(screw), float(eta0(oil, temperature)), float(entrainment_speed(screw, speed))
    power = 0.0
    for raceway in RACEWAYS:
        R_x, R_y = (float(R) for R in reduced_radii(screw, angle, raceway))
        W, U = load / (E * R_x**2), eta * u_e / (E * R_x)
        G = oil.pressure_viscosity * E
        force = 2.86 * E * R_x**2 * (R_y / R_x) ** 0.348 * G**0.022 * U**0.66 * W**0.47
        power += screw.loaded_ball_count * float(2.0 * u_e * force)
    return power / speed / (1.0 + 0.29 * float(thermal_load_parameter(oil, u_e, temperature)) ** 0.78)


#: oil of the bearings, and its temperature [K]
VISCOSITY_GRADE, BEARING_TEMPERATURE = 68, 313.15
#: the law with other supplies of oil
OTHER_SUPPLIES: dict[str, dict[str, float]] = {
    "flooded": {"supply_length": FLOODED}, "replenished": {"replenishment_constant": 6e-8}
}  # fmt: skip


class BearingType(NamedTuple):
    """Geometry [mm, deg] with what the catalogue states: dynamic rating [N] and limiting speed [r/min].

    in_data: with rows in skf_torque.csv. Balls and grooves are no catalogue data: number and diameter of the balls
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
LOAD_RATIOS, NU_N = (0.02, 0.05, 0.1, 0.2, 0.3), (1e3, 1e4, 1e5, 5e5, 1e6)


class Point(NamedTuple):
    """A bearing under an axial load of a fraction of its rating at nu n [mm2/s r/min], with the parts by SKF [N.m]."""

    bearing: str
    load_ratio: float
    nu_n: float
    skf_rolling: float
    skf_sliding: float


def operating_points() -> list[Point]:
    """The data, then the other bearings."""
    known = {name.replace(" ", ""): name for name in BEARINGS}
    result = [
        Point(known[row.bearing], row.axial_load_over_C, row.nu_n_mm2_s_r_min,
              1e-3 * row.skf_rolling_Nmm, 1e-3 * row.skf_sliding_Nmm)
        for row in data_file(SKF_TORQUE).itertuples()
    ]  # fmt: skip
    for name, of in BEARINGS.items():
        for ratio, nu_n in itertools.product(LOAD_RATIOS, NU_N):
            n = nu_n / VISCOSITY_GRADE
            if not of.in_data and n <= of.limiting_speed:
                skf = skf_torque(of.kind, of.pitch_diameter, ratio * of.rating, n, VISCOSITY_GRADE)
                result.append(Point(name, ratio, nu_n, *skf))
    return result


#: groove radii over ball diameter that the bearings may have as well; load over rating and nu n of the comparison
CONFORMITIES = {"7208 B": (0.515, 0.52, 0.53), "51108": (0.52, 0.53, 0.54)}
CONFORMITY_LOAD, CONFORMITY_NU_N = 0.1, NU_N[:4]


def conformity_ratios() -> list[tuple[str, float, list[float]]]:
    """Bearing, groove radius over ball diameter, total of the law over that of SKF at CONFORMITY_NU_N."""
    result = []
    for name, conformities in CONFORMITIES.items():
        load = CONFORMITY_LOAD * BEARINGS[name].rating
        for conformity in conformities:
            of = BEARINGS[name]._replace(conformities=(conformity, conformity))
            ratios, built = [], of.built()
            for nu_n in CONFORMITY_NU_N:
                n = nu_n / VISCOSITY_GRADE
                law = built.torque(load, n * RPM, BEARING_TEMPERATURE).total
                ratios.append(law / sum(skf_torque(of.kind, of.pitch_diameter, load, n, VISCOSITY_GRADE)))
            result.append((name, conformity, ratios))
    return result


@cache
def _built(name: str, supply: str) -> Bearing:
    return BEARINGS[name].built(**OTHER_SUPPLIES.get(supply, {}))


def bearing_points(points: Iterable[Point]) -> pd.DataFrame:
    """Law, closed formulas and SKF at points, torques [N.m]: columns of Point, axial_load [N] and

    rolling, hysteresis, sliding, total, low, high of the law; rolling_ and total_ with other supplies of oil;
    rolling_houpert; total_palmgren with oil mist and with an oil bath; skf: total without drag; skf_replenished: with
    replenishment
    """
    rows = []
    for point in points:
        of, n = BEARINGS[point.bearing], point.nu_n / VISCOSITY_GRADE
        load, speed = point.load_ratio * of.rating, n * RPM
        law = _built(point.bearing, "")
        row = point._asdict() | law.torque(load, speed, BEARING_TEMPERATURE)._asdict()
        for supply in OTHER_SUPPLIES:
            other = _built(point.bearing, supply)
            ((_, nut),) = nuts_powers(other.parameters, [load], other.contacts, speed, BEARING_TEMPERATURE)
            row[f"rolling_{supply}"] = nut.viscous_screw + nut.viscous_nut
            row[f"total_{supply}"] = nut.torque(*CAGED.values[:2])
        # like with like: the same factor on both
        factor = row["rolling_replenished"] / row["rolling"]
        row["skf_replenished"] = factor * point.skf_rolling + point.skf_sliding
        row["rolling_houpert"] = houpert_rolling(law.parameters, load, speed, BEARING_TEMPERATURE)
        for oil in ("mist", "bath"):
            torque = palmgren_torque(law.parameters, of.kind, oil, load, n, VISCOSITY_GRADE)
            row[f"total_palmgren_{oil}"] = torque
        rows.append(
            row | {"axial_load": load, "in_data": of.in_data, "skf": point.skf_rolling + point.skf_sliding}
        )
    return pd.DataFrame(rows)
