"""Map build: every contact solved or refused, and the nut map the sum over the balls of its contacts."""

import math
import os
import pickle
import re
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import (
    CLOSED_FILM,
    GRID,
    ClosedFilm,
    closed_build,
    closed_contact,
    nut_map_of,
    partly_failed_contact,
    partly_solved_contact,
    same_map,
    small_map,
    values,
)

from ballscrew_tehl.contact import UnconvergedContactError, solve_ball
from ballscrew_tehl.contact import ball_contact as operating_contact
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map import build
from ballscrew_tehl.nut_map.build import MapNotBuiltError, extreme_values, sharing_values
from ballscrew_tehl.nut_map.contact_map import SolvedFilm
from ballscrew_tehl.nut_map.contacts import FILMS, MAPPED, QUANTITIES
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.ball_law import contact_angle_at_ball_load
from ballscrew_tehl.physics.hertz import RACEWAYS, E_prime, ellipse, reduced_radii
from ballscrew_tehl.physics.load import double_nut_loads, nut_loads, separation_load

SCREW = GD4008.screw
FRICTION = FrictionSet("test", "published", "solved", 7.0, 0.005, 3e-8)
MAP = nut_map_of(small_map())
#: error of the few nodes of GRID, and of its few contacts
CLOSED = 4e-4 + CLOSED_FILM


def nodes(name):
    lo, hi, count = getattr(GRID, name)
    return np.linspace(lo, hi, count) if name == "temperature" else np.geomspace(lo, hi, count)


FILM_MODELS = {
    name: SolvedFilm(small_map().contact_map, thermal)
    for name, thermal in (("solved", False), ("solved_thermal", True))
}


def direct_torque(preload, speed, temperature, axial_load=0.0, film=FILM_MODELS["solved"]):
    """Sum over the balls without a nut map."""
    return double_nut_torque(GD4008, FRICTION, film, preload, speed, temperature, axial_load)


# --- contacts ---


def test_every_contact_is_stored_at_its_point():
    """Four threads finish out of order."""
    with ThreadPoolExecutor(4) as executor:
        contact_map = closed_build(executor=executor).contact_map
    for raceway, contacts in contact_map.contacts.items():
        for i, (load, speed, temperature) in enumerate(contacts.points.tolist()):
            expected = closed_contact(GD4008, raceway, load, speed, temperature)
            assert {name: contacts.values[name][i] for name in QUANTITIES} == expected


def test_header_counts_the_contacts():
    header, contacts = small_map().header, small_map().contact_map.contacts
    # two raceways, isothermal and thermal
    assert header["contacts"] == 4 * GRID.contact_first
    assert header["contacts_not_solved"] == 0
    assert header["range_cut"] == ""
    # closed_contact flags loads above 100 N
    share = np.mean([np.mean(each.points[:, 0] > 100.0) for each in contacts.values()])
    assert 0.1 < share < 0.5
    assert header["asymptotic_share"] == pytest.approx(share)
    assert set(header["sampling_errors"]) == set(RACEWAYS)
    errors = np.array(list(header["sampling_errors"].values()))
    assert ((errors > 1e-6) & (errors < 1e-3)).all()
    assert header["axes"]["share"] == [0.0, 1.0, GRID.share_nodes]
    assert {name: tuple(header["axes"][name]) for name in ("force", "speed", "temperature", "preload")} == {
        name: getattr(GRID, name) for name in ("force", "speed", "temperature", "preload")
    }


def test_progress_rises_to_the_end():
    calls = []
    built = closed_build(progress=lambda *call: calls.append(call))
    finished, totals, texts = zip(*calls, strict=True)
    assert set(totals) == {built.header["contacts"]}
    assert finished[-1] == totals[-1]
    # a contact at a time, isothermal and thermal
    assert set(np.diff([0, *finished])) == {2}
    assert all(texts)


def test_progress_knows_of_the_contacts_that_are_added():
    calls = []
    grid = replace(GRID, contact_first=40, contact_most=56, contact_tolerance=1e-9)
    built = closed_build(grid=grid, progress=lambda *call: calls.append(call[:2]))
    totals = sorted({total for _, total in calls})
    assert totals == [4 * 40, 4 * 56]
    assert calls[-1] == (4 * 56, 4 * 56)
    assert built.header["contacts"] == 4 * 56


