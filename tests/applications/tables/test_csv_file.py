"""One CSV dialect: headings in a comment or below other lines, marks of thousands, decimal commas that begin late."""

import numpy as np
import pytest

from ballscrew_tehl.applications.tables.csv_file import open_table, read_columns, read_rows
from ballscrew_tehl.applications.tables.headings import LOG, TORQUES

HEAD = "preload [N];speed [r/min];torque [Nm]\n"


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


#: text, fields of the first row
READ = [
    ("# bench 3\n# preload_n;speed_rpm\n1,5;100\n2;500\n", ["1.5", "100"]),
    # the line of headings, not the comment that has as many fields
    ("# 7, 8\npreload_n,speed_rpm\n1000,100\n", ["1000", "100"]),
    # three decimals everywhere, but 0.500 is no group of thousands
    ("a;b\n1.234;0.500\n", ["1.234", "0.500"]),
    # 1500 shows that thousands have no mark
    ("a;b\n1.234;1500\n", ["1.234", "1500"]),
    ("a,b\n20 5,1\n", ["20 5", "1"]),
    ('"a; b",c\n" \u22121.5 ",x\n', ["-1.5", "x"]),
]


def test_is_read(tmp_path):
    for text, first in READ:
        assert [*read_rows(write(tmp_path / "x.csv", text))[0].values()] == first


REFUSED = [
    (HEAD + "1.500;100;1,25\n", "no point (thousands or decimal?), 1.500 or 1500"),
    (HEAD + "1,500;100;1.25\n", "no comma (thousands or decimal?), 1.500 or 1500"),
    # the column that is not used shows the decimal mark
    (
        "preload [N];speed [r/min];torque [Nm];x\n1.500;1000;2;0,5\n",
        "no point (thousands or decimal?), 1.500 or 1500",
    ),
    (
        "preload [N];speed [r/min];torque [Nm];x\n1,500;1000;2;0.5\n",
        "no comma (thousands or decimal?), 1.500 or 1500",
    ),
    (HEAD + "1.500;100;1.250\n", "preload [N] = '1.500' can be read in two ways, 1.500 or 1500"),
    # whole numbers below 1000 in the column: the marks are those of thousands, though 0.4 has a point
    (HEAD + "1.500;100;0.4\n800;100;0.4\n", "line 2: preload [N] = '1.500' can be read in two ways"),
    (
        HEAD + "1;2;3\n" * 3 + "2,5;-;3\n1;1;0.5\n",
        "line 6: torque [Nm] = '0.5'; allowed in a file with decimal commas",
    ),
    # decimal commas that begin late, thousands marked in a part of the numbers
    (
        HEAD + "1.5;100;0.123\n" * 50 + "1,234;100;0,123\n",
        "line 2: preload [N] = '1.5'; allowed in a file with decimal",
    ),
    (HEAD + "1.234;100;4\n" * 50 + "1,234;100;4\n", "no point (thousands or decimal?), 1.234 or 1234"),
    (HEAD + "1.000,5;60;0,4\n1000,5;60;0,4\n", "preload [N] = '1.000,5'; allowed in a file with decimal"),
    (
        HEAD.replace(";", ",") + '1,60,"0,4"\n',
        "numbers with commas, decimal or of thousands, need semicolons between the fields",
    ),
    (
        HEAD.replace(";", ",") + "1,60,4\n1,0,60,0,4\n",
        "line 3: 5 fields under 3 headings; allowed: a number, or an empty field",
    ),
    ("1000,100,3\n2000,500,3\n", "no line of headings, the first line is '1000,100,3'"),
    ("\n# only\n", "no rows; allowed: a line of headings"),
    (HEAD, "no rows; allowed: a line of headings"),
]


def test_numbers_that_can_be_read_in_two_ways_are_refused(tmp_path):
    for text, message in REFUSED:
        path = write(tmp_path / "x.csv", text)
        with pytest.raises(ValueError, match=r"x\.csv: ") as caught:  # noqa: PT012
            table = open_table(path, TORQUES)
            read_columns(table, table.single_columns(), TORQUES)
        assert message in str(caught.value)


#: head, first field, the number
THOUSANDS = [
    (HEAD, ("1 500;100;0.4", "800;100;0.4"), 1500.0),
    (HEAD, ("1.000,5;60;0,4",), 1000.5),
    (HEAD, ("1'234'567.5;60;0.4",), 1234567.5),
    (HEAD, ("1.234.567;60;4", "2.500;60;4", "800;60;4"), 1234567.0),
    (HEAD, ("1.500;60;0,4", "800;60;0,4"), 1500.0),
    (HEAD.replace(";", ","), ('"1,500",60,0.4', "800,60,0.4"), 1500.0),
]


