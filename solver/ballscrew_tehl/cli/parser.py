"""Commands and their options, as a table; a parser with one line per error and a page of help with an example first.

Names of choices are repeated here, so that building the parser imports none of the modules that define them; a test
compares both.
"""

import argparse
import difflib
import functools
import itertools
import re
import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, NoReturn

from .._version import __version__
from .shared.quantities import (
    CALIBRATION_POINT,
    CURRENT_UNIT,
    IDENTIFY_OPTIONS,
    LEAD,
    PRELOAD,
    PRELOAD_POINT,
    RATIO,
    REPORT_POINT,
    SCREW_POINT,
    SPEED,
    TEMPERATURE,
    TORQUE_CONSTANT,
    TORQUE_POINT,
    Quantity,
)

KINEMATICS = ("published", "rolling_frame")
SET_NAMES = ("two_parameter", "three_parameter", "mechanistic")
DROP_KINDS = ("impossible", "outside", "outliers")
OILS = ("viscosities", "iso_vg")
LUBRICANTS = ("oil", "grease")
EXPORT_FORMATS = ("twincat", "csv", "modelica", "matlab", "json")
LAWS = ("barus", "roelands")
#: points of a check
CHECK_POINTS = 4

#: package of the commands
RUN = f"{__package__}.commands"
#: flag or name of an argument, settings of argparse
Option = tuple[str, dict[str, Any]]
Metavar = str | tuple[str, ...] | None


class Command(NamedTuple):
    """A command, or the commands below it.

    help: one line;  run: package.module:function;  options: its own, shared: those of several commands
    example: what follows the name of the command;  interrupted: what is said after Ctrl-C
    groups: headings over names of actions
    """

    help: str
    run: str = ""
    options: Sequence[Option] = ()
    shared: Sequence[Option] = ()
    example: str = ""
    description: str = ""
    actions: Mapping[str, "Command"] = {}
    groups: Mapping[str, Sequence[str]] = {}
    interrupted: str = ""


def option(flag: str, text: str, metavar: Metavar = None, **settings: Any) -> Option:
    """An option of the table."""
    return flag, {"help": text} | ({} if metavar is None else {"metavar": metavar}) | settings


def switch(flag: str, text: str) -> Option:
    """An option without a value."""
    return option(flag, text, action="store_true")


def _of(quantities: Sequence[Quantity], **settings: Any) -> list[Option]:
    """An option for each quantity."""
    return [option(one.option, one.help, one.metavar, **settings) for one in quantities]


# fmt: off
HELP = option("-h --help", "show this page; --version shows the version", action="help")
VERSION = option("--version", argparse.SUPPRESS, action="version", version=f"ballscrew-tehl {__version__}")
JSON = switch("--json", "JSON on stdout, logs on stderr")
SCREW = option("--screw", "screw file; default: that in the map, or the packaged GD4008-3", "FILE.toml")
SCREW_ALONE = option("--screw", "screw file; default: the packaged GD4008-3", "FILE.toml")
KINEMATIC = option("--kinematics", "published or rolling_frame: speeds and law; default: by the screw", "LAW",
                   choices=KINEMATICS)
MAP_FILE = option("--map", "map file, which holds its screw; default: packaged or made in memory", "FILE.npz")
FRICTION = option("--friction", "two_parameter, three_parameter, mechanistic, or a file of calibrate", "NAME|FILE")
INPUTS = (SCREW, MAP_FILE, FRICTION, KINEMATIC)
OF_SCREW, OF_MAP = (SCREW, KINEMATIC, JSON), (*INPUTS, JSON)
OUTPUT = "file to write"
ROWS = (
    option("--points", "many points: rows with columns such as preload_n or preload [kN]", "FILE.csv"),
    option("--output", "the answers with all columns, in place of a table", "FILE.csv"),
)
# without a default, which would take the place of --map
GIVEN_MAP = (option("map", "map file, also as --map; default: the packaged map", "FILE.npz", nargs="?",
                    default=argparse.SUPPRESS), option("--map", argparse.SUPPRESS))
PLOT = option("--plot", "draw the result", "FILE.png")

