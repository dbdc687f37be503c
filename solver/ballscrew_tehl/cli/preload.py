"""The command preload: the preload at which the map gives a measured torque."""

from __future__ import annotations

from argparse import Namespace

from .. import __version__
from ..friction.sets import default_friction_set
from ..parameters.units import CELSIUS, RPM
from .common import map_of, screw_of, warn_of_film
from .main import PRELOAD_POINT
from .points import print_results, read_points


def run_preload(args: Namespace) -> int:
    """Preload at which the map gives the measured torque."""
    from ..friction.torque import preload_from_torque

    points = read_points(args, PRELOAD_POINT)
    parameters = screw_of(args)
    friction_set = default_friction_set(parameters)
    nut_map = map_of(args, parameters)
    warn_of_film(friction_set, nut_map.header["film_model"])
    axes = nut_map.header["axes"]
    highest = min(float(axes[name][1]) for name in ("force", "preload"))
    results = []
    for point in points:
        speed, temperature = point["speed_rpm"] * RPM, point["temperature_c"] + CELSIUS

        def torque(preload: float, speed: float = speed, temperature: float = temperature) -> float:
            state = nut_map.evaluate(preload, speed, temperature, 0.0, *friction_set.values)
            return float(state.friction_torque)

        preload = preload_from_torque(torque, point["torque_nm"], 0.0, highest)
        state = nut_map.evaluate(preload, speed, temperature, 0.0, *friction_set.values)
        results.append({
            **point,
            "preload_n": preload,
            "in_range": bool(state.in_range),
            "clamped": list(state.clamped),
            "screw": parameters.name,
            "kinematics": friction_set.kinematics,
            "friction_set": friction_set.name,
            "map_hash": nut_map.header["file_hash"],
            "version": __version__,
        })  # fmt: skip
    print_results(results, args.json, bool(args.points))
    return 0
