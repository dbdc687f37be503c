"""Table of the variables of BallScrewAxis: the ball screw with motor inertia, table and guide. Equations of the model.

Angle phi and speed of the screw, position x and velocity of the table, r = lead/(2 pi). The deflection of the nut is
d = r phi + u - x with the axial displacement u of the screw in its bearing; contacts and friction at the deflection
are those of BallScrewTransmission (native/models/transmission/contacts.h).

    (motor_inertia + screw_inertia) dspeed/dt = motor_torque - r nut_force - friction_torque
                                                - bearing_torque - motor_friction_torque
    table_mass dvelocity/dt = nut_force + external_force - guide_force + P^2/(2 rod_stiffness)
                              - table_mass g sin(inclination)
    screw_mass d2u/dt2      = -nut_force - P - support damping - screw_mass g sin(inclination)

with the pull P = u / (1/support_stiffness + (free_length + position)/rod_stiffness) of bearing and screw in series: the
screw is free over free_length at position 0, between its fixed bearing and the nut. A longer screw stores less energy
at the same u, hence the force on the table, mostly below 1 N. Without support_stiffness the bearing is rigid, without
free_length the screw; without both u is locked. Friction torque: elasto-slip elements in parallel (presliding_law.h)
and the viscous part of the map at the forces of both nuts. guide_force: guide_viscous velocity and one elasto-slip
element, elastic to guide_coulomb over guide_presliding_travel. Support bearings and motor: one such element over
shaft_presliding_angle, which slides at bearing_seal_torque + motor_coulomb + bearing_friction_factor times the torque
of the rows at the speed, from a table over speed and temperature (bearing_table); its stiffness is that at the lowest
speed.

Assumed: table is rigid, so are motor shaft and coupling, and the screw in torsion; balls have no mass; all of
screw_mass moves with u; the damping of contacts and of bearing and screw is contact_damping_time times their stiffness;
bearing and screw have the same stiffness in both directions; the bearings have the temperature of the oil, and friction
without the force of the process; the guide carries no moment and its friction does not depend on the load;
shaft_presliding_angle, by which the balls of a bearing of 50 mm roll through their contacts (0.1 mm), and a lip shears;
the screw is a cylinder of steel unless its inertia and mass are set. At the start all is at rest, without deflection: a
weight begins to settle.

supplied_energy = change of kinetic, potential and stored energy + heat, if preload and parameters stay. A change of the
preload is work of the preload, which no energy includes. In model exchange the importer integrates powers: heat is that
of events alone, supplied_energy is 0.
"""

import functools
import math
from typing import Any

import numpy as np

from ballscrew_fmu.variables.friction import (
    ELEMENT_STATES,
    FRICTION_PARAMETERS,
    Header,
    Names,
    Shared,
    Variable,
    film_rows,
    states,
    table_of,
)
from ballscrew_fmu.variables.transmission import of_screw, transmission_variables
from ballscrew_tehl.applications.axis.bearing_pair import pair_of
from ballscrew_tehl.applications.axis.parts import guide_force, middle, weight_along_axis
from ballscrew_tehl.parameters.file import Parameters
from ballscrew_tehl.parameters.identity import SCREW_FILE, map_parameters
from ballscrew_tehl.runtime.constants import AXIS_DAMPING_TIME, BEARING_SPEEDS, BEARING_TEMPERATURES

#: of bearing_table
BEARING_NUMBERS = 4 + BEARING_SPEEDS * BEARING_TEMPERATURES
_ELEMENTS = ELEMENT_STATES
_SCREW = ("screw_displacement", "screw_velocity")

# what outputs depend on: states and inputs, and parameters in initialization mode
_WAY = ("angle", "position", _SCREW[0])
_LOADS = (*_WAY, "preload", "temperature_difference")
_FORCE = (*_LOADS, "speed", "velocity", _SCREW[1])
_FRICTION = (*_LOADS, "speed", "temperature")
_TORQUE = (*_FRICTION, *_ELEMENTS)
_GUIDE = ("velocity", "guide_element")
_SHAFT = ("speed", "temperature", "shaft_element")
_ALL = (*_FORCE, "temperature", *_ELEMENTS, "guide_element", "shaft_element")
_SPRING = ("support_stiffness", "free_length", "rod_stiffness")
_ELASTIC = ("lead", "nut_stiffness", "stiffness_preload", "axial_play", "initial_position")
_DAMPED = (*_ELASTIC, "contact_damping_time", *_SPRING)
_LAW = tuple(
    name
    for name in FRICTION_PARAMETERS
    if name not in ("presliding", "regularization_speed")  # has no other law
)
_GUIDED = ("guide_viscous", "guide_coulomb", "guide_presliding_travel")
_BEARINGS = ("bearing_seal_torque", "bearing_friction_factor", "motor_coulomb", "shaft_presliding_angle")
_INERTIA = ("motor_inertia", "screw_inertia", "screw_diameter", "screw_length")
_MASS = ("screw_mass", "screw_diameter", "screw_length", *_SPRING, "inclination")


