"""The command torque: friction torque, films and contact extremes, from the map or by direct solves."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from ..._version import __version__
from ...friction.baselines import nsk_torque
from ...friction.sets import carried_over
from ...parameters.file import FOUR_POINT
from ...parameters.units import CELSIUS, RPM
from ...runtime.packed import MECHANISTIC
from ..shared.chosen import EXTREMES, Chosen, chosen_of, say_outside
from ..shared.points import read_points
from ..shared.progress import QUIET, progress_bar
from ..shared.quantities import TORQUE_POINT
from ..shared.results import print_results, say

if TYPE_CHECKING:
    from ...friction.interval import TorqueInterval
    from ...runtime.evaluate import NutMap


#: of a table, those that a narrow one leaves out last
COLUMNS = (
    "preload_n", "speed_rpm", "temperature_c", "axial_load_n", "friction_torque_nm", "torque_low_nm", "torque_high_nm",
    "in_range", "film_thickness_min_m",
)  # fmt: skip
#: torque at which motion begins, of an answer at speed 0
BREAKAWAY = "breakaway_torque_nm"
#: what is said of a film beyond lubrication theory, of a torque that goes the wrong way, of oversize balls
TOO_THICK, TOO_THIN, UNPHYSICAL, UNLIKE = RESERVATIONS = (
    "too_thick_film", "too_thin_film", "unphysical_trend", "unlike_flanks",
)  # fmt: skip
#: loads of balls under an axial load
OF_A_NUT = "nut loaded as by preload alone"


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
    chosen = chosen_of(args)
    other = carried_over(chosen.friction_set, chosen.parameters)
    common = {
        **chosen.described,
        # stderr has it beside a table
        **({"friction_note": other} if other and args.json else {}),
        "version": __version__,
    }
    if args.direct:
        results, most = _direct_torques(chosen, points), math.inf
    else:
        results, most = _map_torques(chosen, args, points)
    if other:
        say(other)
    _say_at_rest(results)
    if args.points and not args.json:
        _say_reservations(results)
        for key, note in chosen.catalogue_note.items():
            say(f"{key}: {note}")
    print_results(
        [{**result, **_catalogue(chosen, result, most), **common} for result in results],
        args.json,
        bool(args.points),
        _notes(points[0]),
        COLUMNS,
        args.output,
    )
    return 0


def _notes(point: dict[str, float]) -> dict[str, str]:
    """What numbers of the text mean that another command or another point would give differently."""
    notes = {}
    if point["speed_rpm"] == 0.0:
        notes = {"friction_torque_nm": "at rest", "breakaway_torque_nm": "needed to start, either way"}
    if point["axial_load_n"] != 0.0:
        # screw has the loads of both bodies stretched by the axial load
        notes |= dict.fromkeys(("ball_load_max_n", "contact_pressure_max_pa"), OF_A_NUT)
    return notes


def _say_at_rest(results: list[dict[str, Any]]) -> None:
    """One line on stderr about answers at speed 0."""
    resting = [result for result in results if BREAKAWAY in result]
    if resting:
        which = "" if len(results) == 1 else f"{len(resting)} of {len(results)} points, the first: "
        first = resting[0]
        say(
            f"speed_rpm 0: {which}at rest friction balances the torque of the drive up to {BREAKAWAY} = "
            f"{first[BREAKAWAY]:.6g} N.m either way; friction_torque_nm is that of motion, and 0"
        )


def _say_reservations(results: list[dict[str, Any]]) -> None:
    """One line on stderr for each reservation about some of many answers, which a table has no room for."""
    names = [quantity.name for quantity in TORQUE_POINT]
    for key in RESERVATIONS:
        marked = [result for result in results if key in result]
        if marked:
            at = ", ".join(f"{name} {marked[0][name]:g}" for name in names)
            say(f"{key}: {len(marked)} of {len(results)} points, the first: {at}: {marked[0][key]}")


def _odd_films(chosen: Chosen, extremes: Mapping[str, float]) -> dict[str, str]:
    """What is to say of films beyond lubrication theory, by the keys of an answer."""
    from ...nut_map.trend import too_thick, too_thin

    thickest = max(extremes["film_thickness_central_screw_m"], extremes["film_thickness_central_nut_m"])
    thick = too_thick(thickest, 0.5 * chosen.parameters.screw.ball_diameter)
    thin = too_thin(extremes["film_thickness_min_m"])
    return {key: text for key, text in ((TOO_THICK, thick), (TOO_THIN, thin)) if text}


def _catalogue(chosen: Chosen, point: dict[str, Any], most: float) -> dict[str, Any]:
    """Catalogue torque and why the law differs; none at a preload [N] above the most of the map.

    Of a single nut its kind, and with a fitted set the spin of oversize balls, which it omits.
    """
    screw, preload = chosen.parameters.screw, point["preload_n"]
    if preload > most:
        # the torque is that of the edge of the map: another preload
        return {}
    found = {"catalogue_torque_nm": float(nsk_torque(screw, preload)), **chosen.catalogue_note}
    if screw.preload_kind == "double_nut":
        return found
    kind = {"preload_kind": screw.preload_kind}
    if screw.preload_kind != FOUR_POINT or chosen.friction_set.film_model == MECHANISTIC:
        return found | kind
    from ...friction.torque import four_point_spin_bound

    bound = four_point_spin_bound(chosen.parameters, preload, point["axial_load_n"])
    return found | kind | {"spin_torque_not_included_at_most_nm": bound}


def _interval(found: TorqueInterval, torque: float) -> dict[str, Any]:
    """Keys of an interval: its ends over its own torque, applied to that of the answer."""
    low, high = sorted(share * torque for share in found.relative)
    # at rest the torque is that of the drive
    meaning = found.meaning if torque else "none at rest"
    return {"torque_low_nm": low, "torque_high_nm": high, "torque_interval": meaning}


def _map_torques(
    chosen: Chosen, args: Namespace, points: list[dict[str, float]]
) -> tuple[list[dict[str, Any]], float]:
    """Answers, and the largest preload of the map [N]."""
    nut_map = chosen.nut_map(args)
    read = _MapAnswer(chosen, nut_map)
    results = []
    with progress_bar(QUIET) as progress:
        for number, point in enumerate(points):
            progress(number, len(points), "points")
            results.append(read.at(point))
        progress(len(points), len(points), "points")
    say_outside(results, nut_map.header["axes"])
    return results, float(nut_map.header["axes"]["preload"][1])


class _MapAnswer(NamedTuple):
    """A map that answers operating points."""

    chosen: Chosen
    nut_map: NutMap

    def at(self, point: dict[str, float]) -> dict[str, Any]:
        """Keys of the answer at a point."""
        from ...nut_map.trend import unphysical_trend

        nut_map = self.nut_map
        speed = point["speed_rpm"] * RPM
        at = point["preload_n"], speed, point["temperature_c"] + CELSIUS, point["axial_load_n"]
        state = nut_map.evaluate(*at)
        torques = _signed((state.viscous_torque, state.hysteresis_torque, state.sliding_torque), speed)
        further: dict[str, Any] = {}
        if speed == 0.0:
            further[BREAKAWAY] = float(state.friction_torque)
        if trend := unphysical_trend(nut_map, *at).text:
            further[UNPHYSICAL] = trend
        extremes = {key: float(getattr(state, name)) for name, key in EXTREMES.items()}
        films = _odd_films(self.chosen, extremes)
        if point["preload_n"] > 0.0:
            further |= self._interval(at, torques["friction_torque_nm"])
        return {
            **point,
            **torques,
            **further,
            **films,
            **extremes,
            "in_range": bool(state.in_range) and not (trend or TOO_THICK in films or UNLIKE in further),
            "clamped": list(state.clamped),
            "film_kinematics": nut_map.header["film_kinematics"],
            "map_hash": nut_map.header["file_hash"],
        }

    def _interval(self, at: tuple[float, float, float, float], torque: float) -> dict[str, Any]:
        """Interval of a torque by the mechanistic law, and whether oversize balls make it uncertain."""
        if self.nut_map.law != MECHANISTIC:
            return {}
        from ...nut_map.interval import map_interval
        from ...nut_map.trend import unlike_flanks

        parameters, friction_set = self.chosen.parameters, self.chosen.friction_set
        found = map_interval(parameters, self.nut_map.header["axes"], friction_set, *at)
        unlike = unlike_flanks(parameters, at[0], at[3], found.torque)
        return _interval(found, torque) | ({UNLIKE: unlike} if unlike else {})


def _direct_torques(chosen: Chosen, points: list[dict[str, float]]) -> list[dict[str, Any]]:
    from ...physics.kinematics import ROLLING_FRAME
    from ...refinement.direct import direct_extremes, rolling_parameters
    from ...runtime.constants import LAMBDA_RATIO_MAX, SMOOTH

    for point in points:
        if point["speed_rpm"] == 0.0 or point["preload_n"] == 0.0:
            raise ValueError("speed_rpm or preload_n = 0; allowed with --direct: not 0 (no film at rest)")
    parameters, friction_set = chosen.parameters, chosen.friction_set
    solved = _mechanistic(chosen) if friction_set.film_model == MECHANISTIC else _film_shear(chosen)
    height = friction_set.roughness_height
    if friction_set.film_model == MECHANISTIC:
        from ...friction.mechanistic import roughness_of

        height = roughness_of(parameters.friction)
    # speeds of the published kinematics are not physical: its films are not shown, as by the map
    rolling = rolling_parameters(parameters)
    results = []
    with progress_bar() as progress:
        for number, point in enumerate(points):
            progress(number, len(points), "points solved")
            speed, temperature = point["speed_rpm"] * RPM, point["temperature_c"] + CELSIUS
            preload, axial_load = point["preload_n"], point["axial_load_n"]
            torques = solved(preload, speed, temperature, axial_load)
            extremes = direct_extremes(rolling, preload, axial_load, abs(speed), temperature)
            film = extremes["film_thickness_min"]
            extremes["lambda_ratio"] = min(film / max(height, SMOOTH), LAMBDA_RATIO_MAX)
            shown = {key: float(extremes[name]) for name, key in EXTREMES.items()}
            films = _odd_films(chosen, shown)
            results.append({
                **point,
                **torques,
                **films,
                **shown,
                "in_range": TOO_THICK not in films,
                "clamped": [],
                "film_kinematics": ROLLING_FRAME,
            })  # fmt: skip
        progress(len(points), len(points), "points solved")
    return results


#: preload [N], speed [rad/s], temperature [K], axial load [N] -> keys of the answer
_Solved = Callable[[float, float, float, float], dict[str, Any]]


def _film_shear(chosen: Chosen) -> _Solved:
    """Torques of a fitted set, each contact by the solver."""
    from ...friction.torque import double_nut_torque
    from ...refinement.direct import DirectFilm

    film_model = DirectFilm(chosen.parameters, chosen.friction_set.film_model == "solved_thermal")

    def solved(preload: float, speed: float, temperature: float, axial_load: float) -> dict[str, Any]:
        parts = double_nut_torque(
            chosen.parameters, chosen.friction_set, film_model, preload, speed, temperature, axial_load
        )
        return _signed((parts.viscous, parts.hysteresis, parts.sliding), speed)

    return solved


def _mechanistic(chosen: Chosen) -> _Solved:
    """Torques by the power balance of the mean balls with their interval."""
    from ...atlas.contact_atlas import load_atlas
    from ...friction.interval import torque_interval
    from ...friction.mechanistic import double_nut_parts
    from ...friction.torque import nut_forces
    from ...refinement.direct import DirectContacts

    contacts = DirectContacts(chosen.parameters)
    # of the grid of these solves, against a finer one
    errors = load_atlas().header["certificate"]["of_direct_solves"]
    of_grid = {f"direct_torque_error_{key}": errors[f"torque_error_{key}"] for key in ("mean", "99")}

    def solved(preload: float, speed: float, temperature: float, axial_load: float) -> dict[str, Any]:
        forces = nut_forces(chosen.parameters, preload, axial_load)
        at = chosen.parameters, forces, contacts, abs(speed), temperature
        torques = _signed(double_nut_parts(*at, *chosen.friction_set.values[:2])[:3], speed) | of_grid
        return torques | _interval(torque_interval(*at, chosen.friction_set), torques["friction_torque_nm"])

    return solved
