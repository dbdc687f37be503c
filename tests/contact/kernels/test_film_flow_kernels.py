"""Film coefficients and film flow: compiled against NumPy, derivatives against a complex step and differences."""

from types import SimpleNamespace

import contact_twins as twins
import film_flow_twins
import numpy as np
import pytest
from contact_cases import OIL, OILS

from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film import kernels
from ballscrew_tehl.contact.film.asperity import Asperities
from ballscrew_tehl.contact.film.oil import TABLE_STEP, oil_table
from ballscrew_tehl.contact.film.transport import HeatTransport, film_change
from ballscrew_tehl.contact.problem import WarmFilm
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
#: gap [m]
H = 2e-7


class Columns:
    """Every argument of the film coefficients random: thinning that follows the viscosity, slide and spin."""

    def __init__(self, oil, n_z=6, seed=5):
        rng = np.random.default_rng(seed)
        self.table, shape = oil_table(oil, T_IN), (3, 5)
        self.p = np.concatenate([np.zeros((3, 1)), 1.2 * rng.random((3, 4))], axis=1)
        self.t = between_kinks(self.table, T_IN + 90.0 * rng.random((*shape, n_z + 1)))
        self.thinning = 1.0 + 5.0 * rng.random(self.t.shape)
        everywhere = np.broadcast_to(self.p[..., None] * P_MAX, self.t.shape)
        self.ln_eta_at = twins.ln_viscosity(self.table, everywhere, self.t) + 0.5 * rng.normal(
            size=self.t.shape
        )
        self.share = rng.random(self.t.shape)
        self.speeds = film_flow.SurfaceSpeeds(
            *rng.normal(loc=[[[2.0]], [[1.0]], [[0.3]], [[-0.2]]], size=(4, *shape))
        )

    def roll(self):
        """Both surfaces at one speed, along and across."""
        self.speeds = self.speeds._replace(u_b=self.speeds.u_a, v_b=self.speeds.v_a)

    def thin(self):
        """Thinning as film_flow leaves it in these columns: a small gap, a gradient that turns the stress.

        Returns the shear rate on every level.
        """
        flow = film_flow.FilmFlow.empty(*self.p.shape, self.t.shape[2] - 1)
        flow.gradient_x[:], flow.gradient_y[:] = 4e13, -2e13
        x, h = 1e-4 * np.arange(self.p.shape[1]), np.full(self.p.shape, H)
        film_flow.film_flow(self.table, x, self.p * P_MAX, h, self.t, self.speeds, flow)
        self.thinning, self.ln_eta_at, self.share = flow.thinning, flow.ln_eta, flow.stress_share
        lever = H * (np.arange(self.t.shape[2]) / (self.t.shape[2] - 1) - 0.5)
        stress = np.hypot(
            flow.traction_x[..., None] + lever * flow.gradient_x[..., None],
            flow.traction_y[..., None] + lever * flow.gradient_y[..., None],
        )
        return stress * flow.thinning / np.exp(flow.ln_eta)

    def compiled(self):
        """ln phi, g, g_y, their derivatives to p, and by_t."""
        out = tuple(np.full(self.p.shape, np.nan) for _ in range(6))
        by_t = np.full((*self.p.shape, 3, self.t.shape[2]), np.nan)
        film_flow.film_coefficients(
            self.table, P_MAX, self.p, self.t, self.thinning, self.ln_eta_at, self.share, self.speeds, U_E, SCALE,
            *out, by_t,
        )  # fmt: skip
        return np.array(out[::2]), np.array(out[1::2]), by_t

    def twin(self, p, t):
        return np.array(
            film_flow_twins.thinned_coefficients(
                self.table, P_MAX, p, t, self.thinning, self.ln_eta_at, self.share, self.speeds, U_E, SCALE
            )
        )


def between_kinks(table, t):
    """Temperatures in the middle of their interval of the viscosity table, which has kinks every TABLE_STEP."""
    return table.table_start + TABLE_STEP * (np.floor((t - table.table_start) / TABLE_STEP) + 0.5)