MAP_ACTIONS = {
    "build": Command("sum the contacts of the atlas over a nut, write the map", f"{RUN}.map_build:run_map_build", (
        option("--output", OUTPUT, "FILE.npz"),
        *(option(f"--{name}", f"range of the map [{unit}]", ("LO", "HI"), type=float, nargs=2)
          for name, unit in (("preload-n", "N"), ("speed-rpm", "r/min"), ("temperature-c", "C"))),
        option("--family", "a map for every *.toml in this folder; --output: folder", "FOLDER"),
    ), (SCREW_ALONE, KINEMATIC, JSON), "--screw my.toml --output my_map.npz",
        "Ranges: by these options, else table [map] of the screw file, else what the screw and its oil allow. The map "
        "holds its screw and oil, and the errors of the atlas against direct solves. No command needs the file: with "
        "--screw alone they make the map in memory."),
    "check": Command("compare a map with direct solves", f"{RUN}.map_file:run_map_check",
                     (*GIVEN_MAP, option("--count", f"points compared with direct solves (+5 %% at low speed); "
                                         f"default: {CHECK_POINTS}", "N", type=int, default=CHECK_POINTS),
                      option("--workers", "processes; default: one per core", "N", type=int)), OF_SCREW, "my_map.npz"),
    "info": Command("axes, parameters, version and certificate of a map", f"{RUN}.map_file:run_map_info",
                    GIVEN_MAP, OF_SCREW, "my_map.npz"),
}
CONTACT = {
    "contact": Command("solve one elastohydrodynamic contact", f"{RUN}.contact:run_contact", (
        option("--load-n", "load [N]", "N"),
        option("--radius-x-m", "reduced radius along rolling [m]", "M"),
        option("--radius-y-m", "reduced radius across rolling [m], not below the other", "M"),
        option("--u1-m-s", "speed of surface 1 [m/s]", "S"),
        option("--u2-m-s", "speed of surface 2 [m/s]", "S"),
        option("--temperature-k", "temperature of oil and bodies [K]", "K"),
        switch("--isothermal", "without the energy equation"),
        option("--moes", "Moes load and lubricant number", ("M", "L"), nargs=2),
        option("--radius-ratio", "0 < R_x/R_y <= 1", "R_X/R_Y"),
        option("--law", "barus (incompressible) or roelands (compressible)", choices=LAWS),
        option("--domain", "along and across rolling [Hertz half-widths]", ("XA", "XB", "Y"), nargs=3),
        option("--refine", "truth check: nodes, layers and domain times K, 1 to 8", "K"),
    ), (*ROWS, SCREW_ALONE, JSON), "--moes 20 5 --radius-ratio 1 --law barus",
        "By its dimensions, thermal unless --isothermal, with oil and steel of --screw; or by its Moes numbers: "
        "--moes, --radius-ratio, --law. The default domain is wide enough not to starve."),
}
COMMANDS = {
    "init": Command("write a commented screw file to fill in", f"{RUN}.screw:run_init", (
        option("file", "a new file", "FILE.toml"),
        option("--oil", "oil by two viscosities, or by ISO grade and viscosity index", choices=OILS, default=OILS[0]),
        option("--lubricant", "grease: base oil by grade, NLGI grade", choices=LUBRICANTS, default=LUBRICANTS[0]),
        *(option(f"--{name}", text, metavar, type=kind) for name, text, metavar, kind in (
            ("diameter-mm", "nominal diameter of the catalogue", "D", float), ("lead-mm", "lead", "P", float),
            ("ball-mm", "ball diameter", "D", float), ("turns", "loaded turns of one nut", "N", float),
            ("starts", "starts of the thread", "N", int))),
    ), (JSON,), "my.toml --diameter-mm 32 --lead-mm 10",
        "With diameter and lead a file of that screw, in which what is not given is marked as assumed."),
    "screw": Command("loads, pressure, stiffness, life, efficiency, catalogue torque",
                     f"{RUN}.screw:run_screw",
                     (*_of(SCREW_POINT), *_of((SPEED, TEMPERATURE), type=float)), (*ROWS, *OF_MAP),
                     "--screw my.toml --preload-n 1000 --axial-load-n 1500",
                     "Default of the preload: 5 % of the dynamic rating. With speed and temperature also efficiency "
                     "and hours, from the map. Catalogue torque: drag torque by JIS B 1192."),
    "oil": Command("viscosity, density and pressure-viscosity coefficient of an oil", f"{RUN}.oil:run_oil", (
        option("--iso-vg", "ISO 3448 viscosity grade", "GRADE", type=int),
        option("--viscosity-index", "viscosity index (ASTM D2270)", "VI", type=float),
        option("--density-15c-kg-m3", "density at 15 C; default: a paraffinic oil", "RHO", type=float),
    ), (option("--screw", "screw file, whose oil is described", "FILE.toml"), JSON), "--iso-vg 68 --viscosity-index 95",
        "A mineral oil by its grade, or the oil of a screw file, at 20 to 100 C, with assumptions and their errors."),
    "map": Command("build, check or describe a map", actions=MAP_ACTIONS),
    "torque": Command("friction torque with its parts, films and interval", f"{RUN}.torque:run_torque", (
        *_of(TORQUE_POINT), switch("--direct", "solve the contacts instead of reading the map"),
    ), (*ROWS, *OF_MAP), "--preload-n 2000 --speed-rpm 1000 --temperature-c 30 --map my_map.npz"),
    "preload": Command("preload behind a measured friction torque", f"{RUN}.preload:run_preload", _of(PRELOAD_POINT),
                       (*ROWS, *OF_MAP), "--torque-nm 0.8 --speed-rpm 100 --temperature-c 30 --map my_map.npz"),
    "identify": Command("inertia, offset, friction and preload from a log of a drive",
                        f"{RUN}.identify:run_identify", (
        option("log", "log of an axis that moves both ways", "LOG.csv"),
        option("--column", "a column by heading: \"current=Iq_act [A]\" (repeat it)", "NAME=HEADING",
               action="append", default=[]),
        *_of((*IDENTIFY_OPTIONS, TEMPERATURE)),
        option("--without-nut", "log of the same axis without the nut, which is subtracted", "LOG.csv"),
        option("--before", "earlier log of the same axis: change of the preload", "LOG.csv"),
        PLOT,
        option("--measurements", "write points for calibrate, with their standard errors", "FILE.csv"),
        option("--output", "write what --json prints, for export --identified", "FILE.json"),
    ), OF_MAP, "log.csv --torque-constant-nm-a 0.8 --map my_map.npz",
        "Columns with units: time [s], position [mm] or speed [r/min], current [A], torque [N.m], force [N] or "
        "voltage [V]."),
    "calibrate": Command("fit the friction parameters to measured torques", f"{RUN}.calibrate:run_calibrate", (
        option("measurements", "measured torques", "MEASUREMENTS.csv", nargs="?"),
        *_of(CALIBRATION_POINT),
        option("--output", "where to write the sets, for --friction", "FILE.toml"),
        PLOT,
        option("--set", "parameters to fit; default: as in the screw file", choices=SET_NAMES),
        option("--drop", "rows to leave out (repeat it for several)", choices=DROP_KINDS, action="append", default=[]),
    ), (SCREW, MAP_FILE, KINEMATIC, JSON), "measurements.csv --map my_map.npz --output friction.toml",
        "Columns by headings with units: preload [N], speed [r/min], temperature [degC], torque [N.m]; optional "
        "axial_load, torque_uncertainty or weight, table, comment. Or one torque, measured or of a catalogue: the four "
        "options of a point. Prints errors, 95 % intervals, outliers and what the data do not identify."),
    "export": Command("friction of a map or a log as a table for a controller or a tool",
                      f"{RUN}.export:run_export", (
        option("--format", "twincat: list frict_comp; modelica: CombiTable1Ds", choices=EXPORT_FORMATS,
                required=True),
        option("--output", OUTPUT + "; of several lists the stem of their names", "PATH", required=True),
        *_of((PRELOAD, TEMPERATURE), nargs="+"),
        option("--identified", "not of a map: of the whole axis, by identify --output", "FILE.json"),
        option("--speed-rpm", "range of the screw's speed; default: of map or log", ("LO", "HI"), nargs=2),
        *_of((LEAD, TORQUE_CONSTANT, RATIO, CURRENT_UNIT)),
        option("--points", "most entries of a list (20), speeds of a table (40)", "N", type=int),
    ), OF_MAP, "--map my_map.npz --format csv --output friction.csv",
        "Torque over speed, preload and temperature with its interval; units and signs are in the file. Defaults: 5 % "
        "of the dynamic rating, reference temperature of the oil, whole range of speed. Options of motor and lead: of "
        "twincat, which is over the velocity of the axis. With --identified each direction by itself, in a list the "
        "mean."),
    "report": Command("one HTML page on a screw: torque, film, loads, limits", f"{RUN}.report:run_report", (
        option("--output", OUTPUT, "FILE.html", required=True), *_of(REPORT_POINT),
    ), OF_MAP, "--map my_map.npz --output my_report.html",
        "One page without external files; without screw and map on the packaged GD4008-3. Default of the point: 5 % of "
        "the dynamic rating, 1000 r/min, reference temperature of the oil."),
    **CONTACT,
}
#: python -m ballscrew_tehl; catalogue is the old name of screw
SOLVER = Command("Friction torque of preloaded ball screws.", actions={
    **COMMANDS, "catalogue": COMMANDS["screw"],
})
# fmt: on


