"""Run-time refinement corrects a wrong map to direct solves; contacts in closed form.

The map is that of synthetic_contacts, moved by a few percent that vary over its axes; the contacts behind it stay.
"""

import json
import math

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import LAW, ClosedFilm, closed_ball, law_map, nut_map_of, small_map
from synthetic_map import make_map

from ballscrew_tehl.contact import UnconvergedContactError
from ballscrew_tehl.friction.film_shear import double_nut_torque
from ballscrew_tehl.friction.mechanistic import nut_powers
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters.identity import map_parameters
from ballscrew_tehl.physics.load import nut_loads
from ballscrew_tehl.refinement import direct
from ballscrew_tehl.refinement.direct import DirectContacts
from ballscrew_tehl.refinement.refine import REACH, UNSOLVABLE_RADIUS, CorrectionStore, Refinement
from ballscrew_tehl.runtime.evaluate import NutMap
from ballscrew_tehl.runtime.packed import sealed

POINT = (2000.0, 40.0, 303.15)


def moved(nut_map, size=0.03, certificate=()):
    """The map with torques and films wrong by `size`, smoothly over all axes."""
    arrays = dict(nut_map.arrays)
    force, speed, temperature, _ = (np.arange(n) for n in arrays["coefficients"].shape)
    wave = np.cos(0.9 * force)[:, None, None] + np.sin(0.8 * speed)[:, None] + 0.3 * np.cos(0.7 * temperature)
    error = size * (1.5 + 0.5 * wave)
    arrays["coefficients"] = arrays["coefficients"] + error[..., None] * np.repeat([1, 1, -1, 1, -1], 2)
    header = {k: v for k, v in nut_map.header.items() if k not in ("content_hash", "format_version")}
    header["certificate"] = dict(certificate)
    return NutMap(sealed(header, arrays), arrays)


@pytest.fixture(scope="module")
def wrong():
    return moved(nut_map_of(small_map()))


@pytest.fixture(autouse=True)
def closed_contacts(request, monkeypatch):
    """Contacts in closed form instead of solved ones, unless the test is slow."""
    if not request.node.get_closest_marker("slow"):
        monkeypatch.setattr(direct, "solve_ball", closed_ball)


def direct_torque(*point):
    return double_nut_torque(GD4008, default_friction_set(GD4008), ClosedFilm(GD4008), *point).total


def viscous_torque(force, *at):
    loads = nut_loads(LAW.screw, force, LAW.screw.loaded_ball_count)
    nut = nut_powers(LAW, loads, *at, DirectContacts(LAW))
    return 2.0 * float(np.squeeze(nut.parts(1.0, 0.0).viscous))


def test_refined_torque_is_the_direct_one_and_the_rest_that_of_the_map(wrong):
    """Films that are shown are of rolling balls: not corrected. 3e-5: residual of the contacts at their points."""
    for point in (POINT, (5000.0, 90.0, 298.0, 3000.0), (700.0, 12.0, 310.0, -200.0), (9000.0, 60.0, 305.0)):
        refinement, expected = Refinement(wrong), direct_torque(*point)
        plain, found = wrong.evaluate(*point), refinement.evaluate(*point)
        assert abs(plain.friction_torque / expected - 1.0) > 3e-3
        assert found.friction_torque == pytest.approx(expected, rel=3e-5)
        assert 2 <= len(refinement) <= 4
        for field in found._fields:
            if "viscous" not in field:
                assert getattr(found, field) == getattr(plain, field)


def test_mechanistic_law_is_refined_with_films_and_rise():
    """Rolling part by the mean ball; films of extreme balls, up to 30 % heavier, within the change of the error."""
    nut_map = moved(nut_map_of(law_map()))
    plain, found = nut_map.evaluate(*POINT), Refinement(nut_map, LAW).evaluate(*POINT)
    rolling = viscous_torque(*POINT)
    assert abs(plain.viscous_torque / rolling - 1.0) > 3e-3
    assert found.viscous_torque == pytest.approx(rolling, rel=1e-4)
    for name in ("hysteresis_torque", "contact_pressure_max", "ball_load_max"):
        assert getattr(found, name) == getattr(plain, name)
    shown = direct.direct_extremes(LAW, POINT[0], 0.0, *POINT[1:])
    for name in set(shown) - {"contact_pressure_max", "ball_load_max"}:
        assert getattr(found, name) == pytest.approx(shown[name], rel=8e-3)
        assert abs(getattr(plain, name) / shown[name] - 1.0) > 8e-3


def run_of(refinement, count=300, back=False):
    time = np.linspace(1.0, 0.0, count) if back else np.linspace(0.0, 1.0, count)
    speeds, loads = 12.0 * 8.0**time, 400.0 * np.sin(25.0 * time)
    points = zip(speeds.tolist(), loads.tolist(), strict=True)
    torques = [refinement.evaluate(2000.0, w, 303.15, a).friction_torque for w, a in points]
    return np.array(torques), speeds, loads


