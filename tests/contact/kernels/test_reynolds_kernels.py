"""Reynolds kernels: compiled against NumPy; Jacobian against derivatives of the twin and against its own parts."""

from functools import partial

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
#: no changes of ln phi, g and g_y
NONE = np.zeros((3, 1, 1))


def film_of(p, spin=1.0):
    """A smooth piezoviscous, compressible film with spin: ln phi, g, g_y; p may be complex."""
    shift = spin * np.linspace(-1.0, 1.0, p.shape[1])
    return 2.0 - 9.0 * p + p**2, 1.0 + 0.3 * np.tanh(p), shift * (0.4 + 0.2 * np.sin(3.0 * p))


def derivative(function, *at):
    """Derivatives of a function of complex arguments, one of which has a step in it."""
    return [np.imag(value) / STEP for value in function(*at)]


class Case:
    """Fields with a cavitated (slightly negative) part and a gap that falls below FLOOR; the kernels' answer."""

    def __init__(self, mirror, open_side, floor, spin=1.0, seed=3):
        rng = np.random.default_rng(seed)
        self.film = partial(film_of, spin=spin)
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
        #: changes of ln phi, g and g_y beside those with the pressure of the node
        self.extra = rng.normal(size=(3, ny, nx))

        self.ln_phi, self.g, self.g_y = self.film(self.p)
        self.dln_phi, self.dg, self.dg_y = derivative(self.film, self.p + 1j * STEP)
        self.flow_x, self.flow_y = np.full((ny, nx - 1), np.nan), np.full((ny - 1, nx), np.nan)
        self.c_x, self.c_y = np.full((ny, nx - 1, 4), np.nan), np.full((ny - 1, nx, 5), np.nan)
        self.wedge = np.full((ny, nx - 1, 3), np.nan)
        kernels.face_fluxes(
            self.grid.x, self.kappa_h, mirror, open_side, self.p, self.gap, self.ln_phi, self.g, self.g_y,
            self.flow_x, self.flow_y, self.c_x, self.c_y, self.wedge, floor,
        )  # fmt: skip

    @property
    def parts(self):
        return self.mirror, self.c_x, self.c_y, self.wedge, self.gap, self.g, self.g_y, self.penalty

    def times(self, dp, dh, extra, squeeze):
        out = np.full(self.shape, np.nan)
        film = [
            by_p * dp + more for by_p, more in zip((self.dln_phi, self.dg, self.dg_y), extra, strict=True)
        ]
        kernels.jacobian_times(self.grid.width_x, self.kappa_h, *self.parts, squeeze, dp, dh, *film, out)
        return out

    def twin_fluxes(self, p, gap, ln_phi, g, g_y):
        return twins.face_fluxes(
            self.grid.x, self.kappa_h, self.mirror, self.open_side, p, gap, ln_phi, g, g_y, self.floor
        )

    def twin_times(self, dp, dh, extra=NONE, squeeze=0.0):
        """Derivative of the twin's residual; ln phi, g and g_y follow the pressure of the node."""
        p, gap = self.p + 1j * STEP * dp, self.gap + 1j * STEP * dh
        ln_phi, g, g_y = (value + 1j * STEP * more for value, more in zip(self.film(p), extra, strict=True))
        out = twins.residual(
            self.grid.width_x, self.kappa_h, self.mirror, *self.twin_fluxes(p, gap, ln_phi, g, g_y)
        )
        out[self.grid.inner] -= (self.penalty * p + squeeze * g * gap)[self.grid.inner]
        return np.imag(out) / STEP


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
    flow_x, flow_y = case.twin_fluxes(case.p, case.gap, case.ln_phi, case.g, case.g_y)
    # rounding, and 1e-14 of the series that replaces the logarithmic mean of nearly equal values
    np.testing.assert_allclose(case.flow_x, flow_x, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(case.flow_y, flow_y, rtol=1e-11, atol=1e-13)
    wedge = np.broadcast_to(twins.wedge_weights(case.grid.x), case.wedge.shape)
    np.testing.assert_allclose(case.wedge, wedge, atol=1e-13)
    out = np.full(case.shape, np.nan)
    kernels.residual(case.grid.width_x, case.kappa_h, case.mirror, case.flow_x, case.flow_y, out)
    twin = twins.residual(case.grid.width_x, case.kappa_h, case.mirror, flow_x, flow_y)
    np.testing.assert_allclose(out, twin, rtol=1e-10, atol=1e-11)


#: what moves, and where its derivative at the node before a face and behind it stands in c_x and c_y
FACE_DERIVATIVES = {
    "pressure": (0, (0, 0), (0, 0)),
    "gap": (1, (3, 3), (3, 4)),
    "ln phi": (2, (1, 2), (1, 2)),
}


@pytest.mark.parametrize("what", FACE_DERIVATIVES)
def test_derivatives_of_the_fluxes_are_those_of_the_twin(case, what):
    """Every other node of a face moved in turn; of the pressure flow, so without the wedge."""
    moved, *own = FACE_DERIVATIVES[what]
    nodes, still = np.indices(case.shape), np.zeros(case.shape)
    for parity in (0, 1):
        for axis, compiled, flux, (before, behind) in (
            (1, case.c_x, 0, own[0]),
            (0, case.c_y, 1, own[1]),
        ):
            fields = [case.p + 0j, case.gap + 0j, case.ln_phi + 0j]
            fields[moved] = fields[moved] + 1j * STEP * (nodes[axis] % 2 == parity)
            twin = np.imag(case.twin_fluxes(*fields, still, still)[flux]) / STEP
            faces = nodes[axis][: twin.shape[0], : twin.shape[1]]
            # the node moved is the first of the face or the second; the conductance is for a difference of pressure
            first = -compiled[..., before] if what == "pressure" else compiled[..., before]
            found = np.where(faces % 2 == parity, first, compiled[..., behind])
            assert np.abs(twin).max() > 1e-3
            np.testing.assert_allclose(found, twin, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("squeeze", [0.0, 3.0])
@pytest.mark.parametrize("what", ["pressure", "gap", "film", "all"])
def test_jacobian_times_is_the_derivative_of_the_residual(case, what, squeeze):
    """squeeze: of g H that leaves what it was in one pseudo time step of 1/squeeze."""
    dp, dh, extra = (
        change * (what in (name, "all"))
        for name, change in (("pressure", case.dp), ("gap", case.dh), ("film", case.extra))
    )
    twin = case.twin_times(dp, dh, extra, squeeze)
    assert np.abs(twin).max() > 1.0
    found = case.times(dp, dh, extra, squeeze)
    np.testing.assert_allclose(found, twin, rtol=1e-10, atol=1e-11 * np.abs(twin).max())


def line_jacobian(case, line, same_line, squeeze, squash, by_p, far_phi, far_g):
    n = case.shape[1] - 2
    matrix, approach = np.full((n, n), np.nan), np.full(n, np.nan)
    kernels.line_jacobian(
        line, case.grid.width_x, case.kappa_h, *case.parts, squeeze, squash, *by_p, far_phi, far_g, same_line,
        matrix, approach,
    )  # fmt: skip
    return matrix, approach


@pytest.mark.parametrize("far", [False, True], ids=["own node", "far"])
@pytest.mark.parametrize("line", [0, 1, -3, -2])
def test_line_jacobian_holds_the_columns_of_the_jacobian(case, line, far):
    """far: ln phi and g of every node of the line answer to every pressure of it."""
    line = line % case.shape[0]
    if line == 0 and not case.mirror:
        pytest.skip("an edge: P = 0")
    if line == 0:
        # a contact with spin has no mirror: the Jacobian of the line at the mirror has no flow across by spin
        case = Case(case.mirror, case.open_side, case.floor, spin=0.0)
    same_line = 0.2 * line_influence(case.grid.x, case.grid.cell_edges_x, case.grid.h_y / 0.3, 1)[0]
    nx = case.shape[1]
    response = np.random.default_rng(8).normal(size=(2, nx, nx)) if far else np.zeros((2, 0, 0))
    squeeze, still = 2.0, np.zeros(case.shape)
    matrix, approach = line_jacobian(
        case, line, same_line, squeeze, still, (case.dln_phi, case.dg), *response
    )
    for k in range(nx - 2):
        dp, dh, extra = np.zeros(case.shape), np.zeros(case.shape), np.zeros((3, *case.shape))
        dp[line, k + 1], dh[line] = 1.0, same_line[:, k + 1]
        if far:
            extra[:2, line] = response[:, :, k + 1]
        column = case.twin_times(dp, dh, extra, squeeze)[line, 1:-1]
        np.testing.assert_allclose(matrix[:, k], column, rtol=1e-10, atol=1e-11 * np.abs(matrix).max())
    everywhere = case.twin_times(still, np.ones(case.shape), squeeze=squeeze)[line, 1:-1]
    np.testing.assert_allclose(approach, everywhere, rtol=1e-10, atol=1e-11 * np.abs(approach).max())


def test_line_jacobian_takes_from_the_film_what_the_asperities_carry(case):
    """A gap that closes takes pressure from the film, whose properties follow; the approach squeezes all lines."""
    # the approach leaves out how the flow across by spin follows the pressure of the neighbour lines
    case = Case(case.mirror, case.open_side, case.floor, spin=0.0)
    line, nx = 1, case.shape[1]
    same_line = 0.2 * line_influence(case.grid.x, case.grid.cell_edges_x, case.grid.h_y / 0.3, 1)[0]
    squash = np.zeros(case.shape)
    squash[case.grid.inner] = -np.random.default_rng(9).random(squash[case.grid.inner].shape)
    none = np.zeros((0, 0))
    matrix, approach = line_jacobian(case, line, same_line, 0.0, squash, (case.dln_phi, case.dg), none, none)
    for k in range(nx - 2):
        dp, dh = np.zeros(case.shape), np.zeros(case.shape)
        dh[line] = same_line[:, k + 1]
        dp[line] = -squash[line] * dh[line]
        dp[line, k + 1] += 1.0
        column = case.twin_times(dp, dh)[line, 1:-1]
        np.testing.assert_allclose(matrix[:, k], column, rtol=1e-10, atol=1e-11 * np.abs(matrix).max())
    everywhere = case.twin_times(-squash, np.ones(case.shape))[line, 1:-1]
    np.testing.assert_allclose(approach, everywhere, rtol=1e-10, atol=1e-11 * np.abs(approach).max())


# --- what the pressure flow dissipates --------------------------------------------------------------------------------


def test_smaller_of_one_sign():
    assert kernels.smaller(2.0, 3.0) == kernels.smaller(3.0, 2.0) == 2.0
    assert kernels.smaller(-2.0, -3.0) == kernels.smaller(-3.0, -2.0) == -2.0
    assert kernels.smaller(2.0, -3.0) == kernels.smaller(-2.0, 3.0) == kernels.smaller(0.0, 3.0) == 0.0


def steady_flux(case, p=None):
    """kernels.line_flux of every line."""
    out = np.full_like(case.flow_x, np.nan)
    for j in range(0 if case.mirror else 1, case.shape[0] - 1):
        kernels.line_flux(
            j, case.grid.width_x, case.kappa_h, case.mirror, case.p if p is None else p, case.flow_x, case.flow_y,
            out[j],
        )  # fmt: skip
    return out


def test_flux_by_continuity_balances_and_starts_behind_the_largest_pressure(case):
    steady, lines = steady_flux(case), case.grid.inner[0]
    left = np.full(case.shape, np.nan)
    kernels.residual(case.grid.width_x, case.kappa_h, case.mirror, steady, case.flow_y, left)
    # rounding of the fluxes over the narrowest cell
    assert np.abs(left).max() <= 1e-12 * np.abs(steady[lines]).max() / case.grid.width_x.min()
    anchor = 1 + np.argmax(case.p[lines, 1:-1], axis=1)
    at = np.arange(case.shape[0])[lines], anchor
    np.testing.assert_array_equal(steady[at], case.flow_x[at])


def pressure_flow(case, **changed):
    """The kernel's answer by name."""
    ny, nx = case.shape
    fields = {
        "p": case.p, "gap": case.gap, "ln_phi": case.ln_phi, "dln_phi": case.dln_phi, "g": case.g,
        "flow_x": case.flow_x, "flow_y": case.flow_y, "c_x": case.c_x, "c_y": case.c_y, "wedge": case.wedge,
        "same_line": np.eye(nx),
    } | changed  # fmt: skip
    out = {name: np.full((ny, nx), np.nan) for name in ("grad_x", "grad_y", "power")}
    out |= {"pull": np.full((ny, nx, 2), np.nan), "push": np.full((ny, nx, 4), np.nan)}
    grid = case.grid
    kernels.pressure_flow(
        grid.x, grid.width_x, grid.h_y, case.kappa_h, case.mirror, *fields.values(), case.floor, *out.values()
    )
    return out


def flow_twin(case, steady):
    """grad_x, grad_y, power; and the dissipation of the faces along (n_y, n_x-1) and across (n_y-1, n_x)."""

    def smaller(a, b):
        return np.where(a * b > 0.0, np.sign(a) * np.minimum(np.abs(a), np.abs(b)), 0.0)

    grid, p = case.grid, case.p
    drop_x, drop_y = np.diff(p, axis=1), np.diff(p, axis=0)
    along, across = case.c_x[..., 0] * drop_x, case.c_y[..., 0] * drop_y
    # of the flux of continuity, what is not the wedge's
    along = smaller(along, steady - (case.flow_x - along))
    conductance = twins.lifted_gap(case.gap, case.floor) ** 3 * np.exp(case.ln_phi)
    grad_x, grad_y = np.zeros(case.shape), np.zeros(case.shape)
    grad_x[:, 1:-1] = smaller(
        0.5 * (along[:, 1:] + along[:, :-1]) / conductance[:, 1:-1], np.gradient(p, grid.x, axis=1)[:, 1:-1]
    )
    grad_y[1:-1] = smaller(
        0.5 * (across[1:] + across[:-1]) / (conductance[1:-1] * case.kappa_h * grid.h_y),
        np.gradient(p, grid.h_y, axis=0)[1:-1],
    )
    along, across = along * drop_x, case.kappa_h * across * drop_y
    power = np.zeros(case.shape)
    power[:, 1:-1] = 0.5 * (along[:, 1:] + along[:, :-1]) / grid.width_x[1:-1]
    power[1:-1] += 0.5 * (across[1:] + across[:-1])
    # the line below the mirror is the one above it
    power[0] += across[0]
    live = np.zeros(case.shape, dtype=bool)
    live[grid.inner] = p[grid.inner] > 0.0
    return [np.where(live, value, 0.0) for value in (grad_x, grad_y, power)], (along, across), live


def test_gradients_and_power_of_the_pressure_flow_are_the_numpy_twin(case):
    found = pressure_flow(case)
    (grad_x, grad_y, power), _, live = flow_twin(case, steady_flux(case))
    if case.mirror:
        grad_y[0] = 0.0
    for name, twin in (("grad_x", grad_x), ("grad_y", grad_y), ("power", power)):
        assert np.abs(twin).max() > 1e-3
        np.testing.assert_allclose(found[name], twin, rtol=1e-9, atol=1e-11 * np.abs(twin).max())
    assert (case.p[case.grid.inner] < 0.0).any()
    for value in found.values():
        assert (value[~live] == 0.0).all()
    assert (np.abs(found["pull"]).max(axis=-1)[live] > 0.0).any()


@pytest.mark.parametrize("cavitated", [False, True])
def test_power_of_the_nodes_sums_to_that_of_the_faces(case, cavitated):
    """In a steady flow every face gives half its dissipation to either end, nothing where there is no pressure."""
    grid, p = case.grid, np.maximum(case.p, 0.0) if cavitated else np.abs(case.p)
    flow_x = steady_flux(case, p)
    power = pressure_flow(case, p=p, flow_x=flow_x)["power"]
    live = p > 0.0
    along = case.c_x[..., 0] * np.diff(p, axis=1) ** 2 * 0.5 * (live[:, :-1] * 1.0 + live[:, 1:])
    across = case.kappa_h * case.c_y[..., 0] * np.diff(p, axis=0) ** 2 * 0.5 * (live[:-1] * 1.0 + live[1:])
    # both halves of a mirrored contact: the line between them counts once, a face across lies in either
    lines = np.where(np.arange(case.shape[0]) > 0, 2.0, 1.0)[:, None] if case.mirror else 1.0
    faces = np.sum(lines * along) + (2.0 if case.mirror else 1.0) * np.sum(across * grid.width_x)
    assert np.sum(lines * power * grid.width_x) == pytest.approx(faces, rel=1e-11)
    assert (case.p[grid.inner] < 0.0).any()


class SmoothFilm:
    """A film without spikes on a graded grid, its pressure flow by the kernels; n nodes along, half as many lines."""

    def __init__(self, n, p, ln_phi, gap):
        self.mirror, self.floor = False, 1e-9
        self.grid = grid = graded_grid(-2.5, 1.5, 1.2, n, (n + 1) // 2, 0.1, False)
        self.kappa_h = 0.3 / grid.h_y
        x, y = grid.x + 0.0 * grid.y[:, None], grid.y[:, None] + 0.0 * grid.x
        self.p, self.ln_phi, self.gap = p(x, y), ln_phi(x, y), gap(x, y)
        self.dln_phi = self.g = self.g_y = np.zeros_like(self.p)
        self.shape = ny, nx = self.p.shape
        self.flow_x, self.flow_y = np.empty((ny, nx - 1)), np.empty((ny - 1, nx))
        self.c_x, self.c_y, self.wedge = (
            np.empty((ny, nx - 1, 4)),
            np.empty((ny - 1, nx, 5)),
            np.empty((ny, nx - 1, 3)),
        )
        kernels.face_fluxes(
            grid.x, self.kappa_h, False, False, self.p, self.gap, self.ln_phi, self.g, self.g_y, self.flow_x,
            self.flow_y, self.c_x, self.c_y, self.wedge, self.floor,
        )  # fmt: skip

    def gradients(self):
        """Of the inner nodes, at fluxes that are continuous."""
        steady = steady_flux(self)
        steady[[0, -1]] = 0.0
        found = pressure_flow(self, flow_x=steady)
        return [found[name][self.grid.inner] for name in ("grad_x", "grad_y")]

    def central(self):
        slopes = np.gradient(self.p, self.grid.y, self.grid.x)
        # per unit of x and of h_y, as the grid has them
        return [slope[self.grid.inner] for slope in slopes[::-1]]


def test_gradients_of_a_plane_pressure_in_an_even_film_are_its_slopes():
    film = SmoothFilm(
        33, lambda x, y: 5.0 - 0.7 * x + 0.4 * y, lambda x, y: 0.3 + 0.0 * x, lambda x, y: 0.2 + 0.0 * x
    )
    along, across = film.gradients()
    np.testing.assert_allclose(along, -0.7, rtol=1e-11)
    np.testing.assert_allclose(across, 0.4, rtol=1e-11)


def test_gradients_of_a_smooth_film_are_the_central_ones():
    """What the fluxes of the faces drive differs from the difference of the neighbours by the square of the spacing."""
    errors = []
    for n in (33, 65, 129):
        film = SmoothFilm(
            n,
            lambda x, y: 9.0 + 0.5 * x + 0.3 * x**2 + 0.7 * y + 0.2 * y**2,
            lambda x, y: 0.2 * x - 0.3 * y,
            lambda x, y: 0.5 + 0.05 * x**2 + 0.04 * y**2,
        )
        pairs = list(zip(film.gradients(), film.central(), strict=True))
        errors.append([np.abs(found - central).max() for found, central in pairs])
        for found, central in pairs:
            # the smaller of the two
            assert (np.abs(found) <= np.abs(central) + 1e-11).all()
    errors = np.array(errors)
    assert errors[-1].max() <= 5e-4
    # second order: 4, less because the node of the largest error moves towards the edge
    assert (errors[:-1] >= 3.2 * errors[1:]).all()


def test_gradients_beside_a_spike_are_the_smaller_ones():
    """Fluidity that falls a thousandfold at one node: neither its own conductance nor that of its faces misleads."""
    peak = 16

    def ln_phi(x, y):
        return np.where(np.arange(x.shape[1]) == peak, -7.0, 0.0) + 0.0 * x

    film = SmoothFilm(33, lambda x, y: 5.0 - 0.7 * x, ln_phi, lambda x, y: 0.2 + 0.0 * x)
    along = film.gradients()[0]
    # inner nodes begin at 1: the spike has the slope of its neighbours, not the flux of its faces by its fluidity
    np.testing.assert_allclose(along[:, peak - 1], -0.7, rtol=1e-11)
    mean = -np.expm1(-7.0) / 7.0
    for beside in (peak - 2, peak):
        np.testing.assert_allclose(along[:, beside], -0.7 * 0.5 * (1.0 + mean), rtol=1e-11)


def driven_line(x, drops, mass, passing, deflection=0.0):
    """A line between two edges whose pressure flow is what continuity asks for: passing + the wedge flux of mass.

    deflection: of a node by its own pressure. Returns power, pull, push and the conductances of the faces.
    """
    nx = x.size
    p = np.zeros((3, nx))
    p[1] = 20.0 + np.concatenate([[0.0], np.cumsum(drops)])
    wedge = np.zeros((3, nx - 1, 3))
    wedge[1] = twins.wedge_weights(x)
    before = np.concatenate([mass[:1], mass[:-2]])
    flux = passing + wedge[1, :, 0] * mass[:-1] + wedge[1, :, 1] * before + wedge[1, :, 2] * mass[1:]
    c_x, c_y = np.zeros((3, nx - 1, 4)), np.zeros((2, nx, 5))
    c_x[1, :, 0] = flux / drops
    width = np.diff(np.concatenate([[x[0]], 0.5 * (x[1:] + x[:-1]), [x[-1]]]))
    grad_x, grad_y, power = np.empty((3, 3, nx))
    pull, push = np.empty((3, nx, 2)), np.empty((3, nx, 4))
    one, still = np.ones((3, nx)), np.zeros((3, nx))
    kernels.pressure_flow(
        x, width, 1.0, 1.0, False, p, one, still, still, one, np.full((3, nx - 1), passing), np.zeros((2, nx)), c_x,
        c_y, wedge, deflection * np.eye(nx), 1e-9, grad_x, grad_y, power, pull, push,
    )  # fmt: skip
    return power[1], pull[1], push[1], c_x[1, :, 0]


class TestPowerByDropsAndWedge:
    """Power is linear in every pressure drop and in every wedge flux: finite differences are exact."""

    rng = np.random.default_rng(21)
    n = 9
    x = np.cumsum(0.3 + rng.random(n))
    #: larger than the wedge can turn round: fluxes of the sign of the drops
    drops, mass, passing = 0.5 + rng.random(n - 1), rng.random(n), 4.0

    def difference(self, what, k):
        """Derivative of the power of all nodes to one drop at given fluxes, or to one wedge flux."""
        step, values = 0.25, []
        for s in (step, -step):
            moved = {"drops": self.drops.copy(), "mass": self.mass.copy()}
            moved[what][k] += s
            values.append(driven_line(self.x, passing=self.passing, **moved)[0])
        return (values[0] - values[1]) / (2.0 * step)

    @pytest.mark.parametrize("face", range(n - 1))
    def test_pull(self, face):
        pull = driven_line(self.x, self.drops, self.mass, self.passing)[1]
        expected = np.zeros(self.n)
        # a face is the one behind its first node, and the one before its second
        expected[face] += pull[face, 1]
        expected[face + 1] += pull[face + 1, 0]
        difference = self.difference("drops", face)
        assert np.abs(difference).max() > 0.1
        np.testing.assert_allclose(difference, expected, rtol=1e-11, atol=1e-12)

    @pytest.mark.parametrize("node", range(1, n - 1))
    def test_push(self, node):
        push = driven_line(self.x, self.drops, self.mass, self.passing)[2]
        # node is i-2, i-1, i, i+1 of the nodes i = node + 2 ... node - 1
        expected = np.zeros(self.n)
        for m in range(4):
            i = node + 2 - m
            if 0 < i < self.n - 1:
                expected[i] = push[i, m]
        difference = self.difference("mass", node)
        assert np.abs(difference).max() > 0.1
        np.testing.assert_allclose(difference, expected, rtol=1e-11, atol=1e-12)

    def test_push_by_the_share_of_a_face_that_pressure_flow_has(self):
        """The pressure carries what the deflection does not: conductance over conductance and deflection."""
        stiff = driven_line(self.x, self.drops, self.mass, self.passing)[2]
        _, _, soft, c = driven_line(self.x, self.drops, self.mass, self.passing, 2.0)
        inner = np.arange(2, self.n - 1)
        # the first and the last weight are those of one face only, before the node and behind it
        for m, face in ((0, inner - 1), (3, inner)):
            np.testing.assert_allclose(soft[inner, m], stiff[inner, m] * (c / (c + 2.0))[face], rtol=1e-12)


# --- parts ------------------------------------------------------------------------------------------------------------


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
    c_x, c_y = np.zeros((ny, nx - 1, 4)), np.zeros((ny - 1, nx, 5))
    for c in (c_x, c_y):
        # the fluidity makes a face answer a little differently to its two nodes, as with piezoviscous oil
        c[..., 0], c[..., 1:3] = 0.7 + rng.random(c.shape[:2]), rng.normal(size=(*c.shape[:2], 2))
    dln_phi = -0.1 * rng.random((ny, nx))
    inner = np.zeros((ny, nx), dtype=bool)
    inner[0 if mirror else 1 : -1, 1:-1] = True
    low = inner & (rng.random((ny, nx)) < 0.8)
    p = np.where(inner, np.maximum(rng.random((ny, nx)) - 0.5, 0.0), 0.0)
    r = np.where(inner, rng.normal(size=(ny, nx)), 0.0)
    settled, left = p.copy(), r.copy()
    kernels.settle_edge(width, kappa_h, mirror, c_x, c_y, dln_phi, low, 2000, settled, left)

    unit, jacobian = np.zeros((ny, nx)), []
    for j, i in np.argwhere(low):
        unit[j, i] = 1.0
        thicker = dln_phi * unit
        flow_x = c_x[..., 0] * np.diff(unit, axis=1) + c_x[..., 1] * thicker[:, :-1]
        flow_y = c_y[..., 0] * np.diff(unit, axis=0) + c_y[..., 1] * thicker[:-1]
        flow_x += c_x[..., 2] * thicker[:, 1:]
        flow_y += c_y[..., 2] * thicker[1:]
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
