"""The command calibrate: friction parameters from measured torques, of a file or one."""

from argparse import Namespace
from pathlib import Path

from ...calibration.measured import calibrate
from ...calibration.measurements import Measurement
from ...calibration.plot import calibration_figure, save_figure
from ...calibration.result import calibration_data, calibration_text
from ...friction.sets import FrictionSet, check_usable, refuse_other_fit, write_friction_sets
from ...parameters.file import PACKAGED_VG100
from ...parameters.units import CELSIUS, RPM
from ...runtime.packed import MECHANISTIC
from ..shared.chosen import screw_of
from ..shared.files import check_output, written
from ..shared.progress import QUIET, progress_bar
from ..shared.quantities import CALIBRATION_POINT
from ..shared.results import Answer, say


def run_calibrate(args: Namespace) -> Answer:
    """Fit to a file of measured torques or to one torque."""
    one = any(getattr(args, quantity.name) is not None for quantity in CALIBRATION_POINT[:3])
    if bool(args.measurements) + one != 1:
        raise ValueError("calibrate needs either MEASUREMENTS.csv or --torque-nm with its point")
    measurements, name = (_point(args), MECHANISTIC) if one else (args.measurements, args.set)
    # as torque --friction mechanistic does
    law = name == MECHANISTIC and not (args.screw or args.map)
    parameters = screw_of(args, PACKAGED_VG100 if law else None)
    if law:
        say(f"no --screw: {parameters.name} with {parameters.lubricant.name} ({PACKAGED_VG100.name})")
    for option, path, kind in (("--output", args.output, "*.toml"), ("--plot", args.plot, "*.png")):
        if path:
            check_output(option, path, f"a file {kind}", inputs=(args.measurements, args.screw))
    temperature = None if args.temperature_c is None else args.temperature_c + CELSIUS
    with progress_bar(QUIET) as progress:
        result = calibrate(
            measurements, parameters, args.map, name=name, drop=args.drop, progress=progress,
            temperature=temperature,
        )  # fmt: skip
    friction = result.friction_set
    # what the commands after this one would refuse
    check_usable(
        friction, parameters, args.measurements or "--torque-nm", "check the units of torque and preload"
    )
    refuse_other_fit(friction, parameters)
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


def _screw_file_lines(friction: FrictionSet) -> list[str]:
    """Table friction of a screw file with the fitted numbers."""
    ratio, net, height = (f"{value:.6g}" for value in friction.values)
    lines = ["[friction]", f'law = "{friction.name}"', f"net_sliding_coefficient = {net}"]
    if friction.name == MECHANISTIC:
        # the height in the screw file is that of its surfaces
        return lines
    return [*lines, f"apparent_viscosity_ratio = {ratio}", f"roughness_height_m = {height}"]
