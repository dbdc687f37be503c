"""The command `ballscrew`: pages of help, old names, completion, rows; what a map and the library give."""

import os
import subprocess
import sys

import pytest
from command_line import answer, run

import ballscrew_tehl
from ballscrew_tehl.nut_map.file import VG100, packaged_map
from ballscrew_tehl.parameters.units import RPM

POINT = ("--preload-n", "2000", "--speed-rpm", "1000", "--temperature-c", "30")


def test_a_reader_that_has_left_is_no_error():
    words = "-m", "ballscrew_tehl", "torque", *POINT
    for unbuffered in ("", "1"):
        reader, writer = os.pipe()
        os.close(reader)
        environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
        command = sys.executable, *words
        done = subprocess.run(command, env=environment, stdout=writer, stderr=subprocess.PIPE)
        os.close(writer)
        assert (done.returncode, done.stderr) == (0, b"")


def test_a_map_finds_its_screw(capsys):
    law = packaged_map(VG100)
    for words in (("map", "info", law), ("map", "info", "--map", law), ("torque", *POINT, "--map", law)):
        alone, _ = answer(capsys, *words)
        assert "mechanistic" in (alone.get("law"), alone.get("friction_set"))
        assert alone == answer(capsys, *words, "--screw", law.with_name("gd4008_vg100.toml"))[0]
    assert "content_hash" not in run(capsys, "map", "info", law)[1]
    library = {name: getattr(ballscrew_tehl, name) for name in ballscrew_tehl.__all__}
    for name in ("load_map", "calibrate"):
        with pytest.raises(ValueError, match=r"parameters = .own.toml.; needs what load_screw"):
            library[name](law, "own.toml")
    state = library["load_map"](law).evaluate(2000.0, 1000.0 * RPM, 303.15)
    assert float(state.friction_torque) == pytest.approx(alone["friction_torque_nm"], rel=1e-12)
