"""Torque of the nut and of the double nut: hand-checked numbers, sums, limits, recovered preload."""

import math

import numpy as np
import pytest
from closed_film import HamrockDowsonFilm
from reference_screw import GD4008
from section7 import BASIS, BETA, FILM, RPM, TEMPERATURE, uniform_sums

from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.friction.torque import (
    NO_TORQUE,
    UNLOADED,
    double_nut_torque,
    nut_sums,
    preload_from_torque,
)
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.load import double_nut_loads, nut_loads

PUBLISHED_VALUES = (0.297 / 0.033, 0.0037, 0.0)
SET = FrictionSet("by hand", "published", "hamrock_dowson", *PUBLISHED_VALUES)


def test_films_against_hand_calculation():
    sums = uniform_sums(1000.0, 100 * RPM)
    assert round(1e9 * sums.film_screw, 1) == 42.9
    assert round(1e9 * sums.film_nut, 1) == 23.1


def test_eleven_torques_against_hand_calculation():
    # eta_i = 0.297 Pa s, mu = 0.0037, without hysteresis; four digits stated
    stated = [0.4442, 0.8152, 1.1673, 1.5085, 1.8423, 2.1705, 0.5965, 0.6915, 0.7580, 0.8108, 0.8555]
    found = BASIS.torque(PUBLISHED_VALUES) - BASIS.hysteresis
    np.testing.assert_allclose(found, stated, atol=5.001e-5, rtol=0)
    assert round(100.0 * float(np.mean(np.abs(found / BASIS.measured - 1.0))), 2) == 2.25


def test_hysteresis_share_of_the_measured_torques():
    share = 100.0 * BASIS.hysteresis / BASIS.measured
    assert round(float(share.min()), 1) == 0.4
    assert round(float(share.max()), 1) == 1.6


def test_sliding_torque_counts_each_ball_once():
    # 61.33 mu N.m per kN of preload
    per_kilonewton = 2.0 * uniform_sums(1000.0, 10.0).sliding
    assert round(per_kilonewton, 2) == 61.33
    arm = GD4008.screw.nominal_radius + 0.5 * GD4008.screw.ball_diameter * math.cos(BETA)
    assert per_kilonewton == pytest.approx(2.0 * 1000.0 * arm / math.sin(BETA), rel=1e-12)


def without_hysteresis(preload, rpm, ratio, net, height=0.0):
    parts = uniform_sums(preload, rpm * RPM).torque(ratio, net, height)
    return parts.viscous, parts.sliding


@pytest.mark.parametrize(
    ("values", "stated", "within"),
    [((9.0, 0.0037, 0.0), 183, 0.5), ((8.76, 0.00372, 0.0), 202, 0.8), ((7.62, 0.00506, 23.7e-9), 900, 10.0)],
)
def test_speed_at_which_viscous_equals_sliding(values, stated, within):
    # tolerance: the digits in which the parameters are stated
    low, high = 20.0, 3000.0
    for _ in range(60):
        rpm = math.sqrt(low * high)
        viscous, sliding = without_hysteresis(1800.0, rpm, *values)
        low, high = (rpm, high) if viscous < sliding else (low, rpm)
    assert rpm == pytest.approx(stated, abs=within)


def test_production_model_is_close_to_uniform_loads():
    # loaded angle and true loads shift the torque by 1 to 3 %, more at high preload
    film = HamrockDowsonFilm(GD4008)
    for preload, least, most in ((1000.0, 0.002, 0.02), (6000.0, 0.01, 0.04)):
        true = double_nut_torque(GD4008, SET, film, preload, 100 * RPM, TEMPERATURE).total
        sums = uniform_sums(preload, 100 * RPM).torque(*PUBLISHED_VALUES)
        assert least < 1.0 - true / (2.0 * sums.total) < most


def test_sign_of_the_speed_does_not_matter():
    film = HamrockDowsonFilm(GD4008)
    forward, backward = (double_nut_torque(GD4008, SET, film, 1500.0, w, 303.0) for w in (40.0, -40.0))
    assert forward == backward


def test_axial_load_adds_to_one_nut_and_relieves_the_other():
    film = HamrockDowsonFilm(GD4008)
    preload, axial = 2000.0, 3000.0
    found = double_nut_torque(GD4008, SET, film, preload, 50.0, 303.0, axial)
    shared = double_nut_loads(GD4008.screw, preload, axial, 86)
    alone = [
        double_nut_torque(GD4008, SET, film, f, 50.0, 303.0).total / 2.0
        for f in (shared.force_a, shared.force_b)
    ]
    assert found.total == pytest.approx(sum(alone), rel=1e-12)
    # the sums over the loads under the axial load differ only by the elongation of the bodies
    exact = sum(
        nut_sums(GD4008, loads, 50.0, 303.0, film).torque(*PUBLISHED_VALUES).total
        for loads in (shared.Q_a, shared.Q_b)
    )
    assert found.total == pytest.approx(exact, rel=2e-3)


