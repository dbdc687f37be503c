"""The example screws of this folder: their range of a map, and small maps with solved contacts."""

import math
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map.build import build_map
from ballscrew_tehl.nut_map.certificate import operating_points
from ballscrew_tehl.nut_map.file import load_map, save_map
from ballscrew_tehl.nut_map.grid import COLDEST, HOTTEST, MapGrid, contact_range, map_grid
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.load import contact_angle_at_ball_load, nut_loads
from ballscrew_tehl.physics.lubricant import eta0
from ballscrew_tehl.refinement.direct import mean_ball_state

FILES = sorted((Path(__file__).parent / "screws").glob("*.toml"))
SCREWS = {path.stem: load_parameters(path) for path in FILES}
#: two digits of the ends of a range: rounded down by less than a tenth
ROUNDED = 1.0 / 1.1


def test_screws_cover_kinds_sizes_and_oils():
    assert len(SCREWS) == 10
    kinds = [parameters.screw.preload_kind for parameters in SCREWS.values()]
    assert set(kinds) == {"double_nut", "single_nut_offset", "single_nut_oversize_ball"}
    sizes = {re.fullmatch(r"example_(\d\d)x(\d\d)", name).groups() for name in SCREWS}
    assert {("08", "02"), ("80", "20")} <= sizes
    oils = [parameters.lubricant for parameters in SCREWS.values()]
    assert {32, 220} <= {oil.iso_vg for oil in oils}
    assert sum("grease" in oil.name for oil in oils) == 2


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_file_is_an_example_and_named_after_its_size(path):
    diameter, lead = map(int, re.findall(r"\d+", path.stem))
    assert path.read_text(encoding="utf-8").startswith("# EXAMPLE, not a product: ")
    parameters = load_parameters(path)
    screw = parameters.screw
    assert parameters.name == f"example {diameter}x{lead}"
    assert screw.lead == pytest.approx(1e-3 * lead, rel=1e-12)
    # the balls run near the outer diameter of the thread
    assert 0.5e-3 * diameter < screw.nominal_radius < 0.5e-3 * diameter + 0.5 * screw.ball_diameter
    assert 0.1 < screw.ball_diameter / (1e-3 * diameter) < 0.25
    for radius in (screw.screw_raceway_radius, screw.nut_raceway_radius):
        assert 0.515 < radius / screw.ball_diameter < 0.545


@pytest.mark.parametrize("name", SCREWS)
def test_range_follows_from_screw_and_oil(name):
    parameters = SCREWS[name]
    screw, grid = parameters.screw, map_grid(parameters)
    heaviest = float(nut_loads(screw, grid.preload[1], screw.loaded_ball_count).max())
    angle = float(contact_angle_at_ball_load(screw, heaviest))
    radii = [reduced_radii(screw, angle, raceway) for raceway in RACEWAYS]
    pressure = max(float(ellipse(heaviest, *both, E_prime(screw)).p_max) for both in radii)
    # pressure grows with the cube root of load
    assert ROUNDED ** (1.0 / 3.0) * 2.1e9 < pressure <= 2.1e9
    # mm r/min over the diameter of the ball centre circle
    speed_factor = 2e3 * screw.nominal_radius * grid.speed[1] / RPM
    assert ROUNDED * 240e3 < speed_factor <= 240e3 * (1.0 + 1e-9)
    cold, hot = grid.temperature[:2]
    assert COLDEST <= cold < hot <= HOTTEST
    viscosity = [float(eta0(parameters.lubricant, t)) for t in (hot, cold)]
    assert 2e-3 <= viscosity[0] < viscosity[1] <= 2.0
    assert cold == COLDEST or float(eta0(parameters.lubricant, cold - 1.0)) > 2.0
    assert hot == HOTTEST or float(eta0(parameters.lubricant, hot + 1.0)) < 2e-3


@pytest.mark.parametrize("name", SCREWS)
def test_ball_loads_carry_the_force_and_lie_in_the_range(name):
    parameters = SCREWS[name]
    screw, grid = parameters.screw, map_grid(parameters)
    low, high = contact_range(parameters, grid).load
    for force in (*grid.force[:2], *grid.preload[:2]):
        for count in (screw.ball_count, screw.loaded_ball_count):
            loads = nut_loads(screw, force, count)
            assert loads.size == count
            assert low <= loads.min() <= loads.max() <= high
            angles = np.array([float(contact_angle_at_ball_load(screw, load)) for load in loads])
            axial = float(np.sum(loads * np.sin(angles))) * math.cos(screw.lead_angle)
            assert axial == pytest.approx(force, rel=1e-3)


#: range of a small map from the highest preload and speed of its screw, oil temperatures [K]
PRELOADS, SPEEDS, TEMPERATURES = (0.1, 0.4), (0.05, 0.2), (303.15, 323.15)
SMALL = MapGrid(
    force=(1.0, 2.0, 13), speed=(1.0, 2.0, 9), temperature=(300.0, 310.0, 7), preload=(1.0, 2.0, 9),
    contact_first_atlas=32, contact_max_atlas=32,
)  # fmt: skip
#: relative error of the torque by the mechanistic law, whose rolling loss is interpolated over a closed formula
BOUND = 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", ["example_08x02", "example_16x05", "example_63x10"])
def test_small_map_agrees_with_direct_solves(tmp_path, name):
    parameters = SCREWS[name]
    whole = map_grid(parameters)
    preload, speed = ([share * axis[1] for share in shares] for shares, axis in (
        (PRELOADS, whole.preload), (SPEEDS, whole.speed)
    ))  # fmt: skip
    grid = map_grid(parameters, tuple(preload), tuple(speed), TEMPERATURES, SMALL)
    with ThreadPoolExecutor(1) as thread:
        built = build_map(parameters, grid=grid, executor=thread)
    assert built.header["contacts"] == 4 * SMALL.contact_first_atlas
    assert built.header["atlas_share"] == 1.0
    assert built.header["contacts_not_solved"] == 0
    path = tmp_path / "map.nc"
    save_map(path, built, {})
    nut_map, friction_set = load_map(path, parameters), default_friction_set(parameters)
    for point in operating_points(nut_map, 3).tolist():
        by_map = nut_map.evaluate(*point, *friction_set.values)
        solved = mean_ball_state(parameters, friction_set, *point)
        error = abs(float(by_map.friction_torque) / solved.friction_torque - 1.0)
        assert error <= BOUND


def test_small_range_lies_in_that_of_the_screws():
    for parameters in SCREWS.values():
        grid = map_grid(parameters)
        assert grid.preload[0] <= PRELOADS[0] * grid.preload[1]
        assert grid.speed[0] <= SPEEDS[0] * grid.speed[1]
        assert grid.temperature[0] <= TEMPERATURES[0] < TEMPERATURES[1] <= grid.temperature[1]
