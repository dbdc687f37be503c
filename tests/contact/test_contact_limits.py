"""Limits, symmetries and scalings of the solved contact."""

import math

import numpy as np
import pytest
from contact_cases import CIRCLE, LONG, STEEL, conditions, moes, solved

from ballscrew_tehl.contact import ContactConditions, SolverOptions, reference_oil, solve


@pytest.mark.slow
@pytest.mark.parametrize(("ratio", "M"), [(CIRCLE, 2.0), (LONG, 5.0)])
def test_thick_film_is_that_of_rigid_bodies(ratio, M):
    """Low load, thin oil: Brewe, Hamrock & Taylor, J Lubr Technol 101 (1979) 231, rigid, one viscosity, flooded.

    H = 128 alpha lambda^2 [0.131 atan(alpha/2) + 1.683]^2 (U/W)^2, alpha = R_y/R_x, lambda = 1/(1 + 2/(3 alpha)).
    """
    alpha = 1.0 / ratio
    side = 1.0 / (1.0 + 2.0 / (3.0 * alpha))
    closed = 0.25 * 128.0 * alpha * side**2 * (0.131 * math.atan(0.5 * alpha) + 1.683) ** 2
    # a fit, 3 % stated; the film of the default domain is 3 % thin on the circle
    assert moes(M, 0.01, ratio, "barus").Hc * M**2 == pytest.approx(closed, rel=0.06)


@pytest.mark.slow
def test_swapped_bodies_give_the_same_film_and_the_opposite_traction():
    """The film is turned over: z = 0 is then the other body."""
    for thermal in (True, False):
        one, other = (
            solved(conditions(load=3.0, srr=srr), thermal=thermal, tolerance=1e-6) for srr in (0.7, -0.7)
        )
        assert other.grid_film == pytest.approx(one.grid_film, rel=1e-4)
        # extrapolated from grids of half the nodes, which are solved to 3e-4
        assert (other.h_c, other.h_m) == pytest.approx((one.h_c, one.h_m), rel=3e-4)
        assert other.traction_force == pytest.approx(-one.traction_force, rel=2e-3)
        assert one.traction_force > 0.0  # drags body 2 towards the faster body 1
        if thermal:
            gap = np.abs(other.temperature[:, :, ::-1] - one.temperature)
            assert gap.max() <= 5e-3 * one.temperature_rise


@pytest.mark.slow
def test_film_of_a_slow_contact_is_isothermal():
    slow = conditions(load=0.05, u_e=1e-2, srr=1.0)
    thermal, isothermal = solved(slow), solved(slow, thermal=False)
    assert 0.0 < thermal.temperature_rise < 0.05
    # the trapezoidal rule takes 1/n_z^2 off the fluidity of the film, and the film follows with a power of 0.7
    assert 0.0 <= thermal.h_c / isothermal.h_c - 1.0 + 1e-4 < 0.8 / 8**2
    assert thermal.traction_force == pytest.approx(isothermal.traction_force, rel=0.02)


def test_film_in_moes_units_depends_on_M_and_L_alone():
    """Another size, modulus and oil with the same M and L (Barus, incompressible: no further number)."""
    M, L, ratio = 100.0, 5.0, 0.2
    E, R_x, alpha, eta0 = 1.1e11, 3e-3, 1.3e-8, 0.2
    oil = reference_oil("barus").model_copy(update={"pressure_viscosity": alpha, "viscosity": eta0})
    two_u = (L / (alpha * E)) ** 4
    u_e = 0.5 * two_u * E * R_x / eta0
    at = ContactConditions(M * two_u**0.75 * E * R_x**2, R_x, R_x / ratio, u_e, u_e, 313.15, E)
    other = solve(at, oil, STEEL, SolverOptions(thermal=False, n_x=65, n_y=17))
    np.testing.assert_allclose([other.M, other.L], [M, L], rtol=1e-9)
    reference = moes(M, L, ratio, "barus", n_x=65, n_y=17)
    assert other.h_c / (R_x * math.sqrt(two_u)) == pytest.approx(reference.Hc, rel=1e-4)
    assert other.h_m / (R_x * math.sqrt(two_u)) == pytest.approx(reference.Hm, rel=1e-4)
