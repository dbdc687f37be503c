"""Shared by the examples: their command lines and the style of their figures."""

import argparse
import sys
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NoReturn


class Parser(argparse.ArgumentParser):
    """Parser of a script with its docstring as description; one line per error."""

    def __init__(self, script: str, description: str | None) -> None:
        super().__init__(
            prog=Path(script).name, description=description, formatter_class=argparse.RawTextHelpFormatter
        )

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (see --help)\n")

    def complain(self, message: str) -> int:
        """One line on stderr; returns the exit code."""
        print(f"{self.prog}: {' '.join(message.split())}", file=sys.stderr)
        return 2


def no_fmu(path: Path) -> str:
    """Error message if the file is not an FMU, else ""."""
    if zipfile.is_zipfile(path):
        return ""
    problem = "is no FMU" if path.exists() else "not found"
    return f"{path} {problem}; run ballscrew build first, or name an FMU with --fmu"


def run_with_fmu(
    arguments: list[str] | None,
    script: str,
    description: str | None,
    fmu: Path,
    main: Callable[[Path], Any],
    table: Callable[[Any], str],
    plot: Callable[[Any, Path], None],
    kind: str = "FMU",
) -> int:
    """Run main with the FMU of the arguments, print its table, draw its plot; returns the exit code.

    arguments: None = of the process; script: its __file__; description: its __doc__; fmu: the default; kind: of the
    FMU, for the help.
    """
    parser = Parser(script, description)
    parser.add_argument("--fmu", type=Path, default=fmu, help=f"the {kind}, FMI 2.0; default: %(default)s")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw the result to this file")
    options = parser.parse_args(arguments)
    if problem := no_fmu(options.fmu):
        return parser.complain(problem)
    try:
        result = main(options.fmu)
        print(table(result))
        if not result.get("in_range", True):
            print("the map of the FMU does not cover every step: inputs were clamped", file=sys.stderr)
        if options.plot:
            plot(result, options.plot)
            print(options.plot)
    except (OSError, ValueError) as error:
        return parser.complain(str(error))
    return 0


def run_and_plot(
    script: str,
    description: str | None,
    main: Callable[[], Any],
    report: Callable[[Any], str] | None,
    plot: Callable[[Any, Path], None],
) -> None:
    """Run main, print its report, draw its plot to --plot, by default a PNG named like the script."""
    parser = Parser(script, description)
    default = Path(Path(script).stem + ".png")
    parser.add_argument("--plot", type=Path, default=default, metavar="FILE.png", help="default: %(default)s")
    path = parser.parse_args().plot
    result = main()
    if report is not None:
        print(report(result))
    plot(result, path)
    print(path)


def plain(panels: Iterable[Any]) -> None:
    """Pale grid, axes at the left and below only."""
    for panel in panels:
        panel.grid(color="0.92", lw=0.8)
        panel.spines[["top", "right"]].set_visible(False)
