"""The picture of a map: curves, samples and points of the certificate are those of the map; its command."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import run
from reference_screw import GD4008
from synthetic_contacts import FEW, GRID, closed_build, closed_contact, small_map

from ballscrew_tehl.nut_map import build, certificate
from ballscrew_tehl.nut_map.certificate import Deviation, deviation_from_direct
from ballscrew_tehl.nut_map.file import load_contact_map, load_map, save_map
from ballscrew_tehl.nut_map.plot import ERROR_SPAN, ERRORS, caption, map_figure, map_picture
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.runtime.packed import POINT


def row(nut_map, parameters, point):
    """Different in every column and at every point."""
    share = (point[0] % 7.0 + 0.1) / 7.0
    return Deviation(0.01 * share, 0.1 * share**2, share**3)


def picture_of(path):
    return map_picture(load_map(path, GD4008), load_contact_map(path, GD4008))


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("map") / "small.nc"
    save_map(path, small_map(), {})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(certificate, "deviation_at", row)
        save_map(path, small_map(), deviation_from_direct(load_map(path, GD4008), GD4008, 9))
    return path


@pytest.fixture(scope="module")
def picture(path):
    return picture_of(path)


def panel(figure, name):
    (axes,) = (axes for axes in figure.axes if axes.get_label() == name)
    return axes


def lines(axes):
    """Coordinates of the lines that hold data (entries of a legend hold none)."""
    return [line.get_xydata().T for line in axes.lines if line.get_xydata().size]


def test_lines_are_the_values_of_the_map_point_by_point(picture):
    nut_map, speeds, figure = picture.nut_map, picture.speed, map_figure(picture)
    assert (speeds[0], speeds[-1]) == tuple(GRID.speed[:2])

    def answers(preload, temperature):
        return [nut_map.evaluate(float(preload), float(w), float(temperature)) for w in speeds[::40]]

    by_preload = [answers(f, picture.temperature) for f in picture.preloads]
    by_temperature = [answers(picture.preload, t) for t in picture.temperatures]
    drawn = {
        "torque_by_preload": [[state.friction_torque for state in states] for states in by_preload],
        "torque_by_temperature": [[state.friction_torque for state in states] for states in by_temperature],
        "rise": [[state.film_temperature_rise for state in states] for states in by_temperature],
        "film": [
            [1e9 * getattr(state, f"film_thickness_{name}") for state in by_temperature[k]]
            for name in ("central_screw", "central_nut", "min")
            for k in picture.film_rows
        ],
    }
    for name, expected in drawn.items():
        for (x, y), values in zip(lines(panel(figure, name)), expected, strict=True):
            assert x * RPM == pytest.approx(speeds, rel=1e-12)
            assert y[::40] == pytest.approx(values, rel=1e-9)


def test_samples_are_marked_as_asymptotic_or_not_solved(tmp_path, monkeypatch):
    monkeypatch.setattr(build, "UNCERTAIN", np.inf)

    def solve(parameters, raceway, load, speed, temperature):
        found = closed_contact(parameters, raceway, load, speed, temperature) | {"asymptotic": 0.0}
        if raceway == "nut" and load > 100.0:
            found = dict.fromkeys(found, np.nan) if speed < 20.0 else found | {"asymptotic": 1.0}
        return found

    save_map(tmp_path / "x.nc", closed_build(grid=FEW, solve=solve), {})
    picture = picture_of(tmp_path / "x.nc")
    figure, contacts = map_figure(picture), picture.contact_map.contacts["nut"]
    load, speed, _ = contacts.points.T
    heavy, slow = load > 100.0, speed < 20.0
    solved, flagged, lost = lines(panel(figure, "nut"))
    for (x, y), mask in ((solved, ~(heavy & slow)), (flagged, heavy & ~slow), (lost, heavy & slow)):
        assert mask.sum() >= 2
        assert y == pytest.approx(load[mask])
        assert x * RPM == pytest.approx(speed[mask])
    assert len(lines(panel(figure, "screw"))) == 1
    text = caption(picture).replace("\n", " ")
    assert f"{FEW.contact_first - int((heavy & slow).sum())} on the nut raceway" in text
    assert f"; {int((heavy & slow).sum())} not solved." in text
    # without a certificate no points
    assert "The map has no certificate." in text
    assert "<colorbar>" not in [axes.get_label() for axes in figure.axes]


@pytest.mark.parametrize("error", ERRORS)
def test_points_of_the_certificate_are_drawn_with_their_error(picture, error):
    each, figure = picture.nut_map.header["certificate"]["each"], map_figure(picture, error)
    columns = [each[name] for name in POINT]
    for raceway in RACEWAYS:
        (points,) = panel(figure, raceway).collections
        rpm, load = np.asarray(points.get_offsets()).T
        assert rpm * RPM == pytest.approx(each["speed"], rel=1e-12)
        answers = [picture.nut_map.evaluate(*point).ball_load_max for point in zip(*columns, strict=True)]
        assert load == pytest.approx(answers, rel=1e-9)
        errors = np.array(each[f"{error}_error"])
        shown = np.asarray(points.get_array())
        assert shown == pytest.approx(np.maximum(errors, ERROR_SPAN * errors.max()), rel=1e-12)
        # larger for a larger error
        assert (np.diff(points.get_sizes()[np.argsort(shown)]) >= 0.0).all()
    assert ERRORS[error] in panel(figure, "<colorbar>").get_xlabel()
    with pytest.raises(ValueError, match="error = 'pressure'; allowed: torque, film, temperature_rise"):
        map_figure(picture, "pressure")


@pytest.mark.slow
def test_command_writes_the_same_picture_and_its_extremes(path, picture, tmp_path, capsys):
    found = []
    for name in ("a.png", "b.png"):
        code, out, err = run(capsys, "map", "plot", path, "--output", tmp_path / name, "--json")
        assert (code, err) == (0, f"drawing {tmp_path / name}\n")
        found.append(json.loads(out))
    content = (tmp_path / "a.png").read_bytes()
    assert content == (tmp_path / "b.png").read_bytes()
    assert f"map {picture.nut_map.header['file_hash']}".encode() in content
    states = picture.by_preload, picture.by_temperature
    torques = np.concatenate([np.ravel(state.friction_torque) for state in states])
    assert found[0]["friction_torque_nm"] == pytest.approx([torques.min(), torques.max()], rel=1e-12)
    assert found[0]["speed_rpm"] == pytest.approx([100.0, 1000.0])
    assert found[0]["samples"] == len(RACEWAYS) * GRID.contact_first
    each = picture.nut_map.header["certificate"]["each"]
    for name in ERRORS:
        assert found[0][f"{name}_error"] == [min(each[f"{name}_error"]), max(each[f"{name}_error"])]
    # the points of a certificate stay out of tables
    assert "each" not in run(capsys, "map", "info", path)[1]
    # the packaged map; its points have the error of the torque alone
    code, out, _ = run(capsys, "map", "plot", "--output", tmp_path / "c.png", "--json")
    assert (code, json.loads(out)["temperature_c"]) == (0, [10.0, 80.0])
