"""The command calibrate: friction parameters from measured torques, of a file or one."""

from argparse import Namespace

from ballscrew_tehl.applications.calibration.measured import calibrate
from ballscrew_tehl.applications.calibration.measurements import Measurement
from ballscrew_tehl.applications.calibration.plot import calibration_figure, png_of
from ballscrew_tehl.applications.calibration.result import calibration_data, calibration_text
from ballscrew_tehl.applications.calibration.written_sets import friction_sets_text
from ballscrew_tehl.applications.screw_model import read_screw
from ballscrew_tehl.friction.sets import SETS
from ballscrew_tehl.parameters.file import PACKAGED_VG100
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.runtime.packed import Law

from ...quantities import CALIBRATION_POINT, TOLERANCES
from ..shared.output import QUIET, Answer, check_output, progress_bar, say, write_file


def run_calibrate(args: Namespace) -> Answer:
    """Fit to a file of measured torques or to one torque."""
    one = any(getattr(args, quantity.name) is not None for quantity in CALIBRATION_POINT[:3])
    if bool(args.measurements) + one != 1:
        raise ValueError("calibrate needs either MEASUREMENTS.csv or --torque-nm with its point")
    measurements = _point(args) if one else args.measurements
    # as torque --friction mechanistic does
    law = one and not (args.screw or args.map)
    parameters = read_screw(args.screw, args.map, PACKAGED_VG100 if law else None)
    if law:
        say(f"no --screw: {parameters.name} with {parameters.lubricant.name} ({PACKAGED_VG100.name})")
    for option, path, kind in (("--output", args.output, "*.toml"), ("--plot", args.plot, "*.png")):
        if path:
            check_output(option, path, f"a file {kind}", inputs=(args.measurements, args.screw))
    if one and parameters.friction.law is not Law.MECHANISTIC:
        raise ValueError(
            f"--torque-nm, law = {parameters.friction.law}; allowed: {Law.MECHANISTIC}, with one number"
        )
    options = {"drop": args.drop}
    options |= {each.axis: 0.01 * (getattr(args, each.name) or 0.0) for each in TOLERANCES}
    if args.temperature_c is not None:
        options["temperature"] = args.temperature_c + CELSIUS
    with progress_bar(QUIET) as progress:
        result = calibrate(measurements, parameters, args.map, progress=progress, **options)
    friction, data = result.friction_set, calibration_data(result)
    text = calibration_text(result, data)
    if args.plot:
        write_file("--plot", args.plot, png_of(calibration_figure(result)))
    if args.output:
        sets = friction_sets_text([friction], "Fitted by ballscrew calibrate")
        write_file("--output", args.output, sets, f"; next: ballscrew page ... --friction {args.output}")
    else:
        keys = {name: name.replace("height", "height_m") for name in SETS[friction.name]}
        if friction.supply_length is not None:
            keys |= {"supply_length": "supply_length"}
        numbers = (f"{key} = {getattr(friction, name):.6g}" for name, key in keys.items())
        text = "\n".join([text, "For the screw file:", "[friction]", f'law = "{friction.name}"', *numbers])
    entry = friction.entries | {"calibration": data}
    return Answer([{friction.name: entry}], text=text)


def _point(args: Namespace) -> Measurement:
    """The one point of the options."""
    if args.drop:
        raise ValueError("--drop with --torque-nm; allowed: with MEASUREMENTS.csv only")
    values = {quantity.option: getattr(args, quantity.name) for quantity in CALIBRATION_POINT}
    for option in (option for option, value in values.items() if value is None):
        raise ValueError(f"{option} (missing); allowed: {', '.join(values)} together")
    torque, preload, speed, temperature = values.values()
    return Measurement(preload, abs(speed) * RPM, temperature + CELSIUS, torque)
