"""Contacts in closed form instead of solved ones, for fast tests of the map build and of its file.

The logarithms of the ratios to the closed film formula and of the temperature rise are cubic polynomials or
less in (ln load, ln speed, temperature): the contact map holds them exactly. The row function can be sent to
other processes.
"""

from concurrent.futures import Executor, ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest
from reference_screw import GD4008

from ballscrew_tehl.nut_map import build
from ballscrew_tehl.nut_map.build import RPM, BuiltMap, MapGrid, build_map
from ballscrew_tehl.nut_map.contact_map import FILMS, QUANTITIES, film_formula

GRID = MapGrid(
    force=(120.0, 12000.0, 7),
    speed=(300.0 * RPM, 3000.0 * RPM, 6),
    temperature=(293.15, 313.15, 4),
    preload=(200.0, 9000.0, 5),
    share_nodes=6,
    contact_nodes=(4, 5, 4),
)
SHARE = {FILMS[0]: 1.0, FILMS[1]: 0.8, FILMS[2]: 0.5}


def ratio(raceway, name, load, speed, temperature):
    """Film over closed formula."""
    x, y, z = np.log(load / 30.0), np.log(speed / 100.0), (temperature - 303.15) / 10.0
    side = 1.0 if raceway == "screw" else 0.9
    cooling = 0.0 if name == FILMS[0] else 0.1 * y + 0.02 * y**2 - 0.03 * z * y
    return SHARE[name] * side * np.exp(0.02 * x - 0.005 * x**3 + 0.04 * y * x - 0.01 * z**2 - cooling)


def temperature_rise(raceway, load, speed, temperature):
    """Rise [K]."""
    x, y, z = np.log(load / 30.0), np.log(speed / 100.0), (temperature - 303.15) / 10.0
    side = 20.0 if raceway == "screw" else 15.0
    return side * np.exp(0.3 * x + 0.9 * y - 0.05 * y**3 - 0.1 * z + 0.01 * x * y * z)


def film(parameters, raceway, name, load, speed, temperature):
    """Central or minimum film [m] of balls with load (n,)."""
    formula = film_formula(parameters, raceway, np.asarray(load), speed, temperature)
    return formula * ratio(raceway, name, load, speed, temperature)


class ClosedFilm:
    """Film model of the closed form, without a map between."""

    def __init__(self, parameters, thermal):
        self.parameters = parameters
        self.name = "solved_thermal" if thermal else "solved"
        self._quantity = FILMS[1] if thermal else FILMS[0]

    def central_film(self, raceway, load, speed, temperature):
        return film(self.parameters, raceway, self._quantity, load, speed, temperature)


def closed_row(parameters, raceway, load, speeds, temperature):
    """In place of build._solve_row."""
    row = {name: np.empty(speeds.size) for name in QUANTITIES}
    for i, speed in enumerate(speeds):
        for name in FILMS:
            row[name][i] = film(parameters, raceway, name, load, speed, temperature)
        row["temperature_rise"][i] = temperature_rise(raceway, load, speed, temperature)
    row["pressure_max"][:] = 1e9 * (load / 40.0) ** (1 / 3)
    row["traction_force"][:] = 0.03 * load * np.exp(-0.1 * speeds / 100.0)
    row["asymptotic"][:] = load > 200.0
    return row


def closed_build(
    parameters=GD4008, grid: MapGrid = GRID, progress=None, row=closed_row, executor: Executor | None = None
) -> BuiltMap:
    """build_map with closed contacts, in one thread unless an executor is given."""
    with pytest.MonkeyPatch.context() as patch, ThreadPoolExecutor(1) as thread:
        patch.setattr(build, "_solve_row", row)
        return build_map(parameters, None, progress, grid, executor or thread)


@cache
def small_map() -> BuiltMap:
    """The map of GD4008 over GRID."""
    return closed_build()
