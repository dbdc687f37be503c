"""Friction of a whole axis at the screw, by part: the nut, and what stands around it in the screw file."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...friction.sets import FrictionSet
from ...numerics import Array
from ...nut_map.interval import nearest, relative_intervals
from ...parameters.file import Parameters, ScrewParameters
from ...runtime.evaluate import NutMap
from ...runtime.packed import Law
from ..mechanics import efficiency
from .parts import PartTorque, bearing_range, constant_part, other_parts, weight_along_axis

#: names in words, in the order of a budget
PART_NAMES = {
    "nut": "nut", "support_bearings": "support bearings, rows", "bearing_seals": "support bearings, seals",
    "guide": "guide", "wipers": "wipers of the nut", "motor": "motor",
}  # fmt: skip


class AxisBudget(NamedTuple):
    """Friction torque at the screw [N.m] of an axis over its speed.

    Attributes
    ----------
    speed : (n,) array
        Speed of the screw [rad/s], > 0.
    parts : dict of str to PartTorque
        Torque of each part, (n,) each, with an interval of about 80 %.
    axial_load : float
        Of the nut: process and weight [N].
    in_range : (n,) array
        Whether nut and bearings are inside the ranges of their laws.
    notes : tuple of str
        What is not as it should be, in words.
    """

    speed: Array
    parts: dict[str, PartTorque]
    axial_load: float
    in_range: NDArray[np.bool_]
    notes: tuple[str, ...]

    @property
    def torque(self) -> Array:
        """Sum of the parts [N.m]."""
        return np.sum([part.torque for part in self.parts.values()], axis=0)

    @property
    def low(self) -> Array:
        """Low end of the sum: parts are independent, their distances to the end add in quadrature."""
        squares = [(part.torque - part.low) ** 2 for part in self.parts.values()]
        return self.torque - np.sqrt(np.sum(squares, axis=0))

    @property
    def high(self) -> Array:
        """High end of the sum, likewise."""
        squares = [(part.high - part.torque) ** 2 for part in self.parts.values()]
        return self.torque + np.sqrt(np.sum(squares, axis=0))


def axis_budget(
    parameters: Parameters,
    nut_map: NutMap,
    friction_set: FrictionSet,
    preload: float,
    speed: Any,
    temperature: float,
    axial_load: float = 0.0,
    temperature_difference: float = 0.0,
) -> AxisBudget:
    """Friction of all parts of an axis over speed.

    Parameters
    ----------
    parameters : Parameters
        Screw file; parts without a table are not in the budget.
    nut_map : NutMap
        Map of the screw, with the numbers of the friction set.
    friction_set : FrictionSet
        Of the interval.
    preload : float
        As preload_basis of the screw file says [N].
    speed : float or (n,) array
        Speeds of the screw [rad/s], > 0.
    temperature : float
        Of oil and grease [K].
    axial_load : float, optional
        Force of the process along the axis [N]; the weight of an inclined axis is added.
    temperature_difference : float, optional
        Screw minus nut [K].

    Returns
    -------
    AxisBudget
        Parts and their sum.

    Raises
    ------
    ValueError
        An argument or a bearing out of range.

    Notes
    -----
    The nut carries process and weight; the friction of the guide, which it carries too, is left out: some percent of
    the preload. Seals of the screw file (seal_torque) are met within a factor of SPREAD, as wipers.

    Examples
    --------
    >>> from ballscrew_tehl import load_map, load_screw
    >>> from ballscrew_tehl.friction.sets import default_friction_set
    >>> screw = load_screw("gd4008_vg100.toml")
    >>> budget = axis_budget(screw, load_map(None, screw), default_friction_set(screw), 2000.0, 104.7, 303.15)
    >>> list(budget.parts), budget.torque.shape
    (['nut'], (1,))
    """
    speeds = np.atleast_1d(np.asarray(speed, dtype=float))
    if not np.all(np.isfinite(speeds) & (speeds > 0.0)):
        raise ValueError(
            f"speed = {speeds[~(speeds > 0.0)][:1]} rad/s; allowed: > 0: friction of a resting axis holds"
        )
    load = axial_load + weight_along_axis(parameters)
    state = nut_map.evaluate(
        preload, speeds, temperature, load, temperature_difference=temperature_difference
    )
    seals = nut_map.seal_torque
    nut = np.broadcast_to(state.friction_torque - seals, speeds.shape)
    parts = {"nut": PartTorque(nut, *(end * nut for end in _ends(parameters, nut_map, friction_set, state, preload,
                                                                 speeds, temperature, load)))}  # fmt: skip
    parts |= other_parts(parameters, speeds, temperature, axial_load)
    if seals:
        parts["wipers"] = constant_part((seals, seals), np.ones(len(speeds)))
    ordered = {name: parts[name] for name in PART_NAMES if name in parts}
    good, notes = bearing_range(parameters, speeds, temperature, axial_load)
    inside = np.broadcast_to(state.in_range, speeds.shape)
    if not inside.all():
        names = ", ".join(name.replace("_", " ") for name in state.clamped)
        notes = f"nut: {names} outside the map (ballscrew map info), its torque is that of the edge", *notes
    if nut_map.law != Law.MECHANISTIC:
        notes = f"nut: the law {nut_map.law} has no interval; that of the sum is of the other parts", *notes
    good = good & inside
    return AxisBudget(speeds, ordered, load, good, notes)


def _ends(
    parameters: Parameters, nut_map: NutMap, friction_set: FrictionSet, state: Any, preload: float, speeds: Array,
    temperature: float, load: float,
) -> Array:  # fmt: skip
    """Ends of the interval of the nut over its torque, (2, n); 1 by a law that has none, and of a free nut."""
    if nut_map.law != Law.MECHANISTIC:
        return np.ones((2, len(speeds)))
    axes = nut_map.header["axes"]
    actual = float(np.max(state.preload_actual)) / friction_set.preload_factor
    if not (actual > 0.0 or load):
        return np.ones((2, len(speeds)))
    force = nearest(axes, "force", actual) if actual > 0.0 else actual
    at = (
        np.array([force]),
        np.clip(speeds, *axes["speed"][:2]),
        np.array([nearest(axes, "temperature", temperature)]),
    )
    ends = relative_intervals(parameters, axes, friction_set, *at, load)
    return np.reshape(ends, (-1, 2)).T


def budget_rows(budget: AxisBudget, screw: ScrewParameters) -> list[dict[str, Any]]:
    """One row per speed by key: torques [N.m] with intervals, parts that add up, power by part [W], efficiency."""
    rows = []
    torque, low, high = budget.torque, budget.low, budget.high
    for k, speed in enumerate(budget.speed.tolist()):
        of_parts = {
            key: {name: float(getattr(part, end)[k]) for name, part in budget.parts.items()}
            for key, end in (("parts", "torque"), ("parts_low", "low"), ("parts_high", "high"))
        }
        row: dict[str, Any] = {"friction_torque_nm": float(torque[k])}
        row |= {"torque_low_nm": float(low[k]), "torque_high_nm": float(high[k]), **of_parts}
        row["power_w"] = {name: value * speed for name, value in of_parts["parts"].items()}
        row["power_loss_w"] = float(torque[k]) * speed
        row["nut_share"] = of_parts["parts"]["nut"] / float(torque[k]) if torque[k] else math.nan
        both = efficiency(screw, budget.axial_load, float(torque[k]))
        if both is not None and budget.in_range[k]:
            row |= {"efficiency": both.driving, "efficiency_backdriving": both.backdriving}
        rows.append(row | {"in_range": bool(budget.in_range[k])})
    return rows
