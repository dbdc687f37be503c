"""The command torque: friction torque, films and contact extremes, from the map or by direct solves."""

import math
from argparse import Namespace
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ..._version import __version__
from ...friction.baselines import nsk_torque
from ...friction.interval import TorqueInterval, torque_interval
from ...friction.mechanistic import double_nut_parts, roughness_of
from ...friction.sets import carried_over
from ...friction.torque import double_nut_torque, nut_forces
from ...nut_map.interval import map_interval
from ...nut_map.trend import too_thick, too_thin, unlike_flanks, unphysical_trend
from ...parameters.units import CELSIUS, RPM
from ...physics.kinematics import ROLLING_FRAME
from ...runtime.constants import LAMBDA_RATIO_MAX, SMOOTH
from ...runtime.evaluate import NutMap
from ...runtime.packed import MECHANISTIC
from ..shared.chosen import EXTREMES, Chosen, chosen_of, say_outside, some_of
from ..shared.points import read_points
from ..shared.progress import each
from ..shared.quantities import TORQUE_POINT
from ..shared.results import Answer, say

Values = dict[str, Any]
#: preload [N], speed [rad/s], temperature [K], axial load [N]
SI = tuple[float, float, float, float]
#: of a table, those that a narrow one leaves out last
COLUMNS = (
    "preload_n", "speed_rpm", "temperature_c", "axial_load_n", "friction_torque_nm", "torque_low_nm", "torque_high_nm",
    "in_range", "film_thickness_min_m",
)  # fmt: skip
PARTS = ("viscous_torque_nm", "hysteresis_torque_nm", "sliding_torque_nm")
#: torque at which motion begins, of an answer at speed 0
BREAKAWAY = "breakaway_torque_nm"
#: a film beyond lubrication theory, a torque that goes the wrong way, oversize balls that slip
TOO_THICK, TOO_THIN, UNPHYSICAL, UNLIKE = RESERVATIONS = (
    "too_thick_film", "too_thin_film", "unphysical_trend", "unlike_flanks",
)  # fmt: skip


class _State(NamedTuple):
    """Operating point of the double nut, by the map or by direct solves."""

    parts: tuple[float, ...]  # magnitudes of PARTS [N.m]
    extremes: Mapping[str, float]  # by the names of EXTREMES, SI
    interval: TorqueInterval | None
    keys: Values  # further ones of the answer


def run_torque(args: Namespace) -> Answer:
    """Friction torque, films and contact extremes at one or many operating points."""
    points = read_points(args, TORQUE_POINT)
    chosen = chosen_of(args)
    max_preload, axes = math.inf, None
    if args.direct:
        if any(point["speed_rpm"] == 0.0 or point["preload_n"] == 0.0 for point in points):
            raise ValueError("speed_rpm or preload_n = 0; allowed with --direct: not 0 (no film at rest)")
        state_at, work = _by_solves(chosen), each(points, "points solved", quiet=0.0)
    else:
        nut_map = chosen.nut_map(args)
        axes = nut_map.header["axes"]
        max_preload = float(axes["preload"][1])
        state_at, work = _by_map(chosen, nut_map), each(points, "points")
    results = [_result(chosen, point, state_at(_si(point))) for point in work]
    if axes:
        say_outside(results, axes)
    if other := carried_over(chosen.friction_set, chosen.parameters):
        say(other)
    if resting := [result for result in results if BREAKAWAY in result]:
        say(
            f"speed_rpm 0: {some_of(resting, results)}at rest friction balances the torque of the drive up to "
            f"{BREAKAWAY} = {resting[0][BREAKAWAY]:.6g} N.m either way; friction_torque_nm is that of motion, and 0"
        )
    if args.points and not args.json:
        _say_reservations(results)
    for result in results:
        if result["preload_n"] <= max_preload:
            # else the torque is that of the edge of the map: another preload
            result |= _catalogue(chosen, result)
        result |= chosen.described | ({"friction_note": other} if other and args.json else {})
        result["version"] = __version__
    return Answer(results, bool(args.points), columns=COLUMNS, output=args.output)


def _say_reservations(results: list[Values]) -> None:
    """One line on stderr for each reservation about some of many answers, which a table has no room for."""
    for key in RESERVATIONS:
        if marked := [result for result in results if key in result]:
            at = ", ".join(f"{quantity.name} {marked[0][quantity.name]:g}" for quantity in TORQUE_POINT)
            say(f"{key}: {len(marked)} of {len(results)} points, the first: {at}: {marked[0][key]}")


def _catalogue(chosen: Chosen, point: Values) -> Values:
    """Catalogue torque and why the law differs.

    Of a single nut its kind.
    """
    screw, preload = chosen.parameters.screw, point["preload_n"]
    values = {"catalogue_torque_nm": float(nsk_torque(screw, preload)), **chosen.catalogue_note}
    if screw.preload_kind != "double_nut":
        values["preload_kind"] = screw.preload_kind
    return values


