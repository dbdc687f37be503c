"""Errata of the paper: what is printed, what is used here, and the effect in numbers."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..calibration.csv_table import read_rows
from ..calibration.measurements import PACKAGED_TORQUE
from ..friction.parts import net_sliding_share, no_slip_position
from ..parameters.file import changed
from ..parameters.units import RPM
from ..physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ..physics.kinematics import surface_speeds
from ..physics.lubricant import eta0, relative_density, section_2_3, temperature_slope, viscosity
from ..validation.tables import ASSUMED_TEMPERATURE
from .material import Material

#: operating point of the torques below: preload [N], speed [rad/s]; both in the measured range
POINT = (1000.0, 1000.0 * RPM)
#: printed by Eq. 4 at 3000 r/min [m/s]
EQUATION_4 = 0.3997
#: printed in Table 1 with the symbols: pressure coefficient [1/Pa] and temperature coefficient [1/K], swapped
SWAPPED = (0.032, 1.85e-8)


class Erratum(NamedTuple):
    """Where, what is printed, what is used instead, the effect in numbers."""

    where: str
    printed: str
    used: str
    effect: str


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


def errata(material: Material) -> list[Erratum]:
    """All of them, in the order of the paper's equations; the numbers need the packaged screw."""
    return [
        *_speeds(material),
        *_contact(material),
        *_oil(material),
        *_heat(material),
        *_friction(material),
        *_tables(material),
    ]


def _speeds(material: Material) -> list[Erratum]:
    published = changed(material.parameters, friction={"kinematics": "published"})
    nut = surface_speeds(published, "nut", 3000.0 * RPM)
    u_e = 0.5 * (EQUATION_4 + nut.u_2)
    srr = abs(EQUATION_4 - nut.u_2) / u_e
    rolling = changed(material.parameters, friction={"kinematics": "rolling_frame"})
    true = surface_speeds(rolling, "nut", 3000.0 * RPM)
    screw = surface_speeds(published, "screw", 3000.0 * RPM)
    return [
        Erratum(
            "Eq. 3",
            "a term without its square",
            "r_b^2 sin^2; the pair of speeds that the printed values imply",
            f"{1e3 * screw.u_1:.1f} mm/s for the screw at 3000 r/min, as the printed screw values need",
        ),
        Erratum(
            "Eq. 4",
            f"gives {1e3 * EQUATION_4:.1f} mm/s for the nut at 3000 r/min",
            f"{1e3 * nut.u_1:.1f} mm/s, the only one that agrees with both printed nut values",
            f"entrainment {1e3 * u_e:.0f} instead of {1e3 * nut.u_e:.0f} mm/s, slide-to-roll ratio "
            f"{srr:.3f} instead of {abs(nut.srr):.3f}",
        ),
        Erratum(
            "Eqs. 1 to 4",
            "surface speeds in the fixed frame",
            "available as kinematics published; rolling_frame as the alternative",
            f"entrainment of screw over nut {screw.u_e / nut.u_e:.2f}; seen from the ball both are "
            f"{true.u_e:.3f} m/s and there is no mean sliding",
        ),
    ]


def _contact(material: Material) -> list[Erratum]:
    shares, thinning = [], []
    for raceway in RACEWAYS:
        s = material.contact("published", raceway)
        if s is None or s.temperature is None:
            continue
        shares.append(f"{s.hertz.delta / s.h_c:.0f}")
        # viscosity over the height of the film at the hottest place
        j, i, _ = np.unravel_index(int(np.argmax(s.temperature)), s.temperature.shape)
        column = s.temperature[j, i]
        across = viscosity(material.parameters.lubricant, float(s.pressure[j, i]), column)
        thinning.append(f"{float(f'{float(across.max() / across.min()):.2g}'):g}")
    none = "contact not solved"
    return [
        Erratum(
            "Eq. 5",
            "density and viscosity constant across the film",
            "generalised Reynolds equation, integrated across the film",
            f"viscosity varies across the film {' and '.join(thinning)} times (screw and nut, section 5.1, "
            "at the hottest place)"
            if thinning
            else none,
        ),
        Erratum(
            "Eq. 6",
            "gap without the deflection of the bodies",
            "deflection of the half-spaces added",
            f"Hertz approach of {' and '.join(shares)} central films (screw and nut, section 5.1)"
            if shares
            else none,
        ),
        Erratum(
            "Eq. 12",
            "continuity misprinted",
            "d(rho u)/dx + d(rho v)/dy + d(rho w)/dz = 0",
            "no number: the printed form is not used",
        ),
    ]