def _shared(row: str, depends_on: Names = (), initially: Names = (), **changes: Any) -> Shared:
    return Shared(row, {"depends_on": depends_on, "initially_depends_on": initially, **changes})


def _energy(name: str, description: str, depends_on: Names, initially: Names = ()) -> Variable:
    return Variable(
        name, "output", description, "J", nominal=1.0, depends_on=depends_on, initially_depends_on=initially,
    )  # fmt: skip


def _parameter(
    name: str, description: str, unit: str, start: float | None = None, nominal: float = 1.0, **fields: Any
) -> Variable:
    return Variable(
        name, "parameter", description, unit, start, **{"minimum": 0.0, "nominal": nominal, **fields}
    )


def _rate(
    of: str, unit: str, nominal: float, depends_on: Names, initially: Names = (), **fields: Any
) -> Variable:
    return Variable(
        f"{of}_rate", "local", f"Time derivative of {of}", unit, nominal=nominal, depends_on=depends_on,
        initially_depends_on=initially, derivative_of=of, **fields,
    )  # fmt: skip


_START = ("initial_position", "lead")
_ACCELERATED = (*_DAMPED, *_LAW)
#: where heat arises, in the order of the C code: what it is, what its power depends on
PLACES: dict[str, tuple[str, Names, Names]] = {
    "nut": ("the contacts in the nut", _TORQUE, (*_ELASTIC, *_LAW)),
    "wipers": ("seal_torque, wipers and seals of the nut", _TORQUE, (*_ELASTIC, *_LAW)),
    "bearings": ("the support bearings", _SHAFT, _BEARINGS),
    "motor": ("the friction of the motor", _SHAFT, _BEARINGS),
    "guide": ("the guide", _GUIDE, _GUIDED),
    "damping": ("the damping of contacts, bearing and screw", _FORCE, _DAMPED),
}

