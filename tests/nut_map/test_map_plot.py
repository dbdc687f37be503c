"""The picture of a map: curves, samples and points of the certificate are those of the map."""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import run
from reference_screw import GD4008
from synthetic_contacts import GRID, closed_build, closed_contact, partly_failed_contact, small_map

from ballscrew_fmu.pages.friction import documentation_files
from ballscrew_tehl.cli.parser import CERTIFIED
from ballscrew_tehl.nut_map import build, certificate
from ballscrew_tehl.nut_map.certificate import Deviation, deviation_from_direct, operating_points
from ballscrew_tehl.nut_map.file import load_contact_map, load_map, save_map
from ballscrew_tehl.nut_map.plot import (
    ERROR_SPAN,
    ERRORS,
    caption,
    map_figure,
    map_picture,
    percent,
    save_figure,
)
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.load import double_nut_loads
from ballscrew_tehl.runtime.packed import POINT

TOTALS = {"points": 24, "torque_error_mean": 2e-3, "torque_error_max": 0.03}


def found_deviation(nut_map, parameters, point):
    """Different in every column and at every point."""
    share = (point[0] % 7.0 + 0.1) / 7.0
    return Deviation(0.01 * share, 0.1 * share**2, share**3)


def certified(nut_map, count=9):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(certificate, "deviation_at", found_deviation)
        return deviation_from_direct(nut_map, GD4008, count)


def saved(folder, certificate=None, built=None) -> Path:
    """A map file; without a certificate one with points is added."""
    path = folder / "small.nc"
    if certificate is None:
        save_map(path, built or small_map(), {})
        certificate = certified(load_map(path, GD4008))
    save_map(path, built or small_map(), certificate)
    return path


def picture_of(path):
    return map_picture(load_map(path, GD4008), load_contact_map(path, GD4008))


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return saved(tmp_path_factory.mktemp("map"))


@pytest.fixture(scope="module")
def picture(path):
    return picture_of(path)


@pytest.fixture(scope="module")
def figure(picture):
    return map_figure(picture)


def panel(figure, name):
    (axes,) = (axes for axes in figure.axes if axes.get_label() == name)
    return axes


def lines(axes):
    """Coordinates of the lines that hold data (entries of a legend hold none)."""
    return [line.get_xydata().T for line in axes.lines if line.get_xydata().size]


# --- lines ---


def test_lines_are_the_values_of_the_map_point_by_point(picture, figure):
    nut_map, speeds = picture.nut_map, picture.speed

    def answers(preload, temperature):
        # one point at a time, other than the picture
        return [nut_map.evaluate(float(preload), float(w), float(temperature)) for w in speeds[::40]]

    assert (speeds[0], speeds[-1]) == tuple(GRID.speed[:2])
    by_preload = [answers(f, picture.temperature) for f in picture.preloads]
    by_temperature = [answers(picture.preload, t) for t in picture.temperatures]
    assert all(state.in_range for row in by_preload + by_temperature for state in row)
    drawn = {
        "torque_by_preload": [[sum(state[:3]) for state in row] for row in by_preload],
        "torque_by_temperature": [[sum(state[:3]) for state in row] for row in by_temperature],
        "rise": [[state.film_temperature_rise for state in row] for row in by_temperature],
        "film": [
            [1e9 * getattr(state, f"film_thickness_{name}") for state in by_temperature[row]]
            for name in ("central_screw", "central_nut", "min")
            for row in picture.film_rows
        ],
    }
    for name, expected in drawn.items():
        found = lines(panel(figure, name))
        assert len(found) == len(expected)
        for (x, y), row in zip(found, expected, strict=True):
            assert x * RPM == pytest.approx(speeds, rel=1e-12)
            assert y[::40] == pytest.approx(row, rel=1e-9)
        assert panel(figure, name).get_xscale() == "log"


def test_reference_temperature_beyond_the_map_is_its_end(tmp_path):
    warm = closed_build(grid=replace(GRID, temperature=(313.15, 333.15, 4)))
    picture = picture_of(saved(tmp_path, {}, warm))
    assert picture.temperature == 313.15
    assert picture.temperatures == pytest.approx([313.15, 323.15, 333.15])
    assert picture.film_rows == [0, 2]


# --- samples ---


def test_asymptotic_samples_are_marked_on_their_raceway(tmp_path):
    def solve(parameters, raceway, load, speed, temperature):
        found = closed_contact(parameters, raceway, load, speed, temperature)
        marked = raceway == "nut" and load > 100.0 and speed < 20.0 and temperature < 300.0
        return found | {"asymptotic": float(marked)}

    figure = map_figure(picture_of(saved(tmp_path, {}, closed_build(solve=solve))))
    assert len(lines(panel(figure, "screw"))) == 1
    x, y = lines(panel(figure, "nut"))[1]
    load, speed, temperature = small_map().contact_map.contacts["nut"].points.T
    expected = (load > 100.0) & (speed < 20.0) & (temperature < 300.0)
    assert expected.sum() >= 2
    assert y == pytest.approx(load[expected])
    assert x * RPM == pytest.approx(speed[expected])


