"""Cost and certificate of the maps of many screws.

`python tests/benchmarks/bench_maps.py [--screws FOLDER] [--only NAME ...] [--quick] [--count N] [--workers W]
[--maps FOLDER] [--output FILE.csv]` builds the map of every screw file of a folder (default: tests/data/screws) and of
the packaged screw in both kinematics by the command `map build`, and prints for each: contacts, seconds, core-seconds,
contacts not solved, share of asymptotic ones and the errors of the certificate. With --output a screw is one row as
soon as its map is finished; the same command again builds those that are missing, and continues an interrupted one
with the contacts in --maps (default: next to the output). Its seconds are then those of the rest alone (column "kept":
contacts from before).

`--workers-ratio [--only NAME ...] [--quick] [--count N]` builds each map anew with one worker and with two and prints
the ratio of their seconds, start of the processes and work between the contacts included, with the load of the machine
before and after (processes that run or wait, mean of a minute): other load lowers it.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import math
import os
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from result_file import ResultFile, solver_hash

import ballscrew_tehl.nut_map
from ballscrew_tehl.cli.main import INTERRUPTED
from ballscrew_tehl.cli.main import main as command
from ballscrew_tehl.cli.shared.results import table
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import changed, load_parameters
from ballscrew_tehl.physics.kinematics import KINEMATICS

SCREWS = Path(__file__).parents[1] / "data" / "screws"
#: exit code of the command if too few contacts converge
NOT_CONVERGED = 1
#: columns of the table that are shown in percent
PERCENT = ("asymptotic", "torque_mean", "torque_99", "torque_max", "film_99", "rise_99")


class Built(NamedTuple):
    """One map; errors of its certificate are relative. code: exit code of the command, without a map NaN."""

    screw: str
    quick: bool
    count: int
    code: int
    contacts: int
    kept: int
    seconds: float
    core_seconds: float
    not_solved: int
    range_cut: str
    asymptotic: float
    points: int
    points_not_solved: int
    torque_mean: float
    torque_99: float
    torque_max: float
    film_99: float
    rise_99: float


class Case(NamedTuple):
    """A screw: options of the command that select it."""

    name: str
    options: tuple[str, ...]


def cases(folder: Path, only: Sequence[str] | None = None) -> list[Case]:
    """The screws of a folder and the packaged one in each kinematics.

    Raises       ValueError: no such folder, or a name that is none of them
    """
    files = sorted(folder.glob("*.toml"))
    if not files:
        raise ValueError(f"{folder}: no screw files *.toml")
    found = [Case(file.stem, ("--screw", str(file))) for file in files]
    found += [Case(f"gd4008_{name}", ("--kinematics", name)) for name in KINEMATICS]
    unknown = set(only or ()) - {case.name for case in found}
    if unknown:
        raise ValueError(f"--only {', '.join(sorted(unknown))}; allowed: {', '.join(c.name for c in found)}")
    return [case for case in found if only is None or case.name in only]


def core_time() -> float:
    """Processor time of this process and of those that it has waited for [s]."""
    now = os.times()
    return now.user + now.system + now.children_user + now.children_system


def build(case: Case, maps: Path, quick: bool, count: int, workers: int | None) -> Built:
    """Build one map and read its figures.

    Raises       KeyboardInterrupt; SystemExit: bad input, with the line that the command has printed
    """
    path = maps / f"{case.name}.nc"
    journal = path.with_name(path.name + ".contacts")
    kept = len(journal.read_bytes().splitlines()) - 1 if journal.exists() else 0
    words = ["map", "build", *case.options, "--output", str(path), "--count", str(count), "--json"]
    words += ["--quick"] if quick else []
    words += ["--workers", str(workers)] if workers is not None else []
    begun, used = time.perf_counter(), core_time()
    with contextlib.redirect_stdout(io.StringIO()):
        code = command(words)
    seconds, core_seconds = time.perf_counter() - begun, core_time() - used
    if code == INTERRUPTED:
        raise KeyboardInterrupt
    if code not in (0, NOT_CONVERGED):
        raise SystemExit(code)
    if code == NOT_CONVERGED:
        return Built(
            case.name, quick, count, code, 0, 2 * kept, seconds, core_seconds, 0, "", math.nan, 0, 0,
            *[math.nan] * 5,
        )  # fmt: skip
    options = dict(zip(case.options[::2], case.options[1::2], strict=True))
    parameters = load_parameters(options.get("--screw"))
    if "--kinematics" in options:
        parameters = changed(parameters, friction={"kinematics": options["--kinematics"]})
    header = load_map(path, parameters).header
    certificate = header["certificate"]
    return Built(
        case.name, quick, count, code, header["contacts"], 2 * kept, seconds, core_seconds,
        header["contacts_not_solved"], header["range_cut"], header["asymptotic_share"],
        certificate["points"], certificate["points_not_solved"],
        certificate["torque_error_mean"], certificate["torque_error_99"], certificate["torque_error_max"],
        certificate["film_error_99"], certificate["temperature_rise_error_99"],
    )  # fmt: skip


class Ratio(NamedTuple):
    """Seconds of the build of one map with one worker and with two. load: of the machine before and after."""

    screw: str
    contacts: int
    one: float
    two: float
    ratio: float
    load_before: float
    load_after: float


def workers_ratio(case: Case, quick: bool, count: int) -> Ratio:
    """Build a map with one worker and with two.

    Raises       ArithmeticError: no map, or two workers wrote other bytes than one
    """
    before = os.getloadavg()[0]
    built, files = [], []
    for workers in (1, 2):
        with tempfile.TemporaryDirectory() as folder:
            built.append(build(case, Path(folder), quick, count, workers))
            if built[-1].code:
                raise ArithmeticError(f"{case.name}: no map")
            files.append((Path(folder) / f"{case.name}.nc").read_bytes())
    if files[0] != files[1]:
        raise ArithmeticError(f"{case.name}: two workers write other bytes than one")
    one, two = (each.seconds for each in built)
    return Ratio(case.name, built[0].contacts, one, two, one / two, before, os.getloadavg()[0])


def ratio_report(rows: Sequence[Ratio]) -> str:
    """Table of the ratios."""
    head = [name.replace("_", " ") for name in Ratio._fields]
    cells = [[row.screw, str(row.contacts), *(f"{value:.2f}" for value in row[2:])] for row in rows]
    return table([head, *cells])


def report(rows: Sequence[Built]) -> str:
    """Table of the maps; errors and shares in percent."""
    names = [name for name in Built._fields if name not in ("quick", "count", "range_cut")]
    head = [f"{name.replace('_', ' ')} [%]" if name in PERCENT else name.replace("_", " ") for name in names]
    lines = [head]
    for row in rows:
        cells = []
        for name in names:
            value = getattr(row, name)
            if name in PERCENT:
                value = f"{100.0 * value:.3g}"
            elif isinstance(value, float):
                value = f"{value:.1f}"
            cells.append(str(value))
        lines.append(cells)
    cuts = [f"{row.screw}: {row.range_cut}" for row in rows if row.range_cut]
    return "\n".join([table(lines), *cuts])


def parser() -> argparse.ArgumentParser:
    """Options of this command."""
    options = argparse.ArgumentParser(description="Cost and certificate of the maps of many screws.")
    options.add_argument("--screws", type=Path, default=SCREWS, metavar="FOLDER", help="screw files *.toml")
    options.add_argument("--only", nargs="+", metavar="NAME", help="these screws alone")
    options.add_argument("--quick", action="store_true", help="few contacts")
    options.add_argument("--count", type=int, default=200, metavar="N", help="points of each certificate")
    options.add_argument("--workers", type=int, metavar="W", help="processes; default: one per core")
    options.add_argument("--workers-ratio", action="store_true", help="seconds with one worker over two")
    options.add_argument("--maps", type=Path, metavar="FOLDER", help="keep the maps, and continue them")
    options.add_argument("--output", type=Path, metavar="FILE.csv", help="figures of finished maps")
    return options


def main(arguments: Sequence[str] | None = None) -> list[Built]:
    """Run the benchmark; returns the rows of the table, none with --workers-ratio."""
    options = parser().parse_args(arguments)
    wanted = cases(options.screws, options.only)
    if options.workers_ratio:
        print(ratio_report([workers_ratio(case, options.quick, options.count) for case in wanted]))
        return []
    key = "screw", "quick", "count"
    # also the interpolation changes the figures
    solver = solver_hash(Path(ballscrew_tehl.nut_map.__path__[0]))
    file = ResultFile(options.output, Built, key, solver)
    done = file.cases()
    with contextlib.ExitStack() as stack:
        maps = options.maps or (options.output and options.output.with_suffix(".maps"))
        maps = maps or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        with contextlib.suppress(KeyboardInterrupt):
            for case in wanted:
                if (case.name, options.quick, options.count) not in done:
                    file.append(build(case, maps, options.quick, options.count, options.workers))
    names = {case.name for case in wanted}
    rows = [row for row in file.rows if row.screw in names and row[1:3] == (options.quick, options.count)]
    if rows:
        print(report(rows))
    return rows


if __name__ == "__main__":
    main()
