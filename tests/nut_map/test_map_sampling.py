"""Sampling of a map by its error: solved and interpolated nodes."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import GRID, closed_row, same_samples

from ballscrew_tehl.nut_map import build, sampling
from ballscrew_tehl.nut_map.contact_map import FILMS, QUANTITIES, ContactAxes, ContactMap, film_formula
from ballscrew_tehl.nut_map.journal import Journal
from ballscrew_tehl.physics.hertz import RACEWAYS

#: may be halved: odd numbers of nodes
ODD = replace(GRID, contact_nodes=(5, 5, 5), contact_most=(33, 33, 33), contact_tolerance=3e-4)


def sampled(grid=ODD, row=closed_row, executor=None, progress=None, journal=None):
    """build_contact_map with closed contacts, in one thread unless an executor is given."""
    with pytest.MonkeyPatch.context() as patch, ThreadPoolExecutor(1) as thread, ExitStack() as stack:
        patch.setattr(build, "_solve_row", row)
        record = None if journal is None else stack.enter_context(Journal(journal, "{}", "1"))
        return build.build_contact_map(GD4008, grid, executor or thread, progress, record)


def solves(contact_map):
    """Isothermal and thermal solves behind a map."""
    return 2 * sum(int(mask.sum()) for mask in contact_map.solved.values())


@pytest.fixture(autouse=True)
def negligible_film_floor(monkeypatch):
    """Lower FILM_FLOOR: the closed films are thinner than it."""
    monkeypatch.setattr(sampling, "FILM_FLOOR", 1e-12)


def rough_along(axis, raceways=RACEWAYS, sharpness=2.0):
    """closed_row with a film that bends sharply along one axis only."""

    def bend(load, speed, temperature):
        along = np.log(load / 30.0), np.log(speed / 30.0), (temperature - 303.15) / 5.0
        return 0.2 * np.tanh(sharpness * along[axis])

    def row(parameters, raceway, load, speeds, temperature):
        found = closed_row(parameters, raceway, load, speeds, temperature)
        if raceway in raceways:
            for name in FILMS:
                found[name] = found[name] * np.exp([bend(load, speed, temperature) for speed in speeds])
        return found

    return row


def true_samples(contact_map, row):
    """Values of the row function at all nodes, by raceway and quantity."""
    loads, speeds, temperatures = contact_map.axes.nodes
    found = {}
    for raceway in RACEWAYS:
        table = {name: np.empty(contact_map.axes.shape) for name in QUANTITIES}
        for i, load in enumerate(loads.tolist()):
            for k, t in enumerate(temperatures.tolist()):
                for name, values in row(GD4008, raceway, load, speeds, t).items():
                    table[name][i, :, k] = values
        found[raceway] = table
    return found


@pytest.mark.slow
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_axis_with_the_larger_error_gets_more_nodes(axis):
    contact_map = sampled(row=rough_along(axis))
    shape = contact_map.axes.shape
    assert shape[axis] > 9
    assert all(nodes <= 9 for k, nodes in enumerate(shape) if k != axis)
    assert shape[axis] <= 33
    # the other axes are cubic in the logarithms
    assert all(e <= 3e-4 for k, e in enumerate(sampling.axis_errors(contact_map)) if k != axis)


@pytest.mark.slow
def test_nodes_interpolated_within_the_tolerance_are_not_solved():
    """A film with a sharp bend at 30 N only: the finest nodes lie there, interpolated nodes are accurate."""
    # nine initial loads: fewer do not resolve the bend
    grid = replace(ODD, contact_nodes=(9, 5, 5), contact_tolerance=1e-2)
    row = rough_along(0, sharpness=4.0)
    contact_map = sampled(grid, row)
    true = true_samples(contact_map, row)
    loads = contact_map.axes.nodes[0]
    for raceway in RACEWAYS:
        solved = contact_map.solved[raceway]
        assert 0.2 < solved.mean() < 0.9
        far = np.abs(np.log(loads / 30.0)) > 1.3
        # the coarsest nodes are solved everywhere
        assert solved[~far].mean() > solved[far].mean() + 0.2
        for name in FILMS[:2]:
            error = np.abs(contact_map.samples[raceway][name] / true[raceway][name] - 1.0)
            assert error[solved].max() < 1e-12
            assert error[~solved].max() > 1e-9  # interpolated
            assert error[~solved].max() < 4.0 * grid.contact_tolerance
        for name in ("temperature_rise", "pressure_max"):
            np.testing.assert_allclose(contact_map.samples[raceway][name], true[raceway][name], rtol=1e-3)


def test_raceways_are_sampled_each_by_its_own_error():
    contact_map = sampled(row=rough_along(1, raceways=("nut",)))
    screw, nut = (int(contact_map.solved[raceway].sum()) for raceway in RACEWAYS)
    assert nut > 2 * screw


@pytest.mark.slow
def test_smaller_tolerance_gives_more_solves_and_smaller_errors():
    """The error at the nodes that were not solved follows the tolerance."""
    row = rough_along(1)
    counts, errors = [], []
    for tolerance in (1e-2, 3e-3, 1e-3):
        contact_map = sampled(replace(ODD, contact_tolerance=tolerance), row)
        true = true_samples(contact_map, row)
        counts.append(solves(contact_map))
        errors.append(
            max(
                float(np.abs(contact_map.samples[r][FILMS[0]] / true[r][FILMS[0]] - 1.0).max())
                for r in RACEWAYS
            )
        )
        assert errors[-1] < 4.0 * tolerance
    assert counts[0] < counts[1] < counts[2]
    assert errors[2] < errors[0]


@pytest.mark.slow
def test_error_of_thin_films_counts_less(monkeypatch):
    row = rough_along(1)
    many = sampled(row=row).solved["screw"].sum()
    # 100 times the closed films
    monkeypatch.setattr(sampling, "FILM_FLOOR", 1e-5)
    assert sampled(row=row).solved["screw"].sum() < 0.8 * many


def test_refinement_ends_at_the_largest_number_of_nodes():
    grid = replace(ODD, contact_most=(5, 9, 5), contact_tolerance=1e-9)
    contact_map = sampled(grid, row=rough_along(1))
    assert contact_map.axes.shape == (5, 9, 5)
    assert all(mask.all() for mask in contact_map.solved.values())


@pytest.mark.slow
def test_refined_build_is_the_same_with_one_and_four_threads(tmp_path):
    with ThreadPoolExecutor(4) as four:
        one, other = (sampled(row=rough_along(0), executor=executor) for executor in (None, four))
    same_samples(one, other)


@pytest.mark.slow
def test_refined_build_continues_from_its_journal(tmp_path):
    """Stopped in the second stage of refinement; the nodes of former stages are not solved again."""
    journal, solved, row = tmp_path / "x.contacts", [], rough_along(0)

    def counted(parameters, raceway, load, speeds, temperature):
        solved.extend(speeds.tolist())
        return row(parameters, raceway, load, speeds, temperature)

    class InterruptError(Exception):
        pass

    def stop(finished, total, what):
        if finished > 4 * 5 * 5 * 5 + 200:
            raise InterruptError

    with pytest.raises(InterruptError):
        sampled(row=counted, progress=stop, journal=journal)
    solved.clear()
    resumed = sampled(row=counted, journal=journal)
    whole = sampled(row=row)
    same_samples(resumed, whole)
    # contacts solved but not yet stored when the first build stopped are lost
    assert 2 * len(solved) < solves(whole) - 4 * 5 * 5 * 5


@pytest.mark.slow
def test_estimated_error_is_that_between_the_nodes():
    """A sharp bend along speed; true error at the middles of the cells, 95 % quantile."""
    grid = replace(GRID, contact_nodes=(5, 17, 5))
    contact_map, row = sampled(grid, row=rough_along(1)), rough_along(1)
    loads, speeds, temperatures = contact_map.axes.nodes
    middles = np.sqrt(speeds[1:] * speeds[:-1])
    errors = []
    for raceway in RACEWAYS:
        found = contact_map.evaluate_grid(raceway, FILMS[0], loads, middles, temperatures)
        for i, load in enumerate(loads):
            for k, t in enumerate(temperatures):
                true = row(GD4008, raceway, load, middles, t)[FILMS[0]]
                errors.append(np.abs(np.log(found[i, :, k] / true)))
    assert 0.2 < np.quantile(errors, 0.95) / sampling.axis_errors(contact_map)[1] < 2.0


def test_axis_with_an_even_number_of_nodes_is_not_halved():
    contact_map = sampled(replace(GRID, contact_most=(33, 5, 33), contact_tolerance=1e-12))
    assert contact_map.axes.shape == (4, 5, 4)
    assert sampling.axis_errors(contact_map)[0] == 0.0 == sampling.axis_errors(contact_map)[2]


@pytest.mark.slow
def test_halved_map_keeps_its_nodes_and_what_is_cubic():
    """Three nodes by the parabola, more by the spline."""
    built = sampled(replace(GRID, contact_nodes=(5, 5, 5)))
    for axis in range(3):
        finer = sampling.halved(built, axis)
        assert finer.axes.shape[axis] == 9
        true = true_samples(finer, closed_row)
        every_other = tuple(slice(None, None, 2 if k == axis else 1) for k in range(3))
        for raceway in RACEWAYS:
            np.testing.assert_array_equal(finer.solved[raceway][every_other], True)
            assert finer.solved[raceway].sum() == built.solved[raceway].sum()
            for name in (*FILMS, "temperature_rise"):
                np.testing.assert_allclose(finer.samples[raceway][name], true[raceway][name], rtol=1e-12)
    three = ContactAxes((2.0, 200.0, 3), (1.0, 500.0, 4), (283.15, 353.15, 4))
    x = np.linspace(-1.0, 1.0, 3)[:, None, None] + np.zeros(three.shape)
    samples = {r: {name: np.exp(1.0 + x - x**2) for name in QUANTITIES} for r in RACEWAYS}
    everywhere = {r: np.ones(three.shape, dtype=bool) for r in RACEWAYS}
    finer = sampling.halved(ContactMap(GD4008, three, samples, everywhere), 0)
    middle = np.linspace(-1.0, 1.0, 5)
    np.testing.assert_allclose(
        finer.samples["nut"]["temperature_rise"][:, 0, 0], np.exp(1.0 + middle - middle**2), rtol=1e-14
    )


def test_refined_axes_keep_their_nodes():
    axes = ContactAxes((2.0, 200.0, 5), (1.0, 500.0, 9), (283.15, 353.15, 5))
    for axis in range(3):
        finer = axes.refined(axis)
        assert finer.shape[axis] == 2 * axes.shape[axis] - 1
        np.testing.assert_allclose(finer.nodes[axis][::2], axes.nodes[axis], rtol=1e-14)


def test_grid_of_points_equals_point_by_point():
    contact_map = sampled(GRID)
    rng = np.random.default_rng(3)
    loads, speeds, temperatures = rng.uniform(8, 200, 5), rng.uniform(12, 100, 4), rng.uniform(294, 313, 3)
    for raceway in RACEWAYS:
        for name in (*FILMS, "temperature_rise"):
            found = contact_map.evaluate_grid(raceway, name, loads, speeds, temperatures)
            for j, w in enumerate(speeds.tolist()):
                for k, t in enumerate(temperatures.tolist()):
                    np.testing.assert_allclose(
                        found[:, j, k], contact_map.evaluate(raceway, name, loads, w, t), rtol=1e-12
                    )
    with pytest.raises(ValueError, match=r"speed \[rad/s\]"):
        contact_map.evaluate_grid("nut", FILMS[0], loads, np.array([1e4]), temperatures)


def test_balls_lighter_than_sampled_keep_the_ratio_to_the_formula():
    contact_map = sampled(GRID)
    lightest = contact_map.axes.load[0]
    loads = np.array([0.1, 0.5, 1.0, 1.5]) * lightest
    speeds, temperatures = np.array([20.0, 60.0]), np.array([295.0, 310.0])
    for raceway in RACEWAYS:
        for name in FILMS:
            found = contact_map.evaluate_grid(raceway, name, loads, speeds, temperatures)
            ratio = found / film_formula(GD4008, raceway, loads[:, None, None], speeds[:, None], temperatures)
            np.testing.assert_allclose(ratio[:2], np.broadcast_to(ratio[2], ratio[:2].shape), rtol=1e-12)
            assert (np.abs(ratio[3] / ratio[2] - 1.0) > 1e-4).all()
        rise = contact_map.evaluate_grid(raceway, "temperature_rise", loads, speeds, temperatures)
        np.testing.assert_allclose(rise[0], 0.1 ** (1.0 / 3.0) * rise[2], rtol=1e-12)
