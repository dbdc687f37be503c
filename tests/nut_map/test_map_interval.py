"""Interval of the torque from the contacts of a map, and the band in its header."""

import json

import pytest
from synthetic_contacts import GRID, closed_build

from ballscrew_tehl.friction.interval import fit_of, zero_fitted
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map import file as store
from ballscrew_tehl.nut_map.file import load_contact_map, load_map, save_map
from ballscrew_tehl.nut_map.interval import BAND, band_point, map_interval
from ballscrew_tehl.parameters.file import changed, load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA

LAW = load_parameters(PACKAGED_DATA / "gd4008_vg100.toml")
POINT = (2000.0, 50.0, 303.15)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    file = tmp_path_factory.mktemp("map") / "law.nc"
    save_map(file, closed_build(LAW), {})
    return file


@pytest.fixture(scope="module")
def at(path):
    """Interval at an operating point, zero fitted."""
    contacts, axes = load_contact_map(path, LAW), load_map(path, LAW).header["axes"]
    return lambda *point: map_interval(LAW, contacts, axes, zero_fitted(LAW), *point)


def test_torque_is_that_of_the_map(path, at):
    """Within the error of the spline through the nodes of this small map."""
    nut_map, zero = load_map(path, LAW), zero_fitted(LAW)
    for axial_load in (0.0, 800.0, -800.0):
        state = nut_map.evaluate(*POINT, axial_load, *zero.values[:2])
        found = at(*POINT, axial_load)
        assert found.torque == pytest.approx(float(state.friction_torque), rel=2e-3)
        assert found.low < found.torque < found.high


def test_beyond_the_axes_the_nearest_point_counts(at):
    slow, fast, _ = GRID.speed
    cold, hot, _ = GRID.temperature
    assert at(1e6, 1e5, 500.0) == at(GRID.force[1], fast, hot)
    assert at(1.0, -1e-3, 200.0) == at(GRID.force[0], slow, cold)
    # a nut without load has no friction
    assert at(*POINT, 1e5).torque < at(GRID.force[1], *POINT[1:]).torque


def test_band_is_in_the_header_of_the_law(path, monkeypatch):
    header = load_map(path, LAW).header
    band, friction_set = header[BAND], default_friction_set(LAW)
    point = band_point(header["axes"])
    assert tuple(band[name] for name in ("preload", "speed", "temperature")) == point
    contacts = load_contact_map(path, LAW)
    found = map_interval(LAW, contacts, header["axes"], friction_set, *point)
    assert (band["low"], band["high"]) == pytest.approx(found.relative, rel=1e-12)
    assert band["fitted"] is (fit_of(friction_set, LAW) is not None) is True
    assert json.loads(json.dumps(band)) == band
    # the stored one is taken as long as the numbers are those of the build
    monkeypatch.setattr(store, "band", None)
    assert load_map(path, LAW).header[BAND] == band


@pytest.mark.parametrize("friction", [{"boundary_friction": 0.1}, {"ball_thrust": 0.7}])
def test_band_follows_the_constants(path, friction):
    own = changed(LAW, friction=friction)
    one, two = (load_map(path, parameters).header[BAND] for parameters in (LAW, own))
    assert one["numbers"] != two["numbers"]
    assert (one["low"], one["high"]) != (two["low"], two["high"])
    # the packaged number was fitted with the constants of its own screw file
    assert two["fitted"] is False
