"""`python -m ballscrew_tehl map ...` on a small grid with contacts in closed form, for the commands of the docs
that solve contacts for minutes. Everything else of the command is unchanged.

    python tests/support/small_map_build.py map build --screw my.toml --output my_map.nc
"""

import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from synthetic_contacts import GRID, ClosedFilm, closed_row

from ballscrew_tehl.cli import map as map_commands
from ballscrew_tehl.cli.main import main
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map import build, certificate
from ballscrew_tehl.nut_map.grid import map_grid


def closed_deviation(nut_map, parameters, point):
    """Torque of the map against the closed contacts of every ball; film and rise are not compared."""
    friction_set = default_friction_set(parameters)
    preload, speed, temperature, axial_load = point
    state = nut_map.evaluate(preload, speed, temperature, axial_load, *friction_set.values)
    torque = state.friction_torque
    film = ClosedFilm(parameters, friction_set.film_model == "solved_thermal")
    direct = double_nut_torque(parameters, friction_set, film, *point).total
    return certificate.Deviation(abs(torque / direct - 1.0), 0.0, 0.0)


def small_grid(parameters, preload, speed, temperature, base):
    """Nodes and contacts of GRID, and its range where the command gives none."""
    given = {"preload": preload, "speed": speed, "temperature": temperature}
    if not any(given.values()):
        return GRID
    ends = {name: value or getattr(GRID, name)[:2] for name, value in given.items()}
    return map_grid(parameters, **ends, base=GRID)


@contextmanager
def thread(workers, dask):
    with ThreadPoolExecutor(1) as pool:
        yield pool


if __name__ == "__main__":
    build._solve_row = closed_row
    map_commands.map_grid = small_grid
    map_commands.build_executor = thread
    certificate.deviation_at = closed_deviation
    sys.exit(main(sys.argv[1:]))
