"""Costs of the native FMU from a C host, compared with a trivial table FMU in C and the Python FMU in one run.

`python tests/benchmarks/bench_native_step.py` builds the libraries as they are delivered and the C host
native/step_costs.c with -O2 and prints medians of many short runs, so that other work on the machine does not
count. `--monitor`: the
FMUs BallScrewPreloadMonitor, which have no target. `--law mechanistic`: a map of that friction law in closed form.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from ctypes import c_double, c_size_t, c_uint
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))  # run as a script
sys.path.insert(0, str(Path(__file__).parents[1] / "support" / "fmu"))
from native_host import c_host
from native_model import TOKEN, compile_once
from paths import NATIVE_HOSTS
from synthetic_map import LAWS, make_map

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.models import FRICTION, MONITOR, TRANSMISSION, FmuModel
from ballscrew_fmu.native_fmu.compile import build_libraries
from ballscrew_fmu.native_fmu.map_file import MAP_FILE, map_bytes
from ballscrew_fmu.native_fmu.sources import fmi_headers, native_sources
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.runtime.packed import FILM_SHEAR

REPETITIONS, CALLS = 1001, 300
PYTHON = "python"
TARGETS = {  # [s]
    "torque": 0.12e-6, "torque_axial": 0.3e-6, "all": 1e-6, "all_axial": 1e-6, "load": 3e-3,
    "single_torque": 1e-6, "single_torque_axial": 1e-6, "single_all_axial": 1e-6,
}  # fmt: skip
CASES = {
    "torque": "3 inputs, torque; a drive cycle",
    "torque_axial": "4 inputs, torque; axial load varies",
    "all": "3 inputs, all outputs",
    "all_axial": "4 inputs, all outputs",
    "torque_speed": "3 inputs, torque; only speed varies",
    "torque_scattered": "3 inputs, torque; anywhere in the map",
    "torque_axial_scattered": "4 inputs, torque; anywhere",
    "all_scattered": "3 inputs, all outputs; anywhere",
    "all_axial_scattered": "4 inputs, all outputs; anywhere",
    "table": "table FMU in C: 3 inputs, torque",
    "load": "load library and map, instantiate, initialize",
    PYTHON: "Python FMU: 3 inputs, torque, raw ctypes",
}


def host_command(folder: Path, nut_map, model: FmuModel = FRICTION) -> list[str]:
    """Command of the C host up to repetitions; everything built in the folder."""
    sources = native_sources(nut_map.header, 2, TOKEN, model)
    library = build_libraries(sources, model.native_name, ["x86_64-linux"])
    (folder / "native.so").write_bytes(library["x86_64-linux"])
    (folder / MAP_FILE).write_bytes(map_bytes(nut_map))
    which = () if model is FRICTION else ("-DMONITOR",)
    host = c_host(nut_map, "step_costs", "-O2", *which, runtime=False)
    headers = {f"fmi/{name}": text for name, text in fmi_headers(2).items()}
    table = headers | {"table_fmu.c": (NATIVE_HOSTS / "table_fmu.c").read_bytes()}
    library = compile_once(table, "table.so", "-O2", "-shared", "-fPIC")
    return [str(host), str(folder / "native.so"), TOKEN, folder.as_uri(), str(library)]


def figures_of(words: list[str]) -> dict[str, list[float]]:
    """Median and least [s] by case, as a C host prints them; of single calls p50, p99, p99.9, largest, clock."""
    run = subprocess.run(words, capture_output=True, text=True, check=True)
    return {name: [float(x) for x in numbers] for name, *numbers in map(str.split, run.stdout.splitlines())}


def measure(command: list[str], repetitions: int = REPETITIONS, calls: int = CALLS) -> dict[str, list[float]]:
    host, *arguments = command
    return figures_of([host, str(repetitions), str(calls), *arguments])


def show_transmission(nut_map) -> None:
    """Cost of a step of BallScrewTransmission: set 6, step, get 2 (screw torque, nut force) or all outputs."""
    program = c_host(nut_map, "transmission_costs", "-O2", "-ffp-contract=off", model=TRANSMISSION)
    figures = figures_of([str(program), program.parent.as_uri(), str(REPETITIONS), str(CALLS)])
    for name, (median, least) in figures.items():
        print(
            f"set 6, step, get {name:4} median {text_of(median)}, least {text_of(least)}; target of get 2: 0.5 us"
        )


def python_step(fmu: Path, first: float = 2000.0, repetitions: int = 501, steps: int = 10) -> list[float]:
    """Median and least [s] of a step of the Python FMU through its C functions."""
    with FmuInstance(fmu) as one:
        library, handle = one.slave.dll, one.slave.component
        inputs, torque = (c_uint * 3)(0, 1, 2), (c_uint * 1)(4)
        values, found = (c_double * 3)(), (c_double * 1)()
        three, single, step, spent = c_size_t(3), c_size_t(1), c_double(1e-4), []
        for _ in range(repetitions):
            begin = time.perf_counter()
            for n in range(steps):
                values[:] = first * (1.0 + 5e-4 * n), 2.0 + 0.01 * n, 303.15 + 0.01 * n
                library.fmi2SetReal(handle, inputs, three, values)
                library.fmi2DoStep(handle, c_double(1e-4 * n), step, 1)
                library.fmi2GetReal(handle, torque, single, found)
            spent.append((time.perf_counter() - begin) / steps)
        return [statistics.median(spent), min(spent)]


def text_of(seconds: float) -> str:
    return f"{1e3 * seconds:.2f} ms" if seconds >= 1e-3 else f"{1e6 * seconds:.3f} us"


def table(figures: dict[str, list[float]], model: FmuModel = FRICTION) -> str:
    yardstick = figures["table"][0]
    targets = TARGETS if model is FRICTION else {}
    lines = [f"{'case':47s} {'median':>9s} {'least':>9s} {'x table':>8s}  target"]
    for name, title in CASES.items():
        median, least = figures[name]
        target = text_of(targets[name]) if name in targets else ""
        ratio = f"{median / yardstick:8.1f}"
        title = title if model is FRICTION or name == "table" else title.replace("torque", "preload")
        lines.append(f"{title:47s} {text_of(median):>9s} {text_of(least):>9s} {ratio}  {target}")
    lines.append(f"\nsteps one by one{'':31s} {'p50':>9s} {'p99':>9s} {'p99.9':>9s} {'largest':>9s}")
    for name, numbers in figures.items():
        if name.startswith("single_"):
            quantiles = " ".join(f"{text_of(x):>9s}" for x in numbers[:4])
            lines.append(f"{CASES[name.removeprefix('single_')]:47s} {quantiles}")
            clock = numbers[4]
    lines.append(f"target p99.9: {text_of(1e-6)}; {text_of(clock)} of reading the clock taken off each")
    lines.append(f"\nPython FMU over native FMU: {figures[PYTHON][0] / figures['torque'][0]:.0f}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--monitor", action="store_true", help="the preload monitor instead of the friction")
    parser.add_argument("--transmission", action="store_true", help="the transmission alone")
    parser.add_argument("--law", choices=LAWS, default=FILM_SHEAR)
    args = parser.parse_args()
    model, first = (MONITOR, 0.9) if args.monitor else (FRICTION, 2000.0)
    nut_map = load_map(None, load_parameters()) if args.law == FILM_SHEAR else make_map(law=args.law)
    with tempfile.TemporaryDirectory() as scratch:
        if args.transmission:
            show_transmission(nut_map)
            return
        command = host_command(Path(scratch), nut_map, model)
        figures = measure(command)
        fmu = build_fmu(nut_map, Path(scratch) / f"{model.name}.fmu", model=model).path
        figures[PYTHON] = python_step(fmu, first)
    print(table(figures, model))


if __name__ == "__main__":
    main()
