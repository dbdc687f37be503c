"""The commands screw, catalogue and init: what a ball-screw program states of a screw; a screw file to fill in."""

from __future__ import annotations

import json
import math
from argparse import Namespace
from typing import Any

from ...friction.baselines import nsk_torque
from ...mechanics import CATALOGUE_SHARE, LoadedScrew, efficiency, loaded_screw, screw_constants
from ...parameters.units import CELSIUS, RPM
from ...physics.rating import STATIC_PRESSURE, dynamic_rating, static_rating
from ..shared.chosen import chosen_of, say_outside, screw_of
from ..shared.files import check_output, written
from ..shared.points import read_points
from ..shared.quantities import SCREW_POINT, SPEED, TEMPERATURE
from ..shared.results import print_results, say

#: loads of balls under an axial load
STRETCHED = "bodies stretched by the axial load"
CONDITIONS = "JIS B 1192: 100 r/min, oil ISO VG 68, no seals; a convention, proportional to the preload"
#: ends of the keys by the field of LoadedScrew; none: a pure number
UNITS = {
    **dict.fromkeys(("nut_force_a", "nut_force_b", "separation_load", "ball_load_max"), "_n"),
    **dict.fromkeys(("static_load_rating", "dynamic_load_rating"), "_n"),
    "contact_pressure_max": "_pa",
    "axial_stiffness": "_n_per_m",
    "axial_deflection": "_m",
    "lost_motion": "_m",
    "catalogue_torque": "_nm",
}
KEYS = [name + UNITS.get(name, "") for name in LoadedScrew._fields]


def run_screw(args: Namespace) -> int:
    """Loads, pressure, stiffness, life and, with a map, efficiency at one or many loads."""
    chosen = chosen_of(args)
    screw = chosen.parameters.screw
    needs_map = args.speed_rpm is not None
    if needs_map != (args.temperature_c is not None):
        raise ValueError("--speed-rpm and --temperature-c: give both, for the efficiency, or none")
    points = read_points(args, SCREW_POINT)
    constants = screw_constants(screw)
    results: list[dict[str, Any]] = []
    for point in points:
        found = loaded_screw(screw, constants, point["preload_n"], point["axial_load_n"])
        results.append({**point, **dict(zip(KEYS, found, strict=True))})
    if crushed := [result for result in results if result["pressure_over_static"] > 1.0]:
        pressure = 1e-9 * crushed[0]["contact_pressure_max_pa"]
        say(f"contact pressure {pressure:.3g} GPa; the static rating allows {1e-9 * STATIC_PRESSURE:.3g} GPa")
    if needs_map:
        speed = SPEED.checked("--speed-rpm", args.speed_rpm)
        temperature = TEMPERATURE.checked("--temperature-c", args.temperature_c)
        nut_map = chosen.nut_map(args)
        for point, result in zip(points, results, strict=True):
            state = nut_map.evaluate(
                point["preload_n"], abs(speed) * RPM, temperature + CELSIUS, point["axial_load_n"]
            )
            torque = float(state.friction_torque)
            result |= {"speed_rpm": speed, "temperature_c": temperature, "friction_torque_nm": torque}
            if (both := efficiency(screw, point["axial_load_n"], torque)) is not None:
                result |= {"efficiency": both.driving, "efficiency_backdriving": both.backdriving}
            result |= {
                "in_range": bool(state.in_range),
                "clamped": list(state.clamped),
            } | chosen.catalogue_note
            if speed:
                result["life_hours"] = result["life_turns"] / (60.0 * abs(speed))
        if speed == 0.0:
            say("--speed-rpm 0: friction_torque_nm and efficiencies are those at breakaway")
        say_outside(results, nut_map.header["axes"])
    print_results(
        [{**result, **chosen.described} for result in results],
        args.json,
        bool(args.points),
        _notes(points[0]["axial_load_n"], args.speed_rpm),
    )
    return 0


def _notes(axial_load: float, speed: float | None) -> dict[str, str]:
    """What numbers of the text mean that `torque` gives differently."""
    notes = {"friction_torque_nm": "at breakaway"} if speed == 0.0 else {}
    if axial_load != 0.0:
        # torque and maps take the loads of each nut as by a preload of its force
        notes |= dict.fromkeys(("ball_load_max_n", "contact_pressure_max_pa"), STRETCHED)
    return notes


def run_catalogue(args: Namespace) -> int:
    """Catalogue torque of a screw at a preload, by default 5 % of its dynamic rating."""
    parameters = screw_of(args)
    screw = parameters.screw
    rating = dynamic_rating(screw)
    preload = CATALOGUE_SHARE * rating if args.preload_n is None else args.preload_n
    if not (math.isfinite(preload) and preload >= 0.0):
        raise ValueError(f"--preload-n = {preload:g}; allowed: a finite number >= 0")
    result = {
        "preload_n": preload,
        "preload_over_dynamic": preload / rating,
        "catalogue_torque_nm": float(nsk_torque(screw, preload)),
        "dynamic_load_rating_n": rating,
        "static_load_rating_n": static_rating(screw),
        "conditions": CONDITIONS,
        "screw": parameters.name,
    }
    print_results([result], args.json, False)
    return 0


def run_init(args: Namespace) -> int:
    """A screw file to fill in."""
    from ...parameters.template import write_template

    check_output("FILE.toml", args.file, "a new file *.toml")
    with written("FILE.toml", args.file):
        write_template(args.file, args.oil, args.lubricant)
    if args.json:
        print(json.dumps({"file": args.file}))
    else:
        print(f"{args.file}: enter the values of your screw and oil; the first lines explain the next steps")
    return 0
