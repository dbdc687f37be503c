"""Errata of the paper: what is printed, what is used here, the effect in numbers.

One table, data/zhao2023_errata.csv, for the report and the documentation.
"""

from __future__ import annotations

from typing import NamedTuple

from ..calibration.csv_table import read_rows
from ..parameters.packaged_data import PACKAGED_DATA

PACKAGED_ERRATA = PACKAGED_DATA / "zhao2023_errata.csv"


class Erratum(NamedTuple):
    """Where, what is printed, what is used instead, the effect with the packaged screw."""

    where: str
    printed: str
    used: str
    effect: str


def errata() -> list[Erratum]:
    """All of them, in the order of the paper's equations."""
    return [Erratum(**row) for row in read_rows(PACKAGED_ERRATA)]
