"""Wheel and source archive: what they hold, and that the wheel alone builds and checks all FMUs, without compilers."""

import os
import shutil
import tarfile
import zipfile

import pytest
from paths import ROOT
from processes import output

from ballscrew_fmu.native_fmu.compile import PLATFORMS

BUILD = "from setuptools import build_meta as b; print(b.build_sdist('out')); print(b.build_wheel('out'))"
#: run with the unpacked wheel alone, without any compiler: a point of the map, a screw file, all FMUs
USE = """
import os, sys
sys.modules["ziglang"] = sys.modules["numba"] = None
os.environ["PATH"] = os.environ["CC"] = ""
from ballscrew_fmu.command import main
from ballscrew_fmu.native_fmu.compile import BuildError, find_compiler
try:
    find_compiler()
except BuildError:
    pass
else:
    raise SystemExit("there is a compiler")
assert main(["torque", "--preload-n", "2000", "--speed-rpm", "500", "--temperature-c", "30", "--json"]) == 0
assert main(["torque", "--preload-n", "2000", "--speed-rpm", "500", "--temperature-c", "30", "--direct"]) == 2
assert main(["init", "my.toml"]) == 0
assert main(["map", "build", "--screw", "my.toml", "--output", "my.npz"]) == 0
assert main(["build", "--output", "fmus"]) == 0
for fmu in sorted(os.listdir("fmus")):
    assert main(["check", f"fmus/{fmu}"]) == 0
assert main(["page", "--output", "page.html"]) == 0
assert main(["build", "--embed-map", "--output", "embedded"]) == 1
point = "--torque-nm 0.4 --preload-n 1000 --speed-rpm 100 --temperature-c 30".split()
assert main(["calibrate", *point, "--screw", "my.toml", "--output", "fit.toml", "--plot", "fit.png"]) == 0
with open("measured.csv", "w") as file:
    file.write("preload [N],speed [r/min],torque [N.m]\\n1000,100,0.4\\n1000,500,0.38\\n1000,1500,0.45\\n")
assert main(["calibrate", "measured.csv", "--screw", "my.toml", "--plot", "fit.png"]) == 0
import ballscrew_tehl
assert ballscrew_tehl.bearing(60e-3, 12.3e-3, 14, 0.7, 0.52, 0.52).torque(1e3, 100.0, 313.0).total > 0.0
print(ballscrew_tehl.__file__)
"""
LEFT_OUT = (".*", "dist", "build", "*.egg-info", "__pycache__", "*.nb[ci]", "*.pyc")


@pytest.mark.slow
def test_archives_are_complete_and_the_wheel_alone_works(tmp_path):
    project, elsewhere = tmp_path / "project", tmp_path / "elsewhere"
    shutil.copytree(ROOT, project, ignore=shutil.ignore_patterns(*LEFT_OUT))
    sources = os.pathsep.join(str(project / name) for name in ("solver", "fmu_src"))
    files = {"pyproject.toml", "build_fmu.py", "README.md", "CHANGELOG.md", "LICENSE", "CITATION.cff"}
    for folder in ("solver", "fmu_src", "atlas_builder", "tests", "examples", "docs"):
        found = (path for path in (project / folder).rglob("*") if path.is_file())
        files |= {path.relative_to(project).as_posix() for path in found}
    output("-m", "ballscrew_fmu.native_fmu.libraries", folder=project, PYTHONPATH=sources)
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
    fmus = list((elsewhere / "fmus").iterdir())
    assert len(fmus) == 10
    assert sum(f"{fmu.name}: fmpy: no finding; replay" in printed for fmu in fmus) == 10
    with zipfile.ZipFile(elsewhere / "fmus" / "BallScrewAxis_fmi3.fmu") as archive:
        folders = {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}
    assert folders == set(PLATFORMS)
    assert not (elsewhere / "embedded").exists()
    assert printed.splitlines()[-1].startswith(str(tmp_path))
