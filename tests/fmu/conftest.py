"""FMUs of the closed-form map, built once for all tests of this folder."""

import os
import sys
from pathlib import Path

import fmpy
import pytest
import stub_solver
from native_reference import REFERENCE, VALIDATION

from ballscrew_fmu.checks.replay import FmuInstance
from ballscrew_fmu.native_fmu.package import build_native_fmu, native_file_name
from ballscrew_fmu.python_fmu.package import build_fmu


@pytest.fixture(scope="session")
def fmu(tmp_path_factory, synthetic_nut_map):
    path = tmp_path_factory.mktemp("fmu") / "BallScrewFriction.fmu"
    return build_fmu(synthetic_nut_map, path).path


@pytest.fixture(scope="session")
def unpacked(fmu):
    return fmpy.extract(str(fmu), unzipdir=str(fmu.parent / "unpacked"))


@pytest.fixture(scope="session")
def cache_folder(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


#: of the C compiler, outside the environment of the tests: an empty cache costs compiling the stubs of five libraries
COMPILER_CACHE = os.environ.get("ZIG_GLOBAL_CACHE_DIR") or os.path.join(
    os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "zig"
)


@pytest.fixture(autouse=True)
def user_cache(monkeypatch, cache_folder):
    """A cache folder of the tests for all FMUs that refine."""
    monkeypatch.setenv("ZIG_GLOBAL_CACHE_DIR", COMPILER_CACHE)
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME"):
        monkeypatch.setenv(name, str(cache_folder))
    return cache_folder


@pytest.fixture(scope="session")
def refinable(tmp_path_factory, synthetic_nut_map):
    """Unpacked FMU of the closed-form map that refines with the stub."""
    folder = tmp_path_factory.mktemp("refinable")
    fmu = build_fmu(synthetic_nut_map, folder / "BallScrewFriction.fmu", solver=stub_solver.SOURCES).path
    return fmpy.extract(str(fmu), unzipdir=str(folder / "unpacked"))


@pytest.fixture(scope="session")
def slave_module():
    """Module of the slave of an unpacked FMU that is loaded; others may be loaded as well."""

    def find(folder):
        return sys.modules[next(Path(folder).glob("resources/_ballscrew_*")).name + ".python_fmu_slave"]

    return find


@pytest.fixture
def instance(unpacked):
    with FmuInstance(unpacked) as one:
        yield one


@pytest.fixture(scope="session")
def native_fmus(tmp_path_factory, synthetic_nut_map):
    """The native FMUs for all platforms, by FMI version."""
    folder = tmp_path_factory.mktemp("native")
    return {
        version: build_native_fmu(
            synthetic_nut_map, version, folder / native_file_name(version), REFERENCE, VALIDATION
        ).path
        for version in (2, 3)
    }


@pytest.fixture(scope="session")
def native_unpacked(native_fmus):
    """Folders where they are unpacked, by FMI version."""
    return {
        version: fmpy.extract(str(path), unzipdir=str(path.parent / f"unpacked_{version}"))
        for version, path in native_fmus.items()
    }
