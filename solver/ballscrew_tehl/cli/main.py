"""Command line: python -m ballscrew_tehl COMMAND.

Exit codes: 0 done; 1 a computation did not converge; 2 bad input, with one line on stderr that names what is
allowed. Results go to stdout, everything else to stderr. Modules are imported when a command runs: results from the
map must not wait for the import of the solver.
"""

from __future__ import annotations

import argparse
import difflib
import importlib
import itertools
import os
import sys
from collections.abc import Iterable, Sequence
from typing import Any, NoReturn

from .. import __version__
from .contact import add_contact
from .extras import missing_extra
from .files import os_error_text
from .oil import add_oil
from .points import Quantity, add_json, add_options

PRELOAD = Quantity("preload_n", "preload of the nut [N]", least=0.0)
SPEED = Quantity("speed_rpm", "screw speed [r/min]")
TEMPERATURE = Quantity("temperature_c", "oil temperature [C]", least=-73.15, most=200.0)
AXIAL_LOAD = Quantity("axial_load_n", "external axial load [N]", default=0.0)
TORQUE = Quantity("torque_nm", "measured friction torque, magnitude [N.m]", least=0.0)
TURNING = SPEED._replace(not_zero=True)

TORQUE_POINT = (PRELOAD, SPEED, TEMPERATURE, AXIAL_LOAD)
SCREW_POINT = (PRELOAD, AXIAL_LOAD)
PRELOAD_POINT = (TORQUE, TURNING, TEMPERATURE)

KINEMATICS = ("published", "rolling_frame")
SET_NAMES = ("two_parameter", "three_parameter", "mechanistic")
#: exit code after Ctrl-C: 128 and the number of the signal
INTERRUPTED = 130
#: points of a certificate: of a build, of a quick one
POINTS, QUICK_POINTS = 200, 8
CERTIFIED = ("torque", "film", "temperature_rise")
DROP_KINDS = ("impossible", "outside", "outliers")
OILS = ("viscosities", "iso_vg")
LUBRICANTS = ("oil", "grease")
LOSS_NAMES = ("least_squares", "soft_l1")


def _nearest(given: str, known: Iterable[str]) -> str:
    """End of a message about a misspelt word, empty if it is like none: a word that begins so, or the most similar."""
    words = list(known)
    begun = [word for word in words if len(given.strip("-")) > 1 and word.startswith(given)]
    near = begun or difflib.get_close_matches(given, words, n=1, cutoff=0.6)
    return f"; is {near[0]} meant?" if near else ""