def test_solved_contact_has_its_values_under_their_names(monkeypatch):
    """Isothermal film from the isothermal solve, all else but the branch from the thermal one."""

    def solve(parameters, raceway, load, speed, temperature, thermal):
        scale = 2.0 if thermal else 1.0
        return SimpleNamespace(
            h_c=scale * speed, h_m=3.0 * scale * speed, p_max=7.0 * scale * temperature,
            traction_force=11.0 * scale * speed, error_estimate=23.0 * scale,
            temperature_rise_mean=5.0 * scale * load, temperature_rise_smooth=4.0 * scale * load,
            rolling_loss=13.0 * scale, core_pressure=17.0 * scale, core_area=19.0 * scale,
            mean_temperature=scale * temperature,
            branch="asymptotic" if speed > 15.0 and not thermal else "resolved",
        )  # fmt: skip

    monkeypatch.setattr(build, "solve_ball", solve)
    expected = {
        "isothermal_central_film": 20.0, "thermal_central_film": 40.0, "thermal_minimum_film": 120.0,
        "temperature_rise": 400.0, "temperature_rise_smooth": 320.0, "pressure_max": 4200.0,
        "traction_force": 440.0, "rolling_loss": 26.0, "core_pressure": 34.0, "core_area": 38.0,
        "mean_rise": 300.0, "error_estimate": 46.0, "asymptotic": 1.0,
    }  # fmt: skip
    assert build._solve_contact(GD4008, "nut", 40.0, 20.0, 300.0) == expected
    assert build._solve_contact(GD4008, "nut", 40.0, 10.0, 300.0)["asymptotic"] == 0.0


@pytest.mark.parametrize("which", [False, True], ids=["isothermal", "thermal"])
def test_contact_that_does_not_converge_is_nan(monkeypatch, which):
    def solve(parameters, raceway, load, speed, temperature, thermal):
        if thermal == which:
            raise UnconvergedContactError("contact not solved: any")
        return SimpleNamespace(
            h_c=speed, h_m=speed, p_max=1.0, traction_force=1.0, error_estimate=1.0, branch="resolved",
            temperature_rise_smooth=1.0, temperature_rise_mean=1.0, rolling_loss=1.0, core_pressure=1.0,
            core_area=1.0, mean_temperature=1.0,
        )  # fmt: skip

    monkeypatch.setattr(build, "solve_ball", solve)
    contact = build._solve_contact(GD4008, "nut", 40.0, 20.0, 300.0)
    assert contact.keys() == QUANTITIES.keys()
    assert all(math.isnan(value) for value in contact.values())


# --- processes and failures ---


@pytest.mark.slow
def test_one_and_two_workers_build_the_same_map_and_leave_the_environment(monkeypatch):
    """One contact of it is solved, by spawned processes."""
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    one, two = (closed_build(solve=partly_solved_contact, workers=workers) for workers in (1, 2))
    assert os.environ["OMP_NUM_THREADS"] == "3"
    assert "MKL_NUM_THREADS" not in os.environ
    same_map(one, two)
    range_, contacts = one.contact_map.range, one.contact_map.contacts["nut"]
    corner = np.array([range_.load[0], range_.speed[0], range_.temperature[0]])
    (place,) = np.flatnonzero(np.all(np.isclose(contacts.points, corner, rtol=1e-12), axis=1))
    cold, hot = (
        solve_ball(GD4008, "nut", *contacts.points[place].tolist(), thermal=t) for t in (False, True)
    )
    found = {name: float(array[place]) for name, array in contacts.values.items()}
    rise = hot.temperature_rise_mean
    # other numbers of BLAS threads round otherwise
    solved = {FILMS[0]: cold.h_c, FILMS[1]: hot.h_c, FILMS[2]: hot.h_m, "temperature_rise": rise}
    solved |= {"pressure_max": hot.p_max, "traction_force": hot.traction_force}
    assert {name: found[name] for name in solved} == pytest.approx(solved, rel=1e-8)
    closed = small_map().contact_map.contacts["nut"].values
    assert all(abs(found[name] / closed[name][place] - 1.0) > 1e-6 for name in FILMS)


