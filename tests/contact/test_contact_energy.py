"""Film energy equation on channels with a closed solution, and its balances of mass and heat."""

import numpy as np
import pytest
from contact_cases import CHI, STEEL
from contact_cases import OIL as REAL_OIL
from scipy.integrate import solve_bvp

from ballscrew_tehl.contact.film import energy, oil
from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film.transport import HeatTransport
from ballscrew_tehl.contact.half_space.grid import uniform_grid
from ballscrew_tehl.contact.half_space.walls import wall_operator
from ballscrew_tehl.contact.moes import reference_oil
from ballscrew_tehl.physics import lubricant

OIL = reference_oil("barus")  # one viscosity, one density
T_IN = 313.15
GAP = 1e-6
ROUNDING = 1e-9


def cell_widths(x):
    return np.diff(np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]]))


class Channel:
    """Film of one height between two plates without pressure; three lines across, the first a line of symmetry."""

    def __init__(self, length=1e-3, n_x=21, n_z=10, u_a=1.5, u_b=0.5, gradient=0.0, power=0.0):
        self.x, self.n_x, self.n_z = np.linspace(0.0, length, n_x), n_x, n_z
        self.y = np.linspace(0.0, length, 3)
        self.h_y, self.width = self.y[1], cell_widths(self.x)
        self.h, self.heat = np.full((3, n_x), GAP), HeatTransport.empty(3, self.x, n_z)
        self.t = np.full((3, n_x, n_z + 1), T_IN)
        self.q_a, self.q_b = np.zeros((3, n_x)), np.zeros((3, n_x))
        self.flow = film_flow.FilmFlow.empty(3, n_x, n_z)
        self.flow.gradient_x[:], self.flow.power[:] = gradient, power
        plate = np.ones((3, n_x))
        speeds = film_flow.SurfaceSpeeds(u_a * plate, u_b * plate, 0.0 * plate, 0.0 * plate)
        film_flow.film_flow(oil.oil_table(OIL, T_IN), self.x, 0.0 * plate, self.h, self.t, speeds, self.flow)
        self.face = energy.FaceFlow.empty(
            np.ones(3, dtype=np.int64), np.full(3, n_x - 1, dtype=np.int64), n_x, n_z
        )
        flux = np.full((3, n_x - 1), OIL.density * 0.5 * (u_a + u_b) * GAP)
        energy.face_flow(
            self.width, self.h_y, True, OIL.specific_heat, 0.0 * plate, flux, np.zeros((2, n_x)), self.flow, self.face
        )  # fmt: skip

    def sweep(self, forward=True):
        return energy.sweep(
            self.x, self.width, self.h_y, True, self.h, OIL.thermal_conductivity, T_IN, self.flow, self.face,
            self.t.copy(), False, forward, True, self.t, self.heat, self.q_a, self.q_b, np.zeros((3, self.n_x, 4)),
        )  # fmt: skip


def shear_stress(u_a, u_b):
    return OIL.viscosity * abs(u_a - u_b) / GAP


@pytest.mark.parametrize("n_z", [4, 10, 21])
@pytest.mark.parametrize(("u_a", "u_b"), [(1.5, 0.5), (0.5, 1.5), (2.0, 1.0), (-0.5, -1.5)])
def test_plug_film_warms_by_its_closed_form(n_z, u_a, u_b):
    """Sheared film between walls at T0, far from the inlet: rise tau |du| h/(8 k) in the middle, half the heat each."""
    channel = Channel(n_z=n_z, u_a=u_a, u_b=u_b)
    for _ in range(8):  # a sweep moves a column by SWEEP_LIMIT at most
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
        channel.flow.traction_x, -shear_stress(u_a, u_b) * np.sign(u_a - u_b), rtol=ROUNDING
    )


