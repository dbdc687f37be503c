"""Location of the map of the native FMUs: unusual and long folder names, URI and path, missing map."""

import os
import shutil
from pathlib import Path
from urllib.parse import quote

import pytest
from native_library import CS, ERROR, ME, NUT_MAP, OK, TOKEN, WARNING, NativeInstance, compiled
from synthetic_map import make_map

from ballscrew_fmu.native_fmu.map_file import MAP_FILE, map_bytes
from ballscrew_tehl.runtime.packed import MECHANISTIC, FrictionParameters

pytestmark = pytest.mark.slow

NAMES = [
    "with space", "m\u00fc\u00df \u00c4\u00d6\u00dc", "a+b", "sharp#1", "[brackets]", "per%20cent", "100%",
    "%41", "a&b;c=d", "semi'quote\"", "query?x", "back\\slash", "\u6ede\u73e0\u4e1d\u6760", "emoji\U0001f529",
    "tilde~", "%zz", "%", "dot.", " lead", "n" * 255, "\u00e4" * 127,
]  # fmt: skip
FORMS = {
    "file:///": lambda path: "file://" + quote(path),
    "file://localhost/": lambda path: "file://localhost" + quote(path),
    "file:/": lambda path: "file:" + quote(path),
    "upper case": lambda path: "FILE://LOCALHOST" + quote(path),
    "lower case escapes": lambda path: "file://" + quote(path).replace("%C3", "%c3").replace("%5B", "%5b"),
    "all escaped": lambda path: "file://" + "".join("/" if c == 47 else f"%{c:02X}" for c in path.encode()),
    "slash behind": lambda path: "file://" + quote(path) + "/",
}


def put_map(folder: Path, content: bytes | None = None) -> Path:
    folder.mkdir(parents=True)
    if content is None:
        shutil.copy(compiled(2).parent / MAP_FILE, folder)
    else:
        (folder / MAP_FILE).write_bytes(content)
    return folder


def loads(version, resources, kind=CS):
    """Whether an instance is created; otherwise there is one message, of status error."""
    with NativeInstance(version, kind, resources=str(resources)) as one:
        if one.handle is None:
            assert [message.status for message in one.messages] == [3]
        else:
            one.start() if kind == CS else None
        return one.handle is not None


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_uris_of_odd_folders(tmp_path, name, form):
    assert loads(2, FORMS[form](str(put_map(tmp_path / name / "resources"))))


@pytest.mark.parametrize("name", NAMES, ids=range(len(NAMES)))
def test_paths_of_odd_folders(tmp_path, name):
    """FMI 3: nothing is decoded. FMI 2: a location that is not a URI is a path."""
    folder = put_map(tmp_path / name / "resources")
    assert loads(3, f"{folder}/")
    assert loads(3, folder, ME)
    assert loads(2, folder)
    assert loads(3, f"{folder}/../resources")


def test_fmi3_does_not_accept_a_uri(tmp_path):
    assert not loads(3, FORMS["file:///"](str(put_map(tmp_path / "resources"))))


@pytest.mark.parametrize("version", [2, 3])
def test_a_path_is_decoded_once(tmp_path, version):
    """Folders 'a b' and 'a%20b' in one place: each is found only by its own name."""
    put_map(tmp_path / "a b")
    damaged = put_map(tmp_path / "a%20b", b"nothing")
    text = str(damaged) if version == 3 else "file://" + quote(str(damaged))
    assert not loads(version, text)
    assert loads(version, tmp_path / "a b" if version == 3 else f"file://{tmp_path}/a%20b")


@pytest.mark.parametrize("version", [2, 3])
def test_long_paths(tmp_path, version):
    """Up to the limit of the system; beyond it a refusal, not a crash."""
    deep, part, here = tmp_path, "long folder " + "x" * 180, os.getcwd()
    try:
        while len(str(deep / part / part)) < 4000:
            deep = deep / part
            deep.mkdir()
        put_map(deep / "resources")
        beyond = deep
        os.chdir(deep)
        while len(str(beyond)) < 4200:  # made step by step: the whole path is too long to name
            os.mkdir(part)
            os.chdir(part)
            beyond = beyond / part
        shutil.copy(compiled(2).parent / MAP_FILE, MAP_FILE)
    finally:
        os.chdir(here)
    assert len(str(deep)) > 3500
    assert loads(version, deep / "resources")
    assert not loads(version, beyond)
    assert not loads(version, "/" + "y" * 1_000_000)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("kind", [CS, ME])
def test_without_map_there_is_no_instance(tmp_path, version, kind):
    other = map_bytes(make_map(law=MECHANISTIC))
    good = map_bytes(NUT_MAP)
    cases = {
        "cannot be opened": tmp_path / "none",
        "friction law mechanistic, expected film_shear": put_map(tmp_path / "other", other),
        "truncated": put_map(tmp_path / "short", good[:-8]),
        "not a nut map": put_map(tmp_path / "empty", b""),
        "checksum": put_map(tmp_path / "damaged", good[:-1] + bytes([good[-1] ^ 1])),
    }
    folder = tmp_path / "folder"
    (folder / MAP_FILE).mkdir(parents=True)
    for found, place in [*cases.items(), ("cannot be", folder)]:
        with NativeInstance(version, kind, resources=str(place)) as one:
            assert one.handle is None, found
            assert found in one.last
    for nothing in ("file:", "file://", "file:///", "/", ".", "%"):
        assert not loads(version, nothing, kind)


@pytest.mark.parametrize("version", [2, 3])
def test_the_log_names_the_map(version):
    with NativeInstance(version) as one:
        assert one.opening == [
            (OK, "logAll", f"map {NUT_MAP.header['content_hash']}, film_shear friction law")
        ]
    with NativeInstance(version, logging=False) as one:
        assert one.opening == []


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("kind", [CS, ME])
def test_a_map_of_another_screw_replaces_that_in_the_resources(tmp_path, version, kind):
    """Results are those of the new map with the parameters of the model description, and a warning says so."""
    other = make_map(viscous_scale=2.0)
    folder = put_map(tmp_path / "other", map_bytes(other))
    with NativeInstance(version, kind, resources=str(folder)) as one, NativeInstance(version, kind) as built:
        new, old = (m.header["content_hash"][:12] for m in (other, NUT_MAP))
        assert [m.status for m in one.opening] == [OK, WARNING]
        assert f"map {new} replaces map {old}" in one.opening[1].text
        at = {"preload": 2500.0, "speed": 40.0, "temperature": 310.0, "axial_load": 500.0}
        for instance, nut_map in ((one, other), (built, NUT_MAP)):
            instance.start(**at)
            if kind == CS:
                assert instance.step(0.0, 1e-3) == OK
            expected = nut_map.evaluate(*at.values(), *FrictionParameters(**NUT_MAP.header["defaults"]))
            assert instance.get("viscous_torque")[0] == pytest.approx(expected.viscous_torque, rel=1e-12)
            assert instance.get("film_thickness_min")[0] == pytest.approx(
                expected.film_thickness_min, rel=1e-12
            )
        saved = one.serialize(one.save())
        assert other.header["content_hash"].encode() in saved
        assert built.deserialize(saved)[0] == ERROR
        assert f"this FMU has {TOKEN} and map {old}" in built.last
