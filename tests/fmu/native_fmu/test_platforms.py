"""The libraries for Windows and aarch64 Linux, executed under wine and qemu: the numbers of x86_64 Linux."""

import fmpy
import numpy as np
import pytest
from platforms import HERE, emulator, end_wine, run_on
from processes import RUNS_HERE
from synthetic_map import closed_form

from ballscrew_fmu.checks.reference import reference_of
from ballscrew_fmu.models import MODELS
from ballscrew_fmu.native_fmu.package import build_native_fmu
from ballscrew_fmu.python_fmu.package import build_fmu

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not RUNS_HERE, reason="compares with x86_64 Linux")]
NUT_MAP = closed_form()
WINDOWS = "x86_64-windows"
AGREEMENT = (
    1e-12  # of the range of an output: C libraries differ in the last digits of exp, log, pow and tanh
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """For hosts and the prefix of wine."""
    folder = tmp_path_factory.mktemp("platforms")
    yield folder
    end_wine(folder)


def unpacked(folder, platform, model):
    if emulator(platform) is None:
        pytest.skip(f"runs no library for {platform}: needs wine64, or qemu-user and libc6-arm64-cross")
    place = folder / f"{model.name} {platform}"
    fmu = folder / f"{model.name}.fmu"
    build_native_fmu(NUT_MAP, 2, fmu, platforms=(HERE, platform), model=model)
    fmpy.extract(str(fmu), unzipdir=str(place))
    return place


@pytest.mark.parametrize("platform", [WINDOWS, "aarch64-linux"])
@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_another_platform_gives_the_numbers_of_linux(folder, platform, model):
    """By a URI of the resources with a drive; these are read and not written."""
    place = unpacked(folder, platform, model)
    files = {file: file.read_bytes() for file in place.rglob("*") if file.is_file()}
    reference = reference_of(NUT_MAP, model)
    here, there = (run_on(p, place, folder, reference.step, reference.inputs) for p in (HERE, platform))
    assert there.log == here.log
    assert len(here.outputs) == len(reference.inputs) == len(there.outputs)
    difference = np.abs(there.outputs - here.outputs).max(axis=0) / np.maximum(
        np.abs(here.outputs).max(axis=0), 1e-300
    )
    worst = dict(zip(here.names, difference, strict=True))
    assert all(x <= (1e-9 if model.step_derivatives is False else AGREEMENT) for x in worst.values()), worst
    assert {file: file.read_bytes() for file in files} == files


def test_the_windows_library_of_the_fmu_for_python_finds_its_resources(folder):
    """In a host without Python it says what it lacks, after it has read the token in the resources."""
    if emulator(WINDOWS) is None:
        pytest.skip("needs wine64")
    place = folder / "for Python"
    build_fmu(NUT_MAP, folder / "python.fmu")
    fmpy.extract(str(folder / "python.fmu"), unzipdir=str(place))
    log = run_on(WINDOWS, place, folder, 1e-3, [{"speed": 1.0}]).log
    assert "needs a host that runs Python" in log
    assert "pythonfmu-export.dll: Windows error" in log
