"""The bodies: dry contact and deflection against Hertz, moving heat sources against their closed forms."""

import numpy as np
import pytest
from contact_cases import CIRCLE, LONG, OIL, STEEL, conditions, options
from scipy.integrate import quad
from scipy.special import k0e

from ballscrew_tehl.contact.coupled import wall_operators
from ballscrew_tehl.contact.film.geometry import TARGET_LOAD, ContactGeometry
from ballscrew_tehl.contact.grid import Grid, GridChoice
from ballscrew_tehl.contact.half_space import dry_contact, wall_operator
from ballscrew_tehl.contact.problem import ContactProblem
from ballscrew_tehl.parameters.screw import NITRIDE

K = STEEL.thermal_conductivity
CHI = K / (STEEL.density * STEEL.specific_heat)
HALF_WIDTH, FLUX = 65.4e-6, 1e8


def band(peclet, n_x=65, n_y=9, kappa=1.0 / 400.0):
    """Temperature rise at the middle of a long uniform band -1..1 [b] that moves with u = peclet chi/b."""
    x = -1.0 + 2.0 * (np.arange(n_x) + 0.5) / n_x
    grid = Grid(np.concatenate([[x[0] - 2.0 / n_x], x, [x[-1] + 2.0 / n_x]]), np.linspace(0.0, 1.0, n_y))
    flux = np.zeros((n_y, n_x + 2))
    flux[:-1, 1:-1] = FLUX
    return grid.x, wall_operator(grid, kappa, HALF_WIDTH, peclet * CHI / HALF_WIDTH, K, CHI)(flux)[0]


def line_source(peclet, x):
    """The same of an endless band: q b/(pi k) integral of exp(beta s) K0(|beta s|), beta = Pe/2 (Jaeger 1942)."""
    beta = 0.5 * peclet

    def source(s):
        return np.exp(beta * s - abs(beta * s)) * k0e(abs(beta * s))

    rise = sum(quad(source, *ends, limit=200)[0] for ends in ((x - 1.0, 0.0), (0.0, x + 1.0)))
    return FLUX * HALF_WIDTH / (np.pi * K) * rise


def test_moving_band_standing_square_and_reversed_source():
    for peclet in (20.0, 2.0, 0.1):
        x, rise = band(peclet)
        exact = np.array([line_source(peclet, v) for v in x[1:-1:8]])
        # of the peak: quadrature of the cells 1e-3, ends of the band at 400 half-widths below that for Pe >= 0.1
        assert np.abs(rise[1:-1:8] - exact).max() <= 3e-3 * exact.max()
    np.testing.assert_allclose(band(-5.0, n_x=17)[1], band(5.0, n_x=17)[1][::-1], rtol=1e-12)
    # middle of a uniform square 2b: T = 4 q b asinh(1)/(pi k) (Carslaw & Jaeger 1959, section 10.5)
    n = 33
    x = -1.0 + 2.0 * (np.arange(n) + 0.5) / n
    # the outer line is half a cell outside the square, so that cells tile it
    grid = Grid(np.concatenate([[x[0] - 2.0 / n], x, [x[-1] + 2.0 / n]]), np.arange(n // 2 + 2) * 2.0 / n)
    flux = np.zeros((grid.y.size, n + 2))
    flux[:-1, 1:-1] = FLUX
    rise = wall_operator(grid, 1.0, HALF_WIDTH, 0.0, K, CHI)(flux)[0, n // 2 + 1]
    assert rise == pytest.approx(4.0 * FLUX * HALF_WIDTH * np.arcsinh(1.0) / (np.pi * K), rel=1e-3)


def test_walls_of_a_contact_have_the_speed_of_their_own_body():
    """Uniform flux over the Hertz ellipse of a fast contact: the strip along the middle line near its trailing edge.

    46 W/(m K), 7870 kg/m3, 450 J/(kg K) are the printed numbers of the steel, 28, 3240, 700 those of a ceramic ball.
    """
    at = conditions(u_e=60.0, srr=0.2)
    problem = ContactProblem(at, OIL, (STEEL, NITRIDE), options(n_x=257, n_y=33))
    grid, b = problem.geometry.grid, problem.scales.hertz.b
    inside = (grid.x**2 + grid.y[:, None] ** 2 <= 1.0).astype(float)
    walls = wall_operators(problem)
    for wall, u, k_rho_c in (
        (walls[0], at.u_1, 46.0 * 7870.0 * 450.0),
        (walls[1], at.u_2, 28.0 * 3240.0 * 700.0),
    ):
        found = np.interp(0.9, grid.x, wall(FLUX * inside)[0])
        strip = 2.0 * FLUX * np.sqrt(1.9 * b / (np.pi * k_rho_c * u))
        assert found == pytest.approx(strip, rel=0.01)
        # the increments of the iteration, in single precision
        np.testing.assert_allclose(wall.rough(inside), wall(inside), atol=1e-5 * wall(inside).max())


@pytest.mark.parametrize("ratio", [CIRCLE, LONG])
def test_dry_contact_is_that_of_hertz(ratio):
    geometry = ContactGeometry(GridChoice(-2.0, 1.5, 1.3, 65, 17, 0.2), ratio)
    p, approach = geometry.dry_contact
    gap = geometry.gap(p, approach)
    assert np.sum(geometry.weights * p) == pytest.approx(TARGET_LOAD, rel=1e-12)
    assert p.min() == 0.0
    # tolerance of the conjugate gradients, 1e-10 of p_max, through an ill-conditioned deflection
    assert np.abs(gap[p > 0.0]).max() <= 1e-6
    assert gap[p == 0.0].min() > -1e-6
    r_2 = geometry.grid.x**2 + geometry.grid.y[:, None] ** 2
    hertz = np.sqrt(np.maximum(0.0, 1.0 - r_2))
    # cells at the root edge carry 0.05; inside a half per cent
    assert np.abs(p - hertz)[r_2 < 0.7].max() <= 0.005
    assert np.abs(p - hertz).max() <= 0.06
    # an eighth of the load: half the pressure and half the radius
    light, _ = dry_contact(geometry.grid, geometry.undeformed, geometry.deflection, TARGET_LOAD / 8.0)
    assert light.max() == pytest.approx(0.5, abs=0.06)