def test_thousands_that_the_file_shows_are_read_and_said(tmp_path):
    for head, rows, value in THOUSANDS:
        table = open_table(write(tmp_path / "x.csv", head + "\n".join(rows)), TORQUES)
        found = read_columns(table, table.single_columns(), TORQUES)
        assert found.values["preload"][0] == value
        assert found.notes[0].startswith("thousands are marked: preload [N] = '1")


def test_a_first_row_that_is_no_measurement_is_a_row(tmp_path):
    for first in ("1_000;60;0.4", "x;60;0.4"):
        table = open_table(write(tmp_path / "x.csv", f"{HEAD}{first}\n1000;60;0.4\n"), TORQUES)
        assert read_columns(table, table.single_columns(), TORQUES).lines == [2, 3]


ROWS = np.array([(0.0, 5.0, 0.25), (0.001, 5.5, -0.5), (0.002, 5.0, 0.75), (0.003, 4.0, 0.5)])
HEADINGS = "time [s],position [deg],torque [N.m]"
CHINESE = {"time": "\u6642 [s]", "position": "\u89d2 [deg]", "torque": "\u529b [N.m]"}
#: lines above the rows, form of a row, stated headings, encoding, field for the position of the second row
LOGS = [
    ('"time\n[s]","position [deg]","torque\n[N.m]"', "{},{},{}", {}, "utf-8", ""),
    ("# time [s], position [deg], torque [N m]", "{:.9e} {:.9e} {:.9e}", {}, "utf-8", ""),
    ("  time [s]   position [deg]  torque [N.m]", "{:>9}{:>9}{:>9}", {}, "utf-8", ""),
    ("|time [s]|position [deg]|torque [N.m]|\n|--:|---|:--|", "| {} | {} | {} |", {}, "utf-8", ""),
    ("time,position,torque", "{} sec,{} deg,{} Nm", {}, "utf-8", ""),
    ("time,position [deg],torque [N.m]", "0 days 00:00:0{:.6f},{},{}", {}, "utf-8", ""),
    ("#Sampling period is 1000000 nSec\nposition [deg];torque [N.m]", "{1};{2}", {}, "utf-8", ""),
    ("Sampling rate [kHz];1\nposition [deg];torque [N.m]", "{1};{2}", {}, "utf-8", ""),
    ("position [deg];torque [N.m]", "{1};{2}", {"time": "row [1 ms]"}, "utf-8", ""),
    ("%" + HEADINGS, "{},{},{}", {}, "utf-8", ""),
    *(
        (",".join(CHINESE.values()), "{},{},{}", CHINESE, code, "")
        for code in ("gbk", "cp949", "big5", "utf-16-be")
    ),
    *((HEADINGS, "{},{},{}", {}, "utf-8", word) for word in ("#N/A", "None", "---", "1.#INF", "n/a", "<NA>")),
]


@pytest.mark.parametrize("log", LOGS)
def test_logs_as_tools_write_them(tmp_path, log):
    head, form, stated, encoding, word = log
    rows, expected = [form.format(*row) for row in ROWS.tolist()], ROWS * [1.0, np.pi / 180.0, 1.0]
    if word:
        rows[1], expected[1, 1] = rows[1].replace("5.5", word), np.nan
    # the headings repeat
    text = "\n".join([head, *rows[:2], head.splitlines()[-1] if '"' not in head else "", *rows[2:]])
    (tmp_path / "x.csv").write_bytes(text.encode(encoding))
    table = open_table(tmp_path / "x.csv", LOG, stated)
    values = read_columns(table, table.single_columns(), LOG, 0.01).values
    found = np.column_stack([values[key] for key in ("time", "position", "torque")])
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_number_before_a_unit_is_said_or_is_no_range(tmp_path):
    for unit, factor in (("469.7 N", 469.7), ("0.04 N", 0.04), ("0.5 kN", None)):
        path = write(tmp_path / "x.csv", HEAD.replace("[N]", f"[{unit}]") + "2;60;0.5\n")
        if factor is None:
            with pytest.raises(ValueError, match=r"may be the range of the sensor"):
                open_table(path, TORQUES).single_columns()
        else:
            table = open_table(path, TORQUES)
            found = read_columns(table, table.single_columns(), TORQUES)
            assert found.values["preload"][0] == 2.0 * factor
            assert f"is {factor:g} N" in found.notes[0]
