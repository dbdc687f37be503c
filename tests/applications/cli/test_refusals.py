"""Bad input of every command: one line on stderr that names what, value and remedy, exit code 2, nothing written."""

import dataclasses
import errno
import os
import sys
import tempfile
from contextlib import nullcontext
from unittest.mock import Mock

import pytest
from command_line import refused, run

from ballscrew_tehl.applications.calibration.written_sets import write_friction_sets
from ballscrew_tehl.applications.cli.commands import map_file
from ballscrew_tehl.applications.cli.shared.output import OTHER_FOLDER, REMEDIES
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map.file import VG100, packaged_map
from ballscrew_tehl.parameters.file import PACKAGED_DATA, PACKAGED_VG100, load_screw
from ballscrew_tehl.refinement import certificate, direct

POINT = ("--preload-n", "2000", "--speed-rpm", "1000", "--temperature-c", "30")
BUILD = ("map", "build", "--output", "x.npz")
CONTACT = ("contact", "--load-n", "60", "--radius-x-m", "2e-3", "--radius-y-m", "6e-3", "--u1-m-s", "0.5", "--u2-m-s",
           "0.4", "--temperature-k", "313.15")  # fmt: skip
MOES = ("contact", "--moes", "20", "5", "--law", "barus")
EXPORT = ("--screw", "{screw}", "--map", "{vg100}", "--format")
SIZE = ("x.toml", "--diameter-mm", "16", "--lead-mm", "5", "--turns", "3")
NUMBERS = "preload_n,speed_rpm,temperature_c\n"

