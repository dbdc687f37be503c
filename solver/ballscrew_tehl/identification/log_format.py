"""Where the table of a log begins: headings, units, separator, decimal sign, below the lines that exports put first.

The line of headings is the first that names time, motion and drive. Rows begin where those fields are numbers.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from .log_units import EXAMPLE, LogColumn, log_columns, needed_places

#: bytes looked at;  lines that the headings are searched in
HEAD, MOST_LINES = 65536, 100
#: what stands for a missing value; EOF: last line of exports
MISSING = [
    "", "nan", "NaN", "NAN", "null", "NULL", "-", "n/a", "N/A", "inf", "-inf", "Inf", "-Inf", "1.#QNAN", "-1.#IND",
    "EOF",
]  # fmt: skip
#: TwinCAT Scope heads each column of time so
SCOPE = "Name"


class Format(NamedTuple):
    """Columns by signal; headings that are not used; fields of a row; lines above the first row; notes.

    recoded : encoding that the rows have to be recoded from; empty: bytes that contain ASCII
    """

    columns: dict[str, LogColumn]
    unused: list[str]
    fields: int
    separator: str
    decimal: str
    skipped: int
    recoded: str
    notes: list[str]


def read_format(path: Path, stated: Mapping[str, str], wanted: Sequence[str] = ()) -> Format:
    """Format of a log.

    Parameters   stated, wanted : see log_columns
    Raises       ValueError: cannot be read, no headings, headings not understood, no rows
    """
    lines, recoded = _head(path)
    content = [number for number, line in enumerate(lines) if not _is_comment(line)]
    heading, first = _table(lines, content, stated)
    separator = _separator(lines[heading])
    headings = _fields(lines[heading], separator)
    rows = [_fields(lines[number], separator) for number in content if number >= first]
    if not rows:
        raise ValueError("no rows; allowed: a line of headings and one line per sample")
    between = [_fields(lines[number], separator) for number in content if heading < number < first]
    clocks = [place for place, text in enumerate(headings) if text == SCOPE and headings[0] == SCOPE]
    headings = [
        ("" if place else "time [ms]") if place in clocks else text for place, text in enumerate(headings)
    ]
    for units in (*between, []):
        given = [unit.strip("[]() ") for unit in units] + len(headings) * [""]
        try:
            columns, unused = log_columns(headings, given, stated, wanted)
            break
        except ValueError:
            if not units:
                raise
    if columns["time"].place in clocks:
        columns["time"] = columns["time"]._replace(place=_clock(columns, clocks, rows))
    double = 2 * len(headings)
    if separator == "," and sum(len(row) == double for row in rows) > len(rows) // 2 and double > 2:
        raise ValueError(
            f"{double} fields under {len(headings)} headings; numbers with decimal commas need semicolons between the "
            "fields"
        )
    numbers = [row[column.place] for column in columns.values() for row in rows if column.place < len(row)]
    decimal = "," if any("," in number for number in numbers) else "."
    notes = []
    if above := sum(number < heading for number in content):
        notes.append(f"{above} line{'s' * (above > 1)} above the headings in line {heading + 1} skipped")
    if between:
        notes.append(f"{len(between)} line{'s' * (len(between) > 1)} between headings and rows: no samples")
    # a separator may end each row
    fields = max(len(headings), 0 if any(rows[0][len(headings) :]) else len(rows[0]))
    return Format(
        columns, [text for text in unused if text], fields, separator, decimal, first, recoded, notes
    )


def _head(path: Path) -> tuple[list[str], str]:
    """First lines, and the encoding if it is none with ASCII or lines end with a carriage return alone."""
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
            whole = not file.read(1)
    except OSError as error:
        raise ValueError(f"cannot be read ({error.strerror}); give a CSV file") from error
    encoding = "utf-16" if head[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = head[: len(head) // 2 * 2 if encoding == "utf-16" else None].decode(encoding)
    except UnicodeDecodeError as error:
        # a character that the piece has cut
        if encoding != "utf-16" and error.start < len(head) - 4:
            encoding = "cp1252"
        text = head.decode(encoding, "replace")
    if "\0" in text[:1000]:
        raise ValueError("is no text; allowed: a CSV file with a line of headings")
    text = text.replace("\r\n", "\n").rstrip("\r")
    lines = text.replace("\r", "\n").split("\n")
    return lines if whole else lines[:-1], encoding if encoding == "utf-16" or "\r" in text else ""


def _is_comment(line: str) -> bool:
    return not line.strip(" \t;,") or line.lstrip().startswith("#") or line.startswith("sep=")


def _separator(line: str) -> str:
    return next((mark for mark in ";\t" if mark in line), ",")


def _fields(line: str, separator: str) -> list[str]:
    return [
        field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    ]


def is_number(text: str, decimal: str = ",") -> bool:
    """Whether a field is a number."""
    try:
        float(text.replace(decimal, "."))
    except ValueError:
        return False
    return True


def _table(lines: Sequence[str], content: Sequence[int], stated: Mapping[str, str]) -> tuple[int, int]:
    """Number of the line of headings and of the first row.

    Raises       ValueError: no headings
    """
    table = [(number, _fields(lines[number], _separator(lines[number]))) for number in content[:MOST_LINES]]
    heading, places = -1, [0]
    for number, fields in table:
        if found := needed_places(["time" if text == SCOPE else text for text in fields], stated):
            heading, places = number, found
        elif heading >= 0 and max(places) < len(fields):
            time, *others = (fields[place] for place in places)
            if is_number(time) and all(is_number(text) or text in MISSING for text in others):
                return heading, number
    if heading >= 0:
        return heading, heading + 1
    # none is understood: the one above the first numbers, for the message
    numeric = [all(is_number(text) for text in fields if text) for _, fields in table]
    first = numeric.index(True) if any(numeric) else 1
    if not table or first == 0:
        raise ValueError(
            f"no line of headings{f', the first line is {lines[content[0]][:40]!r}' if content else ''}; allowed: "
            f"headings with units, such as {EXAMPLE}"
        )
    names = [number for number, fields in table[:first] if fields[0] == SCOPE and len(fields) > 2]
    return (names or [table[first - 1][0]])[-1], table[first][0] if first < len(table) else len(lines)


def _clock(columns: Mapping[str, LogColumn], clocks: Sequence[int], rows: Sequence[Sequence[str]]) -> int:
    """Place of the time of motion and drive, which is left of them.

    Raises       ValueError: unlike times
    """
    names = [name for name in columns if name not in ("time", "temperature", "preload")]
    places = [max(place for place in clocks if place < columns[name].place) for name in names]
    if any(row[places[0] : places[0] + 1] != row[places[1] : places[1] + 1] for row in rows):
        raise ValueError(
            f"{names[0]} and {names[1]} have unlike times; allowed: an export at one sample time"
        )
    return places[0]
