"""The command `map build`: one screw, a family of screws, bad input."""

import dataclasses
import json
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import GRID, ClosedFilm, closed_row

from ballscrew_tehl.cli import map as map_commands
from ballscrew_tehl.cli.main import main
from ballscrew_tehl.cli.progress import progress_bar
from ballscrew_tehl.contact import ball_contact as operating_contact
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map import build, certificate, sampling
from ballscrew_tehl.nut_map.certificate import Deviation, deviation_from_direct, operating_points
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.refinement import direct

SCREW = resources.files("ballscrew_tehl") / "data" / "gd4008.toml"


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
    monkeypatch.setattr(build, "_solve_row", closed_row)
    monkeypatch.setattr(map_commands, "MapGrid", lambda: GRID)
    monkeypatch.setattr(map_commands, "build_executor", thread)
    monkeypatch.setattr(certificate, "deviation_at", certificate_row)


@pytest.mark.slow
def test_family_gets_a_map_for_every_screw(closed, tmp_path, capsys):
    folder, maps = tmp_path / "screws", tmp_path / "maps"
    folder.mkdir()
    text = SCREW.read_text(encoding="utf-8")
    for name in ("a", "b"):
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    assert (
        main(["map", "build", "--family", str(folder), "--output", str(maps), "--count", "5", "--json"]) == 0
    )
    shown = capsys.readouterr()
    results = json.loads(shown.out)
    assert [Path(result["file"]).name for result in results] == ["a.nc", "b.nc"]
    assert "s left" in shown.err
    # no journal or trial file remains
    assert sorted(path.name for path in maps.iterdir()) == ["a.nc", "b.nc"]
    for result in results:
        nut_map = load_map(result["file"], load_parameters(str(folder / "a.toml")))
        stored = nut_map.header["certificate"]
        assert stored["points"] == result["points"] == 5
        assert 0.0 < stored["torque_error_mean"] < stored["torque_error_max"] < 0.01
        assert stored["film_error_max"] == pytest.approx(10.0 * stored["torque_error_max"])


@pytest.mark.slow
def test_tolerance_reaches_the_sampling(closed, tmp_path, monkeypatch):
    grid = dataclasses.replace(GRID, contact_nodes=(5, 5, 5), contact_most=(9, 9, 9))
    monkeypatch.setattr(map_commands, "MapGrid", lambda: grid)
    monkeypatch.setattr(sampling, "FILM_FLOOR", 1e-12)
    contacts = []
    for tolerance in ("0.1", "1e-5"):
        path = tmp_path / f"{tolerance}.nc"
        assert main(["map", "build", "--output", str(path), "--count", "1", "--tolerance", tolerance]) == 0
        contacts.append(load_map(path, GD4008).header["contacts"])
    assert contacts[0] == 4 * 5**3 < contacts[1]


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
    assert main(["map", "build", "--output", str(path), "--count", "7", "--json"]) == 0
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
def test_deviation_is_that_of_the_map(closed, tmp_path, monkeypatch, capsys):
    """Direct films 3 % above the map's own: film off by 3 %, torque by less."""
    path = tmp_path / "map.nc"
    monkeypatch.undo()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "_solve_row", closed_row)
        patch.setattr(map_commands, "MapGrid", lambda: GRID)
        patch.setattr(map_commands, "build_executor", thread)
        patch.setattr(certificate, "deviation_at", certificate_row)
        assert main(["map", "build", "--output", str(path), "--count", "1"]) == 0
    nut_map = load_map(path, GD4008)
    point = (2000.0, 50.0, 303.15, 0.0)
    state = nut_map.evaluate(*point)

    friction_set = default_friction_set(GD4008)
    thicker = direct.DirectState(
        direct_torque(friction_set, *point[:3], factor=1.03),
        state.film_thickness_central_screw / 1.03,
        state.film_thickness_central_nut,
        state.film_temperature_rise + 0.5,
    )
    monkeypatch.setattr(direct, "direct_state", lambda *arguments: thicker)
    deviation = certificate.deviation_at(nut_map, GD4008, point)
    assert deviation.film == pytest.approx(0.03, rel=1e-9)
    assert deviation.temperature_rise == pytest.approx(
        0.5 / max(state.film_temperature_rise + 0.5, 1.0), rel=1e-9
    )
    assert 0.003 < deviation.torque < 0.03


@pytest.mark.slow
def test_points_without_direct_solution_are_counted_and_left_out(closed, tmp_path, monkeypatch):
    path = tmp_path / "map.nc"
    assert main(["map", "build", "--output", str(path), "--count", "1"]) == 0
    nut_map = load_map(path, GD4008)
    points = operating_points(nut_map, 6).tolist()

    def some(nut_map, parameters, point):
        if points.index(list(point)) % 3 == 1:
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--workers", "0"], "--workers = 0; allowed: a whole number >= 1"),
        (["--count", "0"], "--count = 0; allowed: a whole number >= 1"),
        (["--tolerance", "nan"], "--tolerance = nan; allowed: 1e-5 to 0.1"),
        (["--tolerance", "0.2"], "--tolerance = 0.2; allowed: 1e-5 to 0.1"),
        (["--family", "{empty}"], "allowed: a folder with screw files"),
        (["--family", "{empty}", "--screw", "x.toml"], "--family and --screw"),
        (["--dask", "tcp://127.0.0.1:9", "--output", "{empty}/x.nc"], "no scheduler answers there"),
    ],
)
def test_bad_input_is_refused_in_one_line(tmp_path, capsys, arguments, line):
    if "--dask" in arguments:
        pytest.importorskip("distributed")
    arguments = [argument.replace("{empty}", str(tmp_path)) for argument in arguments]
    assert main(["map", "build", *arguments]) == 2
    shown = capsys.readouterr().err.strip()
    assert line in shown
    assert "\n" not in shown
    assert list(tmp_path.iterdir()) == []
