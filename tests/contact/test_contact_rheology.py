"""Shear-thinning oils in the film: Couette flow in closed form, limits, and both wall equations with spin."""

import contact_twins as twins
import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film import oil

T_IN, N_Z = 303.15, 10
GAP = 2e-7
RHEOLOGIES = {
    "eyring": {"rheology": "eyring", "eyring_stress": 4e6},
    "carreau": {"rheology": "carreau", "carreau_modulus": 2e6, "carreau_exponent": 0.4},
    "limiting": {"rheology": "limiting_shear_stress", "limiting_stress_slope": 0.05},
}
#: the same with stresses that no film reaches
STIFF = {
    "eyring": {"rheology": "eyring", "eyring_stress": 1e9},
    "carreau": {"rheology": "carreau", "carreau_modulus": 1e10},
    "carreau, n = 1": {"rheology": "carreau", "carreau_exponent": 1.0},
    "limiting": {
        "rheology": "limiting_shear_stress",
        "limiting_stress_ambient": 1e9,
        "limiting_stress_slope": 0.5,
    },
}
WEIGHTS = film_flow.layer_weights(N_Z)
#: residual of the wall equations at which Newton may stop, in units of the sliding; ten times, for the viscosity
NEWTON = 1e-8


def column(update, p, eta, du, dv=0.0, p_x=0.0, p_y=0.0, h=GAP):
    """Stress at wall a and thinning of a column that starts as a Newtonian one."""
    table = oil.oil_table(OIL.model_copy(update=update), T_IN)
    thinning = np.ones(N_Z + 1)
    eta = np.broadcast_to(np.asarray(eta, dtype=float), (N_Z + 1,)).copy()
    stress = film_flow.wall_stress(table, p, h, p_x, p_y, du, dv, eta, WEIGHTS, thinning)
    return np.array(stress), thinning


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
@pytest.mark.parametrize("p", [0.0, 3e8, 1.2e9])
@pytest.mark.parametrize("newtonian", [1e3, 1e6, 1e7, 1e8, 1e9, 1e11])
def test_couette_flow_has_the_closed_stress(update, p, newtonian):
    """tau0 asinh(eta rate/tau0), eta rate (1 + (eta rate/G)^2)^((n-1)/2), tau_L (1 - exp(-eta rate/tau_L))."""
    eta, direction = 60.0, np.array([0.6, -0.8])
    slip = newtonian * GAP / eta
    tau, thinning = column(update, p, eta, *(slip * direction))
    closed = twins.shear_stress(OIL.model_copy(update=update), p, eta, slip / GAP)
    # close to the limiting stress the law is continued along its tangent
    np.testing.assert_allclose(
        tau, closed * direction, rtol=1e-3 if "limiting" in update["rheology"] else 1e-7
    )
    np.testing.assert_allclose(thinning, newtonian / closed, rtol=1e-3)


@pytest.mark.parametrize("p", [0.0, 2e8, 1e9])
@pytest.mark.parametrize("newtonian", [1e6, 1e8, 1e9, 1e11])
@pytest.mark.parametrize("gradient", [0.0, 3e12])
def test_stress_never_passes_the_limiting_stress(p, newtonian, gradient):
    oil_ = OIL.model_copy(update=RHEOLOGIES["limiting"])
    limit = max(oil_.limiting_stress_ambient, oil_.limiting_stress_slope * p)
    tau, _ = column(RHEOLOGIES["limiting"], p, 60.0, newtonian * GAP / 60.0, p_x=gradient)
    z = GAP * np.linspace(0.0, 1.0, N_Z + 1)
    assert np.abs(tau[0] + z * gradient).max() <= 1.001 * limit
    if newtonian > 100.0 * limit:
        assert np.abs(tau[0] + z * gradient).max() > 0.999 * limit


@pytest.mark.parametrize("update", STIFF.values(), ids=STIFF)
def test_large_parameters_give_the_newtonian_oil(update):
    eta = 60.0 * np.exp(-2.0 * np.linspace(0.0, 1.0, N_Z + 1))
    flow = {"p": 1e8, "eta": eta, "du": 3e-3, "dv": -1e-3, "p_x": 2e12, "p_y": -1e12}
    newtonian, _ = column({}, **flow)
    tau, thinning = column(update, **flow)
    # first term of the thinning: tau/(2 tau_L) for the limiting law, (tau/tau_0)^2/6 for the others
    np.testing.assert_allclose(tau, newtonian, rtol=5e-3)
    np.testing.assert_allclose(thinning, 1.0, atol=2e-3)
    softer, _ = column(RHEOLOGIES["eyring"], **flow)
    assert np.linalg.norm(softer) < np.linalg.norm(newtonian)


