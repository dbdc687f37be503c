"""The range of a map follows from the screw and its oil; where its contacts are solved."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import GRID, small_map

from ballscrew_tehl.nut_map import grid as limits
from ballscrew_tehl.nut_map import sampling
from ballscrew_tehl.nut_map.contact_map import ContactModel
from ballscrew_tehl.nut_map.contacts import FILMS, QUANTITIES, ContactRange, SolvedContacts, film_parameters
from ballscrew_tehl.nut_map.grid import MapGrid, contact_range, map_grid, narrowed
from ballscrew_tehl.nut_map.sampling import LIGHT, MIN_FILM, left_out_errors, next_points, operating_points
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.ball_formula import film_formula
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.physics.lubricant import eta0

SCREW = GD4008.screw
WHOLE = replace(GRID, preload=(400.0, 12000.0, 7))
#: a nut with an axial load: balls down to 0.01 of the load under the lowest preload
WIDE = ContactRange((0.1, 250.0), (0.5, 600.0), (283.15, 353.15), 10.0)


def oil(viscosity):
    return changed(GD4008, lubricant={"viscosity": viscosity})


def test_contacts_hold_the_loads_of_all_balls_of_the_range_and_no_more():
    """The range itself is that of tests/data/test_screws.py; of the packaged screw it is the default."""
    grid = map_grid(GD4008)
    for name in ("force", "speed", "temperature", "preload"):
        assert getattr(grid, name) == pytest.approx(getattr(MapGrid(), name), rel=1e-12)
    range_ = contact_range(GD4008, grid)
    assert (range_.speed, range_.temperature) == (grid.speed[:2], grid.temperature[:2])
    counts = SCREW.ball_count, SCREW.loaded_ball_count
    lightest = min(nut_loads(SCREW, grid.force[0], count).min() for count in counts)
    heaviest = max(nut_loads(SCREW, grid.force[1], count).max() for count in counts)
    assert 0.95 * lightest < range_.load[0] < lightest < heaviest < range_.load[1] < 1.05 * heaviest
    preloaded = nut_loads(SCREW, grid.preload[0], SCREW.ball_count).min()
    assert 0.95 * preloaded < range_.preloaded < preloaded


def test_temperatures_end_where_the_oil_is_too_thick_or_too_thin():
    for viscosity, end, other, limit in ((1.0, 0, 353.15, 2.0), (8e-3, 1, 283.15, 2e-3)):
        ends = limits.temperature_range(oil(viscosity))
        beyond, inside = (
            eta0(oil(viscosity).lubricant, ends[end] + step) for step in ((-1, 0) if end == 0 else (1, 0))
        )
        assert min(beyond, inside) <= limit <= max(beyond, inside)
        assert ends[1 - end] == other
    for viscosity in (5e-4, 1e3):
        with pytest.raises(ValueError, match=r"over 10 K: give --temperature-c"):
            map_grid(oil(viscosity))


def contact_at(force, speed, temperature):
    """Contact of the heaviest ball of a nut."""
    return [float(nut_loads(SCREW, force, SCREW.loaded_ball_count).max()), speed, temperature]


def test_range_is_cut_past_every_contact_at_the_end_that_leaves_most_of_it():
    for point, name, end in (
        ((3000.0, 15.0, 303.0), "speed", 0), ((8000.0, 100.0, 303.0), "speed", 1),
        ((11000.0, 40.0, 303.15), "preload", 1), ((3000.0, 40.0, 294.0), "temperature", 0),
        ((3000.0, 40.0, 312.5), "temperature", 1),
    ):  # fmt: skip
        found, what = narrowed(GD4008, WHOLE, np.array([contact_at(*point)]))
        before, after = getattr(WHOLE, name), getattr(found, name)
        value = dict(zip(("preload", "speed", "temperature"), point, strict=True))[name]
        # a little of the range that is left is between its end and the contact
        assert 0.0 < (value - after[1] if end else after[0] - value) <= 0.022 * before[1]
        assert what.startswith(f"{('lowest', 'highest')[end]} {name} ")
        same = {other for other in ("preload", "speed", "temperature") if other != name}
        assert all(getattr(found, other) == getattr(WHOLE, other) for other in same)
        assert (after[1 - end], found.force[1]) == (before[1 - end], found.preload[1])
    ends = [contact_at(*(getattr(WHOLE, n)[k] for n in ("force", "speed", "temperature"))) for k in (0, 1)]
    with pytest.raises(ArithmeticError, match="lie throughout the range: give a narrower one"):
        narrowed(GD4008, WHOLE, np.array(ends))


# --- where contacts are solved ---


def test_first_points_are_corners_edges_faces_and_then_fill_the_cube():
    """From end to end of the axes, logarithmic, a share of them light balls: two decades of load, in both parts."""
    points = sampling.first_points(26 + 1024)
    assert {tuple(point) for point in points[:8].tolist()} == set(itertools.product((0.0, 1.0), repeat=3))
    assert (points[:26] == 0.5).sum(axis=1).tolist() == [0] * 8 + [1] * 12 + [2] * 6
    octants = np.bincount((points[26:] > 0.5) @ np.array([1, 2, 4]), minlength=8)
    assert 120 <= octants.min() <= octants.max() <= 136
    alone = replace(WIDE, load=(10.0, 250.0))
    corners = operating_points(WIDE, np.array([[0.0] * 3, [0.5] * 3, [1.0] * 3]))
    np.testing.assert_allclose(corners[[0, 2]].T, (WIDE.load, WIDE.speed, WIDE.temperature), rtol=1e-12)
    assert corners[1, 1:] == pytest.approx((math.sqrt(300.0), 318.15))
    load, heavy = (operating_points(range_, points[26:])[:, 0] for range_ in (WIDE, alone))
    for share, expected in (
        (load < 10.0, LIGHT), (load < 1.0, 0.5 * LIGHT), (load > 50.0, (1.0 - LIGHT) / 2.0), (heavy > 50.0, 0.5)
    ):  # fmt: skip
        assert np.mean(share) == pytest.approx(expected, abs=2e-3)


def test_no_contact_of_a_film_below_the_limit_is_solved():
    """Slow, hot and heavy ones, neither of the first contacts nor of those that follow."""
    slow = replace(WIDE, load=(10.0, 250.0), speed=(0.02, 600.0))
    for raceway in RACEWAYS:
        points = sampling.first_contacts(GD4008, raceway, slow, 64)
        every = operating_points(slow, sampling.first_points(256))
        films = film_formula(GD4008, raceway, *every.T)
        assert np.mean(films < MIN_FILM) >= 0.1
        np.testing.assert_array_equal(points, every[films >= MIN_FILM][:64])
        solved = {name: np.ones(64) for name in QUANTITIES}
        solved |= {name: 0.8**k * film_formula(GD4008, raceway, *points.T) for k, name in enumerate(FILMS)}
        model = ContactModel(GD4008, raceway, slow, SolvedContacts(points, solved))
        assert np.min(film_formula(GD4008, raceway, *next_points(model, 400, 0).T)) >= MIN_FILM


def test_next_points_are_where_what_counts_is_uncertain():
    """The rolling loss counts where the map has the law that takes it; points go to the part with the errors."""
    rolling, model = film_parameters(GD4008), small_map().contact_map.models["nut"]
    assert sampling.refined(model) == FILMS[:2]
    fast = model.points[:, 1] > 40.0
    scatter = np.where(fast, np.where(np.arange(len(fast)) % 2, 1.2, 0.8), 1.0)
    rough = dict(model.contacts.values) | {"rolling_loss": scatter * model.contacts.values["rolling_loss"]}
    rough_model = ContactModel(rolling, "nut", model.range, SolvedContacts(model.contacts.points, rough))
    assert sampling.refined(rough_model) == (*FILMS[:2], "rolling_loss")
    films, both = left_out_errors(rough_model, FILMS[:2]), left_out_errors(rough_model)
    assert (both >= films).all()
    assert both.mean() >= 5.0 * films.mean()
    chosen = next_points(rough_model, 32, 0)
    assert len(np.unique(chosen, axis=0)) == 32
    assert np.min(film_formula(rolling, "nut", *chosen.T)) >= MIN_FILM
    assert np.mean(chosen[:, 1] > 40.0) >= 0.7
