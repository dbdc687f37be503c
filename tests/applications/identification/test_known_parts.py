"""Preload of random axes whose parts have laws of their own, within the tolerance of what the screw file states."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from servo_log import CONSTANT, LEAD, TEMPERATURE, screw_log

from ballscrew_tehl.applications.axis import bearing_pair
from ballscrew_tehl.applications.axis.parts import SPREAD, STANDARD_GRAVITY, guide_force
from ballscrew_tehl.applications.identification import known_parts as parts
from ballscrew_tehl.applications.identification import preload as of_friction
from ballscrew_tehl.applications.identification.directions import Bidirectional
from ballscrew_tehl.applications.identification.dynamics import identify
from ballscrew_tehl.applications.identification.log.signals import Section, Signals
from ballscrew_tehl.friction.interval import DEVIATIONS
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map.file import VG100, packaged_map
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters import axis
from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw

MIDDLE = 50.0  # [rad/s]


class Pair:
    """Bearings of which half of the printed torque [N.m] is that of the seals."""

    def __init__(self, parameters):
        self.half = 0.5 * parameters.support_bearings.friction_torque[0]
        self.seals = self.half, self.half / SPREAD, self.half * SPREAD

    def torque(self, load, speed, temperature):
        rows = self.half * (0.8 + 0.2 * (speed / MIDDLE) ** 0.67)
        return SimpleNamespace(rows=rows, low=rows / SPREAD, high=rows * SPREAD)

    notes = ()

    def why_not(self, load, speed, temperature):
        return ""


@pytest.fixture(scope="module")
def law():
    parameters = load_screw(PACKAGED_VG100)
    nut_map = load_map(packaged_map(VG100), parameters)
    return of_friction.ScrewMap(parameters, nut_map, default_friction_set(parameters))


@pytest.fixture(autouse=True)
def pairs(monkeypatch):
    monkeypatch.setattr(bearing_pair, "pair_of", Pair)


def random_axis(law, rng):
    """Law with a screw file that has all tables; true preload [N]; true torque of the other parts over speed."""
    lowest, highest = law.preloads
    preload = math.exp(rng.uniform(math.log(4.0 * lowest), math.log(0.3 * highest)))
    nut = float(law.torque(preload, MIDDLE, TEMPERATURE))
    lead = law.parameters.screw.lead / (2.0 * math.pi)
    bearing, guide, wiper, motor = nut * rng.uniform((0.2, 0.1, 0.05, 0.05), (0.6, 0.3, 0.2, 0.15))
    tables = {
        "support_bearings": axis.SupportBearingParameters(
            bore=0.03, outer_diameter=0.062, preload=3e3, friction_torque=bearing, seals="contact"
        ),
        "guide": axis.GuideParameters(seal_resistance=0.125 * guide / lead),
        "axis": axis.AxisParameters(moved_mass=0.5 * guide / lead / 0.00245 / STANDARD_GRAVITY),
        "wipers": axis.WiperParameters(friction_torque=(wiper / 1.6, 1.6 * wiper)),
        "motor": axis.MotorParameters(friction_torque=motor),
    }
    law = law._replace(parameters=law.parameters.model_copy(update=tables))
    factors = np.exp(math.log(SPREAD) / DEVIATIONS * rng.standard_normal(4))
    levels, exponents = [1.0, guide_force(law.parameters)[0] * lead, wiper, motor], rng.normal(0.0, 0.07, 4)

    def others(speed):
        pair = Pair(law.parameters)
        curves = [pair.torque(0.0, speed, TEMPERATURE).rows + pair.seals[0], 1.0, 1.0, 1.0]
        true = zip(factors, levels, curves, exponents, strict=True)
        return sum(f * level * c * (np.maximum(speed, 0.1) / MIDDLE) ** e for f, level, c, e in true)

    return law, preload, others


def log_of(law, preload, others, seed, factor=1.0):
    """Friction of the whole axis at the screw from what a drive records; factor: on the law of the nut."""

    def evaluate(force, speed, kelvin):
        return SimpleNamespace(friction_torque=factor * law.torque(force, speed, kelvin) + others(speed))

    noise = 0.02 * float(law.torque(preload, MIDDLE, TEMPERATURE)) / CONSTANT
    _, angle, current = screw_log(SimpleNamespace(evaluate=evaluate), preload, seed, noise=noise, guides=0.0)
    signals = Signals(True, False, 1e-3, 0.0, [Section(angle, CONSTANT * current)], TEMPERATURE, None, {}, [])
    return of_friction.screw_friction(identify(signals, travel=5e-5 / LEAD), None)


def found(law, whole, **stated):
    known = parts.known_parts(law.parameters, stated, whole.speed, TEMPERATURE)
    nut = of_friction.without(whole, known.at(whole.speed).torque)
    return of_friction.PreloadedLog(
        nut, of_friction.found_preload(nut, law, TEMPERATURE, known), TEMPERATURE, known
    )


def computed(law, preload, other):
    """Without a log: exact friction of the nut and another torque [N.m]."""
    speed = np.geomspace(8.0, 150.0, 12)
    torque = law.torque(preload, speed, TEMPERATURE) + other
    return Bidirectional(speed, torque, 0.0 * speed, 1e-4 * torque)


@pytest.mark.parametrize("seed", range(3))
def test_interval_of_random_axes_holds_the_preload(law, seed):
    own, preload, others = random_axis(law, np.random.default_rng(seed))
    whole = log_of(own, preload, others, seed)
    log = found(own, whole)
    assert log.result.preload_low_n <= preload <= log.result.preload_high_n
    assert (log.result.shape_fits, log.known.not_stated) == (True, ())
    bare = found(law, whole)
    assert bare.result.preload_low_n > preload  # an upper bound, whose interval is none
    assert bare.known.not_stated == parts.PARTS


def test_ends_of_parts_add_up_in_torque_and_reach_0(law):
    whole = computed(law, 2000.0, 0.5)
    exact = found(law, whole, guide=(0.3, 0.0), bearings_and_seals=(0.2, 0.0)).result
    assert exact.preload_n == pytest.approx(2000.0, rel=1e-4)
    one, both = (
        found(law, whole, guide=(0.3, guide), bearings_and_seals=(0.2, seals)).result
        for guide, seals in ((0.2, 0.0), (0.16, 0.12))
    )
    assert both.preload_low_n == pytest.approx(one.preload_low_n, rel=1e-3)
    assert both.preload_high_n == pytest.approx(one.preload_high_n, rel=1e-3)
    assert one.preload_low_n < exact.preload_low_n
    nothing = found(law, whole, guide=(0.3, 1.0), bearings_and_seals=(0.2, 0.0)).result
    assert nothing.preload_low_n == 0.0 < nothing.preload_n < nothing.preload_high_n < math.inf
    with pytest.raises(ValueError, match=r"without the known parts -.* N.m; allowed: known parts smaller"):
        found(law, whole, guide=(2.0, 0.0))


def test_errors_of_parts_are_common_to_two_logs(law):
    logs = [computed(law, preload, 0.5) for preload in (1800.0, 2000.0)]
    changes = []
    for error in (0.0, 0.3):
        now, before = (found(law, log, guide=(0.4, error)) for log in logs)
        change = of_friction.change_of_preload(now, before, law)
        assert change.preload_ratio_low <= 0.9 <= change.preload_ratio_high
        changes.append(change.preload_ratio_high - change.preload_ratio_low)
    assert changes[0] < changes[1] < 0.5 * (now.result.preload_high_n / now.result.preload_n - 1.0)


def test_a_vertical_axis_loads_nut_and_law(law):
    heavy = law._replace(axial_load=1500.0)
    whole = computed(heavy, 1000.0, 0.0)
    assert found(heavy, whole).result.preload_n == pytest.approx(1000.0, rel=1e-4)
    assert found(law, whole).result.preload_n > 1100.0
