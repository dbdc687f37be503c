"""Cost per point of a map evaluated for many points at once, compared with scipy's RegularGridInterpolator.

`python tests/benchmarks/bench_map_evaluate.py [--points N] [--repeat N]`: the interpolator gets a table over the axes
of the map with as many columns as the map has surfaces, and as many points; linear, and cubic as the map is. In turn
in one run, median.
"""

import argparse
import os
import statistics
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.runtime.packed import COLUMNS


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--points", type=int, default=1_000_000, help="random points (default %(default)s)")
    parser.add_argument("--repeat", type=int, default=3, help="timed runs, median (default %(default)s)")
    args = parser.parse_args()
    nut_map = load_map(None, load_parameters())
    axes = nut_map.header["axes"]
    rng = np.random.default_rng(1)

    def inside(low: float, high: float) -> np.ndarray:
        return np.exp(rng.uniform(np.log(low), np.log(high), args.points))

    force, speed = inside(*axes["force"][:2]), inside(*axes["speed"][:2])
    temperature = rng.uniform(*axes["temperature"][:2], args.points)
    nodes = [np.linspace(0.0, 1.0, axes[name][2]) for name in ("force", "speed", "temperature")]
    table = rng.random((*(n.size for n in nodes), COLUMNS))
    points = rng.random((args.points, 3))
    linear = RegularGridInterpolator(nodes, table)
    cubic = RegularGridInterpolator(nodes, table, method="cubic")
    calls = {
        "map, no axial load": (lambda: nut_map.evaluate(force, speed, temperature), args.points),
        "map, axial load": (lambda: nut_map.evaluate(force, speed, temperature, 0.1 * force), args.points),
        f"RegularGridInterpolator, linear, {COLUMNS} columns": (lambda: linear(points), args.points),
        f"RegularGridInterpolator, cubic, {COLUMNS} columns": (lambda: cubic(points), args.points),
    }
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(args.repeat):
        for name, (call, size) in calls.items():
            begun = time.perf_counter()
            call()
            seconds[name].append((time.perf_counter() - begun) / size)
    for name, found in seconds.items():
        print(f"{name:48} {1e6 * statistics.median(found):8.3f} us per point")


if __name__ == "__main__":
    main()
