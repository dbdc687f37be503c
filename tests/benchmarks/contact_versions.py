"""Worker processes with the contact solver of a checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from contact_worker import Request

WORKER = Path(__file__).with_name("contact_worker.py")
HERE = Path(__file__).parents[2]


class Worker:
    """A process that times contacts with the solver of a checkout; close it, or use it as a context.

    Raises ValueError: the process ends or imports the package of another folder
    """

    def __init__(self, checkout: Path, python: str = sys.executable) -> None:
        # of its own session: Ctrl-C ends the benchmark, which closes the worker
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        self._process = subprocess.Popen(
            [python, str(WORKER)], env=environment | {"PYTHONPATH": str(checkout / "solver")}, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True,
        )  # fmt: skip
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
