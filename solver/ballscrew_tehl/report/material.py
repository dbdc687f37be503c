"""What claims and paper_tables read of the packaged screw; goes where they go."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from ..parameters.file import Parameters
from ..physics.hertz import RACEWAYS
from ..validation.tables import ValidationTable
from .lines import Friction

if TYPE_CHECKING:
    from ..contact import ContactResult


class SolvedContact(NamedTuple):
    """A solved contact of one ball."""

    kinematics: str
    raceway: str
    solution: ContactResult


@dataclass(frozen=True)
class Material:
    """Friction sets, validation tables and solved contacts; preload [N]; contact_point [N, rad/s, K]."""

    parameters: Parameters
    frictions: tuple[Friction, ...]
    tables: dict[str, list[ValidationTable]]
    balls: PreloadPoint
    contact_point: tuple[float, float, float]
    contacts: tuple[SolvedContact, ...]

    @property
    def chosen(self) -> Friction:
        """The friction set selected by the parameters."""
        return self.frictions[0]

    def contact(self, kinematics: str, raceway: str) -> ContactResult | None:
        """Converged solution, None without one."""
        for found in self.contacts:
            if found[:2] == (kinematics, raceway) and found.solution.converged:
                return found.solution
        return None


class PreloadPoint(NamedTuple):
    """Preload [N] of the contact."""

    preload: float


def torque_of_contacts(material: Material, kinematics: str) -> float:
    """Torque [N.m] of the double nut if every load-carrying ball had the traction of the solved contacts; NaN: none."""
    screw = material.parameters.screw
    solutions = [material.contact(kinematics, raceway) for raceway in RACEWAYS]
    force = sum(math.nan if s is None else abs(s.traction_force) for s in solutions)
    arm = screw.nominal_radius + 0.5 * screw.ball_diameter * math.cos(screw.contact_angle)
    return 2.0 * screw.loaded_ball_count * force * arm * math.cos(screw.lead_angle)
