"""End of the process on Linux: what the binary of pythonfmu does too late is done in time.

pythonfmu 0.7 keeps a static std::shared_ptr in each copy of its library and resets it in a destructor of the library.
The library is never unloaded (it has unique symbols), so that this destructor runs at exit, after the pointer: it
counts down in memory that is free again, mostly the links of a free block. A library that was loaded after the FMU,
as those of scipy and numba are by refine, has its turn even later. If it allocates or frees memory then, the process
may die with "free(): corrupted unsorted chunks" or the like, however well the simulation went. Reset by the end of
Python, while it lives, the pointer is empty and the destructor has nothing to do. Standard library only.
"""

import atexit
import ctypes
import os
import sys
from pathlib import Path

BINARIES = "binaries/linux64"  # beside the resources
RESET = "finalizePythonInterpreter"  # what the destructor calls; a second call has no effect

_libraries: dict[str, ctypes.CDLL] = {}  # by path; held, so that the function to call stays where it is


def reset_at_exit(resources: str) -> None:
    """Arrange, once per library, that the library of the FMU with these resources is reset when Python ends."""
    if not sys.platform.startswith("linux"):
        return
    for file in map(str, Path(resources).parent.glob(f"{BINARIES}/*.so")):
        if file in _libraries:
            continue
        try:
            library = ctypes.CDLL(file, mode=os.RTLD_NOW | os.RTLD_NOLOAD)
            reset = getattr(library, RESET)
        except (OSError, AttributeError):  # not loaded from here, or of another pythonfmu
            continue
        reset.argtypes, reset.restype = (), None
        _libraries[file] = library
        atexit.register(reset)
