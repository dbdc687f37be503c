"""Linearisation of the film by differences: Newton's matrix, its lines, temperatures that follow."""

import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl.contact.film import flow as film_flow
from ballscrew_tehl.contact.film import transport
from ballscrew_tehl.contact.film.flow import oil_table
from ballscrew_tehl.contact.film.geometry import TARGET_LOAD, ContactGeometry, ReynoldsState
from ballscrew_tehl.contact.film.linear import Film, Linearisation, times
from ballscrew_tehl.contact.grid import GridChoice

GEOMETRIES = {
    "circle": (GridChoice(-3.0, 1.8, 1.6, 33, 7, 0.2), 1.0),
    "ellipse, open side": (GridChoice(-3.0, 1.8, 1.6, 33, 9, 0.2, open_side=True), 0.1),
}
N_Z, P_MAX = 5, 4e8


class State:
    """A thick, warm film, cavitated behind the contact, with random factors of its heat."""

    def __init__(self, choice, ratio):
        self.geometry = geometry = ContactGeometry(choice, ratio)
        grid, rng = geometry.grid, np.random.default_rng(11)
        shape = geometry.undeformed.shape
        p = geometry.embed((0.9 / (1.0 + grid.x**2 + grid.y[:, None] ** 2))[grid.inner])
        self.p = np.where((grid.x > 1.1) & (p > 0.0), -1e-7, p)
        self.h_0 = 0.6 - float(geometry.gap(np.maximum(self.p, 0.0), 0.0).min())
        self.t = 303.15 + 30.0 * rng.random((*shape, N_Z + 1))
        self.table = oil_table(OIL, 303.15)
        heat = self.heat = transport.HeatTransport.empty(shape[0], grid.x, N_Z)
        inner = heat.source.shape
        # kelvins by the largest pressure, by the gap and by the flow; half of it from the column upstream
        heat.source[:], heat.squeeze[:] = 3.0 / P_MAX * rng.normal(size=(2, *inner))
        heat.widen[:] = 3e6 * rng.normal(size=inner)
        heat.lift[:], heat.push[:], heat.pull[:] = rng.random(inner), rng.normal(), rng.normal()
        heat.wedge_h[:] = geometry.gap(self.p, self.h_0)
        heat.up_1[:], heat.up_2[:], heat.pivot[:] = 0.6, -0.1, 1.0
        heat.lower[..., 1:], heat.upper[..., :-1] = -0.2, -0.2
        heat.weight[:], heat.stress[:] = 0.1 * rng.random((2, *inner))

    def law(self, p, t):
        """Film coefficients at a pressure [p_max] and temperatures [K]."""
        speeds = film_flow.SurfaceSpeeds(1.4, 0.8)
        return film_flow.film_coefficients(self.table, P_MAX, p, t, speeds, 1.1, 1.0)

    def linear(self, d_p=0.0, d_h=0.0, squeeze=0.0, free=True):
        """Linearisation, at temperatures that have followed from the state, linearly as by the energy equation."""
        film, geometry = Film(self.law, P_MAX, 1e-6, self.t.copy(), self.heat), self.geometry
        gap = geometry.gap(self.p, self.h_0)
        if np.any(d_p) or d_h:
            linear = self.linear()
            gap = geometry.gap(self.p + d_p, self.h_0 + d_h)
            film.follow(
                linear.system, np.maximum(self.p + d_p, 0.0) - np.maximum(self.p, 0.0), gap - linear.gap
            )
        return Linearisation(
            geometry, ReynoldsState(self.p + d_p, self.h_0 + d_h, gap), film, 0.7, squeeze, free
        )

    def unbounded(self, d_p, d_h, squeeze):
        """Residual without the penalty, and the load: the function that the Jacobian differentiates."""
        found, inner = self.linear(d_p, d_h), self.geometry.grid.inner
        residual = found.residual + found.penalty * (self.p + d_p)
        residual[inner] -= (squeeze * found.g * found.gap)[inner]
        return np.append(residual, np.sum(self.geometry.weights * (self.p + d_p)))

    def random(self, seed=12):
        """Pressures on the inner nodes."""
        shape = self.geometry.undeformed[self.geometry.grid.inner].shape
        return self.geometry.embed(np.random.default_rng(seed).normal(size=shape))


@pytest.fixture(scope="module", params=GEOMETRIES.values(), ids=GEOMETRIES)
def state(request):
    return State(*request.param)


def test_jacobian_is_the_derivative_of_residual_and_load(state):
    """Film coefficients, deflection and load, with temperatures that follow the pressure."""
    for squeeze in (0.0, 5.0):
        linear = state.linear(squeeze=squeeze)
        assert (linear.penalty > 0.0).any()
        assert (linear.gap < 0.7).any()  # the safeguard of the gap acts as well
        for share, d_h in ((1.0, 0.0), (0.0, 0.7), (1.0, 0.7)):
            d_p = share * np.where(state.p < 0.0, 0.0, state.random())
            found = times(linear.system, np.append(d_p, d_h))
            plus, minus = (state.unbounded(s * 1e-6 * d_p, s * 1e-6 * d_h, squeeze) for s in (1.0, -1.0))
            difference = (plus - minus) / 2e-6 / np.append(linear.scale, TARGET_LOAD)
            # deflection of the Jacobian in single precision: 1e-6
            assert np.abs(found - difference).max() <= 1e-5 * np.abs(difference).max()
            assert found[-1] == pytest.approx(difference[-1], rel=1e-6, abs=1e-9)
