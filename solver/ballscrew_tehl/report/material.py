"""The numbers of the report: friction sets with their maps, tables, lines, ball loads, solved contacts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..friction.origin import other_sets, with_set
from ..friction.sets import FrictionSet, default_friction_set
from ..nut_map.contact_map import Array
from ..nut_map.file import load_contact_map, load_map
from ..nut_map.plot import MapPicture, map_picture
from ..parameters.file import Parameters, changed, load_parameters
from ..parameters.units import RPM
from ..physics.hertz import RACEWAYS
from ..physics.kinematics import KINEMATICS
from ..physics.load import DoubleNutLoads, double_nut_loads, separation_load
from ..runtime.evaluate import NutMap
from ..validation.section5 import LOAD, PRELOAD, SPEED
from ..validation.tables import ValidationTable, validation_tables

if TYPE_CHECKING:
    from ..contact.solve import ContactSolution

#: speeds of lines over preload and temperature [rad/s]; only those within the map are drawn
LINE_SPEEDS = tuple(rpm * RPM for rpm in (100.0, 500.0, 1000.0, 2500.0))
#: preloads of the lines of the measured screw [N] and end of its speeds [rad/s]
MEASURED_PRELOADS, MEASURED_TOP = (1000.0, 2000.0, 4000.0, 6000.0), 3000.0 * RPM
#: points of a line
POINTS = 161
#: axial load over the separation load: of the load distributions, and the end of the forces over axial load
AXIAL_SHARES, AXIAL_END = (0.0, 0.5, 1.0), 1.2

#: called with the name of the next step
Progress = Callable[[str], None]


class Friction(NamedTuple):
    """A friction set and the map with the film of its fit."""

    entry: FrictionSet
    nut_map: NutMap

    def parts(self, preload: Any, speed: Any, temperature: Any) -> tuple[Any, Any, Any]:
        """Viscous, hysteresis and sliding torque [N.m] at preload [N], speed [rad/s], temperature [K]."""
        state = self.nut_map.evaluate(preload, speed, temperature)
        return state.viscous_torque, state.hysteresis_torque, state.sliding_torque

    def torque(self, preload: Any, speed: Any, temperature: Any) -> Any:
        """Their sum."""
        return sum(self.parts(preload, speed, temperature))


class Lines(NamedTuple):
    """Torque [N.m] over one quantity, one row per value of another; all at one value of the third."""

    x: Array
    rows: Array
    torque: Array
    fixed: float


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
    solution: ContactSolution


@dataclass(frozen=True)
class Material:
    """All numbers of the report; frictions: the chosen set first.

    measured: the screw and its oil are those of the paper; without it `tables` is empty
    contact_point: ball load [N], screw speed [rad/s], temperature [K] of the solved contacts
    """

    parameters: Parameters
    frictions: tuple[Friction, ...]
    picture: MapPicture
    measured: bool
    tables: dict[str, list[ValidationTable]]
    over_speed: Lines
    over_preload: Lines
    over_temperature: Lines
    balls: BallLoads
    contact_point: tuple[float, float, float]
    contacts: tuple[SolvedContact, ...]

    @property
    def chosen(self) -> Friction:
        """The friction set selected by the parameters."""
        return self.frictions[0]

    def contact(self, kinematics: str, raceway: str) -> ContactSolution | None:
        """Converged solution, None without one."""
        for found in self.contacts:
            if found[:2] == (kinematics, raceway) and found.solution.converged:
                return found.solution
        return None


def is_measured_screw(parameters: Parameters) -> bool:
    """Whether screw, steel, oil and surface speeds are those of the paper."""
    own = load_parameters()
    tables = ("screw", "solid", "lubricant", "published_speeds")
    return all(getattr(parameters, name) == getattr(own, name) for name in tables)


def gather(
    parameters: Parameters,
    map_file: Path | str | None,
    progress: Progress,
    friction_set: FrictionSet | None = None,
) -> Material:
    """Load the map, evaluate it, solve the contacts.

    Parameters   map_file: None = the packaged map of the kinematics;  progress: called before every contact
                 friction_set: of a file; None = the packaged one that the parameters select
    Raises       MapError (a ValueError): map missing, damaged or of another screw
    """
    frictions = friction_sets(parameters, map_file, friction_set)
    picture = map_picture(frictions[0].nut_map, load_contact_map(map_file, parameters))
    measured = is_measured_screw(parameters)
    tables = {f.entry.name: validation_tables(f.torque) for f in frictions} if measured else {}
    preload = PRELOAD if measured else picture.preload
    balls = ball_loads(parameters, preload)
    top = float(picture.speed[-1])
    heaviest = float(max(balls.cases[0].loads.Q_a.max(), balls.cases[0].loads.Q_b.max()))
    point = (LOAD if measured else heaviest, min(SPEED, top), parameters.lubricant.reference_temperature)
    return Material(
        parameters,
        frictions,
        picture,
        measured,
        tables,
        *_lines(frictions[0], picture, measured),
        balls,
        point,
        solved_contacts(parameters, point, progress),
    )


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


def _lines(friction: Friction, picture: MapPicture, measured: bool) -> tuple[Lines, Lines, Lines]:
    """Torque over speed, over preload, over temperature."""
    axes = picture.nut_map.header["axes"]
    slowest, fastest = axes["speed"][:2]
    preloads = np.array(MEASURED_PRELOADS) if measured else picture.preloads[-4:]
    held = [speed for speed in LINE_SPEEDS if slowest <= speed <= fastest]
    speeds = np.array(held) if len(held) > 1 else np.geomspace(slowest, fastest, 3)
    top = min(MEASURED_TOP, fastest) if measured else fastest
    temperature, preload = picture.temperature, preloads[len(preloads) // 2 - 1]
    speed = np.geomspace(slowest, top, POINTS)
    force = np.linspace(picture.preloads[0], preloads[-1], POINTS)
    oil = np.linspace(float(axes["temperature"][0]), float(axes["temperature"][1]), POINTS)
    return (
        Lines(speed, preloads, friction.torque(preloads[:, None], speed, temperature), temperature),
        Lines(force, speeds, friction.torque(force, speeds[:, None], temperature), temperature),
        Lines(oil, speeds, friction.torque(float(preload), speeds[:, None], oil), float(preload)),
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


def solved_contacts(
    parameters: Parameters, point: tuple[float, float, float], progress: Progress
) -> tuple[SolvedContact, ...]:
    """Thermal solves of both raceways with every kinematics for which the screw has data."""
    from ..contact.ball_contact import ball_contact
    from ..contact.solve import solve_contact

    names = [name for name in KINEMATICS if name != "published" or parameters.published_speeds is not None]
    found: list[SolvedContact] = []
    for kinematics in names:
        variant = changed(parameters, friction={"kinematics": kinematics})
        for raceway in RACEWAYS:
            progress(
                f"contact {len(found) + 1} of {len(names) * len(RACEWAYS)}: {kinematics}, {raceway} raceway"
            )
            conditions = ball_contact(variant, raceway, *point)
            solution = solve_contact(conditions, variant.lubricant, variant.solid)
            found.append(SolvedContact(kinematics, raceway, solution))
    return tuple(found)


def torque_of_contacts(material: Material, kinematics: str) -> float:
    """Torque [N.m] of the double nut if every load-carrying ball had the traction of the solved contacts; NaN: none."""
    screw = material.parameters.screw
    solutions = [material.contact(kinematics, raceway) for raceway in RACEWAYS]
    force = sum(math.nan if s is None else abs(s.traction_force) for s in solutions)
    arm = screw.nominal_radius + 0.5 * screw.ball_diameter * math.cos(screw.contact_angle)
    return 2.0 * screw.loaded_ball_count * force * arm * math.cos(screw.lead_angle)
