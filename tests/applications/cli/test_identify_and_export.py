"""The commands identify and export as a user runs them: answers, files, the way from a log to a calibration."""

import json
import re

import numpy as np
import pytest
from command_line import answer, refused, run
from servo_log import CONSTANT, GAIN, GUIDES, LEAD, MASS, PIECES, main

from ballscrew_tehl.applications.cli.shared.output import to_builtin
from ballscrew_tehl.applications.export.files import SUFFIXES, TableOptions, friction_files
from ballscrew_tehl.applications.identification.axis_log import StatedAxis, identify_log
from ballscrew_tehl.applications.screw_model import screw_model
from ballscrew_tehl.applications.torque_point import torque_at_point
from ballscrew_tehl.nut_map.file import VG100, packaged_map
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.file import PACKAGED_VG100, load_screw
from ballscrew_tehl.parameters.units import RPM

MAP = ("--screw", PACKAGED_VG100, "--map", packaged_map(VG100))
AXIS = ("--torque-constant-nm-a", CONSTANT, "--guide-force-n", GUIDES, "--seal-torque-nm", 0)
#: tables of an axis whose guide has 80 N and no other part any friction
TABLES = """
[wipers]
friction_torque_Nm = 0
[motor]
friction_torque_Nm = 0
ratio = 1
[guide]
seal_resistance_N = 0
friction_coefficient = [0.002, 0.00301]
cover_force_N = [66, 70]
[axis]
moved_mass_kg = 500
"""


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
    assert [line.split()[0] for line in text.splitlines()[:4]] == ["preload", "shape", "nut", "inertia"]
    assert ("some of" in text, "too high" in text, len(text.splitlines()) < 25) == (True, False, True)
    _, text, _ = run(capsys, "identify", logs / "now.csv", *AXIS[:2], *MAP)
    assert "too high by the friction of support_bearings, guide, wipers, motor" in text.splitlines()[0]
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


def test_tables_of_the_axis_are_subtracted_unless_a_log_or_an_option_states_more(capsys, logs, tmp_path):
    screw = tmp_path / "axis.toml"
    screw.write_text(PACKAGED_VG100.read_text() + TABLES)
    words = "identify", logs / "now.csv", *AXIS[:2], "--map", MAP[3], "--screw", screw
    found, _ = answer(capsys, *words)
    assert (found["not_stated"], found["preload_is_upper_bound"]) == (["support_bearings"], True)
    assert (found["preload_low_n"], found["shape_fits"]) == (0.0, None)
    assert found["subtracted"]["guide"]["torque_nm"] == pytest.approx(GUIDES * LEAD, rel=0.01)
    _, text, _ = run(capsys, *words)
    assert "too high by the friction of support_bearings, which" in text
    found, _ = answer(
        capsys, *words, "--seal-torque-nm", "0+-0.05", "--guide-force-n", "80+-10", "--ratio", "-1"
    )
    assert found["preload_low_n"] < 1800.0 < found["preload_high_n"]
    assert ("preload_is_upper_bound" in found, found["not_stated"], found["ratio"]) == (False, [], -1.0)
    limits = found["subtracted"]["guide"]
    assert limits["high_nm"] - limits["torque_nm"] == pytest.approx(10.0 * 1.2816 * LEAD)
    share = 1.0 - GUIDES * LEAD / found["axis_torque_nm"]
    assert found["nut_share"] == pytest.approx(share, abs=0.01)
    assert [note.split()[0] for note in found["notes"][-2:]] == ["--guide-force-n", "--seal-torque-nm"]
    bare = tmp_path / "bare.csv"
    rows = (logs / "now.csv").read_text().splitlines()
    small = (",".join([*row.split(",")[:2], str(0.2 * float(row.split(",")[2])), "30"]) for row in rows[1:])
    bare.write_text("\n".join([rows[0], *small]))
    found, _ = answer(capsys, *words, "--without-nut", bare)
    assert list(found["subtracted"]) == ["log_without_nut"]
    assert found["nut_share"] == pytest.approx(0.8, abs=0.01)
    assert "not [guide], [wipers], [motor]" in " ".join(found["notes"])
    problem = refused(capsys, *words, "--ratio", "2")
    assert "--ratio = 2; allowed: that of [motor] in the screw file, 1 (with either sign)" in problem
    screw.write_text(PACKAGED_VG100.read_text() + TABLES + 'drive = "belt"\n')
    assert "axis.drive = 'belt'; allowed:" in refused(capsys, *words)


