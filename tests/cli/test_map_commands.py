"""The command `map build`: its range, its plan, a family of screws, an interrupt, bad input."""

import dataclasses
import itertools
import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from command_line import interruptible, refused, run
from reference_screw import GD4008
from synthetic_contacts import ClosedFilm, closed_contact

from ballscrew_tehl.cli import map as map_commands
from ballscrew_tehl.cli.main import INTERRUPTED, main
from ballscrew_tehl.cli.progress import progress_bar
from ballscrew_tehl.contact import ball_contact as operating_contact
from ballscrew_tehl.contact.ball_formula import film_formula
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map import build, certificate
from ballscrew_tehl.nut_map.certificate import BELOW_SPEED, Deviation, deviation_from_direct, operating_points
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.nut_map.grid import MapGrid, map_grid
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.parameters.identity import map_parameters_json
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.refinement import direct

SCREW = resources.files("ballscrew_tehl") / "data" / "gd4008.toml"
#: few nodes and contacts; the range is that of the command
SMALL = MapGrid(
    force=(1.0, 2.0, 9), speed=(1.0, 2.0, 9), temperature=(300.0, 310.0, 7), preload=(1.0, 2.0, 7),
    contact_first=30, contact_batch=8, contact_most=30, atlas=False,
)  # fmt: skip
QUICK = dataclasses.replace(SMALL, contact_first=12, contact_most=12)
#: range of most tests here
NARROW = ("--preload-n", "500", "4000", "--speed-rpm", "100", "1000", "--temperature-c", "20", "40")


@contextmanager
def thread(workers, dask):
    with ThreadPoolExecutor(1) as pool:
        yield pool


def direct_torque(friction_set, preload, speed, temperature, factor):
    """Friction torque with the closed films times a factor."""

    class Thicker(ClosedFilm):
        def central_film(self, raceway, load, speed, temperature):
            return factor * super().central_film(raceway, load, speed, temperature)

    return double_nut_torque(GD4008, friction_set, Thicker(GD4008, True), preload, speed, temperature).total


def certificate_row(nut_map, parameters, point):
    """Different deviations in every place of the result."""
    share = (point[0] % 7.0) / 7.0
    return Deviation(0.01 * share, 0.1 * share, share)


@pytest.fixture
def closed(monkeypatch):
    """Contacts in closed form, solved in one thread."""
    monkeypatch.setattr(build, "_solve_contact", closed_contact)
    monkeypatch.setattr(map_commands, "MapGrid", lambda: SMALL)
    monkeypatch.setattr(map_commands, "QUICK", QUICK)
    monkeypatch.setattr(map_commands, "build_executor", thread)
    monkeypatch.setattr(certificate, "deviation_at", certificate_row)


def screw_file(folder, table):
    """GD4008 with a table [map]."""
    path = folder / "screw.toml"
    path.write_text(f"{SCREW.read_text(encoding='utf-8')}\n[map]\n{table}\n", encoding="utf-8")
    return path


def built(path, *options):
    """Exit code of a build with a certificate of one point, and the map."""
    code = main(["map", "build", "--output", str(path), "--count", "1", *map(str, options)])
    return code, load_map(path, GD4008)


def ends(nut_map, name):
    return nut_map.header["axes"][name][:2]


@pytest.mark.slow
def test_range_follows_from_the_screw(closed, tmp_path):
    code, nut_map = built(tmp_path / "map.nc")
    assert code == 0
    grid = map_grid(GD4008)
    for name in ("preload", "speed", "temperature"):
        assert ends(nut_map, name) == pytest.approx(getattr(grid, name)[:2], rel=1e-12), name


@pytest.mark.slow
def test_options_overrule_the_table_and_the_table_the_screw(closed, tmp_path):
    table = "preload_min_N = 300.0\npreload_max_N = 3000.0\nspeed_min_rpm = 50.0\nspeed_max_rpm = 800.0"
    path = screw_file(tmp_path, table)
    code, nut_map = built(tmp_path / "map.nc", "--screw", path, "--speed-rpm", "100", "1000")
    assert code == 0
    assert ends(nut_map, "preload") == pytest.approx((300.0, 3000.0), rel=1e-12)
    assert ends(nut_map, "speed") == pytest.approx((100.0 * RPM, 1000.0 * RPM), rel=1e-12)
    assert ends(nut_map, "temperature") == pytest.approx(map_grid(GD4008).temperature[:2], rel=1e-12)
    # another range belongs to the same screw
    assert nut_map.header["parameters_json"] == map_parameters_json(GD4008)


