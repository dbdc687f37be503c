"""The range of a map follows from the screw and its oil."""

import math

import pytest
from reference_screw import GD4008

from ballscrew_tehl.nut_map.grid import (
    MapGrid,
    ball_range,
    force_at_pressure,
    map_grid,
    screw_grid,
    temperature_range,
)
from ballscrew_tehl.parameters.file import FOUR_POINT, changed
from ballscrew_tehl.physics.ball_law import flank_travel, largest_oversize
from ballscrew_tehl.physics.load import largest_preload, nut_loads, separation_load
from ballscrew_tehl.physics.lubricant import eta0

SCREW = GD4008.screw


def oil(viscosity):
    return changed(GD4008, lubricant={"viscosity": viscosity})


def test_range_holds_the_loads_of_all_balls_and_no_more():
    """The range itself is that of tests/examples/test_screws.py; of the packaged screw it is the default."""
    grid = map_grid(GD4008)
    for name in ("force", "speed", "temperature", "preload"):
        assert getattr(grid, name) == pytest.approx(getattr(MapGrid(), name), rel=1e-12)
    found = ball_range(GD4008, grid)
    assert (found.speed, found.temperature) == (grid.speed[:2], grid.temperature[:2])
    counts = SCREW.ball_count, SCREW.loaded_ball_count
    lightest = min(nut_loads(SCREW, grid.force[0], count).min() for count in counts)
    heaviest = max(nut_loads(SCREW, grid.force[1], count).max() for count in counts)
    assert 0.95 * lightest < found.load[0] < lightest < heaviest < found.load[1] < 1.05 * heaviest


def test_given_ends_come_before_those_of_the_file_and_these_before_the_screw():
    own = changed(GD4008, map={"preload_min": 300, "preload_max": 3000, "speed_min": 5, "speed_max": 80})
    grid = screw_grid(own, {"speed_min": 10.0, "speed_max": 100.0})
    assert (grid.preload[:2], grid.speed[:2]) == ((300.0, 3000.0), (10.0, 100.0))
    assert grid.temperature == map_grid(GD4008).temperature
    # an axial load relieves one nut
    assert grid.force[0] < 0.2 * 300.0
    assert grid.force[1] == 3000.0


def test_preload_ends_where_no_axial_load_frees_an_oversize_ball():
    """Close grooves at a small contact angle: before the pressure does."""
    close = {
        "preload_kind": FOUR_POINT, "contact_angle": math.radians(15.0),
        "screw_raceway_radius": 0.51 * SCREW.ball_diameter, "nut_raceway_radius": 0.51 * SCREW.ball_diameter,
    }  # fmt: skip
    own = changed(GD4008, friction={"law": "mechanistic"}, screw=close)
    screw, count = own.screw, own.screw.loaded_ball_count
    most, highest = largest_preload(screw, count), map_grid(own).preload[1]
    assert highest == pytest.approx(0.9 * most, rel=0.1)
    assert highest < 0.9 * force_at_pressure(screw)
    # the limit is that of flank_travel, and the whole range has a load that relieves the flanks
    with pytest.raises(ValueError, match="the preload is beyond these grooves"):
        flank_travel(screw, largest_oversize(screw))
    assert separation_load(screw, highest, count) > highest
    with pytest.raises(ValueError, match="no axial load frees balls that are larger"):
        map_grid(own, preload=(0.1 * most, 1.001 * most))
    assert largest_preload(SCREW, SCREW.ball_count) == math.inf


def test_temperatures_end_where_the_oil_is_too_thick_or_too_thin():
    for viscosity, end, other, limit in ((1.0, 0, 353.15, 2.0), (8e-3, 1, 283.15, 2e-3)):
        ends = temperature_range(oil(viscosity))
        beyond, inside = (
            eta0(oil(viscosity).lubricant, ends[end] + step) for step in ((-1, 0) if end == 0 else (1, 0))
        )
        assert min(beyond, inside) <= limit <= max(beyond, inside)
        assert ends[1 - end] == other
    for viscosity in (5e-4, 29.0):
        with pytest.raises(ValueError, match=r"over 10 K: give --temperature-c"):
            map_grid(oil(viscosity))
