"""The command torque: friction torque, films and contact extremes, from the map or by direct solves."""

import math
from argparse import Namespace
from collections.abc import Callable, Mapping
from typing import Any

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
#: torque at which motion begins, of an answer at speed 0
BREAKAWAY = "breakaway_torque_nm"
#: torque of the seals, if the screw file states it
SEAL = "seal_torque_nm"
#: a film beyond lubrication theory, a torque that goes the wrong way, oversize balls that slip
TOO_THICK, TOO_THIN, UNPHYSICAL, UNLIKE = RESERVATIONS = (
    "too_thick_film", "too_thin_film", "unphysical_trend", "unlike_flanks",
)  # fmt: skip
#: loads of balls under an axial load
OF_A_NUT = "nut loaded as by preload alone"


def run_torque(args: Namespace) -> Answer:
    """Friction torque, films and contact extremes at one or many operating points."""
    points = read_points(args, TORQUE_POINT)
    chosen = chosen_of(args)
    other = carried_over(chosen.friction_set, chosen.parameters)
    max_preload = math.inf
    if args.direct:
        results = _direct_results(chosen, points)
    else:
        nut_map = chosen.nut_map(args)
        results = [_map_result(chosen, nut_map, point) for point in each(points, "points")]
        say_outside(results, nut_map.header["axes"])
        max_preload = float(nut_map.header["axes"]["preload"][1])
    if other:
        say(other)
    if resting := [result for result in results if BREAKAWAY in result]:
        say(
            f"speed_rpm 0: {some_of(resting, results)}at rest friction balances the torque of the drive up to "
            f"{BREAKAWAY} = {resting[0][BREAKAWAY]:.6g} N.m either way; friction_torque_nm is that of motion, and 0"
        )
    if args.points and not args.json:
        _say_reservations(results)
        for key, note in chosen.catalogue_note.items():
            say(f"{key}: {note}")
    for result in results:
        result |= _catalogue(chosen, result, max_preload) | chosen.described
        # a table has it on stderr
        result |= ({"friction_note": other} if other and args.json else {}) | {"version": __version__}
    return Answer(results, bool(args.points), columns=COLUMNS, notes=_notes(points[0]), output=args.output)


def _notes(point: Mapping[str, float]) -> dict[str, str]:
    """What numbers of the text mean that another command or another point would give differently."""
    notes = {}
    if point["speed_rpm"] == 0.0:
        notes = {"friction_torque_nm": "at rest", BREAKAWAY: "needed to start, either way"}
    if point["axial_load_n"] != 0.0:
        # screw has the loads of both bodies stretched by the axial load
        notes |= dict.fromkeys(("ball_load_max_n", "contact_pressure_max_pa"), OF_A_NUT)
    return notes


def _say_reservations(results: list[Values]) -> None:
    """One line on stderr for each reservation about some of many answers, which a table has no room for."""
    for key in RESERVATIONS:
        if marked := [result for result in results if key in result]:
            at = ", ".join(f"{quantity.name} {marked[0][quantity.name]:g}" for quantity in TORQUE_POINT)
            say(f"{key}: {len(marked)} of {len(results)} points, the first: {at}: {marked[0][key]}")


def _catalogue(chosen: Chosen, point: Values, max_preload: float) -> Values:
    """Catalogue torque and why the law differs; none at a preload [N] above that of the map.

    Of a single nut its kind.
    """
    screw, preload = chosen.parameters.screw, point["preload_n"]
    if preload > max_preload:
        # the torque is that of the edge of the map: another preload
        return {}
    values = {"catalogue_torque_nm": float(nsk_torque(screw, preload)), **chosen.catalogue_note}
    if screw.preload_kind != "double_nut":
        values["preload_kind"] = screw.preload_kind
    return values


def _si(point: Mapping[str, float]) -> SI:
    return (
        point["preload_n"],
        point["speed_rpm"] * RPM,
        point["temperature_c"] + CELSIUS,
        point["axial_load_n"],
    )


def _torques(chosen: Chosen, viscous: float, hysteresis: float, sliding: float, speed: float) -> Values:
    """Torques that oppose the motion: sign of the speed, 0 at rest. That of the seals if the screw file states it."""
    sign = math.copysign(1.0, speed) if speed else 0.0
    parts = sign * float(viscous), sign * float(hysteresis), sign * float(sliding)
    names = "viscous_torque_nm", "hysteresis_torque_nm", "sliding_torque_nm"
    seal = sign * chosen.parameters.screw.seal_torque
    of_seal = {SEAL: seal} if seal else {}
    return {"friction_torque_nm": sum(parts) + seal, **dict(zip(names, parts, strict=True)), **of_seal}


def _interval(interval: TorqueInterval, torques: Values) -> Values:
    """Keys of an interval, its ends over its own torque applied to that of the balls of the answer."""
    seal = torques.get(SEAL, 0.0)
    torque = torques["friction_torque_nm"] - seal
    low, high = sorted(end * torque + seal for end in interval.relative)
    # at rest the torque is that of the drive
    meaning = interval.meaning if torque else "none at rest"
    return {"torque_low_nm": low, "torque_high_nm": high, "torque_interval": meaning}


