"""Film coefficients and film flow: compiled against NumPy, derivatives against a complex step of the twin."""

import contact_twins as twins
import numpy as np
import pytest
from contact_cases import OIL, OILS

from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film.oil import oil_table
from ballscrew_tehl.physics import lubricant

T_IN = 303.15
P_MAX, U_E, SCALE = 1.1e9, 1.7, 0.7
RHEOLOGIES = {
    "newtonian": {},
    "eyring": {"rheology": "eyring", "eyring_stress": 2e6},
    "carreau": {"rheology": "carreau", "carreau_modulus": 1e6, "carreau_exponent": 0.4},
    "limiting": {"rheology": "limiting_shear_stress", "limiting_stress_slope": 0.05},
}
STEP = 1e-30
#: interpolation of ln eta0 in steps of 0.25 K (1e-5 of eta0), enlarged by the pressure term of Roelands
TABLE = 1e-4


class Columns:
    """Every argument of the film coefficients random: heat that follows the pressure, thinning, slide and spin."""

    def __init__(self, oil, n_z=6, seed=5):
        rng = np.random.default_rng(seed)
        self.table, shape = oil_table(oil, T_IN), (3, 5)
        self.p = np.concatenate([np.zeros((3, 1)), 1.2 * rng.random((3, 4))], axis=1)
        self.p_at = self.p + 0.02 * rng.normal(size=shape)
        self.t = T_IN + 90.0 * rng.random((*shape, n_z + 1))
        self.t_p = 2e-7 * rng.normal(size=self.t.shape)
        self.thinning = 1.0 + 5.0 * rng.random(self.t.shape)
        everywhere = np.broadcast_to(self.p[..., None] * P_MAX, self.t.shape)
        self.ln_eta_at = twins.ln_viscosity(self.table, everywhere, self.t) + 0.5 * rng.normal(
            size=self.t.shape
        )
        self.share = rng.random(self.t.shape)
        self.speeds = film_flow.SurfaceSpeeds(
            *rng.normal(loc=[[[2.0]], [[1.0]], [[0.3]], [[-0.2]]], size=(4, *shape))
        )

    def compiled(self):
        out = tuple(np.full(self.p.shape, np.nan) for _ in range(6))
        film_flow.film_coefficients(
            self.table, P_MAX, self.p, self.p_at, self.t, self.t_p, self.thinning, self.ln_eta_at, self.share,
            self.speeds, U_E, SCALE, *out,
        )  # fmt: skip
        return out

    def twin(self, p):
        return twins.film_coefficients(
            self.table, P_MAX, p, self.p_at, self.t, self.t_p, self.thinning, self.ln_eta_at, self.share,
            self.speeds, U_E, SCALE,
        )  # fmt: skip


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
def test_oil_of_the_twins_is_that_of_the_lubricant_module(oil):
    columns, n = Columns(oil), 7
    p = np.repeat(columns.p[..., None], n, axis=2) * P_MAX
    ln_eta = twins.ln_viscosity(columns.table, p, columns.t)
    np.testing.assert_allclose(ln_eta, np.log(lubricant.viscosity(oil, p, columns.t)), atol=TABLE)
    rho = twins.density(columns.table, p, columns.t)
    np.testing.assert_allclose(rho, lubricant.density(oil, p, columns.t) / oil.density, rtol=1e-12)


