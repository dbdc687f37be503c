"""Timed solves of contacts by the package on the import path, which may be another version.

As a module: `timed`. As a script: version and path of the package in the first line of stdout, then one JSON reply per
JSON request on stdin, see Request.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any, NamedTuple

import ballscrew_tehl

try:
    from ballscrew_tehl.contact import ContactConditions, SolverOptions, reference_oil, solve
except ImportError:  # a checkout from before contact.solve
    from ballscrew_tehl.contact.conditions import ContactConditions, SolverOptions
    from ballscrew_tehl.contact.moes import reference_oil
    from ballscrew_tehl.contact.solve import solve_contact as solve
from ballscrew_tehl.parameters.file import load_parameters

PARAMETERS = load_parameters()


class Request(NamedTuple):
    """One contact to time.

    options: of SolverOptions;  conditions: of ContactConditions;  law: oil of the film references, None = packaged
    """

    options: dict[str, Any]
    conditions: dict[str, float]
    law: str | None = None


def _clear_caches() -> None:
    """Empty the caches of grids and operators of the contact solver: the next solve builds its own."""
    for name, module in sorted(sys.modules.items()):
        if name.startswith("ballscrew_tehl.contact"):
            for value in vars(module).values():
                if callable(getattr(value, "cache_clear", None)):
                    value.cache_clear()


def _solved(request: Request) -> tuple[Any, float, float]:
    """Result, wall seconds and processor seconds."""
    oil = PARAMETERS.lubricant if request.law is None else reference_oil(request.law)
    at, options = ContactConditions(**request.conditions), SolverOptions(**request.options)
    wall, cpu = time.perf_counter(), time.process_time()
    result = solve(at, oil, PARAMETERS.solid, options)
    return result, time.perf_counter() - wall, time.process_time() - cpu


def timed(request: Request) -> dict[str, Any]:
    """Figures of one contact: wall seconds cold, without grids in the caches, and again, with them; cpu_ of each."""
    _clear_caches()
    result, cold, cpu_cold = _solved(request)
    _, again, cpu_again = _solved(request)
    return {
        "h_c": result.h_c, "converged": result.converged, "branch": result.branch,
        "error_estimate": result.error_estimate, "iterations": result.iterations, "deflections": result.deflections,
        "cold": cold, "again": again, "cpu_cold": cpu_cold, "cpu_again": cpu_again,
    }  # fmt: skip


def main() -> None:
    print(json.dumps({"version": ballscrew_tehl.__version__, "path": ballscrew_tehl.__file__}), flush=True)
    for line in sys.stdin:
        print(json.dumps(timed(Request(**json.loads(line)))), flush=True)


if __name__ == "__main__":
    main()
