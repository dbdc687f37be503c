"""Map build: the nut map is the sum over the balls of its contacts; no contact is solved."""

from dataclasses import replace

import numpy as np
import pytest
from paths import ROOT
from reference_screw import GD4008
from synthetic_contacts import GRID, LAW, ClosedContacts, ClosedFilm, law_map, nut_map_of, small_map

from ballscrew_tehl.atlas.contact_atlas import load_atlas
from ballscrew_tehl.friction.film_shear import double_nut_torque, nut_forces
from ballscrew_tehl.friction.mechanistic import double_nut_parts, nut_powers
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map.build import build_map, sharing_values
from ballscrew_tehl.nut_map.grid import screw_grid
from ballscrew_tehl.parameters.file import FOUR_POINT, changed, load_screw
from ballscrew_tehl.physics.ball_law import contact_angle_at_ball_load
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.load import double_nut_loads, nut_loads, separation_load

SCREW = GD4008.screw
FOUR = changed(LAW, screw={"preload_kind": FOUR_POINT})
SPACED = changed(LAW, screw={"spacer_balls": True, "ball_count": 36, "loaded_ball_count": 36})
MAP, CONTACTS = nut_map_of(small_map()), ClosedContacts(GD4008)
#: error of the few nodes of GRID
CLOSED = 5e-4


def nodes(name):
    lo, hi, count = getattr(GRID, name)
    return np.linspace(lo, hi, count) if name == "temperature" else np.geomspace(lo, hi, count)


def test_random_points_agree_with_the_sum_over_the_balls():
    rng, free = np.random.default_rng(8), 0
    friction, closed = default_friction_set(GD4008), ClosedFilm(GD4008)
    for _ in range(40):
        preload = float(np.exp(rng.uniform(np.log(600.0), np.log(2500.0))))
        axial, speed = preload * rng.uniform(-3.5, 3.5), float(np.exp(rng.uniform(*np.log(GRID.speed[:2]))))
        relieved = min(double_nut_loads(SCREW, preload, axial, SCREW.ball_count)[2:4])
        # below its axis of forces the map follows power laws
        if 0.0 < relieved < GRID.force[0]:
            continue
        free += relieved == 0.0
        point = (preload, speed, float(rng.uniform(*GRID.temperature[:2])), axial)
        state = MAP.evaluate(*point)
        expected = double_nut_torque(GD4008, friction, closed, *point)
        assert state.in_range
        assert state[:3] == pytest.approx(expected[:3], rel=CLOSED)
    assert free >= 3


def test_films_and_rise_are_those_of_all_balls_that_carry_and_roll():
    rng, ends = np.random.default_rng(9), set()
    for _ in range(8):
        force, *at = (float(rng.choice(nodes(name))) for name in ("force", "speed", "temperature"))
        loads = nut_loads(SCREW, force, SCREW.loaded_ball_count)
        points = loads, *(np.full_like(loads, value) for value in at)
        balls = {raceway: CONTACTS.at(raceway, *points) for raceway in RACEWAYS}
        ends.update((raceway, int(np.argmin(found["minimum_film"]))) for raceway, found in balls.items())
        state, angle = MAP.evaluate(force, *at), contact_angle_at_ball_load(SCREW, loads.max())
        expected = (
            min(found["minimum_film"].min() for found in balls.values()),
            *(found["central_film"].min() for found in balls.values()),
            max(found["temperature_rise"].max() for found in balls.values()),
        )
        assert state[3:7] == pytest.approx(expected, rel=CLOSED)
        radii = (reduced_radii(SCREW, angle, raceway) for raceway in RACEWAYS)
        p_max = max(float(ellipse(loads.max(), *each, E_prime(SCREW)).p_max) for each in radii)
        assert state[7:9] == pytest.approx((p_max, loads.max()), rel=1e-9)
    assert {("screw", SCREW.loaded_ball_count - 1), ("nut", 0)} <= ends


@pytest.mark.parametrize("law", [LAW, SPACED])
def test_map_of_rolling_balls_holds_the_law_at_its_nodes(law):
    built = law_map(law)
    nut_map, contacts = nut_map_of(built), ClosedContacts(law)
    for i, j, k in ((0, -1, 0), (1, 0, 1), (-1, 2, -1)):
        force, *at = nodes("force")[i], nodes("speed")[j], nodes("temperature")[k]
        nut = nut_powers(law, nut_loads(law.screw, force, law.screw.loaded_ball_count), *at, contacts)
        surfaces = np.exp(nut_map.surfaces(force, *at)[:4])
        expected = nut.viscous_screw, nut.viscous_nut, nut.shear, nut.thrust_factor
        np.testing.assert_allclose(surfaces, np.ravel(expected), rtol=1e-6)
        state = nut_map.evaluate(force, *at)
        assert state.hysteresis_torque == pytest.approx(2.0 * nut.hysteresis, rel=1e-8)
        without, whole = (nut_map.evaluate(force, *at, 0.0, 1.0, k).sliding_torque for k in (0.0, 1.0))
        ball_on_ball = 2.0 * nut.sliding * nut.thrust_factor
        assert whole - without == pytest.approx(ball_on_ball, rel=1e-6, abs=1e-20)
    header, atlas = built.header, load_atlas()
    assert header["law"] == "mechanistic"
    assert (header["atlas"], header["certificate"]) == (atlas.hash, atlas.header["certificate"])
    for name in ("force", "speed", "temperature", "preload"):
        assert tuple(header["axes"][name]) == getattr(GRID, name)


def test_oversize_balls_are_held_by_four_flanks_or_free_of_two():
    """Under preload, under an axial load, and beyond that which frees two flanks; without the friction of ball on ball.

    Free, the shear is that of a mean over speeds and temperatures.
    """
    nut_map = nut_map_of(law_map(FOUR))
    for axial, near in ((0.0, 2e-3), (1500.0, 2e-3), (-8000.0, 0.02)):
        forces = list(nut_forces(FOUR, 2000.0, axial))
        parts = double_nut_parts(FOUR, forces, ClosedContacts(FOUR), 40.0, 303.0, 1.0, 0.0)
        state = nut_map.evaluate(2000.0, 40.0, 303.0, axial, 1.0, 0.0)
        assert state.friction_torque == pytest.approx(parts.total, rel=near)


@pytest.mark.parametrize(
    "screw", [LAW, load_screw(ROOT / "examples/screws/example_80x20.toml")], ids=["40x8", "80x20"]
)
def test_balls_that_an_axial_load_nearly_frees_have_contacts_in_numbers(screw):
    """Far below the range of the screw, at its highest speed: closed films thicker than the ball, losses of nothing."""
    light = changed(screw, map={"preload_min": 500.0, "preload_max": 3000.0})
    grid = screw_grid(light)
    few = replace(
        grid, force=(*grid.force[:2], 4), speed=(*grid.speed[:2], 4), temperature=(*grid.temperature[:2], 4)
    )
    built = build_map(light, few)
    assert all(np.isfinite(array).all() for array in built.arrays.values())


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
