"""The commands screw and catalogue: what a ball-screw program states of a screw, and its catalogue torque."""

from __future__ import annotations

import math
from argparse import Namespace
from typing import Any, NamedTuple

from ..friction.baselines import nsk_torque
from ..parameters.file import ScrewParameters
from ..parameters.units import CELSIUS, RPM
from ..physics.axial_stiffness import axial_deflection, axial_stiffness, contact_stiffness, lost_motion
from ..physics.load import double_nut_loads, separation_load
from ..physics.rating import STATIC_PRESSURE, ball_pressure, dynamic_rating, life, static_rating
from .common import chosen_of, say, say_outside, screw_of
from .main import SCREW_POINT, SPEED, TEMPERATURE
from .points import print_results, read_points

#: preload over the dynamic rating that catalogues state torques for
CATALOGUE_SHARE = 0.05
#: loads of balls under an axial load
STRETCHED = "bodies stretched by the axial load"
CONDITIONS = "JIS B 1192: 100 r/min, oil ISO VG 68, no seals; a convention, proportional to the preload"


class _Constants(NamedTuple):
    """What a screw has at any load: ratings [N], contact stiffness K of F = K deflection^(3/2)."""

    static: float
    dynamic: float
    stiffness: float


def run_screw(args: Namespace) -> int:
    """Loads, pressure, stiffness, life and, with a map, efficiency at one or many loads."""
    chosen = chosen_of(args)
    screw = chosen.parameters.screw
    needs_map = args.speed_rpm is not None
    if needs_map != (args.temperature_c is not None):
        raise ValueError("--speed-rpm and --temperature-c: give both, for the efficiency, or none")
    points = read_points(args, SCREW_POINT)
    constants = _Constants(static_rating(screw), dynamic_rating(screw), contact_stiffness(screw))
    results = [{**point, **_mechanics(screw, constants, **point)} for point in points]
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
            result |= _efficiency(screw, point["axial_load_n"], torque)
            result |= {"in_range": bool(state.in_range), "clamped": list(state.clamped)}
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


def _mechanics(
    screw: ScrewParameters, constants: _Constants, preload_n: float, axial_load_n: float
) -> dict[str, Any]:
    """Loads, pressures, stiffness and life at one load of the nut, on the balls that carry load."""
    nuts = double_nut_loads(screw, preload_n, axial_load_n, screw.loaded_ball_count)
    heaviest = max(float(nuts.Q_a.max()), float(nuts.Q_b.max()))
    pressure = ball_pressure(screw, heaviest) if heaviest > 0.0 else 0.0
    largest = max(nuts.force_a, nuts.force_b)
    static, dynamic, k = constants
    deflection = float(axial_deflection(k, preload_n, axial_load_n))
    return {
        "nut_force_a_n": nuts.force_a,
        "nut_force_b_n": nuts.force_b,
        "separation_load_n": separation_load(screw, preload_n, screw.loaded_ball_count),
        "ball_load_max_n": heaviest,
        "contact_pressure_max_pa": pressure,
        "static_load_rating_n": static,
        "static_safety": static / largest if largest > 0.0 else math.inf,
        "pressure_over_static": pressure / STATIC_PRESSURE,
        "dynamic_load_rating_n": dynamic,
        "preload_over_dynamic": preload_n / dynamic,
        "life_turns": life(screw, nuts.force_a, nuts.force_b),
        "axial_stiffness_n_per_m": float(axial_stiffness(k, preload_n, deflection)),
        "axial_deflection_m": deflection,
        "lost_motion_m": float(lost_motion(k, preload_n, axial_load_n)),
        "catalogue_torque_nm": float(nsk_torque(screw, preload_n)),
    }


def _efficiency(screw: ScrewParameters, axial_load: float, torque: float) -> dict[str, Any]:
    """Useful over spent work in one turn, screw driving the nut and nut driving the screw."""
    useful = abs(axial_load) * screw.lead / (2.0 * math.pi)
    if useful == 0.0:
        return {}
    # below zero: self-locking
    return {
        "efficiency": useful / (useful + torque),
        "efficiency_backdriving": max(1.0 - torque / useful, 0.0),
    }


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
