"""An oil by its grade: the standard's own examples, inverses, limits, bad input, the command."""

import json
import math

import numpy as np
import pytest
from command_line import run
from hypothesis import given
from hypothesis import strategies as st

from ballscrew_tehl.parameters import mineral_oil as oil_grade
from ballscrew_tehl.parameters.file import graded_oil
from ballscrew_tehl.parameters.mineral_oil import (
    ISO_GRADES,
    density_15c,
    density_at,
    density_slope,
    roelands_z,
    viscosity_at_100c,
    viscosity_index,
)
from ballscrew_tehl.parameters.oil import LubricantParameters
from ballscrew_tehl.parameters.toml import ParameterError
from ballscrew_tehl.physics.lubricant import ambient_density, eta0, pressure_viscosity


@pytest.mark.parametrize(
    ("U", "Y", "stated"), [(73.30, 8.86, 92.43), (22.83, 5.05, 156.37), (53.47, 7.80, 111)]
)
def test_examples_of_astm_d2270(U, Y, stated):
    """Procedures A, B and B again; the first two with the decimals that the standard prints on the way."""
    index = viscosity_index(1e-6 * U, 1e-6 * Y)
    assert round(index) == round(stated)
    assert index == pytest.approx(stated, abs=0.31)  # L and H by its equations instead of its table


def test_reference_viscosities_of_the_examples():
    # interpolated in the table of the standard: L = 119.94, H = 69.48 at 8.86; H = 28.97 at 5.05 mm2/s
    L, H = oil_grade._reference_oils(8.86)
    assert (pytest.approx(119.94, rel=1.2e-3), pytest.approx(69.48, rel=1.2e-3)) == (L, H)
    assert oil_grade._reference_oils(5.05)[1] == pytest.approx(28.97, rel=1.2e-3)


@given(index=st.floats(0.0, 400.0), grade=st.sampled_from(ISO_GRADES[2:]))
def test_viscosity_at_100c_has_the_index(index, grade):
    try:
        nu_100 = viscosity_at_100c(1e-6 * grade, index)
    except ValueError:
        assert grade <= 32
        return
    # the equations of two neighbouring intervals meet within 0.12 %
    assert viscosity_index(1e-6 * grade, nu_100) == pytest.approx(index, abs=0.31)


def test_procedures_meet_at_100():
    for Y in (3.0, 8.0, 20.0, 90.0):
        _, H = oil_grade._reference_oils(Y)
        below, above = (viscosity_index(1e-6 * H * (1.0 + step), 1e-6 * Y) for step in (1e-9, -1e-9))
        assert (below, above) == (pytest.approx(100.0, abs=1e-5), pytest.approx(100.0, abs=1e-5))


def test_higher_index_means_less_change_with_temperature():
    nu = [viscosity_at_100c(68e-6, index) for index in range(0, 400, 10)]
    assert np.all(np.diff(nu) > 0.0)


@pytest.mark.parametrize(
    ("nu_40", "nu_100"),
    [(68e-6, 1.9e-6), (8e-6, 9e-6), (math.nan, 8e-6), (math.inf, 8e-6), (68e-6, math.nan)],
)
def test_no_index_is_defined(nu_40, nu_100):
    with pytest.raises(ValueError, match="no index is"):
        viscosity_index(nu_40, nu_100)


def test_index_outside_the_range_of_the_grade():
    with pytest.raises(ValueError, match=r"viscosity_index = 5; allowed: 62\.08 to .* for 7 mm2/s"):
        viscosity_at_100c(7e-6, 5.0)
    with pytest.raises(ValueError, match="viscosity_index = 1e\\+06; allowed"):
        viscosity_at_100c(68e-6, 1e6)
    with pytest.raises(ValueError, match="viscosity_index = nan; allowed"):
        viscosity_at_100c(68e-6, math.nan)
    # the limits in the message are allowed
    assert viscosity_at_100c(7e-6, 62.09) == pytest.approx(2e-6, rel=1e-4)


@given(nu=st.floats(6e-6, 3e-3), vgc=st.floats(0.78, 0.95))
def test_density_has_its_viscosity_gravity_constant(nu, vgc):
    G, lg = 1e-3 * density_15c(nu, vgc), math.log10(1e6 * nu - 5.5)
    assert (G - 0.0664 - 0.1154 * lg) / (0.94 - 0.109 * lg) == pytest.approx(vgc, rel=1e-12)


def test_effect_of_the_constant_on_the_density():
    """As stated in the docstring of density_15c."""
    heavier = oil_grade.PARAFFINIC_VGC + oil_grade.VGC_TOLERANCE
    change = [density_15c(1e-6 * grade, heavier) / density_15c(1e-6 * grade) - 1.0 for grade in ISO_GRADES]
    assert np.all(np.diff(change) < 0.0)
    assert (round(change[0], 3), round(change[-1], 3)) == (0.022, 0.012)


def test_density_falls_by_its_slope():
    for T in (283.15, 313.15, 373.15):
        slope = -(density_at(880.0, T + 0.01) - density_at(880.0, T - 0.01)) / 0.02 / density_at(880.0, T)
        assert density_slope(880.0, T) == pytest.approx(slope, rel=1e-7)
    assert density_at(880.0, oil_grade.T_15C) == 880.0
    # ASTM D1250: K_1/rho = 0.000713 1/K
    assert density_slope(880.0, oil_grade.T_15C) == pytest.approx(7.134e-4, rel=1e-3)


