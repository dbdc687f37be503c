"""Progress of long commands on stderr."""

import shutil
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import timedelta
from typing import TypeVar

from ...tables.csv_file import Progress
from .results import say

Item = TypeVar("Item")

#: seconds in which a command that mostly takes less shows no progress
QUIET = 2.0
#: seconds between two lines: of a stage in a file, others; on a terminal each takes the place of the last
IN_FILE, BETWEEN = 10.0, 0.5


@contextmanager
def progress_bar(quiet: float = 0.0) -> Iterator[Progress]:
    """Lines with the time left of each stage.

    Parameters   quiet : seconds from the beginning in which nothing is shown
    """
    terminal, last = sys.stderr.isatty(), time.monotonic() + quiet - BETWEEN
    stage, begun, before, is_open = ("", 0), last, 0, False

    def progress(finished: int, total: int, what: str) -> None:
        nonlocal last, stage, begun, before, is_open
        now, new, done = time.monotonic(), (what, total) != stage, finished == total
        # the end of a stage that was not shown is no news
        wait = BETWEEN if new or terminal else IN_FILE
        if (new and quiet > 0.0) if done else now < last + wait:
            return
        if new:
            stage, begun, before = (what, total), now, finished
        seconds, clock = now - begun, ""
        if done:
            clock = f" in {_clock(seconds)}"
        elif finished > before:
            clock = f", {_clock(seconds * (total - finished) / (finished - before))} left"
        text, is_open = f"{what}: {finished} of {total}{clock}", terminal and not done
        say(text[: shutil.get_terminal_size().columns - 1] if is_open else text, end="" if is_open else "\n")
        last = now

    try:
        yield progress
    finally:
        if is_open:
            say("", end="\r")


def each(items: Sequence[Item], what: str, quiet: float = QUIET) -> Iterator[Item]:
    """The items one by one, with progress."""
    with progress_bar(quiet) as progress:
        for number, item in enumerate(items):
            progress(number, len(items), what)
            yield item
        progress(len(items), len(items), what)


def _clock(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))
