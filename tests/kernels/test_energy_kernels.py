"""Energy kernels: compiled against NumPy, forward and back, with flow, heating and cooling of every sign."""

import contact_twins as twins
import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl import lubricant
from ballscrew_tehl.contact import energy, film_flow

T_IN = 303.15
NY, NX, NZ = 4, 8, 6
X = 1e-4 * np.cumsum(np.concatenate([[0.0], np.linspace(0.6, 1.4, NX - 1)]))
H_Y = 2e-4
Y = H_Y * np.arange(NY)
WIDTH = np.diff(np.concatenate([[X[0]], 0.5 * (X[1:] + X[:-1]), [X[-1]]]))
OILS = {
    "roelands": OIL,
    "barus": OIL.model_copy(update={"pressure_law": "barus"}),
    "incompressible": OIL.model_copy(update={"density_law": "incompressible", "density_temperature": 0.0}),
}


def random_film(seed=6):
    rng = np.random.default_rng(seed)
    p = 4e8 * rng.random((NY, NX))
    h = 1e-6 * (0.3 + rng.random((NY, NX)))
    return p, h, T_IN + 60.0 * rng.random((NY, NX, NZ + 1))


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
@pytest.mark.parametrize(("u_a", "u_b"), [(3.0, 1.0), (0.5, 2.0), (1.0, -0.4)])
def test_film_flow_is_the_numpy_twin(oil, u_a, u_b):
    p, h, t = random_film()
    flow = energy.FilmFlow.empty(NY, NX, NZ)
    energy.film_flow(film_flow.oil_table(oil, T_IN), X, Y, p, h, t, u_a, u_b, flow)
    pressure = np.repeat(p[..., None], NZ + 1, axis=2)
    eta, rho = lubricant.viscosity(oil, pressure, t), lubricant.density(oil, pressure, t)
    expansion = oil.density_temperature * oil.density / rho
    m_x, m_y, shear, compression, traction = twins.film_flow(X, Y, p, h, eta, rho, expansion, u_a, u_b)
    for name, twin in (("m_x", m_x), ("m_y", m_y), ("shear", shear), ("compression", compression)):
        # the interpolated viscosity table, 1e-5 of ln eta, enters differences of large terms
        assert not np.abs(getattr(flow, name) - twin).max() > 2e-4 * np.abs(twin).max(), name
    np.testing.assert_allclose(flow.traction, traction, atol=2e-4 * np.abs(traction).max())
    rates = np.log(lubricant.viscosity(oil, pressure, t - 0.5) / lubricant.viscosity(oil, pressure, t + 0.5))
    np.testing.assert_allclose(flow.soft, rates, rtol=5e-3)  # chord within 0.25 K
    # no slip at either wall, whatever the quadrature
    np.testing.assert_allclose(flow.m_x[..., 0], rho[..., 0] * h * u_a, rtol=1e-9)
    np.testing.assert_allclose(flow.m_x[..., -1], rho[..., -1] * h * u_b, rtol=1e-9)
    assert not np.abs(flow.m_y[..., [0, -1]]).max() > 1e-9 * np.abs(flow.m_y).max()


def random_flow(along, seed=7):
    """Mass flows, sources and softening; along: "forward", "backward" or "both" ways, with recirculation."""
    rng = np.random.default_rng(seed)
    flow = energy.FilmFlow.empty(NY, NX, NZ)
    m_x = {"forward": 1.0, "backward": -1.0, "both": 0.0}[along] + 0.6 * rng.normal(size=flow.m_x.shape)
    flow.m_x[:] = 1e-3 * m_x
    flow.m_y[:] = 3e-4 * rng.normal(size=flow.m_y.shape)
    flow.m_y[0] = 0.0
    flow.shear[:] = 1e7 * rng.random(flow.shear.shape)
    flow.compression[:] = 1e4 * rng.normal(size=flow.shear.shape)
    flow.soft[:] = 0.05 * rng.random(flow.shear.shape)
    return flow


def swept(flow, h, t, forward, heat=2000.0, conductivity=0.14):
    q_a, q_b, response = np.zeros((NY, NX)), np.zeros((NY, NX)), np.zeros((NY, NX, 4))
    t = t.copy()
    change = energy.sweep(X, WIDTH, H_Y, h, heat, conductivity, flow, forward, t, q_a, q_b, response)
    return t, q_a, q_b, change, response


@pytest.mark.parametrize("forward", [True, False], ids=["forward sweep", "backward sweep"])
@pytest.mark.parametrize("along", ["forward", "backward", "both"])
def test_sweep_is_the_numpy_twin(forward, along):
    _, h, t = random_film()
    flow = random_flow(along)
    compiled = swept(flow, h, t, forward)
    twin = twins.sweep(X, WIDTH, H_Y, h, 2000.0, 0.14, flow, forward, t)
    for value, expected, scale in zip(compiled, twin, (1.0, 1e5, 1e5, 1.0), strict=False):
        np.testing.assert_allclose(value, expected, rtol=1e-9, atol=1e-9 * scale)
    # walls and borders are held
    np.testing.assert_array_equal(compiled[0][..., [0, -1]], t[..., [0, -1]])
    np.testing.assert_array_equal(compiled[0][-1], t[-1])
    np.testing.assert_array_equal(compiled[0][:, [0, -1]], t[:, [0, -1]])


@pytest.mark.parametrize("i", [1, 4])
@pytest.mark.parametrize("j", [0, 2])
def test_response_is_the_change_of_flux_with_the_wall_temperatures(i, j):
    """One column only: in the others the wall change would reach it through its neighbours."""
    _, h, t = random_film()
    flow = random_flow("both")
    # a forward sweep visits (j, i) before any column that depends on it: earlier columns do not see its walls
    _, q_a, q_b, _, response = swept(flow, h, t, True)
    for wall, fluxes in (
        (0, (-response[j, i, 0], response[j, i, 2])),
        (-1, (response[j, i, 1], -response[j, i, 3])),
    ):
        warmer = t.copy()
        warmer[j, i, wall] += 1.0
        _, q_a_1, q_b_1, _, _ = swept(flow, h, warmer, True)
        # linear in the wall temperature: rounding only
        np.testing.assert_allclose((q_a_1 - q_a)[j, i], fluxes[0], rtol=1e-7)
        np.testing.assert_allclose((q_b_1 - q_b)[j, i], fluxes[1], rtol=1e-7)
