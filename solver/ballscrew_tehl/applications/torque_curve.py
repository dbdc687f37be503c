"""Torque over speed with its interval, from the atlas of contacts: no map is made."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..atlas.ball_contacts import BallContacts
from ..friction.drag_torque import preload_left, screw_friction_set
from ..friction.interval import counted_constants, is_fitted, meaning, torque_and_ends
from ..friction.sets import PRELOAD, FrictionSet
from ..numerics import Array
from ..nut_map.interval import relative_intervals
from ..parameters.file import Parameters
from ..parameters.friction import Law

#: speeds at which an interval over many is computed; its ends over the torque are interpolated over ln(speed)
INTERVALS = 5


class TorqueCurve(NamedTuple):
    """Friction torque of a screw over its speed.

    Attributes
    ----------
    speed : (n,) array
        Speeds [rad/s].
    torque, low, high : (n,) array
        Torque with its seals, and its interval [N.m].
    meaning : str
        What the interval is.
    """

    speed: Array
    torque: Array
    low: Array
    high: Array
    meaning: str


def torque_over_speed(
    parameters: Parameters,
    preload: float,
    speeds: Array,
    temperature: float,
    axial_load: float = 0.0,
    temperature_difference: float = 0.0,
    friction_set: FrictionSet | None = None,
) -> TorqueCurve:
    """Torque over speed with its interval, by the mechanistic law from the atlas.

    Parameters
    ----------
    parameters : Parameters
        Screw and oil.
    preload : float
        As preload_basis of the screw file says [N], >= 0; 0: a nut with clearance, which an axial load may load.
    speeds : (n,) array
        Speeds [rad/s], > 0.
    temperature : float
        Temperature of the oil [K].
    axial_load : float, optional
        Axial load [N].
    temperature_difference : float, optional
        Screw minus nut [K].
    friction_set : FrictionSet, optional
        Numbers of the law; None: those of the screw file or the packaged ones.

    Returns
    -------
    TorqueCurve
        Torque [N.m] and interval.

    Raises
    ------
    ValueError
        An argument out of range, the law of the paper, contacts outside the atlas.

    Notes
    -----
    The map is a spline through such values, about 0.1 % off them. No preload is left: torque 0.

    Examples
    --------
    >>> import numpy as np
    >>> from ballscrew_tehl import load_screw
    >>> curve = torque_over_speed(load_screw("example_25x10.toml"), 800.0, np.array([10.0, 100.0]), 313.15)
    >>> bool(np.all((curve.low < curve.torque) & (curve.torque < curve.high)))
    True
    """
    speeds = np.atleast_1d(np.asarray(speeds, dtype=float))
    if not 0.0 <= preload < np.inf:
        raise ValueError(f"preload = {preload:g} N; allowed: >= 0")
    if not 0.0 < float(np.min(speeds)) < np.inf:
        raise ValueError(f"speeds = {float(np.min(speeds)):g} rad/s; allowed: > 0")
    if parameters.friction.law is not Law.MECHANISTIC:
        raise ValueError('law = "three_parameter"; allowed: "mechanistic", which has an interval')
    numbers = screw_friction_set(parameters) if friction_set is None else friction_set
    preload = preload_left(parameters, numbers, preload, temperature_difference)
    fitted = is_fitted(numbers, parameters)
    text = meaning(fitted, PRELOAD in counted_constants(parameters, numbers, fitted))
    seals = parameters.screw.seal_torque
    if preload == 0.0 and not axial_load:
        rest = seals * np.ones(len(speeds))
        return TorqueCurve(speeds, rest, rest, rest, text)
    at_grid = np.array([preload]), BallContacts(parameters), speeds, np.array([temperature])
    torque, low, high = (
        np.ravel(part) for part in torque_and_ends(parameters, *at_grid, numbers, axial_load)
    )
    return TorqueCurve(speeds, torque + seals, low * torque + seals, high * torque + seals, text)


def interval_ratios(
    parameters: Parameters, axes: Mapping[str, Any], friction_set: FrictionSet,
    preload: Array, speed: Array, temperature: Array,
) -> Array:  # fmt: skip
    """Low and high end of the interval of a map over its torque (2, speed, preload, temperature), speeds rising."""
    nodes = np.geomspace(speed[0], speed[-1], INTERVALS)
    ends = relative_intervals(parameters, axes, friction_set, preload, nodes, temperature)
    places = np.log(speed), np.log(nodes)
    over_speed = np.apply_along_axis(lambda ratios: np.interp(*places, ratios), 1, ends)
    return np.asarray(over_speed.transpose(3, 1, 0, 2))
