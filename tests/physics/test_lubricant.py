"""Viscosity and density laws: printed values, points, slopes by difference, limits."""

import math
from importlib import resources

import numpy as np
import pytest

from ballscrew_tehl.parameters.file import changed, load_screw
from ballscrew_tehl.physics.lubricant import (
    eta0,
    pressure_viscosity,
    relative_density,
    section_2_3,
    temperature_slope,
    viscosity,
)

LAWS = ("section_2_3", "roelands_printed", "astm_d341", "constant")


def oil(law, **values):
    if law == "astm_d341":
        with resources.as_file(resources.files("ballscrew_tehl") / "data" / "example_25x10.toml") as path:
            return changed(load_screw(path), lubricant=values).lubricant
    return changed(load_screw(), lubricant={"viscosity_law": law, **values}).lubricant


def test_roelands_printed_is_equation_7():
    lub = oil("roelands_printed")
    p, T, T_0, level = 1.2e9, 350.0, 303.0, math.log(0.033) + 9.67
    s0_roelands = 0.032 * (T_0 - 138) / level
    bracket = (1 + 5.1e-9 * p) ** 0.58 * ((T - 138) / (T_0 - 138)) ** -s0_roelands - 1
    assert viscosity(lub, p, T) == pytest.approx(0.033 * math.exp(level * bracket), rel=1e-12)
    assert temperature_slope(lub, T_0) == pytest.approx(-0.032, rel=1e-12)


def test_printed_numbers_of_section_2_3_and_points_of_astm_d341():
    # 0.297 Pa s at 303 K, 0.033 at 343 K, slope 0.073 1/K
    assert section_2_3(303.0) == pytest.approx(0.297, abs=0.0005)
    assert section_2_3(343.0) == pytest.approx(0.033, abs=0.0005)
    assert temperature_slope(oil("section_2_3"), 303.0) == pytest.approx(-0.073, abs=0.0005)
    lub = oil("astm_d341", density_temperature=0.0)
    for T, nu in ((313.15, 100e-6), (373.15, 11.1e-6)):
        assert eta0(lub, T) == pytest.approx(nu * 890.0, rel=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_slopes_by_temperature_and_pressure_are_the_derivatives(law):
    lub, dT, dp = oil(law), 1e-3, 1e3
    for T in (251.0, 290.0, 303.0, 343.0, 420.0):
        by_difference = (math.log(eta0(lub, T + dT)) - math.log(eta0(lub, T - dT))) / (2 * dT)
        assert temperature_slope(lub, T) == pytest.approx(by_difference, rel=1e-6, abs=1e-11)
        for pressure_law in ("roelands", "barus"):
            other = oil(law, pressure_law=pressure_law)
            by_difference = math.log(viscosity(other, dp, T) / viscosity(other, 0.0, T)) / dp
            assert pressure_viscosity(other, T) == pytest.approx(by_difference, rel=1e-4)


def test_dowson_higginson_both_printed_forms():
    p = np.array([0.0, 1e7, 1e9, 4e9])
    # the two forms in use are rounded differently: 0.9 % apart at 4 GPa
    other = (5.9e8 + 1.34 * p) / (5.9e8 + p)
    assert relative_density("dowson_higginson", p) == pytest.approx(other, rel=9e-3)
    assert relative_density("dowson_higginson_590", p) == pytest.approx(other, rel=1e-14)
    assert relative_density("dowson_higginson", 0.0) == 1.0
    assert relative_density("dowson_higginson", 1e15) == pytest.approx(1 + 0.6 / 1.7, rel=1e-6)


def test_bad_temperature():
    for T in [0.0, 25.0, 183.0, math.nan, math.inf]:
        lub, said = (
            oil("section_2_3"),
            r"is 298.15 K meant" if T == 25.0 else r"is \d+.15 K meant|is it in kelvin",
        )
        for function in (eta0, temperature_slope, pressure_viscosity):
            with pytest.raises(ValueError, match=said):
                function(lub, T)
        with pytest.raises(ValueError, match=said):
            viscosity(lub, 0.0, T)
