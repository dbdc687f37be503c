"""Interval of the torque of a map by the mechanistic law, from the contacts of the atlas."""

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..atlas.ball_contacts import BallContacts
from ..friction.interval import (
    OperatingPoint,
    TorqueInterval,
    is_fitted,
    of_force,
    oil_shifts,
    torque_and_ends,
    torque_interval,
    unknown_constants,
)
from ..friction.mechanistic import law_constants
from ..friction.sets import PRELOAD, FrictionSet
from ..numerics import Array
from ..parameters.file import Parameters, ScrewParameters
from ..parameters.friction import PRELOAD_FORCE
from ..physics.rating import catalogue_preload
from ..runtime.bspline import fit as coefficients_of
from ..runtime.packed import POINT
from .grid import ball_range, grid_of

BAND = "mechanistic_interval"  # key of a header
BAND_TEMPERATURE = 303.15  # [K] nearest to which the band of a map is stated
#: nodes of interval_table: ends of the interval without axial load, two maps, 768 points: off by 0.15 % in the mean,
#: 0.7 % at 95 %, 2.5 % at most, in cold oil at high speed, where the supply of oil begins to fail; there other screws
#: were off by up to 14 % (17 screws, 14 points each)
TABLE_NODES = 9, 11, 7
#: nodes of the contacts of interval_table over load and speed; the ends are ratios: two screws, off by 0.014 % in the
#: mean, 0.6 % at most
CONTACT_NODES = 33, 17
#: tables of this process by what they follow from: live page, FMUs and report of one screw take the same
_KEPT: dict[str, Array] = {}
MOST_KEPT, _LOCK = 4, threading.Lock()


def map_interval(
    parameters: Parameters,
    axes: Mapping[str, Any],
    friction_set: FrictionSet,
    preload: float,
    speed: float,
    temperature: float,
    axial_load: float = 0.0,
) -> TorqueInterval:
    """Interval at an operating point, at the nearest one of the map where that lies beyond its axes.

    Parameters
    ----------
    parameters : Parameters
        Screw and oil.
    axes : mapping
        Of the header of the map.
    friction_set : FrictionSet
        Fitted number of the law.
    preload, speed, temperature : float
        Operating point [N] > 0, [rad/s], [K].
    axial_load : float, optional
        Axial load [N].

    Returns
    -------
    TorqueInterval
        Torque and its interval [N.m].

    Raises
    ------
    ArithmeticError
        Equilibrium of a ball not found.

    Examples
    --------
    >>> from ballscrew_tehl import load_map, load_screw
    >>> from ballscrew_tehl.friction.sets import default_friction_set
    >>> screw = load_screw("gd4008_vg100.toml")
    >>> axes = load_map(None, screw).header["axes"]
    >>> interval = map_interval(screw, axes, default_friction_set(screw), 2000.0, 104.7, 303.15)
    >>> f"{interval.low:.2f} to {interval.high:.2f} N.m"
    '1.04 to 1.22 N.m'
    """
    at = nearest(axes, "speed", abs(speed)), nearest(axes, "temperature", temperature), axial_load
    point = OperatingPoint(nearest(axes, "force", preload), *at)
    return torque_interval(parameters, point, BallContacts(parameters), friction_set)


