"""The packaged screw of the paper and the published tables, for several test modules."""

import csv

from paths import PUBLISHED

from ballscrew_tehl.parameters.file import load_screw

GD4008 = load_screw()


def published_rows(name: str) -> list[dict[str, str]]:
    """Rows of a table under tests/published/data; lines that start with # are its source."""
    lines = (PUBLISHED / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))
