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
def _interrupt_ignored() -> Iterator[None]:
    """Ctrl-C without effect on this process and on those that it starts; no change beside the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def worker_pool(workers: int | None) -> Iterator[Executor]:
    """Processes, None: one per core; one BLAS thread each, for matrices are small.

    Raises       ChildProcessError: a process has died
    """
    threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    before = {name: os.environ[name] for name in threads if name in os.environ}
    os.environ.update(threads)
    count = workers or os.cpu_count() or 1
    pool = ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), _leave_with_parent)
    try:
        with _interrupt_ignored():
            # all start here: Ctrl-C would kill them before _leave_with_parent, with a traceback. They import what
            # they need while this process prepares the first contacts
            for _ in range(count):
                pool.submit(import_module, "ballscrew_tehl.refinement.direct")
        yield pool
    except BrokenExecutor as error:
        raise ChildProcessError(
            "a worker process has died, killed or out of memory: run the same command again"
        ) from error
    finally:
        # a second Ctrl-C would leave the pool half shut down, and the command waiting for it without end
        with _interrupt_ignored():
            pool.shutdown(cancel_futures=True)
        for name in threads:
            os.environ.pop(name)
        os.environ.update(before)
