"""What the commands write: answers on stdout as JSON, CSV, a table or a listing; lines and progress on stderr; files.

A file is refused before the long work of its command, and in one line if the disk refuses later.
"""

import contextlib
import errno
import json
import os
import re
import shutil
import sys
import tempfile
import textwrap
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any, NamedTuple

from ballscrew_tehl.whole_file import whole_file

Row = Mapping[str, Any]
Progress = Callable[[int, int, str], None]
#: seconds in which a command that mostly takes less shows no progress, and between two lines of a stage in a file
QUIET, IN_FILE = 2.0, 10.0
OTHER_FOLDER = "give a path in a folder that can be written"
#: what to do about an error of the system, by its number
REMEDIES = {
    errno.ENOENT: "create the folder, or give a path in one that exists",
    errno.EISDIR: "give the name of a file",
    errno.ENOSPC: "free space on this disk, or give a path on another one",
}


class CommandError(Exception):
    """A check or a build that failed, on input that is allowed: one line, exit code 1."""


#: keys that JSON and CSV have and a listing only with another value than this; None: never
NOT_LISTED = ("map_hash",)


class Answer(NamedTuple):
    """What a command returns, to be printed by `show`."""

    rows: Sequence[Row]  # values by key, one row per operating point
    many: bool = False  # a list of points was given, also a list of one
    text: str | None = None  # for readers, in place of table or listing
    columns: Sequence[str] = ()  # main keys, of the table of many rows
    output: str | None = ""  # CSV file of all keys; None: not given, "": the command writes none
    code: int = 0  # exit code


def say(text: str) -> None:
    """One line on stderr; a reader that has left is no error."""
    with contextlib.suppress(BrokenPipeError):
        print(text, file=sys.stderr, flush=True)


def to_builtin(value: Any) -> Any:
    """For JSON: numpy scalars and arrays as Python objects, None (null) for values that are not finite."""
    text = json.dumps(value, default=lambda array: array.tolist())
    return json.loads(text, parse_constant=lambda not_finite: None)


def show(answer: Answer, as_json: bool) -> int:
    """Write the CSV file of an answer, print it on stdout. Returns the exit code."""
    rows, many, text, columns, output, code = answer
    if output or (many and text is None and not as_json):
        import pandas as pd

        cells = [{key: " ".join(v) if isinstance(v, list) else v for key, v in row.items()} for row in rows]
        frame = pd.DataFrame(cells)
        if output:
            write_file("--output", output, frame.to_csv(index=False))
        else:
            main = frame[[key for key in columns if key in frame]]
            further = "--json" if output == "" else "--output FILE.csv, or --json"
            say(f"{len(frame.columns) - len(main.columns)} further columns: {further}")
            width, form = shutil.get_terminal_size().columns, "{:.5g}".format
            print(main.to_string(index=False, line_width=width, float_format=form, na_rep="-"))
    if as_json:
        print(json.dumps(to_builtin(rows if many else rows[0]), allow_nan=False))
    elif text is not None or not many:
        shown = {k: v for k, v in rows[0].items() if k not in NOT_LISTED}
        print(listing(shown) if text is None else text)
    return code