def close(found, expected, share):
    """Within a share of the largest of each of the coefficients, the first index."""
    for name, a, b in zip(("ln phi", "g", "g_y"), found, expected, strict=True):
        assert np.abs(a - b).max() <= share * np.abs(b).max(), name


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
    np.testing.assert_allclose(film_flow.cumulative_matrix(n), twins.running_integral(n), atol=1e-14)
    film_flow.cumulative(4.0 * z**3 - 3.0 * z**2 + 1.0, 1.0 / n, out)
    np.testing.assert_allclose(out, z**4 - z**3 + z, atol=1e-14)


@pytest.mark.parametrize("oil", OILS.values(), ids=OILS)
@pytest.mark.parametrize("n_z", [4, 7])
def test_film_coefficients_and_their_slopes_are_the_numpy_twin(oil, n_z):
    columns = Columns(oil, n_z)
    values, slopes, by_t = columns.compiled()
    p, t = columns.p, columns.t
    close(values, columns.twin(p, t), 1e-12)
    twin = np.imag(columns.twin(p + 1j * STEP, t)) / STEP
    assert np.abs(twin).max(axis=(1, 2)).min() > 0.01
    close(slopes, twin, 1e-11)
    for k in range(n_z + 1):
        twin = np.imag(columns.twin(p, t + 1j * STEP * (np.arange(n_z + 1) == k))) / STEP
        close(np.moveaxis(by_t[..., k], 2, 0), twin, 1e-11)
    # per kelvin: the viscosity of every oil but one falls with the temperature
    assert (np.abs(by_t).max(axis=(0, 1)).min() > 1e-4) == (np.ptp(columns.table.ln_eta0) > 0.0)


def test_film_coefficients_against_differences_of_themselves():
    """The derivatives to the pressure used by Newton's method, at constant temperature."""
    columns, eps = Columns(OIL), 1e-6
    _, slopes, _ = columns.compiled()
    p = columns.p
    columns.p = p + eps
    ahead, _, _ = columns.compiled()
    columns.p = p - eps
    behind, _, _ = columns.compiled()
    close(slopes, (ahead - behind) / (2.0 * eps), 1e-8)


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
@pytest.mark.parametrize("rolling", [False, True], ids=["sliding", "rolling"])
def test_changes_with_the_temperature_of_a_layer_are_differences_of_the_coefficients(rolling, update):
    """by_t of each layer against a step of its temperature alone, within one interval of the viscosity table."""
    columns, eps = Columns(OIL.model_copy(update=update)), 0.01
    if rolling:
        columns.roll()
    columns.thin()
    assert (columns.share.min() < 0.7) == bool(update)
    _, _, by_t = columns.compiled()
    t = columns.t
    for k in range(t.shape[2]):
        step = eps * (np.arange(t.shape[2]) == k)
        columns.t = t + step
        ahead, _, _ = columns.compiled()
        columns.t = t - step
        behind, _, _ = columns.compiled()
        difference = (ahead - behind) / (2.0 * eps)
        # the step squared times the third derivative: (0.1/K * 0.01 K)^2 / 6
        close(np.moveaxis(by_t[..., k], 2, 0), difference, 1e-6)
        assert np.abs(difference).max(axis=(1, 2)).min() > 1e-6
    # without slide the flow of the surfaces changes with the density alone
    surface = -columns.speeds.u_a[..., None] * columns.table.beta_t * film_flow.layer_weights(t.shape[2] - 1)
    assert np.allclose(by_t[:, :, 1], surface / U_E, rtol=1e-12, atol=0.0) == rolling


