"""Film energy equation on channels with a closed solution: plug film, decaying mode, moving sources."""

import numpy as np
import pytest
from contact_cases import CHI, STEEL

from ballscrew_tehl.contact import energy, film_flow
from ballscrew_tehl.contact.grid import uniform_grid
from ballscrew_tehl.contact.moes import reference_oil
from ballscrew_tehl.contact.walls import wall_operator

OIL = reference_oil("barus")  # one viscosity, one density
T_IN = 313.15
GAP = 1e-6
ROUNDING = 1e-9


class Channel:
    """Film of one height between two plates, three lines across, without pressure."""

    def __init__(self, length=1e-3, n_x=21, n_z=10, u_a=1.5, u_b=0.5):
        self.x, self.n_x, self.n_z = np.linspace(0.0, length, n_x), n_x, n_z
        self.y = np.linspace(0.0, length, 3)
        self.width = np.diff(np.concatenate([self.x[:1], 0.5 * (self.x[1:] + self.x[:-1]), self.x[-1:]]))
        self.h = np.full((3, n_x), GAP)
        self.t = np.full((3, n_x, n_z + 1), T_IN)
        self.q_a, self.q_b = np.zeros((3, n_x)), np.zeros((3, n_x))
        self.flow = energy.FilmFlow.empty(3, n_x, n_z)
        table = film_flow.oil_table(OIL, T_IN)
        energy.film_flow(table, self.x, self.y, np.zeros((3, n_x)), self.h, self.t, u_a, u_b, self.flow)

    def sweep(self, forward=True):
        h_y = self.y[1] - self.y[0]
        return energy.sweep(
            self.x, self.width, h_y, self.h, OIL.specific_heat, OIL.thermal_conductivity, self.flow, forward,
            self.t, self.q_a, self.q_b, np.zeros((3, self.n_x, 4)),
        )  # fmt: skip


def shear_stress(u_a, u_b):
    return OIL.viscosity * abs(u_a - u_b) / GAP


@pytest.mark.parametrize("n_z", [4, 10, 21])
@pytest.mark.parametrize(("u_a", "u_b"), [(1.5, 0.5), (0.5, 1.5), (2.0, 1.0), (-0.5, -1.5)])
def test_plug_film_warms_by_its_closed_form(n_z, u_a, u_b):
    """Sheared film between walls at T0, far from the inlet: rise tau |du| h/(8 k) in the middle, half the heat each."""
    channel = Channel(n_z=n_z, u_a=u_a, u_b=u_b)
    channel.sweep(forward=u_a + u_b > 0.0)
    column = channel.n_x - 2 if u_a + u_b > 0.0 else 1
    heat = shear_stress(u_a, u_b) * abs(u_a - u_b)
    z = np.linspace(0.0, 1.0, n_z + 1)
    # differences are exact for the parabola; the inlet has faded by exp(-100)
    closed = heat * GAP / (2.0 * OIL.thermal_conductivity) * z * (1.0 - z)
    for line in (0, 1):
        np.testing.assert_allclose(
            channel.t[line, column] - T_IN, closed, rtol=ROUNDING, atol=ROUNDING * closed.max()
        )
    if n_z % 2 == 0:
        middle = channel.t[0, column, n_z // 2] - T_IN
        assert middle == pytest.approx(heat * GAP / (8.0 * OIL.thermal_conductivity), rel=ROUNDING)
    assert channel.q_a[0, column] == pytest.approx(0.5 * heat, rel=ROUNDING)
    assert channel.q_b[0, column] == pytest.approx(0.5 * heat, rel=ROUNDING)
    np.testing.assert_allclose(
        channel.flow.traction, -shear_stress(u_a, u_b) * np.sign(u_a - u_b), rtol=ROUNDING
    )


def test_softening_does_not_move_the_fixed_point():
    """The linearised source slows the sweep down but vanishes once the temperature no longer changes."""
    channel, plain = Channel(), Channel()
    channel.flow.soft[:] = 0.05
    plain.sweep()
    changes = [channel.sweep() for _ in range(60)]
    assert not changes[-1] > 1e-9
    np.testing.assert_allclose(channel.t, plain.t, atol=1e-7)


def decaying_mode_error(n, n_z):
    """Largest error of T0 + sin(pi z/h) exp(-x/l), l = rho c u h^2/(pi^2 k), in a plug flow that cools down."""
    u, k = 1.0, OIL.thermal_conductivity
    length = OIL.density * OIL.specific_heat * u * GAP**2 / (np.pi**2 * k)
    channel = Channel(length=1.5 * length, n_x=n + 1, n_z=n_z, u_a=u, u_b=u)
    exact = np.sin(np.pi * np.linspace(0.0, 1.0, n_z + 1)) * np.exp(-channel.x / length)[:, None]
    channel.t[:, 0] += exact[0]
    # the border cells are held: exact values there, at the inlet and across
    channel.t[2] += exact
    channel.sweep()
    return np.abs(channel.t[0, 1:-1] - T_IN - exact[1:-1]).max()


def test_convection_and_conduction_are_of_second_order():
    sizes = np.array([8, 16, 32, 64])
    errors = [decaying_mode_error(n, n_z) for n, n_z in zip(sizes, (6, 12, 24, 48), strict=True)]
    order = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    # the first column is upwinded with first order: once per line, so that the rest keeps its order
    assert 1.8 < order < 2.4
    assert not errors[-1] > 1e-3


def test_walls_take_the_temperature_that_their_heat_gives_them():
    """Film and bodies in turn: a fixed point of sweep and update_walls satisfies T = T0 + K q."""
    n_y, n_x, n_z = 5, 25, 6
    grid = uniform_grid(-2.0, 2.0, 1.5, n_x, n_y)
    a, b, kappa = 2e-4, 1e-4, 0.5
    walls = tuple(wall_operator(grid, kappa, b, u, STEEL.thermal_conductivity, CHI) for u in (1.0, 0.5))
    flow = energy.FilmFlow.empty(n_y, n_x, n_z)
    flow.shear[:] = 5e7 * np.maximum(0.0, 1.0 - grid.x**2 - grid.y[:, None] ** 2)[..., None]
    flow.m_x[:] = OIL.density * 0.75 * GAP
    t = np.full((n_y, n_x, n_z + 1), T_IN)
    q_a, q_b, response = np.zeros((n_y, n_x)), np.zeros((n_y, n_x)), np.zeros((n_y, n_x, 4))
    for _ in range(12):
        energy.sweep(
            grid.x * b, grid.width_x * b, grid.h_y * a, np.full((n_y, n_x), GAP), OIL.specific_heat,
            OIL.thermal_conductivity, flow, True, t, q_a, q_b, response,
        )  # fmt: skip
        energy.update_walls(walls, t, q_a, q_b, response, T_IN)
    rise = t[:, :, [0, -1]] - T_IN
    assert rise.max() > 10.0
    # GMRES of every update is good to 1e-2; twelve of them leave rounding
    np.testing.assert_allclose(rise[..., 0], walls[0](q_a), atol=1e-6)
    np.testing.assert_allclose(rise[..., 1], walls[1](q_b), atol=1e-6)
    assert rise[0, n_x // 2, 1] > rise[0, n_x // 2, 0]  # the slower body runs hotter
    balance = energy.heat_balance(grid, a, b, OIL.specific_heat, flow, t, T_IN, q_a, q_b)
    assert abs(balance.defect) < 0.02
