"""The validation table: rows, mean deviations, recovered preload, text."""

import itertools

import pytest
from reference_screw import published_rows

from ballscrew_tehl.friction.sets import FrictionSet, friction_set_text
from ballscrew_tehl.validation.tables import ASSUMED_TEMPERATURE, table_text, validation_tables


def measured_exactly(preload, speed, temperature):
    """A model that equals every measured torque: piecewise linear through the printed points."""
    assert temperature == ASSUMED_TEMPERATURE
    rpm = speed * 30.0 / 3.141592653589793
    if rpm > 101.0:
        for row in published_rows("zhao2023/table4_torque_vs_speed.csv"):
            if abs(float(row["speed_rpm"]) - rpm) < 1e-6:
                return float(row["measured_Nm"])
    knots = [(0.0, 0.0)] + [
        (float(row["preload_N"]), float(row["measured_Nm"]))
        for row in published_rows("zhao2023/table2_torque_vs_preload.csv")
    ]
    for (x_0, y_0), (x_1, y_1) in itertools.pairwise(knots):
        if preload <= x_1 or x_1 == knots[-1][0]:
            return y_0 + (y_1 - y_0) * (preload - x_0) / (x_1 - x_0)
    raise AssertionError(preload)


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


def test_deviation_is_the_mean_of_magnitudes():
    tables = validation_tables(lambda *point: 1.1 * measured_exactly(*point))
    assert tables[0].deviations[0] == pytest.approx(0.1, rel=1e-9)
    assert tables[1].deviations[0] == pytest.approx(0.1, rel=1e-9)
    assert 0.05 < tables[2].deviations[0] < 0.15


def test_text_shows_every_row_and_the_means(tables):
    lines = table_text(tables["table2"]).splitlines()
    assert len(lines) == 9
    assert lines[1].split() == ["preload", "speed", "measured", "this", "model", "Zhao", "Zhou", "NSK"]
    assert lines[2].split() == ["1000", "N", "100", "0.409", "0.4090", "0.4160", "0.3990", "0.2550"]
    assert lines[-1].split()[-8:] == ["0.00", "%", "1.59", "%", "4.15", "%", "35.32", "%"]


def test_friction_set_text_names_values_intervals_and_errors():
    entry = FrictionSet(
        "three_parameter", "published", "solved", 7.5, 0.005, 24e-9, "least_squares",
        intervals={"apparent_viscosity_ratio": 0.5, "roughness_height": 14e-9},
        errors={"mean": 0.0124, "leave_one_out_mean": 0.02},
        leave_one_table_out={"table2": {"mean": 0.1, "max": 0.2}},
        correlations={"a, b": 0.98},
    )  # fmt: skip
    text = friction_set_text([entry])
    for part in (
        "published, three_parameter (film: solved, loss: least_squares)",
        "7.5 +- 0.5", "24 nm +- 14 nm", "mean 1.24 %", "leave_one_out_mean 2.00 %",
        "fitted without table2: missed by 10.0 % on average, 20.0 % at most", "correlation a, b: 0.98",
        "Only the total torque is identified",
    ):  # fmt: skip
        assert part in " ".join(text.split()), part
