"""Range and nodes of a map, from what the screw and its oil allow; a map before it is stored."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..atlas.ball_contacts import BallRange
from ..numerics import Array, rising_root
from ..parameters.file import WIDEST_ENDS, LubricantParameters, Parameters, ScrewParameters
from ..parameters.units import CELSIUS, RPM, SHOWN
from ..physics.load import largest_preload, nut_loads
from ..physics.lubricant import eta0
from ..physics.rating import ball_pressure

#: called with (finished, total, what) while a map is built
Progress = Callable[[int, int, str], None]
LOAD_MARGIN = 0.02  # beyond the ball loads at the ends of the map; at 0 rounding puts them outside
#: largest Hertz pressure of a map [Pa]: half of the 4.2 GPa that dent balls (ISO 76), so the axial force of one
#: nut goes to about a sixth of C_0a, above any catalogue preload
PRESSURE_LIMIT = 2.1e9
#: largest product of screw speed and diameter of the ball centre circle [m rad/s]: 240,000 mm r/min; catalogues of
#: high-speed screws end at 160,000 to 220,000
SPEED_FACTOR_LIMIT = 240.0 * RPM
#: lowest over highest force of one nut, preload, speed
FORCE_SPAN, PRELOAD_SPAN, SPEED_SPAN = 1e-3, 1e-2, 1.0 / 1200.0
FREED = 0.9  # highest preload of a map over the largest_preload of oversize balls
#: oil temperatures [K], and the viscosities at ambient pressure [Pa s] that narrow them
COLDEST, HOTTEST = 10.0 + CELSIUS, 80.0 + CELSIUS
THINNEST_OIL, THICKEST_OIL = 2e-3, 2.0
MIN_SPAN = 10.0  # least distance of the ends of the temperatures [K]
#: force [N] between which the limit of pressure is sought
MIN_FORCE, LARGEST_FORCE = 1.0, WIDEST_ENDS["preload"][1]
#: viscosities at ambient pressure [Pa s] of any map: thinner oils do not thicken with pressure by the law of Roelands
#: (ln eta0 > -9.67); largest pressure [Pa]: of the static rating
WIDEST_VISCOSITY = 1e-4, 1e4
MAX_PRESSURE = 2.0 * PRESSURE_LIMIT
DIGITS = 2  # digits of the ends of a range


@dataclass(frozen=True)
class MapGrid:
    """Range and nodes of a map.

    force of one nut [N], speed [rad/s], temperature [K], preload [N]: lowest, highest, nodes; the force goes lower than
    the preload, for an axial load relieves one nut; share: nodes of the axial load from 0 to the separation load;
    difference: of the temperature difference of screw and nut.
    """

    force: tuple[float, float, int] = (12.0, 12000.0, 31)
    speed: tuple[float, float, int] = (5.0 * RPM, 6000.0 * RPM, 33)
    temperature: tuple[float, float, int] = (283.15, 353.15, 21)
    preload: tuple[float, float, int] = (120.0, 12000.0, 13)
    share_nodes: int = 21
    difference_nodes: int = 17


@dataclass(frozen=True)
class BuiltMap:
    """A whole map before it is stored: header without friction defaults, spline arrays, parameters."""

    header: dict[str, Any]
    arrays: dict[str, Array]
    parameters: Parameters


def grid_of(axes: Mapping[str, Any]) -> MapGrid:
    """Range and nodes by the axes of the header of a map."""
    ends = {name: tuple(axes[name]) for name in ("force", "speed", "temperature", "preload")}
    return MapGrid(**ends, share_nodes=axes["share"][2], difference_nodes=axes["difference"][2])


def largest_pressure(screw: ScrewParameters, force: float) -> float:
    """Hertz pressure [Pa] of the heaviest ball of a nut under an axial force [N], larger one of both raceways."""
    return ball_pressure(screw, float(nut_loads(screw, force, screw.loaded_ball_count).max()))


def force_at_pressure(screw: ScrewParameters) -> float:
    """Axial force of one nut [N] at which the largest Hertz pressure of its balls reaches PRESSURE_LIMIT."""

    def excess(ln_force: float) -> float:
        return math.log(largest_pressure(screw, math.exp(ln_force)) / PRESSURE_LIMIT)

    ends = math.log(MIN_FORCE), math.log(LARGEST_FORCE)
    if not excess(ends[0]) < 0.0 < excess(ends[1]):
        raise ValueError(
            f"pressure limit = {1e-9 * PRESSURE_LIMIT:.3g} GPa; no axial force from {MIN_FORCE:g} to "
            f"{LARGEST_FORCE:g} N reaches it: check ball diameter, groove radii and ball count, or give --preload-n"
        )
    return math.exp(rising_root(excess, *ends)[0])


def temperature_range(parameters: Parameters) -> tuple[float, float]:
    """Oil temperatures [K] of a map: COLDEST to HOTTEST, where the oil is between THICKEST_OIL and THINNEST_OIL."""
    oil = parameters.lubricant
    good = _temperatures_of_viscosity(oil, (COLDEST, HOTTEST), (THINNEST_OIL, THICKEST_OIL))
    if good.size == 0 or not good[-1] - good[0] >= MIN_SPAN:
        thick, thin = (float(eta0(oil, temperature)) for temperature in (COLDEST, HOTTEST))
        raise ValueError(
            f"{oil.name}: viscosity {thick:.3g} to {thin:.3g} Pa s from "
            f"{COLDEST - CELSIUS:g} to {HOTTEST - CELSIUS:g} C; a map needs {THINNEST_OIL:g} to {THICKEST_OIL:g} Pa s "
            f"over {MIN_SPAN:g} K: give --temperature-c"
        )
    return float(good[0]), float(good[-1])


def _temperatures_of_viscosity(
    oil: LubricantParameters, ends: tuple[float, float], viscosity: tuple[float, float]
) -> Array:
    """Temperatures [K] between two ends, a kelvin apart, where the viscosity is between two bounds [Pa s]."""
    temperatures = np.arange(ends[0], ends[1] + 0.5, 1.0)
    result = np.array([float(eta0(oil, temperature)) for temperature in temperatures])
    return np.asarray(temperatures[(result >= viscosity[0]) & (result <= viscosity[1])])


def _rounded_down(value: float) -> float:
    scale = 10.0 ** (math.floor(math.log10(value)) - DIGITS + 1)
    # a hair above a round number counts as it
    return math.floor(value / scale * (1.0 + 1e-9)) * scale


def map_grid(
    parameters: Parameters,
    preload: tuple[float, float] | None = None,
    speed: tuple[float, float] | None = None,
    temperature: tuple[float, float] | None = None,
) -> MapGrid:
    """Range of a map from the screw and its oil.

    Parameters
    ----------
    parameters : Parameters
        Screw and oil.
    preload, speed, temperature : tuple of float, optional
        Lowest and highest [N], [rad/s], [K]; None: from the screw. Preload to the force_at_pressure, or FREED of the
        largest_preload of oversize balls, speed to SPEED_FACTOR_LIMIT over the diameter of the ball centre circle, both
        rounded down to two digits; temperature_range.

    Returns
    -------
    MapGrid
        Range and nodes.

    Raises
    ------
    ValueError
        No map can have this range.

    Examples
    --------
    >>> from ballscrew_tehl import load_screw
    >>> map_grid(load_screw("example_25x10.toml")).preload
    (48.0, 4800.0, 13)
    """
    if preload is None:
        screw = parameters.screw
        highest = _rounded_down(
            min(force_at_pressure(screw), FREED * largest_preload(screw, parameters.summed_balls))
        )
        preload = PRELOAD_SPAN * highest, highest
    if speed is None:
        fastest = RPM * _rounded_down(SPEED_FACTOR_LIMIT / (2.0 * parameters.screw.nominal_radius) / RPM)
        speed = SPEED_SPAN * fastest, fastest
    if temperature is None:
        temperature = temperature_range(parameters)
    ends = {"preload": preload, "speed": speed, "temperature": temperature}
    _refuse_ends(parameters, ends)
    # an axial load relieves one nut
    force = min(FORCE_SPAN * preload[1], 0.1 * preload[0]), preload[1]
    nodes: dict[str, Any] = {
        name: (*own, getattr(MapGrid(), name)[2]) for name, own in (ends | {"force": force}).items()
    }
    return replace(MapGrid(), **nodes)


def screw_grid(parameters: Parameters, given: Mapping[str, float] | None = None) -> MapGrid:
    """Range of the map of a screw; given: ends by the names of the table [map], SI, before those of the screw file."""
    ends = parameters.map.model_dump() | dict(given or {})

    def of(name: str) -> tuple[float, float] | None:
        low, high = ends[f"{name}_min"], ends[f"{name}_max"]
        return None if low is None or high is None else (low, high)

    return map_grid(parameters, of("preload"), of("speed"), of("temperature"))


def _refuse_ends(parameters: Parameters, ends: Mapping[str, tuple[float, float]]) -> None:
    """Raise ValueError, in the units of the options, unless a map can have these ends of its axes."""
    what = {}
    for name, (low, high) in ends.items():
        shown, (least, most) = SHOWN[name], WIDEST_ENDS[name]
        what[name] = f"{name} = {shown.of(low):.6g} to {shown.of(high):.6g} {shown.unit}"
        if not least <= low < high <= most:
            raise ValueError(
                f"{what[name]}; needs {shown.of(least):.6g} <= lowest < highest <= {shown.of(most):.6g}"
            )
    pressure = 1e-9 * largest_pressure(parameters.screw, ends["preload"][1])
    if not pressure <= 1e-9 * MAX_PRESSURE:
        raise ValueError(
            f"{what['preload']}: Hertz pressure up to {pressure:.3g} GPa; allowed: {1e-9 * MAX_PRESSURE:.3g} GPa"
        )
    most = largest_preload(parameters.screw, parameters.summed_balls)
    if not ends["preload"][1] < most:
        raise ValueError(
            f"{what['preload']}; allowed: below {most:.4g} N: no axial load frees balls that are larger"
        )
    thick, thin = (float(eta0(parameters.lubricant, temperature)) for temperature in ends["temperature"])
    least, most = WIDEST_VISCOSITY
    if not least <= thin <= thick <= most:
        widest = WIDEST_ENDS["temperature"]
        good = _temperatures_of_viscosity(parameters.lubricant, widest, WIDEST_VISCOSITY) - CELSIUS
        where = f", that is {math.ceil(good[0])} to {math.floor(good[-1])} C" if good.size else ""
        raise ValueError(
            f"{what['temperature']}: viscosity of {parameters.lubricant.name} {thin:.3g} to {thick:.3g} Pa s; allowed: "
            f"{least:g} to {most:g} Pa s{where}"
        )


def ball_range(parameters: Parameters, grid: MapGrid) -> BallRange:
    """Range that holds every ball load of a nut from the lowest to the highest force."""
    screw = parameters.screw
    lightest = (1.0 - LOAD_MARGIN) * float(nut_loads(screw, grid.force[0], parameters.summed_balls).min())
    heaviest = (1.0 + LOAD_MARGIN) * float(nut_loads(screw, grid.force[1], screw.loaded_ball_count).max())
    return BallRange((lightest, heaviest), grid.speed[:2], grid.temperature[:2])