@pytest.mark.slow
def test_temperature_option_is_in_degrees_celsius(closed, tmp_path):
    code, nut_map = built(tmp_path / "map.nc", *NARROW)
    assert code == 0
    assert ends(nut_map, "temperature") == pytest.approx((20.0 + CELSIUS, 40.0 + CELSIUS), rel=1e-12)
    assert ends(nut_map, "preload") == [500.0, 4000.0]
    # an axial load relieves one nut
    assert ends(nut_map, "force")[0] < 0.2 * 500.0


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("--workers", "0"), "--workers = 0; allowed: a whole number >= 1"),
        (("--count", "0"), "--count = 0; allowed: a whole number >= 1"),
        (("--tolerance", "nan"), "--tolerance = nan; allowed: 1e-5 to 0.1"),
        (("--tolerance", "0.2"), "--tolerance = 0.2; allowed: 1e-5 to 0.1"),
        (("--preload-n", "2000", "500"), "preload = 2000 to 500 N; needs 0.01 <= lowest < highest <= 1e+07"),
        (("--preload-n", "500", "500"), "preload = 500 to 500 N; needs 0.01 <= lowest < highest <= 1e+07"),
        (("--preload-n", "-5", "500"), "preload = -5 to 500 N; needs 0.01 <= lowest < highest <= 1e+07"),
        (("--preload-n", "nan", "500"), "preload = nan to 500 N; needs 0.01 <= lowest < highest <= 1e+07"),
        (("--preload-n", "500", "inf"), "preload = 500 to inf N; needs 0.01 <= lowest < highest <= 1e+07"),
        (("--preload-n", "500"), "--preload-n: expected 2 arguments"),
        (("--preload-n", "500", "much"), "invalid float value: 'much'"),
        (("--speed-rpm", "0", "500"), "speed = 0 to 500 r/min; needs 0.001 <= lowest < highest <= 1e+06"),
        (("--speed-rpm", "500", "100"), "speed = 500 to 100 r/min; needs 0.001 <= lowest < highest <= 1e+06"),
        (
            ("--temperature-c", "40", "20"),
            "temperature = 40 to 20 C; needs -73.15 <= lowest < highest <= 500",
        ),
        (
            ("--temperature-c", "-300", "20"),
            "temperature = -300 to 20 C; needs -73.15 <= lowest < highest <= 500",
        ),
        (("--preload-n", "1e-300", "1e300"), "preload = 1e-300 to 1e+300 N; needs 0.01 <= lowest"),
        (("--preload-n", "1000", "1e6"), "preload = 1000 to 1e+06 N: Hertz pressure up to "),
        (("--temperature-c", "80", "400"), "temperature = 80 to 400 C: viscosity of oil of Table 1 "),
        (("--temperature-c", "80", "400"), "allowed: 0.0001 to 10000 Pa s, that is -40 to 266 C"),
        (
            ("--temperature-c", "10", "-1e1"),
            "temperature = 10 to -10 C; needs -73.15 <= lowest < highest <= 500",
        ),
        (
            ("--temperature-c", "-3e2", "-inf"),
            "temperature = -300 to -inf C; needs -73.15 <= lowest < highest <= 500",
        ),
    ],
)
def test_bad_ranges_and_numbers_are_refused_in_one_line(closed, tmp_path, capsys, arguments, line):
    assert line in refused(capsys, "map", "build", "--output", tmp_path / "x.nc", *arguments)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ((), "--output (missing); allowed: a file *.nc for the map"),
        (("--quick",), "--output (missing)"),
        (("--family", "{empty}"), "allowed: a folder with screw files"),
        (("--family", "{empty}", "--screw", "x.toml"), "--family and --screw"),
        (("--dask", "tcp://127.0.0.1:9", "--output", "{empty}/x.nc"), "no scheduler answers there"),
    ],
)
def test_bad_places_are_refused_in_one_line(tmp_path, capsys, arguments, line):
    if "--dask" in arguments:
        pytest.importorskip("distributed")
    arguments = [argument.replace("{empty}", str(tmp_path)) for argument in arguments]
    assert line in refused(capsys, "map", "build", *arguments)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("table", "line"),
    [
        ("preload_min_N = 100.0", "map.preload_max"),
        ("speed_max_rpm = 100.0", "map.speed_min"),
        ("temperature_min_degC = 40.0\ntemperature_max_degC = 20.0", "more than temperature_min"),
        ("preload_min_N = -1.0\npreload_max_N = 100.0", "map.preload_min_N = -1.0"),
        (
            "speed_min_rad_s = 1.0\nspeed_max_rad_s = 1e300",
            "map.speed_max_rad_s = 1e+300; allowed: >= 0.00010472 rad_s, <= 104720 rad_s",
        ),
        (
            "temperature_min_K = 20.0\ntemperature_max_K = 300.0",
            "map.temperature_min_K = 20.0; allowed: >= 200 K",
        ),
        (
            "temperature_min_degC = 20.0\ntemperature_max_degC = 501.0",
            "_degC = 501.0; allowed: >= -73.15 degC, <= 500 degC",
        ),
        ("preload_min = 1.0", "bad unit"),
        ("torque_max_Nm = 1.0", "a known key"),
    ],
)
def test_bad_tables_are_refused_in_one_line(tmp_path, capsys, table, line):
    path = screw_file(tmp_path, table)
    assert line in refused(capsys, "map", "build", "--screw", path, "--output", tmp_path / "x.nc")
    assert list(tmp_path.iterdir()) == [path]


