"""build_fmu.py and `ballscrew_fmu build`: what is delivered, what stops the build, bad input."""

import hashlib
import importlib.util
import math
import re
import subprocess
import sys
import zipfile
from dataclasses import replace

import pytest
from fmpy import read_model_description
from html_page import Page
from markupsafe import escape
from paths import ROOT

from ballscrew_fmu import build
from ballscrew_fmu.__main__ import main
from ballscrew_fmu.checks import check, reference
from ballscrew_fmu.models import TRANSMISSION
from ballscrew_fmu.native_fmu.compile import PLATFORMS, this_platform
from ballscrew_fmu.native_fmu.map_file import map_bytes
from ballscrew_tehl.friction.sets import FrictionSet, write_friction_sets
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.runtime.packed import MapError

pytestmark = pytest.mark.slow

PYTHON = ["BallScrewFriction.fmu", "BallScrewPreloadMonitor.fmu"]
NATIVE = [
    f"{name}_fmi{version}.fmu"
    for name in ("BallScrewFrictionNative", "BallScrewPreloadMonitorNative", "BallScrewTransmission")
    for version in (2, 3)
]
FITTED_HERE = FrictionSet(
    "three_parameter", "published", "solved_thermal", 5.5, 0.0061, 31e-9,
    loss="least_squares",
    provenance='bench <3> "a".csv (SHA-256 0123456789ab), 24 points of 25 rows, without row 7',
    errors={"mean": 0.0123, "leave_one_out_mean": 0.0145},
    limits={"roughness_height": {"low": 1e-8, "high": math.inf}},
    not_identified={"roughness_height": "95 % interval 10 nm to no bound around 31 nm"},
)  # fmt: skip
PAGE = (
    escape(FITTED_HERE.provenance), "mean 1.23 %, leave_one_out_mean 1.45 %",
    "roughness_height = 3.1e-08 m, 95 % limits 1e-08 to no bound",
    "roughness_height: 95 % interval 10 nm to no bound around 31 nm",
)  # fmt: skip


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("build_fmu", ROOT / "build_fmu.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.main


@pytest.fixture
def with_synthetic_map(monkeypatch, synthetic_nut_map):
    monkeypatch.setattr(build, "read_inputs", lambda *_: (load_parameters(), synthetic_nut_map))


@pytest.fixture
def for_this_machine(monkeypatch):
    """Native FMUs for this machine only; test_native_package covers the other platforms."""
    own = {this_platform(): PLATFORMS[this_platform()]}
    monkeypatch.setattr("ballscrew_fmu.native_fmu.compile.PLATFORMS", own)


def one_line(capsys):
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


def member(fmu, name):
    with zipfile.ZipFile(fmu) as archive:
        return archive.read(name)


def test_all_fmus_with_own_friction_parameters_are_checked_and_documented(
    script, for_this_machine, tmp_path, capsys
):
    friction, folder = tmp_path / "friction.toml", tmp_path / "new" / "dist"
    write_friction_sets(friction, {("published", "three_parameter"): FITTED_HERE})
    assert script(["--friction", str(friction), "--output", str(folder)]) == 0
    assert sorted(path.name for path in folder.iterdir()) == sorted(PYTHON + NATIVE)
    printed = capsys.readouterr().out
    assert f"friction: three_parameter, least_squares; {FITTED_HERE.provenance}\n" in printed
    for fmu in folder.iterdir():
        line = rf"{fmu.name}: fmpy: no finding; replay .*"
        line += r"; preload of Table 3: \d+\.\d\d % mean deviation" if "Monitor" in fmu.name else ""
        line += r"; reference experiments: largest difference \d" if fmu.name in NATIVE else ""
        assert re.search(line, printed)
        assert f"{fmu}  " in printed
        assert hashlib.sha256(fmu.read_bytes()).hexdigest() in printed
        starts = {v.name: v.start for v in read_model_description(str(fmu)).modelVariables}
        assert float(starts["apparent_viscosity_ratio"]) == 5.5
        assert float(starts["net_sliding_coefficient"]) == 0.0061
        assert float(starts["roughness_height"]) == 31e-9
        text = member(fmu, "documentation/index.html").decode()
        page = Page(text)  # every element is closed
        assert page.loaded == [] or {name for _, name, _ in page.loaded} == {"src"}
        assert not re.search(r"\{[{%#]|[%#]\}", text)
        for part in PAGE:
            assert part in text, (fmu.name, part)
        assert "identify their sum, not the split" not in text
        rows = {row[0]: row[1:] for row in page.tables["variable_table"]}
        assert list(rows)[1:] == list(starts)
        assert rows["temperature"][:3] == ["input", "K (degC)", "303.15"]
        if fmu.name.startswith("BallScrewFrictionNative"):
            assert "Table 4: torque over speed" in text
            for image in page.images:
                source = image["src"]
                where = source.removeprefix("../") if source[:2] == ".." else f"documentation/{source}"
                assert member(fmu, where)[:4] == b"\x89PNG"
        if fmu.name in PYTHON:
            assert b"numpy" in member(fmu, "documentation/externalDependencies.txt")
            assert b"Permission is hereby granted" in member(fmu, "documentation/licenses/pythonfmu.txt")
        else:
            assert b"mingw-w64" in member(fmu, "documentation/licenses/license.txt")


def test_with_the_map_compiled_in_an_fmu_opens_no_file(
    with_synthetic_map, for_this_machine, tmp_path, monkeypatch
):
    monkeypatch.setattr(build, "NATIVE_MODELS", (TRANSMISSION,))
    monkeypatch.setattr(build, "MODELS", ())
    monkeypatch.chdir(tmp_path)
    assert main(["build", "--embed-map"]) == 0
    for version in (2, 3):
        with zipfile.ZipFile(tmp_path / "dist" / f"BallScrewTransmission_fmi{version}.fmu") as archive:
            members = archive.namelist()
            assert b"opens no file" in archive.read("documentation/index.html")
        assert not any(name.startswith("resources/") for name in members)
        assert "sources/nut_map.c" in members


def test_map_writes_the_file_of_the_native_fmus(with_synthetic_map, tmp_path, capsys, synthetic_nut_map):
    target, header = tmp_path / "nut_map.bin", synthetic_nut_map.header
    assert main(["map", "--output", str(target)]) == 0
    assert target.read_bytes() == map_bytes(synthetic_nut_map)
    printed = capsys.readouterr().out
    assert all(f"{name} = {value:g}" in printed for name, value in header["defaults"].items())
    assert main(["map", "--output", str(tmp_path)]) == 2
    assert "Is a directory; needs a file that can be written" in one_line(capsys)


# --- what stops a build: nothing is delivered ---


def raising(error):
    def fail(*_):
        raise error

    return fail


def scaled(*arguments, original=reference.presliding_outputs):
    return [{n: v * (1.0 + 1e-8) for n, v in row.items()} for row in original(*arguments)]


def native_differs(fmu, *arguments, original=check.check_replay):
    if "fmi3" in fmu.name:
        raise reference.CheckError("another torque")
    return original(fmu, *arguments)


FRICTION, MONITOR = PYTHON
FAILURES = {  # name to patch: what is there instead, message
    "fmpy.validation.validate_fmu": (lambda _: ["first", "second"], f"validation of {FRICTION}: first | second"),
    "ballscrew_fmu.checks.reference.presliding_outputs": (scaled, f"{FRICTION}: replay step"),
    "ballscrew_fmu.checks.check.table3": (raising(RuntimeError("no preload")), f"{MONITOR}: no preload"),
    "ballscrew_fmu.checks.check.check_replay": (native_differs, "BallScrewFrictionNative_fmi3.fmu: another torque"),
}  # fmt: skip


def test_nothing_is_delivered_when_a_check_fails(
    script, with_synthetic_map, for_this_machine, tmp_path, capsys
):
    old = tmp_path / "BallScrewFriction.fmu"
    old.write_bytes(b"the one before")
    for name, (instead, message) in FAILURES.items():
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(name, instead)
            assert script(["--output", str(tmp_path)]) == 1
        error = one_line(capsys)
        assert error.startswith("build_fmu.py: ")
        assert "no FMU delivered: " in error
        assert message in error
        assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [
            (old.name, b"the one before")
        ]


def test_bad_input_is_one_line_and_leaves_nothing(script, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("kept")
    wrong = {
        "rolling_frame with set three_parameter; allowed: published": {"kinematics": "rolling_frame"},
        "needs the film hamrock_dowson": {"film_model": "hamrock_dowson"},
        "net_sliding_coefficient = 1.5; allowed: less than or equal to 1": {"net_sliding_coefficient": 1.5},
        "fitted for the screw another (000000000000)": {"screw": "another", "parameters_hash": "0" * 12},
    }
    cases = {"none.toml": ["--screw", "none.toml"], "--friction = nothing": ["--friction", "nothing"]}
    cases["invalid choice: 'sliding'"] = ["--kinematics", "sliding"]
    for number, (message, changes) in enumerate(wrong.items()):
        entry = replace(FITTED_HERE, **changes)
        write_friction_sets(tmp_path / f"{number}.toml", {(entry.kinematics, entry.name): entry})
        cases[message] = ["--friction", f"{number}.toml"]
    cases["needs a folder that can be written"] = ["--python-only", "--output", "file"]
    before = sorted(tmp_path.iterdir())
    for message, arguments in cases.items():
        try:
            code = script(["--output", "dist", *arguments])
        except SystemExit as end:
            code = end.code
        assert (code, sorted(tmp_path.iterdir())) == (2, before)
        assert message in one_line(capsys)
    monkeypatch.setattr(
        build, "read_inputs", raising(MapError("map of another screw: found a,\n expected b"))
    )
    assert script(["--output", "dist"]) == 2
    assert one_line(capsys) == "build_fmu.py: map of another screw: found a, expected b"


def test_as_a_program_and_for_another_screw(fmu, synthetic_nut_map):
    run = subprocess.run(
        [sys.executable, str(ROOT / "build_fmu.py"), "--help"], capture_output=True, text=True
    )
    assert run.returncode == 0
    assert all(
        word in run.stdout for word in ("--screw", "--map", "--python-only", "--embed-map", "exit codes")
    )
    other = load_parameters(ROOT / "solver" / "ballscrew_tehl" / "data" / "example_25x10.toml")
    text = check.torque_tables(fmu, other, synthetic_nut_map)
    assert text.startswith("No measurement of this screw")
    assert "Zhao" not in text
    state = synthetic_nut_map.evaluate(1200.0, 100.0 * math.pi / 30.0, 303.15)
    assert f"    1200 N     100{sum(state[:3]):10.4f}" in text
