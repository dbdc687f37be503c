"""build_fmu.py: the delivered FMU, its report, and bad input."""

import csv
import hashlib
import importlib.util
import io
import math
import re
import subprocess
import sys
import zipfile
from dataclasses import replace
from html import escape

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from paths import ROOT

from ballscrew_fmu import build
from ballscrew_fmu.__main__ import main
from ballscrew_fmu.checks import check, reference
from ballscrew_fmu.native_fmu.compile import PLATFORMS, BuildError
from ballscrew_fmu.native_fmu.map_file import map_bytes
from ballscrew_tehl.friction.sets import FrictionSet, load_friction_sets, write_friction_sets
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.runtime.packed import MapError

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("build_fmu", ROOT / "build_fmu.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def with_synthetic_map(script, monkeypatch, synthetic_nut_map):
    monkeypatch.setattr(build, "read_inputs", lambda *_: (load_parameters(), synthetic_nut_map))


@pytest.fixture
def for_this_machine(monkeypatch):
    """Native FMUs for this machine only; test_native_package covers the other platforms."""
    host = "x86_64-windows" if sys.platform == "win32" else f"x86_64-{sys.platform}"
    monkeypatch.setattr("ballscrew_fmu.native_fmu.compile.PLATFORMS", {host: PLATFORMS[host]})


NATIVE = ["BallScrewFrictionNative_fmi2.fmu", "BallScrewFrictionNative_fmi3.fmu"]
MONITOR = ["BallScrewPreloadMonitorNative_fmi2.fmu", "BallScrewPreloadMonitorNative_fmi3.fmu"]
TRANSMISSION = ["BallScrewTransmission_fmi2.fmu", "BallScrewTransmission_fmi3.fmu"]
PYTHON = ["BallScrewFriction.fmu", "BallScrewPreloadMonitor.fmu"]


def test_it_writes_a_checked_fmu_and_describes_it(script, with_synthetic_map, tmp_path, capsys):
    assert script.main(["--python-only", "--output", str(tmp_path / "new" / "dist")]) == 0
    folder = tmp_path / "new" / "dist"
    assert sorted(path.name for path in folder.iterdir()) == PYTHON
    printed = capsys.readouterr().out
    for fmu in folder.iterdir():
        assert validate_fmu(str(fmu)) == []
        assert hashlib.sha256(fmu.read_bytes()).hexdigest() in printed
        assert str(fmu) in printed
    for word in ("measured", "this model", "Zhao", "Zhou", "NSK", "Table 2", "Table 4", "no finding"):
        assert word in printed


def test_it_writes_the_native_fmus_as_well(
    script, with_synthetic_map, for_this_machine, tmp_path, capsys, synthetic_nut_map
):
    assert script.main(["--output", str(tmp_path)]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        [*PYTHON, *NATIVE, *MONITOR, *TRANSMISSION]
    )
    printed = capsys.readouterr().out
    for name in MONITOR:
        assert validate_fmu(str(tmp_path / name)) == []
        assert re.search(
            rf"{name}: fmpy: no finding; replay .*; preload of Table 3: \d+\.\d\d % mean deviation", printed
        )
        with zipfile.ZipFile(tmp_path / name) as archive:
            results = archive.read(
                f"extra/org.fmi-standard.fmi-ls-ref/{name[:-9]}_validation_out.csv"
            ).decode()
        rows_in_range = [row for row in csv.DictReader(io.StringIO(results)) if row["in_range"] == "1"]
        assert len(rows_in_range) > 100
    for name in TRANSMISSION:
        assert validate_fmu(str(tmp_path / name)) == []
        assert re.search(
            rf"{name}: fmpy: no finding; replay .*; reference experiments: largest difference \d", printed
        )
    for name in NATIVE:
        assert validate_fmu(str(tmp_path / name)) == []
        assert hashlib.sha256((tmp_path / name).read_bytes()).hexdigest() in printed
        assert re.search(
            rf"{name}: fmpy: no finding; replay .*; reference experiments: largest difference \d", printed
        )
        with zipfile.ZipFile(tmp_path / name) as archive:
            files = {member: archive.read(member) for member in archive.namelist()}
        assert "Table 4: torque over speed" in files["documentation/index.html"].decode()
        assert files["documentation/torque_over_speed.png"][:4] == b"\x89PNG"
        results = files[
            "extra/org.fmi-standard.fmi-ls-ref/BallScrewFrictionNative_validation_out.csv"
        ].decode()
        rows = list(csv.DictReader(io.StringIO(results)))
        assert len(rows) == 240
        inputs = list(reference.reference_input(synthetic_nut_map.header))
        state = synthetic_nut_map.evaluate(**inputs[-1])
        assert float(rows[-1]["film_thickness_min"]) == state.film_thickness_min
        assert float(rows[-1]["time"]) == pytest.approx(0.24)


FITTED_HERE = FrictionSet(
    "three_parameter", "published", "solved_thermal", 5.5, 0.0061, 31e-9,
    loss="least_squares",
    provenance='bench <3> "a".csv (SHA-256 0123456789ab), 24 points of 25 rows, without row 7',
    errors={"mean": 0.0123, "leave_one_out_mean": 0.0145},
    limits={"roughness_height": {"low": 1e-8, "high": math.inf}},
    not_identified={"roughness_height": "95 % interval 10 nm to no bound around 31 nm"},
)  # fmt: skip


def test_with_the_map_compiled_in_only_the_native_fmus_differ(
    script, with_synthetic_map, for_this_machine, tmp_path, capsys, synthetic_nut_map
):
    assert script.main(["--embed-map", "--output", str(tmp_path)]) == 0
    assert capsys.readouterr().out.count("no finding") == 8
    for name in (*NATIVE, *MONITOR, *TRANSMISSION):
        with zipfile.ZipFile(tmp_path / name) as archive:
            members = archive.namelist()
            page = archive.read("documentation/index.html").decode()
        assert not any(member.startswith("resources/") for member in members)
        assert "sources/nut_map.c" in members
        assert "opens no file" in page


def test_map_writes_the_file_of_the_native_fmus(with_synthetic_map, tmp_path, capsys, synthetic_nut_map):
    target = tmp_path / "nut_map.bin"
    assert main(["map", "--output", str(target)]) == 0
    assert target.read_bytes() == map_bytes(synthetic_nut_map)
    printed = capsys.readouterr().out
    assert f"map {synthetic_nut_map.header['content_hash']}, film_shear friction law" in printed
    for name, value in synthetic_nut_map.header["defaults"].items():
        assert f"{name} = {value:g}" in printed
    assert main(["map", "--output", str(tmp_path)]) == 2
    assert "Is a directory; needs a file that can be written" in one_line(capsys)


def test_friction_parameters_of_a_file_are_start_values_and_documented(
    script, for_this_machine, tmp_path, capsys
):
    friction = tmp_path / "friction.toml"
    write_friction_sets(friction, {("published", "three_parameter"): FITTED_HERE})
    assert script.main(["--friction", str(friction), "--output", str(tmp_path / "dist")]) == 0
    assert f"friction: three_parameter, least_squares; {FITTED_HERE.provenance}\n" in capsys.readouterr().out
    for path in (tmp_path / "dist").iterdir():
        description = read_model_description(str(path))
        starts = {v.name: v.start for v in description.modelVariables if v.causality == "parameter"}
        assert float(starts["apparent_viscosity_ratio"]) == 5.5
        assert float(starts["net_sliding_coefficient"]) == 0.0061
        assert float(starts["roughness_height"]) == 31e-9
        with zipfile.ZipFile(path) as archive:
            page = archive.read("documentation/index.html").decode()
        assert escape(FITTED_HERE.provenance) in page, path.name
        assert "mean 1.23 %, leave_one_out_mean 1.45 %" in page
        assert "<li>roughness_height = 3.1e-08 m, 95 % limits 1e-08 to no bound</li>" in page
        assert "<li>roughness_height: 95 % interval 10 nm to no bound around 31 nm</li>" in page
        assert "identify their sum, not the split" not in page


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"kinematics": "rolling_frame"},
            "kinematics = rolling_frame with set three_parameter; allowed: published, as in the screw file",
        ),
        ({"film_model": "hamrock_dowson"}, "fitted with the film hamrock_dowson; expected one of solved"),
        ({"net_sliding_coefficient": 1.5}, "net_sliding_coefficient = 1.5; allowed: less than or equal to 1"),
        (
            {"screw": "another", "parameters_hash": "0" * 12},
            "fitted for the screw another (000000000000); expected",
        ),
    ],
)
def test_a_friction_file_of_another_model_is_one_line(script, tmp_path, capsys, changes, message):
    entry = replace(FITTED_HERE, **changes)
    write_friction_sets(tmp_path / "friction.toml", {(entry.kinematics, entry.name): entry})
    friction = str(tmp_path / "friction.toml")
    assert script.main(["--friction", friction, "--output", str(tmp_path / "dist")]) == 2
    assert message in one_line(capsys)
    assert not (tmp_path / "dist").exists()