ROWS: tuple[Variable | Shared, ...] = (
    Variable(
        "motor_torque", "input", "Torque of the motor on the screw, in the air gap", "N.m", 0.0, nominal=10.0,
    ),
    Variable(
        "external_force", "input", "Force of the process on the table, along the position", "N", 0.0, nominal=1000.0,
    ),
    Shared("temperature"),
    Shared("preload"),
    Shared("temperature_difference"),
    Variable(
        "angle", "output", "Angle of the screw", "rad", nominal=1.0, display_unit="deg",
        depends_on=("angle",), initially_depends_on=_START,
    ),
    Variable(
        "speed", "output", "Speed of the screw", "rad/s", nominal=10.0, depends_on=("speed",),
        display_unit="rev/min",
    ),
    Variable(
        "position", "output", "Position of the table, along the screw", "m", nominal=0.1, display_unit="mm",
        depends_on=("position",), initially_depends_on=_START,
    ),
    Variable(
        "velocity", "output", "Velocity of the table", "m/s", nominal=0.1, depends_on=("velocity",),
        display_unit="m/min",
    ),
    _shared("friction_torque", _TORQUE, (*_ELASTIC, *_LAW)),
    _shared("viscous_torque", _FRICTION, (*_ELASTIC, *_LAW)),
    _shared("hysteresis_torque", _TORQUE, (*_ELASTIC, *_LAW)),
    _shared("sliding_torque", _TORQUE, (*_ELASTIC, *_LAW)),
    _shared("friction_torque_nut_a", _TORQUE, (*_ELASTIC, *_LAW)),
    _shared("friction_torque_nut_b", _TORQUE, (*_ELASTIC, *_LAW)),
    Variable(
        "guide_force", "output", "Friction of the guide, opposes the motion of the table", "N", nominal=1000.0,
        depends_on=_GUIDE, initially_depends_on=_GUIDED,
    ),
    _shared("nut_force", _FORCE, _DAMPED, description="Force of the screw on the table through the nut"),
    _shared("force_nut_a", _LOADS, _ELASTIC),
    _shared("force_nut_b", _LOADS, _ELASTIC),
    Variable(
        "axial_deflection", "output", "Way by which the screw leads the table: lead angle/(2 pi) - position", "m",
        nominal=1e-6, depends_on=("angle", "position"), initially_depends_on=_START, display_unit="um",
    ),
    _shared("axial_stiffness", _LOADS, _ELASTIC),
    _shared(
        "power_loss", _ALL, (*_ACCELERATED, *_GUIDED, *_BEARINGS),
        description="Dissipated power of all places, mean of the step",
    ),
    _shared("heat", _ALL),
    _energy(
        "stored_energy", "Elastic energy of contacts, bearing, screw and friction, 0 without load",
        (*_LOADS, *_ELEMENTS, "guide_element", "shaft_element"), (*_ELASTIC, *_LAW, *_SPRING, "temperature"),
    ),
    _energy("kinetic_energy", "Of screw and table", ("speed", "velocity", _SCREW[1]),
            ("table_mass", *_INERTIA, *_MASS)),
    _energy(
        "potential_energy", "Of table and screw in the field of gravity, 0 at position 0", ("position", _SCREW[0]),
        ("table_mass", *_START, *_MASS),
    ),
    _energy(
        "supplied_energy",
        "Work of motor torque and external force in all steps since the start. Model exchange does not compute it: 0, "
        "integrate motor_torque speed + external_force velocity",
        _ALL,
    )._replace(from_zero=True),
    *film_rows(_LOADS, _FRICTION, _ELASTIC),
    _shared(
        "in_range", _FRICTION, _ELASTIC,
        description="False while speed, temperature, preload or the force of a nut is outside the map and clamped for "
        "the friction",
    ),
    _shared("range_margin", _FRICTION, _ELASTIC),
    Shared("preload_actual"),
    Variable(
        "bearing_torque", "output", "Friction torque of the support bearings, opposes the motion of the screw", "N.m",
        nominal=1.0, depends_on=_SHAFT, initially_depends_on=_BEARINGS,
    ),
    Variable(
        "motor_friction_torque", "output", "Friction torque of the motor at the screw, opposes its motion", "N.m",
        nominal=1.0, depends_on=_SHAFT, initially_depends_on=_BEARINGS,
    ),
    *(
        Variable(
            f"power_{place}", "output", f"Part of power_loss of {of}, mean of the step", "W", minimum=0.0, nominal=10.0,
            depends_on=depends_on, initially_depends_on=initially,
        )
        for place, (of, depends_on, initially) in PLACES.items()
    ),
    _parameter("motor_inertia", "Inertia of motor and coupling (assumed)", "kg.m2", nominal=1e-3),
    _parameter("screw_inertia", "Inertia of the screw. 0: of a cylinder of steel", "kg.m2", 0.0, 1e-3),
    _parameter(
        "screw_mass", "Mass of the screw, used with a support. 0: of a cylinder of steel", "kg", 0.0, 10.0,
    ),
    _parameter(
        "screw_diameter", "Diameter of the screw, for inertia and mass", "m", nominal=0.01, display_unit="mm",
        fixed=True,
    ),
    _parameter(
        "screw_length", "Length of the screw, for inertia and mass (assumed)", "m", display_unit="mm", fixed=True,
    ),
    _parameter("table_mass", "Mass of the table with its load (assumed)", "kg", nominal=100.0),
    _parameter("guide_viscous", "Viscous friction of the guide", "N.s/m", 0.0, nominal=100.0),
    _parameter("guide_coulomb", "Friction of the guide without its viscous part (assumed)", "N", nominal=100.0),
    _parameter(
        "guide_presliding_travel", "Elastic travel of the guide before it slides (assumed)", "m", 1e-5, 1e-5,
        display_unit="um",
    ),
    _parameter(
        "inclination", "Inclination of the screw: pi/2 with the position upwards", "rad", 0.0, minimum=-0.5 * math.pi,
        maximum=0.5 * math.pi, display_unit="deg", fixed=True,
    ),
    _parameter(
        "support_stiffness", "Axial stiffness of the bearings of the screw and their seat. 0: rigid", "N/m", 0.0, 1e8,
        display_unit="N/um", fixed=True,
    ),
    _parameter(
        "free_length", "Screw between its fixed bearing and the nut at position 0, which is elastic. 0: rigid", "m",
        0.0, display_unit="mm", fixed=True,
    ),
    _parameter(
        "rod_stiffness", "Axial stiffness of the screw times its length. 0: rigid", "N", nominal=1e8, fixed=True,
    ),
    _parameter("bearing_seal_torque", "Friction of the contact seals of the support bearings", "N.m", 0.0, 0.1),
    _parameter(
        "bearing_friction_factor", "Multiplies the friction of the rows of the support bearings, which is a table over "
        "speed and temperature, 0 without a file of the axis", "1", 1.0,
    ),
    _parameter("motor_coulomb", "Friction of the motor at the screw: bearings, seal, brake", "N.m", 0.0, 0.1),
    _parameter(
        "shaft_presliding_angle", "Elastic angle of bearings and motor before they slide (assumed)", "rad", 0.01, 0.01,
        display_unit="deg",
    ),
    _parameter(
        "initial_position", "Position of the table at the start", "m", 0.0, 0.1, minimum=-1000.0, display_unit="mm",
        fixed=True,
    ),
    _parameter(
        "error_bound", "Allowed relative error of a part of a step of co-simulation", "1", 1e-6, 1e-6, minimum=1e-9
    ),
    *map(Shared, ("lead", "nut_stiffness", "stiffness_preload", "axial_play", "contact_damping_time")),
    *map(Shared, _LAW),
)  # fmt: skip
LOCALS: tuple[Variable | Shared, ...] = (
    Variable(
        "screw_displacement", "local", "Axial displacement of the screw in its support, a continuous state", "m",
        nominal=1e-6, display_unit="um",
    ),
    Variable(
        "screw_velocity", "local", "Axial velocity of the screw, a continuous state", "m/s", nominal=1e-2,
        display_unit="m/min",
    ),
    *(
        Variable(
            name, "local", f"Deflection of presliding element {i} times the root of its stiffness, a continuous state",
            "sqrt(J)", nominal=1e-3,
            initially_depends_on=(*_ELASTIC, *_LAW, "temperature", "preload", "temperature_difference"),
        )
        for i, name in enumerate(_ELEMENTS, 1)
    ),
    Variable(
        "guide_element", "local", "Deflection of the guide times the root of its stiffness, a continuous state",
        "sqrt(J)", nominal=1e-2,
    ),
    Variable(
        "shaft_element", "local",
        "Deflection of bearings and motor times the root of their stiffness, a continuous state", "sqrt(J)",
        nominal=1e-2,
    ),
    _rate("angle", "rad/s", 10.0, ("speed",), display_unit="rev/min"),
    _rate("speed", "rad/s2", 100.0, (*_FORCE, *_TORQUE, *_SHAFT, "motor_torque"),
          (*_ACCELERATED, *_INERTIA, *_BEARINGS)),
    _rate("position", "m/s", 0.1, ("velocity",), display_unit="m/min"),
    _rate(
        "velocity", "m/s2", 1.0, (*_FORCE, *_GUIDE, "external_force"),
        (*_DAMPED, *_GUIDED, "table_mass", "inclination"),
    ),
    _rate(_SCREW[0], "m/s", 1e-2, (_SCREW[1],), _SPRING, display_unit="m/min"),
    _rate(_SCREW[1], "m/s2", 1.0, _FORCE, (*_DAMPED, *_MASS)),
    *(
        _rate(name, "sqrt(J)/s", 0.1, (*_FRICTION, name), (*_ELASTIC, *_LAW))
        for name in _ELEMENTS
    ),
    _rate("guide_element", "sqrt(J)/s", 1.0, _GUIDE, _GUIDED),
    _rate("shaft_element", "sqrt(J)/s", 1.0, _SHAFT, _BEARINGS),
    _shared("in_range_indicator", _FRICTION, _ELASTIC),
    _shared("stiffness_indicator", _LOADS, (*_ELASTIC, *_LAW)),
    *(
        _shared(
            "slip_indicator_1", (*_FRICTION, name), (*_ELASTIC, *_LAW), name=f"slip_indicator_{i}",
            description=f"Event indicator of presliding element {i}: start or end of slip",
        )
        for i, name in enumerate(_ELEMENTS, 1)
    ),
    _shared(
        "slip_indicator_1", _GUIDE, _GUIDED, name="guide_slip_indicator",
        description="Event indicator of the guide: start or end of slip",
    ),
    _shared(
        "slip_indicator_1", _SHAFT, _BEARINGS, name="shaft_slip_indicator",
        description="Event indicator of bearings and motor: start or end of slip",
    ),
)  # fmt: skip