@pytest.mark.parametrize("update", list(RHEOLOGIES.values())[1:], ids=list(RHEOLOGIES)[1:])
@pytest.mark.parametrize("rolling", [False, True], ids=["sliding", "rolling"])
def test_thinned_oil_changes_with_temperature_as_at_its_shear_rate(rolling, update):
    """by_t and the derivatives to the pressure against e = stress/rate of the closed law at the shear rate held."""
    oil = OIL.model_copy(update=update)
    # a limiting stress that the pressure raises is held, only the viscosity is followed: its lower bound holds here
    if "limiting" in update["rheology"]:
        oil = oil.model_copy(update={"limiting_stress_ambient": 6e7, "limiting_stress_slope": 0.02})
    columns = Columns(oil)
    if rolling:
        columns.roll()
    rate = columns.thin()

    def law(p, t):
        p = (p * P_MAX)[..., None] + 0.0 * t
        eta = np.exp(twins.ln_viscosity(columns.table, p, t))
        inv_e = rate / twins.shear_stress(oil, 0.0, eta, rate)
        return np.array(
            film_flow_twins.film_coefficients(columns.table, p, t, inv_e, columns.speeds, U_E, SCALE)
        )

    values, slopes, by_t = columns.compiled()
    # the stress of the compiled columns is converged to 1e-9 of the slide, the rate at a limit more steeply so
    close(values, law(columns.p, columns.t), 1e-7)
    close(slopes, np.imag(law(columns.p + 1j * STEP, columns.t)) / STEP, 1e-6)
    for k in range(columns.t.shape[2]):
        step = 1j * STEP * (np.arange(columns.t.shape[2]) == k)
        close(np.moveaxis(by_t[..., k], 2, 0), np.imag(law(columns.p, columns.t + step)) / STEP, 1e-6)


def test_temperatures_of_all_layers_together_change_the_film_as_the_sum():
    """What the pressure step makes of temperatures that follow: film_change of a random change, to first order."""
    columns = Columns(OIL)
    _, _, by_t = columns.compiled()
    t, dt = columns.t, np.random.default_rng(3).uniform(-0.1, 0.1, columns.t.shape)
    columns.t = t + dt
    ahead, _, _ = columns.compiled()
    columns.t = t - dt
    behind, _, _ = columns.compiled()
    change = np.full((3, *columns.p.shape), np.nan)
    for j in range(columns.p.shape[0]):
        film_change(by_t, dt, j, change[:, j])
    # the cube of soft * dt = 0.01
    close(change, 0.5 * (ahead - behind), 1e-4)


