"""Files that are there completely or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A temporary name beside `path`, to be written in the block and renamed to it at its end; removed if that fails.

    OSError: the rename is refused.
    """
    # another process may write the same file
    temporary = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        # what cannot be removed hides no error of the block
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
