"""Linear kernels of the pressure step: LU, deflection, Jacobian with following temperatures, lines, GMRES."""

import contact_twins as twins
import numpy as np
import pytest
from scipy.linalg.lapack import dgetrf

from ballscrew_tehl.contact.film import kernels, linear, transport
from ballscrew_tehl.contact.film.linear import LinearSystem, LineFactors
from ballscrew_tehl.contact.film.reynolds import TARGET_LOAD, ContactGeometry, GridChoice
from ballscrew_tehl.contact.film.transport import HeatTransport

#: complex step: derivatives of the twin to rounding
STEP = 1e-30
#: deflection in single precision, relative to the largest value
SINGLE = 1e-6
FLOOR, N_Z, UNIT, UNIT_H = 1e-9, 5, 4e8, 1e-6


# --- LU ---------------------------------------------------------------------------------------------------------------


def factors_of(matrix):
    """Factors and exchanges of the transposed matrix, as factor_lines makes them."""
    a = matrix.copy()
    _, pivots, info = dgetrf(a.T, overwrite_a=1)
    assert info == 0
    return a, pivots


def matrices():
    rng = np.random.default_rng(4)
    full = rng.normal(size=(12, 12))
    dominant = rng.normal(size=(9, 9)) + 20.0 * np.eye(9)
    zero_diagonal = rng.normal(size=(8, 8))
    np.fill_diagonal(zero_diagonal, 0.0)
    return {
        "random": full,
        "no exchange": dominant,
        "zero diagonal": zero_diagonal,
        # every row elsewhere; without exchanges the first pivot is zero
        "permutation": np.roll(np.diag(1.0 + rng.random(7)), 3, axis=0),
        # without exchanges the solution would lose all digits
        "tiny pivot": np.array([[1e-20, 1.0], [1.0, 1.0]]),
        "rows of unlike size": full * 10.0 ** np.linspace(-8.0, 8.0, 12)[:, None],
        "one": np.array([[-3.0]]),
    }


@pytest.mark.parametrize("matrix", matrices().values(), ids=matrices())
def test_lu_solves_like_numpy(matrix):
    n = len(matrix)
    a, pivots = factors_of(matrix)
    assert (a != matrix).any() or n == 1
    rhs = matrix @ np.random.default_rng(5).normal(size=n)
    solution = rhs.copy()
    linear.lu_solve(a, pivots, solution)
    expected = np.linalg.solve(matrix, rhs)
    # rounding through the condition of the rows at one size
    rows = matrix / np.abs(matrix).max(axis=1)[:, None]
    assert np.abs(solution - expected).max() <= 1e-14 * n * np.linalg.cond(rows) * np.abs(expected).max()


# --- system -----------------------------------------------------------------------------------------------------------

CHOICES = {
    "mirror": (GridChoice(-2.5, 1.5, 1.2, 17, 5, 0.2, True, False), 0.3),
    "whole plane, open sides": (GridChoice(-2.5, 1.5, 1.2, 17, 7, 0.2, False, True), 0.3),
    # line 0 and the edge
    "one line": (GridChoice(-2.5, 1.5, 0.6, 17, 2, 0.2, True, False), 0.3),
}


def film_of(p, spin):
    """A smooth piezoviscous, compressible film: ln phi, g, g_y; p may be complex."""
    shift = spin * np.linspace(-1.0, 1.0, p.shape[1])
    return -3.0 * p + p**2, 1.0 + 0.3 * np.tanh(p), shift * (0.4 + 0.2 * np.sin(3.0 * p))


