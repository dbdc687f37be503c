"""One row of a pair of support bearings from what its catalogue prints: balls, preload, loads and torque by the law.

What is not printed of the balls follows, on the pitch diameter (bore + outer diameter)/2 (IBC prints 1.00 to 1.10 of
it), from the axial rating C_a with
  the stiffness at the preload   ball within 2 %, number within 3 % of SNFA's twelve
  a filled row                   FILL: ball -5 to 3 %, number -9 to 19 %, at most 6 % of the torque
C_a is that of one row in all catalogues that were read (SNFA, NSK, IBC, INA): a pair carries an axial load with one.
Formulas: ISO 281 (physics.rating.bearing_rating), 1.01 to 1.03 of SNFA's; contact stiffness at the contact angle under
preload, 0.985 to 1.00 of SNFA's. A preload that is not printed is that at which the pair has its stiffness.

Two rows: the rings are rigid, one displacement adds to a row and takes from the other, F_a - F_b = P; beyond 2.83 of
the preload one is free. The contact angle of each row rises with its load.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ...atlas.ball_contacts import BallContacts
from ...atlas.contact_atlas import OutsideAtlasError
from ...friction.film_shear import TorqueParts
from ...friction.interval import with_constants
from ...friction.mechanistic import ContactValues, double_nut_parts, loaded_nuts, powers_of_nuts, replenished
from ...numerics import rising_root
from ...parameters.axis import SupportBearingParameters
from ...parameters.file import Parameters, ScrewParameters
from ...parameters.friction import BOUNDED, BoundedConstant
from ...parameters.units import CELSIUS, RPM
from ...physics.ball_law import loaded_contact_angle
from ...physics.rating import bearing_rating
from ...physics.stiffness import (
    axial_deflection,
    axial_stiffness,
    forces_of_displacement,
    nut_stiffness_constant,
)
from ..bearing import CAGED, bearing_parameters, needs, rings, without_lead

#: what catalogues of bearings do not print, within bounds
UNKNOWN = {
    "groove": BoundedConstant(
        0.52, 0.515, 0.53, "1", "groove radius over ball diameter, both rings", "angular contact [memory]"
    ),
    "fill": BoundedConstant(
        0.78, 0.69, 0.93, "1", "diameters of the balls of a row over the circle that they fill",
        "SNFA prints balls of 0.69 to 0.83; C_a and stiffness: IBC 0.69 to 0.84, NSK 0.86 to 0.93",
    ),
    "stiffness": BoundedConstant(
        1.0, 0.97, 1.03, "1", "printed stiffness over that of the contacts, where it gives the preload",
        "SNFA 1.00 to 1.02; twice that for other makers [assumption]",
    ),
    "replenishment_constant": BoundedConstant(
        6e-8, 0.0, 6e-8, "1", "K_rs of the table friction: oil that a greased row has not got back",
        "SKF catalogue: 6e-8 grease, 0 flooded [in programs that code it]",
    ),
}  # fmt: skip
#: ball over half of outer diameter less bore, and filled share, that can be
SIZES, FILLS = (0.05, 0.95), (0.4, 1.0)
#: preloads [N] that a stiffness may have; largest contact angle [rad] of the formula of C_a
PRELOADS, STEEPEST_RATED = (1.0, 1e6), math.radians(80.0)
FILLED = f"a row filled to {100.0 * UNKNOWN['fill'].value:g} %"
#: at which a printed torque is taken [rad/s, K]
TEST_SPEED, TEST_TEMPERATURE = 5.0 * RPM, 25.0 + CELSIUS
BOUNDARY = "boundary_friction"
#: replenishment below which the rolling part falls with speed: SKF's goes as x^0.6 exp(-k x), x = viscosity times
#: speed. Beyond it the row has this share of a flooded one, which is flagged as out of range
STARVED = math.exp(-0.6)
#: nodes of the boundary friction between which the torque is a straight line
FRICTIONS = 4


class Row(NamedTuple):
    """One of two equal rows, as screw and nut without a lead, with its preload [N]."""

    parameters: Parameters
    contacts: ContactValues
    preload: float

    def parts(self, axial_load: float, speeds: Any, temperatures: Any) -> TorqueParts:
        """Torque of both rows (s, t) at speeds (s, 1) and temperatures (t,), floats at one point."""
        forces = row_forces(self.parameters.screw, self.preload, axial_load)
        at = self.contacts, speeds, temperatures, *CAGED.values[:2]
        found = double_nut_parts(self.parameters, forces, *at)
        supply = replenished(self.parameters, np.asarray(speeds), np.asarray(temperatures))
        if np.all(supply >= STARVED):
            return found
        friction = self.parameters.friction.model_copy(update={"replenishment_constant": 0.0})
        flooded = double_nut_parts(self.parameters.model_copy(update={"friction": friction}), forces, *at)
        return found._replace(viscous=np.maximum(found.viscous, STARVED * flooded.viscous))

    @property
    def at_test(self) -> float:
        """Torque of both rows at TEST_SPEED and TEST_TEMPERATURE [N.m]."""
        return float(self.parts(0.0, TEST_SPEED, TEST_TEMPERATURE).total)

    def with_friction(self, coefficient: float) -> "Row":
        """With another boundary friction, which then counts as known."""
        return self._replace(parameters=with_constants(self.parameters, {BOUNDARY: coefficient}))

    def with_torque(self, torque: float) -> "Row":
        """With the boundary friction that gives this torque at_test, or the nearer end of its bounds."""
        known = BOUNDED[BOUNDARY]
        nodes = np.linspace(known.low, known.high, FRICTIONS)
        variants = [self.with_friction(float(node)).parameters for node in nodes]
        nuts = loaded_nuts(self.parameters, [self.preload] * 2)
        at = TEST_SPEED, TEST_TEMPERATURE, self.contacts
        torques = [2.0 * nut.torque(*CAGED.values[:2]) for (nut,) in powers_of_nuts(variants, nuts, *at)]
        return self.with_friction(float(np.interp(torque, torques, nodes)))


def row_forces(screw: ScrewParameters, preload: float, axial_load: float) -> tuple[float, float]:
    """Forces [N] of the relieved and of the loaded row under a preload > 0 and a load of any sign [N]."""
    if axial_load == 0.0:
        return preload, preload
    k = _constant(screw, screw.loaded_ball_count, preload)
    return forces_of_displacement(k, preload, axial_deflection(k, preload, abs(axial_load)))


def _constant(screw: ScrewParameters, balls: float, preload: float) -> float:
    """nut_stiffness_constant of a row of so many balls at its contact angle under the preload."""
    angle = loaded_contact_angle(screw, preload / balls, 1)
    return balls * nut_stiffness_constant(screw.model_copy(update={"loaded_ball_count": 1}), angle)


def pair_stiffness(screw: ScrewParameters, balls: float, preload: float) -> float:
    """Axial stiffness of both rows under a preload [N] alone [N/m]."""
    return axial_stiffness(_constant(screw, balls, preload), preload)


def _pitch(table: SupportBearingParameters) -> float:
    return table.pitch_diameter or 0.5 * (table.bore + table.outer_diameter)


def _rings(table: SupportBearingParameters, ball: float, balls: int, groove: float) -> ScrewParameters:
    return without_lead(rings(_pitch(table), ball, balls, table.contact_angle, groove, groove))


def balls_of(table: SupportBearingParameters, fill: float) -> tuple[float, int, str]:
    """Diameter [m] and number of the balls of a row; what gives them with C_a, "": they are printed."""
    rating, stiffness, preload = table.dynamic_rating, table.axial_stiffness, table.preload
    ball, number = table.ball_diameter, table.balls
    if ball is not None and number is not None:
        return ball, number, ""
    if rating is None:
        raise ValueError(
            "dynamic_rating (missing; in a file dynamic_rating_N); needs C_a of one row, or ball_diameter and balls"
        )
    remedy = "the formula of C_a ends there: give ball_diameter and balls"
    steepest = f"up to {STEEPEST_RATED:.4g} rad"
    needs(
        table.contact_angle <= STEEPEST_RATED, "contact_angle", table.contact_angle, "rad", steepest, remedy
    )
    section, circle = 0.5 * (table.outer_diameter - table.bore), math.pi * _pitch(table)
    ends, groove = [share * section for share in SIZES], UNKNOWN["groove"].value
    first = _rings(table, 0.5 * section, 2, groove)

    def screw(size: float) -> ScrewParameters:
        radii = dict.fromkeys(("screw_raceway_radius", "nut_raceway_radius"), groove * size)
        return first.model_copy(update={"ball_diameter": size, "loaded_ball_count": 1, **radii})

    def rated(size: float) -> float:
        """Number of balls with the rating: it falls with the ball."""
        return float((rating / bearing_rating(screw(size))) ** 1.5)

    def root(rising: Callable[[float], float]) -> float:
        found, allowed = [rising(end) for end in ends], "the rating of one row that fits the rings"
        remedy = "check it, axial_stiffness and preload, or give ball_diameter and balls"
        needs(found[0] < 0.0 < found[1], "dynamic_rating", rating, "N", allowed, remedy)
        return rising_root(rising, ends[0], ends[1], 1e-9)[0]

    how = "what is printed of them"
    if number is None:
        if ball is not None:
            share = rated(ball) * ball / circle
        elif stiffness is not None and preload is not None:
            how = "the stiffness at the preload"
            size = root(lambda size: stiffness - pair_stiffness(screw(size), rated(size), preload))
            share = rated(size) * size / circle
        else:
            how, share = FILLED, fill
            size = root(lambda size: fill * circle / size - rated(size))
        allowed = f"that of balls that fill {FILLS[0]:g} to {FILLS[1]:g} of their circle, not {share:.2f}"
        remedy = "C_a is of one row: check it, or omit axial_stiffness"
        needs(FILLS[0] <= share <= FILLS[1], "dynamic_rating", rating, "N", allowed, remedy)
        number = max(round(rated(size if ball is None else ball)), 2)
    whole = number
    return ball or root(lambda size: whole - rated(size)), whole, how


def row_of(table: SupportBearingParameters, law: Mapping[str, Any], **unknown: float) -> Row:
    """The row with values of UNKNOWN other than theirs; law: keywords of bearing, whose constants go before."""
    at = {name: of.value for name, of in UNKNOWN.items()} | unknown
    (ball, balls, _), preload = balls_of(table, at["fill"]), table.preload
    if preload is None:
        assert table.axial_stiffness is not None
        screw, stiffness = _rings(table, ball, balls, at["groove"]), table.axial_stiffness / at["stiffness"]

        def excess(ln_force: float) -> float:
            return pair_stiffness(screw, balls, math.exp(ln_force)) - stiffness

        ends, remedy = [math.log(force) for force in PRELOADS], "it is of both rows, in N/m"
        least, most = (pair_stiffness(screw, balls, force) for force in PRELOADS)
        allowed = f"{least:.3g} to {most:.3g}, at {PRELOADS[0]:g} to {PRELOADS[1]:g} N"
        needs(least < stiffness < most, "axial_stiffness", table.axial_stiffness, "N/m", allowed, remedy)
        preload = math.exp(rising_root(excess, ends[0], ends[1], 1e-9)[0])
    supply = "replenishment_constant"
    law = {**law, "friction": {supply: at[supply], **(law.get("friction") or {})}}
    groove = at["groove"]
    parameters = bearing_parameters((_pitch(table), ball, balls, table.contact_angle, groove, groove), **law)
    try:
        return Row(parameters, BallContacts(parameters), preload)
    except OutsideAtlasError as error:
        outside = str(error).split("; remedy", maxsplit=1)[0]
        raise OutsideAtlasError(f"{outside}; contacts of a pair are not solved: take another oil") from None
