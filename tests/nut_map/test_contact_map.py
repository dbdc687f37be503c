"""Contact of one ball, its map over load, speed and temperature, and the film without a map."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import CLOSED_FILM, CLOSED_RISE, GRID, LOAD_EXPONENT, small_map, values

from ballscrew_tehl.contact import UnconvergedContactError, ball_conditions, map_nodes, solve_ball
from ballscrew_tehl.contact import ball_contact as operating_contact
from ballscrew_tehl.friction.sets import load_friction_sets
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map import file as store
from ballscrew_tehl.nut_map.contact_map import (
    LEAST,
    THICKEST,
    ContactMap,
    SolvedFilm,
    core_formula,
    thick_rolling_formula,
)
from ballscrew_tehl.nut_map.contacts import FILMS, MAPPED, QUANTITIES, RISES, SolvedContacts
from ballscrew_tehl.nut_map.file import FILM_MODELS, load_contact_map, load_map, packaged_map
from ballscrew_tehl.nut_map.sampling import operating_points
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.ball_formula import (
    LEAST_ROLLING,
    drawn_ellipse,
    film_formula,
    moes_groups_of,
    moes_load,
    rolling_formula,
)
from ballscrew_tehl.physics.ball_law import contact_angle_at_ball_load
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, reduced_radii
from ballscrew_tehl.physics.kinematics import KINEMATICS, surface_speeds
from ballscrew_tehl.physics.load import (
    LOAD_NODES,
    NODES_PER_LN,
    double_nut_loads,
    load_nodes,
    nut_loads,
    separation_load,
)
from ballscrew_tehl.physics.lubricant import eta0
from ballscrew_tehl.refinement import direct
from ballscrew_tehl.refinement.direct import DirectFilm, direct_extremes
from ballscrew_tehl.runtime.nut_law import DoubleNutState

RPM = math.pi / 30.0
SCREW = GD4008.screw
MAP = small_map().contact_map
PACKAGED = [name for name in KINEMATICS if packaged_map(name).exists()]
POINT = (30.0, 30.0, 303.0)


# --- interpolation ---


def points_of(contact_map, count, seed=12):
    """Random operating points of a contact map (count, 3)."""
    unit = np.random.default_rng(seed).random((count, 3))
    return operating_points(contact_map.range, unit)


@pytest.mark.parametrize("raceway", RACEWAYS)
def test_solved_contacts_come_back(raceway):
    """Noise found: below 2e-4 of the scale."""
    model = MAP.models[raceway]
    for name in MAPPED:
        np.testing.assert_allclose(model.value(name, model.points), model.solved(name), rtol=2e-5)


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", PACKAGED)
def test_contacts_of_a_packaged_map_come_back_within_their_noise(kinematics):
    """With noise, a contact is never farther from its model than when it is left out."""
    contact_map = load_contact_map(None, changed(GD4008, friction={"kinematics": kinematics}))
    for raceway in RACEWAYS:
        model = contact_map.models[raceway]
        solved = {name: model.solved(name) for name in QUANTITIES}
        # extrapolated on the asymptotic branch, a contact has no estimate
        solved.pop("error_estimate")
        assert all(np.isfinite(values).all() for values in solved.values())
        assert all((solved[name] > 0.0).all() for name in (*FILMS, "pressure_max"))
        # a light ball on a thick film is nearly rigid: both lie at its lowest point, up to the grid
        assert (solved["thermal_minimum_film"] <= 1.001 * solved["thermal_central_film"]).all()
        allowed = 0.0
        for name in FILMS[:2]:
            error = np.abs(model.value(name, model.points) / solved[name] - 1.0)
            allowed += np.mean(np.abs(model.left_out(name)))
            assert np.mean(error) <= 1.01 * allowed


def test_closed_contacts_are_interpolated_within_their_bounds():
    points = points_of(MAP, 400)
    for raceway in RACEWAYS:
        for name in MAPPED:
            expected = values(GD4008, raceway, name, *points.T)
            error = np.abs(MAP.models[raceway].value(name, points) / expected - 1.0)
            assert np.max(error) <= (CLOSED_RISE if name in RISES else CLOSED_FILM)
            assert np.mean(error) <= 0.05 * CLOSED_RISE
            # no copy of the formula
            assert np.max(error) >= 1e-6


def test_one_load_and_many_give_the_same():
    loads = np.array([7.0, 30.0, 31.0, 200.0])
    for raceway in RACEWAYS:
        for name in MAPPED:
            many = MAP.evaluate(raceway, name, loads, 30.0, 303.0)
            alone = [MAP.evaluate(raceway, name, np.array([load]), 30.0, 303.0) for load in loads]
            assert many.shape == (4,)
            # rounding, times the condition of the kriging
            np.testing.assert_allclose(many, np.concatenate(alone), rtol=1e-9)


def test_grid_of_points_equals_point_by_point():
    """By Chebyshev nodes over the loads; a range of ln(load) of 0.1 and of 3.5."""
    rng = np.random.default_rng(3)
    speeds, temperatures = rng.uniform(12, 100, 4), rng.uniform(294, 313, 3)
    for ends, off in (((30.0, 33.0), 2e-6), ((7.0, 230.0), 2e-5)):
        loads = np.sort(rng.uniform(*ends, 60))
        for raceway in RACEWAYS:
            for name in MAPPED:
                found = MAP.evaluate_grid(raceway, name, loads, speeds, temperatures)
                assert found.shape == (60, 4, 3)
                for j, w in enumerate(speeds.tolist()):
                    for k, t in enumerate(temperatures.tolist()):
                        expected = MAP.evaluate(raceway, name, loads, w, t)
                        np.testing.assert_allclose(found[:, j, k], expected, rtol=off)
    with pytest.raises(ValueError, match=r"speed \[rad/s\]"):
        MAP.evaluate_grid("nut", FILMS[0], loads, np.array([1e4]), temperatures)
    with pytest.raises(ValueError, match=r"ball load \[N\] = 1 to 30"):
        MAP.evaluate_grid("nut", FILMS[0], np.array([1.0, 30.0]), speeds, temperatures)


@pytest.mark.parametrize(
    ("load", "nodes"),
    [
        (np.full(5, 30.0), 1),
        (np.linspace(30.0, 33.0, 40), LOAD_NODES),
        (np.geomspace(7.0, 230.0, 40), LOAD_NODES + int(NODES_PER_LN * math.log(230.0 / 7.0))),
        (np.array([7.0, 230.0, 20.0]), 3),
    ],
    ids=["equal", "narrow", "wide", "few"],
)
def test_loads_of_a_nut_are_interpolated_from_few_nodes(load, nodes):
    """Polynomials of ln(load) of that many terms are exact."""
    at, weights = load_nodes(load)
    assert (at.shape, weights.shape) == ((nodes,), (load.size, nodes))
    assert load.min() * (1.0 - 1e-12) <= at.min() <= at.max() <= load.max() * (1.0 + 1e-12)
    for power in range(min(nodes, 5)):
        np.testing.assert_allclose(
            weights @ np.log(at / 30.0) ** power, np.log(load / 30.0) ** power, atol=1e-10
        )


def test_coordinates_are_those_of_their_quantity():
    """The first: stretched Moes load; the second: speed and viscosity; all of the order of one."""
    model, points = MAP.models["nut"], points_of(MAP, 300)
    oil, (_, _, temperature) = GD4008.lubricant, points.T
    moes = moes_load(GD4008, "nut", *points.T)
    for name, power in ((FILMS[0], 1.0), (FILMS[1], 0.5), (FILMS[2], 0.5), ("temperature_rise", 0.5)):
        first, second, third = model.coordinates(name, points).T
        ln_m, span = np.log(moes), np.log(MAP.range.load[1] / MAP.range.load[0] * 10.0)
        np.testing.assert_allclose(
            first, (ln_m + 4.0 * np.tanh(np.log(moes / 33.0) / 0.9)) / span, rtol=1e-12
        )
        thick = points[:, 1] * eta0(oil, temperature) ** power
        np.testing.assert_allclose(second, np.log(thick) / np.log(10.0), rtol=1e-9)
        np.testing.assert_allclose(third, (temperature - 293.15) / 20.0, rtol=1e-9)
        assert all(0.5 <= np.ptp(column) <= 4.0 for column in (first, second, third))


def altered(**scale):
    """Contacts of MAP with values multiplied by quantity, and a map of them."""
    contacts = {
        raceway: SolvedContacts(
            contacts.points,
            {name: scale.get(name, 1.0) * column for name, column in contacts.values.items()},
        )
        for raceway, contacts in MAP.contacts.items()
    }
    return ContactMap(GD4008, MAP.range, contacts)


def test_coordinates_of_rolling_and_core():
    """Rolling: plain Moes load; core and mean rise as the films: stretched where a rigid contact flattens."""
    model, points = MAP.models["nut"], points_of(MAP, 50)
    groups = moes_groups_of(GD4008, "nut", *points.T)[0]
    span = np.log(MAP.range.load[1] / MAP.range.load[0] * 10.0)
    first = model.coordinates("rolling_loss", points)[:, 0]
    np.testing.assert_allclose(first, np.log(groups.M) / span, rtol=1e-12)
    x = np.log(groups.M)
    for name in ("core_pressure", "core_area", "mean_rise", "thermal_central_film"):
        first = model.coordinates(name, points)[:, 0]
        np.testing.assert_allclose(first, (x + 4.0 * np.tanh((x - np.log(33.0)) / 0.9)) / span, rtol=1e-12)


def test_core_formula_is_that_of_hertz_under_load_and_rigid_without():
    load = np.array([1e-3, 2e-3, 250.0, 2500.0])
    pressure, area = core_formula(GD4008, "nut", load, 0.5, 343.15)
    hertz = drawn_ellipse(GD4008, "nut", load)
    np.testing.assert_allclose(pressure[2:] / hertz.p_max[2:], 1.0, atol=1e-3)
    np.testing.assert_allclose(area[2:] / (np.pi * hertz.a * hertz.b)[2:], 1.0, atol=1e-3)
    # M L^0.4 from 5 to 10 for a fast ball in cold oil: cubes of it
    fast_pressure, fast_area = core_formula(GD4008, "nut", load, 500.0, 283.15)
    rigid = fast_pressure[1] / hertz.p_max[1] / (fast_pressure[0] / hertz.p_max[0])
    assert rigid == pytest.approx(8.0, rel=0.01)
    spread = (fast_area / (hertz.a * hertz.b))[0] / (fast_area / (hertz.a * hertz.b))[1]
    assert spread == pytest.approx(8.0, rel=0.01)


def test_thick_films_lack_rolling_loss():
    at = GD4008, "nut", np.array([30.0]), np.array([0.5, 500.0]), 283.15
    share = thick_rolling_formula(*at) / rolling_formula(*at)
    R_x = moes_groups_of(*at)[1]
    np.testing.assert_allclose(share, np.exp(-5.0 * np.sqrt(2.0 * film_formula(*at) / R_x)), rtol=1e-12)
    assert share[1] < 0.9 < share[0] < 1.0


def test_contacts_with_films_as_thick_as_balls_do_not_bend_the_rolling_loss():
    """Their loss is next to none, or negative: nothing that a logarithm could be interpolated through."""
    contacts = altered().contacts
    model = MAP.models["nut"]
    R_x = moes_groups_of(GD4008, "nut", *contacts["nut"].points.T)[1]
    lost = np.arange(6) + 40
    contacts["nut"].values[FILMS[1]][lost] = 1.1 * THICKEST * R_x[lost]
    contacts["nut"].values["rolling_loss"][lost] *= -0.01
    found = ContactMap(GD4008, MAP.range, contacts).models["nut"]
    points = points_of(MAP, 100)
    np.testing.assert_allclose(
        found.value("rolling_loss", points), model.value("rolling_loss", points), rtol=3.0 * CLOSED_FILM
    )
    assert (found.left_out("rolling_loss")[lost] == 0.0).all()
    assert np.count_nonzero(found.left_out("rolling_loss")) == len(model.points) - 6


def test_rolling_loss_has_the_floor_of_the_law():
    nothing = altered(rolling_loss=1e-9).models["screw"]
    points = points_of(MAP, 20)
    floor = LEAST_ROLLING * rolling_formula(GD4008, "screw", *points.T)
    np.testing.assert_allclose(nothing.value("rolling_loss", points), floor, rtol=1e-12)


def test_minimum_film_is_never_above_the_central_one():
    """Contacts of a light ball on a thick film: equal within the scatter of the grid."""
    points = points_of(MAP, 100)
    equal = altered(thermal_minimum_film=1.601)
    for raceway in RACEWAYS:
        model = equal.models[raceway]
        assert np.max(model.solved(FILMS[2]) / model.solved(FILMS[1])) >= 1.0005
        np.testing.assert_array_equal(model.value(FILMS[2], points), model.value(FILMS[1], points))
        least, central = (MAP.models[raceway].value(name, points) for name in (FILMS[2], FILMS[1]))
        np.testing.assert_allclose(least / central, 0.625, rtol=1e-6)


@pytest.mark.parametrize("share", [1.0, 1.005])
def test_a_thermal_film_may_equal_the_isothermal_one(share):
    """Cold and slow, heat takes nothing of the film: the loss is then of the order of the solver's scatter."""
    contacts = altered().contacts
    for each in contacts.values():
        each.values[FILMS[1]][:] = share * each.values[FILMS[0]]
    contact_map = ContactMap(GD4008, MAP.range, contacts)
    points = points_of(MAP, 50)
    for model in contact_map.models.values():
        cold, hot = (model.value(name, points) for name in FILMS[:2])
        np.testing.assert_allclose(hot / cold, share, rtol=1e-6)


