"""Processes of this machine that solve contacts."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module


def _leave_with_parent() -> None:
    """Exit the worker when its parent process has died; Ctrl-C reaches the parent alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def interrupt_held(ignored: bool = False) -> Iterator[None]:
    """Raise KeyboardInterrupt at the end instead of within; Ctrl-C reaches the main thread alone.

    Parameters   ignored: never, but processes that are started meanwhile ignore it too
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    caught: list[int] = []
    before = signal.signal(
        signal.SIGINT, signal.SIG_IGN if ignored else lambda number, frame: caught.append(number)
    )
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if caught:
        raise KeyboardInterrupt


@contextmanager
def worker_pool(workers: int | None) -> Iterator[Executor]:
    """Processes, None: one per core; one BLAS thread each, for matrices are small.

    Raises       ChildProcessError: a process has died
    """
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        spawn = multiprocessing.get_context("spawn")
        count = workers or os.cpu_count() or 1
        pool = ProcessPoolExecutor(count, spawn, _leave_with_parent)
        try:
            with interrupt_held(ignored=True):
                # all start here: Ctrl-C would kill them before _leave_with_parent, with a traceback. They import what
                # they need while this process prepares the first contacts
                for _ in range(count):
                    pool.submit(import_module, "ballscrew_tehl.refinement.direct")
            yield pool
        finally:
            # a second Ctrl-C would leave the pool half shut down, and the command waiting for it without end
            with interrupt_held():
                pool.shutdown(cancel_futures=True)
    except BrokenExecutor as error:
        raise ChildProcessError(
            "a worker process has died, killed or out of memory: run the same command again"
        ) from error
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