def test_temperatures_follow_a_pressure_change_within_bounds():
    """Columns that only their own pressure heats, by a rate of each layer [K/Pa]; the surfaces are held."""
    columns, limit = Columns(OIL), film_flow.FOLLOW_LIMIT
    ny, nx, levels = columns.t.shape
    heat = HeatTransport.empty(ny, 1e-4 * np.arange(nx), levels - 1)
    heat.pivot[:], heat.source[:] = 1.0, 2e-6 * np.random.default_rng(4).normal(size=heat.source.shape)
    scales = SimpleNamespace(hertz=SimpleNamespace(p_max=P_MAX), h_unit=1e-6)
    problem = SimpleNamespace(scales=scales, asperities=Asperities())
    film = WarmFilm(problem, columns.t.copy(), None, heat)
    (_, g, _), (_, dg, _), by_t = columns.compiled()
    d_p = np.full((ny, nx), 0.02)
    d_p[1] = -0.02
    film.follow(SimpleNamespace(g=g, dg=dg, by_t=by_t), d_p, np.zeros((ny, nx)))
    expected = np.zeros(columns.t.shape)
    expected[:, 1:-1, 1:-1] = heat.source[:, 1:-1] * (d_p * P_MAX)[:, 1:-1, None]
    assert expected.max() > limit > -limit > expected.min()
    assert (np.abs(expected[:, 1:-1, 1:-1]) < limit).any()
    np.testing.assert_allclose(film.temperature - columns.t, np.clip(expected, -limit, limit), atol=1e-10)


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
    """On any number of layers: the integrals of a uniform film are exact. A warmer film is the sum of its layers."""
    columns, t, eps = Columns(oil, n_z), between_kinks(oil_table(oil, T_IN), 321.1), 0.01
    columns.t[:], columns.thinning[:], columns.share[:] = t, 1.0, 1.0
    plain = isothermal(columns, columns.p, t)
    values, slopes, by_t = columns.compiled()
    np.testing.assert_allclose(values, plain[::2], rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(slopes, plain[1::2], rtol=1e-11, atol=1e-12)
    ahead, behind = (np.array(isothermal(columns, columns.p, t + step)[::2]) for step in (eps, -eps))
    difference = (ahead - behind) / (2.0 * eps)
    # rounding of ln phi = 20 in the difference, where one viscosity and density hold at any temperature
    np.testing.assert_allclose(np.moveaxis(by_t.sum(axis=3), 2, 0), difference, rtol=1e-7, atol=1e-11)


# --- flow -----------------------------------------------------------------------------------------------------------

NY, NX, NZ = 4, 6, 6
X = 1e-4 * np.cumsum(np.linspace(0.6, 1.4, NX))


def random_film(seed=6):
    """Pressure, gap, temperature, speeds with spin and a gradient that turns the stress by its own size.

    Viscosity and slide such that oils thin several times. The gradient is not that of the pressure: faces give it.
    """
    rng = np.random.default_rng(seed)
    p = 8e8 + 1e8 * rng.random((NY, NX))
    h = H * (0.3 + rng.random((NY, NX)))
    t = T_IN + 60.0 * rng.random((NY, NX, NZ + 1))
    base = np.array([1.6, 1.0, 0.2, -0.1])[:, None, None]
    speeds = film_flow.SurfaceSpeeds(*(base + 0.05 * rng.normal(size=(4, NY, NX))))
    return p, h, t, speeds, 2e13 * rng.normal(size=(NY, NX, 2))


def compiled_flow(table, p, h, t, speeds, gradient, power):
    flow = film_flow.FilmFlow.empty(*p.shape, t.shape[2] - 1)
    flow.gradient_x[:], flow.gradient_y[:], flow.power[:] = gradient[..., 0], gradient[..., 1], power
    film_flow.film_flow(table, X, p, h, t, speeds, flow)
    return flow


def column_coefficients(table, p, t, speeds, flow):
    """ln phi, g, g_y of the columns of a flow, in SI units."""
    out = tuple(np.full(p.shape, np.nan) for _ in range(6))
    film_flow.film_coefficients(
        table, 1.0, p, t, flow.thinning, flow.ln_eta, flow.stress_share, speeds, 1.0, 1.0, *out,
        np.empty((*p.shape, 3, t.shape[2])),
    )  # fmt: skip
    return out[::2]


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
def test_film_flow_is_the_numpy_twin(update):
    oil = OIL.model_copy(update=update)
    table = oil_table(oil, T_IN)
    p, h, t, speeds, gradient = random_film()
    power = 1e7 * np.random.default_rng(7).random(p.shape)
    twin = film_flow_twins.film_flow(oil, table, X, p, h, t, speeds, gradient, power)
    flow = compiled_flow(table, p, h, t, speeds, gradient, power)
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
    p, h, t, speeds, gradient = random_film(seed=8)
    power = 1e7 * np.random.default_rng(7).random(p.shape)
    flow = compiled_flow(table, p, h, t, speeds, gradient, power)
    twin = film_flow_twins.film_flow(oil, table, X, p, h, t, speeds, gradient, power)
    for name, expected in twin.items():
        assert np.abs(getattr(flow, name) - expected).max() <= 1e-9 * np.abs(expected).max(), name


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
def test_flow_of_the_film_is_the_flux_of_the_reynolds_equation(update):
    """int rho u dz = u_e g h - h^3 phi p_x/(12 scale) with the coefficients of the same column, along and across."""
    n_z, table = 40, oil_table(OIL.model_copy(update=update), T_IN)
    p, h, _, speeds, gradient = random_film(seed=9)
    t = T_IN + 40.0 * np.sin(np.pi * np.arange(n_z + 1) / n_z) + np.zeros((NY, NX, 1))
    flow = compiled_flow(table, p, h, t, speeds, gradient, 0.0)
    ln_phi, g, g_y = column_coefficients(table, p, t, speeds, flow)
    weights = film_flow.layer_weights(n_z)
    for mass, carried, slope in ((flow.m_x, g, gradient[..., 0]), (flow.m_y, g_y, gradient[..., 1])):
        flux = table.density * (carried * h - h**3 * np.exp(ln_phi) * slope / 12.0)
        # velocity first or viscosity first: two rules of fourth order for the same integral
        np.testing.assert_allclose(mass @ weights, flux, atol=1e-5 * np.abs(flux).max())


# --- dissipation ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
def test_heat_is_the_full_stress_dissipation_where_power_is_that_of_the_gradient(update):
    """sliding + driven * power = tau^2/e h with the power h^3 phi grad p^2/12 of the Reynolds equation.

    The driven part comes on the cells of the energy equation, which add it up by the trapezoidal rule: its shape is
    that of the dissipation, its sum over the cells the integral of it with the weights of the flow.
    Without thermal expansion: the density, with which the power is weighted, is the same on every level.
    """
    oil = OIL.model_copy(update={"density_temperature": 0.0} | update)
    table = oil_table(oil, T_IN)
    p, h, t, speeds, gradient = random_film(seed=10)
    # little slide: the stress of the pressure counts beside it without thinning, too
    slid = [a + 0.01 * (b - a) for a, b in ((speeds.u_a, speeds.u_b), (speeds.v_a, speeds.v_b))]
    speeds = speeds._replace(u_b=slid[0], v_b=slid[1])
    power_by_phi = 0.0
    for _ in range(2):  # phi needs the thinning of the flow, which the power does not change
        flow = compiled_flow(table, p, h, t, speeds, gradient, power_by_phi)
        ln_phi, _, _ = column_coefficients(table, p, t, speeds, flow)
        power_by_phi = h**3 * np.exp(ln_phi) / 12.0 * np.sum(gradient**2, axis=-1)
    full = film_flow_twins.dissipation(oil, table, p, h, t, speeds, gradient)
    pressed, weights = full - flow.sliding, film_flow.layer_weights(NZ)
    power = pressed @ weights
    relative = twins.density(table, p, t[..., 0])
    assert np.abs(relative * power - flow.power).max() <= 1e-8 * np.abs(full @ weights).max()
    on_cells = pressed * (power / (pressed @ film_flow_twins.cells(NZ)))[..., None]
    assert np.abs(flow.shear - flow.sliding - on_cells).max() <= 1e-8 * full.max()
    assert (flow.thinning.max() > 1.05) == bool(update)
    # each of the parts matters, in some columns the one, in others the other
    by_sliding = (flow.sliding @ weights) / (full @ weights)
    assert by_sliding.min() < 0.1
    assert by_sliding.max() > 0.8


@pytest.mark.parametrize("update", RHEOLOGIES.values(), ids=RHEOLOGIES)
def test_heat_of_sliding_is_the_work_of_the_surfaces_and_of_the_pressure_its_power(update):
    """Across the film: int sliding = stress * slip with the stress about which the pressure turns it, sum driven = 1.

    The sum of driven is that over the cells of the energy equation.
    With thermal expansion, so that the power comes with the mean relative density, which is taken off again.
    """
    table = oil_table(OIL.model_copy(update=update), T_IN)
    p, h, t, speeds, gradient = random_film(seed=11)
    flow = compiled_flow(table, p, h, t, speeds, gradient, 1e7)
    weights = film_flow.layer_weights(NZ)
    work = flow.stress_x * (speeds.u_b - speeds.u_a) + flow.stress_y * (speeds.v_b - speeds.v_a)
    assert np.abs(flow.sliding @ weights - work).max() <= 1e-8 * np.abs(work).max()
    relative = twins.density(table, np.broadcast_to(p[..., None], t.shape), t) @ weights
    np.testing.assert_allclose(relative * (flow.driven @ film_flow_twins.cells(NZ)), 1.0, rtol=1e-12)
    assert np.abs(relative - 1.0).max() > 0.02
    assert flow.driven.min() >= 0.0


def test_heat_from_the_fluxes_of_the_faces_is_the_full_stress_dissipation():
    """Faces, pressure flow and film flow in turn: a linear pressure in a gap and an oil that are the same everywhere.

    There the gradient of the faces, their continuity and the differences of the pressure agree, along and across.
    """
    oil = OIL.model_copy(
        update={"pressure_law": "barus", "density_law": "incompressible", "density_temperature": 0.0}
    )
    table = oil_table(oil, T_IN)._replace(alpha=0.0)
    slope, shape = np.array([8e12, -5e12]), (NY, NX)
    h_y = 5e-5
    p = 1e9 + slope[0] * X + slope[1] * h_y * np.arange(NY)[:, None]
    assert p.min() > 0.0
    h, ones = np.full(shape, H), np.ones(shape)
    t = np.broadcast_to(T_IN + 30.0 * np.linspace(0.0, 1.0, NZ + 1) ** 2, (*shape, NZ + 1)).copy()
    speeds = film_flow.SurfaceSpeeds(1.6 * ones, 0.4 * ones, 0.2 * ones, -0.3 * ones)
    flow = film_flow.FilmFlow.empty(NY, NX, NZ)
    film_flow.film_flow(table, X, p, h, t, speeds, flow)  # for the viscosity
    ln_phi, g, g_y = column_coefficients(table, p, t, speeds, flow)
    # conductance of a face: h^3 phi/12 per length; the fluxes across come per unit of h_y
    ln_phi = ln_phi - np.log(12.0)
    width = np.gradient(X)
    flow_x, flow_y = np.empty((NY, NX - 1)), np.empty((NY - 1, NX))
    c_x, c_y, wedge = np.empty((NY, NX - 1, 4)), np.empty((NY - 1, NX, 5)), np.empty((NY, NX - 1, 3))
    kappa_h, floor, zeros = 1.0 / h_y, 1e-9, np.zeros(shape)
    kernels.face_fluxes(
        X, kappa_h, False, False, p, h, ln_phi, g, g_y, flow_x, flow_y, c_x, c_y, wedge, floor
    )
    kernels.pressure_flow(
        X, width, h_y, kappa_h, False, p, h, ln_phi, zeros, g, flow_x, flow_y, c_x, c_y, wedge,
        np.zeros((NX, NX)), floor, flow.gradient_x, flow.gradient_y, flow.power, np.empty((*shape, 2)),
        np.empty((*shape, 4)),
    )  # fmt: skip
    film_flow.film_flow(table, X, p, h, t, speeds, flow)
    gradient = np.broadcast_to(slope, (*shape, 2))
    full = film_flow_twins.dissipation(oil, table, p, h, t, speeds, gradient)
    inner = np.s_[1:-1, 2:-1]  # the first face along x takes its wedge flux upwind
    np.testing.assert_allclose(flow.gradient_x[inner], slope[0], rtol=1e-9)
    np.testing.assert_allclose(flow.gradient_y[inner], slope[1], rtol=1e-9)
    pressed, pressure = full - flow.sliding, flow.driven * flow.power[..., None]
    power = (pressed @ film_flow.layer_weights(NZ))[inner]
    np.testing.assert_allclose(flow.power[inner], power, rtol=1e-8)
    on_cells = pressed[inner] * (power / (pressed @ film_flow_twins.cells(NZ))[inner])[..., None]
    np.testing.assert_allclose(pressure[inner], on_cells, atol=1e-8 * full.max())
    # each of the parts matters
    assert min(pressure[inner].max(), flow.sliding[inner].max()) > 0.05 * full.max()
