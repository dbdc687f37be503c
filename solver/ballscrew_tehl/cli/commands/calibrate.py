"""The command calibrate: friction parameters from measured torques, of a file or one."""

from __future__ import annotations

import shlex
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from ...calibration.measured import calibrate, films_of
from ...calibration.measurements import Measurement
from ...friction.sets import FrictionSet, check_usable, refuse_other_fit, with_set, write_friction_sets
from ...parameters.file import PACKAGED_VG100, Parameters
from ...parameters.units import CELSIUS, RPM
from ...runtime.packed import MECHANISTIC
from ..shared.chosen import screw_of
from ..shared.files import check_output, written
from ..shared.progress import QUIET, progress_bar
from ..shared.quantities import CALIBRATION_POINT, TEMPERATURE
from ..shared.results import print_results, say

if TYPE_CHECKING:
    from ...calibration.result import Calibration
    from ...friction.mechanistic import ContactValues


def run_calibrate(args: Namespace) -> int:
    """Fit to a file of measured torques or to one torque."""
    one = any(getattr(args, quantity.name) is not None for quantity in CALIBRATION_POINT[:3])
    if bool(args.measurements) + one != 1:
        raise ValueError("calibrate needs either MEASUREMENTS.csv or --torque-nm with its point")
    point = _point(args) if one else None
    # as torque --friction mechanistic does
    law = (one or args.set == MECHANISTIC) and not (args.screw or args.map)
    parameters = screw_of(args, PACKAGED_VG100 if law else None)
    if law:
        say(f"no --screw: {parameters.name} with {parameters.lubricant.name} ({PACKAGED_VG100.name})")
    outputs = ("--output", args.output, "a file *.toml"), ("--plot", args.plot, "a file *.png")
    for option, given, kind in outputs:
        if given:
            check_output(option, given, kind, inputs=(args.measurements, args.screw))
    fitted = _of_file(args, parameters) if point is None else _of_point(args, parameters, point)
    found = fitted.friction_set
    if args.output:
        with written("--output", args.output):
            write_friction_sets(
                args.output,
                [found],
                "Fitted by ballscrew calibrate",
            )
        where = [
            f"--{key} {shlex.quote(getattr(args, key))} " for key in ("screw", "map") if getattr(args, key)
        ]
        # --kinematics alone fits with another oil than a file of the mechanistic law is read with
        follows = f"; next: ballscrew page {''.join(where)}--friction {shlex.quote(args.output)}"
        say(f"written: {args.output}{follows if where or not args.kinematics else ''}")
    if args.json:
        entry = found.entries | {"calibration": fitted.data}
        print_results([{f"{found.kinematics}.{found.name}": entry}], True, False)
        return 0
    print(fitted.text)
    if not args.output:
        print("For the screw file:\n" + "\n".join(_screw_file_lines(found)))
    return 0


def _check_accepted(found: FrictionSet, parameters: Parameters, where: str) -> None:
    """Refuse a set whose file the commands after this one would refuse.

    Raises       ValueError
    """
    check_usable(found, parameters, where, "check the units of torque and preload")
    refuse_other_fit(found, parameters)


class _Fitted(NamedTuple):
    """A fitted set, what --json adds to it, the same as text."""

    friction_set: FrictionSet
    data: dict[str, Any]
    text: str


def _point(args: Namespace) -> Measurement:
    """The one point of the options."""
    unused = {"--plot": args.plot, "--drop": args.drop}
    for option, value in unused.items():
        if value:
            raise ValueError(f"{option} with --torque-nm; allowed: with MEASUREMENTS.csv only")
    if args.set not in (None, MECHANISTIC):
        raise ValueError(f"--set = {args.set}; allowed with --torque-nm: {MECHANISTIC}, which has one number")
    values = []
    for quantity in CALIBRATION_POINT:
        given = getattr(args, quantity.name)
        if given is None:
            names = ", ".join(quantity.option for quantity in CALIBRATION_POINT)
            raise ValueError(f"{quantity.option} (missing); allowed: {names} together")
        values.append(quantity.checked(quantity.option, given))
    torque, preload, speed, temperature = values
    return Measurement(preload, abs(speed) * RPM, temperature + CELSIUS, torque)


def _of_point(args: Namespace, parameters: Parameters, point: Measurement) -> _Fitted:
    from ...calibration.one_point import calibrate_point, point_data, point_text

    with_set(parameters, MECHANISTIC)
    films, outside = films_of(parameters, args.map)
    if reason := outside(point):
        raise ValueError(f"outside the map: {reason}; remedy: a larger map, or none")
    result = calibrate_point(point, parameters, cast("ContactValues", films(MECHANISTIC)))
    _check_accepted(result.friction_set, parameters, "--torque-nm")
    return _Fitted(result.friction_set, point_data(result), point_text(result))


def _of_file(args: Namespace, parameters: Parameters) -> _Fitted:
    """Fit to a file, with its picture if that is wanted."""
    from ...calibration.result import calibration_data, calibration_text

    result = _calibration(args, parameters)
    _check_accepted(result.friction_set, parameters, args.measurements)
    if args.plot:
        from ...calibration.plot import calibration_figure, save_figure

        figure = calibration_figure(result)
        with written("--plot", args.plot):
            save_figure(figure, Path(args.plot))
        say(f"written: {args.plot}")
    return _Fitted(result.friction_set, calibration_data(result), calibration_text(result))


def _screw_file_lines(found: FrictionSet) -> list[str]:
    """Table friction of a screw file with the fitted numbers."""
    ratio, net, height = (f"{value:.6g}" for value in found.values)
    lines = ["[friction]", f'set = "{found.name}"', f"net_sliding_coefficient = {net}"]
    if found.name == MECHANISTIC:
        # the height in the screw file is that of its surfaces
        return lines
    return [*lines, f"apparent_viscosity_ratio = {ratio}", f"roughness_height_m = {height}"]


def _calibration(args: Namespace, parameters: Parameters) -> Calibration:
    temperature = args.temperature_c
    if temperature is not None:
        temperature = TEMPERATURE.checked("--temperature-c", temperature) + CELSIUS
    with progress_bar(QUIET) as progress:
        return calibrate(
            args.measurements, parameters, args.map, name=args.set, temperature=temperature,
            drop=args.drop, progress=progress,
        )  # fmt: skip
