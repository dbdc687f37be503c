"""Commands and their options, as a table; a parser with one line per error and a page of help with an example first.

Names of choices are repeated here, so that building the parser imports none of the modules that define them; a test
compares both.
"""

import argparse
import difflib
import functools
import re
import shutil
import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, NoReturn

from ballscrew_tehl._version import __version__

from .. import quantities as q
from ..quantities import Quantity, with_error

DROP_KINDS = ("impossible", "outside", "outliers")
NUT_KINDS = ("double_nut", "single_nut_offset", "single_nut_oversize_ball")
OILS, LUBRICANTS = ("viscosities", "iso_vg"), ("oil", "grease")
EXPORT_FORMATS = ("twincat", "csv", "modelica", "matlab", "json")
LAWS = ("barus", "roelands")
#: package of the commands
RUN = f"{__package__}.commands"
#: flag or name of an argument, settings of argparse
Option = tuple[str, dict[str, Any]]


class Command(NamedTuple):
    """A command, or the commands below it."""

    help: str  # one line
    run: str = ""  # package.module:function
    options: Sequence[Option] = ()  # its own
    shared: Sequence[Option] = ()  # those of several commands
    example: str = ""  # what follows the name of the command
    description: str = ""
    actions: Mapping[str, "Command"] = {}
    groups: Mapping[str, Sequence[str]] = {}  # headings over names of actions


def option(flag: str, text: str, metavar: str | tuple[str, ...] | None = None, **settings: Any) -> Option:
    """An option of the table."""
    return flag, {"help": text, "metavar": metavar, **settings}


def switch(flag: str, text: str, action: str = "store_true", **settings: Any) -> Option:
    """An option without a value."""
    return flag, {"help": text, "action": action, **settings}


def numbers(*quantities: Quantity, **settings: Any) -> list[Option]:
    """An option for each quantity, with its unit as metavar."""
    return [
        (one.option, {"help": one.help, "type": one, "metavar": one.name.split("_")[-1].upper()} | settings)
        for one in quantities
    ]


# fmt: off
HELP = switch("-h --help", "show this page; --version shows the version", "help")
VERSION = switch("--version", argparse.SUPPRESS, "version", version=f"ballscrew-tehl {__version__}")
JSON = switch("--json", "JSON on stdout, logs on stderr")
SCREW = option("--screw", "screw file; default: that in the map, or the packaged GD4008-3", "FILE.toml")
SCREW_ALONE = option("--screw", "screw file; default: the packaged GD4008-3", "FILE.toml")
MAP_FILE = option("--map", "map file, which holds its screw; default: packaged or made in memory", "FILE.npz")
FRICTION = option("--friction", "a file of calibrate, or the name of a packaged set", "NAME|FILE")
INPUTS = (SCREW, MAP_FILE, FRICTION, *numbers(q.TOLERANCE))
OF_SCREW, OF_MAP = (SCREW, JSON), (*INPUTS, JSON)
OUTPUT = "file to write"
ROWS = (
    option("--points", "many points: rows with columns such as preload_n or preload [kN]", "FILE.csv"),
    option("--output", "the answers with all columns, in place of a table", "FILE.csv"),
)
# without a default, which would take the place of --map
GIVEN_MAP = (option("map", "map file, also as --map; default: the packaged map", "FILE.npz", nargs="?",
                    default=argparse.SUPPRESS), option("--map", argparse.SUPPRESS))
RANGE: dict[str, Any] = {"nargs": 2, "metavar": ("LO", "HI")}
PLOT = option("--plot", "draw the result", "FILE.png")

