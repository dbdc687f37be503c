"""BLAS in one thread while a contact is solved: its matrices are small, and threads that wait for a busy core cost more
than the whole solve."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

try:
    from threadpoolctl import ThreadpoolController
except ImportError:  # a host of the FMU, whose Python lacks it: slower on a busy machine
    ThreadpoolController = None


@lru_cache(maxsize=1)
def _controller() -> Any:
    """The BLAS libraries of this process, looked up once (milliseconds)."""
    return ThreadpoolController().select(user_api="blas")


class _Limit:
    """The limit of the process: set by the first solve that begins, taken off by the last one that ends."""

    lock, solves, limiter = threading.Lock(), 0, None  # type: threading.Lock, int, Any


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit BLAS to one thread; several threads may be within at a time."""
    with _Limit.lock:
        if _Limit.solves == 0 and ThreadpoolController is not None:
            _Limit.limiter = _controller().limit(limits=1)
        _Limit.solves += 1
    try:
        yield
    finally:
        with _Limit.lock:
            _Limit.solves -= 1
            if _Limit.solves == 0 and _Limit.limiter is not None:
                _Limit.limiter.restore_original_limits()
