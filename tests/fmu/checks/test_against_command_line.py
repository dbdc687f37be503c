"""The packaged screw end to end: FMU in fmpy equals the command line over the published tables."""

import csv
import json
import math
import subprocess
import sys

import pytest
from paths import PUBLISHED

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.python_fmu.package import build_fmu
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters

pytestmark = pytest.mark.slow

DATA = PUBLISHED / "zhao2023"


def table(name):
    lines = (line for line in (DATA / name).read_text().splitlines() if not line.startswith("#"))
    return list(csv.DictReader(lines))


TORQUES = table("table2_torque_vs_preload.csv") + table("table4_torque_vs_speed.csv")
PRELOADS = table("table3_preload_from_torque.csv")


def command(name, rows, folder):
    points = folder / f"{name}.csv"
    with points.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    run = subprocess.run(
        [sys.executable, "-m", "ballscrew_tehl", name, "--points", str(points), "--json"],
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(run.stdout)


@pytest.fixture(scope="module")
def torques(tmp_path_factory):
    rows = [
        {"preload_n": r["preload_N"], "speed_rpm": r["speed_rpm"], "temperature_c": "29.85"} for r in TORQUES
    ]
    return command("torque", rows, tmp_path_factory.mktemp("points"))


def test_fmu_and_command_line_agree(torques, tmp_path):
    fmu = build_fmu(load_map(None, load_parameters()), tmp_path / "BallScrewFriction.fmu").path
    with FmuInstance(fmu) as instance:
        for row, point in zip(TORQUES, torques, strict=True):
            speed = float(row["speed_rpm"]) * math.pi / 30.0
            assert instance.step(preload=float(row["preload_N"]), speed=speed, temperature=303.0)
            found = instance.outputs()
            for name in ("friction_torque", "viscous_torque", "hysteresis_torque", "sliding_torque"):
                assert found[name] == pytest.approx(point[f"{name}_nm"], rel=1e-9)
            assert found["film_thickness_min"] == pytest.approx(point["film_thickness_min_m"], rel=1e-9)
            assert point["in_range"]


def test_mean_deviations_of_the_tables_are_those_of_the_publication_or_better(torques):
    """Bounds: deviations of the publication, recomputed from its printed tables."""
    errors = [
        abs(p["friction_torque_nm"] / float(r["measured_Nm"]) - 1.0)
        for r, p in zip(TORQUES, torques, strict=True)
    ]
    assert sum(errors[:6]) / 6 <= 0.0159
    assert sum(errors[6:]) / 6 <= 0.0117


def test_preload_of_table_3_is_recovered(tmp_path):
    rows = [{"torque_nm": r["torque_Nm"], "speed_rpm": "100", "temperature_c": "29.85"} for r in PRELOADS]
    found = command("preload", rows, tmp_path)
    errors = [abs(p["preload_n"] / float(r["preload_N"]) - 1.0) for r, p in zip(PRELOADS, found, strict=True)]
    assert sum(errors) / 6 <= 0.0219