def test_functions_give_what_the_commands_print(capsys, logs, tmp_path):
    """In memory: the answer, the text, the measurements and the files of identify and export; the torque."""
    screw = screw_model(PACKAGED_VG100, packaged_map(VG100))
    parts = {"guide_force_n": (GUIDES, 0.0), "seal_torque_nm": (0.0, 0.0)}
    stated = StatedAxis(CONSTANT, preload_n=1800.0, before=logs / "before.csv", **parts)
    found = identify_log(logs / "now.csv", stated, screw)
    words = "--preload-n", "1800", "--before", logs / "before.csv", "--measurements", tmp_path / "points.csv"
    wanted, _ = answer(
        capsys, "identify", logs / "now.csv", *AXIS, *MAP, *words, "--output", tmp_path / "now.json"
    )
    text, note = found.measurements()
    assert text == (tmp_path / "points.csv").read_text()
    assert to_builtin(found.data) == wanted | {"notes": wanted["notes"][:-1]}
    assert wanted["notes"][-1] == f"{tmp_path / 'points.csv'}: {note}"
    assert found.text.startswith(f"preload   {wanted['preload_n']:.5g} N")
    assert np.all(found.curve[2] < found.curve[1])
    # of a screw that is given for its lead alone
    alone = screw_model(PACKAGED_VG100)
    (tmp_path / "cold.csv").write_text(
        re.sub(r",[^,]*$", "", (logs / "now.csv").read_text(), flags=re.MULTILINE)
    )
    found = identify_log(tmp_path / "cold.csv", StatedAxis(CONSTANT), alone)
    assert "no preload is computed" in found.remark
    assert (found.data["lead_mm"], "preload_n" in found.data) == (pytest.approx(8.0), False)
    for source, options, form, words in (
        (screw, TableOptions([2000.0], points=5), "json", (*MAP, "--preload-n", "2000", "--points", "5")),
        (screw, TableOptions([1e3, 2e3], [30.0], torque_constant_nm_a=CONSTANT), "twincat",
         (*MAP, "--preload-n", "1000", "2000", "--temperature-c", "30", *AXIS[:2])),
        (tmp_path / "now.json", TableOptions(), "matlab", ("--identified", tmp_path / "now.json")),
    ):  # fmt: skip
        path = tmp_path / f"table{SUFFIXES[form][0]}"
        wanted, _ = answer(capsys, "export", *words, "--format", form, "--output", path)
        files = friction_files(path, form, source, options)
        assert to_builtin([file.about for file in files]) == (wanted if form == "twincat" else [wanted])
        assert all(file.path.read_text() == file.text for file in files)
    with pytest.raises(ValueError, match="--preload-n with --identified"):
        friction_files("x.csv", "csv", tmp_path / "now.json", TableOptions([2000.0]))
    point = (
        "--preload-n",
        "900",
        "--speed-rpm",
        "300",
        "--temperature-c",
        "30",
        "--temperature-difference-k",
        "1",
    )
    wanted, _ = answer(capsys, "torque", *MAP, *point)
    at = torque_at_point(screw, screw.nut_map(), 900.0, 300.0 * RPM, 303.15, difference=1.0)
    values = [wanted[f"{key}_nm"] for key in ("friction_torque", "torque_low", "torque_high")]
    assert [at.state.friction_torque, *at.ends(0.0)] == pytest.approx(values, rel=1e-12)


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
