"""The map file: complete or refused in one line, written completely or not at all; maps in memory, errors, band."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from reference_screw import GD4008
from synthetic_contacts import (
    CERTIFICATE,
    GRID,
    LAW,
    ClosedContacts,
    ClosedFilm,
    closed_ball,
    law_map,
    nut_map_of,
    small_map,
)

from ballscrew_tehl.atlas.contact_atlas import OutsideAtlasError, packaged_atlas
from ballscrew_tehl.friction.film_shear import double_nut_torque
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.nut_map import build, interval, kept
from ballscrew_tehl.nut_map import file as store
from ballscrew_tehl.nut_map import grid as limits
from ballscrew_tehl.nut_map.file import save_map
from ballscrew_tehl.nut_map.interval import BAND, band_point, map_interval
from ballscrew_tehl.nut_map.load import load_map
from ballscrew_tehl.parameters import identity
from ballscrew_tehl.parameters.file import PACKAGED_DATA, changed, load_screw
from ballscrew_tehl.physics.thermal_preload import preload_at_temperature_difference
from ballscrew_tehl.refinement import certificate, direct
from ballscrew_tehl.refinement.certificate import (
    WHOLE,
    Deviation,
    claim,
    deviation_from_direct,
    region_points,
)
from ballscrew_tehl.runtime.packed import MapError, npz_bytes, read_npz


@pytest.fixture(scope="module")
def saved(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("map") / "small.npz"
    save_map(path, small_map())
    return path


@pytest.fixture(scope="module")
def law(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("map") / "law.npz"
    save_map(path, law_map())
    return path


@pytest.fixture(autouse=True)
def maps_of_the_user(tmp_path, monkeypatch):
    """Not those of whoever runs the tests."""
    monkeypatch.setattr(kept, "user_cache", lambda: tmp_path)


def refusal(path, parameters=GD4008) -> str:
    with pytest.raises(MapError) as caught:
        load_map(path, parameters)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith(f"{path}: ")
    return text.removeprefix(f"{path}: ")


@pytest.mark.parametrize("screw", [GD4008, LAW])
def test_packaged_map_has_the_preload_by_the_temperature_difference(screw):
    """The axis is stretched, so that one of other ends would move each preload."""
    nut_map = load_map(None, screw)
    for preload, difference in ((300.0, -9.0), (1300.0, -0.3), (1300.0, 5.0), (4000.0, 15.0)):
        exact = preload_at_temperature_difference(screw.screw, preload, difference, screw.summed_balls)
        assert nut_map.actual_preload(preload, difference) == pytest.approx(exact, rel=2e-3)


@pytest.mark.parametrize("parameters", [GD4008, LAW])
def test_packaged_map_is_finite_over_its_whole_range(parameters):
    nut_map = load_map(None, parameters)
    header, axes = nut_map.header, nut_map.header["axes"]
    assert nut_map.law == header["law"] == parameters.friction.law
    rng = np.random.default_rng(7)
    # axial load included, down to standstill, up to the ends
    preload, speed = (np.exp(rng.uniform(*np.log(axes[name][:2]), 500)) for name in ("preload", "speed"))
    speed[:20] *= np.linspace(0.0, 1.0, 20)
    axial = rng.uniform(-1.0, 1.0, 500) * (axes["force"][1] - preload)
    state = nut_map.evaluate(preload, speed, rng.uniform(*axes["temperature"][:2], 500), axial)
    assert state.in_range.all()
    for name, value in state._asdict().items():
        assert np.isfinite(value).all() if name != "clamped" else value == ()
    assert (state.viscous_torque[1:] > 0.0).all()
    assert (state.film_thickness_min <= state.film_thickness_central_nut).all()
    # a relieved nut is in range far below the lowest preload
    lowest = axes["preload"][0]
    assert nut_map.evaluate(lowest, 50.0, 303.0, 1.5 * lowest).in_range
    assert nut_map.evaluate(0.9 * lowest, 50.0, 303.0).clamped == ("preload",)


def test_map_is_read_back_with_the_numbers_of_the_screw_file(saved):
    parameters = changed(GD4008, friction={"net_sliding_coefficient": 0.001})
    friction, nut_map = default_friction_set(parameters), load_map(saved, parameters)
    assert nut_map.defaults == (*friction.values, 1.0)
    for name, array in nut_map_of(small_map()).arrays.items():
        np.testing.assert_array_equal(nut_map.arrays[name], array)
    header = nut_map.header
    assert header["certificate"] == CERTIFICATE
    assert header["parameters_hash"] == identity.parameters_hash(GD4008)
    mechanistic = replace(default_friction_set(GD4008), law="mechanistic")
    with pytest.raises(MapError, match="law mechanistic; expected three_parameter"):
        load_map(saved, GD4008, mechanistic)


def test_same_map_same_bytes(tmp_path, law):
    digest = save_map(tmp_path / "again.npz", law_map.__wrapped__())
    assert (tmp_path / "again.npz").read_bytes() == law.read_bytes()
    assert digest == load_map(law, LAW).header["file_hash"]
    other = replace(law_map(), header=law_map().header | {"certificate": {}})
    assert save_map(tmp_path / "again.npz", other) != digest


def test_map_of_any_screw_is_made_in_memory(tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "MapGrid", lambda: GRID)
    file, calls = PACKAGED_DATA / "example_25x10.toml", []
    screw = load_screw(file)
    made = load_map(file, progress=lambda *call: calls.append(call))
    assert calls[-1][0] == calls[-1][1] > 0
    for name in ("preload", "speed", "temperature"):
        assert tuple(made.header["axes"][name]) == getattr(limits.map_grid(screw), name)
    assert made.header["parameters_json"] == identity.map_parameters_json(screw)
    path = tmp_path / "map.npz"
    assert save_map(path, build.build_map(screw)) == made.header["file_hash"]
    for other in (load_map(path, screw), load_map(path)):
        assert other.header == made.header
    narrow = load_map(None, changed(LAW, map={"preload_min": 150.0, "preload_max": 9000.0}))
    assert narrow.header["axes"]["preload"][:2] == [150.0, 9000.0]
    with pytest.raises(OutsideAtlasError, match=r"law = three_parameter; .*GD4008-3 alone.*--direct"):
        load_map(None, changed(GD4008, screw={"ball_diameter": 4.764e-3}))
    monkeypatch.setattr(kept, "build_map", lambda *_: pytest.fail("a packaged map was built"))
    assert load_map().header["file_hash"] != load_map(None, LAW).header["file_hash"]


def test_a_map_is_made_once_and_again_after_any_change(tmp_path, monkeypatch):
    """What no map depends on, such as seals, makes no other one; a damaged file is made anew."""
    monkeypatch.setattr(limits, "MapGrid", lambda: GRID)
    made = []

    def build_map(*arguments):
        made.append(arguments[0])
        return build.build_map(*arguments)

    monkeypatch.setattr(kept, "build_map", build_map)
    screw = load_screw(PACKAGED_DATA / "example_25x10.toml")
    first, again = load_map(None, screw), load_map(None, screw)
    assert len(made) == 1
    assert again.header == first.header
    for name, array in first.arrays.items():
        np.testing.assert_array_equal(again.arrays[name], array)
    sealed = load_map(None, changed(screw, screw={"seal_torque": 0.1}))
    assert (len(made), sealed.seal_torque) == (1, 0.1)
    assert identity.map_parameters(sealed.header).screw.seal_torque == 0.1
    (file,) = (tmp_path / "maps").iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[:-100])
    assert load_map(None, screw).header == first.header
    save_map(file, build.build_map(changed(screw, lubricant={"pressure_viscosity": 1.9e-8})))
    assert load_map(None, screw).header == first.header
    assert file.read_bytes() == whole
    load_map(None, changed(screw, friction={"boundary_friction": 0.1}))
    load_map(None, changed(screw, lubricant={"pressure_viscosity": 2.2e-8}))
    monkeypatch.setattr(kept, "chain_hash", lambda: "of a changed model")
    load_map(None, screw)
    assert len(made) == 6
    monkeypatch.setattr(kept, "KEPT", 2)
    load_map(None, changed(screw, screw={"ball_count": screw.screw.ball_count - 1}))
    assert len(list((tmp_path / "maps").iterdir())) == 2
    # without a folder for caches
    monkeypatch.setattr(kept, "user_cache", lambda: file)
    assert load_map(None, screw).header == first.header


def resaved(source: Path, target: Path, **entries) -> Path:
    header, arrays = read_npz(source)
    header = {k: v for k, v in {**header, **entries}.items() if v is not None}
    target.write_bytes(npz_bytes(header, arrays))
    return target


def test_missing_cut_foreign_and_older_files_are_refused(saved, tmp_path):
    assert refusal(tmp_path / "none.npz").startswith("no such map file: build it with ballscrew map build")
    assert "not a readable map file" in refusal(tmp_path)
    whole, path = saved.read_bytes(), tmp_path / "cut.npz"
    for part in (b"", b"text\n" * 99, *(whole[: int(share * len(whole)) - 1] for share in (0.02, 0.5, 1.0))):
        path.write_bytes(part)
        assert "not a readable map file" in refusal(path)
    for version in (store.FILE_FORMAT - 1, store.FILE_FORMAT + 1, None):
        message = refusal(resaved(saved, path, file_format=version))
        assert message.startswith(f"map file format {version}; expected {store.FILE_FORMAT}: build it")
    assert refusal(packaged_atlas()).startswith("map file format")
    for change in ({"file_hash": None}, {"version": "9.9"}):
        assert "expected" in refusal(resaved(saved, path, **change))


def test_map_of_another_screw_is_refused_and_that_of_the_same_one_is_not(saved, law):
    """Nor is a double nut a single one; rounding, the range of a map and names are no other screw."""
    for table, key, value, found, expected in (
        ("screw", "ball_diameter", 4.764e-3, "ball_diameter_mm = 4.763", "ball_diameter_mm = 4.764"),
        ("solid", "density", 7800.0, "density_kg_m3 = 7870.0", "density_kg_m3 = 7800.0"),
        ("lubricant", "viscosity", 0.033 * (1.0 + 1e-11), "viscosity = 0.033", "viscosity = 0.03300000000033"),
        ("friction", "hysteresis_coefficient", 0.011, "coefficient = 0.01", "coefficient = 0.011"),
        ("screw", "ball_material", "silicon_nitride", "ball_youngs_modulus_MPa = 205000.0", "_MPa = 310000.0"),
        ("published_speeds", "reference_speed", 300.0, "reference_speed_", "reference_speed_"),
    ):  # fmt: skip
        other = changed(GD4008, **{table: {key: value}})
        of_map, of_file = refusal(saved, other).split("; the screw file is of ")
        assert found in of_map
        assert expected in of_file
        assert "without --map a map of the screw file is made" in of_file
    # geometry first
    both = changed(GD4008, screw={"ball_diameter": 4.764e-3}, lubricant={"density": 880.0})
    assert refusal(saved, both).index("ball_diameter_mm") < refusal(saved, both).index("density")
    for path, screw in ((saved, GD4008), (law, LAW)):
        for kind in ("single_nut_offset", "single_nut_oversize_ball"):
            single = changed(screw, screw={"preload_kind": kind})
            assert f'preload_kind = "{kind}"' in refusal(path, single)
            assert identity.parameters_hash(single) != identity.parameters_hash(screw)
    near = changed(GD4008, screw={"lead_angle": math.nextafter(GD4008.screw.lead_angle, 1.0)})
    narrow = changed(GD4008, map={"preload_min": 500.0, "preload_max": 3000.0})
    renamed = changed(GD4008, lubricant={"name": "another oil"}).model_copy(update={"name": "another screw"})
    assert identity.parameters_hash(renamed) == identity.parameters_hash(GD4008)
    for other in (near, narrow, renamed):
        assert load_map(saved, other).header["file_hash"] == load_map(saved, GD4008).header["file_hash"]


def test_deviation_is_that_of_torque_and_shown_films_from_direct_solves(saved, monkeypatch):
    """Contacts in closed form; torque by the speeds of the map, films by those of rolling balls, 3 % thicker here."""
    monkeypatch.setattr(direct, "solve_ball", closed_ball)
    nut_map, friction = load_map(saved, GD4008), default_friction_set(GD4008)
    regions = region_points(nut_map, GD4008, 4)
    for point in np.concatenate([regions[name] for name in WHOLE]).tolist():
        found = certificate.deviation_at(nut_map, GD4008, tuple(point))
        # films of the lightest ball by the closed formula, see mean_ball_state
        assert (np.array(found) <= (2e-3, 0.05, 0.05)).all()
        torque = double_nut_torque(GD4008, friction, ClosedFilm(GD4008), *point).total
        state = nut_map.evaluate(*point)
        assert found.torque == pytest.approx(abs(state.friction_torque / torque - 1.0), abs=1e-3)
    point = (2000.0, 50.0, 303.15, 0.0)
    state = nut_map.evaluate(*point)
    for factors in ((1.0, 1.03), (1.03, 1.0)):
        thicker = direct.DirectState(
            float(state.friction_torque) / 1.01, state.film_thickness_central_screw / factors[0],
            state.film_thickness_central_nut / factors[1], state.film_temperature_rise + 0.5,
        )  # fmt: skip
        monkeypatch.setattr(direct, "mean_ball_state", lambda *arguments, answer=thicker: answer)
        rise = 0.5 / max(thicker.film_temperature_rise, 10.0)
        assert certificate.deviation_at(nut_map, GD4008, point) == pytest.approx((0.01, 0.03, rise), rel=1e-9)


def test_certificate_leaves_out_points_without_solution(saved, monkeypatch):
    nut_map = load_map(saved, GD4008)
    regions = region_points(nut_map, GD4008, 40)
    points = np.concatenate([regions[name] for name in WHOLE])
    lost = {tuple(points[3]): certificate.NOT_SOLVED, tuple(points[5]): Deviation(0.1, math.nan, 0.1)}

    def row(nut_map, parameters, point):
        return lost.get(point, Deviation(*(1e-6 * k * point[0] for k in (1, 2, 3))))

    monkeypatch.setattr(certificate, "deviation_at", row)
    found, whole = deviation_from_direct(nut_map, GD4008, 40), 1e-6 * np.delete(points[:, 0], [3, 5])
    assert (found["points"], found["points_not_solved"]) == (38, 2)
    for k, name in enumerate(Deviation._fields, start=1):
        stated = [found[f"{name}_error_{key}"] for key in ("mean", "99", "max")]
        expected = [k * np.mean(whole), k * np.quantile(whole, 0.99), k * np.max(whole)]
        assert stated == pytest.approx(expected, rel=1e-12)
    monkeypatch.setattr(certificate, "deviation_at", lambda *_: certificate.NOT_SOLVED)
    with pytest.raises(ArithmeticError, match="none of 2 points"):
        deviation_from_direct(nut_map, GD4008, 2)
    # with 5 % chance 48 random points miss the worst 6.05 % of a map
    assert " 93.9 % of such points with 95 % confidence" in claim(48)


def test_band_is_the_interval_at_its_point_and_follows_the_constants(law, monkeypatch):
    for module in (build, interval):
        monkeypatch.setattr(module, "BallContacts", ClosedContacts)
    nut_map = load_map(law, LAW)
    header, axes, friction = nut_map.header, nut_map.header["axes"], default_friction_set(LAW)
    band, point = header[BAND], band_point(axes, LAW.screw)
    assert tuple(band[name] for name in ("preload", "speed", "temperature")) == point
    found = map_interval(LAW, axes, friction, *point)
    assert (band["low"], band["high"]) == pytest.approx(found.relative, rel=1e-12)
    own = changed(LAW, friction={"boundary_friction": 0.1, "supply_length": math.inf})
    other = load_map(law, own)
    assert identity.map_parameters(other.header) == own
    flooded, starved = (each.evaluate(2000.0, 50.0, 303.15).viscous_torque for each in (other, nut_map))
    assert flooded >= 1.005 * starved
    # torque within the error of the spline through the nodes of this small map, also with the constants of the screw
    for parameters, table in ((LAW, nut_map), (own, other)):
        zero = default_friction_set(changed(parameters, friction={"ball_thrust": 1.0}))
        for axial in (0.0, 800.0):
            state = table.evaluate(2000.0, 50.0, 303.15, axial, *zero.values[:2])
            found = map_interval(parameters, axes, zero, 2000.0, 50.0, 303.15, axial)
            assert found.torque == pytest.approx(float(state.friction_torque), rel=1e-3)
            assert found.low < found.torque < found.high
    assert BAND not in load_map(None, GD4008).header
