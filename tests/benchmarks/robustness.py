"""Robustness of the contact solve over its whole range, at points of a Sobol sequence.

`python tests/benchmarks/robustness.py [--points N] [--thermal] [--layers K] [--roughness-um S] [--workers W]
[--output FILE.csv]` solves N contacts and prints how many did not converge, are not a number or took the asymptotic
branch (and the lowest load that did), the worst error estimate, the worst heat balance and seconds per contact.
`--case K` solves point K alone, for one that is listed as not converged.
Isothermal: radius ratio 0.03 to 1, Moes M 1.5 to 2e6, L 1.8 to 40 (ratio and M over their logarithms), both oil laws.
Thermal: contacts of the packaged screw over the range of its map, both raceways and kinematics; --layers multiplies the
layers through the film, --roughness-um is the composite roughness of both bodies.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from contact_sample import compile_kernels, point_at, sobol_cube
from result_file import ResultFile
from rich.progress import Progress

from ballscrew_tehl.contact import ContactResult, SolverOptions, solve, solve_moes

#: relative gap of a heat balance that is counted
BALANCE = 0.01


class Variant(NamedTuple):
    """What the points are solved with: factor on the layers."""

    thermal: bool = False
    layers: float = 1.0

    @property
    def options(self) -> str:
        """The options of this command that select it."""
        words = ["--thermal"] if self.thermal else []
        words += [f"--layers {self.layers:g}"] if self.layers != 1.0 else []
        return " ".join(words)


class Outcome(NamedTuple):
    """What became of one point. Without heat NaN: heat_balance, its relative gap, extreme_rise [K], from the bath."""

    variant: str
    seed: int
    number: int
    point: str
    M: float
    h_c: float
    h_m: float
    converged: bool
    reason: str
    branch: str
    error: float
    iterations: int
    heat_balance: float
    extreme_rise: float
    seconds: float


def isothermal(u: np.ndarray) -> tuple[str, ContactResult]:
    """One point of the unit cube as Moes numbers."""
    ratio = 0.03 * (1.0 / 0.03) ** u[0]
    M = 1.5 * (2e6 / 1.5) ** u[1]
    L = 1.8 + 38.2 * u[2]
    law = "barus" if u[3] < 0.5 else "roelands"
    return f"ratio {ratio:.4g} M {M:.4g} L {L:.4g} {law}", solve_moes(M, L, ratio, law).result


def thermal(u: np.ndarray, variant: Variant) -> tuple[str, ContactResult]:
    """One point of the unit cube as a contact of the packaged screw."""
    point, options = point_at(u), SolverOptions()
    options = replace(options, n_z=2 * round(0.5 * variant.layers * options.n_z))
    return str(point), solve(point.conditions, point.parameters.lubricant, point.parameters.solid, options)


def outcome(variant: Variant, seed: int, number: int, u: np.ndarray) -> Outcome:
    """Solve one point."""
    point, s = thermal(u, variant) if variant.thermal else isothermal(u)
    balance, rise = math.nan, math.nan
    if s.heat_balance is not None and s.temperature is not None:
        balance = s.heat_balance.defect
        rise = float(np.max(np.abs(s.temperature - s.conditions.temperature)))
    return Outcome(
        variant.options, seed, number, point, s.M, s.h_c, s.h_m, s.converged, s.reason, s.branch, s.error_estimate,
        s.iterations, balance, rise, s.seconds,
    )  # fmt: skip


def outcomes(points: dict[int, np.ndarray], variant: Variant, seed: int, workers: int) -> Iterator[Outcome]:
    """Solve points by their number, in the order in which they end; one worker: in this process."""
    solved = partial(outcome, variant, seed)
    if workers == 1:
        compile_kernels()
        for number, u in points.items():
            yield solved(number, u)
        return
    with ProcessPoolExecutor(workers, initializer=compile_kernels) as pool:
        try:
            for job in as_completed([pool.submit(solved, *point) for point in points.items()]):
                yield job.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def run(
    points: dict[int, np.ndarray], variant: Variant, seed: int, workers: int, output: Path | None
) -> list[Outcome]:
    """Outcomes of the points; those that the output holds are not solved again."""
    file = ResultFile(output, Outcome, ("variant", "seed", "number"))
    done = file.cases()
    left = {number: u for number, u in points.items() if (variant.options, seed, number) not in done}
    with Progress() as progress:
        bar = progress.add_task("contacts", total=len(points), completed=len(points) - len(left))
        try:
            for found in outcomes(left, variant, seed, workers):
                file.append(found)
                progress.advance(bar)
                if not found.converged:
                    progress.console.print(case(found), highlight=False, soft_wrap=True)
        except KeyboardInterrupt:
            progress.console.print("interrupted")
    return [
        row
        for row in file.rows
        if (row.variant, row.seed) == (variant.options, seed) and row.number in points
    ]


def case(found: Outcome) -> str:
    """One line on an unconverged point, with the options that solve it again."""
    again = f"--case {found.number} --seed {found.seed} {found.variant}".rstrip()
    return f"  not converged: {found.point}: {found.reason} ({again})"


def report(found: list[Outcome], seconds: float) -> dict[str, float]:
    """Print the counts and the worst points; the counts."""
    unconverged = [o for o in found if not o.converged]
    broken = [o for o in found if not (math.isfinite(o.h_c) and math.isfinite(o.h_m))]
    asymptotic = [o for o in found if o.branch != "resolved"]
    errors = sorted((o for o in found if math.isfinite(o.error)), key=lambda o: o.error)
    times = np.array([o.seconds for o in found])
    print(
        f"{len(found)} points in {seconds:.0f} s: {len(unconverged)} not converged, {len(broken)} not finite"
    )
    for o in unconverged:
        print(case(o))
    lowest = f", lowest M {min(o.M for o in asymptotic):.3g}" if asymptotic else ""
    print(f"asymptotic branch: {len(asymptotic)} ({100.0 * len(asymptotic) / len(found):.1f} %){lowest}")
    print(f"without an error estimate: {len(found) - len(errors)}")
    if errors:
        for share in (0.5, 0.9, 0.99):
            error = errors[int(share * len(errors))].error
            print(f"error estimate of h_c, {100 * share:.0f} % of the points: {100 * error:.2f} %")
        print(
            f"worst error estimate: {100 * errors[-1].error:.2f} % at {errors[-1].point} ({errors[-1].branch})"
        )
    if resolved := [o for o in errors if o.branch == "resolved"]:
        print(f"worst on the resolved branch: {100 * resolved[-1].error:.2f} % at {resolved[-1].point}")
    if balanced := sorted(
        (o for o in found if math.isfinite(o.heat_balance)), key=lambda o: abs(o.heat_balance)
    ):
        worst, over = balanced[-1], sum(abs(o.heat_balance) > BALANCE for o in balanced)
        print(
            f"heat balance: {over} above {100.0 * BALANCE:g} %, worst {100.0 * worst.heat_balance:.2g} % "
            f"(largest rise {worst.extreme_rise:.2g} K) at {worst.point}"
        )
    slowest = max(found, key=lambda o: o.seconds)
    print(
        f"seconds per contact: median {np.median(times):.3f}, 90 % {np.quantile(times, 0.9):.3f}, "
        f"worst {slowest.seconds:.2f} at {slowest.point}"
    )
    return {
        "points": len(found),
        "not converged": len(unconverged),
        "not finite": len(broken),
        "asymptotic": len(asymptotic),
    }


def main(arguments: list[str] | None = None) -> dict[str, float] | None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--points", type=int, default=2000, help="points of the sequence (default 2000)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the sequence (default 1)")
    parser.add_argument("--thermal", action="store_true", help="thermal contacts of the packaged screw")
    parser.add_argument("--layers", type=float, default=1.0, help="factor on the layers of thermal contacts")
    parser.add_argument("--case", type=int, help="solve this point of the sequence alone")
    parser.add_argument("--output", type=Path, help="CSV file that the outcomes are added to")
    parser.add_argument(
        "--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)"
    )
    args = parser.parse_args(arguments)
    variant = Variant(args.thermal, args.layers)
    if not variant.thermal and variant != Variant():
        parser.error("--layers needs --thermal")
    begun = time.perf_counter()
    if args.case is not None:
        found = outcome(variant, args.seed, args.case, sobol_cube(args.case + 1, args.seed)[-1])
        for name, value in found._asdict().items():
            print(f"{name:12s} {value}")
        return report([found], time.perf_counter() - begun)
    points = dict(enumerate(sobol_cube(args.points, args.seed)))
    found = run(points, variant, args.seed, args.workers, args.output)
    return report(found, time.perf_counter() - begun) if found else None


if __name__ == "__main__":
    main()
