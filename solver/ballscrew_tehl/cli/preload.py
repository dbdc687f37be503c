"""The command preload: the preload at which the map gives a measured torque."""

from __future__ import annotations

from argparse import Namespace

from .. import __version__
from ..friction.origin import carried_over
from ..parameters.units import CELSIUS, RPM
from .common import chosen_of, say, say_outside
from .main import PRELOAD_POINT
from .points import print_results, read_points


def run_preload(args: Namespace) -> int:
    """Preload at which the map gives the measured torque."""
    from ..friction.torque import preload_from_torque

    points = read_points(args, PRELOAD_POINT)
    chosen = chosen_of(args)
    nut_map = chosen.nut_map(args)
    if other := carried_over(chosen.friction_set, chosen.parameters):
        say(other)
    axes = nut_map.header["axes"]
    highest = min(float(axes[name][1]) for name in ("force", "preload"))
    results = []
    for point in points:
        speed, temperature = point["speed_rpm"] * RPM, point["temperature_c"] + CELSIUS

        def torque(preload: float, speed: float = speed, temperature: float = temperature) -> float:
            state = nut_map.evaluate(preload, speed, temperature)
            return float(state.friction_torque)

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
    say_outside(results)
    print_results(results, args.json, bool(args.points))
    return 0
