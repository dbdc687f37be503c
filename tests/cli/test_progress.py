"""Progress of slow commands, on a terminal and as lines; Ctrl-C in one line, nothing half-written."""

import io
import itertools

import command_line
import pytest
from closed_film import HamrockDowsonFilm
from reference_screw import GD4008
from rich.console import Console

from ballscrew_tehl.cli import progress
from ballscrew_tehl.cli.common import EXTREMES
from ballscrew_tehl.nut_map import certificate
from ballscrew_tehl.nut_map.contact_map import SolvedFilm
from ballscrew_tehl.nut_map.file import packaged_map
from ballscrew_tehl.refinement import direct
from ballscrew_tehl.validation import section5

POINT = ("--preload-n", "2000", "--speed-rpm", "1000", "--temperature-c", "30")
FROM_MAP = ("--map", packaged_map("published"))
ROWS = "preload_n,speed_rpm,torque_nm\n" + "\n".join(
    f"{preload},{speed},{4e-4 * preload * (1.0 + 1e-4 * speed)}"
    for preload in (1000, 2000)
    for speed in (100, 500, 900)
)


@pytest.fixture
def clock(monkeypatch):
    """A second passes with every look at the clock of progress."""
    seconds = itertools.count()
    monkeypatch.setattr(progress.time, "monotonic", lambda: float(next(seconds)))


@pytest.fixture
def measured(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text(ROWS)
    return path


def test_a_quick_command_says_nothing_and_a_slow_one_each_stage(capsys, clock):
    with progress.progress_bar(quiet=1e6) as shown:
        shown(1, 3, "contacts")
    assert capsys.readouterr().err == ""
    with progress.progress_bar(quiet=2.5) as shown:
        for number in range(4):
            shown(number, 3, "contacts")
        shown(0, 2, "fits")
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("2 of 3 contacts")
    with progress.progress_bar(quiet=2.5) as shown:
        shown(0, 1, "contacts")
        shown(0, 1, "contacts")
        shown(1, 1, "contacts")
        shown(1, 1, "contacts")
    assert capsys.readouterr().err == ""
    assert lines[-1] == "0 of 2 fits"


def test_a_terminal_gets_a_bar(capsys, monkeypatch):
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=100)
    monkeypatch.setattr("rich.console.Console", lambda **settings: terminal)
    with progress.progress_bar(quiet=1e-9) as shown:
        shown(1, 3, "contacts solved")
        shown(3, 3, "contacts solved")
    assert "contacts solved" in screen.getvalue()
    assert "3/3" in screen.getvalue()
    assert capsys.readouterr().err == ""


def test_calibrate_says_what_it_does(capsys, clock, measured):
    code, _, err = command_line.run(capsys, "calibrate", measured, *FROM_MAP)
    assert code == 0
    assert " of 6 operating points with solved_thermal" in err
    assert " of 6 fits without one point" in err


@pytest.mark.parametrize("place", ["film", "write"])
def test_ctrl_c_in_calibrate_is_one_line_and_leaves_nothing(place, capsys, monkeypatch, measured):
    def interrupted(*arguments, **settings):
        raise KeyboardInterrupt

    if place == "film":
        monkeypatch.setattr(SolvedFilm, "central_film", interrupted)
    else:
        monkeypatch.setattr("os.replace", interrupted)
    output = measured.with_name("fit.toml")
    code, out, err = command_line.run(capsys, "calibrate", measured, *FROM_MAP, "--output", output)
    assert (code, out) == (130, "")
    assert err.splitlines()[-1] == "ballscrew_tehl calibrate: interrupted"
    assert "Traceback" not in err
    assert [*measured.parent.iterdir()] == [measured]


def test_direct_points_are_counted(capsys, monkeypatch, tmp_path):
    extremes = dict.fromkeys(EXTREMES, 1e-7)
    monkeypatch.setattr(direct, "direct_extremes", lambda *arguments: dict(extremes))
    film = HamrockDowsonFilm
    monkeypatch.setattr(direct, "DirectFilm", lambda parameters, thermal: film(parameters))
    path = tmp_path / "points.csv"
    path.write_text("preload_n,speed_rpm,temperature_c\n2000,1000,30\n1000,500,30\n")
    code, out, err = command_line.run(capsys, "torque", "--direct", "--points", path)
    assert code == 0
    assert len(out.splitlines()) == 3
    assert [line.partition(",")[0] for line in err.splitlines()] == [
        "0 of 2 points solved",
        "1 of 2 points solved",
        "2 of 2 points solved",
    ]


def test_contacts_of_section_5_are_counted(monkeypatch):
    seen = []
    monkeypatch.setattr(section5, "_solve", lambda *arguments: None)
    monkeypatch.setattr(section5, "_row", lambda *arguments: None)
    rows = section5.section5_contacts(GD4008, lambda *call: seen.append(call))
    assert len(rows) == 8
    assert [finished for finished, _, _ in seen] == [*range(24)]
    assert {total for _, total, _ in seen} == {24}


def test_reading_of_maps_by_validate_is_counted(capsys, clock):
    code, _, err = command_line.run(capsys, "validate", "--json")
    assert code == 0
    assert " of 3 maps read" in err


def test_map_check_counts_its_points(capsys, monkeypatch):
    monkeypatch.setattr(
        certificate, "_deviation_or_nan", lambda *arguments: certificate.Deviation(0.0, 0.0, 0.0)
    )
    code, _, err = command_line.run(capsys, "map", "check", "--count", "2")
    assert code == 0
    assert [line.partition(",")[0] for line in err.splitlines()] == [
        f"{number} of 2 points of the certificate" for number in range(3)
    ]
