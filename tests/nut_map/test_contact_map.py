"""Contacts of one ball over load, speed and temperature: interpolated, bounded, and refused outside."""

import itertools
import math
import re

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import CLOSED_FILM, CLOSED_RISE, small_map, values

from ballscrew_tehl.nut_map.contact_map import THICKEST, ContactMap, MapContacts, SolvedFilm, core_formula
from ballscrew_tehl.nut_map.contacts import FILMS, MAPPED, RISES, SolvedContacts
from ballscrew_tehl.nut_map.sampling import operating_points
from ballscrew_tehl.physics.ball_formula import LEAST_ROLLING, moes_groups_of, rolling_formula
from ballscrew_tehl.physics.hertz import RACEWAYS, ball_ellipse

MAP = small_map().contact_map


def points_of(count, seed=12):
    """Random operating points of the map (count, 3)."""
    return operating_points(MAP.range, np.random.default_rng(seed).random((count, 3)))


def altered(**scale):
    """A map of the contacts of MAP with values multiplied by quantity."""
    contacts = {
        raceway: SolvedContacts(
            contacts.points, {name: scale.get(name, 1.0) * column for name, column in contacts.values.items()}
        )
        for raceway, contacts in MAP.contacts.items()
    }
    return ContactMap(GD4008, MAP.range, contacts)


def test_contacts_come_back_and_between_them_the_closed_ones_are_interpolated():
    points = points_of(400)
    for raceway in RACEWAYS:
        model = MAP.models[raceway]
        for name in MAPPED:
            # noise below 2e-4 of the scale
            np.testing.assert_allclose(model.value(name, model.points), model.solved(name), rtol=2e-5)
            error = np.abs(model.value(name, points) / values(GD4008, raceway, name, *points.T) - 1.0)
            assert np.max(error) <= (CLOSED_RISE if name in RISES else CLOSED_FILM)
            assert np.mean(error) <= 0.05 * CLOSED_RISE
            # what is left out is predicted about as well, by the border worse
            assert np.mean(np.abs(model.left_out(name))) <= 0.02


def test_single_points_many_loads_and_grids_give_the_same():
    """Grids by Chebyshev nodes over the loads; a range of ln(load) of 0.1 and of 3.5."""
    speeds, temperatures = np.array([13.0, 95.0]), np.array([295.0, 312.0])
    contacts, film = MapContacts(MAP), [SolvedFilm(MAP, thermal) for thermal in (False, True)]
    for ends, off in (((30.0, 33.0), 2e-6), ((7.0, 230.0), 2e-5)):
        loads = np.geomspace(*ends, 17)
        for raceway in RACEWAYS:
            for name in MAPPED:
                found = contacts.value(raceway, name, loads, speeds[:, None], temperatures)
                for (j, w), (k, t) in itertools.product(enumerate(speeds), enumerate(temperatures)):
                    expected = MAP.evaluate(raceway, name, loads, w, t)
                    np.testing.assert_allclose(found[:, j, k], expected, rtol=off)
                # rounding, times the condition of the kriging
                alone = MAP.evaluate(raceway, name, loads[:1], w, t)
                np.testing.assert_allclose(alone, expected[:1], rtol=1e-9)
                if name in FILMS[:2]:
                    own = film[FILMS.index(name)].central_film(raceway, loads, w, t)
                    np.testing.assert_array_equal(own, expected)


def test_core_formula_is_that_of_hertz_under_load_and_rigid_without():
    load = np.array([1e-3, 2e-3, 250.0, 2500.0])
    pressure, area = core_formula(GD4008, "nut", load, 0.5, 343.15)
    hertz = ball_ellipse(GD4008.screw, GD4008.screw.contact_angle, "nut", load)
    np.testing.assert_allclose(pressure[2:] / hertz.p_max[2:], 1.0, atol=1e-3)
    np.testing.assert_allclose(area[2:] / (np.pi * hertz.a * hertz.b)[2:], 1.0, atol=1e-3)
    # M L^0.4 from 5 to 10 for a fast ball in cold oil: cubes of it
    pressure, area = core_formula(GD4008, "nut", load, 500.0, 283.15)
    assert pressure[1] / hertz.p_max[1] / (pressure[0] / hertz.p_max[0]) == pytest.approx(8.0, rel=0.01)
    spread = area / (hertz.a * hertz.b)
    assert spread[0] / spread[1] == pytest.approx(8.0, rel=0.01)


