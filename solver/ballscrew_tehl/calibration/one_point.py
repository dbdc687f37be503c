"""Level of a measured torque compared with the law, and calibration on one torque: the one number of the law, exactly.

A torque that the law cannot give is refused before anything is fitted, with the unit that was probably meant.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

from .._version import __version__
from ..friction.baselines import nsk_torque
from ..friction.interval import TorqueInterval, torque_interval
from ..friction.mechanistic import ContactValues, nuts_powers, torque_line
from ..friction.sets import (
    CALIBRATED_AT,
    CATALOGUE,
    CATALOGUE_DIFFERS,
    FrictionSet,
    default_friction_set,
    with_set,
    without_overrides,
)
from ..friction.torque import FilmModel, double_nut_torque, nut_forces
from ..parameters.file import Law, Parameters
from ..parameters.identity import parameters_hash
from ..parameters.screw import ball_ball_coefficient
from ..parameters.units import CELSIUS, RPM
from ..runtime.packed import MECHANISTIC
from ..tables.headings import TORQUE
from .measurements import Measurement
from .result import SPLIT, TRANSFER, number_notes

#: most that a torque may be above the interval of the law, or below it, as a factor
MAX_FACTOR = 3.0
ONE_POINT = (
    "one point identifies the level of the torque only: no left-out error, no limits of the coefficient"
)
HELD = (
    "the interval of the torque is narrow at this point and wider away from it: at other values of the bounded "
    "constants the coefficient is fitted to this torque again; scatter as of the packaged fit"
)


def law_interval(
    m: Measurement, parameters: Parameters, model: FilmModel | ContactValues, name: str
) -> TorqueInterval:
    """Torque of the unfitted law at a point with its interval, without numbers that the screw file overrides.

    Parameters   model : contacts of the mechanistic set, film of another one, whose interval is its packaged torque
    """
    own = without_overrides(with_set(parameters, name), name)
    if name == MECHANISTIC:
        contacts, friction = cast(ContactValues, model), own.friction
        number = ball_ball_coefficient(friction, friction.ball_thrust)
        unfitted = FrictionSet(Law.MECHANISTIC, 1.0, number)
        forces = nut_forces(own, m.preload, m.axial_load)
        return torque_interval(own, forces, contacts, m.speed, m.temperature, unfitted)
    at = m.preload, m.speed, m.temperature, m.axial_load
    torque = float(double_nut_torque(own, default_friction_set(own), cast(FilmModel, model), *at).total)
    return TorqueInterval(torque, torque, torque, {}, {})


def implausible_level(m: Measurement, law: TorqueInterval, rest: float = 0.0, unit: str = "N.m") -> str:
    """One line if the law cannot give the torque of a point, or hardly does; else "".

    Parameters   rest : torque without friction between balls [N.m], 0: does not bound it;  unit : as it was written
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


def check_level(
    points: Sequence[Measurement],
    parameters: Parameters,
    model: FilmModel | ContactValues,
    name: str,
    path: Path,
    unit: str,
) -> None:
    """Refuse points whose typical one is far from the law: the median of the torques over those of the catalogue.

    Solves the contacts of that point only.

    Parameters   path : of the file;  unit : of its torques
    Raises       ValueError
    """
    ordered = sorted(points, key=lambda m: m.torque / float(nsk_torque(parameters.screw, m.preload)))
    middle = ordered[(len(ordered) - 1) // 2]
    law = law_interval(middle, parameters, model, name)
    if problem := implausible_level(middle, law, unit=unit):
        raise ValueError(f"{path}: {middle.point}, typical of {len(points)} rows: {problem}")


class OnePoint(NamedTuple):
    """The set that gives a torque, the torque, without ball on ball [N.m], and the law's interval there without it."""

    friction_set: FrictionSet
    measurement: Measurement
    rest: float
    law: TorqueInterval
    notes: list[str]


def calibrate_point(m: Measurement, parameters: Parameters, contacts: ContactValues) -> OnePoint:
    """Coefficient with which the mechanistic law gives a torque.

    Parameters   m : no axial load;  contacts : of the balls
    Raises       ValueError: a torque that no coefficient >= 0 gives, or beyond MAX_FACTOR
                 times the interval of the law
    """
    own = without_overrides(parameters, MECHANISTIC)
    law = law_interval(m, parameters, contacts, MECHANISTIC)
    forces = nut_forces(own, m.preload, 0.0)
    rest, slope = torque_line(nuts_powers(own, forces, contacts, m.speed, m.temperature))
    if problem := implausible_level(m, law, rest):
        raise ValueError(problem)
    where = f"{m.preload:g} N, {m.speed / RPM:g} r/min, {m.temperature - CELSIUS:g} C"
    found = FrictionSet(
        Law.MECHANISTIC, 1.0, (m.torque - rest) / slope, loss="solved",
        provenance=f"one torque, {m.torque:g} N.m at {where}, ballscrew_tehl {__version__}",
        not_identified={SPLIT: ONE_POINT},
        screw=parameters.name, parameters_hash=parameters_hash(parameters),
        calibrated_at={name: getattr(m, name) for name in CALIBRATED_AT},
    )  # fmt: skip
    catalogue = float(nsk_torque(own.screw, m.preload))
    level = f"catalogue torque ({CATALOGUE}) {catalogue:.3g} N.m: {CATALOGUE_DIFFERS}"
    return OnePoint(found, m, rest, law, [ONE_POINT, HELD, level, TRANSFER, *number_notes(found, parameters)])


def point_data(result: OnePoint) -> dict[str, Any]:
    """What --json adds to the friction set."""
    m = result.measurement
    return {
        "points": [{
            "preload_n": m.preload,
            "speed_rpm": m.speed / RPM,
            "temperature_k": m.temperature,
            "axial_load_n": m.axial_load,
            "measured_nm": m.torque,
            "without_ball_ball_nm": result.rest,
            "law_low_nm": result.law.low,
            "law_high_nm": result.law.high,
        }],
        "notes": result.notes,
        "not_identified": result.friction_set.not_identified,
    }  # fmt: skip


def point_text(result: OnePoint) -> str:
    """The result as text."""
    found, law = result.friction_set, result.law
    return "\n".join([
        f"Fitted to {found.provenance}",
        f"    {'net_sliding_coefficient':<26}{found.net_sliding_coefficient:.4g}",
        f"    of the torque without friction between balls {result.rest:.4g} N.m",
        f"    the law without any fit {law.torque:.4g} N.m, interval {law.low:.4g} to {law.high:.4g} N.m",
        *(f"note: {note}" for note in result.notes),
    ])  # fmt: skip