def test_rises_of_nothing_are_interpolated():
    contact_map = altered(temperature_rise=0.0)
    rise = contact_map.evaluate("nut", "temperature_rise", np.array([30.0]), 30.0, 303.0)
    assert rise == pytest.approx(LEAST["temperature_rise"], rel=1e-9)


def test_a_mean_rise_may_be_negative():
    """Oil that expands behind the contact cools more than shear heats: cold and slow, or a nearly rigid contact."""

    def share(points):
        return 0.3 * np.tanh(np.log(points[:, 1] / 30.0))

    contacts = altered().contacts
    for each in contacts.values():
        each.values["mean_rise"][:] = share(each.points) * each.values["temperature_rise"]
    contact_map = ContactMap(GD4008, MAP.range, contacts)
    points = points_of(MAP, 200)
    for raceway, model in contact_map.models.items():
        rise = values(GD4008, raceway, "temperature_rise", *points.T)
        error = (model.value("mean_rise", points) - share(points) * rise) / rise
        assert np.max(np.abs(error)) <= CLOSED_RISE
        assert np.ptp(share(points)) >= 0.3
        assert np.isfinite(model.left_out("mean_rise")).all()
        assert np.max(np.abs(model.left_out("mean_rise"))) <= 0.1
        loads, at = np.array([9.0, 30.0]), (np.array([14.0, 60.0]), np.array([300.0]))
        grid = contact_map.evaluate_grid(raceway, "mean_rise", loads, *at)
        single = [contact_map.evaluate(raceway, "mean_rise", loads, w, 300.0) for w in at[0]]
        assert grid.min() < 0.0 < grid.max()
        np.testing.assert_allclose(grid[..., 0], np.stack(single, axis=1), rtol=1e-2)


