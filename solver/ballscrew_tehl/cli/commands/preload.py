"""The command preload: the preload at which the map gives a measured torque."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from ..._version import __version__
from ...friction.sets import carried_over
from ...parameters.units import CELSIUS, RPM
from ...runtime.packed import MECHANISTIC
from ..shared.chosen import Chosen, chosen_of, say_outside
from ..shared.points import read_points
from ..shared.progress import QUIET, progress_bar
from ..shared.quantities import PRELOAD_POINT
from ..shared.results import print_results, say

if TYPE_CHECKING:
    from ...runtime.evaluate import NutMap


def _at(point: Mapping[str, float]) -> str:
    return f"{point['speed_rpm']:g} r/min and {point['temperature_c']:g} C"


#: of a table
COLUMNS = (
    "torque_nm",
    "speed_rpm",
    "temperature_c",
    "preload_n",
    "preload_low_n",
    "preload_high_n",
    "in_range",
)
#: what is said of ends of an interval that the map cuts off
AT_EDGE = "preload_at_edge"


def _intervals(chosen: Chosen, nut_map: NutMap) -> Callable[..., dict[str, Any]]:
    """Keys of the interval over torque [N.m], preload [N], speed [rad/s] and temperature [K]; none for a fitted law."""
    if nut_map.law != MECHANISTIC:
        return lambda *at: {}
    from ...nut_map.interval import preload_interval

    def found(*at: float) -> dict[str, Any]:
        ends = preload_interval(chosen.parameters, nut_map, chosen.friction_set, *at)
        keys = {"preload_low_n": ends.low, "preload_high_n": ends.high, "preload_interval": ends.meaning}
        return keys | ({AT_EDGE: list(ends.at_edge)} if ends.at_edge else {})

    return found


def run_preload(args: Namespace) -> int:
    """Preload at which the map gives the measured torque."""
    from ...friction.torque import preload_from_torque

    points = read_points(args, PRELOAD_POINT)
    chosen = chosen_of(args)
    nut_map = chosen.nut_map(args)
    if other := carried_over(chosen.friction_set, chosen.parameters):
        say(other)
    axes, interval = nut_map.header["axes"], _intervals(chosen, nut_map)
    lowest = float(axes["preload"][0])
    highest = min(float(axes[name][1]) for name in ("force", "preload"))
    results, below = [], []
    with progress_bar(QUIET) as progress:
        for number, point in enumerate(points):
            progress(number, len(points), "points")
            speed, temperature = point["speed_rpm"] * RPM, point["temperature_c"] + CELSIUS

            def torque(preload: float, speed: float = speed, temperature: float = temperature) -> float:
                state = nut_map.evaluate(preload, speed, temperature)
                return float(state.friction_torque)

            least, most = torque(lowest), torque(highest)
            if not point["torque_nm"] <= most:
                raise ValueError(
                    f"torque_nm = {point['torque_nm']:.6g} at {_at(point)}; allowed: {least:.4g} to {most:.4g} N.m, "
                    f"the torques of this map there (preload {lowest:g} to {highest:g} N); remedy: check unit and sign "
                    "of the torque, or ballscrew map build with a higher --preload-n"
                )
            if point["torque_nm"] < least:
                below.append((point, least))
            preload = preload_from_torque(torque, point["torque_nm"], 0.0, highest)
            state = nut_map.evaluate(preload, speed, temperature)
            results.append({
                **point,
                "preload_n": preload,
                **interval(point["torque_nm"], preload, speed, temperature),
                "in_range": bool(state.in_range),
                "clamped": list(state.clamped),
                **chosen.described,
                **({"friction_note": other} if other and args.json else {}),
                "map_hash": nut_map.header["file_hash"],
                "version": __version__,
            })  # fmt: skip
        progress(len(points), len(points), "points")
    if below:
        point, least = below[0]
        which = "" if len(results) == 1 else f"{len(below)} of {len(results)} points, the first: "
        say(
            f"in_range: false; {which}torque_nm {point['torque_nm']:.6g} is below {least:.4g} N.m, the lowest torque "
            f"that this map answers at {_at(point)} (preload {lowest:g} N): preload_n is extrapolated, not reliable; "
            "remedy: check the unit and what was subtracted from the torque, or ballscrew map build with a lower "
            "--preload-n"
        )
    if cut := [result for result in results if AT_EDGE in result]:
        which = "" if len(results) == 1 else f"{len(cut)} of {len(results)} points, the first: "
        ends = " and ".join(f"preload_{end}_n" for end in cut[0][AT_EDGE])
        say(f"{AT_EDGE}: {which}{ends} at {_at(cut[0])}: the interval goes beyond the map")
    say_outside([result for result in results if result["clamped"] != ["preload"]], axes)
    print_results(results, args.json, bool(args.points), columns=COLUMNS, output=args.output)
    return 0
