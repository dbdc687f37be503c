"""The film across: closed forms of flow, stress and heat; the oil of the film."""

import math

import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl.contact import reference_oil
from ballscrew_tehl.contact.film import energy
from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film.transport import HeatTransport

T_A, GAP, U_A, U_B, P_X = 300.0, 2e-6, 1.3, 0.6, 3e11
E2 = math.exp(2.0)
#: eta = exp(-2 z/h), rho = 1: the integrals of the film in closed form, as printed in the model notes to 6 decimals
PRINTED = {"1/e0": 3.194528, "1/e1": 2.097264, "Poiseuille": 0.220373, "Couette": 0.343482}
CLOSED = {"1/e0": (E2 - 1.0) / 2.0, "1/e1": (E2 + 1.0) / 4.0}
CLOSED |= {
    "Poiseuille": (E2 - 3.0) / 4.0 * CLOSED["1/e1"] / CLOSED["1/e0"] - 0.5,
    "Couette": (E2 - 3.0) / 4.0 / CLOSED["1/e0"],
}


def exponential_oil():
    """ln eta = -2 (T - T_a)/100 K, any pressure, constant density."""
    constant = {"pressure_law": "barus", "density_law": "incompressible", "density_temperature": 0.0}
    table = film_flow.oil_table(OIL.model_copy(update=constant), T_A)
    t = table.table_start + film_flow.TABLE_STEP * np.arange(table.ln_eta0.size)
    return table._replace(ln_eta0=-0.02 * (t - T_A), alpha=0.0)


def exponential_film(n_z, u_a=U_A, u_b=U_B, gradient=P_X, power=0.0):
    """Flow of one column, phi, g and their slopes by temperature."""
    t = (T_A + np.linspace(0.0, 100.0, n_z + 1))[None, None]
    flow, one = film_flow.FilmFlow.empty(1, 1, n_z), np.ones((1, 1))
    flow.gradient_x[:], flow.power[:] = gradient, power
    speeds = film_flow.SurfaceSpeeds(u_a, u_b)
    film_flow.film_flow(exponential_oil(), np.zeros(1), 0.0 * one, GAP * one, t, speeds, flow)
    out = film_flow.film_coefficients(exponential_oil(), 1.0, 0.0 * one, t, speeds, 1.0, 1.0)
    return flow, math.exp(out[0][0, 0]), out[2][0, 0], out[4][0, 0]


def test_integrals_across_converge_with_fourth_order_to_the_printed_numbers():
    for name, value in PRINTED.items():
        assert CLOSED[name] == pytest.approx(value, abs=5e-7)
    sizes, errors = (32, 64, 128), []
    for n_z in sizes:
        flow, phi, g, _ = exponential_film(n_z)
        inv0, tau_a = flow.fluidity[0, 0] / GAP, flow.traction_x[0, 0] - 0.5 * GAP * P_X
        inv1 = ((U_B - U_A) / GAP - tau_a * inv0) / (GAP * P_X)
        found = inv0, inv1, phi / 12.0, (g - U_A) / (U_B - U_A)
        errors.append([abs(f - CLOSED[name]) for f, name in zip(found, PRINTED, strict=True)])
    orders = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    np.testing.assert_allclose(orders, 4.0, atol=0.2)
    # the default layers hold this strongly sheared film within a thousandth
    assert exponential_film(8)[1] / 12.0 == pytest.approx(CLOSED["Poiseuille"], rel=1e-3)


