"""Runs of the native model at and near standstill with the start values of its parameters: reversals, a held rotor."""

import math
from typing import NamedTuple

import numpy as np
from native_model import NativeModel

from ballscrew_tehl.runtime.evaluate import NutMap

ACCELERATIONS = (10.0, 100.0, 1000.0, 5000.0)  # [rad/s2]
STEPS = (1e-5, 1e-4, 1e-3)  # [s]
INERTIAS = (0.001, 0.01, 0.1)  # [kg m2]
REVERSAL_SPEED = 5.0  # [rad/s] before and after
LOAD = {"preload": 2000.0, "temperature": 303.15}


def coulomb_level(nut_map: NutMap, speed: float) -> float:
    """Coulomb torque at a speed, breakaway included [N.m]."""
    return float(nut_map.evaluate(LOAD["preload"], speed, LOAD["temperature"]).coulomb_torque)


def reversal_peak(
    model: NativeModel, nut_map: NutMap, acceleration: float, step: float, exchange: bool
) -> float:
    """Largest Coulomb part over its level while the speed goes from + to - REVERSAL_SPEED at this rate.

    In model exchange the bristle is integrated by Euler in substeps of 0.1 ms travel at most, with events.
    """
    model.reset(exchange)
    model.latch(**LOAD, speed=REVERSAL_SPEED)
    if exchange:
        model.initial_event()
    largest = 0.0
    for n in range(max(2, round(2.0 * REVERSAL_SPEED / acceleration / step)) + 1):
        speed = max(REVERSAL_SPEED - acceleration * n * step, -REVERSAL_SPEED)
        if exchange:
            follow(model, speed, step)
        else:
            model.step(step, speed=speed)
        coulomb = model.get("hysteresis_torque") + model.get("sliding_torque")
        largest = float(np.maximum(largest, abs(coulomb) / coulomb_level(nut_map, speed)))
    return largest


def follow(model: NativeModel, speed: float, step: float) -> None:
    """Model exchange: integrate the bristle over a step at this speed, with events."""
    model.latch(speed=speed)
    pieces = max(1, math.ceil(abs(speed) * step / 1e-4))
    for _ in range(pieces):
        if model.get("slip_indicator") < 0.0:
            model.event()
        rate = model.get("presliding_deflection_rate")
        if rate == 0.0:
            break
        model.latch(presliding_deflection=model.get("presliding_deflection") + step / pieces * rate)


class Held(NamedTuple):
    """A rotor under a constant torque."""

    drift: float  # [rad] largest change of angle in the last 10 s
    speed: float  # [rad/s] at the end


def rotor(
    model: NativeModel,
    load: float,
    inertia: float,
    step: float,
    friction_first: bool,
    settle: float,
    hold: float,
) -> Held:
    """A rotor from rest under a torque [N.m], coupled explicitly; the drift is that after `settle` seconds."""
    model.reset()
    model.latch(**LOAD)
    speed = angle = torque = 0.0
    angles = []
    for n in range(round((settle + hold) / step)):
        model.step(step, speed=speed)
        new = model.get("friction_torque")
        angle += step * speed
        speed += step * (load - (new if friction_first else torque)) / inertia
        torque = new
        if n * step >= settle:
            angles.append(angle)
    return Held(float(np.ptp(angles)) if angles else math.nan, speed)
