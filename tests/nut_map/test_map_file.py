"""The map file: complete or refused in one line, written completely or not at all; its certificate and its band."""

import hashlib
import json
import math
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from reference_screw import GD4008
from synthetic_contacts import (
    FEW,
    GRID,
    ClosedFilm,
    closed_ball,
    closed_build,
    nut_map_of,
    partly_failed_contact,
    same_contacts,
    small_map,
)

from ballscrew_tehl.friction.interval import zero_fitted
from ballscrew_tehl.friction.sets import default_friction_set
from ballscrew_tehl.friction.torque import double_nut_torque
from ballscrew_tehl.nut_map import build, certificate, kriging
from ballscrew_tehl.nut_map import file as store
from ballscrew_tehl.nut_map.certificate import Deviation, deviation_from_direct, operating_points
from ballscrew_tehl.nut_map.contacts import POINTS, QUANTITIES, film_parameters
from ballscrew_tehl.nut_map.file import VG100, load_contact_map, load_map, packaged_map, save_map
from ballscrew_tehl.nut_map.interval import BAND, band_point, map_interval
from ballscrew_tehl.parameters import identity
from ballscrew_tehl.parameters.file import changed, load_parameters
from ballscrew_tehl.parameters.packaged_data import PACKAGED_VG100
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.refinement import direct
from ballscrew_tehl.runtime.packed import FORCE_CURVES, POINT, SURFACES, MapError

CERTIFICATE = {"points": 3, "torque_error_max": 5e-4}
LAW = load_parameters(PACKAGED_VG100)


@pytest.fixture(scope="module")
def saved(tmp_path_factory) -> Path:
    """A small map of the packaged screw, saved."""
    path = tmp_path_factory.mktemp("map") / "small.nc"
    save_map(path, small_map(), CERTIFICATE)
    return path


@pytest.fixture(scope="module")
def law_map(tmp_path_factory) -> Path:
    """A small map of rolling balls."""
    path = tmp_path_factory.mktemp("map") / "law.nc"
    save_map(path, closed_build(LAW), CERTIFICATE)
    return path


def refusal(path, parameters=GD4008, load=load_map) -> str:
    """The line of the error message, without the file name at its start."""
    with pytest.raises(MapError) as caught:
        load(path, parameters)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith(f"{path}: ")
    return text.removeprefix(f"{path}: ")


def assert_same(a, b):
    assert a.header == b.header
    for name in a.arrays:
        np.testing.assert_array_equal(a.arrays[name], b.arrays[name])


# --- the packaged maps ---


@pytest.mark.parametrize(
    ("screw", "law", "film"),
    [(None, "film_shear", "solved_thermal"), (PACKAGED_VG100, "mechanistic", "mechanistic")],
)
def test_packaged_map_is_finite_over_its_whole_range(screw, law, film):
    parameters = load_parameters(screw)
    nut_map = load_map(None, parameters)
    header, axes = nut_map.header, nut_map.header["axes"]
    assert (nut_map.law, header["film_model"]) == (law, film)
    assert header["kinematics"] == parameters.friction.kinematics
    # films of the published speeds cannot be physical
    assert header["film_kinematics"] == "rolling_frame"
    assert header["parameters_json"] == identity.map_parameters_json(parameters)
    assert nut_map.defaults[:2] == default_friction_set(parameters).values[:2]
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


# --- writing and reading ---


@pytest.mark.parametrize("set_", ["three_parameter", "two_parameter"])
def test_map_is_read_back_with_the_film_of_the_friction_set(saved, set_):
    """Isothermal or thermal torques; extremes and force curves are common to both."""
    parameters = changed(GD4008, friction={"set": set_, "net_sliding_coefficient": 0.001, "spin_split": 1.0})
    friction, nut_map = default_friction_set(parameters), load_map(saved, parameters)
    assert nut_map.header["film_model"] == friction.film_model
    assert nut_map.defaults == (*friction.values, 1.0)
    for name, array in nut_map_of(small_map(), friction.film_model).arrays.items():
        np.testing.assert_array_equal(nut_map.arrays[name], array)
    header = nut_map.header
    assert header["certificate"] == CERTIFICATE
    digest = hashlib.sha256(header["parameters_json"].encode()).hexdigest()
    assert digest.startswith(header["parameters_hash"])