def test_the_packaged_friction_parameters_are_documented(script, tmp_path, capsys):
    assert script.main(["--python-only", "--output", str(tmp_path)]) == 0
    with zipfile.ZipFile(tmp_path / "BallScrewFriction.fmu") as archive:
        page = archive.read("documentation/index.html").decode()
    assert escape(load_friction_sets()["published", "three_parameter"].provenance) in page
    assert "identify their sum, not the split" in page


def test_nothing_is_written_when_a_native_fmu_differs(
    script, with_synthetic_map, for_this_machine, tmp_path, monkeypatch, capsys
):
    original = check.check_replay

    def differs(fmu, *arguments):
        if fmu.name == NATIVE[1]:
            raise reference.CheckError("replay step 3: another torque")
        return original(fmu, *arguments)

    monkeypatch.setattr(check, "check_replay", differs)
    assert script.main(["--output", str(tmp_path)]) == 1
    assert f"no FMU delivered: {NATIVE[1]}: replay step 3: another torque" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_missing_compiler_is_one_line_with_the_remedy(
    script, with_synthetic_map, tmp_path, monkeypatch, capsys
):
    def missing():
        raise BuildError("no C compiler: install one")

    monkeypatch.setattr("ballscrew_fmu.native_fmu.compile.find_compiler", missing)
    assert script.main(["--output", str(tmp_path)]) == 1
    assert one_line(capsys) == "build_fmu.py: no FMU delivered: no C compiler: install one"
    assert list(tmp_path.iterdir()) == []


