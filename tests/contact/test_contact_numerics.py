"""Grid, dry contact, linearisation, preconditioner and GMRES on their own."""

import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film import kernels
from ballscrew_tehl.contact.film.krylov import gmres
from ballscrew_tehl.contact.film.oil import oil_table
from ballscrew_tehl.contact.film.reynolds import (
    TARGET_LOAD,
    ContactGeometry,
    GridChoice,
    LinePreconditioner,
    _Linearisation,
)
from ballscrew_tehl.contact.half_space.dry import dry_contact
from ballscrew_tehl.contact.half_space.grid import graded_grid, uniform_grid

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
    assert 0.6 < ratio.min() < ratio.max() < 1.7


def test_whole_grid_is_two_halves():
    half = graded_grid(-2.5, 1.5, 1.5, 33, 9, 0.1, open_side=True)
    whole = graded_grid(-2.5, 1.5, 1.5, 33, 17, 0.1, mirror=False, open_side=True)
    np.testing.assert_array_equal(whole.x, half.x)
    np.testing.assert_allclose(whole.y[8:], half.y, atol=1e-15)
    np.testing.assert_allclose(whole.y, -whole.y[::-1], atol=1e-15)
    p = np.random.default_rng(1).random((9, 33))
    p[-1] = 0.0
    both = np.concatenate((p[:0:-1], p))
    for name in ("weights", "load_weights"):
        load = np.sum(getattr(whole, name) * both)
        assert load == pytest.approx(np.sum(getattr(half, name) * p), rel=1e-13)
    assert half.inner == (slice(0, -1), slice(1, -1))
    assert whole.inner == (slice(1, -1), slice(1, -1))


@pytest.mark.parametrize("mirror", [True, False])
def test_load_beyond_an_open_side_is_that_of_the_last_line(mirror):
    """Line loads that fall with the square of the distance: half the sum of both sides as far as infinity."""
    n_y, y_max = (41 if mirror else 81), 10.0
    closed, open_ = (uniform_grid(-1.0, 1.0, y_max, 9, n_y, mirror, side) for side in (False, True))
    np.testing.assert_array_equal(closed.load_weights, closed.weights)
    p = np.where(np.abs(open_.y) > 5.0, 1.0 / np.maximum(np.abs(open_.y), 1e-9) ** 2, 0.0)[
        :, None
    ] + np.zeros(9)
    p[[0, -1]] = 0.0
    # lines from y = 5.25 on: cells begin at 5.125
    tail = 2.0 * 2.0 / 5.125
    assert np.sum(open_.load_weights * p) == pytest.approx(tail, rel=2e-3)
    assert np.sum(open_.weights * p) < 0.6 * tail


def test_halved_choice_keeps_every_other_node():
    choice = GridChoice(-2.5, 1.5, 1.5, 129, 17, 0.1, True, True)
    half = choice.halved()
    assert (half.n_x, half.n_y, half.mirror, half.open_side) == (65, 9, True, True)
    fine, coarse = choice.build(), half.build()
    np.testing.assert_allclose(fine.x[::2], coarse.x, atol=1e-12)
    np.testing.assert_allclose(fine.y[::2], coarse.y, atol=1e-12)
    assert GridChoice(n_x=63).halved() is None
    assert GridChoice(n_y=7).halved() is None


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
    """Pressure on the nodes, gap zero under it and positive outside: complementarity and the closed form."""
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


def test_dry_contact_on_a_grid_too_coarse_for_it_still_carries_the_load():
    geometry = ContactGeometry(GridChoice(-200.0, 60.0, 90.0, 65, 17, 60.0), 1.0)
    p, approach = geometry.dry_contact
    assert np.sum(geometry.weights * p) == pytest.approx(TARGET_LOAD, rel=1e-12)
    assert np.isfinite(approach)


def test_dry_contact_uses_the_given_load():
    geometry = ContactGeometry(GridChoice(-1.5, 1.5, 1.3, 33, 9), 1.0)
    light, _ = dry_contact(geometry.grid, geometry.undeformed, geometry.deflection, TARGET_LOAD / 8.0)
    # Hertz: an eighth of the load, half the pressure and half the radius
    assert light.max() == pytest.approx(0.5, abs=0.03)
    assert geometry.grid.x[light[0] > 0.0].max() == pytest.approx(0.5, abs=0.1)


# --- linearisation of the Reynolds equation ---------------------------------------------------------------------------

