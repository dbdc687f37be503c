"""A pair of support bearings: equilibrium of its rows, printed numbers of makers, what a printed torque says, range."""

import subprocess
import sys

import numpy as np
import pytest

from ballscrew_tehl import bearing_pair, load_screw
from ballscrew_tehl.applications.axis.bearing_pair import pair_of
from ballscrew_tehl.applications.axis.bearing_row import balls_of, row_forces
from ballscrew_tehl.applications.axis.parts import other_parts
from ballscrew_tehl.parameters.axis import SupportBearingParameters
from ballscrew_tehl.parameters.file import graded_oil
from ballscrew_tehl.parameters.units import RPM

ROOM, SLOW = 298.15, 5.0 * RPM
NAMES = "bore", "outer_diameter", "dynamic_rating", "axial_stiffness", "preload", "ball_diameter", "balls"
NSK = dict(zip(NAMES, (0.030, 0.062, 29200.0, 1.03e9, 3350.0), strict=False))
INA = dict(zip(NAMES, (0.035, 0.072, 45000.0, 9e8), strict=False))
#: BS 220, 230, 260
SNFA = [
    dict(zip(NAMES, printed, strict=True))
    for printed in (
        (0.020, 0.047, 18200.0, 7.2e8, 2300.0, 6.35e-3, 13), (0.030, 0.062, 24600.0, 1e9, 3600.0, 7.14e-3, 16),
        (0.060, 0.110, 58050.0, 1.85e9, 10400.0, 11.11e-3, 19),
    )
]  # fmt: skip


@pytest.fixture(scope="module")
def nsk():
    return bearing_pair(**NSK)


def test_rows_share_preload_and_load(nsk):
    """Rigid rings: F_b - F_a = P and F_a^(2/3) + F_b^(2/3) = 2 F^(2/3) until the relieved row is free at 2^1.5 F."""
    screw, F = nsk.row.parameters.screw, nsk.row.preload
    for load in (1.0, 0.3 * F, 0.6 * F, 2.8 * F):
        a, b = row_forces(screw, F, load)
        assert b - a == pytest.approx(load, rel=1e-9)
        assert a ** (2 / 3) + b ** (2 / 3) == pytest.approx(2.0 * F ** (2 / 3), rel=1e-9)
        assert row_forces(screw, F, -load) == (a, b)
    assert row_forces(screw, F, 3.0 * F) == pytest.approx((0.0, 3.0 * F), rel=1e-12)
    alone = nsk.torque(0.0, SLOW, ROOM).rows
    ratios = [nsk.torque(x * F, SLOW, ROOM).rows / alone for x in (0.3, -0.6, 1.2)]
    assert ratios == pytest.approx([1.01, 1.04, 1.16], abs=0.005)


@pytest.mark.parametrize("printed", SNFA)
def test_numbers_of_snfa_both_ways(printed):
    pair = bearing_pair(**printed)
    assert pair.axial_stiffness == pytest.approx(printed["axial_stiffness"], rel=0.02)
    assert pair.dynamic_rating == pytest.approx(printed["dynamic_rating"], rel=0.03)
    unprinted = SupportBearingParameters(**printed | {"ball_diameter": None, "balls": None})
    found = balls_of(unprinted, 0.78)[:2]
    assert found == pytest.approx((printed["ball_diameter"], printed["balls"]), rel=0.03)


def test_torque_of_an_axis_with_contact_seals():
    """Rows at 10 to 3000 r/min, VG 100, 30 C, of a budget of the axis, with half of the printed 0.60 N.m as seals."""
    speeds, rows = np.array([10.0, 100.0, 1000.0, 3000.0]) * RPM, [0.29, 0.20, 0.38, 0.45]
    given = INA | {"friction_torque": 0.6, "seals": "contact"}
    free, pair = bearing_pair(**INA, iso_vg=100), bearing_pair(**given, iso_vg=100)
    found = pair.torque(0.0, speeds, 303.15)
    assert free.torque(0.0, speeds, 303.15).rows == pytest.approx(rows, rel=0.05)
    assert found.rows == pytest.approx(rows, rel=0.05)
    assert pair.seals == pytest.approx((0.3, 0.2, 0.45))
    assert found.total == pytest.approx(found.rows + 0.3)
    assert found.rolling + found.sliding + found.hysteresis == pytest.approx(found.rows, rel=1e-12)
    # at 3000 r/min the film is starved
    assert (found.in_range, "replenishment" in found.why) == (False, True)
    assert pair.torque(0.0, speeds[:3], 303.15).in_range
    assert pair.table(speeds, np.array([303.15]))[:, 0] == pytest.approx(found.rows, rel=1e-12)
    of_many = np.geomspace(*speeds[[0, 3]], 40)
    many, one = pair.torque(0.0, of_many, 303.15), pair.torque(0.0, float(of_many[17]), 303.15)
    assert (many.low[17], many.high[17]) == pytest.approx((one.low, one.high), rel=0.01)
    # the same by a screw file, in its oil
    tables = {"support_bearings": SupportBearingParameters(**given), "lubricant": graded_oil(100, 95.0)}
    screw = load_screw("example_25x10.toml").model_copy(update=tables)
    parts = other_parts(screw, speeds, 303.15)
    assert parts["support_bearings"].torque == pytest.approx(found.rows, rel=1e-9)
    assert pair_of(screw) is pair_of(screw)


