"""Command line of the FMUs: python -m ballscrew_fmu build|check|info|map|page; build is also called by build_fmu.py.

What needs the extra `fmu` is imported when a command runs.
"""

import argparse
import hashlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from ballscrew_tehl.cli.main import INTERRUPTED
from ballscrew_tehl.cli.shared.extras import missing_extra
from ballscrew_tehl.cli.shared.files import check_output, new_folder

DESCRIPTION = """\
Build the FMUs of a screw from its map (friction and preload monitor, for Python hosts and native; the screw as a
transmission, native), check them in fmpy and print their torque."""
EPILOG = """\
steps
  1. read and check the screw file (a wrong key or value: message of one line, exit code 2)
  2. load the map of this screw; a map of another screw or version is rejected
  3. pack map and Python code into BallScrewFriction.fmu (torque from preload) and BallScrewPreloadMonitor.fmu
     (preload from torque): FMI 2.0 co-simulation for Python hosts
  4. compile the C runtime for Linux, Windows and macOS with ziglang, and pack it with the map into
     BallScrewFrictionNative_fmi2.fmu and _fmi3.fmu, BallScrewPreloadMonitorNative_fmi2.fmu and _fmi3.fmu,
     BallScrewTransmission_fmi2.fmu and _fmi3.fmu:
     co-simulation and model exchange for every host
     (the first time some minutes for the C libraries of these systems, then about a minute); without ziglang the C
     compiler of this machine builds for this machine only
  5. validate each FMU with fmpy: any finding stops the build
  6. replay a reference input in fmpy and compare every output with the map (1e-9); the preload of the
     monitors must also agree with the one the torque was computed from (1e-6)
  7. print the measured torque compared with this model, Zhao, Zhou and NSK (packaged screw only),
     and path, size and SHA-256 of each FMU
Same input gives the same bytes. The FMUs are delivered only if all checks pass.

examples
  {prog}                                  the screw GD4008-3 with its packaged map
  {prog} --friction mechanistic           the law of every other screw, with an oil ISO VG 100
  {prog} --python-only                    only the FMUs for Python hosts
  {prog} --embed-map                      native FMUs that open no file, for real-time targets
  python -m ballscrew_tehl map build --screw my.toml --output my_map.nc
  {prog} --screw my.toml --map my_map.nc --output my_fmus
  python -m ballscrew_tehl calibrate measurements.csv --screw my.toml --map my_map.nc --output friction.toml
  {prog} --screw my.toml --map my_map.nc --friction friction.toml

exit codes: 0 done, 1 a check or the compiler failed, 2 invalid input, 130 interrupted
"""

MAP_DESCRIPTION = """\
Write the map of a screw as nut_map.bin, the form in which the native FMUs read it. Put in place of the file of this
name in the resources of a native FMU, it gives the friction of this screw without a build. The friction law must be
that of the FMU. The model description is not changed: its start values, limits and dependencies remain those of the
map that the FMU was built with. Set the friction parameters printed here."""
PAGE_DESCRIPTION = """\
Write one HTML file that computes the friction of a screw in a browser: torque over speed with its interval and parts,
film, axial force of each nut, efficiency, and measured points from a CSV file over them. It contains the C code of the
FMU as WebAssembly and the map, and needs no network. Every FMU has it as documentation/live.html."""


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (see --help)\n")


def parser(prog: str, subcommands: bool, folder: Path) -> Parser:
    """Options of all subcommands, or of build alone.

    Parameters   prog : name of the program in messages;  subcommands : False: options of build
                 folder : default of --output
    """
    form: Any = {"formatter_class": argparse.RawDescriptionHelpFormatter}
    if not subcommands:
        epilog = EPILOG.format(prog=f"python {prog}")
        options = Parser(prog=prog, description=DESCRIPTION, epilog=epilog, **form)
        _add_build(options, folder)
        return options
    options = Parser(prog=prog, description="FMUs of a ball screw.")
    commands = options.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=Parser)
    form |= {"epilog": EPILOG.format(prog="python -m ballscrew_fmu build"), "description": DESCRIPTION}
    text = "build and check the FMUs of a screw from its map"
    _add_build(commands.add_parser("build", help=text, **form), folder)
    check = commands.add_parser("check", help="validate an FMU and replay the reference that it carries")
    info = commands.add_parser("info", help="kinds, platforms and variables of an FMU")
    for command, run in ((check, _check), (info, _info)):
        command.add_argument("fmu", metavar="FILE.fmu", type=Path)
        command.add_argument("--json", action="store_true", help="print one JSON object")
        command.set_defaults(run=run, prog=command.prog)
    text, form = "write the map of another screw for a native FMU", form | {"description": MAP_DESCRIPTION}
    form |= {"epilog": None}
    _add_map(commands.add_parser("map", help=text, **form))
    form |= {"description": PAGE_DESCRIPTION}
    _add_page(commands.add_parser("page", help="write one HTML file that computes in a browser", **form))
    return options


