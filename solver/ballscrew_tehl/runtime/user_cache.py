"""The cache folder of the user."""

import os
import sys
from pathlib import Path


def user_cache() -> Path:
    """Folder of this package below the folder of the operating system for caches; RuntimeError: no home folder."""
    if sys.platform == "win32":
        root = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        root = str(Path.home() / "Library" / "Caches")
    else:
        root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(root) / "ballscrew_tehl"
