"""Time of a contact, beside that of another version.

`python tests/benchmarks/bench_contact.py [--against CHECKOUT] [--contacts N] [--only CLASS ...] [--output FILE.csv]`
solves contacts of the packaged screw over the range of its map, of the own screws (tests/data/screws) and two circles,
each cold with grids and operators in the caches, and prints for each class the medians of the processor time and the
sums; with --against in turn with the code of another checkout, in a process of its own, with the ratios, the largest
difference of the films over the error estimate, and the contacts that either did not solve.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

os.environ |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}

import numpy as np
import pandas as pd
from scipy.stats import qmc

from ballscrew_tehl.contact import (
    ContactConditions,
    SolverOptions,
    ball_conditions,
    moes_conditions,
    reference_oil,
    solve,
    solve_for_map,
)
from ballscrew_tehl.nut_map.grid import ball_range, map_grid
from ballscrew_tehl.parameters.file import Parameters, changed, load_screw
from ballscrew_tehl.physics.hertz import RACEWAYS

HERE = Path(__file__).parents[2]
SCREWS = sorted((HERE / "tests" / "data" / "screws").glob("*.toml"))
CIRCLES = {"circle M 36": 36.0, "circle M 200": 200.0}
Request, Figures = dict[str, Any], dict[str, Any]

#: parameters of a screw file, None = packaged
screw_of = lru_cache(maxsize=None)(load_screw)


def drawn(screw: str | None, u: np.ndarray, kinematics: str | None) -> Request:
    """A contact of a screw at a point of the unit cube: load and speed over their logarithms, temperature, raceway."""
    parameters: Parameters = screw_of(screw)
    if kinematics is not None:
        parameters = changed(parameters, friction={"kinematics": kinematics})
    grid = map_grid(parameters)
    range_ = ball_range(parameters, replace(grid, force=grid.preload))
    ends = np.array([range_.load, range_.speed])
    load, speed = (ends[:, 0] * (ends[:, 1] / ends[:, 0]) ** u[:2]).tolist()
    temperature = float(np.interp(u[2], (0.0, 1.0), range_.temperature))
    at = ball_conditions(parameters, RACEWAYS[int(u[3] >= 0.5)], load, speed, temperature)
    return {"screw": screw, "law": None, "conditions": asdict(at)}


def requests(contacts: int, seed: int) -> dict[str, list[Request]]:
    """Contacts by class."""
    cube = qmc.Sobol(5, seed=seed).random_base2(math.ceil(math.log2(max(contacts, 2))))[:contacts]
    circles = {
        name: [{"law": "roelands", "conditions": asdict(moes_conditions(M, 10.0, 1.0))}] * min(contacts, 5)
        for name, M in CIRCLES.items()
    }
    kinematics = ("rolling_frame", "published")
    return {
        "packaged screw": [drawn(None, u, kinematics[int(u[4] >= 0.5)]) for u in cube],
        "own screws": [drawn(str(SCREWS[k % len(SCREWS)]), u, None) for k, u in enumerate(cube)],
        **circles,
    }


def materials(request: Request) -> tuple[ContactConditions, Any, Any]:
    parameters, law = screw_of(request.get("screw")), request["law"]
    oil = parameters.lubricant if law is None else reference_oil(law)
    return ContactConditions(**request["conditions"]), oil, parameters.solids


def timed(request: Request) -> Figures:
    """Figures of one contact, solved as a map does, or as `contact --moes` does; the second of two solves is timed."""
    for _ in range(2):
        begun = time.process_time()
        if request["law"] is None:
            found = solve_for_map(*materials(request), thermal=True)
        else:
            found = solve(*materials(request), SolverOptions(thermal=False))
        seconds = time.process_time() - begun
    names = ("h_c", "h_m", "rolling_loss", "converged", "error_estimate", "iterations")
    return {name: getattr(found, name) for name in names} | {"cpu": seconds}


def other(checkout: Path) -> Callable[[Request], Figures]:
    """Contacts solved by the code of another checkout, in a process of its own."""
    process = subprocess.Popen(
        [sys.executable, __file__, "--serve"], env=os.environ | {"PYTHONPATH": str(checkout / "solver")},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdin is not None
    assert process.stdout is not None
    if not Path(process.stdout.readline().strip()).is_relative_to(checkout.resolve()):
        raise ValueError(f"--against = {checkout}; allowed: a checkout, whose package can be imported")

    def solved(request: Request) -> Figures:
        print(json.dumps(request), file=process.stdin, flush=True)
        return dict(json.loads(process.stdout.readline()))

    return solved


def serve() -> None:
    """Answer requests of stdin, one JSON object a line."""
    print(Path(sys.modules["ballscrew_tehl"].__file__ or "").resolve(), flush=True)
    for line in sys.stdin:
        print(json.dumps({name: float(value) for name, value in timed(json.loads(line)).items()}), flush=True)


def compared(rows: pd.DataFrame) -> pd.Series:
    """Figures of one class: this code, and over the other one where there is one."""
    found = {"contacts": len(rows), "median_ms": 1e3 * rows.cpu.median(), "sum_s": rows.cpu.sum(),
             "iterations": rows.iterations.median(),
             "unsolved": (rows.converged != 1).sum()}  # fmt: skip
    if "cpu_other" in rows:
        cpu, moved = rows.cpu_other, (rows.h_c / rows.h_c_other - 1.0).abs()
        found |= {"other_median_ms": 1e3 * cpu.median(), "ratio_median": cpu.median() / rows.cpu.median(),
                  "ratio_sum": cpu.sum() / rows.cpu.sum(), "other_unsolved": (rows.converged_other != 1).sum(),
                  "film_99": moved.quantile(0.99), "film_over_estimate": (moved / rows.error_estimate).max(),
                  }  # fmt: skip
    return pd.Series(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--against", type=Path, metavar="CHECKOUT", help="solve in turn with its code")
    parser.add_argument("--contacts", type=int, default=100, metavar="N", help="of each class (circles: 5)")
    parser.add_argument("--only", nargs="+", metavar="CLASS", help="these classes alone")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--output", type=Path, metavar="FILE.csv")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.serve:
        return serve()
    wanted = {
        k: v for k, v in requests(args.contacts, args.seed).items() if args.only is None or k in args.only
    }
    solvers = {"": timed}
    if args.against:
        solvers["_other"] = other(args.against)
    rows: list[Figures] = []
    for name, contacts in wanted.items():
        for request in contacts:
            row: Figures = {"class": name, **request["conditions"]}
            for tag, solver in list(solvers.items())[:: 1 if len(rows) % 2 else -1]:
                row |= {key + tag: value for key, value in solver(request).items()}
            rows.append(row)
            if args.output:
                pd.DataFrame(rows).to_csv(args.output, index=False)
    found = pd.DataFrame(rows)
    table = found.groupby("class", sort=False)[list(found.columns)].apply(compared)
    print(table.T.to_string(float_format="{:.4g}".format))


if __name__ == "__main__":
    main()
