"""Costs of the native FMU from a C host.

`python tests/benchmarks/bench_native_step.py` compiles the runtime with the C host native/step_costs.c
by the compiler and options of a build, and prints medians of many short runs, so that other work
on the machine does not count. `--law mechanistic`: a map of that friction law in closed form.
"""

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
sys.path.insert(0, str(Path(__file__).parents[1] / "support" / "fmu"))
import native_model
from synthetic_map import LAWS, make_map

from ballscrew_fmu.native_fmu.compile import COMPILER_OPTIONS, find_compiler
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_screw
from ballscrew_tehl.runtime.packed import FILM_SHEAR

REPETITIONS, CALLS = 1001, 300
#: what the host measures, in its order, and what it may cost [s]
CASES = {
    "3 inputs, torque; a drive cycle": 0.12e-6, "4 inputs, torque; axial load varies": 0.3e-6,
    "3 inputs, all outputs": 1e-6, "4 inputs, all outputs": 1e-6,
    "load the map, instantiate, initialize": 3e-3,
}  # fmt: skip


def text_of(seconds: float) -> str:
    return f"{1e3 * seconds:.2f} ms" if seconds >= 1e-3 else f"{1e6 * seconds:.3f} us"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--law", choices=LAWS, default=FILM_SHEAR)
    law = parser.parse_args().law
    nut_map = load_map(None, load_screw()) if law == FILM_SHEAR else make_map(law=law)
    native_model.compiler = lambda: [*find_compiler().command]
    host = native_model.c_host(nut_map, "step_costs", *COMPILER_OPTIONS)
    command = [host, str(REPETITIONS), str(CALLS), host.parent]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    seconds = np.array([line.split() for line in run.stdout.splitlines()], float)
    print(f"{'case':47s} {'median':>9s} {'least':>9s}  target")
    for (case, target), median, least in zip(
        CASES.items(), np.median(seconds, 0), seconds.min(0), strict=True
    ):
        print(f"{case:47s} {text_of(median):>9s} {text_of(least):>9s}  {text_of(target)}")


if __name__ == "__main__":
    main()
