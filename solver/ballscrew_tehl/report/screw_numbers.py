"""Numbers of the section on the screw itself: what the command `screw` states, over preload and axial load."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..mechanics import LoadedScrew, ScrewConstants, efficiency, loaded_screw, screw_constants
from ..parameters.file import Parameters
from ..physics.axial_stiffness import axial_stiffness
from ..physics.ball_law import Array
from ..runtime.evaluate import NutMap
from .lines import OperatingPoint

#: axial loads of the lines: end over the largest separation load, number
AXIAL_END, AXIAL_LOADS = 1.25, 101
#: axial loads of the table over the separation load of the preload
AXIAL_SHARES = (0.0, 0.5, 1.0)
#: preloads of the line of stiffness: end over the largest preload of the lines, number
PRELOAD_END, PRELOADS = 1.5, 61


class ScrewNumbers(NamedTuple):
    """The nut under preload and axial load, SI.

    lines : one row per preload of `preloads`, over `axial_loads`; table : cases of AXIAL_SHARES at each preload
    driving, backdriving : efficiency, one row per speed at the preload of `point`; NaN: no axial load, or outside the
    map
    """

    point: OperatingPoint
    constants: ScrewConstants
    preloads: Array
    axial_loads: Array
    lines: tuple[tuple[LoadedScrew, ...], ...]
    table: tuple[tuple[float, float, LoadedScrew], ...]  # preload, axial load
    preload_line: tuple[Array, Array]  # preload [N], stiffness [N/m] without load
    speeds: Array
    driving: Array
    backdriving: Array

    def line(self, name: str) -> Array:
        """A field of LoadedScrew, one row per preload."""
        return np.array([[getattr(case, name) for case in row] for row in self.lines])


def screw_numbers(
    parameters: Parameters, nut_map: NutMap, point: OperatingPoint, preloads: Array, speeds: Array
) -> ScrewNumbers:
    """Numbers at some preloads [N]; efficiency at some speeds [rad/s] and the point's preload and temperature.

    Raises       ValueError, ArithmeticError as mechanics.loaded_screw
    """
    screw = parameters.screw
    constants = screw_constants(screw)

    def case(preload: float, axial_load: float) -> LoadedScrew:
        return loaded_screw(screw, constants, float(preload), float(axial_load))

    separation = [case(preload, 0.0).separation_load for preload in preloads]
    axial_loads = np.linspace(0.0, AXIAL_END * max(separation), AXIAL_LOADS)
    lines = tuple(tuple(case(preload, load) for load in axial_loads) for preload in preloads)
    table = tuple(
        (float(preload), share * apart, case(preload, share * apart))
        for preload, apart in zip(preloads, separation, strict=True)
        for share in AXIAL_SHARES
    )
    force = np.linspace(0.0, PRELOAD_END * float(preloads[-1]), PRELOADS)
    both = np.array([
        [efficiency_at(parameters, nut_map, point, float(load), float(speed)) for load in axial_loads]
        for speed in speeds
    ])  # fmt: skip
    return ScrewNumbers(
        point, constants, preloads, axial_loads, lines, table,
        (force, axial_stiffness(constants.stiffness, force)), speeds, both[..., 0], both[..., 1],
    )  # fmt: skip


def efficiency_at(
    parameters: Parameters, nut_map: NutMap, point: OperatingPoint, axial_load: float, speed: float
) -> tuple[float, float]:
    """Efficiency driving and backdriving; NaN without axial load and where the map does not reach."""
    state = nut_map.evaluate(point.preload, speed, point.temperature, axial_load)
    found = efficiency(parameters.screw, axial_load, float(state.friction_torque))
    return (math.nan, math.nan) if found is None or not state.in_range else (found.driving, found.backdriving)
