"""Progress of long commands on stderr."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING

from .results import say

if TYPE_CHECKING:
    from rich.console import Console

    from ...nut_map.built import Progress


#: seconds before the first word of a command that may be done sooner
QUIET = 2.0
#: seconds between two words of such a command, and after which a line is written again
BETWEEN, AGAIN = 0.5, 20.0


@contextmanager
def progress_bar(quiet: float = 0.0) -> Iterator[Progress]:
    """A bar with the time left for each stage on a terminal, else a line per twentieth of the work or 20 s.

    Parameters   quiet : seconds from the beginning in which nothing is shown, nor anything imported for it
    """
    due = time.monotonic() + quiet
    with ExitStack() as stack:
        shown = None if quiet > 0.0 else stack.enter_context(_display())
        stage = ""

        def progress(finished: int, total: int, what: str) -> None:
            nonlocal shown, due, stage
            done = finished == total
            # the end of a stage that was not shown is no news
            if quiet > 0.0 and (what != stage if done else time.monotonic() < due):
                return
            stage = what
            if quiet > 0.0:
                # a stage of many short steps is soon over
                due = time.monotonic() + BETWEEN
            shown = shown or stack.enter_context(_display())
            shown(finished, total, what)

        yield progress


@contextmanager
def _display() -> Iterator[Progress]:
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield _lines()
        return
    with _bar(console) as progress:
        yield progress


def _lines() -> Progress:
    begun = said = time.monotonic()
    doing = ""
    printed, before, whole = -1, 0, 0

    def line(finished: int, total: int, what: str) -> None:
        nonlocal printed, before, begun, said, doing, whole
        if what != doing or total != whole:
            # a refining build adds work stage by stage
            begun, printed, before, doing, whole = time.monotonic(), -1, finished, what, total
        due = time.monotonic() >= said + AGAIN
        if due or 20 * (finished - before) >= (printed + 1) * (total - before):
            said = time.monotonic()
            printed = 20 * (finished - before) // max(total - before, 1)
            seconds = time.monotonic() - begun
            left = seconds * (total - finished) / max(finished - before, 1)
            clock = f", {_clock(left)} left" if before < finished < total else ""
            clock = f" in {_clock(seconds)}" if finished == total else clock
            say(f"{what}: {finished} of {total}{clock}")

    return line


def _clock(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))


@contextmanager
def _bar(console: Console) -> Iterator[Progress]:
    """A bar for each stage; those of work that begins anew take the place of the others."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TaskID,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
        TextColumn("left"), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=console) as bar:
        stages: dict[str, TaskID] = {}

        def progress(finished: int, total: int, what: str) -> None:
            if what in stages and what != next(reversed(stages)):
                for task in stages.values():
                    bar.remove_task(task)
                stages.clear()
            if what not in stages:
                stages[what] = bar.add_task(what, total=total)
            bar.update(stages[what], completed=finished, total=total)

        yield progress