def test_plan_is_printed_before_the_first_solve(closed, tmp_path, monkeypatch, capsys):
    def stop(*arguments, **settings):
        raise ArithmeticError("first solve")

    monkeypatch.setattr(build, "build_map", stop)
    code, out, err = run(capsys, "map", "build", "--output", tmp_path / "x.nc", *NARROW)
    assert (code, out) == (1, "")
    plan, error = err.splitlines()
    assert error == "ballscrew_tehl map: not converged: first solve"
    for words in ("GD4008-3, kinematics published", "preload 500 to 4000 N (up to 1.46 GPa)", "speed 100 to 1000 r/min",
                  "oil 20 to 40 C", "120 contacts (30 points of each raceway, isothermal and thermal), then 1 ",
                  "core-seconds"):  # fmt: skip
        assert words.replace(" 1 ", " 200 ") in plan
    _, _, err = run(capsys, "map", "build", "--output", tmp_path / "x.nc", "--quick")
    plan = err.splitlines()[0]
    assert "48 contacts (12 points of each raceway, isothermal and thermal), then 8 points" in plan
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_quick_and_tolerance_choose_the_contacts(closed, tmp_path, monkeypatch):
    most = dataclasses.replace(SMALL, contact_first=28, contact_most=44)
    monkeypatch.setattr(map_commands, "MapGrid", lambda: most)
    contacts = {}
    for name, options in {
        "quick": ("--quick",), "wide": ("--tolerance", "0.1"), "narrow": ("--tolerance", "1e-5")
    }.items():  # fmt: skip
        code, nut_map = built(tmp_path / f"{name}.nc", *NARROW, *options)
        assert code == 0
        contacts[name] = nut_map.header["contacts"]
    assert contacts == {"quick": 4 * 12, "wide": 4 * 28, "narrow": 4 * 44}


def interrupted_after(count):
    """closed_contact that Ctrl-C interrupts."""
    left = iter(range(count))

    def solve(*arguments):
        if next(left, None) is None:
            raise KeyboardInterrupt
        return closed_contact(*arguments)

    return solve


