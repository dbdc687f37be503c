"""Cost of the contact solver.

`python tests/benchmarks/bench_contact.py [--parts map circle] [--contacts N] [--output FILE.csv]`
map: thermal contacts drawn from the range of the packaged map, both races and kinematics, nodes of a map. circle:
129 x 129 nodes, M = 200, L = 10. Each is solved cold and with its grid known.

--compare PATH solves the contacts with another
checkout in turn and prints both and the ratio of their medians, with --python if it needs another environment.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
from contact_sample import random_points
from contact_versions import HERE, Worker
from contact_worker import Request, timed

from ballscrew_tehl.contact import MAP_NODES, moes_conditions

Figures = dict[str, Any]
Solvers = Mapping[str, Callable[[Request], Figures]]
TIMES = {
    "cold": "cold, grid and operators built",
    "again": "cold, grid and operators known",
    "cpu_cold": "processor time, cold",
    "cpu_again": "processor time, cold, grid known",
}
COUNTS = {"iterations": "iterations of the fine grid", "deflections": "deflections of the fine grid"}


def map_requests(contacts: int, seed: int) -> list[Request]:
    """Contacts of a map."""
    return [Request({"n_x": MAP_NODES}, asdict(point.conditions)) for point in random_points(contacts, seed)]


def circle_request() -> Request:
    """A row of the film references over its domain."""
    options = {"thermal": False, "n_x": 129, "n_y": 65, "x_in": -2.5, "x_out": 1.5, "y_max": 1.5}
    return Request(options, asdict(moes_conditions(200.0, 10.0, 1.0)), "roelands")


def measure(requests: Sequence[Request], solvers: Solvers) -> dict[str, list[Figures]]:
    """Figures of every request by every solver; they take turns, and each comes first every other time.

    The first request is measured once more before, without effect: kernels are compiled or loaded.
    """
    found: dict[str, list[Figures]] = {name: [] for name in solvers}
    order = list(solvers)
    for name in order:
        solvers[name](requests[0])
    for request in requests:
        for name in order:
            found[name].append(solvers[name](request))
        order.reverse()
    return found


def column(rows: Sequence[Figures], name: str) -> np.ndarray:
    """One quantity of all contacts."""
    return np.array([row[name] for row in rows], dtype=float)


def summary(rows: Sequence[Figures]) -> dict[str, float]:
    """Medians, 90 % quantiles and largest values by "quantity, which [unit]"."""
    found: dict[str, float] = {}
    for name, shown in TIMES.items():
        quantiles = np.quantile(column(rows, name), (0.5, 0.9, 1))
        for which, value in zip(("median", "90 %", "largest"), quantiles, strict=True):
            found[f"{shown}, {which} [ms]"] = 1e3 * float(value)
    for name, shown in COUNTS.items():
        found[f"{shown}, median"] = float(np.median(column(rows, name)))
    found["error estimate, median [%]"] = 100.0 * float(np.nanmedian(column(rows, "error_estimate")))
    found["not converged"] = float(sum(not row["converged"] for row in rows))
    found["asymptotic"] = float(sum(row["branch"] != "resolved" for row in rows))
    return found


def show(part: str, heading: str, requests: list[Request], solvers: Solvers) -> pd.DataFrame:
    """Measure and print one part; its figures by quantity and solver."""
    found = measure(requests, solvers)
    figures = {name: summary(rows) for name, rows in found.items()}
    print(f"{heading:54s}" + "".join(f"{name:>12s}" for name in figures))
    for quantity in next(iter(figures.values())):
        values = [each[quantity] for each in figures.values()]
        ratio = f"{values[0] / values[1]:12.3f}" if len(values) == 2 and values[1] else ""
        print(f"{quantity:54s}" + "".join(f"{value:12.4g}" for value in values) + ratio)
    if len(found) == 2:
        first, second = (column(rows, "h_c") for rows in found.values())
        moved = 100.0 * np.abs(first / second - 1.0)
        heading = "h_c of both, median and largest difference [%]"
        print(f"{heading:54s}{np.median(moved):12.3g}{moved.max():12.3g}")
    return pd.DataFrame(figures).assign(part=part)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    names = ["map", "circle"]
    parser.add_argument("--parts", nargs="+", choices=names, default=names, help="parts to run (default all)")
    parser.add_argument("--contacts", type=int, default=100, help="contacts of the map part (default 100)")
    parser.add_argument("--seed", type=int, default=1, help="seed of these contacts (default 1)")
    parser.add_argument("--repeat", type=int, default=5, help="solves of the circle (default 5)")
    parser.add_argument("--compare", type=Path, help="checkout whose solver takes turns")
    parser.add_argument("--python", default=sys.executable, help="interpreter of that checkout")
    parser.add_argument("--output", type=Path, help="CSV file of the results")
    args = parser.parse_args(arguments)
    parts: list[pd.DataFrame] = []
    requests = map_requests(args.contacts, args.seed)
    checkouts = {"this": (HERE, sys.executable)}
    with ExitStack() as stack:
        solvers: Solvers = {"this": timed}
        if args.compare:
            checkouts["other"] = (args.compare, args.python)
            solvers = {name: stack.enter_context(Worker(*place)) for name, place in checkouts.items()}
        if "map" in args.parts:
            parts.append(show("map", f"Contacts of a map, thermal: {args.contacts}", requests, solvers))
        if "circle" in args.parts:
            parts.append(show("circle", "Circle, M = 200, L = 10", [circle_request()] * args.repeat, solvers))
    if args.output and parts:
        pd.concat(parts).to_csv(args.output)


if __name__ == "__main__":
    main()
