"""The one reader of tables of numbers: logs, measured torques, operating points and packaged values.

Headings, then a row a line, whose fields pandas reads. Semicolons, tabs, commas, bars or blanks separate them: the mark
that gives most numbers. Blank lines, comments after # or % and Excel's `sep=;` are skipped; if no other line has
headings, a comment directly above the rows is taken for them, as np.savetxt writes it. Lines above the headings are
skipped, but the period of the samples is read there if there is no time. A row of units may be below the headings, a
unit in the fields; headings may repeat. A time may be one of the day, with a date or days. Text is UTF-8, UTF-16 or in
the older encoding that stated headings are found in, else Windows-1252 or Shift-JIS: of so few letters, libraries that
guess an encoding take Chinese for Korean. Decimal marks and those of thousands: `marks`.
"""

import csv
import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from io import StringIO
from itertools import islice, takewhile
from pathlib import Path
from statistics import mode
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .headings import (
    CLOCK,
    LOG,
    ROW,
    TIME,
    Column,
    HeadingError,
    Kind,
    columns_of,
    named_places,
    one_column,
    parted,
    quantity_of,
    si,
)
from .marks import COMMAS, STAMP, check_marks, is_missing, is_number, numbers, seconds, without_thousands

SEPARATORS = (";", "\t", ",", "|", " ")
ENCODINGS = ("cp1252", "cp932", "gb18030", "big5", "cp949", "cp1251", "cp1250")
#: lines looked at for headings and first row, the last of them for the separator;  lines that headings are searched
#: in;  lines of a quoted heading;  shortest and longest period of samples [s]
HEAD, SAMPLE, MAX_LINES, MAX_BREAKS, PERIODS = 2000, 200, 100, 10, (5e-6, 0.05)
#: longest field that may be a number: the patterns take a time that grows with its square
LONGEST = 100
#: a number with its unit
SUFFIXED = re.compile(
    r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?\s*([A-Za-z\u00b5\u03bc\u00b0%][^\d\s]*)"
)
#: TwinCAT Scope heads each channel with a column of time [ms] of this name
SCOPE = "Name"
#: table whose columns are all texts
ANY = Kind({}, {}, "")
#: a line that is no row: blank, of rules, a comment (no error of Excel), Excel's first;  one that ends inside quotes
SKIPPED = re.compile(r"[ \t;,|+=:-]*$|\s*(?:#(?!N/A|N[AU]|VALUE|REF|DIV)|%)|sep=")
OPEN = re.compile(r'(?:^|[;,\t| ])"(?:[^"]|"")*$')
#: names of a period or rate of samples above the headings;  a number behind its unit in brackets, or above one
PERIOD = re.compile(
    r"(?i)(?:sampl|scan|abtast|cycle|task|takt|zyklus)\w*[ _-]*(?:time|zeit|period\w*|interval\w*|rate|freq\w*)?"
    r"|(?:record\w*|trac\w*|acquisition|logging)[ _-]*(?:period|interval|rate|freq\w*)"
    r"|\b(?:period|interval|increment|step|delta[ _]?[xt]|dt)\b"
)
RATE = re.compile(
    r"\s*(?:[\[(]\s*([^\d\s\])]+)\s*[\])])?[^\d\[(]*?((?![1-9]\d{0,2},\d{3}\b)\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)[^\w/]*([^\W\d]+(?:/s\w*)?)?"
)
RATES = {"hz": 1.0, "khz": 1e3, "sps": 1.0, "s/s": 1.0, "sa/s": 1.0, "ks/s": 1e3, "samples/s": 1.0}


@contextmanager
def naming(path: Path | str) -> Iterator[None]:
    """ValueErrors name the file."""
    try:
        yield
    except (ValueError, csv.Error) as error:
        if str(error).startswith(f"{path}: "):
            raise
        raise ValueError(f"{path}: {error}") from error


