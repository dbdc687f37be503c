"""Interval of the mechanistic torque: moments, ends of every constant, a Latin hypercube, the measured points."""

import dataclasses
import math

import numpy as np
import pytest
from law_contacts import ClosedContacts
from scipy.stats import qmc

from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.calibration.measured_screw import packaged_measurements
from ballscrew_tehl.friction.interval import (
    FITTED_COEFFICIENT,
    LEFT_OUT,
    torque_interval,
    uniform_moments,
    unknown_constants,
    with_constants,
)
from ballscrew_tehl.friction.mechanistic import double_nut_parts
from ballscrew_tehl.friction.sets import FrictionSet, default_friction_set
from ballscrew_tehl.parameters.file import PACKAGED_DATA, Law, changed, load_screw
from ballscrew_tehl.parameters.friction_constants import BOUNDED
from ballscrew_tehl.parameters.identity import parameters_hash
from ballscrew_tehl.parameters.screw import ball_ball_coefficient
from ballscrew_tehl.parameters.units import CELSIUS, RPM

LAW = load_screw(PACKAGED_DATA / "gd4008_vg100.toml")
FREE = default_friction_set(changed(LAW, friction={"ball_thrust": BOUNDED["ball_thrust"].value}))
FITTED = dataclasses.replace(
    FREE, net_sliding_coefficient=0.0116, parameters_hash=parameters_hash(LAW),
    intervals={"net_sliding_coefficient": 0.0004}, errors={"leave_one_out_mean": 0.03},
)  # fmt: skip
#: forces of the nuts [N], speed [rad/s], temperature [K]
SLOW, FAST = ([1000.0, 1000.0], 100.0 * RPM, 303.0), ([6000.0, 6000.0], 2500.0 * RPM, 303.0)


def interval(point, friction_set=FREE):
    forces, *at = point
    return torque_interval(LAW, forces, ClosedContacts(), *at, friction_set)


def test_moments_are_those_of_the_parabola():
    for low, high, place in [(-0.7, 0.4, 0.5), (-0.1, 0.9, 0.25), (0.3, -0.2, 0.9), (-1.0, 1.0, 0.0)]:
        x, weights = np.polynomial.legendre.leggauss(5)
        x, weights = 0.5 * (x + 1.0), 0.5 * weights
        nodes = [0.0, place, 1.0] if place else [0.0, 1.0]
        through = np.polyfit(nodes, [low, 0.0, high] if place else [low, high], len(nodes) - 1)
        y = np.polyval(through, x)
        mean, variance = uniform_moments(low, high, place)
        assert abs(mean - weights @ y) <= 1e-12
        assert abs(variance - (weights @ y**2 - (weights @ y) ** 2)) <= 1e-12


def test_ends_of_the_thrust_are_torques_of_screws_that_state_it():
    bound = BOUNDED["ball_thrust"]
    for torque, kappa in zip(interval(SLOW).ends["ball_thrust"], (bound.low, bound.high), strict=True):
        other = changed(LAW, friction={"ball_thrust": kappa})
        coefficient = default_friction_set(other).net_sliding_coefficient
        parts = double_nut_parts(other, SLOW[0], ClosedContacts(), *SLOW[1:], 1.0, coefficient)
        assert torque == pytest.approx(parts.total, rel=1e-12)


@pytest.mark.slow
def test_interval_holds_about_80_percent_of_a_latin_hypercube():
    """Found 78 and 80 %: effects of two constants on each other are neglected; 120 points of a hypercube."""
    for point in [SLOW, FAST]:
        forces, *at = point
        found, names = interval(point), list(BOUNDED)

        def torque(values, forces=forces, at=at):
            changed = with_constants(LAW, values)
            k = ball_ball_coefficient(changed.friction, values["ball_thrust"])
            return double_nut_parts(changed, forces, ClosedContacts(), *at, 1.0, k).total

        low, high = (np.array([getattr(BOUNDED[name], end) for name in names]) for end in ("low", "high"))
        x = qmc.LatinHypercube(len(names), seed=3).random(120)
        # a length without a longest one is uniform in 1/length
        sample = np.where(
            np.isinf(high), low / (1.0 - x), low + np.where(np.isinf(high), 0.0, high - low) * x
        )
        torques = np.array([torque(dict(zip(names, row, strict=True))) for row in sample])
        held = np.mean((torques >= found.low) & (torques <= found.high))
        assert 0.69 <= held <= 0.86
        assert 0.05 <= np.mean(torques < found.low) <= 0.2
        # the middle of the interval is the median of the sample
        assert abs(math.log(found.low * found.high / np.median(torques) ** 2)) <= 0.12


def test_interval_holds_the_measured_torques():
    """Of the eleven, at 20, 25, 30, 35 C, for the temperature is not printed: not fitted, then fitted; mean width."""
    unfitted = FrictionSet(Law.MECHANISTIC, 1.0, ball_ball_coefficient(LAW.friction))
    contacts, counts, widths = BallContacts(LAW), [], []
    for entry in (unfitted, default_friction_set(LAW)):
        for celsius in (20.0, 25.0, 30.0, 35.0):
            points = packaged_measurements(celsius + CELSIUS)
            found = [
                torque_interval(LAW, [m.preload] * 2, contacts, m.speed, m.temperature, entry) for m in points
            ]
            counts.append(sum(i.low <= m.torque <= i.high for i, m in zip(found, points, strict=True)))
            widths.append(np.mean([i.high / i.low for i in found]))
    assert counts == [9, 11, 11, 11, 10, 11, 11, 10]
    assert np.all((np.array(widths[:4]) >= 2.3) & (np.array(widths[:4]) <= 2.6))
    assert np.all((np.array(widths[4:]) >= 1.3) & (np.array(widths[4:]) <= 1.5))


def test_stated_constants_are_known():
    assert unknown_constants(LAW) == tuple(BOUNDED)
    surfaces = changed(LAW, friction={"raceway_rq": 1e-7, "ball_rq": 3e-8, "boundary_friction": 0.1})
    assert set(BOUNDED) - set(unknown_constants(surfaces)) == {"roughness_height", "boundary_friction"}
    oil = LAW.model_copy(update={"lubricant": changed(LAW, lubricant={"eyring_stress": 4e6}).lubricant})
    assert "eyring_stress" not in unknown_constants(oil)
    coefficient = changed(LAW, friction={"net_sliding_coefficient": 0.012})
    assert "ball_thrust" not in unknown_constants(coefficient)


def test_fitted_interval_is_that_of_the_coefficient():
    """Constants that enter through the coefficient alone do not count: in a thick film mu_b is not to be seen."""
    found = interval(FAST, FITTED)
    assert "ball_thrust" not in found.ends
    assert found.shares["boundary_friction"] <= 1e-3
    assert {FITTED_COEFFICIENT, LEFT_OUT} <= set(found.shares)
    low, high = found.ends[FITTED_COEFFICIENT]
    deviation = math.log(high / low) / (2.0 * 1.96)
    assert found.shares[FITTED_COEFFICIENT] / found.shares[LEFT_OUT] == pytest.approx(
        deviation**2 / (0.5 * math.pi * 0.03**2), rel=1e-9
    )
    assert found.low < found.torque < found.high
    assert found.high / found.low < 1.25 < interval(FAST).high / interval(FAST).low