GEOMETRIES = {
    "circle, mirror": (GridChoice(-3.0, 1.8, 1.6, 33, 7, 0.2, True, False), 1.0),
    "ellipse, mirror, open side": (GridChoice(-3.0, 1.8, 1.6, 33, 9, 0.2, True, True), 0.1),
    "ellipse, whole plane, open sides": (GridChoice(-3.0, 1.8, 1.6, 33, 11, 0.2, False, True), 0.3),
}
N_Z, P_MAX = 5, 4e8


class State:
    """A thick film of a shear-thinning, warm oil with slide and spin, cavitated behind the contact."""

    def __init__(self, choice, ratio):
        self.geometry = geometry = ContactGeometry(choice, ratio)
        grid, rng = geometry.grid, np.random.default_rng(11)
        shape = geometry.undeformed.shape
        r_2 = grid.x**2 + grid.y[:, None] ** 2
        p = np.zeros(shape)
        p[grid.inner] = (0.9 / (1.0 + r_2))[grid.inner]
        self.p = np.where((grid.x > 1.1) & (p > 0.0), -1e-7, p)
        self.h_0 = 0.6 - float(geometry.gap(np.maximum(self.p, 0.0), 0.0).min())
        t = 303.15 + 30.0 * rng.random((*shape, N_Z + 1))
        t_p, thinning, share = 1e-8 * rng.normal(size=t.shape), 1.0 + rng.random(t.shape), rng.random(t.shape)
        self.table, spin = oil_table(OIL, 303.15), 0.0 if choice.mirror else 0.4
        speeds = film_flow.SurfaceSpeeds(
            1.4 - spin * grid.y[:, None] + 0.0 * r_2, 0.8 + 0.0 * r_2, spin * grid.x + 0.0 * r_2, 0.0 * r_2
        )
        p_at = np.maximum(self.p, 0.0) + 0.01
        ln_eta_at = np.log(0.1) + 8.0 * p_at[..., None] + 0.0 * t

        def film(p):
            out = tuple(np.empty_like(p) for _ in range(6))
            film_flow.film_coefficients(
                self.table, P_MAX, p, p_at, t, t_p, thinning, ln_eta_at, share, speeds, 1.1, 1.0, *out
            )
            return out

        self.film = film

    def linear(self, d_p=0.0, d_h=0.0):
        p = self.p + d_p
        return _Linearisation(self.geometry, p, self.geometry.gap(p, self.h_0 + d_h), self.film, 0.7)

    def unbounded(self, d_p, d_h):
        """Residual without the penalty, and the load: the function that the Jacobian differentiates."""
        linear, inner = self.linear(d_p, d_h), self.geometry.grid.inner
        p = self.p + d_p
        residual = linear.residual + (linear.penalty * p)[inner]
        return np.append(residual, np.sum(self.geometry.weights * p))


@pytest.fixture(scope="module", params=GEOMETRIES.values(), ids=GEOMETRIES)
def state(request):
    return State(*request.param)


@pytest.mark.parametrize("what", ["pressure", "approach", "both"])
def test_scaled_jacobian_is_the_derivative_of_residual_and_load(state, what):
    """Film coefficients, deflection and load together, with temperatures and thinning that follow the pressure."""
    grid, linear = state.geometry.grid, state.linear()
    assert (linear.penalty > 0.0).any()
    assert (linear.gap < 0.7).any()  # the safeguard of the gap acts as well
    d_p = np.zeros_like(state.p)
    if what != "approach":
        d_p[grid.inner] = np.random.default_rng(12).normal(size=d_p[grid.inner].shape)
        d_p[state.p < 0.0] = 0.0
    d_h, eps = 0.0 if what == "pressure" else 0.7, 1e-6
    found = linear.apply(np.append(d_p[grid.inner], d_h))
    plus, minus = (state.unbounded(s * eps * d_p, s * eps * d_h) for s in (1.0, -1.0))
    difference = (plus - minus) / (2.0 * eps) / linear.scale
    # deflection of the Jacobian in single precision: 1e-6
    assert np.abs(found - difference).max() <= 1e-5 * np.abs(difference).max()
    assert found[-1] == pytest.approx(np.sum(grid.load_weights * d_p) / TARGET_LOAD, rel=1e-12, abs=1e-14)