def test_contacts_that_were_not_solved_are_interpolated_from_the_others():
    contacts = altered().contacts
    lost = {raceway: np.arange(5) + 40 + 5 * k for k, raceway in enumerate(RACEWAYS)}
    for raceway, each in contacts.items():
        for column in each.values.values():
            column[lost[raceway]] = math.nan
    contact_map = ContactMap(GD4008, MAP.range, contacts)
    for raceway, each in contacts.items():
        assert each.good.sum() == len(each) - 5
        assert not each.good[lost[raceway]].any()
        at = each.points[lost[raceway]]
        for name in FILMS:
            found = contact_map.models[raceway].value(name, at)
            np.testing.assert_allclose(found, values(GD4008, raceway, name, *at.T), rtol=3.0 * CLOSED_FILM)


def test_cell_is_the_mean_distance_of_the_contacts():
    """A cube of as many cells as contacts."""
    spans = math.log(MAP.range.load[1] / MAP.range.load[0]), math.log(10.0), 20.0
    assert np.prod(spans) / np.prod(MAP.cell) == pytest.approx(GRID.contact_first)
    assert np.divide(MAP.cell, spans) == pytest.approx([GRID.contact_first ** (-1 / 3)] * 3)


def test_ends_of_the_range_are_included():
    for ends in zip(MAP.range.load, MAP.range.speed, MAP.range.temperature, strict=True):
        load, speed, temperature = (value * (1.0 + 1e-12) for value in ends)
        assert np.isfinite(MAP.evaluate("nut", FILMS[0], np.array([load]), speed, temperature)).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("end", [0, 1])
