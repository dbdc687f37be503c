"""Wall temperatures: printed numbers of a uniform band, line source in closed form, fast and standing limits."""

import numpy as np
import pytest
from contact_cases import CHI, OIL, STEEL, conditions, options
from scipy.integrate import quad
from scipy.special import k0e

from ballscrew_tehl.contact.coupled import wall_operators
from ballscrew_tehl.contact.half_space.grid import Grid
from ballscrew_tehl.contact.half_space.walls import uniform_strip_rise, wall_operator
from ballscrew_tehl.contact.problem import ContactProblem

K = STEEL.thermal_conductivity
HALF_WIDTH, FLUX = 65.4e-6, 1e8
#: printed ratios of fast-source to exact peak over Peclet number u b/chi (model notes, worked checks, section 6)
PRINTED_RATIO = {20.0: 1.02, 10.0: 1.04, 5.0: 1.07, 2.0: 1.14, 0.5: 1.35, 0.1: 1.92}
N_X = 65


def band(peclet, n_x=N_X, n_y=9, kappa=1.0 / 400.0):
    """Temperature rise at the middle of a long uniform band -1..1 [b] that moves with u = peclet chi/b."""
    x = -1.0 + 2.0 * (np.arange(n_x) + 0.5) / n_x
    grid = Grid(np.concatenate([[x[0] - 2.0 / n_x], x, [x[-1] + 2.0 / n_x]]), np.linspace(0.0, 1.0, n_y))
    flux = np.zeros((n_y, n_x + 2))
    flux[:-1, 1:-1] = FLUX
    operator = wall_operator(grid, kappa, HALF_WIDTH, peclet * CHI / HALF_WIDTH, K, CHI)
    return grid.x, operator(flux)[0]


def line_source(peclet, x):
    """The same for an endless band: q b/(pi k) integral of exp(beta s) K0(|beta s|), beta = Pe/2 (Jaeger 1942)."""
    beta = 0.5 * peclet

    def source(s):
        return np.exp(beta * s - abs(beta * s)) * k0e(abs(beta * s))

    rise = sum(quad(source, *ends, limit=200)[0] for ends in ((x - 1.0, 0.0), (0.0, x + 1.0)))
    return FLUX * HALF_WIDTH / (np.pi * K) * rise


def test_diffusivity_of_the_steel():
    assert abs(CHI - 1.2989e-5) <= 5e-10  # printed digits


def test_walls_of_a_contact_are_those_of_a_half_space_of_the_printed_steel():
    """Uniform flux over the Hertz ellipse of a fast contact, in the middle at its trailing edge.

    The fast source q sqrt(4 u_b t/(pi k rho c u)) of the strip along the middle line; 46 W/(m K), 7870 kg/m3,
    450 J/(kg K) are the printed numbers of the steel.
    """
    at = conditions(u_e=60.0, srr=0.2)
    problem = ContactProblem(at, OIL, STEEL, options(n_x=257, n_y=33))
    grid, b = problem.geometry.grid, problem.scales.hertz.b
    inside = (grid.x**2 + grid.y[:, None] ** 2 <= 1.0).astype(float)
    for wall, speed in zip(wall_operators(problem), (at.u_1, at.u_2), strict=True):
        found = np.interp(0.9, grid.x, wall(FLUX * inside)[0])
        strip = 2.0 * FLUX * np.sqrt(1.9 * b / (np.pi * 46.0 * 7870.0 * 450.0 * speed))
        assert found == pytest.approx(strip, rel=0.01)


def test_uniform_strip_reaches_the_printed_rise():
    assert uniform_strip_rise(np.array(0.0), FLUX, 1.0, 65.4e-6, K, CHI) == pytest.approx(71.49, abs=0.005)


def test_uniform_strip_is_cold_ahead_of_its_edge():
    np.testing.assert_array_equal(
        uniform_strip_rise(np.array([-3.0, -1.1]), FLUX, 1.0, 1.0, K, CHI), [0.0, 0.0]
    )


@pytest.mark.parametrize(("peclet", "printed"), PRINTED_RATIO.items())
def test_fast_source_overpredicts_by_the_printed_ratio(peclet, printed):
    u = peclet * CHI / HALF_WIDTH
    fast = uniform_strip_rise(np.array(HALF_WIDTH), FLUX, u, HALF_WIDTH, K, CHI)
    # half of the last printed digit, and 1e-3 of the peak between nodes
    assert fast / band(peclet)[1].max() == pytest.approx(printed, abs=0.005 + 1e-3 * printed)


@pytest.mark.parametrize("peclet", PRINTED_RATIO)
def test_long_band_is_the_line_source(peclet):
    x, rise = band(peclet)
    exact = np.array([line_source(peclet, v) for v in x[1:-1:8]])
    # of the peak: quadrature of the cells 1e-3, ends of the band at 400 half-widths below that for Pe >= 0.1
    assert np.abs(rise[1:-1:8] - exact).max() <= 3e-3 * exact.max()


def test_fast_band_approaches_the_printed_integral():
    """Jaeger's parabola behind the leading edge, at a speed where conduction ahead no longer counts."""
    peclet = 2000.0
    x, rise = band(peclet, n_x=129)
    fast = uniform_strip_rise(x * HALF_WIDTH, FLUX, peclet * CHI / HALF_WIDTH, HALF_WIDTH, K, CHI)
    inside = (x > -0.5) & (x < 0.9)
    np.testing.assert_allclose(
        rise[inside], fast[inside], rtol=5e-3
    )  # ratio is 1 + O(1/Pe), and cells of 1/64


def test_band_that_moves_back_is_the_mirror_image():
    np.testing.assert_allclose(band(-5.0, n_x=17)[1], band(5.0, n_x=17)[1][::-1], rtol=1e-12)


def test_heat_is_hottest_under_a_standing_source():
    rises = [band(peclet, n_x=17, kappa=0.1)[1].max() for peclet in (0.0, 0.1, 1.0, 10.0)]
    assert np.all(np.diff(rises) < 0.0)


def test_standing_square_is_the_steady_closed_form():
    """Middle of a uniform square 2b: T = 4 q b asinh(1)/(pi k) (Carslaw & Jaeger 1959, section 10.5)."""
    n = 33
    x = -1.0 + 2.0 * (np.arange(n) + 0.5) / n
    # the outer line is half a cell outside the square, so that cells tile it
    y = np.arange(n // 2 + 2) * 2.0 / n
    grid = Grid(np.concatenate([[x[0] - 2.0 / n], x, [x[-1] + 2.0 / n]]), y)
    flux = np.zeros((y.size, n + 2))
    flux[:-1, 1:-1] = FLUX
    rise = wall_operator(grid, 1.0, HALF_WIDTH, 0.0, K, CHI)(flux)[0, n // 2 + 1]
    exact = 8.0 * FLUX * HALF_WIDTH * np.arcsinh(1.0) / (2.0 * np.pi * K)
    assert rise == pytest.approx(exact, rel=1e-3)
