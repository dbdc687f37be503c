"""The command `map atlas`."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from ..nut_map.atlas_contacts import build_atlas
from ..nut_map.workers import build_executor
from .files import check_output
from .points import print_results
from .progress import progress_bar


def run_map_atlas(args: Namespace) -> int:
    """Solve the contacts of the atlas, compare it with others, and write it; continues an interrupted run."""
    path = Path(args.output)
    check_output("--output", path, "a file *.npz")
    for name in ("workers", "count"):
        value = getattr(args, name)
        if value is not None and value < 1:
            raise ValueError(f"--{name} = {value}; allowed: a whole number >= 1")
    with build_executor(args.workers, args.dask) as executor, progress_bar() as progress:
        header = build_atlas(path, executor, args.count, progress)
    errors = header.pop("errors")
    rows = {f"{name}_error_{key}": value for name, by_key in errors.items() for key, value in by_key.items()}
    print_results([{"file": str(path), **header, **rows}], args.json, False)
    return 0
