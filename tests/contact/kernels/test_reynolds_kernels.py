"""Reynolds kernels: compiled against NumPy; Jacobian against derivatives of the twin and against its own parts."""

import contact_twins as twins
import numpy as np
import pytest

from ballscrew_tehl.contact.film import kernels
from ballscrew_tehl.contact.half_space.deflection import line_influence
from ballscrew_tehl.contact.half_space.grid import graded_grid

FLOOR = 0.05
#: mirror, open side, floor: off, and lifting about a third of the faces
CASES = {
    "half plane": (True, False, FLOOR),
    "half plane, open side": (True, True, FLOOR),
    "half plane, open side, gap as it is": (True, True, 1e-9),
    "whole plane": (False, False, FLOOR),
    "whole plane, open sides": (False, True, FLOOR),
}
#: complex step: derivatives of the twin to rounding
STEP = 1e-30


def film_of(p):
    """A smooth piezoviscous, compressible film with spin: ln phi, g, g_y; p may be complex."""
    shift = np.linspace(-1.0, 1.0, p.shape[1])
    return 2.0 - 9.0 * p + p**2, 1.0 + 0.3 * np.tanh(p), shift * (0.4 + 0.2 * np.sin(3.0 * p))


def derivative(function, *at):
    """Derivatives of a function of complex arguments, one of which has a step in it."""
    return [np.imag(value) / STEP for value in function(*at)]


class Case:
    """Fields with a cavitated (slightly negative) part and a gap that falls below FLOOR; the kernels' answer."""

    def __init__(self, mirror, open_side, floor, seed=3):
        rng = np.random.default_rng(seed)
        self.mirror, self.open_side, self.floor = mirror, open_side, floor
        self.grid = graded_grid(-2.5, 1.5, 1.2, 14, 5 if mirror else 7, 0.1, mirror)
        self.kappa_h = 0.3 / self.grid.h_y
        self.shape = ny, nx = self.grid.y.size, self.grid.x.size
        self.p = np.zeros(self.shape)
        self.p[self.grid.inner] = rng.random(self.p[self.grid.inner].shape) - 0.1
        self.gap = 0.02 + 0.1 * rng.random(self.shape) + 0.2 * np.maximum(0.0, self.grid.x**2 - 1.0)
        # the far line opens from the one before, except for a few nodes where the power law does not apply
        for near, far in ((-2, -1), (1, 0))[: 1 if mirror else 2]:
            self.gap[far, 3:] = self.gap[near, 3:] * (1.2 + rng.random(nx - 3))
            self.gap[far, :3] = 0.7 * self.gap[near, :3]
        self.penalty = np.where(self.p < 0.0, 30.0, 0.0)
        self.dp, self.dh = rng.normal(size=(2, ny, nx))

        ln_phi, self.g, g_y = film_of(self.p)
        dln_phi, self.dg, dg_y = derivative(film_of, self.p + 1j * STEP)
        self.flow_x, self.flow_y = np.full((ny, nx - 1), np.nan), np.full((ny - 1, nx), np.nan)
        self.c_x, self.c_y = np.full((ny, nx - 1, 4), np.nan), np.full((ny - 1, nx, 4), np.nan)
        self.wedge = np.full((ny, nx - 1, 3), np.nan)
        kernels.face_fluxes(
            self.grid.x, self.kappa_h, mirror, open_side, self.p, self.gap, ln_phi, dln_phi, self.g, self.dg, g_y,
            dg_y, self.flow_x, self.flow_y, self.c_x, self.c_y, self.wedge, floor,
        )  # fmt: skip

    @property
    def parts(self):
        return self.mirror, self.c_x, self.c_y, self.wedge, self.gap, self.g, self.dg, self.penalty

    def times(self, dp, dh):
        out = np.full(self.shape, np.nan)
        kernels.jacobian_times(self.grid.width_x, self.kappa_h, *self.parts, dp, dh, out)
        return out

    def twin_fluxes(self, p, gap):
        ln_phi, g, g_y = film_of(p)
        return twins.face_fluxes(
            self.grid.x, self.kappa_h, self.mirror, self.open_side, p, gap, ln_phi, g, g_y, self.floor
        )

    def twin_poiseuille(self, p, gap):
        return (twins.poiseuille_along(self.grid.x, p, gap, film_of(p)[0], self.floor),)

    def twin_residual(self, p, gap):
        out = twins.residual(self.grid.width_x, self.kappa_h, self.mirror, *self.twin_fluxes(p, gap))
        out[self.grid.inner] -= (self.penalty * p)[self.grid.inner]
        return (out,)

    def twin_times(self, dp, dh):
        return derivative(self.twin_residual, self.p + 1j * STEP * dp, self.gap + 1j * STEP * dh)[0]


