"""Cross-film integrals and stresses against the closed forms of a film whose viscosity falls exponentially."""

import math

import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film.oil import TABLE_STEP, oil_table

T_A = 300.0
#: eta = exp(-2 z/h), rho = 1: the integrals in closed form; e2 = exp(2)
E2 = math.exp(2.0)
CLOSED = {
    "1/e0": (E2 - 1.0) / 2.0,
    "1/e1": (E2 + 1.0) / 4.0,
    "r0": 1.0,
    "r1": (E2 - 3.0) / 4.0,
    "r2": 0.5,
}
#: the same as printed in the model notes, section 5 of the worked checks, to 6 decimals
PRINTED = {"1/e0": 3.194528, "1/e1": 2.097264, "r1": 1.097264, "r2": 0.5}
PRINTED_COMBINED = {"Poiseuille": 0.220373, "Couette": 0.343482}  # r1 e0/e1 - r2, e0 r1


def exponential_oil(thermal_expansion=0.0):
    """ln eta = -2 (T - T_a)/100 K, any pressure."""
    oil = OIL.model_copy(
        update={
            "pressure_law": "barus",
            "density_law": "incompressible",
            "density_temperature": thermal_expansion,
            "reference_temperature": T_A,
        }
    )
    table = oil_table(oil, T_A)
    t = table.table_start + TABLE_STEP * np.arange(table.ln_eta0.size)
    return table._replace(ln_eta0=-0.02 * (t - T_A), alpha=0.0)


def levels(n_z):
    """Temperatures of n_z layers, linear through the film."""
    return T_A + np.linspace(0.0, 100.0, n_z + 1)


GAP, U_A, U_B, P_X = 2e-6, 1.3, 0.6, 3e11


def on_cells(n_z, heat):
    """Sum over the cells of the energy equation: trapezoidal, of second order."""
    return np.trapezoid(heat, dx=1.0 / n_z)


def one_column(*speeds):
    """Speeds u_a, u_b, v_a, v_b of a grid of one column."""
    return film_flow.SurfaceSpeeds(*(np.full((1, 1), u) for u in speeds))


def coefficients(oil, t, speeds):
    """exp(ln phi), g, g_y of one column without pressure, u_e = scale = 1, and by_t (3, n_z+1)."""
    out, by_t = tuple(np.full((1, 1), np.nan) for _ in range(6)), np.full((1, 1, 3, t.size), np.nan)
    ones = np.ones((1, 1, t.size))
    film_flow.film_coefficients(
        oil, 1.0, np.zeros((1, 1)), t[None, None], ones, -0.02 * (t - T_A)[None, None], ones, speeds, 1.0, 1.0,
        *out, by_t,
    )  # fmt: skip
    return np.exp(out[0][0, 0]), out[2][0, 0], out[4][0, 0], by_t[0, 0]


def integrals(n_z, thermal_expansion=0.0):
    """What the flow and the coefficients are made of, taken apart again.

    1/e0 from the fluidity and 1/e1 from the level about which the gradient turns the stress; r0 from two surfaces at
    one speed, r1 from surface b alone, r2 from the pressure flow.
    """
    oil, t = exponential_oil(thermal_expansion), levels(n_z)
    flow = film_flow.FilmFlow.empty(1, 1, n_z)
    flow.gradient_x[:] = P_X
    still, h = one_column(0.0, 0.0, 0.0, 0.0), np.full((1, 1), GAP)
    film_flow.film_flow(oil, np.zeros(1), np.zeros((1, 1)), h, t[None, None], still, flow)
    inv0 = flow.fluidity[0, 0] / GAP
    pivot = 0.5 + (flow.stress_x - flow.traction_x)[0, 0] / (GAP * P_X)
    phi, r0, couette, _ = coefficients(oil, t, one_column(1.0, 1.0, 0.0, 1.0))
    r1 = couette * inv0
    return dict(zip(CLOSED, (inv0, pivot * inv0, r0, r1, r1 * pivot - phi / 12.0), strict=True))


