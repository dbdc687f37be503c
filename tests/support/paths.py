"""Folders of the project, for tests."""

from pathlib import Path

SUPPORT = Path(__file__).parent
TESTS = SUPPORT.parent
ROOT = TESTS.parent
EXAMPLES = ROOT / "examples"
PUBLISHED = TESTS / "published" / "data"
FMU_SUPPORT = SUPPORT / "fmu"
NATIVE_HOSTS = FMU_SUPPORT / "native"  # C programs that load a native FMU
