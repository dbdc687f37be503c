"""The law of Jungnickel against a hand calculation; the tables of the paper test those of Zhou and NSK."""

import math

import pytest
from law_contacts import VG100

from ballscrew_tehl.applications.published_formulas import jungnickel_torque
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.hertz import E_prime


def test_jungnickel_against_hand_calculation():
    """Oil ISO VG 100 of 0.157 Pa s at 303 K and 1.0e-4 m2/s at 40 C, E' = 205/0.91 GPa."""
    E, r_b, r_m, z = 205e9 / 0.91, 2.3815e-3, 0.02, 72
    assert E_prime(VG100.screw) == pytest.approx(E, rel=1e-12)
    lead = math.radians(3.64)
    F_k = 1000.0 / (z * math.sin(math.radians(45.0)) * math.cos(lead))
    G = 1.29e-7 * 1e-4**0.204 * E
    W, U = F_k / (E * r_b**2), 0.157 * 100.0 * math.pi / 30.0 * r_m / (2.0 * math.cos(lead) * E * r_b)
    expected = 2.0 * z * 9.16 * G**-0.2 * W**-0.516 * U**0.512 * F_k * r_m / math.cos(lead)
    # three digits of the viscosity
    assert jungnickel_torque(VG100, 1000.0, 100.0 * RPM, 303.0) == pytest.approx(expected, rel=3e-3)
