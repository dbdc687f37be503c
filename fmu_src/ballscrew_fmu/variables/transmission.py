"""Table of the variables of BallScrewTransmission. Its friction and films are those of BallScrewFriction."""

from collections.abc import Mapping
from typing import Any

from ballscrew_fmu.variables.friction import (
    ELEMENT_STATES,
    FRICTION_PARAMETERS,
    Header,
    Names,
    Shared,
    Variable,
    film_rows,
    input_text,
    inputs,
    outputs,
    parameters,
    states,
    table_of,
)

_MOTION = ("angle", "speed", "position", "velocity")
_LOADS = (*_MOTION, "preload", "temperature_difference")
_ALL = (*_LOADS, "temperature")
#: [s] damping of the contacts over their stiffness: rolling bearings have 2.5e-6 to 2.5e-5, Kraemer, Dynamics of Rotors
#: and Foundations 1993
CONTACT_DAMPING_TIME = 1e-5
_ELASTIC = ("lead", "nut_stiffness", "stiffness_preload", "axial_play")
_DAMPED = (*_ELASTIC, "contact_damping_time")
_FRICTION = FRICTION_PARAMETERS


def _friction_row(
    name: str,
    depends_on: Names = (*_ALL, *ELEMENT_STATES),
    initially: Names = (*_ELASTIC, *_FRICTION),
    **changes: Any,
) -> Shared:
    """An output of BallScrewFriction, which here depends on both nut forces and with them on the motion."""
    return Shared(name, {"depends_on": depends_on, "initially_depends_on": initially, **changes})


_FORCE: Mapping[str, Any] = {"unit": "N", "nominal": 1000.0, "depends_on": _LOADS}
_POWER: Mapping[str, Any] = {"unit": "W", "nominal": 100.0}
ROWS: tuple[Variable | Shared, ...] = (
    Variable(
        "angle", "input", "Angle of the screw, at the start of a step", "rad", 0.0, nominal=1.0, display_unit="deg",
    ),
    Shared("speed"),
    Variable(
        "position", "input", "Position of the nut along the screw, at the start of a step", "m", 0.0, nominal=0.1,
        display_unit="mm",
    ),
    Variable("velocity", "input", "Velocity of the nut", "m/s", 0.0, nominal=0.1, display_unit="m/min"),
    Shared("temperature"),
    Shared("preload"),
    Shared("temperature_difference"),
    Variable(
        "screw_torque", "output",
        "Torque that the screw takes: J dw/dt = motor torque - screw_torque; lead/(2 pi) nut_force + friction_torque",
        "N.m", nominal=1.0, depends_on=(*_ALL, *ELEMENT_STATES), initially_depends_on=(*_DAMPED, *_FRICTION),
    ),
    Variable(
        "nut_force", "output", "Force of the screw on the nut: m dv/dt = nut_force - other forces",
        initially_depends_on=_DAMPED, **_FORCE,
    ),
    _friction_row("friction_torque", description="Friction torque of both nuts, opposes the motion of the screw"),
    _friction_row("viscous_torque", depends_on=_ALL),
    _friction_row("hysteresis_torque"),
    _friction_row("sliding_torque"),
    _friction_row("friction_torque_nut_a", description="Friction torque of the nut loaded by a positive nut_force"),
    _friction_row("friction_torque_nut_b", description="Friction torque of the other nut"),
    Variable(
        "force_nut_a", "output", "Force of the contacts of the nut that a positive nut_force loads", minimum=0.0,
        initially_depends_on=_ELASTIC, **_FORCE,
    ),
    Variable(
        "force_nut_b", "output", "Force of the contacts of the other nut", minimum=0.0, initially_depends_on=_ELASTIC,
        **_FORCE,
    ),
    Variable(
        "damping_force", "output", "Part of nut_force from the damping of the contacts", initially_depends_on=_DAMPED,
        **_FORCE,
    ),
    Variable(
        "axial_deflection", "output", "Way by which the screw leads the nut: lead angle/(2 pi) - position", "m",
        nominal=1e-6, display_unit="um", depends_on=_MOTION, initially_depends_on=("lead",),
    ),
    Variable(
        "axial_stiffness", "output", "Stiffness of the nut at this load", "N/m", minimum=0.0, nominal=1e9,
        display_unit="N/um", depends_on=_LOADS, initially_depends_on=_ELASTIC,
    ),
    Variable(
        "efficiency", "output",
        "Share of the power that arrives in steady motion, screw driving nut or nut driving screw; 0 without load", "1",
        minimum=0.0, maximum=1.0, nominal=1.0, depends_on=_ALL, initially_depends_on=(*_DAMPED, *_FRICTION),
    ),
    Variable(
        "shaft_power", "output", "Power from the shaft into the screw, mean of the step",
        depends_on=(*_ALL, *ELEMENT_STATES), initially_depends_on=(*_DAMPED, *_FRICTION), **_POWER,
    ),
    Variable(
        "nut_power", "output", "Power from the screw to the nut, mean of the step", depends_on=_LOADS,
        initially_depends_on=_DAMPED, **_POWER,
    ),
    _friction_row(
        "power_loss", description="Dissipated power of friction and damping, mean of the step",
        initially=(*_DAMPED, *_FRICTION),
    ),
    Variable(
        "stored_energy", "output",
        "Elastic energy of contacts and presliding, 0 without load: shaft_power - nut_power - power_loss is its rate",
        "J", nominal=1e-3, depends_on=(*_ALL, *ELEMENT_STATES), initially_depends_on=(*_ELASTIC, *_FRICTION),
    ),
    *film_rows(_LOADS, _ALL, _ELASTIC),
    _friction_row(
        "in_range", _ALL, _ELASTIC,
        description="False while an input or the force of a nut is outside the map and clamped for the friction",
    ),
    _friction_row("range_margin", _ALL, _ELASTIC),
    _friction_row("heat", initially=()),
    Shared("preload_actual"),
    Variable(
        "lead", "parameter", "Travel of the nut in one turn of the screw. Negative: left-hand thread", "m",
        minimum=-1.0, nominal=0.01, display_unit="mm", fixed=True,
    ),
    Variable(
        "nut_stiffness", "parameter",
        "Axial stiffness of the unloaded nut at stiffness_preload; start value: Hertz contacts between rigid bodies",
        "N/m", minimum=0.0, nominal=1e9, display_unit="N/um", fixed=True,
    ),
    Variable(
        "stiffness_preload", "parameter", "Preload at which the nut has nut_stiffness", "N", minimum=0.0,
        nominal=1000.0, fixed=True,
    ),
    Variable(
        "axial_play", "parameter", "Free way of the nut while preload is 0", "m", 0.0, 0.0, nominal=1e-5,
        display_unit="um", fixed=True,
    ),
    Variable(
        "contact_damping_time", "parameter", "Damping of the contacts divided by their stiffness (assumed)",
        "s", CONTACT_DAMPING_TIME, 0.0, nominal=1e-5,
    ),
    *map(Shared, _FRICTION),
)  # fmt: skip


