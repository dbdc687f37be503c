"""Run-time refinement corrects a wrong map to direct solves; contacts in closed form, a few solved.

The map is that of synthetic_contacts, moved by a few percent that vary over its axes; the contacts behind it stay.
"""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
import synthetic_contacts
from reference_screw import GD4008
from synthetic_contacts import ClosedFilm, nut_map_of, small_map
from synthetic_map import make_map

from ballscrew_tehl.contact import UnconvergedContactError
from ballscrew_tehl.friction.sets import FrictionSet
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map.contacts import FILMS
from ballscrew_tehl.nut_map.file import load_map
from ballscrew_tehl.parameters.file import load_parameters
from ballscrew_tehl.parameters.identity import map_parameters_json
from ballscrew_tehl.parameters.packaged_data import PACKAGED_VG100
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.refinement import direct
from ballscrew_tehl.refinement.corrections import SCATTER, UNSOLVABLE_RADIUS, CorrectionStore
from ballscrew_tehl.refinement.direct import DirectFilm, NutContacts, direct_extremes, mean_load
from ballscrew_tehl.refinement.refine import CELL, REACH, Refinement, map_parameters
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import sealed

FITTED = (7.0, 0.005, 3e-8)
# the contact map reproduces its samples to this; sums by the mean ball are exact to 1e-5 (test below)
SAME = 3e-5


def moved(nut_map, size=0.03):
    """The map with viscous torques and films wrong by `size` and more, smoothly over all axes."""
    arrays = dict(nut_map.arrays)
    force, speed, temperature, _ = (np.arange(n) for n in arrays["coefficients"].shape)
    wave = np.cos(0.9 * force)[:, None, None] + np.sin(0.8 * speed)[:, None] + 0.3 * np.cos(0.7 * temperature)
    error = size * (1.5 + 0.5 * wave)
    arrays["coefficients"] = arrays["coefficients"] + error[..., None] * np.repeat([1, 1, -1, 1, -1], 2)
    header = {k: v for k, v in nut_map.header.items() if k not in ("content_hash", "format_version")}
    return NutMap.from_arrays(sealed(header, arrays), arrays)


def with_parameters(nut_map, **certificate):
    header = {k: v for k, v in nut_map.header.items() if k not in ("content_hash", "format_version")}
    header |= {"parameters_json": map_parameters_json(GD4008), "certificate": certificate}
    return NutMap.from_arrays(sealed(header, nut_map.arrays), nut_map.arrays)


@pytest.fixture(scope="module", params=["solved", "solved_thermal"])
def film(request):
    return request.param


@pytest.fixture(scope="module")
def wrong(film):
    return moved(with_parameters(nut_map_of(small_map(), film, *FITTED)))


@pytest.fixture
def solved_contacts():
    """Tests with this fixture solve contacts."""


@pytest.fixture(autouse=True)
def closed_contacts(request, monkeypatch):
    """Contacts in closed form instead of solved ones, unless the test uses `solved_contacts`."""
    if "solved_contacts" in request.fixturenames:
        return

    def solve_ball(parameters, raceway, load, speed, temperature, thermal):
        def value(name):
            return float(
                synthetic_contacts.values(parameters, raceway, name, np.array([load]), speed, temperature)[0]
            )

        return SimpleNamespace(
            h_c=value(FILMS[1] if thermal else FILMS[0]),
            h_m=value(FILMS[2]),
            temperature_rise_mean=value("temperature_rise"),
            hertz=SimpleNamespace(p_max=1e9),
        )

    monkeypatch.setattr(direct, "solve_ball", solve_ball)


def direct_torque(film, preload, speed, temperature, axial_load=0.0):
    friction_set = FrictionSet("any", "published", film, *FITTED)
    model = ClosedFilm(GD4008, film == "solved_thermal")
    return double_nut_torque(GD4008, friction_set, model, preload, speed, temperature, axial_load).total


def torque(state):
    return state.friction_torque


# values


@pytest.mark.parametrize(
    "point",
    [
        (2000.0, 40.0, 303.15),
        (5000.0, 90.0, 298.0, 3000.0),
        (700.0, 12.0, 310.0, -200.0),
        (9000.0, 60.0, 305.0),
    ],
)
def test_refined_torque_is_the_direct_one_for_any_error_of_the_map(wrong, film, point):
    expected = direct_torque(film, *point)
    refinement = Refinement(wrong)
    assert abs(torque(wrong.evaluate(*point)) / expected - 1.0) > 3e-3
    assert torque(refinement.evaluate(*point)) == pytest.approx(expected, rel=SAME)
    assert 2 <= len(refinement) <= 4


