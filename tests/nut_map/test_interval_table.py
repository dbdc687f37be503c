"""Interval over a map: its table against the law at a point, and of what it is."""

import numpy as np
import pytest

from ballscrew_tehl.atlas.ball_contacts import BallContacts
from ballscrew_tehl.friction.drag_torque import screw_friction_set
from ballscrew_tehl.friction.interval import OperatingPoint, torque_interval
from ballscrew_tehl.nut_map.grid import screw_grid
from ballscrew_tehl.nut_map.interval import TABLE_NODES, interval_table
from ballscrew_tehl.parameters.entries import changed_text
from ballscrew_tehl.parameters.file import PACKAGED_DATA, screw_of

TEXT = (PACKAGED_DATA / "example_25x10.toml").read_text(encoding="utf-8")


def axes_of(screw):
    grid = screw_grid(screw)
    axes = {name: getattr(grid, name) for name in ("force", "speed", "temperature", "preload")}
    return axes | {"share": (0.0, 1.0, grid.share_nodes), "difference": (-20.0, 20.0, grid.difference_nodes)}


def test_table_is_the_law_at_a_point_and_of_the_constants_that_a_file_states():
    screw = screw_of(TEXT)
    stated = TEXT
    for name in ("limiting_shear_coefficient", "boundary_friction"):
        stated = changed_text(stated, "friction", name, getattr(screw.friction, name))
    found = {}
    for text in (TEXT, stated):
        screw = screw_of(text)
        axes, numbers = axes_of(screw), screw_friction_set(screw)
        table = interval_table(screw, axes, numbers)
        place = 5, 6, 3
        lows, highs = zip(*(axes[name][:2] for name in ("force", "speed", "temperature")), strict=True)
        part = [k / (n - 1) for k, n in zip(place, TABLE_NODES, strict=True)]
        force, speed = (lows[k] * (highs[k] / lows[k]) ** part[k] for k in (0, 1))
        temperature = lows[2] + (highs[2] - lows[2]) * part[2]
        # three B-splines live at a node
        weights, (i, j, k) = np.array([1.0, 4.0, 1.0]) / 6.0, place
        around = table[i : i + 3, j : j + 3, k : k + 3]
        found[text] = np.exp(np.einsum("a,b,c,abce", weights, weights, weights, around))
        point = OperatingPoint(force / numbers.preload_factor, speed, temperature)
        expected = torque_interval(screw, point, BallContacts(screw), numbers).relative
        assert found[text] == pytest.approx(expected, rel=0.01)
        assert interval_table(screw, axes, numbers) is table
    # equal parameters, but what is stated is no longer unknown
    assert found[stated][1] - found[stated][0] < 0.95 * (found[TEXT][1] - found[TEXT][0])


def test_work_on_the_way_may_be_ended():
    class EndedError(Exception):
        pass

    def end():
        raise EndedError

    screw = screw_of(changed_text(TEXT, "screw", "seal_torque_Nm", 0.0123))
    with pytest.raises(EndedError):
        interval_table(screw, axes_of(screw), screw_friction_set(screw), end)
