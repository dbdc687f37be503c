"""Errata of the paper: what is printed, what is used here, and the effect in numbers.

Their texts are in data/zhao2023_errata.csv, for this page and for the documentation.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..calibration.csv_table import read_rows
from ..calibration.measurements import PACKAGED_TORQUE
from ..friction.parts import net_sliding_share, no_slip_position
from ..parameters.file import changed
from ..parameters.packaged_data import PACKAGED_DATA
from ..parameters.units import RPM
from ..physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ..physics.kinematics import surface_speeds
from ..physics.lubricant import eta0, relative_density, section_2_3, temperature_slope, viscosity
from ..validation.tables import ASSUMED_TEMPERATURE
from .material import Material

PACKAGED_ERRATA = PACKAGED_DATA / "zhao2023_errata.csv"
#: operating point of the torques below: preload [N], speed [rad/s]; both in the measured range
POINT = (1000.0, 1000.0 * RPM)
#: printed by Eq. 4 at 3000 r/min [m/s]; printed in Table 1 as the pressure coefficient [1/Pa]
EQUATION_4, SWAPPED = 0.3997, 0.032
#: pressure [Pa] and rise [K] of the effects on viscosity and density
PRESSURE, RISE = 1e9, 100.0
#: warm oil [K]
WARM = 353.0
NOT_SOLVED = "(contact not solved)"


class Erratum(NamedTuple):
    """Where, what is printed, what is used instead, the effect in numbers."""

    where: str
    printed: str
    used: str
    effect: str


def printed_errata() -> list[Erratum]:
    """The table of the file, in the order of the paper's equations; effects with {names} for their numbers."""
    return [Erratum(**row) for row in read_rows(PACKAGED_ERRATA)]


def errata_markdown() -> str:
    """The table without the effects, for the documentation."""
    rows = [("where", "printed", "used"), ("---",) * 3, *(erratum[:3] for erratum in printed_errata())]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def errata(material: Material) -> list[Erratum]:
    """All of them with their effects; the numbers need the packaged screw."""
    numbers = {
        **_speeds(material),
        **_contact(material),
        **_oil(material),
        **_heat(material),
        **_friction(material),
    }
    return [one._replace(effect=one.effect.format(**numbers)) for one in printed_errata()]


def fast_source_excess(peclet: float) -> float:
    """Largest surface temperature by the fast-source integral of Eq. 13 over the exact one, uniform strip.

    Parameters   peclet : Pe = |u| b/chi, > 0, half width b
    Source       exact: line source exp(v) K0(|v|), v = u (x-x')/(2 chi) (Carslaw & Jaeger 1959); fast: Jaeger 1942
    Example
        >>> round(fast_source_excess(0.5), 2), round(fast_source_excess(10.0), 2)
        (1.35, 1.04)
    """
    from scipy.special import k0e

    reach = 0.5 * peclet

    # integrals of K0 e^v from 0: both sides by the substitution v = t^2, which takes the logarithm at 0
    def integral(to: np.ndarray) -> np.ndarray:
        t = np.linspace(0.0, math.sqrt(2.0 * reach), 4001)
        middle = 0.5 * (t[1:] + t[:-1])
        step = np.diff(t) * 2.0 * middle
        down = np.concatenate(([0.0], np.cumsum(step * k0e(middle**2))))
        up = np.concatenate(([0.0], np.cumsum(step * k0e(middle**2) * np.exp(-2.0 * middle**2))))
        at = np.sqrt(np.abs(to))
        return np.where(to >= 0.0, np.interp(at, t, down), -np.interp(at, t, up))

    place = np.linspace(-1.0, 1.0, 2001)
    exact = integral(reach * (place + 1.0)) - integral(reach * (place - 1.0))
    return math.sqrt(2.0 * math.pi * peclet) / float(exact.max())


def _speeds(material: Material) -> dict[str, Any]:
    """Speeds at 3000 r/min [mm/s], true_u_e [m/s]."""
    speed = 3000.0 * RPM
    published = changed(material.parameters, friction={"kinematics": "published"})
    rolling = changed(material.parameters, friction={"kinematics": "rolling_frame"})
    nut, screw = surface_speeds(published, "nut", speed), surface_speeds(published, "screw", speed)
    u_e = 0.5 * (EQUATION_4 + nut.u_2)
    return {
        "screw_wall": 1e3 * screw.u_1,
        "eq4_u_e": 1e3 * u_e,
        "nut_u_e": 1e3 * nut.u_e,
        "eq4_srr": abs(EQUATION_4 - nut.u_2) / u_e,
        "nut_srr": abs(nut.srr),
        "frame_ratio": screw.u_e / nut.u_e,
        "true_u_e": surface_speeds(rolling, "nut", speed).u_e,
    }


