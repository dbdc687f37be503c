"""Temperatures that follow pressure and gap: marched factors against solutions of the energy equation itself."""

from dataclasses import dataclass
from typing import NamedTuple

import energy_twins
import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl.contact.film import energy, transport
from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film.oil import oil_table
from ballscrew_tehl.contact.film.transport import HeatTransport

T_IN, HEAT, CONDUCTIVITY = 303.15, 2000.0, 0.14
NY, NX, NZ = 4, 9, 6
X = 1e-4 * np.cumsum(np.linspace(0.6, 1.4, NX))
WIDTH = np.diff(np.concatenate([X[:1], 0.5 * (X[1:] + X[:-1]), X[-1:]]))
H_Y = 2e-4
LINE = 1
#: units of pressure [Pa] and gap [m]
UNIT, UNIT_H = 1e9, 2e-7
LAYERS = energy_twins.layers(NZ)


def upstream_weights(x):
    """Weights (nx, 3) of the pressures of a node and the two before it in dp/dx there, over the first of them."""
    out = np.zeros((x.size, 3))
    for i in range(2, x.size):
        distance = x[[i, i - 1, i - 2]] - x[i]
        slope = np.linalg.solve(distance ** np.arange(3)[:, None], [0.0, 1.0, 0.0])
        out[i] = slope / slope[0]
    return out


# --- follow against the equation -----------------------------------------------------------------------------------


class Changes(NamedTuple):
    """Changes of pressure and gap at the nodes, in their units."""

    p: np.ndarray
    h: np.ndarray


class Channel:
    """One line of oil whose laws are those of the sweep: exponential viscosity, stress by the layers of the sweep.

    Fluxes of the faces, velocities of the compression and the profile of the pressure flow are frozen; all the rest
    depends on pressure, gap and temperature, and the energy equation is solved by repeated sweeps.
    """

    def __init__(self, rising, seed=11):
        rng = np.random.default_rng(seed)
        self.shape = (3, NX)
        levels = (*self.shape, NZ + 1)
        self.h = 3e-7 * (0.8 + 0.4 * rng.random(self.shape))
        self.ln_eta = np.log(0.3) + 0.5 * rng.random(self.shape)
        self.soft, self.stiff = 0.03 + 0.02 * rng.random(levels), 1e-8 * (0.5 + rng.random(levels))
        self.slip = 10.0
        # cooled by expansion: the sweep holds the heat of compression at its last temperature
        self.compression, self.squeeze = -2e4 * rng.random(levels), 1e-5 * rng.normal(size=levels)
        self.driven, self.power = 1.0 + rng.random(levels), 1e6 * rng.random(self.shape)
        self.t_wall = T_IN + 10.0 * rng.random((*self.shape, 2))
        self.g, self.dg = 1.0 + 0.2 * rng.random(self.shape), 0.3 * rng.random(self.shape)
        self.by_t = 1e-2 * rng.normal(size=(*self.shape, 3, NZ + 1))
        self.pull, self.push = (
            1e7 * rng.normal(size=(*self.shape, 2)),
            1e6 * rng.normal(size=(*self.shape, 4)),
        )
        self.wedge_h = 0.5 + rng.random(self.shape)
        ends = np.ones(3, dtype=np.int64), np.full(3, NX - 1, dtype=np.int64)
        self.face = energy.FaceFlow.empty(*ends, NX, NZ)
        self.face.x[:] = HEAT * 2e-2 * (0.4 + rng.random(self.face.x.shape))
        if rising:
            self.face.z[:] = 2e5 * rng.normal(size=self.face.z.shape)

    def wedge(self, change, t):
        """Changes of the wedge fluxes at the nodes by pressure and gap, and with them by the temperatures."""
        held = self.wedge_h * self.dg * change.p + self.g * change.h
        warm = np.einsum("jik,jik->ji", self.by_t[:, :, 1], t - self.t_base)
        return held, held + self.wedge_h * warm

    def flow(self, change, t):
        """Sources by their definitions."""
        flow = film_flow.FilmFlow.empty(*self.shape, NZ)
        d_p, h = UNIT * change.p, self.h + UNIT_H * change.h
        ln_eta = self.ln_eta[..., None] + self.stiff * d_p[..., None] - self.soft * (t - T_IN)
        fluid = np.exp(-ln_eta)
        flow.fluidity[:] = h * (fluid @ LAYERS)
        stress = self.slip / flow.fluidity
        flow.stress_x[:] = stress
        flow.rate[:] = (h * stress)[..., None] * fluid
        flow.sliding[:] = flow.rate * stress[..., None]
        flow.soft[:], flow.stiff[:], flow.squeeze[:], flow.driven[:] = (
            self.soft,
            self.stiff,
            self.squeeze,
            self.driven,
        )
        weights = upstream_weights(X)
        by_p = d_p.copy()
        by_p[:, 2:] += weights[2:, 1] * d_p[:, 1:-1] + weights[2:, 2] * d_p[:, :-2]
        flow.compression[:] = self.compression + self.squeeze * by_p[..., None]
        # while the line is marched, what happens downstream is known by pressure and gap alone
        held, warm = self.wedge(change, t)
        power = self.power.copy()
        drop = np.diff(change.p, axis=1)
        for i in range(1, NX - 1):
            power[:, i] += self.push[:, i, 2] * held[:, i] + self.push[:, i, 3] * held[:, i + 1]
            for m, behind in ((1, i - 1), (0, i - 2)):
                # the first node is the border: nothing follows there
                if behind >= 1:
                    power[:, i] += self.push[:, i, m] * warm[:, behind]
            power[:, i] += self.pull[:, i, 0] * drop[:, i - 1] + self.pull[:, i, 1] * drop[:, i]
        flow.shear[:] = flow.sliding + flow.driven * power[..., None]
        return flow

    def solve(self, change, start=None):
        """Temperatures of the line at a change, and the factors of the last sweep."""
        t = np.full((*self.shape, NZ + 1), T_IN) if start is None else start.copy()
        t[1, 1:-1, [0, -1]] = self.t_wall[1, 1:-1].T
        if start is None:
            self.t_base = t
        heat = HeatTransport.empty(3, X, NZ)
        h, q, moved = self.h + UNIT_H * change.h, np.zeros(self.shape), np.inf
        for _ in range(60):
            moved = energy.sweep(
                X, WIDTH, H_Y, False, h, CONDUCTIVITY, T_IN, self.flow(change, t), self.face, t.copy(), False, True,
                True, t, heat, q, q.copy(), np.zeros((*self.shape, 4)),
            )  # fmt: skip
            if moved < 1e-11:
                break
        assert moved < 1e-9
        heat.pull[:], heat.push[:], heat.wedge_h[:] = self.pull, self.push, self.wedge_h
        return t, heat


