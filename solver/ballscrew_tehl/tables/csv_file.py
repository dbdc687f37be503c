"""The CSV dialect of logs, measured torques, operating points and packaged values.

A line of headings, then a row a line. Fields are separated by semicolons, tabs or commas: the first of these marks that
the line of headings has. Text is UTF-8, UTF-16 with a byte order mark, or Windows-1252. Blank lines, lines that begin
with # and Excel's first line `sep=;` are skipped; if no other line has headings, a comment directly above the rows
is taken for them, as np.savetxt writes it.

Numbers have a decimal point, or a decimal comma where semicolons or tabs separate the fields, the same in the whole
file, and no marks of thousands: a file whose numbers can be read in two ways is refused.
"""

import csv
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas"}
#: lines looked at for headings and first row;  lines without comments that headings are searched in
HEAD, MAX_LINES = 2000, 100
#: rows between two steps of the progress
PIECE = 100_000
#: what stands for a missing value, in lower case; EOF: last line of exports
MISSING = frozenset(["", "nan", "null", "-", "n/a", "inf", "+inf", "-inf", "1.#qnan", "-1.#ind", "eof"])
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_EXPONENT = r"(?:[eE][+-]?\d+)?"
#: numbers, a line each, by what their marks can be: groups of thousands or decimals, decimals, thousands, none
_KINDS = {
    kind: re.compile(rf"\n([+-]?(?:{pattern}))(?=\n)")
    for kind, pattern in {
        ".group": r"[1-9]\d{0,2}\.\d{3}",
        ",group": r"[1-9]\d{0,2},\d{3}",
        ".": rf"(?![1-9]\d{{0,2}}\.\d{{3}}\n)(?=\.?\d)\d*\.\d*{_EXPONENT}",
        ",": rf"(?![1-9]\d{{0,2}},\d{{3}}\n)(?=,?\d)\d*,\d*{_EXPONENT}",
        "thousands": "\\d{1,3}(?:[ '\u2019\u00a0\u202f]\\d{3})+(?:[.,]\\d*)?|\\d{1,3}(?:[.,]\\d{3})+[.,]\\d+",
        "hundreds": r"[1-9]\d\d",
        "many": r"[1-9]\d{3,}",
    }.items()
}
_NAMES = {".": "point", ",": "comma"}
_DIGITS = frozenset("0123456789+-.")
Progress = Callable[[int, int, str], None]


class Table(NamedTuple):
    """Where the table of a file is: headings, their line, lines between them and the rows, lines above the first row.

    lines : of the whole file;  above : lines above the headings that are no comments
    """

    path: Path
    headings: list[str]
    heading_line: int
    between: list[list[str]]
    start: int
    separator: str
    lines: list[str]
    above: int = 0

    def rows(
        self, progress: Progress = lambda finished, total, what: None
    ) -> Iterator[tuple[int, list[str]]]:
        """Line in the file, from 1, and fields of each row; separators at its end are dropped."""
        fields, total = len(self.headings), len(self.lines)
        for number in range(self.start + 1, total + 1):
            line = self.lines[number - 1]
            if number % PIECE == 0:
                progress(number, total, "lines of the file read")
            if line[:1] in _DIGITS or not _is_comment(line):
                row = split_fields(line, self.separator)
                while len(row) > fields and not row[-1]:
                    row.pop()
                yield number, row


def split_fields(line: str, separator: str) -> list[str]:
    """Fields of a line, which may be in quotes."""
    if '"' in line:
        line_fields = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
        return [text.strip() for text in line_fields]
    line = line.rstrip("\r\n")
    return [text.strip() for text in line.split(separator)] if " " in line else line.split(separator)


def separator_of(line: str) -> str:
    """Mark between the fields of a line."""
    return next((mark for mark in SEPARATORS if mark in line), ",")


def is_number(text: str) -> bool:
    """Whether a field is a number, with a decimal point or comma."""
    return NUMBER.fullmatch(text.replace(",", ".")) is not None


def _is_comment(line: str) -> bool:
    return not line.strip(" \t;,\r\n") or line.lstrip().startswith("#") or line.startswith("sep=")