def _result(chosen: Chosen, point: Mapping[str, float], torques: Values, extremes: Values) -> Values:
    """Keys of an answer up to its extremes; not in range with a film or a trend that is not physical."""
    thickest = max(extremes["film_thickness_central_screw_m"], extremes["film_thickness_central_nut_m"])
    thick = too_thick(thickest, 0.5 * chosen.parameters.screw.ball_diameter)
    thin = too_thin(extremes["film_thickness_min_m"])
    films = {key: text for key, text in ((TOO_THICK, thick), (TOO_THIN, thin)) if text}
    inside = not {TOO_THICK, UNPHYSICAL, UNLIKE} & (torques | films).keys()
    return {**point, **torques, **films, **extremes, "in_range": inside}


def _map_result(chosen: Chosen, nut_map: NutMap, point: Mapping[str, float]) -> Values:
    """Answer of a map at an operating point."""
    at = _si(point)
    state = nut_map.evaluate(*at)
    torques: Values = _torques(
        chosen, state.viscous_torque, state.hysteresis_torque, state.sliding_torque, at[1]
    )
    if at[1] == 0.0:
        torques[BREAKAWAY] = float(state.friction_torque)
    if trend := unphysical_trend(nut_map, *at).text:
        torques[UNPHYSICAL] = trend
    if at[0] > 0.0 and nut_map.law == MECHANISTIC:
        interval = map_interval(chosen.parameters, nut_map.header["axes"], chosen.friction_set, *at)
        torques |= _interval(interval, torques)
        if unlike := unlike_flanks(chosen.parameters, at[0], at[3], interval.torque):
            torques[UNLIKE] = unlike
    extremes = {key: float(getattr(state, name)) for name, key in EXTREMES.items()}
    result = _result(chosen, point, torques, extremes)
    return result | {
        "in_range": bool(state.in_range) and result["in_range"],
        "clamped": list(state.clamped),
        "film_kinematics": nut_map.header["film_kinematics"],
        "map_hash": nut_map.header["file_hash"],
    }


def _direct_results(chosen: Chosen, points: list[dict[str, float]]) -> list[Values]:
    """Answers by solves of the contacts."""
    from ...refinement.direct import direct_extremes, rolling_parameters

    if any(point["speed_rpm"] == 0.0 or point["preload_n"] == 0.0 for point in points):
        raise ValueError("speed_rpm or preload_n = 0; allowed with --direct: not 0 (no film at rest)")
    solved, height = _film_shear(chosen), chosen.friction_set.roughness_height
    if chosen.friction_set.film_model == MECHANISTIC:
        solved, height = _mechanistic(chosen), roughness_of(chosen.parameters.friction)
    # speeds of the published kinematics are not physical: its films are not shown, as by the map
    rolling = rolling_parameters(chosen.parameters)
    results = []
    for point in each(points, "points solved", quiet=0.0):
        preload, speed, temperature, axial_load = at = _si(point)
        torques = solved(at)
        values = direct_extremes(rolling, preload, axial_load, abs(speed), temperature)
        lambda_ratio = min(values["film_thickness_min"] / max(height, SMOOTH), LAMBDA_RATIO_MAX)
        values = {**values, "lambda_ratio": lambda_ratio}
        extremes = {key: float(values[name]) for name, key in EXTREMES.items()}
        result = _result(chosen, point, torques, extremes)
        results.append(result | {"clamped": [], "film_kinematics": ROLLING_FRAME})
    return results


def _film_shear(chosen: Chosen) -> Callable[[SI], Values]:
    """Torques of a fitted set, each contact by the solver."""
    from ...refinement.direct import DirectFilm

    film_model = DirectFilm(chosen.parameters, chosen.friction_set.film_model == "solved_thermal")

    def solved(at: SI) -> Values:
        parts = double_nut_torque(chosen.parameters, chosen.friction_set, film_model, *at)
        return _torques(chosen, parts.viscous, parts.hysteresis, parts.sliding, at[1])

    return solved


def _mechanistic(chosen: Chosen) -> Callable[[SI], Values]:
    """Torques by the power balance of the mean balls with their interval."""
    from ...atlas.contact_atlas import load_atlas
    from ...refinement.direct import DirectContacts

    contacts = DirectContacts(chosen.parameters)
    # of the grid of these solves, against a finer one
    errors = load_atlas().header["certificate"]["of_direct_solves"]
    of_grid = {f"direct_torque_error_{key}": errors[f"torque_error_{key}"] for key in ("mean", "99")}

    def solved(at: SI) -> Values:
        preload, speed, temperature, axial_load = at
        forces = nut_forces(chosen.parameters, preload, axial_load)
        place = chosen.parameters, forces, contacts, abs(speed), temperature
        parts = double_nut_parts(*place, *chosen.friction_set.values[:2])
        torques = _torques(chosen, *parts[:3], speed)
        return torques | of_grid | _interval(torque_interval(*place, chosen.friction_set), torques)

    return solved
