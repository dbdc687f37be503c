"""The command torque: friction torque, films and contact extremes, from the map or by direct solves."""

from __future__ import annotations

import math
from argparse import Namespace
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..friction.sets import FrictionSet, default_friction_set
from ..parameters.file import FOUR_POINT, Parameters
from ..parameters.units import CELSIUS, RPM
from .common import EXTREMES, film_model_of, map_of, say, screw_of, warn_of_film
from .main import TORQUE_POINT
from .points import print_results, read_points

if TYPE_CHECKING:
    from ..runtime.evaluate import NutMap


def _signed(parts: tuple[float, float, float], speed: float) -> dict[str, float]:
    """Torques that oppose the motion: sign of the speed, 0 at rest."""
    sign = math.copysign(1.0, speed) if speed else 0.0
    viscous, hysteresis, sliding = (sign * float(part) for part in parts)
    return {
        "friction_torque_nm": viscous + hysteresis + sliding,
        "viscous_torque_nm": viscous,
        "hysteresis_torque_nm": hysteresis,
        "sliding_torque_nm": sliding,
    }


def run_torque(args: Namespace) -> int:
    """Friction torque, films and contact extremes at one or many operating points."""
    points = read_points(args, TORQUE_POINT)
    parameters = screw_of(args)
    friction_set = default_friction_set(parameters)
    if args.direct:
        results = _direct_torques(parameters, friction_set, points)
    else:
        results = _map_torques(map_of(args, parameters), friction_set, points)
    common = {
        "screw": parameters.name,
        "kinematics": friction_set.kinematics,
        "friction_set": friction_set.name,
    }
    print_results(
        [
            {**result, **_single_nut(parameters, result), **common, "version": __version__}
            for result in results
        ],
        args.json,
        bool(args.points),
    )
    return 0


def _single_nut(parameters: Parameters, point: dict[str, Any]) -> dict[str, Any]:
    """Additional results of a single nut: its kind, and an upper bound of the torque of spinning balls."""
    kind = parameters.screw.preload_kind
    if kind == "double_nut":
        return {}
    if kind != FOUR_POINT:
        return {"preload_kind": kind}
    from ..friction.torque import four_point_spin_bound

    bound = four_point_spin_bound(parameters, point["preload_n"], point["axial_load_n"])
    return {"preload_kind": kind, "spin_torque_not_included_at_most_nm": bound}


def _map_torques(
    nut_map: NutMap, friction_set: FrictionSet, points: list[dict[str, float]]
) -> list[dict[str, Any]]:
    warn_of_film(friction_set, nut_map.header["film_model"])
    results = []
    for point in points:
        speed = point["speed_rpm"] * RPM
        state = nut_map.evaluate(
            point["preload_n"],
            speed,
            point["temperature_c"] + CELSIUS,
            point["axial_load_n"],
            *friction_set.values,
        )
        results.append({
            **point,
            **_signed((state.viscous_torque, state.hysteresis_torque, state.sliding_torque), speed),
            **{key: float(getattr(state, name)) for name, key in EXTREMES.items()},
            "in_range": bool(state.in_range),
            "clamped": list(state.clamped),
            "map_hash": nut_map.header["file_hash"],
        })  # fmt: skip
    return results


def _direct_torques(
    parameters: Parameters, friction_set: FrictionSet, points: list[dict[str, float]]
) -> list[dict[str, Any]]:
    from ..friction.torque import double_nut_torque
    from ..refinement.direct import direct_extremes
    from ..runtime.constants import LAMBDA_RATIO_MAX, SMOOTH

    for point in points:
        if point["speed_rpm"] == 0.0 or point["preload_n"] == 0.0:
            raise ValueError("speed_rpm or preload_n = 0; allowed with --direct: not 0 (no film at rest)")
    film_model = film_model_of(friction_set.film_model, parameters)
    results = []
    for number, point in enumerate(points, start=1):
        say(f"point {number} of {len(points)}")
        speed, temperature = point["speed_rpm"] * RPM, point["temperature_c"] + CELSIUS
        preload, axial_load = point["preload_n"], point["axial_load_n"]
        parts = double_nut_torque(
            parameters, friction_set, film_model, preload, speed, temperature, axial_load
        )
        extremes = direct_extremes(parameters, preload, axial_load, abs(speed), temperature)
        lambda_ratio = extremes["film_thickness_min"] / max(friction_set.roughness_height, SMOOTH)
        extremes["lambda_ratio"] = min(lambda_ratio, LAMBDA_RATIO_MAX)
        results.append({
            **point,
            **_signed((parts.viscous, parts.hysteresis, parts.sliding), speed),
            **{key: float(extremes[name]) for name, key in EXTREMES.items()},
            "in_range": True,
            "clamped": [],
        })  # fmt: skip
    return results
