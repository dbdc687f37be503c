"""The command preload: the preload at which the map gives a measured torque."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping

from ... import __version__
from ...friction.origin import carried_over
from ...parameters.units import CELSIUS, RPM
from ..shared.chosen import chosen_of, say_outside
from ..shared.points import read_points
from ..shared.quantities import PRELOAD_POINT
from ..shared.results import print_results, say


def _at(point: Mapping[str, float]) -> str:
    return f"{point['speed_rpm']:g} r/min and {point['temperature_c']:g} C"


def run_preload(args: Namespace) -> int:
    """Preload at which the map gives the measured torque."""
    from ...friction.torque import preload_from_torque

    points = read_points(args, PRELOAD_POINT)
    chosen = chosen_of(args)
    nut_map = chosen.nut_map(args)
    if other := carried_over(chosen.friction_set, chosen.parameters):
        say(other)
    axes = nut_map.header["axes"]
    lowest = float(axes["preload"][0])
    highest = min(float(axes[name][1]) for name in ("force", "preload"))
    results, below = [], []
    for point in points:
        speed, temperature = point["speed_rpm"] * RPM, point["temperature_c"] + CELSIUS

        def torque(preload: float, speed: float = speed, temperature: float = temperature) -> float:
            state = nut_map.evaluate(preload, speed, temperature)
            return float(state.friction_torque)

        least, most = torque(lowest), torque(highest)
        if not point["torque_nm"] <= most:
            raise ValueError(
                f"torque_nm = {point['torque_nm']:.6g} at {_at(point)}; allowed: {least:.4g} to {most:.4g} N.m, the "
                f"torques of this map there (preload {lowest:g} to {highest:g} N); remedy: check unit and sign of the "
                "torque, or map build with a higher --preload-n"
            )
        if point["torque_nm"] < least:
            below.append((point, least))
        preload = preload_from_torque(torque, point["torque_nm"], 0.0, highest)
        state = nut_map.evaluate(preload, speed, temperature)
        results.append({
            **point,
            "preload_n": preload,
            "in_range": bool(state.in_range),
            "clamped": list(state.clamped),
            **chosen.described,
            **({"friction_note": other} if other and args.json else {}),
            "map_hash": nut_map.header["file_hash"],
            "version": __version__,
        })  # fmt: skip
    if below:
        point, least = below[0]
        which = "" if len(results) == 1 else f"{len(below)} of {len(results)} points, the first: "
        say(
            f"in_range: false; {which}torque_nm {point['torque_nm']:.6g} is below {least:.4g} N.m, the lowest torque "
            f"that this map answers at {_at(point)} (preload {lowest:g} N): preload_n is extrapolated, not reliable; "
            "remedy: check the unit and what was subtracted from the torque, or map build with a lower --preload-n"
        )
    say_outside([result for result in results if result["clamped"] != ["preload"]], axes)
    print_results(results, args.json, bool(args.points))
    return 0