def open_table(path: Path | str, places: Callable[[list[str]], Sequence[int] | None] | None = None) -> Table:
    """Find headings and rows.

    Parameters   places : of the fields that make a line one of headings, and are numbers in the first row; None for any
                 other line. Not given: the first line has the headings
    Raises       ValueError: cannot be read, no text, no headings, no rows
    """
    path = Path(path)
    whole = _lines(path)
    lines = whole[:HEAD]
    content = [number for number, line in enumerate(lines) if not _is_comment(line)]
    comments = [number for number, line in enumerate(lines) if line.lstrip().startswith("#")]

    def fields(number: int) -> list[str]:
        line = lines[number].lstrip("\ufeff# ") if number in comments else lines[number]
        return split_fields(line, separator_of(line))

    if places is None:
        heading, first = (content or [-1])[0], (content[1:] or [len(lines)])[0]
    else:
        heading, first = _named(content[:MAX_LINES], fields, places)
    if content and heading in content and all(is_number(text) for text in fields(heading) if text):
        # rows without headings, unless a comment has them
        named = [k for k in comments if k < heading and len(fields(k)) == len(fields(heading))
                 and (places is None or places(fields(k)))]  # fmt: skip
        if not named:
            raise ValueError(
                f"{path}: no line of headings, the first line is {lines[heading][:40]!r}; allowed: headings with units"
            )
        heading, first = named[-1], heading
    if heading < 0 or first >= len(lines):
        raise ValueError(f"{path}: no rows; allowed: a line of headings and one line per point")
    line = lines[heading].lstrip("\ufeff# ") if heading in comments else lines[heading]
    separator = separator_of(line)
    between = [split_fields(lines[k], separator) for k in content if heading < k < first]
    above = sum(k < heading for k in content)
    return Table(path, split_fields(line, separator), heading + 1, between, first, separator, whole, above)


def _named(
    content: Sequence[int], fields: Callable[[int], list[str]], places: Callable[[list[str]], Sequence[int] | None]
) -> tuple[int, int]:  # fmt: skip
    """The last line with known headings above its first row; else the one that stands where headings would."""
    heading, needed = -1, [0]
    numeric = None
    for number in content:
        texts = fields(number)
        if found := places(texts):
            heading, needed = number, list(found)
        elif heading >= 0 and max(needed) < len(texts):
            time, *others = (texts[place] for place in needed)
            if is_number(time) and all(is_number(text) or text.lower() in MISSING for text in others):
                return heading, number
        if numeric is None and all(is_number(text) for text in texts if text):
            numeric = number
    if heading >= 0:
        return heading, heading + 1
    if numeric is None:
        return (content or [-1])[0], (content[1:] or [1 << 30])[0]
    names = [k for k in content if k < numeric and len(fields(k)) == len(fields(numeric))
             and not any(is_number(text) for text in fields(k))]  # fmt: skip
    return (names or [k for k in content if k < numeric][-1:] or [numeric])[0], numeric


def _lines(path: Path) -> list[str]:
    """Lines of a file of any encoding."""
    try:
        content = path.read_bytes()
    except OSError as error:
        reason = f"cannot be read ({error.strerror})"
        raise ValueError(f"{path}: {reason}; give a CSV file with a line of headings") from error
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = content.decode("utf-16", "replace")
    else:
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = content.decode("cp1252", "replace")
    if "\0" in text[:1000]:
        raise ValueError(f"{path}: is no text; give a CSV file with a line of headings")
    return text.replace("\r\n", "\n").rstrip("\r").replace("\r", "\n").split("\n")


def read_table(path: Path | str) -> tuple[Table, list[tuple[int, list[str]]]]:
    """Table of a file, and the fields of each row as they are written, with its line.

    Raises       ValueError: as open_table; a row with more or fewer fields than the headings, a heading twice
    """
    table = open_table(path)
    rows, count = list(table.rows()), len(table.headings)
    hint = (
        "; numbers with decimal commas need semicolons between the fields" if table.separator == "," else ""
    )
    for index, (line, row) in enumerate(rows, start=1):
        if len(row) != count:
            raise ValueError(
                f"{path}: row {index} (line {line}): {len(row)} fields between {SEPARATORS[table.separator]}; "
                f"{count} expected, as in the headings{hint}"
            )
    if twice := sorted({text for text in table.headings if text and table.headings.count(text) > 1}):
        raise ValueError(f"{path}: columns given twice: {', '.join(twice)}; allowed: each heading once")
    return table, rows