STEEL_DENSITY = 7850.0  # [kg/m3]
STEEL_MODULUS = 2.06e11  # [Pa]


def _starts(header: Header) -> dict[str, dict[str, Any]]:
    """Start values of an axis that suits the screw, in two digits, and what the screw file states: docs/axis.md."""
    diameter, mass = float(header["screw"]["diameter"]), 0.23 * float(header["screw"]["stiffness_preload"])
    values = {
        "screw_length": 25.0 * diameter, "table_mass": mass, "guide_coulomb": mass / 6.0,
        "motor_inertia": 1.5 * math.pi / 32.0 * STEEL_DENSITY * 25.0 * diameter**5,
        "rod_stiffness": STEEL_MODULUS * 0.25 * math.pi * diameter**2,
    }  # fmt: skip
    values = {name: float(f"{value:.2g}") for name, value in values.items()}
    if SCREW_FILE in header:
        values |= _stated(map_parameters(header), header)
    return {name: {"start": value} for name, value in values.items()}


def _stated(parameters: Parameters, header: Header) -> dict[str, float]:
    """Start values from a screw file with its tables of the axis."""
    screw, axis, guide = parameters.screw, parameters.axis, parameters.guide
    bearings, motor, wipers = parameters.support_bearings, parameters.motor, parameters.wipers
    # of the screw: ISO 3408-4
    core = screw.root_diameter or 2.0 * screw.nominal_radius - screw.ball_diameter * math.cos(
        screw.contact_angle
    )
    values: dict[str, float | None] = {"rod_stiffness": screw.youngs_modulus * 0.25 * math.pi * core**2}
    if axis is not None:
        values |= {
            "table_mass": axis.moved_mass,
            "inclination": axis.inclination,
            "free_length": axis.free_length,
        }
        if axis.free_length is not None and axis.stroke is not None:
            values["screw_length"] = axis.free_length + axis.stroke
    if guide is not None:
        values |= {"guide_coulomb": guide_force(parameters)[0], "guide_viscous": guide.viscous}
    if bearings is not None:
        seals = _bearings(str(header[SCREW_FILE]), *_ends(header))[1]
        values |= {"support_stiffness": bearings.axial_stiffness, "bearing_seal_torque": seals}
    if motor is not None:
        inertia = None if motor.inertia is None else motor.ratio**2 * motor.inertia
        values |= {"motor_coulomb": motor.ratio * middle(motor.friction_torque), "motor_inertia": inertia}
    if wipers is not None:
        values["seal_torque"] = middle(wipers.friction_torque)
    return {name: value for name, value in values.items() if value is not None}


