"""The validation table: mean deviations of the printed models and of one that is known, range of a map."""

import numpy as np
import pytest
from reference_screw import published_rows

from ballscrew_tehl.applications.calibration.measured_screw import validation_tables


def test_deviations_of_printed_models_and_of_a_torque_proportional_to_the_preload():
    tables = {
        table.name: table for table in validation_tables(lambda preload, speed, temperature: 8e-4 * preload)
    }
    # Zhao, Zhou, NSK; percent
    stated = {"table2": (1.59, 4.15, 35.3), "table4": (1.17, 38.1, 60.4), "table3": (2.19,)}
    for name, figures in stated.items():
        assert len(tables[name].rows) == 6
        for found, figure in zip(tables[name].deviations[1:], figures, strict=False):
            assert round(100.0 * found, len(str(figure).split(".")[1])) == figure
    for name, file, torque in (("table2", "table2_torque_vs_preload", "measured_Nm"),
                               ("table3", "table3_preload_from_torque", "torque_Nm")):  # fmt: skip
        rows = [(float(r["preload_N"]), float(r[torque])) for r in published_rows(f"zhao2023/{file}.csv")]
        over = [8e-4 * force / value if name == "table2" else value / (8e-4 * force) for force, value in rows]
        assert tables[name].deviations[0] == pytest.approx(np.mean(np.abs(np.array(over) - 1.0)), rel=1e-6)