def test_films_and_rise_are_corrected_by_the_mean_ball(wrong):
    """The extreme balls are up to 30 % heavier; over that the map's error varies by some 1e-3."""
    for preload in (2000.0, 6000.0):
        state = Refinement(wrong).evaluate(preload, 40.0, 303.15)
        for name, value in direct_extremes(GD4008, preload, 0.0, 40.0, 303.15).items():
            if name.startswith("film"):
                assert getattr(state, name) == pytest.approx(value, rel=8e-3)
                assert abs(getattr(wrong.evaluate(preload, 40.0, 303.15), name) / value - 1.0) > 8e-3


def test_pressure_and_loads_stay_those_of_the_map(wrong):
    point = (2000.0, 40.0, 303.15)
    refined, plain = Refinement(wrong).evaluate(*point), wrong.evaluate(*point)
    for name in ("hysteresis_torque", "sliding_torque", "contact_pressure_max", "ball_load_max"):
        assert getattr(refined, name) == getattr(plain, name)


def test_one_ball_represents_all():
    """Half of (error of the slope)^2 times the variance of ln(load)."""
    loads = nut_loads(GD4008.screw, 9000.0, GD4008.screw.ball_count)
    load = mean_load(loads)
    for error in (-0.1, 0.1):
        force = loads ** (2.0 / 3.0)
        assert np.sum(force * (loads / load) ** error) / force.sum() == pytest.approx(1.0, abs=1.2e-5)


# along a run


def run_of(refinement, count=600, back=False):
    """Speed up and down with a swinging axial load, as an axis moves; torques."""
    time = np.linspace(1.0, 0.0, count) if back else np.linspace(0.0, 1.0, count)
    speeds, loads = 12.0 * 8.0**time, 400.0 * np.sin(25.0 * time)
    return np.array([
        torque(refinement.evaluate(2000.0, float(w), 303.15, float(a))) for w, a in zip(speeds, loads, strict=True)
    ]), speeds, loads  # fmt: skip


@pytest.mark.parametrize("certificate", [{}, {"torque_error_max": 1e-3}], ids=["without", "too good"])
def test_torque_along_a_run_is_direct_within_the_tolerance_from_few_solves(film, certificate):
    """A certificate with too small errors loses its weight after a few solves."""
    wrong = moved(with_parameters(nut_map_of(small_map(), film, *FITTED), **certificate))
    refinement = Refinement(wrong, tolerance=2e-3)
    found, speeds, loads = run_of(refinement)
    solved = len(refinement.solves)
    assert solved < 100
    expected = [
        direct_torque(film, 2000.0, w, 303.15, a) for w, a in zip(speeds[::12], loads[::12], strict=True)
    ]
    error = np.abs(found[::12] / expected - 1.0)
    assert np.mean(error <= 2e-3) >= 0.95
    assert error.max() <= 6e-3
    # no jump where a contact is added
    plain = np.array(
        [torque(wrong.evaluate(2000.0, w, 303.15, a)) for w, a in zip(speeds, loads, strict=True)]
    )
    assert np.abs(np.diff(np.log(found / plain))).max() <= 6e-3
    # the way back uses remembered corrections
    run_of(refinement, back=True)
    assert len(refinement.solves) - solved <= 0.1 * solved


def test_a_smaller_tolerance_solves_more(wrong):
    counts = []
    for tolerance in (1e-2, 2e-3):
        refinement = Refinement(wrong, tolerance=tolerance)
        run_of(refinement, 150)
        counts.append(len(refinement))
    assert 2 * counts[0] < counts[1]


def test_a_correct_map_needs_few_solves(film):
    right = with_parameters(nut_map_of(small_map(), film, *FITTED), torque_error_max=1e-3)
    wrong = Refinement(moved(right))
    refinement = Refinement(right)
    for each in (refinement, wrong):
        run_of(each, 300)
    assert 4 * len(refinement) < len(wrong)


def test_every_solve_reports_its_reason(wrong, caplog):
    reported = []
    refinement = Refinement(wrong, report=reported.append)
    refinement.evaluate(2000.0, 40.0, 303.15)
    refinement.evaluate(2000.0, 48.0, 303.15)
    assert list(refinement.solves) == reported
    assert str(reported[0]).startswith(
        "contact of the screw at force 2000 N, speed 40 rad/s, 303.15 K solved: no solved"
    )
    assert reported[-1].reason.startswith("torque may be off by ")
    assert caplog.text == ""


