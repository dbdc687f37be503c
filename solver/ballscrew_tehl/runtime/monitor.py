"""One step of the FMU BallScrewPreloadMonitor from measured torque to preload. Twin: native/models/monitor/model.c."""

import math
from typing import Any, NamedTuple

from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import DEFAULTS, FrictionParameters
from ballscrew_tehl.runtime.preload import OverPreload, estimate_preload
from ballscrew_tehl.runtime.standstill import regularised_sign


class MonitorInputs(NamedTuple):
    """Inputs of the FMU, under their names."""

    torque: float  # [N.m] measured, positive when it opposes a positive speed
    speed: float  # [rad/s]
    temperature: float  # [K]
    axial_load: float  # [N]


class MonitorParameters(NamedTuple):
    """Parameters of the FMU, under their names."""

    apparent_viscosity_ratio: float
    net_sliding_coefficient: float
    roughness_height: float  # [m]
    breakaway_factor: float
    regularization_speed: float  # [rad/s]
    speed_min: float  # [rad/s] below it the torque does not determine the preload
    torque_uncertainty: float  # [N.m]
    initial_preload: float  # [N]
    law_uncertainty: float  # [1] half-width of the interval of the law over its torque
    seal_torque: float = 0.0  # [N.m] subtracted from the measured torque


class MonitorStep(NamedTuple):
    """Outputs of a step, and what the next one needs."""

    outputs: dict[str, Any]
    preload: float | None  # [N] of the last step that was in range, this one included; None: none yet
    clamped: tuple[str, ...]  # inputs beyond the map


def monitor_step(
    nut_map: NutMap, inputs: MonitorInputs, parameters: MonitorParameters, held: float | None
) -> MonitorStep:
    """Outputs from finite inputs; held: preload of the last step that was in range [N], None before the first."""
    given, speed, slowest = parameters, inputs.speed, parameters.speed_min
    friction = FrictionParameters(*(getattr(given, name) for name in DEFAULTS))
    point, highest = (inputs.temperature, inputs.axial_load, friction), nut_map.force.hi
    moving = abs(speed) >= slowest and speed != 0.0
    seals = given.seal_torque * regularised_sign(max(abs(speed), slowest), given.regularization_speed)
    torque = inputs.torque - (-seals if speed < 0.0 else seals)
    uncertainty = math.hypot(given.torque_uncertainty, given.law_uncertainty * torque)
    if moving:
        found = estimate_preload(nut_map, torque, speed, *point, given.regularization_speed)
        preload, slope, clamped = found.preload, found.torque_sensitivity, found.clamped
    else:
        preload = given.initial_preload if held is None else held
        over = OverPreload(nut_map, max(abs(speed), slowest), *point, given.regularization_speed)
        slope = max(over.torque(min(preload, highest)).slope, 0.0)
    # films at this preload, and what else is beyond the map
    nut = nut_map.evaluate_point(preload, speed, inputs.temperature, inputs.axial_load, *friction)
    if not moving:
        clamped = tuple(name for name in nut.clamped if name != "preload")
    in_range = moving and not clamped
    half_width = uncertainty / slope if uncertainty < slope * highest else highest
    outputs = {
        **nut._asdict(),
        "preload": preload,
        "preload_half_width": half_width,
        "preload_low": max(preload - half_width, 0.0),
        "preload_high": min(preload + half_width, highest),
        "torque_sensitivity": slope,
        "in_range": in_range,
    }
    return MonitorStep(outputs, preload if in_range else held, clamped)
