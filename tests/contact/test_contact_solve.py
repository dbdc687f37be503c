"""The door of the contact solver: results, refusals, reasons of missing convergence, hard contacts, cache, threads."""

import math
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
from contact_cases import LONG, OIL, STEEL, conditions, moes, options, solved

from ballscrew_tehl import compiled
from ballscrew_tehl.contact import ContactConditions, SolverOptions, solve, solve_moes
from ballscrew_tehl.contact import result as results
from ballscrew_tehl.contact.coupled import solve_coupled
from ballscrew_tehl.contact.film import reynolds
from ballscrew_tehl.contact.problem import ContactProblem
from ballscrew_tehl.contact.result import contact_integrals, solution_of
from ballscrew_tehl.parameters.file import graded_oil
from ballscrew_tehl.physics.film import nijenbanning_venner_moes

COARSE = options()


def test_result_is_complete_and_repeats_to_the_bit():
    result = solve(conditions(srr=1.0), OIL, STEEL, COARSE)
    assert (*result.pressure.shape, 9) == (*result.film.shape, 9) == result.temperature.shape == (9, 65, 9)
    assert (result.pressure.min(), result.pressure.max()) == (0.0, result.p_max)
    assert 0.0 < result.h_m < result.h_c
    assert result.grid_film == pytest.approx(np.interp(0.0, result.x, result.film[0]), rel=1e-3)
    assert 0.0 < 0.25 * abs(result.h_c / result.grid_film - 1.0) < result.error_estimate
    assert result.temperature_rise == pytest.approx(result.temperature.max() - 303.15, rel=1e-9)
    walls = result.temperature[0, np.abs(result.x) < 1.0]
    assert walls[:, 0].mean() < walls[:, -1].mean()  # the faster body stays cooler
    assert 0.0 < result.temperature_rise_mean < result.temperature_rise_smooth <= result.temperature_rise
    assert 303.15 < result.mean_temperature < result.temperature.max()
    again = solve(conditions(srr=1.0), OIL, STEEL, COARSE)
    assert (again.h_c, again.traction_force) == (result.h_c, result.traction_force)
    cold = solved(conditions(), thermal=False)
    assert (cold.temperature, cold.heat_balance, cold.temperature_rise) == (None, None, 0.0)


UNITS = {"load": "N", "R_x": "m", "R_y": "m", "temperature": "K", "E_prime": "Pa"}
GOOD = dict(zip(UNITS, (30.0, 2e-3, 6e-2, 303.15, 2.2e11), strict=True)) | {"u_1": 1.0, "u_2": 1.0}
#: what is changed, beginning of the message
REFUSED = [
    *(({name: value}, f"{name} = {value} {unit}; allowed: ")
      for name, unit in UNITS.items() for value in (0.0, math.nan)),
    *(({"u_1": a, "u_2": b}, f"u_1, u_2 = {a}, {b} m/s; needs up to") for a, b in ((math.nan, 1.0), (2.0, -2.0))),
    ({"load": 1e300}, "load = 1e+300 N; allowed: "), ({"load": True}, "load = True N; needs a number"),
    ({"u_1": 1e300}, "u_1, u_2 = 1e+300, 1.0 m/s; needs up to 10000 m/s"),
    ({"R_x": 6e-2, "R_y": 2e-3}, "R_x = 0.06 m; needs R_x <= R_y = 0.002 m: x is the rolling direction"),
]  # fmt: skip
BAD_OPTIONS = [
    ("x_in", math.nan), ("x_in", -0.9), ("x_out", 0.5), ("y_max", "2"), ("n_x", 3), ("n_x", 10**6), ("n_y", 1),
    ("n_z", 8.5), ("tolerance", 0.0), ("max_newton", 0), ("extent", math.nan), ("thermal", "no"), ("warm_films", 1.0),
]  # fmt: skip