def table(head: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> str:
    """Text columns below their heads, the first `left` of them to the left."""
    lines = [head, *rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    form = "  ".join(f"{{:{'<' if k < left else '>'}{width}}}" for k, width in enumerate(widths))
    return "\n".join(form.format(*line) for line in lines)


def filled(text: str, head: str = "") -> str:
    """A head and a text beside it, in lines that fit the terminal, at most 80 columns."""
    width = max(min(shutil.get_terminal_size().columns, 80), len(head) + 18)
    return textwrap.fill(text, width, initial_indent=head, subsequent_indent=" " * len(head),
                         break_long_words=False, break_on_hyphens=False)  # fmt: skip


def listing(row: Row) -> str:
    """A line per key, long texts continued below their beginning."""
    names = min(max(map(len, row)), 40)
    return "\n".join(filled(_shown(value), f"{key:<{names}}  ") for key, value in row.items())


def _shown(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_shown, value)) or "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None or value == "":
        return "-"
    return str(value) if isinstance(value, int | str) else f"{float(value):.6g}"


@contextlib.contextmanager
def progress_bar(quiet: float = 0.0) -> Iterator[Progress]:
    """A bar of the present stage on a terminal, else lines, after some seconds in which nothing is imported for it."""
    visible, due, stage, bar = time.monotonic() + quiet, 0.0, "", None
    with contextlib.ExitStack() as stack:

        def progress(finished: int, total: int, what: str) -> None:
            nonlocal due, stage, bar
            # the end of a stage that was not shown is no news
            if quiet and (time.monotonic() < visible or (finished == total and what != stage)):
                return
            bar = bar or stack.enter_context(_bar())
            (task,) = bar.tasks
            if what != stage or finished < task.completed:
                bar.reset(task.id, description=what)
                due, stage = 0.0, what
            bar.update(task.id, completed=finished, total=total)
            if bar.disable and (finished == total or time.monotonic() > due):
                due, left = time.monotonic() + IN_FILE, task.time_remaining
                seconds, form = (task.elapsed, " in {}") if finished == total else (left, ", {} left")
                clock = "" if seconds is None else form.format(timedelta(seconds=round(seconds)))
                say(f"{what}: {finished} of {total}{clock}")

        yield progress


def _bar() -> Any:
    """A bar of rich with one task; disabled where there is no terminal, for its clock alone."""
    from rich.console import Console
    from rich.progress import MofNCompleteColumn, Progress

    console = Console(stderr=True)
    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    # times left by all steps, for one may take minutes
    bar = Progress(*columns, console=console, disable=not console.is_terminal, speed_estimate_period=1e9)
    bar.add_task("")
    return bar


def each(items: Sequence[Any], what: str, quiet: float = QUIET) -> Iterator[Any]:
    """The items one by one, with progress."""
    with progress_bar(quiet) as progress:
        for number, item in enumerate(items):
            progress(number, len(items), what)
            yield item
        progress(len(items), len(items), what)


def write_file(option: str, path: Path | str, content: str | bytes, more: str = "") -> None:
    """Write the file of an option, whole or not at all, and say so, with more behind it."""
    with written(option, path), whole_file(Path(path)) as temporary:
        if isinstance(content, bytes):
            temporary.write_bytes(content)
        else:
            temporary.write_text(content, encoding="utf-8")
    say(f"written: {path}{more}")


def check_output(option: str, given: Path | str, kind: str, inputs: Sequence[str | None] = ()) -> Path:
    """The path of an option, refused if it cannot be written, is not of the kind "a file *.png" or is an input."""
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
    """Create a file with a temporary name in a folder, or where it would be created, and remove it."""
    # lexists: a link to nowhere is not created
    while not os.path.lexists(folder) and folder != folder.parent:
        folder = folder.parent
    if not folder.is_dir():
        raise ValueError(f"{where}: {folder} is not a folder; allowed: a path below a folder")
    # with a name as long as the temporary ones that are written
    with _one_line(f"{where}: {folder}"), tempfile.NamedTemporaryFile(dir=folder, prefix=f".{name}."):
        pass


@contextlib.contextmanager
def new_folder(folder: Path) -> Iterator[None]:
    """Create a folder, with those above it, and remove at the end what is empty of them."""
    new = [above for above in (folder, *folder.parents) if not above.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    finally:
        with contextlib.suppress(OSError):
            for above in new:
                above.rmdir()


@contextlib.contextmanager
def written(option: str, path: Path | str) -> Iterator[None]:
    """Create the folder of a file that is written in the block; name option and path where that fails nevertheless."""
    with _one_line(f"{option} = {path}:"), new_folder(Path(path).parent):
        yield


@contextlib.contextmanager
def _one_line(where: str) -> Iterator[None]:
    """An error of the system without its temporary file name, which would only confuse."""
    try:
        yield
    except OSError as error:
        remedy = REMEDIES.get(error.errno or 0, OTHER_FOLDER)
        raise ValueError(
            f"{where} cannot be written ({error.strerror or error}); remedy: {remedy}"
        ) from error
