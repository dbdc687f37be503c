#!/usr/bin/env python3
"""Build the FMUs of a screw from its map: as `python -m ballscrew_fmu build`, into the folder dist of the project."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent


def main(arguments: list[str] | None = None) -> int:
    try:
        from ballscrew_fmu.__main__ import main as run
    except ImportError as error:
        print(
            f"build_fmu.py: {error}; install the project first: python -m pip install -e {ROOT}",
            file=sys.stderr,
        )
        return 2
    return run(arguments, prog="build_fmu.py", subcommands=False, folder=ROOT / "dist")


if __name__ == "__main__":
    sys.exit(main())
