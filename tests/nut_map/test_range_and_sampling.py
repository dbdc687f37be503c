"""The range of a map follows from the screw and its oil; where its contacts are solved."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import GRID, closed_build, closed_contact, small_map, values

from ballscrew_tehl.friction.mechanistic import ball_ball_coefficient, supply_factor
from ballscrew_tehl.nut_map import contacts, sampling
from ballscrew_tehl.nut_map.contact_map import ContactModel
from ballscrew_tehl.nut_map.contacts import (
    FILM_FLOOR,
    FILMS,
    QUANTITIES,
    ContactRange,
    SolvedContacts,
    film_parameters,
    film_weight,
)
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
from ballscrew_tehl.nut_map.sampling import (
    LIGHT,
    MIN_FILM,
    first_contacts,
    first_points,
    frame_points,
    left_out_errors,
    next_points,
    operating_points,
    refined,
    rolling_weight,
)
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.ball_formula import film_formula
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.kinematics import entrainment_speed
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.physics.lubricant import eta0
from ballscrew_tehl.physics.rating import ball_pressure

SCREW = GD4008.screw
WHOLE = replace(GRID, preload=(400.0, 12000.0, 7))
#: a nut with an axial load: balls down to 0.01 of the load under the lowest preload
WIDE = ContactRange((0.1, 250.0), (0.5, 600.0), (283.15, 353.15), 10.0)
FEW = ContactRange((10.0, 250.0), (0.5, 600.0), (283.15, 353.15), 10.0)


def screw_of(diameter, lead, ball, balls):
    """The packaged screw with other sizes [m]; grooves of the same conformity."""
    return changed(
        GD4008,
        screw={
            "nominal_radius": diameter / 2.0, "lead": lead, "lead_angle": math.atan(lead / (math.pi * diameter)),
            "ball_diameter": ball, "screw_raceway_radius": 0.52 * ball, "nut_raceway_radius": 0.52 * ball,
            "ball_count": balls, "loaded_ball_count": balls - 6,
        },
    )  # fmt: skip


SMALL, LARGE = screw_of(8e-3, 2e-3, 1.588e-3, 45), screw_of(80e-3, 20e-3, 12.7e-3, 57)


def oil(viscosity):
    return changed(GD4008, lubricant={"viscosity": viscosity})


# --- range ---


def test_range_follows_from_pressure_diameter_and_oil():
    """Rounded down to two digits; a hundredth and a thousandth of the preload, speed/1200."""
    for parameters in (GD4008, SMALL, LARGE):
        screw, grid = parameters.screw, map_grid(parameters)
        highest = force_at_pressure(screw)
        heaviest = float(nut_loads(screw, highest, screw.loaded_ball_count).max())
        assert ball_pressure(screw, heaviest) == pytest.approx(PRESSURE_LIMIT, rel=1e-5)
        assert 0.9 * highest < grid.preload[1] == grid.force[1] <= highest
        assert grid.preload[1] == pytest.approx(float(f"{grid.preload[1]:.1e}"), rel=1e-12)
        assert grid.preload[0] == pytest.approx(0.01 * grid.preload[1])
        assert grid.force[0] == pytest.approx(1e-3 * grid.preload[1])
        fastest = SPEED_FACTOR_LIMIT / (2.0 * screw.nominal_radius)
        assert 0.9 * fastest < grid.speed[1] <= 1.000001 * fastest
        assert grid.speed[0] == pytest.approx(grid.speed[1] / 1200.0)
    grid, default = map_grid(GD4008), MapGrid()
    for name in ("force", "speed", "temperature", "preload"):
        assert getattr(grid, name) == pytest.approx(getattr(default, name), rel=1e-12)
    given = map_grid(GD4008, (300.0, 3000.0), (1.0, 20.0), (300.0, 320.0), GRID)
    assert (given.preload[:2], given.speed[:2], given.temperature[:2]) == (
        (300.0, 3000.0),
        (1.0, 20.0),
        (300.0, 320.0),
    )
    assert (given.force, given.contact_first) == ((3.0, 3000.0, GRID.force[2]), GRID.contact_first)
    # an axial load relieves one nut, of the lowest preload too
    assert map_grid(GD4008, (5.0, 3000.0)).force[0] == 0.5


def test_temperatures_end_where_the_oil_is_too_thick_or_too_thin():
    for parameters, end, limit in ((oil(1.0), 0, THICKEST_OIL), (oil(8e-3), 1, THINNEST_OIL)):
        ends = temperature_range(parameters)
        viscosity = eta0(parameters.lubricant, np.array(ends))
        assert THINNEST_OIL <= viscosity[1] < viscosity[0] <= THICKEST_OIL
        beyond = float(eta0(parameters.lubricant, ends[end] + (-1.0, 1.0)[end]))
        assert beyond > limit if end == 0 else beyond < limit
        assert ends[1 - end] == (HOTTEST, COLDEST)[end]
    for viscosity in (5e-4, 1e3):
        with pytest.raises(ValueError, match=r"over 10 K: give --temperature-c"):
            map_grid(oil(viscosity))


@pytest.mark.parametrize(
    ("ends", "line"),
    [
        ({"preload": (0.0, 1.0)}, r"preload = 0 to 1 N; needs 0\.01 <= lowest < highest <= 1e\+07"),
        ({"speed": (10.0 * RPM, 10.0 * RPM)}, r"speed = 10 to 10 r/min; needs 0\.001 <= lowest < highest <= 1e\+06"),
        ({"temperature": (300.15, math.nan)}, r"temperature = 27 to nan C; needs -73\.15 <= lowest < highest <= 500"),
        ({"preload": (100.0, 1.0e5)}, r"N: Hertz pressure up to 4\.\d+ GPa; allowed: 4\.2 GPa"),
        ({"temperature": (353.15, 673.15)}, r"temperature = 80 to 400 C: viscosity of .* allowed: 0.0001 to 10000"),
        ({"temperature": (213.15, 273.15)}, r"temperature = -60 to 0 C: viscosity of .* allowed: 0.0001 to 10000"),
    ],
)  # fmt: skip
def test_ends_that_are_no_range_are_refused_in_the_units_of_the_options(ends, line):
    with pytest.raises(ValueError, match=line):
        map_grid(GD4008, **ends)


def test_contacts_cover_the_loads_of_all_balls():
    for parameters, grid in ((GD4008, GRID), (LARGE, map_grid(LARGE))):
        screw, range_ = parameters.screw, contact_range(parameters, grid)
        assert (range_.speed, range_.temperature) == (grid.speed[:2], grid.temperature[:2])
        lightest, heaviest = math.inf, 0.0
        for force in np.geomspace(*grid.force[:2], 5):
            for count in (screw.ball_count, screw.loaded_ball_count):
                loads = nut_loads(screw, float(force), count)
                lightest, heaviest = min(lightest, loads.min()), max(heaviest, loads.max())
        assert 0.95 * lightest < range_.load[0] < lightest
        assert heaviest < range_.load[1] < 1.05 * heaviest
        preloaded = float(nut_loads(screw, grid.preload[0], screw.ball_count).min())
        assert range_.preloaded == pytest.approx((1.0 - LOAD_MARGIN) * preloaded, rel=1e-12)


def points_at(*forces, speed=None, temperature=303.0):
    """Contacts of the heaviest ball of a nut."""
    heaviest = [float(nut_loads(SCREW, f, SCREW.loaded_ball_count).max()) for f in forces]
    return np.array(
        [[load, speed or 12.0 + f / 4000.0, temperature] for load, f in zip(heaviest, forces, strict=True)]
    )


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
    found, what = narrowed(GD4008, WHOLE, points_at(point[0], speed=point[1], temperature=point[2]))
    before, after = getattr(WHOLE, name), getattr(found, name)
    assert after[1 - end] == before[1 - end]
    value = dict(zip(("preload", "speed", "temperature"), point, strict=True))[name]
    # a little of the range that is left is between its end and the contact
    assert 0.0 < (value - after[1] if end else after[0] - value) <= 1.1 * (1.0 - BACK) * before[1]
    assert what.startswith(f"{('lowest', 'highest')[end]} {name} ")
    others = {other for other in ("preload", "speed", "temperature", "force") if other != name}
    kept = {"force"} if name == "preload" else set()
    assert {other for other in others if getattr(found, other) != getattr(WHOLE, other)} == kept
    assert found.force[1] == found.preload[1]


def test_cut_goes_past_every_contact_or_is_refused():
    many = points_at(500.0, 4000.0, 9000.0)
    found, _ = narrowed(GD4008, WHOLE, many)
    assert many[:, 1].max() < found.speed[0] < 1.3 * many[:, 1].max()
    ends = np.concatenate([
        points_at(WHOLE.force[k], speed=WHOLE.speed[k], temperature=WHOLE.temperature[k]) for k in (0, 1)
    ])  # fmt: skip
    with pytest.raises(ArithmeticError, match="lie throughout the range: give a narrower one"):
        narrowed(GD4008, WHOLE, ends)


# --- where contacts are solved ---


def test_first_points_are_corners_edges_faces_and_then_fill_the_cube():
    frame = frame_points()
    assert {tuple(point) for point in frame[:8].tolist()} == set(itertools.product((0.0, 1.0), repeat=3))
    assert (frame == 0.5).sum(axis=1).tolist() == [0] * 8 + [1] * 12 + [2] * 6
    for count in (5, 27, 128):
        points = first_points(count)
        assert len({tuple(point) for point in points.tolist()}) == count
        np.testing.assert_array_equal(points[:26], frame[:count])
    octants = np.bincount((points[26:] > 0.5) @ np.array([1, 2, 4]), minlength=8)
    assert 11 <= octants.min() <= octants.max() <= 16


def test_operating_points_go_from_end_to_end_with_a_share_of_light_balls():
    """Those that only an axial load relieves: two decades of load, logarithmic in both parts."""
    for range_ in (WIDE, FEW):
        corners = operating_points(range_, np.array([[0.0] * 3, [0.5] * 3, [1.0] * 3]))
        np.testing.assert_allclose(
            corners[[0, 2]].T, (range_.load, range_.speed, range_.temperature), rtol=1e-12
        )
        assert corners[1, 1] == pytest.approx(math.sqrt(math.prod(range_.speed)))
        assert corners[1, 2] == pytest.approx(sum(range_.temperature) / 2.0)
    unit = first_points(26 + 1024)[26:]
    load, alone = (operating_points(range_, unit)[:, 0] for range_ in (WIDE, FEW))
    for share, expected in (
        (load < 10.0, LIGHT), (load < 1.0, 0.5 * LIGHT), (load > 50.0, (1.0 - LIGHT) / 2.0), (alone > 50.0, 0.5)
    ):  # fmt: skip
        assert np.mean(share) == pytest.approx(expected, abs=2e-3)


def test_no_contact_of_a_film_below_the_limit_is_solved():
    """Slow, hot and heavy ones, neither of the first contacts nor of those that follow."""
    slow = replace(FEW, speed=(0.02, 600.0))
    for raceway in RACEWAYS:
        points, every = first_contacts(GD4008, raceway, slow, 64), operating_points(slow, first_points(256))
        films = film_formula(GD4008, raceway, *every.T)
        assert np.mean(films < MIN_FILM) >= 0.1
        np.testing.assert_array_equal(points, every[films >= MIN_FILM][:64])
        solved = {name: np.ones(64) for name in QUANTITIES}
        for k, name in enumerate(FILMS):
            solved[name] = 0.8**k * film_formula(GD4008, raceway, *points.T)
        model = ContactModel(GD4008, raceway, slow, SolvedContacts(points, solved))
        assert np.min(film_formula(GD4008, raceway, *next_points(model, 48, 0).T)) >= MIN_FILM


def test_weights_are_the_part_in_the_friction():
    load = np.array([10.0, 200.0, 1.25, 1.25, 200.0])
    film = FILM_FLOOR * np.array([1.0, 5.0, 3.0, 0.5, 0.25])
    np.testing.assert_allclose(film_weight(WIDE, load, film), [1.0, 1.0, 0.25, 0.125, 0.25], rtol=1e-12)
    # the loss of both raceways over that and what the balls push each other with, 2 mu_b Lambda kappa Q u_e
    points = np.array([[200.0, 50.0, 303.0], [1.25, 50.0, 303.0], [200.0, 50.0, 303.0]])
    neighbours = ball_ball_coefficient(GD4008.friction) * points[:, 0] * entrainment_speed(GD4008.screw, 50.0)
    supplied = float(supply_factor(GD4008, 50.0, 303.0))
    loss = neighbours * np.array([1.0, 1.0, 0.0]) / (2.0 * supplied)
    np.testing.assert_allclose(rolling_weight(GD4008, WIDE, points, loss), [0.5, 0.125, 0.0], rtol=1e-12)


def test_rolling_loss_counts_where_the_map_has_the_law_that_takes_it():
    rolling, range_ = film_parameters(GD4008), small_map().contact_map.range
    assert refined(GD4008) == FILMS[:2]
    assert refined(rolling) == (*FILMS[:2], "rolling_loss")
    model = small_map().contact_map.models["nut"]
    scatter = np.where(np.arange(len(model.points)) % 2, 1.2, 0.8)
    rough = dict(model.contacts.values) | {"rolling_loss": scatter * model.contacts.values["rolling_loss"]}
    rough_model = ContactModel(rolling, "nut", range_, SolvedContacts(model.contacts.points, rough))
    films, both = left_out_errors(rough_model, FILMS[:2]), left_out_errors(rough_model)
    assert (both >= films).all()
    assert both.mean() >= 5.0 * films.mean()


def test_next_points_have_the_largest_variance_that_is_left(monkeypatch):
    """By the plain formula of conditional variance, for a model whose weights are all alike; then weighted."""
    monkeypatch.setattr(contacts, "FILM_FLOOR", 1e-12)
    model = small_map().contact_map.models["nut"]
    with monkeypatch.context() as patch:
        patch.setattr(sampling, "left_out_errors", lambda model: np.ones(len(model.points)))
        chosen = next_points(model, 4, 3)
    pool = sampling.qmc.Sobol(3, seed=sampling.POOL_SEED + 3).random_base2(sampling.POOL_POWER)
    places = operating_points(model.range, pool)
    covariance, known = sum(model.covariance(name, places) for name in FILMS[:2]), []
    for point in chosen:
        left = np.diag(covariance).copy()
        if known:
            across = covariance[:, known]
            left -= np.einsum("ik,ki->i", across, np.linalg.solve(covariance[np.ix_(known, known)], across.T))
        (place,) = np.flatnonzero((places == point).all(axis=1))
        assert left[place] >= (1.0 - 1e-6) * np.max(left)
        known.append(place)
    fast = model.points[:, 1] > 40.0
    monkeypatch.setattr(sampling, "left_out_errors", lambda model: np.where(fast, 1.0, 0.02))
    assert np.mean(next_points(model, 32, 0)[:, 1] > 40.0) >= 1.3 * np.mean(
        next_points_alike(model)[:, 1] > 40.0
    )


def next_points_alike(model):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sampling, "left_out_errors", lambda model: np.ones(len(model.points)))
        return next_points(model, 32, 0)


@pytest.mark.slow
def test_smaller_tolerance_gives_more_contacts_and_smaller_errors(monkeypatch):
    """A film that bends sharply along the speed; the mean error left out is about that between the contacts."""
    monkeypatch.setattr(contacts, "FILM_FLOOR", 1e-12)
    rolling = film_parameters(GD4008)

    def bend(speed):
        return np.exp(0.2 * np.tanh(2.0 * np.log(speed / 30.0)))

    def solve(parameters, raceway, load, speed, temperature):
        found = closed_contact(parameters, raceway, load, speed, temperature)
        return found | {name: found[name] * float(bend(speed)) for name in FILMS}

    number, errors = [], []
    for tolerance in (1e-2, 1e-3):
        grid = replace(
            GRID,
            contact_first=64,
            contact_batch=16,
            contact_max=400,
            contact_largest=1.0,
            contact_tolerance=tolerance,
        )
        contact_map = closed_build(rolling, grid, solve=solve).contact_map
        number.append(sum(map(len, contact_map.contacts.values())))
        for raceway, model in contact_map.models.items():
            points = operating_points(contact_map.range, np.random.default_rng(21).random((300, 3)))
            true = bend(points[:, 1]) * values(rolling, raceway, FILMS[0], *points.T)
            errors.append(np.mean(np.abs(model.value(FILMS[0], points) / true - 1.0)))
            assert np.mean(left_out_errors(model)) <= tolerance
            assert errors[-1] <= tolerance
    assert number[0] < number[1] < 800
    assert np.max(errors[2:]) < 0.5 * np.max(errors[:2])
