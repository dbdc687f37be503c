"""Shared by several commands: screw and map of their options, keys of the results."""

from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ...friction.sets import (
    CATALOGUE_DIFFERS,
    FrictionSet,
    default_friction_set,
    friction_set_of_file,
    load_friction_sets,
    refuse_other_fit,
    with_set,
    without_overrides,
)
from ...parameters.file import PACKAGED_VG100, Parameters, changed, load_screw
from ...parameters.screw import Law
from ...runtime.evaluate import NutMap
from ...runtime.packed import MECHANISTIC
from .progress import QUIET, progress_bar
from .quantities import TORQUE_POINT
from .results import say


def screw_of(args: Namespace, default: Path | None = None) -> Parameters:
    """The parameters selected by --screw, else those in the file of --map, and by --kinematics.

    Parameters   default : screw file without both; None = the packaged one
    Raises       ParameterError, MapError (a ValueError)
    """
    if args.screw is None and args.map is not None:
        from ...nut_map.file import screw_of_map

        parameters = screw_of_map(args.map)
    else:
        parameters = load_screw(default if args.screw is None else args.screw)
    if args.kinematics in (None, parameters.friction.kinematics):
        return parameters
    if args.kinematics == "published" and parameters.published_speeds is None:
        raise ValueError(
            f"--kinematics = published; allowed: rolling_frame, {parameters.name} has no table published_speeds"
        )
    # numbers in the screw file belong to its own law
    own = without_overrides(parameters, Law.of_kinematics(args.kinematics)[0])
    return changed(own, friction={"kinematics": args.kinematics})


class Chosen(NamedTuple):
    """Screw and friction set of the options; of_file: the set is that of a file, None = a packaged one."""

    parameters: Parameters
    friction_set: FrictionSet
    of_file: FrictionSet | None

    def nut_map(self, args: Namespace) -> NutMap:
        """The map of --map, or one made now, with the film and the numbers of the friction set."""
        from ...nut_map.file import load_map

        with progress_bar(QUIET) as progress:
            return load_map(args.map, self.parameters, self.of_file, progress)

    @property
    def described(self) -> dict[str, str]:
        """Keys of the answer: screw, set, kinematics, screw of the fit."""
        return {
            "screw": self.parameters.name,
            "oil": self.parameters.lubricant.name,
            "kinematics": self.friction_set.kinematics,
            "friction_set": self.friction_set.name,
            "friction_screw": self.friction_set.screw,
        }

    @property
    def catalogue_note(self) -> dict[str, str]:
        """Key that says why a torque of the mechanistic law differs from that of the catalogue."""
        law = self.friction_set.film_model == MECHANISTIC
        return {"catalogue_note": CATALOGUE_DIFFERS} if law else {}


def chosen_of(args: Namespace) -> Chosen:
    """Screw and friction set selected by --screw, --map, --kinematics and --friction.

    Raises       ValueError: no such set or file, a file for another screw or other kinematics
    """
    name = args.friction
    if name is None:
        parameters = screw_of(args)
        return Chosen(parameters, default_friction_set(parameters), None)
    packaged = load_friction_sets()
    if name in packaged:
        parameters = with_set(screw_of(args, PACKAGED_VG100 if name == MECHANISTIC else None), name)
        return Chosen(parameters, default_friction_set(parameters), None)
    if not Path(name).is_file():
        raise ValueError(
            f"--friction = {name}; allowed: {', '.join(packaged)}, or a file of ballscrew calibrate --output"
        )
    sets = load_friction_sets(name, "give a file that ballscrew calibrate --output has written")
    only_law = all(entry.film_model == MECHANISTIC for entry in sets.values())
    parameters = screw_of(args, PACKAGED_VG100 if only_law else None)
    of_file = friction_set_of_file(name, parameters)
    refuse_other_fit(of_file, parameters)
    return Chosen(without_overrides(parameters, of_file.name), of_file, of_file)


def some_of(some: Sequence[Any], results: Sequence[Any]) -> str:
    """How many of several results a line is about; "" of a single one."""
    return "" if len(results) == 1 else f"{len(some)} of {len(results)} points, the first: "


def say_outside(results: Sequence[Mapping[str, Any]], axes: Mapping[str, Any]) -> None:
    """One line on stderr about answers beyond a map, with the first of them; axes: of its header."""
    outside = [result for result in results if result.get("clamped")]
    if not outside:
        return
    first = outside[0]
    keys = {quantity.axis: quantity.name for quantity in TORQUE_POINT}
    values = ", ".join(
        f"{keys[name]} {first[keys[name]]:g}" if name in keys else name for name in first["clamped"]
    )
    # below its lowest preload a map continues by power laws
    light = list(first["clamped"]) == ["preload"] and first["preload_n"] < axes["preload"][0]
    edge = "extrapolated from its lowest preload" if light else "those at its edge"
    say(
        f"in_range: false; {some_of(outside, results)}{values} is outside the map, the numbers are {edge} (ranges: "
        "ballscrew map info; a larger map: ballscrew map build; without a map: ballscrew torque --direct)"
    )


#: end of a key, its unit, by names of numbers; others are pure numbers
_NAMES = {
    "n": "nut_force_a nut_force_b separation_load ball_load_max static_load_rating dynamic_load_rating traction_force "
    "traction_force_1 traction_force_2",
    "m": "film_thickness_min film_thickness_central_screw film_thickness_central_nut h_c h_m axial_deflection "
    "lost_motion",
    "k": "film_temperature_rise temperature_rise temperature_rise_mean temperature_rise_smooth",
    "pa": "contact_pressure_max p_max",
    "w": "rolling_loss",
    "n_per_m": "axial_stiffness",
    "nm": "catalogue_torque",
}
_KEYS = {name: f"{name}_{unit}" for unit, names in _NAMES.items() for name in names.split()}
#: output of the map -> key of the command line
EXTREMES = {
    name: _KEYS.get(name, name)
    for name in (
        "film_thickness_min", "film_thickness_central_screw", "film_thickness_central_nut", "film_temperature_rise",
        "contact_pressure_max", "ball_load_max", "lambda_ratio",
    )
}  # fmt: skip


def keyed(values: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers of a result by key, which has the unit at its end."""
    return {_KEYS.get(name, name): value for name, value in values.items()}
