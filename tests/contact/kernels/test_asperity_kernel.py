"""The compiled asperity pressure against its plain twin, smoothness at the joint of its two series, limits."""

import math

import numpy as np
import pytest

from ballscrew_tehl.contact.film import asperity as kernels
from ballscrew_tehl.physics.asperity import (
    Roughness,
    asperity_pressure,
    height_integral,
    pressure_scale,
    typical_roughness,
)

E_PRIME = 226e9
RANGES = {"deep": (-50.0, -6.0), "overlap": (-6.0, 0.0), "contact": (0.0, 6.0), "tail": (6.0, 37.0)}


@pytest.mark.parametrize("name", RANGES)
def test_series_against_the_exact_integral(name):
    u = np.linspace(*RANGES[name], 1501)
    series = np.array([kernels.height_integral_5_2(x) for x in u])
    exact, slope = height_integral(2.5, u), -2.5 * height_integral(1.5, u)
    assert np.max(np.abs(series[:, 0] / exact - 1.0)) <= kernels.VALUE_ERROR
    assert np.max(np.abs(series[:, 1] / slope - 1.0)) <= kernels.SLOPE_ERROR
    assert np.min(series[:, 0]) > 0.0
    assert np.max(series[:, 1]) < 0.0
    assert np.max(np.diff(series[:, 0])) < 0.0


def test_slope_is_that_of_the_series():
    u, step = np.linspace(-8.0, 8.0, 401), 1e-5
    up, down = ([kernels.height_integral_5_2(x + s)[0] for x in u] for s in (step, -step))
    slope = np.array([kernels.height_integral_5_2(x)[1] for x in u])
    # central difference: rounding 1e-11, curvature u^2 step^2; the joint at u = 0 adds VALUE_ERROR/step there
    away = np.abs(u) > step
    chord = (np.array(up) - np.array(down)) / (2 * step)
    assert np.max(np.abs(chord / slope - 1.0)[away]) <= 1e-7


def test_series_are_joined_at_zero():
    below, above = np.array(kernels.height_integral_5_2(-1e-300)), np.array(kernels.height_integral_5_2(0.0))
    assert np.max(np.abs(below / above - 1.0)) <= 2 * kernels.SLOPE_ERROR
    assert abs(above[0] - 2**0.75 * math.gamma(1.75) / math.sqrt(2 * math.pi)) <= kernels.VALUE_ERROR


@pytest.mark.parametrize("sigma", [5e-8, 2e-7, 1e-6])
def test_pressure_of_the_kernel_equals_the_twin(sigma):
    rough = Roughness(sigma, 5e10, 1e-5)
    h = np.linspace(-2.0, 8.0, 201) * sigma
    values = np.array([kernels.asperity_pressure(pressure_scale(rough, E_PRIME), sigma, x) for x in h])
    p_a, slope = asperity_pressure(rough, E_PRIME, h)
    assert np.max(np.abs(values[:, 0] / p_a - 1.0)) <= kernels.VALUE_ERROR
    assert np.max(np.abs(values[:, 1] / slope - 1.0)) <= kernels.SLOPE_ERROR


def test_no_pressure_of_a_smooth_contact_or_far_apart():
    scale = pressure_scale(typical_roughness(2e-7), E_PRIME)
    assert kernels.asperity_pressure(scale, 0.0, 1e-9) == (0.0, 0.0)
    assert kernels.asperity_pressure(0.0, 2e-7, 1e-9) == (0.0, 0.0)
    for h in (39 * 2e-7, 1e-3, 1.0):
        assert kernels.asperity_pressure(scale, 2e-7, h) == (0.0, 0.0)


def test_a_film_that_is_not_a_number_stays_visible():
    assert all(math.isnan(value) for value in kernels.asperity_pressure(1e7, 2e-7, math.nan))
