"""What the commands of cli.py do. Each function takes the parsed options and returns the exit code.

Solver, fit and map builder are imported in the command that needs them: an answer from the map must not wait.
"""

from __future__ import annotations

import json
import math
import sys
from argparse import Namespace
from typing import TYPE_CHECKING, Any

from . import __version__
from .cli import FILMS, PRELOAD_POINT, TORQUE_POINT
from .friction_set import FrictionSet, default_friction_set
from .measurements import CELSIUS, RPM
from .operating_points import print_results, read_points
from .parameters import FOUR_POINT, Parameters, changed, load_parameters

if TYPE_CHECKING:
    from .film_model import FilmModel
    from .nut_map.evaluate import NutMap


def _say(text: str) -> None:
    print(text, file=sys.stderr)


def screw_of(args: Namespace) -> Parameters:
    """The parameters that --screw and --kinematics name.

    Raises       ParameterError (a ValueError)
    """
    parameters = load_parameters(args.screw)
    if args.kinematics in (None, parameters.friction.kinematics):
        return parameters
    return changed(parameters, friction={"kinematics": args.kinematics})


def _map_of(args: Namespace, parameters: Parameters) -> NutMap:
    from .nut_map.store import load_map

    return load_map(args.map, parameters)


def _warn_of_film(friction_set: FrictionSet, film_model: str) -> None:
    if friction_set.film_model != film_model:
        _say(
            f"friction set is fitted with the film model {friction_set.film_model}, the film here is {film_model}"
        )


def film_model_of(name: str, parameters: Parameters) -> FilmModel:
    """Film model by its name: solved, solved_thermal (each contact by the solver) or hamrock_dowson.

    Raises       ValueError: unknown name
    """
    if name == "hamrock_dowson":
        from .film_model import HamrockDowsonFilm

        return HamrockDowsonFilm(parameters)
    if name not in FILMS:
        raise ValueError(f"film = {name!r}; allowed: {', '.join(FILMS)}")
    from .nut_map.direct import DirectFilm

    return DirectFilm(parameters, thermal=name == "solved_thermal")


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


#: output of the map -> key of the command line
EXTREMES = {
    "film_thickness_min": "film_thickness_min_m",
    "film_thickness_central_screw": "film_thickness_central_screw_m",
    "film_thickness_central_nut": "film_thickness_central_nut_m",
    "film_temperature_rise": "film_temperature_rise_k",
    "contact_pressure_max": "contact_pressure_max_pa",
    "ball_load_max": "ball_load_max_n",
    "lambda_ratio": "lambda_ratio",
}


def run_torque(args: Namespace) -> int:
    """Friction torque, films and contact extremes at one or many operating points."""
    points = read_points(args, TORQUE_POINT)
    parameters = screw_of(args)
    friction_set = default_friction_set(parameters)
    if args.direct:
        results = _direct_torques(parameters, friction_set, points)
    else:
        results = _map_torques(_map_of(args, parameters), friction_set, points)
    common = {
        "screw": parameters.name,
        "kinematics": friction_set.kinematics,
        "friction_set": friction_set.name,
    }
    print_results(
        [{**result, **_single_nut(parameters, result), **common, "version": __version__} for result in results],
        args.json,
        bool(args.points),
    )
    return 0


def _single_nut(parameters: Parameters, point: dict[str, Any]) -> dict[str, Any]:
    """What a single nut has to say beside the torque: its kind, and what spinning balls may add at most."""
    kind = parameters.screw.preload_kind
    if kind == "double_nut":
        return {}
    if kind != FOUR_POINT:
        return {"preload_kind": kind}
    from .torque import four_point_spin_bound

    bound = four_point_spin_bound(parameters, point["preload_n"], point["axial_load_n"])
    return {"preload_kind": kind, "spin_torque_not_included_at_most_nm": bound}