@pytest.mark.parametrize("gradient", [-2e10, 2e10])
@pytest.mark.parametrize(("u_a", "u_b"), [(1.0, 1.0), (1.5, 0.5), (0.5, 1.5)])
def test_pressure_flow_warms_the_film_by_its_closed_form(u_a, u_b, gradient):
    """Stress tau + p_x (z - h/2): its square is of the sliding, of both, and of the pressure flow, given as a power."""
    power, n_z = 3e5, 10
    channel = Channel(n_z=n_z, u_a=u_a, u_b=u_b, gradient=gradient, power=power)
    for _ in range(8):
        channel.sweep()
    tau = OIL.viscosity * (u_b - u_a) / GAP
    zeta = np.linspace(-0.5, 0.5, n_z + 1)
    sliding = GAP / OIL.viscosity * tau**2 * 0.5 * (0.25 - zeta**2)
    both = 2.0 * GAP**2 / OIL.viscosity * tau * gradient * (0.25 * zeta - zeta**3) / 6.0
    # the second difference of zeta^4 is 12 zeta^2 + 2/n_z^2; the cells add up zeta^2 to (1 + 2/n_z^2)/12
    driven = power * (0.0625 - zeta**4 - (0.25 - zeta**2) / n_z**2) / (1.0 + 2.0 / n_z**2)
    # of the pressure flow exactly its power, whatever the gradient and the layers
    total = tau * (u_b - u_a) + power
    closed = (sliding + both + driven) * GAP / OIL.thermal_conductivity
    assert u_a == u_b or np.abs(both).max() > 0.05 * sliding.max()
    for line in (0, 1):
        found = channel.t[line, channel.n_x - 2] - T_IN
        np.testing.assert_allclose(found, closed, rtol=ROUNDING, atol=ROUNDING * np.abs(closed).max())
        heat = channel.q_a[line, channel.n_x - 2] + channel.q_b[line, channel.n_x - 2]
        assert heat == pytest.approx(total, rel=ROUNDING)


def test_linearised_source_does_not_change_the_fixed_point():
    """The linearisation changes the iterates; its term vanishes where the temperature no longer changes."""
    channel, plain = Channel(), Channel()
    channel.flow.soft[:] = 20.0  # times the rise: a source that halves within it
    first, _ = channel.sweep(), plain.sweep()
    assert np.abs(channel.t - plain.t).max() > 1e-3
    for _ in range(60):
        change, _ = channel.sweep(), plain.sweep()
    assert change <= 1e-9 * first
    rise = np.ptp(plain.t)
    assert rise > 0.03  # K
    np.testing.assert_allclose(channel.t, plain.t, atol=1e-7 * rise)


def decaying_mode_error(n, n_z):
    """Largest error of T0 + sin(pi z/h) exp(-x/l), l = rho c u h^2/(pi^2 k), in a plug flow that cools down."""
    u, k = 1.0, OIL.thermal_conductivity
    length = OIL.density * OIL.specific_heat * u * GAP**2 / (np.pi**2 * k)
    channel = Channel(length=1.5 * length, n_x=n + 1, n_z=n_z, u_a=u, u_b=u)
    exact = np.sin(np.pi * np.linspace(0.0, 1.0, n_z + 1)) * np.exp(-channel.x / length)[:, None]
    # the first two columns are given: what enters from outside the domain is at T0
    channel.face.start[:] = 2
    channel.t[:] = T_IN
    channel.t[:, :2] += exact[:2]
    channel.face.x[:, 0] = channel.face.x[:, 1]
    for _ in range(2):
        channel.sweep()
    return np.abs(channel.t[0, 2:-1] - T_IN - exact[2:-1]).max()


def test_convection_and_conduction_are_of_second_order():
    sizes = np.array([16, 32, 64, 128])
    errors = [decaying_mode_error(n, n_z) for n, n_z in zip(sizes, (6, 12, 24, 48), strict=True)]
    order = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert 1.8 < order < 2.4
    assert errors[-1] <= 1e-3


# --- start of the iteration: a film heated by shear alone -------------------------------------------------------------


@pytest.mark.parametrize("slip", [1e-3, 0.5, 4.0, 30.0])
def test_sheared_film_is_the_solution_of_its_heat_equation(slip):
    """k T'' + tau du/dz = 0 with eta exp(-soft (T-T_w)) at one stress, solved as a boundary value problem."""
    k, h, eta, soft, wall = 0.14, 2e-7, 20.0, 0.06, 320.0
    nahme = soft * eta * slip**2 / k

    def rise(z, s):
        # theta = soft (T - T_w); s[2]: velocity/slip; stress in units of eta slip/h is the parameter
        return lambda parameter: np.stack(
            [s[1], -nahme * parameter**2 * np.exp(s[0]), parameter * np.exp(s[0])]
        )

    z = np.linspace(0.0, 1.0, 201)
    solution = solve_bvp(
        lambda z, s, stress: rise(z, s)(stress[0]),
        lambda a, b, stress: np.array([a[0], b[0], a[2], b[2] - 1.0]),
        z, np.stack([0.0 * z, 0.0 * z, z]), p=[1.0 / (1.0 + nahme / 8.0)], tol=1e-9, max_nodes=20000,
    )  # fmt: skip
    assert solution.success
    t = np.zeros(201)
    q = energy.sheared_film(k, h, slip, eta, soft, wall, wall, t)
    theta, slope = solution.sol(z)[:2]
    # tolerance of the boundary value problem
    np.testing.assert_allclose(soft * (t - wall), theta, atol=1e-6 * max(theta.max(), 1e-6))
    assert q == pytest.approx(k * slope[0] / (soft * h), rel=1e-6)


