"""Numbers of a column as they are written: missing ones, decimal marks, marks of thousands, times of day.

Numbers have a decimal point, or a decimal comma unless commas separate the fields, the same in the whole file. Marks of
thousands are removed where the file shows them, as 1.234.567, 1.234,5, or 1.234 beside 999 in a file with decimal
commas; a file whose numbers can be read in two ways is refused.
"""

import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from .headings import Column

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
#: what stands for a missing value; eof: last line of exports
MISSING = re.compile(
    r"(?i)|[-+]?(nan|inf|infinity|1\.#\w+)|null?|nil|none|<?n/?a>?|#\S*|-+|\.+|\?+|missing|invalid|eof"
)
#: date or days, time of day in parts of 60 and a fraction, AM or PM, time zone
STAMP = re.compile(
    r"(?:(\d{1,4}([-./])\d\d?\2\d{1,4}[T ]|-?\d+ days?,?)\s*)?(?:(\d\d?):)?(\d\d?):(\d\d(?:[.,]\d+|[:;]\d{3})?)"
    r"\s*([ap]m)?(?:z|utc|[+-]\d\d:?\d\d)?",
    re.IGNORECASE,
)
COMMAS = "numbers with commas, decimal or of thousands, need semicolons between the fields"
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


def is_number(text: str) -> bool:
    """Whether a field is a number, with a decimal point or comma."""
    return NUMBER.fullmatch(text.replace(",", ".")) is not None


def is_missing(text: str) -> bool:
    """Whether a field is empty or a word for a missing value."""
    return MISSING.fullmatch(text) is not None


