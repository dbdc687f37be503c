"""Friction torque of a caged ball bearing under an axial load, by the mechanistic law of the ball screw.

The rings are screw and nut without a lead, all balls carry the same load, and a cage keeps them from each other, so
that nothing of the law is fitted. It is how the law is compared with machines that it was not made for:
examples/paper/machines.py.
"""

import math
from collections.abc import Mapping
from numbers import Integral
from typing import Any, NamedTuple

from pydantic import ValidationError

from ..friction.interval import OperatingPoint, torque_interval
from ..friction.mechanistic import ContactValues, double_nut_parts
from ..friction.sets import FrictionSet
from ..parameters.file import (
    FrictionTable,
    Law,
    LubricantParameters,
    Parameters,
    ScrewParameters,
    SolidParameters,
    graded_oil,
)
from ..parameters.units import COLDEST, HOTTEST
from ..physics.hertz import RACEWAYS, reduced_radii
from ..refinement.contacts import contacts_of

#: what a screw needs and a bearing has not, so small that it does not count: lead over ball diameter, and section of
#: the bodies between two balls over its square. The loads of the balls then differ by less than 1e-3; they would be
#: lost in rounding without any stretch of the bodies
LEAD, SECTION = 1e-6, 1e-3
#: contact angles [rad]: least, and one that stands for a right angle, at which a contact has no radius of its own
FLATTEST, STEEPEST = math.radians(1.0), math.radians(89.99)
#: widest groove over ball diameter
WIDEST_GROOVE = 2.0
#: least and highest temperature [K] of an oil with a viscosity
TEMPERATURES = (COLDEST, HOTTEST)
#: least speed [rad/s]: films of fractions of a nanometre, sheared by boundary friction; below, it does not change
SLOWEST = 0.01
#: constants of the law that a bearing has, by their names in the table friction of a screw file
CONSTANTS = (
    "supply_length", "replenishment_constant", "roughness_height", "asperity_film_ratio", "boundary_friction",
    "limiting_shear_coefficient", "hysteresis_coefficient",
)  # fmt: skip
#: Young's modulus [Pa] and Poisson's ratio of rings and balls, and their walls
MODULUS, POISSON = 206e9, 0.3
WALLS = SolidParameters(density=7800.0, specific_heat=460.0, thermal_conductivity=46.0)
#: the law with nothing fitted: factor of the rolling part 1, no ball on ball
CAGED = FrictionSet(Law.MECHANISTIC, 1.0, 0.0)


class BearingTorque(NamedTuple):
    """Torque by part, their sum, and the interval of the sum that contains about 80 % of the torques.

    Attributes
    ----------
    rolling : float
        Hydrodynamic resistance of both raceways [N.m].
    sliding : float
        Spin and differential slip [N.m].
    hysteresis : float
        Of the steel [N.m].
    total : float
        Sum [N.m].
    low, high : float
        Interval of the sum [N.m].
    """

    rolling: float
    sliding: float
    hysteresis: float
    total: float
    low: float
    high: float