@pytest.mark.slow
def test_contacts_and_lengths_of_the_kriging_are_read_back(saved, tmp_path, monkeypatch):
    monkeypatch.setattr(build, "UNCERTAIN", math.inf)
    built, path = closed_build(grid=FEW, solve=partly_failed_contact), tmp_path / "x.nc"
    digest = save_map(path, built, {})
    lost = closed_build(grid=FEW, solve=partly_failed_contact)
    # same map, same bytes; NaN is part of the content that is hashed
    assert save_map(tmp_path / "y.nc", lost, {}) == digest == load_map(path, GD4008).header["file_hash"]
    assert path.read_bytes() == (tmp_path / "y.nc").read_bytes()
    assert save_map(tmp_path / "y.nc", lost, CERTIFICATE) != digest

    def refuse(self):
        raise AssertionError("searched")

    monkeypatch.setattr(kriging.Kriging, "_most_likely", refuse)
    found = load_contact_map(path, GD4008)
    same_contacts(found, built.contact_map)
    assert not all(contacts.good.all() for contacts in found.contacts.values())
    assert found.cell == built.contact_map.cell
    assert load_map(path, GD4008).header["contact_cell"] == list(found.cell)
    at = "nut", "rolling_loss", np.array([9.0, 30.0]), 100.0, 300.0
    np.testing.assert_array_equal(found.evaluate(*at), built.contact_map.evaluate(*at))


def test_file_is_self_describing_in_xarray(saved, law_map):
    with xr.open_dataset(saved) as data, xr.open_dataset(law_map) as law:
        assert data.attrs["title"] == "Nut map of GD4008-3, kinematics published"
        assert json.loads(data.attrs["header"])["version"] in data.attrs["source"]
        for raceway in RACEWAYS:
            contacts = small_map().contact_map.contacts[raceway]
            columns = dict(zip(POINTS, contacts.points.T, strict=True)) | dict(contacts.values)
            for name, unit in (POINTS | QUANTITIES).items():
                variable = data[f"{raceway}_contact_{name}"]
                assert variable.attrs["units"] == unit
                np.testing.assert_array_equal(variable, columns[name])
        assert all(variable.attrs["long_name"] for variable in data.variables.values())
        for file, film, own in ((data, "solved", "film_shear"), (law, "mechanistic", "mechanistic")):
            arrays = f"viscous_coefficients_{film}", "extreme_coefficients", "force_coefficients"
            columns = [file[name].attrs["long_name"].split(": ")[1].split(", ") for name in arrays]
            assert columns == [list(SURFACES[own][:4]), list(SURFACES[own][4:]), list(FORCE_CURVES)]
            assert [file[name].shape[-1] for name in arrays] == [4, 6, 5]
        assert not any("solved" in name for name in law if "coefficients" in name)


# --- refused ---


def test_missing_truncated_and_foreign_files_are_refused(saved, tmp_path):
    assert refusal(tmp_path / "none.nc").startswith(
        "no such map file: build it with python -m ballscrew_tehl"
    )
    assert "not a readable map file" in refusal(tmp_path)
    whole, path = saved.read_bytes(), tmp_path / "cut.nc"
    for share in (0.0, 1e-5, 0.004, 0.02, 0.1, 0.5, 0.9, 0.99995, 1.0):
        path.write_bytes(whole[: min(int(share * len(whole)), len(whole) - 1)])
        assert "not a readable map file" in refusal(path)
    path.write_bytes(pickle.dumps({"header": 1}))
    assert "not a readable map file" in refusal(path)


def test_flipped_bits_are_refused_or_change_nothing(saved, tmp_path):
    """Titles, names of dimensions and padding may change: no number comes from them."""
    whole, good, path = saved.read_bytes(), load_map(saved, GD4008), tmp_path / "flipped.nc"
    rng, refused = np.random.default_rng(11), 0
    places = [*rng.integers(0, len(whole), 60).tolist(), *rng.integers(0, 9000, 60).tolist()]
    for place in places:
        path.write_bytes(
            whole[:place] + bytes([whole[place] ^ 1 << int(rng.integers(8))]) + whole[place + 1 :]
        )
        try:
            assert_same(load_map(path, GD4008), good)
        except MapError as error:
            message = str(error).removeprefix(f"{path}: ")
            assert message.startswith(("content hash ", "map file format ", "not a readable map file ("))
            refused += 1
    assert refused > 80