def test_outside_the_range_is_refused(axis, end):
    bounds = (MAP.range.load, MAP.range.speed, MAP.range.temperature)[axis]
    what = ("ball load [N]", "speed [rad/s]", "temperature [K]")[axis]
    beyond = bounds[end] * (0.999, 1.001)[end]
    point = list(POINT)
    point[axis] = beyond
    with pytest.raises(ValueError, match="the contact map covers") as caught:
        MAP.evaluate("nut", FILMS[0], np.array([20.0, point[0]]), *point[1:])
    assert str(caught.value).startswith(f"{what} = ")
    assert f"{beyond:.6g}" in str(caught.value)
    assert str(caught.value).endswith(f"covers {bounds[0]:.6g} to {bounds[1]:.6g}")
    point[axis] = math.nan
    with pytest.raises(ValueError, match="the contact map covers"):
        MAP.evaluate("nut", FILMS[0], np.array([point[0]]), *point[1:])


@pytest.mark.parametrize("names", [("cage", FILMS[0]), ("nut", "film"), ("nut", "pressure_max")])
def test_unknown_names_are_refused(names):
    with pytest.raises(ValueError, match=next(name for name in names if name not in ("nut", FILMS[0]))):
        MAP.evaluate(*names, np.array([30.0]), *POINT[1:])


