"""The contact of section 5.1 of the paper: converged values of this solver and the printed ones."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from ..contact import ContactResult, SolverOptions, ball_conditions, solve
from ..parameters.file import Parameters, changed
from ..parameters.packaged_data import PACKAGED_DATA
from ..parameters.units import RPM
from ..physics.hertz import RACEWAYS
from ..physics.kinematics import KINEMATICS
from ..tables.csv_file import read_rows

if TYPE_CHECKING:
    from ..calibration.packaged import Progress

#: operating point of the section: 2000 N on the load-carrying balls, 3000 r/min, oil at the reference temperature
PRELOAD, SPEED = 2000.0, 3000.0 * RPM
LOAD = 39.5
#: nodes along, lines across the half width and layers, all refined by this ratio
REFINEMENT = math.sqrt(2.0)
COARSE = SolverOptions(n_x=97, n_y=17, n_z=6)
MIDDLE = SolverOptions(n_x=137, n_y=23, n_z=8)
FINE = SolverOptions(n_x=193, n_y=33, n_z=12)
GRIDS = (COARSE, MIDDLE, FINE)
#: last change, relative, beyond which a value is not extrapolated
SETTLED_BELOW = 0.05
LAWS = ("section_2_3", "roelands_printed")


class ContactRow(NamedTuple):
    """One contact, SI: values of the fine grid, and their dependence on the grid.

    film_changes, rise_changes: relative change from the coarse to the middle and from the middle to the fine grid, of
    the film the larger one of h_c and h_m; film_limit, rise_limit: h_c and rise extrapolated from the three grids, NaN
    where they do not converge. h_c is extrapolated by the solver from two grids. film_limit is extrapolated from the
    films on the grids and so is a check of h_c. converged: on all three.
    """

    kinematics: str
    viscosity_law: str
    raceway: str
    entrainment_speed: float
    slide_roll_ratio: float
    central_film: float
    minimum_film: float
    temperature_rise: float
    traction_force: float
    converged: bool
    film_changes: tuple[float, float]
    rise_changes: tuple[float, float]
    film_limit: float
    rise_limit: float


def printed_values() -> list[dict[str, str]]:
    """Rows of the paper: quantity, screw, nut, unit, note."""
    return read_rows(PACKAGED_DATA / "zhao2023_section5_contact.csv")


def _solve(parameters: Parameters, raceway: str, options: SolverOptions) -> ContactResult:
    temperature = parameters.lubricant.reference_temperature
    conditions = ball_conditions(parameters, raceway, LOAD, SPEED, temperature)
    return solve(conditions, parameters.lubricant, parameters.solids, options)


def extrapolated(coarse: float, middle: float, fine: float) -> float:
    """Limit of a value on three grids of constant ratio REFINEMENT.

    Returns      limit by the observed order; NaN unless they are monotone, of first order at least and the
                 last change is below SETTLED_BELOW
    Source       Roache, J Fluids Eng 116 (1994) 405: f_fine + (f_fine - f_middle)/(REFINEMENT^order - 1)
    Example
        >>> round(extrapolated(1.04, 1.02, 1.01), 12), extrapolated(1.00, 1.01, 1.03)
        (1.0, nan)
    """
    first, second = middle - coarse, fine - middle
    if not (0.0 < REFINEMENT * second * first <= first**2 and abs(second) < SETTLED_BELOW * abs(fine)):
        return math.nan
    return fine + second * second / (first - second)


def section5_contacts(
    parameters: Parameters, progress: Progress = lambda finished, total, what: None
) -> list[ContactRow]:
    """Solve the contact of the section for both kinematics, both viscosity laws and both raceways on three grids.

    The law `roelands_printed` is Eq. 7 with the printed 0.032 1/K; `section_2_3` is the one of all other results.
    """
    rows: list[ContactRow] = []
    wanted = [(k, law, raceway) for k in KINEMATICS for law in LAWS for raceway in RACEWAYS]
    for kinematics, law, raceway in wanted:
        variant = changed(parameters, friction={"kinematics": kinematics}, lubricant={"viscosity_law": law})
        solutions: list[ContactResult] = []
        for grid in GRIDS:
            progress(len(GRIDS) * len(rows) + len(solutions), len(GRIDS) * len(wanted), "contacts solved")
            solutions.append(_solve(variant, raceway, grid))
        rows.append(_row(kinematics, law, raceway, solutions))
    return rows


def _row(kinematics: str, law: str, raceway: str, solutions: list[ContactResult]) -> ContactRow:
    """The row of one contact, solved on the grids from coarse to fine."""
    h_c, h_m, rise = ([getattr(s, name) for s in solutions] for name in ("h_c", "h_m", "temperature_rise"))

    def changes(values: list[float]) -> list[float]:
        return [abs(finer / coarser - 1.0) for coarser, finer in pairwise(values)]

    to_middle, to_fine = (max(pair) for pair in zip(changes(h_c), changes(h_m), strict=True))
    rise_to_middle, rise_to_fine = changes(rise)
    fine = solutions[-1]
    c = fine.conditions
    return ContactRow(
        kinematics, law, raceway, c.u_e, (c.u_1 - c.u_2) / c.u_e, fine.h_c, fine.h_m, fine.temperature_rise,
        fine.traction_force, all(s.converged for s in solutions), (to_middle, to_fine),
        (rise_to_middle, rise_to_fine), extrapolated(*(s.grid_film for s in solutions)), extrapolated(*rise),
    )  # fmt: skip


def section5_text(rows: list[ContactRow]) -> str:
    """The rows as a table, the printed values below."""
    grids = ", ".join(f"{grid.n_x}x{grid.n_y}x{grid.n_z}" for grid in GRIDS)
    lines = [
        "Section 5.1: one ball, 39.5 N, 3000 r/min, oil at 303 K",
        f"Values of the last of three grids ({grids}: along, across the half width, layers).",
        "change: from the first to the second and from the second to the last grid, of the film the larger one.",
        "limit: extrapolated from the three grids, - where the values do not converge. The largest rise of pure",
        "rolling is that of the narrow pressure spike, not resolved by these grids. Its film does not depend on it.",
        "",
        f"{'':26} | {'film':^40} | {'largest rise':^30} |",
        "raceway  u_e m/s       srr |  h_c um   h_m um     change %   limit um |      K     change %    limit K "
        "| converged",
    ]
    group = None
    for row in rows:
        if group != (group := row[:2]):
            lines.append(f"{row.kinematics}, {row.viscosity_law}")
        film = _shown(row.film_changes, 1e6 * row.film_limit, 4)
        rise = _shown(row.rise_changes, row.rise_limit, 2)
        lines.append(
            f"  {row.raceway:5} {row.entrainment_speed:8.4f} {row.slide_roll_ratio:9.5f} "
            f"| {1e6 * row.central_film:7.4f}  {1e6 * row.minimum_film:7.4f} {film} "
            f"| {row.temperature_rise:6.2f} {rise} | {'yes' if row.converged else 'NO'}"
        )
    lines += ["", "printed in the paper (screw | nut):"]
    lines += [
        f"  {p['quantity']:26} {p['screw']:>8} | {p['nut']:>8} {p['unit']:5} {p['note']}".rstrip()
        for p in printed_values()
    ]
    return "\n".join(lines)


def _shown(changes: tuple[float, float], limit: float, digits: int) -> str:
    """Changes in percent and the limit, a dash where there is none."""
    text = f"{limit:.{digits}f}" if math.isfinite(limit) else "-"
    return f"{100.0 * changes[0]:6.2f} {100.0 * changes[1]:6.2f} {text:>9}"
