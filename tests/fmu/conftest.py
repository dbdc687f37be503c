"""FMUs of the closed-form map, built once for all tests of this folder."""

import fmpy
import pytest
from native_reference import REFERENCE, VALIDATION

from ballscrew_fmu.native_package import build_native_fmu, native_file_name
from ballscrew_fmu.package import build_fmu
from ballscrew_fmu.replay import FmuInstance


@pytest.fixture(scope="session")
def fmu(tmp_path_factory, synthetic_nut_map):
    path = tmp_path_factory.mktemp("fmu") / "BallScrewFriction.fmu"
    return build_fmu(synthetic_nut_map, path).path


@pytest.fixture(scope="session")
def unpacked(fmu):
    return fmpy.extract(str(fmu), unzipdir=str(fmu.parent / "unpacked"))


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
