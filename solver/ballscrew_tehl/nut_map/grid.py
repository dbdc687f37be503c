"""Range and nodes of a map, and the map before it is stored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..parameters.file import Parameters
from ..parameters.units import RPM
from ..physics.load import nut_loads
from .contact_map import Array, ContactAxes, ContactMap

LOAD_MARGIN = 0.02  # beyond the ball loads at the ends of the map; at 0 rounding puts them outside


@dataclass(frozen=True)
class MapGrid:
    """Range and nodes of a map.

    force of one nut [N], speed [rad/s], temperature [K], preload [N]: lowest, highest, nodes; the force goes lower than
    the preload, for an axial load relieves one nut; share: nodes of the axial load from 0 to the separation load;
    contact_nodes: of ball load, speed, temperature, to begin with. Axes are halved up to contact_most nodes; of the new
    nodes those are solved whose film is estimated to be off by more than contact_tolerance (sampling.py).
    """

    force: tuple[float, float, int] = (12.0, 12000.0, 31)
    speed: tuple[float, float, int] = (5.0 * RPM, 6000.0 * RPM, 33)
    temperature: tuple[float, float, int] = (283.15, 353.15, 17)
    preload: tuple[float, float, int] = (120.0, 12000.0, 13)
    share_nodes: int = 21
    contact_nodes: tuple[int, int, int] = (5, 9, 5)
    contact_most: tuple[int, int, int] = (33, 33, 17)
    contact_tolerance: float = 2e-3


def contact_axes(parameters: Parameters, grid: MapGrid) -> ContactAxes:
    """Sampling axes that hold every ball load of nuts that are not relieved: ContactMap continues below it."""
    screw = parameters.screw
    lightest = float(nut_loads(screw, grid.preload[0], screw.ball_count).min())
    heaviest = float(nut_loads(screw, grid.force[1], screw.loaded_ball_count).max())
    n_load, n_speed, n_temperature = grid.contact_nodes
    return ContactAxes(
        ((1.0 - LOAD_MARGIN) * lightest, (1.0 + LOAD_MARGIN) * heaviest, n_load),
        (*grid.speed[:2], n_speed),
        (*grid.temperature[:2], n_temperature),
    )


@dataclass(frozen=True)
class BuiltMap:
    """A whole map before it is stored: header without friction defaults, spline arrays per film model, samples."""

    header: dict[str, Any]
    arrays: dict[str, dict[str, Array]]
    contact_map: ContactMap