def test_nut_beyond_separation_has_no_torque():
    film = HamrockDowsonFilm(GD4008)
    found = double_nut_torque(GD4008, SET, film, 1000.0, 50.0, 303.0, 8000.0)
    alone = double_nut_torque(GD4008, SET, film, 8000.0, 50.0, 303.0)
    assert found.total == pytest.approx(0.5 * alone.total, rel=1e-9)


def test_unloaded_balls_and_no_preload():
    film = HamrockDowsonFilm(GD4008)
    assert nut_sums(GD4008, np.zeros(86), 10.0, 303.0, film) is UNLOADED
    assert UNLOADED.torque(8.0, 0.004, 20e-9) == NO_TORQUE
    assert double_nut_torque(GD4008, SET, film, 0.0, 10.0, 303.0, 500.0) == NO_TORQUE
    loads = np.array([0.0, 20.0, 0.0, 25.0])
    some, loaded = (nut_sums(GD4008, q, 10.0, 303.0, film) for q in (loads, loads[loads > 0]))
    assert some == loaded


def test_effective_film_carries_the_share_of_unequal_balls():
    loads = np.array([5.0, 20.0, 60.0])
    height = 8e-9
    sums = nut_sums(GD4008, loads, 10.0, 303.0, FILM, contact_angle=BETA)
    by_ball = [nut_sums(GD4008, np.array([q]), 10.0, 303.0, FILM, contact_angle=BETA) for q in loads]
    together = sums.torque(1.0, 0.0, height).viscous
    apart = sum(one.torque(1.0, 0.0, height).viscous for one in by_ball)
    # exact to first order in (h_r/h)^2 = 0.12
    assert together == pytest.approx(apart, rel=5e-4)
    assert sums.viscous_nut == pytest.approx(sum(one.viscous_nut for one in by_ball), rel=1e-12)


def test_rolling_frame_scales_like_published_in_load_and_speed():
    variant = changed(GD4008, friction={"kinematics": "rolling_frame"})
    film, published = HamrockDowsonFilm(variant), HamrockDowsonFilm(GD4008)
    ratios = []
    for preload, rpm in ((1000.0, 100.0), (6000.0, 100.0), (1000.0, 2500.0)):
        loads = nut_loads(GD4008.screw, preload, 86)
        a = nut_sums(variant, loads, rpm * RPM, 303.0, film)
        b = nut_sums(GD4008, loads, rpm * RPM, 303.0, published)
        ratios.append((a.viscous_screw + a.viscous_nut) / (b.viscous_screw + b.viscous_nut))
    np.testing.assert_allclose(ratios, ratios[0], rtol=1e-3)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"preload": -1.0}, "preload = -1.0 N"),
        ({"preload": math.nan}, "preload = nan"),
        ({"speed": 0.0}, "speed = 0.0 rad/s"),
        ({"speed": math.inf}, "speed = inf"),
        ({"temperature": 20.0}, "temperature = 20.0 K"),
        ({"axial_load": math.nan}, "axial_load = nan"),
    ],
)
def test_bad_input_is_named(changes, named):
    arguments = {"preload": 1000.0, "speed": 10.0, "temperature": 303.0, "axial_load": 0.0, **changes}
    with pytest.raises(ValueError, match=named):
        double_nut_torque(GD4008, SET, HamrockDowsonFilm(GD4008), **arguments)


@pytest.mark.parametrize("power", [0.3, 0.67, 1.0, 2.0])
@pytest.mark.parametrize("target", [1e-3, 0.4, 40.0])
def test_preload_is_found_in_few_steps(power, target):
    calls = []

    def torque(preload):
        calls.append(preload)
        return 0.4 * (preload / 1000.0) ** power

    preload = 1000.0 * (target / 0.4) ** (1.0 / power)
    assert preload_from_torque(torque, target, 0.0, 2.0 * preload + 1e5) == pytest.approx(preload, rel=1e-10)
    assert len(calls) <= (60 if power > 1.0 else 20)


def test_preload_and_torque_are_inverse():
    film = HamrockDowsonFilm(GD4008)
    torque = double_nut_torque(GD4008, SET, film, 2345.0, 10.472, 303.0).total
    found = preload_from_torque(
        lambda preload: double_nut_torque(GD4008, SET, film, preload, 10.472, 303.0).total,
        torque,
        0.0,
        12000.0,
    )
    assert found == pytest.approx(2345.0, rel=1e-9)


def test_error_for_an_unreachable_torque_names_the_range():
    with pytest.raises(ValueError, match=r"torque = 5 N.m; allowed .* 0 to 2 N.m"):
        preload_from_torque(lambda preload: 2e-3 * preload, 5.0, 0.0, 1000.0)
    for bad in (-1.0, math.nan):
        with pytest.raises(ValueError, match="needs finite, >= 0"):
            preload_from_torque(lambda preload: preload, bad, 0.0, 1.0)
    with pytest.raises(ValueError, match="no preload found"):
        preload_from_torque(lambda preload: math.nan if 0 < preload < 1 else preload, 0.4, 0.0, 1.0)
    assert preload_from_torque(lambda preload: preload, 0.0, 0.0, 1.0) == 0.0