def combined(integrals):
    e0, e1 = 1.0 / integrals["1/e0"], 1.0 / integrals["1/e1"]
    return {"Poiseuille": integrals["r1"] * e0 / e1 - integrals["r2"], "Couette": integrals["r1"] * e0}


def test_closed_forms_equal_the_printed_numbers():
    for name, value in PRINTED.items():
        assert CLOSED[name] == pytest.approx(value, abs=5e-7), name
    for name, value in PRINTED_COMBINED.items():
        assert combined(CLOSED)[name] == pytest.approx(value, abs=5e-7), name


def test_layers_converge_to_the_printed_digits():
    found = integrals(64)
    for name, value in (PRINTED | PRINTED_COMBINED).items():
        assert (found | combined(found))[name] == pytest.approx(value, abs=5e-7), name


@pytest.mark.parametrize("name", ["1/e0", "1/e1", "r1", "r2", "Poiseuille", "Couette"])
def test_layers_converge_with_fourth_order(name):
    closed, sizes = CLOSED | combined(CLOSED), (32, 64, 128, 256)
    found = [integrals(n_z) for n_z in sizes]
    errors = [abs((f | combined(f))[name] - closed[name]) for f in found]
    order = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert order == pytest.approx(4.0, abs=0.15)


def test_default_layers_hold_the_flow_within_a_thousandth():
    """Error of 8 layers for this strongly sheared film."""
    found, exact = combined(integrals(8)), combined(CLOSED)
    for name, value in exact.items():
        assert found[name] == pytest.approx(value, rel=1e-3), name


def test_density_that_falls_through_the_film_is_integrated():
    """rho = 1 - b z, against quadrature on 20 000 layers by the trapezoidal rule."""
    found, z = integrals(64, 2e-3), np.linspace(0.0, 1.0, 20001)
    fluidity, rho = np.exp(2.0 * z), 1.0 - 0.2 * z
    inner = [
        np.concatenate(([0.0], np.cumsum(0.5 * (f[1:] + f[:-1])) * z[1])) for f in (fluidity, z * fluidity)
    ]
    assert found["r0"] == pytest.approx(0.9, rel=1e-12)
    assert found["r1"] == pytest.approx(np.trapezoid(rho * inner[0], z), rel=1e-6)
    assert found["r2"] == pytest.approx(np.trapezoid(rho * inner[1], z), rel=1e-6)


def test_warmer_layer_thins_the_film_as_in_closed_form():
    """d(r1 e0/e1 - r2) = 0.02 exp(2z) (z - c)^2 dz and d(e0 r1) = 0.02 exp(2z) (c - z) dz e0 per kelvin, c = e0/e1."""
    n_z, c = 64, CLOSED["1/e1"] / CLOSED["1/e0"]
    z, weights = np.linspace(0.0, 1.0, n_z + 1), film_flow.layer_weights(n_z)
    fluidity = 0.02 * np.exp(2.0 * z)
    speeds = one_column(U_A, U_B, 0.2, -0.1)
    _, _, _, by_t = coefficients(exponential_oil(), levels(n_z), speeds)
    by_poiseuille = weights * fluidity * (z - c) ** 2 / combined(CLOSED)["Poiseuille"]
    by_couette = weights * fluidity * (c - z) / CLOSED["1/e0"]
    closed = by_poiseuille, (U_B - U_A) * by_couette, (-0.1 - 0.2) * by_couette
    for found, expected in zip(by_t, closed, strict=True):
        # the integrals of the whole film are closed to 5e-7 on these layers
        assert np.abs(found - expected).max() <= 1e-6 * np.abs(expected).max()


