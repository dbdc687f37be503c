"""Measured torques: reading, refusing, merging; the packaged copies equal the published tables."""

import math

import pytest
from reference_screw import published_rows

from ballscrew_tehl.measurements import (
    PACKAGED_PRELOAD,
    PACKAGED_TORQUE,
    RPM,
    Measurement,
    merged,
    packaged_measurements,
    read_measurements,
    read_rows,
)


@pytest.fixture
def csv_file(tmp_path):
    def write(text):
        path = tmp_path / "measured.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_packaged_tables_are_the_published_ones():
    packaged = read_rows(PACKAGED_TORQUE)
    for table, name in (("table2", "table2_torque_vs_preload"), ("table4", "table4_torque_vs_speed")):
        rows = [{k: v for k, v in row.items() if k != "table"} for row in packaged if row["table"] == table]
        assert rows == published_rows(f"zhao2023/{name}.csv")
    assert read_rows(PACKAGED_PRELOAD) == published_rows("zhao2023/table3_preload_from_torque.csv")


def test_the_point_of_both_tables_counts_once():
    points = packaged_measurements(303.0)
    assert len(points) == 11
    assert points[0] == Measurement(1000.0, 100.0 * RPM, 303.0, 0.409, ("table2", "table4"))
    assert pytest.approx(2.0 * math.pi / 60.0, rel=1e-15) == RPM
    assert [m.tables for m in points[1:]] == [("table2",)] * 5 + [("table4",)] * 5


def test_a_repeated_measurement_counts_twice():
    one = Measurement(1000.0, 10.0, 303.0, 0.4)
    assert len(merged([one, one])) == 2
    a, b = (Measurement(1000.0, 10.0, 303.0, 0.4, (name,)) for name in "ab")
    assert [m.tables for m in merged([a, a, b])] == [("a", "b"), ("a",)]
    other = Measurement(1000.0, 10.0, 303.0, 0.41, ("b",))
    assert len(merged([a, other])) == 2


def test_user_file_with_and_without_optional_columns(csv_file):
    path = csv_file("# a comment\npreload_N, speed_rpm, torque_Nm\n1000, 60, 0.4\n")
    assert read_measurements(path, 300.0) == [Measurement(1000.0, 2.0 * math.pi, 300.0, 0.4)]
    path = csv_file(
        "preload_N,speed_rpm,torque_Nm,temperature_degC,table,weight\n1e3,60,0.4,40,run1,2\n1e3,60,0.4,40,run2,2\n"
        "2e3,60,0.8,,,\n"
    )
    assert read_measurements(path, 300.0) == [
        Measurement(1000.0, 2.0 * math.pi, 313.15, 0.4, ("run1", "run2"), 2.0),
        Measurement(2000.0, 2.0 * math.pi, 300.0, 0.8),
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("preload_N,speed_rpm\n1,2\n", "column torque_Nm missing; allowed: preload_N"),
        ("preload_N,speed_rpm,torque_Nm,temp\n1,2,3,4\n", "column 'temp' unknown; allowed: preload_N"),
        ("preload_N,speed_rpm,torque_Nm\n", "no rows"),
        ("preload_N,speed_rpm,torque_Nm\n1,2\n", "row 1: 3 fields expected"),
        ("preload_N,speed_rpm,torque_Nm\n1,2,3,4\n", "row 1: 3 fields expected"),
        (
            "preload_N,speed_rpm,torque_Nm\n1,2,3\n1,two,3\n",
            "row 2: speed_rpm = 'two'; allowed: a number > 0",
        ),
        ("preload_N,speed_rpm,torque_Nm\n1,2,nan\n", "row 1: torque_Nm = 'nan'"),
        ("preload_N,speed_rpm,torque_Nm\n0,2,1\n", "row 1: preload_N = '0'; allowed: a number > 0"),
        ("preload_N,speed_rpm,torque_Nm,temperature_degC\n1,2,3,-200\n", "temperature_degC = '-200'"),
    ],
)
def test_bad_files_are_refused_with_the_place(csv_file, text, message):
    with pytest.raises(ValueError, match=r"measured\.csv") as caught:
        read_measurements(csv_file(text), 300.0)
    assert message in str(caught.value)


def test_missing_file_is_one_clear_line(tmp_path):
    with pytest.raises(ValueError, match=r"nowhere.csv: cannot be read .*; give a CSV file"):
        read_rows(tmp_path / "nowhere.csv")
