"""Friction and true preload of a delivered screw from the drag torque that its maker prints or that was measured.

A maker sets a preload by its torque, so that the printed preload is a name: the torque fixes the product of friction
and force. Its deviation from the law is divided between both in proportion to their variances in ln(torque);
friction.interval conditions all constants on it.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..atlas.ball_contacts import BallContacts
from ..numerics import rising_root
from ..parameters.file import Law, Parameters, graded_oil
from ..parameters.friction import PRELOAD_FORCE
from ..parameters.identity import parameters_hash
from ..parameters.units import CELSIUS, RPM
from ..physics.thermal_preload import preload_at_temperature_difference
from .interval import DEVIATIONS, OperatingPoint, effects_at, learned, unknown_constants
from .mechanistic import ContactValues, double_nut_parts
from .sets import DRAG_TORQUE, PRELOAD, FrictionSet, default_friction_set

#: viscosity index of the oil of a test
TEST_INDEX = 95.0
#: largest factor of a drag torque over that of the law at the middle of what is not known, either way: kgf.cm for N.m
#: are a factor of 10
FARTHEST = 4.0


#: keys of an answer: true preload that a drag torque implies, and its interval of about 80 %
IMPLIED = "preload_implied_n", "preload_implied_low_n", "preload_implied_high_n"


def implied_preload(friction_set: FrictionSet, preload: float) -> dict[str, float]:
    """True force [N] of a nominal preload with a set of drag_torque_set, under IMPLIED; {}: no drag torque says it."""
    if not friction_set.nominal:
        return {}
    result, low, high = friction_set.learned, math.log(PRELOAD_FORCE.low), math.log(PRELOAD_FORCE.high)
    deviation, place = (high - low) / math.sqrt(12.0), list(result["mean"]).index(PRELOAD)
    middle = 0.5 * (low + high) + deviation * result["mean"][PRELOAD]
    wide = DEVIATIONS * deviation * math.sqrt(max(result["covariance"][PRELOAD][place], 0.0))
    factor = friction_set.preload_factor
    ends = min(math.exp(middle - wide), factor), max(math.exp(middle + wide), factor)
    return {name: value * preload for name, value in zip(IMPLIED, (factor, *ends), strict=True)}


def preload_left(
    parameters: Parameters, friction_set: FrictionSet, preload: float, difference: float
) -> float:
    """Nominal preload [N] whose true force is left where the screw is warmer than the nut by a difference [K]."""
    if not difference:
        return preload
    factor = friction_set.preload_factor
    of_nut = parameters.screw, factor * preload, difference, parameters.summed_balls
    return preload_at_temperature_difference(*of_nut) / factor


def in_test_oil(parameters: Parameters) -> Parameters:
    """The screw in the oil of its drag torque; itself where that is its own grade of oil."""
    grade, oil = parameters.screw.drag_torque_oil, parameters.lubricant
    if oil.iso_vg == grade and oil.nlgi is None:
        return parameters
    tolerance = {"temperature_tolerance": oil.temperature_tolerance}
    test = graded_oil(grade, TEST_INDEX).model_copy(update=tolerance)
    return parameters.model_copy(update={"lubricant": test})


def drag_torque_set(
    parameters: Parameters, contacts: Callable[[Parameters], ContactValues] = BallContacts
) -> FrictionSet | None:
    """Numbers with which the law has the drag torque of the screw file at its point, and what it says of the constants.

    None: the screw file states none, or the law is another one. ValueError: the law cannot have it, or the file leaves
    nothing open that it could fix. The tolerance holds 80 % of the torque, as friction.interval takes it.
    """
    screw = parameters.screw
    torque, preload = screw.drag_torque, screw.drag_torque_preload
    if torque is None or preload is None or parameters.friction.law is not Law.MECHANISTIC:
        return None
    tested = in_test_oil(parameters)
    point = OperatingPoint(preload, screw.drag_torque_speed, screw.drag_torque_temperature)
    around, usual = contacts(tested), default_friction_set(tested)
    entry = FrictionSet(
        usual.law, usual.apparent_viscosity_ratio, usual.net_sliding_coefficient, loss=DRAG_TORQUE,
        provenance=f"drag torque of the screw file, {torque:.4g} N.m at {preload:g} N, {point.speed / RPM:.4g} r/min, "
        f"{point.temperature - CELSIUS:.4g} C, ISO VG {screw.drag_torque_oil}",
        screw=parameters.name, parameters_hash=parameters_hash(tested),
        screw_hash=parameters_hash(tested, oil=False), nlgi=tested.lubricant.nlgi or "",
    )  # fmt: skip
    unknown = unknown_constants(tested)
    where = f"screw.drag_torque_Nm = {torque:.4g} at {preload:g} N"
    if not {PRELOAD, "ball_thrust"} & {*unknown}:
        raise ValueError(
            f"{where}; allowed: preload_basis = nominal, or no coefficient: it can fix neither force nor friction"
        )
    deviation = effects_at(tested, point, around, entry, unknown).deviation
    variance = {name: float(one[0]) ** 2 for name, one in deviation.items()}
    # between the force and all that is friction
    to_preload = variance.get(PRELOAD, 0.0) / sum(variance.values()) if "ball_thrust" in unknown else 1.0
    middle = math.sqrt(PRELOAD_FORCE.low * PRELOAD_FORCE.high) if PRELOAD in unknown else 1.0

    def at(x: float) -> FrictionSet:
        coefficient, factor = entry.net_sliding_coefficient * x ** (1.0 - to_preload), middle * x**to_preload
        return replace(entry, net_sliding_coefficient=coefficient, preload_factor=factor)

    def excess(x: float) -> float:
        own = at(x)
        place = tested, point.forces(tested, own.preload_factor), around, *point[1:3]
        return float(double_nut_parts(*place, *own.values[:2]).total) - torque

    least, largest = excess(1.0 / FARTHEST), excess(FARTHEST)
    if not least < 0.0 < largest:
        allowed = f"{torque + least:.3g} to {torque + largest:.3g} N.m by the law"
        raise ValueError(
            f"{where}; allowed: {allowed}: check unit, preload and the test: oil, speed, temperature"
        )
    entry = at(rising_root(excess, 1.0 / FARTHEST, FARTHEST, 1e-12)[0])
    ends = np.log(np.array([[screw.drag_torque_min], [screw.drag_torque_max]], float) / torque)
    known = learned(tested, [point], np.zeros(1), np.ones(1), around, entry, tolerances=[ends])
    return replace(entry, learned=known)


def screw_friction_set(parameters: Parameters) -> FrictionSet:
    """Numbers of a screw by its drag torque, else those of default_friction_set."""
    return drag_torque_set(parameters) or default_friction_set(parameters)