#: command -> words and what the line names; {vg100}, {example}, {fit}: files of another screw
REFUSALS = {
    "": [((), "the following arguments are required: COMMAND"), (("paint",), "invalid choice: 'paint'"),
         (("--json", "torque"), "unrecognized arguments: --json"),
         (("tork",), "; is torque meant?")],
    "torque": [
        ((), "--preload-n (missing)"),
        (POINT[:4], "--temperature-c (missing); allowed: -73.15 to 200, or --points FILE.csv"),
        ((*POINT, "--temperature-c", "-274"), "--temperature-c = -274; allowed: -73.15 to 200"),
        ((*POINT, "--preload-n", "-1e3"), "--preload-n = -1e3; allowed: a finite number >= 0"),
        ((*POINT, "--preload-n", "1e3", "--friction", "{example}"), "a screw file, no friction sets; give a file that"),
        ((*POINT, "--preload"), "unrecognized arguments: --preload; is --preload-n meant?"),
        ((*POINT, "--map", "{vg100}", "--screw", "{published}"), "of the law mechanistic; expected three_parameter"),
        ((*POINT, "--friction", "three_parameter", "--screw", "gd4008_vg100.toml"), "no table published_speeds"),
        ((*POINT, "--friction", "{fit}", "--screw", "{example}"), "fitted for the screw mine"),
        ((*POINT, "--direct", "--preload-n", "0"), "allowed with --direct: not 0"),
        (("--points", "binary"), "binary: is no text; give a CSV file"),
        ((*POINT, "--screw", ""), "cannot be read (Is a directory); give the path of a screw file"),
        ((*POINT, "--map", "cut.npz"), "cut.npz: not a readable map file (of another kind, or cut short): build"),
    ],
    "preload": [
        (("--torque-nm", "1", *POINT[2:], "--speed-rpm", "0"), "--speed-rpm = 0; allowed: a finite number, not 0"),
        (("--torque-nm", "1e3", *POINT[2:]), "torque_nm = 1000 at 1000 r/min and 30 C; allowed: "),
    ],
    "contact": [
        ((), "--load-n (missing)"),
        ((*CONTACT[1:], "--domain", "1", "2", "3"), "allowed: XA < -1, XB > 1, Y > 1"),
        (MOES[1:], "--radius-ratio (missing)"),
        ((*MOES[1:], "--radius-ratio", "1", "--load-n", "3"), "--load-n = 3.0; allowed: either"),
    ],
    "oil": [((), "--iso-vg, --viscosity-index (missing)"), (("--iso-vg", "68", "--screw", "x"), "give one oil"),
            (("--iso-vg", "70", "--viscosity-index", "95"), "70")],
    "map": [(("buidl",), "; is build meant?")],
    "map info": [(("--map", "none.npz"), "none.npz: no such map file"),
                 (("{vg100}", "--screw", "{example}"), "(lead_mm = 8.0, ")],
    "map check": [(("--count", "0"), "--count = 0; allowed: a whole number >= 1"), (("--workers", "few"), "= few")],
    "map build": [
        ((), "--output (missing); allowed: a file *.npz for the map"),
        (("--family", "empty"), "allowed: a folder with screw files"),
        (("--family", ".", "--screw", "x.toml"), "--family and --screw"),
        *(((*BUILD[2:], *words), line) for words, line in (
            (("--preload-n", "2000", "500"), "preload = 2000 to 500 N; needs 0.01 <= lowest < highest <= 1e+07"),
            (("--preload-n", "1000", "1e6"), "preload = 1000 to 1e+06 N: Hertz pressure up to "),
            (("--temperature-c", "80", "400"), "allowed: 0.0001 to 10000 Pa s, that is -40 to 266 C"),
            (("--output", "text.npz"), "--output = text.npz; allowed: a new file *.npz, or a map"),
        )),
    ],
    "calibrate": [
        ((), "either MEASUREMENTS.csv or --torque-nm with its point"),
        (POINT, "--torque-nm (missing); allowed: --torque-nm, --preload-n, --speed-rpm, --temperature-c together"),
        (("--torque-nm", "1", *POINT, "--drop", "outliers"), "--drop with --torque-nm; allowed: with MEASUREMENTS.csv"),
        (("--torque-nm", "1", *POINT, "--screw", "gd4008.toml"), "law = three_parameter; allowed: mechanistic"),
        (("--torque-nm", "1", *POINT, "--screw", "{published}"), "law = three_parameter; allowed: mechanistic"),
        (("--torque-nm", "1", *POINT, "--map", "{vg100}", "--preload-n", "99999"), "outside the map: force of a nut"),
        (("--torque-nm", "80", *POINT, "--map", "{vg100}", "--output", "fit.toml"), "is 80 N.cm = 0.8 N.m meant?"),
        (("n_cm.csv", "--map", "{vg100}", "--output", "fit.toml", "--plot", "p.png"),
         "typical of 6 rows: torque = 42 N.m, 8"),
        (("measured.toml", "--output", "./measured.toml"), "is a file that this command reads; allowed: another file"),
    ],
    "identify": [
        (("measured.csv",), "column time missing (found: preload_n, speed_rpm, torque_nm)"),
        (("log.csv",), "--torque-constant-nm-a (missing); needed with a column current"),
        (("log.csv", "--torque-constant-nm-a", "1", "--lead-mm", "8"), "log.csv: current is constant"),
        (("log.csv", "--mass-kg", "1", "--inertia-kgm2", "1"), "--inertia-kgm2 and --mass-kg; allowed: one of them"),
        (("log.csv", "--offset-nm", "1+-x"), "--offset-nm: standard error = x; allowed: 0 to 1e+07"),
        (("log.csv", "--guide-force-n", "80+--1"), "--guide-force-n: standard error = -1; allowed: 0 to 1e+07"),
        (("log.csv", "--before", "log.csv"), "allowed: with both, which turn friction into preload"),
        (("text.csv", "--gain-n-v", "1"), "text.csv: line 4: position [m] = 'x'; allowed: a number"),
        (("back.csv", "--gain-n-v", "1"), "time runs backwards 1 times, first from 0.008 to 0.005 s after row 9"),
    ],
    "export": [
        ((*EXPORT, "twincat", "--output", "x.lis"), "--torque-constant-nm-a; needed with --format twincat"),
        ((*EXPORT, "csv", "--output", "x.csv", "--torque-constant-nm-a", "1"), "allowed only with --format twincat"),
        ((*EXPORT, "matlab", "--output", "1 x.m"), "allowed: the name of a MATLAB function"),
        ((*EXPORT, "csv", "--output", "x.csv", "--preload-n", "9", "99999"), "preload = 9 N; allowed by the map: 120 "),
        ((*EXPORT, "csv", "--output", "x.csv", "--speed-rpm", "9", "9000"), "allowed: a rising range in 5 to 6000 "),
        ((*EXPORT, "csv", "--output", "x.csv", "--identified", "log.csv"), "--screw with --identified; allowed: with"),
        (("--format", "csv", "--output", "x.csv", "--identified", "log.csv"), "that identify --output has written"),
        (("--format", "csv", "--output", "x.csv", "--identified", "one_way.json"), "friction of one direction, 1 to 3"),
    ],
    "report": [
        (("--output", "r.pdf"), "r.pdf; allowed: a file *.html, *.htm"),
        (("--output", "r.html", "--screw", "{screw}", "--map", "{vg100}", "--preload-n", "99999"),
         "preload = 99999 N; allowed: "),
        (("--output", "r.html", "--screw", "{screw}", "--map", "{vg100}", "--speed-rpm", "0"),
         "speed = 0 r/min; allowed: "),
    ],
    "init": [
        (("x.toml", "--oil", "isovg"), "; is iso_vg meant?"), (("x.txt",), "allowed: a new file *.toml"),
        ((*SIZE, "--rating-n", "1380"), "1380 kgf are --rating-n 13533"),
        ((*SIZE, "--static-rating-n", "2500"), "2500 kgf are --static-rating-n 24517"),
        # a lead of 0.2 in: 1600 * 4.448 * 0.2^(-1/3)
        (("x.toml", "--diameter-in", "1", "--lead-in", "0.2", "--turns", "3", "--rating-n", "1600"),
         "1600 lbf for a million inches of travel are --rating-n 12170"),
        ((*SIZE, "--lead-in", "0.2"), "--lead-in with --lead-mm"),
    ],
}  # fmt: skip


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with a text, measurements and files of other screws; no contact may be solved."""
    monkeypatch.setattr(direct, "solve_ball", lambda *_, **options: pytest.fail("a contact was solved"))
    monkeypatch.chdir(tmp_path)
    for name, slope in (("measured.csv", 4e-4), ("measured.toml", 4e-4), ("n_cm.csv", 0.04)):
        rows = (f"{f},{n},{slope * f * (1.0 + 1e-4 * n)}" for f in (1000, 2000) for n in (100, 500, 900))
        (tmp_path / name).write_text("preload_n,speed_rpm,torque_nm\n" + "\n".join(rows))
    time = [0.001 * k for k in range(300)]
    for name, heading, rows in (
        ("log", "time [s],position [m],current [A]", [f"{t},{t},1" for t in time]),
        ("text", "time [s],position [m],voltage [V]", [f"{t},{'x' if 0.001 < t < 0.007 else t},{t}" for t in time]),
        ("back", "time [s],position [m],voltage [V]", [f"{t},{t},{t}" for t in time[:9] + time[5:]]),
    ):  # fmt: skip
        (tmp_path / f"{name}.csv").write_text("\n".join([heading, *rows]))
    torque = '"torque_nm": 1, "torque_error_nm": 1, "torque_low_nm": 0, "torque_high_nm": 2, "samples": 9'
    bins = ", ".join(f'{{"speed_rpm": {n}, {torque}}}' for n in (1, 2, 3))
    (tmp_path / "one_way.json").write_text(f'{{"kind": "rotary", "friction": [{bins}]}}')
    (tmp_path / "text.npz").write_text("notes")
    (tmp_path / "binary").write_bytes(b"a\x81\xff\n\x00")
    (tmp_path / "cut.npz").write_bytes(packaged_map(VG100).read_bytes()[:1000])
    (tmp_path / "empty").mkdir()
    return tmp_path


def named(word):
    return word.format(vg100=packaged_map(VG100), screw=PACKAGED_VG100, example=PACKAGED_DATA / "example_25x10.toml",
                       published=PACKAGED_DATA / "gd4008.toml", fit="fit.toml")  # fmt: skip


@pytest.mark.parametrize("command", REFUSALS, ids=lambda name: name or "none")
def test_bad_input_is_one_line_and_exit_code_2(capsys, command, folder):
    law = load_screw(PACKAGED_VG100)
    fit = default_friction_set(law)
    write_friction_sets("fit.toml", [dataclasses.replace(fit, screw="mine")])
    before = sorted(folder.rglob("*"))
    for words, line in REFUSALS[command]:
        said = refused(capsys, *command.split(), *map(named, words))
        assert line in said, words
    assert sorted(folder.rglob("*")) == before


#: the dialect of files: tests/tables
POINTS = (
    (f"{NUMBERS}1,2,3\n1,nan,3\n", "points.csv: row 2: speed_rpm = nan; allowed: a finite number"),
    ("preload_n,speed_rpm,axial_load\n1,2,3\n", "column 'axial_load': unit missing; write axial_load [UNIT]"),
    ("preload [kN],preload_n,speed_rpm\n2,100,3\n", "columns 'preload [kN]' and 'preload_n' both are"),
    ("preload_n;speed_rpm;temperature_c\n1.500;2,5;3\n", "no point (thousands or decimal?), 1.500 or 1500"),
    ("moes,radius_ratio,lore\n20 5,1,barus\n", "row 1: unrecognized arguments: --lore barus"),
    ("moes,isothermal\n20 5,maybe\n", "row 1: --isothermal = maybe; allowed: true, "),
)


def test_bad_points_are_named_with_their_place(capsys, folder):
    for text, line in POINTS:
        (folder / "points.csv").write_text(text)
        command = "contact" if text.startswith("moes") else "torque"
        assert line in refused(capsys, command, "--points", "points.csv")
    (folder / "points.csv").write_text(f"{NUMBERS}1,2,3\n")
    said = refused(capsys, "torque", "--points", "points.csv", "--speed-rpm", "5")
    assert "--speed-rpm = 5, points.csv has this column in all rows" in said


#: arguments with {} for the file, option or name of the argument, suffix of the file
OUTPUTS = {
    "init": (("init", "{}"), "FILE.toml", ".toml"),
    "map build": (("map", "build", "--output", "{}"), "--output", ".npz"),
    "calibrate": (("calibrate", "measured.csv", "--output", "{}"), "--output", ".toml"),
    "report": (("report", "--output", "{}"), "--output", ".html"),
    "identify --measurements": (("identify", "log.csv", "--measurements", "{}"), "--measurements", ".csv"),
    "export": (("export", "--format", "json", "--output", "{}"), "--output", ".json"),
}


@pytest.mark.parametrize("name", OUTPUTS)
def test_outputs_that_cannot_be_written_are_refused_before_the_work(name, folder, capsys, monkeypatch):
    """Also a folder that refuses, as one without permission would an ordinary user."""
    words, option, suffix = OUTPUTS[name]
    (folder / f"here{suffix}").mkdir()
    before = sorted(folder.rglob("*"))

    def line(stem):
        said = refused(capsys, *(word.format(f"{stem}{suffix}") for word in words))
        assert f"{option} = {stem}{suffix}" in said
        assert sorted(folder.rglob("*")) == before
        return said

    assert "text.npz is not a folder; allowed: a path below a folder" in line("text.npz/x")
    assert "is a folder; allowed: a" in line("here")
    assert f"*{suffix}" in refused(capsys, *(word.format("x.xyz") for word in words))
    for number, remedy in ((errno.EACCES, OTHER_FOLDER), (errno.ENOSPC, REMEDIES[errno.ENOSPC])):
        error = OSError(number, os.strerror(number), "/scratch/.x.tmp")
        monkeypatch.setattr(tempfile, "NamedTemporaryFile", Mock(side_effect=error))
        assert f". cannot be written ({os.strerror(number)}); remedy: {remedy}" in line("new/folder/x")


@pytest.mark.slow
def test_a_disk_that_fills_or_ctrl_c_during_the_work_leaves_nothing(folder, capsys, monkeypatch):
    before = sorted(folder.iterdir())
    published = packaged_map("published")
    calibrate = "calibrate", "measured.csv", "--map", published, "--output", "new/folder/x.toml"
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    compiled = SystemError("a compiled function returned a result with an exception set")
    compiled.__cause__ = SystemError("again")
    compiled.__cause__.__cause__ = KeyboardInterrupt()
    for words in (("init", "new/x.toml"), calibrate):
        for event in (full, KeyboardInterrupt(), compiled):
            monkeypatch.setattr(os, "replace", Mock(side_effect=event))
            if event is full:
                remedy = REMEDIES[errno.ENOSPC]
                assert f"cannot be written ({full.strerror}); remedy: {remedy}" in refused(capsys, *words)
            else:
                assert run(capsys, *words)[:2] == (130, "")
            assert sorted(folder.iterdir()) == before


def test_a_missing_package_is_named_with_its_extra(capsys, folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    line = refused(capsys, "report", "--output", "r.html")
    assert "matplotlib is not installed; remedy: python -m pip install 'ballscrew-tehl[report]'" in line


def test_check_of_a_worse_map_fails(capsys, monkeypatch):
    monkeypatch.setattr(map_file, "worker_pool", lambda workers: nullcontext())
    for error, expected in ((0.0, 0), (0.5, 1)):
        monkeypatch.setattr(certificate, "deviation_at", lambda *_, e=error: certificate.Deviation(e, e, e))
        code, _, err = run(capsys, "map", "check", "--count", "2")
        assert code == expected
        assert "certificate: points solved: 3 of 3 in " in err
        assert ("map differs from direct solves by 5.00e-01" in err) == bool(expected)
