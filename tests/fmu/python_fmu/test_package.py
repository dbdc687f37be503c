"""Packing: reproducible, isolated, complete or absent."""

import json
import subprocess
import sys
import zipfile

import pytest
from paths import SUPPORT
from synthetic_map import make_map

from ballscrew_fmu.archive import write_fmu
from ballscrew_fmu.python_fmu import package
from ballscrew_fmu.python_fmu.package import PackageError, build_fmu, fmu_files, runtime_sources
from ballscrew_tehl.runtime.evaluate import NutMap


def members(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_two_builds_give_the_same_bytes_and_guid(fmu, tmp_path):
    again = build_fmu(make_map(), tmp_path / "again.fmu")
    assert again.path.read_bytes() == fmu.read_bytes()
    assert again.guid.encode() in members(fmu)["modelDescription.xml"]
    assert again.size == fmu.stat().st_size


@pytest.mark.slow
def test_another_process_builds_the_same_bytes(fmu, tmp_path):
    """The bytes do not depend on hash seed and state of the interpreter."""
    script = (
        "import sys; sys.path.insert(0, sys.argv[1]); from synthetic_map import make_map;"
        "from ballscrew_fmu.python_fmu.package import build_fmu; print(build_fmu(make_map(), sys.argv[2]).sha256)"
    )
    tests = str(SUPPORT)
    subprocess.run(
        [sys.executable, "-c", script, tests, str(tmp_path / "b.fmu")], check=True, capture_output=True
    )
    assert (tmp_path / "b.fmu").read_bytes() == fmu.read_bytes()


@pytest.mark.slow
def test_another_map_or_other_code_gives_another_guid_and_other_code_another_package(fmu, tmp_path):
    sources = runtime_sources()
    sources["variables"] += "\n# changed\n"
    other_map = build_fmu(make_map(1.01), tmp_path / "map.fmu")
    other_code = build_fmu(make_map(), tmp_path / "code.fmu", sources)
    assert len({other_map.guid, other_code.guid, build_fmu(make_map(), tmp_path / "same.fmu").guid}) == 3

    def package_of(path):
        return {name.split("/")[1] for name in members(path) if name.startswith("resources/_ballscrew_")}

    assert package_of(fmu) == package_of(other_map.path) != package_of(other_code.path)
    assert all(len(package_of(path)) == 1 for path in (fmu, other_code.path))


def test_the_map_in_the_fmu_is_unchanged(fmu, tmp_path, synthetic_nut_map):
    path = tmp_path / "map.npz"
    path.write_bytes(members(fmu)["resources/nut_map.npz"])
    assert NutMap.from_npz(path).header == synthetic_nut_map.header


def test_every_module_at_the_top_of_the_resources_contains_the_hash(fmu):
    top = {name.split("/")[1] for name in members(fmu) if name.startswith("resources/")}
    mark = next(name for name in top if name.startswith("_ballscrew_")).removeprefix("_ballscrew_")
    python = {f"_ballscrew_{mark}", f"BallScrewFriction_{mark}.py"}
    assert top == {*python, "guid.txt", "nut_map.npz", "slavemodule.txt"}


def test_an_import_of_a_module_outside_the_fmu_is_refused():
    for line in ("import scipy\n", "from ballscrew_tehl import hertz\n", "from . import sibling\n"):
        with pytest.raises(PackageError, match="does not travel"):
            package._relocated(f"def f():\n    {line}", "ballscrew_fmu.python_fmu.slave")
    moved, imported = package._relocated(
        "from ballscrew_tehl.runtime.standstill import regularised_sign\n", "ballscrew_fmu.python_fmu.slave"
    )
    assert moved == "from .runtime_standstill import regularised_sign\n"
    assert imported == ["ballscrew_tehl.runtime.standstill"]


def test_a_failed_write_keeps_the_old_file_and_leaves_no_other(tmp_path, monkeypatch):
    target = tmp_path / "BallScrewFriction.fmu"
    target.write_bytes(b"old")

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr("ballscrew_fmu.archive.os.replace", fail)
    with pytest.raises(OSError, match="disk full"):
        write_fmu(target, {"modelDescription.xml": b"<x/>"})
    assert [path.name for path in tmp_path.iterdir()] == [target.name]
    assert target.read_bytes() == b"old"


def test_members_have_no_dates_and_the_description_comes_first(fmu):
    with zipfile.ZipFile(fmu) as archive:
        assert archive.testzip() is None
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert archive.namelist()[0] == "modelDescription.xml"
        assert sorted(archive.namelist()) == sorted(set(archive.namelist())) == sorted(fmu_files(make_map()))


STEP_AND_LIST_MODULES = """
import json, sys, warnings
import fmpy, fmpy.fmi2
fmpy.read_model_description(sys.argv[1])
from ballscrew_fmu.checks.replay import FmuInstance
before = set(sys.modules)
path = list(sys.path)
with FmuInstance(sys.argv[1], presliding_stiffness=400.0) as one:
    for speed in (0.0, 0.1, 100.0, 1e6):
        assert one.step(speed=speed, axial_load=300.0)
    one.slave.setFMUstate(one.slave.deSerializeFMUstate(one.slave.serializeFMUstate(one.slave.getFMUstate())))
new = sorted(set(sys.modules) - before)
print(json.dumps({"new": new, "all": sorted(sys.modules), "path": path == sys.path}))
"""


def test_a_step_imports_numpy_only(fmu):
    run = subprocess.run(
        [sys.executable, "-c", STEP_AND_LIST_MODULES, str(fmu)], check=True, capture_output=True, text=True
    )
    found = json.loads(run.stdout)
    heavy = {"scipy", "numba", "pandas", "pydantic", "xarray", "matplotlib", "ballscrew_tehl", "pythonfmu"}
    assert heavy.isdisjoint(found["all"])
    roots = {name.partition(".")[0] for name in found["new"]}
    own = {name for name in roots if name.startswith(("_ballscrew_", "BallScrewFriction_"))}
    assert len(own) == 2
    assert roots - own <= {"numpy", *sys.stdlib_module_names}
    assert found["path"], "the search path of the host is left as it was"
