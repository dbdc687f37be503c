"""Axial stiffness of the nut: closed form, laws of preload, the chain of balls with stiff bodies."""

import math

import numpy as np
import pytest

from ballscrew_tehl.parameters.file import FOUR_POINT, load_screw
from ballscrew_tehl.physics.hertz import E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.load import ball_oversize, double_nut_loads
from ballscrew_tehl.physics.stiffness import (
    axial_deflection,
    forces_of_displacement,
    nut_stiffness_constant,
    preload_approach,
)

SCREW = load_screw().screw
K = nut_stiffness_constant(SCREW)
STIFF = {"screw_section_area": 1e3, "nut_section_area": 1e3, "spacer_section_area": 1e3}  # [m^2] rigid bodies
BETA = SCREW.contact_angle


def test_force_of_one_nut_is_that_of_its_balls_by_hertz():
    """Each ball by the closed form of one contact: approach along the contact line of both raceways together."""
    force = 1500.0
    sb = math.sin(BETA) * math.cos(SCREW.lead_angle)
    ball = force / (SCREW.loaded_ball_count * sb)
    radii = [reduced_radii(SCREW, BETA, name) for name in ("screw", "nut")]
    approach = sum(float(ellipse(ball, *each, E_prime(SCREW)).delta) for each in radii)
    assert preload_approach(K, force) == pytest.approx(approach / sb, rel=1e-13)


def test_oversize_balls_have_the_same_law():
    four = SCREW.model_copy(update={"preload_kind": FOUR_POINT, **STIFF})
    count = four.loaded_ball_count
    sb = math.sin(BETA) * math.cos(four.lead_angle)
    assert preload_approach(K, 2000.0) == pytest.approx(ball_oversize(four, 2000.0, count) / sb, rel=1e-13)
    # under such loads the contact angle stays
    chain = double_nut_loads(four, 2e-3, 3e-3, count)
    both = forces_of_displacement(K, 2e-3, axial_deflection(K, 2e-3, 3e-3))
    np.testing.assert_allclose(both, (chain.force_a, chain.force_b), rtol=1e-5)