def random_heat(rng, grid, gap):
    """Columns that pass most of their heat on, and answer by ten kelvin to pressure and gap."""
    heat = HeatTransport.empty(gap.shape[0], grid.x, N_Z)
    shape = heat.source.shape
    conduction = 1.0 + rng.random(shape)
    heat.up_1[:], heat.up_2[:] = 1.0 + rng.random(shape), -0.4 * rng.random(shape)
    heat.source[:], heat.squeeze[:] = (10.0 / UNIT * rng.normal(size=shape) for _ in range(2))
    heat.lift[:], heat.widen[:] = 5.0 * rng.random(shape), 5.0 / UNIT_H * rng.normal(size=shape)
    heat.pull[:], heat.push[:] = rng.normal(size=heat.pull.shape), rng.normal(size=heat.push.shape)
    heat.wedge_h[:] = gap
    # diagonally dominant columns
    heat.lower[:], heat.upper[:] = -0.3 * rng.random(shape), -conduction
    heat.lower[..., 0] = 0.0
    heat.upper[..., -1] = 0.0
    heat.pivot[:] = 1.0 / (4.0 + rng.random(shape))
    heat.weight[:], heat.stress[:] = 0.2 * rng.random(shape), 0.2 * rng.random(shape)
    return heat


class State:
    """Fields with a cavitated part, their linear system, and what it is the derivative of."""

    def __init__(self, choice, ratio, warm, free=True, squeeze=0.7, seed=6, rough=False):
        rng = np.random.default_rng(seed)
        self.geometry = geometry = ContactGeometry(choice, ratio)
        self.grid = grid = geometry.grid
        ny, nx = self.shape = geometry.undeformed.shape
        self.inner = np.zeros(self.shape, dtype=bool)
        self.inner[grid.inner] = True
        p = np.zeros(self.shape)
        p[grid.inner] = 0.3 + 0.6 * rng.random(p[grid.inner].shape)
        p[:, grid.x > 1.0] *= -1e-6
        self.p, self.h_0 = p, 0.5 - float(geometry.gap(p, 0.0).min())
        self.gap, self.spin = geometry.gap(p, self.h_0), 0.0 if grid.mirror else 1.0
        values = film_of(p, self.spin)
        slopes = [np.imag(v) / STEP for v in film_of(p + 1j * STEP, self.spin)]
        self.by_t = 0.01 * rng.normal(size=(ny, nx, 3, N_Z + 1)) * [[1.0], [0.1], [0.1 * self.spin]]
        c_x, c_y = np.empty((ny, nx - 1, 4)), np.empty((ny - 1, nx, 5))
        wedge, flow_x, flow_y = np.empty((ny, nx - 1, 3)), np.empty((ny, nx - 1)), np.empty((ny - 1, nx))
        kernels.face_fluxes(
            grid.x, geometry.kappa_h, grid.mirror, grid.open_side, p, self.gap, *values, flow_x, flow_y, c_x, c_y,
            wedge, FLOOR,
        )  # fmt: skip
        self.penalty = np.where(p < 0.0, 300.0, 0.0)
        heat = random_heat(rng, grid, self.gap) if warm else HeatTransport.none(self.shape)
        (_, g, g_y), (dln_phi, dg, dg_y) = values, slopes
        self.squash = np.zeros(self.shape)
        if rough:
            self.squash[grid.inner] = -np.random.default_rng(15).random(self.squash[grid.inner].shape)
        self.system = LinearSystem(
            grid.width_x, geometry.kappa_h, grid.mirror, self.gap, g, g_y, dln_phi, dg, dg_y,
            self.by_t if warm else np.zeros((ny, nx, 3, 0)), self.penalty, c_x, c_y, wedge, squeeze, self.squash,
            1.0 + 3.0 * rng.random(self.shape), TARGET_LOAD, geometry.weights, free, *geometry.deflection.single,
            geometry.deflection.same_line, heat, UNIT, UNIT_H, warm,
        )  # fmt: skip
        self.size = int(self.inner.sum()) + 1

    def vector(self, inner):
        """Inner pressures and the approach as the kernels have them: all nodes, zero on the edges."""
        out = np.zeros(self.p.size + 1)
        out[:-1][self.inner.ravel()], out[-1] = inner[:-1], inner[-1]
        return out

    def short(self, vector):
        return np.append(vector[:-1][self.inner.ravel()], vector[-1])

    def times(self, v):
        layers = N_Z + 1 if self.system.warm else 0
        out = np.full(v.size, np.nan)
        linear.times(
            self.system, v, np.full((*self.shape, layers), np.nan), np.full((6, *self.shape), np.nan), out
        )
        return out

    def dense(self):
        """Matrix of `times` over inner pressures and approach."""
        return np.array([self.short(self.times(self.vector(unit))) for unit in np.eye(self.size)]).T

    def residual(self, d_p, d_h):
        """Twin: residual with the penalty and the squeeze of one pseudo time step, and the load; d_p may be complex.

        Temperatures follow changes of film pressure and gap linearly, as solved by `follow`.
        """
        s, geometry, grid = self.system, self.geometry, self.grid
        bent = geometry.deflection(np.real(d_p)) + 1j * geometry.deflection(np.imag(d_p))
        gap_change = bent + d_h
        gap, p = self.gap + gap_change, self.p + d_p - self.squash * gap_change
        ln_phi, g, g_y = film_of(p, self.spin)
        if s.warm:
            change = np.zeros((*self.shape, N_Z + 1))
            dp, dh = np.imag(p) / STEP, np.imag(gap) / STEP
            transport.follow(s.heat, s.g, s.dg, s.by_t, UNIT, UNIT_H, dp, dh, change)
            assert np.abs(change).max() > 1.0
            by_t = 1j * STEP * np.einsum("jimk,jik->mji", self.by_t, change)
            ln_phi, g, g_y = ln_phi + by_t[0], g + by_t[1], g_y + by_t[2]
        flows = twins.face_fluxes(
            grid.x, geometry.kappa_h, grid.mirror, grid.open_side, p, gap, ln_phi, g, g_y, FLOOR
        )
        out = twins.residual(grid.width_x, geometry.kappa_h, grid.mirror, *flows)
        out[grid.inner] -= (self.penalty * p + s.squeeze * g * gap)[grid.inner]
        return out, np.sum(geometry.weights * (self.p + d_p))

    def twin_times(self, v):
        """Scaled derivative of the twin in a direction v of all pressures and the approach."""
        r, load = self.residual(1j * STEP * v[:-1].reshape(self.shape), 1j * STEP * v[-1])
        r = np.imag(r) / STEP / self.system.scale
        return np.append(r.ravel(), np.imag(load) / STEP / TARGET_LOAD if self.system.free else v[-1])

    def factors(self):
        out = LineFactors.empty(*self.shape, self.grid.mirror)
        assert linear.factor_lines(self.system, out, carried=True)
        return out

    def precondition(self, v, factors=None):
        out = np.full(v.size, np.nan)
        linear.precondition(self.system, factors or self.factors(), v, out)
        return out

    def direction(self, what="both", seed=12):
        v = np.random.default_rng(seed).normal(size=self.size)
        if what == "approach":
            v[:-1] = 0.0
        if what == "pressure":
            v[-1] = 0.0
        return self.vector(v)


