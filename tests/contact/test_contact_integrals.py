"""Integrals of a contact that friction needs: rolling loss, forces on the walls, heat by part, means."""

import math

import numpy as np
import pytest
from contact_cases import conditions, solved
from scipy.integrate import dblquad

from ballscrew_tehl.contact.result import pressure_core, resistance_beyond, resistance_of_cells


def test_rolling_resistance_of_a_linear_wedge_is_exact():
    """p = x (1 - x), h = 1 + 2 (1 - x): integral of h dp/dx over 0..1 is 1/3, per width."""
    x = np.linspace(0.0, 1.0, 4001)
    found = resistance_of_cells(x, (x * (1.0 - x))[None], (3.0 - 2.0 * x)[None], np.array([0.5])).sum()
    assert abs(found - 0.5 / 3.0) <= 1e-7
    # exact for what is linear between the nodes
    x = np.array([0.0, 1.0, 3.0])
    assert resistance_of_cells(x, np.array([[0.0, 2.0, 2.0]]), x[None] + 1.0, np.array([1.0])).sum() == 3.0


@pytest.mark.parametrize("ratio", [0.03, 0.3, 1.0])
def test_resistance_beyond_is_that_of_the_far_pressure(ratio):
    """p = c |x|/h^2 by quadrature of h dp/dx between two rectangles."""
    R_x, R_y, shear, times = 1.0, 1.0 / ratio, 0.7, 3.0
    c = 12.0 * shear / (3.0 + 2.0 * ratio)
    X, Y = 2.0, 3.0
    x = np.concatenate((np.full(2000, -X), np.linspace(-X, 0.0, 2000)))
    y = np.concatenate((np.linspace(0.0, Y, 2000), np.full(2000, Y)))
    rise = 0.5 * (x**2 / R_x + y**2 / R_y)
    offset = 0.4 * rise.min()

    def integrand(y, x):
        h = 0.5 * (x**2 / R_x + y**2 / R_y) + offset
        return c * (2.0 * x**2 / (R_x * h**2) - 1.0 / h)

    outer = dblquad(integrand, -times * X, 0.0, 0.0, times * Y, epsrel=1e-8)[0]
    inner = dblquad(integrand, -X, 0.0, 0.0, Y, epsrel=1e-8)[0]
    found = resistance_beyond(x, y, rise + offset, R_x, R_y, shear, times)
    assert found == pytest.approx(outer - inner, rel=1e-4)


def test_a_given_meniscus_ends_the_rolling_loss():
    given = solved(conditions(srr=0.0), thermal=False, x_in=-2.0)
    assert given.resistance_beyond == 0.0
    flooded = solved(conditions(srr=0.0), thermal=False)
    assert 0.0 < flooded.resistance_beyond < flooded.rolling_resistance


def hertz_pressure(nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, pressure of 800 MPa over the unit circle and area of the nodes."""
    x = np.linspace(-1.2, 1.2, nodes)
    pressure = 8e8 * np.sqrt(np.maximum(1.0 - x**2 - x[:, None] ** 2, 0.0))
    return x, pressure, np.full(pressure.shape, (2.4 / (nodes - 1)) ** 2)


def test_core_of_a_hertz_pressure_is_the_ellipse():
    x, pressure, area = hertz_pressure(1201)
    largest, core = pressure_core(x, pressure, area)
    assert largest == pytest.approx(8e8, rel=1e-4)
    assert core == pytest.approx(math.pi, rel=1e-4)
    # a wide slope of low pressure hardly changes it
    largest, core = pressure_core(x, np.maximum(pressure, 1e7), area)
    assert largest == pytest.approx(8e8, rel=1e-3)
    assert core == pytest.approx(math.pi, rel=3e-3)