def _contact(material: Material) -> dict[str, Any]:
    approach, thinning = [], []
    for raceway in RACEWAYS:
        s = material.contact("published", raceway)
        if s is None or s.temperature is None:
            continue
        approach.append(f"{s.hertz.delta / s.h_c:.0f}")
        # viscosity over the height of the film at the hottest place
        j, i, _ = np.unravel_index(int(np.argmax(s.temperature)), s.temperature.shape)
        across = viscosity(material.parameters.lubricant, float(s.pressure[j, i]), s.temperature[j, i])
        thinning.append(f"{float(f'{float(across.max() / across.min()):.2g}'):g}")
    return {
        "approach": " and ".join(approach) or NOT_SOLVED,
        "thinning": " and ".join(thinning) or NOT_SOLVED,
    }


def _oil(material: Material) -> dict[str, Any]:
    oil = material.parameters.lubricant
    printed = changed(material.parameters, lubricant={"viscosity_law": "roelands_printed"}).lubricant
    slopes = [1.0 * float(temperature_slope(law, ASSUMED_TEMPERATURE)) for law in (printed, oil)]
    dense, thermal = float(relative_density(oil.density_law, PRESSURE)), oil.density_temperature * RISE
    return {
        "swapped_exponent": SWAPPED * PRESSURE,
        "exponent": oil.pressure_viscosity * PRESSURE,
        "printed_slope": slopes[0],
        "slope": slopes[1],
        "thinner": float(eta0(printed, WARM) / eta0(oil, WARM)),
        "denser": dense + thermal,
        "lighter": dense - thermal,
        "ambient_ratio": float(section_2_3(ASSUMED_TEMPERATURE)) / float(eta0(oil, ASSUMED_TEMPERATURE)),
    }


def _heat(material: Material) -> dict[str, Any]:
    solid, screw = material.parameters.solid, material.parameters.screw
    chi = solid.thermal_conductivity / (solid.density * solid.specific_heat)
    load, speed, _ = material.contact_point
    published = changed(material.parameters, friction={"kinematics": "published"})
    parts = []
    for raceway in RACEWAYS:
        b = float(ellipse(load, *reduced_radii(screw, screw.contact_angle, raceway), E_prime(screw)).b)
        speeds = surface_speeds(published, raceway, speed)
        for body, u in (("raceway", speeds.u_1), ("ball", speeds.u_2)):
            pe = float(abs(u)) * b / chi
            excess = 100.0 * (fast_source_excess(pe) - 1.0)
            parts.append(f"{raceway} contact, {body}: Pe {pe:.2g}, {excess:+.0f} %")
    examples = (f"{100.0 * (fast_source_excess(pe) - 1.0):.0f} % at Pe = {pe:g}" for pe in (0.1, 0.5, 5.0))
    return {"excess": ", ".join(examples), "section5_excess": "; ".join(parts)}


def _friction(material: Material) -> dict[str, Any]:
    parameters, entry = material.parameters, material.chosen.entry
    screw, coulomb, net = (
        parameters.screw,
        parameters.friction.sliding_coefficient,
        entry.net_sliding_coefficient,
    )
    parts = (float(part) for part in material.chosen.parts(*POINT, ASSUMED_TEMPERATURE))
    viscous, hysteresis, sliding = parts
    total = viscous + hysteresis + sliding
    # 2 pi a b/3 instead of pi a b
    less = 2.0 / 3.0
    # int of r^2 (1 - r^2) over int of r^2 sqrt(1 - r^2), r from 0 to 1
    rootless = (2.0 / 15.0) / (math.pi / 16.0) - 1.0
    c = float(no_slip_position(net / coulomb))
    as_printed = coulomb * (1.0 - 0.25 * (3.0 * c - c**3))
    load = POINT[0] / (screw.ball_count * math.sin(screw.contact_angle) * math.cos(screw.lead_angle))
    radii = reduced_radii(screw, screw.contact_angle, "screw")
    length = float(ellipse(load, *radii, E_prime(screw)).a) ** 2 / (6.0 * screw.ball_diameter)
    wrong = coulomb * float(net_sliding_share(length))
    helix = screw.turns * 2.0 * math.pi * screw.nominal_radius / math.cos(screw.lead_angle)
    twice = (
        r["zhao_Nm"]
        for r in read_rows(PACKAGED_TORQUE)
        if (r["preload_N"], r["speed_rpm"]) == ("1000", "100")
    )
    return {
        "torque": total,
        "apparent_ratio": entry.apparent_viscosity_ratio,
        "plain_torque": viscous / entry.apparent_viscosity_ratio + hysteresis + sliding,
        "less_torque": total - (1.0 - less) * viscous,
        "rootless": 100.0 * rootless,
        "rootless_torque": 100.0 * rootless * hysteresis / total,
        "printed_net": as_printed,
        "net": net,
        "c": c,
        "net_ratio": as_printed / net,
        "length_um": 1e6 * length,
        "wrong_net": wrong,
        "wrong_torque": total + (wrong / net - 1.0) * sliding,
        "touching": int(helix / screw.ball_diameter),
        "twice": " and ".join(twice),
    }
