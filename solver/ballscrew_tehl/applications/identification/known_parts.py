"""Parts of the friction of an axis that are known, subtracted from that of a log: of a screw file, or of options.

Each part has an interval of about 80 %, which moves as a whole over speed: a printed torque or force that is wrong is
so at all speeds. Parts are independent of each other and add up in torque: to first order the likeliest of all combined
errors that move a result to the end of an 80 % interval moves each part k by its share (e_k: effect of its own end)

    t_k = e_k / sqrt(sum e^2),   joint curve = sum t_k * (end - value)_k over speed,

and the result with this curve added is the end of its interval, also where torques are near zero and no longer linear.
Assumed: the errors of the bearings' rows are independent of those of the nut's law, though both laws share constants.

A preload is an upper bound unless all of PARTS are stated: what is not stated counts as the nut's, by an amount that
nothing limits. Wipers and motor are no exception: left out, they alone move the preload of two ordinary axes by 32
and 49 %. What is not there is stated as 0: friction_torque_Nm = 0 in the table, --seal-torque-nm 0, --guide-force-n 0.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from ballscrew_tehl.friction.interval import DEVIATIONS
from ballscrew_tehl.numerics import Array
from ballscrew_tehl.parameters.file import Parameters, changed
from ballscrew_tehl.parameters.units import RPM

from ..axis.parts import STANDARD_GRAVITY, PartTorque, bearing_range, other_parts, weight_along_axis
from .directions import Bidirectional

#: offset that the weight of the table axis does not explain, over the whole weight, from which on a note says so: 6 deg
TILT = 0.1
PARTS = ("support_bearings", "guide", "wipers", "motor")
#: options by the part that they state; of bearings and seals: of the wipers alone where the file has the bearings
OPTIONS = {"guide": "--guide-force-n", "bearings_and_seals": "--seal-torque-nm"}
#: standard error of the exponent of speed of a part: printed torques of bearings and their law differ in it by so much
EXPONENT = 0.1
#: speeds of the curve of a part, between which it is a straight line
SPEEDS = 15


class KnownParts(NamedTuple):
    """Friction torque of parts at the screw [N.m] over speeds [rad/s], by name; parts of which nothing is known."""

    speed: Array
    parts: Mapping[str, PartTorque]
    not_stated: tuple[str, ...] = PARTS
    notes: tuple[str, ...] = ()

    @property
    def torque(self) -> Array:
        """Sum of all."""
        return np.asarray(sum((part.torque for part in self.parts.values()), np.zeros(len(self.speed))))

    def at(self, speed: Array) -> Self:
        """The same at other speeds."""
        parts = {
            name: PartTorque(*(np.interp(speed, self.speed, curve) for curve in part))
            for name, part in self.parts.items()
        }
        return self._replace(speed=speed, parts=parts)

    def to_end(self, high: bool) -> Array:
        """High or low end of each part less its value (parts, speeds)."""
        rows = [(part.high if high else part.low) - part.torque for part in self.parts.values()]
        return np.array(rows).reshape(-1, len(self.speed))

    def shares(self, high: bool, weight: Array) -> Array:
        """t_k of the parts, for a result that is a mean of the torque with these weights."""
        effect = self.to_end(high) @ weight
        size = float(np.linalg.norm(effect))
        return np.abs(effect) / size if size > 0.0 else effect

    def shape_columns(self, torque: Array) -> Array:
        """What one standard error of level and exponent of each part does to ln(torque) of the rest (speeds, 2 k)."""
        level = 0.5 * (self.to_end(high=True) - self.to_end(high=False)) / DEVIATIONS
        log_speed = np.log(self.speed) - np.mean(np.log(self.speed))
        values = np.array([part.torque for part in self.parts.values()]).reshape(level.shape)
        exponent = values * EXPONENT * log_speed * np.any(level > 0.0, axis=1, keepdims=True)
        return np.vstack([level, exponent]).T / torque[:, None]


def known_parts(
    parameters: Parameters | None,
    stated: Mapping[str, tuple[float, float]],
    speed: Array,
    temperature: float,
) -> KnownParts:
    """Of a screw file, and of options, which replace a part of the file.

    stated: torque at the screw with its standard error, 0: exact [N.m], by the keys of OPTIONS
    """
    speeds = np.geomspace(speed.min(), speed.max(), SPEEDS)
    parts: dict[str, PartTorque] = {}
    notes: list[str] = []
    if parameters is not None:
        parts = other_parts(parameters, speeds, temperature)
        notes += bearing_range(parameters, speeds, temperature)[1]
        seals = parameters.screw.seal_torque
        if seals and "support_bearings" in parts and "bearings_and_seals" in stated:
            raise ValueError(
                f"{OPTIONS['bearings_and_seals']}, with seal_torque_Nm = {seals:g} and [support_bearings] in the screw "
                "file; allowed: one of both, which are the wipers of the nut"
            )
    for option, (torque, error) in stated.items():
        name = {"bearings_and_seals": "wipers"}.get(option, option)
        if parts.pop(name, None) is not None:
            notes.append(f"{OPTIONS[option]} replaces {name} of the screw file")
        parts[name if "support_bearings" in parts else option] = _of_option(torque, error, SPEEDS)
    return KnownParts(speeds, parts, _not_stated(parameters, stated), tuple(notes))


def _of_option(torque: float, error: float, count: int) -> PartTorque:
    """Torque with a standard error, the same at so many speeds."""
    low, high = max(torque - DEVIATIONS * error, 0.0), torque + DEVIATIONS * error
    return PartTorque(*np.outer((torque, low, high), np.ones(count)))


def of_log(other: Bidirectional, parameters: Parameters | None, stated: Mapping[str, Any]) -> KnownParts:
    """Of a log without the nut, in place of all other parts."""
    half = DEVIATIONS * other.error
    parts = {"log_without_nut": PartTorque(other.mean, other.mean - half, other.mean + half)}
    for name, (torque, error) in stated.items():
        parts[name] = _of_option(torque, error, len(other.speed))
    tables = [
        f"[{name}]" for name in PARTS if parameters is not None and getattr(parameters, name) is not None
    ]
    notes = [f"the log without the nut is subtracted, not {', '.join(tables)}"] if tables else []
    if not stated:
        notes.append(
            "the log without the nut stands for all other parts: of guide and wipers that did not move in it, state "
            "--guide-force-n and --seal-torque-nm"
        )
    return KnownParts(other.speed, parts, (), tuple(notes))


def with_ratio(parameters: Parameters, ratio: float | None) -> tuple[Parameters, float]:
    """Turns of the motor for one of the screw, of the option or of the screw file, which then has it."""
    motor = parameters.motor
    if motor is None or ratio is None:
        return parameters, ratio or (1.0 if motor is None else motor.ratio)
    if "ratio" in motor.model_fields_set and not math.isclose(abs(ratio), motor.ratio, rel_tol=1e-6):
        allowed = f"that of [motor] in the screw file, {motor.ratio:g} (with either sign): remove one of them"
        raise ValueError(f"--ratio = {ratio:g}; allowed: {allowed}")
    return changed(parameters, motor={"ratio": abs(ratio)}), ratio


def _not_stated(parameters: Parameters | None, stated: Mapping[str, Any]) -> tuple[str, ...]:
    has = set(stated)
    if parameters is not None:
        has |= {name for name in PARTS if getattr(parameters, name) is not None}
        if parameters.motor is not None and "friction_torque" not in parameters.motor.model_fields_set:
            has.remove("motor")
        if parameters.screw.seal_torque > 0.0:  # in the torque of the nut
            has.add("wipers")
    if "bearings_and_seals" in stated:
        has |= {"wipers"} if "support_bearings" in has else {"support_bearings", "wipers", "motor"}
    return tuple(name for name in PARTS if name not in has)


def subtracted_data(
    known: KnownParts, whole: Bidirectional, nut: Bidirectional, speed: float
) -> dict[str, Any]:
    """Keys of the answer: what was subtracted from the whole friction, at a typical speed [rad/s], and what is left."""
    parts = {
        name: dict(zip(("torque_nm", "low_nm", "high_nm"), (float(end[0]) for end in part), strict=True))
        for name, part in known.at(np.array([speed])).parts.items()
    }
    left, torque = (float(np.interp(speed, one.speed, one.mean)) for one in (nut, whole))
    return {
        "subtracted": parts, "not_stated": list(known.not_stated), "nut_share": left / torque,
        "axis_torque_nm": torque, "typical_speed_rpm": speed / RPM,
    }  # fmt: skip


def other_weight(parameters: Parameters, offset: float, error: float) -> str:
    """Line where the offset of a log [N.m at the screw] is not the weight of the table `axis`; "" where it may be."""
    if parameters.axis is None:
        return ""
    lever = parameters.screw.lead / (2.0 * math.pi)
    stated, whole = (
        weight_along_axis(parameters) * lever,
        parameters.axis.moved_mass * STANDARD_GRAVITY * lever,
    )
    if abs(abs(offset) - abs(stated)) <= 3.0 * error + TILT * whole:
        return ""
    return (
        f"offset {offset:.3g} N m, the weight of [axis] {stated:.3g} N m: check inclination_deg and moved_mass_kg, "
        "which load the nut, or a counterweight"
    )