def test_solved_film_is_named_and_reads_its_film():
    loads = np.array([20.0, 40.0])
    assert tuple(SolvedFilm(MAP, thermal).name for thermal in (False, True)) == FILM_MODELS[:2]
    for thermal, quantity in ((False, FILMS[0]), (True, FILMS[1])):
        film = SolvedFilm(MAP, thermal).central_film("screw", loads, 30.0, 303.0)
        np.testing.assert_array_equal(film, MAP.evaluate("screw", quantity, loads, 30.0, 303.0))
        assert film == pytest.approx(values(GD4008, "screw", quantity, loads, 30.0, 303.0), rel=CLOSED_FILM)


def test_closed_formula_and_moes_load_are_those_of_each_ball_alone():
    """The coordinate and the base of the films must not depend on the balls of one call."""
    loads, speeds = np.array([7.0, 30.0, 200.0]), np.array([11.0, 40.0, 100.0])
    for function in (film_formula, moes_load):
        for raceway in RACEWAYS:
            many = function(GD4008, raceway, loads[:, None], speeds, 303.0)
            for i, load in enumerate(loads):
                for j, speed in enumerate(speeds):
                    alone = function(GD4008, raceway, np.array([load]), float(speed), 303.0)
                    assert many[i, j] == pytest.approx(float(alone[0]), rel=1e-12)
    light, heavy = moes_load(GD4008, "nut", np.array([30.0, 60.0]), 30.0, 303.0)
    # M = W (2U)^(-3/4) with the radius of each ball, which changes little with load
    assert heavy / light == pytest.approx(2.0, rel=0.01)


# --- one ball ---