def _add_inputs(options: argparse.ArgumentParser) -> None:
    options.add_argument("--screw", metavar="FILE.toml", help="screw file; default: the packaged GD4008-3")
    text = "map file of this screw; default: the packaged map of the screw"
    options.add_argument("--map", metavar="FILE", help=text)
    options.add_argument(
        "--kinematics",
        choices=("published", "rolling_frame"),
        help="surface speeds and friction law: published reproduces the paper, rolling_frame is that of every other "
        "screw; default: from the screw file",
    )
    options.add_argument(
        "--friction",
        metavar="NAME|FILE",
        help="two_parameter, three_parameter, mechanistic, or a file of this screw that `calibrate --output` has "
        "written; default: the packaged set of the screw file. mechanistic without --screw takes the GD4008-3 with an "
        "oil ISO VG 100",
    )


def _add_build(options: argparse.ArgumentParser, folder: Path) -> None:
    _add_inputs(options)
    text = "folder for the FMUs; default: %(default)s"
    options.add_argument("--output", metavar="FOLDER", type=Path, default=folder, help=text)
    options.add_argument("--python-only", action="store_true", help="build the FMUs for Python hosts only")
    options.add_argument(
        "--embed-map",
        action="store_true",
        help="compile the map into the native FMUs: they open no file, their map cannot be replaced, and each file "
        "has 15 MB",
    )
    options.set_defaults(run=_build, prog=options.prog)


def _add_map(options: argparse.ArgumentParser) -> None:
    _add_inputs(options)
    text = "file to write; default: %(default)s"
    options.add_argument("--output", metavar="FILE", type=Path, default=Path("nut_map.bin"), help=text)
    options.set_defaults(run=_write_map, prog=options.prog)


def _add_page(options: argparse.ArgumentParser) -> None:
    _add_inputs(options)
    text = "file to write; default: %(default)s"
    options.add_argument("--output", metavar="FILE.html", type=Path, default=Path("live.html"), help=text)
    options.add_argument("--json", action="store_true", help="print one JSON object")
    options.set_defaults(run=_write_page, prog=options.prog)


def main(
    arguments: Sequence[str] | None = None,
    prog: str = "python -m ballscrew_fmu",
    subcommands: bool = True,
    folder: Path = Path("dist"),
) -> int:
    """Run a command. Returns the exit code: 0 done, 1 a check or the compiler failed, 2 invalid input."""
    args = parser(prog, subcommands, folder).parse_args(arguments)
    try:
        code: int = args.run(args)
    except ModuleNotFoundError as error:
        remedy = missing_extra(error)
        if remedy is None:
            raise
        return _print_error(args, remedy)
    except KeyboardInterrupt:
        return _print_error(args, "interrupted, no FMU delivered", code=INTERRUPTED)
    return code