def test_contacts_that_were_not_solved_are_marked(tmp_path, monkeypatch):
    monkeypatch.setattr(build, "UNCERTAIN", np.inf)
    picture = picture_of(saved(tmp_path, {}, closed_build(solve=partly_failed_contact)))
    figure = map_figure(picture)
    contacts = picture.contact_map.contacts["nut"]
    solved, flagged, lost = (xy for xy in lines(panel(figure, "nut")))
    assert solved[1] == pytest.approx(contacts.points[contacts.good, 0])
    assert flagged[1].min() > 100.0
    assert lost[1] == pytest.approx(contacts.points[~contacts.good, 0])
    assert lost[0] * RPM == pytest.approx(contacts.points[~contacts.good, 1])
    assert "not solved" in [text.get_text() for text in panel(figure, "nut").get_legend().get_texts()]
    assert "not solved" not in [text.get_text() for text in panel(figure, "screw").get_legend().get_texts()]
    count = int((~contacts.good).sum())
    text = caption(picture).replace("\n", " ")
    assert f"{96 - count} on the nut raceway" in text
    assert f"; {count} not solved." in text


# --- certificate ---


def test_certificate_holds_each_point_and_its_deviations(path):
    nut_map = load_map(path, GD4008)
    each, points = nut_map.header["certificate"]["each"], operating_points(nut_map, 9)
    assert list(POINT) == ["preload", "speed", "temperature", "axial_load"]
    for name, column in zip(POINT, points.T, strict=True):
        assert each[name] == pytest.approx(column, rel=1e-5)
    errors = [found_deviation(nut_map, GD4008, point) for point in points.tolist()]
    for name, column in zip(ERRORS, np.array(errors).T, strict=True):
        assert each[f"{name}_error"] == pytest.approx(column, rel=1e-2)
        assert nut_map.header["certificate"][f"{name}_error_max"] == column.max()
    assert set(each) == {*POINT, *(f"{name}_error" for name in ERRORS)}
    # a thousand points: tens of kilobytes
    assert len(json.dumps(each)) < 80 * 9 + 200


@pytest.mark.parametrize("error", ERRORS)
def test_points_of_the_certificate_are_drawn_at_their_heaviest_ball_with_their_error(picture, error):
    each = picture.nut_map.header["certificate"]["each"]
    figure = map_figure(picture, error)
    columns = [each[name] for name in POINT]
    heaviest = [
        double_nut_loads(GD4008.screw, preload, axial, GD4008.screw.loaded_ball_count)
        for preload, axial in zip(each["preload"], each["axial_load"], strict=True)
    ]
    for raceway in RACEWAYS:
        (points,) = panel(figure, raceway).collections
        rpm, load = np.asarray(points.get_offsets()).T
        assert rpm * RPM == pytest.approx(each["speed"], rel=1e-12)
        answers = [picture.nut_map.evaluate(*point).ball_load_max for point in zip(*columns, strict=True)]
        assert load == pytest.approx(answers, rel=1e-9)
        # the map shares the force of a nut among its balls as without axial load
        assert load == pytest.approx([max(both.Q_a.max(), both.Q_b.max()) for both in heaviest], rel=0.05)
        found = np.asarray(points.get_array())
        lowest = max(min(each[f"{error}_error"]), ERROR_SPAN * max(each[f"{error}_error"]))
        assert found == pytest.approx(np.maximum(each[f"{error}_error"], lowest), rel=1e-12)
        # larger for a larger error
        assert (np.diff(points.get_sizes()[np.argsort(found)]) >= 0.0).all()
        assert points.get_sizes().max() > 2.0 * points.get_sizes().min()
        assert (points.norm.vmin, points.norm.vmax) == (found.min(), found.max())
    bar = panel(figure, "<colorbar>")
    assert ERRORS[error] in bar.get_xlabel()


@pytest.mark.slow
@pytest.mark.parametrize("errors", [[0.0], [2e-4, 0.0, 2e-4]])
def test_equal_and_vanishing_errors_are_drawn(tmp_path, errors):
    each = {
        name: [value] * len(errors) for name, value in zip(POINT, (2000.0, 50.0, 300.0, 0.0), strict=True)
    }
    each |= {f"{name}_error": errors for name in ERRORS}
    figure = map_figure(picture_of(saved(tmp_path, {"points": len(errors), "each": each})))
    save_figure(figure, tmp_path / "p.png", "x")
    (points,) = panel(figure, "nut").collections
    assert np.asarray(points.get_array()) == pytest.approx(np.maximum(errors, points.norm.vmin), rel=1e-12)
    assert points.norm.vmax == max(*errors, 1e-9)
    assert points.norm.vmin >= 0.999e-3 * points.norm.vmax
    assert np.isfinite(points.get_sizes()).all()
    assert points.norm.vmin < points.norm.vmax