@pytest.mark.parametrize(
    ("load", "speed", "celsius", "nodes"),
    [(30.0, 100.0, 20.0, 97), (20.0, 600.0, 10.0, 129), (3.0, 600.0, 10.0, 97), (2.0, 0.5, 80.0, 97)],
)
def test_nodes_of_a_contact_of_a_map(load, speed, celsius, nodes):
    """More where the pressure spike of a hardly flattened contact is sharp."""
    parameters = changed(GD4008, friction={"kinematics": "rolling_frame"})
    at = load, speed, celsius + 273.15
    assert map_nodes(ball_conditions(parameters, "nut", *at), GD4008.lubricant) == nodes
    groups = moes_groups_of(parameters, "nut", *(np.array([value]) for value in at))[0]
    assert (15.0 <= groups.M[0] <= 80.0 and groups.L[0] >= 15.0) == (nodes == 129)


@pytest.mark.parametrize("kinematics", KINEMATICS)
@pytest.mark.parametrize("raceway", RACEWAYS)
def test_ball_has_its_own_angle_and_the_speeds_of_its_raceway(kinematics, raceway):
    parameters = changed(GD4008, friction={"kinematics": kinematics})
    contact = ball_conditions(parameters, raceway, 39.5, 314.0, 310.0)
    speeds = surface_speeds(parameters, raceway, 314.0)
    assert (contact.u_1, contact.u_2, contact.u_e) == (speeds.u_1, speeds.u_2, speeds.u_e)
    angle = contact_angle_at_ball_load(SCREW, 39.5)
    assert angle > SCREW.contact_angle
    assert (contact.R_x, contact.R_y) == reduced_radii(SCREW, angle, raceway)
    assert (contact.load, contact.temperature, contact.E_prime) == (39.5, 310.0, E_prime(SCREW))
    assert all(type(value) is float for value in vars(contact).values())


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("cage", 39.5, 314.0, 303.0), "cage"),
        (("nut", -1.0, 314.0, 303.0), "ball_load = -1"),
        (("nut", 0.0, 314.0, 303.0), "load = 0"),
        (("nut", 39.5, 0.0, 303.0), "speed = 0"),
        (("nut", 39.5, math.nan, 303.0), "speed = nan"),
        (("nut", 39.5, 314.0, 0.0), "temperature = 0"),
    ],
)
def test_impossible_contact_is_refused(arguments, named):
    with pytest.raises(ValueError, match=named):
        ball_conditions(GD4008, *arguments)


@pytest.mark.parametrize("thermal", [False, True])
def test_unconverged_contact_is_solved_on_other_grids_and_named(monkeypatch, thermal):
    calls = []

    def solve(conditions, oil, solid, options, warn):
        calls.append((conditions, oil, solid, options.thermal, options.n_x, options.max_thermal))
        return SimpleNamespace(converged=len(calls) == success, reason="pressure spike wanders")

    monkeypatch.setattr(operating_contact, "solve", solve)
    success = 2
    assert solve_ball(GD4008, "nut", 39.5, 314.0, 303.0, thermal).converged
    assert len(calls) == 2
    success = None
    calls.clear()
    with pytest.raises(UnconvergedContactError) as caught:
        solve_ball(GD4008, "nut", 39.5, 314.0, 303.0, thermal)
    kind = "thermal" if thermal else "isothermal"
    assert str(caught.value) == (
        f"contact not solved: nut, load 39.5 N, speed 314 rad/s, 303 K ({kind}): pressure spike wanders"
    )
    assert isinstance(caught.value, ArithmeticError)
    assert [call[-2:] for call in calls] == list(operating_contact.ATTEMPTS)
    assert len(set(operating_contact.ATTEMPTS)) == len(operating_contact.ATTEMPTS)
    expected = (ball_conditions(GD4008, "nut", 39.5, 314.0, 303.0), GD4008.lubricant, GD4008.solid, thermal)
    assert all(call[:-2] == expected for call in calls)


# --- film without a map ---


def closed_ball(parameters, raceway, load, speed, temperature, thermal):
    """In place of solve_ball: a cubic of ln(load), which falls on the screw and rises on the nut."""
    x = math.log(load / 30.0)
    h = (0.8e-7 if thermal else 1e-7) * math.exp(LOAD_EXPONENT[raceway] * (x + 0.05 * x**3))
    return SimpleNamespace(
        h_c=h, h_m=0.5 * h,
        temperature_rise_mean=load if raceway == "nut" else 50.0 / load,
        hertz=SimpleNamespace(p_max=1e9 * (load / 30.0) ** (1 / 3)),
    )  # fmt: skip


