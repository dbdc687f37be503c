"""The command calibrate: friction parameters from measured torques, of a file or one."""

from argparse import Namespace
from pathlib import Path
from typing import Any

from ballscrew_tehl.applications.calibration.measured import calibrate
from ballscrew_tehl.applications.calibration.measurements import Measurement, spread_advice
from ballscrew_tehl.applications.calibration.plot import calibration_figure, save_figure
from ballscrew_tehl.applications.calibration.result import Calibration, calibration_data
from ballscrew_tehl.applications.calibration.written_sets import friction_set_lines, write_friction_sets
from ballscrew_tehl.friction.sets import SETS, check_usable, refuse_other_fit
from ballscrew_tehl.parameters.file import PACKAGED_VG100
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.runtime.packed import Law

from ..shared.inputs import screw_of
from ..shared.output import QUIET, Answer, check_output, progress_bar, say, written
from ..shared.quantities import CALIBRATION_POINT, TOLERANCES


def run_calibrate(args: Namespace) -> Answer:
    """Fit to a file of measured torques or to one torque."""
    one = any(getattr(args, quantity.name) is not None for quantity in CALIBRATION_POINT[:3])
    if bool(args.measurements) + one != 1:
        raise ValueError("calibrate needs either MEASUREMENTS.csv or --torque-nm with its point")
    measurements = _point(args) if one else args.measurements
    # as torque --friction mechanistic does
    law = one and not (args.screw or args.map)
    parameters = screw_of(args, PACKAGED_VG100 if law else None)
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
    friction = result.friction_set
    # what the commands after this one would refuse
    where = args.measurements or "--torque-nm"
    check_usable(friction, parameters, where, "check the units of torque and preload")
    refuse_other_fit(friction, parameters)
    data = calibration_data(result)
    text = _text(result, data)
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


def _text(result: Calibration, data: dict[str, Any]) -> str:
    """Points, parameters, errors, what is not identified, dropped rows."""
    import pandas as pd

    points, entry = pd.DataFrame(data["points"]), result.friction_set
    columns = {
        "row": ["=".join(map(str, rows)) for rows in points["rows"]], "preload [N]": points["preload_n"],
        "speed [r/min]": points["speed_rpm"], "oil [C]": points["temperature_k"] - CELSIUS,
        "axial [N]": points["axial_load_n"], "measured [N m]": points["measured_nm"],
        "computed [N m]": points["computed_nm"], "model [%]": (100.0 * points["deviation"]).round(1),
        "left out [%]": (100.0 * points["left_out_deviation"]).round(1),
    }  # fmt: skip
    if points["outlier"].any():
        columns[""] = points["outlier"].map({True: "outlier", False: ""})
    lines = [pd.DataFrame(columns).to_string(index=False, float_format="{:.4g}".format, na_rep="-"), ""]
    lines.append("Fitted (value +- half-width of the 95 % interval)")
    lines += friction_set_lines(entry)
    lines += [f"    {key:<26}{value:.4g}" for key, value in result.level.items()]
    if (spread := data["error_over_uncertainty"]) is not None:
        advice = spread_advice(spread)
        text = f"    errors over stated uncertainties: {spread:.2g} (about 1 expected)"
        lines.append(f"{text}{advice and f': {advice}'}")
    if entry.not_identified:
        lines.append("Not identified by these data:")
        lines += [f"    {name}: {why}" for name, why in entry.not_identified.items()]
    lines += [f"dropped: {problem}" for problem in result.dropped]
    return "\n".join([*lines, *(f"note: {note}" for note in result.notes)])
