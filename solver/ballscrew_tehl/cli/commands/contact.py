"""The command `contact`: one contact by its dimensions or by its Moes numbers, from options or from a CSV file."""

import math
from argparse import Namespace
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ..._version import __version__
from ...tables.csv_file import read_rows
from ..parser import LAWS
from ..shared.chosen import key_of
from ..shared.points import check_rows
from ..shared.progress import each
from ..shared.results import Answer

DIMENSIONS = ("load_n", "radius_x_m", "radius_y_m", "u1_m_s", "u2_m_s", "temperature_k")
MOES = ("moes", "radius_ratio", "law")
#: of a table
COLUMNS = ("Hc", "Hm", "M", "L", "h_c_m", "h_m_m", "p_max_pa", "temperature_rise_k", "traction_force_n", "converged",
           "error_estimate")  # fmt: skip
#: of an answer, by Moes numbers and by dimensions
OF_MOES = ("converged", "branch", "error_estimate", "seconds", "M", "L", "reason")
OF_DIMENSIONS = (
    "h_c", "h_m", "p_max", "temperature_rise", "traction_force", "traction_force_1", "traction_force_2",
    "rolling_loss", "temperature_rise_mean", "temperature_rise_smooth", "converged", "iterations", "seconds", "M", "L",
    "branch", "error_estimate", "reason",
)  # fmt: skip


def _number(text: str) -> float:
    if not math.isfinite(value := float(text)):
        raise ValueError(text)
    return value


def _numbers(count: int) -> Callable[[str], list[float]]:
    def parse(text: str) -> list[float]:
        values = [_number(part) for part in text.split()]
        if len(values) != count:
            raise ValueError(text)
        return values

    return parse


def _one_of(*names: str) -> Callable[[str], str]:
    return lambda text: names[names.index(text)]


def _flag(text: str) -> bool:
    return {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False}[text.lower()]


#: field -> reader of its text, what is allowed
FIELDS: dict[str, tuple[Callable[[str], Any], str]] = {
    **dict.fromkeys(DIMENSIONS, (_number, "a finite number")),
    "moes": (_numbers(2), "two numbers, M and L"),
    "radius_ratio": (_number, "a number, 0 < R_x/R_y <= 1"),
    "law": (_one_of(*LAWS), ", ".join(LAWS)),
    "domain": (_numbers(3), "three numbers: XA XB along rolling, Y across, in Hertz half-widths"),
    "isothermal": (_flag, "true, false"),
    "refine": (_number, "a number, 1 to 8"),
}


def _read(where: str, fields: dict[str, str]) -> dict[str, Any]:
    """Values of the fields of one contact.

    Raises       ValueError: unknown field, a value not allowed, neither dimensions nor Moes numbers complete
    """

    def place(name: str) -> str:
        return where + (name.replace("_", "-") if where == "--" else name)

    values: dict[str, Any] = {}
    for name, text in fields.items():
        if name not in FIELDS:
            raise ValueError(f"{place(name)}: unknown; allowed: {', '.join(FIELDS)}")
        parse, allowed = FIELDS[name]
        try:
            values[name] = parse(text)
        except (ValueError, KeyError):
            raise ValueError(f"{place(name)} = {text}; allowed: {allowed}") from None
    group, other = (MOES, DIMENSIONS) if "moes" in values else (DIMENSIONS, MOES)
    for name in group:
        if name not in values:
            raise ValueError(f"{place(name)} (missing); allowed: {FIELDS[name][1]}")
    for name in other:
        if name in values:
            raise ValueError(
                f"{place(name)} = {values[name]}; allowed: either {', '.join(MOES)} or dimensions"
            )
    return values


def run_contact(args: Namespace) -> Answer:
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
        contacts = []
        for index, row in enumerate(read_rows(args.points), start=1):
            filled = {key.lower(): text for key, text in row.items() if text}
            contacts.append(_read(f"{args.points}: row {index}: ", {**given, **filled}))
    check_rows(args)
    results = [
        {**_solve(contact, args.screw), "version": __version__}
        for contact in each(contacts, "contacts solved")
    ]
    code = 0 if all(result["converged"] for result in results) else 1
    return Answer(results, args.points is not None, columns=COLUMNS, output=args.output, code=code)


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
    """Isothermal film in Moes units; error_estimate: relative, of Hc."""
    from ...contact import solve_moes

    M, L = contact["moes"]
    film = solve_moes(M, L, contact["radius_ratio"], contact["law"], options)
    return {"Hc": film.Hc, "Hm": film.Hm, **{name: getattr(film.result, name) for name in OF_MOES}}


def _by_dimensions(contact: dict[str, Any], options: Any, screw_file: str | None) -> dict[str, Any]:
    from ...contact import ContactConditions, solve
    from ...parameters.file import load_screw
    from ...physics.hertz import E_prime

    parameters = load_screw(screw_file)
    load, R_x, R_y, u_1, u_2, temperature = (contact[name] for name in DIMENSIONS)
    conditions = ContactConditions(load, R_x, R_y, u_1, u_2, temperature, E_prime(parameters.screw))
    result = solve(conditions, parameters.lubricant, parameters.solids, options)
    return {key_of(name): getattr(result, name) for name in OF_DIMENSIONS}