def test_direct_film_is_that_of_each_ball_solved():
    """Isothermal; 1e-5 is the tolerance of the solver."""
    loads = nut_loads(SCREW, 2000.0, SCREW.ball_count)
    film = DirectFilm(GD4008, thermal=False)
    found = film.central_film("nut", loads, 500.0 * RPM, 303.0)
    assert film.name == FILM_MODELS[0]
    assert found.shape == loads.shape
    for i in (0, 40, -1):
        ball = solve_ball(GD4008, "nut", float(loads[i]), 500.0 * RPM, 303.0, thermal=False)
        assert found[i] == pytest.approx(ball.h_c, rel=1e-5)
    # differs over the nut by more than that
    assert found[0] / found[-1] > 1.001


@pytest.mark.parametrize("thermal", [False, True])
@pytest.mark.parametrize(("width", "nodes"), [(1.05, LOAD_NODES), (1.29, LOAD_NODES + 1), (20.0, 14)])
def test_direct_film_caches_solves_and_takes_more_nodes_over_a_wide_range(monkeypatch, thermal, width, nodes):
    calls = []

    def solve(*arguments):
        calls.append(arguments)
        return closed_ball(*arguments)

    monkeypatch.setattr(direct, "solve_ball", solve)
    film = DirectFilm(GD4008, thermal)
    loads = np.linspace(10.0, 10.0 * width, 20)
    first = film.central_film("nut", loads, 30.0, 303.0)
    again = film.central_film("nut", loads[::-1], 30.0, 303.0)
    assert film.name == FILM_MODELS[thermal]
    assert len(calls) == nodes
    assert {call[-1] for call in calls} == {thermal}
    np.testing.assert_array_equal(first, again[::-1])
    expected = [closed_ball(GD4008, "nut", load, 30.0, 303.0, thermal).h_c for load in loads]
    # three nodes do not reproduce the cubic
    np.testing.assert_allclose(first, expected, rtol=1e-10 if nodes > LOAD_NODES else 1e-7)
    film.central_film("screw", loads, 30.0, 303.0)
    film.central_film("screw", loads, 31.0, 303.0)
    film.central_film("screw", loads, 31.0, 304.0)
    assert len(calls) == 4 * nodes


def test_direct_film_of_equal_loads_takes_one_solve(monkeypatch):
    monkeypatch.setattr(direct, "solve_ball", closed_ball)
    film = DirectFilm(GD4008, thermal=True)
    found = film.central_film("nut", np.full(5, 30.0), 30.0, 303.0)
    np.testing.assert_allclose(found, np.full(5, 0.8e-7), rtol=1e-12)
    assert len(film._solved) == 1