def numbers(texts: Sequence[str]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Values of fields, NaN where one is missing or text, and where it is text."""
    import pandas as pd

    plain = [text.replace(",", ".") for text in texts]
    result = pd.to_numeric(pd.Series(plain, dtype=object), errors="coerce").to_numpy(np.float64)
    good, values = np.isfinite(result), np.full(len(plain), np.nan)
    # float rounds correctly
    values[good] = list(map(float, plain if good.all() else np.array(plain, dtype=object)[good]))
    is_text = np.zeros(len(plain), dtype=bool)
    is_text[~good] = [not (is_missing(plain[k]) or is_number(plain[k])) for k in np.flatnonzero(~good)]
    return values, is_text


def without_thousands(columns: dict[str, list[str]]) -> list[str]:
    """Remove the marks of thousands in columns, by heading, that can only be read so; notes on them."""
    joined = {heading: "\n".join(["", *texts, ""]) for heading, texts in columns.items()}
    notes = []
    for mark, point in ((r"\.", ","), (",", r"\."), ("[ '\u2019\u00a0\u202f]", "[.,]")):
        for heading in _of_thousands(mark, point, joined):
            first = next(number for number in columns[heading] if re.search(mark, number))
            columns[heading][:] = [re.sub(mark, "", number) for number in columns[heading]]
            notes.append(f"thousands are marked: {heading} = '{first}' is {re.sub(mark, '', first)}")
    return notes


def _of_thousands(mark: str, point: str, joined: Mapping[str, str]) -> list[str]:
    """Headings of the columns in which a mark can only be that of thousands; joined: their fields, a line each."""
    group = rf"[+-]?[1-9]\d{{0,2}}(?:{mark}\d{{3}})"
    decimal = rf"\n[+-]?(?![1-9]\d{{0,2}}{point}\d{{3}}\n)\d*{point}\d*\n"
    marked = {heading: text for heading, text in joined.items() if re.search(mark, text)}
    if any(re.search(rf"\n(?!{group}+(?:{point}\d*)?\n)[^\n]*{mark}", text) for text in marked.values()):
        return []  # it is a decimal mark
    # 1.234.567 or 1.234,5
    two = rf"\n{group}(?:{mark}|{point})"
    sure = {key for key, text in marked.items() if mark[0] == "[" or re.search(two, text)}
    others = sure or any(re.search(decimal, joined[key]) for key in joined.keys() - marked.keys())
    # whole numbers below 1000 without a mark, no larger ones
    sure |= {
        key
        for key, text in marked.items()
        if others and re.search(r"\n[+-]?[1-9]\d\d\n", text) and not re.search(point, text)
    }
    return [
        key for key in marked if key in sure and not re.search(rf"\n[+-]?\d{{4,}}(?:\n|{point})", joined[key])
    ]


def check_marks(
    columns: Mapping[str, Sequence[str]], lines: Sequence[int], comma: bool, others: Iterable[str]
) -> None:
    """ValueError: a number of a column, its fields by heading, can be read in two ways, with both.

    lines: of the rows in the file; comma: it separates the fields; others: fields of the other columns as well
    """
    first = _first_of_forms(columns)
    shown = {form for _, form in first} & {*_NAMES}
    if not comma and not shown:
        # columns that are not used show the decimal mark as well
        joined = "\n".join(["", *others, ""])
        shown = {mark for mark in _NAMES if _FORMS[mark].search(joined)}
    for (heading, form), problem in [*_marked(first, comma, shown), *_grouped(first, comma)][:1]:
        number, readings = first[heading, form], ""
        if form.endswith("group"):
            point, none = number.replace(",", "."), re.sub("[.,]", "", number)
            readings = f", {point} or {none}: export without thousands, with the same decimals in each row"
        line = lines[columns[heading].index(number)]
        raise ValueError(f"line {line}: {heading} = {number!r}{problem}{readings}")


def _first_of_forms(columns: Mapping[str, Sequence[str]]) -> dict[tuple[str, str], str]:
    """The first number of each form, by column and form."""
    first = {}
    for heading, texts in columns.items():
        joined = "\n".join(["", *texts, ""])
        for form, pattern in _FORMS.items():
            if (form[0] not in _NAMES or form[0] in joined) and (match := pattern.search(joined)):
                first[heading, form] = match[1]
    return first


Problem = tuple[tuple[str, str], str]


def _marked(first: Mapping[tuple[str, str], str], comma: bool, shown: set[str]) -> list[Problem]:
    """Commas between commas, and both decimal marks in a file."""
    marked = {mark: [key for key, number in first.items() if mark in number] for mark in _NAMES}
    problems = [(key, f"; {COMMAS}") for key in marked[","] if comma]
    decimal, other = (".", ",") if shown == {"."} else (",", ".")
    if marked[other] and (marked[decimal] or decimal in shown):
        allowed = f"a file with decimal {_NAMES[decimal]}s: no {_NAMES[other]} (thousands or decimal?)"
        problems.append(
            (min(marked[other], key=lambda key: "group" not in key[1]), f"; allowed in {allowed}")
        )
    return problems


def _grouped(first: Mapping[tuple[str, str], str], comma: bool) -> Iterable[Problem]:
    """Marks of thousands, and what may be one."""
    forms = {form for _, form in first}
    for heading, form in first:
        others = {other for column, other in first if column == heading}
        # whole numbers below 1000 in the column, and no decimals; or no other number in the file
        grouped = "hundreds" in others and not others & {form[0], "many"}
        if form == "thousands":
            yield (heading, form), "; allowed: a number without marks of thousands"
        elif form.endswith("group") and (grouped or not (comma or forms & {".", ",", "many"})):
            yield (heading, form), " can be read in two ways"


def seconds(texts: list[str], column: Column, units: Mapping[str, tuple[float, float]]) -> list[str]:
    """Times of day, which may pass midnight, as seconds; whole numbers that a float would round less the first."""
    stamps = [
        (row, stamp) for row, text in enumerate(texts) if ":" in text and (stamp := STAMP.fullmatch(text))
    ]
    if not stamps:
        first = next((int(text) for text in texts if text.isdigit()), 0)
        low, high = 1e9, 1e11  # s since 1970, 1601 or the year 1
        if first * units[column.unit][0] * (column.multiple or 1.0) > high:
            likely = [unit for unit, (one, _) in units.items() if low <= first * one <= high]
            remedy = column.option("time", (*likely, "UNIT")[0])
            raise ValueError(f"time = {first} {column.unit}; allowed: <= {high:g} s; likely {remedy}")
        first = first if first > 2**53 else 0
        return [str(int(text) - first) if first and text.isdigit() else text for text in texts]
    results, days, before, date = list(texts), 0, 0.0, stamps[0][1][1]
    for row, stamp in stamps:
        day, _, hour, minute, second, half = stamp.groups()
        hours = int(hour or 0) if half is None else int(hour or 0) % 12 + 12 * (half.lower() == "pm")
        time = 3600 * hours + 60 * int(minute) + float(re.sub("[,:;]", ".", second))
        # without hours it begins again each hour
        period = 3600.0 if hour is None else 86400.0
        days, before, date = days + (time < before - 0.5 * period or day != date), time, day
        results[row] = f"{time + days * period:.9f}"
    return results