@dataclass(frozen=True)
class Part:
    """What changes: pressure, gap, both; rising: oil also passes between the levels."""

    p: float
    h: float
    rising: bool


PARTS = {
    "pressure": Part(1.0, 0.0, True),
    "gap": Part(0.0, 1.0, False),
    "both": Part(1.0, 1.0, False),
}


@pytest.mark.parametrize("part", PARTS.values(), ids=PARTS)
@pytest.mark.parametrize("where", ["everywhere", 2, 5])
def test_follow_is_the_derivative_of_the_temperatures(part, where):
    """Central differences of solutions; a wider gap with no flow between the levels, whose conduction it shares."""
    channel = Channel(part.rising)
    rng = np.random.default_rng(2)
    still = Changes(np.zeros((3, NX)), np.zeros((3, NX)))
    base, _ = channel.solve(still)
    # what follows is counted from the solution, where the power is the given one
    channel.t_base = base
    base, heat = channel.solve(still, base)
    assert np.ptp(base[1]) > 20.0
    direction = Changes(part.p * rng.normal(size=(3, NX)), part.h * rng.normal(size=(3, NX)))
    if where != "everywhere":
        for field in direction:
            field[:, np.arange(NX) != where] = 0.0
    eps = 1e-5
    plus, minus = (
        channel.solve(Changes(sign * eps * direction.p, sign * eps * direction.h), base)[0]
        for sign in (1.0, -1.0)
    )
    measured = (plus - minus)[1] / (2.0 * eps)
    found = np.full(base.shape, np.nan)
    transport.follow(heat, channel.g, channel.dg, channel.by_t, UNIT, UNIT_H, direction.p, direction.h, found)
    scale = np.abs(measured).max()
    assert scale > 0.1  # K per unit
    np.testing.assert_allclose(found[1], measured, atol=1e-6 * scale)
    np.testing.assert_array_equal(found[..., [0, -1]], 0.0)
    if where == 5:
        # carried downstream; upstream only the face before the node and the wedge ahead of it
        assert np.abs(measured[7]).max() > 1e-3 * scale
        np.testing.assert_array_equal(found[1, :4], 0.0)


