"""The commands screw and init: what a ball-screw program states of a screw; a screw file to fill in."""

import math
from argparse import Namespace
from typing import Any

from ballscrew_tehl.applications.catalogue import (
    RATING_UNITS,
    CatalogueSizes,
    catalogue_parameters,
    has_inches,
    rating_of_inches,
    rating_ratios,
)
from ballscrew_tehl.applications.mechanics import efficiency, loaded_screw, screw_constants
from ballscrew_tehl.applications.screw_model import ScrewModel
from ballscrew_tehl.applications.tables.headings import INCH
from ballscrew_tehl.parameters.screw import ScrewParameters
from ballscrew_tehl.parameters.template import example_parameters, screw_template
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.rating import CATALOGUE_SHARE, STATIC_PRESSURE, dynamic_rating

from ...quantities import AXIAL_LOAD, PRELOAD
from ..shared.inputs import chosen_of, key_of, map_of, read_points, say_outside
from ..shared.output import Answer, check_output, filled, say, write_file

CONDITIONS = (
    "JIS B 1192: 100 r/min, ISO VG 68 (ISO 3408-3: VG 100), no seals; a convention, proportional to preload"
)
#: of a table
COLUMNS = ("preload_n", "axial_load_n", "catalogue_torque_nm", "friction_torque_nm", "efficiency", "in_range",
           "static_safety", "life_turns", "contact_pressure_max_pa")  # fmt: skip
#: ratio of a computed rating to that of a catalogue within which they agree (examples/catalogue_screws.py)
RATING_AGREES = (0.85, 1.18)
#: ln of what a computed rating may be off one in another unit
SAME_UNIT = 0.25


def run_screw(args: Namespace) -> Answer:
    """Catalogue torque, loads, pressure, stiffness, life and, with a map, efficiency at one or many loads."""
    selection = chosen_of(args)
    screw = selection.parameters.screw
    if (args.speed_rpm is None) != (args.temperature_c is None):
        raise ValueError("--speed-rpm and --temperature-c: give both, for the efficiency, or none")
    catalogue = PRELOAD._replace(default=CATALOGUE_SHARE[screw.preload_kind] * dynamic_rating(screw))
    points = read_points(args, (catalogue, AXIAL_LOAD))
    constants = screw_constants(screw)
    _say_ratings(screw)
    results: list[dict[str, Any]] = []
    for point in points:
        preload, axial_load = point.values()
        loaded = loaded_screw(screw, constants, selection.friction_set.preload_factor * preload, axial_load)
        values = {key_of(name): value for name, value in loaded._asdict().items()}
        values |= selection.printed(preload)
        results.append({**point, **values, "conditions": CONDITIONS, **selection.described})
    if crushed := [result for result in results if result["pressure_over_static"] > 1.0]:
        pressure = 1e-9 * crushed[0]["contact_pressure_max_pa"]
        say(f"contact pressure {pressure:.3g} GPa; ISO 76 allows {1e-9 * STATIC_PRESSURE:.3g} GPa")
    if args.speed_rpm is not None:
        _add_efficiency(results, selection, args)
    return Answer(results, bool(args.points), columns=COLUMNS, output=args.output)


def _say_ratings(screw: ScrewParameters) -> None:
    """One line on stderr for each stated rating that the computed one is not near."""
    for name, ratio in rating_ratios(screw).items():
        if not RATING_AGREES[0] <= ratio <= RATING_AGREES[1]:
            stated, owner = getattr(screw, name), "start" if ratio > 1.0 and screw.starts > 1 else "nut"
            units = [
                unit for unit, newtons in RATING_UNITS.items() if abs(math.log(ratio / newtons)) < SAME_UNIT
            ]
            meant = f"in {units[0]}? " if units else ""
            what = f"({ratio:.2f} times): check unit, turns (of one {owner}), ball_diameter, raceway radii"
            say(f"{name} {stated:.6g} N of the screw file; {meant}computed {ratio * stated:.4g} N {what}")


def _add_efficiency(results: list[dict[str, Any]], chosen: ScrewModel, args: Namespace) -> None:
    """Torque, efficiency and hours at the speed and temperature of the options, from the map."""
    speed, temperature = args.speed_rpm, args.temperature_c
    nut_map = map_of(chosen)
    axes = nut_map.header["axes"]
    for result in results:
        preload, axial_load = result["preload_n"], result["axial_load_n"]
        state = nut_map.evaluate(preload, abs(speed) * RPM, temperature + CELSIUS, axial_load)
        torque = float(state.friction_torque)
        result |= {"speed_rpm": speed, "temperature_c": temperature, "friction_torque_nm": torque}
        if preload > axes["preload"][1]:
            # the torque is that of the edge of the map: another preload
            del result["catalogue_torque_nm"], result["conditions"]
        if (both := efficiency(chosen.parameters.screw, axial_load, torque)) is not None:
            result |= {"efficiency": both.driving, "efficiency_backdriving": both.backdriving}
        result |= {"in_range": bool(state.in_range), "clamped": list(state.clamped)}
        result |= chosen.catalogue_note(axial_load)
        if speed:
            result["life_hours"] = result["life_turns"] / (60.0 * abs(speed))
    if speed == 0.0:
        say("--speed-rpm 0: friction_torque_nm and efficiencies are those at breakaway")
    say_outside(results, axes)


def run_init(args: Namespace) -> Answer:
    """A screw file to fill in."""
    path = check_output("FILE.toml", args.file, "a new file *.toml")
    if path.exists():
        raise ValueError(f"{path}: exists already; allowed: a new file; choose another name")
    parameters = example_parameters(args.oil, args.lubricant, args.oil_grade or 0)
    assumed, ratios = dict[str, str](), dict[str, float]()
    sizes = {name: value for name in CatalogueSizes._fields if (value := getattr(args, name)) is not None}
    for name in ("diameter", "lead"):
        if (inches := getattr(args, f"{name}_in")) is not None:
            if f"{name}_mm" in sizes:
                raise ValueError(f"--{name}-in with --{name}-mm; allowed: one of them")
            sizes[f"{name}_mm"] = round(1e3 * INCH * inches, 6)
    if sizes:
        if not {"diameter_mm", "lead_mm"} <= sizes.keys():
            raise ValueError("--diameter-mm, --lead-mm (missing); allowed: both together, or no size")
        parameters, assumed = catalogue_parameters(CatalogueSizes(**sizes), parameters)
        ratios = rating_ratios(parameters.screw)
        _say_ratings(parameters.screw)
        if (rating := sizes.get("rating_n")) and has_inches(sizes["lead_mm"]):
            turns = rating_of_inches(rating, sizes["lead_mm"])
            say(f"--rating-n {rating:g}: where it is for a million inches of travel, give {turns:.5g}")
    content = screw_template(parameters, assumed, args.axis)
    write_file("FILE.toml", path, content)
    text = f"{path}: enter the values of your screw and oil; the first lines explain the next steps"
    if assumed:
        entries = [line.partition("#")[0].strip() for line in content.splitlines() if "# assumed, " in line]
        text = f"{path}: check the oil, and what is assumed: {'; '.join(entries)}"
    if ratios:
        shown = (f"{name} {ratio:.2f}" for name, ratio in ratios.items())
        text += f". Computed over stated: {', '.join(shown)}"
    over_stated = {f"{name}_over_stated": ratio for name, ratio in ratios.items()}
    return Answer([{"file": str(path)} | over_stated], text=filled(text))