@pytest.fixture(scope="module", params=CHOICES.values(), ids=CHOICES)
def choice(request):
    return request.param


FILMS = {
    "cold": (False, False),
    "warm": (True, False),
    "cold, rough": (False, True),
    "warm, rough": (True, True),
}


@pytest.fixture(scope="module", params=FILMS.values(), ids=FILMS)
def state(request, choice):
    """Rough: the film is relieved by asperities that a closing gap squeezes."""
    warm, rough = request.param
    return State(*choice, warm, rough=rough)


def test_convolve_is_the_deflection_in_single_precision(choice):
    geometry = ContactGeometry(*choice)
    field = np.zeros(geometry.undeformed.shape)
    field[geometry.grid.inner] = np.random.default_rng(7).normal(size=field[geometry.grid.inner].shape)
    out = np.full(field.shape, np.nan)
    linear.convolve(*geometry.deflection.single, field.astype(np.float32), out)
    exact = geometry.deflection(field)
    assert np.abs(exact).max() > 0.1
    assert np.abs(out - exact).max() <= SINGLE * np.abs(exact).max()
    # and as exact as the operator itself in the precision of the modes
    linear.convolve(*(part.astype(np.float64) for part in geometry.deflection.single), field, out)
    assert np.abs(out - exact).max() <= SINGLE * np.abs(exact).max()


