# PYTHON_ARGCOMPLETE_OK
"""The command `ballscrew`, of both packages, and the commands of the FMUs; what they do is in runs.

The table imports nothing slow: completion reads it at every key.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from ballscrew_tehl.applications.cli import main as cli
from ballscrew_tehl.applications.cli.parser import (
    COMMANDS,
    INPUTS,
    JSON,
    OUTPUT,
    Command,
    numbers,
    option,
    switch,
)
from ballscrew_tehl.applications.quantities import Quantity

RUNS = "ballscrew_fmu.runs"
#: documentation of a clone, and as a wheel puts it (pyproject.toml)
DOCS = Path(__file__).resolve().parents[2] / "docs", Path(sys.prefix, "share", "ballscrew-tehl", "docs")
# fmt: off
#: of models.MODELS, repeated here
LAYERS = ("friction", "monitor", "transmission", "axis")
BUILD = Command("from a screw file to checked FMUs", f"{RUNS}:run_build", (
    option("screw_file", "screw file, also as --screw; default: that in the map, or the packaged GD4008-3", "FILE.toml",
           nargs="?"),
    option("--output", "folder for the FMUs; default: %(default)s", "FOLDER", default="dist"),
    option("--only", "this model only: %(choices)s; may be repeated", "MODEL", action="append", choices=LAYERS,
           default=[]),
    option("--fmi", "this version of FMI only: 2 or 3; default: both", "VERSION", type=int, choices=(2, 3)),
    switch("--python-only", "only the FMU for Python hosts"),
    switch("--embed-map", "native FMUs that open no file, of 15 MB each, for real-time targets"),
), (*INPUTS, JSON), "my_screw.toml --output my_fmus",
    "The map is made in memory in some seconds, unless --map gives one or that of the screw is packaged. Friction, "
    "preload monitor, transmission and axis, native, and friction for Python hosts; for Linux, Windows and macOS. A "
    "wheel has the libraries. A clone compiles them once, some minutes with ziglang (extra compile), without it by the "
    "compiler of this machine for it only; --embed-map always compiles. Each FMU is validated by fmpy and replayed "
    "against the map; FMUs are delivered only if all checks pass. Same input, same bytes. Exit codes: 0 done, 1 a "
    "check or the compiler failed, 2 invalid input.")
FMU_FILE = option("fmu", "an FMU of this program", "FILE.fmu")
#: of the FMUs, in both faces
FMU_COMMANDS = {
    "build": BUILD,
    "check": Command("validate an FMU and replay the reference that it carries", f"{RUNS}:run_check", (FMU_FILE,),
                     (JSON,), "dist/BallScrewFriction.fmu"),
    "info": Command("kinds, platforms and variables of an FMU", f"{RUNS}:run_info", (FMU_FILE,), (JSON,),
                    "dist/BallScrewFriction.fmu"),
    "page": Command("the FMU in one HTML page that computes in any browser", f"{RUNS}:run_page", (
        option("--output", f"{OUTPUT}; default: %(default)s", "FILE.html", default="live.html"),
    ), (*INPUTS, JSON), "--map my_map.npz --output my.html",
        "Torque over speed with its interval and parts, film, axial force of each nut, efficiency, and measured points "
        "from a CSV file over them. It contains the C code of the FMU as WebAssembly, and the map; no network. "
        "The FMUs of friction have it as documentation/live.html."),
}
APP = Command("a page on this machine: a form for a screw, its torque, files to take away", f"{RUNS}:run_app", (
    option("screw_file", "screw file to begin with", "FILE.toml", nargs="?"),
    *numbers(Quantity("port", "port of the address; default: a free one", 1024, 65535, whole=True), metavar="N"),
    switch("--no-browser", "print the address only"),
), (JSON,), "my_screw.toml",
    "Prints its address, opens it in the browser and runs until Ctrl+C. The address has a secret: only who has it gets "
    "an answer, from this machine alone. The page sends nothing elsewhere and writes nothing but what is saved.")
EXAMPLES = Command("the example scripts: list them, or copy them into a folder", f"{RUNS}:run_examples", (
    option("--copy", "new folder for the scripts; default: they are listed", "FOLDER"),
), (JSON,), "--copy examples",
    "They find the FMUs in the folder dist beside theirs, where `ballscrew build` puts them.")
FMUS = Command("FMUs of a ball screw.", actions=FMU_COMMANDS)
BALLSCREW = Command(
    "Friction of preloaded ball screws by thermal elastohydrodynamic lubrication.",
    example="torque --preload-n 2000 --speed-rpm 1000 --temperature-c 30",
    description="Options of a command, with an example: ballscrew COMMAND --help\n"
    f"Documentation: {DOCS[not (DOCS[0] / 'theory.md').is_file()]}\n"
    'Completion: eval "$(register-python-argcomplete ballscrew)" in bash and zsh\n'
    "  register-python-argcomplete --shell fish ballscrew | source, in fish",
    actions={
        **COMMANDS, **FMU_COMMANDS,
        "report": COMMANDS["report"]._replace(run=f"{RUNS}:run_report"),
        "examples": EXAMPLES, "app": APP,
    },
    groups={
        "your screw": ("app", "init", "screw", "oil", "map"),
        "torque and preload": ("torque", "preload", "axis"),
        "measurements": ("identify", "calibrate"),
        "tables and pages": ("export", "report", "page"),
        "FMUs": ("build", "check", "info", "examples"),
        "research": ("contact",),
    },
)
# fmt: on


def main(arguments: Sequence[str] | None = None) -> int:
    """The command `ballscrew`. Returns the exit code: see ballscrew_tehl.applications.cli.main."""
    return cli.main(arguments, "ballscrew", BALLSCREW)


if __name__ == "__main__":
    sys.exit(main())
