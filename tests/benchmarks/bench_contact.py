"""Cost and accuracy of the contact solve.

`python tests/benchmarks/bench_contact.py [--parts map circle ...] [--contacts N] [--repeat N] [--output FILE.csv]`
prints seven parts. map: thermal contacts drawn from the range of the packaged map, both races and kinematics, nodes of
a map: cold, cold with known grid, predicted from the next higher load, share of the time outside compiled kernels
(numpy counts as outside) and by phase, cost of a Newton step. circle: 129 x 129 nodes, M = 200, L = 10.
isothermal, thermal, warm: cases on several grids and from a neighbouring solution. nodes, loads: cost over the number
of nodes N and over Moes M. Per line of these: nodes along x lines over the whole width, M, median and best time of a
solve whose kernels are compiled and whose grid is known, time of the grid itself, Newton steps and elastic deflections
(the work unit of the targets) of the grid, units: median time over that of one deflection on the grid, the share of the
time that the grid of half the nodes takes, the error that the solver estimates and the error of Hc against
tests/published/data/film_references.csv. Thermal cases have no reference: h_c is compared with the finest grid; below
each, where the time goes.

--startup measures a process that compiles the kernels and a later one. --compare PATH solves the contacts of map and
circle with another checkout in turn and prints both and the ratio of their medians. For version 0.1.0:
`git worktree add ../v010 2f22ae7`, then `--compare ../v010`, with `--python` if it needs another environment.
Set OPENBLAS_NUM_THREADS=1 on a machine that is shared: two BLAS threads that wait for a busy core cost 10 to 50 times.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
from contact_cases import OIL, STEEL, conditions
from contact_sample import compile_kernels, random_points
from contact_versions import HERE, Worker, startup
from contact_worker import PREDICTORS
from contact_worker import timed as timed_request
from map_contact import Solvers, circle_request, map_requests, show_contacts
from reference_screw import published_rows
from result_file import FigureFile

from ballscrew_tehl.contact.conditions import SolverOptions
from ballscrew_tehl.contact.film import reynolds
from ballscrew_tehl.contact.moes import solve_moes
from ballscrew_tehl.contact.solve import ContactSolution, solve_contact

#: rheology, M, L, ratio of rows of the table
CASES = [
    ("comp-Roelands", "200", "10", "1.0"),
    ("inc-Barus", "200", "10", "1.0"),
    ("comp-Roelands", "1000", "10", "0.0353"),
    ("inc-Barus", "10000", "10", "0.0353"),
]
#: nodes along, lines over half the width; None: default
GRIDS = [(65, 33), (129, None), (129, 65)]
THERMAL = [("screw, 30 N, 2 m/s, srr 0.5", 0.5), ("screw, 30 N, 2 m/s, srr 1.5", 1.5)]
THERMAL_GRIDS = [(65, 9, 8), (129, None, 10), (129, 33, 20)]
#: case and grids of the cost over N, lines in proportion to nodes along; M of the cost over M
SCALING = (100.0, 10.0, 0.0353, "roelands")
SCALING_NODES = (33, 65, 129, 257)
LOADS = (10.0, 100.0, 1e3, 1e4, 1e5)
#: change of load and speed to the neighbour of a warm start
NEIGHBOUR = 1.02
HEADER = (
    f"{'case':34s} {'grid':>12s} {'M':>7s} {'median ms':>9s} {'best ms':>8s} {'grid ms':>8s} {'steps':>5s} "
    f"{'deflections':>11s} {'units':>6s} {'coarse':>7s} {'estimate':>8s} {'Hc error':>8s}"
)


def timed(solve: Callable[[], Any], repeat: int) -> tuple[Any, list[float], float]:
    """Last result, seconds of every repetition, seconds that the first one took longer (its grid)."""
    reynolds.contact_geometry.cache_clear()
    first = time.perf_counter()
    solution = solve()
    first = time.perf_counter() - first
    seconds = []
    for _ in range(repeat):
        begun = time.perf_counter()
        solution = solve()
        seconds.append(time.perf_counter() - begun)
    return solution, seconds, max(0.0, first - statistics.median(seconds))


def deflection_seconds(solution: ContactSolution, calls: int = 101) -> float:
    """Median time of one elastic deflection on the grid of a solution."""
    c = solution.conditions
    deflection = reynolds.contact_geometry(solution.choice, c.R_x / c.R_y).deflection
    seconds = []
    for _ in range(calls):
        begun = time.perf_counter()
        deflection(solution.state.p)
        seconds.append(time.perf_counter() - begun)
    return statistics.median(seconds)


class Line(NamedTuple):
    """One row of the table: seconds, shares; error: NaN if there is no reference."""

    case: str
    grid: str
    M: float
    median: float
    best: float
    grid_seconds: float
    steps: int
    deflections: int
    units: float
    coarse: float
    estimate: float
    error: float
    note: str

    def __str__(self) -> str:
        shown = "" if math.isnan(self.error) else f"{100.0 * self.error:+.2f} %"
        estimate = "-" if math.isnan(self.estimate) else f"{100.0 * self.estimate:.2f} %"
        return (
            f"{self.case:34s} {self.grid:>12s} {self.M:7.4g} {1e3 * self.median:9.1f} {1e3 * self.best:8.1f} "
            f"{1e3 * self.grid_seconds:8.1f} {self.steps:5d} {self.deflections:11d} {self.units:6.0f} "
            f"{100.0 * self.coarse:5.0f} % {estimate:>8s} {shown:>8s}{self.note}"
        )


def line(
    case: str,
    solution: ContactSolution,
    seconds: list[float],
    grid: float,
    error: float = math.nan,
    layers: str = "",
) -> Line:
    """One row of the table."""
    resolved = solution.converged and solution.branch == "resolved"
    median = statistics.median(seconds)
    return Line(
        case, f"{solution.x.size}x{2 * solution.y.size - 1}{layers}", solution.M, median, min(seconds), grid,
        solution.iterations, solution.deflections, median / deflection_seconds(solution),
        solution.phases.get("coarse grid", 0.0) / solution.seconds, solution.error_estimate, error,
        "" if resolved else f"  {solution.branch}: {solution.reason}",
    )  # fmt: skip


def phases(solution: ContactSolution) -> str:
    """Where the time of a solve goes, in percent."""
    share = {name: 100.0 * value / solution.seconds for name, value in solution.phases.items()}
    share["rest"] = 100.0 - sum(share.values())
    return "    " + ", ".join(f"{name} {value:.0f} %" for name, value in share.items())


def isothermal(repeat: int) -> Iterator[Line | str]:
    rows = {(r["rheology"], r["M"], r["L"], r["lambda"]): r for r in published_rows("film_references.csv")}
    for key in CASES:
        row = rows[key]
        M, L, ratio = (float(v) for v in key[1:])
        law = {"inc-Barus": "barus", "comp-Roelands": "roelands"}[key[0]]
        x_in, x_out = (float(v) for v in row["domain_x"].split(".."))
        y_max = float(row["domain_y"].removeprefix("+-").removesuffix("b"))
        for n_x, n_y in GRIDS:
            options = SolverOptions(thermal=False, n_x=n_x, n_y=n_y, x_in=x_in, x_out=x_out, y_max=y_max)
            film, *timing = timed(partial(solve_moes, M, L, ratio, law, options), repeat)
            error = film.Hc / float(row["Hc"]) - 1.0
            yield line(f"{key[0]} L {key[2]} ratio {key[3]}", film.solution, *timing, error)


def thermal(repeat: int) -> Iterator[Line | str]:
    for name, srr in THERMAL:
        timings = []
        for n_x, n_y, n_z in THERMAL_GRIDS:
            options = SolverOptions(n_x=n_x, n_y=n_y, n_z=n_z)
            timings.append(timed(partial(solve_contact, conditions(srr=srr), OIL, STEEL, options), repeat))
        finest = timings[-1][0].h_c
        for (_, _, n_z), (solution, *timing) in zip(THERMAL_GRIDS, timings, strict=True):
            error = math.nan if solution.h_c == finest else solution.h_c / finest - 1.0
            yield line(name, solution, *timing, error, f"x{n_z}")
            yield phases(solution)


def warm_start(repeat: int) -> Iterator[Line | str]:
    """The first thermal case on its middle grid, from the solution of a neighbour instead of the dry contact."""
    n_x, n_y, n_z = THERMAL_GRIDS[1]
    options = SolverOptions(n_x=n_x, n_y=n_y, n_z=n_z)
    at = conditions(srr=THERMAL[0][1])
    speeds = {"u_1": NEIGHBOUR * at.u_1, "u_2": NEIGHBOUR * at.u_2}
    neighbour = solve_contact(replace(at, load=NEIGHBOUR * at.load, **speeds), OIL, STEEL, options)
    cold = solve_contact(at, OIL, STEEL, options)
    solution, *timing = timed(partial(solve_contact, at, OIL, STEEL, options, neighbour), repeat)
    name = f"from load and speed {100.0 * (NEIGHBOUR - 1.0):.0f} % off"
    yield line(name, solution, *timing, solution.h_c / cold.h_c - 1.0, f"x{n_z}")
    yield phases(solution)


def nodes(repeat: int) -> Iterator[Line | str]:
    """Fitted exponent of the cost over the number of nodes, and that of N log N."""
    counts, best = [], []
    for n_x in SCALING_NODES:
        options = SolverOptions(thermal=False, n_x=n_x, n_y=(n_x + 7) // 8)
        film, seconds, grid = timed(partial(solve_moes, *SCALING, options), 2 * repeat)
        yield line("comp-Roelands L 10 ratio 0.0353", film.solution, seconds, grid)
        counts.append(film.solution.x.size * film.solution.y.size)
        best.append(min(seconds))
    N = np.array(counts, dtype=float)
    found, ideal = (np.polyfit(np.log(N), np.log(cost), 1)[0] for cost in (best, N * np.log(N)))
    # calls per step dominate on small grids: the exponent of the largest grids is more meaningful
    last = math.log(best[-1] / best[-2]) / math.log(counts[-1] / counts[-2])
    yield (
        f"    best time ~ N^{found:.2f} over N = {counts[0]} to {counts[-1]}, last step N^{last:.2f}; "
        f"N log N ~ N^{ideal:.2f}"
    )


def loads(repeat: int) -> Iterator[Line | str]:
    _, L, ratio, law = SCALING
    for M in LOADS:
        film, *timing = timed(partial(solve_moes, M, L, ratio, law), repeat)
        yield line("comp-Roelands L 10 ratio 0.0353", film.solution, *timing)


#: name -> heading, rows
PARTS: dict[str, tuple[str, Callable[[int], Iterator[Line | str]]]] = {
    "isothermal": ("Isothermal cases", isothermal),
    "thermal": ("Thermal cases", thermal),
    "warm": ("Thermal case, warm start; error against the cold start", warm_start),
    "nodes": ("Cost over nodes, isothermal", nodes),
    "loads": ("Cost over Moes M, isothermal, default grid", loads),
}


def show_startup(checkouts: Mapping[str, tuple[Path, str]], output: FigureFile) -> None:
    """Measure and print the start of processes."""
    print("Start of a process, first contact of the map part")
    request = map_requests(random_points(1, 1))[0]._replace(neighbours=None)
    for solver, place in checkouts.items():
        figures = startup(request, *place)
        for name, figure in figures.items():
            print(f"{solver:12s}{name:42s}{figure:12.4g}")
        output.add("startup", "seconds", figures, solver)


def parser() -> argparse.ArgumentParser:
    """The options."""
    found = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = ["map", "circle", *PARTS]
    found.add_argument("--parts", nargs="+", choices=names, help="parts to run (default all)")
    found.add_argument("--contacts", type=int, default=100, help="contacts of the map part (default 100)")
    found.add_argument("--seed", type=int, default=1, help="seed of these contacts (default 1)")
    found.add_argument(
        "--predictor", choices=PREDICTORS, default="nearest", help="start of the predicted solve"
    )
    found.add_argument("--repeat", type=int, default=5, help="timed solves per line (default 5)")
    found.add_argument("--startup", action="store_true", help="measure the start of processes as well")
    found.add_argument(
        "--compare", type=Path, help="checkout whose solver takes turns; parts map and circle only"
    )
    found.add_argument("--python", default=sys.executable, help="interpreter of that checkout")
    found.add_argument("--output", type=Path, help="CSV file of the results")
    return found


def main(arguments: list[str] | None = None) -> None:
    args = parser().parse_args(arguments)
    parts = args.parts or (["map", "circle"] if args.compare else ["map", "circle", *PARTS])
    output = FigureFile(args.output)
    requests = map_requests(random_points(args.contacts, args.seed), args.predictor)
    with ExitStack() as stack:
        solvers: Solvers = {"this": timed_request}
        checkouts = {"this": (HERE, sys.executable)}
        if args.compare:
            checkouts["other"] = (args.compare, args.python)
            solvers = {name: stack.enter_context(Worker(*place)) for name, place in checkouts.items()}
        if "map" in parts:
            heading = f"Contacts of a map, thermal: {args.contacts}, predictor {args.predictor}"
            show_contacts("map", heading, requests, solvers, output)
        if "circle" in parts:
            circles = [circle_request()] * args.repeat
            show_contacts("circle", "Circle, 129 x 129 nodes, M = 200, L = 10", circles, solvers, output)
    if args.startup:
        show_startup(checkouts, output)
    tables = [part for part in PARTS if part in parts]
    if tables and not args.compare:
        compile_kernels()
        print(HEADER)
        for part in tables:
            heading, rows = PARTS[part]
            print(heading)
            for row in rows(args.repeat):
                print(row, flush=True)
                if isinstance(row, Line):
                    output.add(part, f"{row.case}, {row.grid}, M {row.M:.4g}", row._asdict())


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("interrupted")
