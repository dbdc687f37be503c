"""Checks of built FMUs and of FMU files: what passes, what must be found, `ballscrew_fmu check` and `info`."""

import json
import math
import re

import pytest
from fmu_checks import members
from native_model import NativeModel
from synthetic_map import LAWS, closed_form, make_map

from ballscrew_fmu.__main__ import main
from ballscrew_fmu.archive import write_fmu
from ballscrew_fmu.checks import check as checks
from ballscrew_fmu.checks.check import check_replay
from ballscrew_fmu.checks.reference import STEP, axis_input, check_axis, reference_input, reference_of
from ballscrew_fmu.checks.replay import CheckError
from ballscrew_fmu.models import AXIS, FRICTION, MODELS
from ballscrew_fmu.native_fmu.validation import Reference
from ballscrew_fmu.python_fmu.package import build_fmu, runtime_sources

pytestmark = pytest.mark.slow

CASES = [(m, k, LAWS[0]) for m in MODELS for k in ("python", 2, 3) if m is FRICTION or k != "python"]
CASES += [(FRICTION, "python", LAWS[1]), (FRICTION, 3, LAWS[1])]


def one_line(capsys, code, *arguments):
    """The message of a command that ends with this code."""
    assert main([*map(str, arguments)]) == code
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    return err


@pytest.mark.parametrize(("model", "kind", "law"), CASES, ids=lambda x: getattr(x, "name", str(x)))
def test_every_fmu_replays_the_map_and_its_own_reference(built, model, kind, law, capsys):
    fmu = built(model, kind, law)
    reference = reference_of(closed_form(law), model)
    assert "no finding" in checks.check(fmu, reference, model)
    if model is FRICTION:  # the limit of the others is that of a search, and of differences
        assert check_replay(fmu, reference, "") <= 1e-12
    if law == LAWS[0]:
        assert main(["check", str(fmu), "--json"]) == 0
        lines = json.loads(capsys.readouterr().out)["checks"]
        assert lines[0] == "fmpy validation: no finding"
        name = "map" if kind == "python" else "validation"
        assert f"replay against {name} in the FMU, 240 steps: largest difference" in lines[-1]


def test_an_axis_with_another_equation_is_found(opened):
    nut_map = closed_form()
    rows = list(axis_input(nut_map.header))
    assert reference_motion(opened, rows) <= 5e-4
    for change in ({"guide_coulomb": 79.0}, {"contact_damping_time": 2e-5}, {"table_mass": 461.5}):
        with pytest.raises(CheckError, match=r"axis: \w+ differs by .* from an integration in Python"):
            reference_motion(opened, rows, **change)


def reference_motion(opened, rows, **changes):
    one, results = NativeModel(closed_form(), False, AXIS), []
    one.latch(**changes)
    names = [v.name for v in AXIS.variables(closed_form().header) if v.causality == "output"]
    for row in rows:
        one.step(STEP, **row)
        results.append(dict(zip(names, one.values(names), strict=True)))
    return check_axis(closed_form(), rows, results)


def test_a_replay_that_differs_or_is_not_a_number_is_found(tmp_path, capsys):
    """Another map by 1e-8, an output not a number, an output of few steps: real FMUs with such code."""
    whole = 'outputs["friction_torque"] = '
    sources = runtime_sources()
    assert whole in sources["runtime_standstill"]
    for name, text in (("nan", 'float("nan") + '), ("late", "(1e-3 if speed < -200.0 else 0.0) + ")):
        code = sources["runtime_standstill"].replace(whole, whole + text)
        fmu = build_fmu(make_map(), tmp_path / f"{name}.fmu", sources | {"runtime_standstill": code}).path
        with pytest.raises(CheckError, match=r"replay step \d+: friction_torque\w* = "):
            checks.check(fmu, reference_of(make_map()))
        assert "friction_torque" in one_line(capsys, 1, "check", fmu)
    other = build_fmu(make_map(viscous_scale=1.0 + 1e-8), tmp_path / "other.fmu").path
    with pytest.raises(CheckError, match=r"replay step \d+: .* the map: "):
        checks.check(other, reference_of(make_map()))
    one_row = list(reference_input(make_map().header))[:1]
    with pytest.raises(CheckError, match="replay: outputs"):
        check_replay(other, Reference(STEP, one_row, [{"preload": 1.0}]), "")


def with_table(files, change):
    (place,) = [name for name in files if name.endswith("validation_out.csv")]
    return files | {place: "\n".join(change(files[place].decode().splitlines())).encode() + b"\n"}


def with_cell(change):
    def changed(lines):
        time, value, rest = lines[4].split(",", 2)
        return [*lines[:4], f"{time},{change(float(value))!r},{rest}", *lines[5:]]

    return lambda files: with_table(files, changed)


def replaced(end, change):
    """The one file whose path has this end, changed; None: without it."""

    def new(files):
        (name,) = [name for name in files if name.endswith(end)]
        content = change(files[name])
        return {n: c for n, c in files.items() if n != name} | ({} if content is None else {name: content})

    return new


DAMAGES = [  # of the validation of a native FMU
    (with_cell(lambda x: math.nan), "validation in the FMU: nan"),
    (lambda files: with_table(files, lambda lines: lines[:9]), "validation: replay: "),
    (lambda files: with_table(files, lambda lines: [*lines[:9], "a,b"]), "not a table of numbers"),
    (replaced("validation_out.csv", lambda content: None), "validation_out.csv: No such file"),
]


def test_damage_is_one_line(built, tmp_path, capsys):
    damaged = tmp_path / "damaged.fmu"
    differs = with_cell(lambda x: x + 1), r"validation: replay step 3: .* = .*; validation in the FMU: "
    cases = [(FRICTION, *damage) for damage in DAMAGES] + [(model, *differs) for model in MODELS]
    for model, change, message in cases:
        write_fmu(damaged, change(members(built(model, 3))))
        assert re.search(message, one_line(capsys, 1, "check", damaged)), message
    write_fmu(damaged, replaced("nut_map.npz", lambda content: content[:999])(members(built())))
    one_line(capsys, 1, "check", damaged)


def test_another_map_in_a_native_fmu_is_named(built, synthetic_nut_map, tmp_path, capsys):
    own, fmu, other = synthetic_nut_map.header["content_hash"], built(FRICTION, 2), tmp_path / "other.fmu"
    swapped = replaced("nut_map.bin", lambda c: c.replace(own.encode(), own[::-1].encode()))
    write_fmu(other, swapped(members(fmu)))
    for file, note in ((other, f"map {own[::-1]}, not that of the description"), (fmu, f"map {own}\n")):
        assert main(["info", str(file)]) == 0
        assert note in capsys.readouterr().out
    assert "damaged" in one_line(capsys, 1, "check", other)  # its checksum is wrong


def test_what_is_not_an_fmu_is_refused_in_one_line(tmp_path, capsys):
    text, empty, broken = (tmp_path / f"{name}.fmu" for name in ("text", "empty", "broken"))
    text.write_text("no archive")
    write_fmu(empty, {"readme.txt": b"nothing"})
    write_fmu(broken, {"modelDescription.xml": b"<fmiModelDescription fmiVersion='2.0'/>"})
    words = {text: "not an FMU", empty: "not an FMU", broken: "broken.fmu", tmp_path: "a folder"}
    words[tmp_path / "a.fmu"] = "no such"
    for command in ("check", "info"):
        for file, word in words.items():
            assert word in one_line(capsys, 2, command, file)