def _si(point: Mapping[str, float]) -> SI:
    speed, temperature = point["speed_rpm"] * RPM, point["temperature_c"] + CELSIUS
    return point["preload_n"], speed, temperature, point["axial_load_n"]


def _result(chosen: Chosen, point: Mapping[str, float], state: _State) -> Values:
    """Keys of an answer; torques oppose the motion: sign of the speed, 0 at rest."""
    sign = math.copysign(1.0, point["speed_rpm"]) if point["speed_rpm"] else 0.0
    screw = chosen.parameters.screw
    parts = [sign * float(part) for part in state.parts]
    torque, seal = sum(parts), sign * screw.seal_torque
    result: Values = {**point, "friction_torque_nm": torque + seal, **dict(zip(PARTS, parts, strict=True))}
    if seal:
        result["seal_torque_nm"] = seal
    if state.interval is not None:
        # at rest the torque is that of the drive
        meaning = state.interval.meaning if torque else "none at rest"
        low, high = sorted(end * torque + seal for end in state.interval.relative)
        result |= {"torque_low_nm": low, "torque_high_nm": high, "torque_interval": meaning}
    extremes = {key: float(state.extremes[name]) for name, key in EXTREMES.items()}
    thickest = max(extremes["film_thickness_central_screw_m"], extremes["film_thickness_central_nut_m"])
    films = {
        TOO_THICK: too_thick(thickest, 0.5 * screw.ball_diameter),
        TOO_THIN: too_thin(extremes["film_thickness_min_m"]),
    }
    result |= {key: text for key, text in films.items() if text} | extremes | state.keys
    # a film or a trend that is not physical is out of range
    result["in_range"] = (
        state.keys.get("in_range", True) and not {TOO_THICK, UNPHYSICAL, UNLIKE} & result.keys()
    )
    return result


def _by_map(chosen: Chosen, nut_map: NutMap) -> Callable[[SI], _State]:
    """States by a map."""
    header, parameters = nut_map.header, chosen.parameters

    def state_at(at: SI) -> _State:
        preload, speed, _, axial_load = at
        state, interval = nut_map.evaluate(*at), None
        keys: Values = {
            "in_range": bool(state.in_range), "clamped": list(state.clamped),
            "film_kinematics": header["film_kinematics"], "map_hash": header["file_hash"],
        }  # fmt: skip
        if speed == 0.0:
            keys[BREAKAWAY] = float(state.friction_torque)
        if trend := unphysical_trend(nut_map, *at).text:
            keys[UNPHYSICAL] = trend
        if preload > 0.0 and nut_map.law == MECHANISTIC:
            interval = map_interval(parameters, header["axes"], chosen.friction_set, *at)
            if unlike := unlike_flanks(parameters, preload, axial_load, interval.torque):
                keys[UNLIKE] = unlike
        parts = state.viscous_torque, state.hysteresis_torque, state.sliding_torque
        return _State(parts, state._asdict(), interval, keys)

    return state_at


def _by_solves(chosen: Chosen) -> Callable[[SI], _State]:
    """States by solves of the contacts."""
    from ...atlas.contact_atlas import load_atlas
    from ...refinement.direct import DirectContacts, DirectFilm, direct_extremes, rolling_parameters

    parameters, friction_set = chosen.parameters, chosen.friction_set
    mechanistic = friction_set.film_model == MECHANISTIC
    height = roughness_of(parameters.friction) if mechanistic else friction_set.roughness_height
    # speeds of the published kinematics are not physical: its films are not shown, as by the map
    rolling = rolling_parameters(parameters)
    contacts = DirectContacts(parameters)
    film_model = DirectFilm(parameters, friction_set.film_model == "solved_thermal")
    keys: Values = {"clamped": [], "film_kinematics": ROLLING_FRAME}
    if mechanistic:
        # errors of the grid of these solves, against a finer one
        errors = load_atlas().header["certificate"]["of_direct_solves"]
        keys |= {f"direct_torque_error_{key}": errors[f"torque_error_{key}"] for key in ("mean", "99")}

    def state_at(at: SI) -> _State:
        preload, speed, temperature, axial_load = at
        interval = None
        if mechanistic:
            forces = nut_forces(parameters, preload, axial_load)
            place = parameters, forces, contacts, abs(speed), temperature
            parts = double_nut_parts(*place, *friction_set.values[:2])
            interval = torque_interval(*place, friction_set)
        else:
            parts = double_nut_torque(parameters, friction_set, film_model, *at)
        extremes = direct_extremes(rolling, preload, axial_load, abs(speed), temperature)
        lambda_ratio = min(extremes["film_thickness_min"] / max(height, SMOOTH), LAMBDA_RATIO_MAX)
        return _State(tuple(parts[:3]), extremes | {"lambda_ratio": lambda_ratio}, interval, keys)

    return state_at
