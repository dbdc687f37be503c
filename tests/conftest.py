"""Fixtures shared by all tests."""

import os
from pathlib import Path

# the matrices are small: BLAS threads cost more than they save; must be set before numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import hypothesis
import pytest
from synthetic_map import make_map

from ballscrew_fmu.native_fmu.package import build_native_fmu
from ballscrew_tehl.runtime.evaluate import NutMap

# the same examples in every run and no time limit: a failure then means that the program has changed
hypothesis.settings.register_profile("repeatable", derandomize=True, deadline=None)
hypothesis.settings.load_profile("repeatable")


#: they hold no doctest, and two of one name cannot both be imported as modules
collect_ignore_glob = ["conftest.py", "*/conftest.py"]
#: fixtures that cost more than 3 s: native FMUs for five platforms
SLOW_FIXTURES = {"native_fmus", "fmus"}


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests that use a slow fixture as slow; the longest file first.

    Each worker runs one file at a time: the longest would otherwise run alone at the end.
    """
    items.sort(key=lambda item: item.path.name != "test_docs.py")
    for item in items:
        if SLOW_FIXTURES & set(getattr(item, "fixturenames", ())):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def synthetic_nut_map() -> NutMap:
    return make_map()


@pytest.fixture(scope="session")
def native_fmu(tmp_path_factory: pytest.TempPathFactory, synthetic_nut_map: NutMap) -> Path:
    path = tmp_path_factory.mktemp("native_fmu") / "native.fmu"
    return build_native_fmu(synthetic_nut_map, 2, path, platforms=("x86_64-linux",)).path
