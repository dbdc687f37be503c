"""The validation table: rows, mean deviations, recovered preload, text."""

import pytest
from reference_screw import published_rows
from scipy.interpolate import make_interp_spline

from ballscrew_tehl import load_map, load_screw
from ballscrew_tehl.calibration.measured_screw import (
    ASSUMED_TEMPERATURE,
    NEEDED,
    is_measured,
    validation_tables,
)


def measured_exactly(preload, speed, temperature):
    """A model that equals every measured torque: piecewise linear through the printed points."""
    assert temperature == ASSUMED_TEMPERATURE
    rpm = speed * 30.0 / 3.141592653589793
    if rpm > 101.0:
        for row in published_rows("zhao2023/table4_torque_vs_speed.csv"):
            if abs(float(row["speed_rpm"]) - rpm) < 1e-6:
                return float(row["measured_Nm"])
    rows = published_rows("zhao2023/table2_torque_vs_preload.csv")
    knots, torques = ([0.0, *(float(row[name]) for row in rows)] for name in ("preload_N", "measured_Nm"))
    return float(make_interp_spline(knots, torques, k=1)(preload))


@pytest.fixture(scope="module")
def tables():
    return {table.name: table for table in validation_tables(measured_exactly)}


def test_a_model_equal_to_the_measurement_has_no_deviation(tables):
    assert [len(tables[name].rows) for name in ("table2", "table4", "table3")] == [6, 6, 6]
    for table in tables.values():
        assert table.deviations[0] == pytest.approx(0.0, abs=1e-9)


def test_published_models_have_their_recomputed_deviations(tables):
    # Zhao, Zhou, NSK; percent
    stated = {"table2": (1.59, 4.15, 35.3), "table4": (1.17, 38.1, 60.4), "table3": (2.19,)}
    for name, figures in stated.items():
        for found, figure in zip(tables[name].deviations[1:], figures, strict=False):
            digits = len(str(figure).split(".")[1])
            assert round(100.0 * found, digits) == figure


def test_tables_come_from_a_map_with_their_range_only():
    axes = dict(load_map().header["axes"])
    assert is_measured(load_screw().screw, axes)
    for axis, (low, high) in NEEDED.items():
        for narrow in ((low, 0.999 * high), (1.001 * low, high)):
            assert not is_measured(load_screw().screw, {**axes, axis: narrow}), narrow
