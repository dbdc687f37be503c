"""Tables of numbers as CSV: measurements, operating points, contacts, published values; one reader for all.

Fields are separated by commas, semicolons or tabs. With semicolons or tabs numbers may have decimal commas, as
written by a German Excel. A file with decimal commas must not have a point in a number, which could be a thousands
separator. Text may be UTF-8, UTF-16 with a byte order mark, or Windows-1252. Lines that begin with # are comments.
"""

from __future__ import annotations

import csv
import hashlib
import re
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}
#: a number with a decimal comma or point
_DECIMAL = re.compile(r"[+-]?(\d+[.,]\d*|[.,]\d+)([eE][+-]?\d+)?")


class CsvTable(NamedTuple):
    """Headings, fields of each row with its line in the file, separator, start of the SHA-256 of the file."""

    path: Path
    headings: list[str]
    rows: list[tuple[int, list[str]]]
    separator: str
    digest: str


def read_table(path: Path | str) -> CsvTable:
    """Fields of a file as they are written.

    Raises       ValueError: cannot be read, no rows, a row with more or fewer fields than the headings
    """
    path = Path(path)
    try:
        content = path.read_bytes()
        text = _decoded(content)
    except (OSError, UnicodeError) as err:
        reason = f"cannot be read ({err.strerror})" if isinstance(err, OSError) else "is no text"
        raise ValueError(f"{path}: {reason}; give a CSV file with a line of headings") from err
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        # Excel may write the separator in the first line
        if line.strip(" \t;,") and not line.lstrip().startswith("#") and not line.startswith("sep=")
    ]
    if len(lines) < 2:
        raise ValueError(f"{path}: no rows; allowed: a line of headings and one line per point")
    separator = next(mark for mark in _SEPARATORS if mark in lines[0][1] or mark == ",")
    (_, headings), *rows = [
        (number, [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True))])
        for number, line in lines
    ]  # fmt: skip
    hint = "; numbers with decimal commas need semicolons between the fields" if separator == "," else ""
    for index, (line, row) in enumerate(rows, start=1):
        if len(row) != len(headings):
            raise ValueError(
                f"{path}: row {index} (line {line}): {len(row)} fields between {_SEPARATORS[separator]}; "
                f"{len(headings)} expected, as in the headings{hint}"
            )
    if twice := sorted({heading for heading in headings if heading and headings.count(heading) > 1}):
        raise ValueError(f"{path}: columns given twice: {', '.join(twice)}; allowed: each heading once")
    return CsvTable(path, headings, rows, separator, hashlib.sha256(content).hexdigest()[:12])


def _decoded(content: bytes) -> str:
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252")


def with_decimal_points(table: CsvTable, numeric: Collection[int]) -> CsvTable:
    """The table with points instead of decimal commas in columns of numbers.

    Parameters   numeric : numbers of these columns, from 0
    Raises       ValueError: ambiguous commas and points
    """
    commas = any("," in row[k] for _, row in table.rows for k in numeric)
    for number, (line, row) in enumerate(table.rows, start=1):
        for k in numeric:
            where = f"{table.path}: row {number} (line {line}): {table.headings[k]} = {row[k]!r}"
            if "," in row[k] and table.separator == ",":
                raise ValueError(
                    f"{where}; numbers with decimal commas need semicolons between the fields, thousands no mark"
                )
            if commas and "." in row[k]:
                raise ValueError(
                    f"{where}; allowed in a file with decimal commas: no point (thousands or decimal?)"
                )
    return table._replace(
        rows=[
            (line, [text.replace(",", ".") if k in numeric else text for k, text in enumerate(row)])
            for line, row in table.rows
        ]
    )


def read_rows(path: Path | str) -> list[dict[str, str]]:
    """Rows by heading; columns with a decimal comma or point are numbers, which may have decimal commas.

    Raises       ValueError: as read_table and with_decimal_points
    """
    table = read_table(path)
    if table.separator != ",":
        numeric = {k for _, row in table.rows for k, text in enumerate(row) if _DECIMAL.fullmatch(text)}
        table = with_decimal_points(table, numeric)
    return [dict(zip(table.headings, row, strict=True)) for _, row in table.rows]
