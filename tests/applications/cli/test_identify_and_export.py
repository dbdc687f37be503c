"""The commands identify and export as a user runs them: answers, files, the way from a log to a calibration."""

import json
import re

import numpy as np
import pytest
from command_line import answer, run
from servo_log import CONSTANT, GAIN, GUIDES, MASS, PIECES, main

from ballscrew_tehl.nut_map.file import VG100, packaged_map
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw

MAP = ("--screw", PACKAGED_VG100, "--map", packaged_map(VG100))
AXIS = ("--torque-constant-nm-a", CONSTANT, "--guide-force-n", GUIDES)


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    main(folder)
    return folder


def test_linear_axis_has_the_keys_of_its_units(capsys, logs, tmp_path):
    found, _ = answer(capsys, "identify", logs / "emps.csv", "--gain-n-v", GAIN, "--plot", tmp_path / "x.png")
    assert found["mass_low_kg"] <= MASS <= found["mass_high_kg"]
    first = found["friction"][0]
    assert {"velocity_m_s", "force_n", "samples"} <= first.keys()
    assert first["force_low_n"] < first["force_n"] < first["force_high_n"] < 0.0 < -first["velocity_m_s"]
    assert {"offset_n", "contains"} <= found.keys()
    assert sum(found["left_out"].values()) + found["samples"] == pytest.approx(4 * sum(PIECES), rel=0.01)
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")


def test_from_a_log_to_preload_change_and_calibration(capsys, logs, tmp_path):
    found, _ = answer(capsys, "identify", logs / "now.csv", *AXIS, *MAP, "--before", logs / "before.csv")
    assert {"inertia_kgm2", "offset_nm"} <= found.keys()
    assert {"speed_rpm", "torque_nm", "torque_low_nm", "torque_high_nm"} <= found["friction"][0].keys()
    assert found["preload_low_n"] < 1800.0 < found["preload_high_n"]
    assert found["preload_ratio_low"] <= 0.9 <= found["preload_ratio_high"] < 1.0
    points, fit = tmp_path / "points.csv", tmp_path / "fit.toml"
    known = "--preload-n", "2000", "--lead-mm", "8", "--measurements", points
    answer(capsys, "identify", logs / "before.csv", *AXIS, *known)
    assert "torque error [N.m]" in points.read_text()
    fitted, _ = answer(capsys, "calibrate", points, *MAP, "--output", fit)
    assert next(iter(fitted.values()))["calibration"]["error_over_uncertainty"] < 5.0
    words = (*AXIS, *MAP, "--friction", fit, "--output", tmp_path / "now.json")
    _, text, _ = run(capsys, "identify", logs / "now.csv", *words)
    # the answer before the table
    assert [line.split()[0] for line in text.splitlines()[:4]] == ["preload", "shape", "inertia", "offset"]
    assert ("some of" in text, "too high" in text, len(text.splitlines()) < 24) == (True, False, True)
    _, text, _ = run(capsys, "identify", logs / "now.csv", *AXIS[:2], *MAP)
    assert "too high by the friction of guides" in text.splitlines()[0]
    assert "note: the friction is that" not in text
    # the file of another screw, without a map
    own = tmp_path / "own.toml"
    own.write_text(PACKAGED_VG100.read_text().replace("viscosity_index = 95.0", "viscosity_index = 96.0"))
    _, text, _ = run(capsys, "identify", logs / "now.csv", *AXIS, "--screw", own)
    assert text.startswith("preload ")
    again = json.loads((tmp_path / "now.json").read_text())
    assert again["preload_low_n"] < 1800.0 < again["preload_high_n"]
    assert again["preload_high_n"] - again["preload_low_n"] < found["preload_high_n"] - found["preload_low_n"]
    # the friction of the whole axis as a list of the drive
    written = "--identified", tmp_path / "now.json", "--format", "twincat", "--speed-rpm", "100", "1200"
    (entry,), _ = answer(capsys, "export", *written, "--output", tmp_path / "now.lis")
    assert entry["entries"] <= 8
    assert entry["largest_error_share"] <= 0.03  # of a bin of few samples
    velocity, current = (
        np.array(re.findall(rf"\[\d+\]\.{key} +(\S+)", (tmp_path / "now.lis").read_text()), float)
        for key in ("in", "out")
    )
    middle = next(row for row in again["friction"] if 550.0 < row["speed_rpm"] < 650.0)
    at = np.interp(middle["speed_rpm"] / 60.0 * 8e3, velocity, current)
    assert at * 1e-3 * CONSTANT == pytest.approx(middle["torque_nm"], rel=0.02)
    assert 100.0 / 60.0 * 8e3 <= velocity[1] <= velocity[-1] <= 1200.0 / 60.0 * 8e3


def test_exports_hold_the_map(capsys, tmp_path):
    nut_map = load_map(packaged_map(VG100), load_screw(PACKAGED_VG100))
    path = tmp_path / "table.json"
    few = "--preload-n", "2000", "--points", "5"
    answer(capsys, "export", *MAP, "--format", "json", *few, "--output", path)
    data = json.loads(path.read_text())
    speed = np.array(data["speed_rpm"]) * np.pi / 30.0
    torque = np.array(data["torque_nm"])[:, 0, 0]
    kelvin = data["temperature_c"][0] + 273.15
    assert torque == pytest.approx(nut_map.evaluate(2000.0, speed, kelvin).friction_torque, rel=1e-9)
    assert np.all(np.array(data["torque_low_nm"])[:, 0, 0] < torque)
    path = tmp_path / "axis.lis"
    two = "--preload-n", "1000", "2000", "--temperature-c", "30", *AXIS[:2]
    lists, _ = answer(capsys, "export", *MAP, "--format", "twincat", *two, "--output", path)
    assert [one["entries"] for one in lists] == [20, 20]
    assert all(one["largest_error_share"] <= 2e-3 for one in lists)
    names = [file.name for file in tmp_path.glob("*.lis")]
    assert sorted(names) == ["axis_1000N_30C.lis", "axis_2000N_30C.lis"]
