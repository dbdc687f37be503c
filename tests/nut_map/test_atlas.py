"""The packaged atlas: its errors at contacts solved here, its range, its file, and maps over it."""

import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import GRID

from ballscrew_tehl.contact import ball_conditions, scales_of
from ballscrew_tehl.nut_map import atlas_contacts
from ballscrew_tehl.nut_map.atlas import (
    GROUPS,
    HELD,
    STEEL,
    AtlasError,
    atlas_quantities,
    ball_groups,
    coordinates,
    core_of_flattened,
    load_atlas,
    packaged_atlas,
)
from ballscrew_tehl.nut_map.atlas_contacts import (
    CATALOGUE,
    AtlasPoint,
    build_atlas,
    check_points,
    contact_groups,
    errors_at,
    solve_point,
)
from ballscrew_tehl.nut_map.contact_map import ContactModel, screw_atlases, unmodelled
from ballscrew_tehl.nut_map.contacts import CORE, FILMS, QUANTITIES, RISE, SolvedContacts, film_parameters
from ballscrew_tehl.nut_map.grid import contact_range
from ballscrew_tehl.nut_map.sampling import operating_points
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.ball_formula import film_formula
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.physics.lubricant import eta0

ROLLING = film_parameters(GD4008)
RANGE = contact_range(ROLLING, GRID)
ATLAS = load_atlas()


def points_of(count, seed=3):
    return operating_points(RANGE, np.random.default_rng(seed).random((count, 3)))


@pytest.mark.slow
def test_contacts_that_were_not_used_are_predicted():
    """A random contact of a screw, solved here: within the largest errors that the file states."""
    points = check_points(1)
    groups = np.array([contact_groups(point.values)[0] for point in points])
    solved = [[solve_point(point.values, True)[name] for name in HELD] for point in points]
    errors = errors_at(ATLAS, groups, np.array(solved))
    header = ATLAS.header
    assert header["contacts"] >= 1500
    for name in HELD:
        stated = header["errors"][name]
        assert 0.0 < stated["mean"] <= stated["99"] <= stated["max"]
        assert errors[name]["max"] <= 1.01 * stated["max"]
    assert errors[FILMS[0]]["max"] <= 0.01


def test_groups_of_a_ball_are_those_of_its_contact():
    """The pressure is that at the contact angle of the drawing. Axes of the atlas: pressure, viscosity and slope."""
    points = points_of(5)
    for raceway in RACEWAYS:
        for row, point in zip(ball_groups(ROLLING, raceway, points), points.tolist(), strict=True):
            conditions = ball_conditions(ROLLING, raceway, *point)
            scales = scales_of(conditions, ROLLING.lubricant)
            groups = dict(zip(GROUPS, row.tolist(), strict=True))
            assert groups["M"] == pytest.approx(scales.M, rel=1e-12)
            assert groups["L"] == pytest.approx(scales.L, rel=1e-12)
            assert groups["radius_ratio"] == pytest.approx(conditions.R_x / conditions.R_y, rel=1e-12)
            assert groups["pressure"] == pytest.approx(scales.hertz.p_max, rel=5e-3)
            oil = ROLLING.lubricant
            heat = groups["slope"] * float(eta0(oil, point[2])) * conditions.u_e**2 / oil.thermal_conductivity
            assert groups["N"] == pytest.approx(heat, rel=1e-9)
            assert (groups["z"], groups["temperature"]) == (oil.z_roelands, point[2])


def test_points_beyond_the_contacts_are_flagged():
    inside = ball_groups(ROLLING, "nut", np.array([[30.0, 30.0, 303.0]]))
    assert ATLAS.inside(inside).tolist() == [True]
    for column in range(len(GROUPS)):
        for end in ATLAS.ends[:, column] * np.array([0.9, 1.1]):
            outside = inside.copy()
            outside[0, column] = end
            assert ATLAS.inside(outside).tolist() == [False]


def test_what_the_atlas_holds_of_a_screw():
    """All in pure rolling between walls like those of steel, which take heat by sqrt(k rho c)."""
    assert atlas_quantities(ROLLING) == HELD
    assert atlas_quantities(GD4008) == FILMS[:1]
    laws = {
        "rheology": "eyring", "pressure_law": "barus", "density_law": "incompressible",
        "roelands_pressure": 1e8,
    }  # fmt: skip
    for other in (
        *({"lubricant": {key: law}} for key, law in laws.items()),
        {"screw": {"youngs_modulus": 320e9}},
    ):
        assert atlas_quantities(changed(ROLLING, **other)) == ()
    steel, names = STEEL.model_dump(), ("density", "specific_heat", "thermal_conductivity")
    for name, second in zip(names, names[1:] + names[:1], strict=True):
        for factor, held in ((0.6, FILMS[:1]), (0.68, HELD), (1.4, HELD), (1.5, FILMS[:1])):
            other = changed(ROLLING, solid=steel | {name: factor * steel[name]})
            assert atlas_quantities(other) == held
        # the same walls by other numbers
        same = steel | {name: 2.0 * steel[name], second: 0.5 * steel[second]}
        assert atlas_quantities(changed(ROLLING, solid=same)) == HELD


