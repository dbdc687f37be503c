"""Films and torque from single contacts: each ball as solved, extremes of all balls, a mean ball for the friction."""

import math

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import ClosedFilm, closed_ball

from ballscrew_tehl.contact import solve_ball
from ballscrew_tehl.friction.mechanistic import mean_load, nut_powers
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.friction.torque import double_nut_torque, nut_forces
from ballscrew_tehl.nut_map.contacts import film_parameters
from ballscrew_tehl.parameters.file import changed, load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_VG100
from ballscrew_tehl.parameters.units import RPM
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.load import double_nut_loads, nut_loads
from ballscrew_tehl.refinement import direct
from ballscrew_tehl.refinement.direct import DirectContacts, DirectFilm, direct_extremes

SCREW, LAW = GD4008.screw, load_parameters(PACKAGED_VG100)
CASES = ((0.0, 1), (1500.0, 2), (-9000.0, 1))  # axial load, nuts that differ


@pytest.fixture
def solves(monkeypatch):
    """Contacts in closed form; the arguments of each."""
    calls = []

    def solve(*arguments, thermal=None):
        arguments = arguments if thermal is None else (*arguments, thermal)
        calls.append(arguments)
        return closed_ball(*arguments)

    monkeypatch.setattr(direct, "solve_ball", solve)
    return calls


@pytest.mark.slow
def test_direct_film_is_that_of_each_ball_solved():
    """Isothermal; 1e-5 is the tolerance of the solver."""
    loads = nut_loads(SCREW, 2000.0, SCREW.ball_count)
    found = DirectFilm(GD4008, thermal=False).central_film("nut", loads, 500.0 * RPM, 303.0)
    for i in (0, -1):
        ball = solve_ball(GD4008, "nut", float(loads[i]), 500.0 * RPM, 303.0, thermal=False)
        assert found[i] == pytest.approx(ball.h_c, rel=1e-5)
    assert found[0] / found[-1] > 1.001


def test_direct_film_solves_each_point_once(solves):
    """Raceway, speed and temperature are points of their own; more nodes over a wide range of loads."""
    for thermal in (False, True):
        film, counts = DirectFilm(GD4008, thermal), []
        for width in (1.0, 1.05, 20.0):
            loads = np.linspace(10.0, 10.0 * width, 20)
            solves.clear()
            for at in (
                ("nut", 30.0, 303.0),
                ("screw", 30.0, 303.0),
                ("nut", 31.0, 303.0),
                ("nut", 30.0, 304.0),
            ):
                found = film.central_film(at[0], loads, *at[1:])
                expected = [closed_ball(GD4008, at[0], q, *at[1:], thermal).h_c for q in loads]
                np.testing.assert_allclose(found, expected, rtol=1e-6)
                np.testing.assert_array_equal(film.central_film(at[0], loads[::-1], *at[1:]), found[::-1])
            counts.append(len(solves) // 4)
            assert len(set(solves)) == len(solves)
            assert {call[-1] for call in solves} == {thermal}
        assert counts[0] == 1 < counts[1] < counts[2] < 20


@pytest.mark.parametrize("axial", [0.0, 2500.0, -9000.0])
def test_direct_extremes_are_those_of_all_balls_of_both_nuts(solves, axial):
    found = direct_extremes(GD4008, 2000.0, axial, 100.0, 303.0)
    forces = double_nut_loads(SCREW, 2000.0, axial, SCREW.ball_count)[2:4]
    loads = np.concatenate([nut_loads(SCREW, f, SCREW.loaded_ball_count) for f in forces if f > 0.0])
    balls = {r: [closed_ball(GD4008, r, float(q), 100.0, 303.0, True) for q in loads] for r in RACEWAYS}
    everything = balls["screw"] + balls["nut"]
    expected = {
        "film_thickness_min": min(ball.h_m for ball in everything),
        "film_thickness_central_screw": min(ball.h_c for ball in balls["screw"]),
        "film_thickness_central_nut": min(ball.h_c for ball in balls["nut"]),
        "film_temperature_rise": max(ball.temperature_rise_mean for ball in everything),
        "contact_pressure_max": max(ball.hertz.p_max for ball in everything),
        "ball_load_max": loads.max(),
    }
    assert found == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("set_", ["two_parameter", "three_parameter"])
def test_the_mean_ball_represents_all(solves, set_):
    """Torque against the film of every ball; the mean one has an error of second order."""
    parameters = changed(GD4008, friction={"set": set_})
    friction = default_friction_set(parameters)
    film, rolling = ClosedFilm(GD4008, friction.film_model == "solved_thermal"), film_parameters(GD4008)
    for axial, nuts in CASES:
        point = 2000.0, 50.0, 303.0, axial
        torque = double_nut_torque(parameters, friction, film, *point).total
        solves.clear()
        mean = direct.mean_ball_state(parameters, friction, *point, rolling)
        assert len(solves) == len(RACEWAYS) * nuts * 2
        assert mean.friction_torque == pytest.approx(torque, rel=1e-4)
        # the heaviest ball is solved, the lightest by the closed formula; films of rolling balls are shown
        extremes = direct_extremes(rolling, 2000.0, axial, 50.0, 303.0)
        for name in ("film_thickness_central_screw", "film_thickness_central_nut"):
            assert getattr(mean, name) == pytest.approx(extremes[name], rel=0.05)
        assert 0.85 * extremes["film_temperature_rise"] <= mean.film_temperature_rise
        assert mean.film_temperature_rise <= extremes["film_temperature_rise"] * (1.0 + 1e-12)


def test_mechanistic_law_takes_the_mean_ball_of_each_nut(solves):
    """Torque of the law from contacts that it solves itself, also of nuts of two forces."""
    friction = default_friction_set(LAW)
    ratio, net, _ = friction.values
    contacts, solved = DirectContacts(LAW), {}
    for axial, _ in CASES:
        forces = nut_forces(LAW, 2000.0, axial)
        torque = 0.0
        for force in forces:
            if force > 0.0:
                loads = nut_loads(LAW.screw, force, LAW.screw.loaded_ball_count)
                solves.clear()
                nut = nut_powers(LAW, loads, 50.0, 303.0, contacts)
                solved[force] = len(solves)
                torque += nut.torque(ratio, net)
                at = contacts.value(
                    "nut", "thermal_central_film", loads, np.array([[50.0]]), np.array([303.0])
                )
                mean = closed_ball(LAW, "nut", mean_load(loads), 50.0, 303.0, True)
                np.testing.assert_allclose(at, mean.h_c, rtol=1e-9)
        found = direct.mean_ball_state(LAW, friction, 2000.0, 50.0, 303.0, axial)
        assert found.friction_torque == pytest.approx(float(np.squeeze(torque)), rel=1e-9)
    assert max(solved.values()) == len(RACEWAYS)
    assert math.isfinite(torque)
