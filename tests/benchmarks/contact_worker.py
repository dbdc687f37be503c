"""Timed solves of contacts by the package on the import path, which may be another version.

As a module: `timed`. As a script: version and path of the package in the first line of stdout, then one JSON reply per
JSON request on stdin, see Request; with --startup the seconds of the first two solves of one request instead.
Imports only what version 0.1.0 has, too.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import ballscrew_tehl
from ballscrew_tehl.contact.conditions import ContactConditions, SolverOptions
from ballscrew_tehl.contact.moes import solve_moes
from ballscrew_tehl.contact.solve import ContactSolution, solve_contact

try:
    from ballscrew_tehl.parameters.file import load_parameters
except ModuleNotFoundError:  # version 0.1.0
    from ballscrew_tehl.parameters import load_parameters

from kernel_clock import clear_caches, kernel_clock

PARAMETERS = load_parameters()


class Predictor(NamedTuple):
    """A start of a solve from solutions of neighbouring contacts along a line, nearest first."""

    neighbours: int
    start: Callable[[ContactConditions, Sequence[ContactSolution]], Any]


#: by name; a predictor of the package is added here, and imported when it is called: version 0.1.0 has none
PREDICTORS = {"nearest": Predictor(1, lambda conditions, neighbours: neighbours[0])}


class Request(NamedTuple):
    """One contact to time: thermal of the packaged oil if it has conditions (of ContactConditions), else Moes numbers.

    neighbours: conditions along a line, nearest first, for the predicted solve, none: no such solve
    moes: M, L, radius ratio, law;  options: of SolverOptions
    """

    options: dict[str, Any]
    conditions: dict[str, float] | None = None
    neighbours: list[dict[str, float]] | None = None
    predictor: str = "nearest"
    moes: tuple[float, float, float, str] | None = None


def thermal(
    conditions: dict[str, float], options: SolverOptions, start: Any = None
) -> tuple[ContactSolution, float, float]:
    """Solution, wall seconds and processor seconds."""
    at = ContactConditions(**conditions)
    wall, cpu = time.perf_counter(), time.process_time()
    solution = solve_contact(at, PARAMETERS.lubricant, PARAMETERS.solid, options, start)
    return solution, time.perf_counter() - wall, time.process_time() - cpu


def isothermal(
    moes: tuple[float, float, float, str], options: SolverOptions
) -> tuple[ContactSolution, float, float]:
    """The same of a contact by its Moes numbers."""
    wall, cpu = time.perf_counter(), time.process_time()
    solution = solve_moes(*moes, options).solution
    return solution, time.perf_counter() - wall, time.process_time() - cpu


def timed(request: Request) -> dict[str, Any]:
    """Figures of one contact.

    cold: without grids in the caches;  again: with them;  predicted: from the neighbours, whose grids are in the caches
    (NaN: not asked for, or one is not converged);  each wall seconds, and cpu_ of the processor
    kernels: share of the cold time in compiled kernels, of a solve of its own;  calls: of them from Python
    phases: shares of the cold time;  newton_step: seconds of the Reynolds phase of the fine grid per Newton step
    """
    options = SolverOptions(**request.options)

    def solved() -> tuple[ContactSolution, float, float]:
        if request.conditions is not None:
            return thermal(request.conditions, options)
        return isothermal(request.moes, options)

    clear_caches()
    solution, cold, cpu_cold = solved()
    _, again, cpu_again = solved()
    clear_caches()
    with kernel_clock() as clock:
        whole = solved()[1]
    predicted = cpu_predicted = h_predicted = float("nan")
    steps = len(solution.history.change)
    phases = {name: seconds / solution.seconds for name, seconds in solution.phases.items()}
    found = {
        "M": solution.M, "h_c": solution.h_c, "converged": solution.converged, "branch": solution.branch,
        "error_estimate": solution.error_estimate, "iterations": solution.iterations, "steps": steps,
        "deflections": solution.deflections, "nodes": solution.x.size, "lines": 2 * solution.y.size - 1,
        "cold": cold, "again": again, "cpu_cold": cpu_cold, "cpu_again": cpu_again,
        "kernels": clock.seconds / whole, "calls": clock.calls, "phases": phases,
        "newton_step": solution.phases.get("reynolds", float("nan")) / max(steps, 1),
    }  # fmt: skip
    if request.neighbours and request.conditions is not None:
        predictor = PREDICTORS[request.predictor]
        clear_caches()
        neighbours = [thermal(at, options)[0] for at in request.neighbours[: predictor.neighbours]]
        if all(neighbour.converged for neighbour in neighbours):
            start = predictor.start(ContactConditions(**request.conditions), neighbours)
            near, predicted, cpu_predicted = thermal(request.conditions, options, start)
            h_predicted = near.h_c
    return found | {"predicted": predicted, "cpu_predicted": cpu_predicted, "h_predicted": h_predicted}


def first_two(request: Request) -> list[float]:
    """Seconds of the first and of the second solve of this process; its processor seconds to the first solution."""
    options, seconds, used = SolverOptions(**request.options), [], []
    for _ in range(2):
        seconds.append(thermal(request.conditions or {}, options)[1])
        used.append(time.process_time())
    return [*seconds, used[0]]


def main() -> None:
    if sys.argv[1:] == ["--startup"]:
        print(json.dumps(first_two(Request(**json.loads(sys.stdin.readline())))))
        return
    print(json.dumps({"version": ballscrew_tehl.__version__, "path": ballscrew_tehl.__file__}), flush=True)
    for text in sys.stdin:
        print(json.dumps(timed(Request(**json.loads(text)))), flush=True)


if __name__ == "__main__":
    main()
