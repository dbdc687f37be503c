"""Map build: every contact solved or refused, and the nut map the sum over the balls of its contacts."""

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import (
    CLOSED_FILM,
    FEW,
    GRID,
    LAW,
    ClosedFilm,
    closed_build,
    closed_contact,
    law_map,
    nut_map_of,
    partly_failed_contact,
    same_map,
    small_map,
    values,
)

from ballscrew_tehl.contact import UnconvergedContactError
from ballscrew_tehl.friction.mechanistic import nut_powers
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map import build
from ballscrew_tehl.nut_map.build import MapNotBuiltError, sharing_values
from ballscrew_tehl.nut_map.contact_map import MapContacts
from ballscrew_tehl.nut_map.contacts import FILMS, QUANTITIES, VISCOUS, film_parameters
from ballscrew_tehl.physics.ball_law import contact_angle_at_ball_load
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.load import double_nut_loads, nut_loads, separation_load

SCREW, ROLLING = GD4008.screw, film_parameters(GD4008)
FRICTION = FrictionSet("test", "published", "solved", 7.0, 0.005, 3e-8)
MAP = nut_map_of(small_map())
#: error of the few nodes of GRID, and of its few contacts
CLOSED = 4e-4 + CLOSED_FILM


def nodes(name):
    lo, hi, count = getattr(GRID, name)
    return np.linspace(lo, hi, count) if name == "temperature" else np.geomspace(lo, hi, count)


# --- contacts ---


@pytest.mark.slow
def test_every_contact_is_stored_at_its_point_whatever_the_order():
    """Four threads finish out of order; the contacts of the films that are shown are solved as well."""
    calls = []
    with ThreadPoolExecutor(4) as executor:
        built = closed_build(grid=FEW, executor=executor, progress=lambda *call: calls.append(call[:2]))
    for raceway, contacts in built.contact_map.contacts.items():
        for i, point in enumerate(contacts.points.tolist()):
            expected = closed_contact(GD4008, raceway, *point)
            assert {name: contacts.values[name][i] for name in QUANTITIES} == expected
    same_map(built, closed_build(grid=FEW))
    header = built.header
    # two kinematics, two raceways
    assert header["contacts"] == 4 * FEW.contact_first == calls[-1][0] == calls[-1][1]
    assert (header["contacts_not_solved"], header["range_cut"]) == (0, "")
    assert (header["kinematics"], header["film_kinematics"]) == ("published", "rolling_frame")
    for name in ("force", "speed", "temperature", "preload"):
        assert tuple(header["axes"][name]) == getattr(FEW, name)


@pytest.mark.slow
def test_contacts_are_added_until_the_films_left_out_are_known():
    """The mean error counts, and the largest one alone."""
    enough = replace(FEW, contact_batch=4, contact_max=36, contact_tolerance=1.0, contact_largest=100.0)
    for change, count in (({}, 32), ({"contact_tolerance": 1e-9}, 36), ({"contact_largest": 1e-9}, 36)):
        assert closed_build(LAW, grid=replace(enough, **change)).header["contacts"] == 2 * count


def test_solved_contact_has_its_values_under_their_names(monkeypatch):
    """Isothermal film from the isothermal solve, all else but the branch from the thermal one."""

    def solve(parameters, raceway, load, speed, temperature, thermal):
        scale = 2.0 if thermal else 1.0
        if math.isnan(load) and thermal:
            raise UnconvergedContactError("contact not solved: any")
        return SimpleNamespace(
            h_c=scale * speed, h_m=3.0 * scale * speed, temperature_rise_mean=5.0 * scale * load,
            rolling_loss=13.0 * scale, core_pressure=17.0 * scale, core_area=19.0 * scale,
            mean_temperature=scale * temperature,
            branch="asymptotic" if speed > 15.0 and not thermal else "resolved",
        )  # fmt: skip

    monkeypatch.setattr(build, "solve_ball", solve)
    expected = {
        "isothermal_central_film": 20.0, "thermal_central_film": 40.0, "thermal_minimum_film": 120.0,
        "temperature_rise": 400.0, "rolling_loss": 26.0, "core_pressure": 34.0, "core_area": 38.0,
        "mean_rise": 300.0, "asymptotic": 1.0,
    }  # fmt: skip
    assert build._solve_contact(GD4008, "nut", 40.0, 20.0, 300.0) == expected
    assert build._solve_contact(GD4008, "nut", 40.0, 10.0, 300.0)["asymptotic"] == 0.0
    lost = build._solve_contact(GD4008, "nut", math.nan, 20.0, 300.0)
    assert lost.keys() == QUANTITIES.keys()
    assert all(math.isnan(value) for value in lost.values())


