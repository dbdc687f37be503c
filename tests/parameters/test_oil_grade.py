"""An oil by its grade: the standard's own examples, inverses, limits."""

import itertools

import numpy as np
import pytest

from ballscrew_tehl.parameters.file import graded_oil
from ballscrew_tehl.parameters.mineral_oil import (
    ISO_GRADES,
    density_15c,
    density_at,
    roelands_z,
    viscosity_at_100c,
    viscosity_index,
)
from ballscrew_tehl.parameters.oil import LubricantParameters
from ballscrew_tehl.parameters.toml import ParameterError
from ballscrew_tehl.physics.lubricant import ambient_density, eta0, pressure_viscosity


def test_examples_of_astm_d2270():
    """Procedures A, B and B again; the first two with the decimals that the standard prints on the way."""
    for U, Y, stated in [(73.30, 8.86, 92.43), (22.83, 5.05, 156.37), (53.47, 7.80, 111)]:
        index = viscosity_index(1e-6 * U, 1e-6 * Y)
        assert round(index) == round(stated)
        assert index == pytest.approx(stated, abs=0.31)  # L and H by its equations instead of its table


def test_every_grade_gives_an_oil():
    with pytest.raises(ParameterError, match=r"viscosity_index = 0.*62\.08 to"):
        graded_oil(7, 0.0)
    for grade, index in itertools.product(ISO_GRADES, (63.0, 95.0, 250.0)):
        check_oil(grade, index, graded_oil(grade, index))


def check_oil(grade, index, oil):
    rho_15 = density_15c(1e-6 * grade)
    assert oil.density == density_at(rho_15, 313.15)
    assert eta0(oil, 313.15) == pytest.approx(1e-6 * grade * oil.density, rel=1e-12)
    assert eta0(oil, 373.15) == pytest.approx(
        viscosity_at_100c(1e-6 * grade, index) * ambient_density(oil, 373.15), rel=1e-12
    )
    # slope of the pressure law at p = 0
    assert pressure_viscosity(oil, 313.15) == pytest.approx(oil.pressure_viscosity, rel=1e-12)
    eta = [1e-6 * grade * oil.density, viscosity_at_100c(1e-6 * grade, index) * density_at(rho_15, 373.15)]
    assert oil.z_roelands == pytest.approx(roelands_z(*eta), rel=1e-12)
    assert 0.0 < oil.z_roelands < 1.5
    T = np.linspace(283.15, 373.15, 19)
    np.testing.assert_allclose(ambient_density(oil, T), density_at(rho_15, T), rtol=1e-3)


def test_given_values_take_precedence():
    given = {
        "density": 900.0, "specific_heat": 2000.0, "thermal_conductivity": 0.15, "pressure_viscosity": 2e-8,
    }  # fmt: skip
    oil = LubricantParameters(name="mine", iso_vg=46, viscosity_index=100, **given)
    for name, value in given.items():
        assert getattr(oil, name) == value
    assert oil.viscosity == pytest.approx(46e-6 * 900.0, rel=1e-12)
    assert pressure_viscosity(oil, 313.15) == pytest.approx(2e-8, rel=1e-12)
