"""Commands and their options, as a table; a parser with one line per error.

Names of choices are repeated here, so that building the parser imports none of the modules that define them; a test
compares both.
"""

from __future__ import annotations

import argparse
import difflib
import itertools
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, NoReturn

from .. import __version__
from .shared.quantities import (
    CALIBRATION_POINT,
    CURRENT_UNIT,
    IDENTIFY_OPTIONS,
    PRELOAD_POINT,
    RATIO,
    REPORT_POINT,
    SCREW_POINT,
    TORQUE_CONSTANT,
    TORQUE_POINT,
    Quantity,
)

KINEMATICS = ("published", "rolling_frame")
SET_NAMES = ("two_parameter", "three_parameter", "mechanistic")
CERTIFIED = ("torque", "film", "temperature_rise")
DROP_KINDS = ("impossible", "outside", "outliers")
OILS = ("viscosities", "iso_vg")
LUBRICANTS = ("oil", "grease")
LOSS_NAMES = ("least_squares", "soft_l1")
EXPORT_FORMATS = ("twincat", "csv", "modelica", "matlab", "json")
RHEOLOGIES = ("newtonian", "eyring", "carreau", "limiting_shear_stress")
LAWS = ("barus", "roelands")
#: points of a certificate: of a build, of a check
POINTS, CHECK_POINTS = 48, 4

#: flag or name of an argument, settings of argparse
Option = tuple[str, dict[str, Any]]
Metavar = str | tuple[str, ...] | None


class Command(NamedTuple):
    """Help, module and function below `commands`, options; or the commands below it."""

    help: str
    run: str = ""
    options: Sequence[Option] = ()
    description: str = ""
    actions: Mapping[str, Command] = {}


def _option(flag: str, text: str, metavar: Metavar = None, **settings: Any) -> Option:
    return flag, {"help": text} | ({} if metavar is None else {"metavar": metavar}) | settings


def _switch(flag: str, text: str) -> Option:
    return _option(flag, text, action="store_true")


def _choice(flag: str, names: Sequence[str], text: str, **settings: Any) -> Option:
    return _option(flag, text, choices=names, **settings)


def _numbers(flag: str, text: str, metavar: Metavar = "N", kind: Any = float, **settings: Any) -> Option:
    return _option(flag, text, metavar, type=kind, **settings)


def _point(quantities: Sequence[Quantity]) -> list[Option]:
    """One option per quantity, and --points."""
    options = []
    for quantity in quantities:
        note = "" if quantity.default is None else f" (default {quantity.default:g})"
        options.append(
            _option(quantity.option, f"{quantity.help}; {quantity.allowed}{note}", quantity.metavar)
        )
    names = ", ".join(quantity.name for quantity in quantities)
    text = f"many points: columns {names}; an option applies to every row without that column"
    return [*options, _option("--points", text, "FILE.csv")]