def read_rows(path: Path | str, numeric: Callable[[str], bool] | None = None) -> list[dict[str, str]]:
    """Rows by heading; numbers with decimal points.

    Parameters   numeric : whether the column of a heading has numbers; None: columns whose fields are all numbers
    Raises       ValueError: as read_table and Numbers.check
    """
    table, rows = read_table(path)
    numbers, lines = Numbers(table), [line for line, _ in rows]
    columns = list(zip(*(row for _, row in rows), strict=True))
    for place, texts in enumerate(columns):
        if numeric(table.headings[place]) if numeric else all(is_number(text) for text in texts if text):
            numbers.add(place, lines, texts)
            columns[place] = tuple(text.replace(",", ".") for text in texts)
    numbers.check()
    return [dict(zip(table.headings, row, strict=True)) for row in zip(*columns, strict=True)]


class Numbers:
    """Numbers of the columns of a table; the first of each kind of marks with its line, by column."""

    def __init__(self, table: Table) -> None:
        self.table = table
        self.first: dict[tuple[int, str], tuple[int, str]] = {}

    def add(
        self, place: int, lines: Sequence[int], texts: Sequence[str]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """A piece of a column: values, NaN where a field is missing or text, and where it is text."""
        joined = "\n".join(texts)
        for kind, pattern in _KINDS.items():
            possible = (place, kind) not in self.first and (kind[0] not in _NAMES or kind[0] in joined)
            if possible and (number := pattern.search(f"\n{joined}\n")):
                self.first[place, kind] = lines[texts.index(number[1])], number[1]
        texts = joined.replace(",", ".").split("\n")
        bad = np.zeros(len(texts), dtype=bool)
        try:
            values = np.array(texts if "_" not in joined else ["_"], dtype=np.float64)
        except ValueError:
            known = [NUMBER.fullmatch(text) is not None for text in texts]
            values = np.array(
                [float(text) if good else np.nan for text, good in zip(texts, known, strict=True)]
            )
            bad[:] = [
                not good and text.lower() not in MISSING for text, good in zip(texts, known, strict=True)
            ]
        return np.where(np.isfinite(values), values, np.nan), bad

    def check(self) -> None:
        """ValueError: a number can be read in two ways, with both."""

        def numbers(*kinds: str) -> list[tuple[int, tuple[int, str]]]:
            return [(place, number) for (place, kind), number in self.first.items() if kind in kinds]

        def error(place: int, number: tuple[int, str], problem: str, remedy: str = "") -> ValueError:
            readings = ""
            if remedy and re.fullmatch(r"[+-]?\d{1,3}[.,]\d{3}", number[1]):
                readings = f", {number[1].replace(',', '.')} or {re.sub('[.,]', '', number[1])}"
            where = f"{self.table.path}: line {number[0]}: {self.table.headings[place]} = {number[1]!r}"
            return ValueError(f"{where}{problem}{readings}{remedy}")

        remedy, comma = ": export without marks of thousands", self.table.separator == ","
        of = {mark: numbers(mark, f"{mark}group") for mark in ".,"}
        for mark, found in of.items():
            found += [(place, number) for place, number in numbers("thousands") if mark in number[1]]
        if comma and of[","]:
            problem = "; numbers with decimal commas need semicolons between the fields, thousands no mark"
            raise error(*of[","][0], problem)
        if of[","] and of["."]:
            decimal, other = (".", ",") if numbers(".") and not numbers(",") else (",", ".")
            problem = f"; allowed in a file with decimal {_NAMES[decimal]}s: no {_NAMES[other]} (thousands or decimal?)"
            raise error(*of[other][0], problem, remedy)
        if found := numbers("thousands"):
            raise error(*found[0], "; allowed: a number without marks of thousands")
        for mark in ".,":
            for place, number in numbers(f"{mark}group"):
                # whole numbers below 1000 beside it, and no decimals in the column; or nothing else in the file
                grouped = (place, "hundreds") in self.first and not {
                    (place, mark),
                    (place, "many"),
                } & self.first.keys()
                if grouped or not (comma or numbers(".", ",", "many")):
                    raise error(
                        place,
                        number,
                        " can be read in two ways",
                        f"{remedy}, with the same decimals in each row",
                    )
