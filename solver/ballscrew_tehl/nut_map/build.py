"""Building a map: the contacts of the balls, read from the atlas, summed over a nut; no contact is solved."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from .._version import __version__
from ..atlas.ball_contacts import BallContacts
from ..atlas.contact_atlas import OutsideAtlasError
from ..friction.interval import with_constants
from ..friction.mechanistic import (
    Nut,
    drag_limit,
    gap_drag,
    law_constants,
    powers_of_nuts,
    rolling_ball_torque,
)
from ..numerics import Array
from ..parameters.file import FOUR_POINT, Parameters
from ..physics.hertz import RACEWAYS
from ..physics.kinematics import entrainment_speed
from ..physics.load import double_nut_loads, nut_loads, separation_load
from ..physics.thermal_preload import preload_shifts
from ..runtime.bspline import map_arrays
from ..runtime.constants import MOST_DIFFERENCE, STRETCH
from ..runtime.packed import TORQUE_CURVES, Law
from .grid import BuiltMap, MapGrid, Progress, ball_range, largest_pressure, map_grid

LAW_CONSTANTS = "law_constants"  # key of the header of a map of the mechanistic law
#: every third temperature, at which the shear of balls on two flanks is summed; its mean changes by 1.6e-3 at most
SPARSE = slice(1, None, 3)
LARGE_ROUGHNESS = 1.0  # [m] on which asperities carry all
LEAST_DRAG = 1e-30  # [N.m] of gaps without oil: the map holds its logarithm
FORCES = 16  # between two calls of the progress; 8 at a time take a tenth longer


def build_map(
    parameters: Parameters, grid: MapGrid | None = None, progress: Progress | None = None
) -> BuiltMap:
    """Build the map of a screw by the mechanistic law.

    Parameters
    ----------
    parameters : Parameters
        Screw and oil.
    grid : MapGrid, optional
        Range and nodes; None: what screw and oil allow.
    progress : callable, optional
        Called with what is done, the total and a text.

    Returns
    -------
    BuiltMap
        To be written by save_map.

    Raises
    ------
    ValueError
        No range.
    OutsideAtlasError
        A screw or oil that the atlas does not include, or the sliding contacts of the law of the paper.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> small = MapGrid((100.0, 2000.0, 5), (10.0, 100.0, 5), (303.15, 323.15, 5), (200.0, 2000.0, 5), 5)
    >>> build_map(load_screw("example_25x10.toml"), small).arrays["coefficients"].shape
    (7, 7, 7, 10)
    """
    if parameters.friction.law is Law.THREE_PARAMETER:
        raise OutsideAtlasError(
            f"law = {parameters.friction.law}; the atlas holds contacts of {Law.MECHANISTIC}: the map of the law of "
            "the paper is packaged, for the GD4008-3 alone; remedy: ballscrew torque --direct"
        )
    grid = grid or map_grid(parameters)
    contacts = BallContacts(parameters, ball_range(parameters, grid))
    total, report = grid.force[2] + 2, progress or (lambda done, total, what: None)
    surfaces, alone = mechanistic_values(parameters, contacts, grid, lambda done: report(done, total, "map"))
    forces = force_values(parameters, grid, alone)
    extremes = extreme_values(parameters, contacts, grid)
    report(total - 1, total, "map")
    values = np.concatenate([surfaces, extremes], axis=-1)
    arrays = map_arrays(
        values,
        forces,
        drag_values(parameters, grid),
        *sharing_values(parameters, grid),
        shift_values(parameters, grid),
    )
    report(total, total, "map")
    header = {
        **map_header(parameters, grid),
        LAW_CONSTANTS: law_constants(parameters),
        "atlas": contacts.atlas.hash,
        "atlas_fraction": atlas_fraction(contacts, grid),
        "certificate": contacts.atlas.header["certificate"],
    }
    return BuiltMap(header, arrays, parameters)


def map_header(parameters: Parameters, grid: MapGrid) -> dict[str, Any]:
    """Axes, law and version of a map."""
    axes = {name: list(getattr(grid, name)) for name in ("force", "speed", "temperature", "preload")}
    axes |= {
        "share": [0.0, 1.0, grid.share_nodes],
        "difference": [-MOST_DIFFERENCE, MOST_DIFFERENCE, grid.difference_nodes],
    }
    return {
        "axes": axes,
        "law": parameters.friction.law,
        "version": __version__,
    }


def atlas_fraction(contacts: BallContacts, grid: MapGrid) -> float:
    """Fraction of the contacts of the nodes of a map, of its mean balls, that lie within the range of the atlas."""
    forces, *points = _nodes(grid)
    screw = contacts.parameters.screw
    loads = np.array([float(nut_loads(screw, float(f), screw.loaded_ball_count).mean()) for f in forces])
    at = np.meshgrid(loads, *points, indexing="ij", sparse=True)
    return float(np.mean([contacts.inside(raceway, *at) for raceway in RACEWAYS]))


def extreme_values(parameters: Parameters, contacts: BallContacts, grid: MapGrid) -> Array:
    """Minimum and central film [m], largest rise [K] over the load-carrying balls of one nut (..., 6), by raceway.

    Films fall and heating rises with load, but not everywhere: both ends of the range of loads are evaluated.
    """
    forces, *points = _nodes(grid)
    values = np.empty((forces.size, *(nodes.size for nodes in points), 6))
    for i, force in enumerate(forces):
        loads = nut_loads(parameters.screw, float(force), parameters.screw.loaded_ball_count)
        ends = np.array([loads.min(), loads.max()])
        for r, raceway in enumerate(RACEWAYS):
            result = contacts.values(raceway, ends, *points)
            values[i, ..., r] = result["minimum_film"].min(axis=0)
            values[i, ..., 2 + r] = result["central_film"].min(axis=0)
            values[i, ..., 4 + r] = result["temperature_rise"].max(axis=0)
    return values


def force_values(parameters: Parameters, grid: MapGrid, alone: Array) -> Array:
    """Quantities of the force of a nut alone (n_force, 9), packed.FORCE_CURVES, the first of them by the law: alone."""
    screw, ends = parameters.screw, []
    for force in _nodes(grid)[0]:
        heaviest = nut_loads(screw, float(force), screw.loaded_ball_count).max()
        ends.append((largest_pressure(screw, float(force)), heaviest))
    return np.hstack([alone, ends])


def mechanistic_values(
    parameters: Parameters, contacts: BallContacts, grid: MapGrid, report: Callable[[int], None]
) -> tuple[Array, Array]:
    """Torques of one nut by the mechanistic law, and those of its force alone; report: called with forces done.

    (n_force, n_speed, n_temperature, 4): rolling torque screw and nut, shear torque [N.m], thrust factor; (n_force,
    TORQUE_CURVES): hysteresis torque, ball-ball torque at coefficient 1 [N.m], shear of a ball on two flanks over that
    of one on four alike, and the speed at which neighbours slide, geometric means over speeds and SPARSE temperatures,
    shear torque where asperities carry all, drag of the oil over drag_values and its limit [N.m]
    """
    forces, speeds, temperatures = _nodes(grid)
    loads = [nut_loads(parameters.screw, float(f), parameters.screw.loaded_ball_count) for f in forces]
    at, powers, ratios = (speeds[:, None], temperatures), [], []
    for first in range(0, len(loads), FORCES):
        report(first)
        some = [Nut(own) for own in loads[first : first + FORCES]]
        (result,) = powers_of_nuts([parameters], some, *at, contacts, partial(report, first))
        powers += result
        if parameters.screw.preload_kind == FOUR_POINT:
            two = [nut._replace(opposed=np.zeros_like(nut.loads)) for nut in some]
            (free,) = powers_of_nuts([parameters], two, at[0], temperatures[SPARSE], contacts)
            ratios += [
                (_mean(one.shear / p.shear[:, SPARSE]), _mean(one.sliding / np.asarray(p.sliding)[:, SPARSE]))
                for one, p in zip(free, result, strict=True)
            ]
    # in thick films oversize balls turn slower than by rolling: that is in the factor
    sliding = np.array([rolling_ball_torque(parameters, own) for own in loads])
    values = np.stack([
        np.stack([p.viscous_screw, p.viscous_nut, p.shear, p.thrust_factor * p.sliding / full], axis=-1)
        for p, full in zip(powers, sliding, strict=True)
    ])  # fmt: skip
    # where no film is left the stress does not depend on speed, temperature and oil
    dry = with_constants(parameters, {"roughness_height": LARGE_ROUGHNESS})
    (boundary,) = powers_of_nuts([dry], [Nut(own) for own in loads], speeds[0], temperatures[0], contacts)
    sets = 2.0 if parameters.screw.preload_kind == FOUR_POINT else 1.0  # of flanks that share the gaps
    u, total = float(entrainment_speed(parameters.screw, 1.0)), np.array([own.sum() for own in loads])
    alone = np.ones((len(powers), TORQUE_CURVES))
    alone[:, 0], alone[:, 1] = [p.hysteresis for p in powers], sliding
    alone[:, 2:4] = ratios or 1.0
    alone[:, 4] = [float(nut.shear) for nut in boundary]
    alone[:, 5] = (sliding / (u * total)) ** 2 / sets
    alone[:, 6] = drag_limit(parameters.friction) * sliding
    return values, alone


def _mean(values: Any) -> float:
    """Geometric mean."""
    return float(np.exp(np.mean(np.log(values))))


def drag_values(parameters: Parameters, grid: MapGrid) -> Array:
    """Drag (n_speed, n_temperature) [N.m] of the oil in the gaps of a nut whose balls slide on each other at 2 u_e."""
    _, speeds, temperatures = _nodes(grid)
    balls = parameters.screw.loaded_ball_count
    return np.maximum(gap_drag(parameters, balls, speeds[:, None], temperatures), LEAST_DRAG)


def sharing_values(parameters: Parameters, grid: MapGrid) -> tuple[Array, Array]:
    """Separation load over preload (n_preload, 2), (relieved force/preload)^(2/3) (n_preload, n_share, 2); load +-."""
    screw, count = parameters.screw, parameters.summed_balls
    preloads, shares = np.geomspace(*grid.preload), np.linspace(0.0, 1.0, grid.share_nodes)
    ratio, relieved = np.empty((preloads.size, 2)), np.zeros((preloads.size, shares.size, 2))
    for i, preload in enumerate(preloads):
        for side, sign in enumerate((1, -1)):
            largest = abs(separation_load(screw, float(preload), count, sign))
            ratio[i, side] = largest / preload
            for k, fraction in enumerate(shares[:-1]):
                both = double_nut_loads(screw, float(preload), float(sign * fraction * largest), count)
                force = min(both.force_a, both.force_b) if fraction > 0.0 else preload
                relieved[i, k, side] = (max(force, 0.0) / preload) ** (2.0 / 3.0)
    return ratio, relieved


def shift_values(parameters: Parameters, grid: MapGrid) -> Array:
    """Change (n_preload, n_difference) of preload^(2/3) [N^(2/3)] by the temperature difference of screw and nut."""
    stretched = np.sinh(STRETCH * np.linspace(-1.0, 1.0, grid.difference_nodes)) / math.sinh(STRETCH)
    preloads, screw = np.geomspace(*grid.preload), parameters.screw
    return preload_shifts(screw, preloads, MOST_DIFFERENCE * stretched, parameters.summed_balls)


def _nodes(grid: MapGrid) -> tuple[Array, Array, Array]:
    return np.geomspace(*grid.force), np.geomspace(*grid.speed), np.linspace(*grid.temperature)
