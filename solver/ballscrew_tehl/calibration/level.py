"""Level of a measured torque compared with the law: a torque far from it is refused, with the unit probably meant."""

from typing import cast

from ..friction.interval import TorqueInterval, torque_interval
from ..friction.mechanistic import ContactValues
from ..friction.sets import FrictionSet, default_friction_set, with_set, without_overrides
from ..friction.torque import FilmModel, double_nut_torque, nut_forces
from ..parameters.file import Law, Parameters
from ..parameters.screw import ball_ball_coefficient
from ..runtime.packed import MECHANISTIC
from ..tables.headings import TORQUE
from .measurements import Measurement

#: most that a torque may be above the interval of the law, or below it, as a factor
MAX_FACTOR = 3.0


def law_interval(
    m: Measurement, parameters: Parameters, model: FilmModel | ContactValues, name: str
) -> TorqueInterval:
    """Torque of the unfitted law at a point with its interval; of another law its packaged torque alone.

    Numbers that the screw file overrides do not count.
    """
    own = without_overrides(with_set(parameters, name), name)
    if name == MECHANISTIC:
        unfitted = FrictionSet(
            Law.MECHANISTIC, 1.0, ball_ball_coefficient(own.friction, own.friction.ball_thrust)
        )
        forces = nut_forces(own, m.preload, m.axial_load)
        return torque_interval(own, forces, cast(ContactValues, model), m.speed, m.temperature, unfitted)
    at = m.preload, m.speed, m.temperature, m.axial_load
    torque = double_nut_torque(own, default_friction_set(own), cast(FilmModel, model), *at).total
    return TorqueInterval(torque, torque, torque, {}, {})


def implausible_level(m: Measurement, law: TorqueInterval, rest: float = 0.0, unit: str = "N.m") -> str:
    """One line if the law cannot give the torque of a point, or hardly does; else "".

    rest: torque without friction between balls [N.m], 0: does not bound it;  unit: as it was written
    """
    low, high = max(rest, law.low / MAX_FACTOR), MAX_FACTOR * law.high
    if low <= m.torque <= high:
        return ""
    # the unit that brings it nearest to the law
    written = m.torque / TORQUE[unit][0]
    meant = {other: written * factor for other, (factor, _) in TORQUE.items()}
    nearest = min(meant, key=lambda other: max(meant[other] / law.torque, law.torque / meant[other]))
    remedy = "check unit, preload, oil (viscosity, temperature), its supply and what was subtracted from the torque"
    if low <= meant[nearest] <= high and nearest != unit:
        remedy = f"is {written:.6g} {nearest} = {meant[nearest]:.4g} N.m meant?"
    without = f", without friction between balls {rest:.4g} N.m" if rest else ""
    return (
        f"torque = {m.torque:.6g} N.m, {m.torque / law.torque:.3g} times that of the law; allowed: {low:.4g} to "
        f"{high:.4g} N.m. Its interval is {law.low:.4g} to {law.high:.4g} N.m there{without}: {remedy}"
    )
