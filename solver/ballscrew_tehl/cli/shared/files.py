"""Files that a command writes: refused before its long work, and in one line if the disk refuses later."""

from __future__ import annotations

import errno
import os
import re
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

OTHER_FOLDER = "give a path in a folder that can be written"
#: what to do about an error of the system, by its number
REMEDIES = {
    errno.ENOENT: "create the folder, or give a path in one that exists",
    errno.ENOTDIR: "a part of the path is a file; give a path in a folder",
    errno.EISDIR: "give the name of a file",
    errno.EEXIST: "a part of the path is a file; give a path in a folder",
    errno.ENOSPC: "free space on this disk, or give a path on another one",
    errno.EDQUOT: "free space of your quota, or give a path on another disk",
    errno.ENAMETOOLONG: "give a shorter name",
}


def os_error_text(error: OSError) -> str:
    """An error of the system in one line: the file that it names, reason, remedy."""
    if error.strerror is None or not error.filename:
        return str(error)
    remedy = REMEDIES.get(error.errno or 0, "check path and permissions")
    return f"{error.filename}: {error.strerror}; remedy: {remedy}"


def check_output(
    option: str, given: Path | str, kind: str, create: bool = False, inputs: Sequence[str | None] = ()
) -> Path:
    """Refuse a file that could not be written, by trying its folder; nothing is left behind.

    Parameters   option : name of the option, for the message;  kind : allowed files, "a file *.png"
                 create : the command creates missing folders;  inputs : files that the command reads, None = none
    Raises       ValueError
    """
    path = Path(given)
    where = f"{option} = {path}"
    suffixes = re.findall(r"\*(\.\w+)", kind)
    if path.is_dir():
        raise ValueError(f"{where}: is a folder; allowed: {kind}, for example {path / f'NAME{suffixes[0]}'}")
    if path.suffix.lower() not in suffixes:
        raise ValueError(f"{where}; allowed: {kind}")
    for read in inputs:
        if read and path.exists() and Path(read).exists() and path.samefile(read):
            raise ValueError(f"{where}: is a file that this command reads; allowed: another file")
    folder = path.parent
    if not create and not folder.exists():
        raise ValueError(f"{where}: no such folder; allowed: {kind} in a folder that exists")
    try_folder(where, folder, path.name)
    return path


def try_folder(where: str, folder: Path, name: str = "file") -> None:
    """Create a file with a temporary name in a folder, or where it would be created, and remove it.

    Raises       ValueError
    """
    # lexists: a link to nowhere is not created
    while not os.path.lexists(folder) and folder != folder.parent:
        folder = folder.parent
    if not folder.is_dir():
        raise ValueError(f"{where}: {folder} is not a folder; allowed: a path below a folder")
    try:
        # as long as the temporary names that are written
        with tempfile.NamedTemporaryFile(dir=folder, prefix=f".{name}."):
            pass
    except OSError as error:
        # the temporary name would only confuse
        raise ValueError(
            f"{where}: {folder} cannot be written ({error.strerror}); remedy: "
            f"{REMEDIES.get(error.errno or 0, OTHER_FOLDER)}"
        ) from error


@contextmanager
def written(option: str, path: Path | str) -> Iterator[None]:
    """Name option and path where writing fails nevertheless.

    Raises       ValueError in place of OSError
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        remedy = REMEDIES.get(error.errno or 0, OTHER_FOLDER)
        raise ValueError(f"{option} = {path}: cannot be written ({reason}); remedy: {remedy}") from error