def _oil(material: Material) -> list[Erratum]:
    oil = material.parameters.lubricant
    alpha, hot, p = oil.pressure_viscosity, 100.0, 1e9
    thermal = oil.density_temperature * hot
    ambient = float(eta0(oil, ASSUMED_TEMPERATURE))
    text = float(section_2_3(ASSUMED_TEMPERATURE))
    viscous, hysteresis, sliding = material.chosen.parts(*POINT, ASSUMED_TEMPERATURE)
    ratio = material.chosen.entry.apparent_viscosity_ratio
    plain = viscous / ratio + hysteresis + sliding
    total = viscous + hysteresis + sliding
    printed_law = changed(material.parameters, lubricant={"viscosity_law": "roelands_printed"}).lubricant
    slopes = [1.0 * float(temperature_slope(law, ASSUMED_TEMPERATURE)) for law in (printed_law, oil)]
    warm = 353.0
    thinner = float(eta0(printed_law, warm) / eta0(oil, warm))
    dense = float(relative_density(oil.density_law, p))
    return [
        Erratum(
            "Table 1",
            f"pressure coefficient {SWAPPED[0]:g}, temperature coefficient {SWAPPED[1]:g} (symbols swapped)",
            f"by their units: {alpha:g} 1/Pa, {oil.temperature_viscosity:g} 1/K",
            f"exponent of the viscosity at 1 GPa (Barus): {SWAPPED[0] * p:.1e} as printed, {alpha * p:.1f} as used",
        ),
        Erratum(
            "Eq. 7",
            f"temperature coefficient {printed_law.temperature_viscosity:g} 1/K",
            "the law of section 2.3, scaled to Table 1; the printed one is kept by name (roelands_printed)",
            f"ln viscosity changes by {slopes[0]:.3f} per K as printed, {slopes[1]:.3f} as used (303 K); at "
            f"{warm:g} K the printed law gives {thinner:.1f} times the viscosity",
        ),
        Erratum(
            "Eq. 8",
            "sign for a density that rises with temperature",
            "density falls with temperature",
            f"at 1 GPa and {hot:.0f} K above the inlet: {dense + thermal:.3f} as printed, "
            f"{dense - thermal:.3f} as used",
        ),
        Erratum(
            "Table 1, section 2.3",
            f"two ambient viscosities at 303 K: {ambient:.3f} and {text:.3f} Pa s",
            f"film with {ambient:.3f}; shear with the apparent viscosity ratio, calibrated to {ratio:.2f}",
            f"{text / ambient:.1f} times apart; with {ambient:.3f} for both the torque at 1000 N, 1000 "
            f"r/min is {plain:.3f} instead of {total:.3f} N m",
        ),
    ]


def _heat(material: Material) -> list[Erratum]:
    solid = material.parameters.solid
    chi = solid.thermal_conductivity / (solid.density * solid.specific_heat)
    screw, load = material.parameters.screw, material.contact_point[0]
    published = changed(material.parameters, friction={"kinematics": "published"})
    parts = []
    for raceway in RACEWAYS:
        b = float(ellipse(load, *reduced_radii(screw, screw.contact_angle, raceway), E_prime(screw)).b)
        speeds = surface_speeds(published, raceway, material.contact_point[1])
        for body, u in (("raceway", speeds.u_1), ("ball", speeds.u_2)):
            pe = float(abs(u)) * b / chi
            parts.append(
                f"{raceway} contact, {body}: Pe {pe:.2g}, {100.0 * (fast_source_excess(pe) - 1.0):+.0f} %"
            )
    examples = ", ".join(
        f"{100.0 * (fast_source_excess(pe) - 1.0):.0f} % at Pe = {pe:g}" for pe in (0.1, 0.5, 5.0)
    )
    return [
        Erratum(
            "Eq. 13, second line",
            "heat flux into the upper wall without its minus",
            "-k dT/dz at the upper wall",
            "with the printed sign heat from the film would cool that wall",
        ),
        Erratum(
            "Eq. 13",
            "fast moving source at every speed",
            "moving point source, any speed (surface at rest included)",
            f"largest rise of the wall too high by {examples}; in section 5.1: {'; '.join(parts)}",
        ),
    ]


