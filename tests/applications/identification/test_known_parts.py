"""Preload of random axes whose parts have their own friction laws, within the tolerance of what the screw file states."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from servo_log import CONSTANT, LEAD, TEMPERATURE, screw_log

from ballscrew_tehl.applications.axis import bearing_pair
from ballscrew_tehl.applications.axis.parts import SPREAD, STANDARD_GRAVITY, guide_force, weight_along_axis
from ballscrew_tehl.applications.identification.dynamics import identify
from ballscrew_tehl.applications.identification.known_parts import known_parts
from ballscrew_tehl.applications.identification.preload import (
    ScrewMap,
    found_preload,
    screw_friction,
    without,
)
from ballscrew_tehl.applications.identification.signals import Section, Signals
from ballscrew_tehl.friction.interval import DEVIATIONS
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map.file import VG100, packaged_map
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.axis import (
    AxisParameters,
    GuideParameters,
    MotorParameters,
    SupportBearingParameters,
    WiperParameters,
)
from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw

MIDDLE = 50.0  # [rad/s]


class Pair:
    """Law of bearings whose printed torque [N.m] is met within SPREAD."""

    def __init__(self, parameters):
        self.printed = parameters.support_bearings.friction_torque[0]
        self.seals = tuple(0.5 * self.printed * factor for factor in (1.0, 1.0 / SPREAD, SPREAD))

    def torque(self, load, speed, temperature):
        rows = 0.5 * self.printed * (0.8 + 0.2 * (speed / MIDDLE) ** 0.67) * (1.0 + abs(load) / 1e5)
        return SimpleNamespace(rows=rows, low=rows / SPREAD, high=rows * SPREAD)


@pytest.fixture(scope="module")
def law():
    parameters = load_screw(PACKAGED_VG100)
    return ScrewMap(parameters, load_map(packaged_map(VG100), parameters), default_friction_set(parameters))


@pytest.fixture(autouse=True)
def pairs(monkeypatch):
    monkeypatch.setattr(bearing_pair, "pair_of", Pair, raising=False)


def random_axis(law, rng):
    """Law of a screw file with all tables; true preload [N]; true torque of the other parts over speed."""
    lowest, highest = law.preloads
    preload = math.exp(rng.uniform(math.log(4.0 * lowest), math.log(0.3 * highest)))
    nut = float(law.torque(preload, MIDDLE, TEMPERATURE))
    lead = law.parameters.screw.lead / (2.0 * math.pi)
    bearing, guide, wiper, motor = nut * rng.uniform((0.2, 0.1, 0.05, 0.05), (0.6, 0.3, 0.2, 0.15))
    tables = {
        "support_bearings": SupportBearingParameters(
            bore=0.03, outer_diameter=0.062, preload=3e3, friction_torque=bearing, seals="contact"
        ),
        "guide": GuideParameters(seal_resistance=0.125 * guide / lead),
        "axis": AxisParameters(moved_mass=0.5 * guide / lead / 0.00245 / STANDARD_GRAVITY),
        "wipers": WiperParameters(friction_torque=(wiper / 1.6, 1.6 * wiper)),
        "motor": MotorParameters(friction_torque=motor),
    }
    parameters = law.parameters.model_copy(update=tables)
    spreads = math.log(SPREAD) / DEVIATIONS * rng.standard_normal(4)
    exponents = rng.normal(0.0, 0.07, 4)
    values = np.array([0.0, guide_force(parameters)[0] * lead, wiper, motor])

    def others(speed):
        rows, pair = Pair(parameters).torque(0.0, speed, TEMPERATURE).rows, Pair(parameters)
        torques = [rows + pair.seals[0], *(value + 0.0 * speed for value in values[1:])]
        return sum(
            torque * np.exp(spread) * (np.maximum(speed, 0.1) / MIDDLE) ** exponent
            for torque, spread, exponent in zip(torques, spreads, exponents, strict=True)
        )

    return law._replace(parameters=parameters, axial_load=weight_along_axis(parameters)), preload, others


def log_of(law, preload, others, seed, factor=1.0):
    """Friction of the whole axis at the screw from what a drive records."""
    nut = float(law.torque(preload, MIDDLE, TEMPERATURE))
    axis = SimpleNamespace(
        evaluate=lambda force, speed, kelvin: SimpleNamespace(
            friction_torque=factor * law.torque(force, speed, kelvin) + others(speed)
        )
    )
    _, angle, current = screw_log(axis, preload, seed, noise=0.02 * nut / CONSTANT, guides=0.0)
    signals = Signals(True, False, 1e-3, 0.0, [Section(angle, CONSTANT * current)], TEMPERATURE, None, {}, [])
    return screw_friction(identify(signals, travel=5e-5 / LEAD), None)


def found(law, whole, **stated):
    known = known_parts(law.parameters, stated, whole.speed, TEMPERATURE)
    return found_preload(without(whole, known.at(whole.speed).torque), law, TEMPERATURE, known), known
