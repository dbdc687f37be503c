"""Data of this folder, and tables as Markdown: read in a terminal, and part of the documentation as they are."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd


def data_file(name: str, text: bool = False) -> pd.DataFrame:
    """A CSV file of this folder without its lines of comments; text: fields as they are written."""
    written = {"dtype": str, "keep_default_na": False} if text else {}
    return pd.read_csv(Path(__file__).with_name(name), comment="#", **written)


def table(title: str, head: Sequence[str], rows: Iterable[Iterable[Any]], ruled: str = "---:") -> str:
    """A title and a table, the first column to the left; ruled: alignment of the others, "---" for text."""
    lines = [head, ["---", *[ruled] * (len(head) - 1)], *rows]
    return f"**{title}**\n\n" + "".join(f"| {' | '.join(map(str, line))} |\n" for line in lines)


def percent(value: float | None) -> str:
    """A fraction in per cent, "-" for None."""
    return "-" if value is None else f"{100.0 * value:.2f} %"