def _nearest(given: str, known: Iterable[str]) -> str:
    """End of a message about a misspelt word, empty if it is like none: a word that begins so, or the most similar."""
    words = list(known)
    begun = [word for word in words if len(given.strip("-")) > 1 and word.startswith(given)]
    # without dashes, which would make any two options alike
    bare = {word.strip("-"): word for word in words}
    near = begun or [
        bare[word] for word in difflib.get_close_matches(given.strip("-"), bare, n=1, cutoff=0.6)
    ]
    return f"; is {near[0]} meant?" if near else ""


class Parser(argparse.ArgumentParser):
    """One line per error; no abbreviations, which a later option could make ambiguous."""

    def __init__(self, **settings: Any) -> None:
        page = functools.partial(argparse.RawDescriptionHelpFormatter, max_help_position=30)
        super().__init__(allow_abbrev=False, add_help=False, formatter_class=page, **settings)
        #: names of commands by the command that they are below
        self.below: dict[str, list[str]] = {}
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
            flag = word.partition("=")[0]
            if flag.startswith("--") and flag not in known:
                hint = "" if self._subparsers is None else "; options stand behind COMMAND"
                self.error(f"unrecognized arguments: {flag}{_nearest(flag, known) or hint}")
        parsed, left = super().parse_known_args(args, namespace)
        if left:
            self.error(f"unrecognized arguments: {' '.join(left)}")
        return parsed, left

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            known = [str(choice) for choice in action.choices or ()]
            moved = [f"{name} {value}" for name, below in self.below.items() if value in below]
            error.message += f"; is {moved[0]} meant?" if moved else _nearest(str(value), known)
            raise

    def error(self, message: str) -> NoReturn:
        """Print the error and exit with code 2."""
        for kind, allowed in (("float", "a number"), ("int", "a whole number")):
            message = message.replace(f"invalid {kind} value", f"allowed: {allowed}, not")
        self.exit(2, f"{self.prog}: error: {message} (see --help)\n")


