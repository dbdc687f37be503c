"""python -m ballscrew_fmu build|check|info|map|page: the commands of the FMUs without the others of `ballscrew`."""

import sys
from collections.abc import Sequence

from ballscrew_tehl.applications.cli import main as cli

from .command import FMUS


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command. Returns the exit code: see ballscrew_tehl.applications.cli.main."""
    return cli.main(arguments, "python -m ballscrew_fmu", FMUS)


if __name__ == "__main__":
    sys.exit(main())
