"""The command init: a commented screw file to fill in."""

from __future__ import annotations

import json
from argparse import Namespace

from .files import check_output, written


def run_init(args: Namespace) -> int:
    """A screw file to fill in."""
    from ..parameters.template import write_template

    check_output("FILE.toml", args.file, "a new file *.toml")
    with written("FILE.toml", args.file):
        write_template(args.file, args.oil, args.lubricant)
    if args.json:
        print(json.dumps({"file": args.file}))
    else:
        print(f"{args.file}: enter the values of your screw and oil; the first lines explain the next steps")
    return 0
