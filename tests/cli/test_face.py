"""The command `ballscrew`: pages of help, old names, completion, rows; what a map and the library give."""

import os
import re
import subprocess
import sys

import pytest
from command_line import answer, run

import ballscrew_tehl
from ballscrew_fmu.command import BALLSCREW, FMUS
from ballscrew_tehl.cli.parser import SOLVER, build_parser
from ballscrew_tehl.nut_map.file import VG100, packaged_map
from ballscrew_tehl.parameters.file import PACKAGED_DATA
from ballscrew_tehl.parameters.units import RPM

POINT = ("--preload-n", "2000", "--speed-rpm", "1000", "--temperature-c", "30")


def pages(parser, command):
    """Command and parser of every page below one."""
    yield command, parser
    if command.actions:
        (below,) = (action for action in parser._actions if action.choices and not action.option_strings)
        for word, action in command.actions.items():
            yield from pages(below.choices[word], action)


def test_each_page_fits_a_screen_and_its_example_is_understood(monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    for face in (BALLSCREW, SOLVER, FMUS):
        whole = build_parser("ballscrew", face)
        for command, parser in pages(whole, face):
            lines = parser.format_help().splitlines()
            assert len(lines) <= 40, parser.prog
            assert {"--version", *(["--json"] if command.run else [])} <= set(
                parser._option_string_actions
            ), parser.prog
            assert all(len(line) <= 100 for line in lines), parser.prog
            if command.run:
                assert lines[2] == f"  {parser.prog} {command.example}"
                assert whole.parse_args(lines[2].split()[1:]).run == command.run
    assert sorted(BALLSCREW.actions) == sorted(name for names in BALLSCREW.groups.values() for name in names)


def test_completion_imports_nothing_slow(tmp_path):
    """By the protocol of argcomplete, as its functions of the shells call the program."""
    found, line = tmp_path / "found", "ballscrew torque --pre"
    variables = {"_ARGCOMPLETE": "1", "COMP_LINE": line, "COMP_POINT": str(len(line))}
    words = "-X", "importtime", "-c", "from ballscrew_fmu.command import main; main()"
    environment = os.environ | variables | {"_ARGCOMPLETE_STDOUT_FILENAME": str(found)}
    done = subprocess.run([sys.executable, *words], env=environment, capture_output=True, text=True)
    assert (done.returncode, found.read_text()) == (0, "--preload-n ")
    assert not re.search("numpy|pydantic|rich", done.stderr)


def test_a_reader_that_has_left_is_no_error():
    """As in ballscrew torque ... | head -1, whether the interpreter or its end flushes the output."""
    words = "-m", "ballscrew_tehl", "torque", *POINT
    for unbuffered in ("", "1"):
        reader, writer = os.pipe()
        os.close(reader)
        environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
        done = subprocess.run(
            [sys.executable, *words], env=environment, stdout=writer, stderr=subprocess.PIPE
        )
        os.close(writer)
        assert (done.returncode, done.stderr) == (0, b"")


def test_names_are_printed_where_their_letters_are_none(tmp_path):
    screw, words = tmp_path / "screw.toml", (sys.executable, "-m", "ballscrew_tehl", "screw", "--screw")
    text = (PACKAGED_DATA / "gd4008.toml").read_text(encoding="utf-8")
    screw.write_text(text.replace('"GD4008-3"', '"Spindel \u00fc"'), encoding="utf-8")
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = subprocess.run([*words, screw], env=environment, capture_output=True)
    assert (done.returncode, done.stdout.count(rb"Spindel \xfc")) == (0, 1)


def test_a_map_finds_its_screw(capsys):
    law = packaged_map(VG100)
    for words in (("map", "info", law), ("map", "info", "--map", law), ("torque", *POINT, "--map", law)):
        alone, _ = answer(capsys, *words)
        assert alone["kinematics"] == "rolling_frame"
        assert alone == answer(capsys, *words, "--screw", law.with_name("gd4008_vg100.toml"))[0]
    library = {name: getattr(ballscrew_tehl, name) for name in ballscrew_tehl.__all__}
    for name in ("load_map", "calibrate"):
        with pytest.raises(ValueError, match=r"parameters = .own.toml.; needs what load_screw"):
            library[name](law, "own.toml")
    state = library["load_map"](law).evaluate(2000.0, 1000.0 * RPM, 303.15)
    assert float(state.friction_torque) == pytest.approx(alone["friction_torque_nm"], rel=1e-12)


def test_rows_fit_the_terminal_and_the_file_has_all(capsys, tmp_path, monkeypatch):
    points, out = tmp_path / "points.csv", tmp_path / "out.csv"
    points.write_text("preload_n,speed_rpm,temperature_c\n500,100,20\n12345,2500,80\n")
    words = "torque", "--points", points
    for columns in (60, 80):
        monkeypatch.setenv("COLUMNS", str(columns))
        _, text, _ = run(capsys, *words)
        assert all(len(line) <= columns for line in text.splitlines())
        assert "film_thickness_min_m" in text
    assert run(capsys, *words, "--output", out)[:2] == (0, "")
    head, *rows = (line.split(",") for line in out.read_text().splitlines())
    found, _ = answer(capsys, *words)
    assert head[:5] == list(found[0])[:5]
    assert [float(row[4]) for row in rows] == [one["friction_torque_nm"] for one in found]
