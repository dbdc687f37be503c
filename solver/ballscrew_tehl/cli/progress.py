"""Progress of long commands on stderr."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..nut_map.workers import Progress


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """A bar with rate and time left on a terminal, else a line per twentieth of the work."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    begun, doing = time.monotonic(), ""
    if not console.is_terminal:
        printed, before, whole = -1, 0, 0

        def line(finished: int, total: int, what: str) -> None:
            nonlocal printed, before, begun, doing, whole
            if what != doing or total != whole:
                # a refining build adds work stage by stage
                begun, printed, before, doing, whole = time.monotonic(), -1, finished, what, total
            if 20 * (finished - before) >= (printed + 1) * (total - before):
                printed = 20 * (finished - before) // max(total - before, 1)
                rate = (finished - before) / max(time.monotonic() - begun, 1e-9)
                left = f", {rate:.1f}/s, {(total - finished) / rate:.0f} s left" if rate > 0.0 else ""
                print(f"{finished} of {total} {what}{left}", file=sys.stderr, flush=True)

        yield line
        return
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"),
        TimeElapsedColumn(), TimeRemainingColumn(),
    )  # fmt: skip
    with Bar(*columns, console=console) as bar:
        task = bar.add_task("starting", total=None, rate="")

        def progress(finished: int, total: int, what: str) -> None:
            nonlocal doing
            if what != doing:
                doing = what
                bar.reset(task, total=total, description=what)
            speed = bar.tasks[0].speed
            bar.update(task, completed=finished, total=total, rate=f"{speed:.1f}/s" if speed else "")

        yield progress