def _ends(header: Header) -> tuple[float, float, float, float]:
    """Ends of speed and temperature of the map."""
    (slow, fast), (cold, hot) = (header["axes"][name][:2] for name in ("speed", "temperature"))
    return float(slow), float(fast), float(cold), float(hot)


@functools.lru_cache(maxsize=8)
def _bearings(
    screw_file: str, slow: float, fast: float, cold: float, hot: float
) -> tuple[tuple[float, ...], float]:
    """Torque of the rows of the support bearings (speed, temperature), and of their seals [N.m]."""
    parameters, speeds = Parameters.model_validate_json(screw_file), np.geomspace(slow, fast, BEARING_SPEEDS)
    pair = pair_of(parameters)
    rows = pair.table(speeds, np.linspace(cold, hot, BEARING_TEMPERATURES), weight_along_axis(parameters))
    return tuple(rows.ravel().tolist()), pair.seals[0]


def bearing_table(header: Header) -> tuple[float, ...]:
    """Ends of ln speed and of temperature, torque of the rows of the support bearings at nodes between [N.m].

    The nodes are equally spaced, over the range of the map, the temperature first. 0 without a file of the axis.
    ValueError: the law of the bearing does not reach as far.
    """
    slow, fast, cold, hot = ends = _ends(header)
    rows = (0.0,) * (BEARING_NUMBERS - 4)
    if SCREW_FILE in header and map_parameters(header).support_bearings is not None:
        rows = _bearings(str(header[SCREW_FILE]), *ends)[0]
    return (math.log(slow), math.log(fast), cold, hot, *rows)


def _once(v: Variable) -> Variable:
    return v._replace(
        depends_on=tuple(dict.fromkeys(v.depends_on)),
        initially_depends_on=tuple(n for n in dict.fromkeys(v.initially_depends_on) if n not in v.depends_on),
    )


def axis_variables(header: Header) -> tuple[Variable, ...]:
    """The table for the map with this header: inputs, outputs, parameters, then the other states, rates, indicators."""
    others = (*transmission_variables(header), *states(header))
    damping = (
        f"Damping of the elasto-slip elements. 0: stiffness times {1e3 * AXIS_DAMPING_TIME:g} ms (assumed), a quarter "
        "of that of BallScrewFriction, which needs it in explicit coupling"
    )
    changes: dict[str, dict[str, Any]] = {"presliding_damping": {"description": damping}}
    changes |= of_screw(header, screw_diameter="diameter") | _starts(header)
    return tuple(map(_once, table_of((*ROWS, *LOCALS), others, changes)))