def resaved(source: Path, target: Path, **attributes) -> Path:
    """The file with other attributes; None removes one."""
    with xr.open_dataset(source) as data:
        loaded = data.load()
    loaded.attrs = {k: v for k, v in {**loaded.attrs, **attributes}.items() if v is not None}
    loaded.to_netcdf(target, engine="scipy", format="NETCDF3_64BIT")
    return target


def test_other_format_is_refused_with_the_command_that_builds_the_map(saved, tmp_path):
    assert_same(load_map(resaved(saved, tmp_path / "same.nc"), GD4008), load_map(saved, GD4008))
    for version in (store.FILE_FORMAT - 1, store.FILE_FORMAT + 1):
        other = resaved(saved, tmp_path / "other.nc", format_version=version)
        for load in (load_map, load_contact_map):
            message = refusal(other, load=load)
            assert message.startswith(
                f"map file format {version}; expected {store.FILE_FORMAT}: build it with "
            )
            assert "python -m ballscrew_tehl map build" in message
    for attribute in ("format_version", "content_hash", "header"):
        message = refusal(resaved(saved, tmp_path / "other.nc", **{attribute: None}))
        assert "not a readable map file" in message
        assert attribute in message


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ("screw", "ball_diameter", 4.764e-3),
        ("screw", "contact_angle", 0.786),
        ("solid", "density", 7800.0),
        ("lubricant", "viscosity", 0.033 * (1.0 + 1e-11)),
        ("friction", "hysteresis_coefficient", 0.011),
        ("friction", "reference_slip", 0.03),
        ("published_speeds", "reference_speed", 300.0),
    ],
)
def test_map_of_another_screw_is_refused(saved, table, key, value):
    found, other = getattr(getattr(GD4008, table), key), changed(GD4008, **{table: {key: value}})
    for load in (load_map, load_contact_map):
        assert refusal(saved, other, load) == (
            f"map of other parameters: {table}.{key} = {found}; expected {value}: build a map for this screw"
        )


def test_map_of_a_double_nut_is_not_that_of_a_single_one(saved, law_map):
    """Nor the other way round: the preload kind enters the identity where it is no double nut."""
    for path, screw in ((saved, GD4008), (law_map, LAW)):
        for kind in ("single_nut_offset", "single_nut_oversize_ball"):
            single = changed(screw, screw={"preload_kind": kind})
            assert "screw.preload_kind" in refusal(path, single)
            assert identity.parameters_hash(single) != identity.parameters_hash(screw)
    assert "preload_kind" not in identity.map_parameters_json(GD4008)


def test_rounding_range_and_spelling_are_no_other_screw(saved):
    near = changed(GD4008, screw={"lead_angle": math.nextafter(GD4008.screw.lead_angle, 1.0)})
    narrow = changed(GD4008, map={"preload_min": 500.0, "preload_max": 3000.0})
    for other in (near, narrow):
        assert load_map(saved, other).header["file_hash"] == load_map(saved, GD4008).header["file_hash"]
    screw = GD4008.model_dump(exclude_unset=True)["screw"]
    screw["return_ball_count"] = screw["ball_count"] - screw.pop("loaded_ball_count")
    by_returns = type(GD4008).model_validate(GD4008.model_dump(exclude_unset=True) | {"screw": screw})
    assert identity.map_parameters_json(by_returns) == identity.map_parameters_json(GD4008)


def test_without_a_map_the_message_says_what_to_do():
    other = changed(GD4008, screw={"ball_diameter": 4.764e-3})
    for parameters in (other, film_parameters(GD4008)):
        with pytest.raises(
            MapError, match=f"no packaged map fits {GD4008.name} with {GD4008.lubricant.name}"
        ) as error:
            load_map(None, parameters)
        assert "map build" in str(error.value)
        assert "--direct" in str(error.value)


def test_friction_set_of_another_film_is_refused(saved):
    friction = replace(default_friction_set(GD4008), film_model="mechanistic")
    with pytest.raises(
        MapError, match=r"needs the film mechanistic; the map .* published holds solved, solved_thermal"
    ):
        load_map(saved, GD4008, friction)


