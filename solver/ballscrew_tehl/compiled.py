"""Compiled kernels: the decorator, and the folder that keeps their machine code.

numba checks a stored kernel by the date of its own file only, so that a kernel which inlines a changed one of another
file would stay as it was. Here every state of the sources has a folder of its own, named by the hash of all modules
that kernels are made of: in __pycache__ of this package, else in the cache of the user; below NUMBA_CACHE_DIR where
that is set. Where none can be written, kernels are compiled in every process. Folders of other sources go once they
have not been used for KEPT_DAYS. numba itself keeps processors and its own versions apart.
"""

import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

try:
    import numba
except ModuleNotFoundError as error:
    error.msg = "to solve contacts takes numba: python -m pip install 'ballscrew-tehl[direct]'"
    raise

from .runtime.user_cache import digest, user_cache

PACKAGE = Path(__file__).parent
#: modules with kernels and with constants that kernels take from elsewhere, below the package
SOURCES = "compiled.py", "contact/film", "contact/grid.py", "contact/half_space.py", "parameters/oil.py"
KEPT_DAYS = 30.0


def sources_hash(package: Path = PACKAGE) -> str:
    """Hash of the names and contents of the SOURCES of a copy of this package; a part of it may lack some."""
    files: dict[str, bytes] = {}
    for source in SOURCES:
        at = package / source
        for file in at.glob("*.py") if at.is_dir() else [at][: at.exists()]:
            files[file.relative_to(package).as_posix()] = file.read_bytes()
    return digest(files)[:16]


def _roots() -> Iterator[Path]:
    """Folders that may keep the machine code, in order of preference."""
    if numba.config.CACHE_DIR:
        yield Path(numba.config.CACHE_DIR)
        return
    yield PACKAGE / "__pycache__"
    with suppress(RuntimeError):  # no home folder
        yield user_cache()


@lru_cache(maxsize=1)
def cache_folder() -> Path | None:
    """The folder of these sources, made if needed; None: nothing can be written."""
    for root in _roots():
        folder = root / f"kernels-{sources_hash()}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.NamedTemporaryFile(dir=folder).close()  # the date of the folder is that of its last use
        except OSError:
            continue
        for other in root.glob("kernels-*"):
            with suppress(OSError):  # another process has removed it
                if other.stat().st_mtime < time.time() - 86400.0 * KEPT_DAYS:
                    shutil.rmtree(other, ignore_errors=True)
        return folder
    return None


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """numba.njit with the floating-point rules of NumPy and the cache of this package; options are those of njit."""
    if function is None:
        return lambda given: kernel(given, **options)
    folder, before = cache_folder(), numba.config.CACHE_DIR
    # numba reads it here: the functions of others keep their folder
    numba.config.CACHE_DIR = str(folder or "")
    try:
        return numba.njit(cache=folder is not None, error_model="numpy", **options)(function)
    finally:
        numba.config.CACHE_DIR = before
