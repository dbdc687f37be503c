"""The command torque: friction torque, films and contact extremes, from the map or by direct solves."""

import functools
import math
from argparse import Namespace
from collections.abc import Callable, Mapping
from typing import Any

from ballscrew_tehl._version import __version__
from ballscrew_tehl.applications.screw_model import ScrewModel
from ballscrew_tehl.applications.torque_point import TorquePoint, solved_torque, torque_at_point
from ballscrew_tehl.applications.trend import too_thick, too_thin
from ballscrew_tehl.friction.drag_torque import preload_left
from ballscrew_tehl.friction.sets import carried_over
from ballscrew_tehl.parameters.file import ScrewParameters
from ballscrew_tehl.parameters.screw import SEALS
from ballscrew_tehl.parameters.units import CELSIUS, RPM

from ...quantities import TORQUE_POINT
from ..shared.inputs import chosen_of, key_of, map_of, read_points, say_outside, some_of
from ..shared.output import Answer, each, say

Values = dict[str, Any]
#: of a table
COLUMNS = ("preload_n", "speed_rpm", "temperature_c", "axial_load_n", "friction_torque_nm", "torque_low_nm",
           "torque_high_nm", "in_range", "film_thickness_min_m")  # fmt: skip
#: outputs of the map
EXTREMES = ("film_thickness_min", "film_thickness_central_screw", "film_thickness_central_nut",
            "film_temperature_rise", "contact_pressure_max", "ball_load_max", "lambda_ratio")  # fmt: skip
#: preload by the temperature difference of screw and nut
ACTUAL = "preload_actual_n"
PARTS = ("viscous_torque_nm", "hysteresis_torque_nm", "sliding_torque_nm")
#: torque at which motion begins, of an answer at speed 0
BREAKAWAY = "breakaway_torque_nm"
#: a film beyond lubrication theory, a torque that goes the wrong way, oversize balls that slip
OUT_OF_RANGE = ("too_thick_film", "unphysical_trend", "unlike_flanks")
RESERVATIONS = ("too_thin_film", *OUT_OF_RANGE)
#: torque of seals over that of usual ones, above which a line says so
MAX_SEALS = 3.0


def run_torque(args: Namespace) -> Answer:
    """Friction torque, films and contact extremes at one or many operating points."""
    points, difference = read_points(args, TORQUE_POINT), args.temperature_difference_k
    selection = chosen_of(args)
    factor = selection.friction_set.preload_factor
    points = [_warmed(selection, point, difference) for point in points]
    screw = selection.parameters.screw
    if args.direct:
        if any(point["speed_rpm"] == 0.0 or point["preload_n"] == 0.0 for point in points):
            raise ValueError("speed_rpm or preload_n = 0; allowed with --direct: not 0 (no film at rest)")
        if any(point.get(ACTUAL) == 0.0 for point in points):
            raise ValueError(f"{ACTUAL} = 0 at this temperature difference; allowed with --direct: not 0")
        axes, work = {"preload": (0.0, math.inf)}, each(points, "points solved", quiet=0.0)
        point_at, provenance = solved_torque(selection)
    else:
        nut_map = map_of(selection)
        header, work = nut_map.header, each(points, "points")
        axes, point_at = header["axes"], functools.partial(torque_at_point, selection, nut_map)
        provenance = {"map_hash": header["file_hash"]}
    results = [_result(screw, point, factor, point_at) for point in work]
    say_outside(results, axes)
    usual = SEALS * (2.0 * screw.nominal_radius) ** 2
    if screw.seal_torque > MAX_SEALS * usual:
        say(
            f"seal_torque_Nm {screw.seal_torque:g} of the screw file; catalogues have {usual:.2g} N.m for two seals"
        )
    if other := carried_over(selection.friction_set, selection.parameters):
        say(other)
    if resting := [result for result in results if BREAKAWAY in result]:
        say(
            f"speed_rpm 0: {some_of(resting, results)}at rest friction balances the torque of the drive up to "
            f"{BREAKAWAY} = {resting[0][BREAKAWAY]:.6g} N.m either way; friction_torque_nm is that of motion, and 0"
        )
    # a table has no room for them
    for key in RESERVATIONS if args.points and not args.json else ():
        if marked := [result for result in results if key in result]:
            at = ", ".join(f"{quantity.name} {marked[0][quantity.name]:g}" for quantity in TORQUE_POINT)
            say(f"{key}: {len(marked)} of {len(results)} points, the first: {at}: {marked[0][key]}")
    for result in results:
        result |= provenance
        if result["preload_n"] <= axes["preload"][1]:
            # else the torque is that of the edge of the map: another preload
            result |= selection.printed(result["preload_n"])
            result |= selection.catalogue_note(result["axial_load_n"])
            result |= {} if screw.preload_kind == "double_nut" else {"preload_kind": screw.preload_kind}
        result |= selection.described | ({"friction_note": other} if other and args.json else {})
        result["version"] = __version__
    columns = (*COLUMNS, ACTUAL) if difference else COLUMNS
    return Answer(results, bool(args.points), columns=columns, output=args.output)


def _warmed(screw: ScrewModel, point: dict[str, float], difference: float | None) -> dict[str, float]:
    """A point with the true preload at a temperature difference of screw and nut [K], if there is one."""
    if not difference:
        return point
    numbers = screw.friction_set
    left = preload_left(screw.parameters, numbers, point["preload_n"], difference)
    return point | {"temperature_difference_k": difference, ACTUAL: numbers.preload_factor * left}


def _result(
    screw: ScrewParameters, point: Mapping[str, float], factor: float, point_at: Callable[..., TorquePoint]
) -> Values:
    """Keys of an answer; torques oppose the motion: sign of the speed, 0 at rest. factor: true force over preload."""
    preload, rpm, celsius, axial_load = (point[quantity.name] for quantity in TORQUE_POINT)
    preload = point[ACTUAL] / factor if ACTUAL in point else preload
    state, interval, *notes = point_at(preload, rpm * RPM, celsius + CELSIUS, axial_load)
    sign = math.copysign(1.0, rpm) if rpm else 0.0
    magnitudes = state.viscous_torque, state.hysteresis_torque, state.sliding_torque
    parts = [sign * float(part) for part in magnitudes]
    torque, seal = sum(parts), sign * screw.seal_torque
    result: Values = {**point, "friction_torque_nm": torque + seal, **dict(zip(PARTS, parts, strict=True))}
    if seal:
        result["seal_torque_nm"] = seal
    if interval is not None:
        # at rest the torque is that of the drive
        meaning = interval.meaning if torque else "none at rest"
        low, high = sorted(end * torque + seal for end in interval.relative)
        result |= {"torque_low_nm": low, "torque_high_nm": high, "torque_interval": meaning}
    if not rpm:
        result[BREAKAWAY] = float(state.friction_torque)
    thickest = max(state.film_thickness_central_screw, state.film_thickness_central_nut)
    films = too_thin(state.film_thickness_min), too_thick(thickest, 0.5 * screw.ball_diameter)
    reservations = dict(zip(RESERVATIONS, (*films, *notes), strict=True))
    result |= {key: text for key, text in reservations.items() if text}
    result |= {key_of(name): float(getattr(state, name)) for name in EXTREMES}
    result["in_range"] = bool(state.in_range) and not any(reservations[key] for key in OUT_OF_RANGE)
    return result | {"clamped": list(state.clamped)}
