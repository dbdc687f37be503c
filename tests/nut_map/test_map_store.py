"""The map file: complete or refused in one line, written completely or not at all, readable by xarray."""

import hashlib
import json
import math
import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from reference_screw import GD4008
from scipy.io import netcdf_file
from synthetic_contacts import GRID, closed_build, partly_failed_contact, same_contacts, small_map

from ballscrew_tehl.friction.sets import default_friction_set, load_friction_sets
from ballscrew_tehl.nut_map import build, kriging
from ballscrew_tehl.nut_map import file as store
from ballscrew_tehl.nut_map.contact_map import ContactMap
from ballscrew_tehl.nut_map.contacts import MAPPED, POINTS, QUANTITIES
from ballscrew_tehl.nut_map.file import load_contact_map, load_map, packaged_map, save_map
from ballscrew_tehl.parameters import identity
from ballscrew_tehl.parameters.file import changed, graded_oil
from ballscrew_tehl.physics.hertz import RACEWAYS
from ballscrew_tehl.refinement.refine import map_parameters
from ballscrew_tehl.runtime.packed import FILM_SHEAR, FORCE_CURVES, SURFACES, MapError

PACKAGED = ["published"]
CERTIFICATE = {"points": 3, "torque_error_max": 5e-4}


@pytest.fixture(scope="module")
def saved(tmp_path_factory) -> Path:
    """A small map of the packaged screw, saved."""
    path = tmp_path_factory.mktemp("map") / "small.nc"
    save_map(path, small_map(), CERTIFICATE)
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
    assert a.arrays.keys() == b.arrays.keys()
    for name in a.arrays:
        np.testing.assert_array_equal(a.arrays[name], b.arrays[name])


# --- the packaged maps ---


def test_the_default_kinematics_has_its_packaged_map():
    assert GD4008.friction.kinematics in PACKAGED
    assert load_map(None, GD4008).header["kinematics"] == GD4008.friction.kinematics


@pytest.mark.parametrize("kinematics", PACKAGED)
def test_packaged_map_is_finite_over_its_whole_range(kinematics):
    parameters = changed(GD4008, friction={"kinematics": kinematics})
    nut_map = load_map(None, parameters)
    assert nut_map.header["kinematics"] == kinematics
    assert nut_map.header["film_model"] == default_friction_set(parameters).film_model
    assert nut_map.law == FILM_SHEAR
    assert nut_map.defaults == (*default_friction_set(parameters).values, 1.0)
    rng = np.random.default_rng(7)
    axes = nut_map.header["axes"]
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


# --- writing and reading ---


@pytest.mark.slow
@pytest.mark.parametrize("film", store.FILM_MODELS[:2])
def test_map_of_the_film_model_of_the_friction_set_is_read_back(saved, monkeypatch, film):
    """Both film models are in the file; extremes and force curves are common to both."""
    friction = next(entry for entry in load_friction_sets().values() if entry.film_model == film)
    monkeypatch.setattr(store, "default_friction_set", lambda parameters: friction)
    nut_map = load_map(saved, GD4008)
    assert nut_map.header["film_model"] == film
    assert nut_map.defaults == (*friction.values, 1.0)
    for name, array in small_map().arrays[film].items():
        np.testing.assert_array_equal(nut_map.arrays[name], array)
    thermal, isothermal = (
        small_map().arrays[name]["coefficients"] for name in reversed(store.FILM_MODELS[:2])
    )
    assert (np.abs(thermal - isothermal)[..., : store.VISCOUS_COLUMNS].max(axis=(0, 1, 2)) > 0.01).all()


@pytest.mark.parametrize("share", [0.01, 0.5, 0.99])
def test_full_disk_keeps_the_older_map_and_is_named(saved, tmp_path, share):
    """The limit of the size of a file stands for a full disk."""
    resource = pytest.importorskip("resource")
    path, content = tmp_path / "map.nc", saved.read_bytes()
    path.write_bytes(content)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(share * len(content)), before[1]))
    try:
        with pytest.raises(OSError, match=r"map\.nc"):
            save_map(path, small_map(), CERTIFICATE)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert [file.name for file in tmp_path.iterdir()] == ["map.nc"]
    assert path.read_bytes() == content


def test_header_holds_the_input_of_the_map(saved):
    header = load_map(saved, GD4008).header
    text = header["parameters_json"]
    assert header["certificate"] == CERTIFICATE
    assert text == identity.map_parameters_json(GD4008)
    assert hashlib.sha256(text.encode()).hexdigest().startswith(header["parameters_hash"])
    assert header["axes"]["speed"] == list(GRID.speed)
    with xr.open_dataset(saved) as data:
        assert header["version"] in data.attrs["source"]