@pytest.mark.parametrize("rheology", ["newtonian", "eyring"])
@pytest.mark.parametrize(("law", "p"), [("roelands", 1.2e9), ("barus", 6e8)])
@pytest.mark.parametrize("part", ["pressure", "gap"])
def test_temperatures_follow_in_a_sheared_film(law, p, part, rheology):
    """The factors with a real oil, against solutions at another pressure and gap: Couette flow, no gradient."""
    model = OIL.model_copy(update={"pressure_law": law, "rheology": rheology})
    table, h = oil_table(model, T_IN), 2e-7
    nz, shape = 48, (3, 9)
    x, h_y = np.linspace(0.0, 2e-3, 9), 1e-3
    width = np.diff(np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]]))
    ones, zero = np.ones(shape), np.zeros(shape)
    # a shear-thinning oil takes more sliding for the same heat
    slip = 0.2 if rheology == "newtonian" else 3.0
    speeds = film_flow.SurfaceSpeeds((1.0 + 0.5 * slip) * ones, (1.0 - 0.5 * slip) * ones, zero, zero)
    ends = np.ones(3, dtype=np.int64), np.full(3, 8, dtype=np.int64)
    face = energy.FaceFlow.empty(*ends, 9, nz)
    face.x[:] = 1e-4 * HEAT

    def solve(p, h):
        flow, heat = film_flow.FilmFlow.empty(*shape, nz), HeatTransport.empty(3, x, nz)
        t, change = np.full((*shape, nz + 1), 320.0), np.inf
        for _ in range(60):
            film_flow.film_flow(table, x, p * ones, h * ones, t, speeds, flow)
            # the same pressure everywhere: without compression
            flow.squeeze[:] = 0.0
            change = energy.sweep(
                x, width, h_y, True, h * ones, CONDUCTIVITY, 320.0, flow, face, t.copy(), False, True, True, t,
                heat, zero.copy(), zero.copy(), np.zeros((*shape, 4)),
            )  # fmt: skip
            if change < 1e-8:
                break
        assert change < 1e-8
        return t, heat

    base, heat = solve(p, h)
    rise = base.max() - 320.0
    assert rise > 5.0
    d_p, d_h = (1e5, 0.0) if part == "pressure" else (0.0, 1e-4 * h)
    moved = 0.5 * (solve(p + d_p, h + d_h)[0] - solve(p - d_p, h - d_h)[0])
    found = np.empty_like(base)
    transport.follow(heat, ones, zero, np.zeros((*shape, 3, nz + 1)), 1.0, 1.0, d_p * ones, d_h * ones, found)
    # more heat and less conduction cancel in a wider gap of a Newtonian oil: measured by either
    scale = max(np.abs(moved).max(), rise * d_h / h)
    # layers of trapezoidal weight in the sweep, of fourth order in the flow
    np.testing.assert_allclose(found[:2, 1:-1], moved[:2, 1:-1], atol=3e-3 * scale)
    if part == "pressure":
        assert found[1, 4].max() > 1e-9 * d_p  # K/Pa: viscosity and heat rise with the pressure


# --- the same as dense matrices ------------------------------------------------------------------------------------


class Line:
    """Random factors of all lines; those of the columns are stable, as elimination leaves them."""

    def __init__(self, seed=5):
        rng = np.random.default_rng(seed)
        self.heat = HeatTransport.empty(NY, X, NZ)
        for name in (
            "source",
            "squeeze",
            "lift",
            "widen",
            "up_1",
            "up_2",
            "lower",
            "upper",
            "weight",
            "stress",
        ):
            getattr(self.heat, name)[:] = rng.normal(size=(NY, NX, NZ - 1))
        self.heat.pivot[:] = 0.1 + 0.3 * rng.random((NY, NX, NZ - 1))
        self.heat.pull[:] = rng.normal(size=(NY, NX, 2))
        self.heat.push[:] = 0.3 * rng.normal(size=(NY, NX, 4))
        self.heat.wedge_h[:] = rng.random((NY, NX))
        self.g, self.dg = rng.normal(size=(2, NY, NX))
        self.by_t = rng.normal(size=(NY, NX, 3, NZ + 1))
        self.same_line = rng.normal(size=(NX, NX))
        self.unit, self.unit_h = 1.7, 0.6

    def follow(self, d_p, d_h):
        out = np.full((NY, NX, NZ + 1), np.nan)
        transport.follow(self.heat, self.g, self.dg, self.by_t, self.unit, self.unit_h, d_p, d_h, out)
        return out

    def response(self, j, squash=None):
        squash = np.zeros((NY, NX)) if squash is None else squash
        far_phi, far_g = np.full((2, NX, NX), np.nan)
        columns = np.full((3 * NZ + 2, NX), np.nan)
        transport.line_response(
            self.heat, j, self.g, self.dg, self.by_t, self.unit, self.unit_h, squash, self.same_line, columns, far_phi,
            far_g,
        )  # fmt: skip
        return far_phi, far_g

    def change(self, d_t, j):
        out = np.full((3, NX), np.nan)
        transport.film_change(self.by_t, d_t, j, out)
        return out


