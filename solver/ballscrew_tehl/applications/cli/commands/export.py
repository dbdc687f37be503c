"""The command export: friction of a map or of a log as a table for a controller or a simulation tool."""

from argparse import Namespace

from ballscrew_tehl.applications.export.files import SUFFIXES, TableOptions, friction_files, needless

from ..shared.inputs import chosen_of
from ..shared.output import QUIET, Answer, check_output, progress_bar, write_file

#: of the table of lists
COLUMNS = ("file", "preload_n", "temperature_c", "entries", "largest_error_nm", "error_bound_nm")


def run_export(args: Namespace) -> Answer:
    """One file, or one for each preload and temperature of a compensation list."""
    kind = "a file " + ", ".join(f"*{suffix}" for suffix in SUFFIXES[args.format])
    inputs = args.screw, args.map, args.friction, args.identified
    output = check_output("--output", args.output, kind, inputs=inputs)
    options = TableOptions(**{name: getattr(args, name) for name in TableOptions._fields})
    for name in ("screw", "map", "friction") if args.identified else ():
        if getattr(args, name) is not None:
            raise ValueError(needless(name))
    source = args.identified or chosen_of(args)
    with progress_bar(QUIET) as progress:
        files = friction_files(output, args.format, source, options, progress)
    for file in files:
        write_file("--output", file.path, file.text)
    return Answer([file.about for file in files], args.format == "twincat", columns=COLUMNS)
