"""build_fmu.py and `ballscrew_fmu build`: what is delivered, what stops the build, bad input."""

import importlib.util
import json
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from fmpy import read_model_description
from fmu_checks import members
from html_page import Page
from markupsafe import escape
from paths import ROOT

from ballscrew_fmu import build, runs
from ballscrew_fmu.checks import check, reference, replay
from ballscrew_fmu.command import LAYERS
from ballscrew_fmu.models import MODELS
from ballscrew_fmu.native_fmu.compile import PLATFORMS, this_platform
from ballscrew_fmu.native_fmu.package import native_file_name
from ballscrew_tehl.applications.calibration.written_sets import write_friction_sets
from ballscrew_tehl.applications.cli import main as cli
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.parameters.file import load_screw

pytestmark = pytest.mark.slow

PYTHON = ["BallScrewFriction.fmu"]
NATIVE = [native_file_name(version, model) for model in MODELS for version in (2, 3)]
FITTED_HERE = FrictionSet(
    "three_parameter", 5.5, 0.0061, 31e-9,
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
    monkeypatch.setattr(runs, "inputs_of", lambda *_: build.Inputs(load_screw(), synthetic_nut_map))
    monkeypatch.setattr(build, "refuse_other_map", lambda *_: None)  # it is of no screw


@pytest.fixture
def for_this_machine(monkeypatch):
    own = {this_platform(): PLATFORMS[this_platform()]}
    for module in ("compile", "libraries"):
        monkeypatch.setattr(f"ballscrew_fmu.native_fmu.{module}.PLATFORMS", own)


def one_line(capsys):
    *progress, line = capsys.readouterr().err.splitlines()
    assert all(re.match(r"\d+ of \d+: ", one) for one in progress)
    return line


def test_all_fmus_with_own_friction_parameters_are_checked_and_documented(
    script, for_this_machine, tmp_path, capsys
):
    friction, folder = tmp_path / "friction.toml", tmp_path / "new" / "dist"
    write_friction_sets(friction, [FITTED_HERE])
    assert script(["--friction", str(friction), "--output", str(folder)]) == 0
    assert sorted(path.name for path in folder.iterdir()) == sorted(PYTHON + NATIVE)
    printed = capsys.readouterr().out
    assert f"friction: three_parameter, least_squares; {FITTED_HERE.provenance}\n" in printed
    assert not re.search(r"[0-9a-f]{64}", printed)
    for fmu in folder.iterdir():
        line = rf"{fmu.name}: fmpy: no finding; replay .*"
        assert re.search(line, printed)
        assert f"{fmu}  " in printed
        starts = {v.name: v.start for v in read_model_description(str(fmu)).modelVariables}
        assert float(starts["apparent_viscosity_ratio"]) == 5.5
        assert float(starts["net_sliding_coefficient"]) == 0.0061
        assert float(starts["roughness_height"]) == 31e-9
        files = members(fmu)
        text = files["documentation/index.html"].decode()
        page = Page(text)
        assert page.loaded == [] or {name for _, name, _ in page.loaded} == {"src"}
        for part in PAGE:
            assert part in text, (fmu.name, part)
        connections, others = (
            {row[0]: row[1:] for row in page.tables[name][1:]} for name in ("connect", "variable_table")
        )
        rows = connections | others
        assert sorted(rows) == sorted(starts)
        assert {row[0] for row in connections.values()} == {"input", "output"}
        assert rows["temperature"][:3] == ["input", "K (degC)", "303.15"]
        # that of the screw, in one file only
        assert ("documentation/live.html" in files) == (fmu.name == "BallScrewFriction.fmu")
        for image in page.images:
            assert files[image["src"].removeprefix("../")][:4] == b"\x89PNG"


def test_a_screw_file_alone_gives_the_fmus_that_are_asked_for(script, for_this_machine, tmp_path, capsys):
    screw = tmp_path / "my_screw.toml"
    assert cli.main(["init", str(screw), "--diameter-mm", "32", "--lead-mm", "10"]) == 0
    capsys.readouterr()
    wanted = [str(screw), "--only", "transmission", "--only", "monitor", "--fmi", "2", "--json"]
    assert script([*wanted, "--output", str(tmp_path / "fmus")]) == 0
    made = json.loads(capsys.readouterr().out)["fmus"]
    names = ["BallScrewPreloadMonitorNative_fmi2.fmu", "BallScrewTransmission_fmi2.fmu"]
    assert [Path(one["file"]).name for one in made] == names
    assert sorted(path.name for path in (tmp_path / "fmus").iterdir()) == sorted(names)
    starts = {v.name: v.start for v in read_model_description(made[1]["file"]).modelVariables}
    assert float(starts["lead"]) == pytest.approx(0.01)
    assert tuple(model.layer for model in MODELS) == LAYERS


def scaled(*arguments, original=reference.friction_results):
    return [{n: v * (1.0 + 1e-8) for n, v in row.items()} for row in original(*arguments)]


def native_differs(fmu, *arguments, original=check.check_replay):
    if "fmi2" in fmu.name:
        raise replay.CheckError("another torque")
    return original(fmu, *arguments)


(FRICTION,) = PYTHON
FAILURES = {  # name to patch: what is there instead, message
    "fmpy.validation.validate_fmu": (lambda _: ["first", "second"], f"validation of {FRICTION}: first | second"),
    "ballscrew_fmu.checks.reference.friction_results": (scaled, f"{FRICTION}: replay step"),
    "ballscrew_fmu.checks.check.check_replay": (native_differs, "BallScrewFrictionNative_fmi2.fmu: another torque"),
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
        assert message in one_line(capsys)
        assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"the one before"]


def test_bad_input_is_one_line_and_leaves_nothing(script, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("kept")
    wrong = {
        "net_sliding_coefficient = 1.5; allowed: less than or equal to 1": {"net_sliding_coefficient": 1.5},
        "fitted for the screw another (000000000000)": {"screw": "another", "parameters_hash": "0" * 12},
    }
    cases = {"none.toml": ["--screw", "none.toml"], "--friction = nothing": ["--friction", "nothing"]}
    cases["allowed: three_parameter, mechanistic"] = ["--friction", "sliding"]
    for number, (message, changes) in enumerate(wrong.items()):
        entry = replace(FITTED_HERE, **changes)
        write_friction_sets(tmp_path / f"{number}.toml", [entry])
        cases[message] = ["--friction", f"{number}.toml"]
    cases["no FMU to build"] = ["--python-only", "--fmi", "3"]
    cases["invalid choice: 'nut'"] = ["--only", "nut"]
    cases["invalid choice: 4"] = ["--fmi", "4"]
    cases["one.toml and --screw = two.toml; give one screw file"] = ["one.toml", "--screw", "two.toml"]
    cases["one.toml"] = ["one.toml"]
    cases["--output = file: file is not a folder"] = ["--python-only", "--output", "file"]
    before = sorted(tmp_path.iterdir())
    for message, arguments in cases.items():
        try:
            code = script(["--output", "dist", *arguments])
        except SystemExit as end:
            code = end.code
        assert (code, sorted(tmp_path.iterdir())) == (2, before)
        assert message in one_line(capsys)
