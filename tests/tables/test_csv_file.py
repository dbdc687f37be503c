"""One CSV dialect: headings in a comment or below other lines, marks of thousands, decimal commas that begin late."""

import pytest

from ballscrew_tehl.tables.csv_file import open_table, read_columns, read_rows
from ballscrew_tehl.tables.headings import TORQUES

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