def interval_table(
    parameters: Parameters, axes: Mapping[str, Any], friction_set: FrictionSet,
    on_the_way: Callable[[], None] = lambda: None,
) -> Array:  # fmt: skip
    """B-splines (force, speed, temperature, 2) on TABLE_NODES: ln of both ends over the torque, without axial load.

    The last ones are kept. on_the_way: called often; what it raises ends the work.
    """
    # equal parameters may differ in which constants the file states
    known = unknown_constants(parameters), is_fitted(friction_set, parameters)
    key = repr((parameters, axes, friction_set, known))
    if (kept := _KEPT.get(key)) is not None:
        return kept
    (light, heavy), (slow, fast), (cold, hot) = (axes[name][:2] for name in ("force", "speed", "temperature"))
    forces, speeds = np.geomspace(light, heavy, TABLE_NODES[0]), np.geomspace(slow, fast, TABLE_NODES[1])
    temperatures = np.linspace(cold, hot, TABLE_NODES[2])
    # over true forces
    factor = friction_set.preload_factor
    least, most = min(PRELOAD_FORCE.low / factor, 1.0), max(PRELOAD_FORCE.high / factor, 1.0)
    shifted = [temperatures, *(one for pair in oil_shifts(parameters, temperatures).values() for one in pair)]
    grid = replace(
        grid_of(axes),
        force=(least * light, most * heavy, TABLE_NODES[0]),
        temperature=(np.min(shifted), np.max(shifted), TABLE_NODES[2]),
    )
    contacts = BallContacts(parameters, ball_range(parameters, grid)._replace(nodes=CONTACT_NODES))
    at = forces / factor, contacts, speeds, temperatures, friction_set
    ends = np.stack(torque_and_ends(parameters, *at, on_the_way=on_the_way)[1:], axis=-1)
    result = coefficients_of(np.log(ends), (0, 1, 2))
    result.setflags(write=False)
    with _LOCK:
        _KEPT[key] = result
        while len(_KEPT) > MOST_KEPT:
            del _KEPT[next(iter(_KEPT))]
    return result


def relative_intervals(
    parameters: Parameters,
    axes: Mapping[str, Any],
    friction_set: FrictionSet,
    preloads: Array,
    speeds: Array,
    temperatures: Array,
    axial_load: float = 0.0,
) -> Array:
    """Ends of the interval over the torque (p, s, t, 2) on a grid [N, rad/s, K] within a map, at an axial load [N]."""
    at = speeds, temperatures, friction_set, axial_load
    return np.stack(torque_and_ends(parameters, preloads, BallContacts(parameters), *at)[1:], axis=-1)


def nearest(axes: Mapping[str, Any], axis: str, value: float) -> float:
    """Value, moved to the nearest end of an axis if it lies beyond.

    Parameters
    ----------
    axes : mapping
        Lowest and highest value by name.
    axis : str
        Name of the axis.
    value : float
        The value.

    Returns
    -------
    float
        Value on the axis.

    Examples
    --------
    >>> nearest({"speed": (1.0, 100.0)}, "speed", 200.0)
    100.0
    """
    low, high = axes[axis][:2]
    return float(min(max(value, low), high))


def band_point(axes: Mapping[str, Any], screw: ScrewParameters) -> tuple[float, float, float]:
    """Preload [N], speed [rad/s], temperature [K] of the band: start values of the FMU, middle speed of the axis."""
    return (
        nearest(axes, "preload", catalogue_preload(screw)),
        math.sqrt(axes["speed"][0] * axes["speed"][1]),
        nearest(axes, "temperature", BAND_TEMPERATURE),
    )


def band(parameters: Parameters, axes: Mapping[str, Any], friction_set: FrictionSet) -> dict[str, Any]:
    """Entry mechanistic_interval of a header: point (SI), ends over the torque, and what they depend on."""
    point, fitted = band_point(axes, parameters.screw), is_fitted(friction_set, parameters)
    interval = map_interval(parameters, axes, friction_set, *point)
    low, high = interval.relative
    # of a preload that the torque itself measures
    force = map_interval(of_force(parameters, friction_set), axes, friction_set, *point).relative
    numbers = {
        "constants": law_constants(parameters),
        "unknown": list(unknown_constants(parameters)),
        "oil": [parameters.lubricant.temperature_tolerance, parameters.lubricant.iso_vg],
        "values": list(friction_set.values[:2]),
        "fit": friction_set.learned if fitted else None,
    }
    at = dict(zip(POINT, point, strict=False))
    ends = {"low": low, "high": high, "force_low": force[0], "force_high": force[1]}
    return {**at, **ends, "numbers": numbers, "fitted": fitted, "nominal": PRELOAD in interval.shares}
