"""The picture of a map: curves, samples and points of the certificate are those of the map; its command."""

from pathlib import Path

import numpy as np
import pytest
from command_line import run
from reference_screw import GD4008
from synthetic_contacts import GRID, small_map

from ballscrew_tehl.nut_map import certificate
from ballscrew_tehl.nut_map.certificate import Deviation, deviation_from_direct
from ballscrew_tehl.nut_map.file import load_contact_map, load_map, save_map
from ballscrew_tehl.nut_map.plot import ERROR_SPAN, ERRORS, map_figure, map_picture
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.runtime.packed import POINT


def row(nut_map, parameters, point):
    """Different in every column and at every point."""
    share = (point[0] % 7.0 + 0.1) / 7.0
    return Deviation(0.01 * share, 0.1 * share**2, share**3)


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("map") / "small.nc"
    save_map(path, small_map(), {})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(certificate, "deviation_at", row)
        save_map(path, small_map(), deviation_from_direct(load_map(path, GD4008), GD4008, 9))
    return path


def lines(figure, name):
    """Coordinates of the lines of a panel that hold data (entries of a legend hold none)."""
    (axes,) = (axes for axes in figure.axes if axes.get_label() == name)
    return [line.get_xydata().T for line in axes.lines if line.get_xydata().size]


@pytest.mark.slow
def test_lines_are_the_values_of_the_map_and_points_those_of_the_certificate(path):
    picture = map_picture(load_map(path, GD4008), load_contact_map(path, GD4008))
    nut_map, speeds, figure = picture.nut_map, picture.speed, map_figure(picture)
    assert (speeds[0], speeds[-1]) == tuple(GRID.speed[:2])
    by_preload = [nut_map.evaluate(float(f), speeds, picture.temperature) for f in picture.preloads]
    by_temperature = [nut_map.evaluate(picture.preload, speeds, float(t)) for t in picture.temperatures]
    drawn = {
        "torque_by_preload": [state.friction_torque for state in by_preload],
        "torque_by_temperature": [state.friction_torque for state in by_temperature],
        "rise": [state.film_temperature_rise for state in by_temperature],
        "film": [
            1e9 * getattr(by_temperature[k], f"film_thickness_{name}")
            for name in ("central_screw", "central_nut", "min")
            for k in picture.film_rows
        ],
    }
    for name, expected in drawn.items():
        for (x, y), values in zip(lines(figure, name), expected, strict=True):
            np.testing.assert_allclose(x * RPM, speeds, rtol=1e-12)
            np.testing.assert_allclose(y, values, rtol=1e-9)
    each = nut_map.header["certificate"]["each"]
    load = nut_map.evaluate(*(np.array(each[name]) for name in POINT)).ball_load_max
    for error in ERRORS:
        panels = {axes.get_label(): axes for axes in map_figure(picture, error).axes}
        errors = np.array(each[f"{error}_error"])
        for raceway in RACEWAYS:
            (points,) = panels[raceway].collections
            expected = np.stack([np.array(each["speed"]) / RPM, load], axis=1)
            np.testing.assert_allclose(points.get_offsets(), expected, rtol=1e-9)
            shown = np.asarray(points.get_array())
            np.testing.assert_allclose(shown, np.maximum(errors, ERROR_SPAN * errors.max()), rtol=1e-12)


@pytest.mark.slow
def test_command_writes_the_same_picture(path, tmp_path, capsys):
    for name in ("a.png", "b.png"):
        code, _, err = run(capsys, "map", "plot", path, "--output", tmp_path / name, "--json")
        assert (code, err) == (0, f"drawing {tmp_path / name}\n")
    content = (tmp_path / "a.png").read_bytes()
    assert content == (tmp_path / "b.png").read_bytes()
    assert f"map {load_map(path, GD4008).header['file_hash']}".encode() in content
    # the points of a certificate stay out of tables
    assert "each" not in run(capsys, "map", "info", path)[1]