def test_workers_compute_with_one_thread_each():
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    with build.worker_pool(1) as pool:
        assert list(pool.map(os.getenv, names)) == ["1", "1", "1"]


#: pieces of work of GRID
JOBS = len(RACEWAYS) * GRID.contact_first


class Reluctant(Executor):
    """Runs the first jobs when they are submitted, never the others."""

    def __init__(self, run: int) -> None:
        self.run, self.futures = run, []

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        self.futures.append(future)
        if len(self.futures) <= self.run:
            try:
                future.set_result(fn(*args, **kwargs))
            except ArithmeticError as error:
                future.set_exception(error)
        return future


def test_range_that_cannot_be_solved_is_refused_with_its_remedies(monkeypatch):
    """The real function of a contact; only the solver is replaced."""
    calls = []

    def solve(conditions, oil, solid, options, warn):
        calls.append(options.thermal)
        return SimpleNamespace(converged=False, reason="step too small", M=1e3)

    monkeypatch.setattr(operating_contact, "solve", solve)
    executor = Reluctant(run=JOBS)
    with pytest.raises(MapNotBuiltError) as caught:
        build.build_contact_map(GD4008, GRID, executor)
    range_ = small_map().contact_map.range
    assert str(caught.value) == (
        f"{JOBS} of {JOBS} contacts of the range did not converge (ball load {range_.load[0]:.3g} to "
        f"{range_.load[1]:.3g} N, 100 to 1000 r/min, 20 to 40 C): give a narrower range by --preload-n, --speed-rpm, "
        "--temperature-c"
    )
    assert isinstance(caught.value, ArithmeticError)
    # an isothermal contact that fails is not solved with heat
    assert not any(calls)
    assert len(executor.futures) == JOBS


@pytest.mark.parametrize(("share", "built"), [(0.49, True), (0.51, False)])
def test_map_needs_half_of_its_contacts(share, built):
    failed = []

    def solve(*arguments):
        found = closed_contact(*arguments)
        # every other one, so that the rest still covers the range
        if int(share * (len(failed) + 1)) > int(share * len(failed)):
            found = dict.fromkeys(found, math.nan)
        failed.append(arguments)
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "UNCERTAIN", math.inf)
        if built:
            assert closed_build(solve=solve).header["contacts_not_solved"] == int(share * JOBS)
        else:
            with pytest.raises(MapNotBuiltError, match=f"{int(share * JOBS)} of {JOBS} contacts"):
                closed_build(solve=solve)


def test_contacts_that_do_not_converge_are_counted_and_leave_the_others_as_they_are(monkeypatch):
    """Heavy, slow contacts of the nut; the map keeps its range, for UNCERTAIN is large here."""
    monkeypatch.setattr(build, "UNCERTAIN", math.inf)
    built, whole = closed_build(solve=partly_failed_contact), small_map()
    lost = ~built.contact_map.contacts["nut"].good
    points = built.contact_map.contacts["nut"].points
    np.testing.assert_array_equal(lost, (points[:, 0] > 100.0) & (points[:, 1] < 15.0))
    assert built.header["contacts_not_solved"] == lost.sum() >= 4
    assert built.header["contacts"] == whole.header["contacts"]
    assert built.header["range_cut"] == ""
    assert built.header["axes"] == whole.header["axes"]
    for raceway in RACEWAYS:
        found, expected = (each.contact_map.contacts[raceway] for each in (built, whole))
        np.testing.assert_array_equal(found.points, expected.points)
        for name in QUANTITIES:
            np.testing.assert_array_equal(found.values[name][found.good], expected.values[name][found.good])
            assert np.isnan(found.values[name][~found.good]).all()
    for name in MAPPED:
        one, two = (each.contact_map.models["screw"].kriging(name).hyper for each in (built, whole))
        np.testing.assert_array_equal(one, two)
    # in the middle of the range the map is the same, at the lost contacts it is extrapolated
    middle = whole.contact_map.evaluate("nut", FILMS[1], np.array([30.0]), 50.0, 303.0)
    assert built.contact_map.evaluate("nut", FILMS[1], np.array([30.0]), 50.0, 303.0) == pytest.approx(
        middle, rel=CLOSED_FILM
    )
    for film in ("solved", "solved_thermal"):
        assert all(np.isfinite(array).all() for array in built.arrays[film].values())