MAP_ACTIONS = {
    "build": Command("sum the contacts of the atlas over a nut, write the map", f"{RUN}.map_file:run_map_build", (
        option("--output", OUTPUT, "FILE.npz"),
        *numbers(*(Quantity(name, f"range of the map [{unit}]") for name, unit in (
            ("preload_n", "N"), ("speed_rpm", "r/min"), ("temperature_c", "C"))), **RANGE),
        option("--family", "a map for every *.toml in this folder; --output: folder", "FOLDER"),
    ), (SCREW_ALONE, JSON), "--screw my.toml --output my_map.npz",
        "Ranges: by these options, else table [map] of the screw file, else what the screw and its oil allow. The map "
        "holds its screw and oil, and the errors of the atlas against direct solves. No command needs the file: with "
        "--screw alone they make the map in memory."),
    "check": Command("compare a map with direct solves", f"{RUN}.map_file:run_map_check", (
        *GIVEN_MAP,
        *numbers(Quantity("count", "points compared with direct solves (+5 %% at low speed); default: %(default)s", 1,
                          whole=True), metavar="N", default=4),
        *numbers(Quantity("workers", "processes; default: one per core", 1, whole=True), metavar="N"),
    ), OF_SCREW, "my_map.npz"),
    "info": Command("axes, parameters, version and certificate of a map", f"{RUN}.map_file:run_map_info",
                    GIVEN_MAP, OF_SCREW, "my_map.npz"),
}
COMMANDS = {
    "init": Command("write a commented screw file to fill in", f"{RUN}.screw:run_init", (
        option("file", "a new file", "FILE.toml"),
        option("--oil", "oil by two viscosities, or by ISO grade and viscosity index", choices=OILS, default=OILS[0]),
        option("--lubricant", "grease: base oil by grade, NLGI grade", choices=LUBRICANTS, default=LUBRICANTS[0]),
        *numbers(*(Quantity(name, text, 0.0, not_zero=True, whole=name in ("starts", "oil_grade"),
                            signed=name == "lead_mm") for name, text in (
            ("diameter_mm", "nominal diameter of the catalogue"), ("lead_mm", "lead; negative: left-hand"),
            ("diameter_in", "the diameter in inches"), ("lead_in", "the lead in inches"),
            ("root_mm", "root diameter"), ("circle_mm", "circle of the ball centres"), ("ball_mm", "ball diameter"),
            ("starts", "starts of the thread"), ("rating_n", "dynamic rating C_a of one nut [N]"),
            ("static_rating_n", "static rating C_0a [N]"), ("oil_grade", "ISO viscosity grade of the oil")))),
        *numbers(q.TURNS, type=q.turns, metavar="N"),
        option("--nut-kind", "how it is preloaded", choices=NUT_KINDS),
        option("--hand", "hand of the thread", choices=("right", "left")),
        switch("--axis", "with tables of bearings, guide, wipers, motor, as comments with example values"),
    ), (JSON,), "my.toml --diameter-mm 32 --lead-mm 10",
        "With diameter and lead a file of that screw, in which what is not given is marked as assumed. Ball and pitch "
        "circle follow from the root diameter, the grooves (without a root also the ball) from C_a and turns."),
    "screw": Command("loads, pressure, stiffness, life, efficiency, catalogue torque", f"{RUN}.screw:run_screw",
        numbers(q.PRELOAD, q.AXIAL_LOAD, q.SPEED, q.TEMPERATURE), (*ROWS, *OF_MAP),
        "--screw my.toml --preload-n 1000 --axial-load-n 1500",
        "Default of the preload: 5 % of the dynamic rating, of oversize balls 2.5 %. With speed and temperature also "
        "efficiency and hours, from the map. Catalogue torque: drag torque by JIS B 1192."),
    "oil": Command("viscosity, density and pressure-viscosity coefficient of an oil", f"{RUN}.oil:run_oil", (
        *numbers(Quantity("iso_vg", "ISO 3448 viscosity grade", whole=True), metavar="GRADE"),
        *numbers(Quantity("viscosity_index", "viscosity index (ASTM D2270)"), metavar="VI"),
        *numbers(Quantity("density_15c_kg_m3", "density at 15 C; default: a paraffinic oil"), metavar="RHO"),
    ), (option("--screw", "screw file, whose oil is described", "FILE.toml"), JSON), "--iso-vg 68 --viscosity-index 95",
        "A mineral oil by its grade, or the oil of a screw file, at 20 to 100 C, with assumptions and their errors."),
    "map": Command("build, check or describe a map", actions=MAP_ACTIONS),
    "torque": Command("friction torque with its parts, films and interval", f"{RUN}.torque:run_torque", (
        *numbers(*q.TORQUE_POINT, q.DIFFERENCE), switch("--direct", "solve the contacts instead of reading the map"),
    ), (*ROWS, *OF_MAP), "--preload-n 2000 --speed-rpm 1000 --temperature-c 30 --map my_map.npz"),
    "preload": Command("preload behind a measured friction torque", f"{RUN}.preload:run_preload",
        numbers(*q.PRELOAD_POINT, q.DIFFERENCE), (*ROWS, *OF_MAP),
        "--torque-nm 0.8 --speed-rpm 100 --temperature-c 30 --map my_map.npz"),
    "axis": Command("friction of the whole axis by part: nut, bearings, guide, wipers, motor", f"{RUN}.axis:run_axis", (
        option("screw", "screw file with tables of the axis, also as --screw", "FILE.toml", nargs="?",
               default=argparse.SUPPRESS),
        *numbers(*q.AXIS_POINT, q.DIFFERENCE), PLOT,
    ), OF_MAP, "my.toml --preload-n 2000 --speed-rpm 1000 --temperature-c 30",
        "Tables support_bearings, guide, wipers, motor, axis of the screw file, with numbers of catalogues: ballscrew "
        "init --axis. Torques are at the screw. Default of the point: 5 % of the dynamic rating (oversize balls 2.5 "
        "%), 1000 r/min, reference temperature of the oil."),
    "identify": Command("inertia, offset, friction and preload from a log of a drive", f"{RUN}.identify:run_identify", (
        option("log", "log of an axis that moves both ways", "LOG.csv"),
        option("--column", "a column by heading: \"current=Iq_act [A]\" (repeat it)", "NAME=HEADING",
               action="append", default=[]),
        *numbers(*q.IDENTIFY_OPTIONS, q.TEMPERATURE, q.DIFFERENCE), *numbers(*q.OFFSETS, type=with_error),
        *(part for one in q.FRICTIONS for part in numbers(one, type=functools.partial(with_error, quantity=one))),
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
        *numbers(*q.CALIBRATION_POINT, *q.TOLERANCES),
        option("--output", "where to write the sets, for --friction", "FILE.toml"),
        PLOT,
        option("--drop", "rows to leave out (repeat it for several)", choices=DROP_KINDS, action="append", default=[]),
    ), (SCREW, MAP_FILE, JSON), "measurements.csv --map my_map.npz --output friction.toml",
        "Columns by headings with units: preload [N], speed [r/min], temperature [degC], torque [N.m]; optional "
        "axial_load, torque_uncertainty or weight, torque_low and torque_high, preload_tolerance, table, comment. Or "
        "one torque, measured or of a catalogue with its tolerance: the four options of a point. Prints errors, 95 % "
        "intervals, outliers and what the data do not identify."),
    "export": Command("friction of a map or a log as a table for a controller or a tool", f"{RUN}.export:run_export", (
        option("--format", "twincat: list frict_comp; modelica: CombiTable1Ds", choices=EXPORT_FORMATS, required=True),
        option("--output", OUTPUT + "; of several lists the stem of their names", "PATH", required=True),
        *numbers(q.PRELOAD._replace(not_zero=True), q.TEMPERATURE, nargs="+"),
        option("--identified", "not of a map: of the whole axis, by identify --output", "FILE.json"),
        *numbers(q.SPEED._replace(help="range of the screw's speed; default: of map or log"), **RANGE),
        *numbers(q.LEAD, q.TORQUE_CONSTANT, q.RATIO, q.CURRENT_UNIT),
        *numbers(q.POINTS, metavar="N"),
    ), OF_MAP, "--map my_map.npz --format csv --output friction.csv",
        "Torque over speed, preload and temperature with its interval; units and signs are in the file. Defaults: 5 % "
        "(oversize balls 2.5 %) of the dynamic rating, reference temperature of the oil, whole range of speed. Options "
        "of motor and lead: of twincat, which is over the velocity of the axis. With --identified each direction by "
        "itself, in a list the mean."),
    "report": Command("one HTML page on a screw: torque, film, loads, limits", f"{RUN}.report:run_report", (
        option("--output", OUTPUT, "FILE.html", required=True), *numbers(*q.REPORT_POINT),
    ), OF_MAP, "--map my_map.npz --output my_report.html",
        "One page without external files; without screw and map on the packaged GD4008-3. Default of the point: 5 % of "
        "the dynamic rating (oversize balls 2.5 %), 1000 r/min, reference temperature of the oil."),
    "contact": Command("solve one elastohydrodynamic contact", f"{RUN}.contact:run_contact", (
        *numbers(*q.CONTACT_POINT),
        switch("--isothermal", "without the energy equation"),
        *numbers(Quantity("moes", "Moes load and lubricant number"), nargs=2, metavar=("M", "L")),
        *numbers(Quantity("radius_ratio", "0 < R_x/R_y <= 1", 0.0, 1.0, not_zero=True), metavar="R_X/R_Y"),
        option("--law", "barus (incompressible) or roelands (compressible)", choices=LAWS),
        *numbers(Quantity("domain", "along and across rolling [Hertz half-widths]"), nargs=3,
                 metavar=("XA", "XB", "Y")),
        *numbers(Quantity("refine", "truth check: nodes, layers and domain times K, 1 to 8", 1, 8), metavar="K"),
    ), (*ROWS, SCREW_ALONE, JSON), "--moes 20 5 --radius-ratio 1 --law barus",
        "By its dimensions, thermal unless --isothermal, with oil and steel of --screw; or by its Moes numbers: "
        "--moes, --radius-ratio, --law. The default domain is wide enough not to starve."),
}
#: python -m ballscrew_tehl
SOLVER = Command("Friction torque of preloaded ball screws.", actions=COMMANDS)
# fmt: on


