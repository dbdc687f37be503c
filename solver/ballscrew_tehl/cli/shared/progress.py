"""Progress of long commands on stderr."""

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from datetime import timedelta
from typing import TypeVar

from ...nut_map.built import Progress
from .results import say

Item = TypeVar("Item")

#: seconds in which a command that mostly takes less shows no progress
QUIET = 2.0
#: seconds between two steps shown of such a command, and between two lines of a stage in a file
BETWEEN, IN_FILE = 0.5, 10.0


@contextmanager
def progress_bar(quiet: float = 0.0) -> Iterator[Progress]:
    """A bar with the time left of each stage on a terminal, else lines.

    Parameters   quiet : seconds from the beginning in which nothing is shown, nor anything imported for it
    """
    due, stage = time.monotonic() + quiet, ""
    display: Progress | None = None
    with ExitStack() as stack:

        def progress(finished: int, total: int, what: str) -> None:
            nonlocal display, due, stage
            # the end of a stage that was not shown is no news
            if quiet > 0.0 and (what != stage if finished == total else time.monotonic() < due):
                return
            stage, due = what, time.monotonic() + BETWEEN
            if display is None:
                display = stack.enter_context(_bar()) if sys.stderr.isatty() else _lines()
            display(finished, total, what)

        yield progress


def _lines() -> Progress:
    stage, begun, before, last = ("", 0), 0.0, 0, 0.0

    def line(finished: int, total: int, what: str) -> None:
        nonlocal stage, begun, before, last
        now, done = time.monotonic(), finished == total
        if (what, total) != stage:
            stage, begun, before = (what, total), now, finished
        elif not done and now < last + IN_FILE:
            return
        last, seconds, clock = now, now - begun, ""
        if done:
            clock = f" in {_clock(seconds)}"
        elif finished > before:
            clock = f", {_clock(seconds * (total - finished) / (finished - before))} left"
        say(f"{what}: {finished} of {total}{clock}")

    return line


@contextmanager
def _bar() -> Iterator[Progress]:
    """A bar for each stage; those of work that begins anew take the place of the others."""
    from rich import progress as rich
    from rich.console import Console

    columns = (
        rich.TextColumn("{task.description}"), rich.BarColumn(), rich.MofNCompleteColumn(),
        rich.TimeElapsedColumn(), rich.TextColumn("left"), rich.TimeRemainingColumn(),
    )  # fmt: skip
    with rich.Progress(*columns, console=Console(stderr=True)) as bar:
        stages: dict[str, rich.TaskID] = {}

        def progress(finished: int, total: int, what: str) -> None:
            if what in stages and what != next(reversed(stages)):
                for task in stages.values():
                    bar.remove_task(task)
                stages.clear()
            if what not in stages:
                stages[what] = bar.add_task(what, total=total)
            bar.update(stages[what], completed=finished, total=total)

        yield progress


def each(items: Sequence[Item], what: str, quiet: float = QUIET) -> Iterator[Item]:
    """The items one by one, with progress."""
    with progress_bar(quiet) as progress:
        for number, item in enumerate(items):
            progress(number, len(items), what)
            yield item
        progress(len(items), len(items), what)


def _clock(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))
