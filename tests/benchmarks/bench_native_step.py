"""Costs of the native FMU from a C host.

`python tests/benchmarks/bench_native_step.py` builds the library as it is delivered and the C host
native/step_costs.c with -O2 and prints medians of many short runs, so that other work on the machine does not
count. `--law mechanistic`: a map of that friction law in closed form.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
sys.path.insert(0, str(Path(__file__).parents[1] / "support" / "fmu"))
from native_host import c_host
from native_model import TOKEN
from synthetic_map import LAWS, make_map

from ballscrew_fmu.models import FRICTION
from ballscrew_fmu.native_fmu.compile import build_libraries
from ballscrew_fmu.native_fmu.map_file import MAP_FILE, map_bytes
from ballscrew_fmu.native_fmu.sources import native_sources
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.runtime.packed import FILM_SHEAR

REPETITIONS, CALLS = 1001, 300
TARGETS = {  # [s]
    "torque": 0.12e-6, "torque_axial": 0.3e-6, "all": 1e-6, "all_axial": 1e-6, "load": 3e-3,
}  # fmt: skip
CASES = {
    "torque": "3 inputs, torque; a drive cycle",
    "torque_axial": "4 inputs, torque; axial load varies",
    "all": "3 inputs, all outputs",
    "all_axial": "4 inputs, all outputs",
    "load": "load library and map, instantiate, initialize",
}


def host_command(folder: Path, nut_map) -> list[str]:
    """Command of the C host up to repetitions; everything built in the folder."""
    sources = native_sources(nut_map.header, 2, TOKEN)
    library = build_libraries(sources, FRICTION.native_name, ["x86_64-linux"])
    (folder / "native.so").write_bytes(library["x86_64-linux"])
    (folder / MAP_FILE).write_bytes(map_bytes(nut_map))
    host = c_host(nut_map, "step_costs", "-O2", runtime=False)
    return [str(host), str(folder / "native.so"), TOKEN, folder.as_uri()]


def measure(command: list[str], repetitions: int = REPETITIONS, calls: int = CALLS) -> dict[str, list[float]]:
    """Median and least [s] by case."""
    host, *arguments = command
    words = [host, str(repetitions), str(calls), *arguments]
    run = subprocess.run(words, capture_output=True, text=True, check=True)
    return {name: [float(x) for x in numbers] for name, *numbers in map(str.split, run.stdout.splitlines())}


def text_of(seconds: float) -> str:
    return f"{1e3 * seconds:.2f} ms" if seconds >= 1e-3 else f"{1e6 * seconds:.3f} us"


def table(figures: dict[str, list[float]]) -> str:
    lines = [f"{'case':47s} {'median':>9s} {'least':>9s}  target"]
    for name, title in CASES.items():
        target = text_of(TARGETS[name]) if name in TARGETS else ""
        lines.append(f"{title:47s} {' '.join(f'{text_of(x):>9s}' for x in figures[name])}  {target}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--law", choices=LAWS, default=FILM_SHEAR)
    law = parser.parse_args().law
    nut_map = load_map(None, load_parameters()) if law == FILM_SHEAR else make_map(law=law)
    with tempfile.TemporaryDirectory() as scratch:
        figures = measure(host_command(Path(scratch), nut_map))
    print(table(figures))


if __name__ == "__main__":
    main()