def test_penalty_pushes_a_cavitated_node_back(state):
    linear, grid = state.linear(), state.geometry.grid
    node = np.argwhere((linear.penalty > 0.0)[grid.inner])[0]
    change = np.zeros_like(state.p[grid.inner])
    change[tuple(node)] = 1.0
    found = linear.apply(np.append(change, 0.0))[:-1].reshape(change.shape)[tuple(node)]
    assert found == pytest.approx(-1.0, abs=0.2)  # the penalty is most of the scale


def test_line_preconditioner_solves_lines_and_load(state):
    """Every line with its own deflection, all with one approach, and the load of all of them."""
    geometry, linear = state.geometry, state.linear()
    grid, solve = geometry.grid, LinePreconditioner(linear)
    lines, n = linear.residual.shape
    v = np.random.default_rng(13).normal(size=lines * n + 1)
    z = solve.scaled(linear.scale)(v)
    step, d_h = z[:-1].reshape(lines, n), z[-1]
    rhs = (linear.scale * v)[:-1].reshape(lines, n)
    for row in range(lines):
        matrix, column = np.empty((n, n)), np.empty(n)
        kernels.line_jacobian(
            row + (0 if grid.mirror else 1), grid.width_x, geometry.kappa_h, grid.mirror, linear.c_x, linear.c_y,
            linear.wedge, linear.gap, linear.g, linear.dg, linear.penalty, geometry.deflection.same_line, matrix,
            column,
        )  # fmt: skip
        terms = np.abs(matrix) @ np.abs(step[row]) + np.abs(column * d_h)
        assert np.abs(matrix @ step[row] + column * d_h - rhs[row]).max() <= 1e-9 * terms.max()
    assert np.sum(geometry.inner_weights * step) == pytest.approx(TARGET_LOAD * v[-1], rel=1e-9)


def test_gmres_with_the_line_preconditioner_solves_the_newton_system(state):
    linear = state.linear()
    rhs = -np.append(linear.residual, 0.1) / linear.scale
    preconditioned = LinePreconditioner(linear).scaled(linear.scale)
    solution, used, left = gmres(linear.apply, preconditioned, rhs, 1e-4, 60)
    assert left <= 1e-4
    assert 1 < used < 60
    # single precision of the deflection in every product
    assert np.linalg.norm(linear.apply(solution) - rhs) == pytest.approx(left * np.linalg.norm(rhs), rel=0.3)
    _, plain, _ = gmres(linear.apply, lambda v: v, rhs, 1e-4, 60)
    assert used < plain


def test_newton_step_is_taken_in_the_fluidity_where_pressure_flow_dominates(state):
    linear = state.linear()
    assert linear.flow_share.min() >= 0.0
    assert linear.flow_share.max() <= 1.0
    tiny = np.full_like(state.p, 1e-9)
    np.testing.assert_allclose(linear.update(tiny), tiny, rtol=1e-6)
    thickening = np.maximum(linear.thickening, 1e-3)
    d_p = 0.5 / thickening
    share = (linear.update(d_p) - d_p) / (-np.log(0.5) / thickening - d_p)
    np.testing.assert_allclose(share, linear.flow_share, atol=1e-12)
    # a fall of the fluidity to nothing is bounded
    assert np.all(np.isfinite(linear.update(1e6 + tiny)))


# --- GMRES, mixing ----------------------------------------------------------------------------------------------------


def test_gmres_ends_at_once_for_zero_right_side_and_exact_preconditioner():
    solution, used, left = gmres(lambda v: v, lambda v: v, np.zeros(5), 1e-3, 4)
    assert (used, left) == (0, 0.0)
    np.testing.assert_array_equal(solution, 0.0)
    matrix = np.diag([1.0, 5.0, 9.0])
    solution, used, left = gmres(lambda v: matrix @ v, lambda v: v / np.diag(matrix), np.ones(3), 1e-12, 3)
    assert used == 1
    assert left <= 1e-12
    np.testing.assert_allclose(solution, 1.0 / np.diag(matrix), rtol=1e-14)


def test_gmres_stops_at_its_limit():
    rng = np.random.default_rng(9)
    matrix = rng.normal(size=(20, 20))
    rhs = rng.normal(size=20)
    solution, used, left = gmres(lambda v: matrix @ v, lambda v: v, rhs, 1e-14, 5)
    assert used == 5
    assert left > 1e-3
    assert left == pytest.approx(np.linalg.norm(matrix @ solution - rhs) / np.linalg.norm(rhs), rel=1e-9)