def test_core_is_interpolated_where_rigid_and_in_closed_form_where_flattened():
    groups = np.repeat(ball_groups(ROLLING, "nut", np.array([[30.0, 30.0, 303.0]])), 2, axis=0)
    groups[:, GROUPS.index("M")] = 10.0, 2e5
    columns = dict(zip(GROUPS, groups.T, strict=True))
    for name in CORE:
        found, closed = ATLAS.modelled(name, groups), core_of_flattened(name, columns)
        own = ATLAS.interpolants[name](coordinates(name, groups))
        assert abs(closed[0] - own[0]) >= 0.01
        assert found[0] == pytest.approx(own[0], abs=1e-4 * abs(closed[0] - own[0]))
        assert found[1] == pytest.approx(closed[1], abs=1e-4 * abs(closed[1] - own[1]) + 1e-12)


@pytest.mark.slow
def test_few_contacts_correct_the_table_of_a_screw_which_agrees_with_the_atlas():
    """Contacts that are 2 % off the atlas everywhere: eight of them correct it everywhere."""
    table, points = screw_atlases(ROLLING, RANGE, ATLAS.hash)["nut"], points_of(100)
    groups = ball_groups(ROLLING, "nut", points)
    columns = dict(zip(GROUPS, groups.T, strict=True))
    for name in (FILMS[1], RISE, CORE[1]):
        # the rise is held times beta over N
        over = np.log(columns["N"] / columns["slope"]) if name == RISE else 0.0
        error = np.abs(table(name, points) - ATLAS.modelled(name, groups) - over)
        assert np.max(error) <= 0.01
        assert np.mean(error) <= 1e-3
    assert table.inside(points).all()
    few = points[:8]

    def film(at):
        return 1.02 * unmodelled(FILMS[0], table(FILMS[0], at)) * film_formula(ROLLING, "nut", *at.T)

    values = dict.fromkeys(QUANTITIES, np.ones(8)) | {FILMS[0]: film(few), FILMS[1]: 0.9 * film(few)}
    model = ContactModel(ROLLING, "nut", RANGE, SolvedContacts(few, values), None, table)
    np.testing.assert_allclose(model.value(FILMS[0], points), film(points), rtol=1e-5)
    assert np.max(np.abs(model.left_out(FILMS[0]))) <= 1e-5
    # thermal contacts alone: the isothermal film is that of the atlas
    share = unmodelled(FILMS[1], table(FILMS[1], points))
    values |= {FILMS[0]: np.full(8, np.nan), FILMS[1]: share[:8] * film(few)}
    model = ContactModel(ROLLING, "nut", RANGE, SolvedContacts(few, values), None, table)
    np.testing.assert_allclose(model.value(FILMS[1], points), share * film(points), rtol=1e-5)
    np.testing.assert_allclose(model.value(FILMS[0], points), film(points) / 1.02, rtol=1e-12)
    assert np.max(np.abs([model.left_out(name) for name in FILMS[:2]])) <= 1e-5
    with pytest.raises(AtlasError, match="map build"):
        screw_atlases(ROLLING, RANGE, "0" * 64)
    assert screw_atlases(ROLLING, RANGE, "") == {}


def closed_point(values, heated):
    """In place of solve_point: polynomials of the logarithms, without heat the isothermal film alone."""
    x = np.log(contact_groups(values)[0][:2])
    found = dict.fromkeys(HELD, 0.1 * x[1]) | {FILMS[0]: 0.05 * x[0] - 0.01 * x[1], RISE: 0.3 * x[0]}
    return {name: float(v) if heated or name == FILMS[0] else float("nan") for name, v in found.items()}


def few_points():
    drawn = atlas_contacts._drawn(np.random.default_rng(5).random((80, len(CATALOGUE))), CATALOGUE)
    return [AtlasPoint(f"few {k}", values, k % 2 == 0) for k, values in enumerate(drawn)]


@pytest.mark.slow
def test_atlas_is_built_and_read(tmp_path, monkeypatch):
    monkeypatch.setattr(atlas_contacts, "solve_point", closed_point)
    path = tmp_path / "atlas.npz"
    with ThreadPoolExecutor(1) as thread:
        header = build_atlas(path, thread, 6, points=few_points)
    assert (header["contacts"], header["contacts_heated"]) == (80, 40)
    atlas, points = load_atlas(path), few_points()[::2]
    assert atlas.hash != ATLAS.hash
    groups = np.array([contact_groups(point.values)[0] for point in points])
    for name in HELD:
        # groups and values are stored in single precision
        expected = [closed_point(point.values, True)[name] for point in points]
        np.testing.assert_allclose(atlas.interpolants[name](coordinates(name, groups)), expected, atol=2e-3)


def test_damaged_and_other_files_are_refused(tmp_path):
    with np.load(packaged_atlas()) as file:
        arrays = {name: file[name] for name in file.files}
    np.savez(tmp_path / "changed.npz", **arrays | {"rolling_loss_hyper": 1.01 * arrays["rolling_loss_hyper"]})
    header = json.loads(str(arrays["header"])) | {"format": 0}
    np.savez(tmp_path / "format.npz", **(arrays | {"header": np.array(json.dumps(header))}))
    (tmp_path / "text.npz").write_text("text")
    for name, words in (("changed", "content hash"), ("format", "atlas format 0"), ("text", "not a readable atlas"),
                        ("missing", "not a readable atlas")):  # fmt: skip
        with pytest.raises(AtlasError, match=words):
            load_atlas(tmp_path / f"{name}.npz")
