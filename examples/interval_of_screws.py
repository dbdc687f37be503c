"""Width of the interval of a torque, and torque over catalogue torque, of a folder of screw files.

Without a calibration, at the preload that catalogues state torques for, without axial load. Width: high end over low
end. Default folder: the ten example screws of the source tree, 8x2 to 80x20.
"""

import sys
from pathlib import Path

import numpy as np

from ballscrew_tehl.friction.baselines import nsk_torque
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.mechanics import catalogue_preload
from ballscrew_tehl.nut_map.grid import map_grid
from ballscrew_tehl.nut_map.interval import map_interval
from ballscrew_tehl.parameters.file import Parameters, load_screw
from ballscrew_tehl.parameters.units import CELSIUS, RPM

SCREWS = Path(__file__).parents[1] / "tests/data/screws"
#: r/min of catalogue torques, and speeds over the largest one of a screw; degC
CATALOGUE_RPM, SPEEDS, TEMPERATURES = 100.0, (0.1, 0.5, 1.0), (10.0, 30.0, 60.0)


def row(parameters: Parameters) -> list[float]:
    """Torque over catalogue torque at 100 r/min and 30 C; least and largest width, at 100 r/min and SPEEDS."""
    grid, preload = map_grid(parameters), catalogue_preload(parameters.screw)
    given = parameters, vars(grid), default_friction_set(parameters), preload
    slow = CATALOGUE_RPM * RPM
    ratio = map_interval(*given, slow, 30.0 + CELSIUS).torque / float(nsk_torque(parameters.screw, preload))
    widths = []
    for speed in (slow, *(part * grid.speed[1] for part in SPEEDS)):
        for temperature in np.clip(np.array(TEMPERATURES) + CELSIUS, *grid.temperature[:2]):
            low, high = map_interval(*given, speed, float(temperature)).relative
            widths.append(high / low)
    return [ratio, min(widths), max(widths)]


def main(folder: Path | str = SCREWS) -> dict[str, list[float]]:
    """Row of each screw by the name of its file."""
    return {path.stem: row(load_screw(path)) for path in sorted(Path(folder).glob("*.toml"))}


def table(rows: dict[str, list[float]]) -> str:
    """The rows, and the range over them."""
    columns = np.array(list(rows.values()))
    lines = [f"{'screw':<16}{'over catalogue':>16}{'least width':>14}{'largest width':>15}"]
    for name, values in {**rows, "least": columns.min(axis=0), "largest": columns.max(axis=0)}.items():
        lines.append("{:<16}{:>16.2f}{:>14.2f}{:>15.2f}".format(name, *values))
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(main(*sys.argv[1:2])))
