"""The contact of section 5.1 of the paper: converged values of this solver beside the printed ones."""

from __future__ import annotations

import csv
import math
from importlib import resources
from typing import NamedTuple

from .contact.solve import ContactSolution, SolverOptions, solve_contact
from .hertz import RACEWAYS
from .kinematics import KINEMATICS
from .nut_map.operating_contact import ball_contact
from .parameters import Parameters, changed

#: operating point of the section: 2000 N on the load-carrying balls, 3000 r/min, oil at the reference temperature
PRELOAD, SPEED = 2000.0, 3000.0 * math.pi / 30.0
LOAD = 39.5
COARSE = SolverOptions()
FINE = SolverOptions(n_x=193, n_y=25, n_z=16)
LAWS = ("section_2_3", "roelands_printed")


class ContactRow(NamedTuple):
    """One solved contact: SI; error: the largest relative change of film and rise against the coarser grid."""

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
    error: float


def printed_values() -> list[dict[str, str]]:
    """Rows of the paper: quantity, screw, nut, unit, note."""
    text = (resources.files(__package__) / "data" / "zhao2023_section5_contact.csv").read_text(
        encoding="utf-8"
    )
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def _solve(parameters: Parameters, raceway: str, options: SolverOptions) -> ContactSolution:
    temperature = parameters.lubricant.reference_temperature
    conditions = ball_contact(parameters, raceway, LOAD, SPEED, temperature)
    return solve_contact(conditions, parameters.lubricant, parameters.solid, options)


def section5_contacts(parameters: Parameters) -> list[ContactRow]:
    """Solve the contact of the section for both kinematics, both viscosity laws and both raceways on two grids.

    The law `roelands_printed` is Eq. 7 with the printed 0.032 1/K; `section_2_3` is the one of all other results.
    """
    rows = []
    for kinematics in KINEMATICS:
        for law in LAWS:
            variant = changed(
                parameters, friction={"kinematics": kinematics}, lubricant={"viscosity_law": law}
            )
            for raceway in RACEWAYS:
                coarse, fine = (_solve(variant, raceway, options) for options in (COARSE, FINE))
                changes = [
                    abs(getattr(coarse, name) / getattr(fine, name) - 1.0)
                    for name in ("h_c", "h_m", "temperature_rise")
                ]
                c = fine.conditions
                rows.append(
                    ContactRow(
                        kinematics,
                        law,
                        raceway,
                        c.u_e,
                        (c.u_1 - c.u_2) / c.u_e,
                        fine.h_c,
                        fine.h_m,
                        fine.temperature_rise,
                        fine.traction_force,
                        fine.converged and coarse.converged,
                        max(changes),
                    )
                )
    return rows


def section5_text(rows: list[ContactRow]) -> str:
    """The rows as a table, the printed values below."""
    lines = [
        "Section 5.1: one ball, 39.5 N, 3000 r/min, oil at 303 K",
        "kinematics     viscosity law     raceway  u_e m/s  srr      h_c um  h_m um  rise K  grid change  converged",
    ]
    for row in rows:
        lines.append(
            f"{row.kinematics:14} {row.viscosity_law:17} {row.raceway:7} {row.entrainment_speed:8.4f} "
            f"{row.slide_roll_ratio:8.5f} {1e6 * row.central_film:7.4f} {1e6 * row.minimum_film:7.4f} "
            f"{row.temperature_rise:7.2f} {100 * row.error:10.2f} %  {'yes' if row.converged else 'NO'}"
        )
    lines.append("printed in the paper (screw | nut):")
    lines += [
        f"  {p['quantity']:26} {p['screw']:>8} | {p['nut']:>8} {p['unit']:5} {p['note']}"
        for p in printed_values()
    ]
    return "\n".join(lines)