class Bearing(NamedTuple):
    """Bearing as the friction law takes it.

    Attributes
    ----------
    parameters : Parameters
        Rings and balls, as screw and nut without a lead.
    contacts : ContactValues
        Contacts of the balls.
    """

    parameters: Parameters
    contacts: ContactValues

    def torque(self, axial_load: float, speed: float, temperature: float) -> BearingTorque:
        """Friction torque of the inner ring against the outer one.

        Parameters
        ----------
        axial_load : float
            Axial load [N], > 0.
        speed : float
            Speed of one ring against the other [rad/s], >= SLOWEST.
        temperature : float
            Temperature of the oil [K].

        Returns
        -------
        BearingTorque
            Torque [N.m] by part, total and interval.

        Raises
        ------
        ValueError
            An argument out of range.
        ArithmeticError
            A contact or the equilibrium of a ball did not converge.

        Notes
        -----
        friction.mechanistic; the interval: friction.interval, without the ball-to-ball contact force.
        """
        low, high = TEMPERATURES
        loaded, slow = 0.0 < axial_load < math.inf, "below it the torque no longer depends on speed"
        needs(loaded, "axial_load", axial_load, "N", "> 0", "no load, no friction of the law")
        needs(SLOWEST <= speed < math.inf, "speed", speed, "rad/s", f">= {SLOWEST:g}", slow)
        warm, allowed = low <= temperature <= high, f"{low:g} to {high:g}"
        needs(warm, "temperature", temperature, "K", allowed, "is it in kelvin?")
        at = self.parameters, [float(axial_load)], self.contacts, float(speed), float(temperature)
        parts, point = double_nut_parts(*at, *CAGED.values[:2]), OperatingPoint(at[1][0], *at[3:])
        rolling, hysteresis, sliding = map(float, parts)
        # two such bearings have the same relative interval
        ends = torque_interval(self.parameters, point, self.contacts, CAGED).relative
        total = float(parts.total)
        low, high = (end * total for end in ends)
        return BearingTorque(rolling, sliding, hysteresis, total, low, high)


def bearing(
    pitch_diameter: float,
    ball_diameter: float,
    balls: int,
    contact_angle: float,
    inner_conformity: float,
    outer_conformity: float,
    iso_vg: int = 68,
    viscosity_index: float = 95.0,
    *,
    oil: LubricantParameters | None = None,
    friction: Mapping[str, Any] | None = None,
    solved: bool = False,
) -> Bearing:
    """Caged single-row ball bearing under a pure axial load.

    Parameters
    ----------
    pitch_diameter, ball_diameter : float
        Diameters [m].
    balls : int
        Number of balls.
    contact_angle : float
        Contact angle without load [rad]; pi/2 for a thrust bearing.
    inner_conformity, outer_conformity : float
        Groove radius over ball diameter, above 0.5.
    iso_vg : int, optional
        ISO grade of a mineral oil.
    viscosity_index : float, optional
        Its viscosity index.
    oil : LubricantParameters, optional
        Another oil.
    friction : mapping of str to float, optional
        Constants of the law by their name in the table friction of a screw file, SI, such as supply_length
        (math.inf: flooded); those that are given count as known in the interval.
    solved : bool, optional
        Solve each contact, some tenths of a second, instead of the atlas.

    Returns
    -------
    Bearing
        With torque(axial_load, speed, temperature).

    Raises
    ------
    ValueError
        An argument out of range.

    Notes
    -----
    Not modelled: the cage and its friction, seals, churning; the centrifugal load of the balls; radial load, moments.
    All balls carry the same load; their contact angle rises with it, without clearance.

    Examples
    --------
    7208 B, 1 kN, 1000 r/min, 40 C:

    >>> result = bearing(60e-3, 12.303e-3, 14, 0.698, 0.52, 0.52).torque(1000.0, 104.7, 313.15)
    >>> result.low < result.rolling + result.sliding + result.hysteresis < result.high
    True
    """
    sizes = pitch_diameter, ball_diameter, balls, contact_angle, inner_conformity, outer_conformity
    parameters = bearing_parameters(sizes, iso_vg, viscosity_index, oil, friction)
    return Bearing(parameters, contacts_of(parameters, solved))


