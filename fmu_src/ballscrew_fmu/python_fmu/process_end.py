"""End of the process on Linux: workaround for a use after free at exit in the binary of pythonfmu 0.7.

Each copy of its library has a static std::shared_ptr. The library is never unloaded (it has unique symbols), so that
its destructor, which resets the pointer, runs at exit after the pointer, and decrements a counter in freed memory. If
libraries loaded after the FMU (by refine those of scipy and numba) then allocate or free memory, the process may abort
with "free(): corrupted unsorted chunks" after a correct simulation. Here the pointer is reset when Python exits.
Standard library only.
"""

import atexit
import ctypes
import os
import sys
from pathlib import Path

BINARIES = "binaries/linux64"  # in the parent folder of the resources
RESET = "finalizePythonInterpreter"  # called by the destructor; a second call has no effect

_libraries: dict[str, ctypes.CDLL] = {}  # by path; kept so that the registered function stays valid


def reset_at_exit(resources: str) -> None:
    """Register the reset of the library of an FMU at exit of Python, once per library.

    Parameters
    ----------
    resources : str
        Folder of the resources of the FMU.

    Examples
    --------
    >>> reset_at_exit("unpacked/resources")
    """
    if not sys.platform.startswith("linux"):
        return
    for file in map(str, Path(resources).parent.glob(f"{BINARIES}/*.so")):
        if file in _libraries:
            continue
        try:
            library = ctypes.CDLL(file, mode=os.RTLD_NOW | os.RTLD_NOLOAD)
            reset = getattr(library, RESET)
        except (OSError, AttributeError):  # not loaded from this folder, or another version of pythonfmu
            continue
        reset.argtypes, reset.restype = (), None
        _libraries[file] = library
        atexit.register(reset)
