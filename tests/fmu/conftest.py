"""An FMU of the closed-form map, built once for all tests of this folder."""

import fmpy
import pytest

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