@pytest.fixture(scope="module", params=CASES.values(), ids=CASES)
def case(request):
    return Case(*request.param)


def test_case_takes_every_branch(case):
    """Cavitated nodes, lifted gaps, lines that open and close: otherwise the comparison is incomplete."""
    assert (case.p < 0.0).any()
    assert (case.gap > FLOOR).any()
    assert (case.gap < case.floor).any() == (case.floor == FLOOR)
    opening = twins.lifted_gap(case.gap, case.floor)
    assert (opening[-1] > opening[-2]).any()
    assert (opening[-1] < opening[-2]).any()


def test_fluxes_and_residual_are_the_numpy_twin(case):
    flow_x, flow_y = case.twin_fluxes(case.p, case.gap)
    # rounding, and 1e-14 of the series that replaces the logarithmic mean of nearly equal values
    np.testing.assert_allclose(case.flow_x, flow_x, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(case.flow_y, flow_y, rtol=1e-11, atol=1e-13)
    wedge = np.broadcast_to(twins.wedge_weights(case.grid.x), case.wedge.shape)
    np.testing.assert_allclose(case.wedge, wedge, atol=1e-13)
    out = np.full(case.shape, np.nan)
    kernels.residual(case.grid.width_x, case.kappa_h, case.mirror, case.flow_x, case.flow_y, out)
    twin = twins.residual(case.grid.width_x, case.kappa_h, case.mirror, flow_x, flow_y)
    np.testing.assert_allclose(out, twin, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("what", ["pressure", "gap"])
def test_derivatives_of_the_fluxes_are_those_of_the_twin(case, what):
    """Every other node of a face moved in turn."""
    nodes, own = np.indices(case.shape), {"pressure": 0, "gap": 2}[what]
    for parity in (0, 1):
        for axis, compiled, fluxes in (
            (1, case.c_x, case.twin_poiseuille),
            (0, case.c_y, lambda p, gap: case.twin_fluxes(p, gap)[1:]),
        ):
            step = 1j * STEP * (nodes[axis] % 2 == parity)
            moved = (case.p + step, case.gap + 0j) if what == "pressure" else (case.p + 0j, case.gap + step)
            twin = derivative(fluxes, *moved)[0]
            faces = nodes[axis][: twin.shape[0], : twin.shape[1]]
            # the node moved is the first of the face or the second
            found = np.where(faces % 2 == parity, compiled[..., own], compiled[..., own + 1])
            np.testing.assert_allclose(found, twin, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("what", ["pressure", "gap", "both"])
def test_jacobian_times_is_the_derivative_of_the_residual(case, what):
    dp, dh = case.dp * (what != "gap"), case.dh * (what != "pressure")
    twin = case.twin_times(dp, dh)
    assert np.abs(twin).max() > 1.0
    np.testing.assert_allclose(case.times(dp, dh), twin, rtol=1e-10, atol=1e-11 * np.abs(twin).max())


@pytest.mark.parametrize("line", [0, 1, -3, -2])
def test_line_jacobian_holds_the_columns_of_the_jacobian(case, line):
    line = line % case.shape[0]
    if line == 0 and not case.mirror:
        pytest.skip("an edge: P = 0")
    same_line = 0.2 * line_influence(case.grid.x, case.grid.cell_edges_x, case.grid.h_y / 0.3, 1)[0]
    n = case.shape[1] - 2
    matrix, approach = np.full((n, n), np.nan), np.full(n, np.nan)
    kernels.line_jacobian(line, case.grid.width_x, case.kappa_h, *case.parts, same_line, matrix, approach)
    for k in range(n):
        dp, dh = np.zeros(case.shape), np.zeros(case.shape)
        dp[line, k + 1], dh[line] = 1.0, same_line[:, k + 1]
        column = case.twin_times(dp, dh)[line, 1:-1]
        np.testing.assert_allclose(matrix[:, k], column, rtol=1e-10, atol=1e-11 * np.abs(matrix).max())
    everywhere = case.twin_times(np.zeros(case.shape), np.ones(case.shape))[line, 1:-1]
    np.testing.assert_allclose(approach, everywhere, rtol=1e-10, atol=1e-11 * np.abs(approach).max())


def test_log_mean_joins_its_series():
    # around the switch at 1e-3 the next term of the series is d^4/1920 of the mean, d^3/720 = 1e-12 of the weights
    for d in (0.999e-3, 1.001e-3, -0.999e-3, -1.001e-3):
        mean, w_left, w_right = kernels.log_mean(0.7, 0.7 + d)
        assert mean == pytest.approx(np.exp(0.7) * np.expm1(d) / d, rel=1e-13)
        assert w_right == pytest.approx(0.5 + d / 12.0, abs=1e-11)
        assert w_left + w_right == pytest.approx(1.0, abs=1e-15)
    for d in (-60.0, 60.0):
        mean, w_left, w_right = kernels.log_mean(0.0, d)
        assert mean == pytest.approx(np.expm1(d) / d, rel=1e-14)
        assert (w_right > 0.9) == (d > 0.0)
        assert w_left + w_right == pytest.approx(1.0, abs=1e-15)


def test_lifted_gap_is_smooth_positive_and_equals_a_positive_gap():
    assert kernels.lifted_gap(1.3 * FLOOR, FLOOR) == (1.3 * FLOOR, 1.0)
    gaps = FLOOR * np.linspace(-20.0, 2.0, 221)
    lifted, slope = np.array([kernels.lifted_gap(h, FLOOR) for h in gaps]).T
    assert np.all(lifted > 0.0)
    assert np.all(np.diff(lifted) > 0.0)
    eps = 1e-6 * FLOOR
    plus, minus = (np.array([kernels.lifted_gap(h + s * eps, FLOOR)[0] for h in gaps]) for s in (1.0, -1.0))
    np.testing.assert_allclose(slope, (plus - minus) / (2.0 * eps), rtol=1e-5, atol=1e-8)


def test_lifted_gap_stays_positive_however_deep_an_iterate_overlaps():
    lifted = [kernels.lifted_gap(-depth * FLOOR, FLOOR)[0] for depth in (1e2, 1e4, 1e6)]
    assert np.min(lifted) > 0.0


@pytest.mark.parametrize("mirror", [True, False])
def test_settled_edge_solves_the_complementarity_problem(mirror):
    rng = np.random.default_rng(5)
    ny, nx, kappa_h = 6, 9, 0.7
    width = 0.5 + rng.random(nx)
    c_x, c_y = np.zeros((ny, nx - 1, 4)), np.zeros((ny - 1, nx, 4))
    for c in (c_x, c_y):
        # conductances of a face differ a little between its sides, as with piezoviscous oil
        c[..., 0], c[..., 1] = -0.5 - rng.random(c.shape[:2]), 0.5 + rng.random(c.shape[:2])
    inner = np.zeros((ny, nx), dtype=bool)
    inner[0 if mirror else 1 : -1, 1:-1] = True
    low = inner & (rng.random((ny, nx)) < 0.8)
    p = np.where(inner, np.maximum(rng.random((ny, nx)) - 0.5, 0.0), 0.0)
    r = np.where(inner, rng.normal(size=(ny, nx)), 0.0)
    settled, left = p.copy(), r.copy()
    kernels.settle_edge(width, kappa_h, mirror, c_x, c_y, low, 2000, settled, left)

    unit, jacobian = np.zeros((ny, nx)), []
    for j, i in np.argwhere(low):
        unit[j, i] = 1.0
        flow_x = c_x[..., 0] * unit[:, :-1] + c_x[..., 1] * unit[:, 1:]
        flow_y = c_y[..., 0] * unit[:-1] + c_y[..., 1] * unit[1:]
        jacobian.append(twins.residual(width, kappa_h, mirror, flow_x, flow_y))
        unit[j, i] = 0.0
    matrix = np.array(jacobian)[:, low].T
    # primal-dual active set: finite for such matrices
    q, free = p[low], p[low] > 0.0
    for _ in range(50):
        q = np.zeros(free.size)
        start = r[low] - matrix @ p[low]
        q[free] = np.linalg.solve(matrix[np.ix_(free, free)], -start[free])
        inflow = start + matrix @ q
        changed = (q > 0.0) | (~free & (inflow > 1e-12))
        if (changed == free).all():
            break
        free = changed
    else:
        pytest.fail("the active set of the twin did not settle")
    assert settled[low] == pytest.approx(q, abs=1e-7)
    assert left[low] == pytest.approx(inflow, abs=1e-7)
    assert (settled[~low] == p[~low]).all()
    assert 0 < free.sum() < free.size
