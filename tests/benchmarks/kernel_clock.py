"""Time inside compiled kernels of the contact solver, as called from Python; works with any version of the package."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from numba.core.registry import CPUDispatcher

PACKAGE = "ballscrew_tehl.contact"


def _modules() -> list[ModuleType]:
    """The loaded modules of the contact solver."""
    return [module for name, module in sorted(sys.modules.items()) if name.startswith(PACKAGE)]


class _Timed:
    """A kernel whose calls from Python are counted; its own attributes are those of the kernel."""

    def __init__(self, kernel: Callable[..., Any], clock: KernelClock) -> None:
        self._kernel, self._clock = kernel, clock

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        begun = time.perf_counter()
        try:
            return self._kernel(*arguments, **named)
        finally:
            self._clock.seconds += time.perf_counter() - begun
            self._clock.calls += 1

    def __getattr__(self, name: str) -> Any:
        return getattr(self._kernel, name)


class KernelClock:
    """Seconds in compiled kernels, conversion of their arguments included, and calls from Python."""

    def __init__(self) -> None:
        self.seconds, self.calls = 0.0, 0


@contextmanager
def kernel_clock() -> Iterator[KernelClock]:
    """Count kernel calls from Python while the context lasts.

    Every kernel that runs inside must be compiled before: compilation of a caller would meet the wrapper.
    """
    clock, replaced = KernelClock(), []
    for module in _modules():
        for name, value in vars(module).items():
            if isinstance(value, CPUDispatcher):
                replaced.append((module, name, value))
    for module, name, kernel in replaced:
        setattr(module, name, _Timed(kernel, clock))
    try:
        yield clock
    finally:
        for module, name, kernel in replaced:
            setattr(module, name, kernel)


def clear_caches() -> None:
    """Empty the caches of grids and operators of the contact solver: the next solve builds its own."""
    for module in _modules():
        for value in vars(module).values():
            if callable(getattr(value, "cache_clear", None)):
                value.cache_clear()