def test_later_fields_keep_old_maps_valid():
    """The text for GD4008 is that of the packaged maps; a new field enters only where it differs."""
    content = json.loads(identity.map_parameters_json(GD4008))
    for table, names in {
        "screw": ("preload_kind", "return_ball_count"),
        "lubricant": ("iso_vg", "viscosity_index", "density_15c"),
        "friction": ("raceway_rq", "ball_rq"),
    }.items():
        assert not set(names) & set(content[table])
    for kinematics in ("published", "rolling_frame"):
        parameters = changed(GD4008, friction={"kinematics": kinematics})
        with xr.open_dataset(store.packaged_map(kinematics)) as data:
            text = json.loads(data.attrs["header"])["parameters_json"]
        assert text == identity.map_parameters_json(parameters)
    offset = changed(GD4008, screw={"preload_kind": "single_nut_offset"})
    assert json.loads(identity.map_parameters_json(offset))["screw"]["preload_kind"] == "single_nut_offset"


def test_spelling_of_parameters_is_not_part_of_a_map():
    content = GD4008.model_dump(exclude_unset=True)
    content["lubricant"] = graded_oil(68, 95.0).model_dump(exclude_unset=True)
    by_grade = type(GD4008).model_validate(content)
    oil = by_grade.lubricant.model_dump()
    numbers = {name: value for name, value in oil.items() if name not in identity.GIVEN_BY["lubricant"]}
    del numbers["viscosity"]
    by_numbers = type(GD4008).model_validate(content | {"lubricant": numbers})
    assert identity.map_parameters_json(by_numbers) == store.map_parameters_json(by_grade)
    # the parameters of a map's header are complete
    text = identity.map_parameters_json(by_grade)
    assert identity.map_parameters_json(map_parameters({"parameters_json": text})) == text
    screw = GD4008.model_dump(exclude_unset=True)["screw"]
    screw["return_ball_count"] = screw["ball_count"] - screw.pop("loaded_ball_count")
    by_returns = type(GD4008).model_validate(GD4008.model_dump(exclude_unset=True) | {"screw": screw})
    assert identity.map_parameters_json(by_returns) == store.map_parameters_json(GD4008)


def test_range_of_a_screw_file_is_not_part_of_a_map(saved):
    """It is in the header: a map stays valid for a screw file that asks for another one."""
    narrow = changed(GD4008, map={"preload_min": 500.0, "preload_max": 3000.0})
    assert identity.map_parameters_json(narrow) == identity.map_parameters_json(GD4008)
    assert identity.parameters_hash(narrow) == identity.parameters_hash(GD4008)
    assert_same(load_map(saved, narrow), load_map(saved, GD4008))


def test_contact_map_is_read_back(saved):
    found, given = load_contact_map(saved, GD4008), small_map().contact_map
    same_contacts(found, given)
    assert found.cell == given.cell
    assert load_map(saved, GD4008).header["contact_cell"] == list(given.cell)
    rng = np.random.default_rng(1)
    for raceway in RACEWAYS:
        for name in MAPPED:
            point = (raceway, name, rng.uniform(7.0, 200.0, 5), 100.0, 300.0)
            np.testing.assert_array_equal(found.evaluate(*point), given.evaluate(*point))
    other = changed(GD4008, lubricant={"viscosity": 0.034})
    assert "lubricant.viscosity" in refusal(saved, other, load_contact_map)


def test_contacts_that_were_not_solved_are_read_back(tmp_path, monkeypatch):
    monkeypatch.setattr(build, "UNCERTAIN", math.inf)
    built = closed_build(solve=partly_failed_contact)
    path = tmp_path / "x.nc"
    save_map(path, built, {})
    found = load_contact_map(path, GD4008)
    same_contacts(found, built.contact_map)
    lost = sum(int((~contacts.good).sum()) for contacts in found.contacts.values())
    assert lost == load_map(path, GD4008).header["contacts_not_solved"] >= 4
    # NaN is part of the content that is hashed
    assert save_map(tmp_path / "y.nc", built, {}) == load_map(path, GD4008).header["file_hash"]


