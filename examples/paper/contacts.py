#!/usr/bin/env python3
"""Contacts that others published, solved here: section 5.1 of Zhao et al. (2023), and a rolling circle of a multigrid.

    python examples/paper/contacts.py

A converged solution does not reproduce the values of section 5.1: the print does not state which of its two ambient
viscosities entered the contact, and its Eq. 6 omits the deflection.
"""

import itertools
import math
import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from pipe_table import data_file, table

from ballscrew_tehl import load_screw
from ballscrew_tehl.parameters.file import Law, Parameters, changed
from ballscrew_tehl.parameters.oil import ROELANDS_LN
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.hertz import RACEWAYS

try:
    from ballscrew_tehl.contact import (
        ContactConditions,
        ContactResult,
        SolverOptions,
        ball_conditions,
        reference_oil,
        solve,
    )
except ModuleNotFoundError as error:  # numba
    print(f"{Path(__file__).name}: {error}", file=sys.stderr)
    raise SystemExit(2) from None

#: ball load [N] at 2000 N on the load-carrying balls, screw speed
LOAD, SPEED = 39.5, 3000.0 * RPM
#: nodes along, lines across the half width and layers, all refined by this ratio
REFINEMENT = math.sqrt(2.0)
GRIDS = tuple(SolverOptions(n_x=x, n_y=y, n_z=z) for x, y, z in ((97, 17, 6), (137, 23, 8), (193, 33, 12)))
#: last change, relative, beyond which a value is not extrapolated
SETTLED_BELOW = 0.05
#: Eq. 7 with the printed 0.032 1/K is roelands_printed; section_2_3 is the one of all other results
LAWS = ("section_2_3", "roelands_printed")

# case ti_006 of https://github.com/vachekivan495-design/PINN-EHL-Reproducibility (data: CC BY 4.0): steel on glass,
# isothermal, Roelands, Dowson-Higginson 0.59 GPa; [N], [m], [m/s], [Pa s], [1/Pa], [Pa]
CIRCLE_LOAD, RADIUS, CIRCLE_SPEED = 28.63282784819603, 0.01268, 1.5495457435026765
ETA0, ALPHA, P_ROELANDS = 0.06853415663987397, 2.3665293604135514e-8, 1.96e8
E_PRIME = 2.0 / ((1.0 - 0.3**2) / 210e9 + (1.0 - 0.208**2) / 81e9)
#: domain in Hertz radii, nodes, films [m], elapsed time [s] of the multigrid
NAMES = ("x_in", "x_out", "y_max", "n_x", "n_y", "central_film", "minimum_film", "time")
MULTIGRID = dict(zip(NAMES, (-4.0, 2.0, 3.0, 769, 769, 609.842e-9, 380.173e-9, 2885.94), strict=True))


class ContactRow(NamedTuple):
    """One contact: the solution on the fine grid, and its dependence on the grid.

    film_changes, rise_changes: relative change from the coarse to the middle and from the middle to the fine grid, of
    the film the larger one of h_c and h_m; film_limit, rise_limit: film on the grids and rise extrapolated from three
    grids, NaN where they do not converge. h_c is extrapolated by the solver from two grids. converged: on all three.
    """

    law: str
    viscosity_law: str
    raceway: str
    fine: ContactResult
    film_changes: tuple[float, float]
    rise_changes: tuple[float, float]
    film_limit: float
    rise_limit: float
    converged: bool

    @property
    def slide_roll_ratio(self) -> float:
        """(u_1 - u_2)/u_e."""
        c = self.fine.conditions
        return (c.u_1 - c.u_2) / c.u_e


def extrapolated(coarse: float, middle: float, fine: float) -> float:
    """Limit of a value on three grids of constant ratio REFINEMENT.

    Returns limit by the observed order; NaN unless they are monotone, of first order at least and the last change is
    below SETTLED_BELOW. Roache, J Fluids Eng 116 (1994) 405: f_fine + (f_fine - f_middle)/(REFINEMENT^order - 1).
    """
    first, second = middle - coarse, fine - middle
    if not (0.0 < REFINEMENT * second * first <= first**2 and abs(second) < SETTLED_BELOW * abs(fine)):
        return math.nan
    return fine + second * second / (first - second)