class Table(NamedTuple):
    """Where a table is: headings, units, start of numbers; columns by quantity, headings not understood.

    repeated: lines of headings and units, which may repeat; below: first line behind the headings or units
    """

    path: Path
    headings: list[str]
    separator: str
    lines: list[str]
    below: int
    start: int
    columns: dict[str, list[Column]]
    problems: list[HeadingError]
    repeated: frozenset[str]

    def rows(self, start: int) -> Iterator[tuple[int, list[str]]]:
        """Line in the file, from 1, and fields of each row; separators at its end are dropped."""
        fields = len(self.headings)
        for place, line in enumerate(islice(self.lines, start, None), start=start + 1):
            if not (SKIPPED.match(line) or line in self.repeated):
                row = _split(line, self.separator)
                while len(row) > fields and not row[-1]:
                    row.pop()
                yield place, row

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


def _lines(path: Path, stated: Collection[str]) -> list[str]:
    """Lines of a file of any encoding; those of a quoted field are joined, blank ones behind it keep the count."""
    remedy = "give a CSV file with a line of headings"
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ValueError(f"cannot be read ({error.strerror}); {remedy}") from error
    wide = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}.get(content[:2])
    for code, begin in (("utf-16-le", 1), ("utf-16-be", 0)):
        # every other byte of digits is 0
        wide = wide or (code if content[begin:HEAD:2].count(0) > len(content[:HEAD]) // 4 else None)
    try:
        text = content.decode(wide or "utf-8-sig", "replace" if wide else "strict")
    except UnicodeDecodeError:
        # Windows-1252 has none of these bytes but the florin sign; katakana begin with it
        usual = "cp932" if re.search(rb"[\x81\x83\x8d\x8f\x90\x9d]", content) else "cp1252"
        names = [parted(heading)[0] for heading in stated if not heading.isascii()]
        texts = (content.decode(code, "replace") for code in (usual, *ENCODINGS))
        good = (text for text in texts if all(name in text for name in names))
        text = next(good, content.decode(usual, "replace"))
    if "\0" in text[:1000]:
        raise ValueError(f"is no text; {remedy}")
    text = text.lstrip("\ufeff").replace("\u2212", "-")
    lines = text.replace("\r\n", "\n").rstrip("\r").replace("\r", "\n").split("\n")
    odd = [k for k, line in enumerate(lines) if line.count('"') % 2] if '"' in text else []
    while len(odd) > 1:
        first, last = odd[:2]
        if joined := bool(OPEN.search(lines[first])) and last - first <= MAX_BREAKS:
            pieces = map(str.strip, lines[first : last + 1])
            lines[first : last + 1] = [" ".join(pieces), *[""] * (last - first)]
        odd = odd[1 + joined :]
    return lines


def _split(line: str, separator: str) -> list[str]:
    """Fields of a line, which may be in quotes."""
    if separator == "|":
        line = line.strip().removeprefix("|").removesuffix("|")
    elif separator == " ":
        line = line.replace("\t", " ").strip()
    if '"' not in line:
        return line.split() if separator == " " else [text.strip() for text in line.split(separator)]
    return [text.strip() for text in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _mark(line: str) -> str:
    """The first of the separators, but blanks, that a line has outside quotes."""
    outside = re.sub('"[^"]*"', "", line)
    return next((mark for mark in SEPARATORS[:-1] if mark in outside), ",")


def _is_value(text: str) -> bool:
    short = len(text) <= LONGEST
    return short and (
        is_number(text) or STAMP.fullmatch(text) is not None or SUFFIXED.fullmatch(text) is not None
    )


def _separator(lines: Sequence[str]) -> tuple[str, int]:
    """The mark that gives most numbers and least texts, and the usual number of fields; "", 0: there are no numbers."""
    best, selection, count = 0, "", 0
    # commas between headings are none of decimals: 20 5,1 are two fields
    headed = any("," in line and not any(map(_is_value, _split(line, ","))) for line in lines)
    for mark in SEPARATORS:
        other = re.compile(("[;\t|,]" if headed else "[;\t|]") if mark == " " else "$^")
        rows = [
            row for line in lines if not other.search(line) and any(map(_is_value, row := _split(line, mark)))
        ]
        score = sum(1 if _is_value(text) else -1 for row in rows for text in row if not is_missing(text))
        if score > best:
            best, selection, count = score, mark, mode(map(len, rows))
    return selection, count


def _fields(line: str, separator: str, count: int) -> list[str]:
    """Fields of a line above the rows, of headings perhaps, which may be a comment and have another separator."""
    line = line.lstrip("\ufeff#% ").rstrip()
    texts = _split(line, separator if separator in line else _mark(line))
    if separator == " " and '"' not in line:
        # blanks in a name or before its unit
        ways = [texts, _split(line, _mark(line)), re.split(r"\s{2,}|\t", line)]
        ways.append(re.split(r"\s+(?![\[(/])(?![^\[(]*[\])])", line))
        texts = next((way for way in ways if len(way) == count), texts)
    return ["time [ms]", *texts[1:]] if texts.count(SCOPE) > 1 and texts[0] == SCOPE else texts


def _numeric(fields: Sequence[str]) -> bool:
    return all(is_number(text) for text in fields if text)


def open_table(path: Path | str, kind: Kind, stated: Mapping[str, str] = {}) -> Table:
    """Find headings, rows and columns; stated: headings with units by quantity, from an option."""
    path = Path(path)
    with naming(path):
        lines = _lines(path, stated.values())
        content = [k for k, line in enumerate(lines[:HEAD]) if not SKIPPED.match(line)]
        separator, count = _separator([lines[k] for k in content[-SAMPLE:]])
        if said := re.match("sep=(.)", lines[0]):
            separator = said[1]
        separator = separator or _mark(lines[content[0]] if content else "")
        comments = [k for k, line in enumerate(lines[:HEAD]) if line.lstrip().startswith(("#", "%"))]
        fields = {k: _fields(lines[k], separator, count) for k in (*comments, *content)}
        periods = _periods(lines, content, fields) if "time" in kind.needed else set()
        counted = periods or parted(stated.get("time", ""))[0] == ROW
        needed = {what: keys for what, keys in kind.needed.items() if not counted or what != "time"}
        heading, first = _heading(fields, content[:MAX_LINES], comments, kind._replace(needed=needed), stated)
        if not 0 <= heading < first < len(lines):
            raise ValueError("no rows; allowed: a line of headings and one line per point")
        row, names = _split(lines[first].rstrip("; \t,"), separator), fields[heading]
        several = [_split(line, separator) for line in lines[first : first + 3]]
        if numbered := separator in "\t " and _row_names(names, several):
            names = ["", *names]
        most = max(2, len(row))
        if len(names) < most and needed and not named_places(names, kind._replace(needed=needed), stated):
            between = {"\t": "tabs", " ": "blanks, each in quotes,"}.get(separator, separator)
            raise ValueError(
                f"no line of headings: {lines[heading][:40]!r}; allowed: {most}, with {between} between"
            )
        for place, text in enumerate(row[: len(names)]):
            if "time" in kind.quantities and STAMP.fullmatch(text):
                names[place] = f"{parted(names[place])[0] or 'time'} [{CLOCK}]"
        # units are in the headings, in a row below them, or behind the numbers
        units = [k for k in content if heading < k < first and not any(map(is_number, fields[k]))]
        behind = [match[1] if (match := SUFFIXED.fullmatch(text[:LONGEST])) else "" for text in row]
        below = [(heading + 1, behind), *((k + 1, [""] * numbered + fields[k]) for k in units)]
        results, errors = [], []
        for line, texts in below:
            try:
                results.append((line, *columns_of(names, kind, stated, texts, periods)))
            except ValueError as error:
                errors.append(error)
        if not results:
            raise errors[-1]
        line, columns, problems = min(results, key=lambda result: len(result[2]))
        _check_counted(columns, [fields[k] for k in content if k >= first][:3])
        repeated = frozenset(lines[k] for k in (heading, *units))
        return Table(path, names, separator, lines, line, first, columns, problems, repeated)


def _check_counted(columns: Mapping[str, Sequence[Column]], rows: Sequence[Sequence[str]]) -> None:
    """ValueError: the period of the samples would be the time, but a first column that is not used may be that."""
    used = {column.place: column.stated for same in columns.values() for column in same}
    begin = [row[0].replace(",", ".") for row in rows if is_number(row[0])]
    if used.get(-1, True) or 0 in used or len(begin) < 3:
        return
    one, two, three = map(float, begin)
    if two > one and math.isclose(three - two, two - one, rel_tol=1e-3) and not math.isclose(two - one, 1.0):
        remedy = f'--column "time=HEADING [UNIT]" if it is, else --column "time={ROW} [UNIT]"'
        raise ValueError(f"the first column may be the time: {one:g}, {two:g}, {three:g}; allowed: {remedy}")


def _row_names(names: Sequence[str], rows: Sequence[Sequence[str]]) -> bool:
    """Whether rows begin with their number, without a heading, as R writes them."""
    counted = all(row[:1] == [str(k)] or row[:1] == [str(k + 1)] for k, row in enumerate(rows))
    return counted and all(len(row) == len(names) + 1 for row in rows)


def _heading(
    fields: Mapping[int, list[str]], content: Sequence[int], comments: Sequence[int], kind: Kind,
    stated: Mapping[str, str],
) -> tuple[int, int]:  # fmt: skip
    """The last line with the needed headings above its first row, and that, -1: none; else where they would be."""
    heading, needed = -1, [0]
    for place in content:
        if places := named_places(fields[place], kind, stated):
            # a row without a time has numbers from its begin on
            counted = "time" in kind.quantities and "time" not in kind.needed
            heading, needed = place, [0] * counted + places
        elif heading >= 0 and max(needed) < len(row := fields[place]):
            usable = [is_missing(row[k]) or _is_value(row[k]) for k in needed]
            if all(usable) and not is_missing(row[needed[0]]):
                return heading, place
    if heading >= 0:
        return heading, heading + 1
    numeric = next((k for k in content if _numeric(fields[k])), -1)
    if numeric < 0:
        heading, numeric, *_ = *content, -1, -1
        return heading, numeric
    above = [k for k in content if k < numeric]
    same = [k for k in fields if k < numeric and len(fields[k]) == len(fields[numeric])]
    alike = [k for k in above if k in same and not any(map(is_number, fields[k]))]
    block = [*takewhile(set(content).__contains__, range(max(above, default=0), -1, -1))]
    # with most of the stated headings, the first of those behind the last blank line
    names = {k: sum(parted(text)[0] in ",".join(fields[k]) for text in stated.values()) for k in alike}
    alike.sort(key=lambda k: (-names[k], k not in block))
    if alike or above:
        return (alike or above[-1:])[0], numeric
    # rows without headings, unless a comment has them
    alike = [k for k in comments if k in same and (not kind.needed or named_places(fields[k], kind, stated))]
    if not alike:
        line = ",".join(fields[numeric])
        raise ValueError(
            f"no line of headings, the first line is {line[:40]!r}; allowed: headings with units"
        )
    return alike[-1], numeric


def _periods(lines: Sequence[str], content: Sequence[int], fields: Mapping[int, list[str]]) -> set[float]:
    """Periods of the samples [s] that the lines above the rows state."""
    first = next((k for k in content if _numeric(fields[k])), 0)
    periods = set()
    for line in lines[:first]:
        if (name := PERIOD.search(line)) and (match := RATE.match(line, name.end())):
            unit = match[1] or match[3] or "s" * name[0].lower().startswith("delta")
            value = float(match[2].replace(",", "."))
            rate = RATES.get(re.sub("/s.*", "/s", unit.lower()), 0.0)
            with suppress(HeadingError):
                factor = 0.0 if rate else TIME[(quantity_of(f"time [{unit}]", LOG) or ("", "h"))[1]][0]
                period = 1.0 / (rate * value) if rate * value else factor * value
                periods |= {period} if PERIODS[0] <= period <= PERIODS[1] else set()
    return periods


class _Body(NamedTuple):
    """Rows of a table: their lines, from 1, fields by place, sizes of those that are uneven, how many were headings."""

    lines: list[int]
    fields: dict[int, list[str]]
    uneven: dict[int, int]
    repeats: int


def _body(table: Table, start: int, places: Collection[int]) -> _Body:
    """Rows from a line on, columns of these places."""
    import pandas as pd

    mark, count = table.separator, len(table.headings)
    lines = [k for k, line in enumerate(table.lines[start:], start) if not SKIPPED.match(line)]
    body = [k for k in lines if table.lines[k] not in table.repeated]
    rows = [table.lines[k] for k in body]
    if mark == "|":
        rows = [row.strip().removeprefix("|").removesuffix("|") for row in rows]
    wide = max((len(row.split()) if mark == " " else row.count(mark) + 1 for row in rows), default=0)
    wide = max(wide, count)
    used = sorted({*places, count - 1, *range(count, wide)} - {-1})
    # a last line has all columns; quotes are marks only if they are in pairs
    text = "\n".join([*rows, mark.join("x" * wide)])
    for quoting in (csv.QUOTE_MINIMAL, csv.QUOTE_NONE):
        with suppress(pd.errors.ParserError):
            frame = pd.read_csv(
                StringIO(text), sep=r"\s+" if mark == " " else mark, header=None, names=range(wide), usecols=used,
                dtype=object, na_filter=False, index_col=False, skipinitialspace=True, skip_blank_lines=False,
                quoting=quoting, low_memory=False,
            )  # fmt: skip
            if len(frame) == len(rows) + 1:
                break
    fields = {place: [text.strip() for text in frame[place].tolist()[:-1]] for place in used}
    # fields are missing at the end, or there are more of them
    extra = {k for place in range(count, wide) for k, text in enumerate(fields[place]) if text}
    sizes = {
        k: len(_split(rows[k], mark)) for k, text in enumerate(fields[count - 1]) if not text or k in extra
    }
    uneven = {k: size for k, size in sorted(sizes.items()) if size < count or k in extra}
    return _Body([k + 1 for k in body], fields, uneven, len(lines) - len(body))


def read_columns(table: Table, columns: Mapping[str, Column], kind: Kind, max_damaged: float = 0.0) -> Rows:
    """Rows of the columns, NaN where there is no number.

    max_damaged: fraction of rows that may be left out, 0: all have as many fields as the headings, and text is NaN
    """
    count, strict = len(table.headings), not max_damaged
    body = _body(table, table.below if strict else table.start, {column.place for column in columns.values()})
    lines, places = body.lines, body.fields | {-1: [*map(str, range(len(body.lines)))]}
    texts = {key: [*places[column.place]] for key, column in columns.items()}
    read = {key: column for key, column in columns.items() if key in kind.quantities}
    with naming(table.path):
        if not lines:
            raise ValueError("no rows; allowed: a line of headings and one line per row")
        for key, column in read.items():
            _without_units(texts[key], key, column, kind)
        stamped = "time" in read and any(STAMP.fullmatch(text) for text in texts["time"] if ":" in text)
        marked = {column.heading: texts[key] for key, column in read.items() if key != "time" or not stamped}
        notes = without_thousands(marked) + _notes(read, body.repeats)
        if "time" in read:
            texts["time"] = seconds(texts["time"], read["time"], kind.quantities["time"].units)
        result = {key: numbers(texts[key]) for key in read}
        # a blank field may be missing anywhere between blanks
        sizes = {k: n for k, n in body.uneven.items() if n > count or strict or table.separator == " "}
        damaged = {k: f"{size} fields under {count} headings" for k, size in sizes.items()}
        for key, (_, is_text) in {} if strict else result.items():
            for k in np.flatnonzero(is_text):
                damaged.setdefault(int(k), f"{columns[key].heading} = {texts[key][k][:20]!r}")
        first = f"line {lines[min(damaged)]}: {damaged[min(damaged)]}" if damaged else ""
        if len(damaged) > max_damaged * len(lines):
            few = f" ({len(damaged)} of {len(lines)} rows are damaged, at most {100.0 * max_damaged:g} % are left out)"
            end = few * (not strict) + f"; {COMMAS}" * (table.separator == "," and "fields under" in first)
            raise ValueError(f"{first}; allowed: a number, or an empty field, under each heading{end}")
        others = (text for _, row in islice(table.rows(table.start), HEAD) for text in row)
        check_marks(marked, lines, table.separator == ",", others)
    kept = np.delete(np.arange(len(lines)), list(damaged))
    units = {key: column.unit for key, column in read.items()} | ({"time": CLOCK} if stamped else {})
    values = {
        k: si(x[kept], kind.quantities[k], units[k], columns[k].multiple) for k, (x, _) in result.items()
    }
    return Rows(lines, texts, values, (len(damaged), first), notes)


def _notes(columns: Mapping[str, Column], repeats: int) -> list[str]:
    """What is to be said: a number before a unit, the time of rows, headings that repeat."""
    with_one = {
        k: column for k, column in columns.items() if column.multiple not in (None, 1.0) and column.place >= 0
    }
    notes = [f"{c.heading}: one of {k} is {c.multiple:g} {c.unit}" for k, c in with_one.items()]
    if "time" in columns and (time := columns["time"]).place < 0:
        above = "" if time.stated else ", the period stated above the headings"
        notes.append(f"no column of time: a row each {time.multiple or 1.0:.6g} {time.unit}{above}")
    return notes + [f"headings repeat {repeats} times: skipped"] * (repeats > 0)


def _without_units(texts: list[str], key: str, column: Column, kind: Kind) -> None:
    """Remove the unit behind the numbers of a column; ValueError: its heading has another."""
    first = next((text for text in texts if not is_missing(text)), "")
    if not (match := SUFFIXED.fullmatch(first[:LONGEST])):
        return
    with suppress(HeadingError):
        _, unit = quantity_of(f"{kind.quantities[key].names[0]} [{match[1]}]", kind) or ("", "")
        known = kind.quantities[key].units
        if known[unit] != known[column.unit] or column.multiple is not None:
            heading = f"unit {match[1]!r} behind the numbers, {column.unit} in the heading"
            raise ValueError(f"{column.heading} = {first!r}: {heading}; allowed: one unit")
        end = re.compile(rf"\s*{re.escape(match[1])}")
        texts[:] = [
            text[: result.start()] if (result := end.search(text)) and result.end() == len(text) else text
            for text in texts
        ]


def read_rows(path: Path | str) -> list[dict[str, str]]:
    """Rows by heading, as texts; columns of numbers with decimal points."""
    table = open_table(path, ANY)
    columns = {text: Column(place, text, "") for place, text in enumerate(table.headings)}
    with naming(path):
        if len(columns) < len(table.headings):
            raise ValueError("columns given twice; allowed: each heading once")
        lines, texts, *_ = read_columns(table, columns, ANY)
        numeric = {key: fields for key, fields in texts.items() if _numeric(fields)}
        check_marks(
            numeric, lines, table.separator == ",", [text for fields in texts.values() for text in fields]
        )
    texts |= {key: [text.replace(",", ".") for text in fields] for key, fields in numeric.items()}
    return [dict(zip(texts, row, strict=True)) for row in zip(*texts.values(), strict=True)]