def _build(args: argparse.Namespace) -> int:
    from ballscrew_fmu import build
    from ballscrew_fmu.checks.reference import CheckError
    from ballscrew_fmu.native_fmu.compile import BuildError
    from ballscrew_fmu.native_fmu.sources import SourceError

    columns = (TextColumn("{task.description:<40}"), BarColumn(24), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("reading screw and map", total=6 if args.python_only else 18)
        try:
            inputs = build.read_inputs(args.screw, args.map, args.kinematics, args.friction)
        except (ValueError, OSError) as error:
            return _print_error(args, str(error))
        try:
            with new_folder(args.output):
                paths, text = build.build(
                    inputs,
                    args.output,
                    lambda text: progress.update(task, description=text, advance=1),
                    args.python_only,
                    args.embed_map,
                )
        except OSError as error:
            reason = error.strerror or error
            return _print_error(args, f"--output {args.output}: {reason}; needs a folder that can be written")
        except CheckError as error:
            return _print_error(args, f"check failed, no FMU delivered: {error}", code=1)
        except (BuildError, SourceError) as error:
            return _print_error(args, f"no FMU delivered: {error}", code=1)
    print(text)
    if friction := inputs.nut_map.header.get("friction"):
        print(f"friction: {friction['set']}, {friction['loss'] or 'not fitted'}; {friction['provenance']}")
        if friction["carried_over"]:
            print(friction["carried_over"], file=sys.stderr)
    for path in paths:
        content = path.read_bytes()
        print(f"{path}  {len(content) / 1024:.0f} kB\nsha256 {hashlib.sha256(content).hexdigest()}")
    return 0


def _check(args: argparse.Namespace) -> int:
    from ballscrew_fmu.checks.file_check import check_file
    from ballscrew_fmu.checks.reference import CheckError

    try:
        lines = check_file(args.fmu)
    except ValueError as error:
        return _print_error(args, str(error))
    except CheckError as error:
        return _print_error(args, f"{args.fmu}: {error}", code=1)
    print(json.dumps({"file": str(args.fmu), "checks": lines}) if args.json else "\n".join(lines))
    return 0


def _info(args: argparse.Namespace) -> int:
    from ballscrew_fmu.checks.file_check import fmu_info

    try:
        info = fmu_info(args.fmu)
    except ValueError as error:
        return _print_error(args, str(error))
    if args.json:
        print(json.dumps(info))
        return 0
    print(
        f"{info['model']}, FMI {info['fmi_version']}, {' and '.join(info['kinds'])}, {', '.join(info['platforms'])}"
    )
    print(f"{info['description']}\n{info['tool']}, {info['token']}")
    if info["map"]:
        print(info["map"])
    table = Table(box=None, pad_edge=False)
    for title in ("variable", "causality", "unit", "start", "min", "max"):
        table.add_column(title, justify="left" if title in ("variable", "causality", "unit") else "right")
    for v in info["variables"]:
        cells = (v["name"], v["causality"], v["unit"], v["start"], v["min"], v["max"])
        table.add_row(*("" if cell is None else str(cell) for cell in cells))
    Console(width=110).print(table)
    return 0


def _write_map(args: argparse.Namespace) -> int:
    from ballscrew_fmu import build
    from ballscrew_fmu.archive import write_whole
    from ballscrew_fmu.native_fmu.map_file import map_bytes
    from ballscrew_tehl.runtime.packed import map_hash

    try:
        nut_map = build.read_inputs(args.screw, args.map, args.kinematics, args.friction).nut_map
    except (ValueError, OSError) as error:
        return _print_error(args, str(error))
    try:
        write_whole(args.output, map_bytes(nut_map))
    except OSError as error:
        return _print_error(
            args, f"--output {args.output}: {error.strerror or error}; needs a file that can be written"
        )
    print(f"{args.output}  map {map_hash(nut_map.header)}, {nut_map.law} friction law")
    for name, value in nut_map.header["defaults"].items():
        print(f"{name} = {value:g}")
    return 0


def _write_page(args: argparse.Namespace) -> int:
    from ballscrew_fmu import build
    from ballscrew_fmu.archive import write_whole
    from ballscrew_fmu.native_fmu.compile import BuildError
    from ballscrew_fmu.native_fmu.sources import SourceError
    from ballscrew_tehl.runtime.packed import map_hash

    try:
        check_output("--output", args.output, "a file *.html, *.htm")
        inputs = build.read_inputs(args.screw, args.map, args.kinematics, args.friction)
    except (ValueError, OSError) as error:
        return _print_error(args, str(error))
    print("compiling the page; the first time this takes some 20 s", file=sys.stderr)
    try:
        content = inputs.live_page().encode()
        write_whole(args.output, content)
    except (BuildError, SourceError) as error:
        return _print_error(args, f"no page written: {error}", code=1)
    except OSError as error:
        return _print_error(
            args, f"--output {args.output}: {error.strerror or error}; needs a file that can be written"
        )
    found = {"file": str(args.output), "bytes": len(content), "map_hash": map_hash(inputs.nut_map.header)}
    print(json.dumps(found) if args.json else "{file}  {bytes} bytes, map {map_hash}".format(**found))
    return 0


def _print_error(args: argparse.Namespace, message: str, code: int = 2) -> int:
    print(f"{args.prog}: {' '.join(message.split())}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
