"""Influence of heat-source cells: compiled against NumPy, and the whole of it against quadrature."""

from itertools import pairwise

import contact_twins as twins
import numpy as np
import pytest
from scipy.integrate import quad

from ballscrew_tehl.contact.half_space.deflection import LineConvolution, line_influence
from ballscrew_tehl.contact.half_space.grid import Grid, graded_grid, uniform_grid
from ballscrew_tehl.contact.half_space.line_table import (
    NODES,
    POINTS,
    both_sides,
    cell_integrals,
    panel_breaks,
    panel_nodes,
    panel_primitive,
)
from ballscrew_tehl.contact.half_space.walls import (
    STRIP_NODES,
    STRIP_WEIGHTS,
    strips,
    wall_influence,
    wall_operator,
)

GRID = graded_grid(-2.5, 1.5, 1.2, 11, 4, 0.2)
H_Y = GRID.h_y / 0.3
BETAS = [0.0, 0.02, 0.4, -0.4, 6.0, -40.0]
#: grid and kappa of the comparison with quadrature
CASES = {
    "short inlet": (graded_grid(-4.0, 1.5, 1.2, 129, 19, 0.02), 0.1),
    "long inlet": (graded_grid(-2.5, 1.5, 1.2, 65, 9, 0.5), 0.3),
    "uniform": (uniform_grid(-2.0, 1.5, 1.3, 97, 13), 1.0),
}
SPEEDS = [0.0, 1e-3, -0.1, 1.0, -1.0, 10.0, -10.0, 50.0, -50.0]


def influence(beta, grid=GRID, h_y=H_Y):
    return wall_influence(grid.x, grid.cell_edges_x, h_y, grid.n_distance, beta)


@pytest.mark.parametrize("beta", [0.0, 0.02, 0.4, 6.0, 40.0])
def test_strips_are_the_numpy_twin(beta):
    s = np.geomspace(1e-7, 6.0, 23)
    for y in (np.array([0.0, 0.5]), H_Y * (np.arange(6) + 0.5)):
        out = np.full((s.size, y.size - 1), np.nan)
        strips(s, y, beta, STRIP_NODES, STRIP_WEIGHTS, out)
        # of values down to exp(-40) of a strip without exponent: rule of six points, 1e-10 of the largest
        np.testing.assert_allclose(out, twins.strips(s, y, beta), rtol=1e-7, atol=1e-15)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_cell_integrals_are_the_numpy_twin(sign):
    rng = np.random.default_rng(3)
    x, edges = GRID.x, GRID.cell_edges_x
    breaks = np.array([-1.7, -0.4, 0.0, 0.1, 2.0, 4.5])
    table, own = rng.normal(size=(breaks.size - 1, POINTS + 1, 7)), rng.normal(size=(x.size, x.size))
    out = np.empty((7, x.size, x.size))
    cell_integrals(x, edges, sign, breaks, table, own, out)
    np.testing.assert_allclose(out, twins.cell_integrals(x, edges, sign, breaks, table, own), atol=1e-13)


def test_panels_integrate_polynomials():
    half = panel_breaks(0.0, 2.0, 0.3, 0.5, 3.0)
    assert half[0] == 0.0
    assert half[-2] <= 2.0 < half[-1]
    s = panel_nodes(half)[:, :, None]
    powers = np.arange(POINTS)
    breaks, density = both_sides(half, s**powers, (-s[:2]) ** powers)
    assert breaks[0] == -half[2]
    table = panel_primitive(breaks, density)
    t = np.array([-1.0, 0.3, 1.0])
    values = np.einsum("tq,pqm->ptm", t[:, None] ** np.arange(POINTS + 1), table)
    at = 0.5 * (breaks[1:] + breaks[:-1])[:, None] + 0.5 * np.diff(breaks)[:, None] * t
    exact = (at[:, :, None] ** (powers + 1) - breaks[0] ** (powers + 1)) / (powers + 1)
    np.testing.assert_allclose(values, exact, rtol=1e-11, atol=1e-12)


def test_panel_around_the_source_replaces_the_others():
    half = np.array([0.1, 1.0, 2.0])
    value = np.ones((2, NODES.size, 1))
    breaks, density = both_sides(half, value, 2.0 * value[:1], 3.0 * value[:1])
    np.testing.assert_array_equal(breaks, [-1.0, -0.1, 0.1, 1.0, 2.0])
    np.testing.assert_array_equal(density[:, 0, 0], [2.0, 3.0, 1.0, 1.0])