@pytest.mark.parametrize("free", [True, False])
@pytest.mark.parametrize("what", ["pressure", "approach", "both"])
def test_times_is_the_derivative_of_residual_and_load(choice, state, what, free):
    """Deflection, film, penalty, squeeze and, of a warm film, the temperatures that follow."""
    if not free:
        state = State(*choice, state.system.warm, free=False, rough=state.squash.any())
    v = state.direction(what)
    found, twin = state.times(v), state.twin_times(v)
    assert (state.p < 0.0).any()
    assert np.abs(twin[:-1]).max() > 0.1
    assert np.abs(found - twin)[:-1].max() <= 10.0 * SINGLE * np.abs(twin).max()
    assert found[-1] == pytest.approx(twin[-1], rel=1e-12, abs=1e-14)


def test_temperatures_that_follow_change_the_product(choice):
    cold, warm = (State(*choice, w) for w in (False, True))
    v = cold.direction()
    difference = warm.times(v) - cold.times(v)
    assert np.abs(difference).max() > 0.01 * np.abs(cold.times(v)).max()


def test_asperities_change_the_product(choice):
    smooth, rough = (State(*choice, warm=True, rough=rough) for rough in (False, True))
    v = smooth.direction()
    assert np.abs(rough.times(v) - smooth.times(v)).max() > 0.01 * np.abs(smooth.times(v)).max()


def test_following_change_of_the_film_is_the_sum_over_the_layers():
    rng = np.random.default_rng(14)
    by_t, dt, out = rng.normal(size=(3, 4, 3, 6)), rng.normal(size=(3, 4, 6)), np.empty((3, 4))
    for j in range(3):
        transport.film_change(by_t, dt, j, out)
        np.testing.assert_allclose(out, np.einsum("imk,ik->mi", by_t[j], dt[j]), rtol=1e-12, atol=1e-14)


# --- lines ------------------------------------------------------------------------------------------------------------


def line_rows(state):
    return range(0 if state.grid.mirror else 1, state.shape[0] - 1)


def test_factored_lines_are_the_blocks_of_the_jacobian(state):
    """Factors of a line solve for what the line itself answers; heat and deflection of other lines left out."""
    factors, s = state.factors(), state.system
    same_line = s.same_line
    for row, j in enumerate(line_rows(state)):
        x = np.zeros(state.shape)
        x[j, 1:-1] = np.random.default_rng(j).normal(size=state.shape[1] - 2)
        dh = np.zeros(state.shape)
        dh[j] = same_line @ x[j]
        dp = x - s.squash * dh
        dt = np.zeros((*state.shape, N_Z + 1 if s.warm else 0))
        d_phi, d_g, d_gy, r = np.zeros((4, *state.shape))
        linear.film_step(s, dp, dh, dt, d_phi, d_g, d_gy)
        kernels.jacobian_times(
            s.width, s.kappa_h, s.mirror, s.c_x, s.c_y, s.wedge, s.gap, s.g, s.g_y, s.penalty, s.squeeze, dp, dh,
            d_phi, d_g, d_gy, r,
        )  # fmt: skip
        answer = r[j, 1:-1].copy()
        linear.lu_solve(factors.lu[row], factors.pivots[row], answer)
        assert np.abs(answer - x[j, 1:-1]).max() <= 1e-9 * np.abs(x).max()


