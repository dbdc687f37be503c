"""Progress of long commands on stderr."""

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from datetime import timedelta
from typing import TypeVar

from ...tables.csv_file import Progress
from .results import say

Item = TypeVar("Item")

#: seconds in which a command that mostly takes less shows no progress
QUIET = 2.0
#: seconds between two steps shown of such a command, and between two lines of a stage in a file
BETWEEN, IN_FILE = 0.5, 10.0


@contextmanager
def progress_bar(quiet: float = 0.0) -> Iterator[Progress]:
    """A bar of the present stage with the time left on a terminal, else lines.

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
            display = display or stack.enter_context(_display())
            display(finished, total, what)

        yield progress


@contextmanager
def _display() -> Iterator[Progress]:
    from rich import progress as rich
    from rich.console import Console

    columns = (
        rich.TextColumn("{task.description}"), rich.BarColumn(), rich.MofNCompleteColumn(),
        rich.TimeElapsedColumn(), rich.TextColumn("left"), rich.TimeRemainingColumn(),
    )  # fmt: skip
    console, due = Console(stderr=True), 0.0
    lines = not console.is_terminal
    # times left by all steps, for one may take minutes
    with rich.Progress(*columns, console=console, disable=lines, speed_estimate_period=1e9) as bar:
        bar.add_task("")
        (task,) = bar.tasks

        def progress(finished: int, total: int, what: str) -> None:
            nonlocal due
            if what != task.description or finished < task.completed:
                bar.reset(task.id, description=what)
                due = 0.0
            bar.update(task.id, completed=finished, total=total)
            if lines and (finished == total or time.monotonic() > due):
                due, form = time.monotonic() + IN_FILE, ", {} left"
                seconds = task.time_remaining
                if finished == total:
                    seconds, form = task.elapsed, " in {}"
                clock = "" if seconds is None else form.format(timedelta(seconds=round(seconds)))
                say(f"{what}: {finished} of {total}{clock}")

        yield progress


def each(items: Sequence[Item], what: str, quiet: float = QUIET) -> Iterator[Item]:
    """The items one by one, with progress."""
    with progress_bar(quiet) as progress:
        for number, item in enumerate(items):
            progress(number, len(items), what)
            yield item
        progress(len(items), len(items), what)
