"""Contacts solved so far: in memory by their operating point, and line by line in a file that continues a build."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

import numpy as np
from filelock import FileLock, Timeout

from .contacts import QUANTITIES, Array, SolvedContacts

JOURNAL_FORMAT = 2

#: raceway, load, speed, temperature, each number to 12 digits, which distinguish two nodes
Place = tuple[str, str, str, str]


def _place(raceway: str, load: float, speed: float, temperature: float) -> Place:
    return raceway, f"{load:.12g}", f"{speed:.12g}", f"{temperature:.12g}"


class Journal:
    """Append-only text file of solved contacts: a header line, then one line of JSON per piece of work.

    Numbers are read back to the last bit. An incomplete last line, as a killed process leaves it, is removed.

    Parameters   path: created if missing;  parameters_json: canonical text of what the contacts depend on;
                 version: of the solver
    Raises       ValueError: a file for other parameters or of another version, or one that another build is writing
    """

    def __init__(self, path: Path, parameters_json: str, version: str) -> None:
        self.path = path
        self._head: dict[str, Any] = {
            "format": JOURNAL_FORMAT,
            "version": version,
            "parameters": hashlib.sha256(parameters_json.encode()).hexdigest(),
        }
        self._file: TextIO | None = None
        self._lock = FileLock(path.with_name(path.name + ".lock"), timeout=0.0)

    def __enter__(self) -> Journal:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._lock.acquire()
        except Timeout:
            raise ValueError(
                f"{self.path}: another build is writing it; remedy: wait for that, or another --output"
            ) from None
        try:
            self._open()
        except BaseException:
            self._release()
            raise
        return self

    def _open(self) -> None:
        lines = self.path.read_bytes().split(b"\n") if self.path.exists() else [b""]
        whole = b"".join(line + b"\n" for line in lines[:-1])
        if whole:
            try:
                head = json.loads(lines[0])
            except ValueError:
                head = None
            if head != self._head:
                raise ValueError(
                    f"{self.path}: contacts of another screw, oil or version; expected parameters "
                    f"{self._head['parameters'][:12]}, version {self._head['version']}: remove or rename the file"
                )
        with self.path.open("r+b" if self.path.exists() else "wb") as file:
            file.truncate(len(whole))
        self._file = self.path.open("a", encoding="ascii")
        if not whole:
            self._write(self._head)

    def _release(self) -> None:
        # the lock of a killed build falls with its process
        Path(self._lock.lock_file).unlink(missing_ok=True)
        self._lock.release()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None
        self._release()

    def _write(self, content: Mapping[str, Any]) -> None:
        if self._file is None:
            raise ValueError(f"{self.path}: the journal is not open")
        self._file.write(json.dumps(content) + "\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def add(
        self, raceway: str, load: float, speeds: Array, temperature: float, values: Mapping[str, Array]
    ) -> None:
        """Keep one piece of work for good."""
        self._write(
            {
                "raceway": raceway,
                "load": load,
                "temperature": temperature,
                "speeds": speeds.tolist(),
                "values": {name: values[name].tolist() for name in QUANTITIES},
            }
        )

    def pieces(self) -> Iterator[tuple[str, float, Array, float, dict[str, Array]]]:
        """What is in the file, as it was added."""
        with self.path.open(encoding="ascii") as file:
            next(file)
            for line in file:
                piece = json.loads(line)
                values = {name: np.array(piece["values"][name]) for name in QUANTITIES}
                yield (
                    piece["raceway"], piece["load"], np.array(piece["speeds"]), piece["temperature"], values,
                )  # fmt: skip


class Solved:
    """Solved contacts by their place; with a journal those of before, and each new one is written there at once."""

    def __init__(self, journal: Journal | None = None) -> None:
        self._journal = journal
        self._values: dict[Place, tuple[float, ...]] = {}
        if journal is not None:
            for piece in journal.pieces():
                self._take(*piece)

    def _take(
        self, raceway: str, load: float, speeds: Array, temperature: float, values: Mapping[str, Array]
    ) -> None:
        for i, speed in enumerate(speeds.tolist()):
            self._values[_place(raceway, load, speed, temperature)] = tuple(
                float(values[name][i]) for name in QUANTITIES
            )

    def add(
        self, raceway: str, load: float, speeds: Array, temperature: float, values: Mapping[str, Array]
    ) -> None:
        """Take up one piece of work: values by quantity, one per speed."""
        if self._journal is not None:
            self._journal.add(raceway, load, speeds, temperature, values)
        self._take(raceway, load, speeds, temperature, values)

    def missing(self, raceway: str, load: float, speeds: Array, temperature: float) -> Array:
        """Those of the speeds that are not solved yet."""
        open_ = [_place(raceway, load, speed, temperature) not in self._values for speed in speeds.tolist()]
        return speeds[np.array(open_, dtype=bool)]

    def __len__(self) -> int:
        return len(self._values)

    def contacts(self, raceway: str, points: Array) -> SolvedContacts:
        """The contacts at points (n, 3) of load, speed and temperature, which have all been added."""
        table = np.array([self._values[_place(raceway, *point)] for point in points.tolist()])
        return SolvedContacts(points, dict(zip(QUANTITIES, table.T, strict=True)))