def _state_row(v: Variable) -> Variable:
    """A row of STATES, which here depends on the motion."""
    if not (v.derivative_of or v.indicates):
        return v._replace(initially_depends_on=(*_ALL, *_ELASTIC, *_FRICTION))
    kind, *number = v.name.removesuffix("_rate").rsplit("_", 1)  # presliding_element_1_rate, slip_indicator_1
    if number[-1].isdigit():
        return v._replace(
            depends_on=(*_ALL, f"presliding_element_{number[-1]}"),
            initially_depends_on=(*_ELASTIC, *_FRICTION),
        )
    loads = _LOADS if kind == "stiffness" else _ALL
    return v._replace(depends_on=loads, initially_depends_on=(*_ELASTIC, *v.initially_depends_on))


def of_screw(header: Header, **names: str) -> dict[str, dict[str, Any]]:
    """Start values of parameters from the numbers of the screw of these names that the map carries."""
    return {name: {"start": float(header["screw"][number])} for name, number in names.items()}


def transmission_variables(header: Header) -> tuple[Variable, ...]:
    """The table for the map with this header: inputs, outputs, parameters, then the elasto-slip elements."""
    others = (*inputs(header), *outputs(header), *parameters(header))
    changes: dict[str, dict[str, Any]] = {
        "speed": {"description": input_text(header, "speed", "Speed of the screw")},
        "preload": {"description": input_text(header, "preload", "Preload of the screw without axial load")},
    }
    numbers = ("lead", "nut_stiffness", "stiffness_preload")
    changes |= of_screw(header, **dict(zip(numbers, numbers, strict=True)))
    return (*table_of(ROWS, others, changes), *map(_state_row, states(header)))