# --- failures ---


@pytest.mark.slow
def test_map_needs_half_of_its_contacts(monkeypatch):
    """And only numbers: a contact that converged with one that is not finite is refused."""
    monkeypatch.setattr(build, "UNCERTAIN", math.inf)
    jobs = len(RACEWAYS) * FEW.contact_first

    def closed_but(share, **bad):
        lost = []

        def solve(*arguments):
            # spread, so that the rest still covers the range
            lost.append(int(share * (len(lost) + 1)) > int(share * len(lost)))
            found = closed_contact(*arguments)
            return (found | (bad or dict.fromkeys(found, math.nan))) if lost[-1] else found

        return solve

    assert closed_build(LAW, FEW, solve=closed_but(0.49)).header["contacts_not_solved"] == int(0.49 * jobs)
    words = (
        f"^{int(0.52 * jobs)} of {jobs} contacts .* 100 to 1000 r/min, 20 to 40 C.*by --preload-n, --speed"
    )
    with pytest.raises(MapNotBuiltError, match=words):
        closed_build(LAW, FEW, solve=closed_but(0.52))
    for bad in ({FILMS[2]: math.nan}, {"temperature_rise": math.inf}):
        with pytest.raises(ValueError, match="finite"):
            closed_build(LAW, FEW, solve=closed_but(0.1, **bad))


@pytest.mark.slow
def test_contacts_that_do_not_converge_are_interpolated_or_cut_away(monkeypatch):
    """Heavy, slow contacts of the nut."""
    whole = law_map()
    monkeypatch.setattr(build, "UNCERTAIN", math.inf)
    built = closed_build(LAW, solve=partly_failed_contact)
    contacts = built.contact_map.contacts["nut"]
    lost = (contacts.points[:, 0] > 100.0) & (contacts.points[:, 1] < 15.0)
    np.testing.assert_array_equal(~contacts.good, lost)
    assert built.header["contacts_not_solved"] == lost.sum() >= 4
    assert (built.header["range_cut"], built.header["axes"]) == ("", whole.header["axes"])
    monkeypatch.setattr(build, "UNCERTAIN", 1e-6)
    built = closed_build(LAW, solve=partly_failed_contact)
    axes = built.header["axes"]
    assert built.header["range_cut"].startswith("highest preload ")
    highest = axes["preload"][1]
    assert axes["force"] == [GRID.force[0], highest, GRID.force[2]]
    cut, full = (nut_map_of(each, "mechanistic") for each in (built, whole))
    assert not cut.evaluate(1.01 * highest, 30.0, 303.0).in_range
    torques = [each.evaluate(2000.0, 30.0, 303.0).viscous_torque for each in (cut, full)]
    assert torques[0] == pytest.approx(torques[1], rel=CLOSED)


# --- the nut map against sums over the balls ---


def test_random_points_agree_with_the_sum_over_the_balls():
    """Up to and beyond the load that frees a nut; the film is the closed one, without the contact map."""
    rng, free = np.random.default_rng(8), 0
    for film in ("solved", "solved_thermal") * 20:
        preload = float(np.exp(rng.uniform(np.log(600.0), np.log(2500.0))))
        axial, speed = preload * rng.uniform(-3.5, 3.5), float(np.exp(rng.uniform(*np.log(GRID.speed[:2]))))
        relieved = min(double_nut_loads(SCREW, preload, axial, SCREW.ball_count)[2:4])
        # below its axis of forces the map follows power laws
        if 0.0 < relieved < GRID.force[0]:
            continue
        free += relieved == 0.0
        point = (preload, speed, float(rng.uniform(*GRID.temperature[:2])), axial)
        state = nut_map_of(small_map(), film).evaluate(*point)
        closed = ClosedFilm(GD4008, film == "solved_thermal")
        expected = double_nut_torque(GD4008, replace(FRICTION, film_model=film), closed, *point)
        assert state.in_range
        assert state[:3] == pytest.approx(expected[:3], rel=CLOSED)
    assert free >= 3