def bearing_parameters(
    sizes: tuple[float, float, int, float, float, float],
    iso_vg: int = 68,
    viscosity_index: float = 95.0,
    oil: LubricantParameters | None = None,
    friction: Mapping[str, Any] | None = None,
) -> Parameters:
    """Rings and balls as screw and nut without a lead; sizes: of rings, other arguments and ValueError of bearing."""
    screw = rings(*sizes)
    given, remedy = dict(friction or {}), "a bearing has no other constant"
    for name in given:
        needs(name in CONSTANTS, "friction", name, "", ", ".join(CONSTANTS), remedy)
    try:
        law = FrictionTable(**given, net_sliding_coefficient=0.0, neighbour_oil=0.0)
    except ValidationError as err:
        first = err.errors()[0]
        where = ".".join(map(str, ("friction", *first["loc"])))
        raise ValueError(f"{where} = {first['input'] if first['loc'] else given}; {first['msg']}") from None
    D, d = 2e3 * screw.nominal_radius, 1e3 * screw.ball_diameter
    parameters = Parameters(
        name=f"bearing {D:g} mm, {sizes[2]} balls of {d:g} mm", screw=screw, solid=WALLS,
        lubricant=graded_oil(iso_vg, viscosity_index) if oil is None else oil, friction=law,
    )  # fmt: skip
    return parameters.model_copy(update={"screw": without_lead(screw)})


def rings(
    pitch_diameter: float,
    ball_diameter: float,
    balls: int,
    contact_angle: float,
    inner_conformity: float,
    outer_conformity: float,
) -> ScrewParameters:
    """Rings and balls of one row as screw and nut of a short lead; arguments and ValueError of bearing."""
    D, d = float(pitch_diameter), float(ball_diameter)
    needs(0.0 < D <= 2.0, "pitch_diameter", D, "m", "> 0, up to 2 m", "is it in metres?")
    needs(0.0 < d < 0.5 * D, "ball_diameter", d, "m", f"> 0, < {0.5 * D} m", "half of pitch_diameter")
    most = int(math.pi / math.asin(d / D))
    valid = isinstance(balls, Integral) and 2 <= balls <= most
    needs(valid, "balls", balls, "", f"2 to {most}, whole", "more do not fit the pitch circle")
    valid, allowed = FLATTEST <= contact_angle <= 0.5 * math.pi, f"{FLATTEST:.4f} to pi/2 rad"
    needs(valid, "contact_angle", contact_angle, "rad", allowed, "is it in radians?")
    grooves = {"inner_conformity": inner_conformity, "outer_conformity": outer_conformity}
    for name, value in grooves.items():
        valid, allowed = 0.5 < value <= WIDEST_GROOVE, f"> 0.5, up to {WIDEST_GROOVE:g}"
        needs(valid, name, value, "", allowed, "it is groove radius over ball diameter")
    screw = ScrewParameters(
        nominal_radius=0.5 * D, ball_diameter=d, contact_angle=0.25 * math.pi, lead=2.0 * d, turns=1.0,
        screw_raceway_radius=inner_conformity * d, nut_raceway_radius=outer_conformity * d, ball_count=int(balls),
        screw_section_area=SECTION * d**2, nut_section_area=SECTION * d**2,
        youngs_modulus=MODULUS, poisson_ratio=POISSON, preload_basis="force",
    )  # fmt: skip
    # beyond the contact angles of a screw file
    screw = screw.model_copy(update={"contact_angle": min(float(contact_angle), STEEPEST)})
    for name, raceway in zip(grooves, RACEWAYS, strict=True):
        R_x, R_y = reduced_radii(screw, screw.contact_angle, raceway)
        allowed = "a contact that is longer across rolling"
        needs(R_x <= R_y, name, grooves[name], "", allowed, "take a narrower groove")
    return screw


def without_lead(screw: ScrewParameters) -> ScrewParameters:
    """With a lead at which the grooves of a screw would meet."""
    lead = LEAD * screw.ball_diameter
    angle = math.atan(lead / (2.0 * math.pi * screw.nominal_radius))
    return screw.model_copy(update={"lead": lead, "lead_angle": angle})


def needs(valid: bool, name: str, value: object, unit: str, allowed: str, remedy: str) -> None:
    """Raise a ValueError unless valid (a comparison with NaN is false)."""
    if not valid:
        raise ValueError(f"{name} = {value}{' ' * bool(unit)}{unit}; needs {allowed}: {remedy}")