def contact_row(parameters: Parameters, law: Law, viscosity_law: str, raceway: str) -> ContactRow:
    """The contact of section 5.1 on three grids."""
    variant = changed(parameters, friction={"law": law}, lubricant={"viscosity_law": viscosity_law})
    oil = variant.lubricant
    conditions = ball_conditions(variant, raceway, LOAD, SPEED, oil.reference_temperature)
    solutions = [solve(conditions, oil, variant.solids, grid) for grid in GRIDS]

    def changes(name: str) -> list[float]:
        values = [getattr(s, name) for s in solutions]
        return [abs(finer / coarser - 1.0) for coarser, finer in pairwise(values)]

    film = [max(pair) for pair in zip(changes("h_c"), changes("h_m"), strict=True)]
    return ContactRow(
        law, viscosity_law, raceway, solutions[-1], tuple(film), tuple(changes("temperature_rise")),
        extrapolated(*(s.grid_film for s in solutions)), extrapolated(*(s.temperature_rise for s in solutions)),
        all(s.converged for s in solutions),
    )  # fmt: skip


def circle_rows() -> list[dict[str, float]]:
    """The published row, then this solver on the same domain and on its default one; CPU times, converged or not."""
    z = ALPHA * P_ROELANDS / (math.log(ETA0) + ROELANDS_LN)
    printed = {
        "viscosity": ETA0,
        "pressure_viscosity": ALPHA,
        "roelands_pressure": P_ROELANDS,
        "z_roelands": z,
    }
    oil, solid = reference_oil("roelands").model_copy(update=printed), load_screw().solid
    conditions = ContactConditions(
        CIRCLE_LOAD, RADIUS, RADIUS, CIRCLE_SPEED, CIRCLE_SPEED, oil.reference_temperature, E_PRIME
    )
    rows: list[dict[str, float]] = [MULTIGRID]
    same = SolverOptions(thermal=False, x_in=-4.0, x_out=2.0, y_max=3.0)
    for options in (same, SolverOptions(thermal=False)):
        begun = time.process_time()
        s = solve(conditions, oil, solid, options)
        used, domain = time.process_time() - begun, map(float, (s.x[0], s.x[-1], s.y[-1]))
        values = (*domain, s.x.size, 2 * s.y.size - 1, s.h_c, s.h_m, used)
        rows.append(dict(zip(NAMES, values, strict=True)) | {"converged": s.converged})
    return rows


def _changed(changes: tuple[float, float], limit: float, digits: int) -> list[str]:
    """Changes in per cent and the limit, a dash where there is none."""
    text = f"{limit:.{digits}f}" if math.isfinite(limit) else "-"
    return [" ".join(f"{100.0 * change:.2f}" for change in changes), text]


def section5_text(rows: list[ContactRow]) -> str:
    """The contact of section 5.1, and what the paper prints."""
    head = ["law, viscosity", "raceway", "u_e [m/s]", "srr", "h_c [um]", "h_m [um]", "changes [%]"]
    head += ["limit [um]", "largest rise [K]", "changes [%]", "limit [K]", "converged"]
    cells = [
        [f"{row.law}, {row.viscosity_law}", row.raceway, f"{s.conditions.u_e:.4f}",
         f"{row.slide_roll_ratio:.5f}", f"{1e6 * s.h_c:.4f}", f"{1e6 * s.h_m:.4f}",
         *_changed(row.film_changes, 1e6 * row.film_limit, 4), f"{s.temperature_rise:.2f}",
         *_changed(row.rise_changes, row.rise_limit, 2), "yes" if row.converged else "NO"]
        for row in rows for s in (row.fine,)
    ]  # fmt: skip
    printed = data_file("zhao2023_section5_contact.csv", text=True)
    grids = ", ".join(f"{grid.n_x}x{grid.n_y}x{grid.n_z}" for grid in GRIDS)
    title = (
        f"Section 5.1: one ball, {LOAD} N, 3000 r/min, oil at 303 K, on the last of three grids ({grids}); changes: "
        "from grid to grid; limit: extrapolated. The largest rise of pure rolling is that of the narrow pressure "
        "spike, not resolved by these grids; its film does not depend on it"
    )
    return "\n".join([table(title, head, cells), table("Printed", list(printed), printed.values, "---")])


def main() -> str:
    """The tables as text: 24 thermal solves and two isothermal ones."""
    cases = itertools.product(Law, LAWS, RACEWAYS)
    rows = [contact_row(load_screw(), *case) for case in cases]
    circle = [
        [f"{row['x_in']:.4g} to {row['x_out']:.4g}", f"{row['y_max']:.4g}", f"{row['n_x']} x {row['n_y']}",
         f"{1e9 * row['central_film']:.2f}", f"{1e9 * row['minimum_film']:.2f}", f"{row['time']:.2f}",
         {None: "-", True: "yes", False: "NO"}[row.get("converged")]]
        for row in circle_rows()
    ]  # fmt: skip
    head = ["x", "y up to", "nodes", "central film [nm]", "minimum film [nm]", "time [s]", "converged"]
    title = "Rolling circle: published multigrid, this solver on the same domain and on its own [Hertz radii]"
    return section5_text(rows) + "\n" + table(title, head, circle)


if __name__ == "__main__":
    print(main())
