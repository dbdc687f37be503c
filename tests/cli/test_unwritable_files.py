"""Files that cannot be written: one line with option, path, reason and remedy, before the long work; nothing left."""

import errno
import os
import tempfile

import pytest
from command_line import refused

from ballscrew_tehl.cli import files
from ballscrew_tehl.nut_map.file import packaged_map
from ballscrew_tehl.refinement import direct

#: arguments with {} for the file, option or name of the argument, suffix of the file
COMMANDS = {
    "init": (("init", "{}"), "FILE.toml", ".toml"),
    "map build": (("map", "build", "--quick", "--output", "{}"), "--output", ".nc"),
    "map atlas": (("map", "atlas", "--output", "{}"), "--output", ".npz"),
    "map plot": (("map", "plot", "--output", "{}"), "--output", ".png"),
    "calibrate": (("calibrate", "measured.csv", "--output", "{}"), "--output", ".toml"),
    "calibrate --plot": (("calibrate", "measured.csv", "--plot", "{}"), "--plot", ".png"),
    "calibrate --packaged": (("calibrate", "--packaged", "--output", "{}"), "--output", ".toml"),
    "validate": (("validate", "--plot", "{}"), "--plot", ".png"),
}
MAP = str(packaged_map("published"))
ROWS = "preload_n,speed_rpm,torque_nm\n" + "\n".join(
    f"{preload},{speed},{4e-4 * preload * (1.0 + 1e-4 * speed)}"
    for preload in (1000, 2000)
    for speed in (100, 500, 900)
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder; a contact that is solved fails."""

    def solved(*arguments, **options):
        raise AssertionError("a contact was solved before the file was refused")

    monkeypatch.setattr(direct, "solve_ball", solved)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "measured.csv").write_text(ROWS)
    (tmp_path / "regular").write_text("")
    return tmp_path


def arguments_of(name, path):
    words, option, suffix = COMMANDS[name]
    path = f"{path}{suffix}"
    return [word.format(path) for word in words], f"{option} = {path}: "


@pytest.mark.parametrize("name", COMMANDS)
def test_a_path_below_a_file_is_refused(name, folder, capsys):
    before = sorted(folder.iterdir())
    words, where = arguments_of(name, "regular/x")
    assert f"{where}regular is not a folder; allowed: a path below a folder" in refused(capsys, *words)
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize("name", COMMANDS)
def test_a_folder_as_output_is_refused(name, folder, capsys):
    words, where = arguments_of(name, "here")
    (folder / f"here{COMMANDS[name][2]}").mkdir()
    before = sorted(folder.rglob("*"))
    assert f"{where}is a folder; allowed: a" in refused(capsys, *words)
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "map build"])
def test_a_missing_folder_is_refused(name, folder, capsys):
    words, where = arguments_of(name, "nowhere/x")
    line = refused(capsys, *words)
    assert f"{where}no such folder; allowed: a" in line
    assert line.endswith("in a folder that exists")


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize(
    ("number", "remedy"),
    [
        (errno.EACCES, files.OTHER_FOLDER),
        (errno.EROFS, files.OTHER_FOLDER),
        (errno.ENOSPC, files.REMEDIES[errno.ENOSPC]),
    ],
)
def test_a_folder_that_refuses_is_found_before_the_work(name, number, remedy, folder, capsys, monkeypatch):
    """As a folder without permission, which would not hinder an administrator."""

    def refuse(*arguments, **options):
        raise OSError(number, os.strerror(number), "/scratch/.x.tmp")

    monkeypatch.setattr(tempfile, "NamedTemporaryFile", refuse)
    before = sorted(folder.iterdir())
    words, where = arguments_of(name, "x")
    line = refused(capsys, *words)
    assert f"{where}. cannot be written ({os.strerror(number)}); remedy: {remedy}" in line
    assert "Errno" not in line
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize(
    ("words", "where"),
    [
        (("init", "x.toml"), "FILE.toml = x.toml"),
        (("map", "plot", "--output", "x.png"), "--output = x.png"),
        (
            ("calibrate", "measured.csv", "--map", MAP, "--output", "x.toml"),
            "--output = x.toml",
        ),
        (("calibrate", "measured.csv", "--map", MAP, "--plot", "x.png"), "--plot = x.png"),
    ],
)
def test_a_disk_that_fills_during_the_work_leaves_nothing(words, where, folder, capsys, monkeypatch):
    def full(*arguments, **options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "replace", full)
    monkeypatch.setattr(os, "link", full)
    before = sorted(folder.iterdir())
    line = refused(capsys, *words)
    assert line.endswith(
        f"{where}: cannot be written ({os.strerror(errno.ENOSPC)}); remedy: {files.REMEDIES[errno.ENOSPC]}"
    )
    assert sorted(folder.iterdir()) == before


def test_a_lock_that_cannot_be_opened_is_not_another_build(folder, capsys):
    (folder / "x.nc.contacts.lock").mkdir()
    line = refused(capsys, "map", "build", "--quick", "--output", "x.nc")
    assert "--output = x.nc: x.nc.contacts.lock cannot be written; remedy: remove or rename it" in line
    assert "another build" not in line


def test_a_family_whose_folder_cannot_be_made_is_refused(folder, capsys):
    assert refused(capsys, "init", "no/screw.toml")
    (folder / "screws").mkdir()
    (folder / "screws" / "a.toml").write_text("not read")
    line = refused(capsys, "map", "build", "--quick", "--family", "screws", "--output", "regular/maps")
    assert "--output = regular/maps: regular is not a folder; allowed: a path below a folder" in line


def test_an_error_of_the_system_elsewhere_names_file_reason_and_remedy():
    error = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "x.nc.contacts")
    assert files.os_error_text(error) == (
        f"x.nc.contacts: {os.strerror(errno.ENOSPC)}; remedy: {files.REMEDIES[errno.ENOSPC]}"
    )
    # a worker that died: no number, no file
    assert files.os_error_text(ChildProcessError("a worker process has died")) == "a worker process has died"


@pytest.mark.parametrize("name", COMMANDS)
def test_another_suffix_is_refused(name, folder, capsys):
    words, option, suffix = COMMANDS[name]
    error = refused(capsys, *(word.format("x.xyz") for word in words))
    assert f"{option} = x.xyz; allowed: " in error
    assert f"*{suffix}" in error
    assert not (folder / "x.xyz").exists()


@pytest.mark.parametrize(("option", "suffix"), [("--output", ".toml"), ("--plot", ".png")])
def test_what_calibrate_reads_is_not_overwritten(option, suffix, folder, capsys):
    measured = folder / f"measured{suffix}"
    measured.write_text(ROWS)
    # by another name of the same file
    again = folder / "regular" / ".." / measured.name if os.name == "nt" else f"./{measured.name}"
    error = refused(capsys, "calibrate", measured.name, option, str(again))
    assert "is a file that this command reads; allowed: another file" in error
    assert measured.read_text() == ROWS
