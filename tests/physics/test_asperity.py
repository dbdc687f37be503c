"""Height integrals against closed forms, asperity pressure and area against their derivation, bad input."""

import math

import numpy as np
import pytest
from scipy.special import erfc, gamma, pbdv

from ballscrew_tehl.physics.asperity import (
    Roughness,
    asperity_pressure,
    contact_area_ratio,
    film_asperity_share,
    height_integral,
    pressure_scale,
    scaled_height_integral,
    typical_roughness,
)

E_PRIME = 226e9
ROUGH = Roughness(sigma=2e-7, asperity_density=5e10, asperity_radius=1e-5)
SMOOTH = Roughness(sigma=0.0, asperity_density=5e10, asperity_radius=1e-5)
U = np.array([-12.0, -9.5, -3.0, -0.5, 0.0, 0.3, 1.0, 2.5, 6.0, 15.0, 30.0])
ORDERS = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
#: F_n at u = -12, -2, 0, 1, 3, 8, 30 by mpmath with 40 digits, from the parabolic cylinder function
REFERENCE = {
    1.5: (41.67761497103255, 3.111292885687599, 0.4300199936622598, 0.07566817739097507, 0.0002639675542694673,
          3.478399792218691e-17, 3.954799087029981e-200),
    2.0: (145.0, 4.99423127328548, 0.5, 0.07533978334377075, 0.0002034350804869237,
          1.80750644714585e-17, 1.084372487398349e-200),
    2.5: (505.3229916078629, 8.257546668584269, 0.6166342189968439, 0.08056233557081147, 0.0001708729962144244,
          1.033917602809633e-17, 3.282961968135747e-201),
}  # fmt: skip


def relative(value, reference):
    return np.max(np.abs(np.asarray(value) / reference - 1.0))


@pytest.mark.parametrize("order", ORDERS)
def test_value_at_zero(order):
    # int_0^inf s^n exp(-s^2/2) ds = 2^((n-1)/2) Gamma((n+1)/2)
    closed = 2 ** ((order - 1) / 2) * gamma((order + 1) / 2) / math.sqrt(2 * math.pi)
    assert relative(height_integral(order, 0.0), closed) <= 1e-13
    if order == 2.5:
        assert (
            relative(height_integral(order, 0.0), 2**0.75 * math.gamma(1.75) / math.sqrt(2 * math.pi))
            <= 1e-13
        )


@pytest.mark.parametrize("order", REFERENCE)
def test_reference_values(order):
    assert (
        relative(height_integral(order, [-12.0, -2.0, 0.0, 1.0, 3.0, 8.0, 30.0]), REFERENCE[order]) <= 1e-13
    )


@pytest.mark.parametrize("order", ORDERS)
def test_parabolic_cylinder_function(order):
    closed = gamma(order + 1) / math.sqrt(2 * math.pi) * np.exp(-0.25 * U**2) * pbdv(-order - 1, U)[0]
    # the accuracy of pbdv, about 1e-9 for orders that are not integer
    assert relative(height_integral(order, U), closed) <= 1e-8


def test_integer_orders_by_the_error_function():
    bell, tail = np.exp(-0.5 * U**2) / math.sqrt(2 * math.pi), 0.5 * erfc(U / math.sqrt(2))
    near = np.abs(U) <= 6.0  # beyond, the closed forms cancel
    assert relative(height_integral(0, U), tail) <= 1e-12
    assert relative(height_integral(1, U)[near], (bell - U * tail)[near]) <= 1e-11
    assert relative(height_integral(2, U)[near], ((1 + U**2) * tail - U * bell)[near]) <= 1e-9


@pytest.mark.parametrize("order", [1.5, 2.5])
def test_asymptotes(order):
    # next terms: (n+1)(n+2)/(2 u^2) of the tail, n(n-1)/(2 u^2) of the power
    u = 30.0
    tail = gamma(order + 1) * u ** (-order - 1) / math.sqrt(2 * math.pi)
    assert abs(scaled_height_integral(order, u) / tail - 1 + (order + 1) * (order + 2) / (2 * u**2)) <= 1e-4
    assert abs(height_integral(order, -u) / u**order - 1 - order * (order - 1) / (2 * u**2)) <= 1e-5
    assert relative(height_integral(order, -1e5), 1e5**order) <= 1e-9
    assert height_integral(order, 40.0) == 0.0


