"""Influence of pressure cells: compiled against NumPy and quadrature; convolution against the plain sum."""

import contact_twins as twins
import numpy as np
import pytest
from scipy.integrate import dblquad

from ballscrew_tehl.contact.half_space.deflection import LineConvolution, deflection_operator, line_influence
from ballscrew_tehl.contact.half_space.grid import Grid, graded_grid, uniform_grid

GRIDS = {"uniform": uniform_grid(-2.0, 1.5, 1.5, 9, 5), "graded": graded_grid(-4.0, 1.5, 1.2, 15, 4, 0.05)}
ROUNDING = 1e-13  # of double precision and of the largest influence: both forms cancel in far cells


@pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS)
@pytest.mark.parametrize("kappa", [1.0, 0.117])
def test_line_influence_is_the_numpy_twin(grid, kappa):
    arguments = (grid.x, grid.cell_edges_x, grid.h_y / kappa, grid.n_distance)
    twin = twins.line_influence(*arguments)
    np.testing.assert_allclose(line_influence(*arguments), twin, rtol=1e-11, atol=ROUNDING * twin.max())


@pytest.mark.parametrize(("distance", "node", "cell"), [(0, 4, 4), (0, 4, 5), (1, 2, 3), (3, 0, 14)])
def test_influence_is_the_integral_over_the_cell(distance, node, cell):
    grid = GRIDS["graded"]
    x, edges, h_y = grid.x, grid.cell_edges_x, grid.h_y / 0.3
    value = line_influence(x, edges, h_y, 4)[distance, node, cell]
    left, right = edges[cell] - x[node], edges[cell + 1] - x[node]
    # one quadrant at a time, so that the singular point is a corner
    low, high = (0.0, 0.5 * h_y) if distance == 0 else ((distance - 0.5) * h_y, (distance + 0.5) * h_y)
    parts = [(left, 0.0), (0.0, right)] if left < 0.0 < right else [(left, right)]
    exact = sum(
        dblquad(lambda y, x: 1.0 / np.hypot(x, y), *part, low, high, epsabs=1e-9)[0] for part in parts
    )
    exact *= 2.0 if distance == 0 else 1.0
    assert value == pytest.approx(exact, rel=1e-6)  # what dblquad reaches at the singular corner


def test_convolution_is_the_sum_over_all_cells_of_both_halves():
    rng = np.random.default_rng(1)
    n_y, n_x = 5, 6
    influence = rng.normal(size=(2 * n_y - 1, n_x, n_x))
    field = rng.normal(size=(n_y, n_x))
    field[-1] = 0.0
    lines = [(line, field[abs(line)]) for line in range(1 - n_y, n_y)]
    plain = [sum(influence[abs(j - line)] @ value for line, value in lines) for j in range(n_y)]
    np.testing.assert_allclose(LineConvolution(influence, n_y)(field), plain, atol=1e-13)


def test_convolution_of_a_whole_plane_is_the_sum_over_its_cells():
    rng = np.random.default_rng(1)
    for n_y in (3, 6, 7):
        influence, field = rng.normal(size=(n_y, 5, 5)), rng.normal(size=(n_y, 5))
        field[[0, -1]] = 0.0
        plain = [sum(influence[abs(j - line)] @ field[line] for line in range(n_y)) for j in range(n_y)]
        np.testing.assert_allclose(LineConvolution(influence, n_y, mirror=False)(field), plain, atol=1e-13)


@pytest.mark.parametrize("inlet", [0.02, 0.5])
@pytest.mark.parametrize("kappa", [1.0, 0.117])
@pytest.mark.parametrize("mirror", [True, False])
def test_deflection_is_the_convolution_with_the_influence(inlet, kappa, mirror):
    grid = graded_grid(-4.0, 1.5, 1.2, 65, 9, inlet, mirror)
    influence = line_influence(grid.x, grid.cell_edges_x, grid.h_y / kappa, grid.n_distance)
    p = np.random.default_rng(2).random((grid.y.size, grid.x.size))
    p[-1] = 0.0
    p[0] *= mirror
    operator, plain = deflection_operator(grid, kappa, 2.0), LineConvolution(influence, grid.y.size, mirror)
    # panels against the closed form, 1e-11 of the largest influence
    np.testing.assert_allclose(operator(p), 2.0 * kappa * plain(p), rtol=1e-11)
    np.testing.assert_allclose(operator.same_line, 2.0 * kappa * influence[0], rtol=1e-14)
    np.testing.assert_allclose(operator.rough(p), operator(p), rtol=2e-6)
    assert operator.rough(p).dtype == np.float64


def test_even_field_of_a_whole_plane_is_that_of_its_half():
    half, whole = (graded_grid(-4.0, 1.5, 1.2, 15, n, 0.1, n == 5) for n in (5, 9))
    np.testing.assert_allclose(whole.y[4:], half.y, atol=1e-15)
    p = np.random.default_rng(2).random((5, 15))
    p[-1] = 0.0
    both = np.concatenate((p[:0:-1], p))
    np.testing.assert_allclose(
        deflection_operator(whole, 0.3, 1.0)(both)[4:], deflection_operator(half, 0.3, 1.0)(p), rtol=1e-12
    )
    assert np.sum(whole.weights * both) == pytest.approx(np.sum(half.weights * p), rel=1e-13)


def test_mirrored_grid_mirrors_the_deflection():
    grid = GRIDS["graded"]
    mirrored = Grid(-grid.x[::-1], grid.y)
    p = np.random.default_rng(2).random((grid.y.size, grid.x.size))
    p[-1] = 0.0
    here, there = (deflection_operator(g, 0.3, 1.0) for g in (grid, mirrored))
    np.testing.assert_allclose(there(p[:, ::-1]), here(p)[:, ::-1], rtol=1e-12)
