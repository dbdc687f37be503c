"""Friction torque of a map over speed, preload and temperature, with its interval where the law has one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..parameters.file import Parameters

if TYPE_CHECKING:
    from ..friction.sets import FrictionSet
    from ..runtime.evaluate import NutMap

Array = NDArray[np.float64]
#: speeds at which an interval is computed; between them its ends over the torque are interpolated over ln(speed)
INTERVALS = 5


class FrictionTable(NamedTuple):
    """Torque opposing the motion at positive speeds [N.m], (speed, preload, temperature); low, high: None if not known.

    speed [rad/s], preload [N], temperature [K];  about: screw, oil, friction set, hash of the map, meaning of low, high
    """

    speed: Array
    preload: Array
    temperature: Array
    torque: Array
    low: Array | None
    high: Array | None
    lead: float
    about: dict[str, str]

    @property
    def head(self) -> tuple[str, str]:
        """Content and sign."""
        return (
            "friction torque of a preloaded ball screw at the screw, axial load 0",
            "the torque opposes the motion: the drive needs it in the direction of the speed; same magnitude both ways",
        )


def speeds_of(low: float, high: float, count: int) -> Array:
    """Speeds [rad/s] evenly over their logarithm."""
    return np.clip(np.geomspace(low, high, count), low, high)


def curve_speeds(low: float, high: float, count: int) -> Array:
    """Speeds that a list is fitted to: half of them evenly over their logarithm, half evenly."""
    return np.unique(np.r_[speeds_of(low, high, count // 2), np.linspace(low, high, count - count // 2)])


def friction_table(
    nut_map: NutMap, parameters: Parameters, friction_set: FrictionSet, interval: bool,
    speed: Array, preload: Array, temperature: Array,
    progress: Callable[[int, int, str], None] = lambda finished, total, what: None,
) -> FrictionTable:  # fmt: skip
    """Table of a map.

    Parameters   interval : with the ends of the interval, of the mechanistic law
    Raises       ValueError: a point outside the map;  ArithmeticError: as map_interval
    """
    from ..nut_map.interval import map_interval

    axes = nut_map.header["axes"]
    for name, unit, values in (("preload", "N", preload), ("temperature", "K", temperature)):
        low, high = axes[name][:2]
        if bad := [value for value in values if not low <= value <= high]:
            raise ValueError(
                f"{name} = {bad[0]:.6g} {unit}; allowed by the map: {low:.6g} to {high:.6g} {unit}"
            )
    torque = np.asarray(
        nut_map.evaluate(
            preload[None, :, None], speed[:, None, None], temperature[None, None, :]
        ).friction_torque
    )
    about = {
        "screw": parameters.name,
        "oil": parameters.lubricant.name,
        "friction set": f"{friction_set.kinematics}.{friction_set.name}",
        "map": str(nut_map.header["file_hash"]),
    }
    low_ends = high_ends = None
    if interval:
        at = np.exp(np.linspace(np.log(speed[0]), np.log(speed[-1]), INTERVALS))
        ends = np.ones((2, *torque.shape))
        total = len(preload) * len(temperature)
        for j, force in enumerate(preload):
            for k, kelvin in enumerate(temperature):
                progress(j * len(temperature) + k, total, "intervals")
                found = [
                    map_interval(parameters, axes, friction_set, float(force), x, float(kelvin)) for x in at
                ]
                about.setdefault("low and high", found[INTERVALS // 2].meaning)
                for side in (0, 1):
                    own = [one.relative[side] for one in found]
                    ends[side, :, j, k] = np.interp(np.log(speed), np.log(at), own)
        progress(total, total, "intervals")
        low_ends, high_ends = torque * ends[0], torque * ends[1]
    return FrictionTable(
        speed, preload, temperature, torque, low_ends, high_ends, float(parameters.screw.lead), about
    )
