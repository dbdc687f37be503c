"""Contact of one ball, its map over load, speed and temperature, and the film without a map."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import LOAD_EXPONENT, small_map, values

from ballscrew_tehl.contact import ball_contact as operating_contact
from ballscrew_tehl.contact.ball_contact import UnconvergedContactError, ball_contact, solve_ball
from ballscrew_tehl.friction.sets import load_friction_sets
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map import file as store
from ballscrew_tehl.nut_map.contact_map import FILMS, QUANTITIES, SolvedFilm
from ballscrew_tehl.nut_map.file import FILM_MODELS, load_contact_map, load_map, packaged_map
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.ball_law import contact_angle_at_ball_load
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, reduced_radii
from ballscrew_tehl.physics.kinematics import KINEMATICS, surface_speeds
from ballscrew_tehl.physics.load import double_nut_loads, nut_loads, separation_load
from ballscrew_tehl.refinement import direct
from ballscrew_tehl.refinement.direct import LOAD_NODES, DirectFilm, direct_extremes
from ballscrew_tehl.runtime.nut_law import DoubleNutState

RPM = math.pi / 30.0
SCREW = GD4008.screw
MAP = small_map().contact_map
INTERPOLATED = (*FILMS, "temperature_rise")
PACKAGED = [name for name in KINEMATICS if packaged_map(name).exists()]
#: the closed formula takes the mean radii of the balls of one call: a ball alone differs by 6e-5
ALONE = 1e-4
POINT = (30.0, 30.0, 303.0)


# --- interpolation ---


def assert_nodes_come_back(contact_map):
    loads, speeds, temperatures = contact_map.axes.nodes
    for raceway in RACEWAYS:
        for name in INTERPOLATED:
            for j, speed in enumerate(speeds):
                for k, temperature in enumerate(temperatures):
                    found = contact_map.evaluate(raceway, name, loads, float(speed), float(temperature))
                    np.testing.assert_allclose(found, contact_map.samples[raceway][name][:, j, k], rtol=1e-11)


def test_map_equals_samples_at_the_nodes():
    assert_nodes_come_back(MAP)


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", PACKAGED)
def test_packaged_map_equals_samples_at_the_nodes(kinematics):
    contact_map = load_contact_map(None, changed(GD4008, friction={"kinematics": kinematics}))
    assert_nodes_come_back(contact_map)
    for raceway in RACEWAYS:
        samples = contact_map.samples[raceway]
        assert all(np.isfinite(samples[name]).all() for name in QUANTITIES)
        assert all((samples[name] > 0.0).all() for name in (*INTERPOLATED, "pressure_max"))
        # a light ball on a thick film is nearly rigid: both lie at its lowest point, up to the grid
        assert (samples["thermal_minimum_film"] <= 1.001 * samples["thermal_central_film"]).all()


def test_cubic_logarithms_are_exact_between_the_nodes():
    rng = np.random.default_rng(12)
    for _ in range(30):
        raceway, name = rng.choice(RACEWAYS), rng.choice(INTERPOLATED)
        loads = np.exp(rng.uniform(*np.log(MAP.axes.load[:2]), 5))
        speed = float(np.exp(rng.uniform(*np.log(MAP.axes.speed[:2]))))
        temperature = float(rng.uniform(*MAP.axes.temperature[:2]))
        expected = values(GD4008, raceway, name, loads, speed, temperature)
        tolerance = 1e-10 if name == "temperature_rise" else ALONE
        np.testing.assert_allclose(
            MAP.evaluate(raceway, name, loads, speed, temperature), expected, rtol=tolerance
        )


def test_one_load_and_many_give_the_same():
    loads = np.array([7.0, 30.0, 31.0, 200.0])
    for raceway in RACEWAYS:
        for name in INTERPOLATED:
            many = MAP.evaluate(raceway, name, loads, 30.0, 303.0)
            alone = [MAP.evaluate(raceway, name, load, 30.0, 303.0) for load in loads.tolist()]
            assert many.shape == (4,)
            assert alone[0].shape == ()
            np.testing.assert_allclose(many, alone, rtol=ALONE)


def test_ends_of_the_range_are_included():
    for ends in zip(MAP.axes.load[:2], MAP.axes.speed[:2], MAP.axes.temperature[:2], strict=True):
        load, speed, temperature = (value * (1.0 + 1e-12) for value in ends)
        assert np.isfinite(MAP.evaluate("nut", FILMS[0], np.array([load]), speed, temperature)).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("end", [0, 1])
def test_outside_the_range_is_refused(axis, end):
    bounds = (MAP.axes.load, MAP.axes.speed, MAP.axes.temperature)[axis]
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
    assert tuple(SolvedFilm(MAP, thermal).name for thermal in (False, True)) == FILM_MODELS
    for thermal, quantity in ((False, FILMS[0]), (True, FILMS[1])):
        film = SolvedFilm(MAP, thermal).central_film("screw", loads, 30.0, 303.0)
        np.testing.assert_array_equal(film, MAP.evaluate("screw", quantity, loads, 30.0, 303.0))
        assert film == pytest.approx(values(GD4008, "screw", quantity, loads, 30.0, 303.0), rel=ALONE)


# --- one ball ---


@pytest.mark.parametrize("kinematics", KINEMATICS)
@pytest.mark.parametrize("raceway", RACEWAYS)
def test_ball_has_its_own_angle_and_the_speeds_of_its_raceway(kinematics, raceway):
    parameters = changed(GD4008, friction={"kinematics": kinematics})
    contact = ball_contact(parameters, raceway, 39.5, 314.0, 310.0)
    speeds = surface_speeds(parameters, raceway, 314.0)
    assert (contact.u_1, contact.u_2, contact.u_e) == (speeds.u_1, speeds.u_2, speeds.u_e)
    angle = contact_angle_at_ball_load(SCREW, 39.5)
    assert angle > SCREW.contact_angle
    assert (contact.R_x, contact.R_y) == reduced_radii(SCREW, angle, raceway)
    assert (contact.load, contact.temperature, contact.E_prime) == (39.5, 310.0, E_prime(SCREW))
    assert contact.roughness is None
    assert all(type(value) is float for name, value in vars(contact).items() if name != "roughness")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("cage", 39.5, 314.0, 303.0), "cage"),
        (("nut", -1.0, 314.0, 303.0), "ball_load = -1"),
        (("nut", 0.0, 314.0, 303.0), "load = 0"),
        (("nut", 39.5, 0.0, 303.0), "u_1"),
        (("nut", 39.5, math.nan, 303.0), "speed = nan"),
        (("nut", 39.5, 314.0, 0.0), "temperature = 0"),
    ],
)
def test_impossible_contact_is_refused(arguments, named):
    with pytest.raises(ValueError, match=named):
        ball_contact(GD4008, *arguments)


@pytest.mark.parametrize("thermal", [False, True])
def test_unconverged_contact_is_solved_on_other_grids_and_named(monkeypatch, thermal):
    calls = []

    def solve(conditions, oil, solid, options):
        calls.append((conditions, oil, solid, options.thermal, options.n_x, options.max_thermal))
        return SimpleNamespace(converged=len(calls) == success, reason="pressure spike wanders")

    monkeypatch.setattr(operating_contact, "solve_contact", solve)
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
    expected = (ball_contact(GD4008, "nut", 39.5, 314.0, 303.0), GD4008.lubricant, GD4008.solid, thermal)
    assert all(call[:-2] == expected for call in calls)


# --- film without a map ---


def closed_ball(parameters, raceway, load, speed, temperature, thermal):
    """In place of solve_ball: a cubic of ln(load), which falls on the screw and rises on the nut."""
    x = math.log(load / 30.0)
    h = (0.8e-7 if thermal else 1e-7) * math.exp(LOAD_EXPONENT[raceway] * (x + 0.05 * x**3))
    return SimpleNamespace(
        h_c=h, h_m=0.5 * h, temperature_rise=load if raceway == "nut" else 50.0 / load,
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
    loads = np.linspace(10.0, 10.0 * width, 9)
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
    torques = {"viscous_torque", "hysteresis_torque", "sliding_torque"}
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
            "film_temperature_rise": max(ball.temperature_rise for ball in everything),
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
