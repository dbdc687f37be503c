"""Contacts solved so far, by a key: in memory, and line by line in a file that continues an interrupted build."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from filelock import FileLock, Timeout

#: another one also if the values of a solved contact are defined otherwise
JOURNAL_FORMAT = 7

#: values of a solved contact by quantity, NaN where it did not converge
Contact = dict[str, float]
#: what distinguishes a contact from the others of a build
Key = tuple[str, ...]


class Journal:
    """Solved contacts by key; with a path also an append-only text file: a header line, then a contact in each line.

    Numbers are read back to the last bit. Contacts from the first damaged line on, as a killed process or a full disk
    leaves it, are removed and solved again. A second build that opens the file is refused until the first one leaves;
    that removes the file if it has no contact.

    Parameters   names: quantities of a contact;  path: created if missing, None = in memory only
                 identity: what the contacts depend on, each with a line for a file where it differs
    Raises       ValueError: a file of another identity, or one that another build is writing;  OSError
    """

    def __init__(
        self, names: Iterable[str], path: Path | None = None, identity: Mapping[str, Any] | None = None
    ) -> None:
        self.names, self.path = tuple(names), path
        self.contacts: dict[Key, Contact] = {}
        self._head = {"format": JOURNAL_FORMAT, **(identity or {})}
        self._file: TextIO | None = None
        self._lock = None if path is None else FileLock(path.with_name(path.name + ".lock"), timeout=0.0)

    def __enter__(self) -> Journal:
        if self.path is None or self._lock is None:
            return self
        self.path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._lock.acquire()
        except Timeout:
            raise ValueError(
                f"{self.path}: another build is writing it; remedy: wait for that, or another --output"
            ) from None
        try:
            self._open(self.path)
        except BaseException:
            self._close()
            # a full disk took not even the header
            if self.path.exists() and b"\n" not in self.path.read_bytes():
                self.path.unlink()
            self._release()
            raise
        return self

    def _open(self, path: Path) -> None:
        lines = path.read_bytes().splitlines(keepends=True) if path.exists() else []
        # without its end the header was not written completely, nothing follows
        whole = lines[:1] if lines and lines[0].endswith(b"\n") else []
        if whole:
            self._check_head(whole[0])
        self.contacts = {}
        with suppress(ValueError, KeyError, TypeError, AttributeError):
            for line in lines[1:]:
                key, values = json.loads(line)
                contact = {name: float(values[name]) for name in self.names}
                if not line.endswith(b"\n"):
                    break
                self.contacts[tuple(key)] = contact
                whole.append(line)
        with path.open("r+b" if path.exists() else "wb") as file:
            file.truncate(sum(map(len, whole)))
        self._file = path.open("a", encoding="ascii")
        if not whole:
            self._write(self._head)

    def _check_head(self, line: bytes) -> None:
        try:
            head = json.loads(line)
        except ValueError:
            head = None
        if head == self._head:
            return
        what = "not a file of solved contacts"
        if isinstance(head, dict) and head.keys() == self._head.keys():
            name = next(name for name in self._head if head[name] != self._head[name])
            what = f"contacts of {name} {head[name]}; expected {self._head[name]}"
        raise ValueError(f"{self.path}: {what}: remove or rename it, or another --output")

    def _release(self) -> None:
        if self._lock is not None:
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
        if self.path is not None and not self.contacts:
            self.path.unlink(missing_ok=True)
        self._release()

    def discard(self) -> None:
        """Remove the file: what its contacts are for is written."""
        self._close()
        self.contacts = {}
        if self.path is not None:
            self.path.unlink()

    def _write(self, content: Any) -> None:
        if self._file is None:
            raise ValueError(f"{self.path}: the journal is not open")
        try:
            self._file.write(json.dumps(content) + "\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            # a failed write names no file
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def add(self, key: Key, contact: Contact) -> None:
        """Take up a contact, for good if there is a file."""
        if self.path is not None:
            self._write([key, contact])
        self.contacts[key] = contact

    def __contains__(self, key: Key) -> bool:
        return key in self.contacts

    def __len__(self) -> int:
        return len(self.contacts)
