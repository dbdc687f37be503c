"""Wheel and source archive: what they hold, and that the wheel alone evaluates a map and writes an FMU elsewhere."""

import shutil
import tarfile
import zipfile

import pytest
from paths import ROOT
from processes import output

BUILD = "from setuptools import build_meta as b; print(b.build_sdist('out')); print(b.build_wheel('out'))"
#: run with the unpacked wheel alone: a point of the map, a screw file, an FMU for Python hosts
USE = """
from ballscrew_fmu.command import main
assert main(["torque", "--preload-n", "2000", "--speed-rpm", "500", "--temperature-c", "30", "--json"]) == 0
assert main(["init", "my.toml"]) == 0
assert main(["build", "--python-only", "--output", "fmus"]) == 0
assert main(["check", "fmus/BallScrewFriction.fmu"]) == 0
import ballscrew_tehl
print(ballscrew_tehl.__file__)
"""
LEFT_OUT = (".*", "dist", "build", "*.egg-info", "__pycache__", "*.nb[ci]", "*.pyc")


@pytest.mark.slow
def test_archives_are_complete_and_the_wheel_alone_works(tmp_path):
    project, elsewhere = tmp_path / "project", tmp_path / "elsewhere"
    shutil.copytree(ROOT, project, ignore=shutil.ignore_patterns(*LEFT_OUT))
    files = {"pyproject.toml", "build_fmu.py", "README.md", "CHANGELOG.md", "LICENSE", "CITATION.cff"}
    for folder in ("solver", "fmu_src", "tests", "examples", "docs"):
        found = (path for path in (project / folder).rglob("*") if path.is_file())
        files |= {path.relative_to(project).as_posix() for path in found}
    output("-c", BUILD, folder=project)
    (source,), (wheel,) = (project / "out").glob("*.tar.gz"), (project / "out").glob("*.whl")
    with tarfile.open(source) as archive:
        assert files - {name.partition("/")[2] for name in archive.getnames()} == set()
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        archive.extractall(tmp_path / "site")
    assert {"ballscrew_tehl/py.typed", "ballscrew_fmu/py.typed", "ballscrew_tehl/data/gd4008.toml"} <= names
    assert not any("atlas_builder" in name for name in names)
    assert any(name.startswith("ballscrew_fmu/native/core/") and name.endswith(".h") for name in names)
    elsewhere.mkdir()
    printed = output("-c", USE, folder=elsewhere, PYTHONPATH=str(tmp_path / "site"))
    assert printed.splitlines()[-1].startswith(str(tmp_path))