@pytest.mark.parametrize("order", [1.0, 1.5, 2.0, 2.5, 3.0])
def test_slope_is_the_integral_of_lower_order(order):
    step = 1e-4
    chord = (height_integral(order, U + step) - height_integral(order, U - step)) / (2 * step)
    # central difference: u^2 step^2/6 relative at most
    assert relative(-order * height_integral(order - 1.0, U), chord) <= 2e-6


def test_all_integrals_fall_and_stay_positive():
    u = np.linspace(-20.0, 37.0, 3001)
    for order in ORDERS:
        values = height_integral(order, u)
        assert np.min(values) > 0.0
        assert np.max(np.diff(values)) <= 1e-14 * values[0]  # rounding; order 0 tends to 1


def derived(h, load, outer=400):
    """Sum over the pairs of asperities of two surfaces, axes r apart: eta^2 int phi(s) int load(w) 2 pi r dr ds.

    w = s - h - r^2/(4 beta) is the overlap, s the sum of both heights.
    """
    x, weights = np.polynomial.legendre.leggauss(outer)
    sigma, beta = ROUGH.sigma, ROUGH.asperity_radius
    top = h + 12.0 * sigma
    s = 0.5 * (top - h) * (x + 1) + h
    height = (s - h)[:, None]
    r = np.sqrt(4 * beta * height) * 0.5 * (x + 1)
    overlap = np.maximum(height - r**2 / (4 * beta), 0.0)
    inner = np.sum(load(overlap) * 2 * np.pi * r * weights * np.sqrt(4 * beta * height) * 0.5, axis=1)
    density = np.exp(-0.5 * (s / sigma) ** 2) / (sigma * math.sqrt(2 * math.pi))
    return ROUGH.asperity_density**2 * np.sum(inner * density * weights) * 0.5 * (top - h)


@pytest.mark.parametrize("h", [0.0, 1e-7, 3e-7, 6e-7])
def test_pressure_and_area_by_their_derivation(h):
    """Hertz contact of two spheres of radius beta: load (4/3) E* sqrt(beta/2) w^(3/2), area pi (beta/2) w."""
    radius = 0.5 * ROUGH.asperity_radius
    pressure = derived(h, lambda w: 4 / 3 * 0.5 * E_PRIME * math.sqrt(radius) * w**1.5)
    area = derived(h, lambda w: math.pi * radius * w)
    # quadrature of the tests: 1e-6
    assert relative(asperity_pressure(ROUGH, E_PRIME, h)[0], pressure) <= 1e-5
    assert relative(contact_area_ratio(ROUGH, h), area) <= 1e-5


def test_pressure_slope_and_scalings():
    h, step = np.linspace(-4e-7, 1.2e-6, 41), 1e-11
    p_a, slope = asperity_pressure(ROUGH, E_PRIME, h)
    chord = (
        asperity_pressure(ROUGH, E_PRIME, h + step)[0] - asperity_pressure(ROUGH, E_PRIME, h - step)[0]
    ) / (2 * step)
    assert relative(slope, chord) <= 1e-5
    assert np.max(np.diff(p_a)) < 0.0
    assert relative(asperity_pressure(ROUGH, 2 * E_PRIME, h)[0], 2 * p_a) <= 1e-14
    dense = Roughness(ROUGH.sigma, 3 * ROUGH.asperity_density, ROUGH.asperity_radius)
    assert relative(asperity_pressure(dense, E_PRIME, h)[0], 9 * p_a) <= 1e-13
    assert relative(contact_area_ratio(dense, h), 9 * contact_area_ratio(ROUGH, h)) <= 1e-13
    alone = [float(asperity_pressure(ROUGH, E_PRIME, one)[0]) for one in h]
    assert relative(alone, p_a) <= 1e-14