def test_torque_along_a_run_is_direct_within_the_tolerance_from_few_solves():
    """A certificate with too small errors loses its weight after a few solves."""
    plain_map = nut_map_of(small_map())
    for certificate in ({}, {"torque_error_max": 1e-3}):
        wrong = moved(plain_map, certificate=certificate)
        refinement = Refinement(wrong, tolerance=2e-3)
        assert math.log(8.0) > 2.0 * REACH * refinement._cell[1]
        found, speeds, loads = run_of(refinement)
        solved = len(refinement.solves)
        assert solved < 100
        points = zip(speeds[::6], loads[::6], strict=True)
        expected = [direct_torque(2000.0, w, 303.15, a) for w, a in points]
        error = np.abs(found[::6] / expected - 1.0)
        assert np.mean(error <= 2e-3) >= 0.95
        assert error.max() <= 6e-3
        # no jump where a contact is added
        plain = wrong.evaluate(2000.0, speeds, 303.15, loads).friction_torque
        assert np.abs(np.diff(np.log(found / plain))).max() <= 8e-3
        # the way back uses remembered corrections
        run_of(refinement, back=True)
        assert len(refinement.solves) - solved <= 0.1 * solved


def test_at_rest_without_load_and_beyond_the_map_nothing_is_solved(wrong):
    refinement = Refinement(wrong)
    for point in (
        (2000.0, 0.0, 303.15), (0.0, 40.0, 303.15), (2000.0, 1e4, 303.15), (2000.0, 40.0, 400.0), (2000.0, 40.0, 0.0),
        (1e6, 40.0, 303.15), (2000.0, 1e-4, 303.15), (8000.0, 40.0, 303.15, 1e5),
    ):  # fmt: skip
        assert refinement.evaluate(*point) == wrong.evaluate(*point)
    assert len(refinement) == 0
    # a nut that is free is not solved
    assert math.isfinite(refinement.evaluate(500.0, 40.0, 303.15, 2500.0).friction_torque)
    assert {round(solve.force) for solve in refinement.solves} == {2500}


def test_the_store_drops_the_least_recently_used_also_when_restored():
    store, restored, place = CorrectionStore(3, 0.02), CorrectionStore(3, 0.02), np.eye(3) * 10.0
    for point in place:
        store.insert(point, np.full(5, 0.01))
        store.look_up(point)
    store.look_up(place[0])
    restored.restore(json.loads(json.dumps(store.state())))
    # the restored one goes on with the clock: the next use counts as later than those before
    for each in (store, restored):
        each.look_up(place[1])
        each.insert(np.full(3, -10.0), np.full(5, 0.01))
        assert [each.look_up(point).distance == 0.0 for point in place] == [True, True, False]
        assert len(each) == 3
    assert store.state() == restored.state()


def test_a_failed_contact_keeps_the_map_and_is_not_solved_again(wrong, monkeypatch, caplog):
    tried = []

    def fails(parameters, raceway, load, speed, *_, **__):
        tried.append((raceway, speed))
        raise UnconvergedContactError("contact not solved: any")

    monkeypatch.setattr(direct, "solve_ball", fails)
    refinement, restored = Refinement(wrong), Refinement(wrong)
    for _ in range(2):
        assert refinement.evaluate(*POINT) == wrong.evaluate(*POINT)
    assert sorted(tried) == [("nut", 40.0), ("screw", 40.0)]
    restored.restore(json.loads(json.dumps(refinement.state())))
    for each, radius, count in ((restored, 0.0, 2), (refinement, 0.5, 2), (refinement, 2.0, 4)):
        each.evaluate(2000.0, 40.0 * math.exp(radius * UNSOLVABLE_RADIUS * refinement._cell[1]), 303.15)
        assert len(tried) == count
    assert len(refinement) == 0
    assert "not solved, uncorrected map used: contact not solved: any" in caplog.text
    # nor does one whose film is no number
    monkeypatch.setattr(direct, "solve_ball", lambda *at, **_: closed_ball(*at[:4], math.nan, True))
    refinement = Refinement(wrong)
    assert refinement.evaluate(*POINT) == wrong.evaluate(*POINT)
    assert all(solve.failure for solve in refinement.solves)


def test_what_cannot_be_refined_is_refused(wrong):
    for tolerance in (0.0, -1e-3, math.nan, math.inf):
        with pytest.raises(ValueError, match=r"refine_tolerance = .*; needs a finite number > 0"):
            Refinement(wrong, tolerance=tolerance)
    with pytest.raises(ValueError, match="a map without its screw: give the screw file"):
        Refinement(make_map())
    for point in (
        (math.nan, 1.0, 300.0), (1e3, np.array([1.0, math.inf]), 300.0), (1e3, 1.0, 300.0, 0.0, -1.0),
    ):  # fmt: skip
        with pytest.raises(ValueError, match="needs a finite number"):
            Refinement(wrong).evaluate(*point)


@pytest.mark.slow
def test_refined_torque_is_that_of_contacts_solved_directly():
    """By the solver, on the packaged maps, whose header contains the parameters that they were built for."""
    for parameters in (GD4008, LAW):
        nut_map = load_map(None, parameters)
        assert map_parameters(nut_map.header) == parameters
    at = 1700.0, 73.3, 311.0
    refinement, rolling = Refinement(nut_map, tolerance=1e-4), viscous_torque(*at)
    assert refinement.evaluate(*at).viscous_torque == pytest.approx(rolling, rel=1e-4)
    assert len(refinement) == 2
    assert nut_map.evaluate(*at).viscous_torque == pytest.approx(rolling, rel=0.03)
