"""Contacts of cold fast films: narrow pressures, and attempts that end early where they lead nowhere."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from contact_cases import OIL, STEEL, conditions
from paths import ROOT

import ballscrew_tehl.contact.one_grid as one_grid
from ballscrew_tehl.contact.ball_contact import MAP_NODES, ball_contact, map_nodes, solve_ball, solve_for_map
from ballscrew_tehl.contact.conditions import (
    NARROW_L,
    NARROW_LINES,
    NARROW_M,
    ContactConditions,
    SolverOptions,
    expected_grid,
    narrow,
    scales_of,
)
from ballscrew_tehl.contact.coupled import MORE_UNDAMPED, NEWTON_STEPS, WASTED_UNDAMPED
from ballscrew_tehl.contact.solve import solve_contact
from ballscrew_tehl.parameters.file import changed, graded_oil, load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_DATA
from ballscrew_tehl.parameters.units import RPM

SMALL = load_parameters(ROOT / "tests/data/screws/example_12x05.toml")
SMALLEST = load_parameters(ROOT / "tests/data/screws/example_08x02.toml")
#: changes of the load that shift a pressure spike between the nodes
LOADS = np.exp(np.linspace(-0.1, 0.1, 5))


def contact(parameters, load, speed, temperature):
    return ball_contact(parameters, "screw", load, speed, temperature)


def test_a_narrow_pressure_gets_more_lines():
    c = contact(SMALL, 3.96, 212.0, 290.0)
    scales = scales_of(c, SMALL.lubricant)
    assert narrow(scales)
    assert not narrow(replace(scales, M=0.99 * NARROW_M[0]))
    assert not narrow(replace(scales, M=1.01 * NARROW_M[1]))
    options, film = SolverOptions(n_x=MAP_NODES), scales.film_estimate
    lines = expected_grid(c, scales, film, options).n_y
    wide = expected_grid(c, replace(scales, L=0.99 * NARROW_L), film, options)
    assert lines - 1 == pytest.approx(NARROW_LINES * (wide.n_y - 1), abs=2.0)
    assert expected_grid(c, scales, film, replace(options, n_y=21)).n_y == 21


def test_what_friction_takes_of_a_narrow_pressure_follows_the_load():
    """The core left its trend over the loads by 10 % with as many lines as elsewhere."""
    found = []
    for share in LOADS:
        c = contact(SMALLEST, 1.198 * share, 270.0, 284.4)
        options = SolverOptions(n_x=map_nodes(c, SMALLEST.lubricant))
        s = solve_contact(c, SMALLEST.lubricant, SMALLEST.solid, options)
        assert s.converged
        found.append([s.h_c, s.integrals.core_pressure, s.integrals.rolling_loss])
    values = np.log(found)
    trend = np.array([np.polyval(np.polyfit(np.log(LOADS), v, 1), np.log(LOADS)) for v in values.T]).T
    film, core, loss = np.abs(values - trend).max(axis=0)
    assert film <= 2e-3
    assert core <= 0.05
    assert loss <= 5e-3


def test_an_undamped_attempt_ends_soon_where_the_pressure_is_not_found(monkeypatch):
    """It took up to 600 Newton steps before the damped one began, which converges."""
    attempts = []

    def recorded(problem, it, temperature, tolerance, limit, damped=False):
        it = solve(problem, it, temperature, tolerance, limit, damped)
        attempts.append((damped, it.converged, it.reason, len(it.history.change)))
        return it

    solve = one_grid.solve_coupled
    monkeypatch.setattr(one_grid, "solve_coupled", recorded)
    c = contact(SMALL, 3.96, 212.0, 290.0)
    s = solve_contact(c, SMALL.lubricant, SMALL.solid, SolverOptions(n_x=map_nodes(c, SMALL.lubricant)))
    assert s.converged
    failed = [steps for damped, converged, reason, steps in attempts if not damped and not converged]
    assert failed
    most = WASTED_UNDAMPED + MORE_UNDAMPED + 2 * NEWTON_STEPS
    assert all(steps <= most for steps in failed)
    assert attempts[-1][:2] == (True, True)


def test_a_narrow_pressure_that_does_not_settle_is_solved_on_fewer_lines():
    """As many lines as elsewhere found it before, with the same film."""
    parameters = load_parameters(ROOT / "tests/data/screws/example_16x05.toml")
    thick = changed(parameters, lubricant={"iso_vg": 220, "viscosity_index": 100.0})
    oil = thick.lubricant
    # which of the neighbours it is follows the rounding
    for load, rpm in ((62.0, 1500.0), (55.0, 1448.0), (65.0, 1500.0)):
        c = ball_contact(thick, "nut", load, rpm * RPM, 278.15)
        options = SolverOptions(n_x=map_nodes(c, oil))
        s = solve_contact(c, oil, thick.solid, options)
        assert s.converged
        if s.reason.endswith("on fewer lines"):
            break
    assert s.reason.endswith("on fewer lines")
    few = solve_contact(c, oil, thick.solid, replace(options, density=1.0 / NARROW_LINES))
    assert few.choice == s.choice
    assert s.h_c == pytest.approx(few.h_c, rel=1e-12)


def test_rolling_losses_of_neighbours_follow_the_load():
    """The pressure spike was not settled where the film was: the middle one left the others by 4 %."""
    parameters = load_parameters(PACKAGED_DATA / "gd4008_vg100.toml")
    losses = []
    for load in 19.0 * 1.04 ** np.arange(2, 5):
        s = solve_ball(parameters, "nut", load, 1453.0 * RPM, 328.15, thermal=True)
        losses.append(s.integrals.rolling_loss)
    assert abs(losses[1] / np.sqrt(losses[0] * losses[2]) - 1.0) <= 3e-3


def test_a_thick_film_whose_gap_closes_on_the_way_is_solved_otherwise():
    """A groove that fits the ball within 1e-5: at the approach of the heavier contact the lighter one has no gap."""
    heavy = ContactConditions(1.2, 2.79e-3, 100.8, 4.935, 4.935, 319.0, 226.4e9)
    oil = graded_oil(46, 105.0)
    start = solve_for_map(heavy, oil, STEEL, True)
    solution = solve_for_map(replace(heavy, load=0.84), oil, STEEL, True, start)
    assert start.converged
    assert solution.converged, solution.reason
    cold = solve_for_map(replace(heavy, load=0.84), oil, STEEL, True)
    assert abs(solution.h_c / cold.h_c - 1.0) <= 1e-3


def test_a_film_as_thick_as_the_bodies_is_named(caplog):
    """Solved all the same: in dimensionless numbers it is a contact like another."""
    c = replace(conditions(), load=1e-6)
    with caplog.at_level(logging.WARNING):
        s = solve_contact(c, OIL, STEEL, SolverOptions(thermal=False, n_x=65))
    assert s.converged
    assert s.h_c > 0.1 * c.R_x
    assert "above 0.1 of R_x" in caplog.text
    caplog.clear()
    solve_contact(conditions(), OIL, STEEL, SolverOptions(thermal=False, n_x=65))
    assert "R_x" not in caplog.text


@pytest.mark.parametrize("given", [0.2e-6, "rough", (1.0, 2.0)])
def test_roughness_of_another_kind_is_refused(given):
    with pytest.raises(ValueError, match=r"roughness = .*needs a Roughness or None"):
        replace(conditions(), roughness=given)


@pytest.mark.parametrize("given", ["1e-5", None, True, [1e-5]])
@pytest.mark.parametrize("name", ["tolerance", "warm_films", "extent", "density"])
def test_an_option_that_is_no_number_is_refused(name, given):
    with pytest.raises(ValueError, match=rf"{name} = .*needs a number"):
        SolverOptions(**{name: given})


@pytest.mark.parametrize("name", ["x_in", "x_out", "y_max"])
def test_a_domain_that_is_no_number_is_refused(name):
    with pytest.raises(ValueError, match=rf"{name} = .*needs a number"):
        SolverOptions(**{name: "3"})


@pytest.mark.parametrize(
    ("load", "speed", "temperature", "named"),
    [
        ("5", 100.0, 300.0, "load = '5'"),
        ([5.0], 100.0, 300.0, "load = "),
        (5.0, None, 300.0, "speed = None"),
        (5.0, -500.0, 300.0, r"speed = -500.0 rad/s; needs finite, > 0"),
        (5.0, 0.0, 300.0, r"speed = 0.0 rad/s"),
        (5.0, 100.0, "300", "temperature = '300'"),
    ],
)
def test_an_operating_point_that_is_none_is_refused(load, speed, temperature, named):
    with pytest.raises(ValueError, match=named):
        contact(SMALL, load, speed, temperature)


@pytest.mark.parametrize("start", [5, "near", [5]])
def test_a_start_of_another_kind_is_refused(start):
    with pytest.raises(ValueError, match=r"start = .*needs a ContactSolution"):
        solve_contact(conditions(), OIL, STEEL, SolverOptions(thermal=False, n_x=65), start)


def test_an_oil_that_is_none_is_refused():
    with pytest.raises(ValueError, match="oil = None; needs the LubricantParameters"):
        solve_contact(conditions(), None, STEEL)


def test_a_map_says_nothing_of_its_lightest_balls(caplog):
    with caplog.at_level(logging.WARNING):
        s = solve_ball(SMALL, "nut", 0.0759601, 400.0, 290.0, thermal=False)
    assert s.h_c > 0.1 * s.conditions.R_x
    assert "R_x" not in caplog.text
