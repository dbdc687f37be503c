"""The contacts of a map, timed cold and predicted, by one solver or by two in alternation."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from contact_sample import RANGE, Point
from contact_worker import PREDICTORS, Request
from reference_screw import published_rows
from result_file import FigureFile

from ballscrew_tehl.contact.ball_contact import MAP_NODES

Figures = dict[str, Any]
#: by name
Solvers = Mapping[str, Callable[[Request], Figures]]
#: ball load between neighbouring nodes of the finest map
LOAD_STEP = float(RANGE.load[1] / RANGE.preloaded) ** (1.0 / 32.0)
#: quantities that are seconds and shown in milliseconds
TIMES = {
    "cold": "cold, grid and operators built",
    "again": "cold, grid and operators known",
    "predicted": "predicted",
    "cpu_cold": "processor time, cold",
    "cpu_again": "processor time, cold, grid known",
    "cpu_predicted": "processor time, predicted",
    "newton_step": "Newton step of the fine grid",
}
COUNTS = {
    "steps": "Newton steps of the fine grid",
    "iterations": "iterations of the fine grid",
    "deflections": "deflections of the fine grid",
    "calls": "kernel calls from Python",
}


def map_requests(points: Sequence[Point], predictor: str = "nearest") -> list[Request]:
    """Contacts of a map, each with neighbours at the next higher loads for the predictor."""
    found = []
    for point in points:
        neighbours = [
            asdict(point._replace(load=point.load * LOAD_STEP**step).conditions)
            for step in range(1, 1 + PREDICTORS[predictor].neighbours)
        ]
        found.append(Request({"n_x": MAP_NODES}, asdict(point.conditions), neighbours, predictor))
    return found


def circle_request(M: str = "200", L: str = "10") -> Request:
    """A row of the film references with the radius ratio 1, on 129 x 129 nodes over its domain."""
    (row,) = [
        row
        for row in published_rows("film_references.csv")
        if (row["rheology"], row["M"], row["L"], row["lambda"]) == ("comp-Roelands", M, L, "1.0")
    ]
    x_in, x_out = (float(v) for v in row["domain_x"].split(".."))
    y_max = float(row["domain_y"].removeprefix("+-").removesuffix("b"))
    options = {"thermal": False, "n_x": 129, "n_y": 65, "x_in": x_in, "x_out": x_out, "y_max": y_max}
    return Request(options, moes=(float(M), float(L), 1.0, "roelands"))


def measure(
    requests: Sequence[Request],
    solvers: Solvers,
    progress: Callable[[int], None] = lambda done: None,
) -> dict[str, list[Figures]]:
    """Figures of every request by every solver; they take turns, and each comes first every other time.

    The first request is measured once more before, without effect: kernels are compiled or loaded. After Ctrl-C the
    contacts so far.
    """
    found: dict[str, list[Figures]] = {name: [] for name in solvers}
    order = list(solvers)
    try:
        for name in order:
            solvers[name](requests[0])
        for done, request in enumerate(requests):
            figures = {name: solvers[name](request) for name in order}
            for name in solvers:
                found[name].append(figures[name])
            order.reverse()
            progress(done + 1)
    except KeyboardInterrupt:
        print("interrupted")
    return found


def column(rows: Sequence[Figures], name: str) -> np.ndarray:
    """One quantity of all contacts."""
    return np.array([row[name] for row in rows], dtype=float)


def summary(rows: Sequence[Figures]) -> dict[str, float]:
    """Medians, 90 % quantiles and largest values by "quantity, which [unit]"; NaN times do not count.

    Phases are shares of all cold seconds together; "rest" is Python between them and starts on other grids.
    """
    found: dict[str, float] = {}
    for name, shown in TIMES.items():
        seconds = column(rows, name)
        seconds = seconds[np.isfinite(seconds)]
        if seconds.size:
            found[f"{shown}, median [ms]"] = 1e3 * float(np.median(seconds))
            found[f"{shown}, 90 % [ms]"] = 1e3 * float(np.quantile(seconds, 0.9))
            found[f"{shown}, largest [ms]"] = 1e3 * float(np.max(seconds))
    for name, shown in COUNTS.items():
        found[f"{shown}, median"] = float(np.median(column(rows, name)))
    cold = column(rows, "cold")
    outside = 1.0 - float(np.sum(column(rows, "kernels") * cold) / np.sum(cold))
    found["outside compiled kernels [%]"] = 100.0 * outside
    names = sorted({name for row in rows for name in row["phases"]})
    shares = {
        name: 100.0
        * float(np.sum([row["phases"].get(name, 0.0) * row["cold"] for row in rows]) / np.sum(cold))
        for name in names
    }
    shares["rest"] = 100.0 - sum(shares.values())
    found |= {f"phase {name} [%]": share for name, share in shares.items()}
    found["error estimate, median [%]"] = 100.0 * float(np.nanmedian(column(rows, "error_estimate")))
    moved = np.abs(column(rows, "h_predicted") / column(rows, "h_c") - 1.0)
    if np.isfinite(moved).any():
        found["h_c predicted to cold, largest [%]"] = 100.0 * float(np.nanmax(moved))
    found["not converged"] = float(np.sum(~column(rows, "converged").astype(bool)))
    found["asymptotic"] = float(sum(row["branch"] != "resolved" for row in rows))
    return found


def table(found: Mapping[str, Sequence[Figures]]) -> list[tuple[str, ...]]:
    """Rows: quantity, figure of each solver, and with two solvers the ratio first over second, of times and counts."""
    figures = {name: summary(rows) for name, rows in found.items()}
    names = list(dict.fromkeys(quantity for each in figures.values() for quantity in each))
    lines = []
    for quantity in names:
        values = [each.get(quantity, float("nan")) for each in figures.values()]
        lines.append((quantity, *(f"{value:.4g}" for value in values)))
        if len(values) == 2 and "%]" not in quantity and ("[ms]" in quantity or ", median" in quantity):
            lines[-1] += (f"{values[0] / values[1]:.3f}",)
    if len(found) == 2:
        first, second = (column(rows, "h_c") for rows in found.values())
        moved = 100.0 * np.abs(first / second - 1.0)
        lines.append(("h_c first to second, median [%]", f"{np.nanmedian(moved):.3g}"))
        lines.append(("h_c first to second, largest [%]", f"{np.nanmax(moved):.3g}"))
    return lines


def show_contacts(
    part: str, heading: str, requests: list[Request], solvers: Solvers, output: FigureFile
) -> None:
    """Measure and print one of the parts that compare solvers."""
    print(heading)
    every = max(1, len(requests) // 10)

    def progress(done: int) -> None:
        if len(requests) > 10 and done % every == 0:
            print(f"    {done} of {len(requests)}", file=sys.stderr, flush=True)

    found = measure(requests, solvers, progress)
    if not next(iter(found.values())):
        return
    titles = [*solvers, "ratio"] if len(solvers) == 2 else list(solvers)
    print(f"{'':54s}" + "".join(f"{title:>12s}" for title in titles))
    for quantity, *values in table(found):
        print(f"{quantity:54s}" + "".join(f"{value:>12s}" for value in values))
        for title, value in zip(titles, values, strict=False):
            output.add(part, "median of contacts", {quantity: value}, title)
    for solver, rows in found.items():
        for number, row in enumerate(rows):
            output.add(part, str(number), {k: v for k, v in row.items() if k != "phases"}, solver)