@pytest.mark.parametrize("update", [{}, *RHEOLOGIES.values()], ids=["newtonian", *RHEOLOGIES])
@pytest.mark.parametrize("seed", range(6))
def test_both_wall_equations_hold(update, seed):
    """int tau/e dz = u_b - u_a along and across, tau = tau_a + z grad p, from stresses far below and far above."""
    rng = np.random.default_rng(seed)
    p, eta = 10.0 ** rng.uniform(7.0, 9.2), 10.0 ** rng.uniform(-2.0, 5.0)
    eta = eta * np.exp(-rng.uniform(0.0, 4.0) * np.sin(np.pi * np.linspace(0.0, 1.0, N_Z + 1)))
    du, dv = rng.normal(size=2) * 10.0 ** rng.uniform(-2.0, 0.5)
    p_x, p_y = rng.normal(size=2) * min(p / 1e-4, 1e13)
    tau, thinning = column(update, p, eta, du, dv, p_x, p_y)
    z = np.linspace(0.0, 1.0, N_Z + 1)
    s_x, s_y = tau[0] + z * GAP * p_x, tau[1] + z * GAP * p_y
    for stress, slip in ((s_x, du), (s_y, dv)):
        moved = GAP * np.sum(WEIGHTS * thinning * stress / eta)
        assert abs(moved - slip) <= NEWTON * np.hypot(du, dv)
    # the thinning is that of the stress on every level
    if update and not np.hypot(s_x, s_y).max() > 0.999 * 0.05 * p:
        law = OIL.model_copy(update=update)
        for k in range(N_Z + 1):
            size = np.hypot(s_x[k], s_y[k])
            rate = twins.shear_rate(law, p, eta[k], size)
            assert thinning[k] == pytest.approx(eta[k] * rate / size, rel=1e-6)


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
def test_stress_does_not_depend_on_where_newton_starts(update):
    table = oil.oil_table(OIL.model_copy(update=update), T_IN)
    eta = 3e3 * np.exp(-2.0 * np.linspace(0.0, 1.0, N_Z + 1))
    found = []
    for start in (1.0, 30.0, 1e6):
        thinning = np.full(N_Z + 1, start)
        found.append(film_flow.wall_stress(table, 6e8, GAP, 1e12, -2e12, 0.8, 0.3, eta, WEIGHTS, thinning))
    np.testing.assert_allclose(found[1:], [found[0]] * 2, rtol=1e-6)


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
def test_pure_rolling_without_pressure_gradient_carries_no_stress(update):
    tau, thinning = column(update, 5e8, 60.0, 0.0)
    np.testing.assert_array_equal(tau, 0.0)
    np.testing.assert_array_equal(thinning, 1.0)


@pytest.mark.parametrize("update", [{}, *RHEOLOGIES.values()], ids=["newtonian", *RHEOLOGIES])
def test_film_sticks_to_both_walls_with_spin(update):
    """Mass flow of the wall nodes is that of the surfaces, along and across, on the first call."""
    n_y, n_x = 5, 7
    x, y = np.linspace(-1e-4, 1e-4, n_x), np.linspace(-4e-4, 4e-4, n_y)
    p = 1.1e9 * np.maximum(0.0, 1.0 - (x / 1.2e-4) ** 2 - (y[:, None] / 4e-4) ** 2)
    h, t = np.full((n_y, n_x), GAP), np.full((n_y, n_x, N_Z + 1), 330.0)
    u, spin = np.ones((n_y, n_x)), 70.0
    speeds = film_flow.SurfaceSpeeds(
        1.2 * u - spin * y[:, None], 0.9 * u + spin * y[:, None], spin * x * u, -spin * x * u
    )
    flow = film_flow.FilmFlow.empty(n_y, n_x, N_Z)
    flow.gradient_x[:], flow.gradient_y[:] = np.gradient(p, x, axis=1), np.gradient(p, y, axis=0)
    law = OIL.model_copy(update=update)
    film_flow.film_flow(oil.oil_table(law, T_IN), x, p, h, t, speeds, flow)
    rho_a, rho_b = (flow.m_x[0, 0, k] / (h[0, 0] * s[0, 0]) for k, s in ((0, speeds.u_a), (-1, speeds.u_b)))
    assert rho_a == pytest.approx(rho_b, rel=1e-6)
    np.testing.assert_allclose(flow.m_x[..., 0] * speeds.v_a, flow.m_y[..., 0] * speeds.u_a, atol=1e-12)
    density = flow.m_x[..., 0] / (h * speeds.u_a)
    largest = np.abs(speeds.u_a - speeds.u_b).max() + np.abs(speeds.v_a).max()
    # fourth-order running integral against the weights that set the stress: the same sum
    assert np.abs(flow.m_x[..., -1] / (density * h) - speeds.u_b).max() <= NEWTON * largest
    assert np.abs(flow.m_y[..., -1] / (density * h) - speeds.v_b).max() <= NEWTON * largest
    assert (flow.thinning.max() > 1.5) == bool(update)


