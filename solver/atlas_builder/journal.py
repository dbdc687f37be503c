"""What was solved so far, by key, line by line in a file that continues an interrupted run."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, as_completed
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from filelock import FileLock, Timeout

from ballscrew_tehl.nut_map.grid import Progress


class Journal:
    """Entries by key in an append-only text file: a header line, then an entry in each line.

    Numbers are read back to the last bit. From the first damaged line on, as a killed process or a full disk leaves
    it, entries are dropped and solved again. path: created if missing; identity: what the entries depend on.
    ValueError: a file of another identity, or one that another run is writing.
    """

    def __init__(self, path: Path, identity: Mapping[str, Any]) -> None:
        self.path, self.entries = path, dict[str, Any]()
        self._head = dict(identity)
        self._file: TextIO | None = None
        self._lock = FileLock(path.with_name(path.name + ".lock"), timeout=0.0)

    def __enter__(self) -> Journal:
        try:
            self._lock.acquire()
        except Timeout:
            raise ValueError(f"{self.path}: another run is writing it; remedy: wait for that") from None
        lines = self.path.read_bytes().splitlines(keepends=True) if self.path.exists() else []
        kept = 0
        if lines and lines[0].endswith(b"\n"):
            if json.loads(lines[0]) != self._head:
                self._lock.release()
                raise ValueError(
                    f"{self.path}: holds {lines[0].decode().strip()}; expected {json.dumps(self._head)}"
                )
            kept = len(lines[0])
            with suppress(ValueError):
                for line in lines[1:]:
                    key, entry = json.loads(line)
                    if not line.endswith(b"\n"):
                        break
                    self.entries[key] = entry
                    kept += len(line)
        with self.path.open("r+b" if self.path.exists() else "wb") as file:
            file.truncate(kept)
        self._file = self.path.open("a", encoding="ascii")
        if not kept:
            self._write(self._head)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._file.close()
        self._lock.release()

    def _write(self, content: Any) -> None:
        if self._file is None:
            raise ValueError(f"{self.path}: the journal is not open")
        self._file.write(json.dumps(content) + "\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def add(self, key: str, entry: Any) -> None:
        """Take up an entry for good."""
        self._write([key, entry])
        self.entries[key] = entry

    def __contains__(self, key: str) -> bool:
        return key in self.entries

    def __len__(self) -> int:
        return len(self.entries)


def solve_missing(
    function: Callable[..., Any], jobs: Mapping[str, tuple[Any, ...]], journal: Journal, executor: Executor,
    progress: Progress | None = None, stage: str = "solved",
) -> None:  # fmt: skip
    """Solve those jobs, arguments of a function by key, that are not in the journal; every result is kept at once."""
    running = {
        executor.submit(function, *arguments): key for key, arguments in jobs.items() if key not in journal
    }
    try:
        for done, job in enumerate(as_completed(running), 1 + len(jobs) - len(running)):
            journal.add(running[job], job.result())
            if progress is not None:
                progress(done, len(jobs), stage)
    except BaseException:
        for job in running:
            job.cancel()
        raise