@pytest.mark.slow
def test_interrupted_build_continues_with_what_it_has(closed, tmp_path, monkeypatch, capsys):
    path = tmp_path / "map.nc"
    arguments = ["map", "build", "--output", str(path), "--count", "1", *NARROW]
    monkeypatch.setattr(build, "_solve_contact", interrupted_after(20))
    assert main(arguments) == INTERRUPTED
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == "ballscrew_tehl map: interrupted; the same command again continues it"
    assert [file.name for file in tmp_path.iterdir()] == ["map.nc.contacts"]
    solved = []
    monkeypatch.setattr(build, "_solve_contact", lambda *a: solved.append(a) or closed_contact(*a))
    assert main(arguments) == 0
    assert len(solved) == 2 * 30 - 20
    assert [file.name for file in tmp_path.iterdir()] == ["map.nc"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a group of processes is interrupted")
@pytest.mark.parametrize(
    "moments", [(0.03,), (0.3,), (0.5, 0.3)], ids=["tables", "start of a worker", "twice"]
)
def test_ctrl_c_soon_after_the_plan_ends_the_build(tmp_path, moments):
    """While tables of points are read or workers start, and again while the build waits for them."""
    command = [sys.executable, "-m", "ballscrew_tehl", "map", "build", "--output", str(tmp_path / "map.nc")]
    build_ = subprocess.Popen(
        [*command, "--quick", "--workers", "1", *NARROW],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=interruptible,
    )
    with build_:
        assert "core-seconds" in build_.stderr.readline()
        for moment in moments:
            time.sleep(moment)
            os.killpg(build_.pid, signal.SIGINT)
        try:
            build_.wait(20.0)
        except subprocess.TimeoutExpired:
            # while a process starts it is ignored: a user sends it again
            os.killpg(build_.pid, signal.SIGINT)
        lines = build_.stderr.readlines()
    # a second one may also come after the line is printed, while Python exits
    assert build_.returncode == INTERRUPTED or (build_.returncode == -signal.SIGINT and len(moments) == 2)
    assert not any("Traceback" in line for line in lines), lines
    assert lines[-1] == "ballscrew_tehl map: interrupted; the same command again continues it\n"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a group of processes is interrupted")
def test_ctrl_c_on_a_terminal_leaves_one_line(tmp_path):
    """Ctrl-C reaches the command and its workers; contacts here are solved."""
    path = tmp_path / "map.nc"
    command = [sys.executable, "-m", "ballscrew_tehl", "map", "build", "--output", str(path), "--quick"]
    build_ = subprocess.Popen(
        [*command, "--workers", "1", *NARROW], stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=interruptible,
    )  # fmt: skip
    with build_:
        lines = []
        for line in build_.stderr:
            lines.append(line)
            if "contacts solved" in line:
                os.killpg(build_.pid, signal.SIGINT)
                break
        lines += build_.stderr.readlines()
    assert build_.returncode == INTERRUPTED
    assert not any("Traceback" in line for line in lines), lines
    assert lines[-1] == "ballscrew_tehl map: interrupted; the same command again continues it\n"
    kept = (tmp_path / "map.nc.contacts").read_text(encoding="ascii").splitlines()
    assert len(kept) >= 2
    assert all(json.loads(line) for line in kept)


def partly(failed, of):
    """closed_contact without some of so many contacts, as if the solver had not converged."""
    numbers = itertools.count()

    def solve(*arguments):
        found = closed_contact(*arguments)
        if next(numbers) % of < failed:
            found = dict.fromkeys(found, math.nan)
        return found

    return solve


@pytest.mark.slow
def test_contacts_that_do_not_converge_are_counted_and_said(closed, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(build, "_solve_contact", partly(1, 20))
    code, nut_map = built(tmp_path / "map.nc", *NARROW)
    assert code == 0
    assert nut_map.header["contacts_not_solved"] == 3
    assert "3 of 120 contacts did not converge and are interpolated" in capsys.readouterr().err


@pytest.mark.slow
def test_a_map_of_poor_torque_is_said(closed, tmp_path, monkeypatch, capsys):
    assert built(tmp_path / "map.nc", *NARROW)[0] == 0
    assert "poor map" not in capsys.readouterr().err
    monkeypatch.setattr("ballscrew_tehl.cli.map.POOR", 0.0)
    assert built(tmp_path / "map.nc", *NARROW)[0] == 0
    (line,) = (text for text in capsys.readouterr().err.splitlines() if "poor map" in text)
    assert "remedy: a narrower range, or --tolerance" in line


@pytest.mark.slow
def test_build_fails_when_most_contacts_do_not_converge(closed, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(build, "_solve_contact", partly(3, 5))
    path = tmp_path / "map.nc"
    code, out, err = run(capsys, "map", "build", "--output", path, *NARROW)
    assert (code, out) == (1, "")
    found = re.fullmatch(
        r"ballscrew_tehl map: not converged: (\d+) of 60 contacts of the range did not converge .*: give a narrower "
        r"range by --preload-n, --speed-rpm, --temperature-c",
        err.splitlines()[-1],
    )
    assert int(found.group(1)) == 36
    assert not path.exists()


@pytest.mark.slow
def test_family_gets_a_map_for_every_screw(closed, tmp_path, capsys):
    folder, maps = tmp_path / "screws", tmp_path / "maps"
    folder.mkdir()
    text = SCREW.read_text(encoding="utf-8")
    for name in ("a", "b"):
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    assert (
        main(
            [
                "map",
                "build",
                "--count",
                "5",
                "--json",
                "--family",
                str(folder),
                "--output",
                str(maps),
                *NARROW,
            ]
        )
        == 0
    )
    shown = capsys.readouterr()
    results = json.loads(shown.out)
    assert [Path(result["file"]).name for result in results] == ["a.nc", "b.nc"]
    assert "s left" in shown.err
    # one plan for each, before its first contact
    assert shown.err.count("core-seconds") == 2
    # no journal or trial file remains
    assert sorted(path.name for path in maps.iterdir()) == ["a.nc", "b.nc"]
    for result in results:
        nut_map = load_map(result["file"], load_parameters(str(folder / "a.toml")))
        stored = nut_map.header["certificate"]
        assert stored["points"] == result["points"] == 5
        assert 0.0 < stored["torque_error_mean"] < stored["torque_error_max"] < 0.01
        assert stored["film_error_max"] == pytest.approx(10.0 * stored["torque_error_max"])


def family_of(folder, screws):
    """Screw files by name, each the packaged screw with some text replaced."""
    folder.mkdir()
    text = SCREW.read_text(encoding="utf-8")
    for name, (old, new) in screws.items():
        assert old in text
        (folder / f"{name}.toml").write_text(text.replace(old, new), encoding="utf-8")
    return folder


#: name of the packaged screw, and of one whose contacts do not converge
NAMED, BAD = ('"GD4008-3"', '"GD4008-3"'), ('"GD4008-3"', '"bad"')


@pytest.fixture
def closed_or_lost(closed, monkeypatch):
    """No contact of a screw with the name "bad" converges."""

    def solve(parameters, *place):
        found = closed_contact(parameters, *place)
        return dict.fromkeys(found, math.nan) if parameters.name == "bad" else found

    monkeypatch.setattr(build, "_solve_contact", solve)


@pytest.mark.slow
def test_family_goes_on_after_a_screw_whose_contacts_do_not_converge(closed_or_lost, tmp_path, capsys):
    folder = family_of(tmp_path / "screws", {"a": NAMED, "b": BAD, "c": NAMED})
    code, out, err = run(capsys, "map", "build", "--family", folder, "--count", "1", "--json", *NARROW)
    assert code == 0
    assert [Path(result["file"]).name for result in json.loads(out)] == ["a.nc", "c.nc"]
    last = err.splitlines()[-1]
    assert last.startswith(
        "2 of 3 maps built; not converged: b.nc: 60 of 60 contacts of the range did not conv"
    )
    # what was solved of the second one is kept
    names = [path.name for path in sorted(folder.iterdir())]
    assert names == ["a.nc", "a.toml", "b.nc.contacts", "b.toml", "c.nc", "c.toml"]


def test_family_without_a_map_fails(closed_or_lost, tmp_path, capsys):
    folder = family_of(tmp_path / "screws", {"a": BAD, "b": BAD})
    code, out, err = run(capsys, "map", "build", "--family", folder, "--count", "1", *NARROW)
    assert (code, out) == (1, "")
    last = err.splitlines()[-1]
    assert last.startswith(
        "ballscrew_tehl map: not converged: 0 of 2 maps built; not converged: a.nc: 60 of 60 "
    )
    assert "; b.nc: 60 of 60 " in last


def test_bad_input_of_the_last_screw_is_refused_before_the_first_contact(
    closed, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(build, "build_map", None)
    folder = family_of(tmp_path / "screws", {"a": NAMED, "b": NAMED})
    (folder / "b.nc.contacts").write_text("notes\n", encoding="ascii")
    before = sorted(folder.iterdir())
    line = refused(capsys, "map", "build", "--family", folder, "--output", folder, *NARROW)
    assert "b.nc.contacts: not a file of solved contacts: remove or rename it" in line
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize("output", ["", ".", "{folder}", "{screw}", "/dev/null", "{folder}/notes.nc"])
def test_output_that_is_no_map_is_never_replaced(tmp_path, capsys, output):
    screw = screw_file(tmp_path, "")
    (tmp_path / "notes.nc").write_text("notes")
    output = output.format(folder=tmp_path, screw=screw)
    line = refused(capsys, "map", "build", "--screw", screw, "--output", output)
    path = Path(output)
    reason = ": is a folder; allowed: a file *.nc" if path.is_dir() else "; allowed: a file *.nc"
    if path.suffix == ".nc":
        reason = "; allowed: a new file *.nc, or a map"
    assert f"--output = {path}{reason}" in line
    assert sorted(tmp_path.iterdir()) == sorted([screw, tmp_path / "notes.nc"])
    assert (tmp_path / "notes.nc").read_text() == "notes"


def test_output_below_a_file_is_refused(tmp_path, capsys):
    screw = screw_file(tmp_path, "")
    line = refused(capsys, "map", "build", "--output", screw / "x.nc")
    assert line.endswith(
        f"--output = {screw / 'x.nc'}: {screw} is not a folder; allowed: a path below a folder"
    )


@pytest.mark.slow
def test_second_build_of_a_map_is_refused_also_during_the_certificate_of_the_first(
    closed, tmp_path, monkeypatch, capsys
):
    """With contacts and certificate in one thread, the second command runs within the first one."""
    path, second = tmp_path / "map.nc", []

    def row(nut_map, parameters, point):
        second.append(refused(capsys, "map", "build", "--output", path, *NARROW))
        return certificate_row(nut_map, parameters, point)

    monkeypatch.setattr(certificate, "deviation_at", row)
    code, _ = built(path, *NARROW)
    assert code == 0
    # one point, and one below the lowest speed
    assert len(second) == 2
    line = "map.nc.contacts: another build is writing it; remedy: wait for that, or another --output"
    assert all(line in each for each in second)
    assert [file.name for file in tmp_path.iterdir()] == ["map.nc"]


def test_plain_progress_shows_every_stage_of_a_build_that_adds_work(capsys):
    """Two stages of work and the certificate, each printed to its end, without a line for every call."""
    with progress_bar() as progress:
        for finished in range(10, 901, 10):
            progress(finished, 900, "contacts solved")
        for finished in range(910, 1201, 10):
            progress(finished, 1200, "contacts solved")
        for finished in range(1, 4):
            progress(finished, 3, "points of the certificate")
    lines = capsys.readouterr().err.splitlines()
    starts = [line.split(",")[0] for line in lines]
    for expected in ("10 of 900 contacts solved", "900 of 900 contacts solved", "910 of 1200 contacts solved",
                     "1200 of 1200 contacts solved", "3 of 3 points of the certificate"):  # fmt: skip
        assert expected in starts
    assert sum("of 900 " in line for line in lines) <= 22
    assert 15 <= sum("of 1200 " in line for line in lines) <= 22


@pytest.mark.slow
def test_certificate_holds_mean_quantile_and_largest(closed, tmp_path, monkeypatch, capsys):
    path = tmp_path / "map.nc"
    assert main(["map", "build", "--output", str(path), "--count", "7", "--json", *NARROW]) == 0
    result = json.loads(capsys.readouterr().out)
    nut_map = load_map(path, GD4008)
    errors = [certificate_row(nut_map, GD4008, point) for point in operating_points(nut_map, 7).tolist()]
    for k, name in enumerate(Deviation._fields):
        column = [error[k] for error in errors]
        assert result[f"{name}_error_mean"] == pytest.approx(np.mean(column), rel=1e-12)
        assert result[f"{name}_error_99"] == pytest.approx(np.quantile(column, 0.99), rel=1e-12)
        assert result[f"{name}_error_max"] == max(column)
    assert deviation_from_direct(nut_map, GD4008, 7)["torque_error_max"] == result["torque_error_max"]


@pytest.mark.slow
def test_deviation_is_that_of_the_map(closed, tmp_path, monkeypatch):
    """Direct films 3 % above the map's own: film off by 3 %, torque by less."""
    _, nut_map = built(tmp_path / "map.nc", *NARROW)
    monkeypatch.undo()
    point = (2000.0, 50.0, 303.15, 0.0)
    state = nut_map.evaluate(*point)

    friction_set = default_friction_set(GD4008)
    thicker = direct.DirectState(
        direct_torque(friction_set, *point[:3], factor=1.03),
        state.film_thickness_central_screw / 1.03,
        state.film_thickness_central_nut,
        state.film_temperature_rise + 0.5,
    )
    monkeypatch.setattr(direct, "mean_ball_state", lambda *arguments: thicker)
    deviation = certificate.deviation_at(nut_map, GD4008, point)
    assert deviation.film == pytest.approx(0.03, rel=1e-9)
    assert deviation.temperature_rise == pytest.approx(
        0.5 / max(state.film_temperature_rise + 0.5, 1.0), rel=1e-9
    )
    assert 0.003 < deviation.torque < 0.03


class Recording(Executor):
    """Runs jobs at once and keeps their arguments."""

    def __init__(self):
        self.points = []

    def submit(self, function, *args, **kwargs):
        self.points.append(args[-1])
        done = Future()
        done.set_result(function(*args, **kwargs))
        return done


@pytest.mark.slow
def test_certificate_begins_with_thick_films_and_has_a_slow_point(closed, tmp_path):
    """They take longest; the order of the solves is not that of the result."""
    _, nut_map = built(tmp_path / "map.nc", *NARROW)
    executor = Recording()
    found = deviation_from_direct(nut_map, GD4008, 6, executor)
    assert found == deviation_from_direct(nut_map, GD4008, 6)
    assert found["each"]["preload"] == pytest.approx(operating_points(nut_map, 6)[:, 0], rel=1e-5)
    assert found["regions"][BELOW_SPEED]["points"] == 1
    lowest = nut_map.header["axes"]["speed"][0]
    assert sum(point[1] < lowest for point in executor.points) == 1
    loads = [nut_loads(GD4008.screw, p[0], GD4008.screw.loaded_ball_count).max() for p in executor.points]
    films = [
        min(float(film_formula(GD4008, raceway, np.array([load]), *p[1:3])[0]) for raceway in RACEWAYS)
        for load, p in zip(loads, executor.points, strict=True)
    ]
    assert films == sorted(films, reverse=True)
    assert executor.points[:6] != [tuple(p) for p in operating_points(nut_map, 6).tolist()]


@pytest.mark.slow
def test_points_without_direct_solution_are_counted_and_left_out(closed, tmp_path, monkeypatch):
    _, nut_map = built(tmp_path / "map.nc", *NARROW)
    points = operating_points(nut_map, 6).tolist()

    def some(nut_map, parameters, point):
        if list(point) in points and points.index(list(point)) % 3 == 1:
            raise operating_contact.UnconvergedContactError("contact not solved")
        return certificate_row(nut_map, parameters, point)

    monkeypatch.setattr(certificate, "deviation_at", some)
    found = deviation_from_direct(nut_map, GD4008, 6)
    assert (found["points"], found["points_not_solved"]) == (4, 2)
    assert found["each"]["preload"] == pytest.approx([points[k][0] for k in (0, 2, 3, 5)], rel=1e-5)
    assert found["torque_error_max"] == max(
        certificate_row(None, None, points[k]).torque for k in (0, 2, 3, 5)
    )

    def none(nut_map, parameters, point):
        raise operating_contact.UnconvergedContactError("contact not solved")

    monkeypatch.setattr(certificate, "deviation_at", none)
    with pytest.raises(ArithmeticError, match="none of 2 points"):
        deviation_from_direct(nut_map, GD4008, 2)
