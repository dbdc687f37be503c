"""The range of a map follows from the screw and its oil, and shrinks before contacts that cannot be solved."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import GRID

from ballscrew_tehl.nut_map.grid import (
    BACK,
    COLDEST,
    HOTTEST,
    LOAD_MARGIN,
    PRESSURE_LIMIT,
    SPEED_FACTOR_LIMIT,
    THICKEST_OIL,
    THINNEST_OIL,
    MapGrid,
    contact_range,
    force_at_pressure,
    map_grid,
    narrowed,
    temperature_range,
)
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.parameters.screw import WIDEST_ENDS
from ballscrew_tehl.parameters.units import CELSIUS, RPM
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.load import contact_angle_at_ball_load, nut_loads
from ballscrew_tehl.physics.lubricant import T_MIN, eta0

SCREW = GD4008.screw


def screw_of(diameter, lead, ball, balls):
    """The packaged screw with other sizes [m]; grooves of the same conformity, three turns."""
    return changed(
        GD4008,
        screw={
            "nominal_radius": diameter / 2.0,
            "lead": lead,
            "lead_angle": math.atan(lead / (math.pi * diameter)),
            "ball_diameter": ball,
            "screw_raceway_radius": 0.52 * ball,
            "nut_raceway_radius": 0.52 * ball,
            "ball_count": balls,
            "loaded_ball_count": balls - 6,
        },
    )


SMALL, LARGE = screw_of(8e-3, 2e-3, 1.588e-3, 45), screw_of(80e-3, 20e-3, 12.7e-3, 57)


def oil(viscosity):
    """The packaged oil with another viscosity at its reference temperature."""
    return changed(GD4008, lubricant={"viscosity": viscosity})


# --- range ---


@pytest.mark.parametrize("pressure", [0.8e9, 1.4e9, PRESSURE_LIMIT])
@pytest.mark.parametrize("parameters", [GD4008, SMALL, LARGE], ids=["GD4008", "8x2", "80x20"])
def test_force_at_a_pressure_gives_that_pressure_back(parameters, pressure):
    """By the heaviest ball on the raceway with the higher pressure."""
    screw = parameters.screw
    force = force_at_pressure(screw, pressure)
    heaviest = float(nut_loads(screw, force, screw.loaded_ball_count).max())
    angle = float(contact_angle_at_ball_load(screw, heaviest))
    found = [
        float(ellipse(heaviest, *reduced_radii(screw, angle, raceway), E_prime(screw)).p_max)
        for raceway in RACEWAYS
    ]
    assert np.max(found) == pytest.approx(pressure, rel=1e-5)
    assert np.min(found) < 0.999 * pressure


def test_range_of_the_packaged_screw():
    """12 kN, 6000 r/min, 10 to 80 C; a hundredth and a thousandth of the preload, speed/1200."""
    grid = map_grid(GD4008)
    assert grid.preload == (120.0, 12000.0, MapGrid().preload[2])
    assert grid.force == (12.0, 12000.0, MapGrid().force[2])
    assert np.divide(grid.speed[:2], RPM) == pytest.approx([5.0, 6000.0], rel=1e-12)
    assert np.subtract(grid.temperature[:2], CELSIUS) == pytest.approx([10.0, 80.0])
    default = MapGrid()
    for name in ("force", "speed", "temperature", "preload"):
        assert getattr(grid, name) == pytest.approx(getattr(default, name), rel=1e-12)


def test_ranges_of_a_small_and_of_a_large_screw_differ():
    """Force by the pressure, speed by the diameter; rounded down to two digits."""
    small, large = map_grid(SMALL), map_grid(LARGE)
    assert large.preload[1] > 20.0 * small.preload[1]
    assert np.divide(small.speed[1], RPM) == pytest.approx(30000.0)
    assert np.divide(large.speed[1], RPM) == pytest.approx(3000.0)
    assert small.temperature == large.temperature
    for parameters, grid in ((SMALL, small), (LARGE, large)):
        most = force_at_pressure(parameters.screw)
        assert 0.9 * most < grid.preload[1] <= most
        two_digits = float(f"{grid.preload[1]:.1e}")
        assert grid.preload[1] == pytest.approx(two_digits, rel=1e-12)
        assert grid.preload[0] == pytest.approx(0.01 * grid.preload[1])
        assert grid.force[0] == pytest.approx(1e-3 * grid.preload[1])
        fastest = SPEED_FACTOR_LIMIT / (2.0 * parameters.screw.nominal_radius)
        assert 0.9 * fastest < grid.speed[1] <= 1.000001 * fastest


def test_given_ends_replace_those_of_the_screw():
    base = replace(GRID, contact_first=32)
    grid = map_grid(GD4008, (300.0, 3000.0), (1.0, 20.0), (300.0, 320.0), base)
    assert (grid.preload, grid.speed, grid.temperature) == (
        (300.0, 3000.0, base.preload[2]),
        (1.0, 20.0, base.speed[2]),
        (300.0, 320.0, base.temperature[2]),
    )
    assert grid.force == (3.0, 3000.0, base.force[2])
    assert grid.contact_first == 32
    # an axial load relieves one nut, of the lowest preload too
    assert map_grid(GD4008, (5.0, 3000.0)).force[0] == 0.5
    # each end by itself
    assert map_grid(GD4008, speed=(1.0, 20.0)).preload == map_grid(GD4008).preload


def test_temperatures_end_where_the_oil_is_too_thick_or_too_thin():
    thick, thin = oil(1.0), oil(8e-3)
    for parameters in (thick, thin):
        cold, hot = temperature_range(parameters)
        viscosity = eta0(parameters.lubricant, np.array([cold, hot]))
        assert THINNEST_OIL <= viscosity[1] < viscosity[0] <= THICKEST_OIL
    assert temperature_range(thick)[0] > COLDEST
    assert temperature_range(thick)[1] == HOTTEST
    assert float(eta0(thick.lubricant, temperature_range(thick)[0] - 1.0)) > THICKEST_OIL
    assert temperature_range(thin)[0] == COLDEST
    assert temperature_range(thin)[1] < HOTTEST
    assert float(eta0(thin.lubricant, temperature_range(thin)[1] + 1.0)) < THINNEST_OIL
    assert map_grid(thin).temperature[:2] == temperature_range(thin)


@pytest.mark.parametrize("viscosity", [5e-4, 1e3], ids=["thin", "thick"])
def test_oil_without_a_range_is_refused(viscosity):
    parameters = oil(viscosity)
    with pytest.raises(ValueError, match=r"over 10 K: give --temperature-c") as caught:
        map_grid(parameters)
    assert str(caught.value).startswith(f"{parameters.lubricant.name}: viscosity ")
    assert f"needs {THINNEST_OIL:g} to {THICKEST_OIL:g} Pa s" in str(caught.value)
    given = map_grid(parameters, temperature=(300.0, 320.0))
    assert given.temperature[:2] == (300.0, 320.0)


@pytest.mark.parametrize("pressure", [1e6, 1e12])
def test_pressure_that_no_force_reaches_is_refused(pressure):
    with pytest.raises(
        ValueError, match=r"no axial force from 1 to 1e\+07 N reaches it: check ball diameter"
    ) as caught:
        force_at_pressure(SCREW, pressure)
    assert str(caught.value).startswith(f"pressure limit = {1e-9 * pressure:.3g} GPa; ")


@pytest.mark.parametrize(
    "ends",
    [
        (0.0, 1.0),
        (-1.0, 1.0),
        (301.0, 300.0),
        (300.0, 300.0),
        (300.0, math.inf),
        (300.0, 1e9),
        (math.nan, 300.0),
    ],
)
@pytest.mark.parametrize(
    ("name", "unit", "scale", "zero", "widest"),
    [
        ("preload", "N", 1.0, 0.0, "0.01 <= lowest < highest <= 1e+07"),
        ("speed", "r/min", RPM, 0.0, "0.001 <= lowest < highest <= 1e+06"),
        ("temperature", "C", 1.0, -273.15, "-73.15 <= lowest < highest <= 500"),
    ],
)
def test_ends_that_are_no_range_are_refused_in_the_unit_of_the_options(name, unit, scale, zero, widest, ends):
    with pytest.raises(ValueError, match="lowest < highest") as caught:
        map_grid(GD4008, **{name: ends})
    low, high = (end / scale + zero for end in ends)
    assert str(caught.value) == f"{name} = {low:.6g} to {high:.6g} {unit}; needs {widest}"


def test_lowest_temperature_is_that_of_the_viscosity():
    assert WIDEST_ENDS["temperature"][0] == T_MIN


def test_preload_beyond_the_pressure_of_the_static_rating_is_refused():
    most = force_at_pressure(SCREW, 4.2e9)
    assert map_grid(GD4008, (100.0, 0.999 * most)).preload[1] == 0.999 * most
    with pytest.raises(ValueError, match=r"N: Hertz pressure up to 4\.2 GPa; allowed: 4\.2 GPa"):
        map_grid(GD4008, (100.0, 1.001 * most))


@pytest.mark.parametrize(
    ("ends", "found"), [((80.0, 400.0), r"4\.53e-05 to 0\.00251"), ((-60.0, 0.0), r"0\.597 to 7\.62e\+09")]
)
def test_temperature_at_which_the_oil_is_no_lubricant_is_refused(ends, found):
    """At the hot end pressure does not thicken it, at the cold end it is a solid."""
    kelvin = tuple(end + CELSIUS for end in ends)
    line = rf"temperature = {ends[0]:g} to {ends[1]:g} C: viscosity of oil of Table 1 {found} Pa s; allowed: 0.0001 to"
    with pytest.raises(ValueError, match=line):
        map_grid(GD4008, temperature=kelvin)


# --- contacts ---


@pytest.mark.parametrize(
    ("parameters", "grid"),
    [(GD4008, GRID), (GD4008, MapGrid()), (LARGE, map_grid(LARGE))],
    ids=["small", "default", "80x20"],
)
def test_contacts_cover_the_loads_of_all_balls(parameters, grid):
    screw, range_ = parameters.screw, contact_range(parameters, grid)
    assert (range_.speed, range_.temperature) == (grid.speed[:2], grid.temperature[:2])
    for force in np.geomspace(*grid.force[:2], 5):
        for count in (screw.ball_count, screw.loaded_ball_count):
            loads = nut_loads(screw, float(force), count)
            assert range_.load[0] < loads.min() < loads.max() < range_.load[1]
    # no wider than a few percent
    assert range_.load[0] > 0.95 * nut_loads(screw, grid.force[0], screw.ball_count).min()
    assert range_.load[1] < 1.05 * nut_loads(screw, grid.force[1], screw.loaded_ball_count).max()
    lightest = float(nut_loads(screw, grid.preload[0], screw.ball_count).min())
    assert range_.preloaded == pytest.approx((1.0 - LOAD_MARGIN) * lightest, rel=1e-12)
    assert range_.load[0] <= range_.preloaded


# --- cut ---


def points_at(force, speed, temperature):
    """Contact of the heaviest ball of a nut."""
    heaviest = float(nut_loads(SCREW, force, SCREW.loaded_ball_count).max())
    return np.array([[heaviest, speed, temperature]])


@pytest.mark.parametrize(
    ("point", "name", "end"),
    [
        ((3000.0, 15.0, 303.0), "speed", 0),
        ((8000.0, 100.0, 303.0), "speed", 1),
        ((11000.0, 40.0, 303.15), "preload", 1),
        ((3000.0, 40.0, 294.0), "temperature", 0),
        ((3000.0, 40.0, 312.5), "temperature", 1),
    ],
)
def test_range_is_cut_at_the_end_that_leaves_most_of_it(point, name, end):
    grid = replace(GRID, preload=(400.0, 12000.0, 7))
    found, what = narrowed(GD4008, grid, points_at(*point))
    before, after = getattr(grid, name), getattr(found, name)
    assert after[1 - end] == before[1 - end]
    value = dict(zip(("preload", "speed", "temperature"), point, strict=True))[name]
    # a little of the range that is left is between its end and the contact
    assert 0.0 < (value - after[1] if end else after[0] - value) <= 1.1 * (1.0 - BACK) * before[1]
    assert what.startswith(f"{('lowest', 'highest')[end]} {name} ")
    assert " instead of " in what
    others = {other for other in ("preload", "speed", "temperature", "force") if other != name}
    assert [o for o in others if getattr(found, o) != getattr(grid, o)] == (
        ["force"] if name == "preload" else []
    )
    assert found.force[1] == found.preload[1]


def test_cut_goes_past_every_contact():
    grid = replace(GRID, preload=(400.0, 12000.0, 7))
    many = np.concatenate(
        [points_at(force, 12.0 + force / 4000.0, 303.0) for force in (500.0, 4000.0, 9000.0)]
    )
    found, _ = narrowed(GD4008, grid, many)
    assert found.speed[0] > many[:, 1].max()
    assert found.speed[0] < 1.3 * many[:, 1].max()
    assert (found.preload, found.temperature) == (grid.preload, grid.temperature)


def test_contacts_at_both_ends_of_every_axis_cannot_be_cut_away():
    """What would be left of the range is no map."""
    ends = np.concatenate(
        [
            points_at(force, *rest)
            for force, *rest in zip(GRID.force[:2], GRID.speed[:2], GRID.temperature[:2], strict=True)
        ]
    )
    with pytest.raises(ArithmeticError, match="lie throughout the range: give a narrower one"):
        narrowed(GD4008, replace(GRID, preload=(400.0, 12000.0, 7)), ends)
