"""Operating points from options and CSV; results as JSON and table."""

import json
import math

import numpy as np
import pytest

from ballscrew_tehl.cli.main import Parser
from ballscrew_tehl.cli.points import Quantity, add_options, plain, print_results, read_points, table

PRELOAD = Quantity("preload_n", "preload", least=0.0)
SPEED = Quantity("speed_rpm", "speed", not_zero=True)
LOAD = Quantity("axial_load_n", "load", default=0.0)
QUANTITIES = (PRELOAD, SPEED, LOAD)


def points(*arguments):
    parser = Parser(prog="test")
    add_options(parser, QUANTITIES)
    return read_points(parser.parse_args(arguments), QUANTITIES)


@pytest.fixture
def csv_file(tmp_path):
    def write(text):
        path = tmp_path / "points.csv"
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


def test_one_point_from_options():
    assert points("--preload-n", "1e3", "--speed-rpm", "-5") == [
        {"preload_n": 1000.0, "speed_rpm": -5.0, "axial_load_n": 0.0}
    ]


def test_options_fill_what_the_file_leaves_out(csv_file):
    path = csv_file("# comment\npreload_N, axial_load_n\n1000,\n2000,-30\n")
    assert points("--points", path, "--speed-rpm", "100", "--axial-load-n", "7") == [
        {"preload_n": 1000.0, "speed_rpm": 100.0, "axial_load_n": 7.0},
        {"preload_n": 2000.0, "speed_rpm": 100.0, "axial_load_n": -30.0},
    ]


def test_headings_with_units_and_decimal_commas_are_read_as_by_calibrate(csv_file):
    path = csv_file("preload [kN];Speed [rad/s];axial_load_n\n1,5;10,5;-3\n0,2;-1;0\n")
    first, second = points("--points", path)
    assert abs(first["preload_n"] - 1500.0) <= 1e-9
    assert abs(first["speed_rpm"] - 10.5 * 30.0 / math.pi) <= 1e-9
    assert first["axial_load_n"] == -3.0
    assert abs(second["preload_n"] - 200.0) <= 1e-9
    temperature = (Quantity("temperature_c", "t", least=-73.15, most=200.0),)
    parser = Parser(prog="test")
    add_options(parser, temperature)
    for heading, number in (
        ("temperature [K]", "303.15"),
        ("temperature [degF]", "86"),
        ("temperature_C", "30"),
    ):
        args = parser.parse_args(["--points", csv_file(f"{heading}\n{number}\n")])
        assert abs(read_points(args, temperature)[0]["temperature_c"] - 30.0) <= 1e-9


def test_kelvin_given_as_celsius_is_named():
    temperature = Quantity("temperature_c", "t", least=-73.15, most=200.0)
    assert temperature.checked("t", "200") == 200.0
    with pytest.raises(
        ValueError, match=r"t = 303.15; allowed: -73.15 to 200 degrees Celsius; is 303.15 K = 30 C"
    ):
        temperature.checked("t", "303.15")
    with pytest.raises(ValueError, match=r"t = 900; allowed: -73.15 to 200$"):
        temperature.checked("t", "900")


def test_columns_that_are_not_used_are_reported(csv_file, capsys):
    path = csv_file("preload_n,speed_rpm,measured_nm\n1000,100,0.4\n")
    assert len(points("--points", path)) == 1
    assert capsys.readouterr().err == f"{path}: columns not used: measured_nm\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--speed-rpm", "1"), "--preload-n (missing); allowed: a finite number >= 0, or --points FILE.csv"),
        (("--preload-n", "-2", "--speed-rpm", "1"), "--preload-n = -2; allowed: a finite number >= 0"),
        (("--preload-n", "2", "--speed-rpm", "0"), "--speed-rpm = 0; allowed: a finite number, not 0"),
        (("--preload-n", "inf", "--speed-rpm", "1"), "--preload-n = inf"),
        (("--preload-n", "2N", "--speed-rpm", "1"), "--preload-n = 2N"),
    ],
)
def test_bad_options_are_named(arguments, message):
    with pytest.raises(ValueError, match="allowed") as caught:
        points(*arguments)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("preload_n,speed_rpm\n1,2\n1,nan\n", "row 2: speed_rpm = nan; allowed: a finite number, not 0"),
        (
            "preload_n,speed_rpm\n1,\n",
            "row 1: speed_rpm (missing); allowed: a finite number, not 0, in a column or",
        ),
        ("preload_n,speed_rpm,axial_load\n1,2,3\n", "column axial_load; allowed: preload_n"),
        ("preload,speed_rpm\n1,2\n", "is preload_n meant?"),
        (
            "preload_n,speed_rpm\n1,2,3\n",
            "row 1 (line 2): 3 fields between commas; 2 expected, as in the headings",
        ),
    ],
)
def test_bad_files_are_named_with_the_place(csv_file, text, message):
    with pytest.raises(ValueError, match=r"points\.csv") as caught:
        points("--points", csv_file(text))
    assert message in str(caught.value)


def test_strict_bound():
    above = Quantity("x", "x", least=0.0, above=True)
    assert above.checked("x", "1e-9") == 1e-9
    with pytest.raises(ValueError, match=r"x = 0; allowed: a finite number > 0"):
        above.checked("x", "0")


def test_json_holds_plain_values():
    value = {"a": np.float64(1.5), "b": np.array([1.0, math.nan]), "c": (True, None), 4: np.bool_(False)}
    assert plain(value) == {"a": 1.5, "b": [1.0, None], "c": [True, None], "4": False}
    assert plain(math.inf) is None


def test_one_object_or_a_list(capsys):
    print_results([{"x": 1.0}], as_json=True, as_list=False)
    print_results([{"x": 1.0}], as_json=True, as_list=True)
    first, second = capsys.readouterr().out.splitlines()
    assert json.loads(first) == {"x": 1.0}
    assert json.loads(second) == [{"x": 1.0}]


def test_readable_table(capsys):
    print_results([{"x": 1.23456789, "ok": True, "clamped": [], "hash": "abc"}], as_json=False, as_list=False)
    lines = capsys.readouterr().out.splitlines()
    assert [line.split() for line in lines] == [
        ["x", "1.23457"],
        ["ok", "yes"],
        ["clamped", "-"],
        ["hash", "abc"],
    ]
    print_results([{"x": 1.0, "hash": "abc"}, {"x": 2.0, "hash": "abc"}], as_json=False, as_list=True)
    assert capsys.readouterr().out.split() == ["x", "1", "2"]
    assert table([["name", "1"], ["x", "200"]]) == "name    1\nx     200"