def _map_torques(
    nut_map: NutMap, friction_set: FrictionSet, points: list[dict[str, float]]
) -> list[dict[str, Any]]:
    _warn_of_film(friction_set, nut_map.header["film_model"])
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
    from .nut_map.direct import direct_extremes
    from .nut_map.evaluate import LAMBDA_RATIO_MAX
    from .torque import double_nut_torque

    for point in points:
        if point["speed_rpm"] == 0.0 or point["preload_n"] == 0.0:
            raise ValueError(
                "speed_rpm or preload_n = 0; allowed with --direct: not 0, there is no film to solve"
            )
    film_model = film_model_of(friction_set.film_model, parameters)
    results = []
    for number, point in enumerate(points, start=1):
        _say(f"point {number} of {len(points)}")
        speed, temperature = point["speed_rpm"] * RPM, point["temperature_c"] + CELSIUS
        preload, axial_load = point["preload_n"], point["axial_load_n"]
        parts = double_nut_torque(
            parameters, friction_set, film_model, preload, speed, temperature, axial_load
        )
        extremes = direct_extremes(parameters, preload, axial_load, abs(speed), temperature)
        lambda_ratio = extremes["film_thickness_min"] / max(friction_set.roughness_height, 1e-30)
        extremes["lambda_ratio"] = min(lambda_ratio, LAMBDA_RATIO_MAX)
        results.append({
            **point,
            **_signed((parts.viscous, parts.hysteresis, parts.sliding), speed),
            **{key: float(extremes[name]) for name, key in EXTREMES.items()},
            "in_range": True,
            "clamped": [],
        })  # fmt: skip
    return results


def run_preload(args: Namespace) -> int:
    """Preload at which the map shows the measured torque."""
    from .torque import preload_from_torque

    points = read_points(args, PRELOAD_POINT)
    parameters = screw_of(args)
    friction_set = default_friction_set(parameters)
    nut_map = _map_of(args, parameters)
    _warn_of_film(friction_set, nut_map.header["film_model"])
    axes = nut_map.header["axes"]
    highest = min(float(axes[name][1]) for name in ("force", "preload"))
    results = []
    for point in points:
        speed, temperature = point["speed_rpm"] * RPM, point["temperature_c"] + CELSIUS

        def torque(preload: float, speed: float = speed, temperature: float = temperature) -> float:
            state = nut_map.evaluate(preload, speed, temperature, 0.0, *friction_set.values)
            return float(state.viscous_torque + state.hysteresis_torque + state.sliding_torque)

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


def run_validate(args: Namespace) -> int:
    """Model beside measurement and published models, for both fitted sets."""
    from .friction_set import load_friction_sets
    from .validation import friction_set_text, table_text, validation_tables

    parameters = screw_of(args)
    if args.contacts:
        from .contact_validation import section5_contacts, section5_text

        contacts = section5_contacts(parameters)
        if args.json:
            print_results([row._asdict() for row in contacts], True, True)
        else:
            print(section5_text(contacts))
        return 0
    chosen = default_friction_set(parameters)
    packaged = [s for s in load_friction_sets().values() if s.kinematics == parameters.friction.kinematics]
    sets = [chosen] + [s for s in packaged if s.name != chosen.name]
    found = {}
    for entry in sets:
        # every set looks up the film that it was fitted with
        own = _map_of(args, changed(parameters, friction={"set": entry.name}))

        def evaluate(
            preload: float, speed: float, temperature: float, own: NutMap = own, entry: FrictionSet = entry
        ) -> float:
            state = own.evaluate(preload, speed, temperature, 0.0, *entry.values)
            return float(state.viscous_torque + state.hysteresis_torque + state.sliding_torque)

        found[entry.name] = validation_tables(evaluate)
    if args.json:
        result = {
            "kinematics": parameters.friction.kinematics,
            "map_hash": own.header["file_hash"],
            "version": __version__,
            "tables": {name: [t._asdict() | {"rows": [r._asdict() for r in t.rows]} for t in tables]
                       for name, tables in found.items()},
            "friction_sets": [vars(entry) for entry in sets],
        }  # fmt: skip
        print_results([result], True, False)
        return 0
    for name, tables in found.items():
        print(f"== {parameters.name}, kinematics {parameters.friction.kinematics}, friction set {name}\n")
        for one in tables:
            print(table_text(one) + "\n")
    print(friction_set_text(sets))
    return 0


def run_init(args: Namespace) -> int:
    """A screw file to fill in."""
    from .screw_template import write_template

    write_template(args.file, args.oil)
    if args.json:
        print(json.dumps({"file": args.file}))
    else:
        print(f"{args.file}: put in the values of your screw and oil; the first lines say how to go on")
    return 0