def test_approach_of_the_factors_answers_to_a_rigid_approach(state):
    """Line solves of the change that the same gap everywhere makes, temperatures held; and its load.

    Left out: how the flow across by spin follows the pressure that squeezed asperities take.
    """
    factors, s = state.factors(), state.system
    still, unit = np.zeros(state.shape), np.ones(state.shape)
    column, dp = np.empty(state.shape), -s.squash
    kernels.jacobian_times(
        s.width, s.kappa_h, s.mirror, s.c_x, s.c_y, s.wedge, s.gap, s.g, s.g_y, s.penalty, s.squeeze, dp, unit,
        s.dln_phi * dp, s.dg * dp, still, column,
    )  # fmt: skip
    for row, j in enumerate(line_rows(state)):
        answer = column[j, 1:-1].copy()
        linear.lu_solve(factors.lu[row], factors.pivots[row], answer)
        np.testing.assert_allclose(factors.approach[j, 1:-1], answer, rtol=1e-9, atol=1e-12)
    assert (factors.approach[~state.inner] == 0.0).all()
    load = np.sum(s.weights * factors.approach)
    assert factors.approach_load[0] == pytest.approx(load, rel=1e-12)


@pytest.mark.parametrize("free", [True, False])
def test_precondition_solves_lines_and_load(choice, state, free):
    """Every line with its own deflection, all with one approach that the load decides or that is held."""
    if not free:
        state = State(*choice, state.system.warm, free=False, rough=state.squash.any())
    s, factors, v = state.system, state.factors(), state.direction()
    out = state.precondition(v, factors)
    step, rise = out[:-1].reshape(state.shape), out[-1]
    assert (step[~state.inner] == 0.0).all()
    for row, j in enumerate(line_rows(state)):
        answer = (v[:-1].reshape(state.shape) * s.scale)[j, 1:-1]
        linear.lu_solve(factors.lu[row], factors.pivots[row], answer)
        expected = answer - rise * factors.approach[j, 1:-1]
        np.testing.assert_allclose(step[j, 1:-1], expected, rtol=1e-11, atol=1e-12 * np.abs(step).max())
    if free:
        terms = np.sum(s.weights * np.abs(step))
        assert abs(np.sum(s.weights * step) - TARGET_LOAD * v[-1]) <= 1e-11 * terms
    else:
        assert rise == v[-1]


def single_line(free=True):
    """A line that nothing else acts on: no flow to the edge, whose gap changes as well."""
    state = State(*CHOICES["one line"], warm=False, free=free)
    state.system = state.system._replace(kappa_h=0.0)
    return state


@pytest.mark.parametrize("free", [True, False])
def test_precondition_of_one_line_is_the_inverse_of_times(free):
    """Nothing but the line itself: what is left is the single precision of the deflection."""
    state = single_line(free)
    v = state.direction()
    found = state.times(state.precondition(v))
    assert np.abs(found - v).max() <= 10.0 * SINGLE * np.abs(v).max()


def test_a_singular_line_is_reported(state):
    still = state.system._replace(
        c_x=0.0 * state.system.c_x, c_y=0.0 * state.system.c_y, wedge=0.0 * state.system.wedge,
        penalty=0.0 * state.penalty, squeeze=0.0,
    )  # fmt: skip
    empty = LineFactors.empty(*state.shape, state.grid.mirror)
    assert not linear.factor_lines(still, empty, carried=True)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_line_with_numbers_that_are_not_finite_is_reported(state, value):
    gap = state.system.gap.copy()
    gap[line_rows(state)[0], 4] = value
    empty = LineFactors.empty(*state.shape, state.grid.mirror)
    assert not linear.factor_lines(state.system._replace(gap=gap), empty, carried=True)