def test_range_is_cut_before_contacts_that_leave_the_friction_uncertain(monkeypatch):
    monkeypatch.setattr(build, "UNCERTAIN", 1e-6)
    built = closed_build(solve=partly_failed_contact)
    lost = built.contact_map.contacts["nut"].points[~built.contact_map.contacts["nut"].good]
    axes = built.header["axes"]
    assert built.header["range_cut"].startswith("highest preload ")
    highest = axes["preload"][1]
    heaviest = nut_loads(SCREW, highest, SCREW.loaded_ball_count).max()
    assert 0.9 * lost[:, 0].min() < heaviest < lost[:, 0].min()
    assert axes["force"] == [GRID.force[0], highest, GRID.force[2]]
    assert (axes["speed"], axes["temperature"]) == (list(GRID.speed), list(GRID.temperature))
    nut_map = nut_map_of(built)
    assert not nut_map.evaluate(1.01 * highest, 30.0, 303.0).in_range
    assert nut_map.evaluate(0.99 * highest, 30.0, 303.0).in_range
    point = (2000.0, 30.0, 303.0)
    assert nut_map.evaluate(*point)[:3] == pytest.approx(
        direct_torque(*point, film=ClosedFilm(GD4008, False))[:3], rel=CLOSED
    )


def test_interrupt_cancels_the_rest(monkeypatch):
    monkeypatch.setattr(build, "_solve_contact", closed_contact)

    def interrupt(*_):
        raise KeyboardInterrupt

    executor = Reluctant(run=2)
    with pytest.raises(KeyboardInterrupt):
        build.build_contact_map(GD4008, GRID, executor, interrupt)
    assert [future.cancelled() for future in executor.futures[:3]] == [False, False, True]
    assert all(future.cancelled() for future in executor.futures[2:])


def test_error_of_a_worker_is_unpickled_unchanged():
    error = pickle.loads(pickle.dumps(UnconvergedContactError("contact not solved: nut")))
    assert isinstance(error, UnconvergedContactError)
    assert str(error) == "contact not solved: nut"


@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("name", [FILMS[2], "temperature_rise"])
def test_contact_that_converged_with_a_number_that_is_not_finite_is_refused(bad, name):
    """Only a contact without a film counts as not solved."""

    def solve(parameters, raceway, load, speed, temperature):
        found = closed_contact(parameters, raceway, load, speed, temperature)
        return found | {name: bad} if raceway == "nut" and load > 100.0 else found

    with pytest.raises(ValueError, match="finite"):
        closed_build(solve=solve)


@pytest.mark.parametrize("name", ["force", "speed", "temperature", "preload"])
def test_too_few_nodes_are_refused(name):
    axis = (*getattr(GRID, name)[:2], 3)
    with pytest.raises(ValueError, match="3 nodes; needs >= 4"):
        closed_build(grid=replace(GRID, **{name: axis}))


# --- the nut map against sums over the balls ---


@pytest.mark.parametrize("film", ["solved", "solved_thermal"])
def test_nut_map_is_the_sum_over_the_balls_at_its_nodes(film):
    """Found: 1.3e-9, of the polynomial through three nodes over the loads of a nut."""
    nut_map = nut_map_of(small_map(), film)
    rng = np.random.default_rng(4)
    for _ in range(12):
        point = [float(rng.choice(nodes(name))) for name in ("force", "speed", "temperature")]
        state, direct = nut_map.evaluate(*point), direct_torque(*point, film=FILM_MODELS[film])
        assert state[:3] == pytest.approx(direct[:3], rel=1e-8)