def test_a_printed_torque_conditions_the_boundary_friction(nsk):
    """BS 230, 0.19 N.m: mu 0.080; a film that carries all has the torque of before."""
    free, pair, measured = (
        bearing_pair(**SNFA[1], friction_torque=torque) for torque in (None, 0.19, (0.189, 0.191))
    )
    before, slow, fast = (of.torque(0.0, SLOW, ROOM) for of in (free, pair, measured))
    assert (slow.rows, fast.rows) == (pytest.approx(0.19, rel=1e-4), pytest.approx(0.19, rel=1e-4))
    assert pair.row.parameters.friction.boundary_friction == pytest.approx(0.080, abs=5e-4)
    # a number counts within a factor of 1.5, a range as it is
    assert slow.high / slow.low >= 1.5**2 > 1.2 > fast.high / fast.low
    assert before.high / before.low > slow.high / slow.low
    thick = [of.torque(0.0, 1000.0 * RPM, ROOM).rows for of in (free, pair)]
    assert thick[0] == pytest.approx(thick[1], rel=0.01)
    # impossible: the nearer end of its bounds, and a level that reaches from the law to what is printed
    far = bearing_pair(0.012, 0.042, dynamic_rating=18600.0, axial_stiffness=375e6, friction_torque=0.08)
    found = far.torque(0.0, SLOW, ROOM)
    assert far.row.parameters.friction.boundary_friction == 0.15
    assert found.rows == pytest.approx(0.08, rel=1e-3)
    law = bearing_pair(0.012, 0.042, dynamic_rating=18600.0, axial_stiffness=375e6).torque(0.0, SLOW, ROOM)
    assert law.rows < found.low < 0.5 * found.rows < 1.5 * found.rows < found.high
    assert "the printed numbers do not fit" in far.notes[-1]


def test_range_and_refusals(nsk):
    assert "viscosity" in nsk.torque(0.0, 1.0, 600.0).why
    assert "speed" in nsk.torque(0.0, 9000.0 * RPM, 330.0).why
    assert "pressure" in nsk.torque(4e5, 1.0, ROOM).why
    cold = bearing_pair(**NSK, iso_vg=150)
    fast, slow = (cold.torque(0.0, n * RPM, 293.15) for n in (3000.0, 100.0))
    # a starved row does not fall with speed
    assert (fast.rows > slow.rows, fast.in_range, slow.in_range) == (True, False, True)
    refused = (
        ({"bore": 0.07}, "outer_diameter = 0.062 m; "), ({"bore": 30.0}, "bore = 30.0 m; "),
        ({"dynamic_rating": None}, "dynamic_rating .missing; "), ({"dynamic_rating": 1e6}, "dynamic_rating = 1000000"),
        ({"dynamic_rating": 47000.0}, "fill .* not "), ({"friction_torque": (0.3, 0.2)}, "friction_torque = "),
        ({"friction_torque": 0.2, "friction": {"boundary_friction": 0.1}}, "friction = boundary_friction; "),
        ({"preload": None, "axial_stiffness": None}, "preload = None N; "), ({"seals": "lip"}, "seals = lip; "),
        ({"oil": graded_oil(68, 95.0).model_copy(update={"pressure_law": "barus"})}, "pressure_law = barus"),
    )  # fmt: skip
    for change, line in refused:
        with pytest.raises(ValueError, match=line) as found:
            bearing_pair(**NSK | change)
        assert "\n" not in str(found.value)
    for place in ((np.nan, 1.0, ROOM), (0.0, 0.0, ROOM), (0.0, 1.0, 40.0)):
        with pytest.raises(ValueError, match="; needs "):
            nsk.torque(*place)


def test_without_numba():
    text = (
        "import sys; sys.modules['numba'] = None\nfrom ballscrew_tehl import bearing, bearing_pair\n"
        f"print(bearing_pair(**{NSK}).torque(0.0, 1.0, 300.0).in_range)\n"
        "print(bearing(0.06, 0.0123, 14, 0.7, 0.52, 0.52).torque(1e3, 1.0, 300.0).total > 0.0)"
    )
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "True"]
