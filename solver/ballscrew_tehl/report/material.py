"""The numbers of the report: friction sets with their maps, tables, lines, ball loads, solved contacts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..calibration.measured_screw import ValidationTable, validation_tables
from ..friction.origin import other_sets, with_set
from ..friction.sets import FrictionSet, default_friction_set
from ..nut_map.file import load_map
from ..nut_map.plot import MapPicture, map_picture
from ..parameters.file import Parameters, changed, load_screw
from ..parameters.units import RPM
from ..physics.ball_law import Array
from ..physics.hertz import RACEWAYS
from ..physics.kinematics import KINEMATICS, ROLLING_FRAME
from ..physics.load import DoubleNutLoads, double_nut_loads, separation_load
from .lines import Friction, GivenPoint, Progress, TorqueLines, operating_point, torque_lines
from .screw_numbers import ScrewNumbers, screw_numbers

if TYPE_CHECKING:
    from ..contact import ContactResult

#: axial load over the separation load: of the load distributions, and the end of the forces over axial load
AXIAL_SHARES, AXIAL_END = (0.0, 0.5, 1.0), 1.2
CONTACT_STEP = "contacts solved"
#: the contact that the paper prints in section 5.1: ball load [N] at a preload [N], screw speed [rad/s]
LOAD, PRELOAD, SPEED = 39.5, 2000.0, 3000.0 * RPM
CHOSEN_POINT = GivenPoint()


class PreloadWords(NamedTuple):
    """Names of a kind of preload on the page."""

    screw: str  # the whole
    nut: str
    side: str  # relieved or loaded by an axial load
    middle: str  # between both sides
    loads: str  # distribution of the loads; {count} balls


PRELOAD_WORDS = {
    "double_nut": PreloadWords(
        "double-nut ball screw", "double nut", "nut", "spacer",
        "Each nut has {count} load-carrying balls. Screw, nuts and spacer stretch, so the balls next to the spacer "
        "have the highest loads under preload alone.",
    ),
    "single_nut_offset": PreloadWords(
        "single-nut ball screw with offset lead", "single nut", "half", "middle",
        "Each half of the nut has {count} load-carrying balls. Screw and nut stretch, so the balls next to the middle "
        "have the highest loads under preload alone.",
    ),
    "single_nut_oversize_ball": PreloadWords(
        "single-nut ball screw with oversize balls", "single nut", "set of flanks", "same balls, other flanks",
        "The nut has {count} load-carrying balls, each between four flanks: two opposed sets of them. Under preload "
        "alone all loads are equal.",
    ),
}  # fmt: skip


class LoadCase(NamedTuple):
    """Ball loads of both nuts under an axial load [N]."""

    axial_load: float
    loads: DoubleNutLoads


class BallLoads(NamedTuple):
    """Load distribution at one preload [N] and the forces of both nuts over the axial load."""

    preload: float
    separation: float
    cases: tuple[LoadCase, ...]
    axial_loads: Array
    forces: Array  # (2, n): relieved, loaded nut
    words: PreloadWords


class SolvedContact(NamedTuple):
    """A solved contact of one ball."""

    kinematics: str
    raceway: str
    solution: ContactResult


@dataclass(frozen=True)
class Material:
    """All numbers of the report; frictions: the chosen set first.

    measured: the page is about the measured screw of the paper; without it `tables` is empty
    contact_point: ball load [N], screw speed [rad/s], temperature [K] of the solved contacts
    """

    parameters: Parameters
    frictions: tuple[Friction, ...]
    picture: MapPicture
    measured: bool
    given: GivenPoint
    tables: dict[str, list[ValidationTable]]
    lines: TorqueLines
    screw: ScrewNumbers
    balls: BallLoads
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


def is_measured_screw(parameters: Parameters) -> bool:
    """Whether screw, steel, oil and surface speeds are those of the paper."""
    own = load_screw()
    tables = ("screw", "solid", "lubricant", "published_speeds")
    return all(getattr(parameters, name) == getattr(own, name) for name in tables)


def gather(
    parameters: Parameters,
    map_file: Path | str | None,
    progress: Progress,
    friction_set: FrictionSet | None = None,
    measured: bool = True,
    given: GivenPoint = CHOSEN_POINT,
) -> Material:
    """Load the map, evaluate it, solve the contacts.

    Parameters   map_file: None = the packaged map of the kinematics;  progress: called before and after every step
                 friction_set: of a file; None = the packaged one that the parameters select
                 measured: the page is about the screw of the paper;  given: operating point, of any other screw
    Raises       MapError (a ValueError): map missing, damaged or of another screw; ValueError: point outside the map
    """
    frictions = friction_sets(parameters, map_file, friction_set)
    chosen = frictions[0]
    picture = map_picture(chosen.nut_map, parameters)
    tables = {f.entry.name: validation_tables(f.torque) for f in frictions} if measured else {}
    axes = chosen.nut_map.header["axes"]
    point = operating_point(parameters, axes, picture.temperature, given)
    if measured:
        point = point._replace(preload=PRELOAD)
    lines = torque_lines(parameters, chosen, point, measured, progress)
    balls = ball_loads(parameters, point.preload)
    if measured:
        top = float(picture.speed[-1])
        contact_point = LOAD, min(SPEED, top), parameters.lubricant.reference_temperature
    else:
        heaviest = float(max(balls.cases[0].loads.Q_a.max(), balls.cases[0].loads.Q_b.max()))
        contact_point = heaviest, point.speed, point.temperature
    return Material(
        parameters, frictions, picture, measured, given, tables, lines,
        screw_numbers(parameters, chosen.nut_map, point, lines.over_speed.rows, lines.over_preload.rows),
        balls, contact_point,
        solved_contacts(parameters, shown_kinematics(parameters, measured), contact_point, progress),
    )  # fmt: skip


def friction_sets(
    parameters: Parameters, map_file: Path | str | None, of_file: FrictionSet | None = None
) -> tuple[Friction, ...]:
    """The chosen set, then the other packaged ones measured on this screw, each with its own film."""
    first = of_file or default_friction_set(parameters)
    return (
        Friction(first, load_map(map_file, parameters, of_file)),
        *(
            Friction(entry, load_map(map_file, with_set(parameters, entry.name)))
            for entry in other_sets(first, parameters)
        ),
    )


def ball_loads(parameters: Parameters, preload: float) -> BallLoads:
    """Loads of the load-carrying balls at a preload [N] with and without axial load."""
    screw = parameters.screw
    count = screw.loaded_ball_count
    separation = separation_load(screw, preload, count)

    def under(axial_load: float) -> DoubleNutLoads:
        return double_nut_loads(screw, preload, axial_load, count)

    axial_loads = np.linspace(0.0, AXIAL_END * separation, 37)
    forces = np.array([(found.force_a, found.force_b) for found in map(under, axial_loads)]).T
    cases = tuple(LoadCase(share * separation, under(share * separation)) for share in AXIAL_SHARES)
    return BallLoads(preload, separation, cases, axial_loads, forces, PRELOAD_WORDS[screw.preload_kind])


def shown_kinematics(parameters: Parameters, measured: bool) -> list[str]:
    """Kinematics of the solved contacts: of the paper's screw all, else the physical one and the chosen one."""
    if measured:
        return list(KINEMATICS)
    return list(dict.fromkeys((parameters.friction.kinematics, ROLLING_FRAME)))


def solved_contacts(
    parameters: Parameters, kinematics: list[str], point: tuple[float, float, float], progress: Progress
) -> tuple[SolvedContact, ...]:
    """Thermal solves of both raceways with each kinematics at a ball load, screw speed and temperature."""
    from ..contact import ball_conditions, solve

    pairs = [(name, raceway) for name in kinematics for raceway in RACEWAYS]
    found: list[SolvedContact] = []
    for name, raceway in pairs:
        progress(len(found), len(pairs), CONTACT_STEP)
        variant = changed(parameters, friction={"kinematics": name})
        conditions = ball_conditions(variant, raceway, *point)
        found.append(SolvedContact(name, raceway, solve(conditions, variant.lubricant, variant.solids)))
    progress(len(pairs), len(pairs), CONTACT_STEP)
    return tuple(found)
