"""The commands screw and init: what a ball-screw program states of a screw; a screw file to fill in."""

from __future__ import annotations

import json
import math
import textwrap
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...mechanics import CATALOGUE_SHARE, LoadedScrew, efficiency, loaded_screw, screw_constants
from ...parameters.file import ScrewParameters
from ...parameters.units import CELSIUS, RPM
from ...physics.rating import STATIC_PRESSURE, computed_dynamic_rating, dynamic_rating
from ..shared.chosen import chosen_of, say_outside
from ..shared.files import check_output, written
from ..shared.points import read_points
from ..shared.quantities import SCREW_POINT, SPEED, TEMPERATURE
from ..shared.results import print_results, say, width

if TYPE_CHECKING:
    from ...parameters.template import CatalogueSizes

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
#: of a table
COLUMNS = (
    "preload_n", "axial_load_n", "catalogue_torque_nm", "friction_torque_nm", "efficiency", "in_range", "static_safety",
    "life_turns", "contact_pressure_max_pa",
)  # fmt: skip
KEYS = [name + UNITS.get(name, "") for name in LoadedScrew._fields]


def run_screw(args: Namespace) -> int:
    """Catalogue torque, loads, pressure, stiffness, life and, with a map, efficiency at one or many loads."""
    chosen = chosen_of(args)
    screw = chosen.parameters.screw
    needs_map = args.speed_rpm is not None
    if needs_map != (args.temperature_c is not None):
        raise ValueError("--speed-rpm and --temperature-c: give both, for the efficiency, or none")
    if args.preload_n is None:
        args.preload_n = CATALOGUE_SHARE * dynamic_rating(screw)
    points = read_points(args, SCREW_POINT)
    constants = screw_constants(screw)
    _compare_rating(screw)
    results: list[dict[str, Any]] = []
    for point in points:
        found = loaded_screw(screw, constants, point["preload_n"], point["axial_load_n"])
        results.append({**point, **dict(zip(KEYS, found, strict=True)), "conditions": CONDITIONS})
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
            if point["preload_n"] > nut_map.header["axes"]["preload"][1]:
                # the torque is that of the edge of the map: another preload
                del result["catalogue_torque_nm"], result["conditions"]
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
        COLUMNS,
        args.output,
    )
    return 0


#: ratio of a computed rating to that of a catalogue within which they agree; catalogues differ so much themselves
RATING_AGREES = (0.75, 1.33)


def _compare_rating(screw: ScrewParameters) -> None:
    """One line on stderr about the rating of a screw file and that which its geometry gives."""
    if screw.dynamic_rating is None:
        return
    computed = computed_dynamic_rating(screw)
    low, high = RATING_AGREES
    ratio = computed / screw.dynamic_rating
    doubt = (
        ""
        if low <= ratio <= high
        else ": check turns and balls (of one nut), ball_diameter and the nut it is of"
    )
    given = f"{screw.dynamic_rating:.6g} N"
    say(f"dynamic_rating {given} of the screw file; computed {computed:.4g} N, {ratio:.2f} of it{doubt}")


def _notes(axial_load: float, speed: float | None) -> dict[str, str]:
    """What numbers of the text mean that `torque` gives differently."""
    notes = {"friction_torque_nm": "at breakaway"} if speed == 0.0 else {}
    if axial_load != 0.0:
        # torque and maps take the loads of each nut as by a preload of its force
        notes |= dict.fromkeys(("ball_load_max_n", "contact_pressure_max_pa"), STRETCHED)
    return notes


def _sizes(args: Namespace) -> CatalogueSizes | None:
    """Sizes of the options; None without them.

    Raises       ValueError: the diameter or the lead missing, a number out of range
    """
    from ...parameters.template import CatalogueSizes

    given = {name: getattr(args, name) for name in ("diameter_mm", "lead_mm", "ball_mm", "turns", "starts")}
    if not any(value is not None for value in given.values()):
        return None
    for name, value in given.items():
        option = f"--{name.replace('_', '-')}"
        if value is None and name in ("diameter_mm", "lead_mm"):
            raise ValueError(f"{option} (missing); allowed: --diameter-mm and --lead-mm together")
        if value is not None and not 0.0 < value < math.inf:
            raise ValueError(f"{option} = {value:g}; allowed: a finite number > 0")
    if (ball := given["ball_mm"]) is not None and not ball < 0.5 * given["diameter_mm"]:
        raise ValueError(f"--ball-mm = {ball:g}; allowed: less than half of --diameter-mm")
    starts = given["starts"] or 1
    if ball is not None and not ball < given["lead_mm"] / starts:
        raise ValueError(
            f"--ball-mm = {ball:g}; allowed: less than --lead-mm over --starts = {given['lead_mm'] / starts:g} mm, or "
            "grooves meet"
        )
    return CatalogueSizes(**{name: value for name, value in given.items() if value is not None})


def run_init(args: Namespace) -> int:
    """A screw file to fill in."""
    from ...parameters.template import write_template

    check_output("FILE.toml", args.file, "a new file *.toml")
    with written("FILE.toml", args.file):
        write_template(args.file, args.oil, args.lubricant, _sizes(args))
    if args.json:
        print(json.dumps({"file": args.file}))
    else:
        lines = Path(args.file).read_text(encoding="utf-8").splitlines()
        assumed = [line.partition("#")[0].strip() for line in lines if "# assumed: " in line]
        check = "check what is assumed and the oil" if assumed else "enter the values of your screw and oil"
        print(f"{args.file}: {check}; the first lines explain the next steps")
        if assumed:
            print(textwrap.fill(f"assumed: {'; '.join(assumed)}", width()))
    return 0
