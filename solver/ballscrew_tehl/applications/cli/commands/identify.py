"""The command identify: inertia, offset, friction over speed and preload from a log of a drive."""

import json
from argparse import Namespace

from ballscrew_tehl.applications.identification.axis_log import StatedAxis, identify_log

from ..shared.inputs import chosen_of
from ..shared.output import QUIET, Answer, check_output, progress_bar, say, to_builtin, write_file


def run_identify(args: Namespace) -> Answer:
    """Fit of a log, its friction and preload, and the files that are requested."""
    stated = StatedAxis(**{name: getattr(args, name) for name in StatedAxis._fields})
    stated = stated.checked()
    inputs = args.log, args.before, args.without_nut, args.screw, args.map
    for name, suffix in (("plot", "png"), ("measurements", "csv"), ("output", "json")):
        if path := getattr(args, name):
            check_output(f"--{name}", path, f"a file *.{suffix}", inputs=inputs)
    no_law = args.map is None and args.friction is None
    screw = None if no_law and args.screw is None else chosen_of(args)
    with progress_bar(QUIET) as progress:
        found = identify_log(args.log, stated, screw, lead_alone=no_law, progress=progress)
    if found.remark:
        say(found.remark)
    if args.measurements:
        text, note = found.measurements()
        found.data["notes"] += [f"{args.measurements}: {note}"] * bool(note)
        write_file("--measurements", args.measurements, text)
    if args.plot:
        from ballscrew_tehl.applications.calibration.plot import png_of

        write_file("--plot", args.plot, png_of(found.figure()))
    if args.output:
        write_file("--output", args.output, json.dumps(to_builtin(found.data), indent=1) + "\n")
    return Answer([found.data], text=found.text)
