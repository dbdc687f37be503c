"""Worker processes that end with their parent, and that Ctrl-C does not reach."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module


def _leave_with_parent() -> None:
    """Exit the worker when its parent process has died; Ctrl-C reaches the parent alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        if (parent := multiprocessing.parent_process()) is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _interrupt_ignored() -> Iterator[None]:
    """Ctrl-C without effect on this process and on those that it starts; of the main thread."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def worker_pool(workers: int | None) -> Iterator[Executor]:
    """Processes, None: one per core; ChildProcessError if one of them has died."""
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
