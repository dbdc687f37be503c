"""The libraries for Windows and aarch64 Linux, executed: the same numbers as on x86_64 Linux."""

from pathlib import Path

import numpy as np
import pytest
from importers import differences
from platforms import EMULATED, HERE, outputs_on
from rotor_fmu import RUNS_HERE

pytestmark = pytest.mark.skipif(not RUNS_HERE, reason="compares with x86_64 Linux")
AGREEMENT = 1e-12  # their C libraries differ in the last digits of exp, log, pow, tanh and expm1


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    """Folder of the hosts and of one wine prefix."""
    return tmp_path_factory.mktemp("platforms")


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("emulated", EMULATED, ids=lambda e: e.tool)
def test_another_platform_gives_the_same_numbers(emulated, version, native_unpacked, scratch):
    reason = emulated.problem()
    if reason:
        pytest.skip(reason)
    unpacked = Path(native_unpacked[version])
    names, expected = outputs_on(HERE, unpacked, version, scratch)
    _, found = outputs_on(emulated.platform, unpacked, version, scratch)
    assert expected.shape == found.shape == (100, len(names))
    assert np.isfinite(expected).all()
    assert len(np.unique(expected[:, names.index("in_range")])) == 2, "points within the map and beyond"
    worst = differences(found, expected).max(axis=0)
    assert (worst <= AGREEMENT).all(), dict(zip(names, worst, strict=True))