def test_smooth_contact():
    h = np.array([-1e-8, 0.0, 1e-7])
    assert pressure_scale(SMOOTH, E_PRIME) == 0.0
    assert np.max(np.abs(asperity_pressure(SMOOTH, E_PRIME, h))) == 0.0
    assert np.max(np.abs(contact_area_ratio(SMOOTH, h))) == 0.0
    # sigma -> 0 at fixed asperities: no pressure at a finite film
    assert asperity_pressure(typical_roughness(2e-9), E_PRIME, 1e-7)[0] == 0.0


def test_typical_roughness_and_the_pressure_it_can_carry():
    rough = typical_roughness(3e-7, product=0.04, slenderness=2e-3)
    assert relative([rough.product, rough.sigma / rough.asperity_radius], [0.04, 2e-3]) <= 1e-14
    # 26 MPa between steels, as the docstring says
    assert abs(asperity_pressure(typical_roughness(2e-7), E_PRIME, 0.0)[0] - 26.1e6) <= 0.1e6


@pytest.mark.parametrize("bad", [-1e-9, math.nan, math.inf])
def test_bad_roughness(bad):
    with pytest.raises(ValueError, match=r"sigma = .* m; needs finite, >= 0: check the roughness"):
        Roughness(bad, 5e10, 1e-5)
    with pytest.raises(ValueError, match=r"asperity_density = .* 1/m2; needs finite, > 0"):
        Roughness(2e-7, bad, 1e-5)
    with pytest.raises(ValueError, match=r"asperity_radius = .* m; needs finite, > 0"):
        Roughness(2e-7, 5e10, bad)
    with pytest.raises(ValueError, match=r"slenderness = "):
        typical_roughness(2e-7, slenderness=bad)
    with pytest.raises(ValueError, match=r"E_prime = .* Pa; needs finite, > 0"):
        asperity_pressure(ROUGH, bad, 1e-7)


def test_bad_arguments():
    with pytest.raises(ValueError, match=r"asperity_density = 0.0"):
        Roughness(2e-7, 0.0, 1e-5)
    with pytest.raises(ValueError, match=r"sigma = 0.0"):
        typical_roughness(0.0)
    for order in (-0.5, 3.5, math.nan):
        with pytest.raises(ValueError, match=r"order = .*needs finite, 0 to 3"):
            height_integral(order, 0.0)
    for bad in (math.nan, math.inf):
        with pytest.raises(ValueError, match="u = "):
            height_integral(2.5, np.array([0.0, bad]))
        for function in (
            lambda h: asperity_pressure(ROUGH, E_PRIME, h),
            lambda h: contact_area_ratio(SMOOTH, h),
        ):
            with pytest.raises(ValueError, match=r"h = .* m; needs finite, any sign: check the film"):
                function(bad)


def test_film_share_is_the_pressure_at_the_gap_that_holds_the_film():
    """The mean gap by quadrature of (h - s) over the heights s below h, at several distances of the mean planes."""
    rough, mean = typical_roughness(2e-7), 6e8
    for u in (-3.0, -1.0, 0.0, 1.0, 2.5):
        s = np.linspace(-12.0, u, 200001)
        weight = np.exp(-0.5 * s * s) / math.sqrt(2.0 * math.pi)
        gap = rough.sigma * np.trapezoid((u - s) * weight, s)
        share = float(film_asperity_share(rough, E_PRIME, gap, mean))
        expected = min(float(asperity_pressure(rough, E_PRIME, u * rough.sigma)[0]) / mean, 1.0)
        assert abs(share / expected - 1.0) <= 1e-4


def test_film_share_has_its_limits():
    rough = typical_roughness(2e-7)
    film = 2e-7 * np.geomspace(1e-9, 10.0, 200)
    share = film_asperity_share(rough, E_PRIME, film, 6e8)
    assert np.all(np.diff(share) <= 0.0)
    assert share[0] == 1.0
    assert np.max(share[film >= 3.0 * 2e-7]) < 0.01
    assert np.all(film_asperity_share(SMOOTH, E_PRIME, film, 6e8) == 0.0)


@pytest.mark.parametrize("bad", [{"film": 0.0}, {"film": math.nan}, {"mean_pressure": -1.0}])
def test_film_share_refuses_bad_input(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        film_asperity_share(ROUGH, E_PRIME, **({"film": 1e-7, "mean_pressure": 1e9} | bad))