def test_lengths_of_the_kriging_are_read_not_searched(saved, monkeypatch):
    def refuse(self):
        raise AssertionError("searched")

    monkeypatch.setattr(kriging.Kriging, "_most_likely", refuse)
    found = load_contact_map(saved, GD4008)
    header = load_map(saved, GD4008).header["kriging"]
    for raceway in RACEWAYS:
        assert set(header[raceway]) == set(MAPPED)
        for name in MAPPED:
            lengths = found.models[raceway].kriging(name).hyper
            assert lengths.tolist() == header[raceway][name]
    # those of other coordinates are not taken, and without those of the file they would be searched
    monkeypatch.setattr(store, "INTERPOLATION", store.INTERPOLATION + 1)
    with pytest.raises(AssertionError, match="searched"):
        load_contact_map(saved, GD4008).evaluate("nut", "temperature_rise", np.array([30.0]), 30.0, 303.0)
    bare = ContactMap(GD4008, found.range, found.contacts)
    with pytest.raises(AssertionError, match="searched"):
        bare.evaluate("nut", "temperature_rise", np.array([30.0]), 30.0, 303.0)


@pytest.mark.slow
def test_same_map_same_bytes(saved, tmp_path):
    again = save_map(tmp_path / "again.nc", closed_build(), CERTIFICATE)
    other = save_map(tmp_path / "other.nc", small_map(), {**CERTIFICATE, "points": 4})
    assert (tmp_path / "again.nc").read_bytes() == saved.read_bytes()
    assert again == load_map(saved, GD4008).header["file_hash"] != other


def test_file_is_self_describing_in_xarray(saved):
    with xr.open_dataset(saved) as data:
        assert data.attrs["title"] == "Nut map of GD4008-3, kinematics published"
        assert json.loads(data.attrs["header"])["kinematics"] == "published"
        units = {"load": "N", "speed": "rad s-1", "temperature": "K"}
        assert units == POINTS
        for raceway in RACEWAYS:
            contacts = small_map().contact_map.contacts[raceway]
            columns = dict(zip(POINTS, contacts.points.T, strict=True)) | dict(contacts.values)
            for name, unit in (POINTS | QUANTITIES).items():
                variable = data[f"{raceway}_contact_{name}"]
                assert variable.dims == (f"{raceway}_contact",)
                assert variable.attrs["units"] == unit
                assert raceway in variable.attrs["long_name"]
                np.testing.assert_array_equal(variable, columns[name])
        assert all(variable.attrs["long_name"] for variable in data.variables.values())
        titles = [data[name].attrs["long_name"] for name in data if name.endswith("coefficients_solved")]
        titles += [data[f"{name}_coefficients"].attrs["long_name"] for name in ("extreme", "force")]
        columns = [title.split(": ")[1].split(", ") for title in titles]
        assert columns == [list(SURFACES[FILM_SHEAR][:4]), list(SURFACES[FILM_SHEAR][4:]), list(FORCE_CURVES)]
        assert data["extreme_coefficients"].shape[-1] == len(columns[1])


# --- refused ---


def test_missing_file_is_named(tmp_path):
    assert refusal(tmp_path / "none.nc").startswith(
        "no such map file: build it with python -m ballscrew_tehl"
    )
    assert "not a readable map file" in refusal(tmp_path)


@pytest.mark.parametrize("share", [0.0, 1e-5, 0.004, 0.02, 0.1, 0.5, 0.9, 0.99995, 1.0])
def test_truncated_file_is_refused(saved, tmp_path, share):
    whole = saved.read_bytes()
    path = tmp_path / "cut.nc"
    path.write_bytes(whole[: min(int(share * len(whole)), len(whole) - 1)])
    assert "not a readable map file" in refusal(path)


def flipped(path: Path, whole: bytes, place: int, bit: int) -> Path:
    path.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << bit]) + whole[place + 1 :])
    return path


@pytest.mark.slow
def test_flipped_bits_are_refused_or_change_nothing(saved, tmp_path):
    """Titles, names of dimensions and padding may change: no number comes from them."""
    whole, good = saved.read_bytes(), load_map(saved, GD4008)
    rng = np.random.default_rng(11)
    places = np.concatenate([rng.integers(0, len(whole), 150), rng.integers(0, 9000, 150)])
    refused = []
    for place in places.tolist():
        path = flipped(tmp_path / "flipped.nc", whole, place, int(rng.integers(8)))
        try:
            found = load_map(path, GD4008)
        except MapError as error:
            refused.append(str(error).removeprefix(f"{path}: "))
        else:
            assert_same(found, good)
    assert len(refused) > 200
    for message in refused:
        assert message.startswith(("content hash ", "map file format ", "not a readable map file ("))
        assert "\n" not in message