# --- written completely or not at all ---


def test_full_disk_or_no_right_keeps_the_older_map_and_is_named(saved, tmp_path, monkeypatch):
    """The limit of the size of a file stands for a full disk."""
    resource = pytest.importorskip("resource")
    path, content = tmp_path / "a" / "map.nc", saved.read_bytes()
    save_map(str(path), small_map(), CERTIFICATE)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    for share in (0.01, 0.99):
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(share * len(content)), before[1]))
        try:
            with pytest.raises(OSError, match=r"map\.nc"):
                save_map(path, small_map(), {})
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    def refuse(source, target):
        assert Path(source).stat().st_size > 1000
        raise OSError(13, "no permission")

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", refuse)
        with pytest.raises(OSError, match="no permission"):
            save_map(path, small_map(), {})
    assert list(path.parent.iterdir()) == [path]
    assert path.read_bytes() == content
    save_map(path, small_map(), {})
    assert path.read_bytes() != content


@pytest.mark.slow
def test_reading_needs_neither_writer_nor_solver(saved):
    code = (
        "import sys; from ballscrew_tehl.nut_map.file import load_map, load_contact_map;"
        "from ballscrew_tehl.parameters.file import load_parameters; p = load_parameters();"
        "torque = load_map(sys.argv[1], p).evaluate(2000.0, 100.0, 303.0).viscous_torque;"
        "early = {'ballscrew_tehl.contact', 'scipy.stats', 'scipy.spatial'} & set(sys.modules);"
        # needs the closed formula of the contacts, but not their solver
        "film = load_contact_map(sys.argv[1], p).evaluate('nut', 'thermal_central_film', [30.0], 99.0, 303.0);"
        "assert torque > 0.0 and film > 0.0;"
        "print(*early, *{'xarray', 'numba', 'pandas', 'matplotlib', 'rich'} & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code, str(saved)], capture_output=True, text=True, check=True)
    assert run.stdout.split() == []


# --- certificate ---


def test_deviation_is_that_of_torque_and_shown_films_from_direct_solves(saved, monkeypatch):
    """Contacts in closed form; torque by the speeds of the map, films by those of rolling balls, 3 % thicker here."""
    monkeypatch.setattr(direct, "solve_ball", closed_ball)
    nut_map, friction = load_map(saved, GD4008), default_friction_set(GD4008)
    for point in operating_points(nut_map, 4).tolist():
        found = certificate.deviation_at(nut_map, GD4008, tuple(point))
        assert 0.0 < found.torque <= 2e-3
        # films of the lightest ball by the closed formula, see mean_ball_state
        assert found.film <= 0.05
        assert found.temperature_rise <= 0.15
        torque = double_nut_torque(GD4008, friction, ClosedFilm(GD4008, True), *point).total
        state = nut_map.evaluate(*point)
        assert found.torque == pytest.approx(abs(state.friction_torque / torque - 1.0), abs=1e-3)
    point = (2000.0, 50.0, 303.15, 0.0)
    state = nut_map.evaluate(*point)
    thicker = direct.DirectState(
        float(state.friction_torque) / 1.01, state.film_thickness_central_screw,
        state.film_thickness_central_nut / 1.03, state.film_temperature_rise + 0.5,
    )  # fmt: skip
    monkeypatch.setattr(direct, "mean_ball_state", lambda *arguments: thicker)
    rise = 0.5 / max(thicker.film_temperature_rise, 1.0)
    assert certificate.deviation_at(nut_map, GD4008, point) == pytest.approx((0.01, 0.03, rise), rel=1e-9)


def test_certificate_counts_its_points_by_region_and_leaves_out_those_without_solution(saved, monkeypatch):
    nut_map, count, order = load_map(saved, GD4008), 40, []
    points = operating_points(nut_map, count).tolist()
    axes = nut_map.header["axes"]
    for point in points:
        assert max(point[0] + abs(point[3]), point[0]) <= axes["force"][1] * (1.0 + 1e-12)
        assert all(
            low <= value <= high
            for value, (low, high, _) in zip(
                point, (axes["preload"], axes["speed"], axes["temperature"]), strict=False
            )
        )
    assert [point[3] != 0.0 for point in points] == [k % 2 == 1 for k in range(count)]

    def row(nut_map, parameters, point):
        order.append(point)
        lost = list(point) in points and points.index(list(point)) % 10 == 3
        return (
            certificate.NOT_SOLVED if lost else Deviation(1e-6 * point[0], 2e-6 * point[0], 3e-6 * point[0])
        )

    monkeypatch.setattr(certificate, "deviation_at", row)
    found = deviation_from_direct(nut_map, GD4008, count)
    kept = [point for k, point in enumerate(points) if k % 10 != 3]
    errors = 1e-6 * np.array(kept)[:, 0]
    assert (found["points"], found["points_not_solved"]) == (36, 4)
    for k, name in enumerate(Deviation._fields):
        for key, expected in (
            ("mean", errors.mean()),
            ("50", np.median(errors)),
            ("99", np.quantile(errors, 0.99)),
            ("999", np.quantile(errors, 0.999)),
            ("max", errors.max()),
        ):
            assert found[f"{name}_error_{key}"] == pytest.approx((k + 1) * expected, rel=1e-12)
    assert {name: region["points"] for name, region in found["regions"].items()} == {
        "preload alone": 20, "axial load": 16, "below the lowest speed": 2
    }  # fmt: skip
    slow = [point for point in order if point[1] < axes["speed"][0]]
    assert found["regions"]["below the lowest speed"]["torque_error_max"] == 1e-6 * max(p[0] for p in slow)
    for name, column in zip(POINT, np.array(kept).T, strict=True):
        assert found["each"][name] == pytest.approx(column, rel=1e-5)
    assert found["each"]["film_error"] == pytest.approx(2.0 * errors, rel=1e-2)
    monkeypatch.setattr(certificate, "deviation_at", lambda *_: certificate.NOT_SOLVED)
    with pytest.raises(ArithmeticError, match="none of 2 points"):
        deviation_from_direct(nut_map, GD4008, 2)


# --- band of the mechanistic law ---


def test_band_is_the_interval_at_its_point_and_follows_the_constants(law_map, monkeypatch):
    nut_map, contacts = load_map(law_map, LAW), load_contact_map(law_map, LAW)
    header, axes, friction = nut_map.header, nut_map.header["axes"], default_friction_set(LAW)
    band, point = header[BAND], band_point(axes)
    assert tuple(band[name] for name in ("preload", "speed", "temperature")) == point
    found = map_interval(LAW, contacts, axes, friction, *point)
    assert (band["low"], band["high"]) == pytest.approx(found.relative, rel=1e-12)
    assert band["fitted"] is True
    own = changed(LAW, friction={"boundary_friction": 0.1, "replenishment_constant": 0.0})
    other = load_map(law_map, own)
    assert (band["low"], band["high"]) != (other.header[BAND]["low"], other.header[BAND]["high"])
    flooded, starved = (
        float(each.evaluate(2000.0, 50.0, 303.15).viscous_torque) for each in (other, nut_map)
    )
    assert flooded >= 1.005 * starved
    # the packaged number was fitted with the constants of its own screw file
    assert other.header[BAND]["fitted"] is False
    # torque within the error of the spline through the nodes of this small map, also with the constants of the screw
    for parameters, table in ((LAW, nut_map), (own, other)):
        zero = zero_fitted(parameters)
        for axial in (0.0, 800.0):
            state = table.evaluate(2000.0, 50.0, 303.15, axial, *zero.values[:2])
            found = map_interval(parameters, contacts, axes, zero, 2000.0, 50.0, 303.15, axial)
            assert found.torque == pytest.approx(float(state.friction_torque), rel=2e-3)
            assert found.low < found.torque < found.high
    # beyond the axes the nearest point counts
    ends = map_interval(LAW, contacts, axes, friction, 1e6, 1e5, 500.0)
    assert ends == map_interval(
        LAW, contacts, axes, friction, GRID.force[1], GRID.speed[1], GRID.temperature[1]
    )
    # the stored one is taken as long as the numbers are those of the build
    monkeypatch.setattr(store, "band", None)
    assert load_map(law_map, LAW).header[BAND] == band
    assert BAND not in load_map(None, GD4008).header
    assert packaged_map(VG100).exists()
