"""Results of a benchmark as CSV, a row as soon as it is known: an interrupted run keeps its rows and continues."""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Generic, TypeVar, get_type_hints

import ballscrew_tehl.contact

#: a NamedTuple type
Row = TypeVar("Row", bound=tuple)
CONVERTERS = {bool: lambda text: text == "True", int: int, float: float, str: str}


def solver_hash(*further: Path) -> str:
    """Eight digits that change with the sources of the contact solver, of the formulas below it, of further folders."""
    contact = Path(ballscrew_tehl.contact.__file__).parent
    digest = hashlib.sha256()
    for folder in (contact, contact.parent / "physics", *further):
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:8]


class ResultFile(Generic[Row]):
    """Rows of one NamedTuple type in a CSV file; path None: nothing is read or written.

    key: the columns that make a row one case. The column "solver" (None: solver_hash) is added; rows of one only.
    Raises ValueError: the file holds other columns or rows of another solver
    """

    def __init__(
        self, path: Path | None, row_type: type[Row], key: tuple[str, ...], solver: str | None = None
    ) -> None:
        self.path, self.row_type, self.key, self.solver = path, row_type, key, solver or solver_hash()
        self.rows: list[Row] = []
        self._fields: tuple[str, ...] = row_type._fields  # type: ignore[attr-defined]
        if path is not None and path.exists():
            self._read(path)

    def _read(self, path: Path) -> None:
        hints = get_type_hints(self.row_type)
        with path.open(newline="", encoding="utf-8") as stream:
            table = csv.DictReader(stream)
            if table.fieldnames != [*self._fields, "solver"]:
                raise ValueError(f"{path}: columns {table.fieldnames} of another command: use another file")
            for record in table:
                if record["solver"] != self.solver:
                    raise ValueError(
                        f"{path}: rows of solver {record['solver']}, this one is {self.solver}: use another file"
                    )
                values = (CONVERTERS[hints[name]](record[name]) for name in self._fields)
                self.rows.append(self.row_type(*values))

    def case(self, row: Any) -> tuple[Any, ...]:
        """The columns that make a row one case."""
        return tuple(getattr(row, name) for name in self.key)

    def cases(self) -> set[tuple[Any, ...]]:
        """Cases that the file holds."""
        return {self.case(row) for row in self.rows}

    def append(self, row: Row) -> None:
        """Add a row, also to the file."""
        self.rows.append(row)
        if self.path is None:
            return
        new = not self.path.exists()
        with self.path.open("a", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream)
            if new:
                writer.writerow([*self._fields, "solver"])
            writer.writerow([*row, self.solver])


class FigureFile:
    """Figures of a benchmark as CSV: part, case, quantity, solver, value; path None: none are written."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        if path is not None:
            path.write_text("part,case,quantity,solver,value\n", encoding="utf-8")

    def add(self, part: str, case: str, figures: Mapping[str, Any], solver: str = "this") -> None:
        """Add the figures of one case."""
        if self._path is not None:
            with self._path.open("a", newline="", encoding="utf-8") as stream:
                csv.writer(stream).writerows(
                    (part, case, name, solver, figure) for name, figure in figures.items()
                )
