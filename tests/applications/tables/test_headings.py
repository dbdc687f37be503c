"""Headings of measurement files: quantity and unit, or one line with what is allowed."""

import math

import pytest
from scipy import constants

from ballscrew_tehl.applications.calibration.measurements import read_measurement_file
from ballscrew_tehl.applications.tables.headings import (
    ANGLE,
    CURRENT,
    FORCE,
    LENGTH,
    MEASURED,
    SPEED,
    TIME,
    TORQUE,
    TORQUES,
    VELOCITY,
    VOLTAGE,
    quantity_of,
    si,
)

#: heading, value as written, quantity, SI; conversion factors of NIST SP 811
CASES = """
preload_kN; 2; preload; 2000
preload [lbf]; 100; preload; 444.82216152605
speed [rev/s]; 1; speed; 6.283185307179586
temperature_c; 30; temperature; 303.15
oil temperature [degF]; 86; temperature; 303.15
torque [N cm]; 40; torque; 0.4
speed [min^-1]; 60; speed; 6.283185307179586
axial load [kN]; -0.5; axial_load; -500
torque_uncertainty [%]; 2; torque_uncertainty; 0.02
Moment in N.cm; 40; torque; 0.4
Drehzahl / 1/min; 60; speed; 6.283185307179586
torque [lb-in]; 10; torque; 1.129848290276167
torque [ft-lb]; 10; torque; 13.558179483314004
torque [kgf m]; 1; torque; 9.80665
speed [krpm]; 0.06; speed; 6.283185307179586
"""
REFUSED = """
preload [kp]; speed [r/min]; torque [N.m] => column 'preload [kp]': unit 'kp'; allowed: N, kN, daN, kgf, lbf
preload; speed [r/min]; torque [N.m] => column 'preload': unit missing; write preload [UNIT] with one of N, kN
preload [N]; speed [1/s]; torque [N.m] => column 'speed [1/s]': unit '1/s' may be of turns or radians: state [r/s]
preload [N]; speed [r/min]; torque [N.m]; temprature_c => column 'temprature_c' unknown; is temperature meant?
preload [N]; speed [r/min] => column torque missing (found: preload [N], speed [r/min]); allowed:
preload [N]; speed [r/min]; torque [N.m]; measured_Nm => columns 'torque [N.m]' and 'measured_Nm' both are torque
preload [N]; speed [r/min]; torque [N.m]; weight; torque_uncertainty [%] => columns weight and torque_uncertainty
"""


def test_a_heading_gives_quantity_and_factor():
    for line in CASES.strip().splitlines():
        heading, value, key, expected = line.split("; ")
        found, unit = quantity_of(heading, TORQUES)
        assert found == key
        assert math.isclose(si(float(value), MEASURED[key], unit), float(expected), rel_tol=1e-12), line


def test_ambiguous_headings_are_refused(tmp_path):
    for line in REFUSED.strip().splitlines():
        headings, message = line.split(" => ")
        path = tmp_path / "x.csv"
        path.write_text(f"{headings}\n{'1;' * headings.count(';')}1\n")
        with pytest.raises(ValueError, match=r"allowed|write|meant") as caught:
            read_measurement_file(path, 300.0)
        assert message in str(caught.value)


#: SI value of the parts of a unit, by scipy.constants; masses stand for their weights
PARTS = {
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": constants.inch, "inch": constants.inch,
    "ft": constants.foot, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": constants.minute, "h": constants.hour,
    "d": constants.day, "N": 1.0, "kN": 1e3, "daN": 10.0, "dN": 0.1, "mN": 1e-3, "cN": 1e-2, "kgf": constants.kgf,
    "kg": constants.kgf, "lbf": constants.lbf, "lb": constants.lbf, "lbs": constants.lbf, "oz": constants.lbf / 16.0,
    "ozf": constants.lbf / 16.0, "rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": constants.degree,
    "mdeg": 1e-3 * constants.degree, "A": 1.0, "mA": 1e-3, "V": 1.0, "mV": 1e-3,
    **dict.fromkeys(("rev", "r", "turn", "turns", "rot", "U", "Umdr"), 2.0 * math.pi),
}  # fmt: skip


def test_factors_are_those_of_their_parts():
    families = FORCE, SPEED, VELOCITY, TORQUE, LENGTH, ANGLE, TIME, CURRENT, VOLTAGE
    tried = set()
    for unit, (factor, offset) in (item for family in families for item in family.items()):
        above, _, below = unit.partition("/")
        names = [*above.split("."), below or "s"]
        if all(name in PARTS for name in names):
            expected = math.prod(PARTS[name] for name in names[:-1]) / PARTS[names[-1]]
            assert (factor, offset) == (pytest.approx(expected, rel=1e-12), 0.0), unit
            tried.add(unit)
    assert {"m/min", "inch/min", "rev/min", "lbf.ft", "oz.in", "kgf", "h", "mrad"} <= tried
    assert len(tried) > 70
