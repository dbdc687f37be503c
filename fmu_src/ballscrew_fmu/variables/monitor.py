"""Table of the variables of BallScrewPreloadMonitor. Its friction parameters are those of BallScrewFriction."""

from typing import Any

from ballscrew_fmu.variables.friction import (
    Header,
    Shared,
    Variable,
    band_half_width,
    inputs,
    largest_force,
    parameters,
    start_preload,
    table_of,
)
from ballscrew_tehl.runtime.packed import DEFAULTS

_ALL = ("torque", "speed", "temperature", "axial_load", "temperature_difference")
_FRICTION = (*DEFAULTS, "regularization_speed", "seal_torque")
_PRELOAD = (*_FRICTION, "speed_min", "initial_preload")
_INTERVAL = (*_PRELOAD, "torque_uncertainty", "law_uncertainty")


ROWS: tuple[Variable | Shared, ...] = (
    Variable(
        "torque", "input",
        "Measured friction torque without inertia torque, positive if it opposes positive speed",
        "N.m", 0.0, nominal=1.0,
    ),
    Shared("speed"),
    Shared("temperature"),
    Shared("axial_load"),
    Shared("temperature_difference"),
    Variable(
        "preload", "output",
        "Preload with screw and nut at one temperature. Below speed_min: the last one that was in range",
        "N", minimum=0.0, nominal=1000.0, depends_on=_ALL, initially_depends_on=_PRELOAD,
    ),
    Variable(
        "preload_half_width", "output",
        "Half-width of the preload interval: both uncertainties over torque_sensitivity, at most the end of the map",
        "N", minimum=0.0, nominal=100.0, depends_on=_ALL,
        initially_depends_on=_INTERVAL,
    ),
    *(
        Variable(
            f"preload_{end}", "output", f"{end.capitalize()} end of the preload interval, within the map", "N",
            minimum=0.0, nominal=1000.0, depends_on=_ALL, initially_depends_on=_INTERVAL,
        )
        for end in ("low", "high")
    ),
    Variable(
        "torque_sensitivity", "output",
        "Derivative of friction torque with respect to preload, at speed_min if the speed is lower",
        "N.m/N", minimum=0.0, nominal=1e-4, depends_on=_ALL, initially_depends_on=_PRELOAD,
    ),
    Variable(
        "lambda_ratio", "output", "Minimum film thickness at this preload divided by roughness_height, at most 1000",
        "1", minimum=0.0, maximum=1000.0, nominal=1.0, depends_on=_ALL, initially_depends_on=_PRELOAD,
        needs="films",
    ),
    Variable(
        "in_range", "output",
        "True while the torque determines the preload: speed >= speed_min, inputs and preload within the map",
        depends_on=_ALL, initially_depends_on=(*_FRICTION, "speed_min"),
    ),
    *map(Shared, _FRICTION[:-1]),
    Shared("seal_torque", {"description": "Drag of the seals, subtracted from the measured torque"}),
    Variable(
        "speed_min", "parameter", "Magnitude of speed below which the torque does not determine the preload",
        "rad/s", 1.0, 0.0, nominal=1.0, display_unit="rev/min",
    ),
    Variable(
        "torque_uncertainty", "parameter", "Half-width of the uncertainty interval of the measured torque", "N.m",
        0.02, 0.0, nominal=0.01,
    ),
    Variable(
        "initial_preload", "parameter", "Preload reported before the first valid estimate", "N", minimum=0.0,
        nominal=1000.0, fixed=True,
    ),
    Variable(
        "law_uncertainty", "parameter",
        "Half-width of the interval of the law's torque over it; 0: changes since a calibration",
        "1", minimum=0.0, nominal=0.1,
    ),
)  # fmt: skip
INDICATORS = (
    Variable(
        "in_range_indicator", "local", "Event indicator of in_range, without its condition on speed", "1", nominal=1.0,
        depends_on=_ALL, initially_depends_on=(*_FRICTION, "speed_min"), indicates=True,
    ),
    Variable(
        "motion_indicator", "local", "Event indicator of motion: the speed crosses speed_min",
        "rad/s", nominal=1.0, depends_on=("speed",), initially_depends_on=("speed_min",), indicates=True,
    ),
)  # fmt: skip


def _of_header(header: Header) -> dict[str, dict[str, Any]]:
    force = largest_force(header)
    ends = ("preload_half_width", "preload_low", "preload_high")
    return {name: {"maximum": force} for name in ends} | {
        "initial_preload": {"start": start_preload(header), "maximum": force},
        "law_uncertainty": {"start": band_half_width(header)},
    }


def monitor_variables(header: Header) -> tuple[Variable, ...]:
    """Inputs, outputs, parameters, event indicators for the map with this header. There is no continuous state."""
    return (*table_of(ROWS, (*inputs(header), *parameters(header)), _of_header(header)), *INDICATORS)