@pytest.mark.slow
@pytest.mark.parametrize(
    ("certificate", "words"),
    [({}, "The map has no certificate."), (TOTALS, "largest 3 %. The file does not hold the points.")],
    ids=["none", "older file"],
)
def test_map_without_points_is_drawn_without_them(tmp_path, capsys, certificate, words):
    path = saved(tmp_path, certificate)
    picture = picture_of(path)
    assert picture.certificate is None
    assert words in caption(picture).replace("\n", " ")
    figure = map_figure(picture)
    assert not any(axes.collections for axes in figure.axes)
    assert "<colorbar>" not in [axes.get_label() for axes in figure.axes]
    code, out, _ = run(capsys, "map", "plot", path, "--output", tmp_path / "p.png", "--json")
    assert code == 0
    found = json.loads(out)
    assert found["certificate_points"] == 0
    assert [found[f"{name}_error"] for name in ERRORS] == [None] * 3


def test_caption_states_sampling_errors_and_certificate(picture, figure):
    text = figure.get_supxlabel()
    assert text == caption(picture)
    screw, nut = (picture.nut_map.header["sampling_errors"][raceway] for raceway in RACEWAYS)
    flat = text.replace("\n", " ")
    assert 0.0 < screw != nut
    assert f"when its contact is left out: {percent(screw)} and {percent(nut)}." in flat
    contacts = picture.contact_map.contacts
    share = np.mean([np.mean(contacts[raceway].points[:, 0] > 100.0) for raceway in RACEWAYS])
    assert "96 on the screw and 96 on the nut raceway" in flat
    assert f"{percent(share)} of them on the asymptotic branch; 0 not solved." in flat
    totals = picture.nut_map.header["certificate"]
    for name, words in ERRORS.items():
        numbers = [f"{100.0 * totals[f'{name}_error_{key}']:.2g}" for key in ("mean", "99", "999", "max")]
        shown = "{} mean {} %, 99 % quantile {} %, 99.9 % quantile {} %, largest {} %"
        assert shown.format(words, *numbers) in flat
    assert "does not hold the points" not in flat
    assert picture.nut_map.header["file_hash"][:12] in flat


def test_points_of_the_certificate_stay_out_of_tables_and_documentation(path, capsys, monkeypatch):
    assert re.search(r"(?m)^torque_error( +\S+){6}$", run(capsys, "map", "info", path)[1])
    assert "each" not in run(capsys, "map", "info", path)[1]
    assert "each" in json.loads(run(capsys, "map", "info", path, "--json")[1])["certificate"]
    monkeypatch.setattr(certificate, "deviation_at", found_deviation)
    code, out, _ = run(capsys, "map", "check", path, "--count", "9", "--json")
    assert code == 0
    assert "each" not in json.loads(out)
    page = documentation_files(load_map(path, GD4008).header)["index.html"]
    assert re.search(r"<td>friction torque</td>(<td>[^<]* %</td>)+", page)
    assert "axial_load&quot;: [" not in page


# --- command ---


@pytest.mark.slow
def test_json_holds_file_and_extremes_of_the_curves(path, picture, figure, tmp_path, capsys):
    target = tmp_path / "picture.png"
    code, out, err = run(capsys, "map", "plot", path, "--output", target, "--json")
    assert (code, err) == (0, f"drawing {target}\n")
    found = json.loads(out)
    assert found["file"] == str(target)
    assert target.read_bytes().startswith(b"\x89PNG")
    assert [entry.name for entry in tmp_path.iterdir()] == ["picture.png"]

    def ends(name, rows=slice(None)):
        values = np.concatenate([y for _, y in lines(panel(figure, name))[rows]])
        return pytest.approx([values.min(), values.max()], rel=1e-12)

    torques = np.array([y for name in ("torque_by_preload", "torque_by_temperature")
                        for _, y in lines(panel(figure, name))])  # fmt: skip
    assert found["friction_torque_nm"] == pytest.approx([torques.min(), torques.max()], rel=1e-12)
    assert found["film_temperature_rise_k"] == ends("rise")
    for k, name in enumerate(("central_screw", "central_nut", "min")):
        films = 1e9 * np.array(found[f"film_thickness_{name}_m"])
        assert films == ends("film", slice(3 * k, 3 * k + 3))
    assert found["speed_rpm"] == pytest.approx([100.0, 1000.0])
    assert found["preload_n"] == [500.0, 5000.0]
    assert found["temperature_c"] == pytest.approx([20.0, 40.0])
    assert found["ball_load_n"] == pytest.approx(picture.nut_map.header["contact_range"]["load"])
    assert found["samples"] == len(RACEWAYS) * GRID.contact_first
    for raceway in RACEWAYS:
        error = picture.nut_map.header["sampling_errors"][raceway]
        assert found[f"sampling_error_{raceway}"] == error > 0.0
    each = picture.nut_map.header["certificate"]["each"]
    assert found["certificate_points"] == 9
    for name in ERRORS:
        assert found[f"{name}_error"] == [min(each[f"{name}_error"]), max(each[f"{name}_error"])]
    assert (found["screw"], found["kinematics"]) == ("GD4008-3", "published")
    assert found["map_hash"] == picture.nut_map.header["file_hash"]


