"""The command calibrate: friction parameters from measured torques, of a file or one."""

from argparse import Namespace
from pathlib import Path
from typing import cast

from ...calibration.measured import calibrate, film_of
from ...calibration.measurements import Measurement
from ...calibration.one_point import OnePoint, calibrate_point, point_data, point_text
from ...calibration.plot import calibration_figure, save_figure
from ...calibration.result import Calibration, calibration_data, calibration_text
from ...friction.mechanistic import ContactValues
from ...friction.sets import FrictionSet, check_usable, refuse_other_fit, with_set, write_friction_sets
from ...parameters.file import PACKAGED_VG100, Parameters
from ...parameters.units import CELSIUS, RPM
from ...runtime.packed import MECHANISTIC
from ..shared.inputs import screw_of
from ..shared.output import QUIET, Answer, check_output, progress_bar, say, written
from ..shared.quantities import CALIBRATION_POINT


def run_calibrate(args: Namespace) -> Answer:
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
    for option, path, kind in (("--output", args.output, "*.toml"), ("--plot", args.plot, "*.png")):
        if path:
            check_output(option, path, f"a file {kind}", inputs=(args.measurements, args.screw))
    result = _of_file(args, parameters) if point is None else _of_point(args, parameters, point)
    friction = result.friction_set
    # what the commands after this one would refuse
    where = args.measurements if point is None else "--torque-nm"
    check_usable(friction, parameters, where, "check the units of torque and preload")
    refuse_other_fit(friction, parameters)
    if isinstance(result, OnePoint):
        data, text = point_data(result), point_text(result)
    else:
        data = calibration_data(result)
        text = calibration_text(result, data)
        if args.plot:
            figure = calibration_figure(result)
            with written("--plot", args.plot):
                save_figure(figure, Path(args.plot))
            say(f"written: {args.plot}")
    if args.output:
        with written("--output", args.output):
            write_friction_sets(args.output, [friction], "Fitted by ballscrew calibrate")
        say(f"written: {args.output}; next: ballscrew page ... --friction {args.output}")
    else:
        text = "\n".join([text, "For the screw file:", *_screw_file_lines(friction)])
    entry = friction.entries | {"calibration": data}
    return Answer([{f"{friction.kinematics}.{friction.name}": entry}], text=text)


def _point(args: Namespace) -> Measurement:
    """The one point of the options."""
    for option, value in {"--plot": args.plot, "--drop": args.drop}.items():
        if value:
            raise ValueError(f"{option} with --torque-nm; allowed: with MEASUREMENTS.csv only")
    if args.set not in (None, MECHANISTIC):
        raise ValueError(f"--set = {args.set}; allowed with --torque-nm: {MECHANISTIC}, which has one number")
    for quantity in CALIBRATION_POINT:
        if getattr(args, quantity.name) is None:
            names = ", ".join(quantity.option for quantity in CALIBRATION_POINT)
            raise ValueError(f"{quantity.option} (missing); allowed: {names} together")
    torque, preload, speed, temperature = (getattr(args, quantity.name) for quantity in CALIBRATION_POINT)
    return Measurement(preload, abs(speed) * RPM, temperature + CELSIUS, torque)


def _of_point(args: Namespace, parameters: Parameters, point: Measurement) -> OnePoint:
    with_set(parameters, MECHANISTIC)
    contacts, outside = film_of(MECHANISTIC, parameters, args.map)
    if reason := outside(point):
        raise ValueError(f"outside the map: {reason}; remedy: a larger map, or none")
    if seals := parameters.screw.seal_torque:
        point = point.without_seals(seals)
    return calibrate_point(point, parameters, cast(ContactValues, contacts))


def _of_file(args: Namespace, parameters: Parameters) -> Calibration:
    temperature = None if args.temperature_c is None else args.temperature_c + CELSIUS
    with progress_bar(QUIET) as progress:
        return calibrate(
            args.measurements, parameters, args.map, name=args.set, drop=args.drop, progress=progress,
            temperature=temperature,
        )  # fmt: skip


def _screw_file_lines(friction: FrictionSet) -> list[str]:
    """Table friction of a screw file with the fitted numbers."""
    ratio, net, height = (f"{value:.6g}" for value in friction.values)
    lines = ["[friction]", f'law = "{friction.name}"', f"net_sliding_coefficient = {net}"]
    if friction.name == MECHANISTIC:
        # the height in the screw file is that of its surfaces
        return lines
    return [*lines, f"apparent_viscosity_ratio = {ratio}", f"roughness_height_m = {height}"]