def test_films_and_rise_are_those_of_all_balls_that_carry_and_roll():
    """Film and rise fall or rise with load, by raceway: either end of the loads may hold the extreme."""
    rng, ends = np.random.default_rng(9), set()
    for _ in range(8):
        force, *at = (float(rng.choice(nodes(name))) for name in ("force", "speed", "temperature"))
        loads = nut_loads(SCREW, force, SCREW.loaded_ball_count)
        closed = partial(values, ROLLING)
        ends.update((raceway, int(np.argmin(closed(raceway, FILMS[2], loads, *at)))) for raceway in RACEWAYS)
        state, angle = MAP.evaluate(force, *at), contact_angle_at_ball_load(SCREW, loads.max())
        radii = (reduced_radii(SCREW, angle, raceway) for raceway in RACEWAYS)
        expected = (
            min(closed(raceway, FILMS[2], loads, *at).min() for raceway in RACEWAYS),
            *(closed(raceway, FILMS[1], loads, *at).min() for raceway in RACEWAYS),
            max(closed(raceway, "temperature_rise", loads, *at).max() for raceway in RACEWAYS),
        )
        assert state[3:7] == pytest.approx(expected, rel=CLOSED)
        p_max = max(float(ellipse(loads.max(), *each, E_prime(SCREW)).p_max) for each in radii)
        assert state[7:9] == pytest.approx((p_max, loads.max()), rel=1e-9)
    assert {("screw", SCREW.loaded_ball_count - 1), ("nut", 0)} <= ends


def test_map_of_rolling_balls_holds_the_mechanistic_law_alone():
    """At its nodes: torques of the law for both raceways from the contacts of the map, its films their own."""
    built = law_map()
    assert [name for name in built.arrays if name.startswith(VISCOUS)] == [f"{VISCOUS}mechanistic"]
    films = [f"{VISCOUS}solved", f"{VISCOUS}solved_thermal"]
    assert [name for name in small_map().arrays if name.startswith(VISCOUS)] == films
    assert built.header["film_kinematics"] == built.header["kinematics"] == "rolling_frame"
    nut_map, contacts = nut_map_of(built, "mechanistic"), MapContacts(built.contact_map)
    for i, j, k in ((0, -1, 0), (1, 0, 1), (-1, 2, -1)):
        force, *at = nodes("force")[i], nodes("speed")[j], nodes("temperature")[k]
        nut = nut_powers(LAW, nut_loads(LAW.screw, force, LAW.screw.loaded_ball_count), *at, contacts)
        surfaces = np.exp(nut_map.surfaces(force, *at)[:4])
        expected = nut.rolling_screw, nut.rolling_nut, nut.shear, nut.thrust_factor
        np.testing.assert_allclose(surfaces, np.ravel(expected), rtol=1e-6)
        state = nut_map.evaluate(force, *at)
        assert state.hysteresis_torque == pytest.approx(2.0 * nut.hysteresis, rel=1e-8)


# --- sharing of the axial load ---


def test_relieved_nut_goes_from_the_preload_to_zero():
    ratio, relieved = sharing_values(GD4008, GRID)
    assert (relieved[:, 0] == 1.0).all()
    assert (relieved[:, -1] == 0.0).all()
    assert (np.diff(relieved, axis=1) < 0.0).all()
    for i, preload in enumerate(nodes("preload").tolist()):
        expected = [separation_load(SCREW, preload, SCREW.ball_count, sign) / preload for sign in (1, -1)]
        assert ratio[i] == pytest.approx(expected, rel=1e-12)
    # a sum over both nuts does not depend on which one is relieved, only on the two forces
    for share in (-1.2, -0.99, -0.6, -0.1, 0.05, 0.35, 0.8, 0.97, 1.1):
        for preload in (450.0, 1100.0, 3000.0):
            axial = share * separation_load(SCREW, preload, SCREW.ball_count, 1 if share > 0.0 else -1)
            loads = double_nut_loads(SCREW, preload, axial, SCREW.ball_count)
            pair = sorted((loads.force_a, loads.force_b))
            found = MAP._forces_point(preload, axial)
            # error of the spline over the share 3e-5, near the end where the nut separates
            assert found == pytest.approx(pair, abs=1e-4 * preload)
            assert found[1] - found[0] == pytest.approx(abs(axial), rel=1e-12)
