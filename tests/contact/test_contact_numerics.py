"""Grid, dry contact, linearisation, preconditioner and GMRES on their own."""

import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film import kernels, linear, transport
from ballscrew_tehl.contact.film.krylov import gmres
from ballscrew_tehl.contact.film.linear import LineFactors
from ballscrew_tehl.contact.film.oil import oil_table
from ballscrew_tehl.contact.film.reynolds import (
    KEEP_BELOW,
    KRYLOV_TOLERANCE,
    TARGET_LOAD,
    ContactGeometry,
    Film,
    GridChoice,
    NewtonHistory,
    _linear_step,
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


class HotFilm(Film):
    """A film whose temperatures follow the pressure and the gap linearly, as by the energy equation."""

    def __init__(self, state, heat):
        self.state, self.heat = state, heat
        self.unit, self.unit_h, self.warm = P_MAX, 1e-6, True
        self.by_t = np.zeros((*heat.up_1.shape[:2], 3, N_Z + 1))
        self.change = np.zeros_like(state.t)

    def coefficients(self, p):
        out = tuple(np.empty_like(p) for _ in range(6))
        state = self.state
        film_flow.film_coefficients(
            state.table, P_MAX, p, state.t + self.change, state.thinning, state.ln_eta_at, state.share, state.speeds,
            1.1, 1.0, *out, self.by_t,
        )  # fmt: skip
        return out

    def follow(self, system, d_p, d_h):
        """From the temperatures of the state."""
        transport.follow(
            self.heat, system.g, system.dg, system.by_t, self.unit, self.unit_h, d_p, d_h, self.change
        )


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
        self.t = 303.15 + 30.0 * rng.random((*shape, N_Z + 1))
        self.thinning, self.share = 1.0 + rng.random(self.t.shape), rng.random(self.t.shape)
        self.table, spin = oil_table(OIL, 303.15), 0.0 if choice.mirror else 0.4
        self.speeds = film_flow.SurfaceSpeeds(
            1.4 - spin * grid.y[:, None] + 0.0 * r_2, 0.8 + 0.0 * r_2, spin * grid.x + 0.0 * r_2, 0.0 * r_2
        )
        p_at = np.maximum(self.p, 0.0) + 0.01
        self.ln_eta_at = np.log(0.1) + 8.0 * p_at[..., None] + 0.0 * self.t
        heat = transport.HeatTransport.empty(shape[0], grid.x, N_Z)
        inner = heat.source.shape
        # kelvins by the largest pressure, by the gap and by the flow; half of it from the column upstream
        heat.source[:], heat.squeeze[:] = 3.0 / P_MAX * rng.normal(size=(2, *inner))
        heat.widen[:] = 3e6 * rng.normal(size=inner)
        heat.lift[:], heat.push[:], heat.pull[:] = rng.random(inner), rng.normal(), rng.normal()
        heat.wedge_h[:] = geometry.gap(self.p, self.h_0)
        heat.up_1[:], heat.up_2[:], heat.pivot[:] = 0.6, -0.1, 1.0
        heat.lower[..., 1:], heat.upper[..., :-1] = -0.2, -0.2
        heat.weight[:], heat.stress[:] = 0.1 * rng.random((2, *inner))
        self.heat = heat

    def linear(self, d_p=0.0, d_h=0.0, squeeze=0.0, free=True):
        """Linearisation, at temperatures that have followed from the state."""
        film, geometry = HotFilm(self, self.heat), self.geometry
        gap = geometry.gap(self.p, self.h_0)
        if np.any(d_p) or d_h:
            system = self.linear().system
            p, gap = self.p + d_p, geometry.gap(self.p + d_p, self.h_0 + d_h)
            film.follow(system, np.maximum(p, 0.0) - np.maximum(self.p, 0.0), gap - system.gap)
        return _Linearisation(geometry, self.p + d_p, gap, film, 0.7, squeeze, free)

    def unbounded(self, d_p, d_h, squeeze):
        """Residual without the penalty, and the load: the function that the Jacobian differentiates."""
        linear = self.linear(d_p, d_h)
        system, p = linear.system, self.p + d_p
        residual = linear.residual + system.penalty * p
        residual[self.geometry.grid.inner] -= (squeeze * system.g * system.gap)[self.geometry.grid.inner]
        return np.append(residual, np.sum(self.geometry.weights * p))


def apply(system, v):
    """Scaled Jacobian times v: all pressures and the approach."""
    out, shape = np.empty_like(v), system.gap.shape
    linear.times(system, v, np.zeros((*shape, N_Z + 1)), np.zeros((6, *shape)), out)
    return out


def factored(system, mirror):
    factors = LineFactors.empty(*system.gap.shape, mirror)
    assert linear.factor_lines(system, factors, carried=True)
    return factors


@pytest.fixture(scope="module", params=GEOMETRIES.values(), ids=GEOMETRIES)
def state(request):
    return State(*request.param)


@pytest.mark.parametrize("squeeze", [0.0, 5.0])
@pytest.mark.parametrize("what", ["pressure", "approach", "both"])
def test_scaled_jacobian_is_the_derivative_of_residual_and_load(state, what, squeeze):
    """Film coefficients, deflection and load together, with temperatures and thinning that follow the pressure."""
    grid, linearised = state.geometry.grid, state.linear(squeeze=squeeze)
    system = linearised.system
    assert (system.penalty > 0.0).any()
    assert (system.gap < 0.7).any()  # the safeguard of the gap acts as well
    d_p = np.zeros_like(state.p)
    if what != "approach":
        d_p[grid.inner] = np.random.default_rng(12).normal(size=d_p[grid.inner].shape)
        d_p[state.p < 0.0] = 0.0
    d_h, eps = 0.0 if what == "pressure" else 0.7, 1e-6
    found = apply(system, np.append(d_p, d_h))
    plus, minus = (state.unbounded(s * eps * d_p, s * eps * d_h, squeeze) for s in (1.0, -1.0))
    difference = (plus - minus) / (2.0 * eps) / np.append(system.scale, TARGET_LOAD)
    # deflection of the Jacobian in single precision: 1e-6
    assert np.abs(found - difference).max() <= 1e-5 * np.abs(difference).max()
    assert found[-1] == pytest.approx(np.sum(grid.load_weights * d_p) / TARGET_LOAD, rel=1e-12, abs=1e-14)


def test_held_approach_takes_the_place_of_the_load(state):
    """The last equation is the change of the approach itself."""
    held, free = (state.linear(free=free).system for free in (False, True))
    v = np.append(state.p, 0.3)
    assert apply(held, v)[-1] == 0.3
    np.testing.assert_array_equal(apply(held, v)[:-1], apply(free, v)[:-1])


def test_temperatures_that_follow_are_a_good_part_of_the_jacobian(state):
    """Otherwise the comparison above would not see them."""
    system = state.linear().system
    v = np.append(np.where(state.p > 0.0, np.sin(9.0 * state.geometry.grid.x), 0.0), 0.0)
    warm = apply(system, v)
    difference = warm - apply(system._replace(warm=False), v)
    assert np.abs(difference).max() > 0.01 * np.abs(warm).max()


def test_penalty_pushes_a_cavitated_node_back(state):
    system = state.linear().system
    node = tuple(np.argwhere(system.penalty > 0.0)[0])
    change = np.zeros_like(state.p)
    change[node] = 1.0
    found = apply(system, np.append(change, 0.0))[:-1].reshape(change.shape)[node]
    assert found == pytest.approx(-1.0, abs=0.2)  # the penalty is most of the scale


def test_line_preconditioner_solves_lines_and_load(state):
    """Every line with its own deflection and heat, all with one approach, and the load of all of them."""
    geometry, system = state.geometry, state.linear(squeeze=2.0).system
    grid, (ny, nx) = geometry.grid, state.p.shape
    v, z, n = np.zeros(ny * nx + 1), np.empty(ny * nx + 1), nx - 2
    v[:-1] = geometry.embed(np.random.default_rng(13).normal(size=geometry.inner_weights.shape)).ravel()
    v[-1] = 0.4
    linear.precondition(system, factored(system, grid.mirror), v, z)
    step, d_h = z[:-1].reshape(ny, nx), z[-1]
    rhs = system.scale * v[:-1].reshape(ny, nx)
    for j in range(0 if grid.mirror else 1, ny - 1):
        far_phi, far_g = np.empty((2, nx, nx))
        transport.line_response(
            system.heat, j, system.g, system.dg, system.by_t, system.unit, system.unit_h, system.squash,
            system.same_line, np.empty((3 * N_Z + 2, nx)), far_phi, far_g,
        )  # fmt: skip
        matrix, column = np.empty((n, n)), np.empty(n)
        kernels.line_jacobian(
            j, grid.width_x, geometry.kappa_h, grid.mirror, system.c_x, system.c_y, system.wedge, system.gap, system.g,
            system.g_y, system.penalty, system.squeeze, system.squash, system.dln_phi, system.dg, far_phi, far_g,
            system.same_line, matrix, column,
        )  # fmt: skip
        own = step[j, 1:-1]
        terms = np.abs(matrix) @ np.abs(own) + np.abs(column * d_h)
        assert np.abs(matrix @ own + column * d_h - rhs[j, 1:-1]).max() <= 1e-9 * terms.max()
    assert np.sum(geometry.weights * step) == pytest.approx(TARGET_LOAD * v[-1], rel=1e-9)


def test_gmres_with_the_line_preconditioner_solves_the_newton_system(state):
    linearised = state.linear()
    system, rhs = linearised.system, linearised.right_hand_side(0.1)
    solution = np.empty_like(rhs)
    used, left = linear.gmres(system, factored(system, state.geometry.grid.mirror), rhs, 1e-4, 60, solution)
    assert left <= 1e-4
    assert 1 < used < 60
    # single precision of the deflection in every product
    assert np.linalg.norm(apply(system, solution) - rhs) == pytest.approx(left * np.linalg.norm(rhs), rel=0.3)
    _, plain, _ = gmres(lambda v: apply(system, v), lambda v: v, rhs, 1e-4, 60)
    assert used < plain


def test_right_hand_side_is_the_scaled_residual_and_load_error(state):
    linearised = state.linear()
    rhs = linearised.right_hand_side(0.3)
    residual = -rhs[:-1].reshape(state.p.shape) * linearised.system.scale
    np.testing.assert_allclose(residual, linearised.residual, rtol=1e-14)
    assert rhs[-1] == pytest.approx(-0.3 / TARGET_LOAD)


def test_linear_step_keeps_factors_that_are_good_enough(state):
    """Factors of the same state serve again; useless ones are replaced, and the iterations of both are counted."""
    linearised = state.linear()
    rhs = linearised.right_hand_side(0.1)
    first, kept, replaced = NewtonHistory(), NewtonHistory(), NewtonHistory()
    delta, factors = _linear_step(linearised, rhs, None, first)
    assert first.factorisations == 1
    assert first.deflections == first.krylov[0] + 1
    residual = np.linalg.norm(apply(linearised.system, delta) - rhs) / np.linalg.norm(rhs)
    # single precision of the deflection
    assert residual <= KRYLOV_TOLERANCE * 1.01 + 1e-5

    again, same = _linear_step(linearised, rhs, factors, kept)
    assert first.krylov[0] <= KEEP_BELOW
    assert same is factors
    assert (kept.factorisations, kept.krylov) == (0, first.krylov)
    np.testing.assert_array_equal(again, delta)
    useless = factors._replace(
        approach=-factors.approach, lu=np.tile(np.eye(factors.lu.shape[1]), (len(factors.lu), 1, 1))
    )
    renewed, new = _linear_step(linearised, rhs, useless, replaced)
    assert new is not useless
    assert replaced.factorisations == 1
    assert replaced.krylov == [KEEP_BELOW + first.krylov[0]]
    np.testing.assert_allclose(renewed, delta, rtol=1e-9, atol=1e-12 * np.abs(delta).max())


def test_singular_line_ends_the_step(state):
    linearised = state.linear()
    linearised.system = linearised.system._replace(c_x=np.full_like(linearised.system.c_x, np.nan))
    with pytest.raises(np.linalg.LinAlgError, match="singular"):
        _linear_step(linearised, linearised.right_hand_side(0.1), None, NewtonHistory())


def test_newton_step_is_taken_in_the_fluidity_where_pressure_flow_dominates(state):
    linearised = state.linear()
    assert linearised.flow_share.min() >= 0.0
    assert linearised.flow_share.max() <= 1.0
    tiny = np.full_like(state.p, 1e-9)
    np.testing.assert_allclose(linearised.update(tiny), tiny, rtol=1e-6)
    thickening = np.maximum(linearised.thickening, 1e-3)
    d_p = 0.5 / thickening
    share = (linearised.update(d_p) - d_p) / (-np.log(0.5) / thickening - d_p)
    np.testing.assert_allclose(share, linearised.flow_share, atol=1e-12)
    # a fall of the fluidity to nothing is bounded
    assert np.all(np.isfinite(linearised.update(1e6 + tiny)))


@pytest.mark.parametrize("squeeze", [1.0, 1e6])
def test_squeeze_of_a_pseudo_time_step_takes_from_the_share_of_the_pressure_flow(state, squeeze):
    """What the deflection takes grows from 1/width to 1/width + squeeze."""
    still, moving = (state.linear(squeeze=s).flow_share for s in (0.0, squeeze))
    flows = (still > 0.0) & (still < 1.0)
    assert flows[state.geometry.grid.inner].all()
    grown = ((1.0 / moving[flows] - 1.0) / (1.0 / still[flows] - 1.0)).ravel()
    width = (state.geometry.grid.width_x + 0.0 * still)[flows]
    # digits of 1 - share where nearly all is pressure flow
    lost = 1e-15 / np.min(1.0 - still[flows])
    assert lost < 1e-6
    np.testing.assert_allclose(grown, 1.0 + squeeze * width, rtol=1e-9 + 10.0 * lost)


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
