"""Worker processes with the contact solver of a checkout, and the seconds that a process of it needs to start."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from contact_worker import Request

WORKER = Path(__file__).with_name("contact_worker.py")
HERE = Path(__file__).parents[2]


def _command(checkout: Path, python: str, *arguments: str, **variables: str) -> dict[str, Any]:
    """Arguments of subprocess for a worker with the package of a checkout, one thread."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"} | variables
    environment["PYTHONPATH"] = str(checkout / "solver")
    return {"args": [python, str(WORKER), *arguments], "env": environment, "text": True}


class Worker:
    """A process that times contacts with the solver of a checkout; close it, or use it as a context.

    Raises ValueError: the process ends or imports the package of another folder
    """

    def __init__(self, checkout: Path, python: str = sys.executable) -> None:
        # of its own session: Ctrl-C ends the benchmark, which closes the worker
        self._process = subprocess.Popen(
            **_command(checkout, python),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
        )
        ready = self._reply()
        self.version = ready["version"]
        if not Path(ready["path"]).resolve().is_relative_to(checkout.resolve()):
            self.close()
            raise ValueError(f"{checkout}: the worker has imported {ready['path']}")

    def __call__(self, request: Request) -> dict[str, Any]:
        """The figures of contact_worker.timed."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(request._asdict()) + "\n")
        self._process.stdin.flush()
        return self._reply()

    def _reply(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        text = self._process.stdout.readline()
        if not text:
            raise ValueError(f"worker ended with exit code {self._process.wait()}; its message is above")
        return json.loads(text)

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def process_start(
    request: Request, checkout: Path = HERE, python: str = sys.executable, **variables: str
) -> dict[str, float]:
    """Seconds of a process: to the first solution (from its start, with imports), first solve, second solve.

    processor time to it: to the first solution;  message: whether it has said that it compiles, 0 or 1
    variables: of its environment
    Raises CalledProcessError: the process failed
    """
    command = _command(checkout, python, "--startup", **variables)
    begun = time.perf_counter()
    done = subprocess.run(
        **command, input=json.dumps(request._asdict()) + "\n", capture_output=True, check=True
    )
    whole = time.perf_counter() - begun
    first, second, used = json.loads(done.stdout.splitlines()[-1])
    return {
        "to the first solution": whole - second,
        "processor time to it": used,
        "first solve": first,
        "second solve": second,
        "message": float("compiling" in done.stderr),
    }


def startup(request: Request, checkout: Path = HERE, python: str = sys.executable) -> dict[str, float]:
    """The figures of process_start without compiled kernels and with them; the kernels go to a folder of their own."""
    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as cache:
        for name in ("first use", "later process"):
            figures = process_start(request, checkout, python, NUMBA_CACHE_DIR=cache)
            found |= {f"{name}, {part}": figure for part, figure in figures.items()}
    return found