def test_sheared_film_without_softening_is_the_parabola():
    k, h, eta, slip = 0.14, 2e-7, 2.0, 1.0
    z = np.linspace(0.0, 1.0, 9)
    parabola = 320.0 + eta * slip**2 / (2.0 * k) * z * (1.0 - z)
    for soft in (0.0, 1e-9):
        t = np.zeros(9)
        assert energy.sheared_film(k, h, slip, eta, soft, 320.0, 320.0, t) == pytest.approx(
            0.5 * eta * slip**2 / h, rel=1e-6
        )
        expected = np.full(9, 320.0) if soft == 0.0 else parabola
        np.testing.assert_allclose(t, expected, atol=1e-5)
    energy.sheared_film(k, h, 0.0, eta, 0.05, 320.0, 330.0, t)
    np.testing.assert_allclose(t, 320.0 + 10.0 * z, rtol=1e-12)


# --- balances ------------------------------------------------------------------------------------------------------

N_Y, N_X, N_Z = 6, 22, 8
FLOWS = {"sliding": (1.5, 0.5), "recirculating": (1.0, -0.5)}


class Film:
    """Varying pressure and gap, spin, and fluxes that do not conserve mass."""

    def __init__(self, mirror, u_a, u_b, whole=False, seed=3):
        rng = np.random.default_rng(seed)
        self.mirror = mirror
        self.x = 1e-4 * np.cumsum(np.linspace(0.6, 1.4, N_X))
        self.h_y, self.width = 6e-4, cell_widths(self.x)
        self.y = self.h_y * (np.arange(N_Y) - (0 if mirror else (N_Y - 1) / 2))
        s, r = np.meshgrid((self.x - self.x.mean()) / 1e-3, self.y / 2e-3)
        self.p, self.h = 3e8 * np.exp(-(s**2) - r**2), 1e-6 * (1.0 + 0.5 * s**2 + 0.3 * r**2)
        spin = (0.0 if mirror else 80.0) * np.ones((N_Y, N_X))
        self.speeds = film_flow.SurfaceSpeeds(
            u_a - spin * self.y[:, None], u_b + 0.0 * spin, spin * (self.x - self.x.mean()), 0.0 * spin
        )
        self.t = T_IN + 20.0 * np.exp(-(s**2) - r**2)[..., None] * rng.random((N_Y, N_X, N_Z + 1))
        self.heat = HeatTransport.empty(N_Y, self.x, N_Z)
        self.flow = film_flow.FilmFlow.empty(N_Y, N_X, N_Z)
        self.flow.gradient_x[:], self.flow.gradient_y[:] = np.gradient(self.p, self.x, self.y, axis=(1, 0))
        # of the size of the dissipation of a uniform film; the balances hold for any
        squared = self.flow.gradient_x**2 + self.flow.gradient_y**2
        self.flow.power[:] = self.h**3 * squared / (12.0 * lubricant.viscosity(REAL_OIL, self.p, T_IN))
        film_flow.film_flow(
            oil.oil_table(REAL_OIL, T_IN), self.x, self.p, self.h, self.t, self.speeds, self.flow
        )
        # the outer lines are solved over a part of their length, or all lines completely
        inner = whole | (np.abs(self.y) < 1.5e-3)
        start = np.where(inner, 1, 4).astype(np.int64)
        end = np.where(inner, N_X - 1, N_X - 3).astype(np.int64)
        self.face = energy.FaceFlow.empty(start, end, N_X, N_Z)
        # outside the lines and columns that are solved the oil is that of the inlet
        for j in range(N_Y):
            held = np.ones(N_X, dtype=bool)
            if (mirror or j > 0) and j < N_Y - 1:
                held[start[j] : end[j]] = False
            self.t[j, held] = T_IN
        self.flux_x = 0.5 * (u_a + u_b) * 900.0 * 0.5 * (self.h[:, 1:] + self.h[:, :-1])
        self.flux_y = 2e-2 * self.flux_x.mean() * rng.normal(size=(N_Y - 1, N_X))
        energy.face_flow(
            self.width,
            self.h_y,
            mirror,
            REAL_OIL.specific_heat,
            self.p,
            self.flux_x,
            self.flux_y,
            self.flow,
            self.face,
        )
        self.q_a, self.q_b = np.zeros((N_Y, N_X)), np.zeros((N_Y, N_X))

    def sweep(self, forward):
        return energy.sweep(
            self.x, self.width, self.h_y, self.mirror, self.h, REAL_OIL.thermal_conductivity, T_IN, self.flow,
            self.face, self.t.copy(), False, forward, True, self.t, self.heat, self.q_a, self.q_b,
            np.zeros((N_Y, N_X, 4)),
        )  # fmt: skip

    def balance(self):
        return energy.heat_balance(
            self.x, self.width, self.h_y, self.mirror, self.flow, self.face, self.t, T_IN, self.q_a, self.q_b
        )


