"""Files that a command writes: refused before its long work, and in one line if the disk refuses later."""

import errno
import os
import re
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

OTHER_FOLDER = "give a path in a folder that can be written"
#: what to do about an error of the system, by its number
REMEDIES = {
    errno.ENOENT: "create the folder, or give a path in one that exists",
    errno.EISDIR: "give the name of a file",
    errno.ENOSPC: "free space on this disk, or give a path on another one",
    errno.EDQUOT: "free space of your quota, or give a path on another disk",
    errno.ENAMETOOLONG: "give a shorter name",
}


def check_output(option: str, given: Path | str, kind: str, inputs: Sequence[str | None] = ()) -> Path:
    """The path of an option; refused if it cannot be written, is none of the kind "a file *.png" or one of the inputs.

    Raises       ValueError
    """
    path = Path(given)
    where = f"{option} = {path}"
    if path.is_dir():
        raise ValueError(f"{where}: is a folder; allowed: {kind}")
    if path.suffix.lower() not in re.findall(r"\*(\.\w+)", kind):
        raise ValueError(f"{where}; allowed: {kind}")
    if path.exists() and any(read and Path(read).exists() and path.samefile(read) for read in inputs):
        raise ValueError(f"{where}: is a file that this command reads; allowed: another file")
    try_folder(where, path.parent, path.name)
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
    # with a name as long as the temporary ones that are written
    with _one_line(f"{where}: {folder}"), tempfile.NamedTemporaryFile(dir=folder, prefix=f".{name}."):
        pass


@contextmanager
def new_folder(folder: Path) -> Iterator[None]:
    """Create a folder, with those above it, and remove at the end what is empty of them."""
    new = [above for above in (folder, *folder.parents) if not above.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    finally:
        with suppress(OSError):
            for above in new:
                above.rmdir()


@contextmanager
def written(option: str, path: Path | str) -> Iterator[None]:
    """Create the folder of a file that is written in the block; name option and path where that fails nevertheless."""
    with _one_line(f"{option} = {path}:"), new_folder(Path(path).parent):
        yield


@contextmanager
def _one_line(where: str) -> Iterator[None]:
    """An error of the system without its temporary file name, which would only confuse."""
    try:
        yield
    except OSError as error:
        remedy = REMEDIES.get(error.errno or 0, OTHER_FOLDER)
        raise ValueError(
            f"{where} cannot be written ({error.strerror or error}); remedy: {remedy}"
        ) from error