@pytest.mark.parametrize("share", [0.0, 0.4, -0.4, 1.2])
def test_direct_extremes_are_those_of_all_balls_of_both_nuts(monkeypatch, share):
    monkeypatch.setattr(direct, "solve_ball", closed_ball)
    count = SCREW.loaded_ball_count
    axial = share * separation_load(SCREW, 2000.0, SCREW.ball_count, 1 if share >= 0.0 else -1)
    found = direct_extremes(GD4008, 2000.0, axial, 100.0, 303.0)
    torques = {name for name in DoubleNutState._fields if name.endswith("_torque")}
    assert found.keys() == set(DoubleNutState._fields) - torques - {"lambda_ratio", "in_range", "clamped"}
    # both nuts share the load by all their balls, and distribute it over those that carry
    forces = double_nut_loads(SCREW, 2000.0, axial, SCREW.ball_count)[2:4]
    loads = np.concatenate([nut_loads(SCREW, force, count) for force in forces if force > 0.0])
    balls = {r: [closed_ball(GD4008, r, q, 100.0, 303.0, True) for q in loads] for r in RACEWAYS}
    everything = balls["screw"] + balls["nut"]
    assert found == pytest.approx(
        {
            "film_thickness_min": min(ball.h_m for ball in everything),
            "film_thickness_central_screw": min(ball.h_c for ball in balls["screw"]),
            "film_thickness_central_nut": min(ball.h_c for ball in balls["nut"]),
            "film_temperature_rise": max(ball.temperature_rise_mean for ball in everything),
            "contact_pressure_max": max(ball.hertz.p_max for ball in everything),
            "ball_load_max": loads.max(),
        },
        rel=1e-8,
    )


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", PACKAGED)
def test_packaged_map_agrees_with_direct_solves(monkeypatch, kinematics):
    """Within 1 % of the torque, at two points in the middle of the range, by the isothermal film."""
    parameters = changed(GD4008, friction={"kinematics": kinematics})
    friction = next(
        entry
        for (name, _), entry in load_friction_sets().items()
        if name == kinematics and entry.film_model == FILM_MODELS[0]
    )
    monkeypatch.setattr(store, "default_friction_set", lambda parameters: friction)
    nut_map = load_map(None, parameters)
    assert nut_map.header["film_model"] == FILM_MODELS[0]
    film = DirectFilm(parameters, thermal=False)
    rng = np.random.default_rng(14)
    for _ in range(2):
        preload, speed = rng.uniform(1000.0, 4000.0), rng.uniform(50.0, 1500.0) * RPM
        point = (float(preload), float(speed), float(rng.uniform(298.0, 318.0)))
        state = nut_map.evaluate(*point, 0.0, *friction.values)
        parts = double_nut_torque(parameters, friction, film, *point)
        assert sum(state[:3]) == pytest.approx(parts.total, rel=0.01)
        assert state[:3] == pytest.approx(parts[:3], rel=0.01)


def test_state_of_three_balls_is_that_of_all(monkeypatch):
    """Torque against the film of every ball; extremes of both nuts."""

    class BallByBall:
        name = FILM_MODELS[1]

        def central_film(self, raceway, load, speed, temperature):
            return np.array([closed_ball(GD4008, raceway, q, speed, temperature, True).h_c for q in load])

    monkeypatch.setattr(direct, "solve_ball", closed_ball)
    friction = next(s for s in load_friction_sets().values() if s.film_model == FILM_MODELS[1])
    for axial in (0.0, 1500.0, -9000.0):
        found = direct.direct_state(GD4008, friction, 2000.0, 50.0, 303.0, axial)
        parts = double_nut_torque(GD4008, friction, BallByBall(), 2000.0, 50.0, 303.0, axial)
        assert found.friction_torque == pytest.approx(parts.total, rel=1e-5)
        extremes = direct_extremes(GD4008, 2000.0, axial, 50.0, 303.0)
        for name in found._fields[1:]:
            assert getattr(found, name) == pytest.approx(extremes[name], rel=1e-12)


def test_mean_ball_represents_all_in_a_certificate(monkeypatch):
    """A third of the solves. Films by the formula, with an exponent of load of -0.07: that of closed_ball is +0.12."""
    solves = []

    def solve(parameters, raceway, load, speed, temperature, thermal):
        solves.append(load)
        return closed_ball(parameters, raceway, load, speed, temperature, thermal)

    monkeypatch.setattr(direct, "solve_ball", solve)
    for friction in load_friction_sets().values():
        if friction.kinematics != GD4008.friction.kinematics or friction.film_model not in FILM_MODELS:
            continue
        for axial, nuts in ((0.0, 1), (1500.0, 2), (-9000.0, 1)):
            solves.clear()
            found = direct.mean_ball_state(GD4008, friction, 2000.0, 50.0, 303.0, axial)
            assert len(solves) == len(RACEWAYS) * nuts * 2
            expected = direct.direct_state(GD4008, friction, 2000.0, 50.0, 303.0, axial)
            assert found.friction_torque == pytest.approx(expected.friction_torque, rel=1e-4)
            # the heaviest ball is solved, the lightest by the closed formula
            for name in ("film_thickness_central_screw", "film_thickness_central_nut"):
                assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=0.05)
            assert found.film_temperature_rise <= expected.film_temperature_rise * (1.0 + 1e-12)
            assert found.film_temperature_rise == pytest.approx(expected.film_temperature_rise, rel=0.15)
            assert found.film_temperature_rise > 0.0
