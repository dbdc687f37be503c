"""Random screws and bearings as catalogues have them, and contacts of their balls.

Sizes 6 to 125 mm, leads of 0.08 to 1.2 diameters with up to four starts, grooves 0.51 to 0.58 ball diameters, contact
angles 15 to 60 deg, mineral oils ISO VG 10 to 680 with viscosity index 60 to 160, synthetic oils by two viscosities and
a pressure exponent of 0.36 to 0.76; balls of steel or silicon nitride, bodies of bearing or stainless steel. Others of
the same sizes have bodies of any effusivity and oils with exponents of 0.24 to 1.05.
Contacts: pressure to 3 GPa (60 % of the dynamic rating ends near 2.4), n d_m to 240,000 mm r/min, -10 to 90 C.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ballscrew_tehl.contact import ContactConditions
from ballscrew_tehl.parameters.file import (
    LubricantParameters,
    Parameters,
    ScrewParameters,
    SolidParameters,
    graded_oil,
)
from ballscrew_tehl.parameters.mineral_oil import D341_SHIFT
from ballscrew_tehl.parameters.oil import ROELANDS_LN, ROELANDS_PRESSURE
from ballscrew_tehl.parameters.units import CELSIUS
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.kinematics import entrainment_speed
from ballscrew_tehl.physics.lubricant import eta0

#: diameters [mm] of the shaft, mm r/min of its speed, temperatures [K], largest pressure [Pa]
DIAMETERS, SPEED_FACTOR, TEMPERATURES, PRESSURES = (6.0, 125.0), 240e3, (263.15, 363.15), (0.007e9, 3.0e9)
GRADES = (10, 15, 22, 32, 46, 68, 100, 150, 220, 320, 460, 680)
#: viscosities [Pa s] between which a contact is drawn
VISCOSITIES = (1.2e-3, 5.0)
#: bodies: Young's modulus [Pa] and walls
STEEL = 206e9, SolidParameters(density=7800.0, specific_heat=460.0, thermal_conductivity=46.0)
STAINLESS = 204e9, SolidParameters(density=7700.0, specific_heat=460.0, thermal_conductivity=22.0)
#: pressure exponents of ordinary oils, of polyglycols and thin esters (alpha 10 to 15 1/GPa), of fluorinated oils and
#: traction fluids (30 to 45)
ORDINARY_Z, OTHER_Z = (0.36, 0.76), ((0.24, 0.40), (0.72, 1.05))
#: effusivity of bodies over that of bearing steel: from balls of zirconia on stainless steel to plain carbon steel, and
#: beyond
WALLS = 0.4, 1.35


def any_body(random: np.random.Generator) -> SolidParameters:
    """A body of the density and heat of steel whose effusivity lies anywhere in WALLS."""
    wall = WALLS[0] * (WALLS[1] / WALLS[0]) ** random.random()
    steel = STEEL[1]
    return steel.model_copy(update={"thermal_conductivity": wall**2 * steel.thermal_conductivity})


def random_oil(random: np.random.Generator) -> LubricantParameters:
    """A mineral oil by its grade, or one in three a synthetic one."""
    if random.random() < 0.67:
        while True:
            grade, index = int(random.choice(GRADES)), random.uniform(60.0, 160.0)
            try:
                return graded_oil(grade, index)
            except ValueError:  # no such index at the lowest grades
                continue
    return synthetic_oil(random, ORDINARY_Z)


def synthetic_oil(random: np.random.Generator, of_z: tuple[float, float]) -> LubricantParameters:
    """An oil by two viscosities, with a pressure exponent between two."""
    nu_40 = 10.0 * 68.0 ** random.random()
    # slope of ASTM D341: 2.8 for silicone-like, 3.3 to 4.1 for mineral, 6 for the law of Zhao et al. 2023
    slope = random.uniform(2.8, 4.0) if random.random() < 0.8 else random.uniform(4.0, 6.3)
    step = math.log10(373.15 / 313.15)
    other = 10.0**10.0 ** (math.log10(math.log10(nu_40 + D341_SHIFT)) - slope * step) - D341_SHIFT
    density, z = random.uniform(800.0, 960.0), random.uniform(*of_z)
    level = math.log(1e-6 * nu_40 * density) + ROELANDS_LN
    return LubricantParameters(
        name="synthetic", viscosity_law="astm_d341", density=density, reference_temperature=40.0 + CELSIUS,
        density_temperature=6.5e-4, specific_heat=random.uniform(1850.0, 2250.0),
        thermal_conductivity=random.uniform(0.125, 0.155), astm_viscosity_1=1e-6 * nu_40,
        astm_temperature_1=40.0 + CELSIUS, astm_viscosity_2=1e-6 * max(other, 0.31), astm_temperature_2=100.0 + CELSIUS,
        pressure_viscosity=z * level / ROELANDS_PRESSURE, z_roelands=z,
    )  # fmt: skip


def random_screw(random: np.random.Generator) -> Parameters:
    """A screw of a size, lead, groove and oil at random; bearings are its limit of a small lead.

    One in six has balls of silicon nitride, one in ten is of stainless steel.
    """
    diameter = DIAMETERS[0] * (DIAMETERS[1] / DIAMETERS[0]) ** random.random()
    lead = max(0.08 * diameter * 15.0 ** random.random(), 1.0)
    starts = 1 + int(lead > 0.6 * diameter) + 2 * int(lead > 0.9 * diameter)
    ball = min(0.635 * lead / starts * random.uniform(0.8, 1.05), 0.2 * diameter * random.uniform(0.75, 1.1))
    ball = max(ball, 0.6)
    grooves = 0.51 + 0.07 * random.random(2) ** 1.5
    radius = 0.5 * (diameter + 0.27 * ball)
    angle = 45.0 if random.random() < 0.6 else random.uniform(15.0, 60.0)
    kinds = ["double_nut", "single_nut_oversize_ball"]
    modulus, body = STAINLESS if random.random() < 0.1 else STEEL
    balls = "silicon_nitride" if random.random() < 1.0 / 6.0 else "steel"
    screw = ScrewParameters(
        preload_kind=kinds[int(random.random() < 0.3)], nominal_radius=1e-3 * radius, ball_diameter=1e-3 * ball,
        contact_angle=math.radians(angle), screw_raceway_radius=1e-3 * ball * grooves[0],
        nut_raceway_radius=1e-3 * ball * grooves[1], lead=1e-3 * lead, turns=random.uniform(1.5, 6.0),
        youngs_modulus=modulus, poisson_ratio=0.3, ball_material=balls,
    )  # fmt: skip
    oil = random_oil(random)
    return Parameters(name=f"random {diameter:.3g}x{lead:.3g}", screw=screw, solid=body, lubricant=oil)


def of_other_materials(drawn: Parameters, random: np.random.Generator, other_oils: float) -> Parameters:
    """The same screw with any body, and with a share of other_oils an oil beyond the ordinary pressure exponents."""
    result = drawn.model_copy(update={"solid": any_body(random)})
    if random.random() >= other_oils:
        return result
    return result.model_copy(update={"lubricant": synthetic_oil(random, OTHER_Z[int(random.random() < 0.5)])})


class Contact(NamedTuple):
    """A contact to solve: conditions, oil, solids of body and ball."""

    conditions: ContactConditions
    oil: LubricantParameters
    solids: tuple[SolidParameters, SolidParameters]


def random_contact(drawn: Parameters, random: np.random.Generator) -> Contact | None:
    """A contact of a ball in pure rolling, three in four as maps have them; None: the oil is too thick or thin."""
    screw, oil = drawn.screw, drawn.lubricant
    usual = random.random() < 0.75
    raceway = RACEWAYS[int(random.random() < 0.5)]
    if usual:
        pressure, slowest = 0.15e9 * (2.2 / 0.15) ** random.random(), 1.0 / 1200.0
    else:
        pressure, slowest = PRESSURES[0] * (PRESSURES[1] / PRESSURES[0]) ** random.random(), 1.0 / 4800.0
    temperature = random.uniform(283.15, 353.15) if usual else random.uniform(*TEMPERATURES)
    if not VISCOSITIES[0] <= float(eta0(oil, temperature)) <= VISCOSITIES[1]:
        return None
    fastest = SPEED_FACTOR * math.pi / 30.0 / (2e3 * screw.nominal_radius)
    u_e = float(entrainment_speed(screw, fastest * slowest ** random.random()))
    angle = min(max(screw.contact_angle + random.uniform(0.0, 0.03), 0.2), 1.2)
    R_x, R_y = (float(r) for r in reduced_radii(screw, angle, raceway))
    modulus = E_prime(screw)
    load = (pressure / float(ellipse(1.0, R_x, R_y, modulus).p_max)) ** 3
    return Contact(ContactConditions(load, R_x, R_y, u_e, u_e, temperature, modulus), oil, drawn.solids)


def contact_pool(seed: int, screws: int, each: int, other_oils: bool = False) -> list[Contact]:
    """Contacts of random screws, `each` tries of `screws` of them; other_oils: with any body and other oils."""
    random = np.random.default_rng(seed)
    result = []
    for _ in range(screws):
        drawn = random_screw(random)
        if other_oils:
            drawn = of_other_materials(drawn, random, 1.0)
        result += [contact for _ in range(each) if (contact := random_contact(drawn, random)) is not None]
    return result