class Parser(argparse.ArgumentParser):
    """One line per error; no abbreviations, which a later option could make ambiguous."""

    def __init__(self, **settings: Any) -> None:
        page = functools.partial(argparse.RawDescriptionHelpFormatter, max_help_position=30)
        super().__init__(allow_abbrev=False, add_help=False, formatter_class=page, **settings)
        # argparse reads -1e3 and -inf as options; NaN included: it is rejected later by name
        self._negative_number_matcher = re.compile(r"-(\d|\.\d|inf|nan)", re.IGNORECASE)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """As argparse, but what is left over is refused by its command."""
        parsed, left = super().parse_known_args(args, namespace)
        if left:
            self.error(f"unrecognized arguments: {' '.join(left)}")
        return parsed, left

    def explained(self, message: str) -> str:
        """An error of argparse, with the value of a Quantity behind its option, or the word that is meant."""
        message = re.sub(r"^argument (\S+):  = ", r"\1 = ", message)
        if wrong := re.search(r"(?:invalid choice: '|arguments: )([\w-]+)", message):
            known = [*re.findall(r"\w+", message.partition("(choose from")[2]), *self._option_string_actions]
            for near in difflib.get_close_matches(wrong[1], known, n=1):
                message += f"; is {near} meant?"
        return message

    def error(self, message: str) -> NoReturn:
        """Print the error and exit with code 2."""
        self.exit(2, f"{self.prog}: error: {self.explained(message)} (see --help)\n")


