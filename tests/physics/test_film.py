"""Film formulas against independent solutions, worked values and limits."""

import math

import numpy as np
import pytest
from reference_screw import GD4008, published_rows

from ballscrew_tehl.physics.film import (
    asperity_share,
    central_film_estimate,
    film_groups,
    thermal_load_parameter,
    wilson_sheu,
)
from ballscrew_tehl.physics.hertz import ellipse

REFERENCES = published_rows("film_references.csv")
ROELANDS = [row for row in REFERENCES if row["rheology"] == "comp-Roelands"]
OIL = GD4008.lubricant


def allowed(ratio):
    """Deviation of the formula by radius ratio, with the uncertainty of the solutions, 0.5 %."""
    if ratio == 1.0:
        return -0.036, 0.036
    return (-0.005, 0.09) if ratio > 0.05 else (-0.005, 0.12)


def test_compressible_estimate_against_solutions():
    """The oil of the references, scaled by load and speed to the given M and L."""
    for row in ROELANDS:
        M, L, ratio, Hc = (float(row[key]) for key in ("M", "L", "lambda", "Hc"))
        modulus, eta, alpha, R_x = 226e9, 0.04, 2.2e-8, 0.01
        U = 0.5 * (L / (alpha * modulus)) ** 4
        load = M * (2 * U) ** 0.75 * modulus * R_x**2
        groups = film_groups(load, U * modulus * R_x / eta, R_x, modulus, eta, alpha)
        assert (pytest.approx(M, rel=1e-12), pytest.approx(L, rel=1e-12)) == (groups.M, groups.L)
        p_max = ellipse(load, R_x, R_x / ratio, modulus).p_max
        h = central_film_estimate(OIL, groups, R_x, R_x / ratio, p_max, 303.0)
        # the density at the Hertz pressure is the whole difference to Barus: same bounds
        least, most = allowed(ratio)
        assert least <= h / R_x / math.sqrt(2 * U) / Hc - 1.0 <= most


def test_thermal_load_parameter():
    expected = 0.033 * 0.0728214 * 4.0**2 / 0.14
    assert thermal_load_parameter(OIL, 4.0, 303.0) == pytest.approx(expected, rel=1e-5)
    assert thermal_load_parameter(OIL, -4.0, 303.0) == thermal_load_parameter(OIL, 4.0, 303.0)


def test_thermal_factors_by_hand():
    assert wilson_sheu(1.0, 0.0) == pytest.approx(1 / 1.241, rel=1e-12)
    # srr = 2: one surface at rest, Z = 1
    assert wilson_sheu(1.0, 2.0) == pytest.approx(1 / (1 + 0.241 * 15.8), rel=1e-12)


def test_share_falls_from_all_without_a_film_to_nothing_in_a_thick_one():
    film = 2e-7 * np.geomspace(1e-9, 10.0, 200)
    share = asperity_share(film, 2e-7, 0.5)
    assert np.all(np.diff(share) <= 0.0)
    assert abs(share[0] - 1.0) <= 1e-12
    assert np.max(share[film >= 3.0 * 2e-7]) <= 0.01
    assert np.all(asperity_share(film, 0.0, 0.5) == 0.0)