def test_warmer_layer_of_a_rolling_film_takes_its_density_along():
    """Both surfaces at one speed: dg = -b w dT u, whatever the viscosity does; nothing without thermal expansion."""
    b, speeds = 2e-3, one_column(U_A, U_A, 0.2, 0.2)
    _, _, _, by_t = coefficients(exponential_oil(b), levels(8), speeds)
    weights = film_flow.layer_weights(8)
    np.testing.assert_allclose(by_t[1], -b * U_A * weights, rtol=1e-13)
    np.testing.assert_allclose(by_t[2], -b * 0.2 * weights, rtol=1e-13)
    _, _, _, by_t = coefficients(exponential_oil(), levels(8), speeds)
    np.testing.assert_array_equal(by_t[1:], 0.0)
    assert by_t[0].min() > 0.0


# --- stress and flow of the same film --------------------------------------------------------------------------------


def flow_of(n_z, t, speeds, power=0.0):
    """A film of pressure that rises evenly along x; viscosity exp(-2 (T - T_a)/100 K) Pa s."""
    x, ones = np.linspace(0.0, 4e-4, 5), np.ones((3, 5))
    flow = film_flow.FilmFlow.empty(3, 5, n_z)
    flow.gradient_x[:], flow.power[:] = P_X, power
    film_flow.film_flow(exponential_oil(), x, P_X * x * ones, GAP * ones, t, speeds, flow)
    return flow


def exponential_flow(n_z):
    """The same with a viscosity exp(-2 z/h) Pa s and the power of the pressure flow in closed form; a column."""
    ones = np.ones((3, 5))
    speeds = film_flow.SurfaceSpeeds(U_A * ones, U_B * ones, 0.2 * ones, -0.1 * ones)
    t = np.broadcast_to(levels(n_z), (3, 5, n_z + 1)).copy()
    return flow_of(n_z, t, speeds, GAP**3 * combined(CLOSED)["Poiseuille"] * P_X**2), (1, 2)


def test_stress_is_that_of_the_notes():
    """tau_xa = e0 (u_b-u_a)/h - h p_x e0/e1, tau_x = tau_xa + z p_x; across without a gradient."""
    flow, at = exponential_flow(64)
    e0, e1 = 1.0 / CLOSED["1/e0"], 1.0 / CLOSED["1/e1"]
    wall = e0 * (U_B - U_A) / GAP - GAP * P_X * e0 / e1
    assert flow.traction_x[at] == pytest.approx(wall + 0.5 * GAP * P_X, rel=1e-6)
    assert flow.traction_y[at] == pytest.approx(-0.3 * e0 / GAP, rel=1e-6)
    assert flow.fluidity[at] == pytest.approx(GAP * CLOSED["1/e0"], rel=1e-6)
    z = np.linspace(0.0, 1.0, 65)
    rate = (wall + z * GAP * P_X) * np.exp(2.0 * z)
    np.testing.assert_allclose(flow.rate[at], GAP * rate, atol=1e-6 * GAP * np.abs(rate).max())
    across = (0.3 * e0 / GAP) ** 2 * np.exp(2.0 * z)
    heat = GAP * (rate**2 * np.exp(-2.0 * z) + across)
    # the power of the pressure flow, spread so that the cells of the energy equation add up to it
    pressed = GAP * ((z - e0 / e1) * GAP * P_X) ** 2 * np.exp(2.0 * z)
    heat += (flow.power[at] / on_cells(64, pressed) - 1.0) * pressed
    np.testing.assert_allclose(flow.shear[at], heat, rtol=1e-5)