class ClosedGridFilm:
    """build._GridFilm of the closed contacts themselves."""

    name = "closed"

    def __init__(self, contact_map, quantity):
        self.quantity = quantity

    def central_film(self, raceway, load, speed, temperature):
        return values(GD4008, raceway, self.quantity, load[:, None, None], speed, temperature)


def largest_error(grid, film):
    """Of the viscous torque over random points without axial load."""
    nut_map = nut_map_of(closed_build(grid=grid), film)
    rng = np.random.default_rng(6)
    errors = []
    for _ in range(40):
        preload, speed = (
            float(np.exp(rng.uniform(*np.log(getattr(GRID, n)[:2])))) for n in ("force", "speed")
        )
        point = (preload, speed, float(rng.uniform(*GRID.temperature[:2])))
        direct = direct_torque(*point, film=ClosedFilm(GD4008, film == "solved_thermal"))
        errors.append(abs(nut_map.evaluate(*point)[0] / direct[0] - 1.0))
    assert np.isfinite(errors).all()
    return max(errors)


@pytest.mark.slow
@pytest.mark.parametrize("film", ["solved", "solved_thermal"])
def test_error_between_the_nodes_falls_with_the_fourth_power_of_their_distance(monkeypatch, film):
    """Of the splines alone: kriging has finer waves than the closed films."""
    monkeypatch.setattr(build, "_GridFilm", ClosedGridFilm)
    errors = [
        largest_error(
            replace(
                GRID,
                contact_first=48,
                contact_most=48,
                **{name: (*getattr(GRID, name)[:2], count) for name in ("force", "speed", "temperature")},
            ),
            film,
        )
        for count in (4, 7)
    ]
    assert errors[0] < 1e-3
    # half the distance, 1/16 in the limit
    assert errors[1] < errors[0] / 8.0


def test_random_points_with_axial_load_agree_with_the_sum_over_the_balls():
    """Up to and beyond the load that frees a nut; the film is the closed one, without the contact map."""
    rng = np.random.default_rng(8)
    shared = free = 0
    for _ in range(60):
        preload = float(np.exp(rng.uniform(np.log(600.0), np.log(2500.0))))
        speed = float(np.exp(rng.uniform(*np.log(GRID.speed[:2]))))
        axial = preload * rng.uniform(-3.5, 3.5)
        force = double_nut_loads(SCREW, preload, axial, SCREW.ball_count)
        relieved = min(force.force_a, force.force_b)
        # below its axis of forces the map follows power laws
        if 0.0 < relieved < GRID.force[0]:
            continue
        shared, free = shared + (relieved > 0.0), free + (relieved == 0.0)
        point = (preload, speed, float(rng.uniform(*GRID.temperature[:2])), axial)
        state, direct = MAP.evaluate(*point), direct_torque(*point, film=ClosedFilm(GD4008, False))
        assert state.in_range
        assert state[:3] == pytest.approx(direct[:3], rel=CLOSED)
    assert shared >= 20
    assert free >= 5


def test_extremes_are_those_of_all_balls_that_carry():
    """Film and rise fall or rise with load, by raceway: either end of the loads may hold the extreme."""
    rng = np.random.default_rng(9)
    ends = set()
    for _ in range(12):
        force, speed, temperature = (
            float(rng.choice(nodes(name))) for name in ("force", "speed", "temperature")
        )
        loads = nut_loads(SCREW, force, SCREW.loaded_ball_count)
        found = {
            (raceway, name): values(GD4008, raceway, name, loads, speed, temperature)
            for raceway in RACEWAYS
            for name in (*FILMS, "temperature_rise")
        }
        ends.update((raceway, int(np.argmin(found[raceway, FILMS[2]]))) for raceway in RACEWAYS)
        central = {raceway: found[raceway, FILMS[1]].min() for raceway in RACEWAYS}
        p_max = max(
            float(
                ellipse(
                    q, *reduced_radii(SCREW, contact_angle_at_ball_load(SCREW, q), raceway), E_prime(SCREW)
                ).p_max
            )
            for raceway in RACEWAYS
            for q in loads
        )
        state = MAP.evaluate(force, speed, temperature)
        assert state[3:9] == pytest.approx(
            (
                min(found[raceway, FILMS[2]].min() for raceway in RACEWAYS),
                central["screw"],
                central["nut"],
                max(found[raceway, "temperature_rise"].max() for raceway in RACEWAYS),
                p_max,
                loads.max(),
            ),
            rel=CLOSED,
        )
        assert state[7:9] == pytest.approx((p_max, loads.max()), rel=1e-9)
    assert {("screw", SCREW.loaded_ball_count - 1), ("nut", 0)} <= ends