def carried_out(film):
    """Heat [W] through the outer faces of the cells alone: upwind, inflow at T0, outflow continued from two nodes.

    Across, the slope is at most that to the node beyond.
    """
    first = 0 if film.mirror else 1
    lines, across = slice(first, N_Y - 1), np.full(N_Y - 1 - first, film.h_y)
    if film.mirror:
        across[1:] *= 2.0
    weights = np.full(N_Z + 1, 1.0 / N_Z)
    weights[[0, -1]] *= 0.5

    def leaving(flow, near, behind, ratio):
        rise = near + 0.5 * ratio * (near - behind) - T_IN
        return np.maximum(flow, 0.0) * rise

    def across_leaving(flow, near, behind, beyond):
        before, after = near - behind, beyond - near
        slope = np.where(
            before * after > 0.0, np.sign(before) * np.minimum(np.abs(before), np.abs(after)), 0.0
        )
        return leaving(flow, near, near - slope, 1.0)

    x, t = film.x, film.t
    d = np.diff(x)
    # backflow is of first order
    west = leaving(-film.face.x[lines, 0], t[lines, 1], t[lines, 2], 0.0)
    ratio = d[-1] / d[-2] * (film.face.x[lines, -2] > 0.0)
    east = leaving(film.face.x[lines, -1], t[lines, -2], t[lines, -3], ratio)
    total = np.einsum("j,jk,k", across, west + east, weights)
    north = across_leaving(film.face.y[-1], t[-2], t[-3], t[-1])[1:-1]
    total += np.einsum("i,ik,k", film.width[1:-1], north, weights) * (2.0 if film.mirror else 1.0)
    if not film.mirror:
        south = across_leaving(-film.face.y[0], t[1], t[2], t[0])[1:-1]
        total += np.einsum("i,ik,k", film.width[1:-1], south, weights)
    return total


@pytest.mark.parametrize(
    ("values", "slope"),
    [
        ((1.0, 2.0, 4.0), 1.0),
        ((1.0, 4.0, 5.0), 1.0),
        ((5.0, 3.0, 2.5), -0.5),
        ((1.0, 2.0, 1.5), 0.0),
        ((2.0, 1.0, 3.0), 0.0),
        ((2.0, 2.0, 3.0), 0.0),
    ],
)
def test_a_face_lies_between_its_cells(values, slope):
    """The smaller difference, none at an extremum."""
    assert energy.bounded_slope(*values) == slope
    face = values[1] + 0.5 * slope
    low, high = sorted(values[1:])
    assert low <= face <= high


@pytest.mark.parametrize("mirror", [True, False], ids=["mirror", "both halves, spin"])
@pytest.mark.parametrize(("u_a", "u_b"), FLOWS.values(), ids=FLOWS)
def test_heat_leaves_through_the_outer_faces_only(mirror, u_a, u_b):
    """Neighbouring cells agree on what crosses the face between them: the sum over cells is that of the border."""
    film = Film(mirror, u_a, u_b, whole=True)
    for _ in range(150):
        film.sweep(False)
        if film.sweep(True) < 1e-10:
            break
    assert film.balance().convected == pytest.approx(carried_out(film), rel=1e-9)
    assert abs(film.balance().defect) <= 1e-9


@pytest.mark.parametrize("mirror", [True, False], ids=["mirror", "both halves, spin"])
@pytest.mark.parametrize(("u_a", "u_b"), FLOWS.values(), ids=FLOWS)
def test_repeated_sweeps_close_the_heat_balance(mirror, u_a, u_b):
    film = Film(mirror, u_a, u_b)
    assert (film.face.reverse.max() > 0) == (u_b < 0.0)
    film.sweep(True)
    assert abs(film.balance().defect) > 1e-4
    for _ in range(150):
        film.sweep(False)
        change = film.sweep(True)
        if change < 1e-10:
            break
    assert change <= 1e-9
    balance = film.balance()
    assert np.ptp(film.t) > 5.0
    # every part is large enough to matter
    for part in balance:
        assert abs(part) > 1e-3 * max(abs(p) for p in balance)
    assert abs(balance.defect) <= 1e-9