@pytest.mark.slow
def test_packaged_map_is_drawn(tmp_path, capsys):
    target = tmp_path / "map.PNG"
    code, out, _ = run(capsys, "map", "plot", "--output", target, "--json")
    assert code == 0
    found = json.loads(out)
    assert found["kinematics"] == "published"
    assert found["temperature_c"] == [10.0, 80.0]
    assert 0.0 < found["friction_torque_nm"][0] < found["friction_torque_nm"][1]
    assert target.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("output", "named"),
    [
        ("nowhere/map.png", "nowhere/map.png: no such folder; allowed: a file *.png in a folder that exists"),
        ("file/map.png", "file is not a folder; allowed: a path below a folder"),
        ("map.jpg", "map.jpg; allowed: a file *.png"),
        ("folder.png", "folder.png: is a folder; allowed: a file *.png"),
        (".", "allowed: a file *.png"),
        (None, "arguments are required: --output"),
    ],
)
def test_bad_output_is_refused_in_one_line_before_anything_is_read(tmp_path, capsys, output, named):
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.png").mkdir()
    before = sorted(tmp_path.rglob("*"))
    target = [] if output is None else ["--output", tmp_path / output]
    code, out, err = run(capsys, "map", "plot", tmp_path / "none.nc", *target)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert named in err
    assert sorted(tmp_path.rglob("*")) == before


def test_bad_map_and_unknown_error_are_refused(path, picture, tmp_path, capsys):
    code, out, err = run(capsys, "map", "plot", tmp_path / "none.nc", "--output", tmp_path / "p.png")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "none.nc: no such map file" in err
    with pytest.raises(ValueError, match="error = 'pressure'; allowed: torque, film, temperature_rise"):
        map_figure(picture, "pressure")
    assert CERTIFIED == tuple(ERRORS) == Deviation._fields
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_keeps_the_old_picture(path, figure, tmp_path, monkeypatch, capsys):
    from matplotlib.figure import Figure

    def full(self, target, **settings):
        Path(target).write_bytes(b"half")
        raise OSError(28, "No space left on device", str(target))

    (tmp_path / "p.png").write_bytes(b"old")
    monkeypatch.setattr(Figure, "savefig", full)
    code, out, err = run(capsys, "map", "plot", path, "--output", tmp_path / "p.png")
    assert (code, out) == (2, "")
    drawing, _ = err.splitlines()
    assert drawing == f"drawing {tmp_path / 'p.png'}"
    assert "No space left" in err
    assert [(entry.name, entry.read_bytes()) for entry in tmp_path.iterdir()] == [("p.png", b"old")]


@pytest.mark.slow
def test_same_map_same_picture(path, picture, tmp_path, capsys):
    (tmp_path / "a.png").write_bytes(b"old")
    os.link(tmp_path / "a.png", tmp_path / "kept")
    for name in ("a.png", "b.png"):
        assert run(capsys, "map", "plot", path, "--output", tmp_path / name)[0] == 0
    content = (tmp_path / "a.png").read_bytes()
    assert content == (tmp_path / "b.png").read_bytes()
    # renamed into its place, not written over what was there
    assert (tmp_path / "kept").read_bytes() == b"old"
    assert f"map {picture.nut_map.header['file_hash']}".encode() in content


@pytest.mark.slow
def test_importing_and_the_numbers_need_no_matplotlib(path):
    code = (
        "import sys; import ballscrew_tehl.cli.commands.map_file; from ballscrew_tehl.nut_map.plot import *;"
        "from ballscrew_tehl.nut_map.file import *; from ballscrew_tehl.parameters.file import load_parameters as p;"
        "caption(map_picture(load_map(sys.argv[1], p()), load_contact_map(sys.argv[1], p())));"
        "assert not {'matplotlib', 'numba', 'xarray'} & set(sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
