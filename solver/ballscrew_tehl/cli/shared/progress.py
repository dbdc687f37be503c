"""Progress of long commands on stderr."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from ...nut_map.workers import Progress


#: seconds before the first word of a command that may be done sooner
QUIET = 2.0
#: seconds between two words of such a command
BETWEEN = 0.5


@contextmanager
def progress_bar(quiet: float = 0.0) -> Iterator[Progress]:
    """A bar with rate and time left on a terminal, else a line per twentieth of the work.

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


def _rate(per_second: float) -> str:
    return f"{per_second:.1f}/s" if per_second >= 1.0 else f"{per_second:.2g}/s"


def _lines() -> Progress:
    begun, doing = time.monotonic(), ""
    printed, before, whole = -1, 0, 0

    def line(finished: int, total: int, what: str) -> None:
        nonlocal printed, before, begun, doing, whole
        if what != doing or total != whole:
            # a refining build adds work stage by stage
            begun, printed, before, doing, whole = time.monotonic(), -1, finished, what, total
        if 20 * (finished - before) >= (printed + 1) * (total - before):
            printed = 20 * (finished - before) // max(total - before, 1)
            rate = (finished - before) / max(time.monotonic() - begun, 1e-9)
            left = f", {_rate(rate)}, {(total - finished) / rate:.0f} s left" if rate > 0.0 else ""
            print(f"{finished} of {total} {what}{left}", file=sys.stderr, flush=True)

    return line


@contextmanager
def _bar(console: Console) -> Iterator[Progress]:
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=console) as bar:
        task, doing = bar.add_task("starting", total=None, rate=""), ""

        def progress(finished: int, total: int, what: str) -> None:
            nonlocal doing
            if what != doing:
                doing = what
                bar.reset(task, total=total, description=what)
            speed = bar.tasks[0].speed
            bar.update(task, completed=finished, total=total, rate=_rate(speed) if speed else "")

        yield progress
