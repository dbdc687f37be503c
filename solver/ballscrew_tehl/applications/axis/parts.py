"""Friction of what stands around the nut in an axis, by part, as torque at the screw over speed.

Bearings: applications.axis.bearing_pair. The guide is mu (weight + preload) + seals + cover, at the lead, with its
viscous part; wipers and motor are constants. What a catalogue prints as one number is taken to be met within a factor
of SPREAD, in 80 % of the parts (assumed: makers print no scatter; catalogues differ by such factors); [low, high] is
the 80 % interval as stated.

Assumed: the load on the guide is weight and preload, without the moments of process and drive forces; its friction
does not depend on speed but for the viscous part; the same in both directions.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...numerics import Array
from ...parameters.axis import Range
from ...parameters.file import Parameters
from ...parameters.units import CELSIUS, RPM

#: friction over what a catalogue prints as one number, at the ends of an 80 % interval: a factor
SPREAD = 1.5
STANDARD_GRAVITY = 9.80665  # [m/s2]


class PartTorque(NamedTuple):
    """Friction torque at the screw of one part over speed, with an interval of about 80 % that moves as a whole."""

    torque: Array  # (n,) [N.m]
    low: Array
    high: Array


def weight_along_axis(parameters: Parameters) -> float:
    """Force of the weight of the table along the axis [N], 0 without table `axis`."""
    axis = parameters.axis
    return 0.0 if axis is None else axis.moved_mass * STANDARD_GRAVITY * math.sin(axis.inclination)


def middle(ends: Range) -> float:
    """Value of a range: its mean; the number itself where one is stated."""
    low, high = ends
    return low if low == high else 0.5 * (low + high)


def spread(ends: Range) -> tuple[float, float]:
    """80 % interval of a range: as stated, or SPREAD around one number."""
    low, high = ends
    return (low, high) if low < high else (low / SPREAD, high * SPREAD)


def guide_force(parameters: Parameters) -> tuple[float, float, float]:
    """Coulomb friction of the guide [N] with its 80 % interval: seals and cover + mu (weight + preload)."""
    guide, axis = parameters.guide, parameters.axis
    assert guide is not None
    assert axis is not None
    # 0 at a right angle
    normal = round(math.cos(axis.inclination), 12)
    load = axis.moved_mass * STANDARD_GRAVITY * normal + guide.carriages * guide.preload
    parts = (
        (guide.seal_resistance, float(guide.carriages)), (guide.cover_force, 1.0), (guide.friction_coefficient, load),
    )  # fmt: skip
    values = np.array([factor * middle(ends) for ends, factor in parts])
    ends = np.array([[factor * end for end in spread(ends)] for ends, factor in parts])
    below, above = np.sqrt(np.sum((ends - values[:, None]) ** 2, axis=0))
    force = float(values.sum())
    return force, force - float(below), force + float(above)


def other_parts(
    parameters: Parameters, speeds: Array, temperature: float, axial_load: float = 0.0
) -> dict[str, PartTorque]:
    """Friction of all parts of the file but the nut, at the screw.

    Parameters
    ----------
    parameters : Parameters
        Screw file with tables of the axis.
    speeds : (n,) array
        Speeds of the screw [rad/s], > 0.
    temperature : float
        Temperature of oil and grease [K].
    axial_load : float, optional
        Force of the process along the axis [N]; the weight of an inclined axis is added.

    Returns
    -------
    dict of str to PartTorque
        support_bearings (their rows), bearing_seals, guide, wipers, motor: of the tables that the file has.

    Raises
    ------
    ValueError
        A bearing whose numbers do not fit together, or out of the range of its law.

    Examples
    --------
    >>> import numpy as np
    >>> from ballscrew_tehl import load_screw
    >>> other_parts(load_screw(), np.array([10.0]), 303.15)
    {}
    """
    one, lever = np.ones(len(speeds)), parameters.screw.lead / (2.0 * math.pi)
    parts: dict[str, PartTorque] = {}
    if parameters.support_bearings is not None:
        from .bearing_pair import pair_of

        load = axial_load + weight_along_axis(parameters)
        pair = pair_of(parameters)
        at = pair.torque(load, speeds, temperature)
        parts["support_bearings"] = PartTorque(at.rows, at.low, at.high)
        if parameters.support_bearings.seals == "contact":
            parts["bearing_seals"] = PartTorque._make(value * one for value in pair.seals)
    if parameters.guide is not None:
        force, low, high = guide_force(parameters)
        viscous = parameters.guide.viscous * lever * np.asarray(speeds)
        parts["guide"] = PartTorque._make(lever * (end * one + viscous) for end in (force, low, high))
    if parameters.wipers is not None:
        parts["wipers"] = constant_part(parameters.wipers.friction_torque, one)
    if parameters.motor is not None and parameters.motor.friction_torque[1] > 0.0:
        parts["motor"] = constant_part(parameters.motor.friction_torque, parameters.motor.ratio * one)
    return parts


def constant_part(ends: Range, factor: Array) -> PartTorque:
    """Part that does not depend on speed: a range times a factor (n,)."""
    return PartTorque._make(end * factor for end in (middle(ends), *spread(ends)))


def bearing_range(
    parameters: Parameters, speeds: Array, temperature: float, axial_load: float = 0.0
) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Whether the law of the support bearings holds (n,), and what is to be said of their numbers."""
    if parameters.support_bearings is None:
        return np.ones(len(speeds), dtype=bool), ()
    from .bearing_pair import pair_of

    pair, load = pair_of(parameters), axial_load + weight_along_axis(parameters)
    why = [pair.why_not(load, float(speed), temperature) for speed in speeds]
    good = np.array([not text for text in why])
    notes = [f"support bearings: {text}" for text in pair.notes]
    if not good.all():
        first = int(np.argmin(good))
        notes.append(
            f"support bearings at {speeds[first] / RPM:.4g} r/min, {temperature - CELSIUS:.4g} C: {why[first]}"
        )
    return good, tuple(notes)
