"""Fixtures shared by the tests; its place puts this folder on the import path (synthetic_map)."""

import pytest
from synthetic_map import make_map

from ballscrew_tehl.nut_map.evaluate import NutMap


@pytest.fixture(scope="session")
def synthetic_nut_map() -> NutMap:
    """The closed-form nut map of synthetic_map.py."""
    return make_map()
