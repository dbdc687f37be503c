#!/usr/bin/env python3
"""Build the FMUs of a screw from its map: as `ballscrew build`, into the folder dist of the project."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent


def main(arguments: list[str] | None = None) -> int:
    try:
        from ballscrew_fmu.command import BUILD
        from ballscrew_tehl.applications.cli.main import main as run
    except ImportError as error:
        print(
            f"build_fmu.py: {error}; install the project first: python -m pip install -e {ROOT}",
            file=sys.stderr,
        )
        return 2
    given = sys.argv[1:] if arguments is None else arguments
    return run(["--output", str(ROOT / "dist"), *given], "build_fmu.py", BUILD)


if __name__ == "__main__":
    sys.exit(main())
