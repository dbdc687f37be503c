"""Table of the variables of BallScrewAxis: the ball screw with motor inertia, table and guide. Equations of the model.

Angle phi and speed of the screw, position x and velocity of the table, r = lead/(2 pi). The deflection of the nut is
d = r phi + u - x with the axial displacement u of the screw in its bearing; contacts and friction at the deflection
are those of BallScrewTransmission (native/models/transmission/contacts.h).

    (motor_inertia + screw_inertia) dspeed/dt = motor_torque - r nut_force - friction_torque
    table_mass dvelocity/dt = nut_force + external_force - guide_force - table_mass g sin(inclination)
    screw_mass d2u/dt2      = -nut_force - support_stiffness u - support damping - screw_mass g sin(inclination)

Without support_stiffness u is locked. Friction torque: elasto-slip elements in parallel (presliding_law.h) and the
viscous part of the map at the forces of both nuts. guide_force: guide_viscous velocity and one elasto-slip element,
elastic to guide_coulomb over guide_presliding_travel.

Assumed: screw and table are rigid, so are motor shaft and coupling; balls have no mass; the damping of contacts and
support is contact_damping_time times their stiffness; the support has the same stiffness in both directions; the guide
carries no moment and its friction does not depend on the load; the screw is a cylinder of steel unless its inertia and
mass are set. At the start all is at rest, without deflection: a weight begins to settle.

supplied_energy = change of kinetic, potential and stored energy + heat, if preload and parameters stay. A change of the
preload is work of the preload, which no energy includes. In model exchange the importer integrates powers: heat is that
of events alone, supplied_energy is 0.
"""

import math
from typing import Any

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
from ballscrew_tehl.runtime.constants import AXIS_DAMPING_TIME

_ELEMENTS = ELEMENT_STATES
_SCREW = ("screw_displacement", "screw_velocity")

# what outputs depend on: states and inputs, and parameters in initialization mode
_WAY = ("angle", "position", _SCREW[0])
_LOADS = (*_WAY, "preload", "temperature_difference")
_FORCE = (*_LOADS, "speed", "velocity", _SCREW[1])
_FRICTION = (*_LOADS, "speed", "temperature")
_TORQUE = (*_FRICTION, *_ELEMENTS)
_GUIDE = ("velocity", "guide_element")
_ALL = (*_FORCE, "temperature", *_ELEMENTS, "guide_element")
_ELASTIC = ("lead", "nut_stiffness", "stiffness_preload", "axial_play", "initial_position")
_DAMPED = (*_ELASTIC, "contact_damping_time", "support_stiffness")
_LAW = tuple(
    name
    for name in FRICTION_PARAMETERS
    if name not in ("presliding", "regularization_speed")  # has no other law
)
_GUIDED = ("guide_viscous", "guide_coulomb", "guide_presliding_travel")
_INERTIA = ("motor_inertia", "screw_inertia", "screw_diameter", "screw_length")
_MASS = ("screw_mass", "screw_diameter", "screw_length", "support_stiffness", "inclination")


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
        "power_loss", _ALL, (*_ACCELERATED, *_GUIDED),
        description="Dissipated power of friction, guide and damping, mean of the step",
    ),
    _shared("heat", _ALL),
    _energy(
        "stored_energy", "Elastic energy of contacts, support and friction, 0 without load",
        (*_LOADS, *_ELEMENTS, "guide_element"), (*_ELASTIC, *_LAW, "support_stiffness", "temperature"),
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
    _parameter("guide_viscous", "Viscous friction of the guide (assumed)", "N.s/m", nominal=100.0),
    _parameter("guide_coulomb", "Coulomb friction of the guide (assumed)", "N", nominal=100.0),
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
    _rate("angle", "rad/s", 10.0, ("speed",), display_unit="rev/min"),
    _rate("speed", "rad/s2", 100.0, (*_FORCE, *_TORQUE, "motor_torque"), (*_ACCELERATED, *_INERTIA)),
    _rate("position", "m/s", 0.1, ("velocity",), display_unit="m/min"),
    _rate(
        "velocity", "m/s2", 1.0, (*_FORCE, *_GUIDE, "external_force"),
        (*_DAMPED, *_GUIDED, "table_mass", "inclination"),
    ),
    _rate(_SCREW[0], "m/s", 1e-2, (_SCREW[1],), ("support_stiffness",), display_unit="m/min"),
    _rate(_SCREW[1], "m/s2", 1.0, _FORCE, (*_DAMPED, *_MASS)),
    *(
        _rate(name, "sqrt(J)/s", 0.1, (*_FRICTION, name), (*_ELASTIC, *_LAW))
        for name in _ELEMENTS
    ),
    _rate("guide_element", "sqrt(J)/s", 1.0, _GUIDE, _GUIDED),
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
)  # fmt: skip


STEEL_DENSITY = 7850.0  # [kg/m3]


def _starts(header: Header) -> dict[str, dict[str, Any]]:
    """Start values of an axis that suits the screw, in two digits: docs/axis.md."""
    diameter, mass = float(header["screw"]["diameter"]), 0.23 * float(header["screw"]["stiffness_preload"])
    values = {
        "screw_length": 25.0 * diameter, "table_mass": mass, "guide_coulomb": mass / 6.0, "guide_viscous": mass / 0.75,
        "motor_inertia": 1.5 * math.pi / 32.0 * STEEL_DENSITY * 25.0 * diameter**5,
    }  # fmt: skip
    return {name: {"start": float(f"{value:.2g}")} for name, value in values.items()}


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