def test_stress_flux_and_heat_are_those_of_the_notes():
    """tau = e0 (u_b-u_a)/h + (z - c) h p_x, q = h (u_a + du Couette) - h^3 Poiseuille p_x; their work is the heat."""
    power = GAP**3 * CLOSED["Poiseuille"] * P_X**2
    flow, *_ = exponential_film(64, power=power)
    at, weights = (0, 0), film_flow.cumulative_matrix(64)[-1]
    c = CLOSED["1/e1"] / CLOSED["1/e0"]
    tau_a = (U_B - U_A) / GAP / CLOSED["1/e0"] - c * GAP * P_X
    assert flow.traction_x[at] == pytest.approx(tau_a + 0.5 * GAP * P_X, rel=1e-6)
    couette = GAP * (U_A + (U_B - U_A) * CLOSED["Couette"])
    flux = couette - GAP**3 * CLOSED["Poiseuille"] * P_X
    assert flow.m_x[at] @ weights == pytest.approx(OIL.density * flux, rel=1e-6)
    assert abs(flow.m_y[at]).max() == 0.0
    work = (tau_a + GAP * P_X) * U_B - tau_a * U_A - P_X * flux
    cells = np.full(65, 1.0 / 64)
    cells[[0, -1]] *= 0.5
    assert flow.driven[at] @ cells == pytest.approx(1.0, rel=1e-12)
    assert flow.sliding[at] @ weights + power == pytest.approx(work, rel=1e-6)
    np.testing.assert_allclose(flow.shear[at], flow.sliding[at] + flow.driven[at] * power, rtol=1e-12)


COOL, T_IN = reference_oil("barus"), 313.15  # one viscosity, one density


class Channel:
    """Film of one height between two plates; three lines across, the first a line of symmetry."""

    def __init__(self, length=1e-3, n_x=21, n_z=10, u_a=1.5, u_b=0.5, gradient=0.0, power=0.0):
        x = np.linspace(0.0, length, n_x)
        width = np.diff(np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]]))
        self.x, plate = x, np.ones((3, n_x))
        self.mesh = energy.EnergyMesh(x, width, 0.5 * length, COOL.thermal_conductivity, T_IN)
        self.h, self.heat = 1e-6 * plate, HeatTransport.empty(3, x, n_z)
        self.t = np.full((3, n_x, n_z + 1), T_IN)
        self.walls = energy.WallHeat(0.0 * plate, 0.0 * plate, np.zeros((3, n_x, 4)))
        self.flow = film_flow.FilmFlow.empty(3, n_x, n_z)
        self.flow.gradient_x[:], self.flow.power[:] = gradient, power
        speeds = film_flow.SurfaceSpeeds(u_a, u_b)
        film_flow.film_flow(
            film_flow.oil_table(COOL, T_IN), x, 0.0 * plate, self.h, self.t, speeds, self.flow
        )
        ends = np.ones(3, dtype=np.int64), np.full(3, n_x - 1, dtype=np.int64)
        self.face = energy.FaceFlow.empty(*ends, n_x, n_z)
        flux = np.full((3, n_x - 1), COOL.density * 0.5 * (u_a + u_b) * 1e-6)
        energy.face_flow(
            self.mesh, COOL.specific_heat, 0.0 * plate, flux, np.zeros((2, n_x)), self.flow, self.face
        )

    def sweep(self, forward=True, damped=False):
        energy.sweep(
            self.mesh, self.h, self.flow, self.face, self.t.copy(), damped, forward, True, self.t, self.heat,
            self.walls.response,
        )  # fmt: skip
        energy.wall_heat(self.mesh, self.h, self.flow, self.face, self.t, self.walls)


@pytest.mark.parametrize(("u_a", "u_b"), [(1.5, 0.5), (0.5, 1.5), (-0.5, -1.5)])
def test_sheared_film_warms_by_its_closed_form(u_a, u_b):
    """Rise tau |du| h/(8 k) in the middle far from the inlet, half the heat into each wall."""
    for n_z in (4, 10, 21):
        channel = Channel(n_z=n_z, u_a=u_a, u_b=u_b)
        for _ in range(8):  # a sweep moves a column by SWEEP_LIMIT at most
            channel.sweep(forward=u_a + u_b > 0.0)
        at = channel.x.size - 2 if u_a + u_b > 0.0 else 1
        heat = COOL.viscosity * (u_a - u_b) ** 2 / 1e-6
        z = np.linspace(0.0, 1.0, n_z + 1)
        closed = heat * 1e-6 / (2.0 * COOL.thermal_conductivity) * z * (1.0 - z)
        for line in (0, 1):
            # differences are exact for the parabola; the inlet has faded by exp(-100)
            np.testing.assert_allclose(channel.t[line, at] - T_IN, closed, atol=1e-9 * closed.max())
            assert channel.walls.q_a[line, at] == pytest.approx(0.5 * heat, rel=1e-9)
            assert channel.walls.q_b[line, at] == pytest.approx(0.5 * heat, rel=1e-9)
