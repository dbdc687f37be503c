"""Robustness of the contact solve over its whole range, at points of a Sobol sequence.

`python tests/benchmarks/robustness.py [--points N] [--thermal [--roughness-um SIGMA]] [--workers W]` solves N
contacts and prints how many did not converge, are not a number, took the asymptotic branch (and the lowest load that
did), and the worst error estimate.
Isothermal: radius ratio 0.03 to 1, Moes M 1.5 to 2e6, L 1.8 to 40 (ratio and M over their logarithms), both oil laws.
Thermal: contacts of the packaged screw, ball load 2 to 200 N, 5 to 6000 r/min, 10 to 80 C, both raceways and
kinematics.
"""

import argparse
import math
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script

import numpy as np
from reference_screw import GD4008
from rich.progress import Progress
from scipy.stats import qmc

from ballscrew_tehl.contact.ball_contact import ball_contact
from ballscrew_tehl.contact.conditions import SolverOptions
from ballscrew_tehl.contact.moes import solve_moes
from ballscrew_tehl.contact.solve import ContactSolution, solve_contact
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.asperity import typical_roughness


class Outcome(NamedTuple):
    """What became of one point."""

    point: str
    M: float
    h_c: float
    converged: bool
    reason: str
    branch: str
    error: float
    seconds: float


def _outcome(point: str, solution: ContactSolution) -> Outcome:
    return Outcome(
        point, solution.M, solution.h_c, solution.converged, solution.reason, solution.branch,
        solution.error_estimate, solution.seconds,
    )  # fmt: skip


def isothermal(u: np.ndarray) -> Outcome:
    """One point of the unit cube as Moes numbers."""
    ratio = 0.03 * (1.0 / 0.03) ** u[0]
    M = 1.5 * (2e6 / 1.5) ** u[1]
    L = 1.8 + 38.2 * u[2]
    law = "barus" if u[3] < 0.5 else "roelands"
    return _outcome(f"ratio {ratio:.4g} M {M:.4g} L {L:.4g} {law}", solve_moes(M, L, ratio, law).solution)


def thermal(u: np.ndarray, sigma: float = 0.0) -> Outcome:
    """One point of the unit cube as a contact of the packaged screw, of composite roughness sigma [m]."""
    load, speed = 2.0 * 100.0 ** u[0], math.pi / 30.0 * 5.0 * 1200.0 ** u[1]
    temperature = 283.15 + 70.0 * u[2]
    raceway = "screw" if u[3] < 0.5 else "nut"
    kinematics = "published" if u[4] < 0.5 else "rolling_frame"
    parameters = changed(GD4008, friction={"kinematics": kinematics})
    roughness = typical_roughness(sigma) if sigma > 0.0 else None
    conditions = ball_contact(parameters, raceway, load, speed, temperature, roughness=roughness)
    point = f"{kinematics} {raceway} {load:.4g} N {speed:.4g} rad/s {temperature:.4g} K"
    return _outcome(point, solve_contact(conditions, parameters.lubricant, parameters.solid, SolverOptions()))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--points", type=int, default=2000, help="points of the sequence (default 2000)")
    parser.add_argument("--thermal", action="store_true", help="thermal contacts of the packaged screw")
    parser.add_argument(
        "--roughness-um", type=float, default=0.0, help="composite rms roughness of thermal contacts"
    )
    parser.add_argument(
        "--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)"
    )
    args = parser.parse_args()
    points = qmc.Sobol(5, seed=1).random_base2(math.ceil(math.log2(args.points)))[: args.points]
    solve = partial(thermal, sigma=1e-6 * args.roughness_um) if args.thermal else isothermal
    begun, found = time.perf_counter(), []
    with ProcessPoolExecutor(args.workers) as pool, Progress() as progress:
        bar = progress.add_task("contacts", total=len(points))
        for job in as_completed([pool.submit(solve, u) for u in points]):
            found.append(job.result())
            progress.advance(bar)
    report(found, time.perf_counter() - begun)


def report(found: list[Outcome], seconds: float) -> None:
    """Print the counts and the worst points."""
    unconverged = [o for o in found if not o.converged]
    broken = [o for o in found if not math.isfinite(o.h_c)]
    asymptotic = [o for o in found if o.branch != "resolved"]
    errors = sorted((o for o in found if math.isfinite(o.error)), key=lambda o: o.error)
    times = np.array([o.seconds for o in found])
    print(
        f"{len(found)} points in {seconds:.0f} s: {len(unconverged)} not converged, {len(broken)} not finite"
    )
    for o in unconverged[:20]:
        print(f"  not converged: {o.point}: {o.reason}")
    lowest = f", lowest M {min(o.M for o in asymptotic):.3g}" if asymptotic else ""
    print(f"asymptotic branch: {len(asymptotic)} ({100.0 * len(asymptotic) / len(found):.1f} %){lowest}")
    print(f"without an error estimate: {len(found) - len(errors)}")
    for share in (0.5, 0.9, 0.99):
        error = errors[int(share * len(errors))].error
        print(f"error estimate of h_c, {100 * share:.0f} % of the points: {100 * error:.2f} %")
    print(f"worst error estimate: {100 * errors[-1].error:.2f} % at {errors[-1].point} ({errors[-1].branch})")
    resolved = [o for o in errors if o.branch == "resolved"]
    print(f"worst on the resolved branch: {100 * resolved[-1].error:.2f} % at {resolved[-1].point}")
    print(
        f"seconds per solve: median {np.median(times):.3f}, 90 % {np.quantile(times, 0.9):.3f}, worst {times.max():.2f}"
    )


if __name__ == "__main__":
    main()
