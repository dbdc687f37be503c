"""Cost and accuracy of the contact solve.

`python tests/benchmarks/bench_contact.py [--repeat N]` prints five parts: isothermal and thermal cases on several
grids, a thermal solve from a neighbouring solution, cost over the number of nodes N and over Moes M. Per line: nodes
along x lines over the whole width, M, median and best time of a solve whose kernels are compiled and whose grid is
known, time of the grid itself, Newton steps and elastic deflections (the work unit of the targets) of the grid, units:
median time over that of one deflection on the grid, the share of the time that the grid of half the nodes takes, the
error that the solver estimates and the error of Hc against tests/published/data/film_references.csv. Thermal cases have
no reference: h_c is compared with the finest grid; below each, where the time goes.
Set OPENBLAS_NUM_THREADS=1 on a machine that is shared: two BLAS threads that wait for a busy core cost 10 to 50 times.
"""

import argparse
import math
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
from contact_cases import OIL, STEEL, conditions
from reference_screw import published_rows

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


def line(
    case: str,
    solution: ContactSolution,
    seconds: list[float],
    grid: float,
    error: float | None = None,
    layers: str = "",
) -> str:
    """One row of the table."""
    size = f"{solution.x.size}x{2 * solution.y.size - 1}{layers}"
    note = (
        ""
        if solution.converged and solution.branch == "resolved"
        else f"  {solution.branch}: {solution.reason}"
    )
    shown = "" if error is None else f"{100.0 * error:+.2f} %"
    estimate = "-" if math.isnan(solution.error_estimate) else f"{100.0 * solution.error_estimate:.2f} %"
    coarse = solution.phases.get("coarse grid", 0.0) / solution.seconds
    median = statistics.median(seconds)
    return (
        f"{case:34s} {size:>12s} {solution.M:7.4g} {1e3 * median:9.1f} {1e3 * min(seconds):8.1f} "
        f"{1e3 * grid:8.1f} {solution.iterations:5d} {solution.deflections:11d} "
        f"{median / deflection_seconds(solution):6.0f} "
        f"{100.0 * coarse:5.0f} % {estimate:>8s} {shown:>8s}{note}"
    )


def phases(solution: ContactSolution) -> str:
    """Where the time of a solve goes, in percent."""
    share = {name: 100.0 * value / solution.seconds for name, value in solution.phases.items()}
    share["rest"] = 100.0 - sum(share.values())
    return "    " + ", ".join(f"{name} {value:.0f} %" for name, value in share.items())


def isothermal(repeat: int) -> None:
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
            print(line(f"{key[0]} L {key[2]} ratio {key[3]}", film.solution, *timing, error))


def thermal(repeat: int) -> None:
    for name, srr in THERMAL:
        timings = []
        for n_x, n_y, n_z in THERMAL_GRIDS:
            options = SolverOptions(n_x=n_x, n_y=n_y, n_z=n_z)
            timings.append(timed(partial(solve_contact, conditions(srr=srr), OIL, STEEL, options), repeat))
        finest = timings[-1][0].h_c
        for (_, _, n_z), (solution, *timing) in zip(THERMAL_GRIDS, timings, strict=True):
            error = None if solution.h_c == finest else solution.h_c / finest - 1.0
            print(line(name, solution, *timing, error, f"x{n_z}"))
            print(phases(solution))


def warm_start(repeat: int) -> None:
    """The first thermal case on its middle grid, from the solution of a neighbour instead of the dry contact."""
    n_x, n_y, n_z = THERMAL_GRIDS[1]
    options = SolverOptions(n_x=n_x, n_y=n_y, n_z=n_z)
    at = conditions(srr=THERMAL[0][1])
    speeds = {"u_1": NEIGHBOUR * at.u_1, "u_2": NEIGHBOUR * at.u_2}
    neighbour = solve_contact(replace(at, load=NEIGHBOUR * at.load, **speeds), OIL, STEEL, options)
    cold = solve_contact(at, OIL, STEEL, options)
    solution, *timing = timed(partial(solve_contact, at, OIL, STEEL, options, neighbour), repeat)
    name = f"from load and speed {100.0 * (NEIGHBOUR - 1.0):.0f} % off"
    print(line(name, solution, *timing, solution.h_c / cold.h_c - 1.0, f"x{n_z}"))
    print(phases(solution))


def nodes(repeat: int) -> None:
    """Fitted exponent of the cost over the number of nodes, and that of N log N."""
    counts, best = [], []
    for n_x in SCALING_NODES:
        options = SolverOptions(thermal=False, n_x=n_x, n_y=(n_x + 7) // 8)
        film, seconds, grid = timed(partial(solve_moes, *SCALING, options), 2 * repeat)
        print(line("comp-Roelands L 10 ratio 0.0353", film.solution, seconds, grid))
        counts.append(film.solution.x.size * film.solution.y.size)
        best.append(min(seconds))
    N = np.array(counts, dtype=float)
    found, ideal = (np.polyfit(np.log(N), np.log(cost), 1)[0] for cost in (best, N * np.log(N)))
    # calls per step dominate on small grids: the exponent of the largest grids is more meaningful
    last = math.log(best[-1] / best[-2]) / math.log(counts[-1] / counts[-2])
    print(
        f"    best time ~ N^{found:.2f} over N = {counts[0]} to {counts[-1]}, last step N^{last:.2f}; "
        f"N log N ~ N^{ideal:.2f}"
    )


def loads(repeat: int) -> None:
    _, L, ratio, law = SCALING
    for M in LOADS:
        film, *timing = timed(partial(solve_moes, M, L, ratio, law), repeat)
        print(line("comp-Roelands L 10 ratio 0.0353", film.solution, *timing))


#: heading -> part
PARTS: dict[str, Callable[[int], None]] = {
    "Isothermal cases": isothermal,
    "Thermal cases": thermal,
    "Thermal case, warm start; error against the cold start": warm_start,
    "Cost over nodes, isothermal": nodes,
    "Cost over Moes M, isothermal, default grid": loads,
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeat", type=int, default=5, help="timed solves per line (default 5)")
    repeat = parser.parse_args().repeat
    # compile everything before the clock runs
    solve_contact(conditions(), OIL, STEEL, SolverOptions(n_x=33, n_y=5, n_z=4, max_thermal=2))
    print(HEADER)
    for heading, part in PARTS.items():
        print(heading)
        part(repeat)


if __name__ == "__main__":
    main()
