"""Headings of measurement files: quantity and unit, or one line with what is allowed."""

import math

import pytest

from ballscrew_tehl.calibration.measurement_units import QUANTITIES, Column, _letters, column_of, columns_of

#: heading, value as written, quantity, SI; conversion factors of NIST SP 811
CASES = [
    ("preload [N]", 2.0, "preload", 2.0),
    ("Preload (kN)", 2.0, "preload", 2000.0),
    ("preload_n", 2.0, "preload", 2.0),
    ("preload_kN", 2.0, "preload", 2000.0),
    ("preload [lbf]", 100.0, "preload", 444.82216152605),
    ("preload [kgf]", 10.0, "preload", 98.0665),
    ("speed [r/min]", 60.0, "speed", 2.0 * math.pi),
    ("speed [1/min]", 60.0, "speed", 2.0 * math.pi),
    ("speed_rpm", 60.0, "speed", 2.0 * math.pi),
    ("SPEED [rad/s]", 3.0, "speed", 3.0),
    ("speed_rad_s", 3.0, "speed", 3.0),
    ("speed [rev/s]", 1.0, "speed", 2.0 * math.pi),
    ("temperature [degC]", 30.0, "temperature", 303.15),
    ("temperature [\u00b0C]", 30.0, "temperature", 303.15),
    ("temperature_c", 30.0, "temperature", 303.15),
    ("oil temperature [degF]", 86.0, "temperature", 303.15),
    ("temperature [K]", 30.0, "temperature", 30.0),
    ("torque [N.m]", 0.4, "torque", 0.4),
    ("torque_nm", 0.4, "torque", 0.4),
    ("torque_Nm", 0.4, "torque", 0.4),
    ("measured_Nm", 0.4, "torque", 0.4),
    ("friction torque [mNm]", 400.0, "torque", 0.4),
    ("torque [N\u00b7m]", 0.4, "torque", 0.4),
    ("torque [Ncm]", 40.0, "torque", 0.4),
    ("torque [lbf.in]", 10.0, "torque", 1.129848290276167),
    ("axial load [kN]", -0.5, "axial_load", -500.0),
    ("axial-load [N]", -0.5, "axial_load", -0.5),
    ("torque_uncertainty_nm", 0.01, "torque_uncertainty", 0.01),
    ("torque_uncertainty [%]", 2.0, "torque_uncertainty", 0.02),
]


@pytest.mark.parametrize(("heading", "value", "key", "si"), CASES)
def test_a_heading_gives_quantity_and_factor(heading, value, key, si):
    column = column_of(heading)
    assert column.key == key
    assert column.si(value) == pytest.approx(si, rel=1e-12)


def test_a_unit_after_a_name_has_one_meaning():
    for quantity in QUANTITIES.values():
        factors = {}
        for unit, factor in quantity.units.items():
            assert factors.setdefault(_letters(unit), factor) == factor, unit


def test_columns_without_unit_and_unknown_ones():
    assert column_of("weight") == Column("weight", "weight")
    assert column_of("operator") is None
    assert column_of("zhao_Nm") is None


NEEDED = ["preload [N]", "speed [r/min]", "torque [N.m]"]


@pytest.mark.parametrize(
    ("headings", "message"),
    [
        (["preload [kp]", *NEEDED[1:]], "column 'preload [kp]': unit 'kp'; allowed: N, kN, daN, kgf, lbf"),
        (["preload [n]", *NEEDED[1:]], "unit 'n'; allowed: N, kN"),
        ([*NEEDED[:2], "torque [nm]"], "unit 'nm'; allowed: N.m, Nm"),
        ([*NEEDED[:2], "torque [MNm]"], "unit 'MNm'; allowed: N.m, Nm"),
        (["preload", *NEEDED[1:]], "column 'preload': unit missing; write preload [UNIT] with one of N, kN"),
        (
            [NEEDED[0], "speed_hz", NEEDED[2]],
            "column 'speed_hz': unit 'hz'; write speed [UNIT] with one of r/min",
        ),
        ([*NEEDED, "temp [K]"], "column 'temp [K]' unknown; is temperature meant?"),
        ([*NEEDED, "temprature_c"], "column 'temprature_c' unknown; is temperature meant?"),
        (NEEDED[:2], "column torque missing (found: preload [N], speed [r/min]); allowed:"),
        ([*NEEDED, "measured_Nm"], "columns 'torque [N.m]' and 'measured_Nm' both are torque; allowed: one"),
        (
            [*NEEDED, "weight", "torque_uncertainty [%]"],
            "columns weight and torque_uncertainty; allowed: one",
        ),
    ],
)
def test_ambiguous_headings_are_refused(headings, message):
    with pytest.raises(ValueError, match=r"allowed|write") as caught:
        columns_of(headings)
    assert message in str(caught.value)