def build_parser(prog: str, command: Command) -> Parser:
    """The whole command line of a face, or of one command.

    Parameters   prog : name of the program in help and messages
    """
    return _filled(Parser(**_page(prog, command)), command)


def _page(prog: str, command: Command) -> dict[str, Any]:
    """Name, usage and head of the page of help: an example first."""
    needed = ["COMMAND"] if command.actions else []
    for flag, settings in command.options:
        word = settings.get("metavar", flag.strip("-").upper())
        if not flag.startswith("-"):
            needed.append(f"[{word}]" if settings.get("nargs") == "?" else word)
        elif settings.get("required"):
            needed.append(f"{flag} {word}")
    lines = [f"  {prog} {command.example}\n"] if command.example else []
    about = f"{command.help[:1].upper()}{command.help[1:].rstrip('.')}.", command.description
    lines.append(" ".join(about) if not command.actions else about[0] + "\n")
    if command.actions:
        for title, names in (command.groups or {"commands": list(command.actions)}).items():
            lines += [f"{title}:", *(f"  {name:<10}  {command.actions[name].help}" for name in names)]
        lines.append(f"\n{about[1]}")
    # lines that begin with a space as they are, others filled as argparse does it
    width = shutil.get_terminal_size().columns - 2
    text = "\n".join(
        line if line[:1] in ("", " ") else textwrap.fill(line, width) for line in "\n".join(lines).split("\n")
    )
    return {"prog": prog, "usage": " ".join([prog, *needed, "[options]"]), "description": text}


def _filled(parser: Parser, command: Command) -> Parser:
    """A parser with the options of a command and the parsers of those below it."""
    parser.set_defaults(run=command.run, prog=parser.prog, interrupted=command.interrupted)
    for title, options in {
        "options": command.options,
        "common options": (*command.shared, HELP, VERSION),
    }.items():
        group = parser.add_argument_group(title)
        for flag, settings in options:
            group.add_argument(*flag.split(), **settings)
    if command.actions:
        # listed by the head of the page
        below = parser.add_subparsers(
            dest="command", required=True, metavar="COMMAND", parser_class=Parser, help=argparse.SUPPRESS
        )
        for name, action in command.actions.items():
            parser.below[name] = list(action.actions)
            _filled(
                below.add_parser(name, help=action.help, **_page(f"{parser.prog} {name}", action)), action
            )
    return parser
