"""Contacts of the packaged screw drawn from the range of its map, for the benchmarks and checks of the contact solver.

Point number i of a seed is the same whatever the number of points.
"""

from __future__ import annotations

import math
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
from reference_screw import GD4008

from ballscrew_tehl.contact import ContactConditions, SolverOptions, ball_conditions, solve
from ballscrew_tehl.nut_map.grid import MapGrid, contact_range
from ballscrew_tehl.parameters.file import Parameters, changed
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.hertz import RACEWAYS

KINEMATICS = ("published", "rolling_frame")
RANGE = contact_range(GD4008, MapGrid())


@cache
def parameters_of(kinematics: str) -> Parameters:
    """The packaged screw with one of the kinematics."""
    return changed(GD4008, friction={"kinematics": kinematics})


class Point(NamedTuple):
    """One contact of a ball: load [N], speed of the screw [r/min], temperature [K]."""

    kinematics: str
    raceway: str
    load: float
    speed_rpm: float
    temperature: float

    @property
    def parameters(self) -> Parameters:
        return parameters_of(self.kinematics)

    @property
    def conditions(self) -> ContactConditions:
        return ball_conditions(
            self.parameters, self.raceway, self.load, self.speed_rpm * RPM, self.temperature
        )

    def __str__(self) -> str:
        return (
            f"{self.kinematics} {self.raceway} {self.load:.4g} N {self.speed_rpm:.4g} r/min "
            f"{self.temperature:.2f} K"
        )


def point_at(u: np.ndarray) -> Point:
    """A point of the unit cube (5,) in the range of the packaged map: logarithms of load and speed, temperature."""
    lightest, heaviest = RANGE.preloaded, RANGE.load[1]
    (slowest, fastest), (coldest, hottest) = RANGE.speed, RANGE.temperature
    return Point(
        KINEMATICS[int(u[4] >= 0.5)],
        RACEWAYS[int(u[3] >= 0.5)],
        float(lightest * (heaviest / lightest) ** u[0]),
        float(slowest * (fastest / slowest) ** u[1] / RPM),
        float(coldest + (hottest - coldest) * u[2]),
    )


def random_points(count: int, seed: int) -> list[Point]:
    """Independent points; both kinematics in turn."""
    found = []
    for number in range(count):
        u = np.random.default_rng((seed, number)).random(5)
        u[4] = number % 2
        found.append(point_at(u))
    return found


def sobol_cube(count: int, seed: int) -> np.ndarray:
    """Points (count, 5) of a scrambled Sobol sequence."""
    return qmc.Sobol(5, seed=seed).random_base2(math.ceil(math.log2(max(count, 2))))[:count]


def compile_kernels() -> None:
    """Compile or load every kernel, before a clock runs: a small thermal solve and a small isothermal one."""
    point = Point("published", "nut", 33.0, 1000.0, 303.15)
    for thermal in (True, False):
        options = SolverOptions(thermal=thermal, n_x=33, n_y=5, n_z=4, max_thermal=2)
        solve(point.conditions, point.parameters.lubricant, point.parameters.solid, options)
