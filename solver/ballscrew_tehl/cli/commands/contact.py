"""The command `contact`: one contact by its dimensions or by its Moes numbers, from options or from a CSV file."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ..._version import __version__
from ...tables.csv_file import read_rows
from ..parser import LAWS, RHEOLOGIES
from ..shared.points import check_rows
from ..shared.progress import QUIET, progress_bar
from ..shared.results import print_results

DIMENSIONS = ("load_n", "radius_x_m", "radius_y_m", "u1_m_s", "u2_m_s", "temperature_k")
#: of a table
COLUMNS = ("Hc", "Hm", "M", "L", "h_c_m", "h_m_m", "p_max_pa", "temperature_rise_k", "traction_force_n", "converged",
           "error_estimate")  # fmt: skip
MOES = ("moes", "radius_ratio", "law")


def _numbers(count: int, allowed: str) -> Callable[[str], list[float]]:
    def parse(text: str) -> list[float]:
        found = [float(part) for part in text.split()]
        if len(found) != count or not all(math.isfinite(value) for value in found):
            raise ValueError(allowed)
        return found

    return parse


def _one_of(names: tuple[str, ...]) -> Callable[[str], str]:
    def parse(text: str) -> str:
        if text not in names:
            raise ValueError(text)
        return text

    return parse


def _number(text: str) -> float:
    return _numbers(1, "")(text)[0]


def _flag(text: str) -> bool:
    return {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False}[text.lower()]


#: field -> reader of its text, what is allowed
FIELDS: dict[str, tuple[Callable[[str], Any], str]] = {
    **dict.fromkeys(DIMENSIONS, (_number, "a finite number")),
    "moes": (_numbers(2, ""), "two numbers, M and L"),
    "radius_ratio": (_number, "a number, 0 < R_x/R_y <= 1"),
    "law": (_one_of(LAWS), ", ".join(LAWS)),
    "domain": (_numbers(3, ""), "three numbers: XA XB along rolling, Y across, in Hertz half-widths"),
    "rheology": (_one_of(RHEOLOGIES), ", ".join(RHEOLOGIES)),
    "isothermal": (_flag, "true, false"),
    "refine": (_number, "a number, 1 to 8"),
}


def _read(where: str, fields: dict[str, str]) -> dict[str, Any]:
    """Values of the fields of one contact.

    Raises       ValueError: unknown field, a value not allowed, neither dimensions nor Moes numbers complete
    """

    def shown(name: str) -> str:
        return where + (name.replace("_", "-") if where == "--" else name)

    values: dict[str, Any] = {}
    for name, text in fields.items():
        if name not in FIELDS:
            raise ValueError(f"{shown(name)}: unknown; allowed: {', '.join(FIELDS)}")
        parse, allowed = FIELDS[name]
        try:
            values[name] = parse(text)
        except (ValueError, KeyError):
            raise ValueError(f"{shown(name)} = {text}; allowed: {allowed}") from None
    group, other = (MOES, DIMENSIONS) if "moes" in values else (DIMENSIONS, MOES)
    for name in group:
        if name not in values:
            raise ValueError(f"{shown(name)} (missing); allowed: {FIELDS[name][1]}")
    for name in other:
        if name in values:
            raise ValueError(
                f"{shown(name)} = {values[name]}; allowed: either {', '.join(MOES)} or dimensions"
            )
    return values


def run_contact(args: Namespace) -> int:
    """Solve the contacts; exit code 1 if one did not converge."""
    given: dict[str, str] = {}
    for name in FIELDS:
        value = getattr(args, name)
        if value is True:
            given[name] = "true"
        elif value not in (None, False):
            given[name] = " ".join(value) if isinstance(value, list) else str(value)
    if args.points is None:
        contacts = [_read("--", given)]
    else:
        rows = read_rows(args.points)
        filled = [{key.lower(): text for key, text in row.items() if text} for row in rows]
        contacts = [
            _read(f"{args.points}: row {index}: ", {**given, **row})
            for index, row in enumerate(filled, start=1)
        ]
    check_rows(args)
    results: list[dict[str, Any]] = []
    with progress_bar(QUIET) as progress:
        for contact in contacts:
            progress(len(results), len(contacts), "contacts solved")
            results.append(_solve(contact, args.screw))
        progress(len(results), len(contacts), "contacts solved")
    print_results(
        [{**result, "version": __version__} for result in results], args.json, args.points is not None, {}, COLUMNS,
        args.output,
    )  # fmt: skip
    return 0 if all(result["converged"] for result in results) else 1


def _solve(contact: dict[str, Any], screw_file: str | None) -> dict[str, Any]:
    from ...contact import SolverOptions

    moes = "moes" in contact
    options = SolverOptions(thermal=not (moes or contact.get("isothermal", False)))
    if "domain" in contact:
        x_in, x_out, y_max = contact["domain"]
        if not (x_in < -1.0 and x_out > 1.0 and y_max > 1.0):
            raise ValueError(f"domain = {x_in:g} {x_out:g} {y_max:g}; allowed: XA < -1, XB > 1, Y > 1")
        options = replace(options, x_in=x_in, x_out=x_out, y_max=y_max)
    if "refine" in contact:
        options = options.refined(contact["refine"])
    return _by_moes(contact, options) if moes else _by_dimensions(contact, options, screw_file)


def _by_moes(contact: dict[str, Any], options: Any) -> dict[str, Any]:
    """Isothermal film in Moes units.

    error_estimate: relative, of Hc: change by the extrapolation from half the nodes
    """
    from ...contact import solve_moes

    M, L = contact["moes"]
    found = solve_moes(M, L, contact["radius_ratio"], contact["law"], options)
    solution = found.result
    return {
        "Hc": found.Hc,
        "Hm": found.Hm,
        "converged": bool(solution.converged),
        "branch": solution.branch,
        "error_estimate": solution.error_estimate,
        "seconds": solution.seconds,
        "M": solution.M,
        "L": solution.L,
        "reason": solution.reason,
    }


def _by_dimensions(contact: dict[str, Any], options: Any, screw_file: str | None) -> dict[str, Any]:
    from ...contact import ContactConditions, solve
    from ...parameters.file import changed, load_screw
    from ...physics.hertz import E_prime

    parameters = load_screw(screw_file)
    load, R_x, R_y, u_1, u_2, temperature = (contact[name] for name in DIMENSIONS)
    conditions = ContactConditions(load, R_x, R_y, u_1, u_2, temperature, E_prime(parameters.screw))
    oil = parameters.lubricant
    if "rheology" in contact:
        oil = changed(parameters, lubricant={"rheology": contact["rheology"]}).lubricant
    solution = solve(conditions, oil, parameters.solids, options)
    return {
        "h_c_m": solution.h_c,
        "h_m_m": solution.h_m,
        "p_max_pa": solution.p_max,
        "temperature_rise_k": solution.temperature_rise,
        "traction_force_n": solution.traction_force,
        "traction_force_1_n": solution.traction_force_1,
        "traction_force_2_n": solution.traction_force_2,
        "rolling_loss_w": solution.rolling_loss,
        "temperature_rise_mean_k": solution.temperature_rise_mean,
        "temperature_rise_smooth_k": solution.temperature_rise_smooth,
        "converged": bool(solution.converged),
        "iterations": solution.iterations,
        "seconds": solution.seconds,
        "M": solution.M,
        "L": solution.L,
        "branch": solution.branch,
        "error_estimate": solution.error_estimate,
        "reason": solution.reason,
    }
