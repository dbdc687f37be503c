"""Generalised Reynolds integrals against the closed forms of a film whose viscosity falls exponentially through it."""

import math

import numpy as np
import pytest
from contact_cases import OIL

from ballscrew_tehl.contact import film_flow

#: eta = exp(-2 z/h), rho = 1: the integrals in closed form; e2 = exp(2)
E2 = math.exp(2.0)
CLOSED = {
    "1/e0": (E2 - 1.0) / 2.0,
    "1/e1": (E2 + 1.0) / 4.0,
    "r0": 1.0,
    "r1": (E2 - 3.0) / 4.0,
    "r2": 0.5,
}
#: the same as printed in the model notes, section 5 of the worked checks, to 6 decimals
PRINTED = {"1/e0": 3.194528, "1/e1": 2.097264, "r1": 1.097264, "r2": 0.5}
PRINTED_COMBINED = {"Poiseuille": 0.220373, "Couette": 0.343482}  # r1 e0/e1 - r2, e0 r1


def exponential_film(n_z):
    """Integrals for n_z layers: a viscosity table that is linear in T, and T linear in z."""
    oil = OIL.model_copy(
        update={"pressure_law": "barus", "density_law": "incompressible", "density_temperature": 0.0}
    )
    table = film_flow.oil_table(oil, 300.0)
    # ln eta = -2 (T - T_a)/100 K
    table = table._replace(ln_eta0=-0.02 * 0.25 * np.arange(table.ln_eta0.size))
    t = table.table_start + np.linspace(0.0, 100.0, n_z + 1)
    e0, e1, r0, r1, r2 = film_flow.column_integrals(table, 0.0, t, 1.0, 0.0)
    return {"1/e0": 1.0 / e0, "1/e1": 1.0 / e1, "r0": r0, "r1": r1, "r2": r2}


def combined(integrals):
    e0, e1 = 1.0 / integrals["1/e0"], 1.0 / integrals["1/e1"]
    return {"Poiseuille": integrals["r1"] * e0 / e1 - integrals["r2"], "Couette": integrals["r1"] * e0}


def extrapolated(n_z):
    """Richardson over two second-order values: good to n_z^-4."""
    coarse, fine = exponential_film(n_z), exponential_film(2 * n_z)
    return {name: (4.0 * fine[name] - coarse[name]) / 3.0 for name in fine}


def test_closed_forms_are_the_printed_numbers():
    for name, value in PRINTED.items():
        assert CLOSED[name] == pytest.approx(value, abs=5e-7), name
    for name, value in PRINTED_COMBINED.items():
        assert combined(CLOSED)[name] == pytest.approx(value, abs=5e-7), name


def test_layers_converge_to_six_digits():
    found = extrapolated(64)
    for name, value in (PRINTED | PRINTED_COMBINED).items():
        assert (found | combined(found))[name] == pytest.approx(value, abs=5e-7), name


@pytest.mark.parametrize("name", ["1/e0", "1/e1", "r1", "r2"])
def test_layers_converge_with_second_order(name):
    errors = [abs(exponential_film(n_z)[name] - CLOSED[name]) for n_z in (8, 16, 32, 64)]
    order = -np.polyfit(np.log([8, 16, 32, 64]), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.05)


def test_default_layers_hold_the_flow_within_three_percent():
    """What the trapezoidal rule leaves at 10 layers of this strongly sheared film."""
    found, exact = combined(exponential_film(10)), combined(CLOSED)
    for name, value in exact.items():
        assert found[name] == pytest.approx(value, rel=0.03), name
