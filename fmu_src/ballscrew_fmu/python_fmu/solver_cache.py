"""The contact solver of the FMU: its sources are copied once to a cache folder of the user and imported from there.

An importer unpacks the FMU to a new folder each time, and numba stores compiled code in the folder of the source.
Imported from the FMU, the solver would be compiled at every start. The folder in the cache is named by the hash of the
sources, one for each version, and is created atomically. Standard library only.
"""

import importlib
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

from ballscrew_tehl.runtime.user_cache import digest, user_cache

SOLVER_FOLDER = "solver"  # inside the package of the FMU
ENTRY = "refinement.refine"


class SolverError(RuntimeError):
    """The solver cannot be used in this host. The message gives reason and remedy."""


def solver_name(files: Mapping[str, bytes]) -> str:
    """Name of the solver package with these sources (path with / below it -> content)."""
    return f"_ballscrew_solver_{digest(files)[:12]}"


def installed(shipped: Path, cache: Path) -> Path:
    """Folder of the solver in the cache, to which its sources are copied if it is missing or changed; or OSError."""
    target = cache / shipped.name
    if _intact(target):
        return target
    cache.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=cache, prefix=".new_", ignore_cleanup_errors=True) as scratch:
        fresh, ignored = Path(scratch, shipped.name), shutil.ignore_patterns("__pycache__")
        shutil.copytree(shipped, fresh, ignore=ignored, copy_function=shutil.copyfile)
        if target.exists() and not _intact(target):
            target.rename(Path(scratch, "damaged"))
        try:
            fresh.rename(target)
        except OSError:
            if not _intact(target):  # otherwise another process has created it
                raise
    return target


def _intact(folder: Path) -> bool:
    files = {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*.py"))}
    return bool(files) and solver_name(files) == folder.name


def load_solver(package: Path) -> tuple[ModuleType, str]:
    """Module `refinement.refine` of the solver in this FMU, and why its compiled code is not kept, else empty."""
    folders = sorted(package.joinpath(SOLVER_FOLDER).glob("_ballscrew_solver_*"))
    if len(folders) != 1:
        raise SolverError(f"{len(folders)} solvers in {package}; needs one: build the FMU again")
    folder, name, remark = folders[0], folders[0].name, ""
    if name not in sys.modules:
        try:
            folder = installed(folder, user_cache())
        except (OSError, RuntimeError) as error:  # RuntimeError: no home folder
            remark = f"compiled code of the solver is not kept: {error}; set XDG_CACHE_HOME to another folder"
    importlib.invalidate_caches()  # the folder is new
    sys.path.insert(0, str(folder.parent))
    try:
        return importlib.import_module(f"{name}.{ENTRY}"), remark
    except ImportError as error:
        missing = (error.name or str(error)).partition(".")[0]
        text = f"{missing} is missing in the Python of the host ({error}): python -m pip install {missing}"
        raise SolverError(text) from error
    finally:
        sys.path.remove(str(folder.parent))