def test_bad_conditions_and_options_are_refused_in_one_line():
    for changed, message in REFUSED:
        with pytest.raises(ValueError, match="^" + re.escape(message)) as caught:
            ContactConditions(**(GOOD | changed))
        assert "\n" not in str(caught.value)
    for name, value in BAD_OPTIONS:
        with pytest.raises(ValueError, match=rf"^{name} = {re.escape(repr(value))}.*needs"):
            SolverOptions(**{name: value})
    for factor in (0.5, 9.0, math.nan):
        with pytest.raises(ValueError, match="refine = "):
            SolverOptions().refined(factor)
    for changed, message in (
        ({"L": math.nan}, "L = nan; needs finite, > 0"),
        ({"radius_ratio": 1.2}, "radius_ratio = 1.2; needs R_x/R_y <= 1"),
        ({"law": "Roelands"}, "law = 'Roelands'; allowed: barus, roelands"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match="^" + re.escape(message)):
            solve_moes(**({"M": 100.0, "L": 5.0, "radius_ratio": 0.2, "law": "barus"} | changed))
    with pytest.raises(ValueError, match=r"temperature = 30.0 K; needs finite, >= 200 K: is 303.15 K meant"):
        solve(ContactConditions(**(GOOD | {"temperature": 30.0})), OIL, STEEL, COARSE)
    with pytest.raises(ValueError, match=r"conditions = .2000.; needs ContactConditions"):
        solve("2000", OIL, STEEL)


def test_missing_convergence_has_its_reason():
    cold = solve(conditions(), OIL, STEEL, replace(COARSE, thermal=False, max_newton=1))
    assert not cold.converged
    assert "1 Newton step" in cold.reason
    for most in (1, 3):
        hot = solve(conditions(srr=1.0), OIL, STEEL, replace(COARSE, max_thermal=most))
        assert not hot.converged
        assert f"{most} thermal iterations" in hot.reason


def test_bodies_far_apart_do_not_count_as_a_solution(monkeypatch):
    """36 mm apart, every step keeps pressure and load: once converged, to a film of 1 m in place of 1.1 um."""
    u = 1.996316033584953
    at = ContactConditions(18.3686652372, 2.70979887e-3, 28.0741526e-3, u, u, 289.76286, 226.373626e9)
    problem = ContactProblem(at, graded_oil(68, 108.5195), (STEEL, STEEL), options(n_y=17))

    monkeypatch.setattr(reynolds, "GAP_TOLERANCE", math.inf)
    start = problem.start(problem.geometry.start(36e-3 / 100 / problem.scales.h_unit))
    it = solve_coupled(problem, start, None, 3e-5, 20, damped=True)
    assert it.converged
    refused = solution_of(problem, it, (0.0, 0.0))
    assert not refused.converged
    assert refused.reason.startswith("no solution: its film is 3")


def test_negative_loss_or_film_and_core_far_from_their_formulas_are_no_solution(monkeypatch):
    def turned(*arguments):
        found = contact_integrals(*arguments)
        return found | {"rolling_loss": -found["rolling_loss"]}

    for name, value, reason in (
        ("contact_integrals", turned, "rolling loss is -"),
        ("MOST_FILM", 0.3, "times its formula"), ("LEAST_FILM", 3.0, "times its formula"),
        ("CORE", (2.0, 3.0), "times its estimate"), ("CORE", (0.0, 0.01), "times its estimate"),
    ):  # fmt: skip
        with monkeypatch.context() as patch:
            patch.setattr(results, name, value)
            found = solve(conditions(), OIL, STEEL, COARSE)
        assert not found.converged
        assert reason in found.reason
    # thicker than the gap of round bodies is a parabola, a contact has a film and no loss
    monkeypatch.setattr(results, "contact_integrals", turned)
    monkeypatch.setattr(results, "THICKEST", 1e-9)
    found = solve(conditions(), OIL, STEEL, COARSE)
    assert found.converged
    assert math.isnan(found.rolling_loss)


@pytest.mark.slow
def test_asymptotic_branch_continues_the_resolved_one():
    """Doubled loads across the change of branch: the same slope to a few per cent, and that of the closed formula."""
    loads = 4e4 * 2.0 ** np.arange(0.0, 4.1)
    films = [moes(float(M), 2.0, LONG, "roelands", n_x=65, n_y=9) for M in loads]
    branches = [film.result.branch for film in films]
    change = branches.index("asymptotic")
    assert change > 1
    assert branches == ["resolved"] * change + ["asymptotic"] * (len(loads) - change)
    slopes = np.diff(np.log([film.Hc for film in films])) / math.log(2.0)
    assert np.all(slopes < -0.08)
    assert np.ptp(slopes) <= 0.04  # 2.8 % of the film per doubling found
    formula = [nijenbanning_venner_moes(float(M), 2.0, LONG) for M in loads[[0, -1]]]
    assert films[-1].Hc / films[0].Hc == pytest.approx(formula[1] / formula[0], rel=0.08)


@pytest.mark.slow
def test_contacts_that_once_failed_are_solved():
    """A film thicker than the flattening, whose load follows from the approach; a heavily loaded sliding one."""
    result = solve_moes(0.05, 32.85, 0.03017, "barus", SolverOptions(thermal=False, n_x=97)).result
    assert result.converged, result.reason
    assert (result.branch, result.x.size) == ("resolved", 97)
    # sliding under M = 2e5, from far too cold first temperatures
    heavy = ContactConditions(195.45, 2.573e-3, 6.177e-2, 2.572e-4, 0.017482, 312.74, 2.2527e11)
    result = solve(heavy, OIL, STEEL)
    assert result.converged, result.reason
    assert result.branch == "resolved"


def test_a_change_of_any_kernel_source_gives_another_cache(tmp_path, monkeypatch):
    """A kernel inlines those of other files: the folder follows all of them, and every module with kernels counts."""
    copy = tmp_path / "package"
    shutil.copytree(compiled.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__", "data"))
    found = {compiled.sources_hash(), compiled.sources_hash(copy)}
    assert len(found) == 1
    kernels = [p for p in copy.rglob("*.py") if re.search(r"^\s*@kernel", p.read_text("utf-8"), re.M)]
    assert len(kernels) > 5
    for file in [*kernels, copy / "parameters" / "oil.py"]:
        file.write_text(file.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
        found.add(compiled.sources_hash(copy))
    assert len(found) == len(kernels) + 2
    (copy / "applications" / "cli" / "main.py").write_text("", encoding="utf-8")
    assert compiled.sources_hash(copy) in found