# where nothing is solved


@pytest.mark.parametrize(
    "point",
    [
        (2000.0, 0.0, 303.15), (0.0, 40.0, 303.15), (-5.0, 40.0, 303.15), (2000.0, 1e4, 303.15), (2000.0, 40.0, 400.0),
        (2000.0, 40.0, 0.0), (1e6, 40.0, 303.15), (2000.0, 1e-4, 303.15), (8000.0, 40.0, 303.15, 1e5),
    ],
)  # fmt: skip
def test_at_rest_without_load_and_beyond_the_map_nothing_is_solved(wrong, point):
    refinement = Refinement(wrong)
    assert refinement.evaluate(*point) == wrong.evaluate(*point)
    assert len(refinement) == 0


def test_known_corrections_apply_beyond_the_map_and_below_its_axes(wrong):
    refinement = Refinement(wrong)
    fastest = wrong.speed.hi
    inside = refinement.evaluate(2000.0, fastest, 303.15)
    solved = len(refinement)
    beyond = refinement.evaluate(2000.0, 2.0 * fastest, 303.15)
    assert beyond.viscous_torque == inside.viscous_torque
    assert not beyond.in_range
    assert len(refinement) == solved
    slow = refinement.evaluate(2000.0, 0.5 * wrong.speed.lo, 303.15)
    end = refinement.evaluate(2000.0, wrong.speed.lo, 303.15)
    ratio = wrong.evaluate(2000.0, 0.5 * wrong.speed.lo, 303.15).viscous_torque
    ratio /= wrong.evaluate(2000.0, wrong.speed.lo, 303.15).viscous_torque
    # approximate: the exponent of speed is that of the refined film
    assert slow.viscous_torque / end.viscous_torque == pytest.approx(ratio, rel=2e-2)


def test_a_nut_that_is_free_is_not_solved(wrong):
    refinement = Refinement(wrong)
    state = refinement.evaluate(500.0, 40.0, 303.15, 2500.0)
    assert math.isfinite(torque(state))
    assert {round(solve.force) for solve in refinement.solves} == {2500}


# memory


def test_same_calls_give_same_results_also_from_a_restored_state(wrong):
    first, second = Refinement(wrong), Refinement(wrong)
    run_of(first, 100)
    run_of(second, 100)
    state = json.loads(json.dumps(first.state()))
    assert state == second.state()
    third = Refinement(wrong)
    third.restore(state)
    results = [run_of(each, 140, back=True)[0].tolist() for each in (first, second, third)]
    assert results[0] == results[1] == results[2]
    assert first.state() == third.state()


def test_memory_is_bounded_and_keeps_what_is_used(wrong):
    refinement = Refinement(wrong, capacity=20)
    run_of(refinement)
    assert len(refinement) <= 20
    solved = len(refinement.solves)
    found = torque(refinement.evaluate(2000.0, 90.0, 303.15))
    assert found == pytest.approx(torque(Refinement(wrong).evaluate(2000.0, 90.0, 303.15)), rel=2e-3)
    assert len(refinement.solves) <= solved + 2


def test_the_store_interpolates_its_points_and_gives_nothing_far_away():
    store = CorrectionStore(10, 0.02)
    generator = np.random.default_rng(1)
    points, values = generator.uniform(0.0, 1.5, (8, 3)), generator.normal(0.0, 0.01, (8, 5))
    for point, value in zip(points, values, strict=True):
        store.insert(point, value)
    for point, value in zip(points, values, strict=True):
        found = store.look_up(point)
        assert found.values == pytest.approx(value.tolist(), abs=1e-12)
        assert found.deviation == pytest.approx(0.0, abs=1e-6)
        assert found.distance == 0.0
    far = store.look_up(np.array([40.0, 0.0, 0.0]))
    assert far.values == pytest.approx([0.0] * 5, abs=1e-12)
    near = store.look_up(points[0] + np.array([0.0, 0.3, 0.0]))
    assert 0.0 < near.deviation < far.deviation < 0.03
    assert near.distance < 0.31 < 38.0 < far.distance


