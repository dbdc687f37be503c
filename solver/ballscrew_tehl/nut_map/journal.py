"""Contacts solved so far: in memory by their operating point, and line by line in a file that continues a build."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

import numpy as np
from filelock import FileLock, Timeout

from .contacts import QUANTITIES, Array, SolvedContacts

#: another one also if the values of a solved contact are defined otherwise
JOURNAL_FORMAT = 5

#: values of a solved contact by quantity
Contact = dict[str, float]
#: raceway, load, speed, temperature, each number to 12 digits, which distinguish two nodes
Place = tuple[str, str, str, str]


def _place(raceway: str, point: Sequence[float]) -> Place:
    load, speed, temperature = (f"{value:.12g}" for value in point)
    return raceway, load, speed, temperature


def _read_line(line: bytes) -> tuple[str, list[float], Contact]:
    """Raceway, point and values of a solved contact.

    Raises       ValueError, KeyError, TypeError, AttributeError: not such a line
    """
    found = json.loads(line)
    contact = {name: float(found["values"][name]) for name in QUANTITIES}
    load, speed, temperature = (float(value) for value in found["point"])
    return str(found["raceway"]), [load, speed, temperature], contact


class Journal:
    """Append-only text file of solved contacts: a header line, then a contact as JSON in each line.

    Numbers are read back to the last bit. Contacts from the first damaged line on, as a killed process or a full disk
    leaves it, are removed and solved again. A second build that opens the file is refused until the first one leaves;
    that removes the file if it has no contact.

    Parameters   path: created if missing;  parameters_json: canonical text of what the contacts depend on;
                 version: of the solver
    Raises       ValueError: a file for other parameters or of another version, or one that another build is writing;
                 OSError
    """

    def __init__(self, path: Path, parameters_json: str, version: str) -> None:
        self.path = path
        self._head: dict[str, Any] = {
            "format": JOURNAL_FORMAT,
            "version": version,
            "parameters": hashlib.sha256(parameters_json.encode()).hexdigest(),
        }
        #: raceway, point and values of the contacts that were in the file when it was opened
        self.contacts: list[tuple[str, list[float], Contact]] = []
        self._kept = False
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
            self._close()
            # a full disk took not even the header
            if self.path.exists() and b"\n" not in self.path.read_bytes():
                self.path.unlink()
            self._release()
            raise
        return self

    def _open(self) -> None:
        lines = self.path.read_bytes().splitlines(keepends=True) if self.path.exists() else []
        # without its end the header was not written completely, nothing follows
        whole = lines[:1] if lines and lines[0].endswith(b"\n") else []
        if whole:
            self._check_head(whole[0])
        self.contacts = []
        with suppress(ValueError, KeyError, TypeError, AttributeError):
            for line in lines[1:]:
                contact = _read_line(line)
                if not line.endswith(b"\n"):
                    break
                self.contacts.append(contact)
                whole.append(line)
        self._kept = bool(self.contacts)
        with self.path.open("r+b" if self.path.exists() else "wb") as file:
            file.truncate(sum(map(len, whole)))
        self._file = self.path.open("a", encoding="ascii")
        if not whole:
            self._write(self._head)

    def _check_head(self, line: bytes) -> None:
        try:
            head = json.loads(line)
        except ValueError:
            head = None
        if head == self._head:
            return
        if not (isinstance(head, dict) and self._head.keys() <= head.keys()):
            what = "not a file of solved contacts"
        elif head["format"] != JOURNAL_FORMAT:
            what = f"contacts in format {head['format']}; expected {JOURNAL_FORMAT}"
        elif head["version"] != self._head["version"]:
            what = f"contacts of version {head['version']}; expected {self._head['version']}"
        else:
            what = "contacts of another screw, oil or kinematics"
        raise ValueError(f"{self.path}: {what}: remove or rename it, or another --output")

    def _release(self) -> None:
        # the lock of a killed build falls with its process
        Path(self._lock.lock_file).unlink(missing_ok=True)
        self._lock.release()

    def _close(self) -> None:
        if self._file is not None:
            # every line is on disk; what is left in the buffer is one that a full disk refused
            with suppress(OSError):
                self._file.close()
            self._file = None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close()
        if not self._kept and self.path.exists():
            self.path.unlink()
        self._release()

    def discard(self) -> None:
        """Remove the file: its map is written."""
        self._close()
        self.path.unlink()
        self._kept = False

    def _write(self, content: Mapping[str, Any]) -> None:
        if self._file is None:
            raise ValueError(f"{self.path}: the journal is not open")
        try:
            self._file.write(json.dumps(content) + "\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            # a failed write names no file
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def add(self, raceway: str, point: Sequence[float], contact: Contact) -> None:
        """Write a contact for good."""
        self._write({"raceway": raceway, "point": list(point), "values": contact})
        self._kept = True


class Solved:
    """Solved contacts by their place; with a journal those of before, and each new one is written there at once."""

    def __init__(self, journal: Journal | None = None) -> None:
        self._journal = journal
        self._contacts: dict[Place, Contact] = {}
        for raceway, point, contact in journal.contacts if journal is not None else ():
            self._contacts[_place(raceway, point)] = contact

    def add(self, raceway: str, point: Sequence[float], contact: Contact) -> None:
        """Take up a contact at its load, speed and temperature."""
        if self._journal is not None:
            self._journal.add(raceway, point, contact)
        self._contacts[_place(raceway, point)] = contact

    def holds(self, raceway: str, point: Sequence[float]) -> bool:
        """Whether the contact at a point is solved."""
        return _place(raceway, point) in self._contacts

    def __len__(self) -> int:
        return len(self._contacts)

    def contacts(self, raceway: str, points: Array) -> SolvedContacts:
        """The contacts at points (n, 3) of load, speed and temperature, which have all been added."""
        found = [self._contacts[_place(raceway, point)] for point in points.tolist()]
        return SolvedContacts(points, {name: np.array([each[name] for each in found]) for name in QUANTITIES})
