"""The validation that a native FMU carries: inputs and outputs of its model for them, in tables that any tool reads."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

FOLDER, INPUTS, OUTPUTS = "extra/org.ballscrew-tehl", "validation_in.csv", "validation_out.csv"


class Reference(NamedTuple):
    """Inputs, held over equal steps from time 0, and outputs at the end of each step."""

    step: float  # [s]
    inputs: Sequence[Mapping[str, Any]]
    outputs: Sequence[Mapping[str, Any]]


def reference_files(reference: Reference) -> dict[str, bytes]:
    """Tables by path in the FMU, numbers with all digits."""
    step = reference.step
    tables = {INPUTS: _table(reference.inputs, step, 0), OUTPUTS: _table(reference.outputs, step, 1)}
    return {f"{FOLDER}/{name}": content for name, content in tables.items()}


def validation_in(folder: Path) -> Reference | None:
    """The validation of an unpacked FMU; None: it has none.

    ValueError: a file is missing, or is no table of numbers.
    """
    place = folder / FOLDER
    if not place.is_dir():
        return None
    try:
        (inputs, _), (outputs, times) = (_rows(place / name) for name in (INPUTS, OUTPUTS))
    except OSError as error:
        raise ValueError(f"{Path(error.filename).name}: {error.strerror}") from error
    return Reference(times[0], inputs, outputs)


def _rows(file: Path) -> tuple[list[dict[str, float]], list[float]]:
    """Rows of a table, and their times."""
    try:
        head, *lines = csv.reader(io.StringIO(file.read_text(encoding="utf-8")))
        rows = [dict(zip(head, map(float, line), strict=True)) for line in lines]
        return rows, [row.pop("time") for row in rows]
    except (KeyError, ValueError) as error:
        raise ValueError(f"{file.name}: not a table of numbers: {error}") from error


def _table(rows: Sequence[Mapping[str, Any]], step: float, shift: int) -> bytes:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["time", *rows[0]])
    for n, row in enumerate(rows):
        values = (str(int(v)) if isinstance(v, bool) else repr(float(v)) for v in row.values())
        writer.writerow([repr(round((n + shift) * step, 12)), *values])
    return out.getvalue().encode()
