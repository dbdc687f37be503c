"""Oil supply by geometry: the loss of the missing inlet by quadrature, its limits, and thermal solves without it."""

import math

import numpy as np
import pytest
from scipy.integrate import dblquad

from ballscrew_tehl.contact import SolverOptions, ball_conditions, solve
from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.film import FLOODED, hertz_gap, missing_loss, supply_factor
from ballscrew_tehl.physics.hertz import ellipse
from ballscrew_tehl.physics.lubricant import eta0

#: u_e [m/s], eta0 [Pa s], film, b, R_x, R_y [m]
LIGHT, HEAVY = (0.5, 0.1, 8e-7, 3e-5, 2e-3, 0.05), (5.0, 0.02, 3e-7, 1.5e-4, 2.6e-3, 0.03)


@pytest.mark.parametrize("contact", [LIGHT, HEAVY])
def test_missing_loss_is_the_power_of_the_wedge_that_is_not_there(contact):
    """u_e int h dp/dx dA with p = c x/h^2, slope by differences; the quadrature is good to 2e-4."""
    u_e, viscosity, film, b, R_x, R_y = contact
    for length in (3.0, 10.0):
        X = length * b
        c = 12.0 * viscosity * u_e / (3.0 + 2.0 * R_x / R_y)
        least = film + float(hertz_gap(length, b, R_x))

        def gap(x, y, X=X, least=least):
            return least + 0.5 * (x**2 - X**2) / R_x + 0.5 * y**2 / R_y

        def lost(y, x, gap=gap, c=c):
            step = 1e-4 * x
            before, after = x - step, x + step
            slope = c * (before / gap(before, y) ** 2 - after / gap(after, y) ** 2) / (2.0 * step)
            return u_e * gap(x, y) * slope

        expected = 2.0 * dblquad(lost, X, R_x, 0.0, R_x, epsrel=1e-6)[0]
        assert abs(float(missing_loss(length, *contact)) / expected - 1.0) <= 5e-4


def test_more_supply_is_more_loss_up_to_the_flooded_one():
    load, loss, beyond = 100.0, 2.0 * float(missing_loss(6.0, *HEAVY)), HEAVY[4] / HEAVY[3]
    factors = [float(supply_factor(length, load, loss, *HEAVY)) for length in (2.0, 3.0, 6.0, 12.0, beyond)]
    assert factors[0] > 0.0
    assert np.all(np.diff(factors) > 0.0)
    for length, error in ((beyond, 1e-3), (1e3, 1e-3), (FLOODED, 0.0)):
        assert abs(float(supply_factor(length, load, loss, *HEAVY)) - 1.0) <= error


@pytest.mark.slow
@pytest.mark.parametrize("load", [17.0, 100.0])
def test_factor_is_that_of_contacts_solved_with_the_short_inlet(load):
    """Thermal, GD4008-3 with VG 100 at 500 r/min; found 1 % (17 N) and 1.3 % (100 N) at 6 b, 1 and 0 % at 10 b."""
    own = load_screw(PACKAGED_VG100)
    at = ball_conditions(own, "screw", load, 500.0 * RPM, 303.0)
    hertz = ellipse(load, at.R_x, at.R_y, at.E_prime)
    flooded = solve(at, own.lubricant, own.solid, SolverOptions(n_x=97))
    viscosity = eta0(own.lubricant, 303.0)
    for length in (6.0, 10.0):
        short = solve(
            at, own.lubricant, own.solid, SolverOptions(n_x=97, x_in=-length, y_max=at.R_x / hertz.a)
        )
        assert short.converged
        assert abs(short.heat_balance.defect) <= 1e-3
        factor = supply_factor(
            length, load, flooded.rolling_loss, at.u_e, viscosity, flooded.h_c, hertz.b, at.R_x, at.R_y
        )
        assert abs(math.log(float(factor) * flooded.rolling_loss / short.rolling_loss)) <= 0.05
