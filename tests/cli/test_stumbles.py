"""What users stumbled over: misspelt words, answers at rest, torques below a map, wide tables, loads of a ball."""

import re

import command_line
import numpy as np
import pytest
from command_line import refused
from reference_screw import GD4008

from ballscrew_tehl.cli.points import WIDTH, listing, print_results
from ballscrew_tehl.nut_map.file import VG100, load_map, packaged_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_VG100
from ballscrew_tehl.parameters.units import CELSIUS, RPM

PLACE = ("--preload-n", "1000", "--temperature-c", "30")


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (("tork",), "torque"),
        (("map", "buidl"), "build"),
        (("torque", "--sped-rpm", "3"), "--speed-rpm"),
        (("torque", "--temperature", "30"), "--temperature-c"),
        (("torque", "--preload=3"), "--preload-n"),
        # not that --output is missing
        (("map", "plot", "--ouput", "x.png"), "--output"),
        (("map", "build", "--quik"), "--quick"),
        (("calibrate", "m.csv", "--drop", "outlier"), "outliers"),
        (("torque", "--kinematics", "rolling"), "rolling_frame"),
        (("init", "x.toml", "--oil", "isovg"), "iso_vg"),
        (("--versoin",), "--version"),
    ],
)
def test_a_misspelt_word_is_answered_with_the_nearest(capsys, words, meant):
    assert f"; is {meant} meant? (see --help)" in refused(capsys, *words)


@pytest.mark.parametrize("words", [("torque", "--zzz"), ("zzz",), ("torque", "left", "over")])
def test_a_word_like_none_gets_no_proposal(capsys, words):
    assert "meant?" not in refused(capsys, *words)


@pytest.mark.parametrize("friction", ["three_parameter", "mechanistic"])
def test_at_rest_torque_names_the_breakaway_torque(capsys, friction):
    words = ("torque", *PLACE, "--speed-rpm", "0", "--friction", friction)
    code, out, err = command_line.run(capsys, *words)
    assert code == 0
    (value,) = re.findall(r"(?m)^breakaway_torque_nm +(\S+)  needed to start, either way$", out)
    parameters = load_parameters(PACKAGED_VG100) if friction == "mechanistic" else GD4008
    state = load_map(None, parameters).evaluate(1000.0, 0.0, 30.0 + CELSIUS)
    assert float(value) == pytest.approx(float(state.coulomb_torque), rel=1e-5)
    assert re.search(r"(?m)^friction_torque_nm +0  at rest$", out)
    assert err.count("\n") == 1
    assert f"at rest friction balances the torque of the drive up to breakaway_torque_nm = {value} N.m" in err