@pytest.mark.slow
@pytest.mark.parametrize("kinematics", PACKAGED)
def test_flipped_bits_of_a_packaged_map_are_refused(tmp_path, kinematics):
    whole = packaged_map(kinematics).read_bytes()
    with netcdf_file(packaged_map(kinematics), "r", mmap=False) as file:
        values = [variable[...].tobytes() for variable in file.variables.values()]
    rng = np.random.default_rng(5)
    parameters = changed(GD4008, friction={"kinematics": kinematics})
    for value in values:
        # every variable, somewhere in its data
        place = whole.index(value[:64]) + int(rng.integers(len(value)))
        path = flipped(tmp_path / "flipped.nc", whole, place, int(rng.integers(8)))
        message = refusal(path, parameters)
        assert message.startswith("content hash ")
        assert "; expected " in message


@pytest.mark.parametrize("attribute", ["header", "content_hash"])
def test_flipped_bits_in_header_or_hash_are_refused(saved, tmp_path, attribute):
    whole = saved.read_bytes()
    with xr.open_dataset(saved) as data:
        text = data.attrs[attribute].encode()
    begin = whole.index(text)
    rng = np.random.default_rng(2)
    for place in [0, len(text) - 1, *rng.integers(len(text), size=40).tolist()]:
        message = refusal(flipped(tmp_path / "flipped.nc", whole, begin + place, int(rng.integers(8))))
        assert "; expected " in message or "not a readable map file" in message


def resaved(source: Path, target: Path, **attributes) -> Path:
    """The file with other attributes; None removes one."""
    with xr.open_dataset(source) as data:
        loaded = data.load()
    loaded.attrs = {k: v for k, v in {**loaded.attrs, **attributes}.items() if v is not None}
    loaded.to_netcdf(target, engine="scipy", format="NETCDF3_64BIT")
    return target


@pytest.mark.parametrize("version", [1, store.FILE_FORMAT - 1, store.FILE_FORMAT + 1])
def test_other_format_version_is_refused_with_the_command_that_builds_the_map(saved, tmp_path, version):
    assert_same(load_map(resaved(saved, tmp_path / "same.nc"), GD4008), load_map(saved, GD4008))
    other = resaved(saved, tmp_path / "other.nc", format_version=version)
    for load in (load_map, load_contact_map):
        message = refusal(other, load=load)
        assert message.startswith(f"map file format {version}; expected {store.FILE_FORMAT}: build it with ")
        assert "python -m ballscrew_tehl map build" in message


@pytest.mark.parametrize("attribute", ["format_version", "content_hash", "header"])
def test_missing_attribute_is_refused(saved, tmp_path, attribute):
    message = refusal(resaved(saved, tmp_path / "other.nc", **{attribute: None}))
    assert "not a readable map file" in message
    assert attribute in message


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [
        ("screw", "ball_diameter", 4.764e-3),
        ("screw", "ball_count", 85),
        ("screw", "contact_angle", 0.786),
        ("solid", "density", 7800.0),
        ("lubricant", "viscosity", 0.033 * (1.0 + 1e-11)),
        ("lubricant", "viscosity_law", "roelands_printed"),
        ("friction", "hysteresis_coefficient", 0.011),
        ("friction", "reference_slip", 0.03),
        ("friction", "kinematics", "rolling_frame"),
        ("published_speeds", "reference_speed", 300.0),
    ],
)
def test_map_of_another_screw_is_refused(saved, table, key, value):
    found = getattr(getattr(GD4008, table), key)
    message = refusal(saved, changed(GD4008, **{table: {key: value}}))
    assert message == (
        f"map of other parameters: {table}.{key} = {found}; expected {value}: build a map for this screw"
    )


def test_rounding_of_a_converted_unit_is_no_other_screw(saved):
    near = changed(GD4008, screw={"lead_angle": math.nextafter(GD4008.screw.lead_angle, 1.0)})
    assert load_map(saved, near).header["file_hash"] == load_map(saved, GD4008).header["file_hash"]


def test_without_a_map_the_message_says_what_to_do(saved):
    other = changed(GD4008, screw={"ball_diameter": 4.764e-3})
    with pytest.raises(MapError) as error:
        load_map(None, other)
    text = str(error.value)
    assert text.startswith(
        f"no packaged map fits {other.name} with {other.lubricant.name} (screw.ball_diameter = 0.004764"
    )
    assert "--direct" in text
    assert "map build" in text


def test_map_of_another_name_or_without_a_table_is_refused(saved):
    assert "name = GD4008-3; expected other: " in refusal(saved, GD4008.model_copy(update={"name": "other"}))
    bare = GD4008.model_copy(update={"published_speeds": None})
    assert "published_speeds = {" in refusal(saved, bare)