def test_thick_films_lack_rolling_loss_down_to_the_floor_of_the_law():
    points = points_of(20)
    floor = LEAST_ROLLING * rolling_formula(GD4008, "screw", *points.T)
    nothing = altered(rolling_loss=1e-9).models["screw"]
    np.testing.assert_allclose(nothing.value("rolling_loss", points), floor, rtol=1e-12)
    # films as thick as balls have no loss that a logarithm could be interpolated through: left out
    whole, contacts = MAP.models["nut"], altered().contacts
    R_x = moes_groups_of(GD4008, "nut", *contacts["nut"].points.T)[1]
    lost = np.arange(6) + 40
    contacts["nut"].values[FILMS[1]][lost] = 1.1 * THICKEST * R_x[lost]
    contacts["nut"].values["rolling_loss"][lost] *= -0.01
    found = ContactMap(GD4008, MAP.range, contacts).models["nut"]
    expected = whole.value("rolling_loss", points)
    np.testing.assert_allclose(found.value("rolling_loss", points), expected, rtol=3.0 * CLOSED_FILM)
    assert (found.left_out("rolling_loss")[lost] == 0.0).all()


def test_minimum_film_is_never_above_the_central_one():
    """Contacts of a light ball on a thick film: equal within the scatter of the grid."""
    points, equal = points_of(100), altered(thermal_minimum_film=1.601)
    for raceway in RACEWAYS:
        model = equal.models[raceway]
        assert np.max(model.solved(FILMS[2]) / model.solved(FILMS[1])) >= 1.0005
        np.testing.assert_array_equal(model.value(FILMS[2], points), model.value(FILMS[1], points))
        ratio = MAP.models[raceway].value(FILMS[2], points) / MAP.models[raceway].value(FILMS[1], points)
        np.testing.assert_allclose(ratio, 0.625, rtol=1e-6)


def test_a_thermal_film_may_equal_the_isothermal_one_and_a_rise_be_none():
    """Cold and slow, heat takes nothing of the film: the loss is then of the order of the solver's scatter."""
    points = points_of(50)
    for share in (1.0, 1.005):
        contacts = altered().contacts
        for each in contacts.values():
            each.values[FILMS[1]][:] = share * each.values[FILMS[0]]
        for model in ContactMap(GD4008, MAP.range, contacts).models.values():
            cold, hot = (model.value(name, points) for name in FILMS[:2])
            np.testing.assert_allclose(hot / cold, share, rtol=1e-6)


def test_a_mean_rise_may_be_negative():
    """Oil that expands behind the contact cools more than shear heats: cold and slow, or a nearly rigid contact."""

    def share(points):
        return 0.3 * np.tanh(np.log(points[:, 1] / 30.0))

    contacts = altered().contacts
    for each in contacts.values():
        each.values["mean_rise"][:] = share(each.points) * each.values["temperature_rise"]
    contact_map, points = ContactMap(GD4008, MAP.range, contacts), points_of(200)
    for raceway, model in contact_map.models.items():
        rise = values(GD4008, raceway, "temperature_rise", *points.T)
        error = (model.value("mean_rise", points) - share(points) * rise) / rise
        assert np.max(np.abs(error)) <= CLOSED_RISE
        assert np.max(np.abs(model.left_out("mean_rise"))) <= 0.1


def test_contacts_that_were_not_solved_are_interpolated_from_the_others():
    contacts, lost = altered().contacts, np.arange(5) + 40
    for each in contacts.values():
        for column in each.values.values():
            column[lost] = math.nan
    contact_map = ContactMap(GD4008, MAP.range, contacts)
    for raceway, each in contacts.items():
        assert np.flatnonzero(~each.good).tolist() == lost.tolist()
        at = each.points[lost]
        for name in FILMS:
            found = contact_map.models[raceway].value(name, at)
            np.testing.assert_allclose(found, values(GD4008, raceway, name, *at.T), rtol=3.0 * CLOSED_FILM)
    # uncertain: those whose deviation, weighted by the part in the friction, exceeds a share
    assert len(contact_map.uncertain_points(1e-9)) == 2 * len(lost)
    assert len(contact_map.uncertain_points(1.0)) == 0


def test_outside_the_range_is_refused():
    bounds = MAP.range.load, MAP.range.speed, MAP.range.temperature
    whats = "ball load [N]", "speed [rad/s]", "temperature [K]"
    for axis, (ends, what) in enumerate(zip(bounds, whats, strict=True)):
        for end, factor in zip(ends, (0.999, 1.001), strict=True):
            point = [30.0, 30.0, 303.0]
            # the end itself counts as inside, within rounding
            point[axis] = end * (1.0 + 1e-12)
            assert np.isfinite(MAP.evaluate("nut", FILMS[0], np.array(point[:1]), *point[1:])).all()
            for beyond in (end * factor, math.nan):
                point[axis] = beyond
                words = rf"{re.escape(what)} = {beyond:.6g} .* map covers {ends[0]:.6g} to {ends[1]:.6g}$"
                with pytest.raises(ValueError, match=words):
                    MAP.evaluate("nut", FILMS[0], np.array(point[:1]), *point[1:])
                with pytest.raises(ValueError, match=words):
                    MAP.evaluate_grid("nut", FILMS[0], *(np.array([value]) for value in point))
