"""Cost and certificate of the maps of many screws.

`python tests/benchmarks/bench_maps.py [--screws FOLDER] [--only NAME ...] [--count N] [--workers W]
[--maps FOLDER] [--output FILE.csv]` builds the map of every screw file of a folder (default: tests/data/screws) and the
packaged ones by the command `map build`, and prints for each: contacts, seconds, core-seconds, contacts not solved,
share of asymptotic ones and the errors of the certificate in percent. Maps that --maps holds are read, not built again;
an interrupted build continues. `--workers 1 2` builds each with one worker and with two; their bytes must be the same.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import tempfile
import time
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pandas as pd

from ballscrew_tehl.cli.main import main as command
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_screw
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA

SCREWS = Path(__file__).parents[1] / "data" / "screws"
ERRORS = tuple(f"torque_error_{key}" for key in ("mean", "99", "max"))
ERRORS += ("film_error_99", "temperature_rise_error_99")


def core_time() -> float:
    """Processor time of this process and of those that it has waited for [s]."""
    now = os.times()
    return now.user + now.system + now.children_user + now.children_system


def built(screw: Path, path: Path, options: list[str]) -> dict[str, Any]:
    """Build the map of a screw file unless there is one, and read its figures."""
    row: dict[str, Any] = {"screw": screw.stem}
    if not path.exists():
        words = ["map", "build", "--screw", str(screw), "--output", str(path), "--json", *options]
        begun, used = time.perf_counter(), core_time()
        with contextlib.redirect_stdout(io.StringIO()):
            code = command(words)
        row |= {"seconds": time.perf_counter() - begun, "core_seconds": core_time() - used}
        if code:
            return row | {"code": code}
    header = load_map(path, load_screw(screw)).header
    certificate = header["certificate"]
    row |= {name: header[name] for name in ("contacts", "contacts_not_solved", "range_cut")}
    row |= {name: certificate[name] for name in ("points", "points_not_solved")}
    return row | {name: 100.0 * certificate[name] for name in ERRORS}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--screws", type=Path, default=SCREWS, metavar="FOLDER", help="screw files *.toml")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these screws alone")
    parser.add_argument(
        "--count", type=int, default=48, metavar="N", help="points of each certificate; packaged: 1000"
    )
    parser.add_argument("--workers", type=int, nargs="+", metavar="W", default=[os.cpu_count() or 1])
    parser.add_argument("--maps", type=Path, metavar="FOLDER", help="keep the maps, and continue them")
    parser.add_argument("--output", type=Path, metavar="FILE.csv", help="figures of finished maps")
    args = parser.parse_args()
    packaged = (PACKAGED_DATA / f"gd4008{name}.toml" for name in ("", "_vg100"))
    screws = [*sorted(args.screws.glob("*.toml")), *packaged]
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        for screw in (screw for screw in screws if args.only is None or screw.stem in args.only):
            files = []
            for workers in args.workers:
                kept = args.maps is not None and len(args.workers) == 1
                path = (args.maps if kept else Path(scratch)) / f"{screw.stem}{'' if kept else workers}.nc"
                count = 1000 if screw.parent == PACKAGED_DATA else args.count
                options = ["--count", str(count), "--workers", str(workers)]
                rows.append({"workers": workers, **built(screw, path, options)})
                files.append(path.read_bytes() if path.exists() else b"")
                if args.output:
                    pd.DataFrame(rows).to_csv(args.output, index=False)
            if len(set(files)) > 1:
                raise ArithmeticError(f"{screw.stem}: other numbers of workers write other bytes")
    print(pd.DataFrame(rows).to_string(index=False, float_format="{:.3g}".format))


if __name__ == "__main__":
    main()
