"""One BLAS thread for the matrices of a contact: they are small, and threads that wait for each other cost more.

Factoring a 193 x 193 matrix takes 0.2 ms in one thread and, in OpenBLAS with two threads on two busy cores, 60 ms. A
program that is started for the solver sets OPENBLAS_NUM_THREADS; in somebody else's process it is too late for that.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

#: get and set the number of threads of one library
Threads = tuple[Callable[[], int], Callable[[int], None]]

_FOLDERS = ("{}.libs", "{}/.dylibs", "{}/.libs")
_NAMES = ("scipy_openblas_{}_num_threads", "openblas_{}_num_threads")


@lru_cache(maxsize=1)
def _openblas() -> tuple[Threads, ...]:
    """The OpenBLAS libraries that came with numpy and scipy; none with another BLAS."""
    found: list[Threads] = []
    for package in ("numpy", "scipy"):
        module = sys.modules.get(package)
        if module is None or module.__file__ is None:
            continue
        root = Path(module.__file__).parents[1]
        for file in sorted(
            f for folder in _FOLDERS for f in root.glob(f"{folder.format(package)}/*openblas*")
        ):
            try:
                library = ctypes.CDLL(str(file))
            except OSError:
                continue
            for name in (name + suffix for name in _NAMES for suffix in ("", "64_")):
                try:
                    found.append((library[name.format("get")], library[name.format("set")]))
                    break
                except AttributeError:
                    continue
    return tuple(found)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Within, numpy and scipy use one BLAS thread where they brought OpenBLAS; afterwards as many as before."""
    before = [(get(), put) for get, put in _openblas()]
    for _, put in before:
        put(1)
    try:
        yield
    finally:
        for count, put in before:
            put(count)
