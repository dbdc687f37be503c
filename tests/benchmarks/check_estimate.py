"""Whether the error estimate of the contact solver holds: random thermal contacts against their refined solutions.

`python tests/benchmarks/check_estimate.py [--contacts N] [--seed S] [--output FILE.csv]` solves N contacts of both
kinematics over the range of the packaged map with the nodes of a map and again with nodes, lines, layers, domain and
tolerance refined (SolverOptions.refined), and prints the share of contacts whose h_c moves by no more than
error_estimate, the median estimate and the worst ratio. A contact that does not converge or has no estimate counts as
not covered. Seconds to minutes per contact.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

import pandas as pd
from contact_sample import Point, compile_kernels, random_points

from ballscrew_tehl.contact import MAP_NODES, SolverOptions, solve


def check(point: Point, nodes: int, refine: float) -> dict[str, Any]:
    """Solve one contact with default accuracy and refined; films [m], difference and estimate relative to h_c."""
    options, materials = SolverOptions(n_x=nodes), (point.parameters.lubricant, point.parameters.solid)
    plain = solve(point.conditions, *materials, options)
    refined = solve(point.conditions, *materials, options.refined(refine))
    converged, balance = plain.converged and refined.converged, plain.heat_balance
    difference = abs(plain.h_c / refined.h_c - 1.0) if converged else math.nan
    return {
        "point": str(point), "M": plain.M, "L": plain.L, "branch": plain.branch, "converged": plain.converged,
        "refined_converged": refined.converged, "h_c": plain.h_c, "h_c_refined": refined.h_c,
        "estimate": plain.error_estimate, "difference": difference, "ratio": difference / plain.error_estimate,
        "covered": difference <= plain.error_estimate,
        "heat_balance": math.nan if balance is None else abs(balance.defect),
        "seconds": plain.seconds, "refined_seconds": refined.seconds, "reason": f"{plain.reason}; {refined.reason}",
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--contacts", type=int, default=200, help="random contacts (default 200)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the contacts (default 1)")
    parser.add_argument("--nodes", type=int, default=MAP_NODES, help="nodes along rolling (of a map)")
    parser.add_argument("--refine", type=float, default=2.0, help="factor on nodes, lines, layers and extent")
    parser.add_argument("--output", type=Path, help="CSV file of the rows")
    args = parser.parse_args()
    compile_kernels()
    rows: list[dict[str, Any]] = []
    for point in random_points(args.contacts, args.seed):
        rows.append(check(point, args.nodes, args.refine))
        print(f"{len(rows):4d} {rows[-1]['point']:52s} estimate {rows[-1]['estimate']:.1e}, "
              f"difference {rows[-1]['difference']:.1e}, {rows[-1]['refined_seconds']:.0f} s", flush=True)  # fmt: skip
        if args.output:
            pd.DataFrame(rows).to_csv(args.output, index=False)
    found = pd.DataFrame(rows)
    print(found[~found.covered].to_string(index=False))
    print(found.describe(percentiles=[0.5, 0.9]).T.to_string(float_format="{:.3g}".format))
    print(f"covered: {100.0 * found.covered.mean():.1f} %; not converged {int((~found.converged).sum())}, refined "
          f"{int((~found.refined_converged).sum())}, asymptotic {int((found.branch != 'resolved').sum())}")  # fmt: skip


if __name__ == "__main__":
    main()
