"""Command line of the examples that run one FMU, print a table and may draw a picture."""

import argparse
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any


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
    """Run main with the FMU that the arguments name, print its table, draw its plot; returns the exit code.

    Parameters   arguments: None = of the process;  script: its __file__;  description: its __doc__;  fmu: the default;
                 kind: what FMU it takes, for the help
    """
    parser = argparse.ArgumentParser(
        prog=Path(script).name, description=description, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--fmu", type=Path, default=fmu, help=f"the {kind}, FMI 2.0; default: %(default)s")
    parser.add_argument("--plot", type=Path, metavar="FILE.png", help="draw the result to this file")
    options = parser.parse_args(arguments)
    if not zipfile.is_zipfile(options.fmu):
        print(f"{parser.prog}: {options.fmu} is no FMU; run build_fmu.py first", file=sys.stderr)
        return 2
    result = main(options.fmu)
    print(table(result))
    if options.plot:
        plot(result, options.plot)
    return 0