def test_points_at_rest_have_a_column_that_the_others_leave_empty(capsys, tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("preload_n,speed_rpm,temperature_c\n2000,1000,30\n2000,0,30\n")
    code, out, err = command_line.run(capsys, "torque", "--points", path)
    assert code == 0
    heads, moving, resting = (line.split() for line in out.splitlines())
    column = heads.index("breakaway_torque_nm")
    assert moving[column] == "-"
    assert float(resting[column]) > 0.0
    assert "speed_rpm 0: 1 of 2 points, the first: at rest" in err


def test_efficiency_at_rest_is_that_at_breakaway(capsys):
    code, out, err = command_line.run(capsys, "screw", *PLACE, "--axial-load-n", "500", "--speed-rpm", "0")
    assert code == 0
    assert re.search(r"(?m)^friction_torque_nm +\S+  at breakaway$", out)
    assert err == "--speed-rpm 0: friction_torque_nm and efficiencies are those at breakaway\n"


def test_a_torque_below_the_map_names_the_lowest_and_the_remedy(capsys):
    nut_map = load_map(None, GD4008)
    lowest = nut_map.header["axes"]["preload"][0]
    least = float(nut_map.evaluate(lowest, 100.0 * RPM, 30.0 + CELSIUS).friction_torque)
    words = ("preload", "--speed-rpm", "100", "--temperature-c", "30", "--torque-nm")
    code, _, err = command_line.run(capsys, *words, repr(0.9 * least))
    assert code == 0
    assert err.count("\n") == 1
    assert err.startswith(
        f"in_range: false; torque_nm {0.9 * least:.6g} is below {least:.4g} N.m, the lowest torque"
    )
    assert f"at 100 r/min and 30 C (preload {lowest:g} N)" in err
    assert err.endswith("map build with a lower --preload-n\n")
    code, _, err = command_line.run(capsys, *words, repr(1.001 * least))
    assert (code, err) == (0, "")
    line = refused(capsys, *words, "50")
    assert f"torque_nm = 50 at 100 r/min and 30 C; allowed: {least:.4g} to " in line
    assert line.endswith("map build with a higher --preload-n")


@pytest.mark.parametrize("screw", [None, PACKAGED_VG100])
def test_map_info_fits_a_terminal(capsys, screw):
    code, out, _ = command_line.run(capsys, "map", "info", *([] if screw is None else ["--screw", screw]))
    assert code == 0
    assert [line for line in out.splitlines() if len(line) > WIDTH] == []
    header = load_map(None, load_parameters(screw)).header
    angle = re.search(r"(?m)^presliding_angle +(\S+)  rad at 1 N", out)
    assert float(angle[1]) == pytest.approx(header["presliding_angle"], rel=1e-5)
    # row torque_error, column 99: torque_error_99 of --json
    table = out[out.index("\ncertificate: ") :].splitlines()
    heads = table[2].split()
    (row,) = [line.split() for line in table if line.startswith("torque_error")]
    for name in ("mean", "50", "99", "999", "max"):
        value = float(row[1 + heads.index(name)])
        assert value == pytest.approx(header["certificate"][f"torque_error_{name}"], rel=0.06)
    assert f"    {header['file_hash']}" in out


def test_a_grid_beyond_the_memory_is_refused_in_one_line(capsys, monkeypatch):
    def refuse(*_, **__):
        raise MemoryError("Unable to allocate\n447 GiB")

    monkeypatch.setattr("ballscrew_tehl.contact.solve._solved", refuse)
    given = (
        "--load-n",
        "60",
        "--radius-x-m",
        "2e-3",
        "--radius-y-m",
        "6e-3",
        "--u1-m-s",
        "0.5",
        "--u2-m-s",
        "0.4",
    )
    line = refused(capsys, "contact", *given, "--temperature-k", "313.15")
    assert "not enough memory (Unable to allocate 447 GiB): fewer nodes or a smaller domain" in line


def test_a_listing_wraps_texts_and_keeps_long_words(capsys):
    row = {
        "x": np.float64(1.5),
        "text": "word " * 30,
        "hash": "0123456789abcdef" * 4 + "x" * 12,
        "flag": True,
    }
    lines = listing(row, {"x": "of something"}).splitlines()
    assert lines[0] == "x     1.5  of something"
    assert [line for line in lines if len(line) > WIDTH] == []
    assert " ".join(" ".join(lines[1:-3]).split()) == "text " + " ".join(["word"] * 30)
    assert lines[-3:] == ["hash", "    " + row["hash"], "flag  yes"]
    print_results([{"x": 1.0}, {"x": 2.0, "y": 3.0}], as_json=False, as_list=True)
    assert capsys.readouterr().out.split() == ["x", "y", "1", "-", "2", "3"]


def test_ball_loads_of_torque_and_screw_are_one_without_an_axial_load(capsys):
    loads = [
        load_of(command_line.run(capsys, command, "--preload-n", "3000", *words)[1])
        for command, words in (("torque", ("--speed-rpm", "100", "--temperature-c", "30")), ("screw", ()))
    ]
    # the map interpolates between its forces
    assert loads[0] == pytest.approx(loads[1], rel=1e-5)


def test_ball_loads_under_an_axial_load_say_what_they_are(capsys):
    words = ("--preload-n", "2000", "--axial-load-n", "1500")
    _, torque, _ = command_line.run(capsys, "torque", *words, "--speed-rpm", "100", "--temperature-c", "30")
    _, screw, _ = command_line.run(capsys, "screw", *words)
    assert load_of(torque, "nut loaded as by preload alone") == pytest.approx(58.40, abs=0.005)
    assert load_of(screw, "bodies stretched by the axial load") == pytest.approx(56.24, abs=0.005)


def load_of(text, note=""):
    (found,) = re.findall(rf"(?m)^ball_load_max_n +(\S+){'  ' if note else ''}{note}$", text)
    return float(found)


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ((), "example oil ISO VG 100"),
        (("--oil", "iso_vg"), "mineral oil ISO VG 100, viscosity index 95"),
        (("--lubricant", "grease"), "grease NLGI 2, base oil ISO VG 100"),
    ],
)
def test_init_names_the_lubricant_that_it_writes(capsys, tmp_path, options, name):
    path = tmp_path / "my.toml"
    assert command_line.run(capsys, "init", path, *options)[0] == 0
    assert load_parameters(path).lubricant.name == name


@pytest.mark.parametrize(
    "words", [("map", "info"), ("map", "check"), ("torque", *PLACE, "--speed-rpm", "100", "--map")]
)
def test_a_map_of_another_screw_asks_for_its_screw_file(capsys, words):
    file = packaged_map(VG100)
    line = refused(capsys, *words, file)
    assert line.endswith("give the screw file of the map by --screw")
    # what is said already is not said again
    line = refused(capsys, *words, file, "--screw", PACKAGED_VG100.with_name("gd4008.toml"))
    assert "map of other parameters" in line
    assert "--screw" not in line


def test_a_pressure_above_the_static_limit_is_said(capsys):
    assert command_line.run(capsys, "screw", "--preload-n", "2000")[2] == ""
    code, _, error = command_line.run(capsys, "screw", "--preload-n", "1e6")
    assert code == 0
    assert "the static rating allows 4.2 GPa" in error


def test_columns_given_twice_are_refused(capsys, tmp_path):
    points = tmp_path / "points.csv"
    points.write_text("preload_n,speed_rpm,temperature_c,preload_n\n2000,100,30,1\n")
    error = refused(capsys, "torque", "--points", str(points))
    assert "columns given twice: preload_n; allowed: each heading once" in error


@pytest.mark.parametrize("speed", ["0", "100"])
def test_the_torque_of_the_drive_at_rest_has_no_interval(capsys, speed):
    code, out, _ = command_line.run(
        capsys, "torque", "--friction", "mechanistic", *PLACE, "--speed-rpm", speed
    )
    assert code == 0
    assert ("none at rest" in out, "about 80 %" in out) == (speed == "0", speed != "0")
