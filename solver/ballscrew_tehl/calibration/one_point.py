"""Calibration of the mechanistic law on one torque, measured or of a catalogue: its one number, exactly."""

from typing import Any, NamedTuple

from .._version import __version__
from ..friction.baselines import nsk_torque
from ..friction.interval import TorqueInterval
from ..friction.mechanistic import ContactValues, nuts_powers, torque_line
from ..friction.sets import CALIBRATED_AT, CATALOGUE, CATALOGUE_DIFFERS, FrictionSet, without_overrides
from ..friction.torque import nut_forces
from ..parameters.file import Law, Parameters
from ..parameters.identity import parameters_hash
from ..parameters.units import CELSIUS, RPM
from ..runtime.packed import MECHANISTIC
from .level import implausible_level, law_interval
from .measured import TRANSFER, number_notes
from .measurements import Measurement
from .result import SPLIT

ONE_POINT = (
    "one point identifies the level of the torque only: no left-out error, no limits of the coefficient"
)
HELD = (
    "the interval of the torque is narrow at this point and wider away from it: at other values of the bounded "
    "constants the coefficient is fitted to this torque again; scatter as of the packaged fit"
)


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
    at = own, nut_forces(own, m.preload, 0.0), contacts, m.speed, m.temperature
    law = law_interval(m, parameters, contacts, MECHANISTIC)
    rest, slope = torque_line(nuts_powers(*at))
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
    notes = [
        ONE_POINT, HELD, f"catalogue torque ({CATALOGUE}) {catalogue:.3g} N.m: {CATALOGUE_DIFFERS}", TRANSFER,
        *number_notes(found, parameters),
    ]  # fmt: skip
    return OnePoint(found, m, rest, law, notes)


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