def test_heat_is_parted_at_the_stress_about_which_the_gradient_turns_it():
    """sliding = h (tau*^2 + 2 tau* x)/eta with tau* = e0 (u_b-u_a)/h, x = (z - c) h p_x, c = e0/e1.

    driven = (z - c)^2/eta over its sum on the cells of the energy equation.
    """
    flow, at = exponential_flow(64)
    e0, c = 1.0 / CLOSED["1/e0"], CLOSED["1/e1"] / CLOSED["1/e0"]
    slid_x, slid_y = e0 * (U_B - U_A) / GAP, -0.3 * e0 / GAP
    assert flow.stress_x[at] == pytest.approx(slid_x, rel=1e-6)
    assert flow.stress_y[at] == pytest.approx(slid_y, rel=1e-6)
    z = np.linspace(0.0, 1.0, 65)
    about, inv_e = z - c, np.exp(2.0 * z)
    sliding = GAP * inv_e * (slid_x**2 + 2.0 * slid_x * about * GAP * P_X + slid_y**2)
    np.testing.assert_allclose(flow.sliding[at], sliding, atol=2e-6 * np.abs(sliding).max())
    driven = about**2 * inv_e / on_cells(64, about**2 * inv_e)
    # of second order: a share 1e-3 of the integral on these layers
    assert on_cells(64, about**2 * inv_e) == pytest.approx(combined(CLOSED)["Poiseuille"], rel=2e-3)
    np.testing.assert_allclose(flow.driven[at], driven, atol=2e-6 * driven.max())
    assert (
        min(sliding.max(), (driven * flow.power[at]).max()) > 0.1 * flow.shear[at].max()
    )  # both parts matter


def test_power_of_the_pressure_flow_heats_whatever_its_gradient():
    """The fluxes of the faces give the power: half of it is half of the heat driven, the sliding is unchanged."""
    ones = np.ones((3, 5))
    speeds = film_flow.SurfaceSpeeds(U_A * ones, U_B * ones, 0.2 * ones, -0.1 * ones)
    t = np.broadcast_to(levels(8), (3, 5, 9)).copy()
    power = GAP**3 * combined(CLOSED)["Poiseuille"] * P_X**2
    none, half, full = (flow_of(8, t, speeds, share * power) for share in (0.0, 0.5, 1.0))
    np.testing.assert_array_equal(none.shear, none.sliding)
    np.testing.assert_array_equal(half.sliding, full.sliding)
    np.testing.assert_allclose(half.shear, 0.5 * (none.shear + full.shear), rtol=1e-12)
    np.testing.assert_allclose(on_cells(8, full.shear - none.shear), power, rtol=1e-12)


def test_flux_is_that_of_the_notes():
    """q = h [u_a r0 + (u_b-u_a) e0 r1] - h^3 (r1 e0/e1 - r2) p_x, and the work of the walls and pressure is heat."""
    flow, at = exponential_flow(64)
    weights, parts = film_flow.layer_weights(64), combined(CLOSED)
    couette = GAP * (U_A + (U_B - U_A) * parts["Couette"])
    poiseuille = -(GAP**3) * parts["Poiseuille"] * P_X
    assert abs(poiseuille) > 0.1 * couette  # both parts matter
    assert flow.m_x[at] @ weights == pytest.approx(OIL.density * (couette + poiseuille), rel=1e-6)
    assert flow.m_y[at] @ weights == pytest.approx(
        OIL.density * GAP * (0.2 - 0.3 * parts["Couette"]), rel=1e-6
    )
    # int tau . du = [tau u] - p_x int u
    tau_a = flow.traction_x[at] - 0.5 * GAP * P_X
    work = (tau_a + GAP * P_X) * U_B - tau_a * U_A - P_X * (couette + poiseuille)
    work += flow.traction_y[at] * (-0.1 - 0.2)
    assert flow.sliding[at] @ weights + on_cells(64, flow.driven[at]) * flow.power[at] == pytest.approx(
        work, rel=1e-6
    )


def test_uniform_film_has_the_closed_flux_on_any_layers():
    """Constant rho and eta: rho h (u_a+u_b)/2 - rho h^3 p_x/(12 eta)."""
    ones = np.ones((3, 5))
    speeds = film_flow.SurfaceSpeeds(U_A * ones, U_B * ones, 0.0 * ones, 0.0 * ones)
    closed = OIL.density * (0.5 * GAP * (U_A + U_B) - GAP**3 * P_X / 12.0)
    for n_z in (4, 5, 8):
        flow = flow_of(n_z, np.full((3, 5, n_z + 1), T_A), speeds)
        np.testing.assert_allclose(flow.m_x @ film_flow.layer_weights(n_z), closed, rtol=1e-12)
