"""Robustness of the contact solve over its whole range, at points of a Sobol sequence.

`python tests/benchmarks/robustness.py [--points N] [--thermal] [--refine K] [--output FILE.csv]` solves N contacts and
prints how many did not converge, are not a number or took the asymptotic branch (and the lowest load that did),
quantiles of error estimate, heat balance and seconds, and the worst points.
Isothermal: radius ratio 0.03 to 1, Moes M 1.5 to 2e6, L 1.8 to 40 (ratio and M over their logarithms), both oil laws.
Thermal: contacts of the packaged screw over the range of its map, both raceways and laws. `--refine K` solves
each again with nodes, lines, layers, domain and tolerance refined by K and prints the share of contacts whose film
moves by no more than error_estimate.
"""

import argparse
import math
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pandas as pd
from rich.progress import track
from scipy.stats import qmc

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
from reference_screw import GD4008

from ballscrew_tehl.contact import SolverOptions, ball_conditions, solve, solve_moes
from ballscrew_tehl.nut_map.grid import MapGrid, ball_range
from ballscrew_tehl.parameters.file import Law, changed
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.hertz import RACEWAYS

LAWS = tuple(Law)
RANGE = ball_range(GD4008, replace(MapGrid(), force=MapGrid().preload))


def isothermal(u, refine=1.0):
    """One point of the unit cube as Moes numbers."""
    ratio, M, L = 0.03 * (1.0 / 0.03) ** u[0], 1.5 * (2e6 / 1.5) ** u[1], 1.8 + 38.2 * u[2]
    law = "barus" if u[3] < 0.5 else "roelands"
    options = SolverOptions(thermal=False).refined(refine)
    return f"ratio {ratio:.4g} M {M:.4g} L {L:.4g} {law}", solve_moes(M, L, ratio, law, options).result


def thermal(u, refine=1.0):
    """One point of the unit cube as a contact of the packaged screw; load and speed over their logarithms."""
    ends = np.array([RANGE.load, RANGE.speed])
    load, speed = (ends[:, 0] * (ends[:, 1] / ends[:, 0]) ** u[:2]).tolist()
    temperature = float(np.interp(u[2], (0.0, 1.0), RANGE.temperature))
    raceway, law = RACEWAYS[int(u[3] >= 0.5)], LAWS[int(u[4] >= 0.5)]
    parameters = changed(GD4008, friction={"law": law})
    conditions = ball_conditions(parameters, raceway, load, speed, temperature)
    name = f"{law} {raceway} {load:.4g} N {speed / RPM:.4g} r/min {temperature:.2f} K"
    return name, solve(conditions, parameters.lubricant, parameters.solids, SolverOptions().refined(refine))


def outcome(u, heated, refine):
    """What became of one point. Without heat NaN: heat_balance, its relative gap."""
    contact = thermal if heated else isothermal
    point, s = contact(u)
    return {
        "point": point, "M": s.M, "h_c": s.h_c, "h_m": s.h_m, "converged": s.converged, "reason": s.reason,
        "branch": s.branch, "error": s.error_estimate,
        "difference": abs(s.h_c / contact(u, refine)[1].h_c - 1.0) if refine > 1.0 else math.nan,
        "iterations": s.iterations, "heat_balance": math.nan if s.heat_balance is None else abs(s.heat_balance.defect),
        "seconds": s.seconds,
    }  # fmt: skip


def report(found):
    """Print the counts, the quantiles and the worst points."""
    broken, asymptotic = ~np.isfinite(found[["h_c", "h_m"]]).all(axis=1), found.branch != "resolved"
    print(f"{len(found)} points: {int((~found.converged).sum())} not converged, {int(broken.sum())} not finite, "
          f"{int(asymptotic.sum())} asymptotic, lowest M {found.M[asymptotic].min():.3g}; "
          f"{int(found.error.isna().sum())} without an error estimate")  # fmt: skip
    print(found[~found.converged][["point", "reason"]].to_string())
    if found.difference.notna().any():
        within = 100.0 * (found.difference <= found.error).mean()
        print(f"film within its estimate of the refined one: {within:.1f} %")
    columns = ["error", "difference", "heat_balance", "iterations", "seconds"]
    print(found[columns].describe(percentiles=[0.5, 0.9, 0.99]).T.to_string(float_format="{:.3g}".format))
    for name in columns:
        worst = found.sort_values(name, na_position="first").iloc[-1]
        print(f"largest {name}: {worst[name]:.3g} at {worst.point} (point {worst.name}, {worst.branch})")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=2000, help="points of the sequence (default 2000)")
    parser.add_argument("--thermal", action="store_true", help="thermal contacts of the packaged screw")
    parser.add_argument("--refine", type=float, default=1.0, help="solve again, refined by this factor")
    parser.add_argument("--output", type=Path, help="CSV file of the outcomes")
    args = parser.parse_args()
    cube = qmc.Sobol(5, seed=1).random_base2(math.ceil(math.log2(max(args.points, 2))))[: args.points]
    one = partial(outcome, heated=args.thermal, refine=args.refine)
    with ProcessPoolExecutor() as pool:
        found = pd.DataFrame(track(pool.map(one, cube), "contacts", len(cube)))
    if args.output:
        found.to_csv(args.output, index_label="number")
    report(found)


if __name__ == "__main__":
    main()
