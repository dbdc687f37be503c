"""The packaged atlas: its errors at contacts solved here, its range, its file, and maps over it."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import GRID

from ballscrew_tehl.contact import ball_conditions, scales_of, solve_for_map
from ballscrew_tehl.nut_map import atlas as atlas_module
from ballscrew_tehl.nut_map import atlas_contacts, build
from ballscrew_tehl.nut_map.atlas import (
    GROUPS,
    HELD,
    AtlasError,
    ScrewAtlas,
    atlas_quantities,
    ball_groups,
    coordinates,
    load_atlas,
    packaged_atlas,
)
from ballscrew_tehl.nut_map.atlas_contacts import (
    CATALOGUE,
    AtlasJournal,
    AtlasPoint,
    build_atlas,
    check_points,
    contact_groups,
    errors_at,
    solve_point,
)
from ballscrew_tehl.nut_map.contact_map import ContactModel, screw_atlases, unmodelled
from ballscrew_tehl.nut_map.contacts import CORE, FILMS, QUANTITIES, RISE, SolvedContacts
from ballscrew_tehl.nut_map.grid import contact_range
from ballscrew_tehl.nut_map.sampling import operating_points
from ballscrew_tehl.parameters.file import changed
from ballscrew_tehl.physics.ball_formula import film_formula
from ballscrew_tehl.physics.hertz import RACEWAYS, ellipse

ROLLING = changed(GD4008, friction={"kinematics": "rolling_frame"})
RANGE = contact_range(ROLLING, GRID)
ATLAS = load_atlas()


def points_of(count, seed=3):
    return operating_points(RANGE, np.random.default_rng(seed).random((count, 3)))


@pytest.mark.slow
def test_contacts_that_were_not_used_are_predicted():
    """Two random contacts of screws, solved here: within the largest errors that the file states."""
    points = check_points(2)
    groups = np.array([contact_groups(point.values)[0] for point in points])
    found = errors_at(ATLAS, groups, np.array([solve_point(point.values, True) for point in points]))
    for name in HELD:
        assert found[name]["max"] <= 1.01 * ATLAS.header["errors"][name]["max"]
    assert found[FILMS[0]]["max"] <= 0.01


def test_file_states_its_contacts_and_errors():
    header = ATLAS.header
    assert packaged_atlas().stat().st_size <= 1_000_000
    assert header["contacts"] >= 1500
    assert header["contacts_heated"] >= 500
    for name in HELD:
        errors = header["errors"][name]
        assert errors["points"] >= 100
        assert 0.0 < errors["mean"] <= errors["99"] <= errors["max"]


@pytest.mark.parametrize("raceway", RACEWAYS)
def test_groups_of_a_ball_are_those_of_its_contact(raceway):
    """The pressure is that at the contact angle of the drawing."""
    points = points_of(5)
    for row, point in zip(ball_groups(ROLLING, raceway, points), points.tolist(), strict=True):
        conditions = ball_conditions(ROLLING, raceway, *point)
        scales = scales_of(conditions, ROLLING.lubricant)
        groups = dict(zip(GROUPS, row.tolist(), strict=True))
        assert groups["M"] == pytest.approx(scales.M, rel=1e-12)
        assert groups["L"] == pytest.approx(scales.L, rel=1e-12)
        assert groups["radius_ratio"] == pytest.approx(conditions.R_x / conditions.R_y, rel=1e-12)
        assert groups["pressure"] == pytest.approx(scales.hertz.p_max, rel=5e-3)
        assert groups["z"] == 0.58
        assert groups["temperature"] == point[2]


def test_points_of_the_axes_have_their_pressure_viscosity_and_slope():
    for point in check_points(5):
        conditions, oil = atlas_contacts.contact_of(point.values)
        groups, scales = contact_groups(point.values)
        assert scales.hertz.p_max == pytest.approx(point.values[2], rel=1e-9)
        assert float(atlas_module.eta0(oil, conditions.temperature)) == pytest.approx(
            point.values[4], rel=1e-9
        )
        nu = 1e6 * point.values[4] / atlas_contacts.DENSITY
        slope = point.values[6] * (nu + 0.7) * np.log(nu + 0.7) / (conditions.temperature * nu)
        # the secant over 20 K of a law that is straight in these coordinates, and the density
        assert groups[GROUPS.index("slope")] == pytest.approx(slope + atlas_contacts.EXPANSION, rel=1e-3)


def test_points_beyond_the_contacts_are_flagged():
    inside = ball_groups(ROLLING, "nut", np.array([[30.0, 30.0, 303.0]]))
    assert ATLAS.inside(inside).tolist() == [True]
    for column in range(len(GROUPS)):
        for end in ATLAS.ends[:, column] * np.array([0.9, 1.1]):
            outside = inside.copy()
            outside[0, column] = end
            assert ATLAS.inside(outside).tolist() == [False]


def test_what_the_atlas_holds_of_a_screw():
    assert atlas_quantities(ROLLING) == HELD
    assert atlas_quantities(GD4008) == FILMS[:1]
    for other in (
        {"lubricant": {"rheology": "eyring"}},
        {"lubricant": {"pressure_law": "barus"}},
        {"lubricant": {"density_law": "incompressible"}},
        {"lubricant": {"roelands_pressure": 1e8}},
        {"screw": {"youngs_modulus": 320e9}},
    ):
        assert atlas_quantities(changed(ROLLING, **other)) == ()
    # ceramic walls and an oil that heat does not thin
    assert atlas_quantities(changed(ROLLING, solid={"thermal_conductivity": 5.0})) == FILMS[:1]


@pytest.mark.slow
def test_table_of_a_screw_agrees_with_the_atlas():
    points = points_of(200)
    table = ScrewAtlas(ATLAS, ROLLING, "screw", RANGE)
    groups = ball_groups(ROLLING, "screw", points)
    for name in (*FILMS[:2], *CORE):
        error = table(name, points) - ATLAS.modelled(name, groups)
        assert np.max(np.abs(error)) <= 0.01
        assert np.mean(np.abs(error)) <= 1e-3


@pytest.mark.slow
def test_few_contacts_correct_the_atlas():
    """Contacts that are 2 % off the atlas everywhere: eight of them correct it everywhere."""
    table = screw_atlases(ROLLING, RANGE, ATLAS.hash)["nut"]
    points, others = points_of(8), points_of(50, 4)

    def film(at):
        return 1.02 * unmodelled(FILMS[0], table(FILMS[0], at)) * film_formula(ROLLING, "nut", *at.T)

    values = dict.fromkeys(QUANTITIES, np.ones(8)) | {FILMS[0]: film(points), FILMS[1]: 0.9 * film(points)}
    model = ContactModel(ROLLING, "nut", RANGE, SolvedContacts(points, values), None, table)
    np.testing.assert_allclose(model.value(FILMS[0], others), film(others), rtol=1e-5)
    assert np.max(np.abs(model.left_out(FILMS[0]))) <= 1e-5


def test_map_over_another_atlas_is_refused():
    with pytest.raises(AtlasError, match="map build"):
        screw_atlases(ROLLING, RANGE, "0" * 64)
    assert screw_atlases(ROLLING, RANGE, "") == {}


def test_one_contact_in_error_keeps_the_sampling_going(monkeypatch):
    errors = np.full(30, 1e-4)
    monkeypatch.setattr(build.sampling, "left_out_errors", lambda model: errors)
    assert build._well_known(SimpleNamespace(), GRID)
    errors[7] = 1.5 * GRID.contact_largest
    assert errors.mean() <= GRID.contact_tolerance
    assert not build._well_known(SimpleNamespace(), GRID)
    assert not build._well_known(
        SimpleNamespace(), replace(GRID, contact_largest=1.0, contact_tolerance=1e-5)
    )


def closed_point(values, heated):
    """In place of solve_point: polynomials of the logarithms, without heat the isothermal film alone."""
    x = np.log(contact_groups(values)[0][:2])
    found = dict.fromkeys(HELD, 0.1 * x[1]) | {FILMS[0]: 0.05 * x[0] - 0.01 * x[1], RISE: 0.3 * x[0]}
    return [float(v) if heated or name == FILMS[0] else float("nan") for name, v in found.items()]


def few_points():
    drawn = atlas_contacts._drawn(np.random.default_rng(5).random((80, len(CATALOGUE))), CATALOGUE)
    return [AtlasPoint(f"few {k}", values, k % 2 == 0) for k, values in enumerate(drawn)]


@pytest.mark.slow
@pytest.mark.parametrize(("load", "speed", "temperature"), [(150.0, 2.0, 340.0), (60.0, 0.6, 330.0)])
def test_core_of_flattened_contacts_is_nearly_that_of_hertz(load, speed, temperature):
    """Solved here, with films of nanometres: the atlas alone was off by up to 8 % where it has no contacts."""
    conditions = ball_conditions(ROLLING, "nut", load, speed, temperature)
    own = solve_for_map(conditions, ROLLING.lubricant, ROLLING.solid, thermal=True)
    hertz = ellipse(load, conditions.R_x, conditions.R_y, conditions.E_prime)
    groups = ball_groups(ROLLING, "nut", np.array([[load, speed, temperature]]))
    assert groups[0, 0] >= 2e4
    solved = own.core_pressure / hertz.p_max, own.core_area / (np.pi * hertz.a * hertz.b)
    shares = [float(np.exp(ATLAS.modelled(name, groups)[0])) for name in CORE]
    assert abs(shares[0] / solved[0] - 1.0) <= 1e-3
    # the area over that of Hertz with the square of the pressure
    assert abs(shares[1] / (solved[1] * solved[0] ** 2) - 1.0) <= 3e-3


def test_atlas_is_built_continued_and_read(tmp_path, monkeypatch):
    solved = []

    def counted(values, heated):
        solved.append(values)
        if len(solved) == 50:
            raise KeyboardInterrupt
        return closed_point(values, heated)

    monkeypatch.setattr(atlas_contacts, "solve_point", counted)
    path = tmp_path / "atlas.npz"
    with ThreadPoolExecutor(1) as thread, pytest.raises(KeyboardInterrupt):
        build_atlas(path, thread, 6, points=few_points)
    kept = len(AtlasJournal(tmp_path / "atlas.npz.contacts").solved)
    assert kept >= 40
    with (tmp_path / "atlas.npz.contacts").open("a") as file:
        file.write('["cut of')
    before = len(solved)
    with ThreadPoolExecutor(1) as thread:
        header = build_atlas(path, thread, 6, points=few_points)
    assert len(solved) - before == 80 + 6 - kept
    assert (header["contacts"], header["contacts_heated"]) == (80, 40)
    atlas = load_atlas(path)
    assert atlas.hash != ATLAS.hash
    points = few_points()[::2]
    groups = np.array([contact_groups(point.values)[0] for point in points])
    for name, column in zip(HELD, np.array([closed_point(p.values, True) for p in points]).T, strict=True):
        # groups and values are stored in single precision
        found = atlas.interpolants[name](coordinates(name, groups))
        np.testing.assert_allclose(found, column, atol=2e-3)


def test_points_of_another_format_are_not_continued(tmp_path):
    path = tmp_path / "atlas.npz.contacts"
    path.write_text('["free 0", [1.0, 2.0]]\n')
    with pytest.raises(ValueError, match="not contacts of an atlas in format"):
        AtlasJournal(path)
    assert path.read_text() == '["free 0", [1.0, 2.0]]\n'


def test_damaged_and_other_files_are_refused(tmp_path):
    with np.load(packaged_atlas()) as file:
        arrays = {name: file[name] for name in file.files}
    changed_weights = dict(arrays, temperature_rise_weights=1.01 * arrays["temperature_rise_weights"])
    np.savez(tmp_path / "changed.npz", **changed_weights)
    header = json.loads(str(arrays["header"])) | {"format": 0}
    np.savez(tmp_path / "format.npz", **(arrays | {"header": np.array(json.dumps(header))}))
    (tmp_path / "text.npz").write_text("text")
    for name, words in (("changed", "content hash"), ("format", "atlas format 0"), ("text", "not a readable atlas"),
                        ("missing", "not a readable atlas")):  # fmt: skip
        with pytest.raises(AtlasError, match=words):
            load_atlas(tmp_path / f"{name}.npz")