@pytest.mark.parametrize("n", [4, 5, 10])
def test_running_integral_is_the_numpy_twin_and_exact_for_a_cubic(n):
    f, z = np.random.default_rng(1).normal(size=n + 1), np.arange(n + 1) / n
    out = np.full(n + 1, np.nan)
    film_flow.cumulative(f, 0.3 / n, out)
    np.testing.assert_allclose(out, 0.3 * twins.running_integral(n) @ f, atol=1e-13)
    np.testing.assert_allclose(film_flow.layer_weights(n), twins.running_integral(n)[-1], atol=1e-14)
    film_flow.cumulative(4.0 * z**3 - 3.0 * z**2 + 1.0, 1.0 / n, out)
    np.testing.assert_allclose(out, z**4 - z**3 + z, atol=1e-14)


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
@pytest.mark.parametrize("n_z", [4, 7])
def test_column_integrals_and_their_slopes_are_the_numpy_twin(oil, n_z):
    c = Columns(oil, n_z)
    weights, work = film_flow.layer_weights(n_z), np.full((4, n_z + 1), np.nan)
    for j, i in np.ndindex(c.p.shape):
        p, t, t_p = c.p[j, i] * P_MAX, c.t[j, i], c.t_p[j, i]
        thinned = c.thinning[j, i], c.ln_eta_at[j, i], c.share[j, i]
        found = film_flow.column_integrals(c.table, p, t, t_p, *thinned, weights, *work)

        def twin(step, p=p, t=t, t_p=t_p, thinned=thinned):
            p, t = p + step + 0.0 * t, t + step * t_p
            inv_e = twins.fluidity(c.table, p, t, *thinned)
            return np.array(twins.column_integrals(inv_e, twins.density(c.table, p, t)))

        np.testing.assert_allclose(found[:5], twin(0.0), rtol=1e-12)
        slopes = np.imag(twin(1j * STEP)) / STEP
        np.testing.assert_allclose(found[5:], slopes, rtol=1e-10, atol=1e-24)
        assert np.abs(slopes[[0, 1, 3, 4]]).min() > 0.0  # 1/Pa: each of them matters


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
def test_film_coefficients_and_their_slopes_are_the_numpy_twin(oil):
    columns = Columns(oil)
    ln_phi, dln_phi, g, dg, g_y, dg_y = columns.compiled()
    for found, twin in zip((ln_phi, g, g_y), columns.twin(columns.p), strict=True):
        np.testing.assert_allclose(found, twin, rtol=1e-11, atol=1e-12)
    for found, twin in zip((dln_phi, dg, dg_y), columns.twin(columns.p + 1j * STEP), strict=True):
        assert np.abs(np.imag(twin)).max() > 0.01 * STEP
        np.testing.assert_allclose(found, np.imag(twin) / STEP, rtol=1e-9, atol=1e-11)


def test_film_coefficients_against_differences_of_themselves():
    """The derivatives used by Newton's method, over a pressure change that temperatures follow."""
    columns, eps = Columns(OIL), 1e-6
    at = columns.compiled()
    p = columns.p
    columns.p = p + eps
    ahead = columns.compiled()
    columns.p = p - eps
    behind = columns.compiled()
    for k in (0, 2, 4):
        difference = (ahead[k] - behind[k]) / (2.0 * eps)
        # the table has kinks every 0.25 K: temperatures move 2e-4 K
        np.testing.assert_allclose(at[k + 1], difference, rtol=1e-5, atol=1e-6)


def test_temperatures_follow_a_pressure_change_within_bounds():
    columns = Columns(OIL)
    columns.t_p *= 10.0
    columns.p_at = columns.p - 0.05
    columns.p_at[1] += 0.1
    follow = columns.t_p * (columns.p - columns.p_at)[..., None] * P_MAX
    assert follow.max() > film_flow.FOLLOW_LIMIT > -film_flow.FOLLOW_LIMIT > follow.min()
    ln_phi, _, g, _, g_y, _ = columns.compiled()
    for found, twin in zip((ln_phi, g, g_y), columns.twin(columns.p), strict=True):
        np.testing.assert_allclose(found, twin, rtol=1e-11, atol=1e-12)