def test_bad_viscosities():
    with pytest.raises(ValueError, match=r"> 5\.5 mm2/s"):
        density_15c(5e-6)
    for eta_40, eta_100 in ((0.01, 0.02), (0.01, 1e-4), (math.nan, 0.01), (0.01, math.nan)):
        with pytest.raises(ValueError, match="eta_40 > eta_100"):
            roelands_z(eta_40, eta_100)


# --- the oil of a screw file ---


@pytest.mark.parametrize("grade", ISO_GRADES)
@pytest.mark.parametrize("index", [0.0, 95.0, 150.0, 250.0])
def test_every_grade_gives_an_oil(grade, index):
    try:
        oil = graded_oil(grade, index)
    except ParameterError:
        assert (grade, index) == (7, 0.0)
        return
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
        "density": 900.0,
        "specific_heat": 2000.0,
        "thermal_conductivity": 0.15,
        "pressure_viscosity": 2e-8,
    }
    oil = LubricantParameters(name="mine", iso_vg=46, viscosity_index=100, **given)
    for name, value in given.items():
        assert getattr(oil, name) == value
    assert oil.viscosity == pytest.approx(46e-6 * 900.0, rel=1e-12)
    assert pressure_viscosity(oil, 313.15) == pytest.approx(2e-8, rel=1e-12)
    cooler = LubricantParameters(name="mine", iso_vg=46, viscosity_index=100, reference_temperature=293.15)
    as_such = graded_oil(46, 100.0)
    assert cooler.viscosity == pytest.approx(eta0(as_such, 293.15), rel=1e-3)
    assert cooler.z_roelands == pytest.approx(as_such.z_roelands, rel=1e-12)


def test_command_prints_the_oil_and_what_is_assumed(capsys):
    code, out, _ = run(capsys, "oil", "--iso-vg", "68", "--viscosity-index", "95", "--json")
    found, oil = json.loads(out), graded_oil(68, 95.0)
    assert code == 0
    assert [row["temperature_c"] for row in found["rows"]] == [20.0, 40.0, 60.0, 80.0, 100.0]
    for row in found["rows"]:
        T = row["temperature_c"] + 273.15
        assert row["viscosity_mpas"] == pytest.approx(1e3 * eta0(oil, T), rel=1e-12)
        assert row["alpha_per_gpa"] == pytest.approx(1e9 * pressure_viscosity(oil, T), rel=1e-12)
        assert row["agma_925_per_gpa"] < row["alpha_per_gpa"] < row["so_klaus_per_gpa"]
    assert found["rows"][1]["kinematic_viscosity_mm2_s"] == pytest.approx(68.0, rel=1e-12)
    text = "\n".join(found["assumed"])
    for part in (
        "61.2 to 74.8 mm2/s",
        "D2270",
        "D341",
        "within 0.05 %",
        "11 % rms, 24 %",
        "Cragoe",
        "0.82 +-0.02",
    ):
        assert part in text


def test_command_assumes_less_of_what_is_given(capsys):
    _, out, _ = run(capsys, "oil", "--iso-vg", "68", "--viscosity-index", "150", "--density-15c-kg-m3", "850")
    assert "paraffinic" not in out
    assert "an index above 120" in out
    assert "density_15c_kg_m3 = 850" in out


def test_printed_lines_for_the_screw_file_describe_that_oil(capsys, tmp_path):
    from test_parameters import EXAMPLE

    from ballscrew_tehl.parameters.file import load_parameters

    _, out, _ = run(capsys, "oil", "--iso-vg", "32", "--viscosity-index", "104.5")
    lubricant = out.split("For the screw file:\n")[1]
    before, rest = EXAMPLE.split("[lubricant]")
    path = tmp_path / "screw.toml"
    path.write_text(before + lubricant + "\n[friction]" + rest.split("[friction]")[1])
    assert load_parameters(path).lubricant == graded_oil(32, 104.5)
    code, out, _ = run(capsys, "oil", "--screw", str(path), "--json")
    assert (code, json.loads(out)["oil"]) == (0, "mineral oil ISO VG 32, viscosity index 104.5")


def test_command_shows_the_oil_of_a_screw_that_gives_numbers(capsys, tmp_path):
    from test_parameters import EXAMPLE

    path = tmp_path / "screw.toml"
    path.write_text(EXAMPLE)
    code, out, _ = run(capsys, "oil", "--screw", str(path))
    assert code == 0
    assert "example oil" in out
    assert "assumed" not in out


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["--iso-vg", "69", "--viscosity-index", "95"], ["iso_vg = 69", "46, 68, 100"]),
        (["--iso-vg", "7", "--viscosity-index", "9"], ["viscosity_index = 9", "62.08 to"]),
        (["--iso-vg", "68"], ["--viscosity-index", "(missing)"]),
        ([], ["--iso-vg", "(missing)", "--screw"]),
        (["--iso-vg", "68", "--viscosity-index", "nan"], ["viscosity_index = nan", "finite"]),
        (
            ["--iso-vg", "68", "--viscosity-index", "95", "--density-15c-kg-m3", "0.88"],
            ["0.88", ">= 600 kg_m3"],
        ),
        (["--screw", "x.toml", "--iso-vg", "68"], ["--screw", "give one oil"]),
        (["--screw", "no_such.toml"], ["no_such.toml: cannot be read"]),
    ],
)
def test_bad_input_is_one_line(capsys, arguments, parts):
    code, out, err = run(capsys, "oil", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    for part in parts:
        assert part in err
