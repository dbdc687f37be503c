"""Whether the error estimate of the contact solver holds: random thermal contacts against their refined solutions.

`python tests/benchmarks/check_estimate.py [--contacts N] [--seed S] [--output FILE.csv]` solves N contacts of both
kinematics over the range of the packaged map with the nodes of a map and again with nodes, lines, layers, domain and
tolerance refined (SolverOptions.refined), and prints the share of contacts whose h_c moves by no more than
error_estimate, the median estimate and the worst ratio. A contact that does not converge or has no estimate counts as
not covered. Seconds to minutes per contact; with --output a run may be interrupted and continued.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from contact_sample import Point, compile_kernels, random_points
from result_file import ResultFile

from ballscrew_tehl.contact import MAP_NODES, SolverOptions, solve

#: the truth: factor on nodes, lines, layers and extent
REFINE = 2.0


class Checked(NamedTuple):
    """One contact: films [m], difference and estimate relative to h_c, seconds of both solves."""

    seed: int
    number: int
    nodes: int
    refine: float
    kinematics: str
    raceway: str
    load: float
    speed_rpm: float
    temperature: float
    M: float
    L: float
    branch: str
    converged: bool
    refined_converged: bool
    h_c: float
    h_c_refined: float
    error_estimate: float
    heat_balance: float
    seconds: float
    refined_seconds: float
    reason: str

    @property
    def difference(self) -> float:
        """|h_c - h_c refined| over h_c refined."""
        return abs(self.h_c / self.h_c_refined - 1.0)

    @property
    def covered(self) -> bool:
        return self.converged and self.refined_converged and self.difference <= self.error_estimate

    @property
    def ratio(self) -> float:
        """Difference over estimate."""
        return self.difference / self.error_estimate

    def __str__(self) -> str:
        point = Point(self.kinematics, self.raceway, self.load, self.speed_rpm, self.temperature)
        text = (
            f"{self.number:4d} {point!s:52s} M {self.M:8.4g} L {self.L:4.1f} {self.branch:10s} "
            f"h_c {1e9 * self.h_c:8.2f} nm, refined {1e9 * self.h_c_refined:8.2f}, difference {self.difference:.1e}, "
            f"estimate {self.error_estimate:.1e}, ratio {self.ratio:5.2f}, heat balance {self.heat_balance:.1e}, "
            f"{self.seconds:.1f} and {self.refined_seconds:.0f} s"
        )
        return text if self.converged and self.refined_converged else f"{text}; {self.reason}"


def check(seed: int, number: int, point: Point, nodes: int, refine: float) -> Checked:
    """Solve one contact with default accuracy and refined."""
    options = SolverOptions(n_x=nodes)
    materials = point.parameters.lubricant, point.parameters.solid
    plain = solve(point.conditions, *materials, options)
    refined = solve(point.conditions, *materials, options.refined(refine))
    balance = plain.heat_balance
    return Checked(
        seed, number, nodes, refine, *point, plain.M, plain.L, plain.branch, plain.converged, refined.converged,
        plain.h_c, refined.h_c, plain.error_estimate, math.nan if balance is None else balance.defect,
        plain.seconds, refined.seconds, f"{plain.reason}; refined: {refined.reason}",
    )  # fmt: skip


def report(rows: list[Checked]) -> dict[str, float]:
    """Coverage, estimates and ratios; empty if nothing has converged."""
    solved = [row for row in rows if row.converged and row.refined_converged]
    if not solved:
        return {}
    estimate = np.array([row.error_estimate for row in rows])
    difference, ratio = np.array([(row.difference, row.ratio) for row in solved]).T
    seconds, refined_seconds = np.array([(row.seconds, row.refined_seconds) for row in rows]).T
    return {
        "contacts": len(rows),
        "not converged": sum(not row.converged for row in rows),
        "refined not converged": sum(not row.refined_converged for row in rows),
        "asymptotic": sum(row.branch != "resolved" for row in rows),
        "without an estimate": int(np.sum(np.isnan(estimate))),
        "covered [%]": 100.0 * sum(row.covered for row in rows) / len(rows),
        "median estimate [%]": 100.0 * float(np.nanmedian(estimate)),
        "largest estimate [%]": 100.0 * float(np.nanmax(estimate)),
        "median difference [%]": 100.0 * float(np.median(difference)),
        "largest difference [%]": 100.0 * float(np.max(difference)),
        "median ratio": float(np.nanmedian(ratio)),
        "worst ratio": float(np.nanmax(ratio)),
        "largest heat balance error [%]": 100.0 * float(np.max([abs(row.heat_balance) for row in solved])),
        "median seconds": float(np.median(seconds)),
        "median seconds refined": float(np.median(refined_seconds)),
    }


def run(contacts: int, seed: int, nodes: int, refine: float, output: Path | None) -> list[Checked]:
    """Check the contacts that the output does not hold yet; returns all rows of this seed, nodes and factor."""
    file = ResultFile(output, Checked, ("seed", "number", "nodes", "refine"))
    wanted = {
        (seed, number, nodes, refine): point for number, point in enumerate(random_points(contacts, seed))
    }
    done = file.cases()
    if skipped := len(wanted.keys() & done):
        print(f"{skipped} contacts are in {output}")
    if wanted.keys() - done:
        compile_kernels()
    try:
        for case, point in wanted.items():
            if case not in done:
                file.append(check(seed, case[1], point, nodes, refine))
                print(file.rows[-1], flush=True)
    except KeyboardInterrupt:
        print("interrupted")
    return [row for row in file.rows if file.case(row) in wanted]


def main(arguments: list[str] | None = None) -> dict[str, float]:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--contacts", type=int, default=200, help="random contacts (default 200)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the contacts (default 1)")
    parser.add_argument(
        "--nodes", type=int, default=MAP_NODES, help=f"nodes along rolling (default {MAP_NODES}, of a map)"
    )
    parser.add_argument("--refine", type=float, default=REFINE, help=f"factor (default {REFINE:g})")
    parser.add_argument("--output", type=Path, help="CSV file that the rows are added to")
    args = parser.parse_args(arguments)
    rows = run(args.contacts, args.seed, args.nodes, args.refine, args.output)
    figures = report(rows)
    for row in rows:
        if not row.covered:
            print(f"not covered: {row}")
    for name, figure in figures.items():
        print(f"{name:32s}{figure:12.4g}")
    return figures


if __name__ == "__main__":
    main()
