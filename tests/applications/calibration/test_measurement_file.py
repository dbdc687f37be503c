"""Files of measured torques: spellings of CSV, impossible rows, rows implausible for a screw of this size."""

import math

import pytest

from ballscrew_tehl.applications.calibration.measurements import Measurement, read_measurement_file

HEAD = "preload [N],speed [r/min],temperature [degC],torque [N.m]\n"
GOOD = "1000,60,30,0.4\n"
POINT = Measurement(1000.0, 2.0 * math.pi, 303.15, 0.4)


@pytest.fixture
def csv_file(tmp_path):
    def write(text, encoding="utf-8"):
        path = tmp_path / "measured.csv"
        path.write_bytes(text.encode(encoding))
        return path

    return write


def test_spellings_of_one_point(csv_file):
    for text, encoding in [
        ("\ufeff# bench 3\n\n" + HEAD + "\n# warm\n" + GOOD + ",,,\n", "utf-8"),
        (
            "sep=;\npreload [kN];speed [U/min];temperature [\u00b0C];torque [N\u202fm]\r\n1;60;30;0,4\r\n",
            "utf-8",
        ),
        ("preload [kN]\tspeed [1/min]\ttemperature [\u00b0C]\ttorque [Nm]\n1,0\t60\t30\t0,4\n", "utf-16"),
        (
            "torque [mNm];comment;preload [N];speed [rad/s];\u00d6ltemperatur [K]\n"
            f"-400;new;1e3;{-2.0 * math.pi!r};303.15\n",
            "cp1252",
        ),
    ]:
        (found,) = read_measurement_file(csv_file(text, encoding), 300.0).measurements
        assert found.rows == (1,)
        for name in ("preload", "speed", "temperature", "torque", "weight", "axial_load"):
            assert getattr(found, name) == pytest.approx(getattr(POINT, name), rel=1e-14), name


def test_uncertainties_become_weights(csv_file):
    head = "preload_n,speed_rpm,temperature_c,torque_nm,"
    rows = ("1000,60,30,0.4,{}\n", "1000,600,30,0.5,{}\n", "1000,900,30,1.0,{}\n")
    for name, values in (("torque_uncertainty [%]", (1, 2, 4)), ("uncertainty [mNm]", (4.0, 10.0, 40.0))):
        lines = "".join(r.format(x) for r, x in zip(rows, values, strict=True))
        found = read_measurement_file(csv_file(f"{head}{name}\n{lines}"), 300.0)
        assert [m.weight for m in found.measurements] == pytest.approx([2.0, 1.0, 0.5])
        assert [m.uncertainty for m in found.measurements] == pytest.approx([0.004, 0.01, 0.04])


def test_minimum_and_maximum_of_both_directions_are_a_tolerance(csv_file):
    head = "preload [N],speed [r/min],torque_low [N.m],torque_high [N.m],torque [N.m],preload_tolerance [%]\n"
    rows = "1000,60,0.3,0.5,,10\n1000,-60,-0.35,-0.55,-0.4,\n1000,60,,,0.4,\n1000,60,0.3,,0.4,\n1000,60,0.3,0.5,0.6,\n"
    found = read_measurement_file(csv_file(head + rows), 300.0).with_tolerances(0.2, 0.05)
    values = [(m.torque, *m.limits, m.preload_tolerance) for m in found.measurements]
    assert values == [
        pytest.approx(x) for x in [(0.4, 0.3, 0.5, 0.1), (0.4, 0.35, 0.55, 0.05), (0.4, 0.32, 0.48, 0.05)]
    ]
    assert [problem.row for problem in found.problems] == [4, 5]
    bare = read_measurement_file(
        csv_file("preload_n,speed_rpm,torque_low_nm,torque_high_nm\n900,-60,-0.3,-0.5\n"), 300.0
    )
    assert bare.without_seals(0.1).measurements[0].limits == pytest.approx((0.2, 0.4))


IMPOSSIBLE = """
0,60,30,0.4 => preload = 0 N; allowed: > 0
1000,0,30,0.4 => speed = 0 r/min; allowed: not 0 (no film at rest)
1000,60,30,0 => torque = 0 N.m; allowed: not 0
1000,60,30,-0.4 => torque = -0.4 N.m at speed = 60 r/min; allowed: friction torque with the sign of the
1e999,60,30,0.4 => preload = '1e999' N; allowed: a finite number
1000,,30,0.4 => speed = empty; allowed: a finite number
1000,60,-74,0.4 => temperature = -74 degC; allowed: 200 to 473.15 K (-73.15 to 200 degC)
1000,60,303,0.4 => temperature = 303 degC; allowed: 200 to 473.15 K (-73.15 to 200 degC); probably K, not
"""


def test_impossible_rows_are_named_with_the_reason(csv_file):
    for line in IMPOSSIBLE.strip().splitlines():
        row, reason = line.split(" => ")
        found = read_measurement_file(csv_file(HEAD + GOOD + "# comment\n" + row + "\n"), 300.0)
        (problem,) = found.problems
        assert str(problem).startswith(f"row 2 (line 4): {reason}")
        assert len(found.measurements) == 1
