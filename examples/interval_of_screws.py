"""Torque over catalogue torque (100 r/min, 30 C), and width of the interval, high over low end, of a folder of screws.

Without calibration and axial load, at the preload of catalogues; width: least and largest over speeds and temperatures.
Default folder: ten example screws, 8x2 to 80x20.
"""

import sys
from pathlib import Path

import numpy as np

from ballscrew_tehl.applications.mechanics import loaded_screw, screw_constants
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map.grid import map_grid
from ballscrew_tehl.nut_map.interval import map_interval, nearest
from ballscrew_tehl.parameters.file import load_screw
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.rating import catalogue_preload

SCREWS = Path(__file__).parent / "screws"
SLOW, SPEEDS, TEMPERATURES = 100.0 * RPM, (0.1, 0.5, 1.0), (10.0, 30.0, 60.0)  # over the largest speed; degC


def main(folder: Path | str = SCREWS) -> dict[str, tuple[float, float, float]]:
    """Torque over catalogue torque, least and largest width, by the name of the file."""
    rows = {}
    for path in sorted(Path(folder).glob("*.toml")):
        parameters = load_screw(path)
        screw, axes = parameters.screw, vars(map_grid(parameters))
        law = parameters, axes, default_friction_set(parameters), catalogue_preload(screw)
        intervals = [
            map_interval(*law, speed, nearest(axes, "temperature", celsius + CELSIUS))
            for speed in (SLOW, *(part * axes["speed"][1] for part in SPEEDS))
            for celsius in TEMPERATURES
        ]
        catalogue = loaded_screw(screw, screw_constants(screw), law[3], 0.0).catalogue_torque
        widths = [high / low for low, high in (one.relative for one in intervals)]
        rows[path.stem] = intervals[1].torque / catalogue, min(widths), max(widths)
    return rows


if __name__ == "__main__":
    table = main(*sys.argv[1:2])
    for name, row in {
        **table,
        "least": np.min([*table.values()], 0),
        "largest": np.max([*table.values()], 0),
    }.items():
        print("{:<16}{:>8.2f}{:>8.2f}{:>8.2f}".format(name, *row))
