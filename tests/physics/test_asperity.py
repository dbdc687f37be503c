"""Height integrals against closed forms, asperity pressure and area against their derivation, bad input."""

import math

import numpy as np
import pytest
from scipy.special import erfc, gamma

from ballscrew_tehl.physics.asperity import (
    Roughness,
    film_asperity_share,
    height_integral,
    pressure_scale,
    typical_roughness,
)

E_PRIME = 226e9
ROUGH = Roughness(sigma=2e-7, asperity_density=5e10, asperity_radius=1e-5)
SMOOTH = Roughness(sigma=0.0, asperity_density=5e10, asperity_radius=1e-5)


def relative(value, reference):
    return np.max(np.abs(np.asarray(value) / reference - 1.0))


def test_height_integrals_at_zero_and_by_the_error_function():
    for order in (0.0, 0.5, 1.0, 2.5, 3.0):
        closed = 2 ** ((order - 1) / 2) * gamma((order + 1) / 2) / math.sqrt(2 * math.pi)
        assert relative(height_integral(order, 0.0), closed) <= 1e-13
    u = np.array([-9.5, -3.0, -0.5, 0.0, 0.3, 1.0, 2.5, 6.0])
    bell, tail = np.exp(-0.5 * u**2) / math.sqrt(2 * math.pi), 0.5 * erfc(u / math.sqrt(2))
    for order, closed in ((0, tail), (1, bell - u * tail), (2, (1 + u**2) * tail - u * bell)):
        # the closed forms cancel at large u
        assert relative(height_integral(order, u), closed) <= 1e-9


def test_pressure_has_its_scalings():
    """E* sqrt(2) pi 16/15 (sigma beta eta)^2 sqrt(sigma/beta) F_5/2, E* = E'/2: 26.1 MPa at h = 0."""
    dense = Roughness(ROUGH.sigma, 3 * ROUGH.asperity_density, ROUGH.asperity_radius)
    assert relative(pressure_scale(dense, E_PRIME), 9 * pressure_scale(ROUGH, E_PRIME)) <= 1e-13
    assert relative(pressure_scale(ROUGH, 2 * E_PRIME), 2 * pressure_scale(ROUGH, E_PRIME)) <= 1e-14
    touching = pressure_scale(typical_roughness(2e-7), E_PRIME) * float(height_integral(2.5, 0.0))
    assert touching == pytest.approx(2.61e7, rel=2e-3)


def test_film_share_is_the_pressure_at_the_gap_that_holds_the_film():
    """The mean gap by quadrature of (h - s) over the heights s below h, at several distances of the mean planes."""
    rough, mean = typical_roughness(2e-7), 6e8
    for u in (-3.0, -1.0, 0.0, 1.0, 2.5):
        s = np.linspace(-12.0, u, 200001)
        weight = np.exp(-0.5 * s * s) / math.sqrt(2.0 * math.pi)
        gap = rough.sigma * np.trapezoid((u - s) * weight, s)
        share = float(film_asperity_share(rough, E_PRIME, gap, mean))
        expected = min(pressure_scale(rough, E_PRIME) * float(height_integral(2.5, u)) / mean, 1.0)
        assert abs(share / expected - 1.0) <= 1e-4


def test_film_share_has_its_limits():
    rough = typical_roughness(2e-7)
    film = 2e-7 * np.geomspace(1e-9, 10.0, 200)
    share = film_asperity_share(rough, E_PRIME, film, 6e8)
    assert np.all(np.diff(share) <= 0.0)
    assert share[0] == 1.0
    assert np.max(share[film >= 3.0 * 2e-7]) < 0.01
    assert np.all(film_asperity_share(SMOOTH, E_PRIME, film, 6e8) == 0.0)