# fmt: off
JSON = _switch("--json", "JSON on stdout (a list with --points), logs on stderr")
SCREW = _option("--screw", "screw file; default: the packaged GD4008-3", "FILE.toml")
KINEMATIC = _choice("--kinematics", KINEMATICS, "surface speeds and friction law; default: as in the screw file")
OF_SCREW = (SCREW, KINEMATIC, JSON)
OF_MAP = (
    *OF_SCREW, _option("--map", "map file; default: the packaged map", "FILE"),
    _option("--friction", "two_parameter, three_parameter, mechanistic, or a file that calibrate --output has written; "
            "default: as in the screw file. mechanistic without --screw takes the GD4008-3 with an oil ISO VG 100",
            "NAME|FILE"),
)
MAP_FILE = _option("file", "map file; default: the packaged map", "FILE", nargs="?")
WORKERS = (
    _numbers("--workers", "processes; default: one per core", kind=int),
    _option("--dask", "solve on a Dask cluster: tcp://HOST:PORT of its scheduler", "ADDRESS"),
)
COUNT = "operating points to compare with direct solves (default "
MAP_ACTIONS = {
    "build": Command("solve the contacts and write the map of a screw", "map_build.run_map_build", (
        _option("--output", "where to write the map", "FILE"),
        *(_numbers(f"--{name}", f"range in {unit}; default: table [map] of the screw file, else what the screw and its "
                   "oil allow", ("LO", "HI"), nargs=2)
          for name, unit in (("preload-n", "N"), ("speed-rpm", "r/min"), ("temperature-c", "degrees Celsius"))),
        _numbers("--tolerance", "mean error of a film when its contact is left out, at which no more contacts are "
                 "solved; default: 0.0015", "E"),
        *WORKERS,
        _option("--family", "a map for every screw file *.toml there; --output: folder of the maps", "FOLDER"),
        _numbers("--count", f"{COUNT}%(default)s)", kind=int, default=POINTS),
        *OF_SCREW,
    )),
    "atlas": Command("solve the contacts of the atlas that maps begin with", "map_build.run_map_atlas", (
        _option("--output", "where to write it", "FILE.npz", required=True),
        _numbers("--count", "random contacts that it is compared with", kind=int, default=1000),
        *WORKERS, JSON,
    )),
    "check": Command("load a map, verify its hash and compare it with direct solves", "map_file.run_map_check", (
        MAP_FILE, _numbers("--count", f"{COUNT}%(default)s)", kind=int, default=CHECK_POINTS), *OF_SCREW,
    )),
    "info": Command("axes, parameters, version and certificate of a map", "map_file.run_map_info",
                    (MAP_FILE, *OF_SCREW)),
    "plot": Command("draw torque, film, temperature rise, samples and certificate of a map", "map_file.run_map_plot", (
        MAP_FILE,
        _option("--output", "where to write the picture", "FILE.png", required=True),
        _choice("--error", CERTIFIED, "error that colours the points of the certificate (default %(default)s)",
                default=CERTIFIED[0]),
        *OF_SCREW,
    )),
}
COMMANDS = {
    "contact": Command("solve one elastohydrodynamic contact", "contact.run_contact", (
        _option("--load-n", "load [N]", "N"),
        _option("--radius-x-m", "reduced radius along rolling [m]", "M"),
        _option("--radius-y-m", "reduced radius across rolling [m], not below the other", "M"),
        _option("--u1-m-s", "speed of surface 1 [m/s]", "S"),
        _option("--u2-m-s", "speed of surface 2 [m/s]", "S"),
        _option("--temperature-k", "temperature of oil and bodies [K]", "K"),
        _option("--screw", "oil, solid and modulus; default: the packaged GD4008-3", "FILE.toml"),
        _choice("--rheology", RHEOLOGIES, "default: that of the oil, newtonian in the packaged one"),
        _switch("--isothermal", "without the energy equation"),
        _option("--moes", "Moes load and lubricant number", ("M", "L"), nargs=2),
        _option("--radius-ratio", "0 < R_x/R_y <= 1", "R_X/R_Y"),
        _choice("--law", LAWS, "barus (incompressible) or roelands (compressible)"),
        _option("--domain", "domain in Hertz half-widths, along rolling and across; default: wide enough not to starve",
                ("XA", "XB", "Y"), nargs=3),
        _option("--refine", "truth check: nodes, lines and layers, extent of film and energy domain times K, 1 to 8",
                "K"),
        _option("--points", "many contacts: columns named like the options, load_n, moes (two numbers), ...",
                "FILE.csv"),
        JSON,
    ), "Solve one contact: by its dimensions (thermal unless --isothermal), or by its Moes numbers (isothermal; "
       "--moes, --radius-ratio, --law)."),
    "torque": Command("friction torque of the nut at an operating point", "torque.run_torque", (
        *_point(TORQUE_POINT), _switch("--direct", "solve the contacts instead of reading the map"), *OF_MAP,
    )),
    "preload": Command("preload from a measured friction torque", "preload.run_preload",
                       (*_point(PRELOAD_POINT), *OF_MAP)),
    "screw": Command("loads, pressure, stiffness, preload release, life and efficiency of a screw", "screw.run_screw", (
        *_point(SCREW_POINT),
        _numbers("--speed-rpm", "both: efficiency and hours too, from the map", "RPM"),
        _numbers("--temperature-c", "both: efficiency and hours too, from the map", "C"),
        *OF_MAP,
    )),
    "catalogue": Command("drag torque as catalogues state it (JIS B 1192), load ratings", "screw.run_catalogue", (
        _numbers("--preload-n", "preload of the nut; default: 5 %% of the dynamic rating"), *OF_SCREW,
    )),
    "map": Command("build, check, describe or draw a map", actions=MAP_ACTIONS),
    "calibrate": Command("fit the friction parameters to measured torques", "calibrate.run_calibrate", (
        _option("measurements", "measured torques", "MEASUREMENTS.csv", nargs="?"),
        *(_option(quantity.option, f"instead of a file, one point: {quantity.help}", quantity.metavar)
          for quantity in CALIBRATION_POINT[:3]),
        _switch("--packaged", "refit the packaged sets to the paper's tables"),
        _option("--output", "where to write the sets, for build_fmu.py --friction (--packaged: data of the package)",
                "FILE.toml"),
        _option("--plot", "draw computed over measured torque", "FILE.png"),
        _choice("--set", SET_NAMES, "parameters to fit: mechanistic with kinematics rolling_frame, the others with "
                "published; default: as in the screw file, --packaged: all"),
        _choice("--loss", LOSS_NAMES, "default: least_squares; --packaged: that of the set"),
        _option("--temperature-c", "oil temperature of the one point, or of rows without one; default: reference "
                "of the oil", "C"),
        _choice("--drop", DROP_KINDS, "leave out impossible rows, rows outside the map, outliers (may be repeated); "
                "dropped rows are listed", action="append", default=[]),
        _option("--map", "take the films from this map of the screw; default: solve every point", "FILE"),
        *OF_SCREW,
    ), "Fit the friction parameters to measured torques. Headings of the file name the units, for example "
       "preload [N], speed [r/min], temperature [degC], torque [N.m], or preload_n, speed_rpm, ...; optional: "
       "temperature, axial_load, torque_uncertainty or weight, table, comment. Prints errors, errors of left-out "
       "points, 95 % intervals, correlations, outliers and what the data do not identify. One torque, measured or of a "
       "catalogue (--torque-nm with --preload-n, --speed-rpm, --temperature-c), fits the number of mechanistic to it."),
    "identify": Command("inertia, offset, friction and preload from a log of a drive", "identify.run_identify", (
        _option("log", "log of an axis that moves both ways", "LOG.csv"),
        *(_option(quantity.option, quantity.help, quantity.metavar) for quantity in IDENTIFY_OPTIONS),
        _option("--temperature-c", "oil temperature; default: column temperature of the log", "C"),
        _option("--without-nut", "log of the same axis without the nut, whose friction is subtracted", "LOG.csv"),
        _option("--before", "earlier log of the same axis: change of the preload", "LOG.csv"),
        _option("--plot", "draw friction over speed and the residual over position", "FILE.png"),
        _option("--measurements", "write points for calibrate, with their standard errors", "FILE.csv"),
        _option("--output", "write what --json prints, for export --identified", "FILE.json"),
        *OF_MAP,
    ), "Least squares on the inverse dynamics of a log. Headings of the file name the units: time [s], position [mm], "
       "[rad], [deg] or speed [r/min], velocity [m/s]; current [A], torque [N.m], force [N] or voltage [V]; optional "
       "temperature [degC], preload [N]. Prints inertia or mass, offset and friction over speed in each direction with "
       "95 % intervals, and what was left out. With --screw and --map also the preload with its interval."),
    "export": Command("friction of a map or a log as a table for a controller or a tool", "export.run_export", (
        _choice("--format", EXPORT_FORMATS, "twincat: compensation list frict_comp of TwinCAT CNC and ISG kernels; "
                "modelica: text of a CombiTable1Ds; matlab: a function with its breakpoints", required=True),
        _option("--output", "where to write it; with several preloads or temperatures a list each, named by them",
                "PATH", required=True),
        _option("--preload-n", "preloads [N]; default: 5 %% of the dynamic rating", "N", nargs="+"),
        _option("--temperature-c", "oil temperatures; default: reference of the oil", "C", nargs="+"),
        _option("--identified", "instead of a map: friction of the whole axis, as identify --output has written it",
                "FILE.json"),
        _option("--speed-rpm", "range of the screw's speed; default: that of the map or log", ("LO", "HI"), nargs=2),
        _option("--lead-mm", "with --identified: lead of the screw [mm]; default: that of the log", "MM"),
        *(_option(quantity.option, f"twincat: {quantity.help}", quantity.metavar)
          for quantity in (TORQUE_CONSTANT, RATIO, CURRENT_UNIT)),
        _numbers("--points", "most entries of a list (default 20), speeds of a table (default 40)", kind=int),
        *OF_MAP,
    ), "Friction torque over speed, preload and temperature with its interval. Every file states units and signs. The "
       "entries of a compensation list have the least largest error. With --identified each direction by itself, in a "
       "compensation list their mean."),
    "validate": Command("compare the model with measured torques and published models", "validate.run_validate", (
        _switch("--contacts", "solve instead the contact of section 5.1 of the paper with both kinematics and a circle "
                "of a public multigrid; shows the published values"),
        _switch("--machines", "compare instead the mechanistic law with bearings, balls in open grooves and two ball "
                "screws of others (a minute)"),
        _option("--plot", "draw which part of the mechanistic law carries what share of the torque; with --machines "
                "law over measurements", "FILE.png"),
        *OF_MAP,
    )),
    "report": Command("one HTML page: the screw, torques with intervals, films, a contact, the map; without --screw "
                      "the paper", "report.run_report", (
        _option("--output", "where to write the page", "FILE.html", required=True),
        *(_option(quantity.option, f"with --screw: {quantity.help} of the page; default: {default}", quantity.metavar)
          for quantity, default in zip(
              REPORT_POINT, ("5 %% of the dynamic rating", "1000", "reference of the oil"), strict=True)),
        *OF_MAP,
    ), "Write one HTML page without external files: with --screw about that screw, its oil and its map, without it "
       "about the measured screw of the paper. Solves the contacts of one ball (some seconds)."),
    "init": Command("write a commented screw file to fill in", "screw.run_init", (
        _option("file", "a new file", "FILE.toml"),
        _choice("--oil", OILS, "how the oil is given: by two viscosities or by ISO grade and viscosity index (default "
                "%(default)s)", default=OILS[0]),
        _choice("--lubricant", LUBRICANTS, "grease: base oil by grade, NLGI grade (default %(default)s)",
                default=LUBRICANTS[0]),
        *(_numbers(f"--{name}", f"{text}", metavar, kind) for name, text, metavar, kind in (
            ("diameter-mm", "nominal diameter of the catalogue, with --lead-mm: a file of that screw, in which what "
             "is not given is marked as assumed", "D", float),
            ("lead-mm", "its lead", "P", float), ("ball-mm", "ball diameter", "D", float),
            ("turns", "loaded turns of one nut", "N", float), ("starts", "starts of the thread", "N", int))),
        JSON,
    )),
    "oil": Command("viscosity, density and pressure-viscosity coefficient of an oil", "oil.run_oil", (
        _numbers("--iso-vg", "ISO 3448 viscosity grade", "GRADE", int),
        _numbers("--viscosity-index", "viscosity index (ASTM D2270)", "VI"),
        _numbers("--density-15c-kg-m3", "density at 15 C; default: a paraffinic oil", "RHO"),
        _option("--screw", "the oil of this screw file instead", "FILE.toml"),
        JSON,
    ), "A mineral oil by its ISO grade and viscosity index, or the oil of a screw file, at 20 to 100 C, with "
       "assumptions and their errors."),
}
# fmt: on


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
        # argparse reads -1e3 and -inf as options; NaN included: it is rejected later by name
        self._negative_number_matcher = re.compile(r"-(\d|\.\d|inf|nan)", re.IGNORECASE)

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
        parsed, left = super().parse_known_args(args, namespace)
        if left:
            self.error(f"unrecognized arguments: {' '.join(left)}")
        return parsed, left

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            error.message += _nearest(str(value), [str(choice) for choice in action.choices or ()])
            raise

    def error(self, message: str) -> NoReturn:
        """Print the error and exit with code 2."""
        self.exit(2, f"{self.prog}: error: {message} (see --help)\n")


def build_parser() -> Parser:
    """The whole command line."""
    parser = Parser(prog="ballscrew_tehl", description="Friction torque of preloaded ball screws.")
    parser.add_argument("--version", action="version", version=f"ballscrew_tehl {__version__}")
    _add(
        parser.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=Parser), COMMANDS
    )
    return parser


def _add(commands: argparse._SubParsersAction, table: Mapping[str, Command]) -> None:
    for name, command in table.items():
        parser = commands.add_parser(name, help=command.help, description=command.description or None)
        for flag, settings in command.options:
            parser.add_argument(flag, **settings)
        if command.actions:
            _add(parser.add_subparsers(dest="action", required=True, metavar="ACTION"), command.actions)
        else:
            parser.set_defaults(run=command.run)