@pytest.mark.parametrize("rough", [False, True], ids=["smooth", "rough"])
@pytest.mark.parametrize("j", range(NY))
def test_line_response_is_follow_of_every_pressure(j, rough):
    """Its columns: one unit of pressure at a node, the gap of the line by its own deflection, and the asperities."""
    line = Line()
    squash = np.zeros((NY, NX))
    if rough:
        squash[:, 1:-1] = -np.random.default_rng(21).random((NY, NX - 2))
    far_phi, far_g = line.response(j, squash)
    assert rough == (np.abs(far_phi - line.response(j)[0]).max() > 0.01 * np.abs(far_phi).max())
    for k in range(NX):
        d_p, d_h = np.zeros((2, NY, NX))
        d_h[j] = line.same_line[:, k]
        d_p[j] = -squash[j] * d_h[j]
        d_p[j, k] += 1.0
        phi, g, _ = line.change(line.follow(d_p, d_h), j)
        np.testing.assert_allclose(far_phi[:, k], phi, rtol=1e-10, atol=1e-12 * np.abs(far_phi).max())
        np.testing.assert_allclose(far_g[:, k], g, rtol=1e-10, atol=1e-12 * np.abs(far_g).max())
    # dense: by deflection every node answers to every pressure
    assert np.count_nonzero(far_phi[1:-1]) == (NX - 2) * NX
    np.testing.assert_array_equal(far_phi[[0, -1]], 0.0)


def test_without_deflection_pressures_act_downstream():
    line = Line()
    line.same_line[:] = 0.0
    far_phi, far_g = line.response(LINE)
    # the pressure drop to the next node and its wedge flux are the only ones from downstream
    for far in (far_phi, far_g):
        np.testing.assert_array_equal(np.triu(far, 2), 0.0)
        assert np.all(np.tril(far, 1)[2:-1, 0] != 0.0)


def test_lines_follow_on_their_own():
    """Neighbour lines are held: a change on one line stays there."""
    line, rng = Line(), np.random.default_rng(9)
    d_p, d_h = np.zeros((2, NY, NX))
    d_p[LINE], d_h[LINE] = rng.normal(size=(2, NX))
    found = line.follow(d_p, d_h)
    assert np.abs(found[LINE, 1:-1, 1:-1]).min() > 0.0
    np.testing.assert_array_equal(np.delete(found, LINE, axis=0), 0.0)


def test_without_factors_nothing_follows():
    ny, nx = 3, 7
    d_p, d_h = np.random.default_rng(1).normal(size=(2, ny, nx))
    for heat, levels in ((HeatTransport.none((ny, nx)), 2), (HeatTransport.empty(ny, X[:nx], NZ), NZ + 1)):
        found = np.full((ny, nx, levels), np.nan)
        field, by_t = np.ones((ny, nx)), np.ones((ny, nx, 3, levels))
        transport.follow(heat, field, field, by_t, 1.0, 1.0, d_p, d_h, found)
        np.testing.assert_array_equal(found, 0.0)


def test_film_change_is_the_sum_over_the_levels():
    line, d_t = Line(), np.random.default_rng(3).normal(size=(NY, NX, NZ + 1))
    for j in range(NY):
        twin = np.einsum("imk,ik->mi", line.by_t[j], d_t[j])
        np.testing.assert_allclose(line.change(d_t, j), twin, rtol=1e-12, atol=1e-13)


def test_difference_of_compression_is_that_of_the_quadratic():
    """back_1, back_2: over the pressure of the node, what those upstream weigh in dp/dx; none next to the border."""
    heat, weights = HeatTransport.empty(2, X, NZ), upstream_weights(X)
    np.testing.assert_allclose(heat.back_1, weights[:, 1], rtol=1e-12)
    np.testing.assert_allclose(heat.back_2, weights[:, 2], rtol=1e-12)
    # exact for a straight line, whose differences to the node are those of x
    slope = X[2:] + heat.back_1[2:] * X[1:-1] + heat.back_2[2:] * X[:-2]
    own = 1.0 / (X[2:] - X[1:-1]) + 1.0 / (X[2:] - X[:-2])
    np.testing.assert_allclose(slope * own, 1.0, rtol=1e-11)
