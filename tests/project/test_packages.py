"""Wheel and source archive: what they hold, and that the wheel with [fmu] alone runs every command and example."""

import os
import re
import shutil
import subprocess
import sysconfig
import tarfile
import venv
import zipfile
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from paths import ROOT
from processes import output

from ballscrew_fmu.native_fmu.compile import PLATFORMS

BUILD = "from setuptools import build_meta as b; print(b.build_sdist('out')); print(b.build_wheel('out'))"
#: a log of a screw with 1e-3 kg m2 that turns both ways, written where the commands run
LOG = """
import numpy as np
t = 1e-3 * np.arange(20000)
w = 100.0 * np.clip(3.0 * np.sin(2.0 * np.pi * t / 4.0), -1.0, 1.0)
q = 1e-3 * np.gradient(w, 1e-3) + np.sign(w) * 0.4 + 2e-3 * w + np.random.default_rng(1).normal(0.0, 0.01, t.size)
table = np.c_[t, np.cumsum(w) * 1e-3, q]
np.savetxt("log.csv", table, delimiter=",", header="time [s],position [rad],torque [N.m]", comments="")
"""
POINT = "--preload-n 2000 --speed-rpm 500 --temperature-c 30"
#: commands and their exit codes, in this order; not 0: what solves contacts, and what compiles
COMMANDS = f"""
0 init my.toml --diameter-mm 32 --lead-mm 10
0 screw --screw my.toml
0 oil --iso-vg 68 --viscosity-index 95
0 map build --screw my.toml --output my.npz
0 map info my.npz
2 map check --map my.npz
0 torque {POINT} --screw my.toml --json
0 torque {POINT} --screw gd4008_vg100.toml
2 torque {POINT} --direct
0 preload --torque-nm 0.6 --speed-rpm 500 --temperature-c 30
2 contact --moes 20 5 --radius-ratio 1 --law barus
0 identify log.csv
0 calibrate --torque-nm 0.4 {POINT} --screw my.toml --output my_fit.toml
0 export --screw my.toml --format csv --output friction.csv
0 report --screw my.toml --output report.html
0 page --output page.html
0 build --output fmus
0 info fmus/BallScrewAxis_fmi3.fmu
1 build --embed-map --output embedded
0 examples --copy examples
"""
#: examples that end within seconds are run; all are imported, which is where a package or a file is missing
RUN = (
    "catalogue_screws",
    "torque_over_speed",
    "bearing_friction",
    "kinematics_comparison",
    "modelica_interface",
    "paper/claims",
)
LEFT_OUT = (".*", "dist", "build", "*.egg-info", "__pycache__", "*.nb[ci]", "*.pyc")


@pytest.fixture(scope="module")
def archives(tmp_path_factory):
    """Source archive and wheel of a copy of the tree, and the names of its files."""
    project = tmp_path_factory.mktemp("archives") / "project"
    shutil.copytree(ROOT, project, ignore=shutil.ignore_patterns(*LEFT_OUT))
    sources = os.pathsep.join(str(project / name) for name in ("solver", "fmu_src"))
    files = {"pyproject.toml", "build_fmu.py", "README.md", "CHANGELOG.md", "LICENSE", "CITATION.cff"}
    for folder in ("solver", "fmu_src", "tests", "examples", "docs"):
        found = (path for path in (project / folder).rglob("*") if path.is_file())
        files |= {path.relative_to(project).as_posix() for path in found}
    output("-m", "ballscrew_fmu.native_fmu.libraries", folder=project, PYTHONPATH=sources)
    output("-c", BUILD, folder=project)
    return next((project / "out").glob("*.tar.gz")), next((project / "out").glob("*.whl")), files


def required(name, extras):
    """Names of the distributions that one needs with some extras, by the metadata of each."""
    todo, names = [(name, frozenset(extras))], set()
    while todo:
        if (item := todo.pop()) in names:
            continue
        names.add(item)
        for one in map(Requirement, distribution(item[0]).requires or []):
            if one.marker is None or any(one.marker.evaluate({"extra": extra}) for extra in ("", *item[1])):
                todo.append((one.name, frozenset(one.extras)))
    return {item[0] for item in names} - {name}


@pytest.fixture(scope="module")
def environment(archives, tmp_path_factory):
    """Programs of an environment that holds the wheel and what its extra fmu needs, by links to those of the tests."""
    folder = tmp_path_factory.mktemp("wheel") / "environment"
    venv.create(folder, with_pip=False, symlinks=True)
    site = Path(sysconfig.get_path("purelib", "venv", {"base": str(folder)}))
    for name in required("ballscrew-tehl", {"fmu"}):
        for top in {path.parts[0] for path in distribution(name).files} - {"..", "__pycache__"}:
            if not (site / top).exists():
                (site / top).symlink_to(distribution(name).locate_file(top))
    python = folder / "bin" / "python"
    output("-m", "pip", "--python", python, "install", "--no-deps", "--no-index", archives[1], PYTHONPATH="")
    return folder / "bin"


@pytest.mark.slow
def test_archives_are_complete(archives):
    source, wheel, files = archives
    with tarfile.open(source) as archive:
        assert files - {name.partition("/")[2] for name in archive.getnames()} == set()
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert {"ballscrew_tehl/py.typed", "ballscrew_fmu/py.typed", "ballscrew_tehl/data/gd4008.toml"} <= names
    assert not any("atlas_builder" in name for name in names)
    assert any(name.startswith("ballscrew_fmu/native/core/") and name.endswith(".h") for name in names)


@pytest.mark.slow
def test_wheel_with_the_extra_fmu_runs_every_command_and_example(archives, environment, tmp_path):
    """Exit code 0, or one line with a remedy: an extra of the wheel. There is no compiler."""

    def run(expected, *arguments, program="python"):
        variables = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")} | {
            "PATH": "",
            "CC": "",
        }
        done = subprocess.run(
            [environment / program, *arguments],
            cwd=tmp_path,
            env=variables,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode in expected, f"{arguments}: {done.returncode}\n{done.stderr[-2000:]}"
        if done.returncode:
            line = done.stderr.strip().splitlines()[-1]
            assert "Traceback" not in done.stderr
            extra = re.search(r"pip install '?(?:ballscrew-tehl\[(\w+)\]|ziglang)", line)
            assert extra, line
            assert extra[1] in (None, *distribution("ballscrew-tehl").metadata.get_all("Provides-Extra"))
        return done.stdout

    run((0,), "-c", LOG)
    for code, *words in map(str.split, COMMANDS.strip().splitlines()):
        run((int(code),), *words, program="ballscrew")
    fmus = sorted((tmp_path / "fmus").iterdir())
    assert len(fmus) == 9
    for fmu in fmus:
        assert re.search(r"no finding\n(.*\n)*replay", run((0,), "check", fmu, program="ballscrew"))
    with zipfile.ZipFile(tmp_path / "fmus" / "BallScrewAxis_fmi3.fmu") as archive:
        folders = {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}
    assert folders == set(PLATFORMS)
    copied = {
        path.relative_to(tmp_path).as_posix() for path in (tmp_path / "examples").rglob("*") if path.is_file()
    }
    assert {name for name in archives[2] if name.startswith("examples/")} == copied
    for script in sorted((tmp_path / "examples").rglob("*.py")):
        folder, name = script.parent, script.relative_to(tmp_path / "examples").with_suffix("").as_posix()
        importing = f"import sys; sys.path.insert(0, {str(folder)!r}); import {script.stem}"
        run((0, 1, 2), *([script] if name in RUN else ["-c", importing]))
