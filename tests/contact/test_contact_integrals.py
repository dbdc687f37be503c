"""Integrals of a contact that friction needs: rolling loss, forces on the walls, heat by part, means."""

import dataclasses

import numpy as np
import pytest
from contact_cases import OIL, STEEL, conditions, solved

from ballscrew_tehl.contact.integrals import rolling_resistance
from ballscrew_tehl.contact.moes import solve_moes
from ballscrew_tehl.contact.solve import SolverOptions, solve_contact
from ballscrew_tehl.physics.rolling_resistance import biboulet_houpert_point, rolling_power


def test_rolling_resistance_of_a_linear_wedge_is_exact():
    """p = x (1 - x), h = 1 + 2 (1 - x): integral of h dp/dx over 0..1 is 1/3, per width."""
    x = np.linspace(0.0, 1.0, 4001)
    found = rolling_resistance((x * (1.0 - x))[None], (3.0 - 2.0 * x)[None], np.array([0.5]))
    assert abs(found - 0.5 / 3.0) <= 1e-7
    # two nodes: the trapezoid is exact for what is linear between them
    assert rolling_resistance(np.array([[0.0, 2.0]]), np.array([[1.0, 3.0]]), np.array([1.0])) == 4.0


@pytest.mark.parametrize("n_z", [8, 16])
def test_pure_rolling_heats_the_film_by_the_rolling_loss(n_z):
    """Two integrals of different parts of the solution: h dp/dx, and the sources of the energy equation.

    -0.3 % found with 8 layers, -0.6 % with 16 and 32: by the nodes along rolling.
    """
    found = solve_contact(conditions(srr=0.0), OIL, STEEL, SolverOptions(n_x=193, n_z=n_z)).integrals
    assert found.rolling_loss > 0.0
    assert abs((found.shear_heat + found.compression_heat) / found.rolling_loss - 1.0) <= 0.01
    assert abs(found.compression_heat) <= 0.05 * found.shear_heat


def test_walls_share_the_rolling_resistance():
    found = solved(conditions(srr=0.3))
    walls = found.integrals
    assert walls.traction_force_1 + walls.traction_force_2 == pytest.approx(
        -walls.rolling_resistance, rel=1e-12
    )
    assert walls.traction_force_2 - walls.traction_force_1 == pytest.approx(
        2.0 * found.traction_force, rel=1e-12
    )
    at = found.conditions
    # both surfaces together lose what heats the film, without the compression
    lost = -(walls.traction_force_1 * at.u_1 + walls.traction_force_2 * at.u_2)
    assert abs(lost / walls.shear_heat - 1.0) <= 0.02


def test_reversed_rolling_reverses_the_forces():
    at = conditions(srr=0.3)
    there, back = (solved(c).integrals for c in (at, at.reversed()))
    assert back.rolling_loss == pytest.approx(there.rolling_loss, rel=1e-9)
    assert back.traction_force_1 == pytest.approx(-there.traction_force_1, rel=1e-9)
    assert back.traction_force_2 == pytest.approx(-there.traction_force_2, rel=1e-9)


def test_means_lie_between_the_extremes():
    solution = solved(conditions(srr=1.0))
    found = solution.integrals
    assert 0.0 < found.temperature_rise_mean < found.temperature_rise_smooth <= solution.temperature_rise
    assert solution.conditions.temperature < found.mean_temperature < solution.temperature.max()
    assert found.mean_viscosity > 0.0
    assert solution.share_below(0.0) == 0.0
    assert solution.share_below(np.inf) == pytest.approx(1.0, rel=1e-12)
    shares = [solution.share_below(share * solution.h_c) for share in (0.9, 1.0, 1.1)]
    assert shares == sorted(shares)
    assert shares[0] < shares[2]


def test_rolling_loss_of_elastic_contacts_is_near_the_closed_form():
    """Biboulet & Houpert 2010, where their elastic part prevails: 0.94 to 1.04 of it found on long ellipses.

    On a circle 0.74 to 0.83, and half of it where the rigid part counts, which their sum of both overestimates.
    """
    for M, ratio in ((1000.0, 0.2), (1000.0, 0.0353), (10000.0, 0.0353)):
        solution = solve_moes(M, 2.0, ratio, "barus", SolverOptions(thermal=False, n_x=97)).solution
        c = solution.conditions
        force = biboulet_houpert_point(c.load, c.u_e, c.R_x, c.R_y, c.E_prime, 0.04).force
        assert abs(solution.integrals.rolling_loss / rolling_power(force, c.u_e) - 1.0) <= 0.08


def test_refined_options_multiply_everything():
    options = SolverOptions(n_x=97, n_y=17)
    finer = options.refined(2.0)
    assert (finer.n_x, finer.n_y, finer.n_z) == (193, 33, 16)
    assert (finer.warm_films, finer.extent, finer.density) == (800.0, 2.0, 2.0)
    assert finer.tolerance == options.tolerance / 4.0
    assert dataclasses.replace(options).refined(1.0) == options
    for factor in (0.5, 9.0, np.nan):
        with pytest.raises(ValueError, match="refine = "):
            options.refined(factor)
