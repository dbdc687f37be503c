"""Torque of the nut and of the double nut: hand-checked numbers, sums, limits, recovered preload."""

import numpy as np
import pytest
from closed_film import HamrockDowsonFilm
from reference_screw import GD4008
from section7 import BASIS

from ballscrew_tehl.friction.film_shear import double_nut_torque, nut_sums
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.physics.load import double_nut_loads

PUBLISHED_VALUES = (0.297 / 0.033, 0.0037, 0.0)
SET = FrictionSet("three_parameter", *PUBLISHED_VALUES)


def test_eleven_torques_against_hand_calculation():
    # eta_i = 0.297 Pa s, mu = 0.0037, without hysteresis; four digits stated
    stated = [0.4442, 0.8152, 1.1673, 1.5085, 1.8423, 2.1705, 0.5965, 0.6915, 0.7580, 0.8108, 0.8555]
    found = BASIS.torque(PUBLISHED_VALUES) - BASIS.hysteresis
    np.testing.assert_allclose(found, stated, atol=5.001e-5, rtol=0)
    assert round(100.0 * float(np.mean(np.abs(found / BASIS.measured - 1.0))), 2) == 2.25


def test_axial_load_adds_to_one_nut_and_relieves_the_other():
    film = HamrockDowsonFilm(GD4008)
    preload, axial = 2000.0, 3000.0
    found = double_nut_torque(GD4008, SET, film, preload, 50.0, 303.0, axial)
    shared = double_nut_loads(GD4008.screw, preload, axial, 86)
    forces = shared.force_a, shared.force_b
    alone = [double_nut_torque(GD4008, SET, film, force, 50.0, 303.0).total / 2.0 for force in forces]
    assert found.total == pytest.approx(sum(alone), rel=1e-12)
    # the sums over the loads under the axial load differ only by the elongation of the bodies
    nuts = [nut_sums(GD4008, loads, 50.0, 303.0, film) for loads in (shared.Q_a, shared.Q_b)]
    exact = sum(nut.torque(*PUBLISHED_VALUES) for nut in nuts)
    assert found.total == pytest.approx(exact, rel=2e-3)