def test_the_tables_show_the_torque_of_the_fmu(script, fmu, synthetic_nut_map):
    text = check.torque_tables(fmu, load_parameters(), synthetic_nut_map)
    state = synthetic_nut_map.evaluate(1000.0, 104.71975511965978, 303.0)
    assert f"{sum(state[:3]):.4f}" in text


def test_nothing_is_written_when_a_monitor_misses_the_preload(
    script, with_synthetic_map, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr("ballscrew_fmu.checks.reference.preload_error", lambda *_: 2e-6)
    assert script.main(["--python-only", "--output", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert "BallScrewPreloadMonitor.fmu: preload from torque: relative error 2.0e-06; allowed 1e-06" in error
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_written_when_a_table_is_outside_the_map(
    script, with_synthetic_map, tmp_path, monkeypatch, capsys
):
    def beyond(_):
        raise RuntimeError("no preload in range for 0.4 N.m")

    monkeypatch.setattr("ballscrew_fmu.checks.check.table3", beyond)
    assert script.main(["--python-only", "--output", str(tmp_path)]) == 1
    assert "BallScrewPreloadMonitor.fmu: no preload in range for 0.4 N.m" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_two_runs_write_the_same_bytes(script, with_synthetic_map, tmp_path):
    files = []
    for name in ("a", "b"):
        assert script.main(["--python-only", "--output", str(tmp_path / name)]) == 0
        files.append([(tmp_path / name / fmu).read_bytes() for fmu in PYTHON])
    assert files[0] == files[1]


def test_the_reference_input_covers_both_directions_standstill_and_the_outside(script, synthetic_nut_map):
    rows = list(reference.reference_input(synthetic_nut_map.header))
    states = [synthetic_nut_map.evaluate(**row) for row in rows]
    assert any(row["speed"] == 0.0 for row in rows)
    speeds = sorted(row["speed"] for row in rows)
    assert speeds[0] < -320.0 < 320.0 < speeds[-1]
    assert {name for state in states for name in state.clamped} >= {"speed", "temperature"}
    assert sum(state.in_range for state in states) > 100
    assert any(row["axial_load"] < 0.0 for row in rows)


def test_nothing_is_written_when_a_replay_differs(script, with_synthetic_map, tmp_path, monkeypatch, capsys):
    original = reference.presliding_outputs
    monkeypatch.setattr(
        reference,
        "presliding_outputs",
        lambda *a: [{n: v * (1.0 + 1e-8) for n, v in row.items()} for row in original(*a)],
    )
    assert script.main(["--output", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert "check failed, no FMU delivered: BallScrewFriction.fmu: replay step" in error
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_written_after_a_finding_of_the_validation(
    script, with_synthetic_map, tmp_path, monkeypatch, capsys
):
    old = tmp_path / "BallScrewFriction.fmu"
    old.write_bytes(b"the one before")
    monkeypatch.setattr("fmpy.validation.validate_fmu", lambda _: ["first finding", "second"])
    assert script.main(["--output", str(tmp_path)]) == 1
    assert "fmpy validation of BallScrewFriction.fmu: first finding | second" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [old.name]
    assert old.read_bytes() == b"the one before"


def test_another_screw_is_compared_with_the_formulas_only(script, fmu, synthetic_nut_map):
    other = load_parameters(ROOT / "solver" / "ballscrew_tehl" / "data" / "example_25x10.toml")
    text = check.torque_tables(fmu, other, synthetic_nut_map)
    assert text.startswith("No measurement of this screw")
    assert "Zhao" not in text


def test_the_package_builds_the_same_from_its_own_command(with_synthetic_map, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["build", "--python-only"]) == 0
    assert sorted(path.name for path in (tmp_path / "dist").iterdir()) == PYTHON
    (tmp_path / "file").write_text("kept")
    capsys.readouterr()
    assert main(["build", "--output", "file"]) == 2
    assert one_line(capsys).startswith("python -m ballscrew_fmu build: --output file: ")
    with pytest.raises(SystemExit) as end:
        main([])
    assert end.value.code == 2


def one_line(capsys):
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


def test_a_map_that_cannot_be_used_is_one_line(script, tmp_path, monkeypatch, capsys):
    def refuse(*_):
        raise MapError("map of another screw: found a,\n expected b")

    monkeypatch.setattr(build, "read_inputs", refuse)
    assert script.main(["--output", str(tmp_path / "dist")]) == 2
    assert one_line(capsys) == "build_fmu.py: map of another screw: found a, expected b"
    assert not (tmp_path / "dist").exists()


def test_an_invalid_output_folder_is_one_line(script, with_synthetic_map, tmp_path, capsys):
    (tmp_path / "file").write_text("kept")
    assert script.main(["--output", str(tmp_path / "file")]) == 2
    assert "needs a folder that can be written" in one_line(capsys)
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--screw", "none.toml"], "none.toml"),
        (
            ["--friction", "none.toml"],
            "--friction = none.toml; allowed: three_parameter, two_parameter, mechanistic",
        ),
        (["--kinematics", "sliding"], "invalid choice: 'sliding'"),
        (["--speed", "3"], "unrecognized arguments"),
    ],
)
def test_bad_input_on_the_command_line(arguments, message, tmp_path):
    run = subprocess.run(
        [sys.executable, str(ROOT / "build_fmu.py"), *arguments], capture_output=True, text=True, cwd=tmp_path
    )
    assert (run.returncode, run.stdout) == (2, "")
    assert message in run.stderr
    assert len(run.stderr.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_help_names_steps_options_and_exit_codes():
    run = subprocess.run(
        [sys.executable, str(ROOT / "build_fmu.py"), "--help"], capture_output=True, text=True
    )
    assert run.returncode == 0
    options = ("--screw", "--map", "--output", "--kinematics", "--friction", "--python-only", "--embed-map")
    for word in (*options, "examples", "exit codes"):
        assert word in run.stdout
