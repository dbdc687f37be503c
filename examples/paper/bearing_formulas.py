"""Closed formulas of the friction of caged ball bearings under an axial load: SKF, Palmgren, Houpert.

Units as catalogues: speed n [r/min], kinematic viscosity nu [mm2/s], pitch diameter d_m [mm]; torques [N.m].
"""

from __future__ import annotations

import math

from ..parameters.file import Parameters
from ..physics.ball_law import loaded_contact_angle
from ..physics.film import thermal_load_parameter
from ..physics.hertz import RACEWAYS, E_prime, reduced_radii
from ..physics.kinematics import entrainment_speed
from ..physics.lubricant import eta0
from ..physics.rating import static_rating
from ..physics.rolling_resistance import rolling_power

#: friction coefficient of SKF's sliding part, of boundary and of full film with mineral oil
BOUNDARY, FULL_FILM = 0.12, 0.05
#: f_0 of Palmgren by kind and lubrication
PALMGREN_F0 = {
    ("angular", "mist"): 1.7,
    ("angular", "bath"): 3.3,
    ("thrust", "mist"): 0.8,
    ("thrust", "bath"): 1.5,
}
#: z and y of Palmgren's f_1 = z (P_0/C_0)^y
PALMGREN_F1 = {"angular": (0.001, 0.33), "thrust": (0.0008, 0.33)}


def skf_torque(kind: str, d_m: float, axial_load: float, n: float, nu: float) -> tuple[float, float]:
    """Rolling and sliding part of SKF's friction model, no radial load, no starvation factor, no drag of an oil bath.

    Parameters   kind : "angular" or "thrust" (no other row of the catalogue's table);  axial_load [N]
    Returns      M_rr = phi_ish G_rr (nu n)^0.6, M_sl = G_sl mu_sl [N.m]
    Source       SKF rolling bearings catalogue, forms [read], constants [memory]; they give the 70 rows of
                 data/skf_torque.csv to their digits. phi_ish = 1/(1 + 1.84e-9 (n d_m)^1.28 nu^0.64),
                 mu_sl = phi_bl 0.12 + (1 - phi_bl) 0.05, phi_bl = exp(-2.6e-8 (n nu)^1.4 d_m)
    """
    if kind == "angular":
        thrown = d_m**4 * n**2
        G_rr = 5.03e-7 * d_m**1.97 * (1.90e-12 * thrown + 1.97 * axial_load) ** 0.54
        G_sl = 1.30e-2 * d_m**0.26 * ((1.91e-12 * thrown) ** (4.0 / 3.0) + 0.68 * axial_load ** (4.0 / 3.0))
    else:
        G_rr = 1.03e-6 * d_m**1.83 * axial_load**0.54
        G_sl = 1.6e-2 * d_m**0.05 * axial_load ** (4.0 / 3.0)
    heated = 1.0 / (1.0 + 1.84e-9 * (n * d_m) ** 1.28 * nu**0.64)
    on_asperities = math.exp(-2.6e-8 * (n * nu) ** 1.4 * d_m)
    mu = on_asperities * BOUNDARY + (1.0 - on_asperities) * FULL_FILM
    return 1e-3 * heated * G_rr * (nu * n) ** 0.6, 1e-3 * G_sl * mu


def palmgren_torque(
    parameters: Parameters, kind: str, oil: str, axial_load: float, n: float, nu: float
) -> float:
    """Torque of Palmgren's formula [N.m]; parameters: of caged_bearing; oil: "mist" or "bath".

    Source       Harris, Rolling Bearing Analysis [memory]: M_0 = 1e-7 f_0 (nu n)^(2/3) d_m^3, 160e-7 f_0 d_m^3 below
                 nu n = 2000; M_1 = z (P_0/C_0)^y F d_m, F = max(0.9 cot(alpha), 1) F_a, of thrust bearings F_a; N.mm.
                 differs from it: P_0/C_0 is F_a over the axial load at 4.2 GPa of this geometry
    """
    screw = parameters.screw
    d_m, f_0, (z, y) = 2e3 * screw.nominal_radius, PALMGREN_F0[kind, oil], PALMGREN_F1[kind]
    of_oil = 1e-7 * f_0 * max(nu * n, 2000.0) ** (2.0 / 3.0) * d_m**3
    load = axial_load * max(0.9 / math.tan(screw.contact_angle), 1.0)
    return 1e-3 * (of_oil + z * (axial_load / static_rating(screw)) ** y * load * d_m)


def houpert_rolling(parameters: Parameters, axial_load: float, speed: float, temperature: float) -> float:
    """Rolling part [N.m] by the closed rolling force of Houpert with the inlet heating of Aihara.

    Parameters   parameters : of caged_bearing;  axial_load [N], speed [rad/s], temperature [K]
    Source       F_R = 2.86 E' R_x^2 k^0.348 G^0.022 U^0.66 W^0.47, k = R_y/R_x, U of the mean speed: Houpert, J Tribol
                 109 (1987) 363 [memory];  1/(1 + 0.29 N^0.78): Goksem & Hargreaves, through Aihara 1987 [read]
    """
    screw, oil = parameters.screw, parameters.lubricant
    angle = float(loaded_contact_angle(screw, axial_load, screw.loaded_ball_count))
    load = axial_load / (screw.loaded_ball_count * math.sin(angle))
    E, eta, u_e = E_prime(screw), float(eta0(oil, temperature)), float(entrainment_speed(screw, speed))
    lost = 0.0
    for raceway in RACEWAYS:
        R_x, R_y = (float(R) for R in reduced_radii(screw, angle, raceway))
        W, U = load / (E * R_x**2), eta * u_e / (E * R_x)
        G = oil.pressure_viscosity * E
        force = 2.86 * E * R_x**2 * (R_y / R_x) ** 0.348 * G**0.022 * U**0.66 * W**0.47
        lost += screw.loaded_ball_count * float(rolling_power(force, u_e))
    return lost / speed / (1.0 + 0.29 * float(thermal_load_parameter(oil, u_e, temperature)) ** 0.78)
