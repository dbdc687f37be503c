"""The one reader of tables of numbers: logs, measured torques, operating points and packaged values.

A line of headings, then a row a line. Fields are separated by semicolons, tabs or commas: the first of these marks that
the line of headings has. Text is UTF-8, UTF-16, Windows-1252 or Shift-JIS. Blank lines, lines that begin
with # and Excel's first line `sep=;` are skipped; if no other line has headings, a comment directly above the rows
is taken for them, as np.savetxt writes it. Lines above the headings are skipped, a row of units may be below them.

Numbers have a decimal point, or a decimal comma where semicolons or tabs separate the fields, the same in the whole
file. Marks of thousands are removed where the file shows them, as 1.234.567, 1.234,5, or 1.234 beside 999 in a file
with decimal commas; a file whose numbers can be read in two ways is refused. A time may be one of the day, with a date.
"""

import csv
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice, takewhile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .headings import CLOCK, Column, HeadingError, Kind, columns_of, named_places, one_column, parted, si

SEPARATORS = (";", "\t", ",")
#: lines looked at for headings and first row;  lines without comments that headings are searched in
HEAD, MAX_LINES = 2000, 100
#: what stands for a missing value, in lower case; EOF: last line of exports
MISSING = frozenset(["", "nan", "null", "-", "n/a", "inf", "+inf", "-inf", "1.#qnan", "-1.#ind", "eof"])
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
#: time of day in parts of 60 and a fraction, behind a date, before AM or PM and a time zone
STAMP = re.compile(
    r"(?:\d{1,4}([-./])\d\d?\1\d{1,4}[T ]\s*)?(?:(\d\d?):)?(\d\d?):(\d\d(?:[.,]\d+|[:;]\d{3})?)"
    r"\s*([ap]m)?(?:z|utc|[+-]\d\d:?\d\d)?",
    re.IGNORECASE,
)
#: TwinCAT Scope heads each channel with a column of time [ms] of this name
SCOPE = "Name"
#: table whose columns are all texts
ANY = Kind({}, {}, "")
COMMAS = "numbers with commas, decimal or of thousands, need semicolons between the fields"


@contextmanager
def naming(path: Path | str) -> Iterator[None]:
    """ValueErrors name the file."""
    try:
        yield
    except ValueError as error:
        if str(error).startswith(f"{path}: "):
            raise
        raise ValueError(f"{path}: {error}") from error


class Table(NamedTuple):
    """Where a table is: below headings and units, start of numbers; columns by quantity, headings not understood."""

    path: Path
    headings: list[str]
    separator: str
    lines: list[str]
    below: int
    start: int
    columns: dict[str, list[Column]]
    problems: list[HeadingError]

    def rows(self, start: int) -> Iterator[tuple[int, list[str]]]:
        """Line in the file, from 1, and fields of each row; separators at its end are dropped."""
        fields = len(self.headings)
        for number, line in enumerate(islice(self.lines, start, None), start=start + 1):
            if not _is_comment(line):
                row = _split(line, self.separator)
                while len(row) > fields and not row[-1]:
                    row.pop()
                yield number, row

    def single_columns(self, known: Collection[str] = ()) -> dict[str, Column]:
        """The column of each quantity, one heading each; known: quantities that are given otherwise."""
        with naming(self.path):
            columns = {key: one_column(self.columns, key) for key in self.columns}
            for error in self.problems:
                # next to its quantity, a heading such as torque_low_nm is another one
                if error.unknown_unit or error.key not in (*columns, *known):
                    raise error
        return columns

    def unused(self, used: Mapping[str, Column]) -> str:
        """Headings of the other columns; "" if there are none."""
        places = {column.place for column in used.values()}
        others = [text for k, text in enumerate(self.headings) if k not in places and text not in ("", SCOPE)]
        return f"columns not used: {', '.join(others)}" if others else ""


class Rows(NamedTuple):
    """Lines in the file, from 1; fields and values [SI] by quantity, the latter without damaged rows; these; notes."""

    lines: list[int]
    texts: dict[str, list[str]]
    values: dict[str, NDArray[np.float64]]
    damaged: tuple[int, str]
    notes: list[str]


