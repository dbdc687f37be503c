"""Measured torques: merging; the packaged copies equal the published tables."""

import math

import pytest
from reference_screw import published_rows

from ballscrew_tehl.calibration.csv_table import read_rows
from ballscrew_tehl.calibration.measurements import (
    PACKAGED_PRELOAD,
    PACKAGED_TORQUE,
    Measurement,
    merged,
    packaged_measurements,
)
from ballscrew_tehl.parameters.units import RPM


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


def test_a_merged_point_names_all_its_rows():
    a = Measurement(1000.0, 10.0, 303.0, 0.4, ("a",), rows=(1,))
    b = Measurement(1000.0, 10.0, 303.0, 0.4, ("b",), rows=(7,))
    assert merged([a, b])[0].rows == (1, 7)
    assert merged([a, b])[0].point == "row 1 = 7 (1000 N, 95.493 r/min)"


def test_missing_file_is_one_line(tmp_path):
    with pytest.raises(ValueError, match=r"nowhere.csv: cannot be read .*; give a CSV file"):
        read_rows(tmp_path / "nowhere.csv")
