"""Rough contacts: load sharing against closed schemes, limits, Jacobian with asperities, cold and warm starts."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from contact_cases import MODULUS, OIL, R_X, R_Y, STEEL
from scipy.ndimage import binary_dilation

from ballscrew_tehl.contact.conditions import ContactConditions, SolverOptions
from ballscrew_tehl.contact.film import linear
from ballscrew_tehl.contact.film.reynolds import ReynoldsState
from ballscrew_tehl.contact.problem import ContactProblem
from ballscrew_tehl.contact.solve import solve_contact
from ballscrew_tehl.physics.asperity import Roughness, asperity_pressure, typical_roughness

CONTACTS = {
    "screw": ContactConditions(30.0, R_X, R_Y, 0.3, 0.3, 313.15, MODULUS),
    "circle": ContactConditions(30.0, 5e-3, 5e-3, 1.0, 1.0, 313.15, MODULUS),
}
#: sigma beta eta, sigma/beta: typical, and the stiffest asperities of the intervals in use
SURFACES = {"typical": (0.05, 1e-3), "stiff": (0.1, 1e-2)}


def solve(at, roughness=None, start=None, **options):
    at = replace(at, roughness=roughness)
    solution = solve_contact(at, OIL, STEEL, SolverOptions(**({"n_x": 97} | options)), start)
    assert solution.converged, solution.reason
    return solution


@lru_cache(maxsize=64)
def isothermal(contact, sigma_share, surface="typical"):
    """Solution of a roughness in films of the smooth contact, 0 = smooth."""
    at = CONTACTS[contact]
    if sigma_share == 0.0:
        return solve(at, thermal=False)
    sigma = sigma_share * isothermal(contact, 0.0).h_c
    return solve(at, typical_roughness(sigma, *SURFACES[surface]), thermal=False)


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("contact", CONTACTS)
def test_film_and_asperities_carry_the_load(contact, surface):
    solution = isothermal(contact, 2.0, surface)
    c, hertz = solution.conditions, solution.hertz
    area = solution.grid.load_weights * hertz.a * hertz.b
    film = np.maximum(solution.pressure - solution.asperity_pressure, 0.0)
    asperities = float(np.sum(area * solution.asperity_pressure))
    # load tolerance of the Newton steps; cavitated nodes pull with 1e-6 of p_max
    assert abs(float(np.sum(area * film)) + asperities - c.load) <= 2e-4 * c.load
    assert solution.asperity_load_share == pytest.approx(asperities / c.load, rel=1e-6)
    expected, _ = asperity_pressure(c.roughness, c.E_prime, solution.film[solution.grid.inner])
    np.testing.assert_allclose(solution.asperity_pressure[solution.grid.inner], expected, rtol=1e-6, atol=1.0)


@pytest.mark.parametrize("contact", CONTACTS)
def test_no_roughness_is_the_smooth_contact(contact):
    smooth = isothermal(contact, 0.0)
    other = solve(CONTACTS[contact], Roughness(0.0, 1e9, 1e-4), thermal=False)
    assert other.h_c == smooth.h_c
    np.testing.assert_array_equal(other.pressure, smooth.pressure)
    assert smooth.asperity_load_share == 0.0
    assert not smooth.asperity_pressure.any()


def test_a_vanishing_roughness_tends_to_the_smooth_contact():
    """And film and asperity share rise with the roughness."""
    smooth = isothermal("screw", 0.0)
    found = [isothermal("screw", s, "stiff") for s in (0.25, 0.5, 1.0, 2.0)]
    deviation = np.array([abs(s.h_c / smooth.h_c - 1.0) for s in found])
    share = np.array([s.asperity_load_share for s in found])
    assert np.min(np.diff(deviation[1:])) > 0.0
    assert np.min(np.diff(share)) > 0.0
    assert deviation[0] <= 1e-4
    assert share[0] <= 1e-4


@pytest.mark.parametrize("surface", SURFACES)
def test_cold_and_warm_starts_of_a_hot_film_agree(surface):
    at = replace(CONTACTS["screw"], u_1=1.1, u_2=0.9)
    smooth = solve(at, n_x=65)
    roughness = typical_roughness(2.0 * smooth.h_c, *SURFACES[surface])
    cold, warm = solve(at, roughness, n_x=65), solve(at, roughness, start=smooth, n_x=65)
    # a warm start keeps the extrapolation of the smooth film
    films = [s.h_c / (1.0 + s.extrapolation[0]) for s in (cold, warm)]
    assert films[0] == pytest.approx(films[1], rel=1e-3)
    assert cold.asperity_load_share == pytest.approx(warm.asperity_load_share, rel=1e-2)
    assert cold.h_c > smooth.h_c
    assert cold.temperature_rise > 1.0


@pytest.mark.parametrize("contact", CONTACTS)
def test_jacobian_is_the_derivative_of_the_residual(contact):
    """All pressures and the approach, the pressure of the asperities by the gap, away from cavitated nodes."""
    rough = isothermal(contact, 2.0, "stiff")
    options = SolverOptions(thermal=False, n_x=65)
    problem = ContactProblem(rough.conditions, OIL, STEEL, options)
    it = problem.solve_isothermal(problem.start(), 1e-5, 60)
    assert it.converged
    geometry, film, scale = problem.geometry, problem.isothermal_film, problem.scales.film_estimate
    system = geometry.linearise(it.state, film, scale).system
    inner, shape = geometry.grid.inner, it.state.p.shape
    assert np.min(system.squash) < -0.1
    d_p, d_h = np.zeros(shape), 0.3
    d_p[inner] = np.random.default_rng(3).normal(size=d_p[inner].shape)
    found = np.empty(d_p.size + 1)
    linear.times(system, np.append(d_p, d_h), np.zeros((*shape, 0)), np.zeros((6, *shape)), found)

    def residual(step):
        p, h_0 = it.state.p + step * d_p, it.state.h_0 + step * d_h
        moved = ReynoldsState(p, h_0, geometry.gap(p, h_0), it.state.cavitated)
        return geometry.linearise(moved, film, scale).residual / system.scale

    step = 1e-7
    difference = (residual(step) - residual(-step)) / (2.0 * step)
    # viscosity and density have a kink at the pressure of cavitation
    near = binary_dilation(it.state.p - problem.asperity_pressure(it.state) < 1e-4, np.ones((3, 5)))
    near[:, [0, -1]] = near[-1] = True
    assert np.sum(~near) > 100
    error = np.abs(found[:-1].reshape(shape) - difference)[~near]
    # deflection of the Jacobian in single precision
    assert np.max(error) <= 1e-5 * np.max(np.abs(difference[~near]))