def isothermal(columns, p, t):
    out = tuple(np.full(p.shape, np.nan) for _ in range(6))
    film_flow.isothermal_coefficients(columns.table, P_MAX, p, t, columns.speeds, U_E, SCALE, *out)
    return out


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
def test_isothermal_coefficients_are_the_oil_laws(oil):
    columns, t = Columns(oil), 321.1

    def law(p):
        rho = twins.density(columns.table, p * P_MAX, t + 0.0 * p)
        ln_eta = twins.ln_viscosity(columns.table, p * P_MAX, t + 0.0 * p)
        u_a, u_b, v_a, v_b = columns.speeds
        return np.log(SCALE * rho) - ln_eta, rho * (u_a + u_b) / (2.0 * U_E), rho * (v_a + v_b) / (2.0 * U_E)

    found = isothermal(columns, columns.p, t)
    for value, twin in zip(found[::2], law(columns.p), strict=True):
        np.testing.assert_allclose(value, twin, rtol=1e-12, atol=1e-13)
    for value, twin in zip(found[1::2], law(columns.p + 1j * STEP), strict=True):
        np.testing.assert_allclose(value, np.imag(twin) / STEP, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
@pytest.mark.parametrize("n_z", [4, 9])
def test_generalised_coefficients_of_one_temperature_are_the_isothermal_ones(oil, n_z):
    """On any number of layers: the integrals of a uniform film are exact."""
    columns = Columns(oil, n_z)
    columns.t[:], columns.t_p[:], columns.thinning[:], columns.share[:] = 321.1, 0.0, 1.0, 1.0
    for general, plain in zip(columns.compiled(), isothermal(columns, columns.p, 321.1), strict=True):
        np.testing.assert_allclose(general, plain, rtol=1e-11, atol=1e-12)


# --- flow -----------------------------------------------------------------------------------------------------------

NY, NX, NZ = 4, 6, 6
X = 1e-4 * np.cumsum(np.linspace(0.6, 1.4, NX))
Y = 2e-4 * np.arange(NY)
H = 2e-7


def random_film(seed=6):
    """Pressure, gap, temperature and speeds with spin; viscosity and slide such that oils thin several times."""
    rng = np.random.default_rng(seed)
    p = 8e8 + 1e8 * rng.random((NY, NX))
    h = H * (0.3 + rng.random((NY, NX)))
    t = T_IN + 60.0 * rng.random((NY, NX, NZ + 1))
    base = np.array([1.6, 1.0, 0.2, -0.1])[:, None, None]
    return p, h, t, film_flow.SurfaceSpeeds(*(base + 0.05 * rng.normal(size=(4, NY, NX))))


@pytest.mark.parametrize("mirror", [True, False], ids=["mirror", "whole plane"])
@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
def test_film_flow_is_the_numpy_twin(update, mirror):
    oil = OIL.model_copy(update=update)
    table = oil_table(oil, T_IN)
    p, h, t, speeds = random_film()
    twin = twins.film_flow(oil, table, X, Y, p, h, t, speeds)
    flow = film_flow.FilmFlow.empty(NY, NX, NZ)
    film_flow.film_flow(table, X, Y, mirror, p, h, t, speeds, flow)
    assert set(twin) == set(flow._fields)
    assert (twin["thinning"].max() > 1.3) == bool(update)
    # Newton's method of the wall equations stops at 1e-9 of the sliding; small values are differences of large ones
    for name, expected in twin.items():
        found = getattr(flow, name)
        assert np.abs(found - expected).max() <= 1e-8 * np.abs(expected).max(), name
        assert np.abs(expected).max() > 0.0, name


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
def test_film_flow_of_every_oil_is_the_numpy_twin(oil):
    table = oil_table(oil, T_IN)
    p, h, t, speeds = random_film(seed=8)
    flow = film_flow.FilmFlow.empty(NY, NX, NZ)
    film_flow.film_flow(table, X, Y, True, p, h, t, speeds, flow)
    for name, expected in twins.film_flow(oil, table, X, Y, p, h, t, speeds).items():
        assert np.abs(getattr(flow, name) - expected).max() <= 1e-9 * np.abs(expected).max(), name


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
def test_flow_of_the_film_is_the_flux_of_the_reynolds_equation(update):
    """int rho u dz = u_e g h - h^3 phi p_x/(12 scale) with the coefficients of the same column, along and across."""
    n_z, table = 40, oil_table(OIL.model_copy(update=update), T_IN)
    p, h, _, speeds = random_film(seed=9)
    t = T_IN + 40.0 * np.sin(np.pi * np.arange(n_z + 1) / n_z) + np.zeros((NY, NX, 1))
    flow = film_flow.FilmFlow.empty(NY, NX, n_z)
    film_flow.film_flow(table, X, Y, False, p, h, t, speeds, flow)
    out = tuple(np.full(p.shape, np.nan) for _ in range(6))
    film_flow.film_coefficients(
        table, 1.0, p, p, t, 0.0 * t, flow.thinning, flow.ln_eta, flow.stress_share, speeds, 1.0, 1.0, *out
    )
    weights = film_flow.layer_weights(n_z)
    along, across = np.gradient(p, X, axis=1), np.gradient(p, Y, axis=0)
    across[[0, -1]] = 0.0
    for mass, g, slope in ((flow.m_x, out[2], along), (flow.m_y, out[4], across)):
        flux = table.density * (g * h - h**3 * np.exp(out[0]) * slope / 12.0)
        # velocity first or viscosity first: two rules of fourth order for the same integral
        np.testing.assert_allclose(mass @ weights, flux, atol=1e-5 * np.abs(flux).max())