@pytest.mark.parametrize(
    "friction",
    [
        {"apparent_viscosity_ratio": 3.0},
        {"net_sliding_coefficient": 0.001, "roughness_height": 1e-8},
        {"sliding_coefficient": 0.2},
        {"spin_split": 1.0},
        {"set": "two_parameter"},
    ],
    ids=lambda friction: "+".join(friction),
)
def test_map_holds_for_every_friction_set(saved, friction):
    """Fitted friction parameters are only defaults in the header; the build does not use them."""
    parameters = changed(GD4008, friction=friction)
    found, usual = load_map(saved, parameters), load_map(saved, GD4008)
    assert found.defaults == (*default_friction_set(parameters).values, 1.0)
    assert (found.defaults == usual.defaults) == (
        not friction.keys().isdisjoint(("sliding_coefficient", "spin_split"))
    )
    for name, value in friction.items():
        assert found.header["defaults"].get(name, value) == value
    # a set may be fitted with the other film model: both are in the file
    for name, array in small_map().arrays[found.header["film_model"]].items():
        np.testing.assert_array_equal(found.arrays[name], array)
    if "set" not in friction:
        point = (2000.0, 100.0, 303.0, 500.0)
        assert found.evaluate(*point) == usual.evaluate(*point, *found.defaults)


def test_friction_set_of_another_film_is_refused(saved, monkeypatch):
    friction = replace(default_friction_set(GD4008), film_model="hamrock_dowson")
    monkeypatch.setattr(store, "default_friction_set", lambda parameters: friction)
    message = refusal(saved)
    assert "film hamrock_dowson" in message
    assert f"expected one of {', '.join(store.FILM_MODELS)}" in message


class Harmful:
    """Creates a file when it is unpickled."""

    done = False

    def __reduce__(self):
        return (setattr, (Harmful, "done", True))


def test_nothing_is_unpickled(saved, tmp_path, monkeypatch):
    path = tmp_path / "pickled.nc"
    path.write_bytes(pickle.dumps(Harmful()))
    assert "not a readable map file" in refusal(path)
    assert not Harmful.done
    pickle.loads(path.read_bytes())
    assert Harmful.done

    def refuse(*_, **__):
        raise AssertionError("unpickled")

    for name in ("load", "loads", "Unpickler"):
        monkeypatch.setattr(pickle, name, refuse)
    assert load_map(saved, GD4008).header["certificate"] == CERTIFICATE


# --- written completely or not at all ---


def failing_write(self, path, **_):
    Path(path).write_bytes(b"CDF\x02 half")
    raise OSError("no space left on device")


def failing_rename(source, target):
    assert Path(source).stat().st_size > 1000
    raise OSError("no permission")


@pytest.mark.parametrize(
    ("place", "name", "failure"),
    [(xr.Dataset, "to_netcdf", failing_write), (os, "replace", failing_rename)],
    ids=["write", "rename"],
)
@pytest.mark.parametrize("old", [b"the old map", None], ids=["over_old", "new"])
def test_failed_write_keeps_the_old_file(tmp_path, monkeypatch, place, name, failure, old):
    path = tmp_path / "map.nc"
    if old is not None:
        path.write_bytes(old)
    monkeypatch.setattr(place, name, failure)
    with pytest.raises(OSError, match="no "):
        save_map(path, small_map(), CERTIFICATE)
    assert sorted(tmp_path.iterdir()) == ([path] if old is not None else [])
    if old is not None:
        assert path.read_bytes() == old


def test_save_makes_the_folder_and_replaces_the_old_file(tmp_path):
    path = tmp_path / "a" / "b" / "map.nc"
    save_map(str(path), small_map(), {})
    digest = save_map(path, small_map(), CERTIFICATE)
    assert load_map(path, GD4008).header["file_hash"] == digest
    assert list(path.parent.iterdir()) == [path]


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
        "print(*early, *{'xarray', 'numba', 'pandas', 'matplotlib', 'rich', 'pickle5', 'ballscrew_tehl.contact'}"
        " & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code, str(saved)], capture_output=True, text=True, check=True)
    assert run.stdout.split() == []


@pytest.mark.parametrize("kinematics", PACKAGED)
def test_relieved_nut_is_in_range_far_below_the_lowest_preload(kinematics):
    nut_map = load_map(None, changed(GD4008, friction={"kinematics": kinematics}))
    axes = nut_map.header["axes"]
    lowest = axes["preload"][0]
    assert axes["force"][0] <= 0.1 * lowest
    assert nut_map.evaluate(lowest, 50.0, 303.0, 1.5 * lowest).in_range
    below = nut_map.evaluate(0.9 * lowest, 50.0, 303.0)
    assert (below.in_range, below.clamped) == (False, ("preload",))
    assert nut_map.evaluate(np.array([0.9, 1.0]) * lowest, 50.0, 303.0).in_range.tolist() == [False, True]
