"""Films and torque from single contacts: each ball as solved, extremes of all balls, a mean ball for the friction."""

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import LAW, ClosedFilm, closed_ball

from ballscrew_tehl.atlas.groups import closed_forms
from ballscrew_tehl.friction.film_shear import double_nut_torque, nut_forces
from ballscrew_tehl.friction.mechanistic import mean_load, nut_powers
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.physics.rating import ball_pressure
from ballscrew_tehl.refinement import direct
from ballscrew_tehl.refinement.direct import DirectContacts, DirectFilm, rolling_contacts, solved_contact

SCREW = GD4008.screw
CASES = ((0.0, 1), (1500.0, 2), (-9000.0, 1))  # axial load, nuts that differ


@pytest.fixture
def solves(monkeypatch):
    calls = []

    def solve(*arguments, thermal=None):
        calls.append(arguments if thermal is None else (*arguments, thermal))
        return closed_ball(*calls[-1])

    monkeypatch.setattr(direct, "solve_ball", solve)
    return calls


def test_direct_film_solves_each_point_once(solves):
    places = [("nut", 30.0, 303.0), ("screw", 30.0, 303.0), ("nut", 31.0, 303.0), ("nut", 30.0, 304.0)]
    film, counts = DirectFilm(GD4008), []
    for width in (1.0, 1.05, 20.0):
        loads = np.linspace(10.0, 10.0 * width, 8)
        solves.clear()
        for raceway, *at in places:
            found = film.central_film(raceway, loads, *at)
            expected = [closed_ball(GD4008, raceway, q, *at, True).h_c for q in loads]
            np.testing.assert_allclose(found, expected, rtol=1e-6)
            film.central_film(raceway, loads[::-1], *at)
        counts.append(len(solves) // 4)
        assert len(set(solves)) == len(solves)
        assert {call[-1] for call in solves} == {True}
    assert counts[0] == 1 < counts[1] < counts[2] < 20


def test_extremes_and_torque_are_those_of_all_balls_of_both_nuts(solves):
    """Torque against the film of every ball; the mean one has an error of second order."""
    for axial, nuts in CASES:
        parameters, point = GD4008, (2000.0, 50.0, 303.0, axial)
        rolling, friction = direct.rolling_parameters(parameters), default_friction_set(parameters)
        forces = {f for f in nut_forces(rolling, 2000.0, axial) if f > 0.0}
        loads = np.concatenate([nut_loads(SCREW, f, SCREW.loaded_ball_count) for f in forces])
        balls = {r: [closed_ball(rolling, r, float(q), 50.0, 303.0, True) for q in loads] for r in RACEWAYS}
        everything = balls["screw"] + balls["nut"]
        expected = {
            "film_thickness_min": min(ball.h_m for ball in everything),
            "film_thickness_central_screw": min(ball.h_c for ball in balls["screw"]),
            "film_thickness_central_nut": min(ball.h_c for ball in balls["nut"]),
            "film_temperature_rise": max(ball.temperature_rise_mean for ball in everything),
            "contact_pressure_max": ball_pressure(SCREW, float(loads.max())),
            "ball_load_max": loads.max(),
        }
        assert direct.direct_extremes(rolling, 2000.0, axial, 50.0, 303.0) == pytest.approx(
            expected, rel=1e-8
        )
        film = ClosedFilm(GD4008)
        torque = double_nut_torque(parameters, friction, film, *point).total
        solves.clear()
        mean = direct.mean_ball_state(parameters, friction, *point, rolling)
        # the law of the paper shows the films of rolling balls, which are solved as well
        assert len(solves) == len(RACEWAYS) * nuts * 2
        assert mean.friction_torque == pytest.approx(torque, rel=1e-4)
        # the other balls by the closed formula
        for name in ("film_thickness_central_screw", "film_thickness_central_nut"):
            assert getattr(mean, name) == pytest.approx(expected[name], rel=0.05)
        share = mean.film_temperature_rise / expected["film_temperature_rise"]
        assert 0.85 <= share <= 1.0 + 1e-12


def test_mechanistic_law_takes_the_mean_ball_of_each_nut(solves):
    friction, contacts = default_friction_set(LAW), DirectContacts(LAW)
    ratio, net, _ = friction.values
    at = np.array([[50.0]]), np.array([303.0])
    for axial, nuts in CASES:
        torque = 0.0
        for force in (f for f in nut_forces(LAW, 2000.0, axial) if f > 0.0):
            loads = nut_loads(LAW.screw, force, LAW.screw.loaded_ball_count)
            solves.clear()
            torque += nut_powers(LAW, loads, 50.0, 303.0, contacts).torque(ratio, net)
            assert len(solves) <= len(RACEWAYS)
            mean = mean_load(loads)
            ball = closed_ball(LAW, "nut", mean, 50.0, 303.0, True)
            found = contacts.values("nut", loads, *at)
            for name, value in (
                ("central_film", ball.h_c),
                ("core_pressure", ball.core_pressure),
                ("mean_rise", ball.mean_temperature - 303.0),
            ):
                np.testing.assert_allclose(found[name], np.full((loads.size, 1, 1), value), rtol=1e-9)
            balls = rolling_contacts(LAW, "nut", np.append(loads, mean), 50.0, 303.0)
            closed = closed_forms(balls).values["rolling_loss"]
            loss = ball.rolling_loss * closed[:-1] / closed[-1]
            np.testing.assert_allclose(found["rolling_loss"][:, 0, 0], loss, rtol=1e-9)
        solves.clear()
        state = direct.mean_ball_state(LAW, friction, 2000.0, 50.0, 303.0, axial)
        assert len(solves) == len(RACEWAYS) * nuts
        assert state.friction_torque == pytest.approx(float(np.squeeze(torque)), rel=1e-9)


def test_films_too_thick_for_a_parabolic_gap_are_closed_forms(solves):
    """Of rolling balls above 0.15 R_x; between sliding ones all are solved."""
    at = 600.0, 283.15
    for load, solved in ((0.3, 0), (30.0, 1)):
        contact = rolling_contacts(LAW, "nut", np.array([load]), *at)
        closed = {name: float(np.squeeze(value)) for name, value in closed_forms(contact).values.items()}
        assert (closed["central_film"] < 0.15 * contact.R_x[0]) == solved
        found = solved_contact(LAW, "nut", load, *at)
        assert len(solves) == solved
        if not solved:
            assert found["minimum_film"] == found["central_film"] == closed["central_film"]
            assert found["rolling_loss"] == closed["rolling_loss"]
    solved_contact(GD4008, "nut", 0.3, *at)
    assert len(solves) == 2
