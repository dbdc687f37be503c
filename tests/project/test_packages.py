"""Wheel and source archive: what they hold, and that the wheel alone evaluates a map and writes an FMU elsewhere."""

import json
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile

import pytest
from paths import ROOT

pytestmark = pytest.mark.slow
BUILD = """
import sys
from setuptools import build_meta
print(getattr(build_meta, sys.argv[1])(sys.argv[2]))
"""
#: run with the unpacked wheel alone: a point of the map, a screw file, an FMU for Python hosts
USE = """
import json, sys
from pathlib import Path
from ballscrew_fmu.__main__ import main as fmu
from ballscrew_tehl.cli.main import main as tehl
import ballscrew_tehl
assert tehl(["torque", "--preload-n", "2000", "--speed-rpm", "500", "--temperature-c", "30", "--json"]) == 0
assert tehl(["init", "my.toml"]) == 0
assert fmu(["build", "--python-only", "--output", "fmus"]) == 0
assert fmu(["check", "fmus/BallScrewFriction.fmu"]) == 0
print(json.dumps([ballscrew_tehl.__file__, sorted(path.name for path in Path("fmus").iterdir())]))
"""


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A copy of the project without what git leaves out."""
    folder = tmp_path_factory.mktemp("project") / "project"
    ignored = shutil.ignore_patterns(
        ".git", ".venv", "dist", "build", "*.egg-info", "__pycache__", ".*_cache", ".hypothesis", "*.nb[ci]"
    )
    shutil.copytree(ROOT, folder, ignore=ignored)
    return folder


def built(project, kind):
    run = subprocess.run(
        [sys.executable, "-c", BUILD, kind, "out"], cwd=project, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr[-2000:]
    return project / "out" / run.stdout.splitlines()[-1]


def test_the_source_archive_is_complete(project):
    """Every file of the project but hidden ones."""
    with tarfile.open(built(project, "build_sdist")) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    places = [ROOT / "solver", ROOT / "fmu_src", ROOT / "tests", ROOT / "examples", ROOT / "docs"]
    files = {
        path.relative_to(ROOT).as_posix()
        for place in places
        for path in place.rglob("*")
        if path.is_file()
        and not {"__pycache__"} & set(path.parts)
        and path.suffix not in (".nbi", ".nbc", ".pyc")
    }
    files = {
        name for name in files if ".egg-info" not in name and "_cache" not in name and "/build/" not in name
    }
    top = {"pyproject.toml", "build_fmu.py", "README.md", "CHANGELOG.md", "LICENSE", "CITATION.cff"}
    assert sorted((files | top) - held) == []


def test_the_wheel_alone_works_in_another_folder(project, tmp_path):
    wheel = built(project, "build_wheel")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        archive.extractall(tmp_path / "site")
    for name in ("ballscrew_tehl/py.typed", "ballscrew_fmu/py.typed", "ballscrew_tehl/data/gd4008.toml"):
        assert name in names
    assert any(name.startswith("ballscrew_fmu/native/core/") and name.endswith(".h") for name in names)
    (scripts,) = [name for name in names if name.endswith("entry_points.txt")]
    text = (tmp_path / "site" / scripts).read_text(encoding="utf-8")
    assert "ballscrew-tehl = ballscrew_tehl.cli.main:main" in text
    assert "ballscrew-fmu = ballscrew_fmu.__main__:main" in text
    place = tmp_path / "elsewhere"
    place.mkdir()
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    run = subprocess.run(
        [sys.executable, "-c", USE], cwd=place, env=environment, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr[-3000:]
    package, fmus = json.loads(run.stdout.splitlines()[-1])
    assert package.startswith(str(tmp_path))
    assert fmus == ["BallScrewFriction.fmu", "BallScrewPreloadMonitor.fmu"]
