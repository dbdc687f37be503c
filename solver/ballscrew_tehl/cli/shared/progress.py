"""Progress of long commands on stderr, with the time left of each stage."""

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
#: seconds between two lines of a stage: on a terminal, where one takes the place of the other, and in a file
ON_TERMINAL, IN_FILE = 0.5, 10.0
#: columns of a line on a terminal
WIDTH = 79


@contextmanager
def progress_bar(quiet: float = 0.0) -> Iterator[Progress]:
    """A function of steps finished, their number and the name of the stage, which shows them.

    Parameters   quiet : seconds from the beginning in which nothing is shown
    """
    terminal = sys.stderr.isatty()
    between = ON_TERMINAL if terminal else IN_FILE
    silent_until = due = time.monotonic() + quiet
    stage, begun, before, shown, unfinished = ("", 0), 0.0, 0, False, False

    def progress(finished: int, total: int, what: str) -> None:
        nonlocal stage, begun, before, due, shown, unfinished
        now, done = time.monotonic(), finished == total
        if (what, total) != stage:
            stage, begun, before, shown = (what, total), now, finished, False
            due = max(now, silent_until)
        # the end of a stage that was not shown is no news
        if not (shown if done and quiet else done or now >= due):
            return
        shown, due, unfinished = True, now + between, not done
        text = f"{what}: {finished} of {total}"
        if done:
            text += f" in {_clock(now - begun)}"
        elif finished > before:
            text += f", {_clock((now - begun) * (total - finished) / (finished - before))} left"
        if terminal:
            print(f"\r{text:<{WIDTH}}", end="\n" if done else "", file=sys.stderr, flush=True)
        else:
            say(text)

    try:
        yield progress
    finally:
        if terminal and unfinished:
            say("")


def each(items: Sequence[Item], what: str, quiet: float = QUIET) -> Iterator[Item]:
    """The items one by one, with progress."""
    with progress_bar(quiet) as progress:
        for number, item in enumerate(items):
            progress(number, len(items), what)
            yield item
        progress(len(items), len(items), what)


def _clock(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))
