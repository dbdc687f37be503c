"""The screws of examples/screws: sizes, range of their map, ball loads in it."""

import math
import re

import numpy as np
import pytest
from paths import ROOT

from ballscrew_tehl.nut_map.grid import COLDEST, HOTTEST, ball_range, map_grid
from ballscrew_tehl.parameters.file import load_screw
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.ball_law import contact_angle_at_ball_load
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.physics.lubricant import eta0

FILES = sorted((ROOT / "examples/screws").glob("*.toml"))
#: two digits of the ends of a range: rounded down by less than a tenth
ROUNDED = 1.0 / 1.1


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_range_follows_from_screw_and_oil_and_holds_its_ball_loads(path):
    assert path.read_text(encoding="utf-8").startswith("# EXAMPLE, not a product: ")
    parameters = load_screw(path)
    diameter, lead = map(int, re.findall(r"\d+", path.stem))
    screw, grid = parameters.screw, map_grid(parameters)
    assert screw.lead == pytest.approx(1e-3 * lead, rel=1e-12)
    # the balls run near the outer diameter of the thread
    assert 0.5e-3 * diameter < screw.nominal_radius < 0.5e-3 * diameter + 0.5 * screw.ball_diameter
    heaviest = float(nut_loads(screw, grid.preload[1], screw.loaded_ball_count).max())
    angle = float(contact_angle_at_ball_load(screw, heaviest))
    radii = [reduced_radii(screw, angle, raceway) for raceway in RACEWAYS]
    pressure = max(float(ellipse(heaviest, *both, E_prime(screw)).p_max) for both in radii)
    # pressure grows with the cube root of load
    assert ROUNDED ** (1.0 / 3.0) * 2.1e9 < pressure <= 2.1e9
    assert ROUNDED * 240e3 < 2e3 * screw.nominal_radius * grid.speed[1] / RPM <= 240e3 * (1.0 + 1e-9)
    cold, hot = grid.temperature[:2]
    viscosity = [float(eta0(parameters.lubricant, t)) for t in (hot, cold)]
    assert 2e-3 <= viscosity[0] < viscosity[1] <= 2.0
    assert cold == COLDEST or float(eta0(parameters.lubricant, cold - 1.0)) > 2.0
    assert hot == HOTTEST or float(eta0(parameters.lubricant, hot + 1.0)) < 2e-3
    low, high = ball_range(parameters, grid).load
    for force in (*grid.force[:2], *grid.preload[:2]):
        loads = nut_loads(screw, force, screw.loaded_ball_count)
        assert low <= loads.min() <= loads.max() <= high
        angles = np.array([float(contact_angle_at_ball_load(screw, load)) for load in loads])
        axial = float(np.sum(loads * np.sin(angles))) * math.cos(screw.lead_angle)
        assert axial == pytest.approx(force, rel=1e-3)