def exact_cell(beta, left, right, low, high):
    """Integral over a cell with s = x - x' in left..right, to 1e-9 of itself."""
    if left < 0.0 < right:
        return exact_cell(beta, left, 0.0, low, high) + exact_cell(beta, 0.0, right, low, high)
    sign, speed = (1.0 if left + right > 0.0 else -1.0), abs(beta)

    def line(s):
        bottom, top = np.arcsinh(low / s), np.arcsinh(high / s)
        if speed > 0.0:
            top = min(top, np.arccosh(np.cosh(bottom) + 50.0 / (speed * s)))
        ends = np.linspace(bottom, top, 2 + int((top - bottom) / 2.0))
        level = sign * beta * s - speed * s

        def value(t):
            return np.exp(level - 2.0 * speed * s * np.sinh(0.5 * t) ** 2)

        return sum(quad(value, *part, epsabs=0.0, epsrel=1e-10, limit=200)[0] for part in pairwise(ends))

    near, far = sorted((abs(left), abs(right)))
    if sign * beta < 0.0:
        far = min(far, near + 30.0 / speed)
    # towards the singular point in the root of s
    return quad(lambda v: 2.0 * v * line(v * v), near**0.5, far**0.5, epsabs=0.0, epsrel=1e-9, limit=200)[0]


@pytest.mark.filterwarnings("ignore::scipy.integrate.IntegrationWarning")
@pytest.mark.parametrize("beta", SPEEDS)
@pytest.mark.parametrize("case", CASES)
def test_influence_is_the_integral_over_the_cell(case, beta):
    grid, kappa = CASES[case]
    h_y, nx, edges = grid.h_y / kappa, grid.x.size, grid.cell_edges_x
    values = influence(beta, grid, h_y)
    centre = nx // 2
    chosen = [(0, 0, 0), (0, centre, centre), (0, centre, centre + 1), (0, centre, centre - 3)]
    chosen += [
        (0, nx - 1, 1),
        (0, 2, centre),
        (1, centre, centre),
        (1, centre, centre + 2),
        (2, nx - 9, centre),
    ]
    for distance, node, cell in chosen:
        low, high = (0.0, 0.5 * h_y) if distance == 0 else ((distance - 0.5) * h_y, (distance + 0.5) * h_y)
        exact = exact_cell(beta, grid.x[node] - edges[cell + 1], grid.x[node] - edges[cell], low, high)
        exact *= 2.0 if distance == 0 else 1.0
        value, largest = values[distance, node, cell], values[0, node].max()
        # bound of the docstring
        assert value == pytest.approx(exact, rel=0.0, abs=1e-8 * largest)
        assert value == pytest.approx(exact, rel=1e-5, abs=1e-15 * largest)


@pytest.mark.parametrize("grid", [GRID, CASES["short inlet"][0]], ids=["coarse", "fine"])
def test_standing_wall_is_the_elastic_influence(grid):
    love = line_influence(grid.x, grid.cell_edges_x, H_Y, grid.n_distance)
    # panels of the own line, parts of the largest value in the row
    error = np.abs(influence(0.0, grid) - love) / love[0].max(axis=1)[:, None]
    assert error.max() <= 1e-8
    np.testing.assert_allclose(influence(1e-9, grid), influence(0.0, grid), rtol=1e-7)


def test_reversed_speed_is_the_mirror_image():
    turned = Grid(-GRID.x[::-1], GRID.y)
    np.testing.assert_allclose(influence(-0.4, turned)[:, ::-1, ::-1], influence(0.4), rtol=1e-12)


@pytest.mark.parametrize("mirror", [True, False])
@pytest.mark.parametrize("beta", BETAS)
def test_operator_is_the_convolution_with_the_influence(beta, mirror):
    grid = graded_grid(-2.5, 1.5, 1.2, 21, 7, 0.2, mirror=mirror)
    b, k, chi = 1e-4, 50.0, 1.3e-5
    field = np.random.default_rng(4).random((grid.y.size, grid.x.size))
    field[-1] = 0.0
    field[0] *= mirror
    plain = LineConvolution(influence(beta, grid, grid.h_y / 0.3), grid.y.size, mirror)(field)
    plain *= b / (2.0 * np.pi * k)
    rise = wall_operator(grid, 0.3, b, 2.0 * chi * beta / b, k, chi)(field)
    np.testing.assert_allclose(rise, plain, rtol=1e-10, atol=1e-14 * plain.max())


def test_operator_reuses_the_arrays_of_another():
    grid = graded_grid(-2.5, 1.5, 1.2, 21, 5, 0.2)
    field = np.random.default_rng(4).random((5, 21))
    field[-1] = 0.0
    fresh, old = (wall_operator(grid, 0.3, 1e-4, u, 50.0, 1.3e-5) for u in (1.0, 2.0))
    assert np.any(fresh.rough(field) != old.rough(field))
    memory = old._hat
    new = wall_operator(grid, 0.3, 1e-4, 1.0, 50.0, 1.3e-5, reuse=old)
    assert new._hat is memory
    np.testing.assert_array_equal(new(field), fresh(field))
    np.testing.assert_array_equal(new.rough(field), fresh.rough(field))
    with pytest.raises(ValueError, match="reuse on the same grid size"):
        wall_operator(grid, 0.3, 1e-4, 1.0, 50.0, 1.3e-5, reuse=old)
