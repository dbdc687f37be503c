"""build_fmu.py: the delivered FMU, its report, and bad input."""

import hashlib
import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest
from fmpy.validation import validate_fmu

from ballscrew_tehl.nut_map.packed import MapError
from ballscrew_tehl.parameters import load_parameters

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("build_fmu", ROOT / "build_fmu.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def with_synthetic_map(script, monkeypatch, synthetic_nut_map):
    monkeypatch.setattr(script, "read_inputs", lambda *_: (load_parameters(), synthetic_nut_map))


def test_it_delivers_a_checked_fmu_and_says_what_it_is(script, with_synthetic_map, tmp_path, capsys):
    assert script.main(["--output", str(tmp_path / "new" / "dist")]) == 0
    fmu = tmp_path / "new" / "dist" / "BallScrewFriction.fmu"
    assert [path.name for path in fmu.parent.iterdir()] == [fmu.name]
    assert validate_fmu(str(fmu)) == []
    printed = capsys.readouterr().out
    assert hashlib.sha256(fmu.read_bytes()).hexdigest() in printed
    assert str(fmu) in printed
    for word in ("measured", "this model", "Zhao", "Zhou", "NSK", "Table 2", "Table 4", "no finding"):
        assert word in printed


def test_the_tables_show_the_torque_of_the_fmu(script, fmu, synthetic_nut_map):
    text = script.torque_tables(fmu, load_parameters(), synthetic_nut_map)
    state = synthetic_nut_map.evaluate(1000.0, 104.71975511965978, 303.0)
    assert f"{sum(state[:3]):.4f}" in text


def test_two_runs_deliver_the_same_bytes(script, with_synthetic_map, tmp_path):
    files = []
    for name in ("a", "b"):
        assert script.main(["--output", str(tmp_path / name)]) == 0
        files.append((tmp_path / name / "BallScrewFriction.fmu").read_bytes())
    assert files[0] == files[1]


def test_the_reference_input_visits_both_directions_standstill_and_the_outside(script, synthetic_nut_map):
    rows = list(script.reference_input(synthetic_nut_map.header))
    states = [synthetic_nut_map.evaluate(**row) for row in rows]
    assert any(row["speed"] == 0.0 for row in rows)
    assert min(row["speed"] for row in rows) < -320.0 < 320.0 < max(row["speed"] for row in rows)
    assert {name for state in states for name in state.clamped} >= {"speed", "temperature"}
    assert sum(state.in_range for state in states) > 100
    assert any(row["axial_load"] < 0.0 for row in rows)


def test_a_replay_that_differs_delivers_nothing(script, with_synthetic_map, tmp_path, monkeypatch, capsys):
    original = script.expected_outputs
    monkeypatch.setattr(
        script, "expected_outputs", lambda *a: {n: v * (1.0 + 1e-8) for n, v in original(*a).items()}
    )
    assert script.main(["--output", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert "check failed, no FMU delivered: replay step" in error
    assert list(tmp_path.iterdir()) == []


def test_a_finding_of_the_validation_delivers_nothing(
    script, with_synthetic_map, tmp_path, monkeypatch, capsys
):
    old = tmp_path / "BallScrewFriction.fmu"
    old.write_bytes(b"the one before")
    monkeypatch.setattr("fmpy.validation.validate_fmu", lambda _: ["first finding", "second"])
    assert script.main(["--output", str(tmp_path)]) == 1
    assert "fmpy validation: first finding | second" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [old.name]
    assert old.read_bytes() == b"the one before"


def test_another_screw_is_compared_with_the_formulas_only(script, fmu, synthetic_nut_map):
    other = load_parameters(ROOT / "solver" / "ballscrew_tehl" / "data" / "example_25x10.toml")
    text = script.torque_tables(fmu, other, synthetic_nut_map)
    assert text.startswith("No measurement of this screw")
    assert "Zhao" not in text


def one_line(capsys):
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


def test_a_map_that_cannot_be_used_is_one_line(script, tmp_path, monkeypatch, capsys):
    def refuse(*_):
        raise MapError("map of another screw: found a,\n expected b")

    monkeypatch.setattr(script, "read_inputs", refuse)
    assert script.main(["--output", str(tmp_path / "dist")]) == 2
    assert one_line(capsys) == "build_fmu.py: map of another screw: found a, expected b"
    assert not (tmp_path / "dist").exists()


def test_an_output_that_is_no_folder_is_one_line(script, with_synthetic_map, tmp_path, capsys):
    (tmp_path / "file").write_text("kept")
    assert script.main(["--output", str(tmp_path / "file")]) == 2
    assert "needs a folder that can be written" in one_line(capsys)
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--screw", "none.toml"], "none.toml"),
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
    for word in ("--screw", "--map", "--output", "--kinematics", "examples", "exit codes", "rolling_frame"):
        assert word in run.stdout