class Parser(argparse.ArgumentParser):
    """One line per error; no abbreviations, which a later option could make ambiguous."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(allow_abbrev=False, **settings)
        # of arguments that stay text
        self.register("type", None, _unshielded)

    def add_subparsers(self, **settings: Any) -> argparse._SubParsersAction:
        """Arguments of a command are left to its own parser as they are."""
        self.register("type", None, str)
        return super().add_subparsers(**settings)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """As argparse, but a misspelt option is refused by its command, before one that is missing for it."""
        words = sys.argv[1:] if args is None else list(args)
        if self._subparsers is not None:
            # what follows belongs to the command
            words = list(itertools.takewhile(lambda word: word.startswith("-"), words))
        known = self._option_string_actions
        for word in itertools.takewhile(lambda word: word != "--", words):
            option = word.partition("=")[0]
            if option.startswith("--") and option not in known:
                self.error(f"unrecognized arguments: {option}{_nearest(option, known)}")
        found, left = super().parse_known_args(args, namespace)
        if left:
            self.error(f"unrecognized arguments: {' '.join(left)}")
        return found, left

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            error.message += _nearest(str(value), [str(choice) for choice in action.choices or ()])
            raise

    def error(self, message: str) -> NoReturn:
        """Print the error and exit with code 2."""
        self.exit(2, f"{self.prog}: error: {message} (see --help)\n")


def _screw_options(parser: argparse.ArgumentParser, with_map: bool = True) -> None:
    parser.add_argument("--screw", metavar="FILE.toml", help="screw file; default: the packaged GD4008-3")
    parser.add_argument(
        "--kinematics",
        choices=KINEMATICS,
        help="surface speeds and friction law; default: as in the screw file",
    )
    if with_map:
        parser.add_argument("--map", metavar="FILE", help="map file; default: the packaged map")
        parser.add_argument(
            "--friction",
            metavar="NAME|FILE",
            help="two_parameter, three_parameter, mechanistic, or a file that calibrate --output has written; default: "
            "as in the screw file. mechanistic without --screw takes the GD4008-3 with an oil ISO VG 100",
        )


def _torque(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser("torque", help="friction torque of the nut at an operating point")
    add_options(parser, TORQUE_POINT)
    parser.add_argument("--direct", action="store_true", help="solve the contacts instead of reading the map")
    _screw_options(parser)
    parser.set_defaults(run="torque.run_torque")


def _preload(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser("preload", help="preload from a measured friction torque")
    add_options(parser, PRELOAD_POINT)
    _screw_options(parser)
    parser.set_defaults(run="preload.run_preload")


def _screw(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser(
        "screw", help="loads, pressure, stiffness, preload release, life and efficiency of a screw"
    )
    add_options(parser, SCREW_POINT)
    for option, metavar in (("--speed-rpm", "RPM"), ("--temperature-c", "C")):
        parser.add_argument(
            option, type=float, metavar=metavar, help="both: efficiency and hours too, from the map"
        )
    _screw_options(parser)
    parser.set_defaults(run="screw.run_screw")


def _catalogue(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser(
        "catalogue", help="drag torque as catalogues state it (JIS B 1192), load ratings"
    )
    parser.add_argument(
        "--preload-n", type=float, metavar="N", help="preload of the nut; default: 5 %% of the dynamic rating"
    )
    _screw_options(parser, with_map=False)
    add_json(parser)
    parser.set_defaults(run="screw.run_catalogue")


def _map(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser("map", help="build, check, describe or draw a map")
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    build = actions.add_parser("build", help="solve the contacts and write the map of a screw")
    build.add_argument("--output", metavar="FILE", help="where to write the map")
    for name, unit in (("preload-n", "N"), ("speed-rpm", "r/min"), ("temperature-c", "degrees Celsius")):
        build.add_argument(
            f"--{name}", type=float, nargs=2, metavar=("LO", "HI"),
            help=f"range in {unit}; default: table [map] of the screw file, else what the screw and its oil allow",
        )  # fmt: skip
    build.add_argument("--quick", action="store_true", help="few contacts, for a first look at a screw")
    build.add_argument(
        "--tolerance",
        type=float,
        metavar="E",
        help="mean error of a film when its contact is left out, at which no more contacts are solved; default: 0.0015",
    )
    build.add_argument("--workers", type=int, metavar="N", help="processes; default: one per core")
    build.add_argument(
        "--dask", metavar="ADDRESS", help="solve on a Dask cluster: tcp://HOST:PORT of its scheduler"
    )
    build.add_argument(
        "--family",
        metavar="FOLDER",
        help="a map for every screw file *.toml there; --output: folder of the maps",
    )
    atlas = actions.add_parser("atlas", help="solve the contacts of the atlas that maps begin with")
    atlas.add_argument("--output", required=True, metavar="FILE.npz", help="where to write it")
    atlas.add_argument(
        "--count", type=int, default=1000, metavar="N", help="random contacts that it is compared with"
    )
    atlas.add_argument("--workers", type=int, metavar="N", help="processes; default: one per core")
    atlas.add_argument(
        "--dask", metavar="ADDRESS", help="solve on a Dask cluster: tcp://HOST:PORT of its scheduler"
    )
    add_json(atlas)
    atlas.set_defaults(run="atlas.run_map_atlas")
    check = actions.add_parser("check", help="load a map, verify its hash and compare it with direct solves")
    info = actions.add_parser("info", help="axes, parameters, version and certificate of a map")
    plot = actions.add_parser(
        "plot", help="draw torque, film, temperature rise, samples and certificate of a map"
    )
    plot.add_argument("--output", required=True, metavar="FILE.png", help="where to write the picture")
    plot.add_argument(
        "--error",
        choices=CERTIFIED,
        default=CERTIFIED[0],
        help="error that colours the points of the certificate (default %(default)s)",
    )
    for action in (build, check):
        text = "random operating points to compare with direct solves (default "
        text += f"{POINTS}, with --quick {QUICK_POINTS})" if action is build else "%(default)s)"
        action.add_argument(
            "--count", type=int, default=None if action is build else 4, metavar="N", help=text
        )
    for action in (check, info, plot):
        action.add_argument("file", nargs="?", metavar="FILE", help="map file; default: the packaged map")
    for action, name in ((build, "build"), (check, "check"), (info, "info"), (plot, "plot")):
        _screw_options(action, with_map=False)
        add_json(action)
        action.set_defaults(run=f"{'map_info' if action is info else 'map'}.run_map_{name}")


def _calibrate(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser(
        "calibrate",
        help="fit the friction parameters to measured torques",
        description="Fit the friction parameters to measured torques. Headings of the file name the units, for example "
        "preload [N], speed [r/min], temperature [degC], torque [N.m], or preload_n, speed_rpm, ...; optional: "
        "temperature, axial_load, torque_uncertainty or weight, table, comment. Prints errors, errors of left-out "
        "points, 95 % intervals, correlations, outliers and what the data do not identify.",
    )
    parser.add_argument("measurements", nargs="?", metavar="MEASUREMENTS.csv", help="measured torques")
    parser.add_argument(
        "--packaged", action="store_true", help="refit the packaged sets to the paper's tables"
    )
    parser.add_argument(
        "--output",
        metavar="FILE.toml",
        help="where to write the sets, for build_fmu.py --friction (--packaged: data of the package)",
    )
    parser.add_argument("--plot", metavar="FILE.png", help="draw computed over measured torque")
    parser.add_argument(
        "--set",
        choices=SET_NAMES,
        help="parameters to fit: mechanistic with kinematics rolling_frame, the others with published; default: as in "
        "the screw file, --packaged: all",
    )
    parser.add_argument(
        "--loss", choices=LOSS_NAMES, help="default: least_squares; --packaged: that of the set"
    )
    parser.add_argument(
        "--temperature-c",
        metavar="C",
        help="oil temperature of rows without one; default: reference of the oil",
    )
    parser.add_argument(
        "--drop",
        action="append",
        choices=DROP_KINDS,
        default=[],
        help="leave out impossible rows, rows outside the map, outliers (may be repeated); dropped rows are listed",
    )
    _screw_options(parser, with_map=False)
    parser.add_argument(
        "--map", metavar="FILE", help="take the films from this map of the screw; default: solve every point"
    )
    add_json(parser)
    parser.set_defaults(run="calibrate.run_calibrate")


def _validate(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser(
        "validate", help="compare the model with measured torques and published models"
    )
    parser.add_argument(
        "--contacts",
        action="store_true",
        help="solve instead the contact of section 5.1 of the paper with both kinematics; shows the printed values",
    )
    parser.add_argument(
        "--plot",
        metavar="FILE.png",
        help="draw which part of the mechanistic law carries what share of the torque",
    )
    _screw_options(parser)
    add_json(parser)
    parser.set_defaults(run="validate.run_validate")


def _init(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser("init", help="write a commented screw file to fill in")
    parser.add_argument("file", metavar="FILE.toml", help="a new file")
    parser.add_argument(
        "--oil",
        choices=OILS,
        default=OILS[0],
        help="how the oil is given: by two viscosities or by ISO grade and viscosity index (default %(default)s)",
    )
    parser.add_argument(
        "--lubricant",
        choices=LUBRICANTS,
        default=LUBRICANTS[0],
        help="grease: base oil by grade, NLGI grade and the replenishment of a grease (default %(default)s)",
    )
    add_json(parser)
    parser.set_defaults(run="init.run_init")


def _report(commands: argparse._SubParsersAction) -> None:
    parser = commands.add_parser(
        "report",
        help="one HTML page: the screw, torques with intervals, films, a contact, the map; without --screw the paper",
        description="Write one HTML page without external files: with --screw about that screw, its oil and its map, "
        "without it about the measured screw of the paper. Solves the contacts of one ball (some seconds).",
    )
    parser.add_argument("--output", required=True, metavar="FILE.html", help="where to write the page")
    for quantity, default in (
        (PRELOAD, "5 %% of the dynamic rating"),
        (SPEED, "1000"),
        (TEMPERATURE, "reference of the oil"),
    ):
        parser.add_argument(
            quantity.option, metavar=quantity.name.rsplit("_", 1)[-1].upper(),
            help=f"with --screw: {quantity.help} of the page; default: {default}",
        )  # fmt: skip
    _screw_options(parser)
    add_json(parser)
    parser.set_defaults(run="report.run_report")


def build_parser() -> Parser:
    """The whole command line."""
    parser = Parser(prog="ballscrew_tehl", description="Friction torque of preloaded ball screws.")
    parser.add_argument("--version", action="version", version=f"ballscrew_tehl {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=Parser)
    for add in (
        add_contact,
        _torque,
        _preload,
        _screw,
        _catalogue,
        _map,
        _calibrate,
        _validate,
        _report,
        _init,
        add_oil,
    ):
        add(commands)
    return parser


def _unshielded(text: str) -> str:
    """An argument as it was typed, before _shield_negative_numbers."""
    return text.removeprefix(" ") if text.startswith(" -") else text


def _shield_negative_numbers(arguments: Sequence[str]) -> list[str]:
    """A space before every negative number: argparse reads -1e3 and -inf as options, but " -1e3" as a value."""
    shielded: list[str] = []
    for argument in arguments:
        try:
            # NaN included: it is rejected later by name
            negative = argument.startswith("-") and isinstance(float(argument), float)
        except ValueError:
            negative = False
        shielded.append(f" {argument}" if negative else argument)
    return shielded


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters   arguments : without the program's name; None = those of the process
    Returns      exit code, see the top of this file
    """
    # the solver's matrices are small: BLAS threads would cost more than they save (read when numpy is imported)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    args = build_parser().parse_args(
        _shield_negative_numbers(sys.argv[1:] if arguments is None else arguments)
    )
    module, function = args.run.split(".")
    try:
        return int(getattr(importlib.import_module(f".{module}", __package__), function)(args))
    except ModuleNotFoundError as err:
        remedy = missing_extra(err)
        if remedy is None:
            raise
        print(f"ballscrew_tehl {args.command}: error: {remedy}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        kept = "; the same command again continues it" if args.run == "map.run_map_build" else ""
        print(f"ballscrew_tehl {args.command}: interrupted{kept}", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # the reader of a pipe (head, less) has exited: no error message, also not from the interpreter's own flush
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (ValueError, OSError) as err:
        text = os_error_text(err) if isinstance(err, OSError) else str(err)
        print(f"ballscrew_tehl {args.command}: error: {' '.join(text.split())}", file=sys.stderr)
        return 2
    except MemoryError as err:
        text = " ".join(str(err).split()) or "no number given"
        print(
            f"ballscrew_tehl {args.command}: error: not enough memory ({text}): fewer nodes or a smaller domain",
            file=sys.stderr,
        )
        return 2
    except ArithmeticError as err:
        print(f"ballscrew_tehl {args.command}: not converged: {' '.join(str(err).split())}", file=sys.stderr)
        return 1