def test_columns_of_the_extremes_are_those_of_their_raceway():
    """The map returns the extreme of both raceways, which does not change with exchanged columns."""
    columns = extreme_values(GD4008, small_map().contact_map, GRID)
    for i, force in enumerate(nodes("force")):
        loads = nut_loads(SCREW, force, SCREW.loaded_ball_count)
        for j, speed in enumerate(nodes("speed")):
            rises = [
                values(GD4008, r, "temperature_rise", loads, speed, 303.15).max() for r in ("screw", "nut")
            ]
            middle = np.interp(303.15, nodes("temperature"), np.arange(GRID.temperature[2]))
            found = np.exp([np.interp(middle, range(4), np.log(columns[i, j, :, c])) for c in (4, 5)])
            assert found == pytest.approx(rises, rel=0.01)
            assert abs(rises[0] / rises[1] - 1.0) >= 0.05


# --- sharing of the axial load ---


def test_relieved_nut_goes_from_the_preload_to_zero():
    ratio, relieved = sharing_values(GD4008, GRID)
    assert relieved.shape == (GRID.preload[2], GRID.share_nodes, 2)
    assert (relieved[:, 0] == 1.0).all()
    assert (relieved[:, -1] == 0.0).all()
    assert (np.diff(relieved, axis=1) < 0.0).all()
    for i, preload in enumerate(nodes("preload").tolist()):
        expected = [separation_load(SCREW, preload, SCREW.ball_count, sign) / preload for sign in (1, -1)]
        assert ratio[i] == pytest.approx(expected, rel=1e-12)
    # rigid bodies under a light load, which keeps the contact angle, share by Hertz alone: 2^(3/2)
    stiff = changed(
        GD4008, screw={"youngs_modulus": 205e9, "screw_section_area": 1.0, "nut_section_area": 1.0}
    )
    assert sharing_values(stiff, GRID)[0][0] == pytest.approx(2.0**1.5, rel=0.01)


@pytest.mark.parametrize("share", [-1.2, -0.99, -0.6, -0.1, 0.05, 0.35, 0.8, 0.97, 1.1])
def test_forces_of_the_nuts_are_those_of_the_load_distribution(share):
    """A sum over both nuts does not depend on which one is relieved, only on the two forces."""
    for preload in (450.0, 1100.0, 3000.0):
        sign = 1 if share > 0.0 else -1
        axial = share * separation_load(SCREW, preload, SCREW.ball_count, sign)
        loads = double_nut_loads(SCREW, preload, axial, SCREW.ball_count)
        relieved, loaded = sorted((loads.force_a, loads.force_b))
        found = MAP._forces_point(preload, axial)
        # error of the spline over the share 3e-5, near the end where the nut separates
        assert found == pytest.approx((relieved, loaded), abs=1e-4 * preload)
        assert found[1] - found[0] == pytest.approx(abs(axial), rel=1e-12)
        assert (relieved == 0.0) == (abs(share) > 1.0)


def test_rolling_frame_builds_its_own_map():
    rolling = changed(GD4008, friction={"kinematics": "rolling_frame"})
    built = closed_build(rolling)
    assert built.header["kinematics"] == "rolling_frame"
    state = nut_map_of(built).evaluate(2000.0, 100.0, 303.0)
    direct = double_nut_torque(rolling, FRICTION, ClosedFilm(rolling, False), 2000.0, 100.0, 303.0)
    assert state[:3] == pytest.approx(direct[:3], rel=1e-3)
    # entrainment, slip and film differ
    assert not math.isclose(state[0], MAP.evaluate(2000.0, 100.0, 303.0)[0], rel_tol=0.1)
    assert re.fullmatch(r"\d+\.\d+\.\d+", built.header["version"])