@pytest.mark.parametrize("mirror", [True, False], ids=["mirror", "both halves, spin"])
@pytest.mark.parametrize(("u_a", "u_b"), FLOWS.values(), ids=FLOWS)
def test_face_flow_conserves_mass(mirror, u_a, u_b):
    """Nothing passes the upper wall, and across the film a face carries the flux of the Reynolds equation."""
    film = Film(mirror, u_a, u_b)
    face, heat, weights = film.face, REAL_OIL.specific_heat, np.full(N_Z + 1, 1.0 / N_Z)
    weights[[0, -1]] *= 0.5
    np.testing.assert_allclose(face.y @ weights, heat * film.flux_y, atol=1e-12 * np.abs(face.y).max())
    for j in range(0 if mirror else 1, N_Y - 1):
        start, end = face.start[j], face.end[j]
        # the flux of the residual behind the largest pressure, by continuity elsewhere
        peak = 1 + np.argmax(film.p[j, 1:-1])
        assert start <= peak < end
        assert face.x[j, peak] @ weights == pytest.approx(heat * film.flux_x[j, peak], rel=1e-12)
        # on the axis the line below is the mirror image of the one above
        below = -face.y[0] if mirror and j == 0 else face.y[j - 1]
        inner = slice(start, end)
        out = np.diff(face.x[j, start - 1 : end], axis=0) / film.width[inner, None]
        out += (face.y[j, inner] - below[inner]) / film.h_y
        up = -np.cumsum(out * weights, axis=1)
        largest = np.abs(up).max()
        assert np.abs(up[:, -1]).max() <= 1e-12 * largest
        np.testing.assert_allclose(face.z[j, inner], up[:, :-1], atol=1e-12 * largest)


@pytest.mark.parametrize("mirror", [True, False], ids=["mirror", "both halves"])
def test_wall_temperatures_follow_from_their_heat(mirror):
    """Film and bodies in turn: a fixed point of sweep and update_walls satisfies T = T0 + K q at both walls."""
    n_x, n_z = 25, 6
    grid = uniform_grid(-2.0, 2.0, 1.5, n_x, 5 if mirror else 9, mirror)
    shape = (grid.y.size, n_x)
    a, b, kappa = 2e-4, 1e-4, 0.5
    walls = tuple(wall_operator(grid, kappa, b, u, STEEL.thermal_conductivity, CHI) for u in (1.0, 0.5))
    flow = film_flow.FilmFlow.empty(*shape, n_z)
    flow.shear[:] = 5e7 * np.maximum(0.0, 1.0 - grid.x**2 - grid.y[:, None] ** 2)[..., None]
    flow.m_x[:] = OIL.density * 0.75 * GAP
    ends = (np.ones(shape[0], dtype=np.int64), np.full(shape[0], n_x - 1, dtype=np.int64))
    face = energy.FaceFlow.empty(*ends, n_x, n_z)
    flux = np.full((shape[0], n_x - 1), OIL.density * 0.75 * GAP)
    width, h_y = grid.width_x * b, grid.h_y * a
    energy.face_flow(
        width,
        h_y,
        mirror,
        OIL.specific_heat,
        np.zeros(shape),
        flux,
        np.zeros((shape[0] - 1, n_x)),
        flow,
        face,
    )
    t, heat = np.full((*shape, n_z + 1), T_IN), HeatTransport.empty(shape[0], grid.x * b, n_z)
    q_a, q_b, response = np.zeros(shape), np.zeros(shape), np.zeros((*shape, 4))
    for _ in range(12):
        energy.sweep(
            grid.x * b, width, h_y, mirror, np.full(shape, GAP), OIL.thermal_conductivity, T_IN, flow, face,
            t.copy(), False, True, True, t, heat, q_a, q_b, response,
        )  # fmt: skip
        energy.update_walls(walls, t, q_a, q_b, response, T_IN)
    rise = t[:, :, [0, -1]] - T_IN
    assert rise.max() > 10.0
    # GMRES of every update is good to 1e-2; twelve of them leave rounding
    np.testing.assert_allclose(rise[..., 0], walls[0](q_a), atol=1e-6)
    np.testing.assert_allclose(rise[..., 1], walls[1](q_b), atol=1e-6)
    axis = 0 if mirror else shape[0] // 2
    assert rise[axis, n_x // 2, 1] > rise[axis, n_x // 2, 0]  # the slower body runs hotter
    balance = energy.heat_balance(grid.x * b, width, h_y, mirror, flow, face, t, T_IN, q_a, q_b)
    assert abs(balance.defect) <= 1e-6