def _friction(material: Material) -> list[Erratum]:
    parameters, friction = material.parameters, material.chosen
    viscous, hysteresis, sliding = (float(part) for part in friction.parts(*POINT, ASSUMED_TEMPERATURE))
    total = viscous + hysteresis + sliding
    # 2 pi a b/3 instead of pi a b
    less = 2.0 / 3.0
    # int of r^2 (1 - r^2) over int of r^2 sqrt(1 - r^2), r from 0 to 1
    rootless = (2.0 / 15.0) / (math.pi / 16.0)
    net = friction.entry.net_sliding_coefficient
    coulomb = parameters.friction.sliding_coefficient
    c = float(no_slip_position(net / coulomb))
    inside = 0.5 * (3.0 * c - c**3)
    as_printed = coulomb * (1.0 - 0.5 * inside)
    screw = parameters.screw
    load = POINT[0] / (screw.ball_count * math.sin(screw.contact_angle) * math.cos(screw.lead_angle))
    radii = reduced_radii(screw, screw.contact_angle, "screw")
    a = float(ellipse(load, *radii, E_prime(screw)).a)
    length = a**2 / (6.0 * screw.ball_diameter)
    wrong = coulomb * float(net_sliding_share(length))
    return [
        Erratum(
            "Eq. 15",
            "integral 2 pi a b/3, result pi a b",
            "the printed result pi a b",
            f"with the integral the torque at 1000 N, 1000 r/min is {total - (1.0 - less) * viscous:.3f} "
            f"instead of {total:.3f} N m",
        ),
        Erratum(
            "Eq. 18",
            "integrand without the square root of the Hertz pressure",
            "with it, as in the printed result",
            f"hysteresis torque {100.0 * (rootless - 1.0):+.0f} %, torque "
            f"{100.0 * (rootless - 1.0) * hysteresis / total:+.2f} %",
        ),
        Erratum(
            "Eq. 21",
            "middle integral with opposite sign and half weight",
            "1 - 3c + c^3, as in the printed result",
            f"net sliding coefficient {as_printed:.3f} instead of {net:.4f} at the calibrated c = {c:.3f}: "
            f"{as_printed / net:.0f} times the sliding torque",
        ),
        Erratum(
            "Eq. 21",
            "c = a^2/(6 d_b), a length",
            "c as a fraction of the semi-axis, in one calibrated net coefficient",
            f"{1e6 * length:.1f} um at 1000 N; taken as a number it gives {wrong:.3f} instead of {net:.4f}: "
            f"torque at 1000 N, 1000 r/min {total + (wrong / net - 1.0) * sliding:.2f} instead of "
            f"{total:.2f} N m",
        ),
    ]


def _tables(material: Material) -> list[Erratum]:
    screw = material.parameters.screw
    helix = screw.turns * 2.0 * math.pi * screw.nominal_radius / math.cos(screw.lead_angle)
    rows = [
        row for row in read_rows(PACKAGED_TORQUE) if (row["preload_N"], row["speed_rpm"]) == ("1000", "100")
    ]
    return [
        Erratum(
            "Table 1",
            f"{screw.ball_count} balls in {screw.turns:g} turns",
            f"{screw.ball_count} in the friction sums, as the printed torques need; "
            f"{screw.loaded_ball_count} carry load",
            f"the turns hold at most {int(helix / screw.ball_diameter)} touching balls",
        ),
        Erratum(
            "Tables 2 and 4",
            "the paper's own model at 1000 N, 100 r/min",
            "each value in its table; the measured point counts once",
            " and ".join(row["zhao_Nm"] for row in rows) + " N m for the same point",
        ),
    ]