def test_the_store_estimates_how_much_corrections_vary():
    deviations = []
    for size in (0.1 * SCATTER, 0.01, 0.1):
        store = CorrectionStore(40, 0.02)
        for n in range(12):
            store.insert(np.array([0.5 * n, 0.0, 0.0]), np.full(5, size * (-1) ** n))
        deviations.append(store.look_up(np.array([2.75, 0.0, 0.0])).deviation)
    assert 3.0 * deviations[0] < 2.0 * deviations[1] < deviations[2]


def test_the_store_drops_the_least_recently_used():
    store = CorrectionStore(3, 0.02)
    place = np.eye(3) * 10.0
    for point in place:
        store.insert(point, np.full(5, 0.01))
        store.look_up(point)
    store.look_up(place[0])
    store.insert(np.full(3, -10.0), np.full(5, 0.01))
    assert [store.look_up(point).distance == 0.0 for point in place] == [True, False, True]
    assert len(store) == 3


def test_scatter_between_close_points_is_followed_and_does_not_spread():
    """Two points 1 % apart whose films differ by the scatter: beyond them the correction is their mean."""
    store = CorrectionStore(10, 0.01)
    for x, value in ((0.0, 0.010), (0.01, 0.010 + SCATTER)):
        store.insert(np.array([x, 0.0, 0.0]), np.full(5, value))
    found = store.look_up(np.array([0.3, 0.0, 0.0])).values[0]
    assert 0.008 <= found <= 0.013


# failures


def test_a_failed_contact_keeps_the_map_and_is_not_solved_again(wrong, monkeypatch, caplog):
    tried = []

    def fails(parameters, raceway, load, speed, *_, **__):
        tried.append((raceway, speed))
        raise UnconvergedContactError("contact not solved: any")

    monkeypatch.setattr(direct, "solve_ball", fails)
    refinement = Refinement(wrong)
    for _ in range(3):
        assert refinement.evaluate(2000.0, 40.0, 303.15) == wrong.evaluate(2000.0, 40.0, 303.15)
    assert sorted(tried) == [("nut", 40.0), ("screw", 40.0)]
    refinement.evaluate(2000.0, 40.0 * math.exp(0.5 * UNSOLVABLE_RADIUS * refinement._cell[1]), 303.15)
    assert len(tried) == 2
    refinement.evaluate(2000.0, 40.0 * math.exp(2.0 * UNSOLVABLE_RADIUS * refinement._cell[1]), 303.15)
    assert len(tried) == 4
    assert len(refinement) == 0
    assert "not solved, uncorrected map used: contact not solved: any" in caplog.text
    restored = Refinement(wrong)
    restored.restore(json.loads(json.dumps(refinement.state())))
    restored.evaluate(2000.0, 40.0, 303.15)
    assert len(tried) == 4


def test_a_correction_that_is_not_finite_is_ignored(wrong, monkeypatch):
    nothing = SimpleNamespace(h_c=math.nan, h_m=math.nan, temperature_rise_mean=math.nan)
    monkeypatch.setattr(direct, "solve_ball", lambda *_, **__: nothing)
    refinement = Refinement(wrong)
    assert refinement.evaluate(2000.0, 40.0, 303.15) == wrong.evaluate(2000.0, 40.0, 303.15)
    assert all(solve.failure for solve in refinement.solves)


@pytest.mark.parametrize("tolerance", [0.0, -1e-3, math.nan, math.inf])
def test_an_invalid_tolerance_is_refused(wrong, tolerance):
    with pytest.raises(ValueError, match=r"refine_tolerance = .*; needs a finite number > 0"):
        Refinement(wrong, tolerance=tolerance)


def test_a_map_that_cannot_be_refined_is_refused(wrong):
    with pytest.raises(ValueError, match="film model of the map = synthetic; refinement needs solved"):
        Refinement(make_map())
    with pytest.raises(ValueError, match="capacity = 3; needs a whole number >= 4"):
        Refinement(wrong, capacity=3)


# interface


def test_arrays_equal_scalars(wrong):
    speeds, preloads = np.array([[20.0, 40.0, 0.0]]), np.array([[1000.0], [2000.0]])
    one, other = Refinement(wrong), Refinement(wrong)
    found = one.evaluate(preloads, speeds, 303.15, roughness_height=1e-8)
    assert found.viscous_torque.shape == found.in_range.shape == (2, 3)
    for i, preload in enumerate((1000.0, 2000.0)):
        for j, speed in enumerate((20.0, 40.0, 0.0)):
            state = other.evaluate(preload, speed, 303.15, roughness_height=1e-8)
            for name in state._fields[:-1]:
                assert getattr(found, name)[i, j] == getattr(state, name)
    assert one.evaluate(np.array([2000.0, 1e6]), 40.0, 400.0).clamped == ("temperature", "preload")


