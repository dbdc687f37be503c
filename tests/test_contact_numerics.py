"""Grid, dry contact, GMRES and Anderson mixing on their own."""

import numpy as np
import pytest

from ballscrew_tehl.contact.anderson import AndersonMixing
from ballscrew_tehl.contact.dry import dry_contact
from ballscrew_tehl.contact.grid import graded_grid, uniform_grid
from ballscrew_tehl.contact.krylov import gmres
from ballscrew_tehl.contact.reynolds import TARGET_LOAD, ContactGeometry, GridChoice, contact_geometry

GRIDS = {
    "uniform": uniform_grid(-2.5, 1.5, 1.5, 41, 9),
    "inlet 0.1": graded_grid(-2.5, 1.5, 1.5, 129, 17, 0.1),
    "inlet 0.002": graded_grid(-2.5, 1.5, 1.5, 129, 17, 0.002),
    "thick film": graded_grid(-40.0, 10.0, 20.0, 129, 17, 5.0),
}


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
def test_grid_covers_its_domain(grid):
    assert np.all(np.diff(grid.x) > 0.0)
    assert grid.y[0] == 0.0
    np.testing.assert_allclose(np.diff(grid.y), grid.h_y, rtol=1e-12)
    # the line at Y = 0 is shared by both halves; the outermost line counts in full
    assert grid.weights.sum() == pytest.approx(
        (grid.x[-1] - grid.x[0]) * (2.0 * grid.y[-1] + grid.h_y), rel=1e-12
    )
    middle = grid.weights[0].sum() + grid.weights[1:-1].sum() + 0.5 * grid.weights[-1].sum()
    assert middle == pytest.approx((grid.x[-1] - grid.x[0]) * 2.0 * grid.y[-1], rel=1e-12)
    # neighbouring spacings: smooth enough for second order
    ratio = np.diff(grid.x)[1:] / np.diff(grid.x)[:-1]
    assert 0.6 < ratio.min() < ratio.max() < 1.6


def test_grid_is_finer_where_the_film_forms():
    wide, narrow = (graded_grid(-2.5, 1.5, 1.5, 129, 9, inlet) for inlet in (0.3, 0.01))
    uniform = 4.0 / 128.0
    for grid, finest in ((wide, 0.7), (narrow, 0.25)):
        spacing = np.interp(-0.985, grid.x[:-1], np.diff(grid.x))
        assert spacing < finest * uniform


def test_refinement_keeps_the_places_of_the_nodes():
    coarse, fine = (graded_grid(-2.5, 1.5, 1.5, n, 9, 0.1) for n in (65, 129))
    np.testing.assert_allclose(fine.x[::2], coarse.x, atol=1e-12)


@pytest.mark.parametrize("ratio", [1.0, 0.2, 0.0353])
def test_dry_contact_is_that_of_hertz(ratio):
    """Pressure on the nodes, gap closed under it and open beside it: complementarity and the known answer."""
    geometry = ContactGeometry(GridChoice(-2.0, 1.5, 1.3, 65, 17, 0.2), ratio)
    p = geometry.dry_pressure
    gap = geometry.gap(p, geometry.dry_approach)
    assert np.sum(geometry.weights * p) == pytest.approx(TARGET_LOAD, rel=1e-12)
    assert p.min() == 0.0
    # tolerance of the conjugate gradients, 1e-10 of p_max, through an ill-conditioned deflection
    assert not np.abs(gap[p > 0.0]).max() > 1e-6
    assert gap[p == 0.0].min() > -1e-6
    r_2 = geometry.grid.x**2 + geometry.grid.y[:, None] ** 2
    hertz = np.sqrt(np.maximum(0.0, 1.0 - r_2))
    # cells at the root edge carry 0.05; inside a half per cent
    assert not np.abs(p - hertz)[r_2 < 0.7].max() > 0.005
    assert not np.abs(p - hertz).max() > 0.06


def test_dry_contact_on_a_grid_too_coarse_for_it_still_carries_the_load():
    geometry = ContactGeometry(GridChoice(-200.0, 60.0, 90.0, 65, 17, 60.0), 1.0)
    p = geometry.dry_pressure
    assert np.sum(geometry.weights * p) == pytest.approx(TARGET_LOAD, rel=1e-12)
    assert np.isfinite(geometry.dry_approach)


def test_dry_contact_takes_its_load():
    geometry = ContactGeometry(GridChoice(-1.5, 1.5, 1.3, 33, 9), 1.0)
    light, _ = dry_contact(geometry.grid, geometry.undeformed, geometry.deflection, TARGET_LOAD / 8.0)
    # Hertz: an eighth of the load, half the pressure and half the radius
    assert light.max() == pytest.approx(0.5, abs=0.03)
    assert geometry.grid.x[light[0] > 0.0].max() == pytest.approx(0.5, abs=0.1)


def test_geometry_is_made_once_per_grid():
    choice = GridChoice(n_x=17, n_y=5)
    assert contact_geometry(choice, 0.3) is contact_geometry(GridChoice(n_x=17, n_y=5), 0.3)


def test_gmres_solves_a_linear_system():
    rng = np.random.default_rng(8)
    matrix = np.eye(30) * 4.0 + rng.normal(size=(30, 30))
    rhs = rng.normal(size=30)
    solution, used = gmres(lambda v: matrix @ v, lambda v: v / 4.0, rhs, 1e-12, 30)
    np.testing.assert_allclose(solution, np.linalg.solve(matrix, rhs), rtol=1e-9)
    assert used <= 30
    rough, fewer = gmres(lambda v: matrix @ v, lambda v: v / 4.0, rhs, 1e-1, 30)
    assert fewer < used
    assert not np.linalg.norm(matrix @ rough - rhs) > 0.1 * np.linalg.norm(rhs)


def test_gmres_ends_at_once_on_nothing_and_on_an_exact_preconditioner():
    solution, used = gmres(lambda v: v, lambda v: v, np.zeros(5), 1e-3, 4)
    assert used == 0
    np.testing.assert_array_equal(solution, 0.0)
    matrix = np.diag([1.0, 5.0, 9.0])
    solution, used = gmres(lambda v: matrix @ v, lambda v: v / np.diag(matrix), np.ones(3), 1e-12, 3)
    assert used == 1
    np.testing.assert_allclose(solution, 1.0 / np.diag(matrix), rtol=1e-14)


def test_gmres_stops_at_its_limit():
    rng = np.random.default_rng(9)
    matrix = rng.normal(size=(20, 20))
    _, used = gmres(lambda v: matrix @ v, lambda v: v, rng.normal(size=20), 1e-14, 5)
    assert used == 5


def test_anderson_mixing_beats_the_plain_iteration():
    """x -> A x + c with a slow mode: history of 5 finds the fixed point of a problem with 4 modes."""
    rates, shift = np.array([0.95, -0.6, 0.5, 0.2]), np.array([1.0, 2.0, 3.0, 4.0])
    exact = shift / (1.0 - rates)

    def image(x):
        return rates * x + shift

    mixing, x, plain = AndersonMixing(), np.zeros(4), np.zeros(4)
    for _ in range(20):
        x, plain = mixing.next(x, image(x), 0.7), image(plain)
    assert not np.abs(x - exact).max() > 1e-6
    assert np.abs(plain - exact).max() > 1.0


def test_anderson_mixing_keeps_the_shape_and_a_fixed_point():
    x = np.arange(6.0).reshape(2, 3)
    mixing = AndersonMixing()
    for _ in range(4):
        assert mixing.next(x, x, 0.7).shape == x.shape
        np.testing.assert_allclose(mixing.next(x, x, 0.7), x)