def build_parser(prog: str, command: Command, new: Callable[..., Parser] = Parser) -> Parser:
    """The parser of a command and those below it; prog: its name in help and messages."""
    usage = [prog, *(["COMMAND"] if command.actions else [])]
    for flag, settings in command.options:
        word = settings.get("metavar") or flag.strip("-").upper()
        if not flag.startswith("-"):
            usage.append(f"[{word}]" if settings.get("nargs") == "?" else word)
        elif settings.get("required"):
            usage.append(f"{flag} {word}")
    # an example first
    lines = [f"  {prog} {command.example}\n"] if command.example else []
    about = f"{command.help[:1].upper()}{command.help[1:].rstrip('.')}."
    if command.actions:
        lines.append(about)
        for title, names in (command.groups or {"commands": list(command.actions)}).items():
            lines += [f"\n{title}:", *(f"  {name:<10}  {command.actions[name].help}" for name in names)]
        lines += ["", command.description]
    else:
        lines.append(textwrap.fill(f"{about} {command.description}", shutil.get_terminal_size().columns - 2))
    parser = new(prog=prog, usage=" ".join([*usage, "[options]"]), description="\n".join(lines))
    parser.set_defaults(run=command.run, prog=prog)
    groups = {"options": command.options, "common options": (*command.shared, HELP, VERSION)}
    for title, options in groups.items():
        group = parser.add_argument_group(title)
        for flag, settings in options:
            group.add_argument(*flag.split(), **settings)
    if command.actions:
        # listed by the head of the page
        below = parser.add_subparsers(
            dest="command", required=True, metavar="COMMAND", parser_class=Parser, help=argparse.SUPPRESS
        )
        for name, action in command.actions.items():
            add = functools.partial(below.add_parser, name, help=action.help)
            build_parser(f"{prog} {name}", action, add)
    return parser