def test_bad_arguments_are_refused_as_by_the_map(wrong):
    for arguments in (
        (math.nan, 1.0, 300.0),
        (1e3, np.array([1.0, math.inf]), 300.0),
        (1e3, 1.0, 300.0, 0.0, -1.0),
    ):
        with pytest.raises(ValueError, match="needs a finite number"):
            Refinement(wrong).evaluate(*arguments)


def test_a_map_contains_the_parameters_it_was_built_for():
    for parameters in (load_parameters(), load_parameters(PACKAGED_VG100)):
        header = load_map(None, parameters).header
        assert map_parameters_json(map_parameters(header)) == header["parameters_json"]
    d341 = {
        "viscosity_law": "astm_d341",
        "astm_viscosity_1": 1e-4,
        "astm_temperature_1": 313.15,
        "astm_viscosity_2": 1.1e-5,
        "astm_temperature_2": 373.15,
    }
    content = load_parameters().model_dump(exclude_unset=True)
    del content["lubricant"]["viscosity"]
    parameters = type(load_parameters()).model_validate(content | {"lubricant": content["lubricant"] | d341})
    text = map_parameters_json(parameters)
    assert map_parameters_json(map_parameters({"parameters_json": text})) == text


def test_preparing_solves_a_contact_that_is_not_remembered(wrong, monkeypatch):
    tried = []
    original = direct.solve_ball
    monkeypatch.setattr(direct, "solve_ball", lambda *a, **b: tried.append(a) or original(*a, **b))
    refinement = Refinement(wrong)
    refinement.prepare()
    assert tried
    assert len(refinement) == len(refinement.solves) == 0


def test_run_above_spans_several_cells():
    """Otherwise that run would not test the interpolation."""
    cells = (
        math.log(8.0)
        / Refinement(moved(with_parameters(nut_map_of(small_map(), "solved", *FITTED))))._cell[1]
    )
    assert cells > 2.0 * REACH


def test_cell_is_that_of_the_contacts_of_the_map(wrong):
    assert Refinement(wrong)._cell == pytest.approx(small_map().contact_map.cell)
    header = {k: v for k, v in wrong.header.items() if k not in ("content_hash", "format_version")}
    for bad in (None, [1.0, 2.0], [1.0, 0.0, 1.0], [-1.0, 1.0, 1.0], "abc"):
        other = NutMap.from_arrays(sealed(header | {"contact_cell": bad}, wrong.arrays), wrong.arrays)
        assert tuple(Refinement(other)._cell) == CELL


# the solver


@pytest.mark.slow
def test_refined_torque_is_that_of_the_direct_command(solved_contacts):
    """Map wrong by a few percent. Films are solved to 3e-4, and scatter by 1e-3 over the balls of a nut."""
    parameters = load_parameters()
    packaged = load_map(None, parameters)
    film = packaged.header["film_model"]
    friction_set = FrictionSet("any", "published", film, *packaged.defaults[:3])
    model = DirectFilm(parameters, film == "solved_thermal")
    for point in ((1500.0, 40.0, 303.15, 0.0), (4000.0, 9.0, 295.0, 1500.0)):
        expected = double_nut_torque(parameters, friction_set, model, *point).total
        nut_map = moved(packaged)
        assert abs(torque(nut_map.evaluate(*point)) / expected - 1.0) > 1e-3
        assert torque(Refinement(nut_map).evaluate(*point)) == pytest.approx(expected, rel=2e-3)


@pytest.mark.slow
def test_the_mean_ball_equals_the_sum_over_all_balls(solved_contacts):
    contacts = NutContacts(GD4008, "solved")
    found = contacts.solve("screw", 2000.0, 60.0, 303.15, slope=-0.07)
    film = DirectFilm(GD4008, thermal=False)
    loads = nut_loads(GD4008.screw, 2000.0, GD4008.screw.ball_count)
    weights = loads ** (2.0 / 3.0)
    h = film.central_film("screw", loads, 60.0, 303.15)
    assert found.effective_film == pytest.approx(
        math.sqrt(np.sum(weights / h) / np.sum(weights / h**3)), rel=1e-3
    )
    assert list(RACEWAYS) == ["screw", "nut"]
