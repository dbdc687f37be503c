"""Cost of a step of BallScrewTransmission from a C host: set 6, step, get 2 (screw torque, nut force) or all outputs.

`python tests/benchmarks/bench_transmission_step.py [--law mechanistic]`: medians of many short runs; target 0.5 us for
the first. The map is the packaged one of the GD4008-3, or one in closed form with --law.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
sys.path.insert(0, str(Path(__file__).parents[1] / "support" / "fmu"))
from native_host import c_host
from synthetic_map import LAWS, make_map

from ballscrew_fmu.models import TRANSMISSION
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters

REPETITIONS, CALLS = 1001, 300
TARGET = 0.5e-6  # [s] set 6, step, get 2


def measure(
    folder: Path, nut_map, repetitions: int = REPETITIONS, calls: int = CALLS
) -> dict[str, list[float]]:
    """Median and least [s] by case."""
    program = c_host(nut_map, "transmission_costs", "-O2", "-ffp-contract=off", model=TRANSMISSION)
    run = subprocess.run(
        [str(program), folder.as_uri(), str(repetitions), str(calls)],
        capture_output=True,
        text=True,
        check=True,
    )
    return {name: [float(x) for x in numbers] for name, *numbers in map(str.split, run.stdout.splitlines())}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--law", choices=LAWS, help="a map in closed form of this friction law")
    law = parser.parse_args().law
    nut_map = make_map(law=law) if law else load_map(None, load_parameters())
    with tempfile.TemporaryDirectory() as folder:
        for name, (median, least) in measure(Path(folder), nut_map).items():
            print(f"set 6, step, get {name:4} median {1e6 * median:.3f} us, least {1e6 * least:.3f} us")


if __name__ == "__main__":
    main()
