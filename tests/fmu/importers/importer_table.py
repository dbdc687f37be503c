#!/usr/bin/env python3
"""Print which importers run the FMUs, as a Markdown table with the numbers that the tests check.

python tests/fmu/importers/importer_table.py [--no-platforms] [--only TOOL]
.ci/importers installs all importers into a new environment and runs it.
"""

import argparse
import contextlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TextIO

sys.path.insert(0, str(Path(__file__).parents[2] / "support"))  # run as a script
sys.path.insert(0, str(Path(__file__).parents[2] / "support" / "fmu"))

import fmpy
import numpy as np
from importer_cases import (
    AGREEMENT,
    HELD,
    MASTER_AGREEMENT,
    MONITOR_AGREEMENT,
    NAMES,
    SMOOTH,
    below_special_characters,
    beside_the_monitor,
    coupled,
    differences,
    reference,
    replayed,
    subject,
    subjects_of,
    zero_findings,
)
from importers import MASTERS, REPLAYS, TOOLS, Master, Replay, problem, toolbox_findings, version
from platforms import EMULATED, HERE, outputs_on
from synthetic_map import make_map

HEAD = ("tool", "version", "way", "FMU", "kind", "result")
Line = tuple[str, ...]


def verdict(good: bool, text: str) -> str:
    return text if good else f"**{text}**"


def result(case: Callable[[], str], reason: str | None) -> str:
    if reason:
        return f"not run: {reason}"
    try:
        return case()
    except Exception as error:  # a failing importer is a line of the table
        return f"**{type(error).__name__}: {error}**"


SHORT = 24  # rows for two FMUs at a time, and for special characters


def replay_result(case: Replay, name: str) -> str:
    nut_map = make_map()
    rows, expected = reference(nut_map)
    worst = replayed(case, subject(name).friction, rows, expected)
    zeros = zero_findings(case, subject(name).friction)
    text = f"replay within {worst:.0e} of the map; zero inputs: " + ("; ".join(zeros) or "torque 0, no NaN")
    good = worst <= AGREEMENT and not zeros
    few = rows[:SHORT], expected[:SHORT]
    with below_special_characters(subject(name).friction) as fmu:
        worst = replayed(case, fmu, *few)
    good = good and worst <= AGREEMENT
    text += f"; below a path with blank, #, +, umlaut: {worst:.0e}"
    if case.kind == "CS":
        friction, monitor = beside_the_monitor(case, name, nut_map, *few)
        good = good and friction <= AGREEMENT and monitor <= MONITOR_AGREEMENT
        text += f"; beside the preload monitor: {friction:.0e}, that one {monitor:.0e}"
    return verdict(good, text)


def master_result(case: Master, name: str) -> str:
    friction, rotor = subject(name)[:2]
    with tempfile.TemporaryDirectory() as folder:
        worst = max(coupled(case, friction, rotor, c, Path(folder))[0] for c in (SMOOTH, HELD))
    return verdict(worst <= MASTER_AGREEMENT, f"with a rotor: within {worst:.0e} of the own loop")


def check_result(name: str) -> str:
    findings = toolbox_findings(subject(name).friction)
    return verdict(not findings, "; ".join(findings) or "schema and semantic check: no finding")


def platform_result(platform: str, fmi_version: int, unpacked: Path, scratch: Path) -> str:
    _, expected = outputs_on(HERE, unpacked, fmi_version, scratch)
    _, found = outputs_on(platform, unpacked, fmi_version, scratch)
    worst = float(differences(found, expected).max())
    equal = float(np.mean(found == expected))
    text = (
        f"100 points: {equal:.0%} of the numbers bit for bit as on x86_64 Linux, the rest within {worst:.0e}"
    )
    return verdict(worst <= AGREEMENT, "100 points: bit for bit as on x86_64 Linux" if equal == 1.0 else text)


def lines(platforms: bool, only: str | None) -> Iterator[Line]:
    for case in REPLAYS:
        for name in subjects_of(case) if only in (None, case.tool) else ():
            text = result(lambda c=case, n=name: replay_result(c, n), problem(case.tool))
            yield case.tool, version(case.tool), case.way, name, case.kind, text
    for master in MASTERS:
        for name in subjects_of(master) if only in (None, master.tool) else ():
            text = result(lambda c=master, n=name: master_result(c, n), problem(master.tool))
            yield master.tool, version(master.tool), master.way, name, "CS", text
    tool = "fmu-manipulation-toolbox"
    for name in NAMES if only in (None, tool) else ():
        yield tool, version(tool), "checks", name, "-", result(lambda n=name: check_result(n), problem(tool))
    if platforms:
        yield from platform_lines()


def platform_lines() -> Iterator[Line]:
    from ballscrew_fmu.native_fmu.package import build_native_fmu

    needed = (HERE, *(e.platform for e in EMULATED if e.problem() is None))
    with tempfile.TemporaryDirectory() as scratch:
        for fmi_version in (2, 3):
            path = Path(scratch) / f"{fmi_version}.fmu"
            build_native_fmu(make_map(), fmi_version, path, platforms=needed)
            unpacked = Path(fmpy.extract(str(path), unzipdir=str(path.with_suffix(""))))
            for e in EMULATED:
                text = result(
                    lambda e=e, v=fmi_version, u=unpacked: platform_result(e.platform, v, u, Path(scratch)),
                    e.problem(),
                )
                tool_version = e.version() if e.problem() is None else "-"
                name = f"native FMI {fmi_version}.0"
                yield e.tool, tool_version, f"C host, {e.platform}", name, "CS", text


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-platforms", action="store_true", help="leave out wine and qemu")
    parser.add_argument(
        "--only", choices=TOOLS, metavar="TOOL", help=f"one of {', '.join(TOOLS)}; without wine and qemu"
    )
    options = parser.parse_args()
    with own_output() as table:
        print(f"| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}", file=table, flush=True)
        failed = False
        for line in lines(not (options.no_platforms or options.only), options.only):
            print(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |", file=table, flush=True)
            failed = failed or line[-1].startswith("**")
    return 1 if failed else 0


@contextlib.contextmanager
def own_output() -> Iterator[TextIO]:
    """Standard output contains only the table; output of the importers goes to standard error."""
    kept = os.dup(1)
    os.dup2(2, 1)
    with os.fdopen(kept, "w") as table:
        yield table


if __name__ == "__main__":
    sys.exit(main())
