"""The command preload: the preload at which the map gives a measured torque."""

from argparse import Namespace
from collections.abc import Mapping
from typing import Any

from ballscrew_tehl._version import __version__
from ballscrew_tehl.applications.preload import preload_from_torque, preload_interval
from ballscrew_tehl.applications.screw_model import ScrewModel
from ballscrew_tehl.friction.sets import carried_over
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import Law

from ...quantities import PRELOAD_POINT
from ..shared.inputs import chosen_of, map_of, read_points, say_outside, some_of
from ..shared.output import Answer, each, say

COLUMNS = (
    "torque_nm", "speed_rpm", "temperature_c", "preload_n", "preload_low_n", "preload_high_n", "in_range",
)  # fmt: skip
#: ends of an interval that the map cuts off
AT_EDGE = "preload_at_edge"


def run_preload(args: Namespace) -> Answer:
    """Preload at which the map gives the measured torque."""
    points, difference = read_points(args, PRELOAD_POINT), args.temperature_difference_k or 0.0
    selection = chosen_of(args)
    nut_map = map_of(selection)
    further = {**selection.described, "map_hash": nut_map.header["file_hash"], "version": __version__}
    if other := carried_over(selection.friction_set, selection.parameters):
        say(other)
        further |= {"friction_note": other} if args.json else {}
    results = [_result(selection, nut_map, point, difference) | further for point in each(points, "points")]
    if below := [result for result in results if result["clamped"] == ["preload"]]:
        say(
            f"in_range: false; {some_of(below, results)}torque_nm {below[0]['torque_nm']:.6g} at {_at(below[0])} is "
            "below the lowest torque of this map there: preload_n is extrapolated, not reliable; remedy: check unit "
            "and what was subtracted, or ballscrew map build with a lower --preload-n"
        )
    if cut := [result for result in results if AT_EDGE in result]:
        ends = " and ".join(f"preload_{end}_n" for end in cut[0][AT_EDGE])
        say(f"{AT_EDGE}: {some_of(cut, results)}{ends} at {_at(cut[0])}: the interval goes beyond the map")
    say_outside([result for result in results if result not in below], nut_map.header["axes"])
    return Answer(results, bool(args.points), columns=COLUMNS, output=args.output)


def _at(point: Mapping[str, Any]) -> str:
    return f"{point['speed_rpm']:g} r/min and {point['temperature_c']:g} C"


def _result(
    chosen: ScrewModel, nut_map: NutMap, point: Mapping[str, float], difference: float
) -> dict[str, Any]:
    """Preload and interval behind a torque, not above those of the map; difference: of screw and nut [K]."""
    measured, at = point["torque_nm"], (point["speed_rpm"] * RPM, point["temperature_c"] + CELSIUS)

    def torque(preload: float) -> float:
        return float(nut_map.evaluate(preload, *at, temperature_difference=difference).friction_torque)

    axes = nut_map.header["axes"]
    lowest = float(axes["preload"][0])
    highest = min(float(axes[name][1]) for name in ("force", "preload"))
    if not measured <= torque(highest):
        raise ValueError(
            f"torque_nm = {measured:.6g} at {_at(point)}; allowed: {torque(lowest):.4g} to {torque(highest):.4g} N.m "
            f"(preload {lowest:g} to {highest:g} N); remedy: check its unit and sign, or a map to a higher preload"
        )
    preload = preload_from_torque(torque, measured, 0.0, highest)
    state = nut_map.evaluate(preload, *at, temperature_difference=difference)
    result: dict[str, Any] = {**point, "preload_n": preload}
    if difference or nut_map.preload_factor != 1.0:
        result |= {"temperature_difference_k": difference} if difference else {}
        result["preload_actual_n"] = float(state.preload_actual)
    if nut_map.law == Law.MECHANISTIC:
        ends = preload_interval(
            chosen.parameters, nut_map, chosen.friction_set, measured, preload, *at, difference
        )
        result |= {"preload_low_n": ends.low, "preload_high_n": ends.high, "preload_interval": ends.meaning}
        result |= {AT_EDGE: list(ends.at_edge)} if ends.at_edge else {}
    return result | {"in_range": bool(state.in_range), "clamped": list(state.clamped)}
