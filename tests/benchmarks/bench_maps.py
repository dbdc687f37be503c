"""Time of the maps of many screws, and their errors against direct solves.

`python tests/benchmarks/bench_maps.py [--screws FOLDER] [--only NAME ...] [--count N] [--workers W]
[--output FILE.csv]` makes the map of every screw file of a folder (default: tests/data/screws) and that of the
mechanistic set, and prints for each the seconds, the fraction of its contacts inside the atlas, and its errors at N
points against direct solves in percent, as `map check` finds them.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pandas as pd

from ballscrew_tehl.nut_map.build import build_map
from ballscrew_tehl.nut_map.certificate import deviation_from_direct
from ballscrew_tehl.nut_map.file import nut_map_of
from ballscrew_tehl.nut_map.workers import worker_pool
from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw

SCREWS = Path(__file__).parents[1] / "data" / "screws"
ERRORS = (
    "torque_error_mean", "torque_error_99", "torque_error_max", "film_error_99", "temperature_rise_error_99",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--screws", type=Path, default=SCREWS, metavar="FOLDER", help="screw files *.toml")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these screws alone")
    parser.add_argument("--count", type=int, default=48, metavar="N", help="points that are solved; 0: none")
    parser.add_argument("--workers", type=int, metavar="W", help="processes; default: one per core")
    parser.add_argument("--output", type=Path, metavar="FILE.csv")
    args = parser.parse_args()
    rows: list[dict[str, Any]] = []
    with worker_pool(args.workers) as executor:
        for file in [*sorted(args.screws.glob("*.toml")), PACKAGED_VG100]:
            if args.only is not None and file.stem not in args.only:
                continue
            parameters, begun = load_screw(file), time.perf_counter()
            built = build_map(parameters)
            row = {"screw": file.stem, "seconds": time.perf_counter() - begun}
            row["inside"] = built.header["atlas_fraction"]
            if args.count:
                found = deviation_from_direct(nut_map_of(built), parameters, args.count, executor)
                row |= {
                    "not_solved": found["points_not_solved"],
                    **{name: 100.0 * found[name] for name in ERRORS},
                }
            rows.append(row)
            if args.output:
                pd.DataFrame(rows).to_csv(args.output, index=False)
    print(pd.DataFrame(rows).to_string(index=False, float_format="{:.3g}".format))


if __name__ == "__main__":
    main()