def _split(line: str, separator: str) -> list[str]:
    """Fields of a line, which may be in quotes."""
    if '"' in line:
        return [text.strip() for text in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
    return [text.strip() for text in line.split(separator)]


def _separator(line: str) -> str:
    outside = re.sub('"[^"]*"', "", line)
    return next((mark for mark in SEPARATORS if mark in outside), ",")


def _is_number(text: str) -> bool:
    return NUMBER.fullmatch(text.replace(",", ".")) is not None


def _numeric(fields: Sequence[str]) -> bool:
    return all(_is_number(text) for text in fields if text)


def _is_comment(line: str) -> bool:
    return not line.strip(" \t;,\r\n") or line.lstrip().startswith("#") or line.startswith("sep=")


def _lines(path: Path) -> list[str]:
    """Lines of a file of any encoding."""
    remedy = "give a CSV file with a line of headings"
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ValueError(f"cannot be read ({error.strerror}); {remedy}") from error
    wide = content[:2] in (b"\xff\xfe", b"\xfe\xff") or content[1:4:2] == b"\0\0"
    try:
        text = content.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        # Windows-1252 has none of these bytes but the florin sign; katakana begin with it
        other = "cp932" if re.search(rb"[\x81\x83\x8d\x8f\x90\x9d]", content) else "cp1252"
        text = content.decode("utf-16" if wide else other, "replace")
    if "\0" in text[:1000]:
        raise ValueError(f"is no text; {remedy}")
    return text.replace("\u2212", "-").replace("\r\n", "\n").rstrip("\r").replace("\r", "\n").split("\n")


def open_table(path: Path | str, kind: Kind, stated: Mapping[str, str] = {}) -> Table:
    """Find headings, rows and columns; stated: headings with units by quantity, from an option."""
    path = Path(path)
    with naming(path):
        lines = _lines(path)
        comments = [number for number, line in enumerate(lines[:HEAD]) if line.lstrip().startswith("#")]
        content = [number for number, line in enumerate(lines[:HEAD]) if not _is_comment(line)]
        fields = {k: _head_fields(lines[k]) for k in (*comments, *content)}
        heading, first = _heading({k: fields[k] for k in content[:MAX_LINES]}, lines, kind, stated)
        if heading in content and _numeric(fields[heading]):
            # rows without headings, unless a comment has them
            alike = [k for k in comments if k < heading and len(fields[k]) == len(fields[heading])]
            alike = [k for k in alike if not kind.needed or named_places(fields[k], kind, stated)]
            if not alike:
                line = f"the first line is {lines[heading][:40]!r}"
                raise ValueError(f"no line of headings, {line}; allowed: headings with units")
            heading, first = alike[-1], heading
        if not 0 <= heading < first < len(lines):
            raise ValueError("no rows; allowed: a line of headings and one line per point")
        most = max(2, len(_head_fields(lines[first].rstrip("; \t,"))))
        if len(fields[heading]) < most and kind.needed and not named_places(fields[heading], kind, stated):
            raise ValueError(f"no line of headings: {lines[heading][:40]!r}; allowed: {most}, with ; between")
        separator = _separator(lines[heading])
        for place, text in enumerate(_split(lines[first], separator)[: len(fields[heading])]):
            if "time" in kind.quantities and STAMP.fullmatch(text):
                fields[heading][place] = f"{parted(fields[heading][place])[0]} [{CLOCK}]"
        # a row of units may be below the headings
        units = [k for k in content if heading < k < first and not any(map(_is_number, fields[k]))]
        results, errors = [], []
        for below, row in [(heading + 1, []), *((k + 1, fields[k]) for k in units)]:
            try:
                results.append((below, *columns_of(fields[heading], kind, stated, row)))
            except ValueError as error:
                errors.append(error)
        if not results:
            raise errors[-1]
        below, columns, problems = min(results, key=lambda result: len(result[2]))
        return Table(path, fields[heading], separator, lines, below, first, columns, problems)


def _head_fields(line: str) -> list[str]:
    """Fields of a line that may be one of headings, also in a comment."""
    texts = _split(line.lstrip("\ufeff# "), _separator(line))
    return ["time [ms]", *texts[1:]] if texts.count(SCOPE) > 1 and texts[0] == SCOPE else texts


def _heading(
    rows: Mapping[int, list[str]], lines: Sequence[str], kind: Kind, stated: Mapping[str, str]
) -> tuple[int, int]:
    """The last line with the needed headings above its first row, and that, -1: none; else where they would be."""
    heading, needed = -1, [0]
    for number, texts in rows.items():
        if places := named_places(texts, kind, stated):
            heading, needed = number, places
        elif heading >= 0 and max(needed) < len(row := _split(lines[number], _separator(lines[heading]))):
            time, *others = (row[place] for place in needed)
            usable = all(_is_number(text) or text.lower() in MISSING for text in others)
            if usable and (_is_number(time) or STAMP.fullmatch(time)):
                return heading, number
    if heading >= 0:
        return heading, heading + 1
    numeric = next((k for k, texts in rows.items() if _numeric(texts)), -1)
    if numeric < 0:
        heading, numeric, *_ = *rows, -1, -1
        return heading, numeric
    above = [k for k in rows if k < numeric]
    alike = [k for k in above if len(rows[k]) == len(rows[numeric]) and not any(map(_is_number, rows[k]))]
    block = [*takewhile(rows.__contains__, range(max(above, default=0), -1, -1))]
    # with most of the stated headings, the first of those behind the last blank line
    alike.sort(key=lambda k: (-sum(parted(text)[0] in lines[k] for text in stated.values()), k not in block))
    return (alike or above[-1:] or [numeric])[0], numeric


def read_columns(table: Table, columns: Mapping[str, Column], kind: Kind, max_damaged: float = 0.0) -> Rows:
    """Rows of the columns, NaN where there is no number.

    max_damaged : fraction of rows that may be left out, 0: all have as many fields as the headings, and text is NaN
    """
    fields, strict = len(table.headings), not max_damaged
    lines: list[int] = []
    damaged: dict[int, str] = {}
    texts: dict[str, list[str]] = {key: [] for key in columns}
    for line, row in table.rows(table.below if strict else table.start):
        if len(row) > fields or (strict and len(row) < fields):
            damaged[len(lines)] = f"{len(row)} fields under {fields} headings"
        lines.append(line)
        for key, column in columns.items():
            texts[key].append(row[column.place] if column.place < len(row) else "")
    marks = {column.heading: texts[key] for key, column in columns.items() if key in kind.quantities}
    time = texts["time"] if "time" in kind.quantities and "time" in columns else []
    if stamped := any(map(STAMP.fullmatch, time)):
        del marks[columns["time"].heading]
    notes = _without_thousands(marks)
    with_one = {k: column for k, column in columns.items() if column.multiple not in (None, 1.0)}
    notes += [f"{c.heading}: one of {k} is {c.multiple:g} {c.unit}" for k, c in with_one.items()]
    if time:
        texts["time"] = _seconds(time, columns["time"], kind.quantities["time"].units)
    read = {key: _numbers(texts[key]) for key in columns if key in kind.quantities}
    for key, (_, is_text) in read.items():
        for k in () if strict else np.flatnonzero(is_text):
            damaged.setdefault(int(k), f"{columns[key].heading} = {texts[key][k][:20]!r}")
    first = f"line {lines[min(damaged)]}: {damaged[min(damaged)]}" if damaged else ""
    with naming(table.path):
        if not lines:
            raise ValueError("no rows; allowed: a line of headings and one line per row")
        if len(damaged) > max_damaged * len(lines):
            few = f" ({len(damaged)} of {len(lines)} rows are damaged, at most {100.0 * max_damaged:g} % are left out)"
            end = few * (not strict) + f"; {COMMAS}" * (table.separator == "," and "fields under" in first)
            raise ValueError(f"{first}; allowed: a number, or an empty field, under each heading{end}")
        _check_marks(table, marks, lines)
    kept = np.delete(np.arange(len(lines)), list(damaged))
    units = {key: column.unit for key, column in columns.items()} | ({"time": CLOCK} if stamped else {})
    values = {k: si(x[kept], kind.quantities[k], units[k], columns[k].multiple) for k, (x, _) in read.items()}
    return Rows(lines, texts, values, (len(damaged), first), notes)


def read_rows(path: Path | str) -> list[dict[str, str]]:
    """Rows by heading, as texts; columns of numbers with decimal points."""
    table = open_table(path, ANY)
    columns = {text: Column(place, text, "") for place, text in enumerate(table.headings)}
    with naming(path):
        if len(columns) < len(table.headings):
            raise ValueError("columns given twice; allowed: each heading once")
        lines, texts, *_ = read_columns(table, columns, ANY)
        numbers = {key: fields for key, fields in texts.items() if _numeric(fields)}
        _check_marks(table, numbers, lines)
    texts |= {key: [text.replace(",", ".") for text in fields] for key, fields in numbers.items()}
    return [dict(zip(texts, row, strict=True)) for row in zip(*texts.values(), strict=True)]


def _seconds(texts: list[str], column: Column, units: Mapping[str, tuple[float, float]]) -> list[str]:
    """Times of day, which may pass midnight, as seconds; whole numbers that a float would round less the first."""
    stamps = [(row, stamp.groups()) for row, text in enumerate(texts) if (stamp := STAMP.fullmatch(text))]
    if not stamps:
        first = next((int(text) for text in texts if text.isdigit()), 0)
        low, high = 1e9, 1e11  # s since 1970, 1601 or the year 1
        if first * units[column.unit][0] * (column.multiple or 1.0) > high:
            likely = [unit for unit, (one, _) in units.items() if low <= first * one <= high]
            remedy = column.option("time", (*likely, "UNIT")[0])
            raise ValueError(f"time = {first} {column.unit}; allowed: <= {high:g} s; likely {remedy}")
        first = first if first > 2**53 else 0
        return [str(int(text) - first) if first and text.isdigit() else text for text in texts]
    results, days, before = list(texts), 0, 0.0
    for row, (_, hour, minute, second, half) in stamps:
        hours = int(hour or 0) if half is None else int(hour or 0) % 12 + 12 * (half.lower() == "pm")
        time = 3600 * hours + 60 * int(minute) + float(re.sub("[,:;]", ".", second))
        # without hours it begins again each hour
        period = 3600.0 if hour is None else 86400.0
        days, before = days + (time < before - 0.5 * period), time
        results[row] = f"{time + days * period:.9f}"
    return results


def _without_thousands(columns: dict[str, list[str]]) -> list[str]:
    """Remove the marks of thousands in columns, by heading, that can only be read so; notes on them."""
    joined = {heading: "\n".join(["", *texts, ""]) for heading, texts in columns.items()}
    notes = []
    for mark, point in ((r"\.", ","), (",", r"\."), ("[ '\u2019\u00a0\u202f]", "[.,]")):
        group = rf"[+-]?[1-9]\d{{0,2}}(?:{mark}\d{{3}})"
        decimal = rf"\n[+-]?(?![1-9]\d{{0,2}}{point}\d{{3}}\n)\d*{point}\d*\n"
        marked = {heading: text for heading, text in joined.items() if re.search(mark, text)}
        if any(re.search(rf"\n(?!{group}+(?:{point}\d*)?\n)[^\n]*{mark}", text) for text in marked.values()):
            continue  # it is a decimal mark
        # 1.234.567 or 1.234,5
        two = rf"\n{group}(?:{mark}|{point})"
        sure = {key for key, text in marked.items() if mark[0] == "[" or re.search(two, text)}
        others = sure or any(re.search(decimal, joined[key]) for key in joined.keys() - marked.keys())
        for heading, text in marked.items():
            # whole numbers below 1000 without a mark, no larger ones
            whole = others and re.search(r"\n[+-]?[1-9]\d\d\n", text) and not re.search(point, text)
            if (heading in sure or whole) and not re.search(rf"\n[+-]?\d{{4,}}(?:\n|{point})", text):
                first = next(number for number in columns[heading] if re.search(mark, number))
                columns[heading][:] = [re.sub(mark, "", number) for number in columns[heading]]
                notes.append(f"thousands are marked: {heading} = '{first}' is {re.sub(mark, '', first)}")
    return notes


def _numbers(texts: Sequence[str]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Values of fields, NaN where one is missing or text, and where it is text."""
    values = np.array([float(x.replace(",", ".")) if _is_number(x) else np.nan for x in texts])
    is_text = np.isnan(values) & np.array([x.lower() not in MISSING for x in texts], dtype=bool)
    return np.where(np.isfinite(values), values, np.nan), is_text


_EXPONENT = r"(?:[eE][+-]?\d+)?"
#: numbers by what their marks can be: a group of thousands or decimals, decimals, thousands, none
_FORMS = {
    form: re.compile(rf"\n([+-]?(?:{pattern}))(?=\n)")
    for form, pattern in {
        "thousands": "\\d{1,3}(?:[ '\u2019\u00a0\u202f]\\d{3})+(?:[.,]\\d*)?|\\d{1,3}(?:[.,]\\d{3})+[.,]\\d+",
        ".group": r"[1-9]\d{0,2}\.\d{3}",
        ",group": r"[1-9]\d{0,2},\d{3}",
        ".": rf"(?![1-9]\d{{0,2}}\.\d{{3}}\n)(?=\.?\d)\d*\.\d*{_EXPONENT}",
        ",": rf"(?![1-9]\d{{0,2}},\d{{3}}\n)(?=,?\d)\d*,\d*{_EXPONENT}",
        "hundreds": r"[1-9]\d\d",
        "many": r"[1-9]\d{3,}",
    }.items()
}
_NAMES = {".": "point", ",": "comma"}


def _check_marks(table: Table, columns: Mapping[str, Sequence[str]], lines: Sequence[int]) -> None:
    """ValueError: a number of a column, its fields by heading, can be read in two ways, with both."""
    first = {}  # number of each form, by column
    for heading, texts in columns.items():
        joined = "\n".join(["", *texts, ""])
        for form, pattern in _FORMS.items():
            if (form[0] not in _NAMES or form[0] in joined) and (match := pattern.search(joined)):
                first[heading, form] = match[1]
    comma, forms = table.separator == ",", {form for _, form in first}
    marked = {mark: [key for key, number in first.items() if mark in number] for mark in _NAMES}
    problems = []
    if comma:
        problems += [(key, f"; {COMMAS}") for key in marked[","]]
    shown = forms & {*_NAMES}
    if not comma and not shown:
        # columns that are not used show the decimal mark as well
        fields = {text for _, row in islice(table.rows(table.start), HEAD) for text in row}
        shown = {mark for mark in _NAMES if _FORMS[mark].search("\n".join(["", *fields, ""]))}
    decimal, other = (".", ",") if shown == {"."} else (",", ".")
    if marked[other] and (marked[decimal] or decimal in shown):
        problem = (
            f"; allowed in a file with decimal {_NAMES[decimal]}s: no {_NAMES[other]} (thousands or decimal?)"
        )
        problems.append((min(marked[other], key=lambda key: "group" not in key[1]), problem))
    for heading, form in first:
        others = {other for column, other in first if column == heading}
        # whole numbers below 1000 in the column, and no decimals; or no other number in the file
        grouped = "hundreds" in others and not others & {form[0], "many"}
        if form == "thousands":
            problems.append(((heading, form), "; allowed: a number without marks of thousands"))
        elif form.endswith("group") and (grouped or not (comma or forms & {".", ",", "many"})):
            problems.append(((heading, form), " can be read in two ways"))
    for (heading, form), problem in problems[:1]:
        number, readings = first[heading, form], ""
        if form.endswith("group"):
            point, none = number.replace(",", "."), re.sub("[.,]", "", number)
            readings = f", {point} or {none}: export without thousands, with the same decimals in each row"
        line = lines[columns[heading].index(number)]
        raise ValueError(f"line {line}: {heading} = {number!r}{problem}{readings}")
