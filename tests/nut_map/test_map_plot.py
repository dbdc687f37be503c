"""The picture of a map: its curves are those of the map; its command."""

import numpy as np
import pytest
from command_line import run
from reference_screw import GD4008
from synthetic_contacts import CERTIFICATE, GRID, nut_map_of, small_map

from ballscrew_tehl.nut_map.file import save_map
from ballscrew_tehl.nut_map.plot import map_figure, map_picture
from ballscrew_tehl.parameters.units import RPM


@pytest.mark.slow
def test_lines_are_the_values_of_the_map():
    picture = map_picture(nut_map_of(small_map()), GD4008)
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
    panels = {axes.get_label(): axes for axes in figure.axes}
    for name, expected in drawn.items():
        # entries of a legend hold no data
        lines = [line.get_xydata().T for line in panels[name].lines if line.get_xydata().size]
        for (x, y), values in zip(lines, expected, strict=True):
            np.testing.assert_allclose(x * RPM, speeds, rtol=1e-12)
            np.testing.assert_allclose(y, values, rtol=1e-9)
    assert f"{CERTIFICATE['points']} points of {CERTIFICATE['what']}" in figure.get_supxlabel()
    assert "friction torque largest 0.05 %" in figure.get_supxlabel()


@pytest.mark.slow
def test_command_writes_the_same_picture(tmp_path, capsys):
    path = tmp_path / "map.npz"
    file_hash = save_map(path, small_map())
    for name in ("a.png", "b.png"):
        code, _, err = run(capsys, "map", "plot", path, "--output", tmp_path / name, "--json")
        assert (code, err) == (0, f"drawing {tmp_path / name}\n")
    content = (tmp_path / "a.png").read_bytes()
    assert content == (tmp_path / "b.png").read_bytes()
    assert f"map {file_hash}".encode() in content
