"""Folders of the project, for tests."""

import sys
from pathlib import Path

SUPPORT = Path(__file__).parent
TESTS = SUPPORT.parent
ROOT = TESTS.parent
EXAMPLES = ROOT / "examples"
PUBLISHED = TESTS / "published" / "data"
FMU_SUPPORT = SUPPORT / "fmu"
NATIVE_HOSTS = FMU_SUPPORT / "native"  # C programs that load a native FMU


def writable(name: str) -> str:
    """A file name without the characters that file names of this locale cannot have."""
    encoding = sys.getfilesystemencoding()
    return name.encode(encoding, "ignore").decode(encoding)
