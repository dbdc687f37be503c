"""The command `contact`: one contact by its dimensions or by its Moes numbers, from options or from a CSV file."""

from argparse import Namespace
from collections.abc import Mapping
from typing import Any, NoReturn

from ballscrew_tehl._version import __version__
from ballscrew_tehl.applications.tables.csv_file import read_rows

from ...quantities import CONTACT_POINT
from ..parser import COMMANDS, Parser
from ..shared.inputs import check_rows, key_of
from ..shared.output import Answer, each

DIMENSIONS = tuple(quantity.name for quantity in CONTACT_POINT)
MOES = ("moes", "radius_ratio", "law")
#: of a table
COLUMNS = ("Hc", "Hm", "M", "L", "h_c_m", "h_m_m", "p_max_pa", "temperature_rise_k", "traction_force_n", "converged",
           "error_estimate")  # fmt: skip
#: of an answer, by Moes numbers and by dimensions
OF_MOES = ("converged", "branch", "error_estimate", "seconds", "M", "L", "reason")
OF_DIMENSIONS = ("h_c", "h_m", "p_max", "temperature_rise", "traction_force", "traction_force_1", "traction_force_2",
                 "rolling_loss", "temperature_rise_mean", "temperature_rise_smooth", "converged", "iterations",
                 "seconds", "M", "L", "branch", "error_estimate", "reason")  # fmt: skip
#: words of a column isothermal
WORDS = {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False}


class _RowParser(Parser):
    """Options of a contact from the fields of a row."""

    def error(self, message: str) -> NoReturn:
        raise ValueError(self.explained(message))


def _contact(args: Namespace, row: Mapping[str, str]) -> Namespace:
    """Options of the command, replaced by the fields of a row: a contact by its dimensions or by its Moes numbers."""
    parser = _RowParser(prog="")
    for flag, settings in COMMANDS["contact"].options:
        parser.add_argument(flag, **settings)
    values, words = Namespace(**vars(args)), []
    for name, text in row.items():
        if text and name.lower() == "isothermal":
            if text.lower() not in WORDS:
                raise ValueError(f"--isothermal = {text}; allowed: {', '.join(WORDS)}")
            values.isothermal = WORDS[text.lower()]
        elif text:
            words += [f"--{name.lower().replace('_', '-')}", *text.split()]
    contact = parser.parse_args(words, values)
    needed = DIMENSIONS if contact.moes is None else MOES
    for name in (*needed, *DIMENSIONS, *MOES):
        value = getattr(contact, name)
        if (value is None) == (name in needed):
            stated = f"--{name.replace('_', '-')} {'(missing)' if value is None else f'= {value}'}"
            raise ValueError(
                f"{stated}; allowed: either {', '.join(MOES)} or {', '.join(DIMENSIONS)}, together"
            )
    if contact.domain:
        x_in, x_out, y_max = contact.domain
        if not (x_in < -1.0 and x_out > 1.0 and y_max > 1.0):
            raise ValueError(f"--domain = {x_in:g} {x_out:g} {y_max:g}; allowed: XA < -1, XB > 1, Y > 1")
    return contact


def run_contact(args: Namespace) -> Answer:
    """Solve the contacts; exit code 1 if one did not converge."""
    rows = [{}] if args.points is None else read_rows(args.points)
    contacts = []
    for number, row in enumerate(rows, start=1):
        try:
            contacts.append(_contact(args, row))
        except ValueError as error:
            where = "" if args.points is None else f"{args.points}: row {number}: "
            raise ValueError(f"{where}{error}") from None
    check_rows(args)
    results = [{**_solve(one), "version": __version__} for one in each(contacts, "contacts solved")]
    code = 0 if all(result["converged"] for result in results) else 1
    return Answer(results, args.points is not None, columns=COLUMNS, output=args.output, code=code)


def _solve(contact: Namespace) -> dict[str, Any]:
    """Film in Moes units, its error_estimate relative, of Hc; or the solution in SI."""
    from ballscrew_tehl.contact import ContactConditions, SolverOptions, solve, solve_moes
    from ballscrew_tehl.parameters.file import load_screw
    from ballscrew_tehl.physics.hertz import E_prime

    domain = dict(zip(("x_in", "x_out", "y_max"), contact.domain or (), strict=False))
    options = SolverOptions(thermal=not (contact.moes or contact.isothermal), **domain)
    if contact.refine is not None:
        options = options.refined(contact.refine)
    if contact.moes:
        M, L = contact.moes
        film = solve_moes(M, L, contact.radius_ratio, contact.law, options)
        return {"Hc": film.Hc, "Hm": film.Hm, **{name: getattr(film.result, name) for name in OF_MOES}}
    parameters = load_screw(contact.screw)
    load, R_x, R_y, u_1, u_2, temperature = (getattr(contact, name) for name in DIMENSIONS)
    conditions = ContactConditions(load, R_x, R_y, u_1, u_2, temperature, E_prime(parameters.screw))
    result = solve(conditions, parameters.lubricant, parameters.solids, options)
    return {key_of(name): getattr(result, name) for name in OF_DIMENSIONS}
