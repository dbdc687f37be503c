"""Processes that solve contacts: of this machine, or of a Dask cluster."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, wait
from contextlib import contextmanager
from importlib import import_module

from ..compiled import KERNELS, stored_kernels

#: stage of a build before its first contact, and how often its progress is looked at [s]
COMPILATION, POLL = "compiling the contact solver (once per machine)", 0.5
#: called with (finished, total, what) while a build runs
Progress = Callable[[int, int, str], None]


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
                    pool.submit(import_module, "ballscrew_tehl.nut_map.build")
            yield pool
        finally:
            # a second Ctrl-C would leave the pool half shut down, and the command waiting for it without end
            with interrupt_held():
                pool.shutdown(cancel_futures=True)
    except BrokenExecutor as error:
        raise ChildProcessError(
            "a worker process has died, killed or out of memory: the same command again continues with the contacts "
            "that are solved"
        ) from error
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def compile_kernels(executor: Executor, progress: Progress | None = None) -> None:
    """Compile in one process what a map needs, unless an earlier command has; the others then read its machine code."""
    # all kernels of a map are counted
    for module in ("contact", "friction.ball_equilibrium"):
        import_module(f"ballscrew_tehl.{module}")
    if stored_kernels() == len(KERNELS):
        return
    job, done = executor.submit(_compile), False
    while not done:
        done = bool(wait([job], POLL).done)
        if progress is not None:
            progress(len(KERNELS) if done else stored_kernels(), len(KERNELS), COMPILATION)
    job.result()


def _compile() -> None:
    """Solve a contact of each raceway and the equilibrium of its ball."""
    from ..friction.sets import default_friction_set
    from ..parameters.file import load_screw
    from ..parameters.packaged_data import PACKAGED_VG100
    from ..refinement.direct import mean_ball_state

    # it says that it compiles
    logging.getLogger("ballscrew_tehl.contact").setLevel(logging.ERROR)
    parameters = load_screw(PACKAGED_VG100)
    mean_ball_state(parameters, default_friction_set(parameters), 2000.0, 50.0, 303.15)


@contextmanager
def build_executor(workers: int | None, dask: str | None) -> Iterator[Executor]:
    """The workers of a build.

    Parameters   workers: processes of this machine, None = one per core;  dask: address of the scheduler of a Dask
                 cluster, which is used instead
    Raises       ValueError: dask.distributed is not installed, or no scheduler at the address
    """
    if dask is None:
        with worker_pool(workers) as pool:
            yield pool
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise ValueError(
            "--dask needs dask.distributed; remedy: pip install 'ballscrew-tehl[dask]'"
        ) from error
    try:
        client = Client(dask, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"--dask = {dask}: no scheduler answers there ({error}); allowed: tcp://HOST:PORT"
        ) from error
    with client:
        # contacts of a dead worker go to another one
        yield client.get_executor(retries=3)