def test_factors_without_the_heat_carried_are_those_of_a_film_whose_temperatures_hold(choice):
    state = State(*choice, True)
    held, cold = (LineFactors.empty(*state.shape, state.grid.mirror) for _ in range(2))
    assert linear.factor_lines(state.system, held, carried=False)
    assert linear.factor_lines(state.system._replace(warm=False), cold, carried=True)
    assert (held.lu == cold.lu).all()
    assert np.abs(state.factors().lu - held.lu).max() > 0.0


# --- GMRES ------------------------------------------------------------------------------------------------------------


def solve(state, rhs, tolerance, most, factors=None):
    out = np.full(rhs.size, np.nan)
    used, left = linear.gmres(state.system, factors or state.factors(), rhs, tolerance, most, out)
    return out, used, left


@pytest.mark.parametrize("free", [True, False])
def test_gmres_solves_like_a_dense_matrix(choice, state, free):
    if not free:
        state = State(*choice, state.system.warm, free=False, rough=state.squash.any())
    rhs = state.direction(seed=16)
    solution, used, left = solve(state, rhs, 1e-6, 60)
    assert left <= 1e-6
    assert used < 60
    matrix = state.dense()
    expected = np.linalg.solve(matrix, state.short(rhs))
    # residual and single precision, through the condition of the matrix
    allowed = (left + 10.0 * SINGLE) * np.linalg.cond(matrix)
    assert np.linalg.norm(state.short(solution) - expected) <= allowed * np.linalg.norm(expected)
    assert (solution[:-1].reshape(state.shape)[~state.inner] == 0.0).all()


def test_gmres_returns_the_residual_it_leaves(state):
    """Ended by its tolerance and by its limit."""
    rhs = state.direction(seed=17)
    for tolerance, most in ((1e-2, 60), (1e-4, 60), (0.0, 1), (0.0, 2)):
        solution, used, left = solve(state, rhs, tolerance, most)
        assert used == most if tolerance == 0.0 else left <= tolerance
        true = np.linalg.norm(state.times(solution) - rhs) / np.linalg.norm(rhs)
        # single precision of the products
        assert true == pytest.approx(left, rel=1e-2, abs=1e-4)


def test_gmres_takes_as_many_iterations_as_the_tolerance_asks(state):
    rhs = state.direction(seed=18)
    used = [solve(state, rhs, tolerance, 60)[1] for tolerance in (0.5, 1e-2, 1e-5)]
    assert used == sorted(used)
    before, after = (solve(state, rhs, 0.0, most)[2] for most in (used[2] - 1 or 1, used[2]))
    # the first that is below the tolerance ends it
    assert after <= 1e-5
    assert used[2] == 1 or before > 1e-5


def test_gmres_of_one_line_ends_at_once():
    """The preconditioner is the inverse of the matrix to single precision."""
    state = single_line()
    _, used, left = solve(state, state.direction(seed=19), 10.0 * SINGLE, 60)
    assert used == 1
    assert left <= 10.0 * SINGLE


def test_gmres_of_a_zero_right_side_is_zero(state):
    solution, used, left = solve(state, np.zeros(state.p.size + 1), 1e-3, 4)
    assert (used, left) == (0, 0.0)
    np.testing.assert_array_equal(solution, 0.0)


def test_gmres_that_meets_its_limit_says_so(choice):
    state = State(*choice, warm=True)
    _, used, left = solve(state, state.direction(seed=20), 1e-12, 2)
    assert used == 2
    assert left > 1e-12


def test_gmres_with_factors_of_another_state_needs_more_iterations(choice):
    """An old preconditioner is worse, not wrong."""
    state, other = (State(*choice, warm=False, squeeze=squeeze) for squeeze in (0.0, 30.0))
    rhs = state.direction(seed=22)
    own, own_used, _ = solve(state, rhs, 1e-4, 60)
    old, old_used, left = solve(state, rhs, 1e-4, 60, other.factors())
    assert own_used < old_used
    assert left <= 1e-4
    bound = 4e-4 * np.linalg.cond(state.dense())
    assert np.linalg.norm(own - old) <= bound * np.linalg.norm(own)
