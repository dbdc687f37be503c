"""One CSV dialect: headings in a comment, marks of thousands, decimal commas that begin late."""

import pytest

from ballscrew_tehl.tables.csv_file import Numbers, open_table, read_rows

HEAD = "preload [N];speed [r/min];torque [Nm]\n"


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "first"),
    [
        ("# preload_n,speed_rpm\n1000,100\n2000,500\n", {"preload_n": "1000", "speed_rpm": "100"}),
        ("# bench 3\n# preload_n;speed_rpm\n1,5;100\n2;500\n", {"preload_n": "1.5", "speed_rpm": "100"}),
        # the line of headings, not the comment that has as many fields
        ("# 7, 8\npreload_n,speed_rpm\n1000,100\n", {"preload_n": "1000", "speed_rpm": "100"}),
        # three decimals everywhere, but 0.500 is no group of thousands
        ("a;b\n1.234;0.500\n", {"a": "1.234", "b": "0.500"}),
        # 1500 shows that thousands have no mark
        ("a;b\n1.234;1500\n", {"a": "1.234", "b": "1500"}),
        ('a,b\n" 1.5 ",x\n', {"a": "1.5", "b": "x"}),
    ],
)
def test_is_read(tmp_path, text, first):
    assert read_rows(write(tmp_path / "x.csv", text))[0] == first


REFUSED = [
    (HEAD + "1.500;100;1,25\n", "no point (thousands or decimal?), 1.500 or 1500"),
    (HEAD + "1,500;100;1.25\n", "no comma (thousands or decimal?), 1.500 or 1500"),
    (HEAD + "1.500;100;1.250\n", "preload [N] = '1.500' can be read in two ways, 1.500 or 1500"),
    # whole numbers below 1000 in the column: the marks are those of thousands, though 0.4 has a point
    (HEAD + "1.500;100;0.4\n800;100;0.4\n", "line 2: preload [N] = '1.500' can be read in two ways"),
    ("preload [um],b\n" + "1.500,100\n800,0.4\n", "can be read in two ways, 1.500 or 1500"),
    (HEAD + "1.234.567;100;0.4\n", "'1.234.567'; allowed: a number without marks of thousands"),
    (HEAD + "1 500;100;0.4\n", "'1 500'; allowed: a number without marks of thousands"),
    (
        HEAD + "1500;100;0.4\n1500;100;0,4\n",
        "torque [Nm] = '0.4'; allowed in a file with decimal commas: no point",
    ),
    ('a,b\n"0,4",1\n', "numbers with decimal commas need semicolons between the fields"),
    ("1000,100\n2000,500\n", "no line of headings, the first line is '1000,100'"),
    ("\n# only\n", "no rows; allowed: a line of headings"),
]


@pytest.mark.parametrize(("text", "message"), REFUSED)
def test_numbers_that_can_be_read_in_two_ways_are_refused(tmp_path, text, message):
    with pytest.raises(ValueError, match=r"x\.csv") as caught:
        read_rows(write(tmp_path / "x.csv", text), lambda heading: True)
    assert message in str(caught.value)


def test_marks_of_all_pieces_of_a_column_count(tmp_path):
    """Whole numbers in the first piece, decimal commas later, points last."""
    numbers = Numbers(open_table(write(tmp_path / "x.csv", HEAD + "1;2;3\n")))
    assert list(numbers.add(0, [2, 3], ["1", "2"])[0]) == [1.0, 2.0]
    assert list(numbers.add(0, [4, 5], ["2,5", "-"])[0][:1]) == [2.5]
    numbers.check()
    numbers.add(2, [6], ["0.5"])
    with pytest.raises(
        ValueError, match=r"line 6: torque \[Nm\] = '0\.5'; allowed in a file with decimal commas"
    ):
        numbers.check()
