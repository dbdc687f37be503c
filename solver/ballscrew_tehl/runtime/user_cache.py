"""The cache folder of the user, and the hash by which what is in it is named."""

import hashlib
import os
import sys
from collections.abc import Mapping
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


def digest(files: Mapping[str, bytes]) -> str:
    """Hash of names and contents."""
    result = hashlib.sha256()
    for name in sorted(files):
        result.update(f"{name}\0{len(files[name])}\0".encode())
        result.update(files[name])
    return result.hexdigest()