# --- what the energy equation and the Newton step take from a thinned column -----------------------------------------


def sheared(update, u_b, gradient=3e12, across=20.0):
    """Flow in a row of columns that all slide by 1 - u_b under one gradient; hotter by `across` at surface b; SI."""
    x, ones = 1e-4 * np.arange(4), np.ones((1, 4))
    t = 305.0 + across * np.arange(N_Z + 1) / N_Z + np.zeros((1, 4, 1))
    flow = film_flow.FilmFlow.empty(1, 4, N_Z)
    flow.gradient_x[:] = gradient
    speeds = film_flow.SurfaceSpeeds(ones, u_b * ones, 0.0 * ones, 0.0 * ones)
    table = oil.oil_table(OIL.model_copy(update=update), T_IN)
    film_flow.film_flow(table, x, 6e8 * ones, GAP * ones, t, speeds, flow)
    return flow


@pytest.mark.parametrize("update", [{}, *RHEOLOGIES.values()], ids=["newtonian", *RHEOLOGIES])
@pytest.mark.parametrize("slide", [0.1, 0.5])
def test_fluidity_is_the_slope_of_the_sliding_over_the_stress(update, slide):
    """d(u_b - u_a)/d tau of a column that shears along x alone, at a given gradient, by differences."""
    eps = 1e-4 * slide
    at, ahead, behind = (sheared(update, 1.0 - slide + step) for step in (0.0, eps, -eps))
    slope = 2.0 * eps / (ahead.traction_x - behind.traction_x)
    assert np.abs(at.fluidity / slope - 1.0).max() <= 1e-5
    # a thinned oil gives way more than by its sliding over its stress
    secant = GAP * (at.thinning / np.exp(at.ln_eta)) @ WEIGHTS
    assert (at.fluidity.min() > 1.05 * secant.max()) == bool(update)


@pytest.mark.parametrize("update", [{}, *RHEOLOGIES.values()], ids=["newtonian", *RHEOLOGIES])
def test_pressure_flow_does_no_work_with_the_sliding(update):
    """The stress about which the gradient turns it is that of the sliding: their work is all the heat but the power."""
    flow = sheared(update, 0.9, gradient=2e13)
    assert np.abs(flow.stress_x / flow.traction_x - 1.0).max() > 1e-4  # not the stress in mid-film
    work = flow.stress_x * (0.9 - 1.0)
    np.testing.assert_allclose(flow.sliding @ WEIGHTS, work, rtol=NEWTON)
    np.testing.assert_array_equal(flow.shear, flow.sliding)


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
def test_rolling_film_is_thinned_by_its_pressure_gradient_alone(update):
    """Without slide no stress is left at the pivot, however much the gradient thins the walls: one viscosity."""
    flow = sheared(update, 1.0, gradient=1.5e14, across=0.0)
    assert flow.thinning.max() > 1.2
    largest = np.abs(flow.rate / GAP * np.exp(flow.ln_eta) / flow.thinning).max()
    assert largest > 1e6
    assert np.abs(flow.stress_x).max() <= 1e-6 * largest
    assert flow.driven.min() >= 0.0
    # the walls are sheared most, the pivot in mid-film not at all
    assert flow.driven[..., [0, -1]].min() > 0.0
    np.testing.assert_allclose(flow.driven[..., N_Z // 2], 0.0, atol=1e-6)
