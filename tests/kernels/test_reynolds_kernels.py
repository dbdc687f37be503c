"""Reynolds kernels: compiled against NumPy; Jacobian against differences of the residual and against its own parts."""

from functools import partial

import contact_twins as twins
import numpy as np
import pytest

from ballscrew_tehl.contact import kernels
from ballscrew_tehl.contact.elastic import line_influence
from ballscrew_tehl.contact.grid import graded_grid

GRID = graded_grid(-2.5, 1.5, 1.2, 14, 5, 0.1)
SHAPE = (GRID.y.size, GRID.x.size)
KAPPA_H = 0.3 / GRID.h_y
FLOOR = 0.05
#: off, and lifting about a third of the faces
FLOORS = {"gap as it is": 1e-9, "lifted gap": FLOOR}


def film_of(p):
    """A smooth piezoviscous, compressible film with exact derivatives: ln phi, d ln phi/dP, g, dg/dP."""
    return 2.0 - 9.0 * p + p**2, -9.0 + 2.0 * p, 1.0 + 0.3 * np.tanh(p), 0.3 / np.cosh(p) ** 2


def fields(seed=3):
    """Pressure with a cavitated (slightly negative) part and a gap that falls below FLOOR here and there."""
    rng = np.random.default_rng(seed)
    p = np.zeros(SHAPE)
    p[:-1, 1:-1] = rng.random((SHAPE[0] - 1, SHAPE[1] - 2)) - 0.1
    gap = 0.02 + 0.1 * rng.random(SHAPE) + 0.2 * np.maximum(0.0, GRID.x**2 - 1.0)
    penalty = np.where(p < 0.0, 30.0, 0.0)
    return p, gap, penalty


class Linearised:
    """Fluxes, residual and derivatives by the compiled kernels."""

    def __init__(self, p, gap, penalty, floor):
        self.gap, self.penalty = gap, penalty
        ln_phi, dln_phi, self.g, self.dg = film_of(p)
        ny, nx = p.shape
        self.flow_x, self.flow_y = np.empty((ny, nx - 1)), np.empty((ny - 1, nx))
        self.c_x, self.c_y, self.wedge = (
            np.empty((ny, nx - 1, 4)), np.empty((ny - 1, nx, 4)), np.empty((ny, nx - 1, 3))
        )  # fmt: skip
        kernels.face_fluxes(
            GRID.x, KAPPA_H, p, gap, ln_phi, dln_phi, self.g, self.dg, self.flow_x, self.flow_y,
            self.c_x, self.c_y, self.wedge, floor,
        )  # fmt: skip
        self.residual = np.full(p.shape, np.nan)
        kernels.residual(GRID.width_x, KAPPA_H, self.flow_x, self.flow_y, self.residual)
        self.residual[:-1, 1:-1] -= (penalty * p)[:-1, 1:-1]

    @property
    def parts(self):
        return (self.c_x, self.c_y, self.wedge, self.gap, self.g, self.dg, self.penalty)

    def times(self, dp, dh):
        out = np.full(SHAPE, np.nan)
        kernels.jacobian_times(GRID.width_x, KAPPA_H, *self.parts, dp, dh, out)
        return out


def change(seed=4):
    rng = np.random.default_rng(seed)
    dp = np.zeros(SHAPE)
    dp[:-1, 1:-1] = rng.normal(size=(SHAPE[0] - 1, SHAPE[1] - 2))
    return dp, rng.normal(size=SHAPE)


@pytest.mark.parametrize("floor", FLOORS.values(), ids=FLOORS)
def test_fluxes_and_residual_are_the_numpy_twin(floor):
    p, gap, penalty = fields()
    compiled = Linearised(p, gap, penalty, floor)
    ln_phi, dln_phi, g, _ = film_of(p)
    lifted = np.vectorize(partial(kernels.lifted_gap, floor=floor))
    flow_x, flow_y, c_x, c_y, wedge = twins.face_fluxes(GRID.x, KAPPA_H, p, gap, ln_phi, dln_phi, g, lifted)
    # rounding, and 1e-14 of the series that replaces the logarithmic mean of nearly equal values
    np.testing.assert_allclose(compiled.flow_x, flow_x, rtol=1e-11)
    np.testing.assert_allclose(compiled.flow_y, flow_y, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(compiled.c_x, c_x, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(compiled.c_y, c_y, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(compiled.wedge, wedge, atol=1e-13)
    residual = twins.residual(GRID.width_x, KAPPA_H, flow_x, flow_y)
    residual[:-1, 1:-1] -= (penalty * p)[:-1, 1:-1]
    np.testing.assert_allclose(compiled.residual, residual, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("floor", FLOORS.values(), ids=FLOORS)
def test_jacobian_times_is_the_numpy_twin(floor):
    linear = Linearised(*fields(), floor)
    dp, dh = change()
    twin = twins.jacobian_times(GRID.width_x, KAPPA_H, *linear.parts, dp, dh)
    np.testing.assert_allclose(linear.times(dp, dh), twin, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("floor", FLOORS.values(), ids=FLOORS)
@pytest.mark.parametrize("what", ["pressure", "gap", "both"])
def test_jacobian_is_the_derivative_of_the_residual(floor, what):
    p, gap, penalty = fields()
    dp, dh = change()
    dp, dh = dp * (what != "gap"), dh * (what != "pressure")
    eps = 1e-5
    plus, minus = (
        Linearised(p + s * eps * dp, gap + s * eps * dh, penalty, floor).residual for s in (1.0, -1.0)
    )
    analytic = Linearised(p, gap, penalty, floor).times(dp, dh)
    # central differences: eps^2 times a third derivative of some hundred
    difference = (plus - minus) / (2.0 * eps)
    assert not np.abs(difference - analytic).max() > 1e-6 * np.abs(analytic).max()


@pytest.mark.parametrize("floor", FLOORS.values(), ids=FLOORS)
@pytest.mark.parametrize("line", [0, 1, 3])
def test_line_jacobian_holds_the_columns_of_the_jacobian(floor, line):
    linear = Linearised(*fields(), floor)
    same_line = 0.2 * line_influence(GRID.x, GRID.cell_edges_x, GRID.h_y / 0.3, 1)[0]
    n = SHAPE[1] - 2
    matrix, approach = np.full((n, n), np.nan), np.full(n, np.nan)
    kernels.line_jacobian(line, GRID.width_x, KAPPA_H, *linear.parts, same_line, matrix, approach)
    for k in range(n):
        dp, dh = np.zeros(SHAPE), np.zeros(SHAPE)
        dp[line, k + 1], dh[line] = 1.0, same_line[:, k + 1]
        column = linear.times(dp, dh)[line, 1:-1]
        np.testing.assert_allclose(matrix[:, k], column, rtol=1e-11, atol=1e-11 * np.abs(matrix).max())
    everywhere = linear.times(np.zeros(SHAPE), np.ones(SHAPE))[line, 1:-1]
    np.testing.assert_allclose(approach, everywhere, rtol=1e-11, atol=1e-11 * np.abs(approach).max())


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


def test_lifted_gap_is_smooth_positive_and_leaves_a_film_alone():
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
    assert min(lifted) > 0.0
